//! What a glider's computers logged, each channel on its own clock, brought to the rows of the CTD.

use super::position::{self, Fix};
use super::pressure_zero;
use super::report::Report;
use super::two_computers::agree;
use crate::record::clock_offset::ENGINEERING_PRESSURE;
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

/// One row of the flight to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Unix time, s.
    pub unix_s: f64,
    /// Number of its segment.
    pub segment: u32,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// °C.
    pub temperature_degc: f64,
    /// Practical salinity.
    pub salinity: f64,
}

/// Channels in SI on Unix time.
#[derive(Default)]
pub(super) struct Log {
    pub rows: Vec<Row>,
    pub pitch: Series,
    pub roll: Series,
    pub heading: Series,
    pub ballast: Series,
    pub battery: Series,
    /// Pressure by the steering computer's own sensor, Pa.
    pub steering_pressure: Series,
    pub fixes: Vec<Fix>,
    /// Where it is where there is no fix.
    pub about: Option<Place>,
}

impl Log {
    /// The flight; none without rows.
    pub fn flight(mut self, name: &str, report: &mut Report) -> Option<Flight> {
        let mut times: Vec<f64> = self.rows.iter().map(|r| r.unix_s).collect();
        let stray = stray_times(&mut times, LONGEST_MISSION_S);
        if stray > 0 {
            report.leave_out(format!("{stray} rows further than 400 days from the others: a clock that was not set, or damage"));
        }
        self.rows.iter_mut().zip(times).for_each(|(r, t)| r.unix_s = t);
        self.fixes = position::sound(std::mem::take(&mut self.fixes), report);
        self.rows.retain(|r| r.unix_s.is_finite() && r.pressure_pa.is_finite());
        self.rows.sort_by(|a, b| a.unix_s.total_cmp(&b.unix_s));
        pressure_zero::drop_zeros(&mut self.rows, |r| (r.unix_s, r.pressure_pa), "the pressure", report);
        if !self.steering_pressure.is_empty() {
            pressure_zero::take_out(&mut self.rows, |r| (r.unix_s, &mut r.pressure_pa), |r| r.segment, report);
        }
        let all = self.rows.len();
        self.rows.dedup_by(|b, a| a.unix_s == b.unix_s);
        if self.rows.len() < all {
            report.leave_out(format!("{} of {all} rows repeat a time: the first of each stays", all - self.rows.len()));
        }
        let start = self.rows.first()?.unix_s;
        let unix: Vec<f64> = self.rows.iter().map(|r| r.unix_s).collect();
        let place = self.fixes.first().map(|f| Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg }).or(self.about);
        let density = |r: &Row| seawater::density_of_water(r.salinity, place, r.temperature_degc, r.pressure_pa * 1e-4);
        let column = |f: &dyn Fn(&Row) -> f64| self.rows.iter().map(f).collect::<Vec<f64>>();
        let mut flight = Flight {
            name: name.to_owned(),
            time_s: column(&|r| r.unix_s - start),
            segment: self.rows.iter().map(|r| r.segment).collect(),
            pressure_pa: column(&|r| r.pressure_pa),
            temperature_degc: column(&|r| r.temperature_degc),
            density_kg_m3: column(&density),
            pitch_rad: self.pitch.on(&unix),
            roll_rad: self.roll.on(&unix),
            heading_rad: self.heading.angle_on(&unix),
            ballast_m3: self.ballast.on(&unix),
            battery_mass_m: self.battery.on(&unix),
            ..Flight::blank(unix.len())
        };
        for (name, series, values) in [("pitch", &self.pitch, &flight.pitch_rad), ("ballast", &self.ballast, &flight.ballast_m3)] {
            report_seldom(name, series, values, report);
        }
        flight.extra.insert(SALINITY_COLUMN.into(), column(&|r| r.salinity));
        if !self.steering_pressure.is_empty() {
            let values = self.steering_pressure.on(&unix);
            agree(&flight, &unix, &self.steering_pressure, report);
            if let Some((first, _)) = self.steering_pressure.pairs().next().filter(|_| values.iter().all(|v| v.is_nan())) {
                let apart_s = first - start;
                report.leave_out(format!("the vehicle's computer has no value while the CTD has: their clocks are {apart_s:+.0} s apart"));
            }
            flight.extra.insert(ENGINEERING_PRESSURE.into(), values.iter().map(|p| p * 1e-4).collect());
        }
        report.start_unix_s = Some(start);
        position::place(&mut flight, &unix, &self.fixes, report);
        Some(flight)
    }
}

