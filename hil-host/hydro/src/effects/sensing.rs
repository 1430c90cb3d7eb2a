//! Effects of the sensors: what is measured is not what is true.

use super::{Calibrated, DAY_S, Effect, Parameter};

/// Measured pitch = true pitch + offset.
pub static PITCH_OFFSET: Effect = Effect {
    name: "pitch_offset",
    physics: "the pitch sensor is not aligned with the hull: dives look steeper and climbs shallower than they are, or the reverse",
    separated_by: "a level bench; legs at several pitches with a speed sensor",
    parameters: &[Parameter::new("offset_rad", "rad", 0.0, (-0.2, 0.2), 0.02, "0.5-2 deg on real vehicles")],
    error_of: Some(Calibrated::PitchZero),
    sensed: Some(&|p, s| s.pitch_rad -= p[0]),
    ..Effect::NONE
};

/// Measured pitch = true pitch (1 + gain_error).
pub static PITCH_SCALE: Effect = Effect {
    name: "pitch_scale",
    physics: "the gain of the pitch sensor is wrong: steep legs are wrong in proportion",
    separated_by: "a sweep of pitch with a speed sensor; a tilt table",
    parameters: &[Parameter::new("gain_error", "1", 0.0, (-0.5, 0.7), 0.06, "raw pitch of one public Slocum flight is 1/0.86 too steep")],
    sensed: Some(&|p, s| s.pitch_rad /= 1.0 + p[0]),
    ..Effect::NONE
};

/// Measured density = true density + bias.
pub static DENSITY_BIAS: Effect = Effect {
    name: "density_bias",
    physics: "the CTD's density is off by a constant, which acts like a constant error of buoyancy",
    separated_by: "a calibrated CTD cast beside the glider; the vertical velocity alone cannot tell it from a trim error",
    parameters: &[Parameter::new("bias_kg_m3", "kg/m^3", 0.0, (-3.0, 3.0), 0.2, "conductivity cell fouling, 0.01-0.5 kg/m3")],
    sensed: Some(&|p, s| s.density_kg_m3 -= p[0]),
    ..Effect::NONE
};

/// Measured pressure = true pressure + rate t.
pub static PRESSURE_DRIFT: Effect = Effect {
    name: "pressure_drift",
    physics: "the zero of the pressure sensor drifts in time: readings at the surface show it",
    separated_by: "pressure readings at the surface before and after every leg",
    parameters: &[Parameter::new("rate_dbar_per_day", "dbar/day", 0.0, (-20.0, 20.0), 0.3, "a sick strain gauge; guess")],
    pressure_error_pa: Some(&|p, time_s| p[0] * 1e4 * time_s / DAY_S),
    ..Effect::NONE
};
