//! What a residual may follow at each row of a run: leg, time since the turning point, roll, ballast and its rate, stratification.

use crate::preprocess::Run;

/// Covariates at each row of a run.
pub(crate) struct Traits {
    pub(crate) down: Vec<bool>,
    pub(crate) since_turn_s: Vec<f64>,
    pub(crate) ballast_rate: Vec<f64>,
    pub(crate) stratification: Vec<f64>,
    pub(crate) roll: Vec<f64>,
    pub(crate) ballast: Vec<f64>,
}

/// The covariates of a run.
pub(crate) fn traits(run: &Run) -> Traits {
    let n = run.time_s.len();
    let ahead = |row: usize, seconds: f64| run.input_at_row(row, seconds);
    let mut down = Vec::with_capacity(n);
    let mut since_turn_s = Vec::with_capacity(n);
    let mut last_turn = run.time_s[0];
    for i in 0..n {
        let rate = ahead(i, 12.0).depth_m - ahead(i, -12.0).depth_m;
        let now = if rate.abs() > 0.3 { rate > 0.0 } else { *down.last().unwrap_or(&true) };
        if i > 0 && down[i - 1] != now {
            last_turn = run.time_s[i];
        }
        down.push(now);
        since_turn_s.push(run.time_s[i] - last_turn);
    }
    Traits {
        ballast_rate: (0..n).map(|i| (ahead(i, 6.0).sensed.ballast_m3 - ahead(i, -6.0).sensed.ballast_m3) / 12.0 * 1e5).collect(),
        stratification: (0..n).map(|i| (ahead(i, 8.0).sensed.density_kg_m3 - ahead(i, -8.0).sensed.density_kg_m3) / 16.0 * 30.0).collect(),
        roll: (0..n).map(|i| ahead(i, 0.0).roll_rad).collect(),
        ballast: (0..n).map(|i| ahead(i, 0.0).sensed.ballast_m3 * 5e3).collect(),
        down,
        since_turn_s,
    }
}

/// Depth that a vertical velocity makes at each row of a run, m.
pub(crate) fn integrated(run: &Run, rate: &dyn Fn(usize) -> f64) -> Vec<f64> {
    let time = &run.time_s;
    let mut depth = Vec::with_capacity(time.len());
    let (mut sum, mut before) = (0.0, 0.0);
    for row in 0..time.len() {
        let now = rate(row);
        if row > 0 {
            sum += 0.5 * (now + before) * (time[row] - time[row - 1]);
        }
        before = now;
        depth.push(sum);
    }
    depth
}
