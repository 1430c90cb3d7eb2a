//! Bounded Gauss–Newton with priors: the most probable state under a hypothesis, its curvature, its misfit.

use crate::likelihood::finite_difference::LEAP;
pub use crate::likelihood::jacobian::{Jacobian, symmetric};
use crate::likelihood::{Column, Problem};
use crate::model::internal_wave::{PARTS, Wave};
use crate::model::parameters::{N_CALIBRATION, N_LAW, PITCH_DAMPING, STATED, State, bounds, is_law, tolerance_of, wide_tail};
use hydro::effects::{Active, Effect, SeenIn};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// One free number of an effect on trial.
#[derive(Clone, Copy, Debug)]
struct Free {
    effect: usize,
    parameter: usize,
    low: f64,
    high: f64,
    step: f64,
    /// Mean and standard deviation of its normal prior; none for a size.
    prior: Option<(f64, f64)>,
}

/// The most probable state under a hypothesis.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Where it is.
    pub state: State,
    /// Sum of squares of residuals and of normal priors.
    pub chi2: f64,
    /// Whitened residual; a model discrepancy that the problem knows of is still in it.
    pub residual: Column,
    /// ln det of the curvature (all priors but those of sizes in it).
    pub log_det: f64,
    /// Covariance of all free numbers: calibration, effect parameters in order, wave amplitudes.
    pub covariance: DMatrix<f64>,
    /// 1 sigma of each free parameter of the effects: (effect index, parameter index, sigma).
    pub sigma: Vec<(usize, usize, f64)>,
    /// Columns of all free numbers at the state.
    pub columns: Vec<Column>,
    /// Prior precision of all free numbers.
    pub precision: Vec<f64>,
    /// Means of their normal priors.
    pub centre: Vec<f64>,
    /// Pull that is left on each free number (none on those held by a bound).
    pub gradient: DVector<f64>,
    /// Fall of chi² that the signatures still promised where no step along them led down: a fit at rest has none.
    pub promised: f64,
    /// Sizes that rest at a bound: effect, and the pull outwards, half of the slope of chi² per unit.
    pub pressed: Vec<(usize, f64)>,
}

/// What a fit leaves to more signatures: its residual, its columns and their curvature, priors in it.
pub struct Ground<'a> {
    /// The fit.
    pub fit: &'a Fit,
    /// Cholesky factor of its curvature.
    pub curvature: Cholesky<f64, Dyn>,
    /// Its whitened residual.
    pub residual: &'a Column,
}

