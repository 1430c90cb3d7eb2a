//! The way made, for a map: dead reckoning by compass and the model's speed through the water, and the GPS fixes.
//!
//! Each dive begins where the one before came up: at its last fix, or without one where dead reckoning ends.

use discovery::model::dynamics::Track;
use discovery::preprocess::Run;
use logs::Flight;

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

#[cfg(test)]
mod tests {
    use super::*;
    use discovery::preprocess::prepare;
    use std::f64::consts::FRAC_PI_2;
    use std::path::Path;

    const STEP_S: f64 = 4.0;
    /// Rows of a dive: down and up again.
    const ROWS: usize = 200;

    /// Two dives to 40 m and back, each a segment; fixes only where `fixes` puts them: row, east, north, of the dive's own launch point.
    fn flight(heading_rad: [f64; 2], fixes: &[(usize, f64, f64)]) -> Flight {
        let mut f = Flight::blank(2 * ROWS);
        for row in 0..2 * ROWS {
            let (dive, inside) = (row / ROWS, row % ROWS);
            let down = inside < ROWS / 2;
            let depth_m = 0.4 * if down { inside } else { ROWS - inside } as f64;
            f.time_s[row] = STEP_S * row as f64;
            f.segment[row] = dive as u32;
            f.pressure_pa[row] = 1005.8 * 9.81 * depth_m;
            f.pitch_rad[row] = if down { -0.4 } else { 0.4 };
            f.roll_rad[row] = 0.0;
            f.heading_rad[row] = heading_rad[dive];
            f.ballast_m3[row] = if down { -2e-4 } else { 2e-4 };
            f.temperature_degc[row] = 11.0;
            f.density_kg_m3[row] = 1005.8;
        }
        for (row, east, north) in fixes {
            (f.gps_east_m[*row], f.gps_north_m[*row]) = (*east, *north);
        }
        f
    }

    /// The way of a flight that does 0.5 m/s through the water, 0.3 m/s of it down or up: 0.4 m/s over ground.
    fn way_of(flight: &Flight) -> Way {
        let file = include_str!("../../../vehicles/comet.toml");
        let vehicle = logs::vehicle::parse_text(file, Path::new("comet.toml")).expect("a vehicle");
        let runs = prepare(flight, &vehicle).runs;
        assert_eq!(runs.iter().map(|r| r.segment).collect::<Vec<_>>(), [0, 1], "one run a dive");
        let track = |run: &Run| {
            let rows = run.time_s.len();
            let sink_m_s = run.time_s.iter().map(|t| if t % (STEP_S * ROWS as f64) < 400.0 { 0.3 } else { -0.3 }).collect();
            let (depth_m, alpha_rad) = (run.depth_m.clone(), vec![0.05; rows]);
            Track { depth_m, sink_m_s, speed_m_s: vec![0.5; rows], alpha_rad, displacement_m: (0.0, 0.0), half_steps: 0 }
        };
        let tracks: Vec<Track> = runs.iter().map(track).collect();
        way(flight, &runs, &tracks)
    }

    fn near(a: Place, b: Place) -> bool {
        (a.0 - b.0).abs() < 0.5 && (a.1 - b.1).abs() < 0.5
    }

    /// Metres over ground of a run that lacks no row of its dive.
    fn metres(places: &[Place]) -> f64 {
        0.4 * STEP_S * (places.len() - 1) as f64
    }

    #[test]
    fn dead_reckoning_goes_by_the_compass_and_dives_join() {
        // North, then east.
        let w = way_of(&flight([0.0, FRAC_PI_2], &[]));
        let [first, second] = &w.reckoned[..] else { panic!("{} runs", w.reckoned.len()) };
        assert!(
            first.len() > ROWS / 2 && near(first[0], (0.0, 0.0)) && near(first[first.len() - 1], (0.0, metres(first))),
            "{:?}",
            first.last()
        );
        let end = (metres(second), metres(first));
        assert!(near(second[0], (0.0, metres(first))) && near(second[second.len() - 1], end), "{:?}", second.last());
        assert!(w.fixes.is_empty());
    }

    #[test]
    fn a_dive_begins_at_the_last_fix_of_the_one_before() {
        let w = way_of(&flight([0.0, 0.0], &[(0, 1.0, 2.0), (ROWS - 1, 120.0, 250.0), (2 * ROWS - 1, 10.0, 300.0)]));
        let second = &w.reckoned[1];
        assert!(near(second[0], (120.0, 250.0)) && near(second[second.len() - 1], (120.0, 250.0 + metres(second))), "{second:?}");
        // A fix is of its dive's launch point, which lies where the one before came up.
        assert_eq!(w.fixes, [(1.0, 2.0), (120.0, 250.0), (130.0, 550.0)]);
    }

    #[test]
    fn a_fix_before_the_dive_says_nothing_of_where_it_comes_up() {
        let w = way_of(&flight([0.0, 0.0], &[(0, 50.0, 0.0)]));
        let first = &w.reckoned[0];
        assert!(near(w.reckoned[1][0], first[first.len() - 1]), "{:?}", w.reckoned[1][0]);
    }

    #[test]
    fn without_a_compass_there_are_fixes_and_no_way() {
        let w = way_of(&flight([f64::NAN, f64::NAN], &[(ROWS - 1, 120.0, 250.0)]));
        assert!(w.reckoned.iter().flatten().all(|p| p.0.is_nan()), "{:?}", w.reckoned[0][0]);
        assert_eq!(w.fixes, [(120.0, 250.0)]);
    }
}
