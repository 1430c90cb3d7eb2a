//! What scatters in every vehicle: the calibration numbers, their tolerances, and the model that a state of them means.

use crate::ablation::is_on;
use crate::model::internal_wave::Wave;
use crate::vehicle::Vehicle;
use hydro::effects::{Active, BallastScale, Calibrated, Constants, Effect, PitchOffset};

/// Calibration numbers that scatter in every vehicle, in the order of [`State::calibration`]: those that change the simulation, then
/// those that act on its result.
pub const CALIBRATION: [&str; 27] = [
    "cd0",
    "lift_slope",
    "lift_quadratic",
    "trim_volume",
    "ballast_gain",
    "pitch_zero",
    "hull_compressibility",
    "thermal_expansion",
    "added_mass_surge",
    "added_mass_heave",
    "induced_k",
    "hull_drag",
    "lift_fading",
    "cd_broadside",
    "clock_offset",
    "hull_lag_share",
    "banked_turn",
    "speed_scale",
    "heading_bias",
    "pressure_zero",
    "pressure_port",
    "battery_zero",
    "battery_mass",
    "metacentric_height",
    "ballast_arm",
    "pitch_moment",
    "pitch_damping",
];
/// Number of calibration numbers.
pub const N_CALIBRATION: usize = CALIBRATION.len();
/// How many of them, from the first, have a tolerance that the vehicle file states.
pub(crate) const STATED: usize = 10;
/// How many of them change the simulation.
pub const N_SIMULATED: usize = 17;
/// How many of them, from the first, are numbers of the law of the vehicle; what follows are nuisances.
pub(crate) const N_LAW: usize = 14;
/// Those of the law that are no constant of it: a file states them as the effect that is their error.
pub(crate) const BALLAST_GAIN: usize = 4;
pub(crate) const PITCH_ZERO: usize = 5;
/// Added mass across the hull: a nuisance too, for no vehicle file knows it.
pub(crate) const HEAVE_MASS: usize = 9;
/// Nuisances that change the simulation: time by which pitch, roll and ballast are logged after the pressure; share of the hull's
/// expansion that follows the water late; share of a turn without sideslip.
pub(crate) const CLOCK_OFFSET: usize = 14;
pub(crate) const HULL_LAG: usize = 15;
pub(crate) const BANKED_TURN: usize = 16;
/// Those that act on its result.
pub(crate) const SPEED_SCALE: usize = 17;
pub(crate) const HEADING_BIAS: usize = 18;
pub(crate) const PRESSURE_ZERO: usize = 19;
/// Distance of the pressure port ahead of the centre of the hull.
pub(crate) const PRESSURE_PORT: usize = 20;
pub(crate) const BATTERY_ZERO: usize = 21;
/// The numbers of the moments in pitch, from the first.
pub(crate) const BATTERY_MASS: usize = 22;
pub(crate) const METACENTRIC_HEIGHT: usize = 23;
pub(crate) const BALLAST_ARM: usize = 24;
pub(crate) const PITCH_MOMENT: usize = 25;
pub(crate) const PITCH_DAMPING: usize = 26;
/// Tolerance of the drag due to lift and of the hull's drag due to angle of attack, relative. A vehicle file gives none; but no law of
/// three numbers is nature's to a hundredth at every angle, and what is left of it is not to be named edge lift or vortices. A guess:
/// flights of another author's force law, clean or with a strong drag error, asked for 1 to 2 %.
const LAW_RELATIVE: f64 = 0.015;
/// Doubt about lift beyond the law, in shares of the way between its two continuations, and about the drag of a vehicle broadside on,
/// relative: guesses. A stall is fitted to rows on both sides of the law's end; where what is beyond it was taken for known, stalls
/// came out with drag effects beside them that make up for it. Twice to three times the lift's doubt loses weak effects of vehicles
/// that fly shallow.
const LIFT_FADING: f64 = 0.3;
const BROADSIDE_RELATIVE: f64 = 0.3;
/// Tolerances of the numbers of the moments in pitch, relative: battery's mass, metacentric height, arm of the engine, moment due to
/// angle of attack, damping. The flight format gives none. Guesses: a scale and a trim in a tank give the first two to a hundredth;
/// the arm's is wider, lest much hang on whether the engine's reading or its true volume acts there.
const MOMENTS_RELATIVE: [f64; 5] = [0.01, 0.01, 0.05, 0.1, 0.05];
/// Zero error of the pressure sensor, 1 sigma, Pa (FORMAT section 1: below 0.2 dbar).
pub(crate) const PRESSURE_ZERO_PA: f64 = 1500.0;

