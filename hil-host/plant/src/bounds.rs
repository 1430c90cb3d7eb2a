//! What can be? Physical bounds on every number of a truth file.
//!
//! Wide enough for any glider and any water, narrow enough that a slip of a unit or a sign is told before it flies. A file is
//! walked number by number; one without a bound here is refused too, so none can be forgotten.

use crate::effects::EffectKind;
use std::ops::RangeInclusive;
use toml::Value;
use toml::de::{DeTable, DeValue};

/// Key, least, most, unit. A key stands for itself, or with `*` for any one part in its place.
const BOUNDS: [(&str, f64, f64, &str); 88] = [
    ("seed", 0.0, 1.9e19, ""),
    ("start.clock_us", 0.0, 1.9e19, "us"),
    ("start.in_water_s", 0.0, 1e8, "s"),
    ("start.depth_m", 0.0, 1e4, "m"),
    ("start.heading_rad", -7.0, 7.0, "rad"),
    ("start.pitch_rad", -1.5, 1.5, "rad"),
    ("start.ballast_m3", -5e-3, 5e-3, "m3"),
    ("start.battery_mass_m", -0.5, 0.5, "m"),
    ("start.charge", 0.0, 1.0, ""),
    ("vehicle.mass_kg", 1.0, 5e3, "kg"),
    ("vehicle.ballasted_density_kg_m3", 950.0, 1100.0, "kg/m3"),
    ("vehicle.compressibility_per_pa", 0.0, 5e-9, "1/Pa"),
    ("vehicle.thermal_expansion_per_k", -1e-4, 1e-3, "1/K"),
    ("vehicle.reference_temperature_degc", -5.0, 50.0, "degC"),
    ("vehicle.added_mass_surge_kg", 0.0, 1e4, "kg"),
    ("vehicle.added_mass_heave_kg", 0.0, 1e4, "kg"),
    ("vehicle.inertia_kg_m2", 0.1, 1e5, "kg m2"),
    ("vehicle.metacentric_height_m", 1e-4, 1.0, "m"),
    ("vehicle.battery_mass_kg", 0.1, 1e3, "kg"),
    ("vehicle.ballast_arm_m", -3.0, 3.0, "m"),
    ("vehicle.turn_radius_m", 0.5, 1e4, "m"),
    ("vehicle.yaw_length_m", 0.1, 1e3, "m"),
    ("vehicle.roll_per_curvature_rad_m", -50.0, 50.0, "rad m"),
    ("vehicle.list_rad", -1.0, 1.0, "rad"),
    ("vehicle.fin_area_m2", 0.0, 1.0, "m2/rad2"),
    ("vehicle.turn_drag_m4", 0.0, 100.0, "m4"),
    ("vehicle.drop_weight_kg", 0.0, 100.0, "kg"),
    ("vehicle.release_time_s", 0.0, 86_400.0, "s"),
    ("vehicle.crush_depth_m", 1.0, 1.2e4, "m"),
    ("vehicle.gas_m3", 2e-3, 1.0, "m3"),
    ("vehicle.gas_lag_s", 10.0, 1e6, "s"),
    ("vehicle.battery_j", 1.0, 1e10, "J"),
    ("vehicle.hotel_w", 0.0, 1e3, "W"),
    ("vehicle.aero.reference_area_m2", 1e-3, 10.0, "m2"),
    ("vehicle.aero.axial_m2", 1e-4, 1.0, "m2"),
    ("vehicle.aero.hull_slope_m2", 0.0, 10.0, "m2/rad"),
    ("vehicle.aero.wing_slope_m2", 0.0, 10.0, "m2/rad"),
    ("vehicle.aero.suction_m2", 0.0, 10.0, "m2/rad2"),
    ("vehicle.aero.separation_m2", 0.0, 10.0, "m2/rad2"),
    ("vehicle.aero.hull_crossflow_m2", 0.0, 10.0, "m2"),
    ("vehicle.aero.wing_crossflow_m2", 0.0, 10.0, "m2"),
    ("vehicle.aero.wing_stall_sin", 0.01, 1.0, ""),
    ("vehicle.aero.wing_stalled_share", 0.0, 1.0, ""),
    ("vehicle.aero.moment_slope", -1e3, 1e3, "N m s2/m2"),
    ("vehicle.aero.moment_zero", -100.0, 100.0, "N m s2/m2"),
    ("vehicle.aero.moment_rate", -1e4, 0.0, "N m s2/m"),
    ("actuators.pump.volume_m3", 1e-6, 0.01, "m3"),
    ("actuators.pump.rate_m3_s", 1e-8, 1e-3, "m3/s"),
    ("actuators.pump.dead_band_m3", 0.0, 1e-3, "m3"),
    ("actuators.pump.efficiency", 0.01, 1.0, ""),
    ("actuators.pump.running_w", 0.0, 1e4, "W"),
    ("actuators.pump.stall_pa", 1e4, 2e8, "Pa"),
    ("actuators.battery_travel_m", 1e-4, 1.0, "m"),
    ("actuators.battery_rate_m_s", 1e-6, 1.0, "m/s"),
    ("actuators.battery_dead_band_m", 0.0, 0.1, "m"),
    ("actuators.battery_motor_w", 0.0, 1e3, "W"),
    ("actuators.fin_limit_rad", 0.0, 1.5, "rad"),
    ("actuators.fin_rate_rad_s", 1e-4, 100.0, "rad/s"),
    ("actuators.fin_dead_band_rad", 0.0, 1.0, "rad"),
    ("actuators.fin_motor_w", 0.0, 1e3, "W"),
    ("sensors.depth_density_kg_m3", 950.0, 1100.0, "kg/m3"),
    ("sensors.altimeter_range_m", 0.0, 1e3, "m"),
    ("sensors.first_fix_s", 0.0, 86_400.0, "s"),
    ("sensors.first_comms_s", 0.0, 86_400.0, "s"),
    ("sensors.*.lag_s", 0.0, 3600.0, "s"),
    ("sensors.*.period_s", 0.0, 3600.0, "s"),
    ("sensors.*.dropout", 0.0, 1.0, ""),
    ("ocean.profile.uniform", 950.0, 1100.0, "kg/m3"),
    ("ocean.profile.levels.*.depth_m", 0.0, 1.2e4, "m"),
    ("ocean.profile.levels.*.temperature_degc", -3.0, 45.0, "degC"),
    ("ocean.profile.levels.*.absolute_salinity_g_kg", 0.0, 45.0, "g/kg"),
    ("ocean.profile.levels.*.density_kg_m3", 950.0, 1100.0, "kg/m3"),
    ("ocean.water_depth_m", 5.0, 1.2e4, "m"),
    ("ocean.current.*.depth_m", 0.0, 1.2e4, "m"),
    ("ocean.current.*.north_m_s", -5.0, 5.0, "m/s"),
    ("ocean.current.*.east_m_s", -5.0, 5.0, "m/s"),
    ("ocean.background_rms_m_s", 0.0, 1.0, "m/s"),
    ("ocean.background_time_s", 1.0, 1e6, "s"),
    ("ocean.wave_height_m", 0.0, 20.0, "m"),
    // Sizes of effects, by their unit.
    ("effect.1/rad2", 0.0, 1e3, "1/rad2"),
    ("effect.rad", -1.5, 1.5, "rad"),
    ("effect.1/day", -1.0, 10.0, "1/day"),
    ("effect.cm3", -2e3, 2e3, "cm3"),
    ("effect.m/s", -3.0, 3.0, "m/s"),
    ("effect.kg/m3", -50.0, 50.0, "kg/m3"),
    ("effect.dbar/day", -100.0, 100.0, "dbar/day"),
    ("effect.-", -0.99, 20.0, ""),
    ("effect.s2/m2", 0.0, 1e3, "s2/m2"),
];

