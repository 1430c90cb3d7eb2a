//! What every answer says besides its verdict: which numbers moved, what could hide in this flight, and what the refitted polar is
//! worth.
//!
//! * *Moved*: each number of the law, in the vehicle file and in this flight's fit, with its 90 % interval.
//! * *Could hide*: for each effect the least size that 19 flights of 20 like this one would have named. Expected evidence of a size s with
//!   standard deviation σ is s²/2σ² plus the logarithm of the prior's density there; what it must reach is what naming asks for, and the
//!   noise of one flight takes 1.645 σ more.
//! * *Worth*: how much farther the vehicle glides in still water at the pitch that is best by the refitted polar than at the one that is
//!   best by the file's, each held in dives and climbs all along, both at 0.3 m/s. What a table gains on a mission is another number: the law that flies
//!   changes its pitch by what it measures.

use crate::hypotheses::identifiability::Identifiability;
use crate::inference::evidence::{PRIOR, SPEAK_UP, log_size_prior};
use crate::inference::posterior::Fit;
use crate::inference::unknowns::HELD;
use crate::likelihood::Problem;
use crate::model::parameters::{N_CALIBRATION, NINETY, STATED, State, law};
use crate::model::reported_numbers::{Number, reported_numbers};
use crate::model::sensor_findings::is_at_bound;
use hydro::effects::ForceModel;
use hydro::glide::{Trim, best, steady};
use hydro::{BothWays, Flow, Polar};
use logs::vehicle::Vehicle;
use logs::vehicle::catalogue;
use nalgebra::SymmetricEigen;
use std::f64::consts::PI;

/// An effect that is not named, and the size from which it would have been.
#[derive(Clone, Copy, Debug)]
pub struct Hidden {
    /// Effect.
    pub effect: &'static str,
    /// Its first parameter.
    pub parameter: &'static str,
    /// Unit of that.
    pub unit: &'static str,
    /// Least size named, beyond what the file has; infinite where no possible size would have been.
    pub least: f64,
    /// A usual size of the effect where it is there.
    pub typical: f64,
}

/// Range gained in still water, relative, with its 90 % interval.
#[derive(Clone, Copy, Debug)]
pub struct Worth {
    /// Most probable gain.
    pub gain: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// What is said with any verdict.
#[derive(Clone, Debug)]
pub struct FourParts {
    /// Numbers of the law.
    pub moved: Vec<Number>,
    /// Effects by what could hide of them, in usual sizes, the most first.
    pub hidden: Vec<Hidden>,
    /// L/D in a dive at 0.3 m/s by angle of attack, rad: of the refitted polar, and its 90 % interval; empty where nothing was refitted.
    pub polar: Vec<(f64, [f64; 3])>,
    /// What flying by the refitted polar is worth, or why that is not known.
    pub worth: Result<Worth, &'static str>,
}

impl FourParts {
    /// Of a fit that an answer rests on, which leaves this block error, m/s.
    pub(super) fn of(problem: &Problem, fit: &Fit, error_m_s: f64) -> Self {
        let vehicle = problem.vehicle;
        let left: [f64; STATED] = std::array::from_fn(|i| fit.covariance[(i, i)].max(0.0).sqrt());
        let mut moved = reported_numbers(vehicle, &fit.state, &left, |_| None);
        // What the fit pressed against the end of what is possible, or of what it may deviate at all, has no interval.
        let pressed = |k: &usize| is_at_bound(vehicle, &fit.state, *k) || fit.precision.get(*k).is_some_and(|p| *p >= HELD);
        (0..STATED.min(moved.len())).filter(pressed).for_each(|k| moved[k].tolerance = None);
        Self { moved, hidden: hidden(problem, fit, error_m_s), polar: polar(vehicle, fit), worth: worth(vehicle, fit) }
    }

