//! Which hypothesis do the data prefer: nothing, one effect, two effects, on request three.
//!
//! Singles are fitted from the starts of their own kind; pairs are proposed by whitened signatures, at nothing missing and at the best
//! singles, with what is fitted projected out. Then the lattice of hypotheses is relaxed: every leader offers its state to what it is
//! a part of, to its parts, and to what exchanges one of its effects for a look-alike, until no chi² falls by more than
//! `BETTER`. So chi² of a larger set is never above that of a part of it, and no hypothesis owes its place to a better start. The
//! work is bounded: `Budget`. How one hypothesis is fitted and believed is [`crate::hypotheses::candidate`]'s.

use crate::hypotheses::candidate::{Candidate, RENEW_GAIN, Screen, Waves, named, wave_library};
use crate::hypotheses::sensitivity::{Signature, pair_score, project, signatures};
use crate::inference::evidence::{PRIOR, TIED};
use crate::inference::gauss_newton::{Effort, Fit, Jacobian, fit_from, linear};
use crate::likelihood::Problem;
use crate::model::parameters::State;
use hydro::effects::{CATALOGUE, Effect, WAVE};

/// Everything the search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Nothing missing, calibration refitted.
    pub null: Fit,
    /// All hypotheses fitted, best first.
    pub candidates: Vec<Candidate>,
    /// Cosines between signatures of single effects after the calibration is projected out.
    pub likeness: Vec<(&'static str, &'static str, f64)>,
    /// Whether the work that a search may take was used up: what is found is the best so far.
    pub used_up: bool,
}

impl Found {
    fn of(&self, effects: &[&str]) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.is(effects))
    }

    /// Effects of the best hypothesis, in the order of the alphabet.
    pub(crate) fn leading(&self) -> Vec<&'static str> {
        let mut names = self.candidates.first().filter(|c| c.log_odds > 0.0).map_or_else(Vec::new, |best| best.effects.clone());
        names.sort_unstable();
        names
    }

    /// Puts the best of the hypotheses that add one effect to the best one before it, where there is one that is not told apart; whether.
    pub(crate) fn put_one_more_first(&mut self) -> bool {
        let more = |best: &Candidate| self.candidates.iter().position(|c| c.adds_one_to(best) && best.log_odds - c.log_odds < TIED);
        let Some(more) = self.candidates.first().and_then(more) else { return false };
        self.candidates[..=more].rotate_right(1);
        true
    }

    /// Names the effects of every hypothesis in the order of what each explains alone, a wave last.
    pub(crate) fn name_most_important_first(&mut self) {
        let singles = self.candidates.iter().filter(|c| c.effects.len() == 1);
        let alone: Vec<(&'static str, f64)> = singles.map(|c| (c.effects[0], c.gain)).collect();
        let gain = |name: &str| alone.iter().find(|a| a.0 == name).map_or(f64::NEG_INFINITY, |a| a.1);
        for c in &mut self.candidates {
            c.effects.sort_by(|a, b| (*a == WAVE).cmp(&(*b == WAVE)).then(gain(b).total_cmp(&gain(a))));
        }
    }
}

impl Candidate {
    pub(crate) fn is(&self, effects: &[&str]) -> bool {
        self.effects.len() == effects.len() && effects.iter().all(|e| self.effects.contains(e))
    }

    /// Whether all effects of another hypothesis are in this one.
    pub(crate) fn has_all_of(&self, other: &Self) -> bool {
        other.effects.iter().all(|e| self.effects.contains(e))
    }

    /// All effects of another and one more.
    pub(crate) fn adds_one_to(&self, other: &Self) -> bool {
        self.effects.len() == other.effects.len() + 1 && self.has_all_of(other)
    }

    fn is_plain(&self) -> bool {
        self.fit.state.wave.is_none()
    }
}

/// How deep a search goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// One effect: a quick look.
    Singles,
    /// One effect or two.
    Pairs,
    /// Up to three.
    Triples,
}

