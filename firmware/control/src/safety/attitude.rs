//! Pitch and heading: lost, stuck, or with the wrong sign.
//!
//! Pitch answers to the commands: a reading that does not move while the
//! wanted pitch swings through the turn is stuck; one whose sign opposes
//! pump, wanted pitch and depth rate for long is flipped.

use super::{Verdict, Watch};
use crate::bound::{Bound, all_finite};
use signals::{Abort, Flags, Phase};

/// Without believable pitch: abort after this, s.
pub const PITCH_LOST_S: f32 = 60.0;
/// Sign opposed for this long: the reading is not used any more, s.
pub const OPPOSED_S: f32 = 20.0;
/// Pitch, read or wanted, whose sign is beyond doubt, rad.
pub const PLAIN_RAD: f32 = 0.06;
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
    /// The reading is stuck or has the wrong sign, as found at the last look.
    distrusted: bool,
}

impl AttitudeWatch {
    /// Every cycle: what is lost, and for how long.
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let dt = w.seen.dt_s;
        if w.seen.pitch_rad.is_none() || self.distrusted {
            v.flag(Flags::PITCH_PRESET);
            v.distrust_pitch = true;
            self.lost_s += dt;
        } else {
            // Forgiven slowly, so that a reading that comes and goes is not believed for ever.
            self.lost_s = (self.lost_s - dt).at_least(0.0);
        }
        if self.lost_s > PITCH_LOST_S {
            v.cause(Abort::SensorPitch);
        }
        if w.seen.heading_rad.is_none() {
            v.flag(Flags::NO_HEADING);
            self.heading_lost_s = (self.heading_lost_s + dt).at_most(1e6);
            if self.heading_lost_s > HEADING_LOST_S {
                v.homeward = true;
                if matches!(w.phase, Phase::Climb | Phase::InflectHigh | Phase::Surface | Phase::Comms) {
                    v.cause(Abort::NoHeading);
                }
            }
        } else {
            self.heading_lost_s = 0.0;
        }
    }

    /// Every third cycle, `dt_s` since the last look: whether the reading can be believed.
    pub(super) fn look(&mut self, w: &Watch<'_>, dt_s: f32, mass_held: bool) {
        let all =
            [self.lost_s, self.opposed_s, self.still_s, self.still_at_rad, self.wanted_low_rad, self.wanted_high_rad, self.heading_lost_s];
        if !all_finite(all) {
            *self = Self::default();
        }
        let stuck = self.stuck(w, dt_s);
        let opposed = self.opposed(w, dt_s, mass_held);
        self.distrusted = stuck || opposed;
    }

    fn stuck(&mut self, w: &Watch<'_>, dt_s: f32) -> bool {
        let Some(pitch) = w.seen.pitch_rad else { return false };
        if !w.gliding() || (pitch - self.still_at_rad).abs() > STILL_RAD {
            self.still_at_rad = pitch;
            self.still_s = 0.0;
            self.wanted_low_rad = w.pitch_wanted_rad;
            self.wanted_high_rad = w.pitch_wanted_rad;
            return false;
        }
        self.still_s += dt_s;
        self.wanted_low_rad = self.wanted_low_rad.at_most(w.pitch_wanted_rad);
        self.wanted_high_rad = self.wanted_high_rad.at_least(w.pitch_wanted_rad);
        self.still_s > STILL_S && self.wanted_high_rad - self.wanted_low_rad > MUST_SHOW_RAD
    }

    fn opposed(&mut self, w: &Watch<'_>, dt_s: f32, mass_held: bool) -> bool {
        let (Some(pitch), Some(ballast)) = (w.seen.pitch_rad, w.seen.ballast_m3) else { return false };
        let against = pitch * w.pitch_wanted_rad < 0.0 && pitch.abs() > PLAIN_RAD && w.pitch_wanted_rad.abs() > PLAIN_RAD;
        let moving = w.seen.rate_m_s * ballast < 0.0 && w.seen.rate_m_s.abs() > 0.03;
        let glide = matches!(w.phase, Phase::Dive | Phase::Climb);
        // A mass that does not follow pitches the vehicle the wrong way, and the reading tells the truth.
        if mass_held || !against && glide {
            self.opposed_s = 0.0;
        } else if against && moving && glide {
            self.opposed_s += dt_s;
        }
        self.opposed_s > OPPOSED_S
    }
}
