//! Which message moves the controller: bytes in, one step, bytes out.
//!
//! [`Helm`] is the one piece of code between the line and the law. The board
//! image and the host-built seats run it alike, so equal bytes in give equal
//! bytes out wherever it runs. It touches no pin, no clock and no log: time
//! comes with the frames, UTC for records is set and reckoned on ([`utc`]),
//! flash comes through [`Storage`], and whoever calls it writes down what it
//! answered.
//!
//! ```text
//!            Begin, Launch             a frame
//!   ┌──────┐ ───────────────► ┌───────┐ ─────────► ┌────────┐  phase Done   ┌──────┐
//!   │ Idle │                  │ Armed │            │ Flying │ ────────────► │ Done │
//!   └──────┘ ◄─────────────── └───────┘            └────────┘               └──────┘
//!       ▲         Recall                                │ phase Safe            │ Hello, Begin
//!       │                                               ▼                       ▼
//!       │ Recovered, and seen afloat               ┌────────┐ ──► Flying       Armed
//!       └───────────────────────────────────────── │  Safe  │ ◄── reset or damaged memory during a mission
//!                                                  └────────┘
//! ```
//!
//! - A frame is stepped once. The same `seq` again is answered again from
//!   memory; an older one, or one too far ahead, is counted and refused.
//! - What does not belong to the state is refused by name, never half done.
//! - What changes something carries the session that the last hello was given:
//!   what was recorded in another one does nothing. A hello changes nothing of
//!   a flight under way; its own frames go on in the session that began it.
//! - A mission needs a fresh hello before it: a late copy of an old Begin
//!   cannot send a vehicle down again.
//! - SAFE is left by [`signals::ToBoard::Recovered`] of a vehicle that is
//!   seen [`afloat`], or by the law itself: afloat, after a glitch, twice in a mission
//!   at most, and never as a backseat.
//! - An image of the firmware is uploaded on deck, past the RAM ([`images`]); one on trial launches nothing.
//! - No upload crosses the [`limits`] of the vehicle's class.
//! - Mission, state, configuration and table are sealed by a sum between two
//!   steps; where it does not match, a mission goes on in SAFE.
//! - Work per byte and per message is bounded; nothing here waits.
//!
//! # Dependencies
//!
//! * `embedded-storage`: flash behind a trait
//! * `heapless`, `postcard`: records and messages of bounded length
#![cfg_attr(not(test), no_std)]

pub mod afloat;
pub mod black_box;
mod boot;
pub mod deck;
mod flight;
pub mod glides;
pub mod images;
pub mod limits;
mod mark;
pub mod objects;
mod seal;
pub mod session;
pub mod silence;
pub mod storage;
pub mod thinning;
mod upload;
pub mod utc;
pub mod vault;

pub use boot::Boot;
pub use images::WithImages;
pub use mark::{Mark, Seat};
pub use session::Helm;
pub use storage::{Ask, Content, Kept, MAX_OBJECT, RamStorage, Storage};
pub use utc::UtcClock;
pub use vault::Vault;

#[cfg(test)]
extern crate self as helm; // the name that the fuzzer, an example, knows
#[cfg(test)]
mod tests;
