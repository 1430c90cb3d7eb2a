//! Tests of several folders together, in the program of the unit tests.

mod import_packages;
mod import_real_files;
mod import_situations;
mod made_logs;
mod mutations;
mod old_hdf5;
mod prop_mutated_files;
#[cfg(feature = "export")]
mod public_readers;
