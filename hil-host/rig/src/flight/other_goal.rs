//! What the other goal would have given: best-glide goes farthest for its depth, best-range for its energy.

use crate::flight::closed_loop::{Outcome, Setup, fly};
use crate::seats::in_process::InProcess;
use crate::seats::{Link, Seat};
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

/// Flies that mission in the same world, in process, with this table or the controller's own.
///
/// # Errors
/// The world cannot be, or the controller refuses mission or table.
pub fn flown(setup: &Setup, scenario: &Scenario, table: Option<&[u8]>) -> anyhow::Result<Option<(&'static str, Outcome)>> {
    let Some((name, mission)) = swapped(&setup.mission, scenario.vehicle.hotel_w as f32) else { return Ok(None) };
    let mut link = Link::new(InProcess::default());
    link.hello()?;
    if let Some(bytes) = table {
        link.tabulate(mission.wings, bytes)?;
    }
    let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
    let setup = Setup { mission, realtime: None, ..setup.clone() };
    Ok(Some((name, fly(&mut world, &mut link, &setup, &mut |_| Ok(()))?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{mission_file, worlds};

    #[test]
    fn the_other_goal_costs_more_or_glides_worse() {
        let mission = mission_file::built_in("sea").expect("built in");
        let scenario = worlds::for_mission(&mission);
        let setup = Setup::new(mission);
        let (name, range) = flown(&setup, &scenario, None).expect("flies").expect("best-glide has another goal");
        let ranging = Setup { mission: swapped(&setup.mission, 1.2).expect("other").1, ..setup };
        let (back, glide) = flown(&ranging, &scenario, None).expect("flies").expect("and so has best-range");
        assert_eq!((name, back), ("best-range", "best-glide"));
        let cost = |o: &Outcome| o.joule_per_m().expect("went somewhere");
        assert!(cost(&range) < cost(&glide) && range.achieved_l_over_d() < glide.achieved_l_over_d(), "{range:?} {glide:?}");
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
