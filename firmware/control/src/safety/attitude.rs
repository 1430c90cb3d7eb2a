//! Pitch and heading: lost, stuck, or with the wrong sign.
//!
//! Pitch answers to the commands: a reading that does not move while the
//! wanted pitch swings through the turn is stuck. In a glide its residual
//! against the trim law, at the places that pump and battery report, is the
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
/// A pitch inside this band is not moving, rad.
const STILL_RAD: f32 = 0.003;
/// A reading that does not move for this long, though it must, is stuck, s.
pub const STILL_S: f32 = 20.0;
/// Change of the wanted pitch that must show, rad.
pub const MUST_SHOW_RAD: f32 = 0.15;
/// Without heading: come home after this, s.
pub const HEADING_LOST_S: f32 = 60.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct AttitudeWatch {
    lost_s: f32,
    opposed_s: f32,
    still_s: f32,
    still_at_rad: f32,
    wanted_low_rad: f32,
    wanted_high_rad: f32,
    heading_lost_s: f32,
}

impl AttitudeWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let all =
            [self.lost_s, self.opposed_s, self.still_s, self.still_at_rad, self.wanted_low_rad, self.wanted_high_rad, self.heading_lost_s];
        if !all_finite(all) {
            *self = Self::default();
        }
        let dt = w.seen.dt_s;
        let (stuck, opposed) = (self.stuck(w) && Of::PitchStill.looks(), self.opposed(w) && Of::PitchOpposed.looks());
        if w.seen.pitch_rad.is_none() || stuck || opposed {
            v.flag(Flags::PITCH_PRESET);
            v.distrust_pitch = true;
            self.lost_s += dt;
        } else {
            // Forgiven slowly, so that a reading that comes and goes is not believed for ever.
            self.lost_s = (self.lost_s - dt).at_least(0.0);
        }
        if self.lost_s > Of::PitchLost.after(PITCH_LOST_S) && Of::PitchLost.looks() {
            v.cause(Abort::SensorPitch);
        }
        if w.seen.heading_rad.is_none() {
            v.flag(Flags::NO_HEADING);
            self.heading_lost_s = (self.heading_lost_s + dt).at_most(1e6);
            if self.heading_lost_s > Of::HeadingLost.after(HEADING_LOST_S) && Of::HeadingLost.looks() {
                v.homeward = true;
                if matches!(w.phase, Phase::Climb | Phase::InflectHigh | Phase::Surface | Phase::Comms) {
                    v.cause(Abort::NoHeading);
                }
            }
        } else {
            self.heading_lost_s = 0.0;
        }
    }

    fn stuck(&mut self, w: &Watch<'_>) -> bool {
        let Some(pitch) = w.seen.pitch_rad else { return false };
        if !w.gliding() || (pitch - self.still_at_rad).abs() > STILL_RAD {
            self.still_at_rad = pitch;
            self.still_s = 0.0;
            self.wanted_low_rad = w.pitch_wanted_rad;
            self.wanted_high_rad = w.pitch_wanted_rad;
            return false;
        }
        self.still_s += w.seen.dt_s;
        self.wanted_low_rad = self.wanted_low_rad.at_most(w.pitch_wanted_rad);
        self.wanted_high_rad = self.wanted_high_rad.at_least(w.pitch_wanted_rad);
        self.still_s > Of::PitchStill.after(STILL_S) && self.wanted_high_rad - self.wanted_low_rad > MUST_SHOW_RAD
    }

    fn opposed(&mut self, w: &Watch<'_>) -> bool {
        let (Some(pitch), Some(ballast), Some(battery)) = (w.seen.pitch_rad, w.seen.ballast_m3, w.seen.battery_m) else { return false };
        let trim = &w.config.trim;
        let expected = trim.per_ballast_m3 * ballast + trim.per_battery_m * battery + trim.offset;
        let glide = matches!(w.phase, Phase::Dive | Phase::Climb);
        // In a turn the vehicle lags behind its trim: the count waits.
        if (tan(pitch) - expected).abs() <= OPPOSED.0 + OPPOSED.1 * expected.abs() {
            self.opposed_s = 0.0;
        } else if glide {
            self.opposed_s += w.seen.dt_s;
        }
        self.opposed_s > Of::PitchOpposed.after(OPPOSED_S)
    }
}
