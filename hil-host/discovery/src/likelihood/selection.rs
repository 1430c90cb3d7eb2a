//! Which rows are left out of a fit, and why: outliers of a sensor, and what [`crate::likelihood::stall_mask`] takes out.

use super::battery;
use crate::likelihood::Problem;
use crate::model::branch::Branch;
use crate::preprocess::Run;

/// An innovation that is no news of one sample alone, sigma.
const LARGE_INNOVATION: f64 = 3.0;
/// Rows beyond the law that are more than a launch and a turn.
const STALLED_ROWS: usize = 20;

/// Rows that are left out of a fit, and why.
#[derive(Clone, Debug)]
pub struct LeftOut {
    outlier: Vec<Vec<bool>>,
    speed_outlier: Vec<Vec<bool>>,
    near_stall: Vec<Vec<bool>>,
    near_stall_s: Vec<f64>,
    attached: Vec<Vec<(f64, f64)>>,
    branch: Branch,
}

impl Problem<'_> {
    /// Takes out rows whose innovation is beyond `limit` sigma while their neighbours' are small (what is missing in the model is
    /// wrong over a stretch, a sensor's error is alone), and all such rows in runs that are partly beyond the law: there the model
    /// may be on another branch. Returns how many went.
    pub fn drop_outliers(&mut self, residual: &[f64], limit: f64) -> usize {
        let mut dropped = 0;
        for k in 0..self.runs.len() {
            let count = self.whiteners[k].len();
            let e = &residual[self.offsets[k]..self.offsets[k] + count];
            let stalled = self.near_stall[k].iter().filter(|b| **b).count() > STALLED_ROWS;
            let alone = |i: usize| {
                // The filter has been pulled along: the innovation after an outlier is large too.
                let near = (i.saturating_sub(6)..(i + 7).min(count)).filter(|&j| j != i && j != i + 1);
                e[i].abs() > limit && (stalled || near.filter(|&j| e[j].abs() > LARGE_INNOVATION).count() <= 1)
            };
            for (i, rows) in self.rows(k).into_iter().enumerate() {
                if alone(i) {
                    dropped += rows.len();
                    for row in rows {
                        self.outlier[k][row] = true;
                    }
                }
            }
            let from = self.offsets[k] + count;
            let lone = |i: usize| {
                let r = |j: usize| residual[from + j].abs();
                let n = self.speed_rows[k].len();
                r(i) > limit.max(6.0) && (i == 0 || r(i - 1) < LARGE_INNOVATION) && (i + 1 >= n || r(i + 1) < LARGE_INNOVATION)
            };
            let lonely: Vec<usize> = (0..self.speed_rows[k].len()).filter(|&i| lone(i)).collect();
            dropped += lonely.len();
            for i in lonely {
                for row in self.speed_rows[k][i].clone() {
                    self.speed_outlier[k][row] = true;
                }
            }
        }
        self.refresh();
        dropped
    }

    /// Which rows are left out now, to be put back by [`Self::leave_out`].
    #[must_use]
    pub fn left_out(&self) -> LeftOut {
        LeftOut {
            outlier: self.outlier.clone(),
            speed_outlier: self.speed_outlier.clone(),
            near_stall: self.near_stall.clone(),
            near_stall_s: self.near_stall_s.clone(),
            attached: self.attached.clone(),
            branch: self.branch,
        }
    }

    /// Leaves these rows out and no others.
    pub fn leave_out(&mut self, rows: LeftOut) {
        self.outlier = rows.outlier;
        self.speed_outlier = rows.speed_outlier;
        self.near_stall = rows.near_stall;
        self.near_stall_s = rows.near_stall_s;
        self.attached = rows.attached;
        self.branch = rows.branch;
        self.refresh();
    }

    /// Settles which rows take part from what is known of each, and rebuilds the whitening.
    pub(crate) fn refresh(&mut self) {
        for k in 0..self.runs.len() {
            let run = self.runs[k];
            self.used[k] = (0..run.time_s.len()).map(|i| run.used[i] && !self.outlier[k][i] && !self.near_stall[k][i]).collect();
            self.speed_rows[k] = speed_groups(run, |i| self.used[k][i] && !self.speed_outlier[k][i]);
        }
        let stretches = |(run, used): (&&Run, &Vec<bool>)| {
            self.vehicle.moments.map_or_else(Vec::new, |m| battery::stretches(&m, self.vehicle, run, used))
        };
        self.stretches = self.runs.iter().zip(&self.used).map(stretches).collect();
        self.set_colour(self.colour);
    }
}

/// Longest time over which speed is averaged, s: short against the 10 s in which speed changes.
const SPEED_GROUP_S: f64 = 7.5;

/// Used rows with a speed, neighbours together.
fn speed_groups(run: &Run, used: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for row in (0..run.time_s.len()).filter(|&i| used(i) && run.speed_m_s[i].is_finite()) {
        match groups.last_mut() {
            Some(g) if run.time_s[row] - run.time_s[g[0]] < SPEED_GROUP_S => g.push(row),
            _ => groups.push(vec![row]),
        }
    }
    groups
}
