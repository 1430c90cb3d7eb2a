//! How large the model discrepancy of a flight is, group by group of its basis.
//!
//! ```text
//! none               probability NONE
//! each group else    s ~ half-normal(USUAL_M_S)
//! ```
//! over a grid of sizes, in one linearisation at a fit that was made without the term. What would have to be larger than models are
//! usually wrong by is no discrepancy but an effect that nobody has named: it competes as a hypothesis
//! ([`crate::criticism::residual_tests`]), and here the sizes end.

use crate::ablation::is_on;
use crate::inference::posterior::Fit;
use crate::inference::projected_columns::ProjectedColumns;
use crate::likelihood::discrepancy::{GROUPS, Sizes};
use crate::likelihood::jacobian::ln_det;
use crate::likelihood::{Column, Problem};
use nalgebra::{DMatrix, DVector};

/// Probability that there is none.
pub(crate) const NONE: f64 = 0.5;
/// Scale of the half-normal prior of a size, m/s. Steady flight models of calibrated gliders leave 0.4 to 0.5 cm/s in all (Merckelbach et
/// al. 2010, Frajka-Williams et al. 2011), water motion and sensors in it: half of that is what may be the model's own; a guess.
pub(crate) const USUAL_M_S: f64 = 0.002;
/// Sizes that are tried, in that scale: to where its prior ends.
pub(crate) const USUAL_SIZES: [f64; 8] = [0.0, 0.15, 0.25, 0.4, 0.6, 0.9, 1.35, 2.0];

/// Weight of each of those sizes; they add up to one.
pub(crate) fn usual_weights() -> [f64; USUAL_SIZES.len()] {
    let weight = USUAL_SIZES.map(|s| (-0.5 * s * s).exp());
    let total: f64 = weight.iter().sum();
    weight.map(|w| w / total)
}

/// Log Bayes factor of normal amplitudes, each of its own scale, against none.
fn log_bayes(gram: &DMatrix<f64>, match_: &DVector<f64>, scale: &[f64]) -> f64 {
    let scaled = DVector::from_fn(scale.len(), |i, _| scale[i] * match_[i]);
    let whole = DMatrix::from_fn(scale.len(), scale.len(), |i, j| scale[i] * scale[j] * gram[(i, j)] + if i == j { 1.0 } else { 0.0 });
    whole.cholesky().map_or(f64::NEG_INFINITY, |c| 0.5 * scaled.dot(&c.solve(&scaled)) - 0.5 * ln_det(&c))
}

impl Problem<'_> {
    /// The most probable sizes of the term given a fit that was made without it, m/s.
    pub(crate) fn discrepancy_sizes_at(&self, fit: &Fit) -> Sizes {
        let columns: Vec<Column> = self.discrepancy.unit().iter().map(|z| self.column(0, z.clone())).collect();
        let Some(linearisation) = fit.linearisation().filter(|_| !columns.is_empty() && is_on("discrepancy")) else {
            return Sizes::default();
        };
        let projected = ProjectedColumns::new(&columns, &linearisation);
        let (gram, groups, weights) = (projected.gram(), self.discrepancy.groups(), usual_weights());
        let mut best = (NONE.ln(), Sizes::default());
        let steps = USUAL_SIZES.len();
        for at in 1..steps.pow(GROUPS.len() as u32) {
            let step: [usize; GROUPS.len()] = std::array::from_fn(|g| at / steps.pow(g as u32) % steps);
            // A group that the flight has no columns of has no size.
            if (0..GROUPS.len()).any(|g| step[g] > 0 && !groups.contains(&g)) {
                continue;
            }
            let sizes: Sizes = step.map(|k| USUAL_SIZES[k] * USUAL_M_S);
            let scale: Vec<f64> = groups.iter().map(|g| sizes[*g]).collect();
            let prior: f64 = step.iter().map(|k| weights[*k].ln()).sum();
            let posterior = log_bayes(&gram, &projected.match_, &scale) + prior + (1.0 - NONE).ln();
            if posterior > best.0 {
                best = (posterior, sizes);
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracy_log_bayes_of_scaled_amplitudes_is_that_of_the_columns() {
        let gram = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
        let match_ = DVector::from_vec(vec![2.0, -1.0]);
        // One amplitude: ½ s² m² / (1 + s² g) − ½ ln(1 + s² g).
        let one = log_bayes(&gram, &match_, &[0.5, 0.0]);
        assert!((one - (0.5 * 0.25 * 4.0 / 2.0 - 0.5 * 2.0_f64.ln())).abs() < 1e-12, "{one}");
        assert!((usual_weights().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
