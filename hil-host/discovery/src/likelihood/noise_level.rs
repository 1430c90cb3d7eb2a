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
    /// Sets rms and correlation time of the ordinary water motion, and the depth sensor's noise, to what a state leaves: near what the
    /// file states (the format allows 20 %; smaller is hardly believed, because other colours look smaller to a filter), the rms within a
    /// factor of five where it states nothing. Waves near the surface and stamps that jitter are noise of depth too. Each in
    /// turn by maximum likelihood. Returns whether one moved by more than 7 % (20 %, 10 %).
    pub fn tune_colour(&mut self, state: &State) -> bool {
        /// Standard deviations of the logarithm of what the file states, and of what it does not.
        const STATED: f64 = 0.12;
        const ASSUMED: f64 = 1.0;
        const ROUNDS: usize = 3;
        let missed = |((run, w), depth): ((&&Run, &Whitener), &Vec<f64>)| w.means(|row| run.depth_m[row] - depth[row]);
        let missed: Vec<Vec<f64>> = self.runs.iter().zip(&self.whiteners).zip(&self.depths_m(state)).map(missed).collect();
        let assumed = |key: &str| self.vehicle.assumed.iter().any(|a| a.starts_with(key));
        let free = assumed("background") || !is_on("stated_motion");
        let spread = if free { ASSUMED } else { STATED };
        let rms = if free { 0.2..=5.0 } else { 0.9..=1.2 };
        let noise = if assumed("sensors.pressure_noise") && is_on("depth_noise") { 1.0..=9.1 } else { 1.0..=1.0 };
        let axes = [(spread, rms), (STATED, 0.69..=1.44), (ASSUMED, noise)];
        let stated_m = sensor_m(self.vehicle);
        let colour = |ln: [f64; 3]| Colour {
            rms_m_s: self.vehicle.background.0 * ln[0].exp(),
            correlation_s: self.vehicle.background.1 * ln[1].exp(),
            sensor_m: stated_m * ln[2].exp(),
            ..self.colour
        };
        let cost = |ln: [f64; 3]| {
            let colour = colour(ln);
            let mut cost: f64 = ln.iter().zip(&axes).map(|(l, (spread, _))| (l / spread).powi(2)).sum();
            for (whitener, missed) in self.whiteners.iter().zip(&missed) {
                let w = whitener.coloured(&colour);
                let mut e = Vec::with_capacity(w.len());
                w.whiten_means(missed.iter().copied(), &mut e);
                // Huber: a few rows that no model gets right must not set the scale.
                cost += 2.0 * w.log_scale + e.iter().map(|x| if x.abs() < 3.0 { x * x } else { 6.0 * x.abs() - 9.0 }).sum::<f64>();
            }
            cost
        };
        let mut best = ([0.0; 3], cost([0.0; 3]));
        for axis in (0..ROUNDS).flat_map(|_| 0..3) {
            let (spread, allowed) = &axes[axis];
            let tried = (-10..=10_i32).map(|k| f64::from(k) * spread * 0.2).filter(|l| allowed.contains(&l.exp()));
            for l in tried {
                let mut ln = best.0;
                ln[axis] = l;
                let value = cost(ln);
                if value < best.1 {
                    best = (ln, value);
                }
            }
        }
        let found = colour(best.0);
        let by = |of: fn(&Colour) -> f64| (of(&found) / of(&self.colour)).ln().abs();
        let moved = by(|c| c.rms_m_s) > 0.07 || by(|c| c.correlation_s) > 0.2 || by(|c| c.sensor_m) > 0.1;
        if moved {
            self.set_colour(found);
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
