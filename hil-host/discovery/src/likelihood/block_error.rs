//! The error figures: block depth-rate error of FORMAT section 6.1.

use crate::likelihood::Problem;
use crate::likelihood::column::Column;
use crate::likelihood::discrepancy::Predicted;
use crate::model::parameters::State;
use crate::preprocess::{Prepared, Run, SETTLE_S, SURFACE_M};
use logs::record::plausible::quantile;
use std::cell::RefCell;
use std::rc::Rc;

/// Shortest length of a block, s.
pub const BLOCK_S: f64 = 20.0;
/// Samples that a block has room for where they are sparse: a slope needs three, and one may be missing.
const ROOM: f64 = 4.0;

/// Length of the blocks of a log that is sampled so often, s: [`BLOCK_S`], or room for four samples.
#[must_use]
pub fn block_s(sample_s: f64) -> f64 {
    BLOCK_S.max(ROOM * sample_s)
}

/// Usual time from one sample with a depth to the next in these runs, s; NaN for none.
#[must_use]
pub fn sampled_every_s<'a>(runs: impl IntoIterator<Item = &'a Run>) -> f64 {
    let mut steps: Vec<f64> = Vec::new();
    for run in runs {
        let seen: Vec<f64> = (0..run.time_s.len()).filter(|&i| run.depth_m[i].is_finite()).map(|i| run.time_s[i]).collect();
        steps.extend(seen.windows(2).map(|w| w[1] - w[0]));
    }
    quantile(&steps, 0.5)
}

/// One valid block.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Segment.
    pub segment: u32,
    /// Rows of the run in the block that have a depth.
    pub rows: Vec<usize>,
    /// Observed depth rate, m/s, positive down.
    pub observed_m_s: f64,
}

/// Least-squares slope of `value` against time over some rows.
fn slope(time: &[f64], value: &[f64], rows: &[usize]) -> f64 {
    let n = rows.len() as f64;
    let (t, v) = rows.iter().fold((0.0, 0.0), |(t, v), &i| (t + time[i], v + value[i]));
    let (t, v) = (t / n, v / n);
    let (num, den) = rows.iter().fold((0.0, 0.0), |(a, b), &i| (a + (time[i] - t) * (value[i] - v), b + (time[i] - t) * (time[i] - t)));
    num / den
}

/// Valid blocks of a run, counted from its first row; where it is sampled sparsely they are longer.
#[must_use]
pub fn blocks(run: &Run) -> Vec<Block> {
    let time = &run.time_s;
    let mut out = Vec::new();
    let n = time.len();
    let mut first = 0;
    let mut k = 0.0;
    let length_s = block_s(sampled_every_s([run]));
    while first < n {
        let end_time = time[0] + (k + 1.0) * length_s;
        let mut end = first;
        while end < n && time[end] < end_time {
            end += 1;
        }
        let rows: Vec<usize> = (first..end).filter(|&i| run.depth_m[i].is_finite()).collect();
        if rows.len() >= 3 && time[rows[rows.len() - 1]] - time[rows[0]] >= 0.5 * length_s {
            let from = time[first] - SETTLE_S;
            let shallow = (0..end).rev().take_while(|&i| time[i] >= from).any(|i| run.depth_m[i] < SURFACE_M);
            if !shallow && (run.starts_afloat || time[first] - time[0] > SETTLE_S) {
                out.push(Block { segment: run.segment, observed_m_s: slope(time, &run.depth_m, &rows), rows });
            }
        }
        first = end;
        k += 1.0;
    }
    out
}

/// Modelled depth rate of a block, m/s.
#[must_use]
pub fn modelled_m_s(run: &Run, block: &Block, model_depth_m: &[f64]) -> f64 {
    slope(&run.time_s, model_depth_m, &block.rows)
}

/// Root mean square; NaN for nothing.
#[must_use]
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    if n > 0.0 { f64::sqrt(sum / n) } else { f64::NAN }
}

impl Problem<'_> {
    /// Block error of a state over all blocks of the fitted runs, those left out too, m/s.
    #[must_use]
    pub fn fitted_error_m_s(&self, prepared: &Prepared, state: &State) -> f64 {
        block_errors(self, prepared, &[state], &self.fitted_blocks(prepared), true)[0]
    }

    /// All blocks of the fitted runs.
    fn fitted_blocks(&self, prepared: &Prepared) -> Vec<(usize, Vec<Block>)> {
        let fitted = prepared.runs.iter().enumerate().filter(|(_, run)| self.runs.iter().any(|r| std::ptr::eq(*r, *run)));
        fitted.map(|(k, run)| (k, blocks(run))).collect()
    }
}

