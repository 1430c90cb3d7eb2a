//! Is it one train of waves that a flight has met, or water that moved in every run as it liked?
//!
//! A train of internal waves has another phase in every run and much the same amplitude; what convection, eddies or a fault make has
//! amplitudes of all sizes. The amplitudes of a fitted wave are free in every run, so the fit does not know: here it is asked.
//!
//! ```text
//! alike    ln A_k ~ N(ln A, SPREAD²), ln A ~ N(ln scale, OF_SCALE²); one run in ten is of its own
//! its own  sine and cosine ~ N(0, scale²/2)
//! seen     r_k, the length of sine and cosine with an error σ_k in each: r_k | A_k is of Rice's distribution
//! ```

use crate::inference::numeric::log_mean_exp;
use crate::inference::posterior::Fit;
use std::f64::consts::PI;

/// Standard deviation of ln of the amplitudes of a train in runs some hours apart. Guess.
const SPREAD: f64 = 0.2;
/// Standard deviation of ln of a train's amplitude from the scale that it was found with (scales are a factor of two apart).
const OF_SCALE: f64 = 0.35;
/// Share of the runs of a train that are of their own: a packet that came or went.
const OF_ITS_OWN: f64 = 0.1;
/// Nodes of integrals over a normal variable, sigma.
const NODES: std::ops::RangeInclusive<i32> = -6..=6;
const NODE: f64 = 0.4;
/// Arguments from which the Bessel function is its asymptotic series, and steps of half a circle below.
const ASYMPTOTIC_FROM: f64 = 50.0;
const HALF_CIRCLE: u32 = 24;
/// Log Bayes factor of amplitudes that are alike in all runs against amplitudes that are of their own in each; none without a wave.
#[must_use]
pub(crate) fn log_alike(fit: &Fit) -> Option<f64> {
    let wave = fit.state.wave.as_ref()?;
    let prior = 0.5 * wave.scale_m_s * wave.scale_m_s;
    let seen = fit.wave_amplitudes().into_iter().filter_map(|([a, b], both)| {
        let variance = 0.5 * both;
        // Without the prior, which pulls amplitudes towards nothing.
        let information = 1.0 / variance - 1.0 / prior;
        (information > 0.0).then(|| (a.hypot(b) / (variance * information), information.powf(-0.5)))
    });
    Some(of_amplitudes(&seen.collect::<Vec<_>>(), wave.scale_m_s))
}

/// The same of lengths and their errors.
fn of_amplitudes(seen: &[(f64, f64)], scale: f64) -> f64 {
    let nodes: Vec<f64> = NODES.map(|k| NODE * f64::from(k)).collect();
    let total: f64 = nodes.iter().map(|x| (-0.5 * x * x).exp()).sum();
    let weight = |x: f64| (-0.5 * x * x).exp() / total;
    let one = |amplitude: f64, &(r, sigma): &(f64, f64)| {
        let own = ln_rice(r, 0.0, (0.5 * scale * scale + sigma * sigma).sqrt());
        let alike: f64 = nodes.iter().map(|x| weight(*x) * (ln_rice(r, amplitude * (SPREAD * x).exp(), sigma) - own).exp()).sum();
        ((1.0 - OF_ITS_OWN) * alike + OF_ITS_OWN).ln()
    };
    let all: Vec<f64> = nodes
        .iter()
        .map(|x| (weight(*x) * nodes.len() as f64).ln() + seen.iter().map(|s| one(scale * (OF_SCALE * x).exp(), s)).sum::<f64>())
        .collect();
    log_mean_exp(&all)
}

/// Log of Rice's density of a length, less ln of the length.
fn ln_rice(r: f64, amplitude: f64, sigma: f64) -> f64 {
    let s2 = sigma * sigma;
    let x = r * amplitude / s2;
    -s2.ln() - 0.5 * (r - amplitude).powi(2) / s2 + ln_i0_less(x)
}

/// ln I₀(x) − x.
fn ln_i0_less(x: f64) -> f64 {
    if x > ASYMPTOTIC_FROM {
        return (0.125 / x).ln_1p() - 0.5 * (2.0 * PI * x).ln();
    }
    // The mean of e^(x cos φ) over the circle, which equal steps give to ten digits here.
    let at = |k: u32| (x * ((PI * f64::from(k) / f64::from(HALF_CIRCLE)).cos() - 1.0)).exp();
    let inside: f64 = (1..HALF_CIRCLE).map(at).sum();
    ((0.5 * (at(0) + at(HALF_CIRCLE)) + inside) / f64::from(HALF_CIRCLE)).ln()
}

#[cfg(test)]
mod tests {
    /// Log Bayes factor below which amplitudes are of no train: three to one.
    const OF_NO_TRAIN: f64 = -1.1;

    use super::*;

    /// Amplitudes with an error of 1 mm/s, of a wave of 8 mm/s.
    fn alike(amplitudes_mm_s: &[f64]) -> f64 {
        of_amplitudes(&amplitudes_mm_s.iter().map(|a| (a * 1e-3, 1e-3)).collect::<Vec<_>>(), 8e-3)
    }

    /// Abramowitz and Stegun 1964, table 9.8.
    #[test]
    fn accuracy_of_the_bessel_function_is_six_digits() {
        for (x, i0_less) in [(0.0, 1.0_f64), (1.0, 0.465_759_6), (5.0, 0.183_540_8), (10.0, 0.127_833_3), (20.0, 0.089_780_3)] {
            assert!((ln_i0_less(x).exp() / i0_less - 1.0).abs() < 1e-6, "{x}: {}", ln_i0_less(x).exp());
        }
        // Both sides of where it goes on otherwise: the next term of the series is 9/128 x².
        let (below, above) = (ln_i0_less(ASYMPTOTIC_FROM), ln_i0_less(ASYMPTOTIC_FROM * (1.0 + 1e-9)));
        assert!((below - above).abs() < 4e-5, "{below} {above}");
    }

    /// A train, what convection left in six runs of a simulated flight, and what tells nothing.
    #[test]
    fn amplitudes_of_a_train_are_alike_and_those_of_convection_are_not() {
        assert!(alike(&[8.2, 9.7, 11.7, 8.7, 6.9, 6.2]) > 1.0);
        assert!(alike(&[12.2, 0.9, 2.8, 0.8, 3.7, 6.2]) < OF_NO_TRAIN - 1.0);
        // A packet that one run of five has missed.
        assert!(alike(&[8.0, 8.5, 0.5, 7.5, 8.2]) > OF_NO_TRAIN);
        let unknown = of_amplitudes(&[(8e-3, 0.1), (1e-3, 0.1)], 8e-3);
        assert!(unknown.abs() < 0.05, "{unknown}");
    }
}
