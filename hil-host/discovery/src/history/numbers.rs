//! The eight numbers of a vehicle that a dive is summarised by, and how large an error of each is.
//!
//! Sizes are one standard deviation of what a vehicle file is usually wrong by: guesses of the catalogue, good to a factor of two.
//! A ninth number (climb drag, Reynolds exponent, drag of a bank) in the covariance breaks the quietness of untouched dives.

use hydro::effects::{Parameter, by_name};
use nalgebra::SVector;

/// How many numbers.
pub const NUMBERS: usize = 8;

/// Values of the numbers, mostly counted in their sizes.
pub type Numbers = SVector<f64, NUMBERS>;

/// Places of the numbers.
pub const DRAG_LEVEL: usize = 0;
/// Mass beyond the file's, kg.
pub const BALLAST_OFFSET: usize = 1;
/// 1/Pa beyond the file's.
pub const COMPRESSIBILITY: usize = 2;
/// 1/K beyond the file's.
pub const EXPANSION: usize = 3;
/// True less measured pitch, rad.
pub const PITCH_OFFSET: usize = 4;
/// ln of true over measured pitch.
pub const PITCH_SCALE: usize = 5;
/// ln of true over measured ballast.
pub const BALLAST_SCALE: usize = 6;
/// ln of true over stated lift slope.
pub const SLOPE_OF_LIFT: usize = 7;

/// One number.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// Name in files and reports.
    pub name: &'static str,
    /// Effect of the catalogue that says the same.
    pub effect: &'static str,
    /// Unit of its value.
    pub unit: &'static str,
    /// One standard deviation of its error, in that unit, where the buoyancy engine moves 200 cm³.
    pub size: f64,
    /// Effect that depth alone cannot tell from it.
    pub mirror: Option<&'static str>,
}

const fn number(name: &'static str, effect: &'static str, unit: &'static str, size: f64, mirror: Option<&'static str>) -> Number {
    Number { name, effect, unit, size, mirror }
}

/// All of them. From depth rate alone drag level and pitch scale mirror each other (correlation -.99), as do the others named.
pub const ALL: [Number; NUMBERS] = [
    number("drag_level", "drag_level_error", "ln", 0.3, Some("pitch_scale")),
    number("ballast_offset", "ballast_offset", "kg", 0.1, Some("density_bias")),
    number("compressibility", "hull_compressibility", "1/Pa", 3e-10, None),
    number("thermal_expansion", "thermal_expansion", "1/K", 6e-5, None),
    number("pitch_offset", "pitch_offset", "rad", 0.03, Some("zero_lift_angle")),
    number("pitch_scale", "pitch_scale", "ln", 0.1, Some("drag_level_error")),
    number("ballast_scale", "ballast_scale", "ln", 0.06, None),
    number("lift_slope", "lift_slope_error", "ln", 0.2, Some("induced_drag_error")),
];

/// Effects that have the form of what may depart and is none of the numbers: more drag in climbs, by the speed, by the bank.
pub const FORMS_OF_DRAG: [&str; 3] = ["climb_drag", "reynolds_drag", "roll_turn_drag"];

impl Number {
    /// The first parameter of its effect.
    #[must_use]
    pub fn parameter(&self) -> Parameter {
        const NONE: Parameter = Parameter { name: "", unit: "", off: 0.0, low: 0.0, high: 0.0, typical: 0.0, source: "" };
        by_name(self.effect).and_then(|e| e.parameters.first().copied()).unwrap_or(NONE)
    }
}

/// A number beyond the file's, in its own unit, as the first parameter of its effect: relative to what the file claims where the effect is.
#[must_use]
pub fn in_effect(number: usize, value: f64, claimed: f64) -> f64 {
    /// Density that a mass is a volume of, kg/m³, and cm³ in a m³.
    const WATER_KG_M3: f64 = 1025.0;
    const CC: f64 = 1e6;
    match number {
        BALLAST_OFFSET => -value / WATER_KG_M3 * CC,
        COMPRESSIBILITY | EXPANSION if claimed != 0.0 => value / claimed,
        COMPRESSIBILITY => value / RIGID_PER_PA,
        DRAG_LEVEL | BALLAST_SCALE | SLOPE_OF_LIFT => value.exp_m1(),
        // Effects of the pitch sensor say what it measures of the true pitch, the numbers what is true of the measured one.
        PITCH_SCALE => (-value).exp_m1(),
        PITCH_OFFSET => -value,
        _ => value,
    }
}

/// Compressibility that a relative error is of where the file says that the hull is rigid, 1/Pa.
const RIGID_PER_PA: f64 = 5e-10;

/// Ballast about its middle that has the full size of an offset, m³.
const FULL_DRIVE_M3: f64 = 200e-6;

/// Sizes of the numbers of a vehicle whose engine moves `drive_m3` to either side: a small engine has a small error of trim.
#[must_use]
pub fn sizes(drive_m3: f64) -> Numbers {
    let mut sizes = Numbers::from_fn(|i, _| ALL[i].size);
    sizes[BALLAST_OFFSET] *= (drive_m3 / FULL_DRIVE_M3).min(1.0);
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_and_mirror_is_an_effect_of_the_catalogue() {
        for n in ALL {
            assert!(by_name(n.effect).is_some(), "{}", n.name);
            assert!(n.mirror.is_none_or(|m| by_name(m).is_some()), "{}", n.name);
        }
        assert_eq!(
            (ALL[SLOPE_OF_LIFT].name, ALL[BALLAST_SCALE].name, ALL[EXPANSION].name),
            ("lift_slope", "ballast_scale", "thermal_expansion")
        );
    }

    #[test]
    fn accuracy_a_number_is_its_effects_parameter() {
        assert!((in_effect(BALLAST_OFFSET, 0.1025, 0.0) + 100.0).abs() < 1e-9);
        assert!((in_effect(COMPRESSIBILITY, -2e-10, 4e-10) + 0.5).abs() < 1e-12);
        assert!((in_effect(DRAG_LEVEL, 1.5_f64.ln(), -1.9) - 0.5).abs() < 1e-12);
        assert_eq!((in_effect(PITCH_OFFSET, 0.02, 0.1), ALL[PITCH_OFFSET].parameter().unit), (-0.02, "rad"));
    }

    #[test]
    fn a_small_engine_has_a_small_offset() {
        assert!((sizes(50e-6)[BALLAST_OFFSET] - 0.025).abs() < 1e-12);
        assert!((sizes(500e-6)[BALLAST_OFFSET] - 0.1).abs() < 1e-12);
    }
}
