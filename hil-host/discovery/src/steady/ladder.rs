//! How far does the error fall with each physical effect, on the flight it was fitted to and on another?
//!
//! The steps are cumulative. The second column, a flight the fit never saw, is
//! the one to believe: a true effect can barely help in sample and halve the
//! error out of sample, and the true density alone can raise the error until
//! hull compressibility is added too.
//!
//! Lift slope and drag growth are not freed on any step: the error falls a
//! little further and the angle of attack runs to 42°. What cannot be told is
//! the business of [`super::identify`].

use serde::Serialize;

use super::fit::{Channels, Fit, FitError, Parameter, fit, residuals};
use super::glide::GlideModel;
use super::samples::SteadySamples;

/// One step of the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rung {
    /// Published coefficients, one density, nothing fitted.
    Nominal,
    /// Parasite drag and trim mass fitted, one density.
    TrimConstantDensity,
    /// The same with the measured in-situ density.
    TrimMeasuredDensity,
    /// And hull compressibility.
    Compressibility,
    /// And hull thermal expansion.
    ThermalExpansion,
    /// And the pitch zero.
    PitchOffset,
}

/// Every step, first to last.
pub const RUNGS: [Rung; 6] =
    [Rung::Nominal, Rung::TrimConstantDensity, Rung::TrimMeasuredDensity, Rung::Compressibility, Rung::ThermalExpansion, Rung::PitchOffset];

impl Rung {
    /// What is fitted on this step.
    #[must_use]
    pub fn free(self) -> &'static [Parameter] {
        use Parameter::{Cd0, Compressibility, PitchOffset, ThermalExpansion, TrimMass};
        match self {
            Self::Nominal => &[],
            Self::TrimConstantDensity | Self::TrimMeasuredDensity => &[Cd0, TrimMass],
            Self::Compressibility => &[Cd0, TrimMass, Compressibility],
            Self::ThermalExpansion => &[Cd0, TrimMass, Compressibility, ThermalExpansion],
            Self::PitchOffset => &[Cd0, TrimMass, Compressibility, ThermalExpansion, PitchOffset],
        }
    }

    /// Whether one density stands for all the water.
    #[must_use]
    pub fn constant_density(self) -> bool {
        matches!(self, Self::Nominal | Self::TrimConstantDensity)
    }

    /// What the step adds, for a person.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Nominal => "nominal coefficients, constant density",
            Self::TrimConstantDensity => "drag and trim fitted, constant density",
            Self::TrimMeasuredDensity => "+ measured in-situ density",
            Self::Compressibility => "+ hull compressibility",
            Self::ThermalExpansion => "+ hull thermal expansion",
            Self::PitchOffset => "+ pitch offset",
        }
    }
}

/// One step's result.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// Which.
    pub rung: Rung,
    /// What it adds.
    pub title: &'static str,
    /// Error on the fitted flight: rms of vertical velocity over steady samples, cm/s.
    pub rms_cm_s: f64,
    /// The same on a flight that was not fitted, cm/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test_rms_cm_s: Option<f64>,
    /// The model with the fitted values.
    pub model: GlideModel,
}

/// Fits one step on `train`.
///
/// # Errors
/// [`FitError`].
pub fn climb(train: &SteadySamples, rung: Rung) -> Result<Fit, FitError> {
    fit(train, &train.nominal_model(rung.constant_density()), rung.free(), Channels::Vertical)
}

/// Error of `model` on `samples`: rms of vertical velocity, cm/s; NaN if it has no value on some sample.
#[must_use]
pub fn rms_cm_s(samples: &SteadySamples, model: &GlideModel) -> f64 {
    let r = residuals(samples, model, Channels::Vertical);
    100.0 * (r.norm_squared() / r.len() as f64).sqrt()
}

/// All steps that the flight's channels allow (no temperature: no thermal expansion and nothing after it but the pitch zero).
///
/// # Errors
/// [`FitError`].
pub fn ladder(train: &SteadySamples, test: Option<&SteadySamples>) -> Result<Vec<Step>, FitError> {
    let mut out = Vec::new();
    for rung in RUNGS {
        if rung.free().contains(&Parameter::ThermalExpansion) && !train.has_temperature() {
            continue;
        }
        let Fit { model, rms, .. } = climb(train, rung)?;
        out.push(Step { rung, title: rung.title(), rms_cm_s: 100.0 * rms, test_rms_cm_s: test.map(|t| rms_cm_s(t, &model)), model });
    }
    Ok(out)
}
