//! The numbers of a vehicle before and after a calibration, in the units of its file.

use crate::model::parameters::{HULL_DRAG, NINETY, PARAMETERS, Parameter, STATED, State, TRIM_VOLUME, law, tolerance_of};
use logs::vehicle::Vehicle;

/// One number of the vehicle.
#[derive(Clone, Debug)]
pub struct Number {
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Value in the file given, and in the new one.
    pub value: [f64; 2],
    /// Tolerance in the file given, and in the new one, 1 sigma; none where a file has no place for it.
    pub tolerance: Option<[f64; 2]>,
    /// Scatter between flights, 1 sigma; none for a number of one deployment.
    pub between_flights: Option<f64>,
}

/// Numbers of the law in their own units: of the file, and of a state with these tolerances left, in tolerances of the file.
pub(crate) fn reported_numbers(
    vehicle: &Vehicle,
    state: &State,
    left: &[f64; STATED],
    between: impl Fn(usize) -> Option<f64>,
) -> Vec<Number> {
    let (before, _) = law(vehicle, &State::nominal());
    let (after, _) = law(vehicle, state);
    let number = |(i, p): (usize, &Parameter)| {
        let deviation = state.calibration[i] * tolerance_of(vehicle, i);
        // Trim and zeros are stated as what they deviate by.
        let value = if i == TRIM_VOLUME { None } else { p.constant(&before).zip(p.constant(&after)) };
        let value = value.map_or([0.0, deviation], |(before, after)| [before, after]);
        let unit = if p.is_relative() { value[0].abs() } else { 1.0 };
        Number {
            name: p.name,
            unit: p.unit,
            value,
            tolerance: left.get(i).map(|left| [1.0, *left].map(|t| t * tolerance_of(vehicle, i) * unit)),
            between_flights: between(i).filter(|_| i < STATED).map(|scatter| scatter * tolerance_of(vehicle, i) * unit),
        }
    };
    PARAMETERS.iter().enumerate().take(HULL_DRAG + 1).map(number).collect()
}

impl Number {
    /// 90 % interval of the new value.
    #[must_use]
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.tolerance.map(|[_, t]| (self.value[1] - NINETY * t, self.value[1] + NINETY * t))
    }
}
