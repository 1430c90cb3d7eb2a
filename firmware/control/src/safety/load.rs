//! What hangs on the vehicle, by its motion: a leak that no detector sees, a net, weed, a dragging line.
//!
//! In a steady glide the depth rate tells the net buoyancy:
//! ```text
//! w|w| = (B / B_drive) w_table²        load = B_drive − B = (1 − w|w| / w_table²) B_drive
//! ```
//! w_table: rate at this pitch on the pump's drive alone, by the table as it is.
//! Layered water makes up to 0.4 of the pump's range of it, a drag twice the
//! table's as much again, an internal wave of 0.03 m/s 0.8 of it in a flat glide and
//! 0.3 in a steep one; a pitch that is read 0.15 rad too flat more than 1.2. So what a dive
//! shows costs a turn at most, and only what the vehicle then does takes the weight; each
//! for [`HEAVY_S`]:
//!
//! | glide | load over the pump's range | then |
//! |---|---|---|
//! | dive | [`SUSPECT_DIVE`] | weighed: turned round on all the pump has; the mission goes on if the vehicle rises, the weight goes if not |
//! | dive, no leak detector answers | [`UNGUARDED_DIVE`] | the same, and the mission ends at the surface |
//! | climb, no leak detector answers | [`UNGUARDED_CLIMB`], whatever the water, for [`UNGUARDED_S`] | as in a climb |
//! | climb on the leg's drive | [`HEAVY_CLIMB`] of that drive | all the pump has, for this climb |
//! | climb on all the pump has | [`HEAVY_CLIMB`] | what is left may not win: abort, and the drop weight while it still can |
//! | climb | [`HEAVY`] | the pump does not lift it: the same at once |

use super::{Verdict, Watch};
use crate::bound::Bound;
use crate::mutant::Watch as Of;
use signals::{Abort, Phase};

/// Load over the pump's range in a climb, 1: the pump does not lift it.
pub const HEAVY: f32 = 1.2;
/// Load over the pump's range in a dive, 1: what is left of the pump would hardly lift it. One healthy mission in thirty has such a dive.
pub const SUSPECT_DIVE: f32 = 0.8;
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
    suspected_s: f32,
    full: bool,
    /// A load turned the dive round: what comes next is judged knowing of it.
    loaded: bool,
}

