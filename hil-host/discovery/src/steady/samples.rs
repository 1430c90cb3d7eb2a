//! The steady samples of a flight, as the steady model is judged by them.
//!
//! A flight that brings columns `w_obs_m_s` and `steady` is taken at its word; of any other they are found by [`logs::record::steady`].

use super::glide::{GlideModel, Input};
use logs::record::flight::Flight;
use logs::record::steady::{SteadyFilter, depth_m, interpolated_quantile, steady, vertical_velocity};

/// One steady sample's measurements that the model is judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time since the start of the flight, s.
    pub time_s: f64,
    /// w, m/s, positive up.
    pub vertical_m_s: f64,
    /// U, m/s; NaN where not measured.
    pub speed_m_s: f64,
}

/// The steady samples of one flight.
#[derive(Clone, Debug)]
pub struct SteadySamples {
    inputs: Vec<Input>,
    rows: Vec<Row>,
    /// Filter that chose them; `None` if the flight's own `steady` column did.
    pub filter: Option<SteadyFilter>,
}

/// Why a flight has no steady samples.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SamplesError {
    /// A channel the model needs has no value at all.
    EmptyChannel {
        /// Its name in the flight format.
        column: &'static str,
    },
    /// No sample passed the filter.
    NothingSteady {
        /// Deepest point, m.
        max_depth_m: f64,
    },
}

impl std::fmt::Display for SamplesError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::EmptyChannel { column } => write!(f, "column {column} has no value: a steady comparison needs it"),
            Self::NothingSteady { max_depth_m } => write!(
                f,
                "no steady sample in a flight to {max_depth_m:.0} m: it needs gliding deeper than a few metres, steeper than 11 deg, with a still pump"
            ),
        }
    }
}

impl std::error::Error for SamplesError {}

impl SteadySamples {
    /// Chooses the steady samples of `flight`.
    ///
    /// # Errors
    /// [`SamplesError`].
    pub fn of(flight: &Flight) -> Result<Self, SamplesError> {
        for (column, values) in [
            ("pressure_dbar", &flight.pressure_pa),
            ("m_pitch_rad", &flight.pitch_rad),
            ("m_ballast_pumped_cc", &flight.ballast_m3),
            ("sci_density_kg_m3", &flight.density_kg_m3),
        ] {
            if !values.iter().any(|v| v.is_finite()) {
                return Err(SamplesError::EmptyChannel { column });
            }
        }
        let max_depth_m = interpolated_quantile(&depth_m(flight), 0.995);
        let (vertical, steady, filter) = match (flight.extra.get("w_obs_m_s"), flight.extra.get("steady")) {
            (Some(w), Some(s)) => (w.clone(), s.iter().map(|v| *v == 1.0).collect(), None),
            _ => {
                let filter = SteadyFilter::for_depth(max_depth_m);
                (vertical_velocity(flight), steady(flight, &filter), Some(filter))
            }
        };
        let mut out = Self { inputs: Vec::new(), rows: Vec::new(), filter };
        for i in 0..flight.len() {
            let input = Input {
                pitch_rad: flight.pitch_rad[i],
                ballast_m3: flight.ballast_m3[i],
                density_kg_m3: flight.density_kg_m3[i],
                pressure_pa: flight.pressure_pa[i],
                temperature_degc: flight.temperature_degc[i],
            };
            let whole =
                [input.pitch_rad, input.ballast_m3, input.density_kg_m3, input.pressure_pa, vertical[i]].iter().all(|v| v.is_finite());
            if steady[i] && whole {
                let speed_m_s = flight.speed_m_s.as_ref().map_or(f64::NAN, |u| u[i]);
                out.inputs.push(input);
                out.rows.push(Row { time_s: flight.time_s[i], vertical_m_s: vertical[i], speed_m_s });
            }
        }
        if out.rows.is_empty() { Err(SamplesError::NothingSteady { max_depth_m }) } else { Ok(out) }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none (never so for samples made by [`Self::of`]).
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Model inputs and measurements, sample by sample.
    pub fn rows(&self) -> impl Iterator<Item = (Input, Row)> + '_ {
        self.inputs.iter().copied().zip(self.rows.iter().copied())
    }

