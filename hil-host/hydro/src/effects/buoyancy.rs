//! Effects that change displaced volume.

use super::{Calibrated, Effect, Parameter};

/// Compressibility of a Slocum hull, 1/Pa (gliderflight 1.2.1): what a relative error is relative to where the vehicle file
/// says that the hull is rigid.
const SLOCUM_COMPRESSIBILITY_PER_PA: f64 = 5e-10;
/// The same for thermal expansion, 1/K: aluminium 7e-5 less its oil; a guess.
const SLOCUM_EXPANSION_PER_K: f64 = 5e-5;

/// What the file states, or a typical value where it states none at all (zero).
fn stated_or(stated: f64, typical: f64) -> f64 {
    if stated == 0.0 { typical } else { stated }
}

/// ε (1 + rel_error).
pub static HULL_COMPRESSIBILITY: Effect = Effect {
    name: "hull_compressibility",
    physics: "the hull yields to pressure more or less than the file says, so buoyancy drifts with depth",
    separated_by: "deep dives in water of little temperature contrast",
    parameters: &[
        Parameter::new("rel_error", "1", 0.0, (-1.5, 4.0), 0.3, "3-6e-10/Pa between vehicles, 5e-10/Pa Slocum"),
        Parameter::new("slope_per_mpa", "1/MPa", 0.0, (-0.3, 0.3), 0.05, "seals and foam settle; guess"),
    ],
    error_of: Some(Calibrated::HullCompressibility),
    constants: Some(&|p, c| c.compressibility_per_pa += stated_or(c.compressibility_per_pa, SLOCUM_COMPRESSIBILITY_PER_PA) * p[0]),
    volume_m3: Some(&|p, s, c| -c.hull_volume_m3 * c.compressibility_per_pa * s.pressure_pa * p[1] * s.pressure_pa * 1e-6),
    ..Effect::NONE
};

/// αT (1 + rel_error).
pub static THERMAL_EXPANSION: Effect = Effect {
    name: "thermal_expansion",
    physics: "the hull expands with temperature more or less than the file says, so buoyancy follows the temperature of the water",
    separated_by: "dives through different temperature profiles",
    parameters: &[
        Parameter::new("rel_error", "1", 0.0, (-3.0, 6.0), 0.5, "5-7e-5/K (Seaglider 7.05e-5, Deepglider 6.2e-5)"),
        Parameter::new("slope_per_k", "1/K", 0.0, (-0.04, 0.04), 0.01, "oils and plastics expand about 1 % more per kelvin; guess"),
        Parameter::new(
            "lag_share",
            "1",
            0.0,
            (0.0, 2.0),
            0.7,
            "of what the file lacks; 0: with the water, 1: with a hull that follows it in half a minute; guess",
        ),
    ],
    error_of: Some(Calibrated::ThermalExpansion),
    volume_m3: Some(&|p, s, c| {
        let warmer = s.temperature_degc - c.reference_temperature_degc;
        let behind = s.hull_degc - s.temperature_degc;
        let wrong = stated_or(c.thermal_expansion_per_k, SLOCUM_EXPANSION_PER_K) * p[0];
        c.hull_volume_m3 * (wrong * (warmer + p[2] * behind) + (c.thermal_expansion_per_k + wrong) * warmer * p[1] * warmer)
    }),
    ..Effect::NONE
};

/// A constant extra displaced volume.
pub static BALLAST_OFFSET: Effect = Effect {
    name: "ballast_offset",
    physics: "the vehicle is trimmed light or heavy by a constant volume: dives change against climbs",
    separated_by: "dives and climbs at several buoyancy drives; weighing in the water of the site",
    parameters: &[Parameter::new("volume_cc", "cm^3", 0.0, (-150.0, 150.0), 15.0, "10-100 cc between trim and mission")],
    error_of: Some(Calibrated::TrimVolume),
    constants: Some(&|p, c| c.hull_volume_m3 += p[0] * 1e-6),
    ..Effect::NONE
};

/// True ballast volume = reading (1 + gain_error).
pub static BALLAST_SCALE: Effect = Effect {
    name: "ballast_scale",
    physics: "the buoyancy engine moves more or less volume than its sensor says: all speeds scale",
    separated_by: "a bench value of the pump volume, or a speed sensor at several pitches",
    parameters: &[Parameter::new("gain_error", "1", 0.0, (-0.6, 0.8), 0.05, "1-5 % between bench and sea")],
    error_of: Some(Calibrated::BallastGain),
    sensed: Some(&|p, s| s.ballast_m3 *= 1.0 + p[0]),
    ..Effect::NONE
};