/// A channel that comes less often than this does not show a turn, which takes about a minute, s.
const SELDOM_S: f64 = 30.0;

/// Where a channel is known in a smaller share of the rows, it is lost (guess).
const SELDOM_KNOWN: f64 = 0.2;

/// Names a channel that comes seldom: what lies between its values is lost, or nothing can lie between them.
pub(super) fn report_seldom(name: &str, series: &Series, on_rows: &[f64], report: &mut Report) {
    let (count, step_s) = (series.len(), series.step_s());
    let known = on_rows.iter().filter(|v| v.is_finite()).count();
    if count > 0 && (known as f64) < SELDOM_KNOWN * on_rows.len() as f64 {
        let rows = on_rows.len();
        report.leave_out(format!(
            "{name} has {count} values {step_s:.0} s apart, and {known} of {rows} rows one: too far apart to lie between, or of another time"
        ));
    } else if step_s > SELDOM_S {
        report.note(format!("{name} comes every {step_s:.0} s only: interpolated, what happens in between, such as a turn, is lost"));
    }
}

/// Practical salinity of the source, kept beside the density that is computed from it.
pub const SALINITY_COLUMN: &str = "practical_salinity";

/// Times further than `reach_s` from the middle one are those of a clock that was not set, or damage: they become none. How many.
/// The middle is that of the dates where half of the times are dates, else that of the times that count from anywhere; without any
/// date, all stay.
pub(super) fn stray_times(times: &mut [f64], reach_s: f64) -> usize {
    let (dated, others): (Vec<f64>, Vec<f64>) = times.iter().copied().filter(|t| t.is_finite()).partition(|t| *t > SET_CLOCK_S);
    if dated.is_empty() {
        return 0;
    }
    let middle = quantile(if dated.len() >= others.len() { &dated } else { &others }, 0.5);
    let mut stray = 0;
    for t in times.iter_mut().filter(|t| (**t - middle).abs() > reach_s) {
        *t = f64::NAN;
        stray += 1;
    }
    stray
}

/// Times, in any order, that stand alone more than a day from all others become none. How many. A flight of several parts has many rows
/// in each.
pub(super) fn lonely_times(times: &mut [f64]) -> usize {
    let mut sorted: Vec<f64> = times.iter().copied().filter(|t| t.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let parts: Vec<&[f64]> = sorted.chunk_by(|a, b| b - a <= LONGEST_STAY_S).collect();
    let most = parts.iter().map(|p| p.len()).max().unwrap_or(0);
    let alone: Vec<f64> = parts.into_iter().filter(|p| p.len() < FEW_ROWS && p.len() * 10 < most).flatten().copied().collect();
    times.iter_mut().filter(|t| alone.binary_search_by(|a| a.total_cmp(t)).is_ok()).for_each(|t| *t = f64::NAN);
    alone.len()
}

/// No stay at the surface of a mission is longer, s; and fewer rows than a dive has (guesses).
const LONGEST_STAY_S: f64 = 86_400.0;
const FEW_ROWS: usize = 5;

/// Clocks of two computers that are right begin and end within this time of one another, s (guess): further apart is a zone, or a clock
/// that was not set.
pub(super) const CLOCKS_APART_S: f64 = 1500.0;

/// No mission is longer, s.
pub(super) const LONGEST_MISSION_S: f64 = 400.0 * 86400.0;

/// A clock before this Unix time was not set, s: 1973, before any glider.
pub(super) const SET_CLOCK_S: f64 = 1e8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_the_majority_of_times_decides_which_are_stray() {
        let mut relative: Vec<f64> = (0..300).map(|i| 6.0 * f64::from(i)).collect();
        relative[70] = 4_070_908_800.0;
        assert_eq!(stray_times(&mut relative, LONGEST_MISSION_S), 1);
        assert!(relative[70].is_nan() && relative[71] == 426.0);
        let mut dated: Vec<f64> = (0..300).map(|i| 1.6e9 + f64::from(i)).collect();
        dated[..9].iter_mut().for_each(|t| *t -= 1.6e9);
        assert_eq!(stray_times(&mut dated, LONGEST_MISSION_S), 9);
        let mut years = vec![0.0, 1.0, 9e7];
        assert_eq!(stray_times(&mut years, LONGEST_MISSION_S), 0, "no date, nothing to hold it against");
    }
}
