//! The world we pretend is true: a glider in the water, its sensors and
//! actuators, what it hides from the models, and what goes wrong.
//!
//! This room shares no code and no form of law with the models it judges: the
//! force law is in normal and axial components ([`forces`](vehicle::Aero)),
//! the motion is the full unsteady one.
//!
//! ```
//! use plant::{Scenario, World};
//! use signals::{ActuatorCommand, Wings};
//!
//! let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
//! let dive = ActuatorCommand { ballast_m3: -230e-6, battery_mass_m: -0.008, ..Default::default() };
//! for _ in 0..30 {
//!     let frame = world.sense(); // to the controller
//!     assert!(frame.depth_m.accept(-5.0..=100.0, 10_000).is_some());
//!     world.advance(&dive, 4.0); // its answer
//! }
//! let truth = world.truth();
//! assert!(truth.depth_m > 5.0 && truth.pitch_rad < -0.2, "{truth:?}");
//! ```
//!
//! Glossary: *scenario* – all that defines a world; *effect* – a truth that the
//! nominal model lacks; *fault* – something that breaks; *truth* – the state
//! that only judges see.
//!
//! # Dependencies
//!
//! * `rand`, `rand_chacha`, `rand_distr`: noise that a seed repeats
//! * `gsw`: density of sea water (TEOS-10)
//! * `libm`: the same bits on every computer
//! * `csv`, `serde`, `serde_json`, `toml`: trials and truth files
#![allow(clippy::disallowed_methods)] // host only: nothing here runs on the target

pub mod actuators;
mod bounds;
mod dynamics;
pub mod effects;
pub mod faults;
mod forces;
pub mod ocean;
pub mod replay;
mod scenario;
pub mod sensors;
pub mod trials;
mod truth;
pub mod vehicle;
mod world;

pub use effects::{Effect, EffectKind};
pub use faults::Fault;
pub use scenario::{Scenario, Start};
pub use truth::{Energy, Truth};
pub use vehicle::Vehicle;
pub use world::{BestGlide, World};

#[cfg(test)]
mod tests;
