//! Whether the glides of a surfacing depart from the vehicle's history: a Shiryaev–Roberts e-detector of the eight numbers.
//!
//! The history says that the numbers of a healthy surfacing are N(m, C). Its packet R, y with noise of level λ is then N(R m, V) with
//! V = λ 1 + R C R', and that of a vehicle of which number i has departed by a size that is N(0, 1) is N(R m, V + a a'), a = R e_i. With
//! r = y − R m the ratio of these likelihoods is the Bayes factor of the workbench,
//! ```text
//! ln B_i = ½ (a'V⁻¹r)² / (1 + a'V⁻¹a) − ½ ln(1 + a'V⁻¹a)        E B_i = 1 over healthy surfacings
//! S_i ← (S_i + 1) B_i        alarm: mean of S_i ≥ A; then all begin anew at 0
//! ```
//! Whatever came before, S less the number of surfacings is a martingale of healthy ones, so that the mean number of them to a false
//! alarm is at least A (optional stopping; Shin, Ramdas and Rinaldo 2022, "E-detectors"). That holds where healthy surfacings are as the
//! history has them, one independent of the other: a history of few dives is a guess of that. A factor that is cut off above stays
//! below 1 in the mean. Nothing steers by it.

use crate::NUMBERS;
use crate::dive::noise_level;
use crate::factor::{Factor, Line, WIDTH};
use crate::maths::exp;
use crate::packet::Packet;
use signals::root::sqrt;

/// Healthy surfacings to a false alarm, at least, in the mean.
pub const RUN_LENGTH: f32 = 300.0;
/// Largest exponent of a factor: e^25 in one surfacing is past any doubt.
const MOST: f32 = 25.0;
/// First bytes of a history as it is uploaded: "GHB1".
const MAGIC: [u8; 4] = *b"GHB1";
/// Numbers of a triangle.
const TRIANGLE: usize = NUMBERS * (NUMBERS + 1) / 2;
/// Bytes of a history as it is uploaded.
pub const HISTORY_BYTES: usize = 16 + 4 * (NUMBERS + TRIANGLE);

/// A vehicle's history: what its healthy surfacings say, in [`crate::SIZES`] beyond the constants on board.
///
/// 192 bytes, little endian: "GHB1", the CRC-32 of the constants that it counts from, the usual level of the noise, the mean, the rows of
/// the lower triangle L, each of one number more, and the CRC-32 of all bytes before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct History {
    /// Identity of the constants that it counts from ([`crate::Vehicle::id`]).
    pub vehicle_id: u32,
    /// Usual level of the noise, (m/s)².
    pub usual_level: f32,
    /// Mean.
    pub mean: [f32; NUMBERS],
    /// Lower triangle L: L L' is the covariance of a next healthy surfacing about the mean.
    pub spread: [[f32; NUMBERS]; NUMBERS],
}

impl History {
    /// Its bytes; none of one that no vehicle can have.
    #[must_use]
    pub fn encode(&self) -> Option<[u8; HISTORY_BYTES]> {
        let triangle = self.spread.iter().enumerate().flat_map(|(i, row)| row.iter().take(i.saturating_add(1)));
        let numbers = [self.usual_level].into_iter().chain(self.mean).chain(triangle.copied());
        let body = MAGIC.into_iter().chain(self.vehicle_id.to_le_bytes()).chain(numbers.flat_map(f32::to_le_bytes));
        let mut bytes = [0; HISTORY_BYTES];
        bytes.iter_mut().zip(body).for_each(|(to, byte)| *to = byte);
        let (body, sum) = bytes.split_last_chunk_mut::<4>()?;
        *sum = polar::crc32(body).to_le_bytes();
        self.is_sound().then_some(bytes)
    }

