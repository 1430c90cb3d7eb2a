//! What the controller owes to each fault.
//!
//! The global rules hold for every case (surface, crush depth, ranges, latch).
//! On top of them a fault may demand an abort within a bound, or forbid one.
//! Bounds count from the fault's onset and are sums of what the law says it
//! waits for; the judge adds the control cycle between onset and reading. Where
//! the failed part shows only when it is next needed, the time until then is
//! that of the mission's own healthy twin ([`super::twin`]).

use plant::Fault;
use plant::faults::{Kind, Target};
use signals::{Abort, Phase};

/// Expected behaviour beyond the global rules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expect {
    /// Abort with one of these first causes within this many seconds.
    Abort(&'static [Abort], f64),
    /// The mission goes on: no abort.
    Mission,
    /// No later than this many seconds the vehicle has turned for the surface, aborted or not.
    Home(f64),
    /// Either is right.
    Either,
}

/// Three looks of five, one in each cycle, s: what is there when the first is taken is found two cycles later.
const THREE_LOOKS_S: f64 = 8.0;

/// From the moment at which a pump is asked for what it does not do, s: three retries and a reverse of 8 s each, the depth's
/// answer, and as much again.
const NO_ANSWER_S: f64 = 120.0;

/// What is owed to a single fault; `needed_s`: time from its onset until the healthy twin asks the pump to be elsewhere than
/// where the fault holds it or its feedback, s.
#[must_use]
pub fn expect(fault: &Fault, needed_s: f64) -> Expect {
    use Abort::*;
    use Kind as K;
    use Target as T;
    let in_water = !matches!(fault.phase, Some(Phase::Surface | Phase::Comms) | None);
    // In a turn nothing can be expected to move before the pump has changed sides: 472 cc at 13 cc/s.
    let turning_s = if matches!(fault.phase, Some(Phase::InflectLow | Phase::InflectHigh)) { 37.0 } else { 0.0 };
    let rule = match (fault.target, fault.kind) {
        // No effect on the safety loop, whatever it says.
        (T::Density | T::Roll, _) => Expect::Mission,
        (T::WeightMonitor | T::Gps | T::Comms, _) if fault.kind != K::Alarm => Expect::Mission,
        (T::Altitude, K::Off | K::Nan | K::Inf | K::Sentinel | K::Intermittent | K::Stuck | K::Slow | K::Delayed) => Expect::Mission,
        (T::LeakDetector, K::Stuck) => Expect::Mission,
        (T::Depth, K::Spike | K::Intermittent) => Expect::Mission,
        (T::Sea, K::Current | K::Upwelling) => Expect::Mission,
        // One of two depth sensors is gone for good (30 s): nothing is left behind the other one. A dwell of 8 s in the new dive.
        (T::Depth | T::Depth2, K::Off | K::Nan | K::Inf | K::Sentinel) if in_water => Expect::Home(30.0 + 12.0),
        // The vehicle is in danger or blind.
        (T::LeakDetector, K::Alarm) => Expect::Abort(&[Leak], 0.0),
        // A spoonful of 2 g at 20 g/min.
        (T::Hull, K::Leak) => Expect::Abort(&[Leak], 6.0),
        // 77.6 kPa towards an atmosphere with 600 s: 87.8 kPa is crossed after 337 s, at 22 Pa/s; 3 σ of the gauge are 300 Pa.
        (T::Hull, K::VacuumLoss) => Expect::Abort(&[Vacuum], 337.0 + 300.0 / 22.0 + THREE_LOOKS_S),
        (T::Power, K::Undervoltage) => Expect::Abort(&[Undervoltage], THREE_LOOKS_S),
        (T::Power, K::LowCharge) => Expect::Abort(&[LowCharge], THREE_LOOKS_S),
        (T::Power, K::BrownOut) => Expect::Abort(&[Reset], 4.0),
        (T::VacuumGauge, K::Bias) if fault.size >= 2e4 => Expect::Abort(&[Vacuum], THREE_LOOKS_S),
        (T::WeightMonitor, K::Alarm) => Expect::Abort(&[Degraded], THREE_LOOKS_S),
        // The wire burns for 120 s.
        (T::Release, K::Spurious) => Expect::Abort(&[Degraded], 120.0 + THREE_LOOKS_S),
        // A lie must be found out; what is silent or absurd is above.
        (T::Depth | T::Depth2, K::Stuck) if in_water => Expect::Abort(&[StuckDepth, SensorDepth], 60.0 + 4.0 + turning_s),
        (T::Pitch, K::Off | K::Nan | K::Inf | K::Sentinel) => Expect::Abort(&[SensorPitch], 60.0),
        (T::MassFeedback, K::Off | K::Nan | K::Inf | K::Sentinel) => Expect::Abort(&[MassStuck], 120.0),
        (T::BallastFeedback, K::Off | K::Nan | K::Inf | K::Sentinel) => Expect::Abort(&[BallastFeedback], 9.0),
        // At rest a pump that sticks, one run away to where it is, and a feedback stuck there are no different from sound ones.
        (T::Pump, K::Stuck) => Expect::Abort(&[PumpStuck, BallastFeedback, StuckDepth, Stalled, OverDepth], needed_s + NO_ANSWER_S),
        (T::Pump, K::Runaway) => Expect::Abort(&[PumpStuck], needed_s + NO_ANSWER_S),
        (T::BallastFeedback, K::Stuck) => Expect::Abort(&[BallastFeedback, PumpStuck], needed_s + NO_ANSWER_S),
        _ => Expect::Either,
    };
    match rule {
        // A fault that is over before the bound need not be seen.
        Expect::Abort(_, bound) | Expect::Home(bound) if fault.duration_s.is_some_and(|d| d < bound) => Expect::Either,
        rule => rule,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::faults::catalogue;

    fn owed(fault: &str, needed_s: f64) -> Expect {
        expect(&fault.parse().expect("a fault"), needed_s)
    }

    #[test]
    fn a_held_pump_is_owed_from_the_moment_it_is_needed_and_not_when_it_never_is() {
        for fault in ["pump:stuck@climb", "pump:runaway=-1@dive", "ballast:stuck@climb"] {
            let bound = |needed_s| match owed(fault, needed_s) {
                Expect::Abort(_, bound) => bound,
                other => panic!("{fault}: {other:?}"),
            };
            assert_eq!((bound(0.0), bound(2316.0), bound(f64::INFINITY)), (120.0, 2436.0, f64::INFINITY), "{fault}");
        }
        // Over before the bound.
        assert_eq!(owed("pump:stuck@climb,90s", 0.0), Expect::Either);
        // Its feedback silent: at once, needed or not.
        assert_eq!(owed("ballast:off@climb", f64::INFINITY), Expect::Abort(&[Abort::BallastFeedback], 9.0));
    }

    #[test]
    fn no_bound_but_that_of_a_held_pump_a_lost_vacuum_and_a_burning_wire_is_longer_than_two_minutes() {
        for (target, kind, _, _) in catalogue() {
            let fault = Fault::new(target, kind).expect("in the catalogue").at(Phase::InflectLow, 0.0);
            let bound = match expect(&fault, 0.0) {
                Expect::Abort(_, bound) | Expect::Home(bound) => bound,
                Expect::Mission | Expect::Either => continue,
            };
            let slow = matches!((target, kind), (Target::Hull, Kind::VacuumLoss) | (Target::Release, Kind::Spurious));
            assert!(bound <= 120.0 || slow, "{}:{} {bound} s", target.name(), kind.name());
        }
    }
}
