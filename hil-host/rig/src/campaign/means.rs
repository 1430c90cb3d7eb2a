//! What is left to rise with? Known before a mission is flown.
//!
//! ```text
//! upward force at rest = g (ρ(z) (V_hull(z) + V_pump) − m)      pump at the best position its faults leave
//!                      + weight dropped, if it can be
//!                      − what its faults load on the vehicle
//! ```
//! at the depth where it is least, from the surface (light, warm water) to the
//! crush depth (a hull squeezed more than the water), of the scenario's own
//! vehicle and water. A vehicle floats only where this is positive; a wing turns
//! speed into lift, but speed has to come from this force.
//!
//! | fault | takes or loads |
//! |---|---|
//! | `pump:runaway`, `pump:stuck` | the pump stays where it runs to, or where the healthy twin has it at the onset |
//! | `release:stuck`, `command:lost` | the weight stays on board: it does not go, or is never told to (the pump goes out by itself) |
//! | `vehicle:trim`, `vehicle:wing_loss` | a mass more, 50 g less |
//! | `vehicle:dragged` | a force down |
//! | `sea:lens` | lighter water above 8 m |
//!
//! Nothing else takes a means away for good: slow and leaking pumps get there,
//! sensors move nothing. A case whose budget *for good* is negative has no force
//! left that points up, whatever the controller does: it is flown, owes an abort,
//! full buoyancy and the weight, and is listed apart. What ends (a pull, a net,
//! ice) or grows (water in the hull) is a race in time, not in this budget: it
//! has to be won, unless nobody could ([`super::race`]).

use super::lattice::{Case, Water};
use super::twin::{self, Twin};
use anyhow::anyhow;
use plant::faults::{Kind, Target};
use plant::{Fault, Scenario, World};
use std::sync::OnceLock;

/// Lower edge of the lens, m, and half the thickness of its interface, as the plant has them.
const LENS_M: (f64, f64) = (8.0, 0.5);
/// Mass of a lost wing in water, kg, as the plant has it.
const WING_KG: f64 = 0.05;

/// The budget of a case.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Means {
    /// Least upward force at rest that is left when all that ends has ended, N.
    pub for_good_n: f64,
    /// The same while all faults act at once, N.
    pub while_all_act_n: f64,
    /// Depth at which the first of them is least, m.
    pub at_m: f64,
    /// Whether the race with water or a load can be won, flown before the mission ([`super::race`]); none: it is no race.
    pub race: Option<bool>,
}

impl Means {
    /// The budget of a case, its mission not flown; its twin, where it needs one ([`Twin::for_budget`]).
    ///
    /// # Errors
    /// The world cannot be.
    pub fn of(case: &Case, twin: Option<&Twin>) -> anyhow::Result<Self> {
        let stuck = case.faults.iter().find(|f| f.target == Target::Pump && twin::halts(f));
        let stuck_m3 = stuck.zip(twin).and_then(|(fault, twin)| twin.held_m3(fault));
        static AT_REST: [OnceLock<Option<World>>; 2] = [OnceLock::new(), OnceLock::new()];
        let [shallow, edge] = &AT_REST;
        // Wings and noise move nothing at rest: one world for all of a water.
        let at_rest = || World::new(case.twin().scenario()).ok();
        let own = OnceLock::new();
        let kept = match case.water {
            Water::Shallow => shallow,
            Water::Edge | Water::Alone | Water::Late => edge,
            Water::Drawn => &own,
        };
        let world = kept.get_or_init(at_rest).as_ref().ok_or_else(|| anyhow!("{}: no such world", case.name()))?;
        let lasting: Vec<Fault> = case.faults.iter().filter(|f| f.duration_s.is_none()).copied().collect();
        let (for_good_n, at_m) = least(world, &lasting, stuck_m3);
        Ok(Self { for_good_n, while_all_act_n: least(world, &case.faults, stuck_m3).0, at_m, race: None })
    }

    /// Nothing on board points up for good, or nobody could win the race.
    #[must_use]
    pub fn none_left(&self) -> bool {
        self.for_good_n < 0.0 || self.race == Some(false)
    }
}

