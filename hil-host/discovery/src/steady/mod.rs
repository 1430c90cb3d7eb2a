//! How well does a steady glide explain the vertical velocity that was measured?
//!
//! The oldest and simplest comparison of a glider with its model, and the one
//! with published figures to check ourselves against: at every sample that is
//! far from a turn, the force balance of a steady glide predicts the vertical
//! velocity; what is left is the error. Steps are added one by one (trim,
//! measured density, hull compressibility, thermal expansion, pitch zero) and
//! the error is watched as it falls.
//!
//! * [`glide`]: the force balance.
//! * [`samples`]: which samples are steady, and the observed vertical velocity.
//! * [`fit`]: least squares over named parameters.
//! * [`ladder`]: the steps, trained on one flight and tested on another.
//! * [`mod@held_out`]: which effects another flight asks for.
//! * [`identify`]: what these channels can and cannot tell.
//! * [`report`]: all of it for one flight.
//!
//! Not covered: turns and any inertia. A glider accelerates for 15–40 s after
//! every inflection, and this model is blind to it.

pub mod fit;
pub mod glide;
pub mod held_out;
pub mod identify;
pub mod ladder;
pub mod report;
pub mod samples;

pub use held_out::{HeldOut, held_out};
pub use report::{SteadyReport, steady_report};