    /// Reads it; none of what is none, or damaged.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let (body, sum) = bytes.split_last_chunk::<4>()?;
        if bytes.len() != HISTORY_BYTES || polar::crc32(body) != u32::from_le_bytes(*sum) {
            return None;
        }
        let (words, []) = body.as_chunks::<4>() else { return None };
        let ([magic, id], numbers) = words.split_first_chunk::<2>()?;
        if *magic != MAGIC {
            return None;
        }
        let mut numbers = numbers.iter().map(|b| f32::from_le_bytes(*b));
        let mut out = Self { vehicle_id: u32::from_le_bytes(*id), usual_level: numbers.next()?, ..Self::NONE };
        out.mean.iter_mut().zip(&mut numbers).for_each(|(to, x)| *to = x);
        for (i, row) in out.spread.iter_mut().enumerate() {
            row.iter_mut().take(i.saturating_add(1)).for_each(|to| *to = numbers.next().unwrap_or(f32::NAN));
        }
        out.is_sound().then_some(out)
    }

    const NONE: Self = Self { vehicle_id: 0, usual_level: 0.0, mean: [0.0; NUMBERS], spread: [[0.0; NUMBERS]; NUMBERS] };

    /// Whether a vehicle can have it: a hundred sizes off, none is the one of these constants.
    fn is_sound(&self) -> bool {
        (1e-9..1.0).contains(&self.usual_level) && self.mean.iter().chain(self.spread.iter().flatten()).all(|x| x.abs() < 100.0)
    }
}

/// The detector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Detector {
    odds: [f32; NUMBERS],
}

impl Detector {
    /// Nothing seen yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { odds: [0.0; NUMBERS] }
    }

    /// Takes the packet of a surfacing; whether there is an alarm. Packets of other constants count nothing.
    pub fn take(&mut self, history: &History, packet: &Packet) -> bool {
        if history.vehicle_id != packet.vehicle_id {
            return false;
        }
        for (odds, factor) in self.odds.iter_mut().zip(factors(history, packet)) {
            *odds = (*odds + 1.0) * factor;
        }
        let (sum, most) = (self.odds.iter().sum::<f32>(), RUN_LENGTH * NUMBERS as f32);
        // What is no number, after a flipped bit, begins anew as well.
        if !(sum < most) {
            *self = Self::new();
        }
        sum >= most
    }
}

/// Bayes factors of the eight numbers.
#[must_use]
#[inline(never)]
pub fn factors(history: &History, packet: &Packet) -> [f32; NUMBERS] {
    // The root of V: F'F = λ 1 + (R L)(R L)'.
    let level = sqrt(noise_level(packet.scatter, packet.directions, Some(history.usual_level), packet.variance));
    let mut root = Factor::default();
    for k in 0..NUMBERS {
        let mut own = [0.0; NUMBERS];
        own.iter_mut().skip(k).take(1).for_each(|x| *x = level);
        for x in [own, times(&packet.lines, &column(&history.spread, k))] {
            let mut line = [0.0; WIDTH];
            line.iter_mut().zip(x).for_each(|(to, x)| *to = x);
            root.add(line);
        }
    }
    let mut left = column(&packet.lines, NUMBERS);
    left.iter_mut().zip(times(&packet.lines, &history.mean)).for_each(|(y, expected)| *y -= expected);
    let r = solved(&root, &left);
    let mut out = [0.0; NUMBERS];
    for (k, out) in out.iter_mut().enumerate() {
        let a = solved(&root, &column(&packet.lines, k));
        let (square, product) = (1.0 + dot(&a, &a), dot(&a, &r));
        let exponent = 0.5 * product * product / square;
        // What is no number says nothing.
        let sound = (0.0..1e20).contains(&exponent) && square < 1e20;
        *out = if sound { exp(if exponent < MOST { exponent } else { MOST }) / sqrt(square) } else { 1.0 };
    }
    out
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Column k of rows.
fn column<const N: usize>(rows: &[[f32; N]; NUMBERS], k: usize) -> [f32; NUMBERS] {
    rows.map(|row| row.get(k).copied().unwrap_or(0.0))
}

/// R x.
#[inline(never)]
fn times(lines: &[Line; NUMBERS], x: &[f32; NUMBERS]) -> [f32; NUMBERS] {
    lines.map(|line| dot(&line, x))
}

/// x of F'x = b.
#[inline(never)]
fn solved(root: &Factor, b: &[f32; NUMBERS]) -> [f32; NUMBERS] {
    let mut x = [0.0; NUMBERS];
    for (i, b) in b.iter().enumerate() {
        let above = root.0.iter().map(|row| row.get(i).copied().unwrap_or(0.0));
        let known: f32 = above.clone().zip(&x).take(i).map(|(f, x)| f * x).sum();
        let own = above.skip(i).take(1).sum::<f32>();
        if let Some(to) = x.get_mut(i) {
            *to = if own.abs() > 1e-15 { (b - known) / own } else { 0.0 };
        }
    }
    x
}
