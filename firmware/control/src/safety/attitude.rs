//! Pitch and heading: lost, stuck, or with the wrong sign.
//!
//! Pitch follows pump and battery: a reading that stands still while the trim
//! law, at the places that both report, swings by much is stuck. What was wanted
//! is no part of it: where another pitch is asked for and the trim's correction
//! is taken back at once, the battery may stay where it is, and the pitch too.
//! In a glide the reading's residual against the trim law is the
//! law's own error (zero of the mass, hydrodynamic moment) for a true sensor,
//! and twice the pitch for one with the wrong sign. What the trim has learned
//! in flight is no part of it: it came from the sensor that is on trial.

use super::{Verdict, Watch};
use crate::angle::tan;
use crate::bound::{Bound, all_finite};
use crate::mutant::Watch as Of;
use signals::{Abort, Flags, Phase};

/// Without believable pitch: abort after this, s.
pub const PITCH_LOST_S: f32 = 60.0;
/// Opposed to the trim law for this long: the reading is not used any more, s.
pub const OPPOSED_S: f32 = 20.0;
/// Residual of tan(pitch) that an error of the trim law may make: its offset, up to 0.25 in published fits, and the hydrodynamic
/// moment; and the share of tan(pitch) that its two slopes may be off by, up to 31 % in the same fits.
pub const OPPOSED: (f32, f32) = (0.3, 0.3);
/// The same way as the trim law, a pitch may be so many times more or less than it says, 1: a metacentric height of 3.5 to 6.5 mm where
/// 5 mm were meant scales it by 0.77 to 1.43, and the hydrodynamic moment, which weighs more against a lower one, comes on top.
pub const SCALE: f32 = 2.5;
/// A pitch inside this band is not moving, rad.
const STILL_RAD: f32 = 0.003;
/// A reading that does not move for this long, though it must, is stuck, s.
pub const STILL_S: f32 = 20.0;
/// Change of tan(pitch) by pump and battery, as the trim law has it, that must show, 1: a battery's 6 mm.
pub const MUST_SHOW: f32 = 0.15;
/// Without heading: come home after this, s.
pub const HEADING_LOST_S: f32 = 60.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct AttitudeWatch {
    lost_s: f32,
    opposed_s: f32,
    still_s: f32,
    still_at_rad: f32,
    /// Of tan(pitch) by the trim law, since the reading stands still.
    low: f32,
    high: f32,
    heading_lost_s: f32,
}

impl AttitudeWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let all = [self.lost_s, self.opposed_s, self.still_s, self.still_at_rad, self.low, self.high, self.heading_lost_s];
        if !all_finite(all) {
            *self = Self::default();
        }
        let dt = w.seen.dt_s;
        let (stuck, opposed) = self.against_trim(w);
        if w.seen.pitch_rad.is_none() || stuck || opposed {
            v.flag(Flags::PITCH_PRESET);
            v.distrust_pitch = true;
            self.lost_s += dt;
        } else {
            // Forgiven slowly, so that a reading that comes and goes is not believed for ever.
            self.lost_s = (self.lost_s - dt).at_least(0.0);
        }
        if self.lost_s > Of::PitchLost.after(PITCH_LOST_S) && Of::PitchLost.enabled() {
            v.cause(Abort::SensorPitch);
        }
        if w.seen.heading_rad.is_none() {
            v.flag(Flags::NO_HEADING);
            self.heading_lost_s = (self.heading_lost_s + dt).at_most(1e6);
            if self.heading_lost_s > Of::HeadingLost.after(HEADING_LOST_S) && Of::HeadingLost.enabled() {
                v.home_for_now = true;
                if matches!(w.phase, Phase::Climb | Phase::InflectHigh | Phase::Surface | Phase::Comms) {
                    v.cause(Abort::NoHeading);
                }
            }
        } else {
            self.heading_lost_s = 0.0;
        }
    }

    /// Whether the reading is stuck, and whether it is opposed to the trim law at the places that pump and battery report.
    fn against_trim(&mut self, w: &Watch<'_>) -> (bool, bool) {
        let (Some(pitch), Some(ballast), Some(battery)) = (w.seen.pitch_rad, w.seen.ballast_m3, w.seen.battery_m) else {
            return (false, false);
        };
        let trim = &w.config.trim;
        let expected = trim.per_ballast_m3 * ballast + trim.per_battery_m * battery + trim.offset;
        let (stuck, opposed) = (self.stuck(w, pitch, expected), self.opposed(w, pitch, expected));
        (stuck && Of::PitchStill.enabled(), opposed && Of::PitchOpposed.enabled())
    }

    fn stuck(&mut self, w: &Watch<'_>, pitch_rad: f32, expected: f32) -> bool {
        if !w.gliding() || (pitch_rad - self.still_at_rad).abs() > STILL_RAD {
            self.still_at_rad = pitch_rad;
            self.still_s = 0.0;
            (self.low, self.high) = (expected, expected);
            return false;
        }
        self.still_s += w.seen.dt_s;
        self.low = self.low.at_most(expected);
        self.high = self.high.at_least(expected);
        self.still_s > Of::PitchStill.after(STILL_S) && self.high - self.low > MUST_SHOW
    }

    fn opposed(&mut self, w: &Watch<'_>, pitch_rad: f32, expected: f32) -> bool {
        let glide = matches!(w.phase, Phase::Dive | Phase::Climb);
        let said = tan(pitch_rad);
        let near = (said - expected).abs() <= OPPOSED.0 + OPPOSED.1 * expected.abs();
        let same_way = said * expected > 0.0 && said.abs() <= SCALE * expected.abs() && expected.abs() <= SCALE * said.abs();
        // In a turn the vehicle lags behind its trim: the count waits.
        if near || same_way {
            self.opposed_s = 0.0;
        } else if glide {
            self.opposed_s += w.seen.dt_s;
        }
        self.opposed_s > Of::PitchOpposed.after(OPPOSED_S)
    }
}

