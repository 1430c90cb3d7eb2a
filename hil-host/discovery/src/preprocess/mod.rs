//! Turns a raw flight into what a forward model can be run on: spikes and gaps removed, inputs on a fixed grid, depth to compare with.
//!
//! Method. Spikes go first ([`spikes`]). Pitch on the grid is a local quadratic fit over ±[`PITCH_WINDOW_S`]
//! with weights, which also gives the pitch rate; everything else is interpolated linearly. Depth is ∫ dp/(ρ g).
//!
//! A run is a stretch that starts from a known state: a segment of the trial format (floating at the surface), or a cut at a gap.

pub(crate) mod channels;
mod clean;
pub(crate) mod ctd_gaps;
pub mod dives;
pub mod fixes;
pub(crate) mod gaps;
pub mod gps;
pub mod grid;
pub mod interpolate;
mod pressure_unit;
mod run;
pub mod sanity;
pub mod spikes;
pub(crate) mod stuck_sensors;

use crate::ablation::is_on;
pub use crate::preprocess::grid::STEPS_S;
pub use crate::preprocess::interpolate::{PITCH_WINDOW_S, local_slope, widened_s};
pub use crate::preprocess::run::{Input, Prepared, Run};

use crate::preprocess::clean::run;
use crate::preprocess::gps::displacements;
pub(crate) use crate::preprocess::interpolate::fill;
use crate::preprocess::stuck_sensors::{Removed, unstuck};
use logs::record::afloat::reading_afloat;
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;

/// A gap longer than this starts a new run, s.
pub const GAP_S: f64 = 120.0;
/// Depth above which a row is not compared: surface, waves, launch; m (FORMAT section 6.1).
pub const SURFACE_M: f64 = 2.0;
/// Time after the last row above [`SURFACE_M`] before rows are compared, s (FORMAT section 6.1).
pub const SETTLE_S: f64 = 60.0;
/// Observed depth above which the vehicle may be held floating, m: above the zero error of the sensor, below any dive.
pub const FLOAT_M: f64 = 0.5;

/// A pressure that reads what no part of a glider can be at in a stay at the surface, in words.
fn offset(flight: &Flight) -> Option<String> {
    let known = (0..flight.len()).map(|i| (flight.time_s[i], flight.pressure_pa[i])).filter(|r| r.1.is_finite());
    let level = reading_afloat(known)?;
    let dbar = level * 1e-4;
    Some(format!("pressure_dbar reads {dbar:.2} dbar afloat, an absolute pressure or a wrong zero: take it out, as `glider import` does"))
}

/// Cleans a flight and lays its inputs on the grid.
#[must_use]
pub fn prepare(flight: &Flight, vehicle: &Vehicle) -> Prepared {
    let mut runs = Vec::new();
    let mut notes = Vec::new();
    notes.extend(offset(flight));
    notes.extend(flight.unread.iter().cloned());
    let mut removed = Removed::default();
    let mut flight = unstuck(flight, &mut removed);
    let shift = is_on("clock_from_pressures").then(|| logs::record::clock_offset::align(&mut flight)).flatten();
    if let Some([tau, _]) = shift {
        notes.push(format!(
            "pitch, roll and ballast were {:.1} s {} of the CTD (two pressure sensors compared) and were shifted to its clock",
            tau.abs(),
            if tau < 0.0 { "ahead" } else { "behind" }
        ));
    }
    let flight = &flight;
    let dives = crate::preprocess::dives::cut(flight, vehicle);
    if dives.is_some() {
        notes.push("the flight is one long segment: it was cut into its dives, and segments here are dives".into());
    }
    let segment = dives.as_ref().unwrap_or(&flight.segment);
    let n = flight.len();
    let mut start = 0;
    while start < n {
        let mut end = start + 1;
        while end < n && segment[end] == segment[start] && flight.time_s[end] - flight.time_s[end - 1] < GAP_S {
            end += 1;
        }
        if end - start >= 12 && flight.pressure_pa[start..end].iter().filter(|v| v.is_finite()).count() >= 8 {
            let mut one = run(flight, vehicle, start, end, &mut removed);
            one.segment = segment[start];
            // A dive that was cut out starts and ends under way, not afloat.
            if start > 0 && flight.segment[start] == flight.segment[start - 1] && dives.is_some() {
                one.surface[0] = None;
                one.starts_afloat = false;
            }
            if end < n && flight.segment[end] == flight.segment[end - 1] && dives.is_some() {
                one.surface[1] = None;
            }
            // Repeats of a slower channel are no rows without a value.
            let held = removed.held.partition_point(|row| *row < end) - removed.held.partition_point(|row| *row < start);
            if one.depth_m.iter().filter(|z| z.is_nan()).count() * 2 > one.depth_m.len() + held {
                notes.push(format!("segment {}: more than half of it has no pitch, ballast, density or pressure; left out", one.segment));
            } else {
                runs.push(one);
            }
        } else {
            notes.push(format!("rows {start} to {end} (segment {}) are too few to run a model on; left out", segment[start]));
        }
        start = end;
    }
    removed.note(&mut notes);
    let has_temperature = flight.temperature_degc.iter().any(|t| t.is_finite());
    if !has_temperature {
        notes.push("there is no temperature: the hull's thermal expansion is left out, and nothing is learned about it".into());
    }
    notes.extend(pressure_unit::suspected(&runs, vehicle));
    let displacements = displacements(&mut runs, vehicle.sensors.gps_noise_m);
    Prepared { runs, displacements, notes, has_temperature, clock_shift_s: shift }
}
