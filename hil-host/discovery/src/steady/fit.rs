//! Which parameter values make the steady glide agree best with the samples?
//!
//! Damped Gauss–Newton (Levenberg–Marquardt) on residuals with forward
//! differences; at most seven parameters, so the normal equations of parameters
//! scaled to order one are well behaved. The crate `levenberg-marquardt` was looked at; its
//! release is tied to an older nalgebra, and two of those cost more than these
//! sixty lines.

use nalgebra::{DMatrix, DVector};

use super::glide::{CD0, DRAG_PER_RAD2, GlideModel, LIFT_SLOPE_PER_RAD};
use super::samples::SteadySamples;

/// One thing that may be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Parameter {
    /// Cd0.
    Cd0,
    /// dm.
    TrimMass,
    /// ε.
    Compressibility,
    /// a_T.
    ThermalExpansion,
    /// Pitch offset.
    PitchOffset,
    /// Pitch scale.
    PitchScale,
    /// a.
    LiftSlope,
    /// Cd1.
    DragGrowth,
}

impl Parameter {
    /// Size of an ordinary change: the unit the optimiser works in.
    fn scale(self) -> f64 {
        match self {
            Self::Cd0 => CD0,
            Self::TrimMass => 0.1,          // kg: 100 cc of water
            Self::Compressibility => 5e-10, // 1/Pa: a Slocum hull
            Self::ThermalExpansion => 6e-5, // 1/K: a Seaglider hull
            Self::PitchOffset => 0.02,      // rad: about one degree
            Self::PitchScale => 1.0,
            Self::LiftSlope => LIFT_SLOPE_PER_RAD,
            Self::DragGrowth => DRAG_PER_RAD2,
        }
    }

    /// Value in a model.
    #[must_use]
    pub fn get(self, model: &GlideModel) -> f64 {
        match self {
            Self::Cd0 => model.cd0,
            Self::TrimMass => model.trim_mass_kg,
            Self::Compressibility => model.compressibility_per_pa,
            Self::ThermalExpansion => model.thermal_expansion_per_k,
            Self::PitchOffset => model.pitch_offset_rad,
            Self::PitchScale => model.pitch_scale,
            Self::LiftSlope => model.lift_slope_per_rad,
            Self::DragGrowth => model.drag_per_rad2,
        }
    }

    /// Sets the value in a model.
    pub fn set(self, model: &mut GlideModel, value: f64) {
        match self {
            Self::Cd0 => model.cd0 = value,
            Self::TrimMass => model.trim_mass_kg = value,
            Self::Compressibility => model.compressibility_per_pa = value,
            Self::ThermalExpansion => model.thermal_expansion_per_k = value,
            Self::PitchOffset => model.pitch_offset_rad = value,
            Self::PitchScale => model.pitch_scale = value,
            Self::LiftSlope => model.lift_slope_per_rad = value,
            Self::DragGrowth => model.drag_per_rad2 = value,
        }
    }
}

/// Which channels are to agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Channels {
    /// Vertical velocity alone.
    Vertical,
    /// Vertical velocity and speed through the water, each divided by its noise.
    VerticalAndSpeed {
        /// Noise of w, m/s.
        vertical_m_s: f64,
        /// Noise of U, m/s.
        speed_m_s: f64,
    },
}

/// A finished fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Model with the fitted values.
    pub model: GlideModel,
    /// Root mean square of the fitted residuals: m/s for w alone, else in units of the noise.
    pub rms: f64,
    /// Number of residuals.
    pub residuals: usize,
    /// Steps taken.
    pub steps: usize,
}

/// Why there is no fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer samples than ten per parameter.
    TooFewSamples {
        /// Usable samples.
        samples: usize,
        /// Needed.
        needed: usize,
    },
    /// The model has no value on some sample: a channel is missing.
    NotFinite {
        /// Number of such samples.
        samples: usize,
    },
    /// The channel is not in the flight.
    NoSpeedChannel,
    /// No convergence within the bound.
    DidNotSettle,
}

impl std::fmt::Display for FitError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFewSamples { samples, needed } => {
                write!(f, "{samples} steady samples, {needed} needed: the flight has too little steady gliding")
            }
            Self::NotFinite { samples } => {
                write!(f, "the steady model has no value on {samples} samples: a channel is missing there")
            }
            Self::NoSpeedChannel => write!(f, "the flight has no speed through the water"),
            Self::DidNotSettle => write!(f, "the fit did not settle: this flight cannot distinguish the parameters asked for"),
        }
    }
}

