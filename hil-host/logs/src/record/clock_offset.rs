//! Do the two computers of a glider agree on the time?
//!
//! A Slocum logs pitch and ballast by the clock of its flight computer and the CTD by that of its science computer, and tables
//! made from both can be a second or two apart: enough to look like added mass at every turn. Both carry a pressure sensor. The
//! shift of time at which the rate of one is a straight line of the rates of the other and of the pitch,
//! ```text
//! p'_engineering(t) = a p'_ctd(t − τ) + l (sin pitch)'(t) + b        τ < 0: the engineering channels are early
//! ```
//! tells the difference. Rates, because two sensors that bend and creep against each other by a metre (a 200 m pump's do) hide a
//! shift that moves them by a few centimetres; over a third of a minute neither does. Pitch, because one sensor sits l behind the
//! other along the hull (0.3 to 0.6 m by the logs of two Slocums, whose engineering port is in the tail) and is the deeper one as
//! the nose comes up, which a shift imitates. How sure the shift is, its parts of the flight say: each is left out in turn
//! (jackknife). Not covered: a pressure sensor with a lag of its own, which counts as clock, and a CTD that sits ahead of or
//! behind the vehicle's centre.

use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;

/// Pressure of the flight computer in an imported flight, dbar.
pub const ENGINEERING_PRESSURE: &str = "eng_pressure_dbar";
/// Columns that carry it; their unit does not matter.
const ENGINEERING: [&str; 4] = [ENGINEERING_PRESSURE, "eng_pressure_bar", "m_pressure_bar", "m_pressure"];
/// Largest shift that is looked for, s: two computers that nobody has set drift apart by some seconds a week (a guess). Beyond
/// the window of the rates nothing ends: a turn is as sharp as before.
pub const REACH_S: i32 = 20;
const OFFSET_STEPS: usize = 2 * REACH_S as usize + 1;
/// Smaller shifts than this change nothing, s: half a sample of the usual 1 Hz log.
const WORTH_S: f64 = 0.4;
/// A shift is believed from so many of its standard errors on.
const SURE: f64 = 3.0;
/// Rates are taken over twice this time, s: a turn of a glider, and a few samples of the slower computer (4 s).
const HALF_WINDOW_S: f64 = 10.0;
/// No pressure is made up across a longer gap, s.
const PRESSURE_GAP_S: f64 = 10.0;
/// What was steered by stays as it is across a longer gap, s.
const BRIDGE_S: f64 = 30.0;
/// Rows that are compared at most.
const MOST_ROWS: usize = 4000;
/// Parts of the flight that are left out in turn.
const LEFT_OUT_PARTS: usize = 8;

/// Sums for a straight line of two rates: of the products of (1, x, z, y), x and z being what explains y.
#[derive(Clone, Copy, Default)]
struct Line([[f64; 4]; 4]);

impl Line {
    fn add(&mut self, x: f64, z: f64, y: f64) {
        let v = [1.0, x, z, y];
        for (row, a) in self.0.iter_mut().zip(v) {
            for (s, b) in row.iter_mut().zip(v) {
                *s += a * b;
            }
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| std::array::from_fn(|j| self.0[i][j] + other.0[i][j])))
    }

    /// Mean square that the line leaves; without z where pitch never moves.
    fn left(&self) -> f64 {
        let n = self.0[0][0];
        let s = |i: usize, j: usize| self.0[i][j] / n - self.0[0][i] * self.0[0][j] / (n * n);
        let (xx, xz, zz) = (s(1, 1), s(1, 2), s(2, 2));
        let (xy, zy, yy) = (s(1, 3), s(2, 3), s(3, 3));
        let own = zz - xz * xz / xx;
        let by_pitch = if own > 1e-9 { (zy - xz * xy / xx).powi(2) / own } else { 0.0 };
        yy - xy * xy / xx - by_pitch
    }
}

/// What a sensor's readings change by in the window about a time; not a number where they do not tell.
fn change(of: &Series, time_s: f64) -> f64 {
    of.at_within(time_s + HALF_WINDOW_S, PRESSURE_GAP_S) - of.at_within(time_s - HALF_WINDOW_S, PRESSURE_GAP_S)
}

/// Where a scan of misfits over the shift is least, s; none if that is at an end of it.
fn least(scan: &[Line; OFFSET_STEPS]) -> Option<f64> {
    let left = scan.map(|l| l.left());
    if left.iter().any(|m| !m.is_finite()) {
        return None;
    }
    let best = (1..OFFSET_STEPS - 1).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
    let (before, here, after) = (left[best - 1], left[best], left[best + 1]);
    let curvature = before - 2.0 * here + after;
    (curvature > 0.0 && here <= before && here <= after).then(|| best as f64 - f64::from(REACH_S) + 0.5 * (before - after) / curvature)
}