/// What a reading of each sensor can be, either side of zero: bounds of noise, resolution and constant error.
const READINGS: [(&str, f64, &str); 13] = [
    ("depth", 1e3, "m"),
    ("depth2", 1e3, "m"),
    ("pitch", 1.6, "rad"),
    ("roll", 3.2, "rad"),
    ("heading", 7.0, "rad"),
    ("ballast", 5e-3, "m3"),
    ("battery_mass", 0.5, "m"),
    ("fin", 1.6, "rad"),
    ("density", 100.0, "kg/m3"),
    ("altitude", 1e3, "m"),
    ("voltage", 100.0, "V"),
    ("charge", 1.0, ""),
    ("vacuum", 1e5, "Pa"),
];

/// A number that cannot be.
struct Excess {
    path: Vec<String>,
    what: String,
}

/// Walks every number of a truth file's text.
///
/// # Errors
/// The first number that cannot be: `line:column: key = value; it must be …`.
pub(crate) fn check(text: &str) -> Result<(), String> {
    // What is no TOML at all has been refused already.
    let Ok(document) = toml::from_str::<toml::Table>(text) else { return Ok(()) };
    walk(&Value::Table(document), &mut Vec::new()).map_err(|e| match place(text, &e.path) {
        Some((line, column)) => format!("{line}:{column}: {}", e.what),
        None => e.what,
    })
}

