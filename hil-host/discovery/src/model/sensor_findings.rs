//! Sensors, and numbers of the log, that a fit finds to be off.

use crate::model::parameters::{BATTERY_MASS, CLOCK_OFFSET, NINETY, PARAMETERS, State, bounds, tolerance_of};
use logs::vehicle::Vehicle;

/// A sensor, or a number of the log, that is found to be off.
#[derive(Clone, Debug)]
pub struct SensorFinding {
    /// Name in [`PARAMETERS`].
    pub name: &'static str,
    /// What it is, in words.
    pub what: &'static str,
    /// Value with its 90 % interval.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit.
    pub unit: &'static str,
}

/// Tolerances beyond which a nuisance is reported, and standard errors that it must be from nothing.
const SIGNIFICANT: f64 = 3.0;
/// Nuisances that a fit finds to be off by more than they usually are: a state and the standard errors of its calibration numbers, in
/// tolerances. `clock_shift_s` is what was taken out before the fit ([`crate::preprocess::Prepared`]).
#[must_use]
pub fn sensor_findings(
    vehicle: &Vehicle,
    state: &State,
    sigma: impl Fn(usize) -> f64,
    clock_shift_s: Option<[f64; 2]>,
) -> Vec<SensorFinding> {
    let found = |k: usize| {
        let (what, unit, factor) = PARAMETERS[k].of_sensor()?;
        let (z, s) = (state.calibration[k], sigma(k));
        let by = tolerance_of(vehicle, k) * factor;
        let [value, low, high] = [0.0, -NINETY, NINETY].map(|sigmas| (z + sigmas * s) * by);
        let finding = || SensorFinding { name: PARAMETERS[k].name, what, value, low, high, unit };
        (z.abs() > SIGNIFICANT && z.abs() > SIGNIFICANT * s && !is_at_bound(vehicle, state, k)).then(finding)
    };
    with_clock_shift((0..BATTERY_MASS).filter_map(found).collect(), clock_shift_s)
}

/// Whether a calibration number has come to the end of what is possible: it has no interval there.
pub(crate) fn is_at_bound(vehicle: &Vehicle, state: &State, k: usize) -> bool {
    let z = state.calibration[k];
    z != 0.0 && bounds(vehicle, k).is_some_and(|(low, high)| z <= low || z >= high)
}

/// Nuisances that have come to the end of what is possible: the flight does not determine them, in words.
#[must_use]
pub fn not_determined(vehicle: &Vehicle, state: &State) -> Option<String> {
    let named = |k: usize| PARAMETERS[k].of_sensor().map_or(PARAMETERS[k].name, |(what, ..)| what);
    let what = |k: usize| is_at_bound(vehicle, state, k).then(|| named(k));
    let said: Vec<&str> = (0..BATTERY_MASS).filter_map(what).collect();
    (!said.is_empty()).then(|| format!("at the end of what is possible, so not determined by this flight: {}", said.join("; ")))
}

/// The findings with the shift of a clock and its standard error, s, that was taken out before the fit: what the fit found is beyond it.
fn with_clock_shift(mut findings: Vec<SensorFinding>, shift_s: Option<[f64; 2]>) -> Vec<SensorFinding> {
    let (Some([shift, sigma]), Some((what, unit, _))) = (shift_s, PARAMETERS[CLOCK_OFFSET].of_sensor()) else { return findings };
    let name = PARAMETERS[CLOCK_OFFSET].name;
    if let Some(fitted) = findings.iter_mut().find(|f| f.name == name) {
        [&mut fitted.value, &mut fitted.low, &mut fitted.high].into_iter().for_each(|v| *v += shift);
    } else {
        findings.push(SensorFinding { name, what, value: shift, low: shift - NINETY * sigma, high: shift + NINETY * sigma, unit });
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::HEAVE_MASS;

    #[test]
    fn a_nuisance_at_its_bound_is_a_note_and_no_finding() {
        let text = include_str!("../../../../vehicles/modena.toml");
        let vehicle = logs::vehicle::parse(toml::from_str(text).expect("TOML"), std::path::Path::new("modena.toml")).expect("a vehicle");
        let mut state = State::nominal();
        assert_eq!((sensor_findings(&vehicle, &state, |_| 0.01, None).len(), not_determined(&vehicle, &state)), (0, None));
        let (low, _) = bounds(&vehicle, HEAVE_MASS).expect("bounded");
        state.calibration[HEAVE_MASS] = 0.9 * low;
        assert_eq!((sensor_findings(&vehicle, &state, |_| 0.01, None).len(), not_determined(&vehicle, &state)), (1, None));
        state.calibration[HEAVE_MASS] = low;
        assert!(sensor_findings(&vehicle, &state, |_| 0.01, None).is_empty());
        assert!(
            not_determined(&vehicle, &state)
                .expect("said")
                .ends_with("added mass across the hull beyond the vehicle file's, share of the mass")
        );
    }

    #[test]
    fn a_clock_shift_taken_out_before_the_fit_is_a_finding_with_the_rest() {
        assert!(with_clock_shift(Vec::new(), None).is_empty());
        let alone = with_clock_shift(Vec::new(), Some([-6.5, 0.1]));
        assert_eq!((alone.len(), alone[0].name, alone[0].value, alone[0].unit), (1, "clock_offset", -6.5, "s"));
        assert!((alone[0].high - alone[0].low - 0.329).abs() < 1e-9);
        let more = with_clock_shift(alone, Some([1.0, 0.1]));
        assert_eq!((more.len(), more[0].value), (1, -5.5));
    }
}