/// Whether a shift `tau`, s, leaves less than none as it would if it were true: the misfit grows alike on both sides of it. Two clocks that
/// sample by turns every few seconds have small minima on all sides.
fn stands_out(scan: &[Line; OFFSET_STEPS], tau: f64) -> bool {
    let at = |shift_s: f64| scan.get((shift_s + f64::from(REACH_S)) as usize).map(Line::left);
    let (Some(here), Some(none), Some(beyond)) = (at(tau.round()), at(0.0), at((2.0 * tau).trunc())) else { return true };
    none - here > 0.5 * (beyond - here)
}

/// What the two sensors and the compass of a flight read.
struct Sensors {
    ctd: Series,
    engineering: Series,
    pitch: Series,
}

impl Sensors {
    fn of(flight: &Flight) -> Option<Self> {
        let (_, engineering) = engineering(flight)?;
        let series = |values: &[f64]| Series::new(&flight.time_s, values);
        let pitch: Vec<f64> = flight.pitch_rad.iter().map(|p| p.sin()).collect();
        Some(Self { ctd: series(&flight.pressure_pa), engineering: series(engineering), pitch: series(&pitch) })
    }

    /// Time and the changes of sin pitch and of the engineering pressure at as many of the rows under water as are compared.
    fn rows(&self, flight: &Flight, rows: std::ops::Range<usize>) -> Vec<[f64; 3]> {
        let all: Vec<f64> = rows.filter(|&i| flight.pressure_pa[i] > 5e4 && flight.time_s[i] > 0.0).map(|i| flight.time_s[i]).collect();
        all.iter()
            .step_by(all.len().div_ceil(MOST_ROWS).max(1))
            .map(|t| [*t, change(&self.pitch, *t), change(&self.engineering, *t)])
            .filter(|row| row.iter().all(|v| v.is_finite()))
            .collect()
    }

    /// The sums of these rows for each shift.
    fn scan(&self, rows: &[[f64; 3]]) -> [Line; OFFSET_STEPS] {
        let mut scan = [Line::default(); OFFSET_STEPS];
        for [t, z, y] in rows {
            for (step, line) in scan.iter_mut().enumerate() {
                let x = change(&self.ctd, t - (step as f64 - f64::from(REACH_S)));
                if x.is_finite() {
                    line.add(x, *z, *y);
                }
            }
        }
        scan
    }
}

/// Name and values of the column with the pressure of the flight computer.
pub(super) fn engineering(flight: &Flight) -> Option<(&'static str, &Vec<f64>)> {
    ENGINEERING.iter().find_map(|n| Some((*n, flight.extra.get(*n)?)))
}

/// The shift τ of a flight that has both sensors and its standard error, s; none if it has not, if they do not tell, or if it is not worth taking out.
#[must_use]
pub fn shift_s(flight: &Flight) -> Option<[f64; 2]> {
    let sensors = Sensors::of(flight)?;
    let rows = sensors.rows(flight, 0..flight.len());
    if rows.len() < 200 {
        return None;
    }
    let bounds: [usize; LEFT_OUT_PARTS + 1] = std::array::from_fn(|k| (k * rows.len()).div_ceil(LEFT_OUT_PARTS));
    let parts: [_; LEFT_OUT_PARTS] = std::array::from_fn(|k| sensors.scan(&rows[bounds[k]..bounds[k + 1]]));
    let sum = |left_out: Option<usize>| -> [Line; OFFSET_STEPS] {
        std::array::from_fn(|step| {
            parts.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).fold(Line::default(), |s, (_, p)| s.plus(&p[step]))
        })
    };
    let all = sum(None);
    let tau = least(&all).filter(|tau| stands_out(&all, *tau))?;
    let without = (0..LEFT_OUT_PARTS).map(|k| least(&sum(Some(k)))).collect::<Option<Vec<f64>>>()?;
    let mean = without.iter().sum::<f64>() / LEFT_OUT_PARTS as f64;
    let scatter: f64 = without.iter().map(|t| (t - mean).powi(2)).sum();
    let sigma = ((LEFT_OUT_PARTS - 1) as f64 / LEFT_OUT_PARTS as f64 * scatter).sqrt();
    (tau.abs() > WORTH_S && tau.abs() > SURE * sigma).then_some([tau, sigma])
}

