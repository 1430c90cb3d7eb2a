//! A change of a mission, and a level of a number of its vehicle.

use super::changes::Change;

/// A value with its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A change as it is said.
#[derive(Clone, Debug)]
pub struct Event {
    /// What was found.
    pub change: Change,
    /// Number of the first dive that has it; 0: it was there before the first.
    pub dive: usize,
    /// Day of it.
    pub day: f64,
    /// First and last dive number that it may have begun with, 90 %.
    pub between: (usize, usize),
    /// Size in the unit of its number: of a growth, what it has grown to by the end.
    pub size: Level,
    /// Of a growth, per day.
    pub per_day: Option<f64>,
    /// Change of range at the flown pitch, %.
    pub range_percent: Option<f64>,
    /// Kinds that the dives do not tell from it, with their sizes.
    pub others: Vec<(Change, Level)>,
}
