//! What crosses a border: messages, their units and their bytes.
//!
//! Every other room speaks through these types; this room sees none of them.
//!
//! | message | direction | rate | carries |
//! |---|---|---|---|
//! | [`SensorFrame`] | host or sensors → controller | one per control cycle (4 s default) | what is measured, each reading with its age |
//! | [`Answer`] | controller → host or actuators | one per frame | the command, and why |
//! | [`Mission`] | host → controller | before a flight | what to fly |
//! | [`ToBoard`] / [`ToHost`] | over the serial line | – | everything that may cross the line |
//! | [`Request`] / [`Reply`] | around each of them | – | session, and which request is answered |
//!
//! Axes and signs, stated once: body x forward, y starboard, z down; depth and
//! pressure positive down; pitch positive nose up; angle of attack positive
//! when the flow comes from below the nose (a diving glider has α > 0);
//! ballast positive when the vehicle displaces more water (buoyant); battery
//! position positive forward (forward pitches the nose down); fin positive
//! turns to starboard. SI units only; degrees, cc and dbar live in parsers and
//! printers.
//!
//! # Dependencies
//!
//! * `serde`, `postcard`: the bytes of every message
//! * `crc`: CRC-32 of a frame
//! * `heapless`: lists of bounded length
#![cfg_attr(not(test), no_std)]

pub mod autopsy;
pub mod frame;
pub mod image;
pub mod link;
pub mod messages;
pub mod mission;
pub mod preflight;
pub mod root;
pub mod surfacing;
pub mod time;

pub use frame::{Abort, ActuatorCommand, Answer, Flags, Phase, Reading, SensorFrame, Surface, Switch, Trace, Weight};
pub use image::{Image, Older, Standing};
pub use link::{Receiver, WIRE_VERSION, WireError, decode, encode};
pub use messages::{Counters, Limit, Manifest, Object, Refusal, Reply, Request, ToBoard, ToHost};
pub use mission::{Goal, Leg, MAX_LEGS, Mission, MissionError, Wings};
pub use preflight::{Preflight, Strap, Stroke};
pub use surfacing::{Evidence, Surfacing};
pub use time::{Clock, Micros, TimeSource, Timebase, Utc};

#[cfg(test)]
mod tests;