/// A number whose prior is a mixture of two normal ones about nothing: nearly always as small as its tolerance, now and then wide.
struct WideTail {
    index: usize,
    /// Name for a reader, and the unit and factor it is told in.
    what: &'static str,
    unit: &'static str,
    factor: f64,
    /// Tolerance of the many (none: the vehicle file's) and of the few, in the number's own unit, and the probability of the few.
    tolerance: Option<f64>,
    wide: f64,
    probability: f64,
    /// Bounds of what is possible, in the number's own unit.
    bounds: (f64, f64),
}

/// Numbers of the moments in pitch have been guessed at one time in ten; how far off a guess is, is a guess of its own.
const fn guessed(index: usize, what: &'static str, wide: f64) -> WideTail {
    let tolerance = Some(MOMENTS_RELATIVE[index - BATTERY_MASS]);
    let bounds = (f64::NEG_INFINITY, f64::INFINITY);
    WideTail { index, what, unit: "1", factor: 1.0, tolerance, wide, probability: 0.1, bounds }
}

const WIDE_TAILS: [WideTail; 11] = [
    // A spheroid's is 0.9 of its mass; wings, fins and the water around them are never known: 1.9 to 3 more on the public Slocum flights.
    WideTail {
        index: HEAVE_MASS,
        what: "added mass across the hull beyond the vehicle file's, share of the mass",
        unit: "1",
        factor: 1.0,
        tolerance: None,
        wide: 1.5,
        probability: 0.3,
        // What a vehicle file may state.
        bounds: (0.0, 5.0),
    },
    // Two computers that are set by GPS agree to a tenth of a second; the tables of two Slocums were 1.2 and 2.6 s apart.
    WideTail {
        index: CLOCK_OFFSET,
        what: "clock of pitch and ballast behind that of the pressure",
        unit: "s",
        factor: 1.0,
        tolerance: Some(0.1),
        wide: 3.0,
        probability: 0.1,
        bounds: (-12.0, 12.0),
    },
    // A hull is some seconds to half a minute late (1 is half a minute); longer is no hull's. A conductivity cell that takes the water's
    // temperature late makes a density error of the same form and either sign (Garau et al. 2011: some 0.04 kg/m³ per K, as half of a
    // hull's expansion).
    WideTail {
        index: HULL_LAG,
        what: "thermal lag of hull and conductivity cell, as the share of the hull's expansion that is half a minute late",
        unit: "1",
        factor: 1.0,
        tolerance: Some(0.02),
        wide: 0.5,
        probability: 0.2,
        bounds: (-1.0, 1.6),
    },
    // A body that banks turns, unless its model knows no roll: 1 without sideslip, 0.75 for a hull that slips.
    WideTail {
        index: BANKED_TURN,
        what: "share of a turn without sideslip that a bank makes",
        unit: "1",
        factor: 1.0,
        tolerance: Some(0.05),
        wide: 0.7,
        probability: 0.3,
        bounds: (0.0, 1.2),
    },
    // Zeroed before launch, or not: a sensor of absolute pressure shows 10 dbar at the surface.
    WideTail {
        index: PRESSURE_ZERO,
        what: "zero of the pressure sensor",
        unit: "dbar",
        factor: 1e-4,
        tolerance: Some(PRESSURE_ZERO_PA),
        wide: 3e4,
        probability: 0.1,
        bounds: (-5e5, 5e5),
    },
    // 0.3 to 0.6 m behind the centre by the logs of two Slocums whose port is in the tail; a CTD's is on the hull's side.
    WideTail {
        index: PRESSURE_PORT,
        what: "pressure port ahead of the centre",
        unit: "m",
        factor: 1.0,
        tolerance: Some(0.05),
        wide: 0.5,
        probability: 0.2,
        bounds: (-1.5, 1.5),
    },
    guessed(BATTERY_MASS, "battery_mass_kg", 0.3),
    guessed(METACENTRIC_HEIGHT, "metacentric_height_m", 0.3),
    guessed(BALLAST_ARM, "ballast_arm_m", 0.3),
    guessed(PITCH_MOMENT, "cm_alpha", 1.0),
    guessed(PITCH_DAMPING, "cm_q", 0.5),
];

