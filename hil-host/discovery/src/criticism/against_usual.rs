//! Is an unknown effect larger than models are usually wrong by?

use crate::inference::discrepancy_size::{NONE, USUAL_M_S, USUAL_SIZES, usual_weights};
use crate::inference::numeric::log_mean_exp;
use crate::inference::posterior::Linearisation;
use crate::inference::projected_columns::ProjectedColumns;
use crate::likelihood::Column;

/// Sizes of unknown effects, in sizes that models are usually wrong by.
const UNKNOWN_SIZES: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// A form of an unknown effect given a fit, and the amplitude at which it is as large as models are usually wrong by.
pub(crate) struct Form {
    pub(crate) projected: ProjectedColumns,
    pub(crate) usual: f64,
}

impl Form {
    pub(crate) fn new(columns: &[&Column], linearisation: &Linearisation, whitened_m_s: f64) -> Self {
        let length = columns.iter().map(|c| c.plain_dot(c)).sum::<f64>().sqrt();
        Self { projected: ProjectedColumns::new(columns, linearisation), usual: USUAL_M_S * whitened_m_s / length.max(1e-300) }
    }
}

/// Log Bayes factor of an unknown effect against what models are usually wrong by, of a family with these forms, all as probable; and the
/// form of the best and its size, in usual ones.
pub(crate) fn unknown_against_usual(forms: &[Form]) -> (f64, usize, f64) {
    let weights = usual_weights();
    let of = |form: &Form, size: f64| if size > 0.0 { form.projected.log_bayes(size * form.usual) } else { 0.0 };
    let (mut small, mut large) = (Vec::new(), Vec::new());
    let mut best = (f64::NEG_INFINITY, 0, 1.0);
    for (k, form) in forms.iter().enumerate() {
        small.push(log_sum_exp(USUAL_SIZES.iter().zip(&weights).map(|(s, w)| of(form, *s) + w.ln())));
        for size in UNKNOWN_SIZES {
            let log_bayes = of(form, size);
            large.push(log_bayes);
            if log_bayes > best.0 {
                best = (log_bayes, k, size);
            }
        }
    }
    let usual = log_sum_exp([NONE.ln(), (1.0 - NONE).ln() + log_mean_exp(&small)].into_iter());
    (log_mean_exp(&large) - usual, best.1, best.2)
}

/// ln of the sum of exp.
fn log_sum_exp(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    log_mean_exp(&values) + (values.len() as f64).ln()
}
