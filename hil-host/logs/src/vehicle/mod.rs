//! Reads a vehicle file (JSON or TOML): the nominal model, its tolerances, its sensors, and the effects that are on.
//!
//! Keys are those of `glider-trial/1` (FORMAT section 2). What a file does not state is taken from [`Tolerance::default`] and
//! [`Sensors::default`] and listed in [`Vehicle::assumed`]. Unknown keys are kept in [`Vehicle::document`] and written back;
//! one that is a slip in a key that is read is refused.

mod as_trial;
pub mod catalogue;
pub mod effects_table;
pub mod expression;
pub mod file;
mod keys;
pub mod pitch_moments;
mod quantities;
mod slips;
pub mod text;

use crate::record::csv::ReadError;
use crate::vehicle::keys::{Keys, Stated};
use crate::vehicle::pitch_moments::PitchMoments;
use hydro::effects::{Active, Constants, Effect};
use serde_json::Value;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Key of a vehicle file that says whether a horizontal current may be there: `unknown` or `none`.
pub const CURRENT_KEY: &str = "horizontal_current";

/// What `format` says, where a file has it.
const TRIAL_FORMAT: &str = "glider-trial/1";

/// 1-sigma calibration tolerances of the nominal numbers: the priors of every fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// CD0, relative.
    pub cd0_relative: f64,
    /// Linear lift slope, relative.
    pub lift_slope_relative: f64,
    /// a2, relative.
    pub lift_quadratic_relative: f64,
    /// Constant volume, m³.
    pub trim_volume_m3: f64,
    /// Factor on the ballast reading, relative.
    pub ballast_gain_relative: f64,
    /// Constant pitch error, rad.
    pub pitch_zero_rad: f64,
    /// ε, relative.
    pub hull_compressibility_relative: f64,
    /// αT, relative.
    pub hull_thermal_expansion_relative: f64,
    /// k1, absolute.
    pub added_mass_surge: f64,
    /// k2, absolute.
    pub added_mass_heave: f64,
}

impl Default for Tolerance {
    /// Tolerances of a carefully ballasted Slocum; guess, as FORMAT's example vehicles.
    fn default() -> Self {
        Self {
            cd0_relative: 0.04,
            lift_slope_relative: 0.04,
            lift_quadratic_relative: 0.05,
            trim_volume_m3: 2.5e-6,
            ballast_gain_relative: 0.008,
            pitch_zero_rad: 0.0026,
            hull_compressibility_relative: 0.04,
            hull_thermal_expansion_relative: 0.05,
            added_mass_surge: 0.03,
            added_mass_heave: 0.08,
        }
    }
}

/// Noise of the sensors, 1 sigma, and their resolutions, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Pressure noise, Pa.
    pub pressure_noise_pa: f64,
    /// Pressure resolution, Pa.
    pub pressure_resolution_pa: f64,
    /// Pitch noise, rad.
    pub pitch_noise_rad: f64,
    /// Pitch resolution, rad.
    pub pitch_resolution_rad: f64,
    /// Heading noise, rad.
    pub heading_noise_rad: f64,
    /// Constant compass bias, rad.
    pub heading_bias_rad: f64,
    /// Noise of a GPS fix in each direction, m.
    pub gps_noise_m: f64,
    /// Speed noise, m/s.
    pub speed_noise_m_s: f64,
    /// Relative scale uncertainty of the speed sensor.
    pub speed_scale_relative: f64,
}

impl Sensors {
    /// Noise of a sample of the pitch, its rounding included, 1 sigma, rad.
    #[must_use]
    pub fn pitch_sigma_rad(&self) -> f64 {
        (self.pitch_noise_rad.powi(2) + self.pitch_resolution_rad.powi(2) / 12.0).sqrt()
    }
}

impl Default for Sensors {
    /// A pumped CTD's pressure sensor and a TCM compass; guess, as FORMAT's example vehicles.
    fn default() -> Self {
        Self {
            pressure_noise_pa: 200.0,
            pressure_resolution_pa: 100.0,
            pitch_noise_rad: 0.002,
            pitch_resolution_rad: 0.00175,
            heading_noise_rad: 0.026,
            heading_bias_rad: 0.015,
            gps_noise_m: 3.0,
            speed_noise_m_s: 0.012,
            speed_scale_relative: 0.006,
        }
    }
}

