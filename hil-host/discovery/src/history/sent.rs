//! The summary of a dive as a board sends it at a surfacing (`firmware/evidence`), to be judged as if it were made from the log.

use super::numbers::{NUMBERS, Numbers};
use super::summary::{Summary, noise_level};
use nalgebra::{DMatrix, DVector};

/// What a packet says.
#[derive(Clone, Debug, PartialEq)]
pub struct Sent {
    /// R of the eight numbers, m/s per size, whatever the noise.
    pub r: DMatrix<f64>,
    /// y, m/s, counted from the constants on board.
    pub y: DVector<f64>,
    /// Scatter of the blocks about the best fit, (m/s)², and in how many directions.
    pub scatter: (f64, f64),
    /// Variance of the residuals, (m/s)².
    pub variance: f64,
}

impl Sent {
    /// Of a packet's lines of R and y in sizes `board`, to be read in sizes `ours`.
    #[must_use]
    pub fn new(lines: &[[f64; NUMBERS + 1]; NUMBERS], board: &Numbers, ours: &Numbers, scatter: (f64, f64), variance: f64) -> Self {
        let r = DMatrix::from_fn(NUMBERS, NUMBERS, |i, k| lines[i][k] * ours[k] / board[k]);
        Self { r, y: DVector::from_fn(NUMBERS, |i, _| lines[i][NUMBERS]), scatter, variance }
    }

    /// Counts its numbers from `origin` (sizes beyond the constants on board) from now on.
    pub fn count_from(&mut self, origin: &Numbers) {
        self.y -= &self.r * DVector::from_column_slice(origin.as_slice());
    }

    /// Level of its noise, shrunk to the vehicle's usual one.
    #[must_use]
    pub fn level(&self, usual: Option<f64>) -> f64 {
        noise_level(self.scatter.0, self.scatter.1, usual, self.variance)
    }

    /// N and u over that noise.
    #[must_use]
    pub fn summary(&self, usual: Option<f64>) -> Summary {
        let scale = 1.0 / self.level(usual).sqrt();
        Summary::of_root(&(&self.r * scale), &(&self.y * scale))
    }
}
