//! Effects that have no name in the vocabulary: asked, so that the tool can say that something else is there, never answered.
//!
//! Each is a change of the model's inputs (trim, pitch), run through the model at a fitted state; its whitened signature is offered to
//! the residual like the families of [`crate::remainder`], and what the best of it really gains is then seen by flying it. They are
//! what gliders are known to do beside the catalogue: trim that is not repeatable or leaks away, a hull or a conductivity cell that
//! follows the water's temperature late, water that is exchanged late, an engine that lags its reading, air that pressure shrinks, a
//! pitch sensor that depends on heading (soft iron), pressure or roll, or whose clock is not that of the pressure sensor.

use crate::calibration::{N_CALIBRATION, State};
use crate::evidence::log_mean_exp;
use crate::fit::Ground;
use crate::prepare::{Input, Run};
use crate::problem::{Column, Problem};
use crate::signature::Offer;
use hydro::effects::Sensed;
use nalgebra::DVector;

/// Unit of a change of trim, m³: ten cm³, what a glider's trim is known to.
const TRIM_M3: f64 = 10e-6;
/// Unit of a change of pitch, rad: half a degree.
const PITCH_RAD: f64 = 0.01;
/// Share of a unit that signatures are differenced over.
const STEP: f64 = 0.2;
/// Amplitudes that are believed in, in these units, 1 sigma.
const SCALES: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0];
/// Log Bayes factor from which the gain is checked by flying it.
const WORTH_FLYING: f64 = 4.0;
/// Shares of the linear step that are flown.
const SHARES: [f64; 3] = [1.0, 0.6, 0.3];
/// Lags of temperature, s: cells of conductivity sensors 20 to 60 s (Garau et al. 2011), hulls and oil some minutes (guess).
const TEMPERATURE_LAGS_S: [f64; 5] = [20.0, 60.0, 150.0, 400.0, 900.0];
/// Lags of the water in free-flooding spaces, s (guess).
const DENSITY_LAGS_S: [f64; 4] = [20.0, 60.0, 180.0, 500.0];
/// Lags of the buoyancy engine behind its reading, s (guess).
const BALLAST_LAGS_S: [f64; 3] = [5.0, 15.0, 40.0];
/// Unit of a pitch that is late, s: what clocks of two computers are apart.
const LATE_S: f64 = 1.0;
/// Mean of the unit vectors along the headings from which the heading hardly varies (1: not at all): 0.97 is some 14 degrees rms.
const ONE_HEADING: f64 = 0.97;
/// Pressure of the atmosphere, Pa.
const ATMOSPHERE_PA: f64 = 101_325.0;

/// Change of trim and of pitch of every input of a run, in their units.
type Change = Vec<(f64, f64)>;

/// One amplitude of a stranger: the change it makes in each run, and its whitened signature.
struct Part {
    changes: Vec<Change>,
    column: Column,
}

/// A kind of stranger; each of its forms has one or several amplitudes.
pub struct Stranger {
    /// Which variable it follows, and through what it acts.
    pub variable: &'static str,
    forms: Vec<Vec<Part>>,
}

impl Stranger {
    /// Log Bayes factor of this stranger beside a fit, averaged over forms and sizes; the best of them as it flies, the others as
    /// linear theory has them.
    #[must_use]
    pub fn log_bayes(&self, problem: &Problem, ground: &Ground) -> f64 {
        let mut all = Vec::new();
        let mut best = None;
        let mut best_told = f64::NEG_INFINITY;
        for form in &self.forms {
            let offer = Offer::new(&form.iter().map(|p| &p.column).collect::<Vec<_>>(), ground);
            let told = SCALES.map(|s| (offer.log_bayes(s), s));
            all.extend(told.map(|t| t.0));
            let top = told.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NEG_INFINITY, 1.0));
            if top.0 > best_told {
                best_told = top.0;
                best = Some((form, offer, top.1));
            }
        }
        let linear = log_mean_exp(&all);
        match best {
            Some((form, offer, scale)) if linear > WORTH_FLYING => linear - flown_short(problem, ground, form, &offer, scale),
            _ => linear,
        }
    }
}

