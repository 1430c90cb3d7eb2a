//! The summary of the glides of one surfacing as bytes.
//!
//! Bytes and units: "The packet of the glides" in `docs/backseat.md`; the sizes of R are [`crate::SIZES`].
//!
//! The message that carries it ([`signals`](../signals/surfacing/index.html)) has a CRC-32 over all.

use crate::NUMBERS;
use crate::factor::{Line, WIDTH};

/// Bytes of a packet.
pub const PACKET_BYTES: usize = 109;
/// Numbers of R and y.
const COUNT: usize = NUMBERS * (NUMBERS + 1) / 2 + NUMBERS;
/// Largest mantissa.
const LARGEST: f32 = 2047.0;
const EXPONENTS_AT: usize = 35;
const NUMBERS_AT: usize = EXPONENTS_AT + NUMBERS;

const _: () = assert!(NUMBERS_AT + COUNT / 2 * 3 == PACKET_BYTES, "two numbers in three bytes");

/// What the glides of one surfacing say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Packet {
    /// Identity of the vehicle's constants.
    pub vehicle_id: u32,
    /// Time of the first row, s.
    pub start_s: u32,
    /// From the first to the last row, s.
    pub duration_s: u32,
    /// Rows that count.
    pub rows: u16,
    /// Of these in climbs.
    pub climbing: u16,
    /// Rows without a steady glide, or outliers.
    pub refused: u16,
    /// Blocks.
    pub blocks: u8,
    /// Directions of blocks in the scatter; four of them are lost to the fit.
    pub directions: u16,
    /// Scatter of the blocks about the best fit, (m/s)².
    pub scatter: f32,
    /// Variance of the residuals, (m/s)².
    pub variance: f32,
    /// Mean of |pitch|, rad.
    pub pitch_rad: f32,
    /// Mean of |roll|, rad.
    pub roll_rad: f32,
    /// Half the way of the ballast between dive and climb, m³.
    pub drive_m3: f32,
    /// Deepest row, Pa.
    pub deepest_pa: f32,
    /// R and y: row i is 0 before its place i.
    pub lines: [Line; NUMBERS],
}

/// Why bytes are no packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// A number that no dive can give.
    Content,
}

/// The value in steps, within 16 bits.
fn steps(value: f32, unit: f32) -> [u8; 2] {
    ((value / unit + 0.5) as u16).to_le_bytes()
}

/// Scale of a row with this exponent.
fn scale(exponent: u8) -> f32 {
    f32::from_bits((u32::from(exponent) + 1) << 23)
}

impl Packet {
    /// The bytes; none where a number is not finite, or too large.
    #[must_use]
    pub fn encode(&self) -> Option<[u8; PACKET_BYTES]> {
        if !self.is_sound() {
            return None;
        }
        let mut exponents = [0; NUMBERS];
        let mut mantissas = [0_u16; COUNT];
        let mut places = mantissas.iter_mut();
        for ((i, line), exponent) in self.lines.iter().enumerate().zip(&mut exponents) {
            let largest = line.iter().skip(i).fold(0.0, |most, x: &f32| if x.abs() > most { x.abs() } else { most });
            *exponent = (largest.to_bits() >> 23) as u8;
            let unit = scale(*exponent) / LARGEST;
            for x in line.iter().skip(i) {
                let half = if *x < 0.0 { -0.5 } else { 0.5 };
                *places.next()? = ((x / unit + half) as i16) as u16 & 0xfff;
            }
        }
        let deepest = steps(self.deepest_pa, 1e3);
        let head = self
            .vehicle_id
            .to_le_bytes()
            .into_iter()
            .chain(self.start_s.to_le_bytes())
            .chain(((self.duration_s / 10).min(u32::from(u16::MAX)) as u16).to_le_bytes())
            .chain([self.rows, self.climbing, self.refused].into_iter().flat_map(u16::to_le_bytes))
            .chain([self.blocks])
            .chain(self.directions.to_le_bytes())
            .chain(self.scatter.to_le_bytes())
            .chain(self.variance.to_le_bytes())
            .chain(steps(self.pitch_rad, 1e-4).into_iter().chain(steps(self.roll_rad, 1e-4)))
            .chain(steps(self.drive_m3, 1e-7).into_iter().chain(deepest))
            .chain(exponents);
        let pairs = mantissas.as_chunks::<2>().0.iter();
        let body = pairs.flat_map(|[a, b]| [*a as u8, (a >> 8) as u8 | (b << 4) as u8, (b >> 4) as u8]);
        let mut bytes = [0; PACKET_BYTES];
        bytes.iter_mut().zip(head.chain(body)).for_each(|(to, byte)| *to = byte);
        Some(bytes)
    }

