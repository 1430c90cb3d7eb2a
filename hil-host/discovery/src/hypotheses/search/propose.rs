//! Which hypotheses are fitted: singles by their linear estimates, pairs and triples by the sensitivities at the best.

use super::{MAY_WIN, MAY_WIN_SHARE, PARTNERS, Search, WORTH_A_FIT, prior_of};
use crate::hypotheses::candidate::{Candidate, RENEW_GAIN};
use crate::hypotheses::sensitivity::Signature;
use crate::inference::evidence::PRIOR;
use crate::inference::linear::linear;
use crate::inference::posterior::Fit;
use hydro::effects::Effect;
use logs::vehicle::catalogue;

/// Most singles, and most pairs, that are fitted with the full model.
const MOST_SINGLES: usize = 8;
const MOST_PAIRS: usize = 10;
/// Singles that pairs are proposed with, and pairs proposed by the signatures at nothing missing.
const LEADERS: usize = 3;
const AT_NOTHING: usize = 4;
/// Pairs that a third effect is sought for, and third effects tried with each.
const TRIPLED: (usize, usize) = (3, 4);

impl Search<'_> {
    /// Linear estimates of all, full fits of those that matter.
    pub(super) fn singles(&mut self, signs: &[Signature]) {
        (self.tick)("single effects", 0.1);
        let problem = self.screen.problem;
        let estimate = |s: &Signature| {
            let start = problem.active(s.effect, s.effect.parameters[0].off);
            linear(problem, &self.screen.null, start, &s.column)
        };
        let linear_fits: Vec<Fit> = signs.iter().map(estimate).collect();
        let mut gains: Vec<(f64, usize)> = linear_fits.iter().enumerate().map(|(i, f)| (self.screen.null.chi2 - f.chi2, i)).collect();
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best_gain = gains.first().map_or(0.0, |g| g.0);
        let mut fitted = 0;
        for (gain, i) in gains {
            let effect = signs[i].effect;
            let name = [effect.name];
            if self.position(&name).is_some() {
                continue;
            }
            // A stall's angle is nowhere near linear: of a flight that shows much, its signatures say little.
            let nonlinear = effect.onset.is_some() && best_gain > RENEW_GAIN;
            let promising = gain > WORTH_A_FIT && fitted < MOST_SINGLES && gain > 0.1 * best_gain;
            let full = promising || nonlinear || fitted < 2 || self.known(&name).is_some();
            let fit = if full && !self.is_used_up() {
                fitted += 1;
                (self.tick)(effect.name, 0.1 + 0.3 * fitted as f64 / catalogue::all().count() as f64);
                let screen = &self.screen;
                self.fitted(&screen.jacobian, &name, || screen.best_with(&screen.jacobian, &screen.null, effect, 6))
            } else if let Some(onset) = effect.onset {
                // Its signature has no size: the linear estimate would be of an amplitude.
                self.screen.fit_unfelt(effect, onset)
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
    pub(super) fn pairs(&mut self, signs: &[Signature], ranked: &[(f64, usize, usize)]) {
        self.sort();
        let best_single = self.top();
        // What is proposed, with the log odds it promises, the state it starts from and the signatures there.
        let mut proposed: Vec<(f64, Vec<&'static str>, usize, &'static Effect)> = Vec::new();
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
            seconds.truncate(PARTNERS);
            seconds.extend(self.current().filter(|c| single.effects != [c.name]).map(|current| (0.0, current)));
            for (score, effect) in seconds {
                proposed.push((single.log_odds + score + per_effect, vec![single.effects[0], effect.name], k, effect));
            }
            if self.screen.has_waves() && single.is_plain() {
                let (f, extra) = self.screen.with_wave(self.screen.jacobian_at(Some(&single)), &single.fit, 2);
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
            let gain = |e: &Effect| self.position(&[e.name]).map_or(f64::NEG_INFINITY, |k| self.nodes[k].gain);
            let (first, second) = if gain(a) >= gain(b) { (a, b) } else { (b, a) };
            let Some(k) = self.position(&[first.name]) else { continue };
            proposed.push((score + (prior_of(2) / PRIOR.0).ln(), vec![first.name, second.name], k, second));
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
            if self.position(&names).is_some() || self.nodes[k].effects == [second.name] {
                continue;
            }
            done += 1;
            (self.tick)("pairs", 0.6 + 0.2 * done as f64 / MOST_PAIRS as f64);
            let base = self.nodes[k].clone();
            let jacobian = self.screen.jacobian_at(Some(&base));
            let screen = &self.screen;
            if base.fit.state.wave.is_some() {
                let (f, _) = screen.renewed(screen.best_with(jacobian, &base.fit, second, 4), 4);
                self.take(f, None, base.correction);
            } else {
                let f = self.fitted(jacobian, &names, || screen.best_with(jacobian, &base.fit, second, 6));
                self.take(f, None, 0.0);
            }
        }
    }

    /// To the best pairs, the third effects that promise most.
    pub(super) fn triples(&mut self) {
        self.sort();
        let pairs: Vec<Candidate> =
            self.nodes.iter().filter(|c| c.effects.len() == 2 && c.log_odds.is_finite()).take(TRIPLED.0).cloned().collect();
        for pair in pairs {
            for (_, third) in self.screen.seconds(&pair.fit, pair.own.as_deref()).into_iter().take(TRIPLED.1) {
                let names: Vec<&str> = pair.effects.iter().copied().chain([third.name]).collect();
                if self.position(&names).is_none() {
                    let f = self.screen.best_with(self.screen.jacobian_at(Some(&pair)), &pair.fit, third, 6);
                    self.take(f, None, pair.correction);
                }
            }
            if pair.is_plain() && self.screen.has_waves() {
                let (f, extra) = self.screen.with_wave(self.screen.jacobian_at(Some(&pair)), &pair.fit, 2);
                self.take(f, None, extra);
            }
        }
    }
}
