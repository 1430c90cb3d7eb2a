//! Effects that have no name in the vocabulary: asked, so that the tool can say that something else is there, never answered.
//!
//! Each is a change of the model's inputs (trim, pitch, drag), run through the model at a fitted state; its whitened signature is
//! offered to the residual like the families of [`crate::criticism::residual_tests`], and what the best of it really gains is then seen by flying it.
//! They are what gliders are known to do outside the catalogue: trim that is not repeatable or leaks away, a hull or a conductivity cell
//! that follows the water's temperature late, water that is exchanged late, an engine that lags its reading, air that pressure shrinks,
//! a pitch sensor that depends on heading (soft iron), pressure, temperature or roll, or whose clock is not that of the pressure sensor,
//! and drag that depends on heading, depth or the side to which the glider turns, or that something caught on the way changes.

use crate::criticism::against_usual::{Form, unknown_against_usual};
use crate::inference::gauss_newton::{Effort, fit_from};
use crate::inference::posterior::{Fit, Linearisation};
use crate::inference::projected_columns::ProjectedColumns;
use crate::inference::unknowns::scatter_cost;
use crate::likelihood::{Column, Problem};
use crate::model::parameters::State;
use crate::preprocess::{Input, Run};
use hydro::effects::Sensed;
use nalgebra::DVector;
use std::rc::Rc;

/// Unit of a change of trim, m³: ten cm³, what a glider's trim is known to.
const TRIM_M3: f64 = 10e-6;
/// Unit of a change of pitch, rad: half a degree.
const PITCH_RAD: f64 = 0.01;
/// Unit of a change of CD0, relative: a twentieth, half of what a drag of typical size deviates by.
const DRAG_UNIT: f64 = 0.05;
/// Share of a unit that signatures are differenced over.
const STEP: f64 = 0.2;
/// Log Bayes factor from which the gain is checked by flying it.
const WORTH_FLYING: f64 = 4.0;
/// Shares of the linear step that are flown.
const SHARES: [f64; 3] = [1.0, 0.6, 0.3];
/// Fits anew of a form that linear theory finds wanting or promising, at most, and their iterations.
const REFITS: usize = 4;
const REFIT_ITERATIONS: usize = 4;
/// Share of the log Bayes factor that would decide from which a form is fitted anew.
const NEARLY_DECIDES: f64 = 0.6;
/// Fall of chi² below which another fit is not worth it.
const LITTLE: f64 = 2.0;
/// Lags of temperature, s: cells of conductivity sensors 20 to 60 s (Garau et al. 2011), hulls and oil some minutes (guess).
const TEMPERATURE_LAGS_S: [f64; 5] = [20.0, 60.0, 150.0, 400.0, 900.0];
/// Lags of the water in free-flooding spaces, s (guess).
const DENSITY_LAGS_S: [f64; 4] = [20.0, 60.0, 180.0, 500.0];
/// Lags of the buoyancy engine behind its reading, s: of its motion, and of a bladder or an oil that creeps (guess).
const BALLAST_LAGS_S: [f64; 5] = [5.0, 15.0, 40.0, 120.0, 400.0];
/// Mean of the unit vectors along the headings from which the heading hardly varies (1: not at all): 0.97 is some 14 degrees rms.
const ONE_HEADING: f64 = 0.97;
/// Changed copies of a run that are simulated at a time.
const SIDE_BY_SIDE: usize = 2;
/// Least CD0 that a form leaves, relative.
const LEAST_DRAG: f64 = 0.2;
/// Pressure of the atmosphere, Pa.
const ATMOSPHERE_PA: f64 = 101_325.0;

/// Change of every input of a run, in units of each.
type Change = Vec<Nudge>;

/// Change of one input: trim, pitch, drag, in their units.
type Nudge = [f64; 3];
const ON_TRIM: usize = 0;
const ON_PITCH: usize = 1;
const ON_DRAG: usize = 2;

/// A sum of changes, each so many times.
fn sum_of(parts: impl Iterator<Item = (f64, Nudge)>) -> Nudge {
    parts.fold([0.0; 3], |sum, (times, part)| std::array::from_fn(|i| sum[i] + times * part[i]))
}