/// Fall of chi² below which two fits of one hypothesis are the same.
const BETTER: f64 = 0.5;
/// Gain of chi² below which a linear estimate is as good as a fit.
const WORTH_A_FIT: f64 = 4.0;
/// Most singles, and most pairs, that are fitted with the full model.
const MOST_SINGLES: usize = 8;
const MOST_PAIRS: usize = 10;
/// Singles that pairs are proposed beside, pairs proposed beside each, and by the signatures at nothing missing.
const LEADERS: usize = 3;
const BESIDE_EACH: usize = 4;
const AT_NOTHING: usize = 4;
/// Hypotheses that are relaxed, exchanges tried for each effect of the best of them, and rounds at most.
const RELAXED: usize = 4;
const EXCHANGED: usize = 3;
const ROUNDS: usize = 2;
/// Hypotheses of one size that get signatures of their own in a round.
const RENEWED: usize = 4;
/// Pairs that a third effect is sought for, and third effects tried beside each.
const TRIPLED: (usize, usize) = (3, 4);
/// Log odds behind the best, and share of the best's, up to which a hypothesis may yet win.
const MAY_WIN: f64 = 12.0;
const MAY_WIN_SHARE: f64 = 0.25;

/// Searches all singles and the promising pairs. `before` is an earlier search of the same flight (other rows, colour or discrepancy):
/// its answers are the starts. `tick` is told what is being done and which share is done.
#[must_use]
pub fn search(problem: &Problem, before: Option<&Found>, depth: Depth, tick: &dyn Fn(&str, f64)) -> Found {
    tick("calibration", 0.05);
    let waves = if depth == Depth::Singles { Waves::new() } else { wave_library(problem) };
    let screen = Screen::new(problem, before.map_or(&problem.start, |b| &b.null.state), &waves);
    let mut s = Search { screen, before, tick, nodes: Vec::new(), ends: problem.work() + problem.most_work() };
    let signs = signatures(problem, &s.screen.null.state, Some(&s.screen.jacobian));
    let (likeness, ranked) = geometry(&s.screen, &signs);
    s.singles(&signs);
    s.relax(1);
    if depth != Depth::Singles {
        s.pairs(&signs, &ranked);
        s.relax(2);
    }
    if depth == Depth::Triples {
        tick("three effects", 0.95);
        s.triples();
        s.relax(3);
    }
    let used_up = s.is_used_up();
    s.sort();
    // A wave beside an effect is reached from either: one hypothesis, and told once.
    let mut candidates: Vec<Candidate> = Vec::with_capacity(s.nodes.len());
    s.nodes.into_iter().for_each(|c| {
        if !candidates.iter().any(|o| o.is(&c.effects)) {
            candidates.push(c);
        }
    });
    Found { null: s.screen.null, candidates, likeness, used_up }
}

/// An earlier search weighed anew, where little has changed since (the size of the water motion): hypotheses that may win are fitted
/// again from where they were, the others stay as far behind as they were.
#[must_use]
pub fn weigh_again(problem: &Problem, before: Found, depth: Depth, tick: &dyn Fn(&str, f64)) -> Found {
    tick("weighing again", 0.9);
    let no_waves = Waves::new();
    let screen = Screen::new(problem, &before.null.state, &no_waves);
    let ends = problem.work() + problem.most_work();
    let mut s = Search { screen, before: None, tick, nodes: Vec::new(), ends };
    let top = before.candidates.first().map_or(0.0, |c| c.log_odds);
    let is_single = |c: &Candidate| c.effects.len() == 1;
    let best_single = before.candidates.iter().position(is_single);
    let mut others = Vec::new();
    for (k, c) in before.candidates.into_iter().enumerate() {
        if c.log_odds.is_finite() && (c.log_odds > top - MAY_WIN || Some(k) == best_single) && !s.is_used_up() {
            let f = s.screen.fit(&s.screen.jacobian, &c.fit.state, 4);
            s.take(f, None, c.correction);
        } else {
            others.push(c);
        }
    }
    s.relax(if depth == Depth::Singles { 1 } else { 2 });
    // Odds grow and shrink with the size of the water motion: those that were not fitted again change as the best did.
    let moved = s.top() - top.max(0.0);
    let grown = if top > 1.0 { (s.top() / top).max(0.0) } else { 1.0 };
    others.retain(|c| s.position(&c.effects).is_none());
    others.iter_mut().filter(|c| c.log_odds > 0.0).for_each(|c| c.log_odds = (c.log_odds * grown).min(c.log_odds + moved));
    let used_up = s.is_used_up();
    s.nodes.append(&mut others);
    s.sort();
    Found { null: s.screen.null, candidates: s.nodes, likeness: before.likeness, used_up }
}

/// Prior probability of one given set of effects.
pub(crate) fn prior_of(effects: usize) -> f64 {
    let n = CATALOGUE.len() as f64;
    match effects {
        0 => PRIOR.0,
        1 => PRIOR.1 / n,
        2 => PRIOR.2 / (n * (n - 1.0) / 2.0),
        // A third is as much rarer beside two as a second is beside one.
        _ => PRIOR.2 * PRIOR.2 / PRIOR.1 / (n * (n - 1.0) * (n - 2.0) / 6.0),
    }
}

