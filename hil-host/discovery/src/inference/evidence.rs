//! How much a hypothesis is to be believed: log evidence, with what was known of every effect before the flight.

use crate::inference::posterior::Fit;
use crate::likelihood::Problem;
use crate::model::parameters::{N_CALIBRATION, calibration_of, tolerance_of};
use hydro::effects::Effect;
use std::f64::consts::PI;

/// Prior probability that nothing is missing, that one effect is, that two are. A guess; sealed flights have two more often, but where
/// two lead the better of them by little, flights that others simulated show one (ten to two).
pub const PRIOR: (f64, f64, f64) = (0.27, 0.65, 0.08);

/// Log odds from which a hypothesis is named: ten to one. A tool that names what is not there is not asked twice; a weak effect that
/// goes unnamed shows in a longer flight.
pub(crate) const SPEAK_UP: f64 = std::f64::consts::LN_10;

/// Log odds within which hypotheses are not told apart.
pub(crate) const TIED: f64 = 4.5;

/// Log odds behind a smaller set up to which a larger one is nearly as likely as not: two to nine.
pub(crate) const NEARLY: f64 = 1.5;

/// Prior of an effect's size, integrated against the normal posterior N(value, sigma): `ln E[p]`.
#[must_use]
pub fn log_size_prior(problem: &Problem, effect: &Effect, value: f64, sigma: f64) -> f64 {
    let p = &effect.parameters[0];
    if let Some(onset) = effect.onset {
        // An angle: uniform where the wings fly.
        let (low, high) = onset.range_rad;
        let inside = normal_between(low, high, value, sigma);
        return (inside.max(1e-12) / (high - low)).ln();
    }
    // A deviation inside two tolerances is scatter, beyond three a discovery.
    let hole = own_tolerance(problem, effect);
    // What grows by the day may be felt after months.
    let share = if p.unit.ends_with("/day") { 300.0 } else { 30.0 };
    let smallest = hole.map_or(p.typical / share, |t| 2.2 * t);
    let largest = hole.map_or(p.typical * 12.0, |t| (60.0 * t).max(p.typical * 12.0));
    // Of what the file has already there may be too much or too little.
    let changed = problem.vehicle.switched_on(effect).is_some();
    let one_sided = problem.size_limits(effect).0 >= 0.0;
    let steps = 60;
    let width = (largest / smallest).ln() / f64::from(steps);
    let sigma = sigma.max(1e-12 * p.typical);
    let mut sum = 0.0;
    for side in [1.0, -1.0] {
        if one_sided && side < 0.0 {
            continue;
        }
        let usual = if changed { 0.0 } else { effect.usual_sign };
        let weight = if usual == 0.0 || one_sided {
            1.0
        } else if usual == side {
            1.9
        } else {
            0.1
        };
        for k in 0..steps {
            let a = smallest * (width * f64::from(k)).exp();
            let b = a * width.exp();
            let mass = if side > 0.0 { normal_between(a, b, value, sigma) } else { normal_between(-b, -a, value, sigma) };
            let middle = (a * b).sqrt();
            let admitted = hole.map_or(1.0, |t| 1.0 / (1.0 + (-(middle / t - 2.8) / 0.15).exp()));
            sum += mass * admitted / middle * weight;
        }
    }
    let volume = (largest / smallest).ln() * if one_sided { 1.0 } else { 2.0 };
    (sum / volume).max(1e-300).ln()
}

/// Tolerance of the calibration number that an effect deviates, in the effect's unit; none if it is a term of its own.
fn own_tolerance(problem: &Problem, effect: &Effect) -> Option<f64> {
    calibration_of(effect).map(|k| tolerance_of(problem.vehicle, k))
}

/// Probability of a normal variable between two values.
fn normal_between(a: f64, b: f64, mean: f64, sigma: f64) -> f64 {
    let scale = sigma * std::f64::consts::SQRT_2;
    let (x, y) = ((a - mean) / scale, (b - mean) / scale);
    // On the far side use the complement, so that tails keep their digits.
    if x > 0.0 {
        0.5 * (libm::erfc(x) - libm::erfc(y))
    } else if y < 0.0 {
        0.5 * (libm::erfc(-y) - libm::erfc(-x))
    } else {
        1.0 - 0.5 * (libm::erfc(-x) + libm::erfc(y))
    }
}

/// ln of the share of a normal posterior's mass that is left beyond a physical bound at which the size rests, where the likelihood still
/// pulls outwards by `pull` standard deviations: ½ erfcx(pull / √2) (0 at no pull: nothing is cut away of a size that rests by itself).
fn log_truncated(pull: f64) -> f64 {
    if !(pull > 0.0) {
        return 0.0;
    }
    let x = pull / std::f64::consts::SQRT_2;
    let scaled = if x < 5.0 { (x * x).exp() * libm::erfc(x) } else { (1.0 - 0.5 / (x * x)) / (x * PI.sqrt()) };
    (0.5 * scaled).ln()
}

/// Log evidence of a fit up to a constant common to all hypotheses.
#[must_use]
pub fn log_evidence(problem: &Problem, f: &Fit) -> f64 {
    let mut z = -0.5 * f.chi2 - 0.5 * f.log_det;
    for p in f.precision.iter().skip(N_CALIBRATION) {
        z += 0.5 * if *p > 0.0 { p.ln() } else { (2.0 * PI).ln() };
    }
    for &(effect, parameter, sigma) in &f.sigma {
        let a = &f.state.effects[effect];
        if parameter == 0 {
            z += log_size_prior(problem, a.effect, a.values[0], sigma) + log_truncated(f.pressed_by(effect) * sigma);
        }
    }
    z
}