/// The change that an amplitude makes in run `k`, made anew whenever it is asked: all of them at once are larger than the flight.
type Changing<'a> = Rc<dyn Fn(usize) -> Change + 'a>;

/// One amplitude of an unmodelled effect: the change it makes in each run, and its whitened signature.
struct Part<'a> {
    changes: Changing<'a>,
    column: Column,
}

/// A kind of effect outside the catalogue; each of its forms has one or several amplitudes.
pub struct UnmodelledEffect<'a> {
    /// Which variable it follows, and through what it acts.
    pub variable: &'static str,
    forms: Vec<Vec<Part<'a>>>,
}

impl UnmodelledEffect<'_> {
    /// Log Bayes factor of this effect given a fit, averaged over forms and sizes; the best of them as it flies, the others as
    /// linear theory has them. Where it could reach `decides`, the model is fitted anew with that form, as long as work ends before
    /// `ends`.
    #[must_use]
    pub fn log_bayes(&self, problem: &Problem, linearisation: &Linearisation, whitened_m_s: f64, decides: f64, ends: u64) -> f64 {
        let form = |parts: &Vec<Part>| Form::new(&parts.iter().map(|p| &p.column).collect::<Vec<_>>(), linearisation, whitened_m_s);
        let mut forms: Vec<Form> = self.forms.iter().map(form).collect();
        let (linear, best, size) = unknown_against_usual(&forms);
        let best = (!forms.is_empty()).then(|| (&self.forms[best], forms.swap_remove(best)));
        match best {
            Some((parts, form)) if linear > WORTH_FLYING => {
                let Some(step) = Step::new(linearisation, parts, &form.projected, size * form.usual) else { return f64::NEG_INFINITY };
                let (share, flown) = step.flown(problem, linearisation);
                let log_bayes = linear - 0.5 * (step.promised - flown).max(0.0);
                if log_bayes >= decides || linear < NEARLY_DECIDES * decides || problem.work() > ends {
                    return log_bayes;
                }
                linear - 0.5 * (step.promised - step.fitted_anew(problem, linearisation, share, flown))
            }
            _ => linear,
        }
    }
}

/// What linear theory makes of a form: its amplitudes, how the calibration gives way, the fall of chi².
struct Step<'a> {
    form: &'a [Part<'a>],
    scale: f64,
    amplitude: DVector<f64>,
    give: DVector<f64>,
    promised: f64,
}