fn wide(index: usize) -> Option<&'static WideTail> {
    WIDE_TAILS.iter().find(|w| w.index == index && (index != HEAVE_MASS || is_on("heave_mass")))
}

/// Between what values a calibration number may be, in its tolerances; none where nothing bounds it.
#[must_use]
pub(crate) fn bounds(vehicle: &Vehicle, index: usize) -> Option<(f64, f64)> {
    let (w, tolerance) = (wide(index)?, tolerance_of(vehicle, index));
    // A file that states how lift tilts has said what a bank does.
    if index == BANKED_TURN && vehicle.constants.bank_tilt != 0.0 {
        return Some((0.0, 0.0));
    }
    // What the file has of it already counts.
    let has = match index {
        HEAVE_MASS => vehicle.constants.added_mass_heave,
        HULL_LAG => vehicle.constants.hull_lag_share,
        BANKED_TURN => vehicle.constants.banked_turn,
        _ => 0.0,
    };
    Some(((w.bounds.0 - has).min(0.0) / tolerance, (w.bounds.1 - has).max(0.0) / tolerance))
}

/// A sensor, or a number of the log, that is found to be off.
#[derive(Clone, Debug)]
pub struct SensorFinding {
    /// Name in [`CALIBRATION`].
    pub name: &'static str,
    /// What it is, in words.
    pub what: &'static str,
    /// Value with its 90 % interval.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit.
    pub unit: &'static str,
}

/// Tolerances beyond which a nuisance is told of, and standard errors that it must be from nothing.
const TOLD: f64 = 3.0;
/// Two-sided 90 % of a normal variable, sigma.
const NINETY: f64 = 1.645;

/// Nuisances that a fit finds to be off by more than they usually are: a state and the standard errors of its calibration numbers, in
/// tolerances.
#[must_use]
pub fn sensor_findings(vehicle: &Vehicle, state: &State, sigma: impl Fn(usize) -> f64) -> Vec<SensorFinding> {
    let told = |w: &WideTail| {
        let (z, s) = (state.calibration[w.index], sigma(w.index));
        let unit = tolerance_of(vehicle, w.index) * w.factor;
        let [value, low, high] = [0.0, -NINETY, NINETY].map(|sigmas| (z + sigmas * s) * unit);
        let found = || SensorFinding { name: CALIBRATION[w.index], what: w.what, value, low, high, unit: w.unit };
        (w.index < BATTERY_MASS && z.abs() > TOLD && z.abs() > TOLD * s).then(found)
    };
    WIDE_TAILS.iter().filter_map(told).collect()
}

/// The calibration number that an effect is the error of: its index in [`CALIBRATION`].
#[must_use]
pub fn calibration_of(effect: &dyn Effect) -> Option<usize> {
    Some(match effect.error_of()? {
        Calibrated::Drag => 0,
        Calibrated::LiftSlope => 1,
        Calibrated::TrimVolume => 3,
        Calibrated::BallastGain => BALLAST_GAIN,
        Calibrated::PitchZero => PITCH_ZERO,
        Calibrated::HullCompressibility => 6,
        Calibrated::ThermalExpansion => 7,
        Calibrated::SurgeAddedMass => 8,
        Calibrated::HeaveAddedMass => 9,
    })
}

