//! The controller's configuration as a TOML file: a built-in vehicle and what differs from it.
//!
//! ```toml
//! vehicle = "slocum-200"      # slocum-100 | slocum-200 (default) | slocum-1000
//! crush_depth_m = 240.0
//! undervoltage_v = 10.5
//! [trim]
//! offset = 0.12
//! ```
//! No file crosses the limits of its class of vehicle ([`helm::limits`]), as no board takes one that does.
//!
//! Keys are those of [`control::Settings`], in its units; `glider upload PORT config --read` prints all of them.

use crate::flight::file_kinds::{Kind, expect};
use crate::flight::toml_place;
use anyhow::{Context, anyhow, bail};
use control::{Config, PitchSensor, Settings, config::ConfigError};
use helm::limits;
use logs::record::bounded;
use signals::Limit;
use std::path::Path;
use toml::{Table, Value};

/// Names of the built-in vehicles.
const VEHICLES: [(&str, Settings); 3] =
    [("slocum-100", Settings::slocum_100()), ("slocum-200", Settings::slocum_200()), ("slocum-1000", Settings::slocum_1000())];

/// Reads and checks a configuration file.
///
/// # Errors
/// One line: file, line, key, what is wrong, what would be right.
pub fn load(path: &Path) -> anyhow::Result<Config> {
    expect(path, Kind::Config)?;
    let text = bounded::text(path, bounded::DOCUMENT).with_context(|| format!("{}: cannot read this configuration", path.display()))?;
    parse(&text, &path.display().to_string())
}

/// Reads a configuration from TOML text; `name` is used in messages.
///
/// # Errors
/// One line: file, line, key, what is wrong, what would be right.
pub fn parse(text: &str, name: &str) -> anyhow::Result<Config> {
    let mut file: Table = toml::from_str(text).map_err(|e| toml_place::refused(text, name, &e))?;
    let settings = match file.remove("vehicle") {
        None => Settings::default(),
        Some(Value::String(v)) => {
            let known = || VEHICLES.map(|v| v.0).join(", ");
            VEHICLES
                .iter()
                .find(|k| k.0 == v)
                .map(|k| k.1)
                .ok_or_else(|| wrong(text, name, "vehicle", &format!("no vehicle is called \"{v}\"; there are {}", known())))?
        }
        Some(_) => return Err(wrong(text, name, "vehicle", "the vehicle is a name in quotes")),
    };
    let mut merged = Table::try_from(settings)?;
    let built = merged.clone();
    overlay(&mut merged, file, text, name)?;
    let settings: Settings = merged.try_into().map_err(|e: toml::de::Error| anyhow!("{name}: {}", e.message()))?;
    let config = Config::new(settings).map_err(|e| match e {
        ConfigError::Setting(key) => {
            let stands =
                key.split('.').try_fold(&Value::Table(built.clone()), |at, part| at.get(part)).map_or_else(String::new, Value::to_string);
            let what = format!("{key} is not finite or outside what the law was written for; this vehicle has {stands}");
            wrong(text, name, key.rsplit('.').next().unwrap_or(key), &what)
        }
        other => anyhow!("{name}: {other:?}"),
    })?;
    limits::check(&config).map_err(|e| {
        let (low, high) = (e.allowed.start(), e.allowed.end());
        let key = e.key;
        match e.limit {
            Limit::Class => wrong(text, name, key, &format!("no class of vehicle has such a pump: {key} is {low} to {high}")),
            _ => wrong(text, name, key, &format!("{key} is {low} to {high} in this class of vehicle; no board takes anything else")),
        }
    })?;
    Ok(config)
}

/// Puts the file's values over the built-in ones; numbers may be written without a point.
fn overlay(base: &mut Table, over: Table, text: &str, name: &str) -> anyhow::Result<()> {
    for (key, value) in over {
        let known = base.keys().cloned().collect::<Vec<_>>().join(", ");
        let Some(old) = base.get_mut(&key) else {
            return Err(wrong(text, name, &key, &format!("no setting is called {key}; there are {known}")));
        };
        match (old, value) {
            (Value::Table(old), Value::Table(new)) => overlay(old, new, text, name)?,
            (old @ Value::Float(_), Value::Integer(new)) => *old = Value::Float(new as f64),
            (old, new) if old.same_type(&new) => *old = new,
            (old, _) => bail!(wrong(text, name, &key, &format!("{key} must be a {}", old.type_str()))),
        }
    }
    Ok(())
}

/// A complaint with line and column of a key's value.
fn wrong(text: &str, name: &str, key: &str, what: &str) -> anyhow::Error {
    let value = |line: &str| {
        let rest = line.trim_start().strip_prefix(key)?.trim_start().strip_prefix('=')?;
        Some(line.len() - rest.trim_start().len() + 1)
    };
    match text.lines().enumerate().find_map(|(i, line)| Some((i + 1, value(line)?))) {
        Some((line, column)) => anyhow!("{name}:{line}:{column}: {what}"),
        None => anyhow!("{name}: {what}"),
    }
}

