//! What the other goal would have given: best-glide goes farthest for its depth, best-range for its energy.

use crate::flight::closed_loop::{Outcome, Setup, fly};
use crate::seats::Link;
use crate::seats::in_process::InProcess;
use anyhow::anyhow;
use plant::{Scenario, World};
use signals::{Goal, Mission};

/// The mission with best-range for best-glide (the vehicle's own hotel load, W) or the other way round, and the goal's name; none: it
/// has neither.
#[must_use]
pub fn swapped(mission: &Mission, hotel_w: f32) -> Option<(&'static str, Mission)> {
    let any = |of: fn(&Goal) -> bool| mission.legs.iter().any(|leg| of(&leg.goal));
    let (name, goal) = if any(|g| matches!(g, Goal::BestRange { .. })) {
        ("best-glide", Goal::BestGlide)
    } else if any(|g| matches!(g, Goal::BestGlide)) {
        ("best-range", Goal::BestRange { hotel_w })
    } else {
        return None;
    };
    let mut other = mission.clone();
    for leg in &mut other.legs {
        if matches!(leg.goal, Goal::BestGlide | Goal::BestRange { .. }) {
            leg.goal = goal;
        }
    }
    Some((name, other))
}

/// Flies that mission in the same world, in process.
///
/// # Errors
/// The world cannot be, or the controller refuses mission or table.
pub fn flown(setup: &Setup, scenario: &Scenario) -> anyhow::Result<Option<(&'static str, Outcome)>> {
    let Some((name, mission)) = swapped(&setup.mission, scenario.vehicle.hotel_w as f32) else { return Ok(None) };
    let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
    let setup = Setup { mission, realtime: None, ..setup.clone() };
    Ok(Some((name, fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |_| Ok(()))?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{mission_file, worlds};
    use crate::seats::Seat;
    use crate::seats::stock::Stock;
    use signals::{Leg, Wings};

    #[test]
    fn the_other_goal_costs_more_or_glides_worse() {
        let mission = mission_file::built_in("sea").expect("built in");
        let scenario = worlds::for_mission(&mission);
        let setup = Setup::new(mission);
        let (name, range) = flown(&setup, &scenario).expect("flies").expect("best-glide has another goal");
        let ranging = Setup { mission: swapped(&setup.mission, 1.2).expect("other").1, ..setup };
        let (back, glide) = flown(&ranging, &scenario).expect("flies").expect("and so has best-range");
        assert_eq!((name, back), ("best-range", "best-glide"));
        let cost = |o: &Outcome| o.joule_per_m().expect("went somewhere");
        assert!(cost(&range) < cost(&glide) && range.achieved_l_over_d() < glide.achieved_l_over_d(), "{range:?} {glide:?}");
    }

    /// J/m of four dives in a band for a goal; none: by the stock controller.
    fn cost(wings: Wings, band_m: (f32, f32), goal: Option<Goal>) -> f64 {
        let (depth_min_m, depth_max_m) = band_m;
        let leg = Leg { dives: 4, depth_min_m, depth_max_m, goal: goal.unwrap_or(Goal::BestGlide), ..Leg::default() };
        let mission = Mission { wings, max_duration_s: 72 * 3600, legs: [leg].into_iter().collect(), ..Mission::default() };
        let mut world = World::new(worlds::for_mission(&mission)).expect("a world");
        let mut seat: Box<dyn Seat> = match goal {
            Some(_) => Box::new(Link::new(InProcess::default())),
            None => Box::new(Stock::default()),
        };
        seat.hello().expect("answers");
        let out = fly(&mut world, &mut *seat, &Setup::new(mission), &mut |_| Ok(())).expect("flies");
        out.joule_per_m().expect("went somewhere")
    }

    /// Measured when written, over the best constant pitch: 1.005 and 1.018 (rails) in 3-27 m, 1.003 and 1.002 in 0-200 m.
    #[test]
    fn accuracy_best_range_costs_what_the_best_constant_pitch_does() {
        for wings in [Wings::Standard, Wings::LowAspectRatio] {
            for band_m in [(3.0, 27.0), (0.0, 200.0)] {
                let pitches = (12..=28u8).map(|degrees| f32::from(degrees).to_radians());
                let best = pitches.map(|pitch_rad| cost(wings, band_m, Some(Goal::FixedPitch { pitch_rad }))).fold(f64::INFINITY, f64::min);
                let (range, stock) = (cost(wings, band_m, Some(Goal::BestRange { hotel_w: 1.2 })), cost(wings, band_m, None));
                println!("{wings:?} {band_m:?} m: best-range {range:.3} J/m, best constant pitch {best:.3}, stock {stock:.3}");
                assert!(range <= 1.02 * best && range < stock, "{wings:?} {band_m:?}: {range} J/m, {best}, stock {stock}");
            }
        }
    }

    #[test]
    fn a_fixed_pitch_has_no_other_goal() {
        let mut mission = mission_file::built_in("sea").expect("built in");
        for leg in &mut mission.legs {
            leg.goal = Goal::FixedPitch { pitch_rad: 0.4 };
        }
        assert_eq!(swapped(&mission, 1.2), None);
    }
}
