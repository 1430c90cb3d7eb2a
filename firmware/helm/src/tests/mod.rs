//! Tests of several files together, in the program of the unit tests.

mod bit_flips;
mod glides;
mod image_upload;
mod link_faults;
mod log_60_days;
mod long_time;
pub(crate) mod model_check;
mod mutation;
mod session;
mod toy;
mod vault;