impl Fit {
    /// Mean square of the innovations, 1 for noise.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        self.residual.dot(&self.residual) / self.residual.values.len().max(1) as f64
    }

    /// By how much the likelihood pulls the size of an effect beyond the bound at which it rests; 0 where it rests by itself.
    #[must_use]
    pub(crate) fn pressed_by(&self, effect: usize) -> f64 {
        self.pressed.iter().find(|p| p.0 == effect).map_or(0.0, |p| p.1)
    }

    /// What all free numbers of a state near this fit cost by their normal priors, in chi². One that a limit holds does not move: it
    /// costs nothing more.
    #[must_use]
    pub fn cost_of(&self, state: &State) -> f64 {
        let own = self.sigma.iter().map(|&(e, p, _)| state.effects[e].values[p]);
        let waves = state.wave.iter().flat_map(|w| w.amplitude_m_s.iter().flatten().copied());
        let numbers = state.calibration.iter().copied().chain(own).chain(waves);
        let priors = self.centre.iter().zip(&self.precision).map(|(c, p)| (c, if *p < HELD { *p } else { 0.0 }));
        numbers.zip(priors).map(|(x, (centre, precision))| precision * (x - centre).powi(2)).sum()
    }

    /// The fit's state with its free numbers moved by so much each; those of effects stay within their limits.
    #[must_use]
    pub fn moved(&self, by: impl IntoIterator<Item = f64>) -> State {
        let mut state = self.state.clone();
        let mut by = by.into_iter();
        state.calibration.iter_mut().zip(&mut by).for_each(|(z, b)| *z += b);
        for (&(e, p, _), b) in self.sigma.iter().zip(&mut by) {
            let active = &mut state.effects[e];
            let (parameter, from) = (&active.effect.parameters()[p], active.values[p]);
            active.values[p] = (from + b).clamp(parameter.low.min(from), parameter.high.max(from));
        }
        let amplitudes = state.wave.iter_mut().flat_map(|w| w.amplitude_m_s.iter_mut().flatten());
        amplitudes.zip(&mut by).for_each(|(a, b)| *a += b);
        state
    }

    /// Sine and cosine amplitude of the fitted wave in each run, m/s, and the sum of their variances; empty without a wave.
    #[must_use]
    pub(crate) fn wave_amplitudes(&self) -> Vec<([f64; 2], f64)> {
        let amplitudes = self.state.wave.as_ref().map_or(&[][..], |w| &w.amplitude_m_s);
        let first = self.covariance.nrows() - PARTS * amplitudes.len();
        let variance = |at: usize| self.covariance[(at, at)] + self.covariance[(at + 1, at + 1)];
        amplitudes.iter().enumerate().map(|(k, &[a, b, ..])| ([a, b], variance(first + PARTS * k))).collect()
    }

    /// What the fit leaves; none where its curvature is not positive.
    #[must_use]
    pub fn ground(&self) -> Option<Ground<'_>> {
        let n = self.columns.len();
        let mut curvature = symmetric(n, |i, j| self.columns[i].dot(&self.columns[j]));
        for i in 0..n {
            curvature[(i, i)] = (curvature[(i, i)] + self.precision[i]).max(1e-12) * (1.0 + 1e-9);
        }
        Some(Ground { fit: self, curvature: curvature.cholesky()?, residual: &self.residual })
    }
}

/// How a fit is run.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most iterations.
    pub iterations: usize,
    /// Whether only the place matters: signatures, curvature and errors are those of the step before.
    pub rough: bool,
}

impl Effort {
    /// At most so many iterations.
    #[must_use]
    pub const fn of(iterations: usize) -> Self {
        Self { iterations, rough: false }
    }
}

/// Most that a calibration number may deviate, in its tolerances: scatter beyond two is rare and beyond three a discovery; what
/// strains further is no calibration, and the model has no glide there. A vehicle that nobody has calibrated has no such limit.
const MOST_STRAINED: f64 = 10.0;
/// Prior precision of a calibration number at that limit: none of it is left free.
const HELD: f64 = 1e12;
/// Tolerances within which every vehicle scatters (flight format: inside two is normal, beyond three is something missing), and what
/// the prior's precision grows by beyond them: a guess; three tolerances cost what three and a half of a normal prior would.
const SCATTER: f64 = 2.0;
const RARER: f64 = 3.0;
/// Relative ridge of a step that is not bounded, which keeps the Cholesky factor positive for a column of zeros; and steps that are tried
/// with ever larger ones.
const LEAST_DAMPING: f64 = 1e-9;
/// Fall of chi² over what signatures promised, within which they are as good as new.
const AS_PROMISED: std::ops::Range<f64> = 0.8..1.25;
const TRIALS: usize = 5;
/// Share of a parameter's typical size that is the step of a difference.
const DIFFERENCE: f64 = 0.02;

/// What the prior asks of a calibration number beyond its scatter, on top of a normal prior: penalty, and half of the penalty's slope
/// and curvature. Numbers without a stated tolerance are only guessed at; they have no such edge.
fn beyond_scatter(index: usize, z: f64) -> (f64, f64, f64) {
    let over = z.abs() - SCATTER;
    if index < STATED && is_law(index) && over > 0.0 { (RARER * over * over, RARER * over * z.signum(), RARER) } else { (0.0, 0.0, 0.0) }
}

/// The same of a number whose prior has a wide tail: what it pays less than by a normal prior.
fn beside_normal(problem: &Problem, index: usize, z: f64) -> (f64, f64, f64) {
    wide_tail(problem.vehicle, index, z).map_or((0.0, 0.0, 0.0), |(cost, precision)| (cost - z * z, (precision - 1.0) * z, precision - 1.0))
}