fn walk(value: &Value, path: &mut Vec<String>) -> Result<(), Excess> {
    let number = match value {
        Value::Table(table) => {
            for (key, value) in table {
                path.push(key.clone());
                walk(value, path)?;
                path.pop();
            }
            return Ok(());
        }
        Value::Array(list) => {
            for (i, value) in list.iter().enumerate() {
                path.push(i.to_string());
                if path[0] == "effects" {
                    effect(value, path)?
                } else {
                    walk(value, path)?
                }
                path.pop();
            }
            return Ok(());
        }
        Value::Float(v) => *v,
        Value::Integer(v) => *v as f64,
        _ => return Ok(()),
    };
    let (range, unit) = bound(path).ok_or_else(|| excess(path, number, "has no bound", ""))?;
    within(path, number, range, unit)
}

/// The sizes of one effect, whose bounds are those of its kind.
fn effect(value: &Value, path: &mut Vec<String>) -> Result<(), Excess> {
    let kind = value.get("kind").and_then(Value::as_str).and_then(EffectKind::from_name);
    let Some(kind) = kind else { return Ok(()) };
    let number = |key: &str| value.get(key).and_then(|v| v.as_float().or_else(|| v.as_integer().map(|i| i as f64)));
    path.push("value".into());
    if let Some(v) = number("value") {
        let (range, unit) = size(kind);
        within(path, v, range, unit)?;
    }
    path.pop();
    path.push("aux".into());
    if let Some(v) = number("aux") {
        let (range, unit) = second(kind);
        within(path, v, range, unit)?;
    }
    path.pop();
    Ok(())
}

/// Bounds of an effect's size.
fn size(kind: EffectKind) -> (RangeInclusive<f64>, &'static str) {
    match kind.parameter().1 {
        "m3" => (0.0..=0.1, "m3"),
        "s" => (0.0..=86_400.0, "s"),
        "g/h" => (-1e5..=1e5, "g/h"),
        unit => {
            let key = format!("effect.{unit}");
            BOUNDS.iter().find(|b| b.0 == key).map_or((0.0..=0.0, ""), |b| (b.1..=b.2, b.3))
        }
    }
}

/// Bounds of an effect's second number, by its unit in `meaning, unit, default`.
fn second(kind: EffectKind) -> (RangeInclusive<f64>, &'static str) {
    match kind.second().split(", ").nth(1).unwrap_or_default() {
        "rad" => (0.0..=1.5, "rad"),
        "rad from north" => (-7.0..=7.0, "rad"),
        "s" => (1.0..=1e7, "s"),
        "m" => (0.1..=1e4, "m"),
        // It takes none.
        _ => (f64::MIN..=f64::MAX, ""),
    }
}

fn bound(path: &[String]) -> Option<(RangeInclusive<f64>, &'static str)> {
    if let [sensors, name, key] = path
        && sensors == "sensors"
        && let Some((_, most, unit)) = READINGS.iter().find(|r| r.0 == name)
    {
        match key.as_str() {
            "bias" => return Some((-*most..=*most, unit)),
            "noise" | "resolution" => return Some((0.0..=*most, unit)),
            _ => {}
        }
    }
    let fits = |pattern: &str| {
        let parts: Vec<&str> = pattern.split('.').collect();
        parts.len() == path.len() && parts.iter().zip(path).all(|(a, b)| *a == "*" || a == b)
    };
    BOUNDS.iter().find(|b| fits(b.0)).map(|b| (b.1..=b.2, b.3))
}

fn within(path: &[String], number: f64, range: RangeInclusive<f64>, unit: &str) -> Result<(), Excess> {
    if range.contains(&number) {
        return Ok(());
    }
    let must = format!("must be within {} to {}", range.start(), range.end());
    Err(excess(path, number, &format!("it {must}"), unit))
}