/// The same configuration with another pitch sensor.
///
/// # Errors
/// A sensor that is further off than the law was written for.
pub fn with_pitch_sensor(config: &Config, pitch_sensor: PitchSensor) -> anyhow::Result<Config> {
    let settings = Settings { pitch_sensor, ..*config.settings() };
    Config::new(settings).map_err(|e| anyhow!("{pitch_sensor:?} cannot be flown: {e:?}"))
}

/// What a configuration file says of a pitch sensor alone; none of one that reads true.
#[must_use]
pub fn pitch_sensor_alone(sensor: PitchSensor) -> Option<String> {
    let reads_true = sensor == Settings::default().pitch_sensor;
    let PitchSensor { zero_rad, per_reading } = sensor;
    let vehicles = VEHICLES.map(|v| v.0).join(" | ");
    (!reads_true).then(|| {
        format!(
            "# Name the vehicle, {vehicles}: without a name it is the default.\n# vehicle = \"slocum-200\"\n\
             # True pitch = per_reading * (reading - zero_rad).\n[pitch_sensor]\nzero_rad = {zero_rad:?}\nper_reading = {per_reading:?}\n"
        )
    })
}

/// A configuration as such a file.
///
/// # Errors
/// Never for a checked configuration.
pub fn write(config: &Config) -> anyhow::Result<String> {
    Ok(toml::to_string(config.settings())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_says_what_differs_and_is_written_and_read_back() {
        let config = parse("vehicle = \"slocum-100\"\ncrush_depth_m = 120\n[trim]\noffset = 0.125\n", "f").expect("reads");
        let settings = Settings { crush_depth_m: 120.0, ..Settings::slocum_100() };
        let trim = control::TrimLaw { offset: 0.125, ..settings.trim };
        assert_eq!(*config.settings(), Settings { trim, ..settings });
        for (_, settings) in VEHICLES {
            let config = Config::new(settings).expect("built in");
            assert_eq!(parse(&write(&config).expect("writes"), "f").expect("reads"), config);
        }
        assert_eq!(parse("", "f").expect("reads"), Config::default());
    }

    #[test]
    fn only_a_vehicle_with_a_wrong_pitch_sensor_gives_a_controller_file() {
        let active = |name, value| hydro::effects::Active::sized(hydro::effects::by_name(name).expect(name), value);
        let sensor =
            crate::flight::vehicles::pitch_sensor(&[active("pitch_offset", 0.03), active("pitch_scale", 0.25), active("stall", 0.1)]);
        // true = (reading - 0.03) / 1.25
        assert!((sensor.zero_rad - 0.03).abs() < 1e-7 && (sensor.per_reading - 0.8).abs() < 1e-7, "{sensor:?}");
        let text = pitch_sensor_alone(sensor).expect("a file");
        assert_eq!(parse(&text, "f").expect("reads").pitch_sensor, sensor);
        assert_eq!(with_pitch_sensor(&Config::default(), sensor).expect("flies").pitch_sensor, sensor);
        assert_eq!(pitch_sensor_alone(crate::flight::vehicles::pitch_sensor(&[active("stall", 0.1)])), None);
        let upside_down = PitchSensor { zero_rad: 0.0, per_reading: -1.0 };
        assert!(with_pitch_sensor(&Config::default(), upside_down).is_err());
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        for (text, words) in [
            ("\ncrush_depth_m = 150.0", &["f:2:", "crush_depth_m", "outside"][..]),
            ("crush_depth = 250.0", &["f:1:", "crush_depth_m", "no setting"]),
            ("cycle_s = nan", &["f:1:", "cycle_s"]),
            ("crush_depth_m = 9000.0", &["f:1:17:", "crush_depth_m", "20 to 250"]),
            ("\nundervoltage_v = 0.0", &["f:2:", "undervoltage_v", "9 to 60"]),
            ("no_comms_s = 4294967295", &["f:1:", "no_comms_s"]),
            ("pump_rate_m3_s = 1e-6", &["f:1:", "no class"]),
            ("cycle_s = \"4\"", &["f:1:", "float"]),
            ("vehicle = \"slocum\"", &["slocum-1000"]),
            ("[trim]\noffset = 3.0", &["f:2:10:", "trim.offset", "this vehicle has 0"]),
            ("x = ", &["f:1:"]),
        ] {
            let said = format!("{:#}", parse(text, "f").expect_err(text));
            assert!(words.iter().all(|w| said.contains(w)) && !said.contains('\n'), "{text}: {said}");
        }
    }
}