/// Tolerance of a calibration number in the unit of the effect that deviates it.
#[must_use]
pub fn tolerance_of(vehicle: &Vehicle, index: usize) -> f64 {
    let t = &vehicle.tolerance;
    match index {
        0 => t.cd0_relative,
        1 => t.lift_slope_relative,
        2 => t.lift_quadratic_relative,
        3 => t.trim_volume_m3 * 1e6,
        4 => t.ballast_gain_relative,
        5 => t.pitch_zero_rad,
        6 => t.hull_compressibility_relative,
        7 => t.hull_thermal_expansion_relative,
        8 => t.added_mass_surge,
        9 => t.added_mass_heave,
        10 | 11 => LAW_RELATIVE,
        12 => LIFT_FADING,
        13 => BROADSIDE_RELATIVE,
        SPEED_SCALE => vehicle.sensors.speed_scale_relative,
        HEADING_BIAS => vehicle.sensors.heading_bias_rad,
        BATTERY_ZERO => vehicle.moments.map_or(0.0, |m| m.battery_zero_m),
        _ => wide(index).and_then(|w| w.tolerance).unwrap_or(0.0),
    }
}

/// Whether a calibration number is an ordinary number of the law: it scatters within its tolerance, and a name is for what is beyond.
#[must_use]
pub(crate) fn is_law(index: usize) -> bool {
    index < N_LAW && wide(index).is_none()
}

/// Prior of a number that may have been guessed at, where a calibration number has a wide tail: cost against a value of zero (minus twice
/// the log density), and precision of the normal prior of the same pull. None for the others, whose prior is normal.
#[must_use]
pub(crate) fn wide_tail(vehicle: &Vehicle, index: usize, z: f64) -> Option<(f64, f64)> {
    let w = wide(index)?;
    let width = w.wide / tolerance_of(vehicle, index);
    let density = |z: f64| [(1.0 - w.probability) * (-0.5 * z * z).exp(), w.probability / width * (-0.5 * (z / width).powi(2)).exp()];
    let [[core, tail], [at_zero, beside]] = [density(z), density(0.0)];
    let cost = -2.0 * ((core + tail) / (at_zero + beside)).ln();
    Some((cost, (core + tail / (width * width)) / (core + tail)))
}

/// Step of a difference in a calibration number, in its tolerances: half of one, but never further than a vehicle stays linear.
#[must_use]
pub fn step_of(vehicle: &Vehicle, index: usize) -> f64 {
    // In the unit of the effect that deviates the number; guesses, wider than half the tolerances of a calibrated vehicle.
    const LARGEST: [f64; N_SIMULATED] = [0.05, 0.05, 0.05, 5.0, 0.02, 0.005, 0.1, 0.1, 0.05, 0.1, 0.05, 0.05, 0.15, 0.1, 0.05, 0.05, 0.05];
    LARGEST.get(index).map_or(1.0, |largest| (largest / tolerance_of(vehicle, index)).min(0.5))
}

/// Values of all unknowns.
#[derive(Clone, Debug)]
pub struct State {
    /// Calibration numbers in units of their tolerance.
    pub calibration: [f64; N_CALIBRATION],
    /// Effects on trial.
    pub effects: Vec<Active>,
    /// Internal wave on trial.
    pub wave: Option<Wave>,
}

impl State {
    /// Everything nominal.
    #[must_use]
    pub fn nominal() -> Self {
        Self { calibration: [0.0; N_CALIBRATION], effects: Vec::new(), wave: None }
    }

    /// Whether this is the vehicle as its file gives it.
    #[must_use]
    pub fn is_nominal(&self) -> bool {
        self.effects_in_all() == 0 && self.calibration.iter().all(|z| *z == 0.0)
    }

    /// How many effects are on trial, the wave among them.
    #[must_use]
    pub fn effects_in_all(&self) -> usize {
        self.effects.len() + usize::from(self.wave.is_some())
    }
}

/// What a state says of the sensors, beside the law of the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorErrors {
    /// Time by which pitch, roll and ballast are logged later than the pressure of the same instant, s.
    pub clock_s: f64,
    /// Distance of the pressure port ahead of the centre of the hull, m.
    pub port_m: f64,
}

/// Sensor errors that a state means.
#[must_use]
pub fn sensor_errors(vehicle: &Vehicle, state: &State) -> SensorErrors {
    let of = |index: usize| state.calibration[index] * tolerance_of(vehicle, index);
    SensorErrors { clock_s: of(CLOCK_OFFSET), port_m: of(PRESSURE_PORT) }
}

