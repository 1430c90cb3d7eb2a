//! Tests of several folders together, in the program of the unit tests.

mod doubtful_inputs;
mod example_trials;
mod forecast;
mod import_formats;
mod real_flights;
mod steady_real_flights;
