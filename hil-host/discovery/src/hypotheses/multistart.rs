//! Fits that sit where they should not: behind a hill of the strained calibration they came from, or on a ledge where no signature
//! points downhill (a leg that stalls with the next small step).

use crate::hypotheses::candidate::{Candidate, RENEW_GAIN, TELLS_ALL, is_strained, named};
use crate::hypotheses::search::{Search, may_win_from, prior_of};
use crate::inference::initial_guess::descend;
use crate::model::parameters::State;
use hydro::effects::Active;

/// Hypotheses that are let go from a strained calibration, and the shares of the strain that are kept.
const LET_GO: usize = 6;
const KEPT_STRAIN: [f64; 2] = [0.0, 0.5];
/// How far from half a share is to be that gives an effect to one of two places.
const GIVEN: f64 = 0.25;
/// Fall of chi² that signatures promise and no step along them finds, from which a fit is stuck: what decides whether a name is said.
const STUCK: f64 = 4.0;
/// Stuck hypotheses that are freed, and the share of an effect's size from which they go on.
const FREED: usize = 4;
const HALF: f64 = 0.5;
/// Leading hypotheses whose parts follow them, and the steps by which a part shows that it may be lower there.
const LED: usize = 2;
const FIRST_STEPS: usize = 3;

/// The state with an effect that has been given all to one of two places in the other one; none if it has none.
fn elsewhere(state: &State) -> Option<State> {
    let given = |a: &Active| a.effect.parameters().get(1).is_some_and(|p| p.name == "wing_share") && (a.values[1] - 0.5).abs() > GIVEN;
    let k = state.effects.iter().position(given)?;
    let mut state = state.clone();
    state.effects[k].values[1] = 1.0 - state.effects[k].values[1];
    Some(state)
}

impl Search<'_> {
    /// Far from its model a flight strains the calibration before any effect is there, and what leads may stay in that hollow: the
    /// leaders are fitted anew, as large as they are, from a calibration that is not strained.
    pub(crate) fn let_go(&mut self) {
        let strained = |c: &Candidate| is_strained(&c.fit.state);
        let plain = |c: &Candidate| c.fit.state.wave.is_none() && c.log_odds.is_finite();
        let leaders: Vec<usize> = (0..self.found.len()).filter(|&k| plain(&self.found[k])).take(LET_GO).collect();
        if !leaders.first().is_some_and(|&k| strained(&self.found[k])) {
            return;
        }
        for k in leaders.into_iter().filter(|&k| strained(&self.found[k])).collect::<Vec<_>>() {
            let was = &self.found[k].fit;
            let kept = if was.mean_square() > TELLS_ALL { &KEPT_STRAIN[..] } else { &[] };
            let from = |share: f64| State { calibration: was.state.calibration.map(|z| share * z), ..was.state.clone() };
            let mut starts: Vec<State> = kept.iter().map(|share| from(*share)).collect();
            starts.extend(elsewhere(&from(0.0)));
            self.take_lower(k, &starts, RENEW_GAIN);
        }
        self.settle(2);
    }

    /// Leaders that are stuck go on from where one of their effects is half as large.
    pub(crate) fn free_the_stuck(&mut self) {
        self.found.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        let top = self.found.first().map_or(0.0, |c| c.log_odds.max(0.0));
        let floor = may_win_from(top);
        let stuck = |c: &Candidate| c.fit.promised > STUCK && c.fit.state.wave.is_none() && c.log_odds > floor;
        let concerned: Vec<usize> = (0..self.found.len()).filter(|&k| stuck(&self.found[k])).take(FREED).collect();
        for k in concerned {
            let was = &self.found[k];
            let halved = |of: usize| {
                let mut state = was.fit.state.clone();
                let effect = &mut state.effects[of];
                let off = effect.effect.parameters()[0].off;
                effect.values[0] = off + HALF * (effect.values[0] - off);
                state
            };
            let starts: Vec<State> = (0..was.fit.state.effects.len()).map(halved).collect();
            self.take_lower(k, &starts, STUCK);
        }
        self.settle(2);
    }

    /// What is a part of a leading pair goes on from where the pair is, if that is lower: the pair may have found the way for both, and
    /// its part would pass for worse than it is.
    pub(crate) fn follow_the_whole(&mut self) {
        let screen = self.screen;
        let plain = |c: &Candidate| c.fit.state.wave.is_none() && c.log_odds > 0.0;
        let leaders: Vec<Candidate> = self.found.iter().take(LED).filter(|c| plain(c) && c.effects.len() > 1).cloned().collect();
        for whole in &leaders {
            for left_out in 0..whole.fit.state.effects.len() {
                let mut part = whole.fit.state.clone();
                part.effects.remove(left_out);
                let same = |c: &Candidate| plain(c) && named(&c.fit.state) == named(&part);
                let Some(k) = self.found.iter().position(same) else { continue };
                let there = screen.fit(screen.beside(Some(whole)), &part, FIRST_STEPS);
                if there.chi2 < self.found[k].fit.chi2 {
                    self.take_lower(k, &[there.state], RENEW_GAIN);
                }
            }
        }
        self.settle(2);
    }

    /// A hypothesis takes the best of the fits from these starts, where it is lower by so much chi².
    fn take_lower(&mut self, k: usize, starts: &[State], by: f64) {
        let (screen, was) = (self.screen, &self.found[k]);
        let fits = starts.iter().map(|start| descend(screen.problem, start));
        let Some(f) = fits.min_by(|a, b| a.chi2.total_cmp(&b.chi2)).filter(|f| f.chi2 < was.fit.chi2 - by) else { return };
        let (f, own) = screen.renewed(f, 4);
        self.found[k] = Candidate { own: Some(own), ..screen.candidate(f, prior_of(was.effects.len()), was.correction) };
    }
}