#[cfg(test)]
mod tests {
    use super::{AttitudeWatch, STILL_S};
    use crate::config::Config;
    use crate::safety::{Verdict, Watch};
    use crate::senses::Seen;
    use signals::{ActuatorCommand, Micros, Phase, SensorFrame};

    /// Pump of this dive, m³.
    const BALLAST_M3: f32 = -140e-6;

    /// Whether the pitch is distrusted after each cycle in which it, rad, and the battery, m, are read so.
    fn distrusted(cycles: impl Iterator<Item = (f32, f32)>) -> Vec<bool> {
        let (config, frame, commanded, mut watch) =
            (Config::default(), SensorFrame::default(), ActuatorCommand::default(), AttitudeWatch::default());
        let mut look = |(pitch_rad, battery_m): (f32, f32)| {
            let (pitch_rad, battery_m, ballast_m3) = (Some(pitch_rad), Some(battery_m), Some(BALLAST_M3));
            let seen = Seen { dt_s: 4.0, pitch_rad, ballast_m3, battery_m, heading_rad: Some(0.0), ..Seen::default() };
            let w = Watch {
                config: &config,
                clock: Micros(0),
                seen: &seen,
                frame: &frame,
                commanded: &commanded,
                ballast_m3: BALLAST_M3,
                table_rate_m_s: None,
                phase: Phase::Dive,
                leg_max_m: 190.0,
                max_duration_s: 1000,
                climb_stalled: false,
                no_way_turns: 0,
                bottom_turns: 0,
            };
            let mut v = Verdict::default();
            watch.watch(&w, &mut v);
            v.distrust_pitch
        };
        cycles.map(&mut look).collect()
    }

    #[test]
    fn regress_a_lower_metacentric_height_is_no_fault_of_the_pitch_sensor() {
        let config = Config::default();
        let trim = &config.trim;
        // Whether a steady pitch is distrusted in the end where the trim law gives this tangent.
        let distrusts = |pitch_rad: f32, expected: f32| {
            let battery_m = (expected - trim.offset - trim.per_ballast_m3 * BALLAST_M3) / trim.per_battery_m;
            distrusted([(pitch_rad, battery_m); 20].into_iter()).contains(&true)
        };
        // 32° nose down, and half of its tangent by a trim law for 5 mm; but not the other way round, nor a quarter.
        assert!(!distrusts(-0.559, -0.31) && distrusts(0.559, -0.31) && distrusts(-0.7, -0.2));
        assert!(!distrusts(-0.35, -0.5) && distrusts(0.35, -0.5));
    }

    #[test]
    fn a_pitch_is_stuck_only_if_it_does_not_follow_pump_and_battery() {
        let (held, moved) = ([(-0.61, 0.018); 200], [(-0.61, 0.011); 50]);
        assert!(distrusted(held.into_iter()).iter().all(|d| !d), "nothing moves");
        let got = distrusted(held[..2].iter().chain(&moved).copied());
        let found = got.iter().position(|d| *d).expect("stuck");
        assert!(4.0 * found as f32 <= STILL_S + 8.0, "{found}");
    }
}
