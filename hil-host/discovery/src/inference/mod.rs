//! Fits a hypothesis and weighs it: start, Gauss-Newton, evidence.

pub mod estimate;
pub mod evidence;
pub mod gauss_newton;
pub mod initial_guess;
pub(crate) mod wave_train;