/// Constants and effects that a state of a vehicle means.
#[must_use]
pub fn law(vehicle: &Vehicle, state: &State) -> (Constants, Vec<Active>) {
    let (t, z) = (&vehicle.tolerance, &state.calibration);
    let mut c = vehicle.constants;
    c.cd0 *= 1.0 + z[0] * t.cd0_relative;
    c.lift_slope_per_rad *= 1.0 + z[1] * t.lift_slope_relative;
    c.lift_quadratic_per_rad2 *= 1.0 + z[2] * t.lift_quadratic_relative;
    c.hull_volume_m3 += z[3] * t.trim_volume_m3;
    c.compressibility_per_pa *= 1.0 + z[6] * t.hull_compressibility_relative;
    c.thermal_expansion_per_k *= 1.0 + z[7] * t.hull_thermal_expansion_relative;
    c.added_mass_surge += z[8] * t.added_mass_surge;
    c.added_mass_heave += z[9] * t.added_mass_heave;
    c.induced_k *= 1.0 + z[10] * LAW_RELATIVE;
    c.hull_drag_per_rad2 *= 1.0 + z[11] * LAW_RELATIVE;
    c.beyond.lift_fading += z[12] * LIFT_FADING;
    c.beyond.cd_broadside *= (1.0 + z[13] * BROADSIDE_RELATIVE).max(0.1);
    c.hull_lag_share += z[HULL_LAG] * tolerance_of(vehicle, HULL_LAG);
    c.banked_turn += z[BANKED_TURN] * tolerance_of(vehicle, BANKED_TURN);
    let mut effects = vehicle.effects.clone();
    if z[BALLAST_GAIN] != 0.0 {
        effects.push(Active::sized(&BallastScale, z[BALLAST_GAIN] * t.ballast_gain_relative));
    }
    if z[PITCH_ZERO] != 0.0 {
        effects.push(Active::sized(&PitchOffset, z[PITCH_ZERO] * t.pitch_zero_rad));
    }
    effects.extend_from_slice(&state.effects);
    (c, effects)
}

#[cfg(test)]
mod tests {
    use super::{BALLAST_ARM, BATTERY_MASS, HEAVE_MASS, METACENTRIC_HEIGHT, wide_tail};
    use crate::vehicle::{Vehicle, parse};

    fn vehicle() -> Vehicle {
        let text = include_str!("../../../../vehicles/modena.toml");
        parse(toml::from_str(text).expect("TOML"), std::path::Path::new("modena.toml")).expect("a vehicle")
    }

    #[test]
    fn accuracy_a_wide_tail_is_its_cost_derived_and_costs_little_far_out() {
        let vehicle = vehicle();
        for index in super::WIDE_TAILS.iter().map(|w| w.index) {
            let cost = |z: f64| wide_tail(&vehicle, index, z).expect("a tail").0;
            assert_eq!(cost(0.0), 0.0);
            for z in [-20.0, -3.0, 0.4, 2.0, 2.9, 5.0, 11.0] {
                let (_, precision) = wide_tail(&vehicle, index, z).expect("a tail");
                let slope = (cost(z + 1e-5) - cost(z - 1e-5)) / 2e-5;
                // A normal prior of this precision: cost p z², slope 2 p z; differenced to 1e-7.
                assert!((slope - 2.0 * precision * z).abs() < 1e-6 * (1.0 + slope.abs()), "{index} {z}: {slope} {precision}");
            }
        }
        // Thirty hundredths off: as improbable as a guess is, and as that it is off by so much. A normal prior would ask for 900.
        let far = wide_tail(&vehicle, METACENTRIC_HEIGHT, 30.0).expect("a tail").0;
        assert!((far - (1.0 + 2.0 * (30.0_f64 * 9.0).ln())).abs() < 0.1, "{far}");
        let has = |index: usize| wide_tail(&vehicle, index, 1.0).is_some();
        assert!(!has(BATTERY_MASS - 1) && has(BALLAST_ARM) && has(HEAVE_MASS) && !has(HEAVE_MASS - 1));
    }
}
