//! The physics we believe: wings, body, vehicle, steady glide, named effects.
#![cfg_attr(not(test), no_std)]

pub mod effects;
pub mod glide;
pub mod polar;

pub use effects::{Constants, Flow, ForceModel, LiftDrag};
pub use polar::Polar;
