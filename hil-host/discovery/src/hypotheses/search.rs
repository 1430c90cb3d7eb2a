//! Which hypothesis do the data prefer: nothing, one effect, two effects, on request three.
//!
//! Singles are fitted from the starts of their own kind; pairs are proposed by whitened signatures, at nothing missing and at the best
//! singles, with what is fitted projected out. Then the lattice of hypotheses is relaxed: every leader offers its state to what it is
//! a part of, to its parts, and to what exchanges one of its effects for a look-alike, until no chi² falls by more than
//! `BETTER`. So chi² of a larger set is never above that of a part of it, and no hypothesis owes its place to a better start. The
//! work is bounded ([`Problem::most_work`]). How one hypothesis is fitted and believed is [`crate::hypotheses::candidate`]'s.

use crate::hypotheses::candidate::{Candidate, Screen, Waves, named, wave_library};
use crate::hypotheses::sensitivity::{Signature, pair_score, project, signatures};
use crate::inference::evidence::PRIOR;
use crate::inference::posterior::Fit;
use crate::likelihood::Problem;
use crate::likelihood::jacobian::Jacobian;
use crate::model::parameters::State;
use hydro::effects::{Effect, WAVE};
use logs::vehicle::catalogue;

mod propose;
mod relax;

/// Everything the search found.
#[derive(Clone, Debug)]
pub struct SearchResult {
    /// Nothing missing, calibration refitted.
    pub null: Fit,
    /// All hypotheses fitted, best first.
    pub candidates: Vec<Candidate>,
    /// Cosines between signatures of single effects after the calibration is projected out.
    pub likeness: Vec<(&'static str, &'static str, f64)>,
    /// Whether the work that a search may take was used up: what is found is the best so far.
    pub used_up: bool,
}

impl SearchResult {
    fn of(&self, effects: &[&str]) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.is(effects))
    }

    /// Effects of the best hypothesis, in the order of the alphabet.
    pub(crate) fn leading(&self) -> Vec<&'static str> {
        let mut names = self.candidates.first().filter(|c| c.log_odds > 0.0).map_or_else(Vec::new, |best| best.effects.clone());
        names.sort_unstable();
        names
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
/// Pairs proposed with each single, and larger sets that a hypothesis is offered to.
const PARTNERS: usize = 4;
/// Log odds behind the best, and share of the best's, up to which a hypothesis may yet win.
const MAY_WIN: f64 = 12.0;
const MAY_WIN_SHARE: f64 = 0.25;

/// Searches all singles and the promising pairs. `before` is an earlier search of the same flight (other rows, colour or discrepancy):
/// its answers are the starts. `tick` is told what is being done and which share is done.
#[must_use]
pub fn search(problem: &Problem, before: Option<&SearchResult>, depth: Depth, tick: &dyn Fn(&str, f64)) -> SearchResult {
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
    // A wave with an effect is reached from either: one hypothesis, listed once.
    let mut candidates: Vec<Candidate> = Vec::with_capacity(s.nodes.len());
    s.nodes.into_iter().for_each(|c| {
        if !candidates.iter().any(|o| o.is(&c.effects)) {
            candidates.push(c);
        }
    });
    SearchResult { null: s.screen.null, candidates, likeness, used_up }
}

/// Prior probability of one given set of effects.
pub(crate) fn prior_of(effects: usize) -> f64 {
    let n = catalogue::all().count() as f64;
    match effects {
        0 => PRIOR.0,
        1 => PRIOR.1 / n,
        2 => PRIOR.2 / (n * (n - 1.0) / 2.0),
        // A third is as much rarer after two as a second is after one.
        _ => PRIOR.2 * PRIOR.2 / PRIOR.1 / (n * (n - 1.0) * (n - 2.0) / 6.0),
    }
}

/// Cosines of all signatures with each other, and pairs by what they promise, best first.
#[allow(clippy::type_complexity)]
fn geometry(screen: &Screen, signs: &[Signature]) -> (Vec<(&'static str, &'static str, f64)>, Vec<(f64, usize, usize)>) {
    let (mut likeness, mut ranked) = (Vec::new(), Vec::new());
    let Some(linearisation) = screen.null.linearisation() else { return (likeness, ranked) };
    let gram_and_match = project(&linearisation, signs);
    for i in 0..signs.len() {
        for j in (i + 1..signs.len()).filter(|j| signs[i].effect.name != signs[*j].effect.name) {
            let (gi, gj, gij) = (gram_and_match.0[(i, i)], gram_and_match.0[(j, j)], gram_and_match.0[(i, j)]);
            likeness.push((signs[i].effect.name, signs[j].effect.name, gij / (gi * gj).max(1e-300).sqrt()));
            ranked.push((pair_score(screen.problem, signs, &gram_and_match, i, j), i, j));
        }
    }
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    (likeness, ranked)
}

struct Search<'a> {
    screen: Screen<'a>,
    before: Option<&'a SearchResult>,
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

    fn current(&self) -> Option<&'static Effect> {
        catalogue::current().filter(|_| self.screen.problem.has_displacement())
    }
}
