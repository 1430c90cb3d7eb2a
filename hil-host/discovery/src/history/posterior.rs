//! What all dives of a flight say of the eight numbers together, where nothing is known but the usual sizes of their errors: what worlds
//! are drawn from.

use super::glide::Glider;
use super::learn::linear_about;
use super::numbers::{NUMBERS, Numbers};
use super::rows::Unit;
use super::summary::Summary;
use super::weigh::inverse;
use nalgebra::{DMatrix, DVector};

/// Gauss and Newton's steps, linearised anew at each.
const STEPS: usize = 6;

/// Mean and covariance of the numbers beyond the file's, in sizes; none where no dive has rows to judge.
#[must_use]
pub fn posterior(units: &[Unit], glider: &Glider) -> Option<(Numbers, DMatrix<f64>)> {
    let prior = DMatrix::identity(NUMBERS, NUMBERS);
    let units: Vec<&Unit> = units.iter().filter(|u| !u.rows.is_empty()).collect();
    if units.is_empty() {
        return None;
    }
    let (mut d, mut precision) = (Numbers::zeros(), prior.clone());
    for _ in 0..STEPS {
        let mut u = DVector::zeros(NUMBERS);
        precision.copy_from(&prior);
        for unit in &units {
            let linear = linear_about(unit, glider, &Numbers::zeros(), &d);
            let says = Summary::of(&linear, linear.own_level(None));
            precision += says.n;
            u += says.u;
        }
        let step = Numbers::from_column_slice((inverse(&precision) * u).as_slice()) - d;
        d += step * (1.0 / step.amax().max(1.0));
    }
    d.iter().all(|x| x.is_finite()).then(|| (d, inverse(&precision)))
}
