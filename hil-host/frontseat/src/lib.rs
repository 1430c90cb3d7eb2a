//! A simulated Slocum front seat: the glider's own computers at the other end of the backseat line.
//!
//! The board writes parameters, and everything between them and the motors is the front seat's: its cycle, its delays, its clips and
//! dead bands, its own mission with its own safety. What is known of it comes from public missions and sensor lists; what nobody
//! published is a switch ([`Switches`]) and the board has to live with every setting.
//!
//! ```text
//! plant ─sense─► sensors ─2 s─► SD lines ─► board ─► SW lines ─2 s─► parameters (f32) ─► behaviours ─► clip, dead band ─► plant
//!                                                                     abend > surface > yo, heading
//! ```
//!
//! | file | answers |
//! |---|---|
//! | [`mission`] | the mission's text, and what it says |
//! | [`behaviours`] | which behaviour commands what now |
//! | [`science`] | the computer at the line: sentences, files, delays |
//! | [`wire`] | bytes per second, and what goes wrong on the way |
//! | [`sensors`] | a frame of the plant in the glider's sensors and units |
//! | [`flight`] | one flight: plant, front seat and board together |
//! | [`board`] | the board: the controller built for this computer, or a real one on a port |
//!
//! Left out: the vendor's autoballast, its behaviours other than those named, its modems and its log files.
//!
//! # Dependencies
//!
//! * `serialport`, `embedded-io`: the line to a backseat
//! * `heapless`: lines of it
//! * `gsw`: density of sea water (TEOS-10)
//! * `rand`, `rand_chacha`: noise that a seed repeats
//! * `anyhow`: errors for a person

#![allow(clippy::disallowed_methods)] // host only: nothing here runs on the target

pub mod behaviours;
pub mod board;
pub mod flight;
pub mod measured;
pub mod mission;
mod other_end;
pub mod science;
pub mod sensors;
pub mod wire;

#[cfg(test)]
mod tests;

/// Flight cycle, s: mean of 65,000 single cycles in public logs.
pub const CYCLE_S: f64 = 4.009;

/// What a front seat does where no public source says it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches {
    /// A write to an index that is not in the file.
    pub bad_index: OnBadWrite,
    /// A write to a sensor that the glider sends.
    pub input_write: OnBadWrite,
    /// Surfaces when the backseat is silent for so many seconds.
    pub silence_s: Option<u32>,
    /// A written file needs `FC` to be there.
    pub needs_close: bool,
}

/// Answer to a write that makes no sense.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnBadWrite {
    /// Nothing.
    #[default]
    Ignore,
    /// `ER`.
    Error,
    /// It is taken.
    Take,
}
