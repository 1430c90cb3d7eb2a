//! The water of one trial: stratification, vertical motion, currents.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::{SEGMENTS, Site};

/// Standard deviation of the relative modulation of an internal wave between segments (guess).
const WAVE_MODULATION: f64 = 0.12;

/// Temperature, density and pressure against depth, tabulated each half metre.
#[derive(Clone, Debug)]
pub struct Column {
    temperature: Vec<f64>,
    density: Vec<f64>,
    pressure: Vec<f64>,
    /// Share of the integral of the buoyancy frequency above each depth.
    stretched: Vec<f64>,
}

const STEP_M: f64 = 0.5;

impl Column {
    /// Draws a lake with a thermocline or a sea with a mixed layer, pycnocline and salinity gradient; TEOS-10 density.
    pub fn draw(site: Site, depth_m: f64, gravity: f64, rng: &mut ChaCha8Rng) -> Self {
        let n = (depth_m * 1.15 / STEP_M) as usize + 4;
        let (surface, bottom, centre, width) = match site {
            Site::Lake => {
                (rng.random_range(13.0..21.0), rng.random_range(6.0..8.5), rng.random_range(8.0..14.0), rng.random_range(2.0..4.5))
            }
            Site::Sea => {
                (rng.random_range(14.0..22.0), rng.random_range(9.0..12.0), rng.random_range(25.0..60.0), rng.random_range(10.0..22.0))
            }
        };
        let slope = if site == Site::Sea { rng.random_range(0.003..0.008) } else { 0.0 };
        let (s_top, s_jump) = match site {
            Site::Lake => (rng.random_range(0.05..0.3), rng.random_range(0.0..0.04)),
            Site::Sea => (rng.random_range(34.2..35.6), rng.random_range(-0.2..0.5)),
        };
        let mut column = Self {
            temperature: Vec::with_capacity(n),
            density: Vec::with_capacity(n),
            pressure: Vec::with_capacity(n),
            stretched: Vec::with_capacity(n),
        };
        let mut p_pa = 0.0;
        for i in 0..n {
            let z = i as f64 * STEP_M;
            let fade = 0.5 * (1.0 - libm::tanh((z - centre) / width));
            let t = bottom + (surface - bottom) * fade - slope * z;
            let s = s_top + s_jump * (1.0 - fade);
            let rho = density(s, t, p_pa / 1e4);
            column.temperature.push(t);
            column.density.push(rho);
            column.pressure.push(p_pa);
            p_pa += rho * gravity * STEP_M;
        }
        let mut sum = 0.0;
        for i in 0..n {
            column.stretched.push(sum);
            if i + 1 < n {
                let z = i as f64 * STEP_M;
                let p = column.pressure[i] / 1e4;
                let here = density(s_top, column.temperature[i], p);
                let below = density(s_top, column.temperature[i + 1], p);
                // A floor keeps the mixed layers from having no mode at all.
                let n2 = ((below - here) / here * gravity / STEP_M).max(2e-6);
                if z < depth_m {
                    sum += libm::sqrt(n2) * STEP_M;
                }
            }
        }
        column.stretched.iter_mut().for_each(|s| *s /= sum);
        column
    }

    fn at(table: &[f64], z: f64) -> f64 {
        let x = (z / STEP_M).clamp(0.0, (table.len() - 2) as f64);
        let i = x as usize;
        table[i] + (table[i + 1] - table[i]) * (x - i as f64)
    }

    /// Temperature, °C, at depth m.
    #[must_use]
    pub fn temperature(&self, z: f64) -> f64 {
        Self::at(&self.temperature, z)
    }

    /// In-situ density, kg/m³.
    #[must_use]
    pub fn density(&self, z: f64) -> f64 {
        Self::at(&self.density, z)
    }

    /// Gauge pressure, Pa.
    #[must_use]
    pub fn pressure(&self, z: f64) -> f64 {
        Self::at(&self.pressure, z)
    }

    /// First vertical mode in stretched depth: 0 at surface and bottom, at most 1.
    #[must_use]
    pub fn mode(&self, z: f64, number: f64) -> f64 {
        libm::sin(core::f64::consts::PI * number * Self::at(&self.stretched, z))
    }
}

/// Colour of the background vertical motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// First-order Markov, the file's correlation time.
    Markov,
    /// Second-order: a broad peak.
    WaveLike,
    /// Three Markov processes a factor four apart.
    OneOverF,
    /// Markov plus a level that differs per segment.
    PerDive,
}

