//! Do we agree with the sea, and what is missing: flights and vehicles are read, a model of the vehicle is run on the measured
//! inputs, its residual is whitened, and every named effect is asked whether it explains what remains.

pub mod dynamics;
pub mod export;
pub mod flight;
pub mod import;
pub mod metric;
pub mod prepare;
pub mod read;
pub mod steady;
pub mod vehicle;
pub mod vehicle_file;

pub use flight::Flight;
pub use vehicle::Vehicle;
