//! Two clocks on one glider: values of one brought to the instants of the other.

/// A channel on its own clock; NaN values are left out when it is made.
#[derive(Clone, Debug, Default)]
pub struct Series {
    time_s: Vec<f64>,
    value: Vec<f64>,
    /// Usual time from one value to the next, s; NaN for fewer than two.
    step_s: f64,
}

/// Silence longer than this is not bridged, s: engineering channels come every 4 s, or every 30 s in the short files sent home.
pub const MAX_BRIDGE_S: f64 = 120.0;
/// Short files sent home by satellite may have a channel every 2 or 5 minutes only (Slocum sbd of the pyglider examples: 123 and
/// 300 s): then so many of its usual steps are bridged, up to the limit, s.
const BRIDGED_STEPS: f64 = 2.0;
const LONGEST_BRIDGE_S: f64 = 700.0;

impl Series {
    /// Pairs with finite time and value, sorted by time; of equal times the first stays.
    #[must_use]
    pub fn new(time_s: &[f64], value: &[f64]) -> Self {
        let known = || time_s.iter().copied().zip(value.iter().copied()).filter(|(t, v)| t.is_finite() && v.is_finite());
        let (time_s, value): (Vec<f64>, Vec<f64>) = if known().is_sorted_by(|a, b| a.0 < b.0) {
            known().unzip()
        } else {
            let mut pairs: Vec<(f64, f64)> = known().collect();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            pairs.dedup_by(|b, a| a.0 == b.0);
            pairs.into_iter().unzip()
        };
        let steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
        Self { time_s, value, step_s: crate::record::plausible::quantile(&steps, 0.5) }
    }

    /// Usual time from one value to the next, s; NaN for fewer than two values.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is no value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Times and values.
    pub fn pairs(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.time_s.iter().copied().zip(self.value.iter().copied())
    }

    /// The values from one time to another, both included.
    #[must_use]
    pub fn within(&self, from_s: f64, to_s: f64) -> Self {
        let rows = self.time_s.partition_point(|t| *t < from_s)..self.time_s.partition_point(|t| *t <= to_s);
        if rows.is_empty() { Self::default() } else { Self::new(&self.time_s[rows.clone()], &self.value[rows]) }
    }

    /// Linear interpolation; NaN outside and across long silence.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        self.at_within(t, self.bridge_s())
    }

    /// The same where silence up to this length is bridged, s.
    #[must_use]
    pub fn at_within(&self, t: f64, bridge_s: f64) -> f64 {
        let next = self.time_s.partition_point(|s| *s < t);
        self.place(next, t, bridge_s).map_or(f64::NAN, |at| self.between(at))
    }

    /// The value before `t` and the one behind it, which is that of place `next`, with the share of the way to it; none where there are none
    /// or silence lies between them.
    fn place(&self, next: usize, t: f64, bridge_s: f64) -> Option<(usize, usize, f64)> {
        let after_s = *self.time_s.get(next)?;
        if after_s == t {
            return Some((next, next, 0.0));
        }
        let before = next.checked_sub(1)?;
        let step = after_s - self.time_s[before];
        (step <= bridge_s).then(|| (before, next, (t - self.time_s[before]) / step))
    }

    fn between(&self, (before, next, share): (usize, usize, f64)) -> f64 {
        if before == next { self.value[next] } else { self.value[before] + share * (self.value[next] - self.value[before]) }
    }

    /// The silence that is bridged, s.
    fn bridge_s(&self) -> f64 {
        (BRIDGED_STEPS * self.step_s).clamp(MAX_BRIDGE_S, LONGEST_BRIDGE_S)
    }

    /// Places of `times`, which mostly go on from one to the next.
    fn places(&self, times: &[f64], bridge_s: f64) -> impl Iterator<Item = Option<(usize, usize, f64)>> {
        let mut next = 0;
        times.iter().map(move |t| {
            if next > 0 && self.time_s[next - 1] >= *t {
                next = self.time_s.partition_point(|s| s < t);
            }
            while self.time_s.get(next).is_some_and(|s| s < t) {
                next += 1;
            }
            self.place(next, *t, bridge_s)
        })
    }

    /// Interpolation at `times`, across silence up to this length, s.
    #[must_use]
    pub fn on_within(&self, times: &[f64], bridge_s: f64) -> Vec<f64> {
        self.places(times, bridge_s).map(|at| at.map_or(f64::NAN, |at| self.between(at))).collect()
    }

    /// Interpolation at `times`.
    #[must_use]
    pub fn on(&self, times: &[f64]) -> Vec<f64> {
        self.on_within(times, self.bridge_s())
    }

    /// An angle at `times`, rad, through the shorter way; in 0..2π.
    #[must_use]
    pub fn angle_on(&self, times: &[f64]) -> Vec<f64> {
        let of = |(before, next, share): (usize, usize, f64)| {
            let (sin, cos) = self.value[before].sin_cos();
            let (sin, cos) = if before == next {
                (sin, cos)
            } else {
                let (next_sin, next_cos) = self.value[next].sin_cos();
                (sin + share * (next_sin - sin), cos + share * (next_cos - cos))
            };
            sin.atan2(cos).rem_euclid(std::f64::consts::TAU)
        };
        self.places(times, self.bridge_s()).map(|at| at.map_or(f64::NAN, of)).collect()
    }
}

