//! Injected errors: one thing changed in the vehicle file or in the log of a real flight, and what a diagnosis should then say.

use logs::Flight;
use logs::record::resample::Series;
use serde_json::{Value, json};

/// Compressibility of a Slocum hull, 1/Pa, that a relative error is relative to where the file says that the hull is rigid.
const SLOCUM_COMPRESSIBILITY_PER_PA: f64 = 5e-10;
/// Silence of an engineering channel that a shifted clock is interpolated across, s.
const BRIDGE_S: f64 = 60.0;
/// Speed of the current that the fixes are made to drift by, m/s.
const CURRENT_M_S: f64 = 0.2;

/// One change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// None.
    Nothing,
    /// Numbers of the vehicle file (JSON pointers) multiplied by a factor.
    Number(&'static [&'static str], f64),
    /// Pitch of the log multiplied, then moved, rad.
    Pitch(f64, f64),
    /// Ballast of the log multiplied, then moved, m³.
    Ballast(f64, f64),
    /// Engineering channels behind the science clock by this time, s.
    Clock(f64),
    /// Pressure of the CTD moved, Pa.
    PressureZero(f64),
    /// Fixes drift north with a current, m/s.
    Current(f64),
}

/// A change and the effect that undoes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectedError {
    /// Name for people and files.
    pub name: &'static str,
    /// What is changed.
    pub change: Change,
    /// Effect of the catalogue and its parameter that says so; none for what is a finding about a sensor.
    pub effect: Option<(&'static str, &'static str)>,
    /// Size of the effect in terms of the unchanged file, for the expected information.
    pub shift: f64,
    /// Value that the parameter should be reported with; none where it depends on the file ([`InjectedError::value`]).
    value: Option<f64>,
    /// Name of the sensor finding that says so.
    pub finding: Option<&'static str>,
}

