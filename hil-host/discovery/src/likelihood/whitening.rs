//! Whitening: what of a depth residual is news, given ordinary vertical water motion and sensor noise.
//!
//! The water's ordinary motion is a first-order process (rms σ, correlation time τ); the depth residual is its integral ζ plus
//! sensor noise. A Kalman filter with fixed gains turns a residual into independent unit innovations; being linear, it
//! whitens signatures of effects the same way:
//! ```text
//! dζ/dt = v (+ white, from pitch noise)    dv/dt = −v/τ + white    r = ζ + ε
//! ```
//! The start of each run is diffuse: an unknown offset costs one sample.

use crate::preprocess::Run;
use std::sync::Arc;

/// Colour of the depth residual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// Rms of the vertical water motion, m/s.
    pub rms_m_s: f64,
    /// Its correlation time, s.
    pub correlation_s: f64,
    /// Standard deviation of the depth sensor, m (noise and resolution).
    pub sensor_m: f64,
    /// Random walk of depth from noise in pitch, m²/s.
    pub walk_m2_s: f64,
}

/// Rows that carry one news between them.
#[derive(Clone, Debug)]
struct Group {
    rows: Vec<usize>,
    /// Their mean time, s.
    time_s: f64,
    /// Whether rows before them hide what the model does not know.
    hidden: bool,
}

#[derive(Clone, Debug)]
struct Stage {
    decay: f64,
    reach: f64,
    gain: [f64; 2],
    scale: f64,
}

/// The filter of one run: gains do not depend on the data.
#[derive(Clone, Debug)]
pub struct Whitener {
    groups: Arc<Vec<Group>>,
    /// Longest gap between groups that is bridged, s.
    gap_s: f64,
    stages: Vec<Stage>,
    /// Sum of ln of the innovation standard deviations: the likelihood's normaliser.
    pub log_scale: f64,
}

/// Rows within this time are averaged, s.
const GROUP_S: f64 = 3.4;
/// Longest gap in the rows that the filter bridges, s; in a sparse log so many times the usual time between rows.
const BRIDGED_GAP_S: f64 = 45.0;
const GAP_INTERVALS: f64 = 3.0;
/// Variance of the unknown offset at the start of a run, m².
const DIFFUSE_M2: f64 = 1e4;

impl Group {
    fn mean(&self, value: &impl Fn(usize) -> f64) -> f64 {
        match self.rows.as_slice() {
            [one] => value(*one),
            many => many.iter().map(|&r| value(r)).sum::<f64>() / many.len() as f64,
        }
    }
}

impl Whitener {
    /// Gains for the used rows of a run. In `unknown` rows, and where its inputs were made up, the model's depth is undetermined: by the next
    /// row it says nothing.
    #[must_use]
    pub fn new(run: &Run, used: &[bool], unknown: impl Fn(usize) -> bool, colour: &Colour) -> Self {
        // Rows closer than a sample of motion are averaged: they carry one news between them.
        let mut groups: Vec<(Vec<usize>, bool)> = Vec::new();
        let mut hidden = false;
        for (row, &t) in run.time_s.iter().enumerate() {
            if !used[row] {
                hidden |= unknown(row) || run.unseen[row];
                continue;
            }
            match groups.last_mut() {
                Some((g, _)) if !hidden && t - run.time_s[g[0]] < GROUP_S => g.push(row),
                _ => groups.push((vec![row], hidden)),
            }
            hidden = false;
        }
        let mean_s = |rows: &[usize]| rows.iter().map(|&r| run.time_s[r]).sum::<f64>() / rows.len() as f64;
        let group = |(rows, hidden): (Vec<usize>, bool)| Group { time_s: mean_s(&rows), rows, hidden };
        let groups: Vec<Group> = groups.into_iter().map(group).collect();
        let mut apart: Vec<f64> = groups.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
        apart.sort_by(f64::total_cmp);
        let gap_s = BRIDGED_GAP_S.max(GAP_INTERVALS * apart.get(apart.len() / 2).copied().unwrap_or(0.0));
        Self::of(Arc::new(groups), gap_s, colour)
    }

    /// The same rows under another colour.
    #[must_use]
    pub fn coloured(&self, colour: &Colour) -> Self {
        Self::of(self.groups.clone(), self.gap_s, colour)
    }

