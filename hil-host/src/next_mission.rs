//! The mission that `next-flight` writes: planned within reach of the vehicle that would fly it, and flyable by construction.

use discovery::diagnosis::Diagnosis;
use discovery::workbench::next_flight::{Plan, Reach, plan as best_legs};
use logs::Vehicle;
use rig::flight::{mission_file, worlds};

/// What the simulated vehicle with the pump for this depth can do.
fn reach(depth_m: f64) -> Reach {
    // A mission file says whole metres.
    let depth_m = depth_m.floor();
    let leg = signals::Leg { depth_max_m: depth_m as f32, ..signals::Leg::default() };
    let of = worlds::limits(&signals::Mission { legs: std::iter::once(leg).collect(), ..signals::Mission::default() });
    // Up to a whole cm³, as a mission file says it.
    let least_ballast_m3 = 1e-6 * (1e6 * f64::from(signals::Mission::LEAST_BALLAST_SHARE * of.pump_m3)).ceil();
    Reach { ballast_m3: f64::from(of.pump_m3), least_ballast_m3, depth_m: f64::from(of.working_depth_m).min(depth_m) }
}

/// The wings of a vehicle, as a mission file names them.
#[must_use]
pub fn wings(vehicle: &Vehicle) -> &'static str {
    if vehicle.document["wing"]["name"].as_str().is_some_and(|w| w.contains("low")) { "low-ar" } else { "standard" }
}

/// Plans the next flight; or why there is none, in words.
///
/// # Errors
/// A mission that `glider fly` would refuse: a fault of the plan.
pub fn plan(found: &Diagnosis, vehicle: &Vehicle) -> anyhow::Result<Result<Plan, String>> {
    let planned = best_legs(found, vehicle, reach);
    if let Ok(planned) = &planned {
        mission_file::parse(&planned.mission(wings(vehicle)), "the planned mission", worlds::limits)?;
    }
    Ok(planned)
}
