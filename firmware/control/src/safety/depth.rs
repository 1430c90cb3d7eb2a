//! Depth: too deep, unknown, contradictory, or not moving though it must.

use super::release::{RISES, pump_stroke_s};
use super::{Verdict, Watch};
use crate::bound::{Bound, all_finite};
use crate::mutant::Watch as Of;
use crate::senses::{LEAP_S, NO_DEPTH_S};
use signals::{Abort, Flags};

/// Without a depth, and with pump and pitch to reckon it by: abort after this, s. What has not come back in ten minutes is gone: a guess.
pub const BLIND_S: f32 = 600.0;
/// Without anything that answers: abort after this, s. Two windows of a bus that is reset.
pub const SILENT_S: f32 = 30.0;
/// What may hang on a vehicle that nobody sees sinks it at this, m/s: that of a slow flat glide.
const UNSEEN_M_S: f32 = 0.1;
/// Bridged so often in a mission; then it ends at the surface.
const BRIDGES: u8 = 5;
/// Two depths apart for this long, s.
pub const APART_S: f32 = 20.0;
/// Too deep: this far below the working depth, m, and beyond [`OVER_WORKING_SHARE`].
pub const OVER_WORKING_M: f32 = 5.0;
/// Too deep: beyond this multiple of the working depth. Slocums of 30, 100, 200, 350 and 1000 m end a mission 2 to 5 % below that.
pub const OVER_WORKING_SHARE: f32 = 1.02;
/// Too deep: this far below the leg's deepest, m, and beyond [`OVER_LEG_SHARE`].
pub const OVER_LEG_M: f32 = 10.0;
/// Too deep: beyond this multiple of the leg's deepest.
pub const OVER_LEG_SHARE: f32 = 1.05;
/// Looks too deep while the two sensors contradict each other: 20 s of 4 s cycles.
const OVER_APART: u8 = 5;
/// A depth that stays inside this band is not moving, m: below the noise of any live transducer over ten samples.
const STILL_M: f32 = 0.03;
/// Slowest sinking at full drive, m/s: a third of the slowest glide.
const SLOWEST_M_S: f32 = 0.03;
/// Shortest watch before "stuck", s (bound 60 s).
pub const STUCK_S: f32 = 45.0;
/// Pitch beyond which the vehicle must move, rad (5°).
const MOVES_RAD: f32 = 0.087;

/// Afloat (antenna out) with a depth farther than this from zero, m: twice the zero error that is taken out there.
pub const AFLOAT_M: f32 = 3.0;
/// For so many samples: the first readings after a rise are filtered and stirred by waves.
pub const AFLOAT_SAMPLES: u8 = 4;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DepthWatch {
    /// Deepest depth reckoned since no depth is measured, m.
    peak_m: f32,
    /// Times that depth was bridged, the present one included.
    bridges: u8,
    bridging: bool,
    /// Time for which there was no pump position or no pitch to reckon by, s.
    unreckoned_s: f32,
    over: u8,
    afloat: u8,
    apart_s: f32,
    still_s: f32,
    expected_m: f32,
    low_m: f32,
    high_m: f32,
}

