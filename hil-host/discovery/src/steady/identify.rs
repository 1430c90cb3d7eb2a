//! What can these channels tell, and what can they not?
//!
//! A parameter is tried at a low and a high value that a good engineer could
//! not rule out beforehand; everything else is refitted each time. If the error
//! hardly moves, the flight does not tell that parameter, however small the
//! error is. "Hardly": twice the loss of log-likelihood stays under 3.84 (95 %
//! of χ² with one degree of freedom), counting independent samples: as many as
//! the colour of the residual leaves (integral time scale of its
//! autocorrelation), and no more than there are legs, since what a steady model
//! gets wrong it gets wrong in the same way at the same depth of every leg.
//! Counting logged samples instead rules out the pitch scale that a bench found.
//!
//! Structure behind it: w and pitch fix only ratios. (buoyancy, Cd0, Cd1, a)
//! scale freely together, and a pitch scale trades against drag with the
//! vertical velocity unchanged and the speed through water 14 % off.

use serde::Serialize;

use super::fit::{Channels, Fit, FitError, Parameter, fit, residuals};
use super::glide::GlideModel;
use super::samples::SteadySamples;

/// 95 % of χ² with one degree of freedom.
const CHI2_95: f64 = 3.84;

/// Noise of w when speed is used beside it, m/s: the steady model's own error on the reference flights, 0.44–0.65 cm/s.
pub const VERTICAL_NOISE_M_S: f64 = 0.005;
/// Noise of a DVL's speed through water, m/s: 2–3 cm/s scatter about a steady glide (Comet 2016).
pub const SPEED_NOISE_M_S: f64 = 0.025;

/// Verdict on one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// Which.
    pub parameter: Parameter,
    /// Values tried.
    pub tried: [f64; 2],
    /// Best error of w with each value held, cm/s; none where no steady glide exists.
    pub rms_cm_s: [Option<f64>; 2],
    /// Mean speed through water that the model then claims, m/s.
    pub speed_m_s: [Option<f64>; 2],
    /// Loss of evidence of each against the best of all (2 Δ log-likelihood).
    pub evidence: [Option<f64>; 2],
    /// Independent samples in the residual.
    pub independent_samples: f64,
    /// Whether both values are ruled out.
    pub identified: bool,
}

/// A parameter that nobody can rule out within a range: each value is tried, the best counts.
#[derive(Clone, Copy, Debug)]
pub struct Nuisance<'a> {
    /// Which.
    pub parameter: Parameter,
    /// Values of its range.
    pub values: &'a [f64],
}

/// Tries `parameter` at two values with all of `free` refitted and `nuisance`, if any, anywhere in its range.
///
/// # Errors
/// [`FitError`].
pub fn identify(
    samples: &SteadySamples,
    start: &GlideModel,
    free: &[Parameter],
    nuisance: Option<Nuisance<'_>>,
    parameter: Parameter,
    tried: [f64; 2],
    channels: Channels,
) -> Result<Identification, FitError> {
    let best_of = |start: &GlideModel, free: &[Parameter]| -> Result<Fit, FitError> {
        let Some(nuisance) = nuisance else { return fit(samples, start, free, channels) };
        let mut best: Option<Fit> = None;
        for value in nuisance.values {
            let mut held = *start;
            nuisance.parameter.set(&mut held, *value);
            match fit(samples, &held, free, channels) {
                Ok(one) if best.as_ref().is_none_or(|b| one.rms < b.rms) => best = Some(one),
                // Stalled somewhere, or running away: this value is no way out.
                Ok(_) | Err(FitError::NotFinite { .. } | FitError::DidNotSettle) => {}
                Err(e) => return Err(e),
            }
        }
        best.ok_or(FitError::DidNotSettle)
    };
    let base = best_of(start, free)?;
    let coloured = independent_samples(residuals(samples, &base.model, Channels::Vertical).as_slice());
    let independent_samples = coloured.min(legs(samples) as f64);
    let others: Vec<Parameter> = free.iter().copied().filter(|p| *p != parameter).collect();
    let mut fits = Vec::new();
    for value in tried {
        let mut held = base.model;
        parameter.set(&mut held, value);
        fits.push(match best_of(&held, &others) {
            Ok(fit) => Some(fit),
            // No glide at this value explains the flight: the strongest evidence there is.
            Err(FitError::NotFinite { .. } | FitError::DidNotSettle) => None,
            Err(e) => return Err(e),
        });
    }
    let best = fits.iter().flatten().map(|f| f.rms).fold(base.rms, f64::min);
    let each = |value: &dyn Fn(&Fit) -> f64| [0, 1].map(|i: usize| fits[i].as_ref().map(value));
    let evidence = each(&|f| 2.0 * independent_samples * (f.rms / best).ln());
    Ok(Identification {
        parameter,
        tried,
        rms_cm_s: each(&|f| super::ladder::rms_cm_s(samples, &f.model)),
        speed_m_s: each(&|f| mean_speed(samples, &f.model)),
        evidence,
        independent_samples,
        identified: evidence.iter().all(|e| e.is_none_or(|e| e > CHI2_95)),
    })
}

