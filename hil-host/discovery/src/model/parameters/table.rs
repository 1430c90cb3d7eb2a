//! The table of calibration and nuisance parameters: what each is called, scatters by, changes, and is written as.

use hydro::effects::{BALLAST_SCALE, Calibrated, Constants, Effect, PITCH_OFFSET};
use logs::vehicle::{Tolerance, Vehicle};

/// One calibration or nuisance parameter.
pub struct Parameter {
    /// Name.
    pub name: &'static str,
    /// Unit of its value for a reader.
    pub unit: &'static str,
    pub(super) group: Group,
    /// 1-sigma tolerance: standard deviation of its prior, or of the core of that.
    pub(super) tolerance: Spread,
    /// Prior of the few that are far off; none where it is normal.
    pub(super) tail: Option<Tail>,
    /// Largest step of a difference, in the unit of the tolerance; a guess, wider than half the tolerances of a calibrated vehicle. None:
    /// the observations are linear in it.
    pub(super) largest_step: Option<f64>,
    pub(super) acts: Acts,
    /// Numbers of a vehicle file that are refitted in proportion to it.
    pub document: &'static [&'static str],
    /// What an effect may be the error of.
    pub(super) error_of: Option<Calibrated>,
}

/// Groups of parameters, in the order of the table.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Group {
    /// Of the law of the vehicle; the vehicle file states its tolerance.
    Stated,
    /// Of the law, with a tolerance of ours.
    Law,
    /// A nuisance that changes the simulation.
    Simulated,
    /// A nuisance that acts on the simulation's result.
    Observed,
}

/// Where a tolerance comes from.
pub(super) enum Spread {
    /// The vehicle file.
    Stated(Stated),
    /// Another number of the vehicle.
    Of(fn(&Vehicle) -> f64),
    /// A number of ours.
    Guess(f64),
}

/// A tolerance that the vehicle file states.
#[derive(Clone, Copy, Debug)]
pub struct Stated {
    /// Key in `tolerance_1sigma`.
    pub key: &'static str,
    pub(super) place: fn(&mut Tolerance) -> &mut f64,
    /// Its unit in that of the model.
    pub(super) factor: f64,
    /// The tolerance where the file's is not to be trusted, wider than any vehicle scatters.
    pub freed: f64,
}

/// What a deviation changes.
pub(super) enum Acts {
    /// A constant of the law, relative.
    Scales(fn(&mut Constants) -> &mut f64),
    /// The same, of which a tenth is always left.
    ScalesToTenth(fn(&mut Constants) -> &mut f64),
    /// A constant of the law, by so much.
    Shifts(fn(&mut Constants) -> &mut f64),
    /// The law, as an effect of this size.
    Is(&'static Effect),
    /// What the sensors show or where the battery is wanted: see the likelihood of each.
    Observations,
}

/// A mixture of two normal priors about nothing: nearly always as small as the tolerance, now and then wide.
pub(super) struct Tail {
    /// What it is for a reader, in which unit, and the factor to that.
    pub(super) what: &'static str,
    pub(super) unit: &'static str,
    pub(super) factor: f64,
    /// Standard deviation of the few, in the parameter's own unit, and their probability.
    pub(super) wide: f64,
    pub(super) probability: f64,
    /// Bounds of what is possible, in the parameter's own unit.
    pub(super) bounds: (f64, f64),
}

/// What the rows of the table begin from.
const PLAIN: Parameter = Parameter {
    name: "",
    unit: "1",
    group: Group::Observed,
    tolerance: Spread::Guess(0.0),
    tail: None,
    largest_step: None,
    acts: Acts::Observations,
    document: &[],
    error_of: None,
};

const fn stated(key: &'static str, place: fn(&mut Tolerance) -> &mut f64, freed: f64) -> Spread {
    Spread::Stated(Stated { key, place, factor: 1.0, freed })
}

/// A number of the moments in pitch, guessed at one time in ten; how far off a guess is, is a guess of its own.
const fn moment(name: &'static str, key: &'static str, document: &'static [&'static str], tolerance: f64, wide: f64) -> Parameter {
    let tail = Tail { what: key, unit: "1", factor: 1.0, wide, probability: 0.1, bounds: (f64::NEG_INFINITY, f64::INFINITY) };
    Parameter { name, tolerance: Spread::Guess(tolerance), tail: Some(tail), document, ..PLAIN }
}

