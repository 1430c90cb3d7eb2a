//! The forward model: parameters, equations of motion, their integration over the measured inputs.

pub mod branch;
pub mod dynamics;
pub mod integrator;
pub mod internal_wave;
pub mod parameters;
pub mod reported_numbers;
pub mod sensor_findings;
