//! The way made, for a map: dead reckoning by compass and the model's speed through the water, and the GPS fixes.
//!
//! Each dive begins where the one before came up: at its last fix, or without one where dead reckoning ends.

use discovery::Flight;
use discovery::model::dynamics::Track;
use discovery::preprocess::Run;

/// A place, m east and north of the start.
pub type Place = (f64, f64);

/// A way on the map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Way {
    /// Of each run, row by row; NaN where there is no compass.
    pub reckoned: Vec<Vec<Place>>,
    /// The fixes.
    pub fixes: Vec<Place>,
}

/// The way of a flight by the tracks of its runs.
#[must_use]
pub fn way(flight: &Flight, runs: &[Run], tracks: &[Track]) -> Way {
    let compass = flight.heading_rad.iter().any(|h| h.is_finite());
    let (mut out, mut start) = (Way::default(), (0.0, 0.0));
    let paired: Vec<(&Run, &Track)> = runs.iter().zip(tracks).collect();
    for dive in paired.chunk_by(|a, b| a.0.segment == b.0.segment) {
        let mut at = if compass { start } else { (f64::NAN, f64::NAN) };
        for (run, track) in dive {
            let mut places = Vec::with_capacity(run.time_s.len());
            for row in 0..run.time_s.len() {
                let before = row.saturating_sub(1);
                let (speed, sink) = (track.speed_m_s[before], track.sink_m_s[before]);
                let step = (speed * speed - sink * sink).max(0.0).sqrt() * (run.time_s[row] - run.time_s[before]);
                let input = run.input_at_row(before, 0.0);
                at = (at.0 + step * input.sin_heading, at.1 + step * input.cos_heading);
                places.push(at);
            }
            out.reckoned.push(places);
        }
        let (first, last) = (&dive[0].0, &dive[dive.len() - 1].0);
        let under_way = (first.time_s.first().copied(), last.time_s.last().copied());
        let fixes = rows_of(flight, first.segment).filter_map(|i| {
            let fix = (flight.gps_east_m[i], flight.gps_north_m[i]);
            (fix.0.is_finite() && fix.1.is_finite()).then(|| (flight.time_s[i], (start.0 + fix.0, start.1 + fix.1)))
        });
        let fixes: Vec<(f64, Place)> = fixes.collect();
        out.fixes.extend(fixes.iter().map(|f| f.1));
        let middle = under_way.0.zip(under_way.1).map_or(f64::INFINITY, |(a, b)| 0.5 * (a + b));
        let up = fixes.last().filter(|f| f.0 > middle).map(|f| f.1);
        start = up.unwrap_or(if at.0.is_finite() { at } else { start });
    }
    out
}

fn rows_of(flight: &Flight, segment: u32) -> impl Iterator<Item = usize> + '_ {
    (0..flight.len()).filter(move |i| flight.segment[*i] == segment)
}