    fn of(groups: Arc<Vec<Group>>, gap_s: f64, colour: &Colour) -> Self {
        let (var, tau) = (colour.rms_m_s * colour.rms_m_s, colour.correlation_s);
        let noise = colour.sensor_m * colour.sensor_m;
        let mut p = [DIFFUSE_M2, 0.0, var];
        let mut before = f64::NAN;
        let mut stages = Vec::with_capacity(groups.len());
        let mut log_scale = 0.0;
        for group in groups.iter() {
            let t = group.time_s;
            let noise = noise / group.rows.len() as f64;
            let dt = if before.is_nan() { 0.0 } else { t - before };
            before = t;
            // After a gap or hidden rows the model's depth error is anybody's guess: start anew.
            let anew = stages.is_empty() || dt > gap_s || group.hidden;
            let decay = (-dt / tau).exp();
            let reach = tau * (1.0 - decay);
            // P ← F P Fᵀ + Q
            let (p0, p1, p2) = (p[0], p[1], p[2]);
            p[0] = p0
                + 2.0 * reach * p1
                + reach * reach * p2
                + var * tau * tau * (2.0 * dt / tau - 3.0 + 4.0 * decay - decay * decay)
                + colour.walk_m2_s * dt;
            p[1] = decay * (p1 + reach * p2) + var * tau * (1.0 - decay) * (1.0 - decay);
            p[2] = decay * decay * p2 + var * (1.0 - decay * decay);
            if anew {
                p = [DIFFUSE_M2, 0.0, var];
            }
            let s = p[0] + noise;
            let gain = [p[0] / s, p[1] / s];
            p = [p[0] - gain[0] * p[0], p[1] - gain[0] * p[1], p[2] - gain[1] * p[1]];
            stages.push(Stage { decay, reach, gain, scale: if anew { 0.0 } else { 1.0 / s.sqrt() } });
            if !anew {
                log_scale += 0.5 * s.ln();
            }
        }
        Self { groups, gap_s, stages, log_scale }
    }

    /// Number of innovations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.stages.len()
    }

    /// Whether there is nothing to whiten.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stages.is_empty()
    }

    /// Rows behind each innovation.
    pub fn rows(&self) -> impl Iterator<Item = &[usize]> + '_ {
        self.groups.iter().map(|g| g.rows.as_slice())
    }

    /// Appends the innovations of `value(row)`.
    pub fn whiten(&self, value: impl Fn(usize) -> f64, out: &mut Vec<f64>) {
        self.whiten_means(self.groups.iter().map(|g| g.mean(&value)), out);
    }

    /// What this whitener sees of `value(row)`, whatever the colour: one mean for each innovation.
    pub fn means(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        self.groups.iter().map(|g| g.mean(&value)).collect()
    }

    /// Appends the innovations of such means.
    pub fn whiten_means(&self, means: impl Iterator<Item = f64>, out: &mut Vec<f64>) {
        let (mut zeta, mut v) = (0.0, 0.0);
        for (s, seen) in self.stages.iter().zip(means) {
            let ahead = zeta + s.reach * v;
            let e = seen - ahead;
            zeta = ahead + s.gain[0] * e;
            v = s.decay * v + s.gain[1] * e;
            out.push(e * s.scale);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Colour, Whitener};

    /// A turn beyond the stall is left out of a fit because nobody knows how deep the model sinks in it. The first row after it was
    /// compared all the same where the gap was short: clean flights were told to stall for it.
    #[test]
    fn regress_what_the_model_sinks_in_unknown_rows_is_no_news_after_them() {
        let run = crate::model::integrator::tests::run(200.0, 0.45, false);
        let colour = Colour { rms_m_s: 0.002, correlation_s: 50.0, sensor_m: 0.02, walk_m2_s: 0.0 };
        // Seven rows, 28 s, in which the model sinks by half a metre too much.
        let turn = 45..52;
        let used: Vec<bool> = (0..run.time_s.len()).map(|row| !turn.contains(&row)).collect();
        let missed = |row: usize| if row < turn.start { 0.0 } else { 0.5 };
        let largest = |whitener: &Whitener| {
            let mut news = Vec::new();
            whitener.whiten(missed, &mut news);
            assert_eq!(news.len(), used.iter().filter(|u| **u).count());
            news.iter().fold(0.0, |most: f64, e| most.max(e.abs()))
        };
        let known = Whitener::new(&run, &used, |_| false, &colour);
        let unknown = Whitener::new(&run, &used, |row| turn.contains(&row), &colour);
        // Sigma; rows that are merely lost are bridged, and their sinking is seen.
        assert!(largest(&known) > 5.0, "{}", largest(&known));
        // The start of a run is not quite unknown: 100 m.
        assert!(largest(&unknown) < 1e-4, "{}", largest(&unknown));
    }
}
