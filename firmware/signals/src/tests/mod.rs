//! Tests of several files together, in the program of the unit tests.

mod surfacing;
mod wire_page;