fn excess(path: &[String], number: f64, must: &str, unit: &str) -> Excess {
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Excess { path: path.to_vec(), what: format!("{} = {number}; {must}{unit}", path.join(".")) }
}

/// Line and column of the value under a path.
fn place(text: &str, path: &[String]) -> Option<(usize, usize)> {
    let root = DeTable::parse(text).ok()?;
    let (first, rest) = path.split_first()?;
    let mut at = root.get_ref().iter().find(|(key, _)| *key.get_ref() == first.as_str())?.1;
    for part in rest {
        at = match at.get_ref() {
            DeValue::Table(table) => table.iter().find(|(key, _)| *key.get_ref() == part.as_str())?.1,
            DeValue::Array(list) => list.get(part.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    let before = text.get(..at.span().start)?;
    Some((before.matches('\n').count() + 1, before.chars().rev().take_while(|c| *c != '\n').count() + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;
    use crate::ocean::{CurrentLevel, Level, Ocean, Profile};
    use crate::scenario::Scenario;
    use crate::vehicle::Aero;
    use signals::Wings;

    /// A world in which every number is stated.
    fn whole(profile: Profile) -> Scenario {
        let mut s = Scenario::sea(Wings::Standard);
        s.start.ballast_m3 = Some(1e-4);
        s.start.battery_mass_m = Some(0.01);
        s.start.charge = Some(0.9);
        s.vehicle.ballasted_density_kg_m3 = Some(1025.0);
        s.vehicle.aero = Some(Aero::of(Wings::Standard));
        s.sensors.depth_density_kg_m3 = Some(1025.0);
        s.ocean.profile = profile;
        s.ocean.current = vec![CurrentLevel { depth_m: 1.0, north_m_s: 0.1, east_m_s: -0.1 }];
        s.effects = EffectKind::ALL
            .iter()
            .map(|k| Effect { aux: Some(10.0).filter(|_| second(*k).0.contains(&10.0)), ..Effect::typical(*k) })
            .collect();
        s
    }

    #[test]
    fn every_number_of_every_world_has_a_bound_and_is_in_it() {
        let level = Level { depth_m: 1.0, temperature_degc: 10.0, absolute_salinity_g_kg: 35.0, density_kg_m3: Some(1027.0) };
        for profile in [Profile::Lake, Profile::Uniform(1000.0), Profile::Levels(vec![level, Level { depth_m: 9.0, ..level }])] {
            for world in
                [whole(profile.clone()), Scenario { ocean: Ocean { profile, ..Ocean::deep() }, ..Scenario::deep(Wings::LowAspectRatio) }]
            {
                let text = world.to_toml().expect("writes");
                check(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            }
        }
        assert!(EffectKind::ALL.iter().all(|k| !size(*k).1.is_empty() || k.parameter().1 == "-"));
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_place_and_its_range() {
        for (text, said) in [
            ("[vehicle]\nmass_kg = -1.0", "2:11: vehicle.mass_kg = -1; it must be within 1 to 5000 kg"),
            ("[vehicle]\nhotel_w = inf", "2:11: vehicle.hotel_w = inf"),
            ("[sensors.pitch]\nbias = 20", "2:8: sensors.pitch.bias = 20; it must be within -1.6 to 1.6 rad"),
            ("[sensors]\ndepth = { noise = -1 }", "2:19: sensors.depth.noise"),
            ("[ocean]\nprofile = { uniform = 1.025 }", "2:23: ocean.profile.uniform"),
            ("[[ocean.current]]\ndepth_m = 1\nnorth_m_s = 50.0\neast_m_s = 0", "3:13: ocean.current.0.north_m_s"),
            ("[[effects]]\nkind = \"stall\"\nvalue = 11.5", "3:9: effects.0.value = 11.5; it must be within -1.5 to 1.5 rad"),
            ("[[effects]]\nkind = \"internal_wave\"\nvalue = 0.02\naux = -900", "4:7: effects.0.aux"),
            ("[start]\ndepth_m = nan", "2:11: start.depth_m = NaN"),
        ] {
            let e = Scenario::from_toml(text).expect_err(text);
            assert!(e.starts_with(said), "{text}: {e}");
        }
    }
}
