//! Which message moves the controller: bytes in, one step, bytes out.
//!
//! [`Helm`] is the one piece of code between the line and the law. The board
//! image and the host-built seats run it alike, so equal bytes in give equal
//! bytes out wherever it runs. It touches no pin, no clock and no log: time
//! comes with the frames, flash comes through [`Storage`], and whoever calls
//! it writes down what it answered.
//!
//! ```text
//!                Begin ok                 Sensor
//!   ┌──────┐ ───────────────► ┌───────┐ ─────────► ┌────────┐  phase Done   ┌──────┐
//!   │ Idle │                  │ Armed │            │ Flying │ ────────────► │ Done │
//!   └──────┘ ◄─────────────── └───────┘            └────────┘               └──────┘
//!       ▲         Recall                                │ phase Safe            │ Hello, Begin
//!       │                                               ▼                       ▼
//!       │ Recovered (at the surface)               ┌────────┐                 Armed
//!       └───────────────────────────────────────── │  Safe  │ ◄── reset during a mission
//!                                                  └────────┘
//! ```
//!
//! - A frame is stepped once. The same `seq` again is answered again from
//!   memory; an older one, or one too far ahead, is counted and dropped.
//! - What does not belong to the state is refused by name, never half done.
//! - A mission needs a fresh hello before it: a late copy of an old Begin
//!   cannot send a vehicle down again.
//! - SAFE is left only by [`signals::ToBoard::Recovered`], at the surface.
//! - Work per byte and per message is bounded; nothing here waits.
#![cfg_attr(not(test), no_std)]

pub mod objects;
pub mod session;
pub mod silence;
pub mod storage;
mod upload;
pub mod vault;

pub use session::{Boot, Helm, Seat};
pub use storage::{Content, Kept, MAX_OBJECT, RamStorage, Storage};
pub use vault::{Mark, Vault};
