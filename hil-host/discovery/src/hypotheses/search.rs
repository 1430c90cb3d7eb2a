//! Which hypothesis do the data prefer: nothing, one effect, two effects, on request three.
//!
//! Singles are fitted with the full model from several starts; pairs are screened with whitened signatures after the calibration is
//! projected out, and the best ones fitted; in the best pair each member is then exchanged for its look-alikes. How one hypothesis is
//! fitted and believed is [`crate::hypotheses::candidate`]'s.

use crate::hypotheses::aliases::{level_twins, twins};
use crate::hypotheses::candidate::{Candidate, RENEW_GAIN, Screen, TELLS_ALL, Waves, named, wave_library};
use crate::hypotheses::discrepancy;
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
}

impl Found {
    fn of(&self, effects: &[&str]) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.is(effects))
    }

    /// Effects of the best hypothesis, in the order of the alphabet.
    pub(crate) fn leading(&self) -> Vec<&'static str> {
        let mut names = self.candidates.first().map_or_else(Vec::new, |best| best.effects.clone());
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

    /// Two effects, neither of them a wave.
    fn is_plain_pair(&self) -> bool {
        self.fit.state.effects.len() == 2 && self.fit.state.wave.is_none()
    }
}

/// How deep a search goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// One effect or two.
    Pairs,
    /// Up to three.
    Triples,
}

/// Gain of chi² below which a linear estimate is as good as a fit.
const WORTH_A_FIT: f64 = 4.0;
/// Most singles, and most pairs, that are fitted with the full model.
const MOST_SINGLES: usize = 9;
const MOST_PAIRS: usize = 14;
/// Effects tried beside a wave that leads, the third and later ones from this share of what the first promises: look-alikes of it.
const BESIDE_WAVE: usize = 4;
const ALIKE_SHARE: f64 = 0.5;
/// Chi² by which the calibration has sat in a hollow: as much as decides whether a name is worth saying.
const HOLLOW: f64 = 4.0;
/// Look-alikes that each member of the best pair is exchanged for.
const EXCHANGED: usize = 4;
/// Pairs that are fitted anew from a part of them that fits better than they do.
const CAUGHT_UP: usize = 6;
/// Pairs that a third effect is sought for, and third effects tried beside each.
const TRIPLED: (usize, usize) = (3, 4);
/// Log odds by which a single effect leads the others clearly, and what a second beside it may promise beyond its price: where both hold
/// and it leaves hardly more than noise, a pair without it hardly wins.
const CLEAR_LEAD: f64 = 15.0;
const HARDLY_A_SECOND: f64 = 2.0;
/// Pairs without it that are tried all the same where signatures at nothing missing promise more of them than of any pair with it.
const OTHERS: usize = 2;
/// Log odds behind the best from which a hypothesis is not weighed again: a change of the water motion's size by a fifth changes
/// odds, and how far one is behind another, by less than half.
pub(crate) const MAY_WIN_RECOLOURED: f64 = 10.0;
/// The same where rows or signatures are others, and of these what stale ones leave of a gain.
pub(crate) const MAY_WIN: f64 = 25.0;
const MAY_WIN_SHARE: f64 = 0.25;
/// Most hypotheses of one size that get signatures of their own at a time.
const MOST_SETTLED: usize = 10;
/// Hypotheses whose signatures are taken anew when they are weighed again.
const WEIGHED_CLOSELY: usize = 4;
/// Searches all singles and the promising pairs. `before` is an earlier search of the same flight (other rows or another colour):
/// its answers are the starts. `tick` is told what is being done and which share is done.
#[must_use]
pub fn search(problem: &Problem, before: Option<&Found>, depth: Depth, tick: &dyn Fn(&str, f64)) -> Found {
    let waves = wave_library(problem);
    let found = search_from(problem, &waves, before.map_or(&problem.start, |b| &b.null.state), before, depth, tick);
    // The calibration may sit in a hollow that any effect lifts it out of: what it finds beside the best effect, taken without the
    // effect, may serve nothing missing better than its own start did.
    let lifts = |c: &&Candidate| c.gain > RENEW_GAIN || c.log_odds > 0.0;
    let Some(best) = found.candidates.iter().filter(lifts).max_by(|a, b| a.gain.total_cmp(&b.gain)) else { return found };
    let alone = State { calibration: best.fit.state.calibration, ..State::nominal() };
    let null = fit_from(problem, &alone, Effort::of(6));
    if null.chi2 < found.null.chi2 - HOLLOW { search_from(problem, &waves, &null.state, Some(&found), depth, tick) } else { found }
}

