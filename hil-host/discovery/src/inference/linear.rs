//! One more effect added to a fit, if everything were linear.

use crate::inference::posterior::Fit;
use crate::likelihood::{Column, Problem};
use crate::model::parameters::N_CALIBRATION;
use hydro::effects::Active;
use nalgebra::{DMatrix, DVector};

/// The fit that one more signature would give if everything were linear: no simulation. `size` is where `column` was taken.
#[must_use]
pub fn linear(problem: &Problem, null: &Fit, active: Active, column: &Column) -> Fit {
    let n = null.columns.len();
    let mut columns = null.columns.clone();
    columns.push(column.clone());
    let mut precision = null.precision.clone();
    precision.push(0.0);
    let mut centre = null.centre.clone();
    centre.push(0.0);
    let cross = DVector::from_fn(n, |i, _| null.columns[i].dot(column));
    let own = column.dot(column);
    let through = &null.covariance * &cross;
    let left = (own - cross.dot(&through)).max(1e-12 * own + 1e-300);
    let match_ = column.dot(&null.residual) - through.dot(&null.gradient);
    let p = &active.effect.parameters[0];
    let (low, high) = problem.size_limits(active.effect);
    let size = (p.off + match_ / left).clamp(low, high) - p.off;
    let mut state = null.state.clone();
    for i in 0..N_CALIBRATION {
        state.calibration[i] -= through[i] * size;
    }
    let mut active = active;
    active.values[0] = p.off + size;
    state.effects.push(active);
    let mut residual = null.residual.values.to_vec();
    for (i, r) in residual.iter_mut().enumerate() {
        *r -= size * column.values[i];
        for k in 0..N_CALIBRATION {
            *r += through[k] * size * null.columns[k].values[i];
        }
    }
    let residual = problem.column(0, residual);
    let mut covariance = DMatrix::zeros(n + 1, n + 1);
    let outer = &through * through.transpose() / left;
    covariance.view_mut((0, 0), (n, n)).copy_from(&(&null.covariance + outer));
    for i in 0..n {
        covariance[(i, n)] = -through[i] / left;
        covariance[(n, i)] = -through[i] / left;
    }
    covariance[(n, n)] = 1.0 / left;
    let gain = 2.0 * match_ * size - size * size * left;
    Fit {
        state,
        chi2: null.chi2 - gain,
        residual,
        log_det: null.log_det + left.ln(),
        covariance,
        sigma: vec![(0, 0, left.powf(-0.5))],
        columns,
        precision,
        centre,
        gradient: DVector::zeros(n + 1),
        promised: 0.0,
        pressed: Vec::new(),
    }
}
