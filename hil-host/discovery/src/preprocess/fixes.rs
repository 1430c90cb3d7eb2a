//! GPS fixes before and after a dive, and ways between them.

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
