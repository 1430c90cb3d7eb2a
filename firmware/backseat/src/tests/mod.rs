//! Tests of several files together, in the program of the unit tests.

mod bench;
mod damaged_line;
mod lost_line;
mod session;
mod surfacing_report;