impl LoadWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        self.full &= w.phase != Phase::Dive;
        self.loaded &= !(w.seen.afloat || w.phase == Phase::Climb && w.seen.rate_m_s < RISES_M_S);
        v.loaded = self.loaded && deep(w);
        v.pump_full |= self.full;
        let Some(table_m_s) = w.table_rate_m_s else {
            (self.heavy_s, self.suspected_s) = (0.0, 0.0);
            return;
        };
        let up = w.ballast_m3 > 0.0;
        let load = |rate_m_s: f32| {
            let heavier = w.ballast_m3 + rate_m_s * rate_m_s.abs() / (table_m_s * table_m_s) * w.ballast_m3.abs();
            heavier / w.config.pump_m3
        };
        let rate_m_s = w.seen.rate_m_s;
        let all = w.ballast_m3 >= ALL * w.config.pump_m3;
        let suspect = match (up, v.unguarded) {
            (true, true) => load(rate_m_s) > UNGUARDED_CLIMB,
            (true, false) => load(rate_m_s - WATER_UP_M_S) > HEAVY_CLIMB * if all { 1.0 } else { w.ballast_m3 / w.config.pump_m3 },
            (false, true) => load(rate_m_s) > UNGUARDED_DIVE,
            (false, false) => load(rate_m_s) > SUSPECT_DIVE,
        };
        let certain = up && load(rate_m_s - WATER_UP_M_S) > HEAVY;
        let known = w.seen.depth_age_s <= 0.0;
        let count = |s: f32, stands: bool| if stands && known { (s + w.seen.dt_s).at_most(1e4) } else { s * w.seen.unchanged() };
        self.suspected_s = count(self.suspected_s, suspect);
        self.heavy_s = count(self.heavy_s, certain);
        let of = if up { Of::LoadInClimb } else { Of::LoadInDive };
        let after_s = if up && v.unguarded { UNGUARDED_S } else { HEAVY_S };
        if !of.enabled() {
            return;
        }
        let suspected = self.suspected_s >= of.after(after_s);
        if deep(w) && (self.heavy_s >= of.after(HEAVY_S) || suspected && up && all) {
            v.cause(Abort::Stalled);
            v.pump_loses = true;
        } else if suspected && !up {
            // Weighed on all that the pump has: what does not rise then loses its weight.
            v.climb = true;
            v.homeward |= v.unguarded;
            v.pump_full = true;
            self.full = true;
            self.loaded = true;
        } else if suspected {
            self.full = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::LoadWatch;
    use crate::config::Config;
    use crate::safety::{Verdict, Watch};
    use crate::senses::Seen;
    use signals::{ActuatorCommand, Micros, Phase, SensorFrame};

    /// What is judged after 80 s of a glide, with these shares of the pump's range as its drive and as the load on the vehicle.
    fn judged(drive: f32, load: f32, depth_m: f32, unguarded: bool) -> (Verdict, LoadWatch) {
        let (config, frame, commanded, mut watch) =
            (Config::default(), SensorFrame::default(), ActuatorCommand::default(), LoadWatch::default());
        let table_m_s = 0.2;
        let net = (load - drive) / drive.abs();
        let seen = Seen { dt_s: 4.0, depth_m, rate_m_s: table_m_s * net.signum() * crate::angle::sqrt(net.abs()), ..Seen::default() };
        let w = Watch {
            config: &config,
            clock: Micros(0),
            seen: &seen,
            frame: &frame,
            commanded: &commanded,
            ballast_m3: drive * config.pump_m3,
            table_rate_m_s: Some(table_m_s),
            phase: if drive > 0.0 { Phase::Climb } else { Phase::Dive },
            leg_max_m: 190.0,
            max_duration_s: 10_000,
            climb_stalled: false,
            no_way_turns: 0,
            bottom_turns: 0,
        };
        let mut v = Verdict::default();
        for _ in 0..20 {
            v = Verdict { unguarded, ..Verdict::default() };
            watch.watch(&w, &mut v);
        }
        (v, watch)
    }

    #[test]
    fn regress_a_load_that_a_dive_shows_is_weighed_before_the_weight_goes() {
        // In a dive: nothing, weighed, weighed and home without a detector; weighed however large it seems, for a pitch may be off.
        let (light, _) = judged(-1.0, 0.75, 100.0, false);
        assert_eq!(light, Verdict::default());
        let (weighed, watch) = judged(-1.0, 0.85, 100.0, false);
        assert!(weighed.climb && weighed.pump_full && !weighed.homeward && weighed.abort.is_none(), "{weighed:?}");
        assert!(watch.full && watch.loaded);
        let (home, _) = judged(-1.0, 0.65, 100.0, true);
        assert!(home.climb && home.homeward && home.abort.is_none(), "{home:?}");
        let (large, _) = judged(-1.0, 1.6, 100.0, false);
        assert!(large.climb && large.pump_full && large.abort.is_none() && !large.pump_loses, "{large:?}");
        // Nearer to the surface than the release takes: the way up comes first.
        let (shallow, _) = judged(-1.0, 1.25, 20.0, false);
        assert!(shallow.climb && shallow.abort.is_none() && !shallow.loaded, "{shallow:?}");
    }

    #[test]
    fn regress_a_climb_on_part_of_the_pump_takes_all_of_it_before_the_weight() {
        for (drive, load, full, weight) in [
            (0.5, 0.35, false, false),
            (0.5, 0.45, true, false),
            (1.0, 0.75, false, false),
            (1.0, 0.9, false, true),
            (0.5, 1.3, false, true),
        ] {
            let (v, watch) = judged(drive, load, 100.0, false);
            assert_eq!((watch.full, v.pump_loses, v.abort.is_some()), (full, weight, weight), "{drive} {load}: {v:?}");
        }
        let (v, watch) = judged(1.0, 1.3, 20.0, false);
        assert!(watch.full && v.abort.is_none(), "near the surface the way up comes first: {v:?}");
    }
}
