//! Fits a hypothesis and weighs it: start, Gauss-Newton, evidence.

pub(crate) mod discrepancy_size;
pub mod estimate;
pub mod evidence;
pub mod gauss_newton;
pub mod initial_guess;
pub mod offer;
pub(crate) mod wave_train;
