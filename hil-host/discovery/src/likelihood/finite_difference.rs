//! Derivatives by finite differences: what the model's prediction changes by, per unit of a number.
//!
//! The prediction is discontinuous where the next small step stalls a leg: the run is somewhere else then. A finite difference across a
//! stall discontinuity is no derivative: thousands of times too large, it makes a number look known to a millionth and leads fits nowhere.
//! Where the prediction of a run jumps away from the measurements, the difference to the other side is taken for that run. (A jump towards
//! them is a way down.)

use std::ops::Range;

/// Change of a run's answer by one step, chi², from which it may be a leap, where a step is a fiftieth of what is felt.
pub(crate) const LEAP: f64 = 9.0;
/// The same where a step is large enough to be felt itself.
pub(crate) const LEAP_IF_FELT: f64 = 100.0;
/// How many times smaller, in chi², the slope on the other side is then.
const SMOOTHER: f64 = 9.0;
/// Step to the other side, in steps: near, lest there be a discontinuity too.
const BEHIND: f64 = -0.2;

/// What answers are answers to: what was seen, run by run, and the change of a run, in chi², from which it may be a leap.
pub(crate) struct Seen<'a> {
    pub(crate) runs: Vec<Range<usize>>,
    pub(crate) data: &'a [f64],
    pub(crate) leap: f64,
}

impl Seen<'_> {
    /// The change per unit from `base` to `ahead`, which is one `step` further; in runs where that leaps away from what was seen, the
    /// change to what is on the other side, which is asked for only then, by so much.
    #[must_use]
    pub(crate) fn slope(&self, base: &[f64], ahead: &[f64], step: f64, behind: impl FnOnce(f64) -> Vec<f64>) -> Vec<f64> {
        let mut out: Vec<f64> = ahead.iter().zip(base).map(|(a, b)| (a - b) / step).collect();
        let apart = |a: &[f64], b: &[f64], run: &Range<usize>| {
            a[run.clone()].iter().zip(&b[run.clone()]).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        };
        let leaps = |run: &&Range<usize>| {
            // Not a number where the model has no glide ahead.
            let near = apart(ahead, base, run) < self.leap;
            !near && !(apart(ahead, self.data, run) < apart(base, self.data, run) - self.leap)
        };
        let leaping: Vec<Range<usize>> = self.runs.iter().filter(leaps).cloned().collect();
        if leaping.is_empty() {
            return out;
        }
        let back = BEHIND * step;
        let other: Vec<f64> = behind(back).iter().zip(base).map(|(a, b)| (a - b) / back).collect();
        let square = |of: &[f64]| of.iter().map(|x| x * x).sum::<f64>();
        for run in leaping {
            if !(SMOOTHER * square(&other[run.clone()]) > square(&out[run.clone()])) {
                out[run.clone()].copy_from_slice(&other[run]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::{LEAP, Seen};

    /// With the next step of the size of a body–wing vortex one leg stalled: its size looked known to 0.0005 of 21.6 where 3.9 is right,
    /// and the pair that this discontinuity did not touch seemed nine log odds likelier.
    #[test]
    fn regress_a_stall_on_one_side_is_no_derivative_unless_it_leads_down() {
        let answer = |x: f64| -> Vec<f64> {
            let stalled = if x > 2.01 { 400.0 } else { 0.0 };
            (0..6).map(|i| f64::from(i) * x + if i < 3 { 0.0 } else { stalled }).collect()
        };
        let (here, beyond) = (answer(2.0), answer(2.1));
        let slope = |data: &[f64], x: f64, step: f64| {
            Seen { runs: vec![0..3, 3..6], data, leap: LEAP }.slope(&answer(x), &answer(x + step), step, |back| answer(x + back))
        };
        let close = |slopes: &[f64]| slopes.iter().enumerate().all(|(i, s)| (s - i as f64).abs() < 1e-9);
        assert!(close(&slope(&here, 2.0, 0.1)), "{:?}", slope(&here, 2.0, 0.1));
        // The measurements lie beyond the discontinuity.
        let down = slope(&beyond, 2.0, 0.1);
        assert!(close(&down[..3]) && (down[4] - 4004.0).abs() < 1e-6, "{down:?}");
        // No discontinuity: what is large may be so.
        assert!(close(&slope(&here, 1.0, 0.9)));
    }

    #[test]
    fn a_side_without_a_glide_is_no_derivative_either() {
        let seen = Seen { runs: vec![0..1, 1..2], data: &[1.0, 1.0], leap: LEAP };
        let slopes = seen.slope(&[1.0, 1.0], &[f64::NAN, 1.1], 0.1, |back| vec![1.0 + 3.0 * back, f64::NAN]);
        assert!((slopes[0] - 3.0).abs() < 1e-9 && (slopes[1] - 1.0).abs() < 1e-9, "{slopes:?}");
    }
}
