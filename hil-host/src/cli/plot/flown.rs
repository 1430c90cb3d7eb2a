//! Figures of one flight.

use super::{Args, Kind};
use crate::cli::compare::not_diverged;
use crate::cli::diagnose::{load, load_and_ask_by, load_sound};
use crate::pages::answer_charts::{forest_figure, ladder};
use crate::pages::chart::{Axis, Chart, Mark, histogram};
use crate::pages::figure::Figure;
use anyhow::{Context as _, anyhow, ensure};
use discovery::history::flight as history;
use discovery::hypotheses::search::Depth;
use discovery::workbench::compare::{Comparison, Sample, compare};
use logs::Flight;
use logs::record::plausible::quantile;
use std::path::Path;

/// Length of the averages of a residual plot, s (as the block error of the flight format, section 6.1).
const BLOCK_S: f64 = 20.0;
/// Largest |α| of a histogram, degrees, and its bins of 1°.
const HISTOGRAM_DEG: (f64, usize) = (30.0, 60);
/// Points per line at most, so that a long flight stays a small file.
const LINE_POINTS: usize = 2000;

/// What a diagnosis says of the vehicle's numbers, or how the error falls.
pub fn answer(args: &Args) -> anyhow::Result<Figure> {
    let path = args.flight.as_deref().context("a flight")?;
    let given = args.history.as_deref().map(history::read).transpose().map_err(|e| anyhow!(e))?;
    let file = args.history.as_ref().map(|file| file.display().to_string());
    let (flight, vehicle, found) = load_and_ask_by(given.as_ref().zip(file.as_deref()), path, args.vehicle.as_deref(), Depth::Pairs)?;
    if args.kind == Kind::Forest {
        return Ok(forest_figure(&found, &flight.name));
    }
    Ok(Figure {
        panels: vec![ladder(&found)],
        caption: format!("Flight {}, vehicle {}: {}.", flight.name, vehicle.name, found.verdict.name()),
    })
}

/// Time under way over the rows of a log. Pauses are cut, so that a log of weeks with a dive a day is drawn as dives.
struct UnderWay {
    /// From which moment on how much is taken off, s.
    cuts: Vec<(f64, f64)>,
    /// Longest step between two rows that a line joins, s.
    gap_s: f64,
    /// Unit of the axis, and its seconds.
    unit: (&'static str, f64),
}

impl UnderWay {
    fn of(times_s: &[f64]) -> Self {
        /// Usual steps of the log's own sampling that are no gap yet.
        const STEPS: f64 = 4.0;
        /// Longer pauses are cut to this, s, or to a gap of the log.
        const PAUSE_S: f64 = 120.0;
        /// Longer flights are drawn over hours, s.
        const LONG_S: f64 = 5.0 * 3600.0;
        let steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
        let gap_s = STEPS * quantile(&steps, 0.5).max(1.0);
        let mut off = times_s.first().copied().unwrap_or(0.0);
        let mut cuts = vec![(off, off)];
        for (step, end) in steps.iter().zip(&times_s[1..]).filter(|(step, _)| **step > PAUSE_S.max(gap_s)) {
            off += step - PAUSE_S.max(gap_s);
            cuts.push((*end, off));
        }
        let whole_s = times_s.last().map_or(0.0, |t| t - off);
        Self { cuts, gap_s, unit: if whole_s > LONG_S { ("h", 3600.0) } else { ("min", 60.0) } }
    }

    fn at(&self, time_s: f64) -> f64 {
        let before = self.cuts.partition_point(|c| c.0 <= time_s).saturating_sub(1);
        (time_s - self.cuts[before].1) / self.unit.1
    }

    fn axis(&self) -> Axis {
        Axis::new("time under way", self.unit.0)
    }

