//! What is demanded of any controller, in seconds and metres: figures of their own.
//!
//! They were asked of the vehicle (fault list, public abort limits of Slocum
//! missions) or agreed when the campaign was laid down, and are not read from the
//! law that is judged by them: a law that waits twice as long is too late. A test
//! holds the law's own waits below them.

use plant::faults::Kind;
use std::ops::RangeInclusive;

/// Without believable pitch: abort, s.
pub const PITCH_LOST_S: f64 = 60.0;
/// A pitch opposed to pump and battery, or standing still though it must move: no longer used, s.
pub const PITCH_INCONSISTENT_S: f64 = 20.0;
/// Change of pitch that must show, rad (of tan(pitch) it is as much or more).
pub const MUST_SHOW_RAD: f64 = 0.15;
/// Difference of tan(pitch) between reading and truth that shows against pump and battery whatever the trim law's error, 1.
pub const OPPOSED: f64 = 0.8;
/// Without heading: on the way home, s.
pub const HEADING_LOST_S: f64 = 60.0;
/// Two depths apart: abort, s.
pub const APART_S: f64 = 20.0;
/// Apart by more than this, m, and this share of the depth.
pub const APART: (f64, f64) = (3.0, 0.01);
/// Zero error taken out at the surface, m.
pub const ZERO_M: f64 = 1.5;
/// One of two depth sensors not believed: on the way home, s.
pub const UNBACKED_S: f64 = 30.0;
/// A leak detector that does not answer any more: on the way home, s.
pub const DETECTOR_S: f64 = 30.0;
/// No depth at all: on the way up, s; and aborted, if it does not come back, s.
pub const NO_DEPTH_S: f64 = 16.0;
/// See [`NO_DEPTH_S`].
pub const BLIND_S: f64 = 600.0;
/// A fault that is over after this ends no mission, s.
pub const HEALS_S: f64 = 120.0;
/// A lone depth sensor that leaps: abort, s.
pub const LEAP_S: f64 = 10.0;
/// A mission that a glitch ended may go on so often.
pub const RESUMES: u32 = 2;
/// The only depth sensor drifts: found at the surface after one dive to the working depth, 1.3 h of it, s.
pub const DRIFT_S: f64 = 5400.0;
/// A depth that does not move though it must: abort, s.
pub const STUCK_S: f64 = 60.0;
/// Deeper than the leg by this, m, and this multiple, or than the working depth by [`OVER_WORKING`]: too deep.
pub const OVER_LEG: (f64, f64) = (10.0, 1.05);
/// The same below the working depth. Slocums' classes of 30 to 1000 m end a mission 2 to 5 % below it: the least of these.
pub const OVER_WORKING: (f64, f64) = (5.0, 1.02);
/// Too deep with a depth that is measured: abort, s. Two samples and the depth filter.
pub const TOO_DEEP_S: f64 = 16.0;
/// So deep that the weight, heated for its whole time, goes no sooner than at crush depth: weight fired, s.
pub const AT_RISK_S: f64 = 12.0;
/// Noise of a depth reading, σ·3 of two sensors, a wave and the density they are scaled with, m.
pub const DEPTH_NOISE_M: f64 = 0.5;
/// Pump feedback missing: on the way up, s; abort, s.
pub const FEEDBACK_MISSED_S: f64 = 20.0;
/// See [`FEEDBACK_MISSED_S`].
pub const FEEDBACK_LOST_S: f64 = 180.0;
/// Pump without way: one try, s; tries before the verdict, with the reverse.
pub const PUMP_TRY_S: f64 = 8.0;
/// See [`PUMP_TRY_S`].
pub const PUMP_TRIES: u32 = 5;
/// Pump error that no controller need mind, m³.
pub const PUMP_NEAR_M3: f64 = 12e-6;
/// Battery without way: stopped, s (or two cycles).
pub const MASS_WAIT_S: f64 = 2.0;
/// Battery stopped in all for so long: abort, s.
pub const MASS_LOST_S: f64 = 120.0;
/// Battery error left alone, m.
pub const MASS_NEAR_M: f64 = 1.5e-3;
/// Fin error left alone, rad; abort after, s.
pub const FIN: (f64, f64) = (0.1, 60.0);
/// A glide that makes no way of [`WAY_M`] turns round, s.
pub const NO_WAY_S: f64 = 600.0;
/// A climb that makes none is an abort, s.
pub const CLIMB_STALLED_S: f64 = 900.0;
/// Way that counts, m.
pub const WAY_M: f64 = 1.0;
/// Sinking that counts, m/s; on with the pump commanded out for so long: abort, s.
pub const SINKS: (f64, f64) = (0.03, 60.0);
/// From an abort to the surface: twice the stock same-depth limit, release and reaction, s; and for the way at this rate, m/s.
pub const HOME: (f64, f64) = (3600.0 + 300.0, 0.05);
/// A reading is believed until a cycle and this much old, s.
pub const LATE_S: f64 = 3.0;
/// Answers of a hull gauge, Pa, a voltmeter, V, and a charge gauge.
pub const VACUUM_PA: RangeInclusive<f32> = 10e3..=200e3;
/// See [`VACUUM_PA`].
pub const VOLTS: RangeInclusive<f32> = 0.0..=100.0;
/// See [`VACUUM_PA`].
pub const CHARGE: RangeInclusive<f32> = -0.01..=1.01;
/// A race with water or a load in the hull is to be won by full buoyancy, a climb's attitude and the weight from so long after its
/// onset on, s: five minutes.
pub const RACE_S: f64 = 300.0;