const fn number(name: &'static str, keys: &'static [&'static str], factor: f64, effect: &'static str) -> InjectedError {
    let value = if factor == 0.0 { None } else { Some(1.0 / factor - 1.0) };
    InjectedError {
        name,
        change: Change::Number(keys, factor),
        effect: Some((effect, "rel_error")),
        shift: 1.0 - factor,
        value,
        finding: None,
    }
}

const fn log(name: &'static str, change: Change, effect: (&'static str, &'static str), value: f64) -> InjectedError {
    InjectedError { name, change, effect: Some(effect), shift: value, value: Some(value), finding: None }
}

const fn sensor(name: &'static str, change: Change, finding: Option<&'static str>, value: f64) -> InjectedError {
    InjectedError { name, change, effect: None, shift: value, value: Some(value), finding }
}

const COMPRESSIBILITY: &[&str] = &["/hull_compressibility_per_pa"];
const EXPANSION: &[&str] = &["/hull_thermal_expansion_per_k"];
const DRAG: &[&str] = &["/hydro/cd0", "/hydro/wide/cd0"];
const LIFT: &[&str] = &["/hydro/wing_lift_slope_per_rad", "/hydro/hull_lift_slope_per_rad", "/hydro/wide/lift_slope_per_rad"];
/// Three degrees.
const PITCH_RAD: f64 = 0.052_359_877_559_829_89;

/// All injected errors, nothing changed first.
pub const INJECTED_ERRORS: [InjectedError; 19] = [
    sensor("nothing", Change::Nothing, None, 0.0),
    number("compressibility x0.3", COMPRESSIBILITY, 0.3, "hull_compressibility"),
    number("compressibility off", COMPRESSIBILITY, 0.0, "hull_compressibility"),
    number("expansion x3", EXPANSION, 3.0, "thermal_expansion"),
    number("cd0 /1.5", DRAG, 1.0 / 1.5, "drag_level_error"),
    number("cd0 x1.5", DRAG, 1.5, "drag_level_error"),
    number("lift /1.3", LIFT, 1.0 / 1.3, "lift_slope_error"),
    log("pitch +3 deg", Change::Pitch(1.0, PITCH_RAD), ("pitch_offset", "offset_rad"), PITCH_RAD),
    log("pitch -3 deg", Change::Pitch(1.0, -PITCH_RAD), ("pitch_offset", "offset_rad"), -PITCH_RAD),
    log("pitch x1.08", Change::Pitch(1.08, 0.0), ("pitch_scale", "gain_error"), 0.08),
    // A reading that is 120 cm³ too buoyant wants 120 cm³ less of hull.
    log("ballast +120 cc", Change::Ballast(1.0, 120e-6), ("ballast_offset", "volume_cc"), -120.0),
    log("ballast -120 cc", Change::Ballast(1.0, -120e-6), ("ballast_offset", "volume_cc"), 120.0),
    log("ballast x1.08", Change::Ballast(1.08, 0.0), ("ballast_scale", "gain_error"), 1.0 / 1.08 - 1.0),
    sensor("clock +5 s", Change::Clock(5.0), Some("clock_offset"), 5.0),
    sensor("clock -5 s", Change::Clock(-5.0), Some("clock_offset"), -5.0),
    sensor("pressure zero +1.5 dbar", Change::PressureZero(15_000.0), Some("pressure_zero"), 1.5),
    sensor("pressure zero -1.5 dbar", Change::PressureZero(-15_000.0), Some("pressure_zero"), -1.5),
    log("current 0.2 m/s", Change::Current(CURRENT_M_S), ("horizontal_current", "speed_m_s"), CURRENT_M_S),
    // The same the other way: a vehicle whose file has too much of it.
    number("compressibility x2", COMPRESSIBILITY, 2.0, "hull_compressibility"),
];

impl InjectedError {
    /// Value that the parameter of the effect should be told with, given the unchanged vehicle file.
    #[must_use]
    pub fn value(&self, vehicle: &Value) -> Option<f64> {
        let stated = || Some(vehicle.pointer(COMPRESSIBILITY[0])?.as_f64()? / SLOCUM_COMPRESSIBILITY_PER_PA);
        self.value.or_else(stated)
    }

    /// Changes a flight and its vehicle file.
    pub fn tell(&self, flight: &mut Flight, vehicle: &mut Value) {
        match self.change {
            Change::Nothing => {}
            Change::Number(keys, factor) => {
                for key in keys {
                    if let Some(v) = vehicle.pointer_mut(key)
                        && let Some(x) = v.as_f64()
                    {
                        *v = json!(x * factor);
                    }
                }
            }
            Change::Pitch(scale, zero) => flight.pitch_rad.iter_mut().for_each(|p| *p = *p * scale + zero),
            Change::Ballast(scale, zero) => flight.ballast_m3.iter_mut().for_each(|b| *b = *b * scale + zero),
            Change::PressureZero(by) => flight.pressure_pa.iter_mut().for_each(|p| *p += by),
            Change::Current(speed) => flight.gps_north_m.iter_mut().zip(&flight.time_s).for_each(|(n, t)| *n += speed * t),
            Change::Clock(late_s) => {
                let time = flight.time_s.clone();
                let shift = |values: &mut Vec<f64>| {
                    let series = Series::new(&time, values);
                    let had: Vec<bool> = values.iter().map(|v| v.is_finite()).collect();
                    *values =
                        time.iter().zip(had).map(|(t, had)| if had { series.at_within(t - late_s, BRIDGE_S) } else { f64::NAN }).collect();
                };
                // Heading stays: an interpolated compass reads south where it passes north, and no dive feels a heading five seconds old.
                let steered = [&mut flight.pitch_rad, &mut flight.roll_rad, &mut flight.ballast_m3, &mut flight.battery_mass_m];
                steered.into_iter().for_each(shift);
                flight.extra.iter_mut().filter(|(name, _)| name.starts_with("eng_") || name.starts_with("m_")).for_each(|(_, v)| shift(v));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hydro::effects::{Sensed, by_name};

    /// Each injected error of a sensor or the engine is undone by its effect at the stated value.
    #[test]
    fn accuracy_the_effect_of_an_injected_error_undoes_it() {
        for injected in INJECTED_ERRORS {
            let (Some((name, parameter)), Change::Pitch(..) | Change::Ballast(..)) = (injected.effect, injected.change) else { continue };
            let mut flight = Flight { pitch_rad: vec![0.4, -0.3], ballast_m3: vec![2e-4, -1.5e-4], ..Flight::default() };
            injected.tell(&mut flight, &mut json!({}));
            let effect = by_name(name).expect("in the catalogue");
            assert_eq!(effect.parameters[0].name, parameter);
            let value = injected.value(&json!({})).expect("stated");
            for (i, (pitch, ballast)) in [(0.4, 2e-4), (-0.3, -1.5e-4)].into_iter().enumerate() {
                let mut s = Sensed {
                    time_s: 0.0,
                    pitch_rad: flight.pitch_rad[i],
                    ballast_m3: flight.ballast_m3[i],
                    density_kg_m3: 1025.0,
                    temperature_degc: 10.0,
                    hull_degc: 10.0,
                    pressure_pa: 0.0,
                };
                effect.sensed.inspect(|to_truth| to_truth(&[value], &mut s));
                let volume = if name == "ballast_offset" { value * 1e-6 } else { 0.0 };
                assert!((s.pitch_rad - pitch).abs() < 1e-12 && (s.ballast_m3 + volume - ballast).abs() < 1e-15, "{}", injected.name);
            }
        }
    }

    #[test]
    fn accuracy_a_number_of_the_file_comes_back_by_its_relative_error() {
        for injected in INJECTED_ERRORS {
            let Change::Number(keys, _) = injected.change else { continue };
            let mut file = json!({"hull_compressibility_per_pa": 4e-10, "hull_thermal_expansion_per_k": 6e-5,
                "hydro": {"cd0": 0.15, "wing_lift_slope_per_rad": 3.7, "hull_lift_slope_per_rad": 3.8}});
            let before = file.pointer(keys[0]).and_then(Value::as_f64).expect("there");
            let error = injected.value(&file).expect("stated");
            injected.tell(&mut Flight::default(), &mut file);
            let after = file.pointer(keys[0]).and_then(Value::as_f64).expect("there");
            let base = if after == 0.0 { SLOCUM_COMPRESSIBILITY_PER_PA } else { after };
            assert!((after + base * error - before).abs() < 1e-12 * before, "{}", injected.name);
        }
    }

    #[test]
    fn accuracy_a_late_clock_moves_the_engineering_channels_and_nothing_else() {
        let time_s: Vec<f64> = (0..100).map(f64::from).collect();
        let mut flight = Flight { pitch_rad: time_s.clone(), pressure_pa: time_s.clone(), time_s: time_s.clone(), ..Flight::default() };
        flight.extra.insert("eng_pressure_bar".into(), time_s.clone());
        let late = INJECTED_ERRORS.iter().find(|l| l.name == "clock +5 s").expect("there");
        late.tell(&mut flight, &mut json!({}));
        assert_eq!((flight.pitch_rad[50], flight.extra["eng_pressure_bar"][50], flight.pressure_pa[50]), (45.0, 45.0, 50.0));
        assert!(flight.pitch_rad[2].is_nan());
    }
}