/// A vehicle: the nominal model and what is known about its certainty.
#[derive(Clone, Debug)]
pub struct Vehicle {
    /// Where it was read from.
    pub path: PathBuf,
    /// Name of the trial or vehicle.
    pub name: String,
    /// `lake`, `sea` or empty.
    pub site: String,
    /// Nominal constants, without the effects in `effects`.
    pub constants: Constants,
    /// Effects the file has switched on.
    pub effects: Vec<Active>,
    /// Calibration tolerances.
    pub tolerance: Tolerance,
    /// Sensor noise.
    pub sensors: Sensors,
    /// The moments in pitch, where the file states all of them.
    pub moments: Option<PitchMoments>,
    /// Rms of the ordinary vertical water motion, m/s, and its correlation time, s.
    pub background: (f64, f64),
    /// Whether GPS displacement contains an unknown current.
    pub current_unknown: bool,
    /// Water depth, m; NaN if not stated.
    pub water_depth_m: f64,
    /// Segments that may be fitted; empty if the file does not say.
    pub fit_segments: Vec<u32>,
    /// Segments reserved for error figures.
    pub check_segments: Vec<u32>,
    /// What the file did not state and was assumed, for the report.
    pub assumed: Vec<String>,
    /// Keys of the file that are read in another table only, and so do nothing, in words.
    pub misplaced: Vec<String>,
    /// The file as read.
    pub document: Value,
}

impl Vehicle {
    /// What in the file does nothing, and what it does not state of the model itself, apart from its tolerances and sensors, in words.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let misplaced = self.misplaced.iter().map(|what| format!("vehicle file: {what}"));
        misplaced.chain(self.assumed_of_the_model()).collect()
    }

    /// Whether an effect needs the depth of the water, which the file does not state.
    #[must_use]
    pub fn lacks_depth_for(&self, effect: &Effect) -> bool {
        needs_water_depth(effect) && !(self.water_depth_m > 0.0)
    }

    /// What it does not state of the model itself, apart from its tolerances and sensors, and what was assumed, in words.
    #[must_use]
    pub fn assumed_of_the_model(&self) -> Option<String> {
        let of_others = ["tolerance_1sigma.", "sensors.", "background_"];
        let of_model: Vec<&str> = self.assumed.iter().map(String::as_str).filter(|a| !of_others.iter().any(|b| a.starts_with(b))).collect();
        (!of_model.is_empty()).then(|| format!("the vehicle file does not state, and these were assumed: {}", of_model.join(", ")))
    }
}

/// The vehicle files beside a flight: `vehicle.json` and `vehicle.toml` of its directory, as far as they are there.
#[must_use]
pub fn files_next_to(flight: &Path) -> Vec<PathBuf> {
    let folder = if flight.is_dir() { Some(flight) } else { flight.parent() };
    let named = folder.into_iter().flat_map(|f| ["vehicle.json", "vehicle.toml"].map(|n| f.join(n)));
    named.filter(|p| p.is_file()).collect()
}

/// The vehicle file beside a flight, if there is one.
///
/// # Errors
/// There are two.
pub fn file_next_to(flight: &Path) -> Result<Option<PathBuf>, ReadError> {
    match files_next_to(flight).as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(one.clone())),
        [one, other, ..] => {
            let why = format!("lies beside {}: which one is meant? Name it with --vehicle, or move the other away", other.display());
            Err(ReadError::File { path: one.clone(), why })
        }
    }
}

/// Whether an effect depends on how deep the water is: one of one's own by the variable H.
fn needs_water_depth(effect: &Effect) -> bool {
    effect.acts_on_depth() && effect.expression.is_none_or(|text| expression::find_word(text, "H").is_some())
}

/// Reads a vehicle file.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn read(path: &Path) -> Result<Vehicle, ReadError> {
    parse_text(&text::of_file(path)?, path)
}

