//! The whole diagnosis of one flight: prepare, fit, search, ask for a remainder, decide, measure the error before and after.
//!
//! Nothing of the check segments but their inputs is seen before the error figures are made.

mod by_history;
pub mod four_parts;
pub mod judged;
mod no_worse;
mod parts_in_words;
pub(crate) mod ranking;
pub mod report;
pub(crate) mod settle;
pub(crate) mod unknown;
pub mod verdict;

use crate::ablation::is_on;
use crate::criticism::held_out::{error_of_four_fifths, missed_near_stall, typical_error, worst_segment};
use crate::criticism::law::{Law, laws};
use crate::criticism::residual_tests::Family;
use crate::diagnosis::four_parts::FourParts;
use crate::diagnosis::judged::{Blocks, Judged, is_fitted};
pub use crate::diagnosis::ranking::Ranked;
use crate::diagnosis::ranking::rank;
use crate::diagnosis::settle::search_until_stable;
use crate::diagnosis::unknown::unknowns;
use crate::diagnosis::verdict::{Errors, Evidence, MOST_DISCREPANCY_M_S, PRACTICAL, holds_elsewhere, judge};
pub use crate::diagnosis::verdict::{Reason, Verdict};
use crate::history::file::History;
use crate::history::flight::{Said, by_history, judged};
use crate::hypotheses::candidate::{Candidate, size_at_end};
use crate::hypotheses::search::{Depth, SearchResult};
use crate::inference::estimate::estimate;
use crate::inference::evidence::{NEARLY, SPEAK_UP, TIED};
use crate::inference::gauss_newton::{Effort, fit_from};
use crate::inference::initial_guess::is_uncalibrated;
use crate::inference::posterior::Fit;
use crate::inference::unknowns::is_free;
use crate::likelihood::block_error::Predictor;
use crate::likelihood::discrepancy::Remains;
use crate::likelihood::{Column, Problem};
use crate::model::branch::Branch;
use crate::model::parameters::{State, is_law};
use crate::model::sensor_findings::{SensorFinding, not_determined, sensor_findings};
use crate::preprocess::{Prepared, prepare, sanity};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use std::sync::Arc;

/// Innovations beyond this are outliers, sigma.
pub(crate) const OUTLIER: f64 = 5.0;

/// A diagnosis.
#[derive(Debug)]
pub struct Diagnosis {
    /// What the flight says.
    pub verdict: Verdict,
    /// Why.
    pub reasons: Vec<Reason>,
    /// Effects named.
    pub answer: Vec<&'static str>,
    /// Hypotheses that are not told apart, the answer first.
    pub equivalent: Vec<Vec<&'static str>>,
    /// All hypotheses, best first.
    pub candidates: Vec<Ranked>,
    /// Probability that nothing is missing.
    pub probability_nothing: f64,
    /// Nothing missing, calibration refitted.
    pub recalibrated: State,
    /// State whose error is the error after.
    pub after: State,
    /// Block errors on the check segments, m/s: nominal, recalibrated, after; NaN where there are none.
    pub block_error_m_s: [f64; 3],
    /// Block errors on the fitted segments, m/s.
    pub fitted_error_m_s: [f64; 3],
    /// Error that ordinary water motion and sensor noise alone would leave, m/s.
    pub noise_floor_m_s: f64,
    /// Usual length of the blocks of these errors, s.
    pub block_s: f64,
    /// Rms velocity that the model is wrong by under every hypothesis, m/s; 0: none is seen.
    pub discrepancy_m_s: f64,
    /// What it follows, largest first.
    pub remains: Vec<Remains>,
    /// Sensors that are found to be off.
    pub sensors: Vec<SensorFinding>,
    /// Effects outside the catalogue given the best hypothesis, strongest first.
    pub remainder: Vec<Family>,
    /// Where something without a name leads: laws that describe it, not told apart, best first.
    pub laws: Vec<Law>,
    /// Whether check segments were named by the vehicle file (else they were chosen here, or none could be).
    pub check: Vec<u32>,
    /// What had to be repaired or could not be told.
    pub notes: Vec<String>,
    /// Cleaned flight.
    pub prepared: Arc<Prepared>,
    /// Mean square of innovations at the answer, 1 for noise.
    pub misfit: f64,
    /// Innovations that were fitted, and rows left out near the stall.
    pub rows: usize,
    /// Rows left out near the stall.
    pub rows_near_stall: usize,
    /// Rms of the ordinary water motion that was used, relative to the vehicle file's.
    pub colour: f64,
    /// Which branch the model was taken to be on beyond the valid angle of attack.
    pub branch: Branch,
    /// Likeness of signatures.
    pub likeness: Vec<(&'static str, &'static str, f64)>,
    /// What moved, what could hide, and what the refitted polar is worth.
    pub parts: FourParts,
    /// What the history of the vehicle says of it; none without a steady dive.
    pub history: Option<Said>,
}