/// Cosines of all signatures with each other, and pairs by what they promise, best first.
#[allow(clippy::type_complexity)]
fn geometry(screen: &Screen, signs: &[Signature]) -> (Vec<(&'static str, &'static str, f64)>, Vec<(f64, usize, usize)>) {
    let (mut likeness, mut ranked) = (Vec::new(), Vec::new());
    let Some(ground) = screen.null.ground() else { return (likeness, ranked) };
    let projected = project(&ground, signs);
    for i in 0..signs.len() {
        for j in (i + 1..signs.len()).filter(|j| signs[i].effect.name() != signs[*j].effect.name()) {
            let (gi, gj, gij) = (projected.0[(i, i)], projected.0[(j, j)], projected.0[(i, j)]);
            likeness.push((signs[i].effect.name(), signs[j].effect.name(), gij / (gi * gj).max(1e-300).sqrt()));
            ranked.push((pair_score(screen.problem, signs, &projected, i, j), i, j));
        }
    }
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    (likeness, ranked)
}

struct Search<'a> {
    screen: Screen<'a>,
    before: Option<&'a Found>,
    tick: &'a dyn Fn(&str, f64),
    /// Hypotheses that were fitted.
    nodes: Vec<Candidate>,
    /// Work at which the search ends.
    ends: u64,
}

