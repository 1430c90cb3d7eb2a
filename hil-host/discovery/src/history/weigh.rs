//! Evidence of a departure: Bayes factors of columns against what healthy units scatter by, and which names they bear.

use super::numbers::NUMBERS;
use super::summary::Summary;
use crate::model::parameters::NINETY;
use nalgebra::{DMatrix, DVector};

/// A name needs these odds against each of its rivals.
const ODDS: f64 = 10.0;
/// Most names that one class prints.
const MOST_NAMES: usize = 3;

/// Inverse of a symmetric positive matrix.
#[must_use]
pub fn inverse(m: &DMatrix<f64>) -> DMatrix<f64> {
    let q = m.nrows();
    let symmetric = (m + m.transpose()) * 0.5;
    let jitter = 1e-12 * symmetric.trace().abs() / q as f64;
    symmetric
        .clone()
        .cholesky()
        .or_else(|| (symmetric + DMatrix::identity(q, q) * jitter.max(1e-300)).cholesky())
        .map_or_else(|| DMatrix::from_element(q, q, f64::NAN), |c| c.inverse())
}

/// Evidence of some columns against the history alone, and their most probable size and its covariance, in sizes.
#[derive(Clone, Debug)]
pub struct Weighed {
    /// ln Bayes factor.
    pub ln_bayes: f64,
    /// Most probable sizes.
    pub size: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
}

/// Inverse of the covariance of u, N C N + N, of units that scatter by `covariance`; what the unit does not see is left to a jitter.
fn precision_of_u(unit: &Summary, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let q = unit.u.len();
    let mut of_u = &unit.n * covariance * &unit.n + &unit.n;
    let jitter = 1e-9 * of_u.trace() / q as f64;
    of_u += DMatrix::identity(q, q) * jitter;
    inverse(&of_u)
}

/// Weighs the columns `e`, prior N(0, 1), against units that scatter by `covariance` about `mean`.
#[must_use]
pub fn weigh(unit: &Summary, mean: &DVector<f64>, covariance: &DMatrix<f64>, e: &[usize]) -> Weighed {
    let columns = unit.n.select_columns(e);
    let w = precision_of_u(unit, covariance) * &columns;
    let says = w.tr_mul(&unit.about(mean));
    let precision = columns.tr_mul(&w) + DMatrix::identity(e.len(), e.len());
    let covariance = inverse(&precision);
    let size = &covariance * &says;
    let ln_bayes = 0.5 * says.dot(&size) - 0.5 * precision.determinant().ln();
    Weighed { ln_bayes, size, covariance }
}

/// By how many standard deviations a unit is off in each number, were that alone to depart; no prior of its size in it.
#[must_use]
pub fn deviations(unit: &Summary, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> [f64; NUMBERS] {
    let w = precision_of_u(unit, covariance) * &unit.n;
    let (says, information) = (w.tr_mul(&unit.about(mean)), unit.n.tr_mul(&w));
    std::array::from_fn(|i| says[i].abs() / information[(i, i)].max(f64::MIN_POSITIVE).sqrt())
}

/// Least size, in sizes, that 19 of 20 such units would name, of a number with this information per size²: its expected evidence stands
/// where the noise of one unit takes 1.645 standard deviations off.
#[must_use]
pub fn least_named(information: f64) -> f64 {
    let asked = (ODDS * NUMBERS as f64).ln() + 0.5 * information.ln_1p();
    ((2.0 * asked * (1.0 + information) / information).sqrt() + NINETY) / information.sqrt()
}

/// Whether odds are large enough against all rivals together.
#[must_use]
pub fn stands(ln_bayes: f64) -> bool {
    ln_bayes > (ODDS * NUMBERS as f64).ln()
}

/// Names that the evidence bears: the best where its odds beat all rivals together, and those within ten to one of it.
#[must_use]
pub fn class(ln_bayes: &[f64; NUMBERS]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..NUMBERS).filter(|i| ln_bayes[*i].is_finite()).collect();
    order.sort_by(|a, b| ln_bayes[*b].total_cmp(&ln_bayes[*a]));
    let Some(&best) = order.first().filter(|i| stands(ln_bayes[**i])) else { return Vec::new() };
    order.into_iter().filter(|i| ln_bayes[*i] > ln_bayes[best] - ODDS.ln()).take(MOST_NAMES).collect()
}

/// How probable it is that a healthy unit departs as much: rank of its chi² among those of earlier units, with its floor.
#[must_use]
pub fn chance(chi2: f64, earlier: &[f64]) -> (f64, f64) {
    let n = earlier.len() as f64 + 1.0;
    let as_large = earlier.iter().filter(|c| **c >= chi2).count() as f64;
    ((1.0 + as_large) / n, 1.0 / n)
}
