//! What a vehicle's own quiet dives tell: the mean of its numbers, and how they differ from dive to dive when nothing happened.
//!
//! Numbers are counted in their sizes. Expectation and maximisation of a normal model with a known information per unit; the mean is
//! anchored where the calibration began, since numbers that no dive sees would walk away otherwise.

use super::glide::Glider;
use super::numbers::{NUMBERS, Numbers};
use super::rows::{Unit, median};
use super::structure;
use super::summary::{Linear, Summary};
use super::weigh::{class, deviations, inverse, weigh};
use crate::model::parameters::NINETY;
use logs::record::plausible::quantile;
use nalgebra::{DMatrix, DVector};

/// Weight of the covariance that is expected before any dive, in units.
const PRIOR_UNITS: f64 = 3.0;
/// Standard deviation from dive to dive that is expected, in sizes: of few units, and from [`MANY`] on.
pub(super) const EXPECTED_SCATTER: [f64; 2] = [0.1, 0.05];
const MANY: usize = 12;
/// Standard deviation of the mean about the anchor, in sizes.
pub(super) const ANCHOR: f64 = 0.5;
/// Most recent quiet units that a history is learnt from.
pub const WINDOW: usize = 24;
/// Mean chi² per number of the history's units, each against the others, beyond which they are not alike.
pub const GATE: f64 = 2.5;
const PASSES: usize = 60;

/// Mean and covariance between units.
#[derive(Clone, Debug, PartialEq)]
pub struct Between {
    /// Mean.
    pub mean: DVector<f64>,
    /// What is not known of the mean.
    pub of_mean: DMatrix<f64>,
    /// Covariance between units.
    pub scatter: DMatrix<f64>,
}

impl Between {
    /// Covariance of a next healthy unit about the mean.
    #[must_use]
    pub fn next(&self) -> DMatrix<f64> {
        &self.scatter + &self.of_mean
    }
}

/// Variance of each column from dive to dive that is expected before any of `units` is seen.
#[must_use]
pub fn expected_scatter(units: usize, further: &[f64]) -> DVector<f64> {
    let own = EXPECTED_SCATTER[usize::from(units >= MANY)];
    DVector::from_iterator(NUMBERS + further.len(), std::iter::repeat_n(own, NUMBERS).chain(further.iter().copied()).map(|s| s * s))
}

/// Mean and covariance of units about an anchor.
#[must_use]
pub fn between(units: &[Summary], expected: &DVector<f64>, anchor: &DVector<f64>) -> Between {
    between_from(units, expected, anchor, None)
}

fn between_from(units: &[Summary], expected: &DVector<f64>, anchor: &DVector<f64>, start: Option<&Between>) -> Between {
    let q = expected.len();
    let expected = DMatrix::from_diagonal(expected);
    let tie = 1.0 / (ANCHOR * ANCHOR);
    let mut out =
        start.cloned().unwrap_or_else(|| Between { mean: anchor.clone(), of_mean: DMatrix::zeros(q, q), scatter: &expected * 4.0 });
    let n = units.len() as f64;
    for _ in 0..if start.is_some() { PASSES / 4 } else { PASSES } {
        let precision = inverse(&out.scatter);
        let own: Vec<DMatrix<f64>> = units.iter().map(|s| inverse(&(&s.n + &precision))).collect();
        let mut information = DMatrix::identity(q, q) * tie;
        let mut says = anchor * tie;
        for (s, c) in units.iter().zip(&own) {
            let nc = &s.n * c;
            information += &s.n - &nc * &s.n;
            says += &s.u - &nc * &s.u;
        }
        out.of_mean = inverse(&information);
        out.mean = &out.of_mean * says;
        let mut scatter = &expected * PRIOR_UNITS;
        for (s, c) in units.iter().zip(&own) {
            let m = c * s.about(&out.mean);
            scatter += c + &m * m.transpose();
        }
        out.scatter = scatter / (n + PRIOR_UNITS);
    }
    out
}

/// Where a unit's numbers are, given the history.
#[must_use]
pub fn place(unit: &Summary, of: &Between) -> DVector<f64> {
    inverse(&(&unit.n + inverse(&of.scatter))) * unit.about(&of.mean) + &of.mean
}

/// chi² per number of a unit against what healthy units look like: a = L⁻¹ (y - R mean), L L' = 1 + R C R'.
#[must_use]
pub fn chi2(unit: &Summary, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let numbers = unit.of_numbers();
    let (n, c) = (&numbers.n, covariance.view((0, 0), (NUMBERS, NUMBERS)).into_owned());
    let y = numbers.about(&mean.rows(0, NUMBERS).into_owned());
    // y'R⁻¹ (1 + R C R')⁻¹ R⁻ᵀy in directions that the unit sees.
    let s = n + n * &c * n;
    let e = s.symmetric_eigen();
    let largest = e.eigenvalues.max();
    let seen: Vec<f64> = (0..NUMBERS)
        .filter(|k| e.eigenvalues[*k] > 1e-7 * largest)
        .map(|k| e.eigenvectors.column(k).dot(&y).powi(2) / e.eigenvalues[k])
        .collect();
    seen.iter().sum::<f64>() / seen.len() as f64
}

