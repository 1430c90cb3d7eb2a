//! The water where the CTD was silent: what was measured at the same depth on the way back.
//!
//! A CTD is out for a minute now and then, and a glider crosses a whole thermocline in a minute. A straight line in time over such a
//! gap is off by 1 kg/m³ in a lake, which is a third of a buoyancy engine's stroke; the leg before or after has seen the same water.

use crate::preprocess::fill;
use crate::preprocess::spikes::FASTEST;

/// Gaps shorter than this are bridged in time, s: a glider moves 2 m meanwhile.
const SHORT_S: f64 = 13.0;
/// How far in time another pass through the same depth is looked for, s: water stays what it is for an hour or two.
const NEAR_S: f64 = 7_200.0;
/// Two samples of one pass are no further apart than this, s.
const TOGETHER_S: f64 = 13.0;

/// [`fill`] for a property of the water: long gaps are filled from other passes through the same `pressure`, where there are any,
/// shifted so that both ends meet.
pub(crate) fn fill_by_depth(time: &[f64], pressure: &[f64], value: &[f64], fallback: f64) -> Vec<f64> {
    let mut out = fill(time, value, fallback);
    let known: Vec<usize> = (0..value.len()).filter(|&i| value[i].is_finite()).collect();
    let passes = Passes { time, pressure, value, known: &known };
    for (at, pair) in known.windows(2).enumerate() {
        let (a, b) = (pair[0], pair[1]);
        if b == a + 1 || time[b] - time[a] < SHORT_S {
            continue;
        }
        let seen: Option<Vec<f64>> = (a..=b).map(|row| passes.at(row, at)).collect();
        let Some(seen) = seen else { continue };
        let (from, to) = (value[a] - seen[0], value[b] - seen[b - a]);
        for row in a + 1..b {
            out[row] = seen[row - a] + from + (to - from) * (time[row] - time[a]) / (time[b] - time[a]);
        }
    }
    out
}

/// Measured passes through the water.
struct Passes<'a> {
    time: &'a [f64],
    pressure: &'a [f64],
    value: &'a [f64],
    /// Rows with a value.
    known: &'a [usize],
}

impl Passes<'_> {
    /// What other legs have measured at the pressure of a row, between the last pass before the gap after `known[gap]` and the first
    /// one behind it.
    fn at(&self, row: usize, gap: usize) -> Option<f64> {
        let (a, b) = (self.known[gap], self.known[gap + 1]);
        let sinks = self.pressure[b] > self.pressure[a];
        let crossing = |&k: &usize| self.crossing(k, self.pressure[row], sinks);
        let before = (0..gap).rev().take_while(|&k| self.time[a] - self.time[self.known[k]] < NEAR_S).find_map(|k| crossing(&k));
        let behind =
            (gap + 1..self.known.len() - 1).take_while(|&k| self.time[self.known[k]] - self.time[b] < NEAR_S).find_map(|k| crossing(&k));
        match (before, behind) {
            (Some((t0, v0)), Some((t1, v1))) => Some(v0 + (v1 - v0) * (self.time[row] - t0) / (t1 - t0)),
            (one, other) => one.or(other).map(|c| c.1),
        }
    }

    /// Time and value at which the step after `known[k]` goes through a pressure against the direction of the gap: on another leg.
    fn crossing(&self, k: usize, pressure: f64, gap_sinks: bool) -> Option<(f64, f64)> {
        let (i, j) = (self.known[k], self.known[k + 1]);
        let (p, q) = (self.pressure[i], self.pressure[j]);
        let against = if gap_sinks { q <= pressure && pressure < p } else { p <= pressure && pressure < q };
        let share = (pressure - p) / (q - p);
        let between = |of: &[f64]| of[i] + (of[j] - of[i]) * share;
        (against && self.time[j] - self.time[i] < TOGETHER_S).then(|| (between(self.time), between(self.value)))
    }
}

/// Air is out of the cell below this, Pa: the pump has flushed it.
const FLUSHED_PA: f64 = 1e5;
/// Lowest density of water at the surface (fresh, at 35 °C) less a sensor's error, kg/m³.
const LIGHTEST_KG_M3: f64 = 993.0;

