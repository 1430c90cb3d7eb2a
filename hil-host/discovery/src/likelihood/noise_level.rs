//! The level of ordinary water motion: its rms and correlation time by what a state leaves, and the block error that it makes alone.

use super::Problem;
use crate::likelihood::block_error::{block_s, sampled_every_s};
use crate::likelihood::whitening::{Colour, Whitener};
use crate::model::parameters::State;
use crate::preprocess::Run;

impl Problem<'_> {
    /// Scales the rms of the ordinary water motion to what a state leaves, near its nominal value (the format allows 20 %; a
    /// guess in the file may be far off). Its
    /// correlation time likewise. Returns whether either moved by more than 7 % (20 %).
    pub fn tune_colour(&mut self, state: &State) -> bool {
        let missed = |((run, w), depth): ((&&Run, &Whitener), &Vec<f64>)| w.means(|row| run.depth_m[row] - depth[row]);
        let missed: Vec<Vec<f64>> = self.runs.iter().zip(&self.whiteners).zip(&self.depths_m(state)).map(missed).collect();
        let nominal = self.vehicle.background.0;
        let spread = if self.vehicle.assumed.iter().any(|a| a.starts_with("background")) { 1.0 } else { 0.12 };
        // The format allows 20 % either way; smaller than nominal is hardly believed, because other colours look smaller to a filter.
        let allowed = if spread > 0.5 { 0.2..=5.0 } else { 0.9..=1.2 };
        let mut best = (f64::INFINITY, self.colour);
        for (k, j) in (-10..=10_i32).flat_map(|k| (-3..=3_i32).map(move |j| (k, j))) {
            let (factor, stretch) = ((f64::from(k) * spread * 0.2).exp(), (f64::from(j) * 0.12).exp());
            if !allowed.contains(&factor) {
                continue;
            }
            let colour = Colour { rms_m_s: nominal * factor, correlation_s: self.vehicle.background.1 * stretch, ..self.colour };
            let mut cost = (factor.ln() / spread).powi(2) + (stretch.ln() / 0.12).powi(2);
            for (whitener, missed) in self.whiteners.iter().zip(&missed) {
                let w = whitener.coloured(&colour);
                let mut e = Vec::with_capacity(w.len());
                w.whiten_means(missed.iter().copied(), &mut e);
                // Huber: a few rows that no model gets right must not set the scale.
                cost += 2.0 * w.log_scale + e.iter().map(|x| if x.abs() < 3.0 { x * x } else { 6.0 * x.abs() - 9.0 }).sum::<f64>();
            }
            if cost < best.0 {
                best = (cost, colour);
            }
        }
        let moved =
            (best.1.rms_m_s / self.colour.rms_m_s).ln().abs() > 0.07 || (best.1.correlation_s / self.colour.correlation_s).ln().abs() > 0.2;
        if moved {
            self.set_colour(best.1);
        }
        moved
    }

    /// Usual length of the blocks that errors are formed over, s.
    #[must_use]
    pub fn block_s(&self) -> f64 {
        block_s(sampled_every_s(self.runs.iter().copied()))
    }

    /// Error that the ordinary water motion and the sensor leave in a block, m/s.
    #[must_use]
    pub fn noise_floor_m_s(&self) -> f64 {
        let c = &self.colour;
        let t = self.block_s();
        let n = 40;
        // The least-squares slope of an integral weighs the velocity by 6 x (1 − x) over the block.
        let weight = |i: usize| {
            let x = (i as f64 + 0.5) / n as f64;
            6.0 * x * (1.0 - x) / n as f64
        };
        let mut water = 0.0;
        for i in 0..n {
            for j in 0..n {
                let lag = (i as f64 - j as f64).abs() * t / n as f64;
                water += weight(i) * weight(j) * (-lag / c.correlation_s).exp();
            }
        }
        let period = self.runs.first().map_or(4.0, |r| (r.time_s[r.time_s.len() - 1] - r.time_s[0]) / (r.time_s.len() - 1) as f64);
        // Variance of a slope over m samples: 12 s²/(t² m).
        let sensor = 12.0 * c.sensor_m * c.sensor_m / (t * t * (t / period).max(3.0));
        (c.rms_m_s * c.rms_m_s * water + sensor).sqrt()
    }
}