/// What is known of a vehicle from its quiet units.
#[derive(Clone, Debug)]
pub struct Learnt {
    /// The vehicle's numbers beyond its file, in sizes: where summaries are linearised.
    pub at: Numbers,
    /// Mean (beyond `at`) and covariance between units.
    pub between: Between,
    /// The same of all columns, structures behind the numbers; none where nothing was learnt of them.
    pub wide: Option<Between>,
    /// Median level of the noise of its units.
    pub usual_level: f64,
    /// Summaries of the units, in the order of time.
    pub units: Vec<Summary>,
    /// Mean chi² per number of the units, each against the others; NaN of fewer than four.
    pub chi2: f64,
    /// Standard deviations that hold nine of ten deviations of one number, of units each against the others; those of a normal law where
    /// that is not known.
    pub ninety: f64,
}

impl Learnt {
    /// Whether its units are alike, so that it can judge another.
    #[must_use]
    pub fn predicts_itself(&self) -> bool {
        !(self.chi2 > GATE)
    }
}

/// Where a history begins: the numbers of its first units. Six that agree are few enough to be of one trim.
#[must_use]
pub fn start_of_first(units: &[Unit], glider: &Glider) -> Numbers {
    const FIRST: usize = 6;
    start(&units.iter().take(FIRST).collect::<Vec<_>>(), glider)
}

/// Numbers from all units together within the tolerances of the vehicle file.
#[must_use]
pub fn start(units: &[&Unit], glider: &Glider) -> Numbers {
    const STEPS: usize = 25;
    let precision = DVector::from_fn(NUMBERS, |i, _| glider.tolerance[i].powi(-2));
    let mut d = Numbers::zeros();
    for _ in 0..STEPS {
        let all: Vec<Linear> = units.iter().map(|u| Linear::of(u, glider, &d)).collect();
        // Other dives scatter by much more than the rows of one.
        let level = 20.0 * median(all.iter().map(|l| l.variance)).max(1e-6);
        let here = DVector::from_column_slice(d.as_slice());
        let mut n = DMatrix::from_diagonal(&precision);
        let mut g = -precision.component_mul(&here);
        for linear in &all {
            let (ni, ui) = linear.normal();
            g += (ui - &ni * &here) / level;
            n += ni / level;
        }
        let step = inverse(&n) * g;
        let largest = step.amax();
        if !largest.is_finite() {
            break;
        }
        d += Numbers::from_column_slice((step * (1.0_f64).min(1.0 / largest)).as_slice());
        if largest < 0.01 {
            break;
        }
    }
    d
}

/// Levels of the noise of units, each shrunk to their median.
#[must_use]
pub fn levels(all: &[Linear], mut usual: Option<f64>) -> (Vec<f64>, f64) {
    let mut own = Vec::new();
    for _ in 0..2 {
        own = all.iter().map(|l| l.own_level(usual)).collect();
        usual = Some(median(own.iter().copied()));
    }
    (own, usual.unwrap_or(f64::NAN))
}

/// Learns a history from quiet units, in the order of time: from the numbers `from`, which also anchor its mean.
#[must_use]
pub fn learn(units: &[&Unit], glider: &Glider, from: &Numbers) -> Learnt {
    let expected = expected_scatter(units.len(), &[]);
    let mut at = *from;
    let mut own = vec![Numbers::zeros(); units.len()];
    let mut usual = None;
    let anchor = |at: &Numbers| DVector::from_column_slice((from - at).as_slice());
    for _ in 0..3 {
        // About `at`: what a unit says is counted from there.
        let all: Vec<Linear> = units.iter().zip(&own).map(|(u, d)| linear_about(u, glider, &at, d)).collect();
        let (levels, median_level) = levels(&all, usual);
        usual = Some(median_level);
        let summaries: Vec<Summary> = all.iter().zip(levels).map(|(l, k)| Summary::of(l, k)).collect();
        let found = between(&summaries, &expected, &anchor(&at));
        let step = Numbers::from_fn(|i, _| found.mean[i].clamp(-1.0, 1.0));
        at += step;
        own = summaries.iter().map(|s| Numbers::from_column_slice(place(s, &found).as_slice()) - step).collect();
    }
    let pairs = units.iter().map(|u| both(u, glider, &at, usual));
    let (summaries, wide): (Vec<Summary>, Vec<Summary>) = pairs.map(|b| (b.0, b.1)).unzip();
    of_summaries(summaries, &wide, at, &anchor(&at), usual.unwrap_or(f64::NAN))
}

/// Summaries of a unit counted from `at`: of the numbers alone, where structures are noise, and of all columns.
fn both(unit: &Unit, glider: &Glider, at: &Numbers, usual: Option<f64>) -> (Summary, Summary) {
    let (narrow, wide) = (linear_about(unit, glider, at, &Numbers::zeros()), wide_about(unit, glider, at, &Numbers::zeros()));
    (Summary::of(&narrow, narrow.own_level(usual)), Summary::of(&wide, wide.own_level(usual)))
}

