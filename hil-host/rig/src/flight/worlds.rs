//! Which world belongs to which mission, and what the nominal vehicle of a
//! flight log is.
//!
//! The world is never the model: [`plant`] has its own force law. What a log
//! states as its nominal vehicle is what a person would know of it: masses and
//! volume from the ballasting bench, and as hydrodynamics what a towing tank
//! says of the healthy vehicle of these wings by least squares of the relative
//! error: in the coefficients of the flight format where gliders glide, and as
//! `hydro.wide` over the range that one without much of its lift flies in. The
//! controller's polar table is older than the tank: with rail wings it
//! overstates the drag due to lift, and a log that stated it would have that
//! missing in every flight.

use crate::flight::file_kinds::{Kind, expect};
use crate::flight::mission_file::{Limits, wings_name};
use crate::flight::toml_place;
use crate::spelling::meant_path;
use anyhow::{Context, anyhow};
use control::{Config, Settings};
use logs::record::bounded;
use nalgebra::{DMatrix, DVector};
use plant::{Scenario, World};
use serde_json::{Value, json};
use signals::{Mission, Wings};
use std::ops::RangeInclusive;
use std::path::Path;

/// Noise of a GPS fix in each direction, m (as in the format's example flights).
pub const GPS_NOISE_M: f64 = 3.0;

/// Configuration of the vehicle that flies a mission: the Slocum with the 100 m, 200 m or deep pump, by its deepest depth.
#[must_use]
pub fn config(mission: &Mission) -> Config {
    let depth_m = mission.deepest_m();
    // The built-in settings are valid (tested in `control`), so the default never steps in.
    if depth_m <= 100.0 { Config::new(Settings::slocum_100()).unwrap_or_default() } else { Config::for_depth(depth_m) }
}

/// What that vehicle can do.
#[must_use]
pub fn limits(mission: &Mission) -> Limits {
    let c = config(mission);
    Limits { working_depth_m: c.working_depth_m, pump_m3: c.pump_m3 }
}

/// The calm water and the healthy vehicle for a mission, by its deepest depth.
#[must_use]
pub fn for_mission(mission: &Mission) -> Scenario {
    let depth_m = mission.deepest_m();
    let mut scenario = match depth_m {
        d if d <= 100.0 => Scenario::shallow(mission.wings),
        d if d <= 200.0 => Scenario::sea(mission.wings),
        _ => Scenario::deep(mission.wings),
    };
    let config = config(mission);
    scenario.vehicle.crush_depth_m = f64::from(config.crush_depth_m);
    scenario.vehicle.release_time_s = f64::from(config.release_time_s);
    scenario.ocean.water_depth_m = scenario.ocean.water_depth_m.max(1.2 * f64::from(depth_m));
    scenario
}

/// A world with the keys of a truth file in place of its own.
///
/// # Errors
/// One line: file, line, column, what is wrong, what would be right.
pub fn overlay(base: &Scenario, path: &Path) -> anyhow::Result<Scenario> {
    let name = path.display();
    anyhow::ensure!(path.exists(), "{name}: no such truth file{}", meant_path(path));
    expect(path, Kind::Truth)?;
    let text = bounded::text(path, bounded::DOCUMENT).with_context(|| format!("{name}: cannot read this truth file"))?;
    let one_line = |e: String| {
        let what = e.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join(" ");
        // `line:column: …` goes on from the file's name.
        let space = if what.starts_with(|c: char| c.is_ascii_digit()) { "" } else { " " };
        anyhow!("{name}:{space}{what}")
    };
    // Alone first: an error then has the line of this file.
    toml::from_str::<Scenario>(&text).map_err(|e| toml_place::refused(&text, &name.to_string(), &e))?;
    Scenario::from_toml(&text).map_err(one_line)?;
    let mut merged: toml::Table = toml::from_str(&base.to_toml().map_err(one_line)?)?;
    merge(&mut merged, toml::from_str(&text)?);
    Scenario::from_toml(&toml::to_string(&merged)?).map_err(one_line)
}

fn merge(base: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => drop(base.insert(key, value)),
        }
    }
}

