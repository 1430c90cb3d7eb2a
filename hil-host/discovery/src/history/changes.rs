//! What changed in a mission, by the history of its own dives: each dive against the quiet ones before it, and steps and drifts by what
//! later dives say together.
//!
//! A dive's own scatter is integrated out of its summary, `A = N - N (N + T⁻¹)⁻¹ N`; such marginal summaries of several dives add up, with
//! weights where a change grows, and what is not known of the mean is all the covariance that is left.

use super::glide::Glider;
use super::judge::{Judgement, judge};
use super::learn::{FEWEST_CONTROLS, Learnt, WINDOW, forward, learn, linear_about, start};
use super::numbers::{NUMBERS, Numbers};
use super::rows::{Unit, drive_m3, mean_temperature_degc, without_stubs};
use super::summary::Summary;
use super::weigh::{chance, inverse, weigh};
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};

/// A unit beside the quiet ones before it.
#[derive(Clone, Debug)]
pub struct Compared {
    /// What is said of it.
    pub judgement: Judgement,
    /// How probable it is that a healthy one departs as much, and the least that this could be.
    pub chance: (f64, f64),
}

/// The dives of a mission as their own history.
#[derive(Clone, Debug)]
pub struct Own {
    /// Steady dives in the order of time.
    pub units: Vec<Unit>,
    /// Numbers that the start of the mission has.
    from: Numbers,
    quiet: Vec<bool>,
    /// What its numbers are relative to.
    pub glider: Glider,
}

/// What an ordinary dive leaves of a unit's summary.
fn marginal(unit: &Summary, history: &Learnt) -> Summary {
    let nc = &unit.n * inverse(&(&unit.n + inverse(&history.between.scatter)));
    let about = unit.about(&history.between.mean);
    Summary { n: &unit.n - &nc * &unit.n, u: &about - &nc * &about }
}

impl Own {
    /// Of a mission; none where it has too few steady dives to be a history.
    #[must_use]
    pub fn of(units: Vec<Unit>, vehicle: &Vehicle) -> Option<Self> {
        const FIRST: usize = 6;
        let units = without_stubs(units);
        if units.len() <= FEWEST_CONTROLS {
            return None;
        }
        let glider = Glider::new(vehicle, mean_temperature_degc(&units), drive_m3(&units));
        let from = start(&units.iter().take(FIRST).collect::<Vec<_>>(), &glider);
        let quiet = forward(&units, &glider, &from, WINDOW).iter().map(|f| f.quiet).collect();
        Some(Self { units, from, quiet, glider })
    }

    fn quiet_before(&self, i: usize) -> Vec<&Unit> {
        let quiet: Vec<&Unit> = self.units[..i].iter().zip(&self.quiet).filter(|(_, quiet)| **quiet).map(|(u, _)| u).collect();
        quiet[quiet.len().saturating_sub(WINDOW)..].to_vec()
    }

    /// Every unit beside the quiet ones before it; none of those that have too few before them.
    #[must_use]
    pub fn one_by_one(&self) -> Vec<Option<Compared>> {
        /// A history of this many controls is learnt anew after so many more.
        const LEARNT: (usize, usize) = (12, 4);
        let mut earlier = Vec::new();
        let mut last: Option<(usize, Learnt)> = None;
        let one = |i: usize| {
            let before = self.quiet_before(i);
            let seen = self.quiet[..i].iter().filter(|quiet| **quiet).count();
            if before.len() < FEWEST_CONTROLS {
                return None;
            }
            let is_new = |at: usize| seen > at && (seen < LEARNT.0 || seen >= at + LEARNT.1);
            if last.as_ref().is_none_or(|l| is_new(l.0)) {
                last = Some((seen, learn(&before, &self.glider, &self.from)));
            }
            let history = &last.as_ref()?.1;
            let judgement = judge(&self.units[i], &self.glider, history, &history.at);
            let chance = chance(judgement.chi2, &earlier);
            if judgement.is_quiet() {
                earlier.push(judgement.chi2);
            }
            Some(Compared { judgement, chance })
        };
        (0..self.units.len()).map(one).collect()
    }

    /// ln Bayes factors of the numbers for a change that has gone by `weight` at each unit, against units that have none of it.
    /// A step before which there are not three quiet units cannot be told from the vehicle; of a growth the oldest are the history then.
    #[must_use]
    pub fn change(&self, weight: &[f64]) -> Option<[f64; NUMBERS]> {
        const OLDEST: usize = 12;
        let first = weight.iter().position(|w| *w != 0.0)?;
        let mut before = self.quiet_before(first);
        let (mut from, mut least) = (first, 0.0);
        if before.len() < FEWEST_CONTROLS {
            if weight.iter().skip(first).all(|w| *w == weight[first]) {
                return None;
            }
            from = OLDEST.min(self.units.len() / 3).max(FEWEST_CONTROLS);
            before = self.units.get(..from)?.iter().collect();
            least = weight.get(..from)?.iter().sum::<f64>() / from as f64;
        }
        let history = learn(&before, &self.glider, &self.from);
        let (mut n, mut u) = (DMatrix::zeros(NUMBERS, NUMBERS), DVector::zeros(NUMBERS));
        for (unit, w) in self.units.iter().zip(weight).skip(from) {
            let linear = linear_about(unit, &self.glider, &history.at, &Numbers::zeros());
            let one = marginal(&Summary::of(&linear, linear.own_level(Some(history.usual_level))), &history);
            n += one.n * (w - least).powi(2);
            u += one.u * (w - least);
        }
        let all = Summary { n, u };
        Some(std::array::from_fn(|k| weigh(&all, &DVector::zeros(NUMBERS), &history.between.of_mean, &[k]).ln_bayes))
    }
}
