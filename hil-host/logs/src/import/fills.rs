//! Values that stand for none though nothing says so.

use std::ops::RangeInclusive;

use super::Report;

/// Nothing that a glider measures is larger: such numbers are fills that the file does not declare (NetCDF's own are about 1e37).
pub(super) const LARGEST: f64 = 1e30;
/// A column has no more fills than this.
const MOST_FILLS: usize = 8;

/// Makes NaN of the values of `name` that stand for none.
pub(super) fn without_fills(name: &str, values: &mut [f64], possible: &RangeInclusive<f64>, report: &mut Report) {
    values.iter_mut().filter(|v| !(v.abs() < LARGEST)).for_each(|v| *v = f64::NAN);
    for _ in 0..MOST_FILLS {
        let Some((fill, count)) = undeclared_fill(values).or_else(|| impossible_fill(values, possible)) else { break };
        report.note(format!("{count} of {} values of {name} are {fill}: a fill that the file does not declare, left out", values.len()));
        values.iter_mut().filter(|v| **v == fill).for_each(|v| *v = f64::NAN);
    }
}

/// Without values that are outside of what the channel can be, where these are few: of many the unit is wrong, which is said elsewhere.
pub(super) fn without_impossible(name: &str, possible: &RangeInclusive<f64>, values: &mut [f64], report: &mut Report) {
    let all = values.iter().filter(|v| v.is_finite()).count();
    let outside = values.iter().filter(|v| v.is_finite() && !possible.contains(v)).count();
    if outside > 0 && 2 * outside <= all {
        values.iter_mut().filter(|v| !possible.contains(v)).for_each(|v| *v = f64::NAN);
        report.note(format!("{outside} of {all} values of {name} are outside of what it can be: left out"));
    }
}

/// Whether a number is of nines alone, `least` of them and more.
fn is_of_nines(fill: f64, least: usize) -> bool {
    let digits = fill.abs().to_string();
    digits.matches('9').count() >= least && digits.chars().all(|c| matches!(c, '9' | '.'))
}

/// A value that comes three times and more, lies further from all others than they span ten times over, and is ten times larger or
/// smaller (a pump that is out as often as it is in has two values too); for numbers of nines, such as -9999, beyond them by a tenth of
/// their span. With its count.
pub(super) fn undeclared_fill(values: &[f64]) -> Option<(f64, usize)> {
    let known = || values.iter().copied().filter(|v| v.is_finite() && v.abs() < LARGEST);
    let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    // Of the two ends how often they come, and the next ones.
    let (mut lows, mut highs, mut above, mut below) = (0, 0, f64::INFINITY, f64::NEG_INFINITY);
    for v in known() {
        if v == low {
            lows += 1;
        } else {
            above = above.min(v);
        }
        if v == high {
            highs += 1;
        } else {
            below = below.max(v);
        }
    }
    let is_fill = |fill: f64, count: usize, first: f64, last: f64| {
        let (span, away) = (last - first, (fill - last).max(first - fill));
        let (least, most) = (first.abs().min(last.abs()), first.abs().max(last.abs()));
        let another_size = fill.abs() > 10.0 * most || 10.0 * fill.abs() < least;
        let far = (away > 10.0 * span && another_size) || (away > 0.1 * span && is_of_nines(fill, 3));
        count >= 3 && span > 0.0 && span.is_finite() && far
    };
    [(high, highs, low, below), (low, lows, above, high)]
        .into_iter()
        .find(|(fill, count, first, last)| is_fill(*fill, *count, *first, *last))
        .map(|(fill, count, ..)| (fill, count))
}

/// A value that comes three times and more and that its channel cannot have, of a channel whose other values it can have mostly (of
/// another unit all are impossible); and it is no more than half of them, but for numbers of nines. With its count.
fn impossible_fill(values: &[f64], possible: &RangeInclusive<f64>) -> Option<(f64, usize)> {
    let (inside, mut outside): (Vec<f64>, Vec<f64>) = values.iter().filter(|v| v.is_finite()).partition(|v| possible.contains(v));
    outside.sort_unstable_by(f64::total_cmp);
    let (fill, count) = outside.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).max_by_key(|run| run.1)?;
    let others = outside.len() - count;
    (count >= 3 && others < inside.len() && (is_of_nines(fill, 2) || count <= inside.len())).then_some((fill, count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fills_that_nothing_declares_are_found_and_measurements_are_not() {
        let wave: Vec<f64> = (0..300).map(|i| 10.0 + 5.0 * (0.1 * f64::from(i)).sin()).collect();
        let filled = |fill: f64, rows: std::ops::Range<usize>| {
            let mut with = wave.clone();
            with[rows].fill(fill);
            with
        };
        let deep: Vec<f64> = (0..1000).map(f64::from).chain([-999.0; 5]).collect();
        // Held at a rail three times, near the others; one large number is a spike.
        let cases = [
            (wave.clone(), None),
            (wave.iter().map(|v| v.min(14.0)).collect(), None),
            (filled(9999.0, 7..8), None),
            (deep, Some((-999.0, 5))),
        ];
        for (values, want) in
            cases.into_iter().chain([-9999.9, 9999.0, -999.0, -32768.0, 1e20].map(|f| (filled(f, 50..150), Some((f, 100)))))
        {
            assert_eq!(undeclared_fill(&values), want);
        }
        // What water cannot be; two values are spikes, kelvin are another unit.
        let water = -3.0..=45.0;
        let kelvin: Vec<f64> = wave.iter().map(|t| (t + 273.15).round()).collect();
        let mostly: Vec<f64> = [[-99.0; 200].as_slice(), &wave[..50]].concat();
        let cases =
            [(wave.clone(), None), (filled(99.0, 0..2), None), (kelvin, None), (mostly, Some((-99.0, 200))), (vec![f64::NAN], None)];
        for (values, want) in cases.into_iter().chain([-99.0, 99.0, -99.9, -10.0].map(|f| (filled(f, 60..75), Some((f, 15))))) {
            assert_eq!(impossible_fill(&values, &water), want);
        }
        let degrees: Vec<f64> = (0..300).map(|i| [26.0, -26.0, 0.0][usize::min(i % 10 / 4, 2)]).collect();
        assert_eq!(impossible_fill(&degrees, &(-1.6..=1.6)), None);
    }
}