fn search_from(problem: &Problem, waves: &Waves, start: &State, before: Option<&Found>, depth: Depth, tick: &dyn Fn(&str, f64)) -> Found {
    tick("calibration", 0.05);
    let screen = Screen::new(problem, start, waves);
    let mut s = Search { screen: &screen, before, tick, found: Vec::new(), told: false };
    let signs = signatures(problem, &screen.null.state, Some(&screen.jacobian));
    s.singles(&signs);
    tick("pairs", 0.5);
    let (likeness, ranked) = geometry(&screen, &signs);
    s.pairs(&signs, &ranked);
    s.let_go();
    // Greedy steps from one single never meet the look-alikes of a pair's members.
    tick("look-alikes", 0.92);
    s.exchange();
    s.free_the_stuck();
    s.follow_the_whole();
    if depth == Depth::Triples {
        tick("three effects", 0.95);
        s.triples();
    }
    let mut candidates = s.found;
    discrepancy::mark_down_larger_sets(problem, &mut candidates, &[]);
    candidates.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    // A wave beside an effect is reached from either: one hypothesis, and told once.
    let mut once: Vec<Candidate> = Vec::with_capacity(candidates.len());
    candidates.into_iter().for_each(|c| {
        if !once.iter().any(|o| o.is(&c.effects)) {
            once.push(c)
        }
    });
    let candidates = once;
    Found { null: screen.null, candidates, likeness }
}

/// An earlier search weighed anew, where little has changed since: hypotheses no further behind the best than `within` are fitted
/// again from where they were, the others stay as they were.
#[must_use]
pub fn weigh_again(problem: &Problem, before: Found, within: f64, tick: &dyn Fn(&str, f64)) -> Found {
    tick("weighing again", 0.9);
    let no_waves = Waves::new();
    let screen = Screen::new(problem, &before.null.state, &no_waves);
    let top = before.candidates.first().map_or(0.0, |c| c.log_odds);
    let is_single = |c: &Candidate| c.effects.len() == 1 && c.effects != [WAVE];
    let best_single = before.candidates.iter().position(is_single);
    let (mut contenders, mut others) = (Vec::new(), Vec::new());
    for (k, c) in before.candidates.into_iter().enumerate() {
        let may_win = c.log_odds.is_finite() && (c.log_odds > top - within || Some(k) == best_single);
        if may_win { contenders.push(c) } else { others.push(c) }
    }
    let single = contenders.iter().position(is_single);
    let odds = |contenders: &[Candidate], k: Option<usize>| k.and_then(|k| contenders.get(k)).map_or(0.0, |c| c.log_odds);
    let top_single = odds(&contenders, single);
    let weighed = |c: &Candidate, closely: bool| {
        let mut f = screen.fit(&screen.jacobian, &c.fit.state, 4);
        if c.gain > RENEW_GAIN && closely {
            f = screen.renewed(f, 4).0;
        }
        screen.candidate(f, prior_of(c.effects.len()), c.correction)
    };
    for (k, c) in contenders.iter_mut().enumerate() {
        *c = weighed(c, k < WEIGHED_CLOSELY);
    }
    level_twins(&screen, &mut contenders, &mut others, &before.likeness);
    discrepancy::mark_down_larger_sets(problem, &mut contenders, &others);
    // Odds grow and shrink with the size of the water motion and the number of rows: those that were not fitted again change as the best,
    // or the best single, did, and come no nearer to the best.
    let grown = |after: f64, before: f64| if before > 1.0 && after > 0.0 { after / before } else { 1.0 };
    let moved = Some(odds(&contenders, Some(0)) - top).filter(|m| m.is_finite()).unwrap_or(0.0);
    let (of_all, of_singles) = (grown(odds(&contenders, Some(0)), top), grown(odds(&contenders, single), top_single));
    for c in others.iter_mut().filter(|c| c.log_odds > 0.0) {
        let factor = if is_single(c) { of_singles } else { of_all };
        c.log_odds = (c.log_odds * factor).min(c.log_odds + moved);
        c.gain *= factor;
    }
    // Another single may be the best now; what is left beside the best single is asked of a fit to these rows and this colour.
    let best = |of: &[Candidate]| {
        let singles = of.iter().enumerate().filter(|(_, c)| is_single(c));
        singles.map(|(k, c)| (k, c.log_odds)).max_by(|a, b| a.1.total_cmp(&b.1))
    };
    while let Some((k, _)) = best(&others).filter(|stale| best(&contenders).is_none_or(|fresh| stale.1 > fresh.1)) {
        let again = weighed(&others.remove(k), true);
        contenders.push(again);
    }
    contenders.append(&mut others);
    contenders.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    Found { null: screen.null, candidates: contenders, likeness: before.likeness }
}

