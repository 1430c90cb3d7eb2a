//! A vehicle file with refitted calibration numbers: what `add` and `calibrate` write.

use crate::model::parameters::{BALLAST_GAIN, PARAMETERS, PITCH_ZERO, STATED, State, calibration_of, law, tolerance_of};
use logs::vehicle::{Vehicle, catalogue};
use serde_json::{Map, Value, json};

/// The vehicle's document with the numbers that a state means. Its effects are those of the file; ballast scale and pitch offset, which
/// have no constant of their own, are left to [`zeros`].
pub(crate) fn numbers(vehicle: &Vehicle, state: &State) -> Value {
    let mut d = vehicle.document.clone();
    for (p, z) in PARAMETERS.iter().zip(state.calibration) {
        let factor = p.on_document(vehicle, z);
        // A fit that turns the sign of a number does not know it: it stays as stated.
        for pointer in p.document.iter().filter(|_| factor > 0.0) {
            if let Some(v) = d.pointer_mut(pointer)
                && let Some(x) = v.as_f64()
            {
                *v = json!(x * factor);
            }
        }
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
    let stating = |k: usize| catalogue::all().find(|e| calibration_of(e) == Some(k)).map(|e| (k, e));
    [BALLAST_GAIN, PITCH_ZERO]
        .into_iter()
        .filter_map(stating)
        .map(|(k, e)| {
            let (effect, parameter, unit) = (e.name, e.parameters[0].name, e.parameters[0].unit);
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
    for (k, p) in PARAMETERS.iter().enumerate() {
        let (Some(of_file), tolerance) = (p.stated(), tolerance_of(vehicle, k)) else { continue };
        let grown = if p.is_relative() { 1.0 + state.calibration[k] * tolerance } else { 1.0 };
        if grown > 0.0 {
            stated.insert(of_file.key.into(), json!(tolerance * left[k] / grown));
        }
    }
    stated
}
