//! Times that cannot be: of a clock that was not set, of damage, of a clock that counts whole seconds.

use crate::record::plausible::quantile;

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

/// Whole times that most rows share with a neighbour, evenly apart up to the next; none of any other.
pub(super) fn spread_evenly(times: &[f64]) -> Option<Vec<f64>> {
    if times.iter().any(|t| t.fract() != 0.0) {
        return None;
    }
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (i, t) in times.iter().enumerate() {
        match runs.last_mut() {
            Some((first, count)) if times[*first] == *t => *count += 1,
            _ => runs.push((i, 1)),
        }
    }
    let shared: usize = runs.iter().filter(|r| r.1 > 1).map(|r| r.1).sum();
    let gap = |k: usize| {
        let next = runs.get(k + 1)?;
        Some(times[next.0] - times[runs[k].0]).filter(|gap| *gap > 0.0 && *gap <= COARSEST_CLOCK_S)
    };
    // The first run may have begun before the log, and the last one goes on after it.
    let steps: Vec<f64> = (1..runs.len()).filter_map(|k| Some(gap(k)? / runs[k].1 as f64)).collect();
    let usual_s = quantile(&steps, 0.5);
    if 2 * shared < times.len() || 2 * steps.len() < runs.len().saturating_sub(2) || !usual_s.is_finite() {
        return None;
    }
    let mut out = Vec::with_capacity(times.len());
    for (k, (first, count)) in runs.iter().enumerate() {
        let (start_s, step_s) = match gap(k) {
            Some(gap) if k == 0 && usual_s * *count as f64 <= gap => (gap - usual_s * *count as f64, usual_s),
            Some(gap) => (0.0, gap / *count as f64),
            None => (0.0, usual_s.min(COARSEST_CLOCK_S / *count as f64)),
        };
        out.extend((0..*count).map(|m| times[*first] + start_s + step_s * m as f64));
    }
    Some(out)
}

/// A clock of whole minutes is the coarsest that is spread, s.
const COARSEST_CLOCK_S: f64 = 60.0;

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
        assert_eq!(stray_times(&mut [0.0, 1.0, 9e7], LONGEST_MISSION_S), 0, "no date, nothing to hold it against");
        assert_eq!(lonely_times(&mut [0.0, 2e5, 4e5, 4e5 + 4.0]), 0, "sparse throughout");
    }

    #[test]
    fn regress_whole_seconds_and_minutes_are_spread() {
        // 2 Hz, cut in the middle of the first second.
        let whole: Vec<f64> = (1..41).map(|i| f64::from(i / 2)).collect();
        let even = spread_evenly(&whole).expect("spread");
        assert!((0..40).all(|i| (even[i] - 0.5 * (i + 1) as f64).abs() < 1e-9), "{even:?}");
        // Every 6 s in whole minutes, from 31 s on, with a silence of ten minutes.
        let truth: Vec<f64> = (0..60).map(|i| 31.0 + 6.0 * f64::from(i) + if i < 35 { 0.0 } else { 600.0 }).collect();
        let even = spread_evenly(&truth.iter().map(|t| (t / 60.0).floor() * 60.0).collect::<Vec<_>>()).expect("spread");
        assert!(even.windows(2).all(|w| w[1] > w[0]), "{even:?}");
        assert!(even.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 6.0), "{even:?}");
        // Single repeats, and times of fractions, are none of a coarse clock.
        for other in [&[0.0, 1.0, 1.0, 2.0, 3.0, 4.0][..], &[0.5, 0.5, 1.5, 1.5, 2.5, 2.5], &[], &[7.0; 4]] {
            assert_eq!(spread_evenly(other), None);
        }
    }
}
