//! Do we agree with the sea, and what is missing.

pub mod flight;

pub use flight::Flight;
