//! Which faults are active when.

use super::{Fault, Kind, Target};
use signals::Phase;

/// Faults and when they began.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schedule {
    entries: Vec<(Fault, Option<f64>)>,
}

impl Schedule {
    pub(crate) fn new(faults: &[Fault]) -> Self {
        Self { entries: faults.iter().map(|f| (*f, f.phase.is_none().then_some(f.delay_s))).collect() }
    }

    pub(crate) fn add(&mut self, fault: Fault, now: f64) {
        self.entries.push((fault, fault.phase.is_none().then_some(now + fault.delay_s)));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The controller is in `phase` at `now`.
    pub(crate) fn observe(&mut self, phase: Phase, now: f64) {
        for (fault, onset) in &mut self.entries {
            if onset.is_none() && fault.phase == Some(phase) {
                *onset = Some(now + fault.delay_s);
            }
        }
    }

    /// Active faults, each with the time since it began, s.
    pub(crate) fn active(&self, now: f64) -> impl Iterator<Item = (Fault, f64)> + '_ {
        self.entries.iter().filter_map(move |(fault, onset)| {
            let since = now - (*onset)?;
            (since >= 0.0 && fault.duration_s.is_none_or(|d| since < d)).then_some((*fault, since))
        })
    }

    /// Size of an active fault and the time since it began.
    pub(crate) fn find(&self, now: f64, target: Target, kind: Kind) -> Option<(f64, f64)> {
        self.active(now).find(|(f, _)| f.target == target && f.kind == kind).map(|(f, since)| (f.size, since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_waits_for_its_phase_and_ends() {
        let mut s = Schedule::new(&["depth:off@climb+10s,20s".parse().unwrap()]);
        assert!(s.find(1e6, Target::Depth, Kind::Off).is_none());
        s.observe(Phase::Climb, 100.0);
        s.observe(Phase::Climb, 115.0);
        let at = |t| s.find(t, Target::Depth, Kind::Off).is_some();
        assert!(!at(109.9) && at(110.0) && at(129.9) && !at(130.0));
    }
}
