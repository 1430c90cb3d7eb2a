//! The CTD's pressure and that of the vehicle's own computer, side by side: of one dive or not, on one clock or not, in which minutes
//! the CTD has no sample.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::pressure_zero::UNDER_WATER_PA;
use super::report::list_of;
use super::{Report, position};
use crate::record::clock_offset;
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;

/// Clocks are looked for so far apart, s, in these steps first.
const CLOCK_REACH_S: i32 = 150;
const COARSE_S: i32 = 5;
/// Two clocks that are named stand so far apart at the least, s (guess): a comparison takes out less, where it is the same all the time.
const NAMED_CLOCKS_APART_S: f64 = 8.0;
/// A shift of one clock is believed where it leaves less than this share of the mean square (guess).
const EXPLAINED: f64 = 0.25;
/// Two sensors on one clock scatter by less about their difference, Pa: a second of a glider's way many times over (guess).
const SCATTER_PA: f64 = 1e4;
/// As many rows of a segment say how far two clocks are apart.
const ROWS_COMPARED: usize = 200;

/// A segment in which the two do not agree.
struct Apart {
    segment: u32,
    /// How far the pressures differ in the middle, and how deep it went, Pa.
    off: f64,
    deep: f64,
    /// By how much the vehicle's clock is to be set to fit, s; 0 where that does not explain it.
    lag_s: f64,
}

/// Says in which segments the CTD's pressure and the vehicle's own, Pa on Unix time as the rows' `unix`, are of different dives, or of
/// clocks apart.
pub(super) fn agree(flight: &Flight, unix: &[f64], own: &Series, report: &mut Report) {
    let segments = position::segments(flight);
    let apart: Vec<Apart> = segments.iter().filter_map(|rows| compare(flight, unix, own, rows)).collect();
    let Some(most) = apart.iter().max_by(|a, b| a.off.total_cmp(&b.off)) else { return };
    let numbers: Vec<String> = apart.iter().map(|a| a.segment.to_string()).collect();
    let named = if apart.len() == segments.len() { String::new() } else { format!(" in segments {}", list_of(&numbers)) };
    let why = if most.lag_s == 0.0 {
        "one of them is wrong, or their clocks are apart".to_owned()
    } else {
        format!("they fit with the vehicle's clock set by {:+.0} s", most.lag_s)
    };
    // As long as it is one shift all the time a comparison finds it better, from the rates.
    let taken_out = named.is_empty() && apart.iter().all(|a| a.lag_s != 0.0 && a.lag_s.abs() < f64::from(clock_offset::REACH_S));
    let why = if taken_out { why + ", which a comparison does" } else { why };
    let what = format!(
        "CTD and vehicle do not agree{named}: their pressures differ by {:.1} dbar in the middle, the vehicle went to {:.1} dbar; {why}",
        most.off * 1e-4,
        most.deep * 1e-4
    );
    if taken_out { report.note(what) } else { report.leave_out(what) }
}

/// Compares them in the `rows` of one segment. Two sensors of one dive differ by less than a few dbar and 3 %.
fn compare(flight: &Flight, unix: &[f64], own: &Series, rows: &Range<usize>) -> Option<Apart> {
    let step = rows.len().div_ceil(ROWS_COMPARED).max(1);
    let pairs: Vec<(f64, f64)> = rows.clone().step_by(step).map(|i| (unix[i], flight.pressure_pa[i])).collect();
    let differences = |lag_s: f64| -> Vec<f64> { pairs.iter().map(|(t, p)| p - own.at(t - lag_s)).filter(|d| d.is_finite()).collect() };
    // Mean square about their mean difference, of as many rows at the least as half of those that are known unshifted.
    let now = differences(0.0);
    let scatter = |lag_s: f64| {
        let off = differences(lag_s);
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        if 2 * off.len() < now.len() { f64::NAN } else { off.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / off.len() as f64 }
    };
    let off = quantile(&now.iter().map(|d| d.abs()).collect::<Vec<_>>(), 0.5);
    let deep = quantile(&pairs.iter().map(|(t, _)| own.at(*t)).collect::<Vec<_>>(), 0.9);
    let lag_s = if scatter(0.0) > SCATTER_PA * SCATTER_PA { lag(scatter) } else { 0.0 };
    (off > 3e4 + 0.03 * deep || lag_s != 0.0).then_some(Apart { segment: flight.segment[rows.start], off, deep, lag_s })
}

