//! How far the depth may be off by now, and when it has to be held against the surface.
//!
//! Depth comes from pressure sensors that may drift, and nothing under water
//! shows it: a sensor that reads ever too little takes the vehicle ever deeper.
//! Only at the surface is the depth known, by the antenna. So its uncertainty grows
//! with the time since then, and a dive ends where depth and uncertainty reach half
//! way from working to crush depth:
//! ```text
//! uncertainty = drift reckoned with × time since the antenna was out
//! ```
//! A depth that was missing for long and came back is held against the surface before the next dive, where no other sensor backs it.
//!
//! A climb goes on to the surface where the next dive would come that far. The
//! time without word from shore is bounded in the same way.

use super::{Verdict, Watch};
use crate::bound::{Bound, all_finite};
use crate::mutant::Watch as Of;
use crate::senses::NO_DEPTH_S;
use signals::{Micros, Phase};

/// Drift reckoned with where one sensor measures alone, m/s: 60 m/h.
pub const DRIFT_ALONE_M_S: f32 = 60.0 / 3600.0;
/// The same where two measure and agree, m/s: 10 m/h in both at once.
pub const DRIFT_AGREED_M_S: f32 = 10.0 / 3600.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SurfacingWatch {
    /// Since the antenna was out, s.
    since_s: f32,
    /// Length of the dive under way, or of the last one, s.
    dive_s: f32,
    diving: bool,
    /// The depth was missing under water and is not held against the surface since.
    unchecked: bool,
    shore: Micros,
}

impl SurfacingWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        if !all_finite([self.since_s, self.dive_s]) {
            // Not known: as long as any sensor is trusted for.
            *self = Self { since_s: 86_400.0, ..Self::default() };
        }
        let seen = w.seen;
        self.unchecked = !seen.afloat && (self.unchecked || seen.depth_alone && seen.depth_age_s >= NO_DEPTH_S);
        self.since_s = if seen.afloat { 0.0 } else { (self.since_s + seen.dt_s).at_most(1e6) };
        if seen.shore {
            self.shore = w.clock;
        }
        let diving = w.phase == Phase::Dive;
        if diving {
            self.dive_s = if self.diving { (self.dive_s + seen.dt_s).at_most(1e6) } else { 0.0 };
        }
        self.diving = diving;
        let drift_m_s = if seen.depth_alone { DRIFT_ALONE_M_S } else { DRIFT_AGREED_M_S };
        let deepest_m = w.config.deepest_m();
        if diving && seen.depth_m + self.since_s * drift_m_s > deepest_m && Of::DriftEndsDive.enabled() {
            v.climb = true;
        }
        let next_s = self.since_s + 2.0 * self.dive_s;
        let silent_for = w.clock.since(self.shore).seconds();
        let uncertain = w.leg_max_m + next_s * drift_m_s > deepest_m && Of::DriftSurfaces.enabled();
        v.surface = uncertain || self.unchecked || silent_for > 0.5 * w.config.no_comms_s as f32;
    }
}
