//! What was measured: a flight, read from the flight format, and its channels put on one clock.

pub mod afloat;
pub mod bounded;
pub mod clock_offset;
pub mod csv;
pub mod flight;
pub mod plausible;
pub mod resample;
pub mod seawater;
pub mod situations;
pub mod steady;
