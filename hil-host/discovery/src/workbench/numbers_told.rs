//! The numbers of a vehicle before and after a calibration, in the units of its file.

use crate::model::parameters::{CALIBRATION, STATED, State, law, tolerance_of};
use crate::vehicle::Vehicle;

/// Two-sided 90 % of a normal variable, sigma.
const NINETY: f64 = 1.645;

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
pub(crate) fn numbers_told(vehicle: &Vehicle, state: &State, left: &[f64; STATED], between: impl Fn(usize) -> Option<f64>) -> Vec<Number> {
    let values = |state: &State| {
        let (c, _) = law(vehicle, state);
        let z = |i: usize| state.calibration[i] * tolerance_of(vehicle, i);
        [
            (c.cd0, "1"),
            (c.lift_slope_per_rad, "1/rad"),
            (c.lift_quadratic_per_rad2, "1/rad2"),
            (z(3), "cm3"),
            (z(4), "1"),
            (z(5), "rad"),
            (c.compressibility_per_pa, "1/Pa"),
            (c.thermal_expansion_per_k, "1/K"),
            (c.added_mass_surge, "of the mass"),
            (c.added_mass_heave, "of the mass"),
            (c.induced_k, "1"),
            (c.hull_drag_per_rad2, "1/rad2"),
        ]
    };
    let (before, after) = (values(&State::nominal()), values(state));
    let unit_of = |i: usize| if matches!(i, 0..=2 | 6 | 7) { before[i].0.abs() } else { 1.0 };
    (0..before.len())
        .map(|i| Number {
            name: CALIBRATION[i],
            unit: before[i].1,
            value: [before[i].0, after[i].0],
            tolerance: left.get(i).map(|left| [1.0, *left].map(|t| t * tolerance_of(vehicle, i) * unit_of(i))),
            between_flights: between(i).filter(|_| i < STATED).map(|scatter| scatter * tolerance_of(vehicle, i) * unit_of(i)),
        })
        .collect()
}

impl Number {
    /// 90 % interval of the new value.
    #[must_use]
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.tolerance.map(|[_, t]| (self.value[1] - NINETY * t, self.value[1] + NINETY * t))
    }
}
