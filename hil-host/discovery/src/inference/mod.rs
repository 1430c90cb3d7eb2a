//! Fits a hypothesis and weighs it: start, Gauss-Newton, evidence.

pub(crate) mod discrepancy_size;
pub mod estimate;
pub mod evidence;
pub mod gauss_newton;
pub mod initial_guess;
pub mod linear;
pub mod offer;
pub mod posterior;
pub(crate) mod unknowns;
pub(crate) mod wave_train;
