//! The science bay's loop, on whatever chip it runs: bytes of the line or
//! readings of its own parts in, one step of [`helm`], bytes or motors out.
//!
//! | file | question |
//! |---|---|
//! | [`run`] | what is done when: one pass of the loop |
//! | [`backseat_role`] | the same as a Slocum's backseat: the glider's line for parts |
//! | [`parts`] | what is measured, and what is moved |
//! | [`antenna`] | whether there is a fix |
//! | [`compass`] | which attitude holds |
//! | [`kept_utc`] | what time it is after a reset |
//! | [`radio`] | what the shore is told at a surfacing |
//! | [`strokes`] | whether pump and battery mass move, on deck |
//! | [`supplies`] | which part has its supply when |
//! | `trips` | what becomes of a motor bridge that has switched itself off |
//! | [`rudder`] | the fin's servo |
//! | [`scale`] | what the configuration means at pots and motors |
//!
//! Pins, buses and ports come as embedded-hal and embedded-io traits, time and
//! what outlives a reset through [`run::Outside`]. The board image wires them
//! to the chip; the parts seat on a laptop wires them to models of the same
//! parts, registers and all, so that what flies there is this code.
//!
//! # Dependencies
//!
//! * `embedded-hal`, `embedded-io`: pins, buses and serial lines behind traits
#![cfg_attr(not(test), no_std)]

pub mod antenna;
pub mod backseat_role;
mod bytes;
pub mod compass;
pub mod kept_utc;
pub mod parts;
pub mod radio;
pub mod rudder;
pub mod run;
pub mod scale;
pub mod strokes;
pub mod supplies;
mod trips;

pub use backseat_role::{BackseatLaw, RunBackseat};
use bytes::next_byte;
pub use kept_utc::KeptUtc;
pub use parts::{Fitted, Parts, Wiring};
pub use run::{Outside, Run, Woken};
pub use supplies::SupplyPins;
