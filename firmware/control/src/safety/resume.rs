//! Whether a mission that a glitch ended goes on.
//!
//! SAFE is left by this order alone, afloat, and never to sink deeper than the vehicle could come back from: what stays
//! wrong, or comes back, ends the mission again. All of it has to hold:
//!
//! | | |
//! |---|---|
//! | cause | a part that may come back: a sensor, a feedback, a motor that did not follow, the line |
//! | weight | on board, and never fired |
//! | supply | no leak, vacuum, voltage, charge and time as a mission needs them: no watch finds a cause |
//! | afloat | the antenna has been out for [`AFLOAT_S`] without a break, with a depth that says so |
//! | sound | nothing has been missing, stopped or not believed for [`SOUND_S`] |
//! | count | fewer than [`RESUMES`] times in this mission |

use super::{Verdict, Watch};
use crate::bound::{Bound, all_finite};
use signals::{Abort, Flags, Phase, Switch};

/// With the antenna out for so long, s: ten cycles, as its controller asks of two depth sensors.
pub(crate) const AFLOAT_S: f32 = 40.0;
/// With everything sound for so long, s: twice what the slowest watch of a sensor takes.
pub(crate) const SOUND_S: f32 = 120.0;
/// So often in a mission: what fails a third time is no glitch.
pub(crate) const RESUMES: u8 = 2;
/// What may not be up: it says that something is missing, stopped or preset.
const UNSOUND: Flags = Flags::PITCH_PRESET.with(Flags::NO_HEADING).with(Flags::PUMP_OPEN_LOOP).with(Flags::MASS_STOPPED);

/// Memory of the rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resume {
    afloat_s: f32,
    sound_s: f32,
    /// A leak detector has answered in this mission: one that does not any more is a part lost.
    detects: bool,
    left: u8,
    resumed: bool,
}

impl Default for Resume {
    fn default() -> Self {
        Self { afloat_s: 0.0, sound_s: 0.0, detects: false, left: RESUMES, resumed: false }
    }
}

/// Whether what ended the mission may come back.
#[must_use]
pub const fn comes_back(cause: Abort) -> bool {
    matches!(
        cause,
        Abort::SensorDepth
            | Abort::StuckDepth
            | Abort::SensorPitch
            | Abort::NoHeading
            | Abort::BallastFeedback
            | Abort::PumpStuck
            | Abort::MassStuck
            | Abort::FinStuck
            | Abort::LinkLost
    )
}

impl Resume {
    /// Not any more in this mission.
    pub(crate) fn never(&mut self) {
        self.left = 0;
    }

    pub(crate) fn has_resumed(&self) -> bool {
        self.resumed
    }

    /// Whether the mission goes on from this cycle. `v`: what the watches find now; `quiet`: the weight is on board and was never wished away.
    pub(crate) fn due(&mut self, w: &Watch<'_>, v: &Verdict, latched: Option<Abort>, quiet: bool) -> bool {
        if !all_finite([self.afloat_s, self.sound_s]) {
            *self = Self { left: 0, resumed: self.resumed, ..Self::default() };
        }
        let (seen, leak) = (w.seen, w.frame.leak);
        self.detects |= leak != Switch::Unknown;
        let missing = v.flags.0 & UNSOUND.0 != 0 || seen.depth_age_s > 0.0 || self.detects && leak != Switch::Clear;
        let sound = !missing && v.abort.is_none() && !v.climb && !v.homeward && !v.home_for_now && !v.pump_lost && quiet;
        self.sound_s = if sound { (self.sound_s + seen.dt_s).at_most(1e4) } else { 0.0 };
        let up = seen.afloat && w.phase == Phase::Safe && seen.measured_m.is_some_and(|z| z.abs() < super::depth::AFLOAT_M);
        self.afloat_s = if up { (self.afloat_s + seen.dt_s).at_most(1e4) } else { 0.0 };
        let due = latched.is_some_and(comes_back) && self.left > 0 && self.sound_s >= SOUND_S && self.afloat_s >= AFLOAT_S;
        if due {
            *self = Self { left: self.left.saturating_sub(1), resumed: true, detects: self.detects, ..Self::default() };
        }
        due
    }
}
