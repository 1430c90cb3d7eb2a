//! An internal wave on trial: its kind (period, mode, vertical shape) and what it does to the depth of each run.
//!
//! Vertical velocity, up: `Σ parts a_i f_i(t) φ(z)`, with `f` = sine and cosine of the period and of half of it (a steep wave is
//! not a sine; the second harmonic is expected at [`HARMONIC`] of the first), all amplitudes free in every run because the phase
//! is another. The shape φ is `sin(n π z/H)`, or the same in depth stretched by the measured stratification, as the WKB
//! approximation of a mode has it (Gill, Atmosphere-Ocean Dynamics 1982, section 8.4).

use crate::preprocess::Run;
use hydro::effects::vertical_mode;
use logs::vehicle::Vehicle;

/// Amplitudes per run: sine, cosine, and the same of the second harmonic.
pub const PARTS: usize = 4;
/// Second harmonic relative to the first, 1 sigma; guess from the steepness of waves in lakes and on shelves.
pub const HARMONIC: f64 = 0.15;

/// Period and vertical shape of a wave.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// Period, s.
    pub period_s: f64,
    /// Vertical mode.
    pub mode: u32,
    /// Stretched depth (0 at the surface, 1 at the bottom) on equal steps of depth, if the stratification shapes the mode.
    pub stretched: Option<std::sync::Arc<Vec<f64>>>,
}

/// A wave whose amplitudes are free in each run.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// What wave.
    pub kind: Kind,
    /// Amplitudes in each fitted run, m/s, up; the harmonic's in units of [`HARMONIC`].
    pub amplitude_m_s: Vec<[f64; PARTS]>,
    /// Amplitude that waves of this scale have, m/s: the rms that the prior of the amplitudes expects.
    pub scale_m_s: f64,
}

impl Kind {
    fn shape(&self, depth_m: f64, water_depth_m: f64) -> f64 {
        let Some(s) = &self.stretched else { return vertical_mode(self.mode, depth_m, water_depth_m) };
        let x = (depth_m / water_depth_m).clamp(0.0, 1.0) * (s.len() - 1) as f64;
        let i = (x as usize).min(s.len() - 2);
        vertical_mode(self.mode, s[i] + (s[i + 1] - s[i]) * (x - i as f64), 1.0)
    }

    /// Depth shifts of unit amplitudes at each row of a run, m, positive down.
    #[must_use]
    pub fn depths_m(&self, run: &Run, vehicle: &Vehicle) -> [Vec<f64>; PARTS] {
        let omega = 2.0 * std::f64::consts::PI / self.period_s;
        let n = run.time_s.len();
        let mut out: [Vec<f64>; PARTS] = std::array::from_fn(|_| Vec::with_capacity(n));
        let mut shift = [0.0; PARTS];
        let mut before = ([0.0; PARTS], f64::NAN);
        for i in 0..n {
            let t = run.time_s[i];
            let shape = self.shape(run.depth_at_row(i, vehicle.constants.gravity_m_s2), vehicle.water_depth_m);
            let (sin, cos) = (omega * t).sin_cos();
            let up = [sin, cos, HARMONIC * 2.0 * sin * cos, HARMONIC * (cos * cos - sin * sin)].map(|x| x * shape);
            for j in 0..PARTS {
                if i > 0 {
                    shift[j] -= 0.5 * (up[j] + before.0[j]) * (t - before.1);
                }
                out[j].push(shift[j]);
            }
            before = (up, t);
        }
        out
    }
}

impl Wave {
    /// Rms over the runs of the amplitude of the fundamental, m/s.
    #[must_use]
    pub fn rms_amplitude_m_s(&self) -> f64 {
        let power: f64 = self.amplitude_m_s.iter().map(|[a, b, ..]| a * a + b * b).sum();
        (power / self.amplitude_m_s.len().max(1) as f64).sqrt()
    }

    /// Depth shift at each row of fitted run `k`, m, positive down.
    #[must_use]
    pub fn depth_m(&self, run: &Run, k: usize, vehicle: &Vehicle) -> Vec<f64> {
        let parts = self.kind.depths_m(run, vehicle);
        let a = &self.amplitude_m_s[k];
        (0..run.time_s.len()).map(|row| (0..PARTS).map(|j| a[j] * parts[j][row]).sum()).collect()
    }
}

