//! Sums of a campaign: what passed, what did not, what nobody could have brought home.

use super::Verdict;
use super::lattice::Case;
use crate::flight::closed_loop::End;

/// Sums of a campaign.
#[derive(Clone, Copy, Debug, Default)]
pub struct Summary {
    /// Missions with a fault that were judged.
    pub missions: u64,
    /// Of these, all global rules kept.
    pub safe: u64,
    /// Of these, below crush depth.
    pub below_crush: u64,
    /// Missions with a fault that came home, those set apart too, and those flown to their end.
    pub home: u64,
    /// See [`Self::home`].
    pub finished: u64,
    /// Of these, expectation of the fault not met.
    pub unmet: u64,
    /// Healthy twins.
    pub twins: u64,
    /// Of these, aborted or not finished.
    pub false_aborts: u64,
    /// Missions set apart before the flight, for want of any force that points up; not among `missions`.
    pub apart: u64,
    /// Of these, home all the same: a fault's phase never came, or the weight went before its release stuck.
    pub apart_home: u64,
    /// Missions with a fault deeper than 100 m, those set apart too, and those of them with two faults.
    pub at_depth: u64,
    /// See [`Self::at_depth`].
    pub pairs_at_depth: u64,
    /// Of the missions over a bad line, those with another actuator stream than their twin.
    pub line_changed: u64,
}

impl Summary {
    /// Counts verdicts; `twins` are the healthy ones.
    #[must_use]
    pub fn of(faulty: &[Verdict], twins: &[Verdict]) -> Self {
        let mut s = Self { twins: twins.len() as u64, ..Self::default() };
        s.false_aborts = twins.iter().filter(|t| t.abort.is_some() || t.end != End::Done || t.unmet.is_some()).count() as u64;
        let key = |c: &Case| (c.water, c.wings as u8, c.seed);
        let streams: std::collections::HashMap<_, u64> = twins.iter().map(|t| (key(&t.case), t.hash)).collect();
        for v in faulty {
            s.home += u64::from(v.home());
            s.finished += u64::from(v.finished);
            s.unmet += u64::from(v.unmet.is_some());
            s.at_depth += u64::from(v.at_depth());
            s.pairs_at_depth += u64::from(v.at_depth() && v.case.faults.len() == 2);
            if v.apart() {
                s.apart += 1;
                s.apart_home += u64::from(v.home());
                continue;
            }
            s.missions += 1;
            s.safe += u64::from(v.safe());
            s.below_crush += u64::from(v.crushed());
            s.line_changed += u64::from(v.case.line.is_some() && streams.get(&key(&v.case)).is_some_and(|h| *h != v.hash));
        }
        s
    }

    /// Nothing to complain about.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.missions > 0 && self.safe == self.missions && self.below_crush + self.unmet + self.false_aborts + self.line_changed == 0
    }
}
