//! What a flight can show of an effect, before anything is asked of it: expected (Fisher) information after calibration and model
//! discrepancy are marginalised.
//!
//! With `A` the whitened sensitivities of what is fitted and of the discrepancy, `P` their prior precision, and `E` those of the effects,
//! ```text
//! information of the effects = Eᵀ E − Eᵀ A (Aᵀ A + P)⁻¹ Aᵀ E
//! ```
//! The discrepancy is a vertical velocity that nature has and the model lacks: Legendre polynomials of depth up to the third degree, apart
//! for dives and climbs, with normal amplitudes. Its size is what the block error has beyond the noise floor, and no less than
//! `LEAST_M_S`. (The size of the greatest evidence is of no use: columns that the calibration can follow too make it 1 cm/s and more.)

use crate::hypotheses::sensitivity::signatures;
use crate::inference::posterior::Fit;
use crate::likelihood::jacobian::{Jacobian, symmetric};
use crate::likelihood::{Column, Problem};
use crate::model::parameters::{STATED, State};
use logs::vehicle::catalogue;
use nalgebra::DMatrix;

/// Least discrepancy, m/s: the lower part of the 0.5 to 3 mm/s that depth rates of real vehicles leave by depth and leg; a guess.
const LEAST_M_S: f64 = 0.001;
/// Terms of the polynomial in depth.
const TERMS: usize = 4;
/// Speed at which a current's sensitivity is differenced, m/s.
const CURRENT_M_S: f64 = 0.1;

/// Expected information of a flight.
#[derive(Clone, Debug)]
pub struct Identifiability {
    names: Vec<&'static str>,
    information: DMatrix<f64>,
    /// Standard deviation of the model discrepancy that was marginalised, m/s.
    pub discrepancy_m_s: f64,
}

/// Legendre polynomials of degree 0 to 3 with unit mean square over −1 to 1, divided so that their squares sum to one on average.
fn legendre(x: f64) -> [f64; TERMS] {
    let p = [1.0, x, 1.5 * x * x - 0.5, 2.5 * x * x * x - 1.5 * x];
    std::array::from_fn(|k| p[k] * ((2 * k + 1) as f64 / TERMS as f64).sqrt())
}

/// Sensitivities to a discrepancy of 1 m/s rms.
fn discrepancy(problem: &Problem, state: &State) -> Vec<Column> {
    let tracks = problem.fitted_tracks(state);
    let deepest = tracks.iter().flat_map(|t| &t.depth_m).copied().fold(1.0, f64::max);
    let mut out = Vec::with_capacity(2 * TERMS);
    for down in [true, false] {
        for k in 0..TERMS {
            out.push(problem.rate_column(&|run, row| {
                let t = &tracks[run];
                let on_leg = (t.sink_m_s[row] > 0.0) == down;
                if on_leg { legendre(2.0 * t.depth_m[row].max(0.0) / deepest - 1.0)[k] } else { 0.0 }
            }));
        }
    }
    out
}

/// What is fitted and the discrepancy, together.
struct Marginalised {
    columns: Vec<Column>,
    covariance: DMatrix<f64>,
    size_m_s: f64,
}

/// Sensitivities to the discrepancy that a fit with this block error, m/s, leaves room for, in its own standard deviations, and its size, m/s.
pub(crate) fn discrepancy_of(problem: &Problem, state: &State, error_m_s: f64) -> (Vec<Column>, f64) {
    let beyond = (error_m_s.powi(2) - problem.noise_floor_m_s().powi(2)).max(0.0).sqrt();
    let size_m_s = LEAST_M_S.max(beyond);
    let unit = discrepancy(problem, state).into_iter();
    (unit.map(|c| problem.column(c.from, c.values.iter().map(|v| v * size_m_s).collect())).collect(), size_m_s)
}

fn marginalised(problem: &Problem, fit: &Fit, error_m_s: f64) -> Option<Marginalised> {
    let (scaled, size_m_s) = discrepancy_of(problem, &fit.state, error_m_s);
    let columns: Vec<Column> = fit.columns.iter().cloned().chain(scaled).collect();
    let precision = |i: usize| fit.precision.get(i).copied().unwrap_or(1.0);
    let mut curvature = symmetric(columns.len(), |i, j| columns[i].dot(&columns[j]));
    for i in 0..columns.len() {
        curvature[(i, i)] = (curvature[(i, i)] + precision(i)).max(1e-12) * (1.0 + 1e-9);
    }
    Some(Marginalised { covariance: curvature.cholesky()?.inverse(), columns, size_m_s })
}