/// Amplitude of ordinary water motion of one period, m/s: that of a sine with the stated rms, which is off by up to a fifth. A wave
/// no larger is none.
#[must_use]
pub fn ordinary_amplitude_m_s(vehicle: &Vehicle) -> f64 {
    1.2 * std::f64::consts::SQRT_2 * vehicle.background.0
}

/// Bins of the density profile.
const BINS: usize = 40;

/// Depth stretched by the buoyancy frequency that the runs saw, normalised to the water depth: `∫N dz / ∫_0^H N dz`. Below the
/// deepest dive the last tenth's frequency is held. None where the water is not seen to be stratified.
#[must_use]
pub fn stretched(runs: &[&Run], vehicle: &Vehicle) -> Option<std::sync::Arc<Vec<f64>>> {
    let (g, bottom) = (vehicle.constants.gravity_m_s2, vehicle.water_depth_m);
    if !(bottom > 0.0) {
        return None;
    }
    // In situ density less the part that pressure alone makes (4.5e-10 /Pa times ρ): what is left is stratification.
    let mut sums = vec![(0.0_f64, 0.0_f64); BINS];
    for run in runs {
        for i in &run.inputs {
            let bin = (i.depth_m / bottom * BINS as f64).floor();
            if i.depth_m > 0.5 && (0.0..BINS as f64).contains(&bin) {
                let s = &mut sums[bin as usize];
                s.0 += i.sensed.density_kg_m3 * (1.0 - 4.5e-10 * i.sensed.pressure_pa);
                s.1 += 1.0;
            }
        }
    }
    let seen = sums.iter().rposition(|s| s.1 > 3.0)?;
    let mean: Vec<f64> = sums.iter().map(|s| s.0 / s.1).collect();
    let dz = bottom / BINS as f64;
    let mut frequency = vec![0.0; BINS];
    for (i, f) in frequency.iter_mut().enumerate().take(seen + 1) {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(seen));
        let rise = (mean[b] - mean[a]) / ((b - a).max(1) as f64 * dz);
        *f = if rise.is_finite() { (g / 1000.0 * rise.max(0.0)).sqrt() } else { 0.0 };
    }
    let top = frequency.iter().copied().fold(0.0, f64::max);
    // 1e-3 rad/s: a period of 100 min; less is no stratification.
    if seen < 4 || top < 1e-3 {
        return None;
    }
    let last = frequency[seen.saturating_sub(BINS / 10)..=seen].iter().sum::<f64>() / (seen - seen.saturating_sub(BINS / 10) + 1) as f64;
    frequency[seen + 1..].fill(last);
    // A floor keeps the mixed layer from vanishing.
    let mut s = vec![0.0];
    for f in &frequency {
        s.push(s[s.len() - 1] + f.max(0.1 * top));
    }
    let whole = s[BINS];
    s.iter_mut().for_each(|v| *v /= whole);
    Some(std::sync::Arc::new(s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_stretches_in_stratified_water_and_vanishes_at_both_ends() {
        // A thermocline in the middle of 100 m: half of the stretched depth is passed within it.
        let sharp: Vec<f64> = (0..=BINS).map(|i| if i < 18 { 0.01 * i as f64 } else { (0.18 + 0.16 * (i - 18) as f64).min(1.0) }).collect();
        let kind = Kind { period_s: 1200.0, mode: 1, stretched: Some(std::sync::Arc::new(sharp)) };
        let plain = Kind { stretched: None, ..kind.clone() };
        for k in [&kind, &plain] {
            assert!(k.shape(0.0, 100.0).abs() < 1e-12 && k.shape(100.0, 100.0).abs() < 1e-12);
        }
        // Stretched depth 0.5 lies at 2 bins below the top of the thermocline: (18 + 2) / 40 of the depth.
        assert!((kind.shape(50.0, 100.0) - 1.0).abs() < 1e-9, "{}", kind.shape(50.0, 100.0));
        assert!(kind.shape(20.0, 100.0) < 0.5 * plain.shape(20.0, 100.0));
    }
}
