//! What hangs on the vehicle, by its motion: a leak that no detector sees, a net, weed, a dragging line.
//!
//! In a steady glide the depth rate tells the net buoyancy:
//! ```text
//! w|w| = (B / B_drive) w_table²        load = B_drive − B = (1 − w|w| / w_table²) B_drive
//! ```
//! w_table: rate at this pitch on the pump's drive alone, by the table as it is.
//! Layered water makes up to 0.4 of the pump's range of it, a drag twice the
//! table's as much again; from the rate that of sinking water is taken first.
//! More, for [`HEAVY_S`], is a load:
//!
//! | glide | load over the pump's range | then |
//! |---|---|---|
//! | dive | [`HEAVY_DIVE`] | turned round, mission ends at the surface |
//! | climb on the leg's drive | [`HEAVY_CLIMB`] | all the pump has, for this climb |
//! | climb on all the pump has | [`HEAVY_CLIMB`] | what is left may not win: abort, and the drop weight while it still can |

use super::{Verdict, Watch};
use crate::bound::Bound;
use crate::mutant::Watch as Of;
use signals::{Abort, Phase};

/// Load over the pump's range in a dive, 1: the pump, turned round, would not lift it.
pub const HEAVY_DIVE: f32 = 1.2;
/// Load over the pump's range in a climb, 1: a climb at less than half the rate.
pub const HEAVY_CLIMB: f32 = 0.8;
/// For so long, s.
pub const HEAVY_S: f32 = 60.0;
/// Sinking water that a vehicle may be in for so long, m/s: internal waves of 0.01 to 0.03 m/s. A flat glide sinks at 0.09 m/s.
const WATER_M_S: f32 = 0.03;
/// Share of the pump's range that is all it has, 1.
const ALL: f32 = 0.9;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LoadWatch {
    heavy_s: f32,
    full: bool,
}

impl LoadWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        self.full &= w.phase != Phase::Dive;
        v.pump_full |= self.full;
        let Some(table_m_s) = w.table_rate_m_s else {
            self.heavy_s = 0.0;
            return;
        };
        let up = w.ballast_m3 > 0.0;
        let rate_m_s = w.seen.rate_m_s - WATER_M_S;
        let heavier = w.ballast_m3 + rate_m_s * rate_m_s.abs() / (table_m_s * table_m_s) * w.ballast_m3.abs();
        let heavy = heavier > w.config.pump_m3 * if up { HEAVY_CLIMB } else { HEAVY_DIVE };
        self.heavy_s =
            if heavy && w.seen.depth_age_s <= 0.0 { (self.heavy_s + w.seen.dt_s).at_most(1e4) } else { self.heavy_s * w.seen.unchanged() };
        let of = if up { Of::LoadInClimb } else { Of::LoadInDive };
        if !(self.heavy_s >= of.after(HEAVY_S) && of.enabled()) {
            return;
        }
        if !up {
            v.climb = true;
            v.homeward = true;
        } else if w.ballast_m3 < ALL * w.config.pump_m3 {
            self.full = true;
        } else if w.seen.depth_m > w.config.release_time_s * super::release::ASCENT_M_S {
            v.cause(Abort::Stalled);
            v.pump_loses = true;
        }
    }
}
