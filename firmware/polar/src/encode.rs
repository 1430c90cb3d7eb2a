//! Writes a table in the layout of [`crate::format`].

use crate::Table;
use crate::format::{FORMAT, MAX_POINTS, MAX_TABLE, MIN_POINTS, Sample, TableError, crc32, wings_code};
use heapless::Vec;
use signals::Wings;

/// Why a table cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeError {
    /// Number of samples outside [`MIN_POINTS`]..=[`MAX_POINTS`].
    Points(usize),
    /// The written table would not be accepted by [`Table::parse`].
    Refused(TableError),
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