/// Which segments are for checking: those the file names, else every fourth of at least four.
#[must_use]
pub fn check_segments(vehicle: &Vehicle, prepared: &Prepared, notes: &mut Vec<String>) -> Vec<u32> {
    let mut present: Vec<u32> = prepared.runs.iter().filter(|r| r.used.iter().any(|u| *u)).map(|r| r.segment).collect();
    present.dedup();
    let named: Vec<u32> = vehicle.check_segments.iter().copied().filter(|s| present.contains(s)).collect();
    if !named.is_empty() {
        return named;
    }
    if present.len() >= 4 {
        let why =
            if vehicle.check_segments.is_empty() { "the vehicle file names no check segments" } else { "no check segment can be used" };
        notes.push(format!("{why}: every fourth segment was kept out of the fit"));
        return present.into_iter().skip(2).step_by(4).collect();
    }
    notes.push("too few segments to keep some out of the fit: errors are of the fitted data".into());
    Vec::new()
}

/// A flight on which nothing can be asked.
#[derive(Debug)]
pub struct NothingToFit(String);

impl NothingToFit {
    /// For this reason.
    pub(crate) fn because(why: impl Into<String>) -> Self {
        Self(why.into())
    }
}

impl std::fmt::Display for NothingToFit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NothingToFit {}

/// Fewest rows under way that a diagnosis is made on.
const FEWEST_ROWS_UNDER_WAY: usize = 40;
/// Fewest of them that are left when those near the stall are out.
pub(crate) const FEWEST_COMPARED: usize = 20;

/// The fit of a flight made ready: rows near the stall and outliers out, the size of the water motion settled. Also the fit of the
/// calibration alone.
///
/// # Errors
/// No dive in the flight that a model could be compared with.
pub fn prepared_problem<'a>(
    flight: &Flight,
    vehicle: &'a Vehicle,
    prepared: &'a Prepared,
    check: &[u32],
    notes: &mut Vec<String>,
) -> Result<(Problem<'a>, Fit), NothingToFit> {
    let fitted = |s: u32| is_fitted(vehicle, check, s);
    let mut problem = Problem::new(prepared, vehicle, fitted);
    let all = prepared.runs.iter().filter(|r| fitted(r.segment)).count();
    if problem.runs.len() < all {
        notes.push(format!("{} of {all} dives, spread evenly over the flight, are fitted", problem.runs.len()));
    }
    let under_way: usize = problem.runs.iter().map(|r| r.used.iter().filter(|u| **u).count()).sum();
    if under_way < FEWEST_ROWS_UNDER_WAY {
        return Err(NothingToFit(format!(
            "{}: only {under_way} rows deeper than 2 m and a minute under way in the segments to fit; at least {FEWEST_ROWS_UNDER_WAY} are needed (is pressure in dbar? does the log hold a dive?)",
            flight.name
        )));
    }
    if let Some(why) = sanity::contradiction(prepared).or_else(|| sanity::cannot_dive(prepared, vehicle)) {
        return Err(NothingToFit(format!("{}: {why}", flight.name)));
    }
    problem.start = crate::inference::initial_guess::find(&problem);
    let null_fit = |problem: &Problem| fit_from(problem, &problem.start, Effort::of(3));
    let first = null_fit(&problem);
    let second = if problem.settle_continuation(&first.state) > 0 { null_fit(&problem) } else { first };
    let outliers = problem.drop_outliers(&problem.innovations(&second.residual), OUTLIER);
    if outliers > 0 {
        notes.push(format!("{outliers} lone samples beyond {OUTLIER} sigma left out of the fit"));
    }
    problem.tune_colour(&second.state);
    problem.scale_moment_noise(&second.state);
    Ok((problem, second))
}