/// Total lift slope of hull and tail, m²/rad (at-sea fits of Slocums, 0.30–0.38), for splitting lift between hull and wing.
const HULL_SLOPE_M2: f64 = 0.33;

/// Reference area of the coefficients, m² (the at-sea fits' value).
const REFERENCE_AREA_M2: f64 = 0.1;

/// Least ordinary vertical water motion that a nominal vehicle states, m/s rms: nobody knows of water that it is still, and a law in
/// the format's coefficients leaves up to 1.6 mm/s of the plant's (eight flights in still water).
const LEAST_BACKGROUND_M_S: f64 = 0.002;

/// Aspect ratio and area (m²) of a wing set (paper, sec. III).
fn wing(wings: Wings) -> (f64, f64) {
    match wings {
        Wings::Standard => (5.536, 0.0880),
        Wings::LowAspectRatio => (0.3155, 0.1202),
    }
}

/// Pitches of the glides that a towing tank is asked about, degrees nose down: what missions are flown at, from best glide on.
const GLIDES_DEG: RangeInclusive<u32> = 12..=40;
/// And what else flies at the angles of attack of vehicles that lack much of their lift. The format's law of the glides above has 18 %
/// too much drag at 0.25 rad on the standard wings, and a law of all of these is 3 % off where they glide.
const WIDE_DEG: RangeInclusive<u32> = 8..=40;

