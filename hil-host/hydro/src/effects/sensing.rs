//! Effects of the sensors: what is measured is not what is true.

use super::{Calibrated, DAY_S, Effect, InFlow, Parameter, Sensed};

/// Measured pitch = true pitch + offset.
#[derive(Clone, Copy, Debug)]
pub struct PitchOffset;

impl Effect for PitchOffset {
    fn name(&self) -> &'static str {
        "pitch_offset"
    }
    fn physics(&self) -> &'static str {
        "the pitch sensor is not aligned with the hull: dives look steeper and climbs shallower than they are, or the reverse"
    }
    fn separated_by(&self) -> &'static str {
        "a level bench; legs at several pitches with a speed sensor"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::PitchZero)
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "offset_rad",
            unit: "rad",
            off: 0.0,
            low: -0.2,
            high: 0.2,
            typical: 0.02,
            source: "0.5-2 deg on real vehicles",
        }]
    }
    fn acts_on_sensors(&self) -> bool {
        true
    }
    fn sensed(&self, p: &[f64], s: &mut Sensed) {
        s.pitch_rad -= p[0];
    }
}

/// Measured pitch = true pitch (1 + gain_error).
#[derive(Clone, Copy, Debug)]
pub struct PitchScale;

impl Effect for PitchScale {
    fn name(&self) -> &'static str {
        "pitch_scale"
    }
    fn physics(&self) -> &'static str {
        "the gain of the pitch sensor is wrong: steep legs are wrong in proportion"
    }
    fn separated_by(&self) -> &'static str {
        "a sweep of pitch with a speed sensor; a tilt table"
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "gain_error",
            unit: "1",
            off: 0.0,
            low: -0.5,
            high: 0.7,
            typical: 0.06,
            source: "raw pitch of one public Slocum flight is 1/0.86 too steep",
        }]
    }
    fn acts_on_sensors(&self) -> bool {
        true
    }
    fn sensed(&self, p: &[f64], s: &mut Sensed) {
        s.pitch_rad /= 1.0 + p[0];
    }
}

/// Measured density = true density + bias.
#[derive(Clone, Copy, Debug)]
pub struct DensityBias;

impl Effect for DensityBias {
    fn name(&self) -> &'static str {
        "density_bias"
    }
    fn physics(&self) -> &'static str {
        "the CTD's density is off by a constant, which acts like a constant error of buoyancy"
    }
    fn separated_by(&self) -> &'static str {
        "a calibrated CTD cast beside the glider; the vertical velocity alone cannot tell it from a trim error"
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "bias_kg_m3",
            unit: "kg/m^3",
            off: 0.0,
            low: -3.0,
            high: 3.0,
            typical: 0.2,
            source: "conductivity cell fouling, 0.01-0.5 kg/m3",
        }]
    }
    fn acts_on_sensors(&self) -> bool {
        true
    }
    fn sensed(&self, p: &[f64], s: &mut Sensed) {
        s.density_kg_m3 -= p[0];
    }
}

/// Measured pressure = true pressure + rate t.
#[derive(Clone, Copy, Debug)]
pub struct PressureDrift;

impl Effect for PressureDrift {
    fn name(&self) -> &'static str {
        "pressure_drift"
    }
    fn physics(&self) -> &'static str {
        "the zero of the pressure sensor drifts in time: readings at the surface show it"
    }
    fn separated_by(&self) -> &'static str {
        "pressure readings at the surface before and after every leg"
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "rate_dbar_per_day",
            unit: "dbar/day",
            off: 0.0,
            low: -20.0,
            high: 20.0,
            typical: 0.3,
            source: "a sick strain gauge; guess",
        }]
    }
    fn acts_on_depth(&self) -> bool {
        true
    }
    fn pressure_error_pa(&self, p: &[f64], time_s: f64) -> f64 {
        p[0] * 1e4 * time_s / DAY_S
    }
}
