//! Hull and supply: leak, vacuum, voltage, charge, time, shore.

use super::{Verdict, Watch};
use crate::bound::Bound;
use signals::{Abort, Micros, Phase, Switch};

/// Longest time a standing leak alarm may wait for its vote, s.
const LEAK_BOUND_S: f32 = 2.0;
/// Both battery gauges silent for this long: the worst is assumed, s.
const GAUGES_LOST_S: f32 = 300.0;

#[cold]
#[inline(never)]
fn no_time_to_vote(w: &Watch<'_>) -> bool {
    2.0 * w.cycle_s() > LEAK_BOUND_S
}

/// The last five answers of a detector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Vote(u8);

impl Vote {
    /// Whether three of the last five are alarms.
    fn three_of_five(&mut self, alarm: bool) -> bool {
        self.0 = ((self.0 << 1) | u8::from(alarm)) & 0b1_1111;
        // Bit n says whether three bits or more are set in n: the processor has no instruction that counts bits.
        (0xFEE8_E880_u32 >> self.0) & 1 != 0
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SupplyWatch {
    leak: Vote,
    vacuum: Vote,
    volts: Vote,
    charge: Vote,
    gauges_seen: bool,
    gauges_lost_s: f32,
    shore: Micros,
}

impl SupplyWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let config = w.config;
        let new = w.seen.dt_s > 0.0;
        if new {
            let leak = w.frame.leak == Switch::Alarm;
            let voted = self.leak.three_of_five(leak);
            v.leak_stands = voted;
            // Where three votes would take longer than a leak may wait, one is enough.
            if voted || (leak && no_time_to_vote(w)) {
                v.cause(Abort::Leak);
            }
        }
        let running = !matches!(w.phase, Phase::Done);
        if running && w.clock > Micros::from_secs(u64::from(w.max_duration_s)) {
            v.cause(Abort::OverTime);
        }
        if w.seen.shore {
            self.shore = w.clock;
        }
        if running && w.clock.since(self.shore) > Micros::from_secs(u64::from(config.no_comms_s)) {
            v.cause(Abort::NoComms);
        }
    }

    /// Every third cycle, `dt_s` since the last look. So the third vote comes in the ninth cycle after the alarm at the latest.
    pub(super) fn look_at_hull(&mut self, w: &Watch<'_>, dt_s: f32, v: &mut Verdict) {
        if !(dt_s > 0.0) {
            return;
        }
        let vacuum = w.frame.vacuum_pa.accept(10e3..=200e3, 60_000);
        if self.vacuum.three_of_five(vacuum.is_some_and(|p| p > w.config.vacuum_max_pa)) {
            v.cause(Abort::Vacuum);
        }
    }

    /// The same for voltage and charge.
    pub(super) fn look_at_battery(&mut self, w: &Watch<'_>, dt_s: f32, v: &mut Verdict) {
        if !(dt_s > 0.0) {
            return;
        }
        let volts = w.frame.battery_v.accept(0.0..=100.0, 60_000);
        if self.volts.three_of_five(volts.is_some_and(|u| u < w.config.undervoltage_v)) {
            v.cause(Abort::Undervoltage);
        }
        let charge = w.frame.charge.accept(-0.01..=1.01, 60_000);
        if self.charge.three_of_five(charge.is_some_and(|c| c < w.config.reserve_charge)) {
            v.cause(Abort::LowCharge);
        }
        if volts.is_some() || charge.is_some() {
            self.gauges_seen = true;
            self.gauges_lost_s = 0.0;
        } else {
            // What is no number becomes the longest time.
            self.gauges_lost_s = (self.gauges_lost_s + dt_s).at_most(1e6);
            v.homeward |= self.gauges_lost_s > GAUGES_LOST_S && self.gauges_seen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Vote;

    #[test]
    fn three_alarms_of_five_are_an_alarm_and_two_are_not() {
        let mut vote = Vote::default();
        let answers = [true, false, true, false, false, true, false, true, true];
        let got: Vec<bool> = answers.into_iter().map(|a| vote.three_of_five(a)).collect();
        assert_eq!(got, [false, false, false, false, false, false, false, false, true]);
    }
}
