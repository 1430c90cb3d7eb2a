//! Rows into blocks, blocks into the summary of a dive and the level of its noise.
//!
//! A block is a leg, cut after 25 minutes. Its rows make a factor R_b, y_b; all blocks make R, y. The noise has no law: its level is
//! the scatter of what the blocks say about the best fit d, in the four best determined directions v of each,
//! `Σ_b Σ_v (v'(y_b − R_b d))² / (directions − 4)`. That sum is a square form of d, so one more factor holds it whatever d comes out.

use crate::factor::{Factor, WIDTH, best_determined};
use crate::glide::{Vehicle, linearise};
use crate::packet::Packet;
use crate::rows::{Cycle, Row, Rows};
use polar::Table;

/// Longest block, s; also the longest pause in one.
const BLOCK_S: f32 = 1500.0;
/// Best determined directions of a block whose scatter is the noise; as many are lost to the fit.
const DIRECTIONS: usize = 4;
/// Degrees of freedom that the vehicle's usual level counts for.
const USUAL_FREEDOM: f32 = 8.0;
/// Rows of which the usual size of a residual is remembered.
const REMEMBERED: f32 = 30.0;
/// A row is an outlier beyond so many usual sizes, once so many rows are known, and this, m/s.
const OUTLIER: (f32, f32, f32) = (6.0, 8.0, 1e-3);

/// Level of the noise where the best fit leaves `scatter` in so many directions: shrunk to the vehicle's usual level where that is known,
/// and no less than the variance of the rows.
pub(crate) fn noise_level(scatter: f32, directions: u16, usual: Option<f32>, variance: f32) -> f32 {
    let own = f32::from(directions.saturating_sub(DIRECTIONS as u16));
    let (sum, freedom) = usual.map_or((scatter, own), |usual| (scatter + USUAL_FREEDOM * usual, own + USUAL_FREEDOM));
    let level = sum / if freedom > 1.0 { freedom } else { 1.0 };
    if level > variance { level } else { variance }
}

/// Sums over the rows that count.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    rows: u16,
    climbing: u16,
    refused: u16,
    residual: f32,
    squares: f32,
    usual_m_s: f32,
    pitch_rad: f32,
    roll_rad: f32,
    ballast_m3: [f32; 2],
    deepest_pa: f32,
    first_s: f32,
    last_s: f32,
}

/// What the glides since the last surfacing say.
#[derive(Clone, Copy, Debug)]
pub struct Dives {
    rows: Rows,
    says: Says,
}

#[derive(Clone, Copy, Debug)]
struct Says {
    block: Factor,
    all: Factor,
    scatter: Factor,
    directions: u16,
    blocks: u8,
    /// Way, first and last row of the block under way.
    block_way: f32,
    block_s: [f32; 2],
    alpha_rad: f32,
    sums: Sums,
}

const EMPTY: Factor = Factor([[0.0; WIDTH]; WIDTH]);

impl Says {
    const fn new() -> Self {
        Self {
            block: EMPTY,
            all: EMPTY,
            scatter: EMPTY,
            directions: 0,
            blocks: 0,
            block_way: 0.0,
            block_s: [0.0; 2],
            alpha_rad: 0.0,
            sums: Sums {
                rows: 0,
                climbing: 0,
                refused: 0,
                residual: 0.0,
                squares: 0.0,
                usual_m_s: 0.0,
                pitch_rad: 0.0,
                roll_rad: 0.0,
                ballast_m3: [0.0; 2],
                deepest_pa: 0.0,
                first_s: 0.0,
                last_s: 0.0,
            },
        }
    }
}

impl Dives {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { rows: Rows::new(), says: Says::new() }
    }

    /// Takes a cycle of a glide.
    pub fn take(&mut self, vehicle: &Vehicle, table: &Table<'_>, cycle: &Cycle) {
        let Self { rows, says } = self;
        rows.take(cycle, |row| says.take(vehicle, table, row));
    }

    /// A cycle that is no glide, or whose sensors do not tell: rows do not reach over it.
    pub fn interrupt(&mut self) {
        self.rows.interrupt();
    }

    /// The packet of all rows so far.
    #[must_use]
    pub fn packet(&self, vehicle_id: u32) -> Packet {
        let mut says = self.says;
        says.end_block();
        says.packet(vehicle_id, self.rows.start_s())
    }

    /// Begins anew after a packet was sent. What is known of the depths of dives stays.
    pub fn begin(&mut self) {
        self.says = Says::new();
    }

    /// Rows that count so far.
    #[must_use]
    pub const fn rows(&self) -> u16 {
        self.says.sums.rows
    }
}

