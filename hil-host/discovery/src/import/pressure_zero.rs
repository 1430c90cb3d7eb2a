//! The zero of a pressure sensor, as a stay at the surface shows it.

use super::{Imported, Report};
use crate::record::afloat::reading_afloat;

/// Speed of sound in sea water, m/s: density grows by dp/c² with pressure (1500 within 4 %).
const SOUND_M_S: f64 = 1500.0;

/// Takes the zero out of rows in the order of time (`at`: the time, s, and pressure, Pa, of a row), before anything is computed from them; what it was, Pa.
pub(super) fn take_out<T>(rows: &mut [T], at: impl Fn(&mut T) -> (f64, &mut f64), report: &mut Report) -> Option<f64> {
    let pairs: Vec<(f64, f64)> = rows.iter_mut().map(&at).map(|(t, p)| (t, *p)).collect();
    let level = reading_afloat(pairs.into_iter())?;
    rows.iter_mut().for_each(|r| *at(r).1 -= level);
    let what = if level > 5e4 { ": absolute pressure?" } else { "" };
    report.note(format!("pressure reads {:.2} dbar afloat{what}: zero taken out", level * 1e-4));
    Some(level)
}

/// The same of a flight that was made with it: its density, where it was recomputed with that pressure, and its dives, where they are
/// cut at the surface, follow.
pub(super) fn take_out_of_flight(imported: &mut Imported) {
    let flight = &imported.flight;
    let mut rows: Vec<(f64, f64)> = flight.time_s.iter().copied().zip(flight.pressure_pa.iter().copied()).collect();
    let Some(level) = take_out(&mut rows, |r| (r.0, &mut r.1), &mut imported.report) else { return };
    let flight = &mut imported.flight;
    flight.pressure_pa = rows.into_iter().map(|r| r.1).collect();
    if imported.report.density.contains("TEOS-10") {
        flight.density_kg_m3.iter_mut().for_each(|d| *d -= level / (SOUND_M_S * SOUND_M_S));
    }
    if flight.segment.iter().all(|s| *s == 0) {
        super::surface::cut_anew(imported, 2);
    }
}

/// Under water, Pa.
pub(super) const UNDER_WATER_PA: f64 = 2e4;
/// No glider rises or sinks faster, Pa/s (1 m/s).
const FASTEST_PA_S: f64 = 1e4;

/// Takes out rows whose pressure is the zero of a sensor that was off: to which, and from which, no glider could come so fast. `at` is
/// the time, s, and pressure, Pa, of a row, `name` the sensor's.
pub(super) fn drop_zeros<T>(rows: &mut Vec<T>, at: impl Fn(&T) -> (f64, f64), name: &str, report: &mut Report) {
    let pairs: Vec<(f64, f64)> = rows.iter().map(at).collect();
    let zeros = zeros_under_way(&pairs);
    if !zeros.is_empty() {
        report.note(format!("{} of {} values of {name} are 0 in the middle of a dive: left out", zeros.len(), pairs.len()));
        let mut place = 0..;
        rows.retain(|_| place.next().is_none_or(|k| !zeros.contains(&k)));
    }
}

/// Places of such zeros.
fn zeros_under_way(pairs: &[(f64, f64)]) -> std::collections::BTreeSet<usize> {
    let mut out = std::collections::BTreeSet::new();
    let mut start = 0;
    while start < pairs.len() {
        let end = (start..pairs.len()).find(|k| pairs[*k].1 != 0.0).unwrap_or(pairs.len());
        if end > start && start > 0 && end < pairs.len() {
            let (before, first, last, after) = (pairs[start - 1], pairs[start], pairs[end - 1], pairs[end]);
            let fast = |p: f64, step_s: f64| p > FASTEST_PA_S * step_s && p > UNDER_WATER_PA;
            if fast(before.1, first.0 - before.0) && fast(after.1, after.0 - last.0) {
                out.extend(start..end);
            }
        }
        start = end.max(start + 1);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three dives to 40 dbar with two minutes afloat between them, 4 s apart, read `zero` dbar too high.
    fn rows(zero: f64) -> Vec<(f64, f64)> {
        let depth = |k: u32| if k < 30 { 0.05 } else { 40.0 - (f64::from(k) - 70.0).abs() };
        (0..330).map(|i| (4.0 * f64::from(i), 1e4 * (zero + depth(i % 110)))).collect()
    }

    #[test]
    fn regress_an_absolute_pressure_is_a_gauge_one_before_dives_are_cut() {
        for zero in [10.13, 3.0, -1.5] {
            let mut report = Report::new("made");
            let mut got = rows(zero);
            assert!(take_out(&mut got, |r| (r.0, &mut r.1), &mut report).is_some(), "{zero}");
            assert!(got.iter().zip(rows(0.0)).all(|(a, b)| (a.1 - b.1).abs() < 1e3), "{zero}");
            assert_eq!(report.notes.len(), 1);
        }
        // A stay of a minute, as between two dives without a call.
        let mut short: Vec<(f64, f64)> =
            rows(10.13).into_iter().enumerate().filter(|(i, _)| i % 110 < 12 || i % 110 >= 30).map(|r| r.1).collect();
        assert!(take_out(&mut short, |r| (r.0, &mut r.1), &mut Report::new("made")).is_some());
        // Turns at 10 dbar, sampled every 45 s, are no stay.
        let depth = [10.0, 10.0, 17.0, 24.0, 31.0, 31.0, 24.0, 17.0];
        let mut turns: Vec<(f64, f64)> = (0..40_u32).map(|i| (45.0 * f64::from(i), 1e4 * depth[i as usize % 8])).collect();
        assert!(take_out(&mut turns, |r| (r.0, &mut r.1), &mut Report::new("made")).is_none());
        let mut report = Report::new("made");
        assert!(take_out(&mut rows(0.3), |r| (r.0, &mut r.1), &mut report).is_none() && report.notes.is_empty());
    }

    #[test]
    fn regress_zeros_of_a_sensor_that_is_off_in_a_dive_are_found() {
        let at = |i: u32, p: f64| (4.0 * f64::from(i), p);
        let mut pairs: Vec<(f64, f64)> = (0..100).map(|i| at(i, 1e4 * (34.0 + 0.1 * f64::from(i)))).collect();
        assert!(zeros_under_way(&pairs).is_empty());
        (40..55).for_each(|k| pairs[k].1 = 0.0);
        assert_eq!(zeros_under_way(&pairs).into_iter().collect::<Vec<_>>(), (40..55).collect::<Vec<_>>());
        // Afloat, and from there down as fast as a glider sinks.
        let surfacing: Vec<(f64, f64)> = (0..100_u32).map(|i| at(i, 1e4 * f64::from(i.abs_diff(50).saturating_sub(5)))).collect();
        assert!(zeros_under_way(&surfacing).is_empty());
    }
}
