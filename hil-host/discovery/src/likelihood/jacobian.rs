//! Signatures of the calibration numbers: what the whitened observations change by per tolerance of each.

use crate::likelihood::finite_difference::LEAP;
use crate::likelihood::{Column, Problem};
use crate::model::parameters::{BATTERY_ZERO, N_CALIBRATION, State, step_of};
use nalgebra::{Cholesky, DMatrix, Dyn};

/// Signatures of the calibration numbers, and their inner products.
#[derive(Clone, Debug)]
pub struct Jacobian {
    /// One column per calibration number, per unit of its tolerance.
    pub columns: Vec<Column>,
    /// Their inner products.
    pub gram: DMatrix<f64>,
}

impl Jacobian {
    /// By differences around a state.
    #[must_use]
    pub fn new(problem: &Problem, at: &State) -> Self {
        let steps: Vec<f64> = (0..N_CALIBRATION).map(|k| step_of(problem.vehicle, k)).collect();
        let aside = |k: usize, step: f64| {
            let mut shifted = at.clone();
            shifted.calibration[k] += step;
            shifted
        };
        let states: Vec<State> = std::iter::once(at.clone()).chain((0..BATTERY_ZERO).map(|k| aside(k, steps[k]))).collect();
        let mut models = problem.models(&states).into_iter();
        let base = models.next().unwrap_or_default();
        let seen = problem.seen(LEAP);
        let columns: Vec<Column> = models
            .enumerate()
            .map(|(k, ahead)| seen.slope(&base, &ahead, steps[k], |back| problem.model(&aside(k, back))))
            .chain(problem.battery_columns(at, &steps[BATTERY_ZERO..]))
            .map(|values| {
                let is_finite = values.iter().all(|x| x.is_finite());
                problem.column(0, if is_finite { values } else { vec![0.0; base.len()] })
            })
            .collect();
        let gram = symmetric(N_CALIBRATION, |i, j| columns[i].dot(&columns[j]));
        Self { columns, gram }
    }
}

/// ln of the determinant.
pub(crate) fn ln_det(c: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * c.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
}

/// A symmetric matrix from its lower half.
#[must_use]
pub fn symmetric(n: usize, of: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let mut out = DMatrix::from_fn(n, n, |i, j| if j <= i { of(i, j) } else { 0.0 });
    for i in 0..n {
        for j in i + 1..n {
            out[(i, j)] = out[(j, i)];
        }
    }
    out
}
