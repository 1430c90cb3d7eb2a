//! Which hypothesis do the data prefer: nothing, one effect, two effects.
//!
//! Every hypothesis gets a log evidence: likelihood at the most probable state times the volume of the posterior over the volume
//! of the prior (Laplace). Sizes have a log-uniform prior over the typical range, so all effects pay about the same for being
//! able to explain; an effect that deviates a calibration number must deviate it beyond the tolerance, because inside it is no
//! discovery. Singles are fitted with the full model from several starts; pairs are screened with whitened signatures after the
//! calibration is projected out, and the best ones fitted; in the best pair each member is then exchanged for its look-alikes.

use crate::evidence::{PRIOR, log_evidence, log_mean_exp};
use crate::fit::{Effort, Fit, Jacobian, fit, linear, start_at};
use crate::problem::{Column, Problem, State, calibration_of, tolerance_of};
use crate::signature::{Offer, log_size_prior_of, pair_score, project, signatures};
use crate::wave::{Kind, PARTS, Wave, stretched};
use hydro::effects::{Active, CATALOGUE, Effect};

/// Name of the effect whose phase is free in every run.
pub const WAVE: &str = "internal_wave";

/// A hypothesis that was fitted.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Names of its effects, most important first.
    pub effects: Vec<&'static str>,
    /// Log evidence relative to nothing missing (prior odds in it).
    pub log_odds: f64,
    /// Fall of chi² against nothing missing.
    pub gain: f64,
    /// The fit.
    pub fit: Fit,
}

/// Everything the search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Nothing missing, calibration refitted.
    pub null: Fit,
    /// All hypotheses fitted, best first.
    pub candidates: Vec<Candidate>,
    /// Cosines between signatures of single effects after the calibration is projected out.
    pub likeness: Vec<(&'static str, &'static str, f64)>,
}

impl Found {
    fn of(&self, effects: &[&str]) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.effects.len() == effects.len() && effects.iter().all(|e| c.effects.contains(e)))
    }
}

/// Amplitudes a wave is tried at, m/s.
const WAVE_SCALES: [f64; 5] = [0.002, 0.004, 0.008, 0.016, 0.032];
/// Chi² per innovation of the calibrated nominal model from which fits start from several values.
const FAR_OFF: f64 = 2.5;
/// Gain of chi² from which signatures are renewed at the fit.
const RENEW_GAIN: f64 = 40.0;
/// Gain of chi² below which a linear estimate is as good as a fit.
const WORTH_A_FIT: f64 = 4.0;
/// Most singles, and most pairs, that are fitted with the full model.
const MOST_SINGLES: usize = 9;
const MOST_PAIRS: usize = 14;
/// Look-alikes that each member of the best pair is exchanged for.
const EXCHANGED: usize = 4;
/// Share of a single effect's log odds that its form may be wrong by.
const FORM_SHARE: f64 = 0.015;
/// And at most this: many forms (sensors, volumes, currents) are exact.
const FORM_MOST: f64 = 20.0;
/// Odds by which an effect beyond an angle of attack is marked down that the model hardly ever flies at: launches and turns are
/// where the law is least known.
const HARDLY_FLOWN: f64 = 8.0;
/// Share of the used rows that is hardly.
const HARDLY: f64 = 0.03;
/// Odds by which a hypothesis is marked down whose size wants to go beyond what is possible.
const AT_BOUND: f64 = 6.0;
/// Odds by which any hypothesis with a wave is marked down: it has amplitudes in every run to follow noise of another colour with.
const WAVE_HANDICAP: f64 = 6.0;

fn effort(iterations: usize) -> Effort {
    Effort { iterations, renew: false }
}

/// Tens of minutes: 7 to 52. A longer wave is a drift of each dive of its own and explains anything.
fn wave_periods() -> impl Iterator<Item = f64> {
    (0..18).map(|k| 420.0 * 1.125_f64.powi(k))
}

fn wave_library(problem: &Problem) -> Vec<(Kind, Vec<Column>)> {
    let stretched = stretched(&problem.runs, problem.vehicle);
    let mut out = Vec::new();
    for shape in [None, stretched.clone()].into_iter().take(if stretched.is_some() { 2 } else { 1 }) {
        for mode in [1, 2] {
            for period_s in wave_periods() {
                let kind = Kind { period_s, mode, stretched: shape.clone() };
                let columns = problem.wave_columns(&kind);
                out.push((kind, columns));
            }
        }
    }
    out
}