/// Places of the longest run of `times` that never goes back (patience sorting, Fredman 1975).
#[must_use]
pub fn longest_in_order(times: &[f64]) -> Vec<usize> {
    // Of all runs of a length, the one that ends earliest in time; and what precedes each sample.
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = Vec::with_capacity(times.len());
    for (i, t) in times.iter().enumerate() {
        let length = ends.partition_point(|e| times[*e] <= *t);
        before.push(length.checked_sub(1).map(|l| ends[l]));
        if length == ends.len() {
            ends.push(i);
        } else {
            ends[length] = i;
        }
    }
    let mut kept: Vec<usize> = std::iter::successors(ends.last().copied(), |i| before[*i]).collect();
    kept.reverse();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewest_samples_are_called_out_of_order() {
        assert_eq!(longest_in_order(&[0.0, 1.0, 9.0, 2.0, 2.0, 3.0]), [0, 1, 3, 4, 5]);
        assert_eq!(longest_in_order(&[3.0, 2.0, 1.0]).len(), 1);
        assert!(longest_in_order(&[]).is_empty());
    }

    #[test]
    fn values_are_interpolated_but_silence_is_not_bridged() {
        let series = Series::new(&[0.0, 4.0, f64::NAN, 8.0, 1000.0], &[1.0, 3.0, 9.0, f64::NAN, 5.0]);
        assert_eq!(series.at(2.0), 2.0);
        assert_eq!(series.at(4.0), 3.0);
        assert!(series.at(500.0).is_nan() && series.at(-1.0).is_nan() && series.at(1001.0).is_nan());
    }

    #[test]
    fn a_part_of_a_series_holds_both_its_ends() {
        let series = Series::new(&[0.0, 4.0, 8.0, 12.0], &[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(series.within(4.0, 8.0).pairs().collect::<Vec<_>>(), [(4.0, 2.0), (8.0, 3.0)]);
        assert!(series.within(5.0, 7.0).is_empty() && series.within(9.0, 1.0).is_empty() && series.within(13.0, 20.0).is_empty());
    }

    #[test]
    fn a_channel_that_always_comes_seldom_is_bridged() {
        let series = Series::new(&[0.0, 300.0, 600.0, 900.0, 5000.0], &[0.0, 3.0, 6.0, 9.0, 50.0]);
        assert_eq!((series.step_s(), series.at(450.0)), (300.0, 4.5));
        assert!(series.at(2000.0).is_nan());
    }

    #[test]
    fn heading_turns_through_north() {
        let series = Series::new(&[0.0, 2.0], &[6.2, 0.1]);
        let middle = series.angle_on(&[1.0])[0];
        // Chord of two unit vectors 0.18 rad apart: the middle is exact.
        assert!((middle - (6.2 + 0.1 - std::f64::consts::TAU) / 2.0).abs() < 1e-9, "{middle}");
    }
}