/// Predicts block errors of fits (their states and residuals) with their most probable model discrepancy.
///
/// The discrepancy is predicted by linearisation, the calibration following it; as in a trust region the prediction counts only where
/// it lowers the error of the fitted runs, as it promises to. That is tried once for each fit.
pub struct Predictor<'p, 'v> {
    pub(crate) problem: &'p Problem<'v>,
    pub(crate) prepared: &'p Prepared,
    fitted: Vec<(usize, Vec<Block>)>,
    tried: RefCell<Vec<(&'p State, Rc<Predicted>)>>,
}

impl<'p, 'v> Predictor<'p, 'v> {
    /// For the fits of a problem.
    #[must_use]
    pub fn new(problem: &'p Problem<'v>, prepared: &'p Prepared) -> Self {
        Self { problem, prepared, fitted: problem.fitted_blocks(prepared), tried: RefCell::default() }
    }

    fn predicted(&self, state: &'p State, residual: &Column) -> Rc<Predicted> {
        if let Some((_, known)) = self.tried.borrow().iter().find(|(of, _)| std::ptr::eq(*of, state)) {
            return known.clone();
        }
        let mut predicted = self.problem.predicted(state, residual);
        if !predicted.amplitudes.is_empty() {
            let without = block_errors(self.problem, self.prepared, &[state], &self.fitted, true);
            let with = self.errors_of(&[&predicted], &self.fitted, true);
            if with[0] > without[0] {
                predicted = Predicted { state: state.clone(), amplitudes: Vec::new() };
            }
        }
        let predicted = Rc::new(predicted);
        self.tried.borrow_mut().push((state, predicted.clone()));
        predicted
    }

    fn errors_of(&self, predicted: &[&Predicted], blocks: &[(usize, Vec<Block>)], with_wave: bool) -> Vec<f64> {
        let states: Vec<&State> = predicted.iter().map(|p| &p.state).collect();
        let shift = |run: &Run, i: usize| self.problem.discrepancy_m(run, predicted[i]);
        errors_with(self.problem, self.prepared, &states, blocks, with_wave, &shift)
    }

    /// Block errors of fits, m/s. A wave's phase is known only in fitted runs.
    #[must_use]
    pub fn errors(&self, fits: &[(&'p State, &Column)], blocks: &[(usize, Vec<Block>)], with_wave: bool) -> Vec<f64> {
        let predicted: Vec<Rc<Predicted>> = fits.iter().map(|(state, residual)| self.predicted(state, residual)).collect();
        self.errors_of(&predicted.iter().map(Rc::as_ref).collect::<Vec<_>>(), blocks, with_wave)
    }
}

/// Block errors of several states, m/s. A wave's phase is known only in fitted runs.
#[must_use]
pub fn block_errors(
    problem: &Problem,
    prepared: &Prepared,
    states: &[&State],
    blocks: &[(usize, Vec<Block>)],
    with_wave: bool,
) -> Vec<f64> {
    errors_with(problem, prepared, states, blocks, with_wave, &|_, _| None)
}

/// The same with a shift of depth of each run and state.
fn errors_with(
    problem: &Problem,
    prepared: &Prepared,
    states: &[&State],
    blocks: &[(usize, Vec<Block>)],
    with_wave: bool,
    shift: &dyn Fn(&Run, usize) -> Option<Vec<f64>>,
) -> Vec<f64> {
    let mut missed: Vec<Vec<f64>> = vec![Vec::new(); states.len()];
    for (k, list) in blocks {
        let run = &prepared.runs[*k];
        for (i, (state, track)) in states.iter().zip(problem.tracks(run, states)).enumerate() {
            let mut depth = track.depth_m;
            let wave = if with_wave { problem.wave_shift(run, state) } else { None };
            for shift in wave.into_iter().chain(shift(run, i)) {
                depth.iter_mut().zip(shift).for_each(|(d, s)| *d += s);
            }
            missed[i].extend(list.iter().map(|b| b.observed_m_s - modelled_m_s(run, b, &depth)));
        }
    }
    missed.into_iter().map(|m| rms(m.into_iter())).collect()
}
