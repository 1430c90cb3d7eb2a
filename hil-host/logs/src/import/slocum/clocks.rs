//! The clocks of Slocum's two computers: not set, set in flight, apart, without a time, going back.

use super::Loaded;
use crate::import::Report;
use crate::import::clocks::{CLOCKS_APART_S, SET_CLOCK_S, stray_times};
use crate::import::dbd;
use crate::record::resample::longest_in_order;

/// What the clock of its computer says in each cycle of a file, s: the vehicle's, else that of science.
pub(super) fn clock(file: &dbd::DbdFile) -> Option<&Vec<f64>> {
    ["m_present_time", "sci_m_present_time"].iter().find_map(|n| file.columns.get(*n)).map(|c| &c.1)
}

/// Middle of the times of a file, s.
fn middle_s(file: &dbd::DbdFile) -> f64 {
    clock(file).map_or(f64::NAN, |times| crate::record::plausible::quantile(times, 0.5))
}

/// Files whose clock was not set, or stands a year off the others, are left out whole.
pub(super) fn set_clocks(loaded: &mut Vec<Loaded>, report: &mut Report, refused: &mut Vec<String>) {
    let set: Vec<f64> = loaded.iter().map(|l| middle_s(&l.file)).filter(|t| *t > SET_CLOCK_S).collect();
    let middle = crate::record::plausible::quantile(&set, 0.5);
    loaded.retain(|l| {
        let own = middle_s(&l.file);
        if !own.is_finite() || (own - middle).abs() < A_YEAR_S {
            return true;
        }
        let year = 1970.0 + (own / A_YEAR_S).floor();
        let others = 1970.0 + (middle / A_YEAR_S).floor();
        let mission = if own > SET_CLOCK_S && others.is_finite() {
            format!(", that of the others in {others:.0} (of another mission? Import it alone)")
        } else {
            String::new()
        };
        let what = format!("{}: its clock stands in {year:.0}{mission}: {} cycles left out", l.name, l.file.cycles);
        refused.push(what.clone());
        report.leave_out(what);
        false
    });
}

/// A year, s: no flight is longer.
const A_YEAR_S: f64 = 365.25 * 86400.0;

/// Times of a file by its computer's clock, s, those that can be and are in order.
fn times(file: &dbd::DbdFile) -> Vec<f64> {
    let times = plausible_times(clock(file).cloned().unwrap_or_default());
    let known: Vec<f64> = times.into_iter().filter(|t| t.is_finite()).collect();
    longest_in_order(&known).into_iter().map(|k| known[k]).collect()
}

/// First and last time of a file, s.
pub(super) fn span(file: &dbd::DbdFile) -> Option<(f64, f64)> {
    let times = times(file);
    times.first().copied().zip(times.last().copied())
}

/// Keeps the cycles of a file whose time, s, is as `wanted` says.
pub(super) fn keep(file: &mut dbd::DbdFile, wanted: impl Fn(f64) -> bool) {
    let rows: Vec<usize> = clock(file).map_or_else(Vec::new, |times| (0..times.len()).filter(|k| wanted(times[*k])).collect());
    for (_, values) in file.columns.values_mut() {
        *values = rows.iter().map(|k| values[*k]).collect();
    }
    file.cycles = rows.len();
}

/// The two computers' clocks of a segment, where they stand far apart, or one of them was set forward while the other ran on.
pub(super) fn apart(loaded: &[Loaded], report: &mut Report) {
    let ends = |times: &[f64]| times.iter().copied().reduce(f64::min).zip(times.iter().copied().reduce(f64::max));
    for science in loaded.iter().filter(|l| l.science) {
        let Some(own) = loaded.iter().find(|l| !l.science && l.segment == science.segment) else { continue };
        let (own_times, science_times) = (times(&own.file), times(&science.file));
        let (Some(a), Some(b)) = (ends(&own_times), ends(&science_times)) else { continue };
        let (first, last) = (b.0 - a.0, b.1 - a.1);
        if first.abs() > CLOCKS_APART_S && (first - last).abs() < ALIKE_S {
            report.leave_out(format!(
                "clocks of {} and {} stand {first:.0} s apart: a zone, or a clock that was not set",
                own.name, science.name
            ));
        }
        // Where one stands still the other shows the hour; where its clock was set the hour is at the end.
        for (one, times, longer_s) in [(own, &own_times, -last), (science, &science_times, last)] {
            let widest = times.windows(2).map(|w| (w[1] - w[0], w[0])).max_by(|a, b| a.0.total_cmp(&b.0));
            let set = widest.filter(|(gap, _)| *gap > CLOCKS_APART_S && (longer_s - gap).abs() < ALIKE_S && first.abs() < ALIKE_S);
            if let Some((gap, at)) = set {
                let into = at - times[0];
                report.leave_out(format!(
                    "{}: its clock jumps by {gap:+.0} s, {into:.0} s after its begin, while the other computer's runs on: the two do not fit \
                     from there on",
                    one.name
                ));
            }
        }
    }
}

/// So well two such differences agree, s (guess).
const ALIKE_S: f64 = 600.0;

/// Cycles without a time, or with one a month and more off the others, are lost.
pub(super) fn report_untimed(one: &Loaded, stated: &[f64], report: &mut Report) {
    let timed = plausible_times(stated.to_vec()).iter().filter(|t| t.is_finite()).count();
    let lost = stated.len() - timed;
    if timed > 0 && lost as f64 > UNTIMED * stated.len() as f64 {
        report.leave_out(format!("{}: {lost} of {} cycles have no time, or one a month and more off the others", one.name, stated.len()));
    }
}

/// A file's first cycles, and a damaged one now and then, have no time: a share of the cycles (guess).
const UNTIMED: f64 = 0.005;

/// Damaged stretches can yield any number: times further than 30 days from the middle one are none.
pub(super) fn plausible_times(mut times: Vec<f64>) -> Vec<f64> {
    stray_times(&mut times, 30.0 * 86400.0);
    times
}

/// Cycles whose time goes back become none: sorted in, they would lie between those of another time.
pub(super) fn in_order(mut times: Vec<f64>, one: &Loaded, clock: &str, report: &mut Report) -> Vec<f64> {
    let (place, known): (Vec<usize>, Vec<f64>) = times.iter().copied().enumerate().filter(|(_, t)| t.is_finite()).unzip();
    let kept = longest_in_order(&known);
    if kept.len() < known.len() {
        let out = known.len() - kept.len();
        report.leave_out(format!("{}: {clock} goes backwards, {out} of {} cycles are out of order", one.name, known.len()));
        let mut in_order = vec![false; known.len()];
        kept.into_iter().for_each(|k| in_order[k] = true);
        for (row, _) in place.into_iter().zip(in_order).filter(|(_, good)| !good) {
            times[row] = f64::NAN;
        }
    }
    times
}