/// Log odds from which a hypothesis may yet win over one of `top`, where rows or signatures are about to be others.
pub(crate) fn may_win_from(top: f64) -> f64 {
    top - MAY_WIN - MAY_WIN_SHARE * top
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

pub(crate) struct Search<'a> {
    pub(crate) screen: &'a Screen<'a>,
    before: Option<&'a Found>,
    tick: &'a dyn Fn(&str, f64),
    pub(crate) found: Vec<Candidate>,
    /// Whether one single effect tells all there is.
    told: bool,
}

impl Search<'_> {
    /// What an earlier look found of this hypothesis.
    fn known(&self, effects: &[&str]) -> Option<&Candidate> {
        self.before.and_then(|b| b.of(effects)).filter(|c| c.log_odds.is_finite() && c.gain > WORTH_A_FIT)
    }

    /// A hypothesis answered before goes on from there, unless that has become worse than a `part` of it on the rows of today.
    fn resumed(&self, jacobian: &Jacobian, effects: &[&str], part: &Fit, fresh: impl FnOnce() -> Fit) -> Candidate {
        let screen = self.screen;
        let from = self.known(effects).map(|c| screen.fit(jacobian, &c.fit.state, 4)).filter(|f| f.chi2 <= part.chi2);
        screen.candidate(from.unwrap_or_else(fresh), prior_of(effects.len()), 0.0)
    }

    fn single(&self, effect: &str) -> Option<&Candidate> {
        self.found.iter().find(|c| c.effects == [effect])
    }

    fn best_single(&self) -> f64 {
        self.found.iter().filter(|c| c.effects.len() == 1).map(|c| c.log_odds).reduce(f64::max).unwrap_or(0.0)
    }

    fn current(&self) -> Option<&'static dyn Effect> {
        hydro::effects::by_name("horizontal_current").filter(|_| self.screen.problem.has_displacement())
    }

    /// Linear estimates of all, full fits of those that matter.
    fn singles(&mut self, signs: &[Signature]) {
        (self.tick)("single effects", 0.15);
        let screen = self.screen;
        let linear_fits: Vec<Fit> = signs
            .iter()
            .map(|s| linear(screen.problem, &screen.null, screen.problem.active(s.effect, s.effect.parameters()[0].off), &s.column))
            .collect();
        let mut gains: Vec<(f64, usize)> = linear_fits.iter().enumerate().map(|(i, f)| (screen.null.chi2 - f.chi2, i)).collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best_gain = gains.first().map_or(0.0, |g| g.0);
        // Where the calibration itself has to be found, a signature may be that of a dive that stalls: every effect gets its fit.
        let all = crate::inference::initial_guess::is_uncalibrated(screen.problem.vehicle);
        let mut fitted = 0;
        for (gain, i) in gains {
            let effect = signs[i].effect;
            if self.single(effect.name()).is_some() {
                continue;
            }
            // A stall's angle is nowhere near linear: of a flight that shows much, its signatures say little.
            let untold = effect.name() == "stall" && best_gain > RENEW_GAIN;
            let promising = gain > WORTH_A_FIT && fitted < MOST_SINGLES && gain > 0.1 * best_gain;
            let c = if promising || untold || all || fitted < 2 || self.known(&[effect.name()]).is_some() {
                fitted += 1;
                (self.tick)(effect.name(), 0.15 + 0.03 * fitted as f64);
                self.resumed(&screen.jacobian, &[effect.name()], &screen.null, || {
                    screen.best_with(&screen.jacobian, &screen.null, effect, 6)
                })
            } else if effect.name() == "stall" {
                // Its signature has no size: the linear estimate would be of an amplitude.
                screen.candidate(screen.fit_stall(gain), prior_of(1), 0.0)
            } else {
                screen.candidate(linear_fits[i].clone(), prior_of(1), 0.0)
            };
            self.found.push(c);
        }
        if let Some(current) = self.current() {
            let f = screen.best_with(&screen.jacobian, &screen.null, current, 6);
            self.found.push(screen.candidate(f, prior_of(1), 0.0));
        }
        let (f, extra) = screen.with_wave(&screen.jacobian, &screen.null, 2);
        self.found.push(screen.candidate(f, prior_of(1), extra));
        self.settle(1);
    }

    /// Pairs that an earlier look, the best singles or the geometry of the signatures promise something of.
    fn pairs(&mut self, signs: &[Signature], ranked: &[(f64, usize, usize)]) {
        let screen = self.screen;
        let best_single = self.best_single();
        let mut pairs: Vec<(&'static dyn Effect, &'static dyn Effect)> = Vec::new();
        // What each leader promises with each effect beside it: log odds, leader, effect.
        let mut promised: Vec<(f64, &'static str, &'static str)> = Vec::new();
        let mut add = |a: &'static dyn Effect, b: &'static dyn Effect| {
            let is = |x: &dyn Effect, y: &dyn Effect| x.name() == a.name() && y.name() == b.name();
            let new = !pairs.iter().any(|(x, y)| is(*x, *y) || is(*y, *x));
            if new && a.name() != b.name() && pairs.len() < MOST_PAIRS {
                pairs.push((a, b));
            }
            new
        };
        // What an earlier look found worth a place comes first.
        if let Some(b) = self.before {
            let top = b.candidates.first().map_or(0.0, |c| c.log_odds);
            for c in b.candidates.iter().filter(|c| c.is_plain_pair() && c.log_odds > top - 8.0) {
                add(c.fit.state.effects[0].effect, c.fit.state.effects[1].effect);
            }
        }
        // From the best singles, with signatures renewed at their fits.
        let near = |c: &&Candidate| c.effects.len() == 1 && c.log_odds > best_single - 25.0 - 0.3 * best_single.max(0.0);
        let mut leaders: Vec<Candidate> = self.found.iter().filter(near).take(if best_single < -1.0 { 0 } else { 4 }).cloned().collect();
        let seconds_of = |single: &Candidate| screen.seconds(&single.fit, single.own.as_deref());
        let mut of_first = leaders.first().map(seconds_of);
        self.told = leaders.first().zip(of_first.as_ref()).is_some_and(|(first, seconds)| {
            let promised = seconds.first().map_or(f64::NEG_INFINITY, |s| s.0) + (prior_of(2) / prior_of(1)).ln();
            let lead = leaders.get(1).map_or(f64::INFINITY, |next| first.log_odds - next.log_odds);
            lead > CLEAR_LEAD && promised < HARDLY_A_SECOND && first.fit.mean_square() < TELLS_ALL
        });
        if self.told {
            leaders.truncate(1);
        }
        for single in &leaders {
            let second = of_first.take().unwrap_or_else(|| seconds_of(single));
            if single.effects == [WAVE] {
                let most = second.first().map_or(0.0, |s| s.0);
                let worth = |(k, s): &(usize, &(f64, &'static dyn Effect))| *k < 2 || s.0 > ALIKE_SHARE * most;
                for (_, (_, effect)) in second.iter().enumerate().filter(worth).take(BESIDE_WAVE) {
                    let (f, own) = screen.renewed(screen.best_with(&screen.jacobian, &single.fit, *effect, 4), 4);
                    // The kind of wave was found beside a calibration that strained for the effect: look again without the strain.
                    let far = single.fit.chi2 - f.chi2 > RENEW_GAIN;
                    let again = far.then(|| screen.with_wave(&own, &screen.fit(&own, &State { wave: None, ..f.state.clone() }, 2), 3));
                    let (f, extra) = again.filter(|a| a.0.chi2 < f.chi2).unwrap_or((f, single.correction));
                    self.found.push(screen.candidate(f, prior_of(2), extra));
                }
            } else {
                let first = single.fit.state.effects[0].effect;
                promised.extend(second.iter().map(|(score, effect)| (single.log_odds + score, first.name(), effect.name())));
                for (_, effect) in second.iter().take(4) {
                    add(first, *effect);
                }
                // Whatever its signatures promise: a stall's angle is nowhere near linear.
                add(first, &hydro::effects::Stall);
                let (f, extra) = screen.with_wave(screen.beside(Some(single)), &single.fit, 2);
                self.found.push(screen.candidate(f, prior_of(2), extra));
                if let Some(current) = self.current() {
                    add(first, current);
                }
            }
        }
        // Two effects that pull apart hide behind the one that tells most of both: signatures where nothing is missing know them.
        let of_leader = |effect: &dyn Effect| leaders.first().is_some_and(|l| l.effects == [effect.name()]);
        let others =
            ranked.iter().map(|(_, i, j)| (signs[*i].effect, signs[*j].effect)).take_while(|(a, b)| !of_leader(*a) && !of_leader(*b));
        for (a, b) in others.take(if self.told { OTHERS } else { 0 }) {
            add(a, b);
        }
        let top = ranked.first().map_or(f64::NEG_INFINITY, |r| r.0);
        if !self.told && top + (prior_of(2) / PRIOR.0).ln() > (0.5 * best_single).max(-2.0) {
            let mut taken = 0;
            for (score, i, j) in ranked {
                if taken < 6 && *score > top - 12.0 - 0.15 * top.max(0.0) && add(signs[*i].effect, signs[*j].effect) {
                    taken += 1;
                }
            }
        }
        let total = pairs.len();
        for (k, (a, b)) in pairs.into_iter().enumerate() {
            (self.tick)("pairs", 0.55 + 0.35 * k as f64 / total as f64);
            // Start from the single that promises more with the other beside it, else from the better of the two.
            let gain = |e: &dyn Effect| self.single(e.name()).map_or(f64::NEG_INFINITY, |c| c.gain);
            let promise = |first: &dyn Effect, second: &dyn Effect| {
                promised.iter().find(|p| (p.1, p.2) == (first.name(), second.name())).map_or(f64::NEG_INFINITY, |p| p.0)
            };
            let (of_a, of_b) = ((promise(a, b), gain(a)), (promise(b, a), gain(b)));
            let (first, second) = if of_a >= of_b { (a, b) } else { (b, a) };
            let Some(base) = self.single(first.name()) else { continue };
            let jacobian = screen.beside(Some(base));
            let c = self.resumed(jacobian, &[a.name(), b.name()], &base.fit, || screen.best_with(jacobian, &base.fit, second, 6));
            self.found.push(c);
        }
        self.settle(2);
    }

    /// Far from the calibrated nominal model the signatures are others: contenders of this size get their own and go on. Best first
    /// at the end.
    pub(crate) fn settle(&mut self, size: usize) {
        for _ in 0..MOST_SETTLED {
            let sized = |c: &Candidate| c.effects.len() == size && c.fit.state.wave.is_none();
            let top = self.found.iter().filter(|c| sized(c)).map(|c| c.log_odds).fold(0.0, f64::max);
            let floor = may_win_from(top);
            // A larger set that gains little more than a part of it was fitted with the signatures of the part.
            let part = |c: &Candidate| {
                let parts = self.found.iter().filter(|p| p.effects.len() < size && c.has_all_of(p));
                parts.map(|p| p.gain).fold(0.0, f64::max)
            };
            let open = |c: &Candidate| sized(c) && c.own.is_none() && c.log_odds > floor && c.gain - part(c) > RENEW_GAIN;
            let best = (0..self.found.len()).filter(|&k| open(&self.found[k]));
            let Some(k) = best.max_by(|a, b| self.found[*a].log_odds.total_cmp(&self.found[*b].log_odds)) else { break };
            let (f, own) = self.screen.renewed(self.found[k].fit.clone(), 5);
            self.found[k] = Candidate { own: Some(own), ..self.screen.candidate(f, prior_of(size), self.found[k].correction) };
        }
        self.found.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    }

    /// The best pair without a wave, if it is above this.
    fn best_pair(&self, floor: f64) -> Option<Candidate> {
        let pairs = self.found.iter().filter(|c| c.is_plain_pair() && c.log_odds > floor);
        pairs.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds)).cloned()
    }

    /// In the best pair each member is exchanged for its look-alikes.
    fn exchange(&mut self) {
        let screen = self.screen;
        let floor = self.best_single() - 3.0;
        if self.told {
            // A look-alike alone may sit in a hollow that a pair with it has left.
            let near: Vec<Candidate> = self.found.iter().filter(|c| c.is_plain_pair() && c.log_odds > floor - TIED).cloned().collect();
            near.iter().for_each(|pair| self.each_alone(pair));
            return;
        }
        let Some(best) = self.best_pair(floor) else { return };
        for kept in 0..2 {
            let keep = best.fit.state.effects[kept];
            let Some(base) = self.without(&best, kept) else { continue };
            for (score, other) in screen.seconds(&base, None).into_iter().take(EXCHANGED) {
                let names = [keep.effect.name(), other.name()];
                let jacobian = screen.beside(self.single(keep.effect.name()));
                let Some(known) = self.found.iter().position(|c| c.is(&names)) else {
                    let c = self.resumed(jacobian, &names, &base, || screen.best_with(jacobian, &base, other, 6));
                    self.found.push(c);
                    continue;
                };
                // Found before from elsewhere, and in a hollow there.
                if base.chi2 - self.found[known].fit.chi2 < score {
                    let f = screen.best_with(jacobian, &base, other, 6);
                    self.take_better(known, f);
                }
            }
            self.exchange_twins(&best, kept);
        }
        self.settle(2);
        // The same once more for what is best now: a pair that owes its place to a better calibration is none.
        if let Some(now) = self.best_pair(floor) {
            self.each_alone(&now);
        }
        self.catch_up();
    }

    /// A pair with a twin of one of the members goes on from where the pair is: what does the same fits as well.
    fn exchange_twins(&mut self, pair: &Candidate, kept: usize) {
        for f in twins(self.screen, pair, 1 - kept) {
            match self.found.iter().position(|c| c.is(&named(&f.state))) {
                Some(known) => self.take_better(known, f),
                None => self.found.push(self.screen.candidate(f, prior_of(2), 0.0)),
            }
        }
    }

    /// A single effect that was found to fit better than pairs with it goes on to those of them that promise most beside it: more
    /// effects never fit worse.
    fn catch_up(&mut self) {
        let screen = self.screen;
        let is_behind =
            |single: &Candidate, pair: &Candidate| pair.is_plain_pair() && pair.has_all_of(single) && pair.fit.chi2 > single.fit.chi2;
        let leads = |c: &&Candidate| c.effects.len() == 1 && c.own.is_some() && c.gain > RENEW_GAIN;
        let mut promised: Vec<(f64, Candidate, &'static dyn Effect, usize)> = Vec::new();
        for single in self.found.iter().filter(leads) {
            let behind: Vec<usize> = (0..self.found.len()).filter(|&k| is_behind(single, &self.found[k])).collect();
            if behind.is_empty() {
                continue;
            }
            for (score, other) in screen.seconds(&single.fit, single.own.as_deref()) {
                let pair = behind.iter().find(|&&k| self.found[k].is(&[single.effects[0], other.name()]));
                promised.extend(pair.map(|&k| (single.log_odds + score, single.clone(), other, k)));
            }
        }
        promised.sort_by(|a, b| b.0.total_cmp(&a.0));
        promised.truncate(CAUGHT_UP);
        if promised.is_empty() {
            return;
        }
        for (_, single, other, k) in promised {
            let f = screen.best_with(screen.beside(Some(&single)), &single.fit, other, 6);
            self.take_better(k, f);
        }
        self.settle(2);
    }

    /// Another fit of a known pair takes its place if it is better.
    fn take_better(&mut self, known: usize, f: Fit) {
        if f.chi2 < self.found[known].fit.chi2 {
            self.found[known] = self.screen.candidate(f, prior_of(2), 0.0);
        }
    }

    /// Both members of a pair fitted alone from where the pair is.
    fn each_alone(&mut self, pair: &Candidate) {
        (0..2).for_each(|kept| drop(self.without(pair, kept)));
    }

    /// The fit of one effect of a pair alone; what the pair has found may serve it better than its own start did.
    fn without(&mut self, pair: &Candidate, kept: usize) -> Option<Fit> {
        let screen = self.screen;
        let keep = pair.fit.state.effects[kept];
        let alone = State { effects: vec![keep], ..pair.fit.state.clone() };
        let base = screen.fit(screen.beside(Some(pair)), &alone, 4);
        let single = self.found.iter_mut().find(|c| c.effects == [keep.effect.name()])?;
        if single.fit.chi2 - base.chi2 > 0.5 {
            let (base, own) = screen.renewed(base, 5);
            *single = Candidate { own: Some(own), ..screen.candidate(base, prior_of(1), 0.0) };
        }
        Some(single.fit.clone())
    }

    /// To the best pairs, the third effects that promise most.
    fn triples(&mut self) {
        let screen = self.screen;
        let mut pairs: Vec<Candidate> = self.found.iter().filter(|c| c.effects.len() == 2 && c.log_odds.is_finite()).cloned().collect();
        pairs.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        for pair in pairs.into_iter().take(TRIPLED.0) {
            for (_, third) in screen.seconds(&pair.fit, pair.own.as_deref()).into_iter().take(TRIPLED.1) {
                let names: Vec<&str> = pair.effects.iter().copied().chain([third.name()]).collect();
                if !self.found.iter().any(|c| c.is(&names)) {
                    let f = screen.best_with(screen.beside(Some(&pair)), &pair.fit, third, 6);
                    self.found.push(screen.candidate(f, prior_of(3), pair.correction));
                }
            }
            if pair.fit.state.wave.is_none() {
                let (f, extra) = screen.with_wave(screen.beside(Some(&pair)), &pair.fit, 2);
                self.found.push(screen.candidate(f, prior_of(3), extra));
            }
        }
    }
}
