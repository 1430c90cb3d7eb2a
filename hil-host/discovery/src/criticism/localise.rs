//! Where the model fails: which variable the block residuals follow, in which range, and whether chance would do as well.
//!
//! Residuals of 20 s blocks are grouped by each variable into bins of equal count; the share of the error a variable explains is
//! that of its bin means. Neighbouring blocks are alike, so chance is asked by turning the residual series against the variable
//! (circular shifts keep its colour): p is the share of shifts that explain as much.

use crate::likelihood::block_error::{Block, modelled_m_s};
use crate::model::dynamics::Track;
use crate::preprocess::Run;

/// Residual of one block with what the vehicle did in it.
#[derive(Clone, Debug)]
pub struct Residual {
    /// Segment.
    pub segment: u32,
    /// Middle of the block, s.
    pub time_s: f64,
    /// Observed minus modelled depth rate, m/s.
    pub residual_m_s: f64,
    /// Value of each variable, in the order of [`VARIABLES`].
    pub values: Vec<f64>,
    /// Whether the vehicle goes down.
    pub down: bool,
    /// Whether it is in steady flight: no stroke, no turning point within 40 s.
    pub steady: bool,
}

/// Variables and their units.
pub const VARIABLES: [(&str, &str); 9] = [
    ("angle_of_attack", "rad"),
    ("speed", "m/s"),
    ("depth", "m"),
    ("temperature", "degC"),
    ("time", "s"),
    ("pitch", "rad"),
    ("roll", "rad"),
    ("dive_or_climb", "1"),
    ("steady_or_turning", "1"),
];

/// One finding.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Variable.
    pub variable: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Range of the bin that contributes most.
    pub range: (f64, f64),
    /// Share of the squared error its bin means explain.
    pub share_of_error: f64,
    /// Share of shifted series that explain as much.
    pub p_value: f64,
    /// Mean residual in the range, m/s, positive: sinks faster or climbs slower than the model.
    pub mean_m_s: f64,
    /// `dive`, `climb` or `both`.
    pub phase: &'static str,
}

/// Residuals of the valid blocks of a run.
#[must_use]
pub fn residuals(run: &Run, blocks: &[Block], track: &Track) -> Vec<Residual> {
    blocks
        .iter()
        .map(|b| {
            let middle = b.rows[b.rows.len() / 2];
            let n = b.rows.len() as f64;
            let mean = |f: &dyn Fn(usize) -> f64| b.rows.iter().map(|&r| f(r)).sum::<f64>() / n;
            let at = |row: usize, ahead: f64| run.input_at_row(row, ahead);
            let down = b.observed_m_s > 0.0;
            let (before, after) = (at(middle, -40.0), at(middle, 40.0));
            let steady = (before.sensed.ballast_m3 - after.sensed.ballast_m3).abs() < 6e-6
                && (before.depth_m - at(middle, 0.0).depth_m < 0.0) == down
                && (after.depth_m - at(middle, 0.0).depth_m > 0.0) == down;
            Residual {
                segment: run.segment,
                time_s: run.time_s[middle],
                residual_m_s: b.observed_m_s - modelled_m_s(run, b, &track.depth_m),
                values: vec![
                    mean(&|r| track.alpha_rad[r]),
                    mean(&|r| track.speed_m_s[r]),
                    mean(&|r| at(r, 0.0).depth_m),
                    mean(&|r| at(r, 0.0).sensed.temperature_degc),
                    run.time_s[middle],
                    mean(&|r| at(r, 0.0).sensed.pitch_rad),
                    mean(&|r| at(r, 0.0).roll_rad.abs()),
                    if down { 1.0 } else { 0.0 },
                    if steady { 1.0 } else { 0.0 },
                ],
                down,
                steady,
            }
        })
        .collect()
}

/// Bins of equal count; two for a yes-or-no variable.
fn bins(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let two = values.iter().all(|v| *v == 0.0 || *v == 1.0);
    let count = if two { 2 } else { (values.len() / 12).clamp(2, 8) };
    let mut out = vec![0; values.len()];
    for (rank, &i) in order.iter().enumerate() {
        out[i] = if two { values[i] as usize } else { rank * count / values.len() };
    }
    out
}

fn share(bins: &[usize], residual: &dyn Fn(usize) -> f64, n: usize) -> (f64, Vec<(f64, f64)>) {
    let count = bins.iter().max().map_or(0, |m| m + 1);
    let mut sums = vec![(0.0, 0.0); count];
    let mut total = 0.0;
    for (i, bin) in bins.iter().enumerate().take(n) {
        let r = residual(i);
        sums[*bin].0 += r;
        sums[*bin].1 += 1.0;
        total += r * r;
    }
    let explained: f64 = sums.iter().filter(|s| s.1 > 0.0).map(|s| s.0 * s.0 / s.1).sum();
    (if total > 0.0 { explained / total } else { 0.0 }, sums)
}

/// Ranks the variables by the share of error they explain; significant ones first.
#[must_use]
pub fn rank(residuals: &[Residual]) -> Vec<Finding> {
    let n = residuals.len();
    if n < 8 {
        return Vec::new();
    }
    let mut out = Vec::new();
    for (v, (variable, unit)) in VARIABLES.iter().enumerate() {
        let values: Vec<f64> = residuals.iter().map(|r| r.values[v]).collect();
        if values.iter().any(|x| !x.is_finite()) {
            continue;
        }
        let spread = values.iter().copied().fold(f64::MIN, f64::max) - values.iter().copied().fold(f64::MAX, f64::min);
        if !(spread > 0.0) {
            continue;
        }
        let bin = bins(&values);
        let (explained, sums) = share(&bin, &|i| residuals[i].residual_m_s, n);
        let shifts = 199.min(n - 1);
        let as_much = (1..=shifts)
            .filter(|k| {
                let by = k * n / (shifts + 1);
                by > 0 && share(&bin, &|i| residuals[(i + by) % n].residual_m_s, n).0 >= explained
            })
            .count();
        let worst = (0..sums.len())
            .filter(|b| sums[*b].1 > 0.0)
            .max_by(|a, b| (sums[*a].0.powi(2) / sums[*a].1).total_cmp(&(sums[*b].0.powi(2) / sums[*b].1)))
            .unwrap_or(0);
        let members: Vec<usize> = (0..n).filter(|&i| bin[i] == worst).collect();
        let low = members.iter().map(|&i| values[i]).fold(f64::INFINITY, f64::min);
        let high = members.iter().map(|&i| values[i]).fold(f64::NEG_INFINITY, f64::max);
        let dives = members.iter().filter(|&&i| residuals[i].down).count();
        let phase = if dives * 5 >= members.len() * 4 {
            "dive"
        } else if dives * 5 <= members.len() {
            "climb"
        } else {
            "both"
        };
        out.push(Finding {
            variable,
            unit,
            range: (low, high),
            share_of_error: explained,
            p_value: (as_much + 1) as f64 / (shifts + 1) as f64,
            mean_m_s: sums[worst].0 / sums[worst].1.max(1.0),
            phase,
        });
    }
    out.sort_by(|a, b| (a.p_value > 0.05).cmp(&(b.p_value > 0.05)).then(b.share_of_error.total_cmp(&a.share_of_error)));
    out
}
