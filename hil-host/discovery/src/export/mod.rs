//! Flights written for others, and for ourselves.
//!
//! * [`csv`]: the project's own flight format.

pub mod csv;
