//! The steady comparison of one flight, as printed and as JSON.

use serde::Serialize;

use super::fit::{Channels, Parameter, fit};
use super::glide::{GlideModel, LIFT_SLOPE_PER_RAD};
use super::identify::{Identification, Nuisance, SPEED_NOISE_M_S, SpeedCheck, VERTICAL_NOISE_M_S, identify, speed_check};
use super::ladder::{Rung, Step, ladder};
use super::samples::SteadySamples;
use logs::record::flight::Flight;
use logs::record::steady::SteadyFilter;

/// Why there is no report.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SteadyError {
    /// No steady samples.
    Samples(super::samples::SamplesError),
    /// No fit.
    Fit(super::fit::FitError),
    /// Too few legs to judge a model on.
    FewLegs {
        /// Flight.
        flight: String,
        /// Its steady legs.
        legs: usize,
        /// Legs that are needed.
        fewest: usize,
    },
}

impl std::fmt::Display for SteadyError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Samples(e) => e.fmt(f),
            Self::Fit(e) => e.fmt(f),
            Self::FewLegs { flight, legs, fewest } => {
                write!(f, "{flight}: {legs} steady legs; at least {fewest} are needed to judge a model on")
            }
        }
    }
}

impl std::error::Error for SteadyError {}

impl From<super::samples::SamplesError> for SteadyError {
    fn from(e: super::samples::SamplesError) -> Self {
        Self::Samples(e)
    }
}

impl From<super::fit::FitError> for SteadyError {
    fn from(e: super::fit::FitError) -> Self {
        Self::Fit(e)
    }
}

/// The steady comparison of one flight.
#[derive(Clone, Debug, Serialize)]
pub struct SteadyReport {
    /// Flight.
    pub flight: String,
    /// Steady samples used.
    pub samples: usize,
    /// Filter that chose them; absent if the flight's own `steady` column did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<SteadyFilter>,
    /// Error of the nominal model (nothing fitted, one density), rms of vertical velocity, cm/s.
    pub before_cm_s: f64,
    /// Error with drag and trim fitted and one density, cm/s.
    pub trim_cm_s: f64,
    /// Error with drag and trim fitted and the measured in-situ density, cm/s.
    pub after_cm_s: f64,
    /// Every step.
    pub ladder: Vec<Step>,
    /// Model speed against measured speed, vertical velocity alone fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<SpeedCheck>,
    /// The same with the pitch scale fitted to both channels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with_speed: Option<WithSpeed>,
    /// What vertical velocity alone can tell of lift slope and pitch scale (the latter decides the speed).
    pub identification: Vec<Identification>,
    /// The same in one sentence for a person.
    pub identified: String,
}

/// What the speed channel adds.
#[derive(Clone, Debug, Serialize)]
pub struct WithSpeed {
    /// Pitch scale, true over measured, -.
    pub pitch_scale: f64,
    /// Error of vertical velocity, cm/s.
    pub rms_cm_s: f64,
    /// Model speed against measured speed.
    pub speed: SpeedCheck,
    /// Whether the pitch scale is told by both channels together.
    pub identification: Identification,
}

/// Fitted together in the identification: the full steady model without the pitch zero.
const BASE: [Parameter; 3] = [Parameter::Cd0, Parameter::TrimMass, Parameter::Compressibility];
/// Lift slopes that sea data and theory allow, as multiples of the nominal: 0.454 to 1.2 m²/rad against 0.753 (fits at sea, slender-body theory).
const LIFT_RANGE: [f64; 2] = [0.6, 1.6];
/// Pitch scales that are not ruled out beforehand (a real vehicle needed 0.86).
const PITCH_SCALE_RANGE: [f64; 2] = [0.85, 1.15];

/// Compares `flight` with the steady glide.
///
/// # Errors
/// [`SteadyError`].
pub fn steady_report(flight: &Flight) -> Result<SteadyReport, SteadyError> {
    let samples = SteadySamples::of(flight)?;
    let ladder = ladder(&samples, None)?;
    let rms = |rung| ladder.iter().find(|s| s.rung == rung).map_or(f64::NAN, |s| s.rms_cm_s);
    let start = samples.nominal_model(false);
    let base = fit(&samples, &start, &BASE, Channels::Vertical)?;
    let lift_anywhere = [LIFT_RANGE[0], 1.0, LIFT_RANGE[1]].map(|k| k * LIFT_SLOPE_PER_RAD);
    let pitch_anywhere = [PITCH_SCALE_RANGE[0], 1.0, PITCH_SCALE_RANGE[1]];
    let open_lift = Some(Nuisance { parameter: Parameter::LiftSlope, values: &lift_anywhere });
    let open_pitch = Some(Nuisance { parameter: Parameter::PitchScale, values: &pitch_anywhere });
    let lift = LIFT_RANGE.map(|k| k * LIFT_SLOPE_PER_RAD);
    let identification = vec![
        identify(&samples, &start, &BASE, open_pitch, Parameter::LiftSlope, lift, Channels::Vertical)?,
        identify(&samples, &start, &BASE, open_lift, Parameter::PitchScale, PITCH_SCALE_RANGE, Channels::Vertical)?,
    ];
    let with_speed = if samples.has_speed() { Some(with_speed(&samples, &start)?) } else { None };
    Ok(SteadyReport {
        flight: flight.name.clone(),
        samples: samples.len(),
        filter: samples.filter,
        before_cm_s: rms(Rung::Nominal),
        trim_cm_s: rms(Rung::TrimConstantDensity),
        after_cm_s: rms(Rung::TrimMeasuredDensity),
        speed: speed_check(&samples, &base.model),
        with_speed,
        identified: sentence(&identification),
        identification,
        ladder,
    })
}

/// Fits the pitch scale to vertical velocity and speed together.
///
/// # Errors
/// [`SteadyError`].
fn with_speed(samples: &SteadySamples, start: &GlideModel) -> Result<WithSpeed, SteadyError> {
    let channels = Channels::VerticalAndSpeed { vertical_m_s: VERTICAL_NOISE_M_S, speed_m_s: SPEED_NOISE_M_S };
    let free = [BASE.as_slice(), &[Parameter::PitchScale]].concat();
    let both = fit(samples, start, &free, channels)?;
    let around = PITCH_SCALE_RANGE.map(|k| k * both.model.pitch_scale);
    let speed = speed_check(samples, &both.model).ok_or(super::fit::FitError::NoSpeedChannel)?;
    Ok(WithSpeed {
        pitch_scale: both.model.pitch_scale,
        rms_cm_s: super::ladder::rms_cm_s(samples, &both.model),
        speed,
        identification: identify(samples, start, &free, None, Parameter::PitchScale, around, channels)?,
    })
}

fn sentence(identification: &[Identification]) -> String {
    let mut parts = Vec::new();
    for one in identification {
        let name = match one.parameter {
            Parameter::LiftSlope => "the lift slope",
            Parameter::PitchScale => "the pitch scale, and with it the speed through water",
            _ => continue,
        };
        let tells = if one.identified { "tells" } else { "does not tell" };
        let tries = [0, 1].map(|i: usize| match (one.rms_cm_s[i], one.speed_m_s[i]) {
            (Some(rms), Some(speed)) => format!("with {:.2} the model is off by {rms:.2} cm/s at {speed:.3} m/s", one.tried[i]),
            _ => format!("with {:.2} there is no steady glide", one.tried[i]),
        });
        parts.push(format!("vertical velocity alone {tells} {name}: {}, {}", tries[0], tries[1]));
    }
    parts.join("; ")
}
