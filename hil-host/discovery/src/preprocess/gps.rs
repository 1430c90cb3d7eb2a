//! GPS fixes before and after a dive, and the ways between them: over one dive, or over several without a surfacing between them.

use crate::preprocess::Run;
use logs::record::flight::Flight;
use std::ops::Range;

/// Mean of the GPS fixes at one end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fix {
    east_m: f64,
    north_m: f64,
    pub(crate) time_s: f64,
    count: f64,
}

impl Fix {
    /// Displacement to another fix (east, north), m, and its 1-sigma error in each direction, m.
    pub(crate) fn to(&self, end: &Self, gps_noise_m: f64) -> (f64, f64, f64) {
        (end.east_m - self.east_m, end.north_m - self.north_m, gps_noise_m * (1.0 / self.count + 1.0 / end.count).sqrt())
    }
}

/// A way from fix to fix over several runs.
#[derive(Clone, Debug)]
pub struct Displacement {
    /// Which runs.
    pub runs: Range<usize>,
    /// Displacement from the fixes before the first to those after the last (east, north), m, and its 1-sigma error in each direction, m.
    pub displacement_m: (f64, f64, f64),
}

/// Mean fixes in the first and in the second half of some rows.
pub(crate) fn fixes(flight: &Flight, rows: Range<usize>) -> [Option<Fix>; 2] {
    let middle = 0.5 * (flight.time_s[rows.start] + flight.time_s[rows.end - 1]);
    let mut sums = [[0.0_f64; 4]; 2];
    for i in rows {
        let (time, east, north) = (flight.time_s[i], flight.gps_east_m[i], flight.gps_north_m[i]);
        if east.is_finite() && north.is_finite() {
            let half = &mut sums[usize::from(time > middle)];
            half.iter_mut().zip([1.0, east, north, time]).for_each(|(sum, x)| *sum += x);
        }
    }
    let mean = |[n, east, north, time]: [f64; 4]| Fix { east_m: east / n, north_m: north / n, time_s: time / n, count: n };
    sums.map(|s| (s[0] > 0.0).then(|| mean(s)))
}

/// Finds the ways over several runs: one with fixes before it only, others that follow at once without any, one with fixes after it
/// only. Each run is told its part of the time.
pub(crate) fn displacements(runs: &mut [Run], gps_noise_m: f64) -> Vec<Displacement> {
    let mut displacements = Vec::new();
    let mut first = None;
    for k in 0..runs.len() {
        let follows = k > 0 && runs[k].first_row == runs[k - 1].first_row + runs[k - 1].time_s.len();
        match runs[k].fixes {
            [Some(start), None] => first = Some((k, start)),
            [None, None] if follows => {}
            [None, Some(end)] if follows => {
                let Some((begin, start)) = first.take() else { continue };
                let between = &mut runs[begin..=k];
                if between.iter().any(|r| r.blind) {
                    continue;
                }
                for run in between {
                    let (from, to) = (run.time_s[0], run.time_s[run.time_s.len() - 1]);
                    run.displacement_s = to.min(end.time_s) - from.max(start.time_s);
                }
                displacements.push(Displacement { runs: begin..k + 1, displacement_m: start.to(&end, gps_noise_m) });
            }
            _ => first = None,
        }
    }
    displacements
}