/// Reads a vehicle from the text of a vehicle file; `path` tells TOML from JSON and is named in messages.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn parse_text(text: &str, path: &Path) -> Result<Vehicle, ReadError> {
    // What editors of Windows put before a text.
    let text = text.trim_start_matches('\u{feff}');
    let document: Value = if crate::vehicle::file::is_geometry(text) {
        crate::vehicle::file::parse(text, path)?.as_trial()
    } else {
        text::document(text, path)?
    };
    parse(document, path).map_err(|e| text::located(e, text))
}

/// Reads a vehicle from a parsed document; `path` is only for messages.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn parse(document: Value, path: &Path) -> Result<Vehicle, ReadError> {
    let keys = Keys { path, document: &document, asked: RefCell::default() };
    if !document.is_object() {
        return Err(keys.bad("file", "is not a vehicle: expected an object with keys such as mass_kg and hydro".into()));
    }
    match keys.at("format").map(|f| f.as_str().unwrap_or_default()) {
        None | Some(TRIAL_FORMAT) => {}
        Some(other) => return Err(keys.bad("format", format!("is `{other}`; expected `{TRIAL_FORMAT}` or no such key"))),
    }
    let read = of_keys(&keys).map_err(|e| keys.slip_before(e))?;
    match keys.slip() {
        Some((key, meant)) => Err(keys.unknown(&key, &meant)),
        None => {
            let misplaced = slips::misplaced(&document, &keys.asked.borrow());
            let misplaced = misplaced.into_iter().map(|(key, meant)| format!("{key} does nothing: it is read as {meant}")).collect();
            Ok(Vehicle { path: path.to_path_buf(), misplaced, document, ..read })
        }
    }
}

