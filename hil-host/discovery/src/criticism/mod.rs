//! What the best hypothesis leaves unexplained, and whether its names can be believed.

mod against_usual;
pub(crate) mod held_out;
pub mod law;
pub mod localise;
pub(crate) mod periodogram;
pub mod residual_tests;
pub mod unmodelled;