/// Clocks that drift apart: the shift at time 0, s, its growth, s a second, and the standard error of the shift in the middle, s; from
/// the shifts of single segments, which lie on a line. None where they do not, or where one shift serves.
fn drift(flight: &Flight) -> Option<[f64; 3]> {
    let sensors = Sensors::of(flight)?;
    let mut start = 0;
    let mut shifts: Vec<(f64, f64)> = Vec::new();
    for of in flight.segment.chunk_by(|a, b| a == b) {
        let rows = sensors.rows(flight, start..start + of.len());
        start += of.len();
        if let Some(tau) = Some(&rows).filter(|r| r.len() >= LEAST_ROWS_OF_A_SHIFT).and_then(|r| least(&sensors.scan(r))) {
            shifts.push((rows[rows.len() / 2][0], tau));
        }
    }
    let shifts: Vec<(f64, f64)> = shifts.iter().copied().step_by(shifts.len().div_ceil(MOST_SEGMENTS).max(1)).collect();
    if shifts.len() < LEAST_SEGMENTS {
        return None;
    }
    // Of all pairs the middle slope (Theil and Sen): a single dive whose sensors tell another shift does not turn it.
    let pairs = shifts.iter().enumerate().flat_map(|(k, a)| shifts[k + 1..].iter().map(|b| (b.1 - a.1) / (b.0 - a.0)));
    let slopes: Vec<f64> = pairs.collect();
    let rate = quantile(&slopes, 0.5);
    let agree = slopes.iter().filter(|s| s.signum() == rate.signum()).count() as f64 / slopes.len() as f64;
    let of = |f: &dyn Fn(&(f64, f64)) -> f64| quantile(&shifts.iter().map(f).collect::<Vec<_>>(), 0.5);
    let at_start_s = of(&|s| s.1 - rate * s.0);
    // 1.48 median deviations are one sigma.
    let left = 1.48 * of(&|s| (s.1 - at_start_s - rate * s.0).abs());
    let grown = rate * (shifts[shifts.len() - 1].0 - shifts[0].0);
    let sure = grown.abs() > 2.0 * WORTH_S && agree > AGREE && left < 0.25 * grown.abs();
    sure.then_some([at_start_s, rate, left / (shifts.len() as f64).sqrt()])
}

/// Segments that tell a drift at the least and at most, the share of their pairs that agree on its sign, and rows that tell the shift of one
/// (guesses).
const LEAST_SEGMENTS: usize = 5;
const MOST_SEGMENTS: usize = 200;
const AGREE: f64 = 0.75;
const LEAST_ROWS_OF_A_SHIFT: usize = 60;

