//! The zero of a pressure sensor, as a stay at the surface shows it.

use super::{Imported, Report};
use crate::record::plausible::quantile;

/// Waves and noise of a sensor afloat, Pa; and how long a glider floats at least, s.
const SURFACE_PA: f64 = 2e3;
const STAY_S: f64 = 60.0;
/// Speed of sound in sea water, m/s: density grows by dp/c² with pressure (1500 within 4 %).
const SOUND_M_S: f64 = 1500.0;

/// What a sensor reads in a stay of a minute at its least, where no part of a glider can be: above the surface, or a metre and more
/// below, Pa. An absolute pressure reads about 10 dbar there. None where it reads what a glider's does.
fn afloat(rows: impl Iterator<Item = (f64, f64)> + Clone) -> Option<f64> {
    let level = quantile(&rows.clone().map(|r| r.1).collect::<Vec<_>>(), 0.01);
    let (mut stay_s, mut longest_s) = (0.0, 0.0_f64);
    let mut before: Option<(f64, f64)> = None;
    for (t, p) in rows {
        let near = |p: f64| (p - level).abs() < SURFACE_PA;
        let joined = before.filter(|(earlier, was)| near(*was) && near(p) && t - earlier < STAY_S);
        stay_s = joined.map_or(0.0, |(earlier, _)| stay_s + t - earlier);
        longest_s = longest_s.max(stay_s);
        before = Some((t, p));
    }
    let impossible = (-1.2e5..-2e3).contains(&level) || (1e4..1.2e5).contains(&level);
    (longest_s >= STAY_S && impossible).then_some(level)
}

/// Takes the zero out of pressures in time, before anything is computed from them; what it was, Pa.
pub(super) fn take_out(rows: &mut [(f64, f64)], report: &mut Report) -> Option<f64> {
    let level = afloat(rows.iter().copied())?;
    rows.iter_mut().for_each(|r| r.1 -= level);
    let what = if level > 5e4 { ": absolute pressure?" } else { "" };
    report.note(format!("pressure reads {:.2} dbar afloat{what}: zero taken out", level * 1e-4));
    Some(level)
}

/// The same of a flight that was made with it: its density, where it was recomputed with that pressure, and its dives, where they are
/// cut at the surface, follow.
pub(super) fn take_out_of_flight(imported: &mut Imported) {
    let flight = &imported.flight;
    let mut rows: Vec<(f64, f64)> = flight.time_s.iter().copied().zip(flight.pressure_pa.iter().copied()).collect();
    let Some(level) = take_out(&mut rows, &mut imported.report) else { return };
    let flight = &mut imported.flight;
    flight.pressure_pa = rows.into_iter().map(|r| r.1).collect();
    if imported.report.density.contains("TEOS-10") {
        flight.density_kg_m3.iter_mut().for_each(|d| *d -= level / (SOUND_M_S * SOUND_M_S));
    }
    let before = flight.segment.clone();
    if before.iter().all(|s| *s == 0) && super::surface::cut(flight) > 1 {
        let count = flight.segment.last().map_or(1, |s| s + 1);
        imported.report.segments = (1..=count).map(|k| format!("dive {k}")).collect();
        super::position::rebase(flight, &mut imported.report, &before);
    }
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
            assert!(take_out(&mut got, &mut report).is_some(), "{zero}");
            assert!(got.iter().zip(rows(0.0)).all(|(a, b)| (a.1 - b.1).abs() < 1e3), "{zero}");
            assert_eq!(report.notes.len(), 1);
        }
        let mut report = Report::new("made");
        assert!(take_out(&mut rows(0.3), &mut report).is_none() && report.notes.is_empty());
    }
}