/// Number of dives and climbs: runs of one sign of w without a gap of a minute.
#[must_use]
pub fn legs(samples: &SteadySamples) -> usize {
    let rows: Vec<_> = samples.rows().map(|(_, row)| row).collect();
    let new = |pair: &[super::samples::Row]| pair[1].time_s - pair[0].time_s > 60.0 || pair[0].vertical_m_s * pair[1].vertical_m_s < 0.0;
    1 + rows.windows(2).filter(|pair| new(pair)).count()
}

/// Mean modelled speed through water, m/s.
#[must_use]
pub fn mean_speed(samples: &SteadySamples, model: &GlideModel) -> f64 {
    samples.rows().map(|(input, _)| model.glide(&input).speed_m_s).sum::<f64>() / samples.len() as f64
}

/// Number of samples divided by the integral time scale of the autocorrelation (summed to its first zero crossing).
#[must_use]
pub fn independent_samples(residual: &[f64]) -> f64 {
    let n = residual.len();
    let mean = residual.iter().sum::<f64>() / n as f64;
    let variance = residual.iter().map(|r| (r - mean).powi(2)).sum::<f64>();
    let mut scale = 1.0;
    for lag in 1..n / 4 {
        let rho = residual.iter().zip(&residual[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / variance;
        if !(rho > 0.0) {
            break;
        }
        scale += 2.0 * rho;
    }
    n as f64 / scale
}

/// Model against the measured speed through water.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SpeedCheck {
    /// Samples with a measured speed.
    pub samples: usize,
    /// Mean of model less measurement, cm/s.
    pub bias_cm_s: f64,
    /// The same as a share of the mean measured speed, %.
    pub bias_percent: f64,
    /// Scatter about the bias, cm/s.
    pub scatter_cm_s: f64,
}

/// Compares the model's speed with the measured one; `None` without measurements.
#[must_use]
pub fn speed_check(samples: &SteadySamples, model: &GlideModel) -> Option<SpeedCheck> {
    let pairs: Vec<(f64, f64)> = samples
        .rows()
        .filter(|(_, row)| row.speed_m_s.is_finite())
        .map(|(input, row)| (model.glide(&input).speed_m_s, row.speed_m_s))
        .collect();
    if pairs.is_empty() {
        return None;
    }
    let n = pairs.len() as f64;
    let bias = pairs.iter().map(|(m, o)| m - o).sum::<f64>() / n;
    let mean = pairs.iter().map(|(_, o)| o).sum::<f64>() / n;
    let scatter = (pairs.iter().map(|(m, o)| (m - o - bias).powi(2)).sum::<f64>() / n).sqrt();
    Some(SpeedCheck { samples: pairs.len(), bias_cm_s: 100.0 * bias, bias_percent: 100.0 * bias / mean, scatter_cm_s: 100.0 * scatter })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_noise_counts_in_full_and_a_slow_wave_hardly() {
        // Linear congruential numbers: any white sequence does.
        let mut state = 1_u64;
        let white: Vec<f64> = (0..4000)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
            })
            .collect();
        assert!(independent_samples(&white) > 3000.0);
        let wave: Vec<f64> = (0..4000).map(|i| (f64::from(i) * std::f64::consts::TAU / 1000.0).sin()).collect();
        assert!(independent_samples(&wave) < 30.0);
    }
}
