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

use heapless::Vec;
use signals::Wings;

use crate::Table;

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

/// Why a table cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeError {
    /// Number of samples outside [`MIN_POINTS`]..=[`MAX_POINTS`].
    Points(usize),
    /// The written table would not be accepted by [`Table::parse`].
    Refused(TableError),
}

/// Force coefficients at one grid point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Lift coefficient at this α ≥ 0.
    pub cl: f32,
    /// Drag coefficient at this α ≥ 0.
    pub cd: f32,
}

/// What a table says about itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// Wing set.
    pub wings: Wings,
    /// CRC-32 of the vehicle file.
    pub vehicle_id: u32,
    /// CRC-32 of the flight the fit used, 0 when nothing was fitted.
    pub fit_id: u32,
    /// Reference area of the coefficients, m².
    pub area_m2: f32,
    /// α of the last grid point, rad.
    pub alpha_max_rad: f32,
    /// α of (L/D)max, rad.
    pub best_alpha_rad: f32,
    /// (L/D)max.
    pub best_l_over_d: f32,
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

/// Writes a table. `samples` are equidistant in α from 0 to `spec.alpha_max_rad`.
///
/// The result has been parsed once: what cannot be flown is never written.
///
/// # Errors
/// Too few or too many samples, or a value no controller should fly.
pub fn encode(spec: &Spec, samples: &[Sample]) -> Result<Vec<u8, MAX_TABLE>, EncodeError> {
    let points = EncodeError::Points(samples.len());
    if !(MIN_POINTS..=MAX_POINTS).contains(&samples.len()) {
        return Err(points);
    }
    let mut out = Vec::new();
    // Cannot run full: MAX_POINTS follows from MAX_TABLE.
    let mut put = |bytes: &[u8]| out.extend_from_slice(bytes).map_err(|_| points);
    put(&[FORMAT, wings_code(spec.wings), samples.len() as u8, 0])?;
    put(&spec.vehicle_id.to_le_bytes())?;
    put(&spec.fit_id.to_le_bytes())?;
    for value in [spec.area_m2, spec.alpha_max_rad, spec.best_alpha_rad, spec.best_l_over_d] {
        put(&value.to_le_bytes())?;
    }
    for sample in samples {
        put(&sample.cl.to_le_bytes())?;
        put(&sample.cd.to_le_bytes())?;
    }
    let id = crc32(&out);
    out.extend_from_slice(&id.to_le_bytes()).map_err(|_| points)?;
    Table::parse(&out, spec.wings).map_err(EncodeError::Refused)?;
    Ok(out)
}