/// Nothing missing: the calibration fitted twice, the second time with signatures taken at the first fit.
fn calibrated(problem: &Problem, start: &State) -> (Jacobian, Fit) {
    let first = fit(problem, &Jacobian::new(problem, start), start, 0.01, effort(3));
    let jacobian = Jacobian::new(problem, &first.state);
    let null = fit(problem, &jacobian, &first.state, 0.01, effort(2));
    (jacobian, null)
}

/// Fits the calibration alone, and the calibration with these effects.
#[must_use]
pub fn fit_named(problem: &Problem, effects: &[&'static dyn Effect]) -> (Fit, Fit) {
    let waves = if effects.iter().any(|e| e.name() == WAVE) { wave_library(problem) } else { Vec::new() };
    let screen = Screen::new(problem, &problem.start, waves);
    let mut out = screen.null.clone();
    for effect in effects.iter().filter(|e| e.name() != WAVE) {
        out = screen.best_with(&out.state, *effect, 8);
    }
    if !screen.waves.is_empty() {
        out = screen.with_wave(&out, 3).0;
    }
    (screen.null, out)
}

struct Screen<'a> {
    problem: &'a Problem<'a>,
    jacobian: Jacobian,
    null: Fit,
    null_evidence: f64,
    waves: Vec<(Kind, Vec<Column>)>,
}

impl<'a> Screen<'a> {
    fn new(problem: &'a Problem<'a>, start: &State, waves: Vec<(Kind, Vec<Column>)>) -> Self {
        let (jacobian, null) = calibrated(problem, start);
        let null_evidence = log_evidence(problem, &null);
        Self { problem, jacobian, null, null_evidence, waves }
    }

    fn candidate(&self, f: Fit, prior: f64, extra: f64) -> Candidate {
        let mut effects: Vec<&'static str> = f.state.effects.iter().map(|a| a.effect.name()).collect();
        if f.state.wave.is_some() {
            effects.push(WAVE);
        }
        let worse = !(f.chi2 <= self.null.chi2 + 0.5);
        let odds = log_evidence(self.problem, &f) - self.null_evidence + (prior / PRIOR.0).ln() + extra;
        let log_odds = if worse || odds.is_nan() { f64::NEG_INFINITY } else { odds - if odds > 0.0 { self.doubts(&f) } else { 0.0 } };
        Candidate { effects, log_odds, gain: self.null.chi2 - f.chi2, fit: f }
    }

    /// Odds against a fit for reasons that a likelihood does not see.
    fn doubts(&self, f: &Fit) -> f64 {
        let bound = |a: &Active| {
            let p = &a.effect.parameters()[0];
            let margin = 1e-3 * (p.high - p.low);
            // Zero is the bound of what only grows, and no size.
            (a.values[0] - p.high).abs() < margin || ((a.values[0] - p.low).abs() < margin && p.low != p.off)
        };
        let hardly = |a: &Active| match a.effect.name() {
            "stall" => self.flown_beyond(&f.state, a.values[0]) < HARDLY,
            "vortex_lift_bodywing" => self.flown_beyond(&f.state, a.values[1]) < HARDLY,
            _ => false,
        };
        let effects = &f.state.effects;
        effects.iter().filter(|a| bound(a)).count() as f64 * AT_BOUND + effects.iter().filter(|a| hardly(a)).count() as f64 * HARDLY_FLOWN
    }

    /// Share of the used rows at which the model flies beyond an angle of attack.
    fn flown_beyond(&self, state: &State, angle_rad: f64) -> f64 {
        let (mut beyond, mut all) = (0, 0);
        for (k, run) in self.problem.runs.iter().enumerate() {
            let t = self.problem.track(run, state);
            for row in (0..run.time_s.len()).filter(|&i| self.problem.used[k][i]) {
                all += 1;
                beyond += usize::from(t.alpha_rad[row].abs() > angle_rad);
            }
        }
        beyond as f64 / all.max(1) as f64
    }

    fn fit(&self, start: &State, wave_prior: f64, iterations: usize) -> Fit {
        fit(self.problem, &self.jacobian, start, wave_prior, effort(iterations))
    }