/// The vehicle of a document's keys, still without its path and document.
fn of_keys(keys: &Keys) -> Result<Vehicle, ReadError> {
    let mut stated = Stated { keys, assumed: Vec::new() };
    let constants = stated.constants()?;
    let tolerance = stated.tolerance()?;
    let sensors = stated.sensors()?;
    let moments = PitchMoments::stated(|key, low, high, unit| keys.within_if_stated(key, low, high, unit))?;
    let background = stated.background()?;
    let assumed = stated.assumed;
    let effects = keys.at("effects").map_or_else(|| Ok(Vec::new()), |table| effects_table::read(table, |key, why| keys.bad(key, why)))?;
    let is_on = |a: &Active| a.effect.parameters.first().is_some_and(|size| a.values[0] != size.off);
    let water_depth_m = keys.within_if_stated("water_depth_m", 0.0, 12e3, "m")?.unwrap_or(f64::NAN);
    if let Some(effect) = effects.iter().find(|on| needs_water_depth(on.effect) && is_on(on)).filter(|_| !(water_depth_m > 0.0)) {
        let why =
            format!("is missing, or 0: the water moves over all of it by effects.{}, which does nothing without it", effect.effect.name);
        return Err(keys.bad("water_depth_m", why));
    }
    let text = |key: &str| keys.document.get(key).and_then(Value::as_str).unwrap_or_default().to_string();
    let (fit_segments, check_segments) = keys.fit_and_check()?;
    Ok(Vehicle {
        path: PathBuf::new(),
        name: Some(text("case")).filter(|s| !s.is_empty()).unwrap_or_else(|| text("name")),
        site: text("site"),
        constants,
        effects,
        tolerance,
        sensors,
        moments,
        background,
        current_unknown: keys.current_unknown()?,
        water_depth_m,
        fit_segments,
        check_segments,
        assumed,
        misplaced: Vec::new(),
        document: Value::Null,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const MINIMAL: &str = r#"{"mass_kg":68,"hull_volume_m3":0.068,"hull_compressibility_per_pa":5e-10,"hull_thermal_expansion_per_k":5e-5,
        "wing":{"area_m2":0.11},"hydro":{"reference_area_m2":0.11,"wing_lift_slope_per_rad":3.45,"hull_lift_slope_per_rad":1.2,
        "hull_area_m2":0.0356,"cd0":0.15},"effects":{"side_edge_lift":{"k":{"value":2.0}}},"colour":"yellow"}"#;

    #[test]
    fn a_minimal_vehicle_states_what_was_assumed_and_keeps_unknown_keys() {
        let v = parse(serde_json::from_str(MINIMAL).expect("json"), Path::new("v.json")).expect("reads");
        assert!((v.constants.lift_slope_per_rad - (3.45 + 1.2 * 0.0356 / 0.11)).abs() < 1e-12);
        assert!(v.assumed.iter().any(|a| a.starts_with("tolerance_1sigma.cd0_relative")));
        let said = v.assumed_of_the_model().expect("a reference temperature that is not stated");
        assert!(said.contains("reference_temperature_degc = 10") && !said.contains("tolerance"), "{said}");
        let appended = MINIMAL.replacen("\"effects\"", "\"segments\":{\"mass_kg\":80},\"effects\"", 1);
        let v = parse(serde_json::from_str(&appended).expect("json"), Path::new("v.json")).expect("reads");
        assert!(v.notes()[0] == "vehicle file: segments.mass_kg does nothing: it is read as mass_kg", "{:?}", v.notes());
        assert_eq!(v.effects.len(), 1);
        assert!((v.effects[0].values[0] - 2.0).abs() < 1e-12);
        assert_eq!(v.document["colour"], "yellow");
    }

    #[test]
    fn regress_an_effect_of_the_whole_depth_needs_the_waters() {
        let with = |effects: Value, depth: Value| {
            let mut d: Value = serde_json::from_str(MINIMAL).expect("json");
            (d["effects"], d["water_depth_m"]) = (effects, depth);
            parse(d, Path::new("v.json")).map(|v| v.effects.len()).map_err(|e| e.to_string())
        };
        let current = json!({"vertical_current": {"velocity_m_s": 0.02}});
        let own = |text: &str| json!({"own": {"expression": text, "k": 0.01}});
        for effects in [current.clone(), own("water_up_m_s += k*z/H")] {
            for depth in [Value::Null, json!(0.0)] {
                let e = with(effects.clone(), depth).expect_err("refused");
                assert!(e.contains("water_depth_m: is missing, or 0"), "{e}");
            }
            assert_eq!(with(effects, json!(45.0)), Ok(1));
        }
        assert_eq!(with(own("water_up_m_s += k*z"), Value::Null), Ok(1));
        assert_eq!(with(json!({"vertical_current": {"velocity_m_s": 0.0}}), Value::Null), Ok(1));
    }

    #[test]
    fn a_wide_law_takes_the_place_of_the_other_and_is_stated_whole() {
        let document = |wide: Value| {
            let mut d: Value = serde_json::from_str(MINIMAL).expect("json");
            d["hydro"]["wide"] = wide;
            d
        };
        let law = json!({"lift_slope_per_rad": 6.9, "lift_quadratic_per_rad2": 5.4, "slope_loss_per_rad2": 4.3, "cd0": 0.16,
            "hull_drag_per_rad2": 11.3, "hull_drag_per_rad3": -13.4});
        let c = parse(document(law.clone()), Path::new("v.json")).expect("reads").constants;
        assert_eq!((c.lift_slope_per_rad, c.lift_quadratic_per_rad2, c.slope_loss_per_rad2), (6.9, 5.4, 4.3));
        assert_eq!((c.cd0, c.hull_drag_per_rad2, c.hull_drag_per_rad3), (0.16, 11.3, -13.4));
        for (key, value, said) in [
            ("cd0", Value::Null, "hydro.wide.cd0: is missing"),
            ("slope_loss_per_rad2", json!(43.0), "hydro.wide.slope_loss_per_rad2: is 43 1/rad2; expected -8 to 8"),
            ("hull_drag_per_rad3", json!(-134.0), "leaves no drag"),
        ] {
            let mut other = law.clone();
            other[key] = value;
            let e = parse(document(other), Path::new("v.json")).expect_err("refused").to_string();
            assert!(e.contains(said), "{e}");
        }
    }

    #[test]
    fn errors_name_the_line_in_toml_and_json() {
        const TOML: &str = "mass_kg = 68\nhull_volume_m3 = 0.068 # mass_kg\nhull_compressibility_per_pa = 5e-10\nhull_thermal_expansion_per_k = 5e-5\n\n[wing]\narea_m2 = 0.11\n\n[hydro]\nreference_area_m2 = 0.11\nwing_lift_slope_per_rad = 3.45\nhull_lift_slope_per_rad = 1.2\nhull_area_m2 = 0.0356\ncd0 = 0.15\n";
        let toml = |from: &str, to: &str| {
            assert!(TOML.contains(from));
            parse_text(&TOML.replacen(from, to, 1), Path::new("v.toml")).expect_err("refused").to_string()
        };
        assert!(toml("mass_kg = 68", "mass_kg = 6.8e4").contains("v.toml, line 1, column mass_kg"));
        assert!(toml("cd0 = 0.15", "cd0 = \"low\"").contains("line 14, column hydro.cd0"));
        // A key that is not there: the table that lacks it.
        assert!(toml("cd0 = 0.15", "").contains("line 9, column hydro.cd0"));
        assert!(toml("[wing]\narea_m2 = 0.11", "[wing]\narea_m2 = 110").contains("line 7, column wing.area_m2"));
        assert!(toml("cd0 = 0.15", "cd0 = ").contains("line 14"));
        let bank = toml("cd0 = 0.15", "cd0 = 0.15\nbank_tilt = 1\nbanked_turn = 0.8");
        assert!(bank.contains("line 16, column hydro.banked_turn") && bank.contains("not both"), "{bank}");
        let json =
            serde_json::to_string_pretty(&serde_json::from_str::<Value>(&MINIMAL.replace("0.15", "-1")).expect("json")).expect("json");
        let line = 1 + json.lines().position(|l| l.contains("\"cd0\"")).expect("there");
        let e = parse_text(&json, Path::new("v.json")).expect_err("refused").to_string();
        assert!(e.contains(&format!("line {line}, column hydro.cd0")), "{e}");
    }

    #[test]
    fn numbers_that_no_vehicle_has_are_refused_by_their_key() {
        let with = |key: &str, value: Value| {
            let mut d: Value = serde_json::from_str(MINIMAL).expect("json");
            let mut at = &mut d;
            for part in key.split('.') {
                at = &mut at[part];
            }
            *at = value;
            parse(d, Path::new("v.json"))
        };
        for (key, value) in [
            ("gravity_m_s2", json!(98.0)),
            ("hydro.added_mass_surge", json!(-1.0)),
            ("hydro.induced_k", json!(-50.0)),
            ("hydro.lift_quadratic_per_rad2", json!(1e6)),
            ("hull_volume_m3", json!(0.001)),
            ("tolerance_1sigma.cd0_relative", json!(-0.1)),
            ("tolerance_1sigma.trim_volume_cc", json!(-1.0)),
            ("sensors.pressure_noise_dbar", json!(-1.0)),
            ("background_vertical_water_motion.correlation_time_s", json!(0.0)),
            ("format", json!("something/9")),
            ("horizontal_current", json!("maybe")),
            ("horizontal_current", json!(0.1)),
            ("water_depth_m", json!(-3.0)),
        ] {
            let e = with(key, value).expect_err(key).to_string();
            assert!(e.contains(key), "{key}: {e}");
        }
        assert!(with("gravity_m_s2", json!(9.78)).is_ok());
    }

    #[test]
    fn errors_name_the_key_and_the_range() {
        let with = |from: &str, to: &str| {
            parse(serde_json::from_str(&MINIMAL.replace(from, to)).expect("json"), Path::new("v.json")).expect_err("refused").to_string()
        };
        let e = with("\"mass_kg\":68", "\"mass_kg\":68000");
        assert!(e.contains("v.json") && e.contains("mass_kg") && e.contains("5000"), "{e}");
        assert!(with("\"cd0\":0.15", "\"cd0\":null").contains("missing"));
        let e = with("\"cd0\":0.15", "\"cd0\":0.15,\"cd_broadside\":-3.5");
        assert!(e.contains("hydro.cd_broadside") && e.contains("0.1 to 20"), "{e}");
        assert!(with("side_edge_lift", "magic").contains("effects.magic"));
    }
}