/// What all calibration numbers of a state pay for being beyond their scatter, in chi²; an uncalibrated vehicle has no scatter.
#[must_use]
pub(crate) fn strain(problem: &Problem, state: &State) -> f64 {
    if crate::inference::initial_guess::is_uncalibrated(problem.vehicle) {
        return 0.0;
    }
    state.calibration.iter().enumerate().map(|(i, z)| beyond_scatter(i, *z).0).sum()
}

fn free_numbers(problem: &Problem, effects: &[Active]) -> Vec<Free> {
    let mut out = Vec::new();
    for (k, a) in effects.iter().enumerate() {
        for (j, p) in a.effect.parameters().iter().enumerate() {
            if a.effect.seen_in() == SeenIn::Waves || p.is_stated() {
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

/// Fits the calibration and the effects of `start`, with signatures taken there.
#[must_use]
pub fn fit_from(problem: &Problem, start: &State, effort: Effort) -> Fit {
    fit(problem, &Jacobian::new(problem, start), start, effort)
}

/// Fits the calibration and the effects of `start`.
#[must_use]
#[allow(clippy::too_many_lines, reason = "waits to be split: unknowns, steps, errors")]
pub fn fit(problem: &Problem, jacobian: &Jacobian, start: &State, effort: Effort) -> Fit {
    let free = free_numbers(problem, &start.effects);
    let wave_columns = start.wave.as_ref().map_or_else(Vec::new, |w| problem.wave_columns(&w.kind));
    let (nc, nf, nw) = (N_CALIBRATION, free.len(), wave_columns.len());
    let n = nc + nf + nw;
    let wave_precision = start.wave.as_ref().map_or(0.0, |w| 2.0 / (w.scale_m_s * w.scale_m_s));
    let precision: Vec<f64> = (0..n)
        .map(|i| {
            if i < nc {
                1.0
            } else if i < nc + nf {
                free[i - nc].prior.map_or(0.0, |p| 1.0 / (p.1 * p.1))
            } else {
                wave_precision
            }
        })
        .collect();
    let centre: Vec<f64> = (0..n).map(|i| if i >= nc && i < nc + nf { free[i - nc].prior.map_or(0.0, |p| p.0) } else { 0.0 }).collect();
    let get = |s: &State, i: usize| -> f64 {
        if i < nc {
            s.calibration[i]
        } else if i < nc + nf {
            s.effects[free[i - nc].effect].values[free[i - nc].parameter]
        } else {
            let j = i - nc - nf;
            s.wave.as_ref().map_or(0.0, |w: &Wave| w.amplitude_m_s[j / PARTS][j % PARTS])
        }
    };
    let limitless = crate::inference::initial_guess::is_uncalibrated(problem.vehicle);
    let most = if limitless { f64::INFINITY } else { MOST_STRAINED };
    let limits: Vec<(f64, f64)> = (0..nc)
        .map(|i| bounds(problem.vehicle, i).unwrap_or(if i < N_LAW { (-most, most) } else { (f64::NEG_INFINITY, f64::INFINITY) }))
        .collect();
    let set = |s: &mut State, i: usize, v: f64| {
        if i < nc {
            s.calibration[i] = v.clamp(limits[i].0, limits[i].1);
        } else if i < nc + nf {
            let f = &free[i - nc];
            s.effects[f.effect].values[f.parameter] = v.clamp(f.low, f.high);
        } else if let Some(w) = s.wave.as_mut() {
            let j = i - nc - nf;
            w.amplitude_m_s[j / PARTS][j % PARTS] = v;
        }
    };
    let noise_in_damping = problem.noise_in_damping();
    let sum = |a: (f64, f64, f64), b: (f64, f64, f64)| (a.0 + b.0, a.1 + b.1, a.2 + b.2);
    let rare = |s: &State, i: usize| match (i < nc).then(|| s.calibration[i]) {
        Some(z) if i == PITCH_DAMPING => sum(beside_normal(problem, i, z), noise_in_damping(z)),
        Some(z) if !is_law(i) => beside_normal(problem, i, z),
        Some(z) if !limitless => beyond_scatter(i, z),
        _ => (0.0, 0.0, 0.0),
    };
    let objective = |s: &State| -> (f64, Column) {
        let residual = problem.residual(&problem.model(s));
        let misfit = residual.dot(&residual);
        let prior: f64 = (0..n).map(|i| precision[i] * (get(s, i) - centre[i]).powi(2) + rare(s, i).0).sum();
        (if misfit.is_finite() { misfit + prior } else { f64::INFINITY }, residual)
    };

    // Numbers at a bound that want to go further.
    let held = |s: &State, gradient: &DVector<f64>| -> Vec<usize> {
        let bounds = limits.iter().copied().chain(free.iter().map(|f| (f.low, f.high)));
        let stuck = |(i, (low, high)): (usize, (f64, f64))| {
            let v = get(s, i);
            ((v <= low && gradient[i] < 0.0) || (v >= high && gradient[i] > 0.0)).then_some(i)
        };
        bounds.enumerate().filter_map(stuck).collect()
    };
    let pull = |s: &State, columns: &[Column], residual: &Column| -> DVector<f64> {
        DVector::from_fn(n, |i, _| columns[i].dot(residual) - precision[i] * (get(s, i) - centre[i]) - rare(s, i).1)
    };

    let mut state = start.clone();
    let (mut chi2, mut residual) = objective(&state);
    let mut columns: Vec<Column> = jacobian.columns.clone();
    columns.extend((0..nf).map(|_| problem.column(0, vec![0.0; problem.data.len()])));
    columns.extend(wave_columns);
    let mut gram = DMatrix::zeros(n, n);
    gram.view_mut((0, 0), (nc, nc)).copy_from(&jacobian.gram);
    let mut settled = false;
    let mut promised = 0.0;
    let mut damping = LEAST_DAMPING;
    // Whether the effects' own signatures are of another state, and whether the last step was not as good as they promised.
    let (mut stale, mut moved_since) = (true, false);
    for iteration in 0..=effort.iterations {
        let last = settled || iteration == effort.iterations;
        stale |= last && moved_since;
        // Signatures of the effects' own numbers at this state.
        if stale && !(last && effort.rough) {
            let step = |f: &Free| if state.effects[f.effect].values[f.parameter] + f.step > f.high { -f.step } else { f.step };
            let beside = |f: &Free, by: f64| {
                let mut beside = state.clone();
                beside.effects[f.effect].values[f.parameter] += by;
                beside
            };
            let models = problem.models(&free.iter().map(|f| beside(f, step(f))).collect::<Vec<_>>());
            let seen = problem.seen(LEAP);
            let here: Vec<f64> = problem.data.iter().zip(&residual.values).map(|(d, r)| d - r).collect();
            for ((j, f), ahead) in free.iter().enumerate().zip(models) {
                columns[nc + j] = problem.column(0, seen.slope(&here, &ahead, step(f), |back| problem.model(&beside(f, back))));
            }
            (stale, moved_since) = (false, false);
        }
        for i in nc..n {
            for j in 0..=i {
                let v = columns[i].dot(&columns[j]);
                gram[(i, j)] = v;
                gram[(j, i)] = v;
            }
        }
        if last {
            break;
        }
        let mut curvature = gram.clone();
        let mut gradient = pull(&state, &columns, &residual);
        for i in 0..n {
            curvature[(i, i)] = (curvature[(i, i)] + precision[i] + rare(&state, i).2).max(1e-12);
        }
        for i in held(&state, &gradient) {
            gradient[i] = 0.0;
            for k in (0..n).filter(|k| *k != i) {
                curvature[(i, k)] = 0.0;
                curvature[(k, i)] = 0.0;
            }
        }
        // Levenberg and Marquardt: the relative ridge that bounds the step grows until a step is as good as it promises to be.
        let damped = |damping: f64| {
            let mut curvature = curvature.clone();
            (0..n).for_each(|i| curvature[(i, i)] *= 1.0 + damping);
            curvature.cholesky().map(|c| c.solve(&gradient))
        };
        let Some(whole) = damped(LEAST_DAMPING) else { break };
        promised = 0.0;
        if gradient.dot(&whole) < 0.05 {
            // Nothing left to gain.
            settled = true;
            continue;
        }
        let mut moved = false;
        let mut gained = 0.0;
        for _ in 0..TRIALS {
            let Some(move_by) = damped(damping) else { break };
            let mut trial = state.clone();
            for i in 0..n {
                set(&mut trial, i, get(&state, i) + move_by[i]);
            }
            let (value, r) = objective(&trial);
            let predicted = 2.0 * gradient.dot(&move_by) - move_by.dot(&(&curvature * &move_by));
            let ratio = (chi2 - value) / predicted;
            if value < chi2 {
                gained = chi2 - value;
                (state, chi2, residual) = (trial, value, r);
                (moved, moved_since) = (true, true);
                stale = !AS_PROMISED.contains(&ratio);
                if ratio > 0.75 {
                    damping = (damping / 10.0).max(LEAST_DAMPING);
                } else if ratio < 0.25 {
                    damping = (damping * 4.0).max(0.1);
                }
                break;
            }
            damping = (damping * 8.0).max(0.5);
        }
        // Signatures of another state may have led nowhere.
        let old = !moved && moved_since && !stale;
        stale |= old;
        settled = gained < 0.1 && !old;
        promised = if moved { 0.0 } else { gradient.dot(&whole) };
    }
    let mut curvature = gram;
    for i in 0..n {
        curvature[(i, i)] += precision[i] + rare(&state, i).2;
        curvature[(i, i)] = curvature[(i, i)].max(1e-12) * (1.0 + 1e-9);
    }
    let log_det = curvature.clone().cholesky().map_or(f64::INFINITY, |c| 2.0 * c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>());
    let mut gradient = pull(&state, &columns, &residual);
    let mut precision = precision;
    (0..nc).filter(|i| !is_law(*i)).for_each(|i| precision[i] += rare(&state, i).2);
    let mut pressed = Vec::new();
    for i in held(&state, &gradient) {
        if let Some(f) = i.checked_sub(nc).and_then(|j| free.get(j)).filter(|f| f.parameter == 0) {
            pressed.push((f.effect, gradient[i].abs()));
        }
        gradient[i] = 0.0;
        // A calibration at its limit does not give way to anything beside it.
        if i < nc {
            precision[i] = HELD;
            curvature[(i, i)] += HELD;
        }
    }
    // A curvature that is not positive knows no errors: not a number, lest intervals be printed from it.
    let covariance = curvature.cholesky().map_or_else(|| DMatrix::from_element(n, n, f64::NAN), |c| c.inverse());
    let sigma = free.iter().enumerate().map(|(j, f)| (f.effect, f.parameter, covariance[(nc + j, nc + j)].max(0.0).sqrt())).collect();
    Fit { state, chi2, residual, log_det, covariance, sigma, columns, precision, centre, gradient, promised, pressed }
}

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
    let p = &active.effect.parameters()[0];
    let (low, high) = problem.size_limits(active.effect);
    let size = (p.off + match_ / left).clamp(low, high) - p.off;
    let mut state = null.state.clone();
    for i in 0..N_CALIBRATION {
        state.calibration[i] -= through[i] * size;
    }
    let mut active = active;
    active.values[0] = p.off + size;
    state.effects.push(active);
    let mut residual = null.residual.values.clone();
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

/// Tolerance of the calibration number that an effect deviates, in the effect's unit; none if it is a term of its own.
#[must_use]
pub fn own_tolerance(problem: &Problem, effect: &dyn Effect) -> Option<f64> {
    crate::model::parameters::calibration_of(effect).map(|k| tolerance_of(problem.vehicle, k))
}
