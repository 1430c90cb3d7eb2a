//! The physics we believe: sections, wings, body, vehicle, steady glide, named effects.
//!
//! | file | answers |
//! |---|---|
//! | [`section`] | what the wing section does: eqs. 1–3, 7, 8 |
//! | [`lift_slope`] | lift-curve slope against aspect ratio: eqs. 4, 5, 6, 9 |
//! | [`body`] | the hull alone: eq. 10 |
//! | [`wing`] | the wings alone: eqs. 11, 12, 13 and the standard wing |
//! | [`rectangular`] | the rail wings: a rectangular plate with side-edge vortices, held against measured plates |
//! | [`drag`] | drag: eqs. 14, 15, 16, friction, zero-suction bound |
//! | [`interference`] | wing and hull together |
//! | [`geometry`] | a vehicle from its geometry, by parts |
//! | [`effects`] | a vehicle from coefficients, and every optional effect |
//! | [`added`] | effects on top of any vehicle |
//! | [`polar`] | who can be asked for lift and drag |
//! | [`mod@glide`] | which steady glide follows |
//!
//! Equation numbers are those of the source paper, "Hydrodynamic Implications for Submarine Launched Underwater
//! Gliders"; its misprints are corrected where they stand, with the printed form and why it fails. f64, SI, no
//! allocation, only `libm`.
//!
//! # Dependencies
//!
//! * `libm`: functions that give the same bits on every computer
#![cfg_attr(not(test), no_std)]

pub mod added;
pub mod body;
pub mod drag;
pub mod effects;
pub mod geometry;
pub mod glide;
pub mod interference;
pub mod lift_slope;
pub mod polar;
pub mod rectangular;
pub mod section;
pub mod separation;
pub mod wing;

pub use added::Added;
pub use effects::{Constants, Flow, ForceModel, LiftDrag};
pub use geometry::{Appendage, Breakdown, Geometry, GeometryPolar};
pub use polar::{BothWays, Polar};

#[cfg(test)]
mod tests;

/// |α| up to which the hull's cross-flow form is valid, rad (25°; paper sec. IV-A, from Fidler & Smith 1977).
pub const ALPHA_BODY_VALID_RAD: f64 = 0.436_332_312_998_582_4;

/// The worked example of CONTRIBUTING.md, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../../CONTRIBUTING.md")]
mod contributing {}
