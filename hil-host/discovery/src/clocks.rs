//! Do the two computers of a glider agree on the time?
//!
//! A Slocum logs pitch and ballast by the clock of its flight computer and the CTD by that of its science computer, and tables
//! made from both can be a second or two apart: enough to look like added mass at every turn. Both carry a pressure sensor. The
//! shift of time at which one is a straight line of the other,
//! ```text
//! p_engineering(t) = a p_ctd(t − τ) + b        τ < 0: the engineering channels are early
//! ```
//! tells the difference. Not covered: a pressure sensor with a lag of its own, which counts as clock.

use crate::flight::Flight;

/// Columns that carry the pressure of the flight computer; their unit does not matter.
const ENGINEERING: [&str; 4] = ["eng_pressure_bar", "m_pressure_bar", "m_pressure", "eng_pressure_dbar"];
/// Largest shift that is looked for, and the step of the search, s.
const REACH_S: f64 = 6.0;
const STEP_S: f64 = 0.5;
/// Smaller shifts than this change nothing, s: half a sample of the usual 1 Hz log.
const WORTH_S: f64 = 0.4;
/// Share by which the shift must lower the misfit of the two sensors: else nothing is known.
const WORTH_SHARE: f64 = 0.05;
/// Rows that are compared at most.
const MOST_ROWS: usize = 4000;

/// The shift τ of a flight that has both sensors, s; none if it has not, or if they do not tell.
#[must_use]
pub fn shift_s(flight: &Flight) -> Option<f64> {
    let engineering = ENGINEERING.iter().find_map(|n| flight.extra.get(*n))?;
    let (time, ctd): (Vec<f64>, Vec<f64>) =
        flight.time_s.iter().zip(&flight.pressure_pa).filter(|(_, p)| p.is_finite()).map(|(t, p)| (*t, *p)).unzip();
    let all: Vec<usize> =
        (0..flight.len()).filter(|&i| engineering[i].is_finite() && flight.pressure_pa[i] > 5e4 && flight.time_s[i] > 0.0).collect();
    let rows: Vec<usize> = all.iter().step_by(all.len().div_ceil(MOST_ROWS).max(1)).copied().collect();
    if rows.len() < 200 || time.len() < 200 {
        return None;
    }
    let misfit = |tau: f64| -> f64 {
        let mut pairs = Vec::with_capacity(rows.len());
        for &i in &rows {
            let t = flight.time_s[i] - tau;
            let k = time.partition_point(|x| *x < t).clamp(1, time.len() - 1);
            let (a, b) = (time[k - 1], time[k]);
            // No pressure is made up across a gap.
            if b - a < 10.0 {
                pairs.push((ctd[k - 1] + (ctd[k] - ctd[k - 1]) * ((t - a) / (b - a)).clamp(0.0, 1.0), engineering[i]));
            }
        }
        let n = pairs.len() as f64;
        let (mx, my) = pairs.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
        let (xx, xy, yy) = pairs.iter().fold((0.0, 0.0, 0.0), |(a, b, c), p| {
            let (x, y) = (p.0 - mx, p.1 - my);
            (a + x * x, b + x * y, c + y * y)
        });
        // Mean square left of a straight line, in units of the slope's.
        (yy - xy * xy / xx) / n
    };
    let steps = (REACH_S / STEP_S) as i32;
    let scan: Vec<f64> = (-steps..=steps).map(|k| misfit(f64::from(k) * STEP_S)).collect();
    if scan.iter().any(|m| !m.is_finite()) {
        return None;
    }
    let best = (1..scan.len() - 1).min_by(|a, b| scan[*a].total_cmp(&scan[*b]))?;
    let (left, middle, right) = (scan[best - 1], scan[best], scan[best + 1]);
    let curvature = left - 2.0 * middle + right;
    // A minimum at the end of the reach is none.
    if !(curvature > 0.0) || middle > left || middle > right {
        return None;
    }
    let tau = STEP_S * (best as f64 - f64::from(steps) + 0.5 * (left - right) / curvature);
    (tau.abs() > WORTH_S && middle.sqrt() < (1.0 - WORTH_SHARE) * scan[steps as usize].sqrt()).then_some(tau)
}

/// The flight with its engineering channels brought to the clock of the CTD, if the two pressure sensors tell by how much.
#[must_use]
pub fn aligned(flight: &Flight) -> Option<(Flight, f64)> {
    let tau = shift_s(flight)?;
    let at = |values: &[f64]| -> Vec<f64> {
        let known: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
        (0..values.len())
            .map(|i| {
                let t = flight.time_s[i] + tau;
                let k = known.partition_point(|&j| flight.time_s[j] < t);
                let (Some(&b), Some(&a)) = (known.get(k), k.checked_sub(1).and_then(|k| known.get(k))) else { return values[i] };
                let gap = flight.time_s[b] - flight.time_s[a];
                if gap > 30.0 || !values[i].is_finite() {
                    return values[i];
                }
                values[a] + (values[b] - values[a]) * (t - flight.time_s[a]) / gap
            })
            .collect()
    };
    let mut out = flight.clone();
    out.pitch_rad = at(&flight.pitch_rad);
    out.roll_rad = at(&flight.roll_rad);
    out.ballast_m3 = at(&flight.ballast_m3);
    out.battery_mass_m = at(&flight.battery_mass_m);
    Some((out, tau))
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
        for tau in [-2.3, -1.0, 1.4, 4.0] {
            let f = flight(tau);
            // 0.1 s: the corners of the saw make the misfit no parabola.
            assert!((shift_s(&f).expect("told") - tau).abs() < 0.1, "{tau}: {:?}", shift_s(&f));
            let (a, _) = aligned(&f).expect("told");
            let worst = (10..2990).map(|i| (a.pitch_rad[i] - (0.01 * a.time_s[i]).sin()).abs()).fold(0.0, f64::max);
            assert!(worst < 1.1e-3, "{tau}: {worst} rad");
            assert!(a.battery_mass_m.iter().all(|v| v.is_nan()));
        }
    }

    #[test]
    fn nothing_is_shifted_without_a_second_sensor_or_without_need() {
        assert!(aligned(&flight(0.1)).is_none());
        let mut f = flight(2.0);
        f.extra.clear();
        assert!(aligned(&f).is_none());
    }
}
