//! Hull and supply: leak, vacuum, voltage, charge, time, shore.

use super::{Verdict, Watch};
use crate::bound::Bound;
use core::ops::RangeInclusive;
use signals::{Abort, Micros, Phase, Reading, SensorFrame, Switch};

/// Longest time a standing leak alarm may wait for its vote, s.
const LEAK_BOUND_S: f32 = 2.0;
/// Both battery gauges silent for this long: the worst is assumed, s.
const GAUGES_LOST_S: f32 = 300.0;

#[cold]
#[inline(never)]
fn no_time_to_vote(w: &Watch<'_>) -> bool {
    2.0 * w.cycle_s() > LEAK_BOUND_S
}

/// Oldest reading of a gauge that is an answer, ms.
const GAUGE_MS: u32 = 60_000;
/// Answers of a hull gauge, Pa.
pub const VACUUM_PA: RangeInclusive<f32> = 10e3..=200e3;
/// Answers of a voltmeter, V.
pub const VOLTS: RangeInclusive<f32> = 0.0..=100.0;
/// Answers of a charge gauge, 0..1.
pub const CHARGE: RangeInclusive<f32> = -0.01..=1.01;

/// Which detector or gauge: its byte among the votes.
#[derive(Clone, Copy)]
enum Of {
    Leak = 0,
    Vacuum = 8,
    Volts = 16,
    Charge = 24,
}

/// The last five answers of each, a byte each, so that a cycle without an alarm costs one shift for all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Votes(u32);

impl Votes {
    fn take(&mut self, leak: bool) {
        self.0 = ((self.0 << 1) & 0x1E1E_1E1E) | u32::from(leak);
    }

    /// An alarm of this one in this cycle; whether it is the third of five.
    fn alarm(&mut self, of: Of) -> bool {
        self.0 |= 1 << of as u32;
        self.three_of_five(of)
    }

    /// Whether three of the last five are alarms.
    fn three_of_five(self, of: Of) -> bool {
        // Bit n says whether three bits or more are set in n: the processor has no instruction that counts bits.
        (0xFEE8_E880_u32 >> (self.0 >> of as u32 & 0b1_1111)) & 1 != 0
    }
}

/// The number a gauge gives, whatever it is worth.
#[inline(always)]
fn raw(reading: Reading) -> f32 {
    match reading {
        Reading::Sampled { value, .. } => value,
        Reading::Missing => f32::NAN,
    }
}

/// Whether that number is a gauge's, and of now.
#[inline(always)]
fn answers(reading: Reading, range: RangeInclusive<f32>) -> bool {
    reading.accept(range, GAUGE_MS).is_some()
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SupplyWatch {
    votes: Votes,
    gauges_seen: bool,
    gauges_lost_s: f32,
    shore: Micros,
}

impl SupplyWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let config = w.config;
        if w.seen.dt_s > 0.0 {
            let leak = w.frame.leak == Switch::Alarm;
            self.votes.take(leak);
            v.leak_stands = self.votes.three_of_five(Of::Leak);
            // Where three votes would take longer than a leak may wait, one is enough.
            if v.leak_stands || (leak && no_time_to_vote(w)) {
                v.cause(Abort::Leak);
            }
            // What is no number is no suspicion; whether a suspicion is a reading at all is asked only then.
            let vacuum = raw(w.frame.vacuum_pa) > config.vacuum_max_pa;
            let volts = raw(w.frame.battery_v) < config.undervoltage_v;
            let charge = raw(w.frame.charge) < config.reserve_charge;
            if vacuum || volts || charge {
                v.busy = true;
                v.abort = v.abort.or(self.suspect(w.frame, vacuum, volts, charge));
            }
        }
        if w.seen.shore {
            self.shore = w.clock;
        }
    }

    /// Votes on gauges that give cause to. The third alarm of five is found in the cycle in which it is read.
    #[cold]
    #[inline(never)]
    fn suspect(&mut self, frame: &SensorFrame, vacuum: bool, volts: bool, charge: bool) -> Option<Abort> {
        let mut found = None;
        if charge && answers(frame.charge, CHARGE) && self.votes.alarm(Of::Charge) {
            found = Some(Abort::LowCharge);
        }
        if volts && answers(frame.battery_v, VOLTS) && self.votes.alarm(Of::Volts) {
            found = Some(Abort::Undervoltage);
        }
        if vacuum && answers(frame.vacuum_pa, VACUUM_PA) && self.votes.alarm(Of::Vacuum) {
            found = Some(Abort::Vacuum);
        }
        found
    }

    /// Every third cycle, `dt_s` since the last look: time, shore, and whether voltage or charge answers at all.
    pub(super) fn look(&mut self, w: &Watch<'_>, dt_s: f32, v: &mut Verdict) {
        let running = !matches!(w.phase, Phase::Done);
        if running && w.clock > Micros::from_secs(u64::from(w.max_duration_s)) {
            v.cause(Abort::OverTime);
        }
        if running && w.clock.since(self.shore) > Micros::from_secs(u64::from(w.config.no_comms_s)) {
            v.cause(Abort::NoComms);
        }
        if !(dt_s > 0.0) {
            return;
        }
        if answers(w.frame.battery_v, VOLTS) || answers(w.frame.charge, CHARGE) {
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
    use super::{Of, Votes};

    #[test]
    fn three_alarms_of_five_are_an_alarm_and_two_are_not() {
        let answers = [true, false, true, false, false, true, false, true, true];
        let all = [Of::Leak, Of::Vacuum, Of::Volts, Of::Charge];
        for of in all {
            let mut votes = Votes::default();
            let got: Vec<bool> = answers
                .into_iter()
                .map(|a| {
                    votes.take(a && matches!(of, Of::Leak));
                    if a {
                        votes.alarm(of);
                    }
                    // Nobody votes for another.
                    assert!(all.iter().all(|other| *other as u32 == of as u32 || !votes.three_of_five(*other)));
                    votes.three_of_five(of)
                })
                .collect();
            assert_eq!(got, [false, false, false, false, false, false, false, false, true]);
        }
    }
}
