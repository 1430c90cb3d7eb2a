//! Collinear effects are refitted from the same state, so that their chi² is comparable and no hypothesis owes its place to a better start.

use super::{BETTER, PARTNERS, Search, prior_of};
use crate::hypotheses::candidate::{Candidate, RENEW_GAIN, named};
use crate::inference::gauss_newton::{Effort, fit_from};
use crate::likelihood::jacobian::Jacobian;

/// Hypotheses that are relaxed, exchanges tried for each effect of the best of them, and rounds at most.
const RELAXED: usize = 4;
const EXCHANGED: usize = 3;
const ROUNDS: usize = 2;
/// Hypotheses of one size that get signatures of their own in a round.
const RENEWED: usize = 4;

impl Search<'_> {
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
    pub(super) fn relax(&mut self, size: usize) {
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
            let jacobian = self.screen.jacobian_at(Some(whole));
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
        let wholes: Vec<Candidate> = self.nodes.iter().filter(behind).take(PARTNERS).cloned().collect();
        let mut changed = false;
        for whole in wholes {
            let more = whole.fit.state.effects.iter().find(|a| !part.effects.contains(&a.effect.name));
            let Some(more) = more else { continue };
            let f = self.screen.best_with(self.screen.jacobian_at(Some(part)), &part.fit, more.effect, 6);
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
            let jacobian = self.screen.jacobian_at(Some(of)).clone();
            for (score, other) in self.screen.seconds(&base, None).into_iter().take(EXCHANGED) {
                if of.effects.contains(&other.name) {
                    continue;
                }
                let names: Vec<&str> = named(&base.state).into_iter().chain([other.name]).collect();
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
}