    /// Reads them.
    ///
    /// # Errors
    /// A number that no dive can give.
    pub fn decode(bytes: &[u8; PACKET_BYTES]) -> Result<Self, Refused> {
        let mut rest = bytes.as_slice();
        let mut out = Self {
            vehicle_id: u32::from_le_bytes(take(&mut rest)?),
            start_s: u32::from_le_bytes(take(&mut rest)?),
            duration_s: u32::from(u16::from_le_bytes(take(&mut rest)?)) * 10,
            rows: u16::from_le_bytes(take(&mut rest)?),
            climbing: u16::from_le_bytes(take(&mut rest)?),
            refused: u16::from_le_bytes(take(&mut rest)?),
            blocks: u8::from_le_bytes(take(&mut rest)?),
            directions: u16::from_le_bytes(take(&mut rest)?),
            scatter: f32::from_le_bytes(take(&mut rest)?),
            variance: f32::from_le_bytes(take(&mut rest)?),
            pitch_rad: f32::from(u16::from_le_bytes(take(&mut rest)?)) * 1e-4,
            roll_rad: f32::from(u16::from_le_bytes(take(&mut rest)?)) * 1e-4,
            drive_m3: f32::from(u16::from_le_bytes(take(&mut rest)?)) * 1e-7,
            deepest_pa: f32::from(u16::from_le_bytes(take(&mut rest)?)) * 1e3,
            lines: [[0.0; WIDTH]; NUMBERS],
        };
        let exponents: [u8; NUMBERS] = take(&mut rest)?;
        let mut numbers = rest.as_chunks::<3>().0.iter().flat_map(|[a, b, c]| {
            let first = u16::from(*a) | u16::from(*b & 0xf) << 8;
            let second = u16::from(*b >> 4) | u16::from(*c) << 4;
            // Twelve bits with a sign: as the upper ones of sixteen.
            [first, second].map(|bits| (bits << 4) as i16 >> 4)
        });
        for ((i, line), exponent) in out.lines.iter_mut().enumerate().zip(exponents) {
            // Larger than 2^60 no row can be.
            let unit = if exponent < 187 { scale(exponent) / LARGEST } else { f32::NAN };
            for x in line.iter_mut().skip(i) {
                let mantissa = numbers.next().ok_or(Refused::Content)?;
                *x = if mantissa < -2047 { f32::NAN } else { f32::from(mantissa) * unit };
            }
        }
        if out.is_sound() { Ok(out) } else { Err(Refused::Content) }
    }

    /// Whether a dive can give it.
    fn is_sound(&self) -> bool {
        let positive = [self.scatter, self.variance, self.pitch_rad, self.roll_rad, self.deepest_pa];
        positive.iter().all(|x| (0.0..1e12).contains(x))
            && self.drive_m3.abs() < 0.1
            && self.lines.iter().flatten().all(|x| x.abs() < 1e15)
            && self.climbing <= self.rows
            && (self.blocks == u8::MAX || self.directions <= 4 * u16::from(self.blocks))
    }
}

/// The next bytes.
fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], Refused> {
    let (taken, left) = rest.split_first_chunk::<N>().ok_or(Refused::Content)?;
    *rest = left;
    Ok(*taken)
}
