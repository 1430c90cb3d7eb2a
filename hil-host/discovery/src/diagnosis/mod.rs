//! The whole diagnosis of one flight: prepare, fit, search, ask for a remainder, decide, measure the error before and after.
//!
//! Nothing of the check segments but their inputs is seen before the error figures are made.

pub mod hull_lag;
pub mod report;
pub(crate) mod settle;

use crate::criticism::held_out::{error_of_four_fifths, missed_near_stall, typical_error, worst_segment};
use crate::criticism::plausibility::unlike;
use crate::criticism::residual_tests::{Family, families};
use crate::diagnosis::settle::look;
use crate::hypotheses::candidate::{Candidate, has_guessed_form};
use crate::hypotheses::search::{Depth, Found, prior_of};
use crate::inference::estimate::{Estimate, estimates};
use crate::inference::evidence::{NEARLY, TIED, log_evidence};
use crate::inference::gauss_newton::{Effort, Fit, beyond_limits, fit_from};
use crate::likelihood::block_error::{Block, blocks};
use crate::likelihood::stall_mask::TRUSTED;
use crate::likelihood::{Problem, block_errors};
use crate::model::branch::Branch;
use crate::model::internal_wave::ordinary_amplitude_m_s;
use crate::model::parameters::State;
use crate::preprocess::{Prepared, prepare, sanity};
use crate::record::flight::Flight;
use crate::vehicle::Vehicle;
use hydro::effects::WAVE;

/// Log odds from which a hypothesis is named: ten to one. A tool that names what is not there is not asked twice; a weak effect that
/// goes unnamed shows in a longer flight.
const SPEAK_UP: f64 = std::f64::consts::LN_10;
/// The same where its form is guessed, 55 to one: a law of nature that is not quite ours looks like it. Between the two one such name in
/// three was right on flights that others simulated, and two of three false alarms were there.
const SPEAK_UP_GUESSED: f64 = 4.0;
/// How much more where more rows are left out than compared: the model is wrong about most of the flight.
const SPEAK_UP_THIN: f64 = 6.0;
/// Log Bayes factor a family of the remainder needs.
const REMAINS: f64 = 9.0;
/// And its share of what the best hypothesis explained: forms of nature differ from ours by that much.
const REMAINS_SHARE: f64 = 0.12;
/// Or a mean square of innovations (1 for noise) that no difference of form explains.
const REMAINS_MISFIT: f64 = 1.3;
/// Share of the explained misfit that a difference of form may leave; a wave is never quite a sine.
const FORM_MISFIT: f64 = 0.02;
const FORM_MISFIT_WAVE: f64 = 0.1;
/// Error on the check segments, typical of all or within four fifths of one, in noise floors, from which an answer has failed: where one
/// was right it was below 2.7 in 227 flights of others, and below 2.2 in 51 clean ones.
const FAILS: f64 = 3.0;
/// The same relative to nothing missing: an answer that makes it worse is none.
const WORSE: f64 = 1.3;
/// Mean square of innovations beyond which no verdict but unexplained is honest.
const FAR_FROM_NOISE: f64 = 2.5;
/// Log Bayes factor from which a family may tell the story better than any name does.
const TELLS: f64 = 6.0;
/// What it must be better by than the best name: log odds, and share of them. On simulated flights the right name is ahead by 3 and
/// more; a hypothesis with a wave by 20, and a wrong one with a wave, which follows anything slow, by 7 at most.
const FAMILY_HANDICAP: f64 = 1.0;
const FAMILY_HANDICAP_WAVE: f64 = -10.0;
const FAMILY_SHARE: f64 = 0.01;
/// Hypotheses that get full figures, for a reader to look at; the others are only ranked.
const SHOWN: usize = 12;
/// Innovations beyond this are outliers, sigma.
pub(crate) const OUTLIER: f64 = 5.0;
/// What the flight says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing but scatter.
    Adequate,
    /// The first candidate is what is missing.
    Explained,
    /// One of the tied candidates is.
    Ambiguous,
    /// Something is missing that no candidate explains.
    Unexplained,
}

impl Verdict {
    /// Name in the report.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Explained => "explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
        }
    }
}

/// One hypothesis in the report.
#[derive(Clone, Debug)]
pub struct Ranked {
    /// Its effects.
    pub effects: Vec<&'static str>,
    /// Parameters with intervals.
    pub parameters: Vec<Estimate>,
    /// Block error on the fitted segments, m/s.
    pub error_fitted_m_s: f64,
    /// Block error on the check segments, m/s.
    pub error_check_m_s: f64,
    /// Probability among all hypotheses.
    pub probability: f64,
    /// Log odds against nothing missing.
    pub log_odds: f64,
    /// Fall of chi².
    pub gain: f64,
    /// Where the model is.
    pub state: State,
}