impl<'a> Step<'a> {
    fn new(linearisation: &Linearisation, form: &'a [Part<'a>], projected: &ProjectedColumns, scale: f64) -> Option<Self> {
        let n = form.len();
        let amplitude = towards(projected, &DVector::zeros(n), scale)?;
        let promised = projected.match_.dot(&amplitude);
        // The calibration gives way: what the form takes of each number's signature.
        let base = &linearisation.fit.columns;
        let pulled = DVector::from_fn(base.len(), |i, _| {
            linearisation.fit.gradient[i] - (0..n).map(|j| base[i].dot(&form[j].column) * amplitude[j]).sum::<f64>()
        });
        let give = linearisation.curvature.solve(&pulled);
        Some(Self { form, scale, amplitude, give, promised })
    }

    /// Run `k` with so much of each part's change of it.
    fn changed(&self, problem: &Problem, changes: &[Change], amplitude: &DVector<f64>, k: usize) -> Run {
        let here = |j: usize| changes.iter().zip(amplitude.iter()).map(move |(c, a)| (*a, c.get(j).copied().unwrap_or_default()));
        nudged(problem.runs[k], |j| sum_of(here(j)))
    }

    /// What each part changes in run `k`.
    fn changes(&self, k: usize) -> Vec<Change> {
        self.form.iter().map(|part| (part.changes)(k)).collect()
    }

    /// What amplitudes cost, in chi².
    fn cost(&self, amplitude: &DVector<f64>) -> f64 {
        amplitude.norm_squared() / (self.scale * self.scale)
    }

    /// Where the fit's own numbers give way to, for a share of the step.
    fn state(&self, linearisation: &Linearisation, share: f64) -> State {
        linearisation.fit.moved(self.give.iter().map(|g| share * g))
    }

    /// The share of the step that gains most as it flies, and by how much chi² falls then (never below 0).
    fn flown(&self, problem: &Problem, linearisation: &Linearisation) -> (f64, f64) {
        // With the form a calibration number pays for being beyond its scatter as it does with a named effect.
        let prior = |state: &State| linearisation.fit.cost_of(state) + scatter_cost(problem, state);
        let before = linearisation.fit.cost_of(&linearisation.fit.state) + linearisation.residual.dot(linearisation.residual);
        let states = SHARES.map(|share| self.state(linearisation, share));
        let amplitudes = SHARES.map(|share| &self.amplitude * share);
        let mut models = SHARES.map(|_| Vec::with_capacity(problem.data.len()));
        for k in 0..problem.runs.len() {
            let changes = self.changes(k);
            let asked: Vec<(&State, Run)> =
                amplitudes.iter().zip(&states).map(|(a, s)| (s, self.changed(problem, &changes, a, k))).collect();
            models.iter_mut().zip(problem.answers_to(k, &asked)).for_each(|(model, answer)| model.extend(answer));
        }
        let gain = |((amplitude, state), model): ((&DVector<f64>, &State), &Vec<f64>)| {
            let residual = problem.residual(model);
            before - prior(state) - residual.dot(&residual) - self.cost(amplitude)
        };
        let gains = amplitudes.iter().zip(&states).zip(&models).map(gain);
        let shares = SHARES.into_iter().zip(gains).filter(|(_, g)| g.is_finite());
        shares.max_by(|a, b| a.1.total_cmp(&b.1)).map_or((SHARES[SHARES.len() - 1], 0.0), |(s, g)| (s, g.max(0.0)))
    }

    /// By how much chi² falls where model and form are fitted together, step by step from a share of the linear one; at least `flown`.
    fn fitted_anew(&self, problem: &Problem, linearisation: &Linearisation, share: f64, flown: f64) -> f64 {
        let mut state = self.state(linearisation, share);
        let mut settled = DVector::zeros(self.form.len());
        let mut amplitude = &self.amplitude * share;
        let mut best = flown;
        for _ in 0..REFITS {
            let runs: Vec<Run> = (0..problem.runs.len()).map(|k| self.changed(problem, &self.changes(k), &amplitude, k)).collect();
            let refitted = Problem { runs: runs.iter().collect(), ..problem.clone() };
            let fitted = fit_from(&refitted, &state, Effort::of(REFIT_ITERATIONS));
            let gain = linearisation.fit.chi2 - fitted.chi2 - self.cost(&amplitude);
            if !(gain > best - LITTLE) {
                // Too far: halfway back to where it was.
                amplitude = 0.5 * (&amplitude + &settled);
                continue;
            }
            let gained = gain - best;
            best = best.max(gain);
            state = fitted.state.clone();
            settled.clone_from(&amplitude);
            let Some(here) = fitted.linearisation() else { break };
            let changes: Vec<&Changing> = self.form.iter().map(|p| &p.changes).collect();
            let columns: Vec<Column> = columns_at(&refitted, &fitted, &changes).into_iter().map(|c| refitted.column(0, c)).collect();
            let Some(step) = towards(&ProjectedColumns::new(&columns, &here), &amplitude, self.scale) else { break };
            if gained.abs() < LITTLE && step.norm() < 0.1 * amplitude.norm() {
                break;
            }
            amplitude += step;
        }
        best
    }
}

/// The step from these amplitudes to the most probable ones, if everything were linear.
fn towards(projected: &ProjectedColumns, from: &DVector<f64>, scale: f64) -> Option<DVector<f64>> {
    let precision = 1.0 / (scale * scale);
    let mut gram = projected.gram();
    for i in 0..from.len() {
        gram[(i, i)] += precision;
    }
    Some(gram.cholesky()?.solve(&(&projected.match_ - from * precision)))
}

