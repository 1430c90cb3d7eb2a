//! What every real flight has and no model does: a small vertical velocity with a pattern of its own, and the little faults of a log.
//!
//! On real gliders 0.05 to 0.3 cm/s of the depth rate follow depth and leg, the time after a turn, single legs, the side of a turn, and
//! heading with the tide; two computers disagree by a second or two on the time, a pressure sensor has a zero, and many logs are sampled
//! every 5 to 40 s. None of it is an effect that has a name, and a tool that names one for it is wrong.
//!
//! The forms are chosen to be nobody's basis: sines of incommensurate lengths in depth, a rational (not exponential) decay after a turn, a
//! saturating function of roll, one draw a leg.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::Site;

/// Rms of the whole pattern, m/s.
const RMS_M_S: [f64; 2] = [0.001, 0.004];
/// Sines in depth for dives and for climbs.
const SINES: usize = 4;
/// Legs that have a draw of their own; later ones repeat them.
const LEGS: usize = 64;
/// Period of the tide, s (M2).
const TIDE_S: f64 = 44_714.0;
/// Roll at which the side of a turn has most of its say, rad.
const SIDE_RAD: f64 = 0.12;

/// The pattern of one vehicle in one water.
#[derive(Clone, Debug)]
pub struct SmallStructure {
    /// Rms that it was drawn for, m/s.
    pub rms_m_s: f64,
    /// Engineering channels are behind the CTD's clock by this, s.
    pub clock_lag_s: f64,
    /// Amplitude m/s, wave number 1/m and phase of the sines in depth, for dives and climbs.
    sines: [[(f64, f64, f64); SINES]; 2],
    /// Amplitude after the turn into a dive and into a climb, m/s, and the time it has halved by, s.
    after_turn: ([f64; 2], f64),
    /// One value a leg, m/s.
    legs: Vec<f64>,
    /// By the side of a turn, m/s.
    side: f64,
    /// Amplitude m/s, heading rad and phase rad of what follows heading with the tide.
    tide: (f64, f64, f64),
}

/// Where the vehicle is in its pattern.
#[derive(Clone, Copy, Debug)]
pub struct Here {
    /// Time since the start of the trial, s.
    pub time_s: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Whether it dives.
    pub diving: bool,
    /// Number of the leg within the trial.
    pub leg: usize,
    /// Time since the leg began, s.
    pub since_turn_s: f64,
    /// Roll, rad.
    pub roll: f64,
    /// Heading, rad.
    pub heading: f64,
}

impl SmallStructure {
    /// Draws a pattern for a site.
    pub fn draw(site: Site, rng: &mut ChaCha8Rng) -> Self {
        let normal = |rng: &mut ChaCha8Rng| rng.sample::<f64, _>(StandardNormal);
        let rms_m_s = rng.random_range(RMS_M_S[0]..RMS_M_S[1]);
        // Shares of the variance.
        let mut shares: [f64; 5] = core::array::from_fn(|_| rng.random_range(0.1..1.0));
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|s| *s = rms_m_s * (*s / sum).sqrt());
        let [depth, turn, leg, side, tide] = shares;
        let deepest = if site == Site::Lake { 27.0 } else { 200.0 };
        let sines = core::array::from_fn(|_| {
            core::array::from_fn(|_| {
                let cycles = rng.random_range(0.3..2.3);
                let amplitude = depth * normal(rng) * (2.0 / SINES as f64).sqrt();
                (amplitude, core::f64::consts::TAU * cycles / deepest, rng.random_range(0.0..core::f64::consts::TAU))
            })
        });
        // The mean square of 1 / (1 + (t/h)²) over a leg of ten half times is about 1/13.
        let after_turn = (core::array::from_fn(|_| turn * 3.6 * normal(rng)), rng.random_range(15.0..90.0));
        Self {
            rms_m_s,
            clock_lag_s: (1.5 * normal(rng)).clamp(-3.0, 3.0),
            sines,
            after_turn,
            legs: (0..LEGS).map(|_| leg * normal(rng)).collect(),
            // Banked a fifth of the time.
            side: side * 2.2 * if rng.random_bool(0.5) { 1.0 } else { -1.0 },
            tide: (2.0 * tide, rng.random_range(0.0..core::f64::consts::TAU), rng.random_range(0.0..core::f64::consts::TAU)),
        }
    }

    /// Upward velocity that the model lacks, m/s.
    #[must_use]
    pub fn up_m_s(&self, at: &Here) -> f64 {
        let which = usize::from(!at.diving);
        let by_depth: f64 = self.sines[which].iter().map(|(a, k, phase)| a * libm::sin(k * at.depth_m + phase)).sum();
        let (into, half) = &self.after_turn;
        let turned = into[which] / (1.0 + (at.since_turn_s / half).powi(2));
        let leg = self.legs.get(at.leg % LEGS).copied().unwrap_or(0.0);
        let side = self.side * libm::tanh(at.roll / SIDE_RAD);
        let (tide, towards, phase) = self.tide;
        let flood = tide * libm::cos(at.heading - towards) * libm::cos(core::f64::consts::TAU * at.time_s / TIDE_S + phase);
        by_depth + turned + leg + side + flood
    }

    /// Zero error of a pressure sensor that nobody has set, dbar.
    pub fn pressure_zero_dbar(rng: &mut ChaCha8Rng) -> f64 {
        (0.3 * rng.sample::<f64, _>(StandardNormal)).clamp(-0.8, 0.8)
    }

    /// Time between samples, s: half of the logs as dense as before (`dense`), the others as sparse as is usual at the site.
    pub fn period_s(site: Site, dense: f64, rng: &mut ChaCha8Rng) -> f64 {
        let sparsest: f64 = if site == Site::Lake { 12.0 } else { 40.0 };
        let sparse = libm::exp(rng.random_range(libm::log(5.0)..libm::log(sparsest))).round();
        if rng.random_bool(0.5) { dense } else { sparse }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;

    #[test]
    fn accuracy_the_pattern_has_the_size_it_was_drawn_for_on_average() {
        let mut ratio = 0.0;
        let draws = 200;
        for seed in 0..draws {
            let s = SmallStructure::draw(Site::Sea, &mut ChaCha8Rng::seed_from_u64(seed));
            let (mut sum, mut n) = (0.0, 0.0);
            for leg in 0..16_usize {
                for i in 0..60 {
                    let since_turn_s = 10.0 * f64::from(i);
                    let roll = if i % 5 == 0 { 0.25 } else { 0.0 };
                    let at = Here {
                        time_s: 40_000.0 * leg as f64 + since_turn_s,
                        depth_m: 200.0 * f64::from(i) / 60.0,
                        diving: leg % 2 == 0,
                        leg,
                        since_turn_s,
                        roll,
                        heading: 0.7 * leg as f64,
                    };
                    sum += s.up_m_s(&at).powi(2);
                    n += 1.0;
                }
            }
            ratio += sum / n / s.rms_m_s.powi(2) / draws as f64;
        }
        // Variance, mean of 200 draws; each scatters by about its own size.
        assert!((0.7..1.3).contains(&ratio), "{ratio}");
    }
}
