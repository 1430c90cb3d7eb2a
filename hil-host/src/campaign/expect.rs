//! What the controller owes to each fault.
//!
//! The global rules hold for every case (surface, crush depth, ranges, latch).
//! On top of them a fault may demand an abort within a bound, or forbid one.
//! Bounds count from the fault's onset and contain the control cycle of 4 s
//! and the votes of the law; where the failed part is only used at the next
//! turn, they contain the longest dive.

use super::lattice::Water;
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

/// Longest time until a pump that fails in a dive or climb is next asked to move, s: 27 m at 0.09 m/s, and 190 m at the
/// 0.074 m/s of the slowest healthy climb (standard wings at the flat pitch that the flight has learned, 2,504 s). Until
/// then a pump at rest, or its feedback stuck where the pump was sent, is no different from a sound one.
fn next_turn_s(water: Water) -> f64 {
    match water {
        Water::Shallow => 300.0,
        Water::Edge => 2600.0,
    }
}

/// What is owed to a single fault.
#[must_use]
pub fn expect(fault: &Fault, water: Water) -> Expect {
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
        (T::LeakDetector, K::Alarm) => Expect::Abort(&[Leak], 12.0),
        (T::Hull, K::Leak) => Expect::Abort(&[Leak], 24.0),
        // 77.6 kPa towards an atmosphere with 600 s: 87.8 kPa is crossed after 337 s.
        (T::Hull, K::VacuumLoss) => Expect::Abort(&[Vacuum], 337.0 + THREE_LOOKS_S),
        (T::Power, K::Undervoltage) => Expect::Abort(&[Undervoltage], THREE_LOOKS_S),
        (T::Power, K::LowCharge) => Expect::Abort(&[LowCharge], THREE_LOOKS_S),
        (T::Power, K::BrownOut) => Expect::Abort(&[Reset], 8.0),
        // A lie must be found out; what is silent or absurd is above.
        (T::Depth, K::Stuck) if in_water => Expect::Abort(&[StuckDepth, SensorDepth], 60.0 + 4.0 + turning_s),
        (T::Pitch, K::Off | K::Nan | K::Inf | K::Sentinel) if in_water => Expect::Abort(&[SensorPitch], 60.0 + 12.0),
        (T::Pump, K::Stuck) if in_water => {
            Expect::Abort(&[PumpStuck, BallastFeedback, StuckDepth, Stalled, OverDepth], next_turn_s(water) + 120.0)
        }
        (T::BallastFeedback, K::Off | K::Nan | K::Inf | K::Sentinel | K::Stuck) if in_water => {
            Expect::Abort(&[BallastFeedback, PumpStuck], next_turn_s(water) + 120.0)
        }
        _ => Expect::Either,
    };
    match rule {
        // A fault that is over before the bound need not be seen.
        Expect::Abort(_, bound) | Expect::Home(bound) if fault.duration_s.is_some_and(|d| d < bound) => Expect::Either,
        rule => rule,
    }
}