/// By how much the gain of a form as it flies falls short of what linear theory promises, in log evidence (never below 0).
fn flown_short(problem: &Problem, ground: &Ground, form: &[Part], offer: &Offer, scale: f64) -> f64 {
    let n = form.len();
    let mut gram = offer.gram();
    for i in 0..n {
        gram[(i, i)] += 1.0 / (scale * scale);
    }
    let Some(c) = gram.cholesky() else { return f64::INFINITY };
    let amplitude = c.solve(&offer.match_);
    let promised = offer.match_.dot(&amplitude);
    // The calibration gives way: what the form takes of each number's signature.
    let base = &ground.fit.columns;
    let pulled = DVector::from_fn(base.len(), |i, _| {
        ground.fit.gradient[i] - (0..n).map(|j| base[i].dot(&form[j].column) * amplitude[j]).sum::<f64>()
    });
    let give = ground.curvature.solve(&pulled);
    let prior = |z: &[f64; N_CALIBRATION]| z.iter().map(|z| z * z).sum::<f64>();
    let misfit = |r: &mut dyn Iterator<Item = f64>| r.map(|r| r * r).sum::<f64>();
    let before = prior(&ground.fit.state.calibration) + misfit(&mut ground.fit.residual.iter().copied());
    let states = SHARES.map(|share| {
        let mut state = ground.fit.state.clone();
        (0..N_CALIBRATION).for_each(|i| state.calibration[i] += share * give[i]);
        state
    });
    let mut models = SHARES.map(|_| Vec::with_capacity(problem.data.len()));
    for k in 0..problem.runs.len() {
        let total = |share: f64, j: usize| {
            form.iter().zip(amplitude.iter()).fold((0.0, 0.0), |sum, (part, a)| {
                let (v, p) = part.changes[k].get(j).copied().unwrap_or_default();
                (sum.0 + share * a * v, sum.1 + share * a * p)
            })
        };
        let asked: Vec<(&State, Run)> =
            SHARES.iter().zip(&states).map(|(share, s)| (s, nudged(problem.runs[k], |j| total(*share, j)))).collect();
        models.iter_mut().zip(problem.answers_to(k, &asked)).for_each(|(model, answer)| model.extend(answer));
    }
    let gain = |((share, state), model): ((f64, &State), &Vec<f64>)| {
        let size: f64 = amplitude.iter().map(|a| (share * a / scale).powi(2)).sum();
        before - prior(&state.calibration) - misfit(&mut problem.data.iter().zip(model).map(|(d, m)| d - m)) - size
    };
    let flown = SHARES.into_iter().zip(&states).zip(&models).map(gain).filter(|g| g.is_finite()).fold(0.0, f64::max);
    0.5 * (promised - flown).max(0.0)
}

/// A run with trim and pitch changed by so many of their units at each of its inputs.
fn nudged(run: &Run, change: impl Fn(usize) -> (f64, f64)) -> Run {
    let mut run = run.clone();
    let grid_s = 0.5 * run.step_s;
    let change: Change = (0..run.inputs.len()).map(change).map(|(v, p)| (v * TRIM_M3, p * PITCH_RAD)).collect();
    for (j, i) in run.inputs.iter_mut().enumerate() {
        let (trim, pitch) = change[j];
        i.sensed.ballast_m3 += trim;
        if pitch != 0.0 {
            i.sensed.pitch_rad += pitch;
            (i.sin_pitch, i.cos_pitch) = i.sensed.pitch_rad.sin_cos();
            let (before, after) = (j.saturating_sub(1), (j + 1).min(change.len() - 1));
            i.pitch_rate_rad_s += (change[after].1 - change[before].1) / ((after - before).max(1) as f64 * grid_s);
        }
    }
    run
}

