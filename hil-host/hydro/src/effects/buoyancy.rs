//! Effects that change displaced volume.

use super::{Calibrated, Constants, Effect, InFlow, Parameter, Sensed};

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
#[derive(Clone, Copy, Debug)]
pub struct HullCompressibility;

impl Effect for HullCompressibility {
    fn name(&self) -> &'static str {
        "hull_compressibility"
    }
    fn physics(&self) -> &'static str {
        "the hull yields to pressure more or less than the file says, so buoyancy drifts with depth"
    }
    fn separated_by(&self) -> &'static str {
        "deep dives in water of little temperature contrast"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::HullCompressibility)
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "rel_error",
                unit: "1",
                off: 0.0,
                low: -1.5,
                high: 4.0,
                typical: 0.3,
                source: "3-6e-10/Pa between vehicles, 5e-10/Pa Slocum",
            },
            Parameter {
                name: "slope_per_mpa",
                unit: "1/MPa",
                off: 0.0,
                low: -0.3,
                high: 0.3,
                typical: 0.05,
                source: "seals and foam settle; guess",
            },
        ]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        c.compressibility_per_pa += stated_or(c.compressibility_per_pa, SLOCUM_COMPRESSIBILITY_PER_PA) * p[0];
    }
    fn acts_on_volume(&self) -> bool {
        true
    }
    fn volume_m3(&self, p: &[f64], s: &Sensed, c: &Constants) -> f64 {
        -c.hull_volume_m3 * c.compressibility_per_pa * s.pressure_pa * p[1] * s.pressure_pa * 1e-6
    }
}

/// αT (1 + rel_error).
#[derive(Clone, Copy, Debug)]
pub struct ThermalExpansion;

impl Effect for ThermalExpansion {
    fn name(&self) -> &'static str {
        "thermal_expansion"
    }
    fn physics(&self) -> &'static str {
        "the hull expands with temperature more or less than the file says, so buoyancy follows the temperature of the water"
    }
    fn separated_by(&self) -> &'static str {
        "dives through different temperature profiles"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::ThermalExpansion)
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "rel_error",
                unit: "1",
                off: 0.0,
                low: -3.0,
                high: 6.0,
                typical: 0.5,
                source: "5-7e-5/K (Seaglider 7.05e-5, Deepglider 6.2e-5)",
            },
            Parameter {
                name: "slope_per_k",
                unit: "1/K",
                off: 0.0,
                low: -0.04,
                high: 0.04,
                typical: 0.01,
                source: "oils and plastics expand about 1 % more per kelvin; guess",
            },
            Parameter {
                name: "lag_share",
                unit: "1",
                off: 0.0,
                low: 0.0,
                high: 2.0,
                typical: 0.7,
                source: "of what the file lacks; 0: with the water, 1: with a hull that follows it in half a minute; guess",
            },
        ]
    }
    fn acts_on_volume(&self) -> bool {
        true
    }
    fn volume_m3(&self, p: &[f64], s: &Sensed, c: &Constants) -> f64 {
        let warmer = s.temperature_degc - c.reference_temperature_degc;
        let behind = s.hull_degc - s.temperature_degc;
        let wrong = stated_or(c.thermal_expansion_per_k, SLOCUM_EXPANSION_PER_K) * p[0];
        c.hull_volume_m3 * (wrong * (warmer + p[2] * behind) + (c.thermal_expansion_per_k + wrong) * warmer * p[1] * warmer)
    }
}

/// A constant extra displaced volume.
#[derive(Clone, Copy, Debug)]
pub struct BallastOffset;

impl Effect for BallastOffset {
    fn name(&self) -> &'static str {
        "ballast_offset"
    }
    fn physics(&self) -> &'static str {
        "the vehicle is trimmed light or heavy by a constant volume: dives change against climbs"
    }
    fn separated_by(&self) -> &'static str {
        "dives and climbs at several buoyancy drives; weighing in the water of the site"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::TrimVolume)
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "volume_cc",
            unit: "cm^3",
            off: 0.0,
            low: -150.0,
            high: 150.0,
            typical: 15.0,
            source: "10-100 cc between trim and mission",
        }]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        c.hull_volume_m3 += p[0] * 1e-6;
    }
}

/// True ballast volume = reading (1 + gain_error).
#[derive(Clone, Copy, Debug)]
pub struct BallastScale;

impl Effect for BallastScale {
    fn name(&self) -> &'static str {
        "ballast_scale"
    }
    fn physics(&self) -> &'static str {
        "the buoyancy engine moves more or less volume than its sensor says: all speeds scale"
    }
    fn separated_by(&self) -> &'static str {
        "a bench value of the pump volume, or a speed sensor at several pitches"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::BallastGain)
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter { name: "gain_error", unit: "1", off: 0.0, low: -0.6, high: 0.8, typical: 0.05, source: "1-5 % between bench and sea" }]
    }
    fn acts_on_sensors(&self) -> bool {
        true
    }
    fn sensed(&self, p: &[f64], s: &mut Sensed) {
        s.ballast_m3 *= 1.0 + p[0];
    }
}