impl DepthWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        if !all_finite([self.peak_m, self.unreckoned_s, self.apart_s, self.still_s, self.expected_m, self.low_m, self.high_m]) {
            *self = Self::default();
        }
        let seen = w.seen;
        self.bridge(w, v);
        if seen.depth_unbacked && Of::Unbacked.enabled() {
            // The other one still measures: no abort, but nothing is left behind it.
            v.climb = true;
            v.home_for_now = true;
        }
        self.apart_s = if seen.depths_disagree { self.apart_s + seen.dt_s } else { 0.0 };
        if self.apart_s >= Of::DepthsApart.after(APART_S) && Of::DepthsApart.enabled() {
            v.cause(Abort::SensorDepth);
        }
        // Where the antenna is out the depth is known: a deep one is wrong, or the receiver is.
        let offset = seen.antenna && seen.measured_m.is_some_and(|z| z.abs() > AFLOAT_M);
        self.afloat = if offset { self.afloat.saturating_add(1) } else { 0 };
        if self.afloat >= AFLOAT_SAMPLES && Of::AfloatOffset.enabled() {
            v.cause(Abort::SensorDepth);
        }
        self.over_depth(w, v);
        self.stuck(w, v);
    }

    /// Without a depth: up, on all the pump has, for as long as the depth reserve lasts.
    fn bridge(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let seen = w.seen;
        if seen.depth_leapt {
            v.cause(Abort::SensorDepth);
        }
        if seen.depth_age_s <= 0.0 {
            (self.peak_m, self.unreckoned_s, self.bridging) = (seen.depth_m, 0.0, false);
            return;
        }
        v.flag(Flags::DEPTH_PROJECTED);
        self.peak_m = self.peak_m.at_least(seen.depth_m);
        let reckons = seen.ballast_m3.is_some() && seen.pitch_rad.is_some();
        self.unreckoned_s = if reckons { 0.0 } else { self.unreckoned_s + seen.dt_s };
        if seen.depth_age_s < Of::NoDepth.after(NO_DEPTH_S) || !Of::NoDepth.enabled() {
            return;
        }
        if !self.bridging {
            (self.bridging, self.bridges) = (true, self.bridges.saturating_add(1));
        }
        v.climb = true;
        v.pump_full = true;
        v.homeward |= self.bridges > BRIDGES;
        if seen.afloat {
            self.peak_m = 0.0;
        }
        let at_most_m = self.peak_m + UNSEEN_M_S * seen.depth_age_s;
        let reserve = seen.afloat || at_most_m <= w.config.deepest_m();
        let out = w.ballast_m3 > RISES * w.config.pump_m3;
        let rises = (out || seen.depth_age_s < NO_DEPTH_S + pump_stroke_s(w.config)) && self.unreckoned_s < LEAP_S;
        if seen.silent {
            // Where nothing at all answers it is not one sensor that is gone.
            if seen.depth_age_s >= SILENT_S {
                v.cause(Abort::LinkLost);
            }
        } else if !(reserve && rises) || seen.depth_age_s >= BLIND_S {
            v.cause(Abort::SensorDepth);
        }
    }

    fn over_depth(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let (z, leg, working) = (w.seen.depth_m, w.leg_max_m, w.config.working_depth_m);
        let allowed = z <= working + OVER_WORKING_M || z <= OVER_WORKING_SHARE * working;
        let within = allowed && (z <= leg + OVER_LEG_M || z <= OVER_LEG_SHARE * leg);
        let over = w.seen.depth_age_s <= 0.0 && !within;
        self.over = if over { self.over.saturating_add(1) } else { self.over * w.seen.unchanged() as u8 };
        // Where the two sensors contradict each other, as long as those have to be found apart.
        let samples = if w.seen.depths_disagree { OVER_APART } else { 2 };
        if self.over >= samples && Of::OverDepth.enabled() {
            v.cause(Abort::OverDepth);
        }
    }

    /// Pump and pitch say "moving", the reading says "not at all".
    fn stuck(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let seen = w.seen;
        let (Some(z), Some(ballast), Some(pitch)) = (seen.measured_m, seen.ballast_m3, seen.pitch_rad) else { return };
        let full = w.config.pump_m3;
        // Down with the nose down, or up with the nose up and water above.
        let driven = ballast.abs() > 0.4 * full && pitch.abs() > MOVES_RAD && ballast * pitch > 0.0 && (ballast < 0.0 || z > 2.0);
        if !(driven && w.gliding() && !seen.afloat) || z - self.low_m > STILL_M || self.high_m - z > STILL_M {
            (self.low_m, self.high_m) = (z, z);
            (self.still_s, self.expected_m) = (0.0, 0.0);
            return;
        }
        self.low_m = z.at_most(self.low_m);
        self.high_m = z.at_least(self.high_m);
        self.still_s += seen.dt_s;
        self.expected_m += SLOWEST_M_S * ballast.abs() / full * seen.dt_s;
        if self.still_s >= Of::DepthStuck.after(STUCK_S) && self.expected_m >= 0.5 && Of::DepthStuck.enabled() {
            v.cause(Abort::StuckDepth);
        }
    }
}
