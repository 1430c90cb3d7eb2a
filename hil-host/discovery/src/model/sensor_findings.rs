//! Sensors, and numbers of the log, that a fit finds to be off.

use crate::model::parameters::{BATTERY_MASS, PARAMETERS, State, tolerance_of};
use crate::vehicle::Vehicle;

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
/// Two-sided 90 % of a normal variable, sigma.
const NINETY: f64 = 1.645;

/// Nuisances that a fit finds to be off by more than they usually are: a state and the standard errors of its calibration numbers, in
/// tolerances.
#[must_use]
pub fn sensor_findings(vehicle: &Vehicle, state: &State, sigma: impl Fn(usize) -> f64) -> Vec<SensorFinding> {
    let found = |k: usize| {
        let (what, unit, factor) = PARAMETERS[k].of_sensor()?;
        let (z, s) = (state.calibration[k], sigma(k));
        let by = tolerance_of(vehicle, k) * factor;
        let [value, low, high] = [0.0, -NINETY, NINETY].map(|sigmas| (z + sigmas * s) * by);
        let finding = || SensorFinding { name: PARAMETERS[k].name, what, value, low, high, unit };
        (z.abs() > SIGNIFICANT && z.abs() > SIGNIFICANT * s).then(finding)
    };
    (0..BATTERY_MASS).filter_map(found).collect()
}