/// As many digits as a file states.
fn round(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

/// A force at an angle of attack.
type OfAngle<'a> = &'a dyn Fn(f64) -> f64;

/// Least squares of the relative error of terms to `of`, over these angles of attack.
fn follow<const N: usize>(angles: &[f64], terms: impl Fn(f64) -> [f64; N], of: OfAngle) -> Option<[f64; N]> {
    let rows = angles.iter().flat_map(|a| terms(*a).map(|x| x / of(*a)));
    let matrix = DMatrix::from_row_iterator(angles.len(), N, rows);
    let numbers = matrix.svd(true, true).solve(&DVector::from_element(angles.len(), 1.0), f64::EPSILON).ok()?;
    Some(std::array::from_fn(|i| numbers[i]))
}

/// Angle of attack of the glide at each of these pitches, rad, where there is one below 0.35: the shallower, the larger.
fn angles(pitches_deg: RangeInclusive<u32>, lift: OfAngle, drag: OfAngle) -> Vec<f64> {
    let pitch_deg = |a: f64| ((drag(a) / lift(a)).atan() - a).to_degrees();
    let angle_of = |pitch: u32| (1..=350).map(|i| f64::from(i) * 1e-3).find(|a| pitch_deg(*a) <= f64::from(pitch));
    pitches_deg.filter_map(angle_of).collect()
}

/// The keys of the flight format's hydrodynamics that follow a polar, positive angles of attack (symmetric beyond): where gliders glide,
/// and with two terms more (ours) over the wide range.
fn hydrodynamics(wing_area_m2: f64, lift: OfAngle, drag: OfAngle) -> Option<Value> {
    let (glides, wide) = (angles(GLIDES_DEG, lift, drag), angles(WIDE_DEG, lift, drag));
    let [slope, quadratic] = follow(&glides, |a| [a, a * a], lift)?;
    let [cd0, per_rad2] = follow(&glides, |a| [1.0, a * a], drag)?;
    let [wide_slope, wide_quadratic, cubic] = follow(&wide, |a| [a, a * a, a * a * a], lift)?;
    let [wide_cd0, wide_per_rad2, per_rad3] = follow(&wide, |a| [1.0, a * a, a * a * a], drag)?;
    Some(json!({
        "reference_area_m2": REFERENCE_AREA_M2, "hull_area_m2": 0.1, "hull_lift_slope_per_rad": HULL_SLOPE_M2 / 0.1,
        "wing_lift_slope_per_rad": round(((slope * REFERENCE_AREA_M2 - HULL_SLOPE_M2) / wing_area_m2).max(0.0)),
        "lift_quadratic_per_rad2": round(quadratic), "cd0": round(cd0), "induced_k": 0.0, "hull_drag_per_rad2": round(per_rad2),
        "wide": {
            "lift_slope_per_rad": round(wide_slope), "lift_quadratic_per_rad2": round(wide_quadratic),
            "slope_loss_per_rad2": round(-cubic / wide_slope),
            "cd0": round(wide_cd0), "hull_drag_per_rad2": round(wide_per_rad2), "hull_drag_per_rad3": round(per_rad3),
        },
    }))
}

/// The healthy vehicle of a world in a towing tank: nothing hidden, nothing broken, the force law of its wings.
fn in_the_tank(world: &World) -> anyhow::Result<World> {
    let mut scenario = Scenario { effects: Vec::new(), faults: Vec::new(), ..world.scenario().clone() };
    scenario.vehicle.aero = None;
    World::new(scenario).map_err(|e| anyhow!("the vehicle without what is hidden is none: {e}"))
}

/// The nominal vehicle of a world, in the flight format's keys.
///
/// # Errors
/// The built-in table is damaged, or no law follows the healthy vehicle's polar.
pub fn nominal(world: &World, case: &str) -> anyhow::Result<Value> {
    let s = world.scenario();
    let v = &s.vehicle;
    let table = polar::builtin(s.wings).map_err(|e| anyhow!("the built-in table is damaged: {e:?}"))?;
    let tank = in_the_tank(world)?;
    let (aspect_ratio, wing_area) = wing(s.wings);
    let on_s = |m2: f64| m2 / REFERENCE_AREA_M2;
    let hydro = hydrodynamics(wing_area, &|a| on_s(tank.lift_drag_area_m2(a).0), &|a| on_s(tank.lift_drag_area_m2(a).1));
    let mut hydro = hydro.context("the healthy vehicle's polar is none that a law could follow")?;
    hydro["added_mass_surge"] = json!(round(v.added_mass_surge_kg / v.mass_kg));
    hydro["added_mass_heave"] = json!(round(v.added_mass_heave_kg / v.mass_kg));
    let sensors = &s.sensors;
    let site = if s.ocean.water_depth_m <= 100.0 { "lake" } else { "sea" };
    Ok(json!({
        "format": "glider-trial/1", "case": case, "site": site, "simulated": true,
        "source": "masses and volume: ballasting bench of the simulated vehicle; hydro: its towing tank, least squares of the relative error in glides of 12 to 40 degrees of pitch, hydro.wide in those of 8 to 40",
        "tool": env!("CARGO_PKG_VERSION"), "table_id": format!("{:08x}", table.id()),
        "gravity_m_s2": plant::ocean::GRAVITY_M_S2,
        "mass_kg": v.mass_kg, "hull_volume_m3": world.hull_volume_m3(),
        "hull_compressibility_per_pa": v.compressibility_per_pa, "hull_thermal_expansion_per_k": v.thermal_expansion_per_k,
        "reference_temperature_degc": v.reference_temperature_degc,
        "wing": { "name": wings_name(s.wings).replace('-', "_"), "aspect_ratio": aspect_ratio, "area_m2": wing_area, "sweep_deg": 45.0 },
        "hydro": hydro,
        "tolerance_1sigma": {
            "cd0_relative": 0.04, "lift_slope_relative": 0.04, "lift_quadratic_relative": 0.05, "trim_volume_cc": 2.5,
            "ballast_gain_relative": 0.008, "pitch_zero_rad": 0.0026, "hull_compressibility_relative": 0.04,
            "hull_thermal_expansion_relative": 0.05, "added_mass_surge": 0.03, "added_mass_heave": 0.08, "battpos_zero_m": 0.002,
        },
        "sensors": {
            "sample_period_s": crate::seats::CYCLE_S,
            "pressure_noise_dbar": round(sensors.depth.noise), "pressure_resolution_dbar": round(sensors.depth.resolution),
            "pitch_noise_rad": sensors.pitch.noise, "pitch_resolution_rad": sensors.pitch.resolution,
            "ballast_resolution_cc": round(sensors.ballast.resolution * 1e6), "heading_noise_rad": sensors.heading.noise,
            "heading_bias_1sigma_rad": 0.015, "gps_noise_m": GPS_NOISE_M,
            "speed_noise_m_s": null, "speed_scale_1sigma": null,
        },
        "background_vertical_water_motion": { "rms_m_s": s.ocean.background_rms_m_s.max(LEAST_BACKGROUND_M_S), "correlation_time_s": s.ocean.background_time_s },
        (logs::vehicle::CURRENT_KEY): if s.ocean.current.is_empty() { "none" } else { "unknown" },
        "water_depth_m": s.ocean.water_depth_m,
    }))
}

/// Water density at a depth, kg/m³, without building a whole flight; none where the scenario cannot be.
#[must_use]
pub fn density_at(scenario: &Scenario, depth_m: f64) -> Option<f64> {
    let start = plant::Start { depth_m, ..scenario.start };
    let probe = Scenario { start, faults: Vec::new(), ..scenario.clone() };
    World::new(probe).ok().map(|w| w.truth().density_kg_m3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::EffectKind;

    const PAGE: &str = include_str!("../../../../docs/truth-file.md");

    /// The plant's law has another form. In the format's terms 2.5 % where the healthy vehicle glides at 13 degrees of pitch and more, and
    /// on the rail wings 5 % up to 0.25 rad; with ours 0.6 % up to there.
    #[test]
    fn accuracy_a_log_states_the_polar_of_the_healthy_vehicle() {
        for (wings, glides, within) in [(Wings::Standard, 0.03..0.115, f64::INFINITY), (Wings::LowAspectRatio, 0.045..0.22, 0.05)] {
            let world = World::new(for_mission(&Mission { wings, ..Mission::default() })).expect("a world");
            let wide = nominal(&world, "tank").expect("a vehicle");
            let mut format = wide.clone();
            format["hydro"]["wide"] = Value::Null;
            let laws = [format, wide].map(|file| logs::vehicle::parse(file, Path::new("tank.json")).expect("reads").constants);
            for a in (21..=250).map(|i| f64::from(i) * 1e-3) {
                let (lift, drag) = world.lift_drag_area_m2(a);
                let [format, wide] = laws.map(|law| {
                    let f = hydro::ForceModel::new(law, &[]).coefficients(&hydro::effects::Flow::steady(a, 0.3));
                    (f.cl * REFERENCE_AREA_M2 / lift - 1.0).abs().max((f.cd * REFERENCE_AREA_M2 / drag - 1.0).abs())
                });
                let owed = if glides.contains(&a) { 0.025 } else { within };
                assert!(wide < 0.006 && format < owed, "{wings:?} {a} rad: {format} {wide}");
            }
        }
    }

    #[test]
    fn validate_the_truth_file_page_lists_every_effect_with_size_and_unit() {
        for kind in EffectKind::ALL {
            let name = kind.name();
            let row = PAGE.lines().find(|l| l.starts_with(&format!("| `{name}` |"))).unwrap_or_else(|| panic!("no row for {name}"));
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            let (parameter, unit) = kind.parameter();
            let size = format!("{} {unit}", kind.typical());
            assert_eq!(cells[2..=3], [parameter, size.trim_end_matches(" -")], "{name}");
            assert_eq!(cells[5], kind.second(), "{name}");
        }
    }

    #[test]
    fn regress_the_wings_of_a_truth_file_are_named_as_its_page_says() {
        for (name, wings) in [("standard", Wings::Standard), ("low-ar", Wings::LowAspectRatio)] {
            assert!(PAGE.contains(&format!("\"{name}\"")));
            assert_eq!(Scenario::from_toml(&format!("wings = \"{name}\"\n")).expect("a truth file").wings, wings);
        }
    }

    #[test]
    fn validate_the_example_of_the_page_is_a_truth_file() {
        let toml = PAGE.split("```toml truth.toml").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
        let scenario = Scenario::from_toml(toml).expect("a truth file");
        assert_eq!(scenario.effects.iter().map(|e| e.kind).collect::<Vec<_>>(), [EffectKind::DragLevelError]);
        assert!(scenario.ocean.background_rms_m_s > 0.0);
    }
}
