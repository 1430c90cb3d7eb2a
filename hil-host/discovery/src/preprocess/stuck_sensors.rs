//! What is taken out of a log before a model is run on it, and how that is told.

use crate::preprocess::SURFACE_M;
use crate::preprocess::gaps::{SILENT_S, thin_held, unstick};
use logs::record::flight::Flight;

/// Pressure above which a vehicle is submerged, Pa.
const SUBMERGED_PA: f64 = 1e4 * SURFACE_M;
/// A turn of pitch or heading that nobody saw, or that a stuck sensor missed, rad: a quarter of the smallest between dive and climb.
pub(crate) const TURNED_RAD: f64 = 0.1;
/// By how much the density is another when a stuck CTD lets go, kg/m³: a CTD repeats itself in mixed water, and goes on from there.
const UNSTUCK_KG_M3: f64 = 0.1;

/// What was taken out of a log, for the report: samples of each sensor, and rows that are not compared.
#[derive(Default)]
pub(crate) struct Removed {
    pub spikes: [usize; 5],
    stuck: [usize; 5],
    /// Rows of the flight at which a pressure repeats the one before because its channel is slower.
    pub held: Vec<usize>,
    pub air: usize,
    pub silent_rows: usize,
    pub unseen_rows: usize,
}

impl Removed {
    pub fn note(&self, notes: &mut Vec<String>) {
        let of = |counts: &[usize], what: &str, names: &[&str], notes: &mut Vec<String>| {
            let some = counts.iter().zip(names).filter(|(count, _)| **count > 0);
            notes.extend(some.map(|(count, name)| format!("{count} {what} removed from {name}")));
        };
        of(&self.spikes, "spikes", &["pressure", "pitch", "density", "speed", "ballast"], notes);
        of(&self.stuck, "samples of a stuck sensor", &["pressure", "pitch", "speed", "density", "heading"], notes);
        if !self.held.is_empty() {
            let repeats = self.held.len();
            notes.push(format!("pressure holds each value over several rows (a slower channel?): {repeats} repeats left out"));
        }
        if self.air > 0 {
            notes.push(format!("{} densities near the surface are of air in the CTD's cell: left out", self.air));
        }
        if self.silent_rows > 0 {
            let rows = self.silent_rows;
            notes.push(format!("{rows} rows further than {SILENT_S} s from any value of pitch, ballast or density are not compared"));
        }
        if self.unseen_rows > 0 {
            notes.push(format!("{} rows over which pitch or ballast changed unseen are not compared", self.unseen_rows));
        }
    }
}

/// The flight without what its sensors repeated while they were stuck. Afloat they may well rest.
pub(crate) fn unstuck(flight: &Flight, removed: &mut Removed) -> Flight {
    let mut flight = flight.clone();
    let submerged: Vec<bool> = flight.pressure_pa.iter().map(|p| *p > SUBMERGED_PA).collect();
    let judged = |i: usize| submerged[i];
    removed.held = thin_held(&mut flight.pressure_pa, &judged);
    let speed = flight.speed_m_s.as_mut().map_or(0, |speed| unstick(speed, &judged, 0.0));
    removed.stuck = [
        unstick(&mut flight.pressure_pa, &judged, 0.0),
        unstick(&mut flight.pitch_rad, &judged, TURNED_RAD),
        speed,
        unstick(&mut flight.density_kg_m3, &judged, UNSTUCK_KG_M3),
        unstick(&mut flight.heading_rad, &judged, TURNED_RAD),
    ];
    flight
}