    /// Starts to try for one effect.
    fn starts(&self, effect: &'static dyn Effect) -> Vec<f64> {
        let p = &effect.parameters()[0];
        match effect.name() {
            "stall" => vec![0.05, 0.10, 0.16],
            // A flight far from its model may sit behind a hill: look from further away too.
            _ if self.null.chi2 > FAR_OFF * self.problem.data.len() as f64 => {
                vec![p.off, (p.off + 1.5 * p.typical).min(p.high), (p.off - 1.5 * p.typical).max(p.low)]
            }
            "vortex_lift_bodywing" => vec![0.5 * p.typical],
            _ => vec![p.off],
        }
    }

    fn start(&self, base: &State, effect: &'static dyn Effect, size: f64) -> State {
        let mut start = base.clone();
        let mut size = size;
        // What the calibration has stretched for belongs to the effect that deviates the same number: the same law, no strain.
        if let Some(k) = calibration_of(effect.name()) {
            let p = &effect.parameters()[0];
            size = (size + start.calibration[k] * tolerance_of(self.problem.vehicle, k)).clamp(p.low, p.high);
            start.calibration[k] = 0.0;
        }
        start.effects.push(if effect.name() == "horizontal_current" { self.current_start(base) } else { start_at(effect, size) });
        start
    }

    /// Goes on from a fit with signatures taken there.
    fn renewed(&self, f: Fit, iterations: usize) -> Fit {
        let jacobian = Jacobian::new(self.problem, &f.state);
        let again = fit(self.problem, &jacobian, &f.state, 0.01, effort(iterations));
        if again.chi2 <= f.chi2 { again } else { f }
    }

    /// Best fit of `effect` added to a state.
    fn best_with(&self, base: &State, effect: &'static dyn Effect, iterations: usize) -> Fit {
        // Wide tolerances: the calibration must find its way anew beside a first effect; a second one starts from there.
        let far = crate::start::is_uncalibrated(self.problem.vehicle) && base.effects.is_empty();
        let from = |start: State| if far { crate::start::descend(self.problem, &start) } else { self.fit(&start, 0.01, iterations) };
        let starts = self.starts(effect).into_iter().map(|size| from(self.start(base, effect, size)));
        let mut best = starts.min_by(|a, b| a.chi2.total_cmp(&b.chi2)).unwrap_or_else(|| self.null.clone());
        // Far from the calibrated nominal model the signatures are others: renew them there and go on.
        if self.null.chi2 - best.chi2 > RENEW_GAIN {
            best = self.renewed(best, 5);
        }
        best
    }

    /// Stall where it promises nothing: the angle out of reach, no discovery.
    fn fit_stall(&self, gain: f64) -> Fit {
        let start = self.start(&self.null.state, &hydro::effects::Stall, 0.2);
        self.fit(&start, 0.01, if gain > 1.0 { 4 } else { 0 })
    }

    /// A current from the displacement residuals, as a start of its fit.
    fn current_start(&self, base: &State) -> Active {
        let (mut east, mut north, mut n) = (0.0, 0.0, 0.0);
        for run in &self.problem.runs {
            if let Some((e, no, _)) = run.displacement_m {
                let t = self.problem.track(run, base);
                east += (e - t.displacement_m.0) / run.displacement_s;
                north += (no - t.displacement_m.1) / run.displacement_s;
                n += 1.0;
            }
        }
        let mut a = start_at(&hydro::effects::HorizontalCurrent, 0.0);
        if n > 0.0 {
            a.values[0] = (east / n).hypot(north / n).max(1e-3);
            a.values[1] = (east / n).atan2(north / n);
        }
        a
    }

    /// Scans kind and amplitude of a wave on the residual of a fit: best kind and scale, and the log Bayes factor.
    fn scan_wave(&self, f: &Fit) -> (Kind, f64, f64) {
        let none = Kind { period_s: 1200.0, mode: 1, stretched: None };
        let Some(ground) = f.ground() else { return (none, 0.01, f64::NEG_INFINITY) };
        let mut best = (&none, 0.01, f64::NEG_INFINITY);
        let mut all = Vec::new();
        for (kind, columns) in &self.waves {
            let prepared = Offer::new(columns, &ground);
            for scale in WAVE_SCALES {
                // Second modes are rarer than first ones.
                let log_bayes = prepared.log_bayes(scale / 2.0_f64.sqrt()) - if kind.mode == 1 { 0.0 } else { 1.0 };
                all.push(log_bayes);
                if log_bayes > best.2 {
                    best = (kind, scale, log_bayes);
                }
            }
        }
        (best.0.clone(), best.1, log_mean_exp(&all))
    }