impl std::error::Error for FitError {}

/// Bound on Gauss–Newton steps; well-posed fits take 4–8.
const MAX_STEPS: usize = 200;

/// Fits `free` starting from `start`.
///
/// # Errors
/// [`FitError`].
pub fn fit(samples: &SteadySamples, start: &GlideModel, free: &[Parameter], channels: Channels) -> Result<Fit, FitError> {
    let needed = 10 * free.len().max(1);
    if samples.len() < needed {
        return Err(FitError::TooFewSamples { samples: samples.len(), needed });
    }
    if matches!(channels, Channels::VerticalAndSpeed { .. }) && !samples.has_speed() {
        return Err(FitError::NoSpeedChannel);
    }
    let mut model = *start;
    let mut residual = residuals(samples, &model, channels);
    let bad = residual.iter().filter(|r| !r.is_finite()).count();
    if bad > 0 {
        return Err(FitError::NotFinite { samples: bad });
    }
    let mut cost = residual.norm_squared();
    let mut damping = 1e-3;
    for step in 0..MAX_STEPS {
        let jacobian = jacobian(samples, &model, free, channels, &residual);
        let gradient = jacobian.transpose() * &residual;
        let normal = jacobian.transpose() * &jacobian;
        let mut improved = false;
        let mut relative_gain = 0.0;
        while damping < 1e12 {
            let mut damped = normal.clone();
            for i in 0..free.len() {
                damped[(i, i)] += damping * normal[(i, i)].max(1e-30);
            }
            let Some(delta) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                damping *= 10.0;
                continue;
            };
            let mut trial = model;
            for (i, p) in free.iter().enumerate() {
                p.set(&mut trial, p.get(&model) - delta[i] * p.scale());
            }
            if !physical(&trial) {
                damping *= 5.0;
                continue;
            }
            let trial_residual = residuals(samples, &trial, channels);
            let trial_cost = trial_residual.norm_squared();
            // A NaN cost is not an improvement.
            if trial_cost < cost {
                relative_gain = (cost - trial_cost) / cost;
                (model, residual, cost) = (trial, trial_residual, trial_cost);
                damping = (damping * 0.2).max(1e-12);
                improved = true;
                break;
            }
            damping *= 5.0;
        }
        if !improved || relative_gain < 1e-10 {
            return Ok(Fit { model, rms: (cost / residual.len() as f64).sqrt(), residuals: residual.len(), steps: step + 1 });
        }
    }
    Err(FitError::DidNotSettle)
}

/// Drag that drives, or lift that sucks, is no glider.
fn physical(model: &GlideModel) -> bool {
    model.cd0 > 0.0 && model.drag_per_rad2 >= 0.0 && model.lift_slope_per_rad > 0.0 && model.pitch_scale > 0.0
}

/// Model minus measurement.
pub fn residuals(samples: &SteadySamples, model: &GlideModel, channels: Channels) -> DVector<f64> {
    let n = samples.len();
    match channels {
        Channels::Vertical => {
            DVector::from_iterator(n, samples.rows().map(|(input, row)| model.glide(&input).vertical_m_s - row.vertical_m_s))
        }
        Channels::VerticalAndSpeed { vertical_m_s, speed_m_s } => {
            let mut all = Vec::with_capacity(2 * n);
            for (input, row) in samples.rows() {
                let glide = model.glide(&input);
                all.push((glide.vertical_m_s - row.vertical_m_s) / vertical_m_s);
                if row.speed_m_s.is_finite() {
                    all.push((glide.speed_m_s - row.speed_m_s) / speed_m_s);
                }
            }
            DVector::from_vec(all)
        }
    }
}

fn jacobian(samples: &SteadySamples, model: &GlideModel, free: &[Parameter], channels: Channels, at: &DVector<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(at.len(), free.len());
    for (i, p) in free.iter().enumerate() {
        let h = 1e-6 * p.scale();
        let mut moved = *model;
        p.set(&mut moved, p.get(model) + h);
        // Per unit of scale, so that all columns are of one order.
        out.set_column(i, &((residuals(samples, &moved, channels) - at) / 1e-6));
    }
    out
}
