//! Triangular factors of least squares, updated line by line.

use crate::NUMBERS;
use signals::root::sqrt;

/// Columns: the numbers, and what is said.
pub const WIDTH: usize = NUMBERS + 1;

/// A line of least squares: coefficients of the numbers, and what their sum should be.
pub type Line = [f32; WIDTH];

/// Most sweeps of Jacobi's rotations; they end with one that turns nothing.
const SWEEPS: usize = 6;
/// Share of the largest information below which a direction is rounding.
const ROUNDING: f32 = 1e-9;
/// Lines shorter than this (squared) say nothing.
const NOTHING: f32 = 1e-20;

/// Upper triangle R of all lines so far, what is said in its last column, the root of the misfit in its last corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Factor(pub [Line; WIDTH]);

impl Factor {
    /// Takes a line by Givens' rotations. Lines that are not finite must not come here.
    #[inline(never)]
    pub fn add(&mut self, mut line: Line) {
        for (i, row) in self.0.iter_mut().enumerate() {
            let (Some(&p), Some(&x)) = (row.get(i), line.get(i)) else { return };
            let length = sqrt(p * p + x * x);
            if !(length > 0.0) {
                continue;
            }
            let (c, s) = (p / length, x / length);
            for (a, b) in row.iter_mut().zip(&mut line).skip(i) {
                (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
            }
        }
    }

    /// Takes all lines of another one.
    pub fn add_all(&mut self, lines: &[Line]) {
        for line in lines {
            self.add(*line);
        }
    }

    /// Most probable numbers where each is 0 with the variance `level` beside the lines.
    #[must_use]
    pub fn most_probable(&self, level: f32) -> [f32; NUMBERS] {
        let mut with = *self;
        for i in 0..NUMBERS {
            let mut line = [0.0; WIDTH];
            if let Some(x) = line.get_mut(i) {
                *x = sqrt(level);
            }
            with.add(line);
        }
        let mut d = [0.0; NUMBERS];
        for (i, row) in with.0.iter().take(NUMBERS).enumerate().rev() {
            let known: f32 = row.iter().zip(&d).skip(i.saturating_add(1)).map(|(r, d)| r * d).sum();
            let (Some(&own), Some(&says), Some(d)) = (row.get(i), row.last(), d.get_mut(i)) else { continue };
            *d = if own.abs() > 1e-15 { (says - known) / own } else { 0.0 };
        }
        d
    }

    /// Sum of the squares that numbers leave of all lines.
    #[must_use]
    pub fn misfit(&self, d: &[f32; NUMBERS]) -> f32 {
        let left = |row: &Line| row.last().copied().unwrap_or(0.0) - row.iter().zip(d).map(|(r, d)| r * d).sum::<f32>();
        self.0.iter().map(|row| left(row) * left(row)).sum()
    }

    /// The same information in lines that are orthogonal to each other, and the squares of their lengths: the directions of the numbers
    /// that it is about (one-sided rotations of Jacobi and Hestenes). The line of the misfit stays out.
    #[must_use]
    pub fn directions(&self) -> [(f32, Line); NUMBERS] {
        let mut lines = [(0.0, [0.0; WIDTH]); NUMBERS];
        lines.iter_mut().zip(&self.0).for_each(|(to, row)| *to = (0.0, *row));
        for _ in 0..SWEEPS {
            let mut turned = false;
            for (square, line) in &mut lines {
                *square = dot(line, line);
            }
            for p in 0..NUMBERS - 1 {
                let (before, after) = lines.split_at_mut(p + 1);
                let Some(a) = before.last_mut() else { continue };
                for b in after {
                    turned |= rotate(a, b);
                }
            }
            if !turned {
                break;
            }
        }
        lines
    }
}

/// Product of two lines' coefficients.
fn dot(a: &Line, b: &Line) -> f32 {
    a.iter().zip(b).take(NUMBERS).map(|(a, b)| a * b).sum()
}

/// Turns two lines, and the squares of their lengths, until their coefficients are orthogonal; whether they were not.
fn rotate((aa, a): &mut (f32, Line), (bb, b): &mut (f32, Line)) -> bool {
    let ab = dot(a, b);
    if !(*aa > NOTHING && *bb > NOTHING && ab * ab > 1e-12 * *aa * *bb) {
        return false;
    }
    let zeta = (*bb - *aa) / (2.0 * ab);
    let root = if zeta.abs() < 1e6 { sqrt(1.0 + zeta * zeta) } else { zeta.abs() };
    let t = if zeta < 0.0 { -1.0 / (root - zeta) } else { 1.0 / (root + zeta) };
    let c = 1.0 / sqrt(1.0 + t * t);
    let s = c * t;
    (*aa, *bb) = (*aa - t * ab, *bb + t * ab);
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
    true
}

/// The best determined of directions, at most `most`: `take` is given each; how many there were.
pub fn best_determined(directions: &[(f32, Line); NUMBERS], most: usize, mut take: impl FnMut(&Line)) -> u16 {
    let largest = directions.iter().fold(0.0, |most, (square, _)| if *square > most { *square } else { most });
    let mut taken: u16 = 0;
    for (i, (square, line)) in directions.iter().enumerate() {
        // How many are better: ties go by their places.
        let is_better = |(k, (other, _)): (usize, &(f32, Line))| other > square || (other == square && k < i);
        let better = directions.iter().enumerate().fold(0_usize, |n, d| n.saturating_add(usize::from(is_better(d))));
        if better < most && *square > ROUNDING * largest && *square > NOTHING {
            take(line);
            taken = taken.saturating_add(1);
        }
    }
    taken
}