    fn with_wave(&self, f: &Fit, iterations: usize) -> (Fit, f64) {
        let (kind, scale, log_bayes) = self.scan_wave(f);
        let mut start = f.state.clone();
        start.wave = Some(Wave { kind, amplitude_m_s: vec![[0.0; PARTS]; self.problem.runs.len()] });
        let fitted = self.fit(&start, scale, iterations);
        // The scan has averaged over kind and amplitude; the fit knows only the best of them.
        let at_best = log_evidence(self.problem, &fitted) - log_evidence(self.problem, f);
        if !(fitted.chi2 <= f.chi2) {
            return (fitted, f64::NEG_INFINITY);
        }
        (fitted, log_bayes - at_best)
    }

    /// Effects that would gain most beside what is fitted, best first: log odds (no prior) and effect.
    fn seconds(&self, f: &Fit) -> Vec<(f64, &'static dyn Effect)> {
        let renewed = signatures(self.problem, &f.state, None);
        let Some(ground) = f.ground() else { return Vec::new() };
        let Offer { gram, match_ } = project(&ground, &renewed);
        let mut second: Vec<(f64, &'static dyn Effect)> = (0..renewed.len())
            .map(|i| {
                let (g, b) = (gram[(i, i)].max(1e-300), match_[i]);
                (0.5 * b * b / g + log_size_prior_of(self.problem, &renewed[i], b / g, g.powf(-0.5)), renewed[i].effect)
            })
            .filter(|s| s.0 > -1.0)
            .collect();
        second.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut seen: Vec<&str> = f.state.effects.iter().map(|a| a.effect.name()).collect();
        second.retain(|s| {
            !seen.contains(&s.1.name()) && {
                seen.push(s.1.name());
                true
            }
        });
        second
    }
}

/// Searches all singles and the promising pairs. `before` is an earlier search of the same flight (other rows or another colour):
/// its answers are the starts. `tick` is told what is being done and which share is done.
#[must_use]
pub fn search(problem: &Problem, before: Option<&Found>, tick: &dyn Fn(&str, f64)) -> Found {
    let found = search_from(problem, before.map_or(&problem.start, |b| &b.null.state), before, tick);
    // Near a stall the calibration may sit in a hollow that any effect lifts it out of: what it finds beside the best effect,
    // taken without the effect, may serve nothing missing better than its own start did.
    let Some(best) = found.candidates.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).filter(|c| c.gain > RENEW_GAIN) else { return found };
    let alone = State { calibration: best.fit.state.calibration, ..State::nominal() };
    let null = fit(problem, &Jacobian::new(problem, &alone), &alone, 0.01, effort(6));
    if null.chi2 < found.null.chi2 - RENEW_GAIN { search_from(problem, &null.state, Some(&found), tick) } else { found }
}