/// Posterior standard deviations of the calibration numbers that a vehicle file states tolerances of, in those tolerances, model
/// discrepancy marginalised. Of the block errors `[fitted, held out]`, m/s, the larger sizes the discrepancy, and what held-out dives scatter
/// by more widens the tolerances (NaN where nothing was held out). None is above 1: a fit does not make a number less certain than it was.
/// None where the curvature is not positive.
#[must_use]
pub fn posterior_tolerances(problem: &Problem, fit: &Fit, [fitted, held_out]: [f64; 2]) -> Option<[f64; STATED]> {
    let m = marginalised(problem, fit, fitted.max(held_out))?;
    let scatter = (held_out / fitted).max(1.0);
    Some(std::array::from_fn(|k| (m.covariance[(k, k)].max(0.0).sqrt() * scatter).min(1.0)))
}

impl Identifiability {
    /// Of the effects of the catalogue that have a sensitivity at this fit of the calibration alone, which leaves this block error, m/s. None
    /// where the curvature of the fit is not positive.
    #[must_use]
    pub fn of(problem: &Problem, fit: &Fit, error_m_s: f64) -> Option<Self> {
        let m = marginalised(problem, fit, error_m_s)?;
        let jacobian = Jacobian::new(problem, &fit.state);
        let mut names = Vec::new();
        let mut effects: Vec<Column> = Vec::new();
        for s in signatures(problem, &fit.state, Some(&jacobian)) {
            names.push(s.effect.name);
            effects.push(s.column);
        }
        if let Some(current) = catalogue::current() {
            let mut with = fit.state.clone();
            let mut active = problem.active(current, CURRENT_M_S);
            active.values[1] = 0.0;
            with.effects.push(active);
            let [before, after] = [&fit.state, &with].map(|s| problem.model(s));
            names.push(current.name);
            effects.push(problem.column(0, after.iter().zip(&before).map(|(a, b)| (a - b) / CURRENT_M_S).collect()));
        }
        let cross = DMatrix::from_fn(m.columns.len(), effects.len(), |i, j| m.columns[i].dot(&effects[j]));
        let own = symmetric(effects.len(), |i, j| effects[i].dot(&effects[j]));
        let information = own - cross.transpose() * &m.covariance * cross;
        Some(Self { names, information, discrepancy_m_s: m.size_m_s })
    }

    fn own(&self, k: usize) -> f64 {
        self.information[(k, k)].max(0.0)
    }

    /// Effects, each with its expected information per square of its size's unit.
    pub(crate) fn each(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.names.iter().enumerate().map(|(k, name)| (*name, self.own(k)))
    }

    /// How many of its own standard deviations an effect of this size is expected to show; 0 for a name without a sensitivity.
    #[must_use]
    pub fn shown_sigma(&self, effect: &str, size: f64) -> f64 {
        self.names.iter().position(|n| *n == effect).map_or(0.0, |k| size.abs() * self.own(k).sqrt())
    }

    /// The effects that can take the place of this one: what an effect of this size still shows with the other fitted in its place is below
    /// so many standard deviations. The effect itself is among them.
    #[must_use]
    pub fn class_of(&self, effect: &str, size: f64, sigma: f64) -> Vec<&'static str> {
        let Some(k) = self.names.iter().position(|n| *n == effect) else { return Vec::new() };
        let left = |j: usize| {
            let g = &self.information;
            let by_other = if self.own(j) > 0.0 { g[(k, j)] * g[(k, j)] / self.own(j) } else { 0.0 };
            size.abs() * (self.own(k) - by_other).max(0.0).sqrt()
        };
        let mut class: Vec<&'static str> = (0..self.names.len()).filter(|&j| j == k || left(j) < sigma).map(|j| self.names[j]).collect();
        class.sort_unstable();
        class.dedup();
        class
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(correlation: f64) -> Identifiability {
        let information = DMatrix::from_row_slice(2, 2, &[100.0, correlation * 100.0, correlation * 100.0, 100.0]);
        Identifiability { names: vec!["drag_level_error", "ballast_scale"], information, discrepancy_m_s: 0.0 }
    }

    #[test]
    fn accuracy_a_class_holds_effects_whose_remainder_is_below_the_bound() {
        // One unit shows 10 sigma; a likeness of 0.9 leaves 10 sqrt(1 - 0.81) = 4.36.
        assert!((two(0.9).shown_sigma("drag_level_error", 1.0) - 10.0).abs() < 1e-12);
        assert_eq!(two(0.9).class_of("drag_level_error", 1.0, 5.0), ["ballast_scale", "drag_level_error"]);
        assert_eq!(two(0.9).class_of("drag_level_error", 1.0, 4.0), ["drag_level_error"]);
        assert_eq!(two(0.9).class_of("drag_level_error", 1.5, 5.0), ["drag_level_error"]);
        assert!(two(0.9).class_of("stall", 1.0, 5.0).is_empty() && two(0.9).shown_sigma("stall", 9.0) == 0.0);
    }

    #[test]
    fn accuracy_the_polynomials_share_one_unit_of_variance() {
        let n = 20_000;
        let sum: f64 = (0..n).map(|i| legendre(2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0).iter().map(|v| v * v).sum::<f64>()).sum();
        // The midpoint rule over 20,000 cells.
        assert!((sum / f64::from(n) - 1.0).abs() < 1e-6, "{sum}");
    }
}
