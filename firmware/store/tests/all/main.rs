//! All tests of this crate, as one program.

mod image_cuts;
mod nor;
mod power_cuts;