impl Colour {
    /// Name for the truth file.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Markov => "markov",
            Self::WaveLike => "wave_like",
            Self::OneOverF => "one_over_f",
            Self::PerDive => "per_dive",
        }
    }

    /// One realisation on a 1 s grid, m/s up.
    pub fn realise(self, rms: f64, time_s: f64, seconds: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        match self {
            Self::Markov => markov(rms, time_s, seconds, rng),
            Self::PerDive => {
                let level: f64 = 0.45 * rms * rng.sample::<f64, _>(StandardNormal);
                markov(0.89 * rms, time_s, seconds, rng).into_iter().map(|w| w + level).collect()
            }
            Self::OneOverF => {
                let mut sum = vec![0.0; seconds];
                for factor in [0.4, 1.4, 5.0] {
                    for (s, w) in sum.iter_mut().zip(markov(rms / libm::sqrt(3.0), time_s * factor, seconds, rng)) {
                        *s += w;
                    }
                }
                sum
            }
            Self::WaveLike => {
                // x'' + 2 z w x' + w² x = noise, a broad peak at a period of about four correlation times.
                let (omega, zeta) = (1.0 / (0.6 * time_s), 0.35);
                let (mut x, mut v) = (rms * rng.sample::<f64, _>(StandardNormal), rms * omega * rng.sample::<f64, _>(StandardNormal));
                let kick = rms * libm::sqrt(4.0 * zeta * omega * omega * omega);
                (0..seconds)
                    .map(|_| {
                        v += -2.0 * zeta * omega * v - omega * omega * x + kick * rng.sample::<f64, _>(StandardNormal);
                        x += v;
                        x
                    })
                    .collect()
            }
        }
    }
}

/// In-situ density, kg/m³, of absolute salinity g/kg, conservative temperature °C, gauge pressure dbar (TEOS-10).
fn density(salinity: f64, temperature: f64, dbar: f64) -> f64 {
    gsw::volume::rho(salinity, temperature, dbar).unwrap_or(f64::NAN)
}

fn markov(rms: f64, time_s: f64, seconds: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let keep = libm::exp(-1.0 / time_s);
    let kick = rms * libm::sqrt(1.0 - keep * keep);
    let mut w = rms * rng.sample::<f64, _>(StandardNormal);
    (0..seconds)
        .map(|_| {
            w = keep * w + kick * rng.sample::<f64, _>(StandardNormal);
            w
        })
        .collect()
}

/// An internal wave of one vertical mode.
#[derive(Clone, Debug)]
pub struct InternalWave {
    /// Amplitude of the vertical velocity at the mode's maximum, m/s.
    pub amplitude: f64,
    /// Period, s.
    pub period: f64,
    /// Mode number.
    pub mode: f64,
    /// Share of the second harmonic (steepening).
    pub harmonic: f64,
    /// Phase per segment, rad.
    pub phase: [f64; SEGMENTS],
    /// Amplitude factor per segment.
    pub factor: [f64; SEGMENTS],
}

impl InternalWave {
    /// Draws period, mode, steepening and phases for an amplitude.
    pub fn draw(amplitude: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            amplitude,
            period: libm::exp(rng.random_range(libm::log(540.0)..libm::log(2100.0))),
            mode: if rng.random_bool(0.85) { 1.0 } else { 2.0 },
            harmonic: rng.random_range(0.0..0.25),
            phase: core::array::from_fn(|_| rng.random_range(0.0..core::f64::consts::TAU)),
            factor: core::array::from_fn(|_| 1.0 + WAVE_MODULATION * super::vehicle::normal_within_2_sigma(rng)),
        }
    }

    /// Vertical velocity at the mode's maximum, m/s up, and displacement, m up.
    #[must_use]
    pub fn motion(&self, segment: usize, t: f64) -> (f64, f64) {
        let omega = core::f64::consts::TAU / self.period;
        let p = omega * t + self.phase[segment];
        let a = self.amplitude * self.factor[segment];
        (a * (libm::sin(p) + self.harmonic * libm::sin(2.0 * p)), -a / omega * (libm::cos(p) + 0.5 * self.harmonic * libm::cos(2.0 * p)))
    }
}

/// Everything that moves in the water of one trial.
#[derive(Clone, Debug)]
pub struct Ocean {
    /// Stratification.
    pub column: Column,
    /// Depth of the bottom, m.
    pub depth_m: f64,
    /// Colour of the background motion.
    pub colour: Colour,
    /// Its true rms, m/s.
    pub rms: f64,
    /// Its true correlation time, s.
    pub time_s: f64,
    /// Internal wave.
    pub wave: Option<InternalWave>,
    /// Steady vertical motion: m/s up at its maximum, and skewness of the profile (1: symmetric).
    pub upwelling: [f64; 2],
    /// Horizontal current at the surface per segment (east, north), m/s.
    pub current: [[f64; 2]; SEGMENTS],
    /// Decay depth of its baroclinic part, m, and the barotropic share.
    pub current_profile: [f64; 2],
}

impl Ocean {
    /// Steady vertical motion at a depth, m/s up.
    #[must_use]
    pub fn steady_up(&self, z: f64) -> f64 {
        if self.upwelling[0] == 0.0 {
            return 0.0;
        }
        let s = (z / self.depth_m).clamp(0.0, 1.0);
        self.upwelling[0] * libm::sin(core::f64::consts::PI * libm::pow(s, self.upwelling[1]))
    }

    /// Horizontal current, m/s, east and north.
    #[must_use]
    pub fn current_at(&self, segment: usize, z: f64) -> [f64; 2] {
        let share = self.current_profile[1] + (1.0 - self.current_profile[1]) * libm::exp(-z / self.current_profile[0]);
        self.current[segment].map(|c| c * share)
    }
}
