//! Where the fit of the calibration starts when the vehicle file is far from the vehicle.
//!
//! A vehicle that has been calibrated sits so close to its file that one linearisation reaches it. A vehicle that nobody has
//! calibrated can be hundreds of cm³ off in trim: its nominal model may float where the real one dives, and no signature taken
//! there points home. So the two numbers that decide whether it dives at all, trim and drag, are scanned over their prior range
//! with the full model, and from the best places Gauss–Newton goes on with signatures renewed at every step.

use crate::inference::gauss_newton::{Effort, fit_from};
use crate::inference::posterior::Fit;
pub use crate::inference::unknowns::is_uncalibrated;
use crate::likelihood::Problem;
use crate::model::parameters::{DRAG, State, TRIM_VOLUME};

/// Places that are tried, in tolerances.
const TRIMS: [f64; 17] = [0.0, -0.25, 0.25, -0.5, 0.5, -0.75, 0.75, -1.0, 1.0, -1.3, 1.3, -1.6, 1.6, -2.0, 2.0, -2.5, 2.5];
const DRAGS: [f64; 4] = [0.0, -1.0, 1.2, 3.0];
/// From how many of them the fit goes on, and how often signatures are renewed at most.
const DESCENTS: usize = 2;
const RENEWALS: usize = 8;
/// Innovations beyond this count linearly, sigma.
const HUBER: f64 = 3.0;

fn cost(problem: &Problem, state: &State) -> f64 {
    let model = problem.model(state);
    let misfit: f64 = problem
        .data
        .iter()
        .zip(&model)
        .map(|(d, m)| (d - m).abs())
        .map(|r| if r < HUBER { r * r } else { HUBER * (2.0 * r - HUBER) })
        .sum();
    let prior: f64 = state.calibration.iter().map(|z| z * z).sum();
    if misfit.is_finite() { misfit + prior } else { f64::INFINITY }
}

/// Follows renewed signatures downhill from a state.
#[must_use]
pub fn descend(problem: &Problem, from: &State) -> Fit {
    let mut best = fit_from(problem, from, Effort::of(2));
    for _ in 0..RENEWALS {
        let next = fit_from(problem, &best.state, Effort::of(2));
        let settled = !(next.chi2 < best.chi2 - 0.5 - 1e-3 * best.chi2);
        if next.chi2 <= best.chi2 {
            best = next;
        }
        if settled {
            break;
        }
    }
    best
}

/// The state from which fits of this problem start.
#[must_use]
pub fn find(problem: &Problem) -> State {
    if !is_uncalibrated(problem.vehicle) {
        return State::nominal();
    }
    let mut places: Vec<(f64, State)> = Vec::new();
    for drag in DRAGS {
        for trim in TRIMS {
            let mut state = State::nominal();
            state.calibration[DRAG] = drag;
            state.calibration[TRIM_VOLUME] = trim;
            places.push((cost(problem, &state), state));
        }
    }
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    places
        .iter()
        .take(DESCENTS)
        .map(|(_, s)| descend(problem, s))
        .min_by(|a, b| a.chi2.total_cmp(&b.chi2))
        .map_or_else(State::nominal, |f| f.state)
}
