//! What hangs on the vehicle, by its motion: a leak that no detector sees, a net, weed, a dragging line.
//!
//! In a steady glide the depth rate tells the net buoyancy:
//! ```text
//! w|w| = (B / B_drive) w_table²        load = B_drive − B = (1 − w|w| / w_table²) B_drive
//! ```
//! w_table: rate at this pitch on the pump's drive alone, by the table as it is.
//! Layered water makes up to 0.4 of the pump's range of it, a drag twice the
//! table's as much again, an internal wave of 0.03 m/s 0.8 of it in a flat glide and
//! 0.3 in a steep one. More than the pump's range, and faster than water moves
//! ([`WATER_M_S`]), for [`HEAVY_S`] is a load:
//!
//! | glide | load over the pump's range | then |
//! |---|---|---|
//! | dive | [`HEAVY_DIVE`] | turned round, mission ends at the surface; the weight goes if the vehicle does not rise then |
//! | dive, no leak detector answers | [`UNGUARDED_DIVE`], whatever the water | the same |
//! | climb, no leak detector answers | [`UNGUARDED_CLIMB`], whatever the water, for [`UNGUARDED_S`] | as in a climb |
//! | climb on the leg's drive | [`HEAVY_CLIMB`] | all the pump has, for this climb |
//! | climb on all the pump has | [`HEAVY_CLIMB`] | what is left may not win: abort, and the drop weight while it still can |

use super::{Verdict, Watch};
use crate::bound::Bound;
use crate::mutant::Watch as Of;
use signals::{Abort, Phase};

/// Load over the pump's range in a dive, 1: the pump, turned round, would not lift it.
pub const HEAVY_DIVE: f32 = 1.2;
/// The same where no leak detector answers, 1: a mission lost to rough water costs less than a vehicle.
pub const UNGUARDED_DIVE: f32 = 0.6;
/// Load over the pump's range in a climb, 1: a climb at less than half the rate.
pub const HEAVY_CLIMB: f32 = 0.8;
/// The same where no leak detector answers, 1: a climb at less than two thirds of the rate. Twice the table's drag makes 0.5 of it.
pub const UNGUARDED_CLIMB: f32 = 0.6;
/// For so long, s.
pub const HEAVY_S: f32 = 60.0;
/// For so long in a climb where no leak detector answers, s: a leak of 50 g/min takes a tenth of the pump meanwhile.
pub const UNGUARDED_S: f32 = 30.0;
/// Faster than the table by this is no water alone, m/s: internal waves of 0.03 m/s, as much of layers, and what else moves for minutes.
const WATER_M_S: f32 = 0.055;
/// Sinking water that a climb may be in for so long, m/s: internal waves of 0.01 to 0.03 m/s.
const WATER_UP_M_S: f32 = 0.015;
/// Share of the pump's range that is all it has, 1.
const ALL: f32 = 0.9;
/// Rising faster than this there is no load that wins, m/s: half of a flat glide.
const RISES_M_S: f32 = -0.05;

/// Deeper than the release's time and a slow ascent: nearer to the surface the weight would go when the vehicle is up.
fn deep(w: &Watch<'_>) -> bool {
    w.seen.depth_m > w.config.release_time_s * super::release::ASCENT_M_S
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LoadWatch {
    heavy_s: f32,
    full: bool,
    /// A load turned the dive: what comes next is judged knowing of it.
    loaded: bool,
}

impl LoadWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        self.full &= w.phase != Phase::Dive;
        self.loaded &= !(w.seen.afloat || w.phase == Phase::Climb && w.seen.rate_m_s < RISES_M_S);
        v.loaded = self.loaded && deep(w);
        v.pump_full |= self.full;
        let Some(table_m_s) = w.table_rate_m_s else {
            self.heavy_s = 0.0;
            return;
        };
        let up = w.ballast_m3 > 0.0;
        let load = |rate_m_s: f32| {
            let heavier = w.ballast_m3 + rate_m_s * rate_m_s.abs() / (table_m_s * table_m_s) * w.ballast_m3.abs();
            heavier / w.config.pump_m3
        };
        let rate_m_s = w.seen.rate_m_s;
        let heavy = match (up, v.unguarded) {
            (true, true) => load(rate_m_s) > UNGUARDED_CLIMB,
            (true, false) => load(rate_m_s - WATER_UP_M_S) > HEAVY_CLIMB,
            (false, true) => load(rate_m_s) > UNGUARDED_DIVE,
            (false, false) => load(rate_m_s) > HEAVY_DIVE && rate_m_s > table_m_s + WATER_M_S,
        };
        self.heavy_s =
            if heavy && w.seen.depth_age_s <= 0.0 { (self.heavy_s + w.seen.dt_s).at_most(1e4) } else { self.heavy_s * w.seen.unchanged() };
        let of = if up { Of::LoadInClimb } else { Of::LoadInDive };
        let after_s = if up && v.unguarded { UNGUARDED_S } else { HEAVY_S };
        if !(self.heavy_s >= of.after(after_s) && of.enabled()) {
            return;
        }
        if !up {
            v.climb = true;
            v.homeward = true;
            v.pump_full = true;
            self.loaded = true;
        } else if w.ballast_m3 < ALL * w.config.pump_m3 {
            self.full = true;
        } else if deep(w) {
            v.cause(Abort::Stalled);
            v.pump_loses = true;
        }
    }
}
