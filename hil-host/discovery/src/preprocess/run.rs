//! What a forward model is run on: a stretch of a flight with its inputs on a grid.

use crate::preprocess::fixes::{Displacement, Fix};
use hydro::effects::Sensed;

/// Inputs at one half step of the grid.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// What the sensors said (cleaned).
    pub sensed: Sensed,
    /// Pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
    /// sin of the measured pitch.
    pub sin_pitch: f64,
    /// cos of the measured pitch.
    pub cos_pitch: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Its cosine.
    pub cos_roll: f64,
    /// sin of the heading.
    pub sin_heading: f64,
    /// cos of the heading.
    pub cos_heading: f64,
    /// Observed depth less what the sensor shows afloat, m.
    pub depth_m: f64,
    /// CD0 at this instant, relative to the law's (1: the law's own).
    pub cd0_relative: f64,
}

/// One stretch of a flight on which the model is run from rest.
#[derive(Clone, Debug)]
pub struct Run {
    /// Segment number in the flight.
    pub segment: u32,
    /// Row of the flight at which the run starts.
    pub first_row: usize,
    /// Time of each row, s.
    pub time_s: Vec<f64>,
    /// Observed depth of each row, m; NaN where the pressure is missing or a spike.
    pub depth_m: Vec<f64>,
    /// Cleaned measured pressure of each row without a gap, Pa.
    pub pressure_pa: Vec<f64>,
    /// Whether the row takes part in fits: submerged, settled, with a depth.
    pub used: Vec<bool>,
    /// Whether inputs up to the row were made up, so that the model's depth there says nothing: long silences, changes that nobody saw.
    pub unseen: Vec<bool>,
    /// Speed through the water of each row, m/s; NaN where there is none.
    pub speed_m_s: Vec<f64>,
    /// Position of the battery at each row, m; NaN where there is none.
    pub battery_m: Vec<f64>,
    /// Reading of the buoyancy engine at each row, gaps filled, m³.
    pub ballast_m3: Vec<f64>,
    /// Inputs at half steps: 0, ½, 1, 1½ … steps from the first row.
    pub inputs: Vec<Input>,
    /// Grid step, s.
    pub step_s: f64,
    /// Mean GPS displacement from start to end (east, north), m, and its 1-sigma error in each direction, m.
    pub displacement_m: Option<(f64, f64, f64)>,
    /// Time between the fixes at the start and those at the end, s; of a way over several runs this run's part of it.
    pub displacement_s: f64,
    /// Mean fixes before the dive and after it.
    pub(crate) fixes: [Option<Fix>; 2],
    /// Whether inputs had to be made up over a stretch.
    pub(crate) blind: bool,
    /// Mean time and mean pressure (Pa) of rows floating at the surface, and how many rows, at the start and at the end.
    pub surface: [Option<(f64, f64, usize)>; 2],
    /// Whether the vehicle floats at the surface at the start.
    pub starts_afloat: bool,
    /// Speed along the hull at the start, m/s: zero afloat; under way what the first depths and pitches say.
    pub start_speed_m_s: f64,
}

/// A flight ready for the model.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Runs in order of time.
    pub runs: Vec<Run>,
    /// Ways over more than one run.
    pub displacements: Vec<Displacement>,
    /// What had to be repaired or left out, for the report.
    pub notes: Vec<String>,
    /// Whether the log has temperatures.
    pub has_temperature: bool,
    /// Time by which the clock of pitch and ballast was behind that of the CTD and its standard error, s, where two pressure sensors show
    /// it: it is taken out.
    pub clock_shift_s: Option<[f64; 2]>,
}
