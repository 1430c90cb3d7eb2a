//! The unknowns of a fit: calibration numbers, numbers of the effects on trial, amplitudes of a wave; their bounds and their priors.

use crate::likelihood::{Column, Problem};
use crate::model::internal_wave::{PARTS, Wave};
use crate::model::parameters::{
    DRAG, LIFT_SLOPE, N_CALIBRATION, N_LAW, PITCH_DAMPING, STATED, State, TRIM_VOLUME, bounds, is_law, wide_tail,
};
use hydro::effects::{Active, SeenIn};
use logs::vehicle::Vehicle;
use nalgebra::DVector;

/// Most that a calibration number may deviate, in its tolerances: scatter beyond two is rare and beyond three a discovery; what
/// goes further is no calibration, and the model has no glide there. [`is_free`] numbers have no such limit.
const MOST_TOLERANCES: f64 = 10.0;
/// Prior precision of a calibration number at that limit: none of it is left free.
pub(crate) const HELD: f64 = 1e12;
/// Tolerances within which every vehicle scatters (flight format: inside two is normal, beyond three is something missing), and what
/// the prior's precision grows by beyond them: a guess; three tolerances cost what three and a half of a normal prior would.
const SCATTER: f64 = 2.0;
const RARER: f64 = 3.0;
/// Share of a parameter's typical size that is the step of a difference.
const DIFFERENCE: f64 = 0.02;

/// Trim and drag tolerances from which a file counts as not calibrated: one linearisation no longer spans them, m³ and 1.
const WIDE_TRIM_M3: f64 = 1e-5;
const WIDE_CD0: f64 = 0.1;

/// Whether the tolerances of a vehicle file are those of a vehicle that nobody has calibrated.
#[must_use]
pub fn is_uncalibrated(vehicle: &Vehicle) -> bool {
    vehicle.tolerance.trim_volume_m3 > WIDE_TRIM_M3 || vehicle.tolerance.cd0_relative > WIDE_CD0
}

/// What a prior adds to a normal one: penalty in chi², and half of its slope and curvature.
type Penalty = (f64, f64, f64);

/// One free number of an effect on trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free {
    pub(super) effect: usize,
    pub(super) parameter: usize,
    low: f64,
    pub(super) high: f64,
    pub(super) step: f64,
    /// Mean and standard deviation of its normal prior; none for a size.
    prior: Option<(f64, f64)>,
}

/// Whether a calibration number is free to be anywhere: what a vehicle that nobody has calibrated floats and glides by. What its hull
/// does under pressure and in warm water, and its sensors, scatter as in any other vehicle.
pub(crate) fn is_free(uncalibrated: bool, index: usize) -> bool {
    crate::ablation::is_on("free_numbers") && uncalibrated && matches!(index, TRIM_VOLUME | DRAG | LIFT_SLOPE)
}

/// What the prior asks of a calibration number beyond its scatter, on top of a normal prior: penalty, and half of the penalty's slope
/// and curvature. Numbers without a stated tolerance are only guessed at; they have no such edge.
fn beyond_scatter(index: usize, z: f64) -> Penalty {
    let over = z.abs() - SCATTER;
    if crate::ablation::is_on("rare_scatter") && index < STATED && is_law(index) && over > 0.0 {
        (RARER * over * over, RARER * over * z.signum(), RARER)
    } else {
        (0.0, 0.0, 0.0)
    }
}

/// The same of a number whose prior has a wide tail: what it pays less than by a normal prior.
fn tail_penalty(problem: &Problem, index: usize, z: f64) -> Penalty {
    wide_tail(problem.vehicle, index, z).map_or((0.0, 0.0, 0.0), |(cost, precision)| (cost - z * z, (precision - 1.0) * z, precision - 1.0))
}

/// What all calibration numbers of a state pay for being beyond their scatter, in chi².
#[must_use]
pub(crate) fn scatter_cost(problem: &Problem, state: &State) -> f64 {
    let uncalibrated = is_uncalibrated(problem.vehicle);
    let scatter = |(i, z): (usize, &f64)| if is_free(uncalibrated, i) { 0.0 } else { beyond_scatter(i, *z).0 };
    state.calibration.iter().enumerate().map(scatter).sum()
}

fn free_numbers(problem: &Problem, effects: &[Active]) -> Vec<Free> {
    let mut out = Vec::new();
    for (k, a) in effects.iter().enumerate() {
        for (j, p) in a.effect.parameters.iter().enumerate() {
            if a.effect.seen_in == SeenIn::Waves || p.is_stated() {
                continue;
            }
            // A direction may be any: a wide normal prior around its start keeps it finite where nothing is known.
            let prior = (j > 0).then_some(if p.name == "direction_rad" { (a.values[j], 1.8) } else { (p.off, p.typical) });
            let (low, high) = if j == 0 { problem.size_limits(a.effect) } else { (p.low, p.high) };
            out.push(Free { effect: k, parameter: j, low, high, step: DIFFERENCE * p.typical, prior });
        }
    }
    out
}

/// All unknowns of one fit, in the order calibration, effects, wave.
pub(super) struct Unknowns<'a> {
    problem: &'a Problem<'a>,
    /// Those of effects.
    pub(super) of_effects: Vec<Free>,
    /// Bounds of the calibration numbers, in their tolerances.
    limits: Vec<(f64, f64)>,
    /// Precision and mean of the normal part of each prior.
    pub(super) precision: Vec<f64>,
    pub(super) centre: Vec<f64>,
    /// Whether nobody has calibrated the vehicle: it has no scatter.
    uncalibrated: bool,
    noise_in_damping: Box<dyn Fn(f64) -> Penalty>,
}