fn search_from(problem: &Problem, start: &State, before: Option<&Found>, tick: &dyn Fn(&str, f64)) -> Found {
    tick("calibration", 0.05);
    let screen = Screen::new(problem, start, wave_library(problem));
    let single_prior = PRIOR.1 / CATALOGUE.len() as f64;
    let pair_prior = PRIOR.2 / (CATALOGUE.len() * (CATALOGUE.len() - 1) / 2) as f64;
    let known = |effects: &[&str]| before.and_then(|b| b.of(effects)).filter(|c| c.log_odds.is_finite());
    // A hypothesis answered before goes on from there, whichever start serves better.
    let resumed = |effects: &[&str], fresh: &dyn Fn() -> Fit| -> Fit {
        match known(effects) {
            Some(c) if c.gain > WORTH_A_FIT => screen.renewed(screen.fit(&c.fit.state, 0.01, 4), if c.gain > RENEW_GAIN { 4 } else { 0 }),
            _ => fresh(),
        }
    };

    // Linear estimates of all, full fits of those that matter.
    tick("single effects", 0.15);
    let signs = signatures(problem, &screen.null.state, Some(&screen.jacobian));
    let linear_fits: Vec<Fit> =
        signs.iter().map(|s| linear(&screen.null, start_at(s.effect, s.effect.parameters()[0].off), &s.column)).collect();
    let mut linear_gain: Vec<(f64, usize)> = linear_fits.iter().enumerate().map(|(i, f)| (screen.null.chi2 - f.chi2, i)).collect();
    linear_gain.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<Candidate> = Vec::new();
    let mut fitted = 0;
    let best_gain = linear_gain.first().map_or(0.0, |g| g.0);
    for &(gain, i) in &linear_gain {
        let effect = signs[i].effect;
        if found.iter().any(|c| c.effects == [effect.name()]) {
            continue;
        }
        let answered = known(&[effect.name()]).is_some_and(|c| c.gain > WORTH_A_FIT);
        let f = if (gain > WORTH_A_FIT && fitted < MOST_SINGLES && gain > 0.1 * best_gain) || fitted < 2 || answered {
            fitted += 1;
            tick(effect.name(), 0.15 + 0.03 * fitted as f64);
            resumed(&[effect.name()], &|| screen.best_with(&screen.null.state, effect, 6))
        } else if effect.name() == "stall" {
            // Its signature has no size: the linear estimate would be of an amplitude.
            screen.fit_stall(gain)
        } else {
            linear_fits[i].clone()
        };
        found.push(screen.candidate(f, single_prior, 0.0));
    }
    let current = hydro::effects::by_name("horizontal_current").filter(|_| problem.has_displacement());
    if let Some(current) = current {
        let f = screen.best_with(&screen.null.state, current, 6);
        found.push(screen.candidate(f, single_prior, 0.0));
    }
    let (f, extra) = screen.with_wave(&screen.null, 2);
    found.push(screen.candidate(f, single_prior, extra - WAVE_HANDICAP));
    found.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));

    // Geometry of the signatures after the calibration is projected out.
    tick("pairs", 0.5);
    let ground = screen.null.ground();
    let projected = ground.as_ref().map(|ground| project(ground, &signs));
    let mut likeness = Vec::new();
    let mut ranked: Vec<(f64, usize, usize)> = Vec::new();
    for (i, projected) in (0..signs.len()).flat_map(|i| projected.iter().map(move |p| (i, p))) {
        for j in i + 1..signs.len() {
            if signs[i].effect.name() == signs[j].effect.name() {
                continue;
            }
            let (gi, gj, gij) = (projected.gram[(i, i)], projected.gram[(j, j)], projected.gram[(i, j)]);
            likeness.push((signs[i].effect.name(), signs[j].effect.name(), gij / (gi * gj).max(1e-300).sqrt()));
            ranked.push((pair_score(problem, &signs, projected, i, j), i, j));
        }
    }
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best_single = found.first().map_or(0.0, |c| c.log_odds);
    let worthwhile = ranked.first().is_some_and(|r| r.0 + (pair_prior / PRIOR.0).ln() > (0.5 * best_single).max(-2.0));
    let mut pairs: Vec<(&'static dyn Effect, &'static dyn Effect)> = Vec::new();
    let mut add = |a: &'static dyn Effect, b: &'static dyn Effect| {
        let is = |x: &dyn Effect, y: &dyn Effect| x.name() == a.name() && y.name() == b.name();
        let known = pairs.iter().any(|(x, y)| is(*x, *y) || is(*y, *x));
        if !known && a.name() != b.name() && pairs.len() < MOST_PAIRS {
            pairs.push((a, b));
        }
        !known
    };
    let mut wave_pairs: Vec<Candidate> = Vec::new();
    // What an earlier look found worth a place comes first.
    if let Some(b) = before {
        let top = b.candidates.first().map_or(0.0, |c| c.log_odds);
        for c in b.candidates.iter().filter(|c| c.fit.state.effects.len() == 2 && c.fit.state.wave.is_none() && c.log_odds > top - 8.0) {
            add(c.fit.state.effects[0].effect, c.fit.state.effects[1].effect);
        }
    }
    // From the best singles, with signatures renewed at their fits.
    let leaders: Vec<Candidate> =
        found.iter().filter(|c| c.log_odds > best_single - 25.0 - 0.3 * best_single.max(0.0)).take(4).cloned().collect();
    for single in &leaders {
        if best_single < -1.0 {
            break;
        }
        let second = screen.seconds(&single.fit);
        if single.effects == [WAVE] {
            let offset = single.log_odds - screen.candidate(single.fit.clone(), single_prior, 0.0).log_odds;
            for (_, effect) in second.iter().take(2) {
                let f = screen.best_with(&single.fit.state, *effect, 4);
                wave_pairs.push(screen.candidate(f, pair_prior, offset));
            }
        } else {
            let first = single.fit.state.effects[0].effect;
            for (_, effect) in second.iter().take(4) {
                add(first, *effect);
            }
            let (f, extra) = screen.with_wave(&single.fit, 2);
            wave_pairs.push(screen.candidate(f, pair_prior, extra - WAVE_HANDICAP));
            if let Some(current) = current {
                add(first, current);
            }
        }
    }
    if worthwhile {
        let top = ranked[0].0;
        let mut taken = 0;
        for (score, i, j) in &ranked {
            if taken < 6 && *score > top - 12.0 - 0.15 * top.max(0.0) && add(signs[*i].effect, signs[*j].effect) {
                taken += 1;
            }
        }
    }
    found.extend(wave_pairs);
    let pair = |found: &[Candidate], a: &'static dyn Effect, b: &'static dyn Effect| -> Option<Candidate> {
        // Start from the better of the two singles.
        let single = |e: &dyn Effect| found.iter().find(|c| c.effects == [e.name()]);
        let gain = |e: &dyn Effect| single(e).map_or(f64::NEG_INFINITY, |c| c.gain);
        let (first, second) = if gain(a) >= gain(b) { (a, b) } else { (b, a) };
        let base = single(first)?.fit.state.clone();
        Some(screen.candidate(resumed(&[a.name(), b.name()], &|| screen.best_with(&base, second, 6)), pair_prior, 0.0))
    };
    let total = pairs.len();
    for (k, (a, b)) in pairs.into_iter().enumerate() {
        tick("pairs", 0.55 + 0.35 * k as f64 / total as f64);
        let fitted = pair(&found, a, b);
        found.extend(fitted);
    }
    // In the best pair each member is exchanged for its look-alikes: greedy steps from one single never meet them.
    tick("look-alikes", 0.92);
    let best_pair = found
        .iter()
        .filter(|c| c.fit.state.effects.len() == 2 && c.fit.state.wave.is_none())
        .max_by(|a, b| a.log_odds.total_cmp(&b.log_odds));
    if let Some(best) = best_pair.filter(|c| c.log_odds > best_single - 3.0).cloned() {
        for kept in 0..2 {
            let keep = best.fit.state.effects[kept];
            let mut alone = best.fit.state.clone();
            alone.effects = vec![keep];
            let mut base = screen.fit(&alone, 0.01, 4);
            // What the pair has found may serve the single better than its own start did.
            if let Some(single) = found.iter_mut().find(|c| c.effects == [keep.effect.name()]) {
                if single.fit.chi2 - base.chi2 > 0.5 {
                    base = screen.renewed(base, 5);
                    *single = screen.candidate(base.clone(), single_prior, 0.0);
                } else {
                    base = single.fit.clone();
                }
            }
            for (_, other) in screen.seconds(&base).into_iter().take(EXCHANGED) {
                let names = [keep.effect.name(), other.name()];
                if found.iter().any(|c| c.effects.len() == 2 && names.iter().all(|n| c.effects.contains(n))) {
                    continue;
                }
                let f = resumed(&names, &|| screen.best_with(&base.state, other, 6));
                found.push(screen.candidate(f, pair_prior, 0.0));
            }
        }
    }
    // Forms of nature differ a little from ours, and a second effect can mend that: it must be worth more than the difference.
    let alone: Vec<(&'static str, f64)> = found.iter().filter(|c| c.effects.len() == 1).map(|c| (c.effects[0], c.log_odds)).collect();
    for c in found.iter_mut().filter(|c| c.effects.len() > 1) {
        let first = alone.iter().filter(|(n, _)| c.effects.contains(n)).map(|a| a.1).fold(0.0, f64::max);
        c.log_odds -= (FORM_SHARE * first).min(FORM_MOST);
    }
    found.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    Found { null: screen.null, candidates: found, likeness }
}