/// Brings the engineering channels of a flight to the clock of the CTD, if the two pressure sensors tell by how much: by one shift, or by one
/// that grows where the clocks drift apart; the shift in the middle of the flight and its standard error, s.
pub fn align(flight: &mut Flight) -> Option<[f64; 2]> {
    let middle_s = 0.5 * (flight.time_s.first()? + flight.time_s.last()?);
    let (at_start_s, rate, tau, sigma) = match drift(flight) {
        Some([at_start_s, rate, sigma]) => (at_start_s, rate, at_start_s + rate * middle_s, sigma),
        None => shift_s(flight).map(|[tau, sigma]| (tau, 0.0, tau, sigma))?,
    };
    let Flight { time_s, pitch_rad, roll_rad, ballast_m3, battery_mass_m, .. } = flight;
    for values in [pitch_rad, roll_rad, ballast_m3, battery_mass_m] {
        let series = Series::new(time_s, values);
        for (value, time_s) in values.iter_mut().zip(&*time_s).filter(|(value, _)| value.is_finite()) {
            let moved = series.at_within(time_s + (at_start_s + rate * time_s), BRIDGE_S);
            *value = if moved.is_finite() { moved } else { *value };
        }
    }
    Some([tau, sigma])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saw(t: f64) -> f64 {
        1e5 + 4e5 * (1.0 - (t / 300.0 - 2.0 * (t / 600.0).floor() - 1.0).abs())
    }

    fn flight(tau: f64) -> Flight {
        let time_s: Vec<f64> = (0..3000).map(f64::from).collect();
        let mut f = Flight {
            pressure_pa: time_s.iter().map(|t| saw(*t)).collect(),
            pitch_rad: time_s.iter().map(|t| (0.01 * (t - tau)).sin()).collect(),
            roll_rad: vec![0.0; 3000],
            ballast_m3: vec![1e-4; 3000],
            battery_mass_m: vec![f64::NAN; 3000],
            time_s,
            ..Flight::default()
        };
        f.extra.insert("eng_pressure_bar".into(), f.time_s.iter().map(|t| saw(t - tau) * 1.01e-5 + 0.02).collect());
        f
    }

    #[test]
    fn accuracy_a_shift_between_two_pressure_sensors_is_found_and_taken_out() {
        for tau in [-17.0, -6.5, -2.3, -1.0, 1.4, 4.0] {
            let f = flight(tau);
            // 0.1 s: the corners of the saw make the misfit no parabola.
            assert!((shift_s(&f).expect("told")[0] - tau).abs() < 0.1, "{tau}: {:?}", shift_s(&f));
            let mut a = f.clone();
            align(&mut a).expect("estimated");
            let worst = (20..2980).map(|i| (a.pitch_rad[i] - (0.01 * a.time_s[i]).sin()).abs()).fold(0.0, f64::max);
            assert!(worst < 1.1e-3, "{tau}: {worst} rad");
            assert!(a.battery_mass_m.iter().all(|v| v.is_nan()));
        }
    }

    #[test]
    fn nothing_is_shifted_without_a_second_sensor_or_without_need() {
        assert!(align(&mut flight(0.1)).is_none());
        let mut f = flight(2.0);
        f.extra.clear();
        assert!(align(&mut f).is_none());
    }

    /// A deep pump's sensor that sits in the tail: it bends by a metre over the range, creeps by half a metre, and is 0.4 m behind
    /// the CTD; the pitch follows the direction of travel and takes ten seconds to turn.
    #[test]
    fn accuracy_a_clock_shift_is_found_under_a_bent_creeping_late_sensor() {
        let mut f = flight(-0.8);
        let pitch = |t: f64| 0.45 * (1.5 * (saw(t - 5.0) - saw(t + 5.0)) / 1.33e4).clamp(-1.0, 1.0);
        f.pitch_rad = f.time_s.iter().map(|t| pitch(t + 0.8)).collect();
        let bent = |p: f64, t: f64| p * 1.01e-5 + 0.1 * (p / 5e5).powi(2) + 0.05 * (t / 3000.0).powi(2);
        f.extra.insert("eng_pressure_bar".into(), f.time_s.iter().map(|t| bent(saw(t + 0.8), *t) + 0.04 * pitch(t + 0.8).sin()).collect());
        // 0.15 s: the bend moves the rates of dive and climb apart as well.
        assert!((shift_s(&f).expect("told")[0] + 0.8).abs() < 0.15, "{:?}", shift_s(&f));
    }

    /// Clocks that drift apart by 15 s in ten dives.
    #[test]
    fn accuracy_clocks_that_drift_apart_are_followed_from_dive_to_dive() {
        let mut f = flight(0.0);
        let late = |t: f64| 15.0 * t / 3000.0;
        f.segment = (0..3000).map(|i| i / 300).collect();
        f.pitch_rad = f.time_s.iter().map(|t| (0.01 * (t - late(*t))).sin()).collect();
        f.extra.insert("eng_pressure_bar".into(), f.time_s.iter().map(|t| saw(t - late(*t)) * 1e-5).collect());
        let mut a = f.clone();
        let [tau, _] = align(&mut a).expect("estimated");
        let worst = (30..2950).map(|i| (a.pitch_rad[i] - (0.01 * a.time_s[i]).sin()).abs()).fold(0.0, f64::max);
        // 0.01 rad a second: a second is left of fifteen, as each dive's own clock moves by 1.5 s within it.
        assert!((tau - 7.5).abs() < 0.3 && worst < 0.01, "{tau} s, {worst} rad");
    }

    /// Sensors that sample every 4 s by turns, one of them scaled: no shift of a sampling step.
    #[test]
    fn regress_a_scaled_pressure_sampled_by_turns_shows_no_shift() {
        let scan = |left: [f64; 5]| -> [Line; OFFSET_STEPS] {
            std::array::from_fn(|k| {
                let step = (k as f64 - f64::from(REACH_S) + 8.0) / 4.0;
                let (low, share) = (step.floor().clamp(0.0, 3.0), step - step.floor().clamp(0.0, 3.0));
                let wanted = left[low as usize] + share.max(0.0) * (left[low as usize + 1] - left[low as usize]);
                let mut line = Line::default();
                // Rates of which nothing is explained: what is left is their mean square.
                [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)]
                    .iter()
                    .for_each(|(x, z, y)| line.add(*x, *z, y * wanted.sqrt()));
                line
            })
        };
        // Misfits at shifts of -8, -4, 0, 4, 8 s, of a 200 m pump's log with a sensor that reads 4 % low; and of one that is early.
        assert!(!stands_out(&scan([0.034_6, 0.027_0, 0.029_1, 0.033_4, 0.04]), -4.0));
        assert!(stands_out(&scan([0.09, 0.027_0, 0.088, 0.3, 0.6]), -4.0));
    }

    /// Half of the flight early and half of it late is a log with a gap in its clock, not a shift.
    #[test]
    fn a_shift_that_the_parts_of_a_flight_do_not_agree_on_is_not_believed() {
        let mut f = flight(0.0);
        let shift = |t: f64| if t < 1000.0 { 4.0 } else { -0.5 };
        f.extra.insert("eng_pressure_bar".into(), f.time_s.iter().map(|t| saw(t - shift(*t)) * 1e-5).collect());
        assert!(shift_s(&f).is_none(), "{:?}", shift_s(&f));
    }
}
