//! Tests of several files together, in the program of the unit tests.

mod backseat_flights;
mod board_resets;
mod flights;
