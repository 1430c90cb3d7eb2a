//! Hull and supply: leak, vacuum, voltage, charge, time, shore.

use super::{Verdict, Watch};
use crate::bound::Bound;
use crate::mutant::Watch as Of;
use core::ops::RangeInclusive;
use signals::{Abort, Micros, Phase, Reading, Switch};

/// Longest time a standing leak alarm may wait for its vote, s.
const LEAK_BOUND_S: f32 = 2.0;
/// A leak detector silent for this long is lost, s: as a depth sensor.
pub const DETECTOR_LOST_S: f32 = 30.0;
/// Both battery gauges silent for this long: the worst is assumed, s.
const GAUGES_LOST_S: f32 = 300.0;

/// Oldest reading of a gauge that is an answer, ms.
const GAUGE_MS: u32 = 60_000;
/// Answers of a hull gauge, Pa.
pub const VACUUM_PA: RangeInclusive<f32> = 10e3..=200e3;
/// Answers of a voltmeter, V.
pub const VOLTS: RangeInclusive<f32> = 0.0..=100.0;
/// Answers of a charge gauge, 0..1.
pub const CHARGE: RangeInclusive<f32> = -0.01..=1.01;

/// The last five samples at a detector or gauge, the newest in bit 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Vote(u8);

impl Vote {
    /// One more look; whether three of the last five are alarms.
    fn take(&mut self, alarm: bool) -> bool {
        self.0 = (self.0 << 1 | u8::from(alarm)) & 0b1_1111;
        self.stands()
    }

    fn stands(self) -> bool {
        self.0.count_ones() >= 3
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SupplyWatch {
    leak: Vote,
    /// A leak detector has answered; and the time for which none has.
    detector_seen: bool,
    detector_lost_s: f32,
    vacuum: Vote,
    volts: Vote,
    charge: Vote,
    gauges_seen: bool,
    gauges_lost_s: f32,
    shore: Micros,
}

impl SupplyWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let (config, frame) = (w.config, w.frame);
        if w.seen.shore {
            self.shore = w.clock;
        }
        // A repeated tick is no look.
        if w.seen.dt_s > 0.0 {
            let leak = frame.leak == Switch::Alarm;
            // Where three votes would take longer than a leak may wait, one is enough.
            let stands = self.leak.take(leak);
            if (stands || (leak && 2.0 * w.cycle_s() > LEAK_BOUND_S)) && Of::Leak.enabled() {
                v.cause(Abort::Leak);
            }
            self.detector(frame.leak != Switch::Unknown, w.seen.dt_s, v);
            let gauge = |reading: Reading, range, alarm: &dyn Fn(f32) -> bool| reading.accept(range, GAUGE_MS).map(alarm);
            let vacuum = gauge(frame.vacuum_pa, VACUUM_PA, &|pa| pa > config.vacuum_max_pa);
            let volts = gauge(frame.battery_v, VOLTS, &|volts| volts < config.undervoltage_v);
            let charge = gauge(frame.charge, CHARGE, &|charge| charge < config.reserve_charge);
            for (vote, alarm, cause, of) in [
                (&mut self.vacuum, vacuum, Abort::Vacuum, Of::Vacuum),
                (&mut self.volts, volts, Abort::Undervoltage, Of::Volts),
                (&mut self.charge, charge, Abort::LowCharge, Of::Charge),
            ] {
                if vote.take(alarm == Some(true)) && of.enabled() {
                    v.cause(cause);
                }
            }
            self.silent_gauges(volts.is_some() || charge.is_some(), w.seen.dt_s, v);
        }
        v.leak_stands = self.leak.stands();
        if w.phase != Phase::Done {
            if w.clock > Micros::from_secs(u64::from(w.max_duration_s)) {
                v.cause(Abort::OverTime);
            }
            if w.clock.since(self.shore) > Micros::from_secs(u64::from(config.no_comms_s)) {
                v.cause(Abort::NoComms);
            }
        }
    }

    /// Whether the leak detector answers at all. One that did is a part lost: nobody would know of water in the hull.
    fn detector(&mut self, answers: bool, dt_s: f32, v: &mut Verdict) {
        self.detector_seen |= answers;
        // What is no number becomes the longest time.
        self.detector_lost_s = if answers { 0.0 } else { (self.detector_lost_s + dt_s).at_most(1e6) };
        v.unguarded = self.detector_lost_s >= Of::Detector.after(DETECTOR_LOST_S) && Of::Detector.enabled();
        if v.unguarded && self.detector_seen {
            v.climb = true;
            v.home_for_now = true;
        }
    }

    /// Whether voltage or charge answers at all.
    fn silent_gauges(&mut self, answers: bool, dt_s: f32, v: &mut Verdict) {
        if answers {
            self.gauges_seen = true;
            self.gauges_lost_s = 0.0;
        } else {
            // What is no number becomes the longest time.
            self.gauges_lost_s = (self.gauges_lost_s + dt_s).at_most(1e6);
            v.home_for_now |= self.gauges_lost_s > GAUGES_LOST_S && self.gauges_seen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Vote;

    #[test]
    fn three_alarms_of_five_are_an_alarm_and_two_are_not() {
        let mut vote = Vote::default();
        let got = [true, false, true, false, false, true, false, true, true].map(|alarm| vote.take(alarm));
        assert_eq!(got, [false, false, false, false, false, false, false, false, true]);
    }
}