/// Diagnoses a flight, looking for as many effects at once as `depth` says. `tick` is told what is being done and which share is done.
///
/// # Errors
/// No dive in the flight that a model could be compared with.
pub fn diagnose(flight: &Flight, vehicle: &Vehicle, depth: Depth, tick: &dyn Fn(&str, f64)) -> Result<Diagnosis, NothingToFit> {
    diagnose_by(None, flight, vehicle, depth, tick)
}

/// The same by a history and its name instead of the one next to the vehicle file.
///
/// # Errors
/// No dive in the flight that a model could be compared with.
pub fn diagnose_by(
    history: Option<(&History, &str)>,
    flight: &Flight,
    vehicle: &Vehicle,
    depth: Depth,
    tick: &dyn Fn(&str, f64),
) -> Result<Diagnosis, NothingToFit> {
    let mut said = of_this_flight(flight, vehicle, depth, tick)?;
    // Last, in memory that the fits have given back.
    let judged = match history {
        Some((history, name)) => by_history(history, name, flight, vehicle),
        None => judged(flight, vehicle, &mut said.notes),
    };
    said.take_history(judged);
    for name in said.answer.iter().filter(|name| vehicle.effects.iter().any(|a| a.effect.name == **name)) {
        said.notes
            .push(format!("the vehicle file has {name} already: what is named is a change of it; `glider add {name}` fits all of it anew"));
    }
    Ok(said)
}

/// What the fits of this flight say, without a history.
fn of_this_flight(flight: &Flight, vehicle: &Vehicle, depth: Depth, tick: &dyn Fn(&str, f64)) -> Result<Diagnosis, NothingToFit> {
    tick("reading the inputs", 0.0);
    let prepared = Arc::new(prepare(flight, vehicle));
    let mut notes = prepared.notes.clone();
    let check = check_segments(vehicle, &prepared, &mut notes);
    let (mut problem, _) = prepared_problem(flight, vehicle, &prepared, &check, &mut notes)?;
    let mut found = search_until_stable(&mut problem, depth, tick);
    found.name_most_important_first();
    tick("what remains", 0.97);
    let rows_near_stall = problem.rows_near_stall();
    if rows_near_stall > 0 {
        notes.push(format!(
            "{rows_near_stall} rows near or beyond the stall (angle of attack over 0.35 rad in the model) left out of the fit"
        ));
    }
    let compared = problem.rows_compared();
    if compared < FEWEST_COMPARED {
        return Err(NothingToFit(format!(
            "{}: {compared} rows are left to compare once {rows_near_stall} near or beyond the stall in the model are left out; at least {FEWEST_COMPARED} are needed: longer dives or steeper pitch settings show more",
            flight.name
        )));
    }
    if rows_near_stall > compared {
        notes.push(format!("what is said is said of {compared} rows; more than those were left out"));
    }
    Ok(conclude(vehicle, &prepared, &problem, &found, &check, notes))
}

/// The best of these hypotheses, best first, where it is worth naming.
pub(crate) fn worth_naming(candidates: &[Candidate]) -> Option<&Candidate> {
    candidates.first().filter(|best| is_worth_naming(best))
}

fn is_worth_naming(c: &Candidate) -> bool {
    c.log_odds > SPEAK_UP
}

