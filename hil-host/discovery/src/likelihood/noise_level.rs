//! The level of ordinary water motion: its rms and correlation time by what a state leaves, and the block error that it makes alone.

use super::Problem;
use crate::ablation::is_on;
use crate::likelihood::block_error::{block_s, sampled_every_s};
use crate::likelihood::whitening::{Colour, Whitener};
use crate::model::parameters::State;
use crate::preprocess::Run;
use logs::vehicle::Vehicle;

/// Standard deviation of the depth sensor by the vehicle file, m: noise and resolution.
pub(super) fn sensor_m(vehicle: &Vehicle) -> f64 {
    let s = &vehicle.sensors;
    let pascal_per_m = 1015.0 * vehicle.constants.gravity_m_s2;
    (s.pressure_noise_pa.powi(2) + s.pressure_resolution_pa.powi(2) / 12.0).sqrt() / pascal_per_m
}

impl Problem<'_> {
    /// Scales the rms of the ordinary water motion to what a state leaves, near its nominal value (the format allows 20 %; a
    /// guess in the file may be far off). Its
    /// correlation time likewise, and the depth sensor's noise where the file does not state it: waves near the surface and stamps
    /// that jitter are white noise of depth too. Returns whether one moved by more than 7 % (20 %, 10 %).
    pub fn tune_colour(&mut self, state: &State) -> bool {
        let missed = |((run, w), depth): ((&&Run, &Whitener), &Vec<f64>)| w.means(|row| run.depth_m[row] - depth[row]);
        let missed: Vec<Vec<f64>> = self.runs.iter().zip(&self.whiteners).zip(&self.depths_m(state)).map(missed).collect();
        let nominal = self.vehicle.background.0;
        let guessed = |key: &str| self.vehicle.assumed.iter().any(|a| a.starts_with(key));
        let spread = if guessed("background") { 1.0 } else { 0.12 };
        // The format allows 20 % either way; smaller than nominal is hardly believed, because other colours look smaller to a filter.
        let allowed = if spread > 0.5 { 0.2..=5.0 } else { 0.9..=1.2 };
        let noises = if guessed("sensors.pressure_noise") && is_on("depth_noise") { 0..=11 } else { 0..=0 };
        let stated_m = sensor_m(self.vehicle);
        let mut best = (f64::INFINITY, self.colour);
        for (n, k, j) in noises.flat_map(|n| (-10..=10_i32).flat_map(move |k| (-3..=3_i32).map(move |j| (n, k, j)))) {
            let (factor, stretch) = ((f64::from(k) * spread * 0.2).exp(), (f64::from(j) * 0.12).exp());
            if !allowed.contains(&factor) {
                continue;
            }
            let noise = 0.2 * f64::from(n);
            let colour = Colour {
                rms_m_s: nominal * factor,
                correlation_s: self.vehicle.background.1 * stretch,
                sensor_m: stated_m * noise.exp(),
                ..self.colour
            };
            let mut cost = (factor.ln() / spread).powi(2) + (stretch.ln() / 0.12).powi(2) + noise.powi(2);
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
        let by = |of: fn(&Colour) -> f64| (of(&best.1) / of(&self.colour)).ln().abs();
        let moved = by(|c| c.rms_m_s) > 0.07 || by(|c| c.correlation_s) > 0.2 || by(|c| c.sensor_m) > 0.1;
        if moved {
            self.set_colour(best.1);
        }
        moved
    }

    /// In words, that the depth is noisier than was assumed.
    pub(crate) fn depth_noise_said(&self) -> Option<String> {
        let (found, assumed) = (self.colour.sensor_m, sensor_m(self.vehicle));
        (found > 1.1 * assumed).then(|| {
            format!("depth scatters by {found:.2} m from sample to sample ({assumed:.2} assumed): surface waves or stamps that jitter")
        })
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