impl<'a> Unknowns<'a> {
    /// Those of a start state.
    pub(super) fn new(problem: &'a Problem<'a>, start: &State) -> Self {
        let of_effects = free_numbers(problem, &start.effects);
        let wave = start.wave.as_ref();
        let amplitudes = wave.map_or(0, |_| PARTS * problem.runs.len());
        let wave_precision = wave.map_or(0.0, |w| 2.0 / (w.scale_m_s * w.scale_m_s));
        let own = || of_effects.iter().map(|f| f.prior);
        let precision = std::iter::repeat_n(1.0, N_CALIBRATION)
            .chain(own().map(|p| p.map_or(0.0, |(_, sigma)| 1.0 / (sigma * sigma))))
            .chain(std::iter::repeat_n(wave_precision, amplitudes))
            .collect();
        let centre = std::iter::repeat_n(0.0, N_CALIBRATION)
            .chain(own().map(|p| p.map_or(0.0, |(mean, _)| mean)))
            .chain(std::iter::repeat_n(0.0, amplitudes))
            .collect();
        let uncalibrated = is_uncalibrated(problem.vehicle);
        let most = |i: usize| if is_free(uncalibrated, i) { f64::INFINITY } else { MOST_TOLERANCES };
        let limit = |i: usize| {
            bounds(problem.vehicle, i).unwrap_or(if i < N_LAW { (-most(i), most(i)) } else { (f64::NEG_INFINITY, f64::INFINITY) })
        };
        let limits = (0..N_CALIBRATION).map(limit).collect();
        let noise_in_damping = Box::new(problem.noise_in_damping());
        Self { problem, of_effects, limits, precision, centre, uncalibrated, noise_in_damping }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.precision.len()
    }

    /// The number of an effect that unknown `i` is; none for those of calibration and wave.
    pub(super) fn of_effect(&self, i: usize) -> Option<&Free> {
        self.of_effects.get(i.checked_sub(N_CALIBRATION)?)
    }

    /// Which amplitude of which run unknown `i` is, where it is one of the wave's.
    fn amplitude(&self, i: usize) -> (usize, usize) {
        let j = i - N_CALIBRATION - self.of_effects.len();
        (j / PARTS, j % PARTS)
    }

    /// Value in a state.
    pub(super) fn get(&self, s: &State, i: usize) -> f64 {
        if i < N_CALIBRATION {
            return s.calibration[i];
        }
        if let Some(f) = self.of_effect(i) {
            return s.effects[f.effect].values[f.parameter];
        }
        let (run, part) = self.amplitude(i);
        s.wave.as_ref().map_or(0.0, |w: &Wave| w.amplitude_m_s[run][part])
    }

    /// Sets it in a state, within its bounds.
    pub(super) fn set(&self, s: &mut State, i: usize, v: f64) {
        if i < N_CALIBRATION {
            s.calibration[i] = v.clamp(self.limits[i].0, self.limits[i].1);
        } else if let Some(f) = self.of_effect(i) {
            s.effects[f.effect].values[f.parameter] = v.clamp(f.low, f.high);
        } else if let Some(w) = s.wave.as_mut() {
            let (run, part) = self.amplitude(i);
            w.amplitude_m_s[run][part] = v;
        }
    }

    /// What its prior adds to the normal part.
    pub(super) fn beyond_normal(&self, s: &State, i: usize) -> Penalty {
        let sum = |a: Penalty, b: Penalty| (a.0 + b.0, a.1 + b.1, a.2 + b.2);
        match (i < N_CALIBRATION).then(|| s.calibration[i]) {
            Some(z) if i == PITCH_DAMPING => sum(tail_penalty(self.problem, i, z), (self.noise_in_damping)(z)),
            Some(z) if !is_law(i) => tail_penalty(self.problem, i, z),
            Some(z) if !is_free(self.uncalibrated, i) => beyond_scatter(i, z),
            _ => (0.0, 0.0, 0.0),
        }
    }

    /// Minus twice the log prior of a state, but for those of sizes.
    fn prior(&self, s: &State) -> f64 {
        (0..self.len()).map(|i| self.precision[i] * (self.get(s, i) - self.centre[i]).powi(2) + self.beyond_normal(s, i).0).sum()
    }

    /// chi² of a state, priors in it, and its whitened residual.
    pub(super) fn objective(&self, s: &State) -> (f64, Column) {
        let residual = self.problem.residual(&self.problem.model(s));
        let misfit = residual.dot(&residual);
        let prior = self.prior(s);
        (if misfit.is_finite() { misfit + prior } else { f64::INFINITY }, residual)
    }

    /// Minus half of the gradient of chi² at a state.
    pub(super) fn gradient(&self, s: &State, columns: &[Column], residual: &Column) -> DVector<f64> {
        DVector::from_fn(self.len(), |i, _| {
            columns[i].dot(residual) - self.precision[i] * (self.get(s, i) - self.centre[i]) - self.beyond_normal(s, i).1
        })
    }

    /// Those at a bound that the gradient pulls beyond it.
    pub(super) fn at_bounds(&self, s: &State, gradient: &DVector<f64>) -> Vec<usize> {
        let bounds = self.limits.iter().copied().chain(self.of_effects.iter().map(|f| (f.low, f.high)));
        let stuck = |(i, (low, high)): (usize, (f64, f64))| {
            let v = self.get(s, i);
            ((v <= low && gradient[i] < 0.0) || (v >= high && gradient[i] > 0.0)).then_some(i)
        };
        bounds.enumerate().filter_map(stuck).collect()
    }
}