/// Whitened change of the observations per unit of each of these changes of the inputs.
fn columns_at(problem: &Problem, fit: &Fit, all: &[&Changing]) -> Vec<Vec<f64>> {
    let at = &fit.state;
    let base: Vec<f64> = problem.data.iter().zip(fit.residual.values.iter()).map(|(d, r)| d - r).collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(base.len()); all.len()];
    for k in 0..problem.runs.len() {
        let stepped = |changes: &&Changing| {
            let change = changes(k);
            (at, nudged(problem.runs[k], |j| sum_of(change.get(j).map(|here| (STEP, *here)).into_iter())))
        };
        let from = problem.range(k).0.start;
        for (some, columns) in all.chunks(SIDE_BY_SIDE).zip(columns.chunks_mut(SIDE_BY_SIDE)) {
            let asked: Vec<(&State, Run)> = some.iter().map(stepped).collect();
            for (column, answer) in columns.iter_mut().zip(problem.answers_to(k, &asked)) {
                column.extend(answer.iter().zip(&base[from..]).map(|(a, b)| (a - b) / STEP));
            }
        }
    }
    columns
}

/// A run with its inputs changed by so many of their units.
fn nudged(run: &Run, change: impl Fn(usize) -> Nudge) -> Run {
    let mut run = run.clone();
    let grid_s = 0.5 * run.step_s;
    let change: Change = (0..run.inputs.len()).map(change).map(|[v, p, d]| [v * TRIM_M3, p * PITCH_RAD, d * DRAG_UNIT]).collect();
    for (j, i) in run.inputs.iter_mut().enumerate() {
        let [trim, pitch, drag] = change[j];
        i.sensed.ballast_m3 += trim;
        i.cd0_relative = (i.cd0_relative + drag).max(LEAST_DRAG);
        if pitch != 0.0 {
            i.sensed.pitch_rad += pitch;
            (i.sin_pitch, i.cos_pitch) = i.sensed.pitch_rad.sin_cos();
            let (before, after) = (j.saturating_sub(1), (j + 1).min(change.len() - 1));
            i.pitch_rate_rad_s += (change[after][1] - change[before][1]) / ((after - before).max(1) as f64 * grid_s);
        }
    }
    run
}

/// A change of one input, in its unit, at each instant of a run.
fn through<'a>(problem: &'a Problem, which: usize, of: impl Fn(usize, &Input) -> f64 + 'a) -> Changing<'a> {
    let nudge = move |k: usize, i: &Input| std::array::from_fn(|w| if w == which { of(k, i) } else { 0.0 });
    Rc::new(move |k| problem.runs[k].inputs.iter().map(|i| nudge(k, i)).collect())
}

/// Trim by what is `seconds` behind.
fn lagged<'a>(problem: &'a Problem, seconds: f64, of: fn(&Sensed) -> f64) -> Changing<'a> {
    Rc::new(move |k| {
        let run = problem.runs[k];
        let share = 1.0 - (-0.5 * run.step_s / seconds).exp();
        let mut behind = run.inputs.first().map_or(0.0, |i| of(&i.sensed));
        let late = |i: &Input| {
            let now = of(&i.sensed);
            behind += share * (now - behind);
            [behind - now, 0.0, 0.0]
        };
        run.inputs.iter().map(late).collect()
    })
}

