//! The line of a Slocum's science bay: a board in the bay reads the glider's sensors and writes its mission parameters.
//!
//! The vendor calls the program at the other end "extctl" and the board a backseat; the glider's own computer is the front seat. The
//! protocol is not published; what is known comes from public projects that use it (docs/backseat.md has the list), and where two of
//! them differ, both are taken.
//!
//! ```text
//! bytes ─► line ─► sentence ─► session ─► readings ─► SensorFrame ─► law ─► ActuatorCommand ─► orders ─► bytes
//!          checksum  type, fields  who may speak  range, rate, age                                  limits, units
//! ```
//!
//! | file | answers |
//! |---|---|
//! | [`number`] | decimal text to number and back, without a heap |
//! | [`mod@line`] | which bytes are a sentence |
//! | [`sentence`] | what a sentence says |
//! | [`base64`] | bytes of a file in a sentence |
//! | [`ini`] | the glider's list of sensors, both generations of it |
//! | [`sensors`] | the list we expect: names, units, ranges, rates |
//! | [`readings`] | what to believe of each sensor, and how old it is |
//! | [`seawater`] | density from conductivity, temperature and pressure |
//! | `list_check` | whether the glider's list is ours |
//! | [`orders`] | a command as mission parameters |
//! | `pace`, `voice` | when a step is due; what is said, and whether it arrives |
//! | `surfacing_report` | the report of a surfacing to the shore, and by which way |
//! | [`session`] | when to listen, when to speak, when the line is lost |
//!
//! Nothing here reads a clock, waits, allocates or panics; work per byte is bounded. Signs are those of [`signals`]; the glider's agree,
//! only its units differ (cc, inches, bar, inches of mercury).
//!
//! # Dependencies
//!
//! * `heapless`: lines of bounded length
//! * `libm`: degrees to metres
#![cfg_attr(not(test), no_std)]

pub mod base64;
pub mod ini;
pub mod line;
mod list_check;
pub mod number;
pub mod orders;
mod pace;
pub mod readings;
pub mod seawater;
pub mod sensors;
pub mod sentence;
pub mod session;
mod surfacing_report;
mod voice;

pub use orders::{Limits, Targets};
pub use sensors::{Generation, Pump, Sensor};
pub use session::{Law, Session, Setup, State};

#[cfg(test)]
mod tests;

/// What does not fit where it should go, is no block of a file, or must not be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unfit;
