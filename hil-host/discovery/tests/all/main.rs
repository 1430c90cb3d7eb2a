//! Tests of the workbench on files of all kinds and on real flights, as one program.

mod doubtful_inputs;
mod example_trials;
mod import_formats;
mod import_packages;
mod import_real_files;
mod import_situations;
mod public_readers;
mod real_flights;
mod steady_real_flights;