impl Search<'_> {
    fn is_used_up(&self) -> bool {
        self.screen.problem.work() > self.ends
    }

    fn sort(&mut self) {
        self.nodes.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    }

    fn position(&self, effects: &[&str]) -> Option<usize> {
        self.nodes.iter().position(|c| c.is(effects))
    }

    fn top(&self) -> f64 {
        self.nodes.iter().map(|c| c.log_odds).fold(0.0, f64::max)
    }

    fn floor(&self) -> f64 {
        let top = self.top();
        top - MAY_WIN - MAY_WIN_SHARE * top
    }

    /// What an earlier search found of this hypothesis.
    fn known(&self, effects: &[&str]) -> Option<State> {
        let known = self.before.and_then(|b| b.of(effects)).filter(|c| c.log_odds.is_finite() && c.gain > WORTH_A_FIT);
        known.map(|c| c.fit.state.clone())
    }

    /// Takes a fit of a hypothesis, with the signatures of its own where it has some, unless it is known with a lower chi²; whether.
    fn take(&mut self, fit: Fit, own: Option<std::sync::Arc<Jacobian>>, correction: f64) -> bool {
        let effects = named(&fit.state);
        let known = self.position(&effects);
        if known.is_some_and(|k| !(fit.chi2 < self.nodes[k].fit.chi2 - BETTER)) {
            return false;
        }
        let c = Candidate { own, ..self.screen.candidate(fit, prior_of(effects.len()), correction) };
        match known {
            Some(k) => self.nodes[k] = c,
            None => self.nodes.push(c),
        }
        true
    }

    /// Fits a hypothesis from a state, where an earlier search has not a better start.
    fn fitted(&self, jacobian: &Jacobian, effects: &[&str], fresh: impl FnOnce() -> Fit) -> Fit {
        let again = self.known(effects).map(|state| self.screen.fit(jacobian, &state, 4));
        match again {
            Some(f) if f.chi2 <= self.screen.null.chi2 => f,
            _ => fresh(),
        }
    }

    fn current(&self) -> Option<&'static dyn Effect> {
        hydro::effects::by_name("horizontal_current").filter(|_| self.screen.problem.has_displacement())
    }

    /// Linear estimates of all, full fits of those that matter.
    fn singles(&mut self, signs: &[Signature]) {
        (self.tick)("single effects", 0.1);
        let problem = self.screen.problem;
        let estimate = |s: &Signature| {
            let start = problem.active(s.effect, s.effect.parameters()[0].off);
            linear(problem, &self.screen.null, start, &s.column)
        };
        let linear_fits: Vec<Fit> = signs.iter().map(estimate).collect();
        let mut gains: Vec<(f64, usize)> = linear_fits.iter().enumerate().map(|(i, f)| (self.screen.null.chi2 - f.chi2, i)).collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best_gain = gains.first().map_or(0.0, |g| g.0);
        // Where the calibration itself has to be found, a signature may be that of a dive that stalls: every effect gets its fit.
        let all = crate::inference::initial_guess::is_uncalibrated(problem.vehicle);
        let mut fitted = 0;
        for (gain, i) in gains {
            let effect = signs[i].effect;
            let name = [effect.name()];
            if self.position(&name).is_some() {
                continue;
            }
            // A stall's angle is nowhere near linear: of a flight that shows much, its signatures say little.
            let untold = effect.name() == "stall" && best_gain > RENEW_GAIN;
            let promising = gain > WORTH_A_FIT && fitted < MOST_SINGLES && gain > 0.1 * best_gain;
            let full = promising || untold || all || fitted < 2 || self.known(&name).is_some();
            let fit = if full && !self.is_used_up() {
                fitted += 1;
                (self.tick)(effect.name(), 0.1 + 0.3 * fitted as f64 / CATALOGUE.len() as f64);
                let screen = &self.screen;
                self.fitted(&screen.jacobian, &name, || screen.best_with(&screen.jacobian, &screen.null, effect, 6))
            } else if effect.name() == "stall" {
                // Its signature has no size: the linear estimate would be of an amplitude.
                self.screen.fit_stall(gain)
            } else {
                linear_fits[i].clone()
            };
            self.take(fit, None, 0.0);
        }
        if let Some(current) = self.current() {
            let f = self.screen.best_with(&self.screen.jacobian, &self.screen.null, current, 6);
            self.take(f, None, 0.0);
        }
        if self.screen.has_waves() {
            let (f, extra) = self.screen.with_wave(&self.screen.jacobian, &self.screen.null, 2);
            self.take(f, None, extra);
        }
    }

    /// Pairs that an earlier search, the best singles or the geometry of the signatures promise something of.
    fn pairs(&mut self, signs: &[Signature], ranked: &[(f64, usize, usize)]) {
        self.sort();
        let best_single = self.top();
        // What is proposed, with the log odds it promises, the state it starts from and the signatures there.
        let mut proposed: Vec<(f64, Vec<&'static str>, usize, &'static dyn Effect)> = Vec::new();
        let per_effect = (prior_of(2) / prior_of(1)).ln();
        let floor = self.floor();
        let leaders: Vec<usize> = (0..self.nodes.len())
            .filter(|&k| self.nodes[k].effects.len() == 1 && self.nodes[k].log_odds > floor.max(-1.0))
            .take(LEADERS)
            .collect();
        for &k in &leaders {
            (self.tick)("pairs", 0.4 + 0.05 * k.min(4) as f64);
            if self.is_used_up() {
                break;
            }
            let single = self.nodes[k].clone();
            let own = single.own.as_deref();
            let mut seconds = self.screen.seconds(&single.fit, own);
            seconds.truncate(BESIDE_EACH);
            // Whatever its signatures promise: a stall's angle is nowhere near linear.
            let others: Vec<&'static dyn Effect> =
                std::iter::once(&hydro::effects::Stall as &'static dyn Effect).chain(self.current()).collect();
            for effect in others {
                if !single.effects.contains(&effect.name()) && !seconds.iter().any(|s| s.1.name() == effect.name()) {
                    seconds.push((0.0, effect));
                }
            }
            for (score, effect) in seconds {
                proposed.push((single.log_odds + score + per_effect, vec![single.effects[0], effect.name()], k, effect));
            }
            if self.screen.has_waves() && single.is_plain() {
                let (f, extra) = self.screen.with_wave(self.screen.beside(Some(&single)), &single.fit, 2);
                self.take(f, None, extra);
            }
        }
        // Two effects that pull apart hide behind the one that tells most of both: signatures where nothing is missing know them.
        let top = ranked.first().map_or(f64::NEG_INFINITY, |r| r.0);
        let worth = |score: f64| {
            score > top - MAY_WIN - MAY_WIN_SHARE * top.max(0.0) && score + (prior_of(2) / PRIOR.0).ln() > (0.5 * best_single).max(-2.0)
        };
        for (score, i, j) in ranked.iter().filter(|r| worth(r.0)).take(AT_NOTHING) {
            let (a, b) = (signs[*i].effect, signs[*j].effect);
            let gain = |e: &dyn Effect| self.position(&[e.name()]).map_or(f64::NEG_INFINITY, |k| self.nodes[k].gain);
            let (first, second) = if gain(a) >= gain(b) { (a, b) } else { (b, a) };
            let Some(k) = self.position(&[first.name()]) else { continue };
            proposed.push((score + (prior_of(2) / PRIOR.0).ln(), vec![first.name(), second.name()], k, second));
        }
        // What an earlier search found worth a place comes first.
        if let Some(b) = self.before {
            let top = b.candidates.first().map_or(0.0, |c| c.log_odds);
            for c in b.candidates.iter().filter(|c| c.fit.state.effects.len() == 2 && c.is_plain() && c.log_odds > top - MAY_WIN) {
                let Some(k) = self.position(&[c.effects[0]]) else { continue };
                proposed.push((f64::INFINITY, c.effects.clone(), k, c.fit.state.effects[1].effect));
            }
        }
        proposed.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut done = 0;
        for (_, names, k, second) in proposed {
            if done >= MOST_PAIRS || self.is_used_up() {
                break;
            }
            let names: Vec<&str> = names;
            if self.position(&names).is_some() || self.nodes[k].effects == [second.name()] {
                continue;
            }
            done += 1;
            (self.tick)("pairs", 0.6 + 0.2 * done as f64 / MOST_PAIRS as f64);
            let base = self.nodes[k].clone();
            let jacobian = self.screen.beside(Some(&base));
            let screen = &self.screen;
            if base.fit.state.wave.is_some() {
                let (f, own) = screen.renewed(screen.best_with(jacobian, &base.fit, second, 4), 4);
                // The kind of wave was found beside a calibration that strained for the effect: look again without the strain.
                let far = base.fit.chi2 - f.chi2 > RENEW_GAIN;
                let again = far.then(|| screen.with_wave(&own, &screen.fit(&own, &State { wave: None, ..f.state.clone() }, 2), 3));
                let (f, extra) = again.filter(|a| a.0.chi2 < f.chi2).unwrap_or((f, base.correction));
                self.take(f, None, extra);
            } else {
                let f = self.fitted(jacobian, &names, || screen.best_with(jacobian, &base.fit, second, 6));
                self.take(f, None, 0.0);
            }
        }
    }

    /// Hypotheses that may win go on with signatures of their own: far from the calibrated nominal model they are others.
    fn renew(&mut self, size: usize) -> bool {
        let mut changed = false;
        for _ in 0..RENEWED {
            let floor = self.floor();
            let part = |c: &Candidate| {
                let parts = self.nodes.iter().filter(|p| p.effects.len() < c.effects.len() && c.has_all_of(p));
                parts.map(|p| p.gain).fold(0.0, f64::max)
            };
            let open = |c: &Candidate| {
                c.own.is_none() && c.is_plain() && c.effects.len() <= size && c.log_odds > floor && c.gain - part(c) > RENEW_GAIN
            };
            let best = (0..self.nodes.len()).filter(|&k| open(&self.nodes[k]));
            let Some(k) = best.max_by(|a, b| self.nodes[*a].log_odds.total_cmp(&self.nodes[*b].log_odds)) else { break };
            if self.is_used_up() {
                break;
            }
            let node = &self.nodes[k];
            let before = node.fit.chi2;
            let (f, own) = self.screen.renewed(node.fit.clone(), 5);
            changed |= f.chi2 < before - BETTER;
            let effects = node.effects.len();
            self.nodes[k] = Candidate { own: Some(own), ..self.screen.candidate(f, prior_of(effects), node.correction) };
        }
        changed
    }

    /// Offers the states of the leaders to their parts, to what they are part of, and to exchanges of one effect, until nothing falls.
    fn relax(&mut self, size: usize) {
        let mut exchanged: Vec<Vec<&'static str>> = Vec::new();
        for round in 0..ROUNDS {
            (self.tick)("look-alikes", 0.8 + 0.05 * round as f64);
            let mut changed = self.renew(size);
            self.sort();
            let floor = self.floor();
            let leaders: Vec<Candidate> = self.nodes.iter().filter(|c| c.is_plain() && c.log_odds > floor).take(RELAXED).cloned().collect();
            for leader in &leaders {
                if self.is_used_up() {
                    return;
                }
                changed |= self.offer_to_parts(leader);
                changed |= self.offer_to_wholes(leader);
            }
            let pair = |c: &&Candidate| c.is_plain() && c.effects.len() > 1 && c.log_odds > floor;
            let best = self.nodes.iter().find(pair).filter(|c| size > 1 && !exchanged.contains(&c.effects)).cloned();
            if let Some(best) = best {
                changed |= self.exchange(&best);
                exchanged.push(best.effects);
            }
            if !changed {
                break;
            }
        }
    }

    /// The parts of a hypothesis from where it is: what it has found may serve them better than their own starts did.
    fn offer_to_parts(&mut self, whole: &Candidate) -> bool {
        let mut changed = false;
        for k in 0..whole.fit.state.effects.len() {
            let mut part = whole.fit.state.clone();
            part.effects.remove(k);
            let jacobian = self.screen.beside(Some(whole));
            let there = self.screen.fit(jacobian, &part, 3);
            let known = if part.effects.is_empty() {
                Some(self.screen.null.chi2)
            } else {
                self.position(&named(&part)).map(|k| self.nodes[k].fit.chi2)
            };
            if known.is_some_and(|chi2| !(there.chi2 < chi2 - BETTER)) {
                continue;
            }
            changed = true;
            if !part.effects.is_empty() {
                let (f, own) = self.screen.renewed(there, 5);
                self.take(f, Some(own), whole.correction);
                continue;
            }
            let jacobian = Jacobian::new(self.screen.problem, &there.state);
            let f = fit_from(self.screen.problem, &there.state, Effort::of(5));
            if f.chi2 < self.screen.null.chi2 - BETTER {
                self.screen.set_null(jacobian, f);
                let again = |c: &Candidate| Candidate {
                    own: c.own.clone(),
                    ..self.screen.candidate(c.fit.clone(), prior_of(c.effects.len()), c.correction)
                };
                self.nodes = self.nodes.iter().map(again).collect();
            }
        }
        changed
    }

    /// What is known with one effect more and does not fit better, from where a hypothesis is: more effects never fit worse.
    fn offer_to_wholes(&mut self, part: &Candidate) -> bool {
        let floor = self.floor();
        let behind = |c: &&Candidate| {
            c.is_plain() && c.adds_one_to(part) && c.fit.chi2 > part.fit.chi2 - BETTER && (c.log_odds > floor || !c.log_odds.is_finite())
        };
        let wholes: Vec<Candidate> = self.nodes.iter().filter(behind).take(BESIDE_EACH).cloned().collect();
        let mut changed = false;
        for whole in wholes {
            let more = whole.fit.state.effects.iter().find(|a| !part.effects.contains(&a.effect.name()));
            let Some(more) = more else { continue };
            let f = self.screen.best_with(self.screen.beside(Some(part)), &part.fit, more.effect, 6);
            changed |= self.take(f, None, 0.0);
        }
        changed
    }

    /// A hypothesis with each of its effects exchanged for what does nearly the same there, fitted from where it is.
    fn exchange(&mut self, of: &Candidate) -> bool {
        let mut changed = false;
        for k in 0..of.fit.state.effects.len() {
            if self.is_used_up() {
                break;
            }
            let mut alone = of.fit.state.clone();
            alone.effects.remove(k);
            let base = match self.position(&named(&alone)) {
                Some(k) => self.nodes[k].fit.clone(),
                None => continue,
            };
            let jacobian = self.screen.beside(Some(of)).clone();
            for (score, other) in self.screen.seconds(&base, None).into_iter().take(EXCHANGED) {
                if of.effects.contains(&other.name()) {
                    continue;
                }
                let names: Vec<&str> = named(&base.state).into_iter().chain([other.name()]).collect();
                // A gain that the signatures promise from here and that is not known yet.
                let behind = self.position(&names).is_none_or(|k| base.chi2 - self.nodes[k].fit.chi2 < score);
                if behind {
                    let f = self.screen.best_with(&jacobian, &base, other, 6);
                    changed |= self.take(f, None, 0.0);
                }
            }
        }
        changed
    }

    /// To the best pairs, the third effects that promise most.
    fn triples(&mut self) {
        self.sort();
        let pairs: Vec<Candidate> =
            self.nodes.iter().filter(|c| c.effects.len() == 2 && c.log_odds.is_finite()).take(TRIPLED.0).cloned().collect();
        for pair in pairs {
            for (_, third) in self.screen.seconds(&pair.fit, pair.own.as_deref()).into_iter().take(TRIPLED.1) {
                let names: Vec<&str> = pair.effects.iter().copied().chain([third.name()]).collect();
                if self.position(&names).is_none() {
                    let f = self.screen.best_with(self.screen.beside(Some(&pair)), &pair.fit, third, 6);
                    self.take(f, None, pair.correction);
                }
            }
            if pair.is_plain() && self.screen.has_waves() {
                let (f, extra) = self.screen.with_wave(self.screen.beside(Some(&pair)), &pair.fit, 2);
                self.take(f, None, extra);
            }
        }
    }
}
