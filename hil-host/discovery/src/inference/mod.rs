//! Fits a hypothesis and weighs it: initial guess, Gauss–Newton, posterior, evidence.

pub(crate) mod discrepancy_size;
pub mod estimate;
pub mod evidence;
pub mod gauss_newton;
pub mod initial_guess;
pub mod linear;
pub mod numeric;
pub mod posterior;
pub mod projected_columns;
pub(crate) mod unknowns;