/// All strangers at a state.
#[must_use]
pub fn strangers(problem: &Problem, at: &State) -> Vec<Stranger> {
    let base = problem.model(at);
    let runs = problem.runs.len();
    let each = |change: &dyn Fn(usize) -> Change| -> Vec<Change> { (0..runs).map(change).collect() };
    let trim = |of: &dyn Fn(usize, &Sensed) -> f64| each(&|k| problem.runs[k].inputs.iter().map(|i| (of(k, &i.sensed), 0.0)).collect());
    let pitch = |of: &dyn Fn(&Input) -> f64| each(&|k| problem.runs[k].inputs.iter().map(|i| (0.0, of(i))).collect());
    let lagged = |seconds: f64, of: &dyn Fn(&Sensed) -> f64| {
        each(&|k| {
            let run = problem.runs[k];
            let share = 1.0 - (-0.5 * run.step_s / seconds).exp();
            let mut behind = run.inputs.first().map_or(0.0, |i| of(&i.sensed));
            let late = |i: &Input| {
                let now = of(&i.sensed);
                behind += share * (now - behind);
                (behind - now, 0.0)
            };
            run.inputs.iter().map(late).collect()
        })
    };
    let lags = |seconds: &[f64], of: &dyn Fn(&Sensed) -> f64| seconds.iter().map(|t| vec![lagged(*t, of)]).collect();
    let first_s = problem.runs.first().map_or(0.0, |r| r.time_s[0]);
    let start_s = |k: usize| problem.runs[k].time_s[0];
    let mpa = |i: &Input| i.sensed.pressure_pa * 1e-6;
    let constant = trim(&|_, _| 1.0);
    let headings = || problem.runs.iter().flat_map(|r| &r.inputs).map(|i| (1.0, i.sin_heading, i.cos_heading));
    let sum = headings().fold((0.0, 0.0, 0.0), |s, h| (s.0 + h.0, s.1 + h.1, s.2 + h.2));
    // On one heading all flight long this is a pitch offset, which has a name.
    let turns = sum.1.hypot(sum.2) < ONE_HEADING * sum.0;
    let by_heading = if turns { vec![vec![pitch(&|i| i.sin_heading), pitch(&|i| i.cos_heading)]] } else { Vec::new() };
    // Forms of each, and of each form the changes that its amplitudes make.
    let kinds: Vec<(&'static str, Vec<Vec<Vec<Change>>>)> = vec![
        ("time since the start of the segment (trim)", vec![vec![trim(&|k, s| (s.time_s - start_s(k)) / 1000.0)]]),
        ("day (trim)", vec![vec![trim(&|_, s| (s.time_s - first_s) / 864_000.0)]]),
        ("temperature some time ago (trim)", lags(&TEMPERATURE_LAGS_S, &|s| s.temperature_degc * 0.2)),
        ("density some time ago (trim)", lags(&DENSITY_LAGS_S, &|s| s.density_kg_m3)),
        ("ballast some time ago (trim)", lags(&BALLAST_LAGS_S, &|s| s.ballast_m3 / TRIM_M3)),
        ("pressure of enclosed air (trim)", vec![vec![trim(&|_, s| ATMOSPHERE_PA / (ATMOSPHERE_PA + s.pressure_pa.max(0.0)))]]),
        ("heading (pitch)", by_heading),
        ("depth (pitch)", vec![vec![pitch(&mpa), pitch(&|i| mpa(i).powi(2))]]),
        ("roll (pitch)", vec![vec![pitch(&|i| i.roll_rad * 4.0)]]),
        ("rate of pitch (its clock is early or late)", vec![vec![pitch(&|i| LATE_S * i.pitch_rate_rad_s / PITCH_RAD)]]),
    ];
    let all: Vec<&Vec<Change>> = std::iter::once(&constant).chain(kinds.iter().flat_map(|(_, forms)| forms.iter().flatten())).collect();
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(base.len()); all.len()];
    for k in 0..runs {
        let stepped = |changes: &&Vec<Change>| {
            let change = &changes[k];
            (at, nudged(problem.runs[k], |j| (STEP * change[j].0, STEP * change[j].1)))
        };
        let from = problem.range(k).0.start;
        let asked: Vec<(&State, Run)> = all.iter().map(stepped).collect();
        for (column, answer) in columns.iter_mut().zip(problem.answers_to(k, &asked)) {
            column.extend(answer.iter().zip(&base[from..]).map(|(a, b)| (a - b) / STEP));
        }
    }
    let mut columns = columns.into_iter();
    let mut part = |changes: Vec<Change>| Part { changes, column: Column { from: 0, values: columns.next().unwrap_or_default() } };
    let mut out = vec![Stranger { variable: "segment (trim)", forms: vec![by_run(problem, &part(constant))] }];
    out.extend(kinds.into_iter().map(|(variable, forms)| Stranger {
        variable,
        forms: forms.into_iter().map(|form| form.into_iter().map(&mut part).collect()).collect(),
    }));
    out
}

/// What a part does in each run, as a part of its own.
fn by_run(problem: &Problem, whole: &Part) -> Vec<Part> {
    let alone = |k: usize| {
        let range = problem.range(k).0;
        let mut changes = vec![Change::new(); problem.runs.len()];
        changes[k].clone_from(&whole.changes[k]);
        Part { changes, column: Column { from: range.start, values: whole.column.values[range].to_vec() } }
    };
    (0..problem.runs.len()).map(alone).collect()
}