/// Tolerance of the drag due to lift and of the hull's drag due to angle of attack, relative. A vehicle file gives none; but no law of
/// three numbers is nature's to a hundredth at every angle, and what is left of it is not to be named edge lift or vortices. A guess:
/// flights of another author's force law, clean or with a strong drag error, asked for 1 to 2 %.
const LAW_RELATIVE: f64 = 0.015;
/// Zero error of the pressure sensor, 1 sigma, Pa (FORMAT section 1: below 0.2 dbar).
pub(crate) const PRESSURE_ZERO_PA: f64 = 1500.0;

/// Number of parameters.
pub const N_CALIBRATION: usize = 27;

/// All of them, group by group: a new one is a row here, and a field of [`crate::model::parameters::State::calibration`] by that.
pub const PARAMETERS: [Parameter; N_CALIBRATION] = [
    Parameter {
        name: "cd0",
        group: Group::Stated,
        tolerance: stated("cd0_relative", |t| &mut t.cd0_relative, 0.5),
        largest_step: Some(0.05),
        acts: Acts::Scales(|c| &mut c.cd0),
        document: &["/hydro/cd0", "/hydro/wide/cd0"],
        error_of: Some(Calibrated::Drag),
        ..PLAIN
    },
    Parameter {
        name: "lift_slope",
        unit: "1/rad",
        group: Group::Stated,
        tolerance: stated("lift_slope_relative", |t| &mut t.lift_slope_relative, 0.5),
        largest_step: Some(0.05),
        acts: Acts::Scales(|c| &mut c.lift_slope_per_rad),
        document: &["/hydro/wing_lift_slope_per_rad", "/hydro/hull_lift_slope_per_rad", "/hydro/wide/lift_slope_per_rad"],
        error_of: Some(Calibrated::LiftSlope),
        ..PLAIN
    },
    Parameter {
        name: "lift_quadratic",
        unit: "1/rad2",
        group: Group::Stated,
        tolerance: stated("lift_quadratic_relative", |t| &mut t.lift_quadratic_relative, 1.0),
        largest_step: Some(0.05),
        acts: Acts::Scales(|c| &mut c.lift_quadratic_per_rad2),
        document: &["/hydro/lift_quadratic_per_rad2", "/hydro/wide/lift_quadratic_per_rad2"],
        ..PLAIN
    },
    Parameter {
        name: "trim_volume",
        unit: "cm3",
        group: Group::Stated,
        tolerance: Spread::Stated(Stated { key: "trim_volume_cc", place: |t| &mut t.trim_volume_m3, factor: 1e6, freed: 300.0 }),
        largest_step: Some(5.0),
        acts: Acts::Shifts(|c| &mut c.hull_volume_m3),
        document: &["/hull_volume_m3"],
        error_of: Some(Calibrated::TrimVolume),
        ..PLAIN
    },
    Parameter {
        name: "ballast_gain",
        group: Group::Stated,
        tolerance: stated("ballast_gain_relative", |t| &mut t.ballast_gain_relative, 0.05),
        largest_step: Some(0.02),
        acts: Acts::Is(&BALLAST_SCALE),
        error_of: Some(Calibrated::BallastGain),
        ..PLAIN
    },
    Parameter {
        name: "pitch_zero",
        unit: "rad",
        group: Group::Stated,
        tolerance: stated("pitch_zero_rad", |t| &mut t.pitch_zero_rad, 0.05),
        largest_step: Some(0.005),
        acts: Acts::Is(&PITCH_OFFSET),
        error_of: Some(Calibrated::PitchZero),
        ..PLAIN
    },
    Parameter {
        name: "hull_compressibility",
        unit: "1/Pa",
        group: Group::Stated,
        tolerance: stated("hull_compressibility_relative", |t| &mut t.hull_compressibility_relative, 1.0),
        largest_step: Some(0.1),
        acts: Acts::Scales(|c| &mut c.compressibility_per_pa),
        document: &["/hull_compressibility_per_pa"],
        error_of: Some(Calibrated::HullCompressibility),
        ..PLAIN
    },
    Parameter {
        name: "thermal_expansion",
        unit: "1/K",
        group: Group::Stated,
        tolerance: stated("hull_thermal_expansion_relative", |t| &mut t.hull_thermal_expansion_relative, 1.0),
        largest_step: Some(0.1),
        acts: Acts::Scales(|c| &mut c.thermal_expansion_per_k),
        document: &["/hull_thermal_expansion_per_k"],
        error_of: Some(Calibrated::ThermalExpansion),
        ..PLAIN
    },
    Parameter {
        name: "added_mass_surge",
        unit: "of the mass",
        group: Group::Stated,
        tolerance: stated("added_mass_surge", |t| &mut t.added_mass_surge, 0.3),
        largest_step: Some(0.05),
        acts: Acts::Shifts(|c| &mut c.added_mass_surge),
        error_of: Some(Calibrated::SurgeAddedMass),
        ..PLAIN
    },
    // A nuisance too, for no vehicle file knows it: a spheroid's is 0.9 of its mass; wings, fins and the water around them are never known:
    // 1.9 to 3 more on the public Slocum flights.
    Parameter {
        name: "added_mass_heave",
        unit: "of the mass",
        group: Group::Stated,
        tolerance: stated("added_mass_heave", |t| &mut t.added_mass_heave, 0.5),
        tail: Some(Tail {
            what: "added mass across the hull beyond the vehicle file's, share of the mass",
            unit: "1",
            factor: 1.0,
            wide: 1.5,
            probability: 0.3,
            // From a sphere's (Lamb, Hydrodynamics, 1932, art. 92; a spheroid of 7 to 1 has 0.93) to what a vehicle file may state.
            bounds: (0.5, 5.0),
        }),
        largest_step: Some(0.1),
        acts: Acts::Shifts(|c| &mut c.added_mass_heave),
        error_of: Some(Calibrated::HeaveAddedMass),
        ..PLAIN
    },
    Parameter {
        name: "induced_k",
        group: Group::Law,
        tolerance: Spread::Guess(LAW_RELATIVE),
        largest_step: Some(0.05),
        acts: Acts::Scales(|c| &mut c.induced_k),
        document: &["/hydro/induced_k"],
        ..PLAIN
    },
    Parameter {
        name: "hull_drag",
        unit: "1/rad2",
        group: Group::Law,
        tolerance: Spread::Guess(LAW_RELATIVE),
        largest_step: Some(0.05),
        acts: Acts::Scales(|c| &mut c.hull_drag_per_rad2),
        document: &["/hydro/hull_drag_per_rad2", "/hydro/wide/hull_drag_per_rad2"],
        ..PLAIN
    },
    // Lift beyond the law, in shares of the way between its two continuations, and the drag of a vehicle broadside on: guesses. A stall is
    // fitted to rows on both sides of the law's end; where what is beyond it was taken for known, stalls came out with drag effects that
    // make up for it. Twice to three times the lift's tolerance loses weak effects of vehicles that fly shallow.
    Parameter {
        name: "lift_fading",
        group: Group::Law,
        tolerance: Spread::Guess(0.3),
        largest_step: Some(0.15),
        acts: Acts::Shifts(|c| &mut c.beyond.lift_fading),
        ..PLAIN
    },
    Parameter {
        name: "cd_broadside",
        group: Group::Law,
        tolerance: Spread::Guess(0.3),
        largest_step: Some(0.1),
        acts: Acts::ScalesToTenth(|c| &mut c.beyond.cd_broadside),
        ..PLAIN
    },
    // Time by which pitch, roll and ballast are logged after the pressure. Two computers that are set by GPS agree to a tenth of a second;
    // the tables of two Slocums were 1.2 and 2.6 s apart.
    Parameter {
        name: "clock_offset",
        unit: "s",
        group: Group::Simulated,
        tolerance: Spread::Guess(0.1),
        tail: Some(Tail {
            what: "clock of pitch and ballast behind that of the pressure",
            unit: "s",
            factor: 1.0,
            wide: 3.0,
            probability: 0.1,
            bounds: (-12.0, 12.0),
        }),
        largest_step: Some(0.05),
        ..PLAIN
    },
    // Share of the hull's expansion that follows the water late. A hull is some seconds to half a minute late (1 is half a minute); longer
    // is no hull's. A conductivity cell that takes the water's temperature late makes a density error of the same form and either sign
    // (Garau et al. 2011: some 0.04 kg/m³ per K, as half of a hull's expansion).
    Parameter {
        name: "hull_lag_share",
        group: Group::Simulated,
        tolerance: Spread::Guess(0.02),
        tail: Some(Tail {
            what: "thermal lag of hull and conductivity cell, as the share of the hull's expansion that is half a minute late",
            unit: "1",
            factor: 1.0,
            wide: 0.5,
            probability: 0.2,
            bounds: (-1.0, 1.6),
        }),
        largest_step: Some(0.05),
        acts: Acts::Shifts(|c| &mut c.hull_lag_share),
        ..PLAIN
    },
    // A body that banks turns, unless its model knows no roll: 1 without sideslip, 0.75 for a hull that slips.
    Parameter {
        name: "banked_turn",
        group: Group::Simulated,
        tolerance: Spread::Guess(0.05),
        tail: Some(Tail {
            what: "share of a turn without sideslip that a bank makes",
            unit: "1",
            factor: 1.0,
            wide: 0.7,
            probability: 0.3,
            bounds: (0.0, 1.2),
        }),
        largest_step: Some(0.05),
        acts: Acts::Shifts(|c| &mut c.banked_turn),
        ..PLAIN
    },
    Parameter { name: "speed_scale", tolerance: Spread::Of(|v| v.sensors.speed_scale_relative), ..PLAIN },
    Parameter { name: "heading_bias", unit: "rad", tolerance: Spread::Of(|v| v.sensors.heading_bias_rad), ..PLAIN },
    // Zeroed before launch, or not: a sensor of absolute pressure shows 10 dbar at the surface.
    Parameter {
        name: "pressure_zero",
        unit: "Pa",
        tolerance: Spread::Guess(PRESSURE_ZERO_PA),
        tail: Some(Tail {
            what: "zero of the pressure sensor",
            unit: "dbar",
            factor: 1e-4,
            wide: 3e4,
            probability: 0.1,
            bounds: (-5e5, 5e5),
        }),
        ..PLAIN
    },
    // Distance of the port ahead of the centre of the hull: 0.3 to 0.6 m behind it by the logs of two Slocums whose port is in the tail; a
    // CTD's is on the hull's side.
    Parameter {
        name: "pressure_port",
        unit: "m",
        tolerance: Spread::Guess(0.05),
        tail: Some(Tail {
            what: "pressure port ahead of the centre",
            unit: "m",
            factor: 1.0,
            wide: 0.5,
            probability: 0.2,
            bounds: (-1.5, 1.5),
        }),
        ..PLAIN
    },
    Parameter { name: "battery_zero", unit: "m", tolerance: Spread::Of(|v| v.moments.map_or(0.0, |m| m.battery_zero_m)), ..PLAIN },
    // The numbers of the moments in pitch, whose tolerances the flight format does not give. Guesses: a scale and a trim in a tank give the
    // first two to a hundredth; the arm's is wider, lest much hang on whether the engine's reading or its true volume acts there.
    moment("battery_mass", "battery_mass_kg", &["/pitch/battery_mass_kg"], 0.01, 0.3),
    moment("metacentric_height", "metacentric_height_m", &["/pitch/metacentric_height_m"], 0.01, 0.3),
    moment("ballast_arm", "ballast_arm_m", &["/pitch/ballast_arm_m"], 0.05, 0.3),
    moment("pitch_moment", "cm_alpha", &["/pitch/cm_alpha"], 0.1, 1.0),
    moment("pitch_damping", "cm_q", &["/pitch/cm_q"], 0.05, 0.5),
];