/// The shift with the least scatter, s; 0 where it explains little or is small.
fn lag(scatter: impl Fn(f64) -> f64) -> f64 {
    let least = |of: &mut dyn Iterator<Item = i32>| {
        of.map(|lag| (scatter(f64::from(lag)), lag)).filter(|s| s.0.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let Some((_, coarse)) = least(&mut (-CLOCK_REACH_S..=CLOCK_REACH_S).step_by(COARSE_S as usize)) else { return 0.0 };
    let Some((left, lag)) = least(&mut (coarse - COARSE_S..=coarse + COARSE_S)) else { return 0.0 };
    let lag_s = f64::from(lag);
    if lag_s.abs() >= NAMED_CLOCKS_APART_S && left < EXPLAINED * scatter(0.0) { lag_s } else { 0.0 }
}

/// How much of a segment's time under water the CTD has samples in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ctd {
    /// Of all of it, or it is too short to say.
    Whole,
    /// Of more than half: minutes without a sample, and all of them.
    Missing(usize, usize),
    /// Of less: minutes with a sample, and all of them.
    Off(usize, usize),
}

/// A CTD that starts late, and minutes in which just one of the two has a sample, are no hole, min.
const OFF_MIN: usize = 2;

/// Times, s, and pressures, Pa, by their segment's number.
pub(super) fn rows_by_segment(rows: impl Iterator<Item = (u32, f64, f64)>) -> BTreeMap<u32, Vec<(f64, f64)>> {
    let mut out: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
    rows.for_each(|(segment, time_s, pressure_pa)| out.entry(segment).or_default().push((time_s, pressure_pa)));
    out
}

/// How far the CTD covers a segment; both are times, s, and pressures, Pa, of it.
pub(super) fn covered(own: &[(f64, f64)], ctd: &[(f64, f64)]) -> Ctd {
    // Of a CTD that samples every minute or less often a minute without one says nothing.
    let steps: Vec<f64> = ctd.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let minute = 60.0_f64.max(3.0 * quantile(&steps, 0.5)).min(600.0);
    let minutes =
        |of: &[(f64, f64)]| -> BTreeSet<i64> { of.iter().filter(|r| r.1 > UNDER_WATER_PA).map(|r| (r.0 / minute) as i64).collect() };
    let (own, ctd) = (minutes(own), minutes(ctd));
    let (off, all, ran) = (own.difference(&ctd).count(), own.len(), ctd.len());
    let in_minutes = |count: usize| (count as f64 * minute / 60.0).round() as usize;
    match all {
        0..3 => Ctd::Whole,
        _ if 2 * ran < all => Ctd::Off(in_minutes(ran), in_minutes(all)),
        _ if off > OFF_MIN && 10 * off > all => Ctd::Missing(in_minutes(off), in_minutes(all)),
        _ => Ctd::Whole,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dives to 60 dbar and back in 700 s.
    fn depth_pa(t: f64) -> f64 {
        1e4 * (60.0 - 0.18 * (t.rem_euclid(700.0) - 350.0).abs()).max(0.0)
    }

    fn made() -> (Flight, Vec<f64>) {
        let mut f = Flight::blank(1050);
        let unix: Vec<f64> = (0..1050).map(|i| 1.7e9 + 2.0 * f64::from(i)).collect();
        for i in 0..1050 {
            (f.time_s[i], f.segment[i], f.pressure_pa[i]) = (unix[i] - unix[0], (i / 350) as u32, depth_pa(unix[i] - unix[0]));
        }
        (f, unix)
    }

    #[test]
    fn accuracy_clocks_apart_in_one_segment_are_named_with_the_seconds() {
        let (f, unix) = made();
        let said = |late: &dyn Fn(usize) -> f64, gain: f64| {
            let own: Vec<f64> = (0..f.len()).map(|i| 3e3 + gain * depth_pa(f.time_s[i] - late(i))).collect();
            let mut report = Report::new("made");
            agree(&f, &unix, &Series::new(&unix, &own), &mut report);
            report.left_out.join("; ") + &report.notes.join("; ")
        };
        for late in [20.0, 30.0, -25.0, 60.0] {
            let one = said(&|i| if i / 350 == 1 { late } else { 0.0 }, 1.0);
            let all = said(&|_| late, 1.0);
            assert!(one.contains("in segments 1: ") && all.contains("do not agree: "), "{late}: {one}; {all}");
            // At the ends of the one segment rows of the others take part.
            for got in [one, all] {
                let set_s: f64 = got.split("set by ").nth(1).and_then(|s| s.trim_end_matches(" s").parse().ok()).expect("seconds");
                assert!((set_s + late).abs() <= 2.0, "{late}: {got}");
            }
        }
        assert!(said(&|_| 12.0, 1.0).contains("set by -12 s, which a comparison does"), "{}", said(&|_| 12.0, 1.0));
        // A second or two, or a sensor that is off by a few percent, is no clock.
        assert_eq!((said(&|_| 2.0, 1.0), said(&|_| 0.0, 1.02)), (String::new(), String::new()));
        assert!(said(&|_| 0.0, 1.5).contains("one of them is wrong"), "{}", said(&|_| 0.0, 1.5));
    }

    #[test]
    fn regress_minutes_without_a_sample_of_the_ctd_are_counted() {
        let own: Vec<(f64, f64)> = (0..350).map(|i| (4.0 * f64::from(i), depth_pa(2.0 * f64::from(i)))).collect();
        let ctd = |kept: &dyn Fn(f64) -> bool| covered(&own, &own.iter().copied().filter(|r| kept(r.0)).collect::<Vec<_>>());
        assert_eq!(ctd(&|_| true), Ctd::Whole);
        assert!(matches!(ctd(&|t| t < 1000.0), Ctd::Missing(5..8, 20..24)), "{:?}", ctd(&|t| t < 1000.0));
        assert!(matches!(ctd(&|t| t < 500.0), Ctd::Off(7..10, 20..24)), "{:?}", ctd(&|t| t < 500.0));
        assert_eq!(ctd(&|t| (t / 4.0) as i64 % 20 == 0), Ctd::Whole, "seldom, and all the time");
    }
}
