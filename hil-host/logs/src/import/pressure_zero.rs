//! The zero of a pressure sensor, as a stay at the surface shows it.

use super::report::{DensityIs, list_of};
use super::{Imported, Report};
use crate::record::afloat::{is_impossible, reading_afloat, reading_in_a_stay};
use crate::record::plausible::quantile;

/// Speed of sound in sea water, m/s: density grows by dp/c² with pressure (1500 within 4 %).
const SOUND_M_S: f64 = 1500.0;

/// No sensor of a glider reads so far above the surface afloat, Pa.
const ABOVE_PA: f64 = -5e3;

/// Takes the zero out of rows in the order of time (`at`: the time, s, and pressure, Pa, of a row; `segment`: its number), before anything
/// is computed from them: of all, or of those segments alone that read a place in the air where others do not (a metre below the surface
/// a segment may turn). What was taken off each row, Pa.
pub(super) fn take_out<T>(
    rows: &mut [T],
    at: impl Fn(&mut T) -> (f64, &mut f64),
    segment: impl Fn(&T) -> u32,
    report: &mut Report,
) -> Option<Vec<f64>> {
    let numbers: Vec<u32> = rows.iter().map(segment).collect();
    let pairs: Vec<(f64, f64)> = rows.iter_mut().map(&at).map(|(t, p)| (t, *p)).collect();
    let mut off = vec![0.0; rows.len()];
    let mut start = 0;
    let (mut wrong, mut sound) = (Vec::new(), 0);
    for run in numbers.chunk_by(|a, b| a == b) {
        let own = start..start + run.len();
        start = own.end;
        match reading_in_a_stay(pairs[own.clone()].iter().copied()) {
            Some(level) if level < ABOVE_PA => {
                off[own].fill(level);
                wrong.push((run[0], level));
            }
            Some(level) => sound += usize::from(!is_impossible(level)),
            None => {}
        }
    }
    let (level, of) = if sound > 0 && !wrong.is_empty() {
        let names: Vec<String> = wrong.iter().map(|w| w.0.to_string()).collect();
        (wrong[0].1, format!(" in segments {}", list_of(&names)))
    } else {
        let level = reading_afloat(pairs.into_iter())?;
        off.fill(level);
        (level, String::new())
    };
    rows.iter_mut().zip(&off).for_each(|(r, off)| *at(r).1 -= off);
    let what = if level > 5e4 { ": absolute pressure?" } else { "" };
    report.note(format!("pressure reads {:.2} dbar afloat{of}{what}: zero taken out", level * 1e-4));
    Some(off)
}

/// The same of a flight that was made with it: its density, where it was recomputed with that pressure, and its dives, where they are
/// cut at the surface, follow.
///
/// # Errors
/// None.
pub(super) fn take_out_of_flight(imported: &mut Imported) -> Result<(), String> {
    let flight = &imported.flight;
    let mut rows: Vec<(f64, f64, u32)> = (0..flight.len()).map(|i| (flight.time_s[i], flight.pressure_pa[i], flight.segment[i])).collect();
    let Some(off) = take_out(&mut rows, |r| (r.0, &mut r.1), |r| r.2, &mut imported.report) else { return Ok(()) };
    let flight = &mut imported.flight;
    flight.pressure_pa = rows.into_iter().map(|r| r.1).collect();
    if imported.report.density_is == DensityIs::Computed {
        flight.density_kg_m3.iter_mut().zip(off).for_each(|(d, off)| *d -= off / (SOUND_M_S * SOUND_M_S));
    }
    if flight.segment.iter().all(|s| *s == 0) {
        super::surface::cut_anew(imported, 2);
    }
    Ok(())
}

/// Turns values round that grow upward, by their middle, which lies further than `above` in the air then, and says so; whether they did.
pub(super) fn turn_upright(values: &mut [f64], name: &str, above: f64, report: &mut Report) -> bool {
    let upward = quantile(values, 0.5) < -above;
    if upward {
        report.note(format!("{name} grows upward: turned round"));
        values.iter_mut().for_each(|v| *v = -*v);
    }
    upward
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
            assert!(take_out(&mut got, |r| (r.0, &mut r.1), |_| 0, &mut report).is_some(), "{zero}");
            assert!(got.iter().zip(rows(0.0)).all(|(a, b)| (a.1 - b.1).abs() < 1e3), "{zero}");
            assert_eq!(report.notes.len(), 1);
        }
        // A stay of a minute, as between two dives without a call.
        let mut short: Vec<(f64, f64)> =
            rows(10.13).into_iter().enumerate().filter(|(i, _)| i % 110 < 12 || i % 110 >= 30).map(|r| r.1).collect();
        assert!(take_out(&mut short, |r| (r.0, &mut r.1), |_| 0, &mut Report::new("made")).is_some());
        // Turns at 10 dbar, sampled every 45 s, are no stay.
        let depth = [10.0, 10.0, 17.0, 24.0, 31.0, 31.0, 24.0, 17.0];
        let mut turns: Vec<(f64, f64)> = (0..40_u32).map(|i| (45.0 * f64::from(i), 1e4 * depth[i as usize % 8])).collect();
        assert!(take_out(&mut turns, |r| (r.0, &mut r.1), |_| 0, &mut Report::new("made")).is_none());
        let mut report = Report::new("made");
        assert!(take_out(&mut rows(0.3), |r| (r.0, &mut r.1), |_| 0, &mut report).is_none() && report.notes.is_empty());
    }

    #[test]
    fn regress_a_zero_of_one_segment_is_taken_out_there_alone() {
        let segment = |r: &(f64, f64)| (r.0 / 440.0) as u32;
        let mut got: Vec<(f64, f64)> = rows(0.0).into_iter().map(|r| if segment(&r) == 1 { (r.0, r.1 - 2e4) } else { r }).collect();
        let mut report = Report::new("made");
        let off = take_out(&mut got, |r| (r.0, &mut r.1), segment, &mut report).expect("a zero");
        assert!(got.iter().zip(rows(0.0)).all(|(a, b)| (a.1 - b.1).abs() < 1e3) && off[0] == 0.0 && off[150] < -1e4, "{off:?}");
        assert!(report.notes[0].contains("afloat in segments 1: zero taken out"), "{:?}", report.notes);
        // A metre and more below the surface one segment may turn for a while.
        let mut turns: Vec<(f64, f64)> = rows(0.0).into_iter().map(|r| if segment(&r) == 1 { (r.0, r.1 + 1.28e4) } else { r }).collect();
        assert!(take_out(&mut turns, |r| (r.0, &mut r.1), segment, &mut report).is_none());
        let mut all = rows(10.13);
        assert!(take_out(&mut all, |r| (r.0, &mut r.1), segment, &mut report).is_some_and(|off| off.iter().all(|o| *o > 1e5)));
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
