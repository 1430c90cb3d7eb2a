//! A vehicle file with refitted calibration numbers: what `add` and `calibrate` write.

use crate::likelihood::battery;
use crate::model::parameters::{BALLAST_GAIN, PITCH_ZERO, STATED, State, calibration_of, law, tolerance_of};
use crate::vehicle::{Vehicle, catalogue};
use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};

/// The vehicle's document with the numbers that a state means. Its effects are those of the file; ballast scale and pitch offset, which
/// have no constant of their own, are left to [`zeros`].
pub(crate) fn numbers(vehicle: &Vehicle, state: &State) -> Value {
    let mut d = vehicle.document.clone();
    let t = &vehicle.tolerance;
    let z = &state.calibration;
    let mut scale = |pointer: &str, factor: f64| {
        if let Some(v) = d.pointer_mut(pointer)
            && let Some(x) = v.as_f64()
        {
            *v = json!(x * factor);
        }
    };
    let of_hydro = [
        (["cd0", "wide/cd0"].as_slice(), 1.0 + z[0] * t.cd0_relative),
        (&["wing_lift_slope_per_rad", "hull_lift_slope_per_rad", "wide/lift_slope_per_rad"], 1.0 + z[1] * t.lift_slope_relative),
        (&["lift_quadratic_per_rad2", "wide/lift_quadratic_per_rad2"], 1.0 + z[2] * t.lift_quadratic_relative),
        (&["induced_k"], 1.0 + z[10] * tolerance_of(vehicle, 10)),
        (&["hull_drag_per_rad2", "wide/hull_drag_per_rad2"], 1.0 + z[11] * tolerance_of(vehicle, 11)),
    ];
    for (keys, factor) in of_hydro {
        keys.iter().for_each(|key| scale(&format!("/hydro/{key}"), factor));
    }
    scale("/hull_volume_m3", 1.0 + z[3] * t.trim_volume_m3 / vehicle.constants.hull_volume_m3);
    scale("/hull_compressibility_per_pa", 1.0 + z[6] * t.hull_compressibility_relative);
    scale("/hull_thermal_expansion_per_k", 1.0 + z[7] * t.hull_thermal_expansion_relative);
    for (k, key) in battery::NUMBERS {
        scale(&format!("/pitch/{key}"), 1.0 + z[k] * tolerance_of(vehicle, k));
    }
    let (c, _) = law(vehicle, state);
    if let Some(hydro) = d.get_mut("hydro") {
        hydro["added_mass_surge"] = json!(c.added_mass_surge);
        hydro["added_mass_heave"] = json!(c.added_mass_heave);
        hydro["bank_tilt"] = json!(c.bank_tilt);
        hydro["banked_turn"] = json!(c.banked_turn);
        hydro["lift_fading"] = json!(c.beyond.lift_fading);
        hydro["cd_broadside"] = json!(c.beyond.cd_broadside);
    }
    if c.hull_lag_share != 0.0 {
        d["hull_lag_share"] = json!(c.hull_lag_share);
    }
    d
}

/// A calibration number that goes on as an effect of the file.
pub(crate) struct Zero {
    /// Effect and its parameter.
    pub effect: &'static str,
    /// Its parameter.
    pub parameter: &'static str,
    /// Unit of that.
    pub unit: &'static str,
    /// What the file says already, and what the state adds.
    pub before: f64,
    /// What the state adds.
    pub shift: f64,
}

/// The two calibration numbers that have no constant in the file: they go on as the effect that states them.
pub(crate) fn zeros(vehicle: &Vehicle, state: &State) -> Vec<Zero> {
    let stating = |k: usize| catalogue::all().find(|e| calibration_of(*e) == Some(k)).map(|e| (k, e));
    [BALLAST_GAIN, PITCH_ZERO]
        .into_iter()
        .filter_map(stating)
        .map(|(k, e)| {
            let (effect, parameter, unit) = (e.name(), e.parameters()[0].name, e.parameters()[0].unit);
            let stated = vehicle.document.pointer(&format!("/effects/{effect}/{parameter}"));
            let before = stated.map_or(0.0, |v| v.get("value").unwrap_or(v).as_f64().unwrap_or(0.0));
            Zero { effect, parameter, unit, before, shift: state.calibration[k] * tolerance_of(vehicle, k) }
        })
        .collect()
}

impl Zero {
    /// Its entry in the table of effects.
    pub(crate) fn entry(&self) -> Value {
        json!({self.parameter: {"value": self.before + self.shift, "unit": self.unit, "from": "calibration"}})
    }
}

/// The table of tolerances with these standard deviations, in tolerances of the file that was refitted. A relative tolerance is of the
/// refitted number.
pub(crate) fn tolerances(vehicle: &Vehicle, document: &Value, state: &State, left: &[f64; STATED]) -> Map<String, Value> {
    let mut stated = document.get("tolerance_1sigma").and_then(Value::as_object).cloned().unwrap_or_default();
    for (k, (key, tolerance)) in crate::hypotheses::identifiability::stated_tolerances(vehicle).into_iter().enumerate() {
        let grown = if key.ends_with("_relative") && k != 4 { 1.0 + state.calibration[k] * tolerance } else { 1.0 };
        if grown > 0.0 {
            stated.insert(key.into(), json!(tolerance * left[k] / grown));
        }
    }
    stated
}

/// Sets a tolerance by calibration number, in the unit of its key.
pub(crate) fn set_tolerance(vehicle: &mut Vehicle, index: usize, value: f64) {
    let t = &mut vehicle.tolerance;
    match index {
        0 => t.cd0_relative = value,
        1 => t.lift_slope_relative = value,
        2 => t.lift_quadratic_relative = value,
        3 => t.trim_volume_m3 = value * 1e-6,
        4 => t.ballast_gain_relative = value,
        5 => t.pitch_zero_rad = value,
        6 => t.hull_compressibility_relative = value,
        7 => t.hull_thermal_expansion_relative = value,
        8 => t.added_mass_surge = value,
        9 => t.added_mass_heave = value,
        _ => {}
    }
}

/// Hash of a file's bytes, in hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