/// Forms of each effect outside the catalogue, and of each form the changes that its amplitudes make.
fn kinds<'a>(problem: &'a Problem) -> Vec<(&'static str, Vec<Vec<Changing<'a>>>)> {
    let trim = |of: &'static dyn Fn(&Sensed) -> f64| vec![vec![through(problem, ON_TRIM, move |_, i| of(&i.sensed))]];
    let pitch = |of: &'static dyn Fn(&Input) -> f64| through(problem, ON_PITCH, move |_, i| of(i));
    let drag = |of: &'static dyn Fn(&Input) -> f64| vec![vec![through(problem, ON_DRAG, move |_, i| of(i))]];
    let lags = |seconds: &[f64], of: fn(&Sensed) -> f64| seconds.iter().map(|t| vec![lagged(problem, *t, of)]).collect();
    let first_s = problem.runs.first().map_or(0.0, |r| r.time_s[0]);
    let since_start = move |k: usize, i: &Input| (i.sensed.time_s - problem.runs[k].time_s[0]) / 1000.0;
    let days = move |_, i: &Input| (i.sensed.time_s - first_s) / 864_000.0;
    let warmth = problem.vehicle.constants.reference_temperature_degc;
    let headings = || problem.runs.iter().flat_map(|r| &r.inputs).map(|i| (1.0, i.sin_heading, i.cos_heading));
    let sum = headings().fold((0.0, 0.0, 0.0), |s, h| (s.0 + h.0, s.1 + h.1, s.2 + h.2));
    // On one heading all flight long this is a pitch offset or a level of drag, which have names.
    let turns = sum.1.hypot(sum.2) < ONE_HEADING * sum.0;
    let by_heading = |which: usize| {
        let both = || vec![vec![through(problem, which, |_, i| i.sin_heading), through(problem, which, |_, i| i.cos_heading)]];
        if turns { both() } else { Vec::new() }
    };
    vec![
        ("time since the start of the segment (trim)", vec![vec![through(problem, ON_TRIM, since_start)]]),
        ("day (trim)", vec![vec![through(problem, ON_TRIM, days)]]),
        ("temperature some time ago (trim)", lags(&TEMPERATURE_LAGS_S, |s| s.temperature_degc * 0.2)),
        ("density some time ago (trim)", lags(&DENSITY_LAGS_S, |s| s.density_kg_m3)),
        ("ballast some time ago (trim)", lags(&BALLAST_LAGS_S, |s| s.ballast_m3 / TRIM_M3)),
        ("pressure of enclosed air (trim)", trim(&|s| ATMOSPHERE_PA / (ATMOSPHERE_PA + s.pressure_pa.max(0.0)))),
        ("heading (pitch)", by_heading(ON_PITCH)),
        ("heading (drag)", by_heading(ON_DRAG)),
        ("depth (drag)", drag(&mpa)),
        ("depth (pitch)", vec![vec![pitch(&mpa), pitch(&|i| mpa(i).powi(2))]]),
        ("temperature (pitch)", vec![vec![through(problem, ON_PITCH, move |_, i| (i.sensed.temperature_degc - warmth) * 0.2)]]),
        ("roll (pitch)", vec![vec![pitch(&|i| i.roll_rad * 4.0)]]),
        ("side of the turn (drag)", drag(&|i| i.roll_rad * 4.0)),
    ]
}

/// Pressure, MPa.
fn mpa(i: &Input) -> f64 {
    i.sensed.pressure_pa * 1e-6
}

/// All effects outside the catalogue, given a fit.
#[must_use]
pub fn unmodelled_effects<'a>(problem: &'a Problem, fit: &Fit) -> Vec<UnmodelledEffect<'a>> {
    let constants = [ON_TRIM, ON_DRAG].map(|which| through(problem, which, |_, _| 1.0));
    let kinds = kinds(problem);
    let all: Vec<&Changing> = constants.iter().chain(kinds.iter().flat_map(|(_, forms)| forms.iter().flatten())).collect();
    let mut columns = columns_at(problem, fit, &all).into_iter().map(|c| problem.without_battery(c));
    let mut part = |changes: Changing<'a>| Part { changes, column: columns.next().unwrap_or_else(|| problem.column(0, Vec::new())) };
    let by_segment = ["segment (trim)", "segment (drag)"].into_iter().zip(constants);
    let mut out: Vec<UnmodelledEffect> =
        by_segment.map(|(variable, constant)| UnmodelledEffect { variable, forms: vec![by_run(problem, &part(constant))] }).collect();
    out.extend(kinds.into_iter().map(|(variable, forms)| UnmodelledEffect {
        variable,
        forms: forms.into_iter().map(|form| form.into_iter().map(&mut part).collect()).collect(),
    }));
    out
}

/// What a part does in each run, as a part of its own.
fn by_run<'a>(problem: &Problem, whole: &Part<'a>) -> Vec<Part<'a>> {
    let alone = |k: usize| {
        let range = problem.range(k).0;
        let of_all = whole.changes.clone();
        let changes: Changing<'a> = Rc::new(move |run| if run == k { of_all(run) } else { Change::new() });
        Part { changes, column: problem.column(range.start, whole.column.values[range].to_vec()) }
    };
    (0..problem.runs.len()).map(alone).collect()
}