impl Default for Dives {
    fn default() -> Self {
        Self::new()
    }
}

impl Says {
    fn take(&mut self, vehicle: &Vehicle, table: &Table<'_>, row: &Row) {
        let way = row.way();
        let Some(linear) = linearise(vehicle, table, row, self.alpha_rad) else {
            self.sums.refused = self.sums.refused.saturating_add(1);
            return;
        };
        self.alpha_rad = linear.alpha_rad;
        let residual = linear.residual;
        if self.is_outlier(residual) {
            self.sums.refused = self.sums.refused.saturating_add(1);
            return;
        }
        let [first_s, last_s] = self.block_s;
        if way != self.block_way || row.time_s - last_s > BLOCK_S || row.time_s - first_s > BLOCK_S {
            self.end_block();
            (self.block_way, self.block_s) = (way, [row.time_s; 2]);
        }
        self.block_s[1] = row.time_s;
        let mut line = [residual; WIDTH];
        line.iter_mut().zip(linear.by_number).for_each(|(to, x)| *to = x);
        self.block.add(line);
        self.sums.take(row, residual);
    }

    /// Outliers are refused by the usual size of the residuals before them, which an outlier moves by no more than another row.
    fn is_outlier(&mut self, residual: f32) -> bool {
        let (times, known, least) = OUTLIER;
        let s = &mut self.sums;
        let size = residual.abs();
        let n = f32::from(s.rows);
        let out = n >= known && size > times * s.usual_m_s + least;
        let most = if n >= known { 3.0 * s.usual_m_s + least } else { f32::MAX };
        let clipped = if size < most { size } else { most };
        s.usual_m_s += (clipped - s.usual_m_s) / if n < REMEMBERED { n + 1.0 } else { REMEMBERED };
        out || !residual.is_finite()
    }

    fn end_block(&mut self) {
        let block = core::mem::take(&mut self.block);
        let directions = block.directions();
        let scatter = &mut self.scatter;
        let taken = best_determined(&directions, DIRECTIONS, |line| scatter.add(*line));
        if taken == 0 {
            return;
        }
        self.directions = self.directions.saturating_add(taken);
        self.blocks = self.blocks.saturating_add(1);
        self.all.add_all(&block.0);
    }

    fn packet(&self, vehicle_id: u32, start_s: u32) -> Packet {
        let s = &self.sums;
        let left = |level: f32| self.scatter.misfit(&self.all.most_probable(level));
        let scatter = left(noise_level(left(s.variance()), self.directions, None, s.variance()));
        let n = f32::from(s.rows.max(1));
        let climbing = f32::from(s.climbing.max(1));
        let diving = f32::from(s.rows.saturating_sub(s.climbing).max(1));
        let [down, up] = s.ballast_m3;
        let mut lines = [[0.0; WIDTH]; crate::NUMBERS];
        lines.iter_mut().zip(&self.all.0).for_each(|(to, row)| *to = *row);
        Packet {
            vehicle_id,
            start_s: start_s.saturating_add(s.first_s as u32),
            duration_s: (s.last_s - s.first_s) as u32,
            rows: s.rows,
            climbing: s.climbing,
            refused: s.refused,
            blocks: self.blocks,
            directions: self.directions,
            scatter,
            variance: s.variance(),
            pitch_rad: s.pitch_rad / n,
            roll_rad: s.roll_rad / n,
            drive_m3: 0.5 * (up / climbing - down / diving),
            deepest_pa: s.deepest_pa,
            lines,
        }
    }
}

impl Sums {
    fn take(&mut self, row: &Row, residual: f32) {
        if self.rows == 0 {
            self.first_s = row.time_s;
        }
        let climbs = row.way() > 0.0;
        self.rows = self.rows.saturating_add(1);
        self.climbing = self.climbing.saturating_add(u16::from(climbs));
        self.residual += residual;
        self.squares += residual * residual;
        self.pitch_rad += row.pitch_rad.abs();
        self.roll_rad += row.roll_rad;
        let [down, up] = &mut self.ballast_m3;
        *if climbs { up } else { down } += row.ballast_m3;
        if row.pressure_pa > self.deepest_pa {
            self.deepest_pa = row.pressure_pa;
        }
        self.last_s = row.time_s;
    }

    fn variance(&self) -> f32 {
        let n = f32::from(self.rows.max(1));
        let mean = self.residual / n;
        let variance = self.squares / n - mean * mean;
        if variance > 1e-12 { variance } else { 1e-12 }
    }
}