    /// Sets what could hide of effects to what something else than these fits judges them by.
    pub(super) fn set_hidden(&mut self, least: impl Iterator<Item = (&'static str, f64)>) {
        for (name, least) in least {
            let Some(p) = catalogue::by_name(name).map(|effect| &effect.parameters[0]) else { continue };
            let least = if least <= possible(p.off, (p.low, p.high)) { least } else { f64::INFINITY };
            self.hidden.iter_mut().filter(|h| h.effect == name).for_each(|h| h.least = least);
        }
        most_first(&mut self.hidden);
    }

    /// Numbers whose value of the file is outside this flight's interval.
    pub fn changed(&self) -> impl Iterator<Item = &Number> {
        self.moved.iter().filter(|n| n.interval().is_some_and(|(low, high)| n.value[0] < low || n.value[0] > high))
    }
}

/// The largest size that an effect may have.
fn possible(off: f64, (low, high): (f64, f64)) -> f64 {
    (high - off).max(off - low)
}

/// Sorts by what could hide, in usual sizes.
fn most_first(hidden: &mut [Hidden]) {
    hidden.sort_by(|a, b| (b.least / b.typical).total_cmp(&(a.least / a.typical)).then(a.effect.cmp(b.effect)));
}

fn hidden(problem: &Problem, fit: &Fit, error_m_s: f64) -> Vec<Hidden> {
    let Some(shown) = Identifiability::of(problem, fit, error_m_s) else { return Vec::new() };
    let mut out = Vec::new();
    for (name, information) in shown.each() {
        let named = fit.state.effects.iter().any(|a| a.effect.name == name);
        let Some(effect) = catalogue::by_name(name).filter(|e| !named && e.onset.is_none()) else { continue };
        let (p, sigma) = (&effect.parameters[0], 1.0 / information.sqrt());
        let asked = SPEAK_UP + (PRIOR.0 / PRIOR.1).ln();
        let mut least = 3.0 * sigma;
        for _ in 0..5 {
            let log_prior = log_size_prior(problem, effect, p.off + least, sigma) + sigma.ln() + 0.5 * (2.0 * PI).ln();
            least = sigma * ((2.0 * (asked - log_prior).max(0.0)).sqrt() + NINETY);
        }
        let least = if least <= possible(p.off, problem.size_limits(effect)) { least } else { f64::INFINITY };
        out.push(Hidden { effect: effect.name, parameter: p.name, unit: p.unit, least, typical: p.typical });
    }
    most_first(&mut out);
    out
}

/// L/D at the pitch that is best by the file, and at the one that is best by a state.
fn glide_ratios(vehicle: &Vehicle, file_pitch_rad: f64, state: &State) -> Option<(f64, f64)> {
    let (constants, effects) = law(vehicle, state);
    let polar = BothWays(ForceModel::new(constants, &effects));
    let top = best(&polar, SPEED_M_S, polar.alpha_valid_rad());
    let force = polar.force(&Flow::steady(top.alpha_rad, SPEED_M_S));
    let drag_n = 0.5 * RHO_KG_M3 * SPEED_M_S * SPEED_M_S * polar.reference_area_m2() * force.cd;
    let trim = |pitch_rad: f64| Trim { pitch_rad: -pitch_rad, net_buoyancy_n: -drag_n / top.glide_angle_rad.sin(), rho_kg_m3: RHO_KG_M3 };
    let flown = |pitch_rad: f64| steady(&polar, &trim(pitch_rad)).ok().map(|g| g.lowest.l_over_d);
    let at_file = flown(file_pitch_rad)?;
    Some((at_file, flown(top.pitch_rad).unwrap_or(top.l_over_d).max(at_file)))
}

/// Speed of the comparison, m/s: that of the flight tables; and the density of the water, kg/m³.
const SPEED_M_S: f64 = 0.3;
const RHO_KG_M3: f64 = 1025.0;

/// The gain of range at the fit, with its interval.
fn worth(vehicle: &Vehicle, fit: &Fit) -> Result<Worth, &'static str> {
    let (constants, effects) = law(vehicle, &State::nominal());
    let file = BothWays(ForceModel::new(constants, &effects));
    let pitch_rad = best(&file, SPEED_M_S, file.alpha_valid_rad()).pitch_rad;
    let gain = |state: &State| glide_ratios(vehicle, pitch_rad, state).map(|(flown, best)| vec![best / flown - 1.0]);
    gain(&fit.state).ok_or("by the refitted polar there is no glide at the file's best pitch")?;
    let all = with_interval(fit, gain).unwrap_or_default();
    let [gain, low, high] = *all.first().ok_or("the fit leaves a number without an interval")?;
    Ok(Worth { gain, low: low.max(0.0), high })
}

/// Angles of attack that L/D is told at, deg.
const DEGREES: std::ops::RangeInclusive<u32> = 1..=20;

/// L/D in a dive over angles of attack by the fit, with its interval.
fn polar(vehicle: &Vehicle, fit: &Fit) -> Vec<(f64, [f64; 3])> {
    let angles = || DEGREES.map(|d| f64::from(d).to_radians());
    let ratio = |state: &State| {
        let (constants, effects) = law(vehicle, state);
        let law = ForceModel::new(constants, &effects);
        let at = |alpha| law.coefficients(&Flow { climb_m_s: DIVE_M_S, ..Flow::steady(alpha, SPEED_M_S) });
        Some(angles().map(at).map(|c| c.cl / c.cd).collect())
    };
    with_interval(fit, ratio).map_or_else(Vec::new, |all| angles().zip(all).collect())
}

/// Rate of climb of a dive: an effect that depends on its sign asks no more.
const DIVE_M_S: f64 = -0.1;

/// Values of a state at the fit, and from the ends of the 90 % intervals of its principal axes, whose deviations to either side add up as
/// squares: value, low, high.
fn with_interval(fit: &Fit, of: impl Fn(&State) -> Option<Vec<f64>>) -> Option<Vec<[f64; 3]>> {
    let here = of(&fit.state)?;
    let n = N_CALIBRATION + fit.sigma.len();
    let covariance = fit.covariance.view((0, 0), (n, n)).into_owned();
    if covariance.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let axes = SymmetricEigen::new(covariance);
    let mut squares = vec![[0.0; 2]; here.len()];
    for (axis, variance) in axes.eigenvectors.column_iter().zip(axes.eigenvalues.iter()) {
        let reach = NINETY * variance.max(0.0).sqrt();
        for side in [-1.0, 1.0] {
            let mut state = fit.state.clone();
            state.calibration.iter_mut().zip(axis.iter()).for_each(|(z, a)| *z += side * reach * a);
            for (&(e, p, _), a) in fit.sigma.iter().zip(axis.iter().skip(N_CALIBRATION)) {
                state.effects[e].values[p] += side * reach * a;
            }
            for ((there, here), square) in of(&state).into_iter().flatten().zip(&here).zip(&mut squares) {
                square[usize::from(there > *here)] += (there - here).powi(2);
            }
        }
    }
    Some(here.into_iter().zip(squares).map(|(v, [down, up])| [v, v - down.sqrt(), v + up.sqrt()]).collect())
}
