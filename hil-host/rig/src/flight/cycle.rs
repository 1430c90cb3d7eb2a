//! One control cycle of a flight: what was measured, what was answered, what was true.

use plant::Truth;
use signals::{Answer, SensorFrame};

/// One control cycle as it happened.
#[derive(Clone, Copy, Debug)]
pub struct Cycle<'a> {
    /// Time since the start of the flight, s.
    pub time_s: f64,
    /// What was measured.
    pub frame: &'a SensorFrame,
    /// What the controller answered.
    pub answer: &'a Answer,
    /// What was true when it was measured.
    pub truth: &'a Truth,
    /// Resets of the controller before it.
    pub resets: u32,
}