    /// A line through segment, moment and value of each row, with a gap (NaN) where a segment ends or rows are missing.
    fn line(&self, rows: &[(u32, f64, f64)]) -> Vec<(f64, f64)> {
        let every = rows.len().div_ceil(LINE_POINTS).max(1);
        let thinned: Vec<_> = rows.iter().step_by(every).collect();
        let joined = |a: &(u32, f64, f64), b: &(u32, f64, f64)| a.0 == b.0 && b.1 - a.1 <= self.gap_s * every as f64;
        let gap = std::iter::once((f64::NAN, f64::NAN));
        let runs = thinned.chunk_by(|a, b| joined(a, b));
        runs.flat_map(|run| run.iter().map(|r| (self.at(r.1), r.2)).chain(gap.clone()).collect::<Vec<_>>()).collect()
    }
}

/// Largest |α| of a block that is drawn, degrees: beyond it the vehicle hardly moves, and has no angle of attack.
const SLOWEST_DEG: f64 = 45.0;

/// Means over blocks: angle of attack (degrees) and residual (cm/s), dives and climbs apart, and how many blocks lie beyond the axis.
fn block_means(samples: &[Sample]) -> ([Vec<(f64, f64)>; 2], usize) {
    let key = |s: &Sample| (s.segment, (s.time_s / BLOCK_S).floor() as i64);
    let (mut out, mut beyond) = ([Vec::new(), Vec::new()], 0);
    for block in samples.chunk_by(|a, b| key(a) == key(b)) {
        let mean = |of: &dyn Fn(&Sample) -> f64| block.iter().map(of).sum::<f64>() / block.len() as f64;
        let climbs = mean(&|s| s.observed_m_s) < 0.0;
        let alpha_deg = mean(&|s| s.alpha_rad.to_degrees());
        if alpha_deg.abs() > SLOWEST_DEG {
            beyond += 1;
        } else {
            out[usize::from(climbs)].push((alpha_deg, mean(&|s| 100.0 * (s.observed_m_s - s.modelled_m_s))));
        }
    }
    (out, beyond)
}

/// What a caption says of blocks that are not drawn.
fn left_out(beyond: usize) -> String {
    if beyond == 0 { String::new() } else { format!(" Left out: {beyond} beyond {SLOWEST_DEG:.0} deg.") }
}

/// The residual of two vehicle files against one flight.
fn before_and_after(file: &Path, flight: &Flight, path: &Path, about: &str, after: &Comparison) -> anyhow::Result<Figure> {
    let (_, old) = load(path, Some(file))?;
    let before = not_diverged(compare(flight, &old), &old)?;
    let ((old_points, old_beyond), (new_points, new_beyond)) = (block_means(&before.samples), block_means(&after.samples));
    let said = |what: &str, c: &Comparison| format!("{what}: {:.2} cm/s rms", 100.0 * c.rms_m_s);
    let panel = Chart::lines("Residual before and after", "angle of attack of the model, deg", "measured minus modelled, cm/s")
        .plus(&said("before", &before), Mark::Point, old_points.concat())
        .plus(&said("after", after), Mark::Point, new_points.concat());
    let caption = format!(
        "{about}; before: {}. Points are {BLOCK_S} s means of the depth rate, positive down.{}",
        old.name,
        left_out(old_beyond + new_beyond)
    );
    Ok(Figure { panels: vec![panel], caption })
}

/// The flight against its model.
pub fn flight(args: &Args) -> anyhow::Result<Figure> {
    let path = args.flight.as_deref().context("a flight")?;
    let (flight, vehicle) = load_sound(path, args.vehicle.as_deref())?;
    let c = not_diverged(compare(&flight, &vehicle), &vehicle)?;
    ensure!(!c.samples.is_empty(), "{}: no row deeper than 2 m and a minute under way; nothing to draw", path.display());
    let effects: Vec<&str> = vehicle.effects.iter().map(|a| a.effect.name).collect();
    let with = if effects.is_empty() { "no effect on".to_owned() } else { format!("with {}", effects.join(", ")) };
    let about = format!("Flight {}, model of {} ({with})", flight.name, vehicle.name);
    let error = format!("depth-rate residual {:.2} cm/s rms over {} rows", 100.0 * c.rms_m_s, c.samples.len());
    if let Some(file) = &args.before {
        return before_and_after(file, &flight, path, &about, &c);
    }
    Ok(match args.kind {
        Kind::Residual => {
            let ([dives, climbs], beyond) = block_means(&c.samples);
            let panel =
                Chart::lines("Residual against angle of attack", "angle of attack of the model, deg", "measured minus modelled, cm/s")
                    .plus("dives", Mark::Point, dives)
                    .plus("climbs", Mark::Point, climbs);
            Figure {
                panels: vec![panel],
                caption: format!("{about}: {error}; points are {BLOCK_S} s means, positive down.{}", left_out(beyond)),
            }
        }
        Kind::Histogram => {
            let (edge, bins) = HISTOGRAM_DEG;
            let alpha: Vec<f64> = c.samples.iter().map(|s| s.alpha_rad.to_degrees()).collect();
            let shares = histogram(&alpha, -edge, edge, bins).into_iter().map(|(x, share)| (x, 100.0 * share));
            let panel = Chart::lines("Angles of attack flown", "angle of attack of the model, deg", "share of rows per degree, %");
            let caption = format!("{about}: {} submerged rows; positive in a dive.", c.samples.len());
            Figure { panels: vec![panel.plus("share", Mark::Bar, shares)], caption }
        }
        _ => {
            let depth_m = logs::record::steady::depth_m(&flight);
            let rows = (0..flight.len()).filter(|i| depth_m[*i].is_finite()).map(|i| (flight.segment[i], flight.time_s[i], depth_m[i]));
            let (used, left): (Vec<_>, Vec<_>) = rows.clone().partition(|r| {
                let near = c.samples.partition_point(|s| s.time_s < r.1 - 1e-6);
                c.samples.get(near).is_some_and(|s| (s.time_s - r.1).abs() <= 1e-6)
            });
            let under_way = UnderWay::of(&rows.map(|r| r.1).collect::<Vec<_>>());
            let of =
                |value: fn(&Sample) -> f64| under_way.line(&c.samples.iter().map(|s| (s.segment, s.time_s, value(s))).collect::<Vec<_>>());
            let deepest = depth_m.iter().copied().filter(|d| d.is_finite()).fold(1.0, f64::max);
            let whole = Some((0.0, depth_m.len().checked_sub(1).map_or(1.0, |last| under_way.at(flight.time_s[last]))));
            let upper = Chart::lines("Depth", under_way.axis(), "depth, m")
                .plus("measured", Mark::Line, under_way.line(&used))
                .plus("measured, not compared", Mark::Dashed, under_way.line(&left))
                .within(whole, Some((1.05 * deepest, 0.0)));
            let lower = Chart::lines("Depth rate, positive down", under_way.axis(), "depth rate, cm/s")
                .plus("measured", Mark::Line, of(|s| 100.0 * s.observed_m_s))
                .plus("model", Mark::Line, of(|s| 100.0 * s.modelled_m_s))
                .within(whole, None);
            Figure {
                panels: vec![upper, lower],
                caption: format!("{about}: {error}; {}; long pauses are cut.", c.filter("both through the same {} filter")),
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_sparse_log_is_drawn_whole_and_its_pauses_are_cut() {
        // A row a minute for ten minutes, two hours at the surface, ten minutes again.
        let times: Vec<f64> = (0..10).chain(130..140).map(|minute| 60.0 * f64::from(minute)).collect();
        let under_way = UnderWay::of(&times);
        let line = under_way.line(&times.iter().map(|t| (0, *t, 1.0)).collect::<Vec<_>>());
        let gaps: Vec<usize> = (0..line.len()).filter(|k| line[*k].0.is_nan()).collect();
        assert_eq!((line.len(), gaps), (22, vec![10, 21]), "one line before the pause, one after it");
        // A pause is as long as the longest step of the log that is none: four minutes.
        assert_eq!((line[9].0, line[11].0, line[20].0), (9.0, 13.0, 22.0));
        // Another segment is another line.
        assert!(under_way.line(&[(0, 0.0, 1.0), (1, 60.0, 1.0)])[1].0.is_nan());
    }
}
