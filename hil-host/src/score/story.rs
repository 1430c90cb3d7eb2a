//! The whole story in one: a flight disagrees with its model, the missing
//! effect is found and added, a new flight table is made, and the controller
//! flies with the old and the new one.
//!
//! The world of the last act is what the flight revealed: the refitted numbers
//! and effects, put into the plant's own force law ([`revealed`]), which is not
//! the model's. Both tables fly in the same world; the difference is the worth
//! of the finding.

use anyhow::{Context, anyhow};
use control::PitchSensor;
use discovery::model::parameters::{NINETY, PARAMETERS, State, law};
use hydro::effects::{Active, Constants};
use logs::Vehicle;
use plant::vehicle::Aero;
use plant::{Effect, EffectKind, Scenario, World};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rig::flight::closed_loop::{Outcome, Setup, fly};
use rig::flight::mission_file::built_in;
use rig::flight::tables::{self, Built};
use rig::flight::vehicles::Model;
use rig::flight::{config_file, worlds};
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use signals::{Mission, Wings};

/// One wing set with one table.
#[derive(Debug)]
pub struct Flown {
    /// The table.
    pub table: Built,
    /// The flight.
    pub outcome: Outcome,
}

/// The table of a vehicle with the effects its file has switched on.
///
/// # Errors
/// The vehicle has no best glide, or does not say which wings it has.
pub fn table_of(vehicle: &Vehicle, bytes: &[u8]) -> anyhow::Result<Built> {
    let id = signals::link::CRC32.checksum(bytes);
    let model = Model::of_coefficients(vehicle, id)?;
    tables::build(&model, model.wings, id, 0).with_context(|| format!("no flight table from {}", vehicle.path.display()))
}

/// The plant's force law that agrees with the model's to second order in α:
/// ```text
/// C_N = C_L + C_D0 α     C_D − C_D0 = (C_Lα + C_D0) α² − suction + separation
/// ```
#[must_use]
pub fn revealed(wings: Wings, c: &Constants) -> Aero {
    let s = c.reference_area_m2;
    let usual = Aero::of(wings);
    let slope = c.lift_slope_per_rad + c.cd0;
    // Drag the normal force alone would make beyond the model's, per α².
    let surplus = slope - c.induced_k * c.lift_slope_per_rad * c.lift_slope_per_rad - c.hull_drag_per_rad2;
    let shape = usual.hull_slope_m2 / (usual.hull_slope_m2 + usual.wing_slope_m2);
    let cross = usual.hull_crossflow_m2 / (usual.hull_crossflow_m2 + usual.wing_crossflow_m2);
    let quadratic = (c.lift_quadratic_per_rad2 * s).max(0.0);
    Aero {
        reference_area_m2: s,
        axial_m2: c.cd0 * s,
        hull_slope_m2: slope * s * shape,
        wing_slope_m2: slope * s * (1.0 - shape),
        suction_m2: (surplus * s).max(0.0),
        separation_m2: (-surplus * s).max(0.0),
        hull_crossflow_m2: quadratic * cross,
        wing_crossflow_m2: quadratic * (1.0 - cross),
        ..usual
    }
}

/// Effects as the plant's own, of the kinds that are wanted.
#[must_use]
pub fn in_the_plant(effects: &[Active], is_wanted: impl Fn(EffectKind) -> bool) -> Vec<Effect> {
    let one = |a: &Active| {
        let kind = EffectKind::ALL.iter().copied().find(|k| k.name() == a.effect.name && is_wanted(*k))?;
        Some(Effect { kind, value: a.values[0], aux: None })
    };
    effects.iter().filter_map(one).collect()
}

/// Effects of the glide, not of sensors or water.
fn is_of_the_glide(kind: EffectKind) -> bool {
    matches!(
        kind,
        EffectKind::VortexLiftBodywing
            | EffectKind::SideEdgeLift
            | EffectKind::ReynoldsDrag
            | EffectKind::Stall
            | EffectKind::ClimbDrag
            | EffectKind::RollTurnDrag
            | EffectKind::DragLevelError
            | EffectKind::LiftSlopeError
            | EffectKind::InducedDragError
            | EffectKind::ZeroLiftAngle
            | EffectKind::AddedMass
            | EffectKind::HeaveAddedMass
    )
}

/// The world that a vehicle describes: its glide, not its sensors.
#[must_use]
pub fn world_of(vehicle: &Model, mission: &Mission) -> Scenario {
    let mut scenario = worlds::for_mission(mission);
    scenario.wings = vehicle.wings;
    scenario.vehicle.aero = Some(revealed(vehicle.wings, vehicle.constants()));
    scenario.effects = in_the_plant(vehicle.effects(), is_of_the_glide);
    scenario
}

/// A world like this one with its own noise; of a vehicle, one with its numbers and its effects' sizes drawn within their tolerances.
#[must_use]
pub fn drawn_world(world: &Scenario, vehicle: Option<&Vehicle>, seed: u64) -> Scenario {
    let mut drawn = Scenario { seed, ..world.clone() };
    let Some(vehicle) = vehicle else { return drawn };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut state = State::nominal();
    for (z, _) in state.calibration.iter_mut().zip(&PARAMETERS).filter(|(_, p)| p.stated().is_some()) {
        *z = normal();
    }
    let (constants, mut effects) = law(vehicle, &state);
    for a in &mut effects {
        let stated = &vehicle.document["effects"][a.effect.name][a.effect.parameters[0].name];
        if let (Some(low), Some(high)) = (stated["low"].as_f64(), stated["high"].as_f64()) {
            a.values[0] += 0.5 * (high - low) / NINETY * normal();
        }
    }
    drawn.vehicle.aero = Some(revealed(world.wings, &constants));
    drawn.effects = in_the_plant(&effects, is_of_the_glide);
    drawn
}

/// Flies with this table in a world, in-process.
///
/// # Errors
/// The controller refuses the table, or the flight cannot be flown.
pub fn fly_table(table: &[u8], setup: &Setup, scenario: &Scenario) -> anyhow::Result<Outcome> {
    let setup = Setup { table: Some(table.to_vec()), ..setup.clone() };
    let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
    Ok(fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |_| Ok(()))?)
}

/// Flies a mission with this table, and with what is known of the pitch sensor, in a world.
///
/// # Errors
/// The controller refuses the table, or the flight cannot be flown.
pub fn fly_with(table: Built, pitch_sensor: PitchSensor, scenario: &Scenario, mission: &Mission) -> anyhow::Result<Flown> {
    let setup = Setup::new(mission.clone());
    let config = config_file::with_pitch_sensor(&setup.config, pitch_sensor)?;
    let outcome = fly_table(&table.bytes, &Setup { config, ..setup }, scenario)?;
    Ok(Flown { table, outcome })
}

/// The mission of the last act: 0–200 m, where steady glide dominates.
///
/// # Errors
/// None in practice: the mission is built in.
pub fn mission(wings: Wings) -> anyhow::Result<Mission> {
    Ok(Mission { wings, ..built_in("sea").context("no mission called sea")? })
}