    /// Whether speed through the water was measured on some sample.
    #[must_use]
    pub fn has_speed(&self) -> bool {
        self.rows.iter().any(|r| r.speed_m_s.is_finite())
    }

    /// Whether temperature is known on every sample.
    #[must_use]
    pub fn has_temperature(&self) -> bool {
        self.inputs.iter().all(|i| i.temperature_degc.is_finite())
    }

    /// Mean in-situ density, kg/m³.
    #[must_use]
    pub fn mean_density_kg_m3(&self) -> f64 {
        self.inputs.iter().map(|i| i.density_kg_m3).sum::<f64>() / self.inputs.len() as f64
    }

    /// Mean water temperature, °C; NaN if it is not known everywhere.
    #[must_use]
    pub fn mean_temperature_degc(&self) -> f64 {
        self.inputs.iter().map(|i| i.temperature_degc).sum::<f64>() / self.inputs.len() as f64
    }

    /// The published coefficients in this flight's water.
    #[must_use]
    pub fn nominal_model(&self, constant_density: bool) -> GlideModel {
        let nominal = GlideModel::nominal(self.mean_density_kg_m3(), self.mean_temperature_degc());
        GlideModel { constant_density, ..nominal }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steady::glide::GRAVITY_M_S2;

    /// A sawtooth with sharp turns: 0.15 m/s down for 300 s, 0.15 m/s up for 300 s.
    fn sawtooth() -> Flight {
        let n = 600;
        let time_s: Vec<f64> = (0..n).map(f64::from).collect();
        let down = |t: f64| t < 300.0;
        let depth = |t: f64| if down(t) { 0.15 * t } else { 0.15 * (600.0 - t) };
        Flight {
            name: "sawtooth".into(),
            segment: vec![0; n as usize],
            pressure_pa: time_s.iter().map(|t| depth(*t) * 1025.0 * GRAVITY_M_S2).collect(),
            pitch_rad: time_s.iter().map(|t| if down(*t) { -0.45 } else { 0.45 }).collect(),
            ballast_m3: time_s.iter().map(|t| if down(*t) { -230e-6 } else { 230e-6 }).collect(),
            density_kg_m3: vec![1025.0; n as usize],
            temperature_degc: vec![10.0; n as usize],
            time_s,
            ..Flight::default()
        }
    }

    #[test]
    fn a_steady_dive_and_climb_are_measured_to_rounding() {
        let flight = sawtooth();
        let samples = SteadySamples::of(&flight).expect("steady");
        assert!([1.0, -1.0].iter().all(|sign| samples.rows().any(|(_, row)| sign * row.vertical_m_s > 0.0)));
        for (input, row) in samples.rows() {
            let truth = if input.pitch_rad < 0.0 { -0.15 } else { 0.15 };
            assert!((row.vertical_m_s - truth).abs() < 1e-9, "{row:?}");
            assert!((row.time_s - 300.0).abs() >= 30.0, "the turn is inside: {row:?}");
        }
    }

    #[test]
    fn a_gap_is_never_bridged() {
        let mut flight = sawtooth();
        for t in flight.time_s.iter_mut().skip(150) {
            *t += 120.0;
        }
        let w = vertical_velocity(&flight);
        assert!(w[145].is_nan() && w[155].is_nan());
        assert!((w[100] + 0.15).abs() < 1e-9 && (w[200] + 0.15).abs() < 1e-9);
    }

    #[test]
    fn an_empty_channel_is_named() {
        let mut flight = sawtooth();
        flight.density_kg_m3.fill(f64::NAN);
        assert_eq!(SteadySamples::of(&flight).unwrap_err(), SamplesError::EmptyChannel { column: "sci_density_kg_m3" });
    }
}
