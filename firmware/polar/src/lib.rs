//! What glide follows from angle of attack, as flown: the compact L/D table.
//!
//! The model of the vehicle (f64, on a laptop) is sampled into one table per
//! wing set; the controller sees nothing else of it. A log that names a
//! table's id is therefore fully explained by that table.
//!
//! | file | answers |
//! |---|---|
//! | [`mod@format`] | which bytes a table is: header, grid, CRC-32 |
//! | [`mod@encode`] | writes one |
//! | [`table`] | lift and drag between the grid points |
//! | `generated/` | the tables built into the firmware (made by `glider table`, do not edit) |
//!
//! Valid range: |α| up to the table's own [`Table::alpha_max_rad`]; beyond it
//! look-ups are clamped, never extrapolated. Not covered: dependence on speed,
//! roll or age of the hull (those belong to a newer table), moments.
//!
//! # Dependencies
//!
//! * `crc`: identity of a table
//! * `heapless`: its rows
#![cfg_attr(not(test), no_std)]

pub mod encode;
pub mod format;
pub mod generated;
pub mod table;

pub use encode::{EncodeError, Spec, encode};
pub use format::{FORMAT, MAX_POINTS, MAX_TABLE, MIN_POINTS, Sample, TableError, crc32};
pub use table::{Coefficients, Table};

use signals::Wings;

/// The table built into the firmware for a wing set.
///
/// # Errors
/// Never for the committed bytes (a test parses both); the type says that even
/// flash is checked before it is flown.
pub fn builtin(wings: Wings) -> Result<Table<'static>, TableError> {
    match wings {
        Wings::Standard => Table::parse(generated::STANDARD, wings),
        Wings::LowAspectRatio => Table::parse(generated::LOW_ASPECT_RATIO, wings),
    }
}