/// The named set that is spoken of: the best where it is worth naming. Where the model has a discrepancy of its own, the likeliest set
/// whose recalibration is one that vehicles scatter by, of which each effect lowers the error of all blocks by a practical share, and
/// which is no worse than nothing named on dives that were kept out. (A recalibration that no vehicle scatters by is no alternative to
/// a name, however well it does.) Also what the best lowers the error by, where nothing is named.
fn spoken_of<'a>(predictor: &Predictor<'a, '_>, found: &'a SearchResult, blocks: [&Blocks; 2]) -> (Option<&'a Candidate>, Option<f64>) {
    let problem = predictor.problem;
    let Some(best) = worth_naming(&found.candidates) else { return (None, None) };
    if problem.discrepancy.size_m_s == 0.0 || !is_on("practical") {
        return (Some(best), None);
    }
    let lowers = |with: &'a Fit, without: &'a Fit| {
        let [with, without] = errors_of_all(predictor, [with, without], blocks);
        1.0 - with / without
    };
    let ordinary = |fit: &Fit| !is_on("ordinary_only") || is_ordinary(problem.vehicle, &fit.state);
    let null_is_sound = ordinary(&found.null);
    let worth: Vec<&'a Candidate> = found.candidates.iter().filter(|c| is_worth_naming(c)).collect();
    let pays = |c: &'a Candidate| {
        let parts = worth.iter().filter(|p| p.effects.len() < c.effects.len() && c.has_all_of(p)).map(|p| &p.fit);
        parts.chain(null_is_sound.then_some(&found.null)).all(|without| lowers(&c.fit, without) > PRACTICAL)
    };
    let holds = |c: &'a Candidate| {
        let on_check = || predictor.errors(&[&c.fit, &found.null].map(parts), blocks[1], false);
        let no_worse = || matches!(*on_check(), [answer, nothing] if holds_elsewhere([answer, nothing], floor_m_s(problem)));
        c.fit.state.wave.is_some() || blocks[1].is_empty() || no_worse()
    };
    match worth.iter().find(|c| ordinary(&c.fit) && pays(c) && holds(c)) {
        Some(sound) => (Some(sound), None),
        None if null_is_sound => (None, Some(lowers(&best.fit, &found.null))),
        None => (Some(best), None),
    }
}

/// Rms over fitted and check blocks of two fits, m/s; a wave's phase is known in fitted ones only, which judge it alone.
fn errors_of_all<'a>(predictor: &Predictor<'a, '_>, fits: [&'a Fit; 2], [fitted, check]: [&Blocks; 2]) -> [f64; 2] {
    let wave = fits.iter().any(|f| f.state.wave.is_some());
    let all: Blocks = if wave { fitted.clone() } else { fitted.iter().chain(check).cloned().collect() };
    let errors = predictor.errors(&fits.map(parts), &all, wave);
    [errors[0], errors[1]]
}

/// What an error is made of.
fn parts(fit: &Fit) -> (&State, &Column) {
    (&fit.state, &fit.residual)
}

/// What water, sensors and discrepancy would leave, m/s.
fn floor_m_s(problem: &Problem) -> f64 {
    problem.noise_floor_m_s().hypot(problem.discrepancy.size_m_s.min(MOST_DISCREPANCY_M_S))
}

/// Errors of the best hypothesis and of nothing missing.
fn errors<'a>(predictor: &Predictor<'a, '_>, fits: [&'a Fit; 2], blocks: [&Blocks; 2]) -> Errors {
    let (problem, prepared) = (predictor.problem, predictor.prepared);
    let [fitted, check] = blocks;
    let wave = fits[0].state.wave.is_some();
    let states = fits.map(|f| &f.state);
    let pair = |v: Vec<f64>| [v[0], v[1]];
    // A wave's phase on check segments is unknown, and so is the branch of a stall.
    let tellable = !wave && problem.rows_near_stall() < problem.data.len() / 10;
    let kept_out = |state: &State, blocks: &[_]| problem.residuals_near_stall_and_elsewhere(prepared, state, blocks);
    let typical = states.map(|s| if tellable { typical_error(&kept_out(s, check)) } else { f64::NAN });
    let of_one = |of| error_of_four_fifths(&kept_out(states[0], std::slice::from_ref(of)));
    let named = !fits[0].state.effects.is_empty() || wave;
    let worst = if tellable || !named { check.iter().map(of_one).fold(f64::NAN, f64::max) } else { f64::NAN };
    Errors {
        check_m_s: pair(predictor.errors(&fits.map(parts), check, false)),
        fitted_m_s: pair(predictor.errors(&fits.map(parts), fitted, true)),
        typical_m_s: typical,
        worst_segment_m_s: worst,
        floor_m_s: floor_m_s(problem),
    }
}

