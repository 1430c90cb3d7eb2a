//! Which bytes a table is.
//!
//! All numbers little-endian, IEEE 754. Not self-describing: [`FORMAT`] names
//! this layout, and another layout gets another number.
//!
//! | offset | type | meaning | unit |
//! |---|---|---|---|
//! | 0 | u8 | [`FORMAT`] | – |
//! | 1 | u8 | wing set: 0 standard, 1 low aspect ratio | – |
//! | 2 | u8 | number of grid points N, 5..=58 | – |
//! | 3 | u8 | reserved, 0 | – |
//! | 4 | u32 | vehicle id: CRC-32 of the vehicle file | – |
//! | 8 | u32 | fit id: CRC-32 of the flight the fit used, 0: no fit | – |
//! | 12 | f32 | reference area of the coefficients | m² |
//! | 16 | f32 | α of the last grid point; the grid is uniform from 0 | rad |
//! | 20 | f32 | α of (L/D)max | rad |
//! | 24 | f32 | (L/D)max | – |
//! | 28 | N × (f32, f32) | C_L, C_D at the grid points | – |
//! | 28 + 8 N | u32 | CRC-32 (ISO-HDLC) of everything before it: the table's id | – |
//!
//! Plain f32 values cost more flash than scaled integers (8 against 4 bytes a
//! point), but they need no scale factors, no rounding budget and print as
//! they are; 512 bytes still hold 58 points, 0.44° apart on a 25° table.

use signals::Wings;

/// Number of this layout.
pub const FORMAT: u8 = 1;

/// Largest table, bytes.
pub const MAX_TABLE: usize = 512;

/// Fewest grid points a table may have: the look-up uses four neighbours.
pub const MIN_POINTS: usize = 5;

/// Most grid points that fit into [`MAX_TABLE`].
pub const MAX_POINTS: usize = (MAX_TABLE - HEADER - 4) / POINT;

/// Bytes before the first grid point.
pub(crate) const HEADER: usize = 28;

/// Bytes of one grid point.
pub(crate) const POINT: usize = 8;

/// Largest |α| any table may claim, rad (60°): beyond it no model of this project speaks.
pub(crate) const ALPHA_CEILING_RAD: f32 = 1.05;

/// Why bytes are not a usable table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableError {
    /// Shorter than its header says, or longer than [`MAX_TABLE`].
    Length,
    /// Another format version.
    Format(u8),
    /// CRC does not match.
    Crc,
    /// For the other wings.
    Wings,
    /// A value is not physical.
    Value,
}

/// Force coefficients at one grid point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Lift coefficient at this α ≥ 0.
    pub cl: f32,
    /// Drag coefficient at this α ≥ 0.
    pub cd: f32,
}

/// CRC-32 (ISO-HDLC: the one of zip and Ethernet) of bytes.
///
/// Bit by bit, without a table: it runs once per start over half a kilobyte.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32, crc::NoTable> = crc::Crc::<u32, crc::NoTable>::new(&crc::CRC_32_ISO_HDLC);
    CRC.checksum(bytes)
}

/// Number of a wing set in the header.
pub(crate) fn wings_code(wings: Wings) -> u8 {
    match wings {
        Wings::Standard => 0,
        Wings::LowAspectRatio => 1,
    }
}