/// The history of units whose summaries, of the numbers and of all columns, count from `at`.
#[must_use]
pub fn of_summaries(units: Vec<Summary>, wide: &[Summary], at: Numbers, anchor: &DVector<f64>, usual_level: f64) -> Learnt {
    let expected = expected_scatter(units.len(), &[]);
    let found = between(&units, &expected, anchor);
    let (chi2, ninety) = left_out(&units, &expected, anchor, &found);
    let further = structure::scatter();
    let wide = between(wide, &expected_scatter(units.len(), &further), &anchor.clone().resize_vertically(NUMBERS + further.len(), 0.0));
    Learnt { at, between: found, wide: Some(wide), usual_level, units, chi2, ninety }
}

/// A unit linearised `d` beyond `at`, and counted from `at`.
#[must_use]
pub fn linear_about(unit: &Unit, glider: &Glider, at: &Numbers, d: &Numbers) -> Linear {
    let mut linear = Linear::of(unit, glider, &(at + d + unit.beyond));
    linear.count_from(&(at + unit.beyond));
    linear
}

/// The same with the columns of structures behind the numbers.
#[must_use]
pub fn wide_about(unit: &Unit, glider: &Glider, at: &Numbers, d: &Numbers) -> Linear {
    let columns = |rises: &[f64], jacobian: &DMatrix<f64>, kept: &[bool]| structure::columns(unit, rises, jacobian, kept);
    let mut linear = Linear::with_columns(unit, glider, &(at + d + unit.beyond), columns);
    linear.count_from(&(at + unit.beyond));
    linear
}

/// Mean chi² per number of every unit against the others, and what holds nine of ten of their deviations: the jackknife of conformal
/// prediction (Barber, Candès, Ramdas and Tibshirani 2021), with the numbers of all units as one sample.
fn left_out(units: &[Summary], expected: &DVector<f64>, anchor: &DVector<f64>, all: &Between) -> (f64, f64) {
    if units.len() < 4 {
        return (f64::NAN, NINETY);
    }
    let one = |j: usize| {
        let others: Vec<Summary> = units.iter().enumerate().filter(|(i, _)| *i != j).map(|(_, s)| s.clone()).collect();
        let found = between_from(&others, expected, anchor, Some(all));
        let next = found.next();
        (chi2(&units[j], &found.mean, &next), deviations(&units[j], &found.mean, &next))
    };
    let (chi2, deviations): (Vec<f64>, Vec<_>) = (0..units.len()).map(one).unzip();
    (chi2.iter().sum::<f64>() / chi2.len() as f64, quantile(&deviations.into_iter().flatten().collect::<Vec<_>>(), 0.9))
}

/// A unit beside the quiet ones before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward {
    /// Whether nothing is named in it.
    pub quiet: bool,
    /// chi² per number; NaN of the first three, which have too few before them.
    pub chi2: f64,
}

/// Fewest units that a history judges by.
pub const FEWEST_CONTROLS: usize = 3;

/// Every unit, in the order of time, beside the quiet ones before it (at most `window`), all at one linearisation: what a history may
/// be learnt from. The first three are taken as they are.
#[must_use]
pub fn forward(units: &[Unit], glider: &Glider, at: &Numbers, window: usize) -> Vec<Forward> {
    /// Share by which one more unit moves the usual level.
    const NEW: f64 = 0.1;
    let mut usual: Option<f64> = None;
    let summary = |unit: &Unit| {
        let linear = linear_about(unit, glider, at, &Numbers::zeros());
        let level = linear.own_level(usual);
        usual = Some(usual.map_or(level, |u| u + NEW * (level - u)));
        Summary::of(&linear, level)
    };
    forward_of(&units.iter().map(summary).collect::<Vec<_>>(), window)
}

/// The same of summaries of the eight numbers.
#[must_use]
pub fn forward_of(summaries: &[Summary], window: usize) -> Vec<Forward> {
    let expected = expected_scatter(0, &[]);
    let anchor = DVector::zeros(NUMBERS);
    let mut out: Vec<Forward> = Vec::with_capacity(summaries.len());
    let mut last: Option<Between> = None;
    for (i, unit) in summaries.iter().enumerate() {
        let recent: Vec<Summary> = (0..i).rev().filter(|j| out[*j].quiet).take(window).map(|j| summaries[j].clone()).collect();
        if recent.len() < FEWEST_CONTROLS {
            out.push(Forward { quiet: true, chi2: f64::NAN });
            continue;
        }
        let found = between_from(&recent, &expected, &anchor, last.as_ref());
        let covariance = found.next();
        let ln_bayes = std::array::from_fn(|k| weigh(unit, &found.mean, &covariance, &[k]).ln_bayes);
        out.push(Forward { quiet: class(&ln_bayes).is_empty(), chi2: chi2(unit, &found.mean, &covariance) });
        last = Some(found);
    }
    out
}