/// Sets that are not told apart from the first, itself first.
fn equivalent_to(first: &Candidate, candidates: &[Candidate]) -> Vec<Vec<&'static str>> {
    // A part of the answer may do as well as all of it. A larger set only adds: it is one where it is nearly as likely as not.
    let part = |c: &Candidate| c.effects.len() < first.effects.len() && first.has_all_of(c);
    let same = |c: &Candidate| c.effects.len() == first.effects.len();
    let equivalent = |c: &&Candidate| {
        let behind = first.log_odds - c.log_odds;
        ((same(c) || part(c)) && behind < TIED) || (c.adds_one_to(first) && behind < NEARLY)
    };
    let others = candidates.iter().filter(|c| !std::ptr::eq(*c, first)).filter(equivalent);
    std::iter::once(first.effects.clone()).chain(others.take(2).map(|c| c.effects.clone())).collect()
}

/// The blocks that are judged: of flight away from the stall, for beyond it a model may be on another branch. Where nothing named stalls
/// all along, that is its failure: the best alone says what is near the stall then.
fn judged_blocks(problem: &Problem, prepared: &Prepared, null: &Fit, best: &Fit, of: &Blocks) -> Blocks {
    let away_of = |states: &[&State]| states.iter().fold(of.clone(), |b, s| problem.away_from_stall(prepared, s, &b));
    let both = away_of(&[&null.state, &best.state]);
    if both.iter().any(|(_, blocks)| !blocks.is_empty()) { both } else { away_of(&[&best.state]) }
}

/// What is said of near the stall, of the noise, of moments, and of numbers that the flight does not determine.
fn notes_of(problem: &Problem, prepared: &Prepared, best: &State, after: &State, kept_out: &Blocks, floor_m_s: f64) -> Vec<String> {
    let near_stall = problem.residuals_near_stall_and_elsewhere(prepared, after, kept_out);
    let mut notes: Vec<String> = missed_near_stall(&near_stall, floor_m_s).into_iter().collect();
    notes.extend(problem.depth_noise_said());
    notes.extend(problem.moments_said(best));
    notes.extend(not_determined(problem.vehicle, best));
    notes
}