/// A diagnosis.
#[derive(Debug)]
pub struct Diagnosis {
    /// What the flight says.
    pub verdict: Verdict,
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
    /// What remains after the best hypothesis, strongest first.
    pub remainder: Vec<Family>,
    /// Whether check segments were named by the vehicle file (else they were chosen here, or none could be).
    pub check: Vec<u32>,
    /// What had to be repaired or could not be told.
    pub notes: Vec<String>,
    /// Cleaned flight.
    pub prepared: Prepared,
    /// Mean square of innovations at the answer, 1 for noise.
    pub misfit: f64,
    /// Innovations that were fitted, and rows left out near the stall.
    pub rows: usize,
    /// Rows left out near the stall.
    pub brink: usize,
    /// Rms of the ordinary water motion that was used, relative to the vehicle file's.
    pub colour: f64,
    /// Which branch the model was taken to be on beyond the valid angle of attack.
    pub branch: Branch,
    /// Likeness of signatures.
    pub likeness: Vec<(&'static str, &'static str, f64)>,
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

impl std::fmt::Display for NothingToFit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NothingToFit {}

/// Fewest rows under way that a diagnosis is made on.
const FEWEST_ROWS: usize = 40;
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
    let fitted = |s: u32| !check.contains(&s) && (vehicle.fit_segments.is_empty() || vehicle.fit_segments.contains(&s));
    let mut problem = Problem::new(prepared, vehicle, fitted);
    let all = prepared.runs.iter().filter(|r| fitted(r.segment)).count();
    if problem.runs.len() < all {
        notes.push(format!("{} of {all} dives, spread evenly over the flight, are fitted", problem.runs.len()));
    }
    let under_way: usize = problem.runs.iter().map(|r| r.used.iter().filter(|u| **u).count()).sum();
    if under_way < FEWEST_ROWS {
        return Err(NothingToFit(format!(
            "{}: only {under_way} rows deeper than 2 m and a minute under way in the segments to fit; at least {FEWEST_ROWS} are needed (is pressure in dbar? does the log hold a dive?)",
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
    let second = if problem.restore_brink(&second.state, TRUSTED) > 0 { null_fit(&problem) } else { second };
    let outliers = problem.drop_outliers(&second.residual, OUTLIER);
    if outliers > 0 {
        notes.push(format!("{outliers} lone samples beyond {OUTLIER} sigma left out of the fit"));
    }
    problem.tune_colour(&second.state);
    problem.doubt_moments(&second.state);
    Ok((problem, second))
}

/// Diagnoses a flight, looking for as many effects at once as `depth` says. `tick` is told what is being done and which share is done.
///
/// # Errors
/// No dive in the flight that a model could be compared with.
pub fn diagnose(flight: &Flight, vehicle: &Vehicle, depth: Depth, tick: &dyn Fn(&str, f64)) -> Result<Diagnosis, NothingToFit> {
    tick("reading the inputs", 0.0);
    let prepared = prepare(flight, vehicle);
    let mut notes = prepared.notes.clone();
    let check = check_segments(vehicle, &prepared, &mut notes);
    let (mut problem, _) = prepared_problem(flight, vehicle, &prepared, &check, &mut notes)?;
    let mut found = look(&mut problem, &prepared, depth, tick, &mut notes);
    found.name_most_important_first();
    tick("what remains", 0.97);
    let brink_rows = problem.brink_rows();
    if brink_rows > 0 {
        notes.push(format!("{brink_rows} rows near or beyond the stall (angle of attack over 0.35 rad in the model) left out of the fit"));
    }
    let compared = problem.rows_compared();
    if compared < FEWEST_COMPARED {
        return Err(NothingToFit(format!(
            "{}: {compared} rows are left to compare once {brink_rows} near or beyond the stall in the model are left out; at least {FEWEST_COMPARED} are needed: longer dives or steeper pitch settings show more",
            flight.name
        )));
    }
    if brink_rows > compared {
        notes.push(format!("what is said is said of {compared} rows; more than those were left out"));
    }
    let concluded = |found: &Found| conclude(vehicle, &prepared, &problem, found, &check, notes.clone());
    let mut said = concluded(&found);
    // A remainder that one effect more explains, when that effect is not told apart, is none.
    if said.verdict == Verdict::Unexplained && found.put_one_more_first() {
        let with_it = concluded(&found);
        if !with_it.answer.is_empty() {
            said = with_it;
            said.notes
                .push("one effect more is named, and listed first, than odds alone would: without it something unexplained remains".into());
        }
    }
    for name in said.answer.iter().filter(|name| vehicle.effects.iter().any(|a| a.effect.name() == **name)) {
        said.notes
            .push(format!("the vehicle file has {name} already: what is named is a change of it; `glider add {name}` fits all of it anew"));
    }
    if !said.answer.is_empty() && !flight.temperature_degc.iter().any(|t| t.is_finite()) {
        said.verdict = Verdict::Ambiguous;
        said.notes.push("without temperature the hull's thermal expansion was not modelled: what is named may be that instead".into());
    }
    Ok(said)
}

/// The best of these hypotheses, best first, where it is worth naming; more is asked for where more rows are left out than compared.
pub(crate) fn worth_naming<'a>(problem: &Problem, candidates: &'a [Candidate]) -> Option<&'a Candidate> {
    let thin = if problem.brink_rows() > problem.rows_compared() { SPEAK_UP_THIN } else { 0.0 };
    let needs = |best: &Candidate| if best.effects.iter().any(|e| has_guessed_form(e)) { SPEAK_UP_GUESSED } else { SPEAK_UP };
    candidates.first().filter(|best| best.log_odds > needs(best) + thin)
}

fn conclude(vehicle: &Vehicle, prepared: &Prepared, problem: &Problem, found: &Found, check: &[u32], mut notes: Vec<String>) -> Diagnosis {
    let Found { null, candidates, likeness } = found;
    let spoken = worth_naming(problem, candidates);
    let best_fit = spoken.map_or(null, |c| &c.fit);
    // What remains is asked beside calibrations that deviate as they like: what those can follow needs no name.
    let relaxed = |f: &Fit| {
        let free = beyond_limits(problem, f);
        let gained = log_evidence(problem, &free) - log_evidence(problem, f);
        (free, gained)
    };
    let waves = spoken.is_some_and(|c| c.effects.contains(&WAVE));
    // Ordinary water motion may have a period; and a wave that is not quite a sine leaves some of itself.
    let ordinary = ordinary_amplitude_m_s(vehicle);
    let counts = |f: &&Family| !f.may_be_water() || (!waves && f.scale_m_s.is_some_and(|amplitude| amplitude > ordinary));
    let (free, head_start) = relaxed(null);
    let explained = spoken.map_or(0.0, |c| 0.5 * (free.chi2 - c.fit.chi2).max(0.0));
    let misfit = best_fit.mean_square();
    // The larger what is explained, the more its form may differ from nature's: a wave's most of all.
    let form = if waves { FORM_MISFIT_WAVE } else { FORM_MISFIT };
    let forgiven = REMAINS_MISFIT + form * 2.0 * explained / problem.data.len().max(1) as f64;
    // A family tells the story better than a name does where it beats the best by its handicap and a share.
    let handicap = if waves { FAMILY_HANDICAP_WAVE } else { FAMILY_HANDICAP };
    let (free_best, gained_best) = spoken.map_or_else(|| (free.clone(), head_start), |c| relaxed(&c.fit));
    let to_beat =
        |share: f64, odds: f64, least: f64| spoken.map_or(f64::INFINITY, |c| c.log_odds * (1.0 + share) + handicap - odds).max(least);
    let remains = REMAINS.max(if misfit > forgiven { 0.0 } else { REMAINS_SHARE / (1.0 - REMAINS_SHARE) * explained });
    let alone = spoken.filter(|c| c.effects.len() == 1 && !waves);
    // Beside the best hypothesis itself the question is what remains, and asks for as much.
    let decides = alone.map_or(remains, |c| remains.min(to_beat(FAMILY_SHARE, c.log_odds + gained_best, REMAINS)));
    // Or a family tells the story better than any name does: after nothing, or after the best single effect without a wave.
    let single = spoken.and_then(|_| candidates.iter().find(|c| c.effects.len() == 1 && !c.effects.contains(&WAVE)));
    let apart = single.filter(|c| !spoken.is_some_and(|best| std::ptr::eq(*c, best))).map(|c| {
        let (fit, gained) = relaxed(&c.fit);
        // A stranger beside a name is a second thing missing, as a second name would be.
        (fit, c.log_odds + gained + (prior_of(2) / prior_of(1)).ln())
    });
    // Each fit with what decides there, and the log odds of what is told beside it and the least it has to be told with.
    let best_too = single.filter(|_| apart.is_none()).map(|c| (c.log_odds + gained_best, REMAINS));
    let mut beside = vec![(&free_best, decides, best_too)];
    if spoken.is_some() {
        let others = std::iter::once((&free, head_start)).chain(apart.iter().map(|(fit, odds)| (fit, *odds)));
        beside.extend(others.map(|(fit, odds)| (fit, to_beat(FAMILY_SHARE, odds, TELLS), Some((odds, TELLS)))));
    }
    let found = families(problem, &beside.iter().map(|(fit, decides, _)| (*fit, *decides)).collect::<Vec<_>>());
    let after_best = &found[0];
    let strongest = after_best.iter().filter(counts).map(|f| f.log_bayes).fold(f64::NEG_INFINITY, f64::max);
    let left_over = strongest > remains;
    // Or the best name would have to be what nothing of that name is.
    let unlike = spoken.map_or_else(Vec::new, |c| unlike(problem, &c.fit));
    let mut tellers: Vec<(f64, &Family)> = Vec::new();
    for (left, (.., told)) in found.iter().zip(&beside) {
        let Some((odds, least)) = *told else { continue };
        // A depth rate of its own, by leg or depth, mends any law a little; what acts through trim or pitch is a cause.
        let share = |f: &Family| if f.scale_m_s.is_some() { REMAINS_SHARE } else { FAMILY_SHARE };
        let tells = |f: &&Family| !f.may_be_water() && f.log_bayes > to_beat(share(f), odds, least);
        tellers.extend(left.iter().filter(tells).map(|f| (odds + f.log_bayes, f)));
    }
    // The best teller first, then what remains after the best name.
    tellers.sort_by(|a, b| b.0.total_cmp(&a.0));
    let better_told = !tellers.is_empty();
    let mut remainder: Vec<Family> = Vec::new();
    for f in tellers.into_iter().map(|t| t.1).chain(after_best) {
        if !remainder.iter().any(|r| (r.variable, r.period_s) == (f.variable, f.period_s)) {
            remainder.push(f.clone());
        }
    }
    let fit_blocks = gather(prepared, |s| problem.runs.iter().any(|r| r.segment == s));
    let check_blocks = gather(prepared, |s| check.contains(&s));
    // Or the answer, or nothing missing, fails on dives it was not fitted to. (A wave's phase there is unknown, and so is the branch of a
    // stall.)
    let tellable = !waves && problem.brink_rows() < problem.data.len() / 10;
    let kept_out = |state: &State, blocks: &[_]| problem.residuals_near_stall_and_elsewhere(prepared, state, blocks);
    let typical = |state: &State| typical_error(&kept_out(state, &check_blocks));
    let floor = problem.noise_floor_m_s();
    let check_error = if tellable { typical(&best_fit.state) } else { f64::NAN };
    // Or on one of them alone: what was caught there and lost again leaves nothing in the others.
    let of_one = |of| error_of_four_fifths(&kept_out(&best_fit.state, std::slice::from_ref(of)));
    let asked = tellable || spoken.is_none();
    let worst_of_one = check_blocks.iter().filter(|_| asked).map(of_one).fold(f64::NAN, f64::max);
    let strays = worst_of_one > FAILS * floor;
    let off_track = strays || check_error > FAILS * floor || (check_error > 2.0 * floor && check_error > WORSE * typical(&null.state));
    // Or far more is left than ordinary motion leaves, and nothing has a name for it.
    let far_off = !(misfit < forgiven.max(FAR_FROM_NOISE));
    let unexplained = left_over || better_told || off_track || far_off || !unlike.is_empty();
    let mut say = |it_is: bool, why: &str| {
        if it_is {
            notes.push(format!("unexplained: {why}"))
        }
    };
    say(left_over, "what remains after the best hypothesis follows a variable");
    say(better_told, "a remainder that follows one variable tells it better than any effect");
    let times = check_error.max(if strays { worst_of_one } else { f64::NAN }) / floor;
    let worst = if off_track { worst_segment(problem, prepared, &best_fit.state, &check_blocks) } else { String::new() };
    let best = if spoken.is_some() { "best hypothesis" } else { "recalibrated model" };
    say(off_track, &format!("on the check segments the {best} leaves {times:.1} times what ordinary water motion leaves{worst}"));
    unlike.iter().for_each(|why| say(true, why));
    say(far_off, "far more than ordinary water motion remains after the best hypothesis");

    let best_odds = spoken.map_or(0.0, |c| c.log_odds);
    let mut equivalent: Vec<Vec<&'static str>> = Vec::new();
    if let Some(first) = spoken {
        equivalent.push(first.effects.clone());
        // A part of the answer may do as well as all of it. A larger set only adds: it is one where it is nearly as likely as not.
        let part = |c: &Candidate| c.effects.len() < first.effects.len() && first.has_all_of(c);
        let same = |c: &Candidate| c.effects.len() == first.effects.len();
        let not_told_apart = |c: &&Candidate| {
            let behind = best_odds - c.log_odds;
            ((same(c) || part(c)) && behind < TIED) || (c.adds_one_to(first) && behind < NEARLY)
        };
        let others = candidates.iter().filter(|c| !std::ptr::eq(*c, first)).filter(not_told_apart);
        equivalent.extend(others.take(2).map(|c| c.effects.clone()));
    }
    let verdict = match (spoken, unexplained) {
        (_, true) => Verdict::Unexplained,
        (None, false) => Verdict::Adequate,
        (Some(_), false) if equivalent.len() > 1 => Verdict::Ambiguous,
        (Some(_), false) => Verdict::Explained,
    };
    let answer = match (verdict, spoken) {
        (Verdict::Explained | Verdict::Ambiguous, Some(c)) => c.effects.clone(),
        _ => Vec::new(),
    };

    // Probabilities over everything that was asked.
    let top = candidates.iter().map(|c| c.log_odds).fold(0.0, f64::max);
    let total: f64 = (-top).exp() + candidates.iter().map(|c| (c.log_odds - top).exp()).sum::<f64>();
    let after = if answer.is_empty() { null.state.clone() } else { spoken.map_or_else(|| null.state.clone(), |c| c.fit.state.clone()) };
    notes.extend(missed_near_stall(&kept_out(&after, &check_blocks), floor));
    notes.extend(problem.moments_said(&best_fit.state));
    let nominal = State::nominal();
    let mut states = vec![&nominal, &null.state, &after];
    states.extend(candidates.iter().take(SHOWN).map(|c| &c.fit.state));
    let on_fitted = block_errors(problem, prepared, &states, &fit_blocks, true);
    let on_check = block_errors(problem, prepared, &states, &check_blocks, false);
    let ranked: Vec<Ranked> = candidates
        .iter()
        .enumerate()
        .map(|(k, c)| Ranked {
            effects: c.effects.clone(),
            parameters: estimates(&c.fit),
            error_fitted_m_s: on_fitted.get(3 + k).copied().unwrap_or(f64::NAN),
            error_check_m_s: on_check.get(3 + k).copied().unwrap_or(f64::NAN),
            probability: (c.log_odds - top).exp() / total,
            log_odds: c.log_odds,
            gain: c.gain,
            state: c.fit.state.clone(),
        })
        .collect();
    let (block_error_m_s, fitted_error_m_s) = ([on_check[0], on_check[1], on_check[2]], [on_fitted[0], on_fitted[1], on_fitted[2]]);
    Diagnosis {
        verdict,
        answer,
        equivalent: if verdict == Verdict::Unexplained { Vec::new() } else { equivalent },
        candidates: ranked,
        probability_nothing: (-top).exp() / total,
        recalibrated: null.state.clone(),
        block_error_m_s,
        fitted_error_m_s,
        after,
        noise_floor_m_s: problem.noise_floor_m_s(),
        block_s: problem.block_s(),
        remainder,
        check: check.to_vec(),
        notes,
        prepared: prepared.clone(),
        branch: problem.branch,
        misfit,
        rows: problem.data.len(),
        brink: problem.brink_rows(),
        colour: problem.colour.rms_m_s / vehicle.background.0,
        likeness: likeness.clone(),
    }
    .with_vehicle_check(vehicle)
}

impl Diagnosis {
    fn with_vehicle_check(mut self, vehicle: &Vehicle) -> Self {
        if !vehicle.assumed.is_empty() {
            self.notes.push(format!("the vehicle file does not state, and these were assumed: {}", vehicle.assumed.join(", ")));
        }
        self
    }
}

fn gather(prepared: &Prepared, wanted: impl Fn(u32) -> bool) -> Vec<(usize, Vec<Block>)> {
    prepared.runs.iter().enumerate().filter(|(_, r)| wanted(r.segment)).map(|(k, r)| (k, blocks(r))).collect()
}