/// Least upward force with these faults acting, N, and its depth, m.
fn least(world: &World, faults: &[Fault], stuck_m3: Option<f64>) -> (f64, f64) {
    let Scenario { vehicle, actuators, .. } = world.scenario();
    let mut pump_m3 = actuators.pump.volume_m3;
    let (mut load_kg, mut weight_kg, mut pull_n, mut lens) = (0.0, vehicle.drop_weight_kg, 0.0, 0.0);
    for fault in faults {
        match (fault.target, fault.kind) {
            (Target::Pump, Kind::Runaway) => pump_m3 = pump_m3.min(fault.size * actuators.pump.volume_m3),
            (Target::Pump, _) if twin::halts(fault) => pump_m3 = pump_m3.min(stuck_m3.unwrap_or(pump_m3)),
            (Target::Release, Kind::Stuck) | (Target::Command, Kind::Lost) => weight_kg = 0.0,
            (Target::Vehicle, Kind::Trim) => load_kg += fault.size * 1e-3,
            (Target::Vehicle, Kind::WingLoss) => load_kg -= WING_KG,
            (Target::Vehicle, Kind::Dragged) => pull_n += fault.size,
            (Target::Sea, Kind::Lens) => lens += fault.size,
            _ => {}
        }
    }
    let upward_n = |depth_m: f64| {
        let (edge_m, half_m) = LENS_M;
        let density = lens * (half_m - (depth_m - edge_m)).clamp(0.0, 1.0);
        world.upward_at_rest_n(depth_m, density, pump_m3, load_kg - weight_kg) - pull_n
    };
    let metres = 0..=vehicle.crush_depth_m as u32;
    metres.map(|z| (upward_n(f64::from(z)), f64::from(z))).fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::lattice::cases;
    use signals::Wings;

    fn budget(case: &Case) -> Means {
        let twin = Twin::if_needed(case).expect("flies");
        Means::of(case, twin.as_ref()).expect("a world")
    }

    fn means(faults: &[&str]) -> Means {
        let faults = faults.iter().map(|f| f.parse().expect("a fault")).collect();
        budget(&Case { water: Water::Shallow, wings: Wings::Standard, seed: 0, faults, line: None })
    }

    #[test]
    fn the_budget_is_pump_and_weight_less_load_and_light_water() {
        let g = plant::ocean::GRAVITY_M_S2;
        let healthy = means(&[]);
        // 0.23 l of pump and 0.45 kg of weight; at the surface 0.052 m3 of hull lose 1.42 kg/m3 against the 50 m they were
        // ballasted for, win 5e-5 of their volume per degree of 12, and 5e-10 per pascal of 490 kPa. Two grams for the rest.
        let light_n = (-1.42 * 0.052 + (5e-5 * 12.0 + 5e-10 * 490e3) * 0.052 * 1000.0) * g;
        let by_hand_n = (0.23 + 0.45) * g + light_n;
        assert!((healthy.for_good_n - by_hand_n).abs() < 0.02, "{healthy:?}, by hand {by_hand_n}");
        assert_eq!(healthy.at_m, 0.0, "least where the water is lightest");
        let pump_n = 2.0 * 0.23 * 0.9989 * g;
        for (faults, takes_n) in [
            (&["pump:runaway=-1@climb"][..], pump_n),
            (&["pump:runaway=1@climb"], 0.0),
            (&["release:stuck"], 0.45 * g),
            (&["command:lost@dive"], 0.45 * g),
            (&["vehicle:trim=200"], 0.2 * g),
            (&["vehicle:wing_loss"], -0.05 * g),
            (&["sea:lens=-2.5"], 2.5 * 0.05228 * g),
            (&["pump:runaway=-1", "release:stuck"], pump_n + 0.45 * g),
            // Stuck where its twin has it: in at the lower turn, out when the climb begins.
            (&["pump:stuck@inflect_low"], pump_n),
            (&["pump:stuck@comms"], 0.0),
            (&["pump:intermittent=1@inflect_low"], pump_n),
            (&["pump:intermittent=0.9@inflect_low"], 0.0),
            // No means taken for good.
            (&["pump:slow", "pump:leak_back"], 0.0),
            (&["hull:leak=20", "depth:off"], 0.0),
            (&["pump:runaway=-1@dive,90s", "release:stuck@dive,90s"], 0.0),
        ] {
            let got = means(faults);
            assert!((healthy.for_good_n - got.for_good_n - takes_n).abs() < 0.01, "{faults:?}: {got:?}, takes {takes_n} N");
        }
    }

    #[test]
    fn only_what_has_no_force_left_for_good_is_set_apart() {
        for (none_left, faults) in [
            (false, &[][..]),
            (false, &["pump:runaway=-1@dive"]),
            (false, &["release:stuck@dive"]),
            (false, &["vehicle:trim=200@dive"]),
            (false, &["vehicle:dragged=3@dive,1200s"]),
            (false, &["pump:runaway=-1@dive", "sea:lens=-2.5@dive"]),
            (true, &["pump:runaway=-1@dive", "release:stuck@dive"]),
            (true, &["pump:runaway=-1@dive", "vehicle:trim=200@dive"]),
            (true, &["release:stuck@dive", "vehicle:trim=200@dive"]),
            (true, &["pump:stuck@inflect_low", "release:stuck@dive"]),
            (false, &["pump:stuck@comms", "release:stuck@dive"]),
            // Loaded by more than the pump lifts, but not for good: a race, to be won.
            (false, &["release:stuck@dive", "vehicle:dragged=3@dive,1200s"]),
            (true, &["release:stuck@dive", "vehicle:dragged=3@dive"]),
            (false, &["pump:runaway=-1@dive", "hull:leak=20@dive"]),
        ] {
            let means = means(faults);
            assert_eq!(means.none_left(), none_left, "{faults:?}: {means:?}");
        }
        let race = means(&["release:stuck@dive", "vehicle:dragged=3@dive,1200s"]);
        assert!(race.while_all_act_n < 0.0 && race.for_good_n > 0.0, "{race:?}");
    }

    #[test]
    fn no_single_fault_of_the_lattice_is_set_apart_and_few_of_its_pairs() {
        let apart: Vec<String> = cases().iter().filter(|c| budget(c).none_left()).map(Case::name).collect();
        assert!(apart.iter().all(|name| name.contains(" + ")), "{apart:#?}");
        // Each takes the pump or the weight, and the other of them or 200 g as well: means or loads, paired. One in 3,000 at most.
        assert!((1..=cases().len() / 3000).contains(&apart.len()), "of {}: {apart:#?}", cases().len());
    }
}