/// The diagnosis that a search comes to.
fn conclude(
    vehicle: &Vehicle,
    prepared: &Arc<Prepared>,
    problem: &Problem,
    found: &SearchResult,
    check: &[u32],
    mut notes: Vec<String>,
) -> Diagnosis {
    let SearchResult { null, candidates, likeness, used_up } = found;
    let whole = Judged::of(prepared, vehicle, check);
    let (fit_blocks, check_blocks) = (&whole.fitted, &whole.kept_out);
    let best = worth_naming(candidates).map_or(null, |c| &c.fit);
    let judged = [fit_blocks, check_blocks].map(|of| judged_blocks(problem, prepared, null, best, of));
    let blocks = [&judged[0], &judged[1]];
    let predictor = Predictor::new(problem, prepared);
    let (named, too_small) = spoken_of(&predictor, found, blocks);
    let best = named.map_or(null, |c| &c.fit);
    let unknowns = unknowns(problem, found, named);
    let equivalent = named.map_or_else(Vec::new, |first| equivalent_to(first, candidates));
    let errors = errors(&predictor, [best, null], blocks);
    let evidence = Evidence {
        named: named.map(|c| c.log_odds),
        too_small,
        at_bound: named.and_then(|c| pressed(&c.fit)),
        equivalent: equivalent.len(),
        may_be_none: named.and_then(|c| may_be_none(&c.fit)),
        unknown_leads: unknowns.leads,
        errors,
        wave: best.state.wave.is_some(),
        mean_square: best.mean_square(),
        has_temperature: prepared.has_temperature,
        used_up: *used_up,
    };
    let (verdict, reasons) = judge(&evidence);
    notes.extend(reasons.iter().map(|r| format!("{}: {}", verdict.name(), r.text())));
    if reasons.iter().any(|r| r.code() == "held_out_too_large") {
        notes.push(format!("the check segments one by one{}", worst_segment(problem, prepared, &best.state, check_blocks)));
    }
    let stands = matches!(verdict, Verdict::Explained | Verdict::Ambiguous);
    let answer = named.filter(|_| stands).map_or_else(Vec::new, |c| c.effects.clone());
    let after = if answer.is_empty() { null.state.clone() } else { best.state.clone() };
    notes.extend(notes_of(problem, prepared, &best.state, &after, check_blocks, errors.floor_m_s));
    let ranking = rank(problem, prepared, found, &after, &whole);
    let sigma = |i: usize| best.covariance[(i, i)].max(0.0).sqrt();
    let of = usize::from(answer.is_empty());
    let parts = FourParts::of(problem, [best, null][of], errors.fitted_m_s[of].max(errors.check_m_s[of]));
    Diagnosis {
        verdict,
        reasons,
        answer,
        equivalent: if verdict == Verdict::Unexplained { Vec::new() } else { equivalent },
        candidates: ranking.candidates,
        probability_nothing: ranking.probability_nothing,
        recalibrated: null.state.clone(),
        block_error_m_s: ranking.block_error_m_s,
        fitted_error_m_s: ranking.fitted_error_m_s,
        after,
        noise_floor_m_s: problem.noise_floor_m_s(),
        block_s: problem.block_s(),
        discrepancy_m_s: problem.discrepancy.size_m_s,
        sensors: sensor_findings(vehicle, &best.state, sigma, prepared.clock_shift_s),
        remains: problem.discrepancy_by_group(&best.residual),
        laws: if verdict == Verdict::Unexplained { laws(problem, best) } else { Vec::new() },
        remainder: unknowns.remainder,
        check: check.to_vec(),
        notes,
        prepared: prepared.clone(),
        branch: problem.branch,
        misfit: best.mean_square(),
        rows: problem.data.len(),
        rows_near_stall: problem.rows_near_stall(),
        colour: problem.colour.rms_m_s / vehicle.background.0,
        likeness: likeness.clone(),
        parts,
        history: None,
    }
    .with_vehicle_check(vehicle)
    .no_worse_than_the_file()
}

/// Tolerances up to which vehicles scatter (flight format, section 5).
const ORDINARY_TOLERANCES: f64 = 3.0;

/// Whether a state moves no calibration number by more than vehicles scatter.
fn is_ordinary(vehicle: &Vehicle, state: &State) -> bool {
    let uncalibrated = is_uncalibrated(vehicle);
    let counts = |k: usize| is_law(k) && !is_free(uncalibrated, k);
    state.calibration.iter().enumerate().all(|(k, z)| !counts(k) || z.abs() <= ORDINARY_TOLERANCES)
}

/// An effect of a fit of which the interval of the size holds none.
fn may_be_none(fit: &Fit) -> Option<&'static str> {
    let holds = |s: &&(usize, usize, f64)| {
        let (e, off) = (estimate(fit, **s), fit.state.effects[s.0].effect.parameters[0].off);
        s.1 == 0 && e.low <= off && off <= e.high
    };
    fit.sigma.iter().find(holds).map(|s| fit.state.effects[s.0].effect.name)
}

/// The effect of a fit whose size is pressed against the end of what is possible by more than chance.
fn pressed(fit: &Fit) -> Option<&'static str> {
    /// Standard deviations by which the likelihood pulls outwards.
    const PRESSED: f64 = 2.0;
    let sigma = |k: usize| fit.sigma.iter().find(|s| (s.0, s.1) == (k, 0)).map_or(0.0, |s| s.2);
    let is = |p: &&(usize, f64)| p.1 * sigma(p.0) > PRESSED && size_at_end(&fit.state.effects[p.0]);
    fit.pressed.iter().find(is).map(|(k, _)| fit.state.effects[*k].effect.name)
}

impl Diagnosis {
    fn with_vehicle_check(mut self, vehicle: &Vehicle) -> Self {
        self.notes.extend(vehicle.misplaced.iter().map(|what| format!("vehicle file: {what}")));
        if !vehicle.assumed.is_empty() {
            self.notes.push(format!("the vehicle file does not state, and these were assumed: {}", vehicle.assumed.join(", ")));
        }
        self
    }
}
