//! What a vehicle's steady glides say of its eight numbers: a square-root information filter, and its packet of 109 bytes.
//!
//! The workbench judges a dive by a summary: R (triangular) and y, with R'R the information about eight numbers of the vehicle and R'y
//! what the dive says of them (docs/calibrate-and-timeline.md, "History"). Here the same summary is made on board, row by row, in f32 and in bounded
//! memory, so that a surfacing can send it. Nothing here steers.
//!
//! | file | answers |
//! |---|---|
//! | [`rows`] | cycles in, steady rows of 40 s out: no turn, no pump stroke, no sea bed, no old sensor |
//! | [`glide`] | the steady glide at a row by the law's own table, and its derivatives by the eight numbers |
//! | [`factor`] | triangular factors: Givens rotations, principal directions |
//! | [`dive`] | rows into blocks, blocks into the summary and the level of its noise |
//! | [`detector`] | whether the summary departs from the vehicle's history |
//! | [`packet`] | the summary as bytes: 12 bits a number |
//!
//! Valid range: that of the table, |pitch| 0.14 to 1.1 rad, 0.02 m/s up or down and more. No heap, no panic, loops of fixed length; what
//! is not finite is refused where it comes in.
#![no_std]

pub mod detector;
pub mod dive;
pub mod factor;
pub mod glide;
mod maths;
pub mod packet;
pub mod rows;

pub use detector::{Detector, History};
pub use dive::Dives;
pub use glide::Vehicle;
pub use packet::{PACKET_BYTES, Packet};
pub use rows::Cycle;

/// How many numbers a vehicle is judged by: drag level, ballast offset, compressibility, thermal expansion, pitch offset, pitch scale,
/// ballast scale, lift slope.
pub const NUMBERS: usize = 8;

/// One standard deviation of what a vehicle file is usually wrong by, of each number: ln, kg, 1/Pa, 1/K, rad, ln, ln, ln. Guesses of the
/// workbench's catalogue (a test there compares them), good to a factor of two.
pub const SIZES: [f32; NUMBERS] = [0.3, 0.1, 3e-10, 6e-5, 0.03, 0.1, 0.06, 0.2];