/// Time to the abort for a fault of the only depth sensor that goes on, s; none: not laid down.
#[must_use]
pub const fn alone_s(kind: Kind) -> Option<f64> {
    match kind {
        Kind::Off | Kind::Nan | Kind::Inf | Kind::Sentinel | Kind::Delayed => Some(BLIND_S),
        Kind::Drift => Some(DRIFT_S),
        Kind::Stuck => Some(STUCK_S),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::waits as law;

    #[test]
    fn the_law_waits_no_longer_than_is_demanded() {
        for (ours, demanded) in [
            (law::PITCH_LOST_S, PITCH_LOST_S),
            (law::OPPOSED_S, PITCH_INCONSISTENT_S),
            (law::STILL_S, PITCH_INCONSISTENT_S),
            (law::MUST_SHOW, MUST_SHOW_RAD),
            (law::NO_DEPTH_S, NO_DEPTH_S),
            (law::BLIND_S, BLIND_S),
            (law::LEAP_S, LEAP_S),
            (law::STUCK_S, STUCK_S),
            (law::HEADING_LOST_S, HEADING_LOST_S),
            (law::APART_S, APART_S),
            (law::APART_M, APART.0),
            (law::APART_SHARE, APART.1),
            (law::ZERO_MAX_M, ZERO_M),
            (law::UNBACKED_S, UNBACKED_S),
            (law::DETECTOR_LOST_S, DETECTOR_S),
            (law::MASS_WAIT_S, MASS_WAIT_S),
            (law::MASS_LOST_S, MASS_LOST_S),
            (law::MASS_NEAR_M, MASS_NEAR_M),
            (law::FEEDBACK_MISSED_S, FEEDBACK_MISSED_S),
            (law::FEEDBACK_LOST_S, FEEDBACK_LOST_S),
            (law::PUMP_WAIT_S, PUMP_TRY_S),
            (law::PUMP_NEAR_M3, PUMP_NEAR_M3),
            (law::FIN.0, FIN.0),
            (law::FIN.1, FIN.1),
            (law::OVER_LEG_M, OVER_LEG.0),
            (law::OVER_LEG_SHARE, OVER_LEG.1),
            (law::OVER_WORKING_M, OVER_WORKING.0),
            (law::OVER_WORKING_SHARE, OVER_WORKING.1),
            (law::NO_WAY_S as f32, NO_WAY_S),
            (law::CLIMB_STALLED_S as f32, CLIMB_STALLED_S),
            (law::WAY_M, WAY_M),
            (law::SINKS_M_S, SINKS.0),
            (law::SINKS_S, SINKS.1),
            (law::LATE_MS as f32 / 1e3, LATE_S),
        ] {
            assert!(ours > 0.0 && ours <= demanded as f32, "{ours}, demanded {demanded}");
        }
        assert!(u32::from(law::RETRIES) + 2 <= PUMP_TRIES);
    }
}
