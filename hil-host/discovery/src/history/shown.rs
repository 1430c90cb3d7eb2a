//! Numbers as people read them: drag and lift in percent, trim in cm³, angles in degrees.

use super::kinds::AFLOAT_ZERO;
use super::numbers::{ALL, BALLAST_OFFSET, COMPRESSIBILITY, DRAG_LEVEL, EXPANSION, Numbers, PITCH_OFFSET, SLOPE_OF_LIFT, in_effect};

/// One number of a timeline.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// Name in tables and documents.
    pub name: &'static str,
    /// Unit there.
    pub unit: &'static str,
    /// Column of a dive's summary.
    pub column: usize,
}

const fn shown(name: &'static str, unit: &'static str, column: usize) -> Shown {
    Shown { name, unit, column }
}

/// How many.
pub const N: usize = 6;
/// What a timeline shows of each dive, beyond the vehicle file.
pub const LEVELS_SHOWN: [Shown; N] = [
    shown("drag", "%", DRAG_LEVEL),
    shown("lift", "%", SLOPE_OF_LIFT),
    shown("trim", "cm3", BALLAST_OFFSET),
    shown("pitch_zero", "deg", PITCH_OFFSET),
    shown("compressibility", "%", COMPRESSIBILITY),
    shown("pressure_zero", "dbar", AFLOAT_ZERO),
];

/// Size of the pressure's zero, dbar.
const PORT_DBAR: f64 = 0.15;
/// What a reading afloat knows it by, dbar: waves, and where the port floats.
const AFLOAT_DBAR: f64 = 0.05;

/// Precision of a reading afloat of so many pascal, per size², and that times its value in sizes.
#[must_use]
pub fn afloat(pressure_pa: f64) -> (f64, f64) {
    const PA: f64 = 1e4;
    let precision = (PORT_DBAR / AFLOAT_DBAR).powi(2);
    if pressure_pa.is_finite() { (precision, precision * pressure_pa / PA / PORT_DBAR) } else { (0.0, 0.0) }
}

/// Name and unit of any column.
#[must_use]
pub fn name_and_unit(column: usize) -> (&'static str, &'static str) {
    let other = || (ALL.get(column).map_or("", |n| n.name), if column == EXPANSION { "1/K" } else { "%" });
    LEVELS_SHOWN.iter().find(|s| s.column == column).map_or_else(other, |s| (s.name, s.unit))
}

/// Where a number stands among [`LEVELS_SHOWN`].
#[must_use]
pub fn place(column: usize) -> usize {
    LEVELS_SHOWN.iter().position(|s| s.column == column).unwrap_or(0)
}

/// So many sizes of a column in its unit; `claims` are what the vehicle file says of the numbers.
#[must_use]
pub fn value(column: usize, in_sizes: f64, sizes: &Numbers, claims: &Numbers) -> f64 {
    match column {
        AFLOAT_ZERO => in_sizes * PORT_DBAR,
        BALLAST_OFFSET => in_effect(column, in_sizes * sizes[column], claims[column]),
        PITCH_OFFSET => in_effect(column, in_sizes * sizes[column], claims[column]).to_degrees(),
        EXPANSION => in_sizes * sizes[column],
        _ => 100.0 * in_effect(column, in_sizes * sizes[column], claims[column]),
    }
}