/// Puts NaN in place of densities that are of air in the conductivity cell, and returns how many. Air takes conductivity away: the
/// density near the surface is that of no water, or falls from one sample to the next, on the way up, by more than water changes
/// ([`FASTEST`]) and stays low until the cell is flushed on the way down.
pub(crate) fn without_air(time: &[f64], pressure: &[f64], density: &mut [f64]) -> usize {
    let mut known: Vec<usize> = (0..density.len()).filter(|&i| density[i].is_finite()).collect();
    let risen: Vec<usize> = upward_spikes(time, density, &known);
    known.retain(|i| !risen.contains(i));
    let shallow = |i: usize| pressure[i] < FLUSHED_PA;
    let mut air = vec![false; density.len()];
    for &i in known.iter().filter(|&&i| shallow(i) && density[i] < LIGHTEST_KG_M3) {
        air[i] = true;
    }
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let fall = LEAP_KG_M3 + FASTEST.density_kg_m3_s * (time[b] - time[a]);
        // From the deeper sample of a leap to the surface and as far as the density stays on the far side of it.
        let middle = 0.5 * (density[a] + density[b]);
        let low = |&&i: &&usize| shallow(i) && density[i] < middle;
        if time[b] - time[a] < TOGETHER_S && shallow(a) && shallow(b) {
            if density[b] - density[a] > fall && pressure[a] < pressure[b] {
                known.iter().rev().skip_while(|&&i| i > a).take_while(low).for_each(|&i| air[i] = true);
            } else if density[a] - density[b] > fall && pressure[b] < pressure[a] {
                known.iter().skip_while(|&&i| i < b).take_while(low).for_each(|&i| air[i] = true);
            }
        }
    }
    for (value, _) in density.iter_mut().zip(&air).filter(|(_, air)| **air) {
        *value = f64::NAN;
    }
    air.iter().filter(|a| **a).count()
}

/// One or two samples of the `known` that leap up from those before and down again: air makes no water denser, so that what lies
/// before and behind them is not judged by them. They are left to the search for spikes.
fn upward_spikes(time: &[f64], density: &[f64], known: &[usize]) -> Vec<usize> {
    let leaps = |a: usize, b: usize| density[b] - density[a] > LEAP_KG_M3 + FASTEST.density_kg_m3_s * (time[b] - time[a]).abs();
    let of = |n: usize| known.windows(n + 2).filter(move |w| leaps(w[0], w[1]) && leaps(w[n + 1], w[n])).flat_map(move |w| &w[1..=n]);
    of(1).chain(of(2)).copied().collect()
}

/// Noise of a density beside what water does, kg/m³ (as for spikes).
const LEAP_KG_M3: f64 = 0.25;

#[cfg(test)]
mod tests {
    use super::{fill_by_depth, without_air};
    use crate::preprocess::fill;

    /// Two yos through 30 m at 0.13 m/s, a row every 4 s, and a thermocline at 12 m, 1.5 kg/m³ over some 4 m.
    fn lake() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..230).map(|i| 4.0 * f64::from(i)).collect();
        let pressure: Vec<f64> = time.iter().map(|t| 1e4 * (30.0 - (30.0 - (0.13 * t) % 60.0).abs())).collect();
        let density = pressure.iter().map(|p| 998.5 + 1.5 / (1.0 + (-(p / 1e4 - 12.0) / 1.0).exp())).collect();
        (time, pressure, density)
    }

    fn worst(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_silent_ctd_in_the_thermocline_is_filled_from_the_way_back() {
        let (time, pressure, truth) = lake();
        // On the way up from 21 m to 8 m, and again on the way down.
        for silent in [75..100, 130..155] {
            let mut seen = truth.clone();
            seen[silent].fill(f64::NAN);
            let in_time = worst(&fill(&time, &seen, 1000.0), &truth);
            let by_depth = worst(&fill_by_depth(&time, &pressure, &seen, 1000.0), &truth);
            assert!(in_time > 0.3 && by_depth < 0.03, "kg/m³: {in_time} in time, {by_depth} by depth");
        }
    }

    #[test]
    fn a_gap_meets_its_ends_where_the_water_has_changed() {
        let (time, pressure, truth) = lake();
        // The second half of the flight in water heavier by 0.2 kg/m³, as a drifting sensor has it.
        let mut seen: Vec<f64> = truth.iter().enumerate().map(|(i, v)| v + if i > 60 { 0.2 } else { 0.0 }).collect();
        let whole = seen.clone();
        seen[75..100].fill(f64::NAN);
        assert!(worst(&fill_by_depth(&time, &pressure, &seen, 1000.0), &whole) < 0.03);
    }

    #[test]
    fn regress_a_spike_of_density_afloat_is_no_air_in_the_cell() {
        let (time, pressure, truth) = lake();
        // As it goes down from the surface, and at it; one sample or two, up or down by more than water changes in a step.
        for (rows, by, air) in [(117..118, 3.0, 0), (117..119, 3.0, 0), (115..116, -3.0, 1)] {
            let mut seen = truth.clone();
            seen[rows.clone()].iter_mut().for_each(|v| *v += by);
            assert_eq!(without_air(&time, &pressure, &mut seen), air, "{rows:?} by {by}");
        }
        let mut seen = truth.clone();
        seen[112..118].iter_mut().for_each(|v| *v -= 3.0);
        assert!(without_air(&time, &pressure, &mut seen) >= 6, "air stays air");
    }

    #[test]
    fn depths_that_were_passed_once_are_bridged_in_time() {
        let (time, pressure, truth) = lake();
        let (time, pressure, mut seen) = (&time[..50], &pressure[..50], truth[..50].to_vec());
        seen[10..30].fill(f64::NAN);
        assert_eq!(fill_by_depth(time, pressure, &seen, 1000.0), fill(time, &seen, 1000.0));
        let nothing = vec![f64::NAN; 50];
        assert_eq!(fill_by_depth(time, pressure, &nothing, 1000.0), vec![1000.0; 50]);
    }
}
