//! Which departure a vehicle's history does not explain: Bayes factors of single numbers, refitted where they lead, and the verdict.

use super::glide::Glider;
use super::learn::{Between, Learnt, chi2, linear_about, wide_about};
use super::numbers::{NUMBERS, Numbers};
use super::rows::{Unit, median};
use super::structure::{Departure, departs};
use super::summary::{Linear, Summary};
use super::weigh::{class, inverse, least_named, weigh};
use crate::model::parameters::NINETY;
use nalgebra::{DMatrix, DVector};

const BEST: usize = 3;
const STEPS: usize = 6;
const REFIT_ROUNDS: usize = 3;

/// A fit under one hypothesis: a number (or none) that is free beside the history.
struct Fit {
    number: Option<usize>,
    d: DVector<f64>,
    linear: Linear,
    covariance: DMatrix<f64>,
}

/// Gauss and Newton's steps, linearised anew at each.
fn fit(unit: &Unit, glider: &Glider, history: &Learnt, from: &Numbers, level: f64, number: Option<usize>) -> Fit {
    let mut covariance = history.between.next();
    if let Some(i) = number {
        covariance[(i, i)] += 1.0;
    }
    let (precision, mean) = (inverse(&covariance), &history.between.mean);
    let mut d = mean.clone();
    let mut linear = linear_about(unit, glider, from, &Numbers::from_column_slice(d.as_slice()));
    for _ in 0..STEPS {
        let (n, u) = linear.normal();
        let step = inverse(&(n / level + &precision)) * (u / level + &precision * mean) - &d;
        let largest = step.amax();
        if !(largest >= 0.03) {
            break;
        }
        d += step * 1.0_f64.min(1.0 / largest);
        linear = linear_about(unit, glider, from, &Numbers::from_column_slice(d.as_slice()));
    }
    Fit { number, d, linear, covariance }
}

/// Laplace's evidence of fits against the first of them, all on the rows and with the noise of the best, and that noise.
fn evidence(fits: &[Fit], history: &Learnt) -> (Vec<f64>, f64) {
    let misfit = |f: &Fit| median(f.linear.residual.iter().map(|r| r.abs()));
    let Some(best) = fits.iter().min_by(|a, b| misfit(a).total_cmp(&misfit(b))) else { return (Vec::new(), f64::NAN) };
    let level = best.linear.level(&best.d, Some(history.usual_level));
    let kept = &best.linear.kept;
    let one = |f: &Fit| {
        let q = f.d.len();
        let e = &f.d - &history.between.mean;
        let precision = inverse(&f.covariance);
        let (mut n, mut g) = (DMatrix::zeros(q, q), -(&precision * &e));
        let mut square = 0.0;
        for i in (0..kept.len()).filter(|i| kept[*i]) {
            let (row, r) = (f.linear.jacobian.row(i), f.linear.residual[i]);
            square += (r * r / level).min(100.0);
            g += row.transpose() * (r / level);
            n.ger(1.0 / level, &row.transpose(), &row.transpose(), 1.0);
        }
        let spread = (DMatrix::identity(q, q) + &n * &f.covariance).determinant().ln();
        let ahead = inverse(&(n + &precision));
        0.5 * (-square - (e.transpose() * &precision * &e)[0] + (g.transpose() * ahead * &g)[0] - spread)
    };
    let all: Vec<f64> = fits.iter().map(one).collect();
    (all.iter().map(|l| l - all[0]).collect(), level)
}

/// What a unit says beside its vehicle's history.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// ln Bayes factors of the eight numbers.
    pub ln_bayes: [f64; NUMBERS],
    /// Size of each were it alone, in sizes of the number, and its standard deviation.
    pub alone: [(f64, f64); NUMBERS],
    /// Least size of each that would have been named, in sizes of the number.
    pub least: [f64; NUMBERS],
    /// What moved: all eight together against the history's mean, and standard deviations, in sizes.
    pub moved: [(f64, f64); NUMBERS],
    /// Standard deviation of each between units of the history and of its mean, in sizes: what it is known to scatter by.
    pub scatter: [f64; NUMBERS],
    /// chi² per number of the unit against the history.
    pub chi2: f64,
    /// What departs that is none of the numbers, and its ln Bayes factor; asked where no number is named.
    pub departs: Option<(Departure, f64)>,
    /// Names in the order of their evidence, none where the history explains the unit or does not predict itself.
    pub class: Vec<usize>,
}

impl Judgement {
    /// Whether nothing departs.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        self.class.is_empty() && self.departs.is_none()
    }

    /// 90 % interval of a number were it alone, in its sizes.
    #[must_use]
    pub fn interval(&self, number: usize) -> (f64, f64) {
        let (size, sigma) = self.alone[number];
        (size - NINETY * sigma, size + NINETY * sigma)
    }
}

/// Judges a unit by its vehicle's history, the vehicle's numbers claimed to be `claimed` (in sizes beyond the file; the history's own
/// `at` where nobody claims another).
#[must_use]
pub fn judge(unit: &Unit, glider: &Glider, history: &Learnt, claimed: &Numbers) -> Judgement {
    let between = &history.between;
    let (mean, covariance) = (&between.mean, between.next());
    let linear = linear_about(unit, glider, claimed, &Numbers::zeros());
    let level = linear.own_level(Some(history.usual_level));
    let first = Summary::of(&linear, level);
    let mut ln_bayes: [f64; NUMBERS] = std::array::from_fn(|i| weigh(&first, mean, &covariance, &[i]).ln_bayes);
    let mut fits = vec![fit(unit, glider, history, claimed, level, None)];
    let mut last = first;
    for _ in 0..REFIT_ROUNDS {
        let mut order: Vec<usize> = (0..NUMBERS).collect();
        order.sort_by(|a, b| ln_bayes[*b].total_cmp(&ln_bayes[*a]));
        let new: Vec<usize> = order.into_iter().take(BEST).filter(|i| fits.iter().all(|f| f.number != Some(*i))).collect();
        if new.is_empty() {
            break;
        }
        fits.extend(new.into_iter().map(|i| fit(unit, glider, history, claimed, level, Some(i))));
        let (found, level) = evidence(&fits, history);
        let best = (0..fits.len()).max_by(|a, b| found[*a].total_cmp(&found[*b])).unwrap_or(0);
        // The others at the best linearisation, on the scale of what was fitted.
        last = Summary::of(&fits[best].linear, level);
        let again: [f64; NUMBERS] = std::array::from_fn(|i| weigh(&last, mean, &covariance, &[i]).ln_bayes);
        let shift = fits[best].number.map_or(0.0, |i| found[best] - again[i]);
        ln_bayes = again.map(|l| (l + shift).min(found[best] - 1e-3));
        fits.iter().zip(&found).filter_map(|(f, l)| Some((f.number?, *l))).for_each(|(i, l)| ln_bayes[i] = l);
    }
    let class = if history.predicts_itself() { class(&ln_bayes) } else { Vec::new() };
    let departs =
        if class.is_empty() && history.predicts_itself() { beyond_numbers(unit, glider, history, claimed, &fits[0]) } else { None };
    let ((alone, least), moved) = (alone(&last, history), moved(&last, between));
    Judgement {
        ln_bayes,
        alone,
        least,
        moved,
        scatter: scatter(between),
        chi2: forward_chi2(unit, glider, history, claimed),
        departs,
        class,
    }
}

/// Judges a unit of which the summary alone is known, counted from the vehicle's numbers: what a surfacing sends. Nothing is linearised
/// anew, and what is none of the numbers is not asked.
#[must_use]
pub fn judge_summary(says: &Summary, history: &Learnt) -> Judgement {
    let between = &history.between;
    let covariance = between.next();
    let ln_bayes = std::array::from_fn(|i| weigh(says, &between.mean, &covariance, &[i]).ln_bayes);
    let class = if history.predicts_itself() { class(&ln_bayes) } else { Vec::new() };
    let ((alone, least), moved) = (alone(says, history), moved(says, between));
    Judgement {
        ln_bayes,
        alone,
        least,
        moved,
        scatter: scatter(between),
        chi2: chi2(says, &between.mean, &covariance),
        departs: None,
        class,
    }
}

/// Each number were it alone to depart, with its standard deviation, and the least size of each that would have been named: the
/// interval of a size holds what it claims for this vehicle's dives, whatever their law.
fn alone(says: &Summary, history: &Learnt) -> ([(f64, f64); NUMBERS], [f64; NUMBERS]) {
    let ratio = (history.ninety / NINETY).powi(2);
    let (scaled, wider) = (Summary { n: &says.n / ratio, u: &says.u / ratio }, history.between.next() * ratio);
    let one: [(f64, f64); NUMBERS] = std::array::from_fn(|i| {
        let w = weigh(&scaled, &history.between.mean, &wider, &[i]);
        (w.size[0], w.covariance[(0, 0)])
    });
    (one.map(|(size, variance)| (size, variance.sqrt())), one.map(|(_, variance)| least_named(1.0 / variance - 1.0)))
}

/// What departs beside the history's best fit that is none of the numbers.
fn beyond_numbers(unit: &Unit, glider: &Glider, history: &Learnt, claimed: &Numbers, null: &Fit) -> Option<(Departure, f64)> {
    let wide = history.wide.as_ref()?;
    let linear = wide_about(unit, glider, claimed, &Numbers::from_column_slice(null.d.as_slice()));
    departs(&linear, linear.own_level(Some(history.usual_level)), &wide.mean, &wide.next())
}

/// What the numbers of the next unit scatter by, one standard deviation each.
fn scatter(between: &Between) -> [f64; NUMBERS] {
    let next = between.next();
    std::array::from_fn(|i| next[(i, i)].sqrt())
}

/// All eight numbers of a unit beyond the history's mean, each free by one size beside the history.
fn moved(unit: &Summary, between: &Between) -> [(f64, f64); NUMBERS] {
    let covariance = between.next() + DMatrix::identity(NUMBERS, NUMBERS);
    let posterior = inverse(&(&unit.n + inverse(&covariance)));
    let size = &posterior * unit.about(&between.mean);
    std::array::from_fn(|i| (size[i], posterior[(i, i)].sqrt()))
}

/// What a unit says with nothing known but the usual sizes of errors: what moved; nothing is named.
#[must_use]
pub fn moved_alone(unit: &Unit, glider: &Glider) -> Judgement {
    let usual =
        Between { mean: DVector::zeros(NUMBERS), of_mean: DMatrix::zeros(NUMBERS, NUMBERS), scatter: DMatrix::identity(NUMBERS, NUMBERS) };
    let level = linear_about(unit, glider, &Numbers::zeros(), &Numbers::zeros()).own_level(None);
    let history =
        Learnt { at: Numbers::zeros(), between: usual, wide: None, usual_level: level, units: Vec::new(), chi2: f64::NAN, ninety: NINETY };
    let found = fit(unit, glider, &history, &history.at, level, None);
    let says = Summary::of(&found.linear, found.linear.level(&found.d, None));
    let posterior = inverse(&(&says.n + DMatrix::identity(NUMBERS, NUMBERS)));
    let size = &posterior * &says.u;
    let moved = std::array::from_fn(|i| (size[i], posterior[(i, i)].sqrt()));
    let chi2 = chi2(&says, &history.between.mean, &history.between.scatter);
    Judgement {
        ln_bayes: [0.0; NUMBERS],
        alone: moved,
        least: [f64::INFINITY; NUMBERS],
        moved,
        scatter: [1.0; NUMBERS],
        chi2,
        departs: None,
        class: Vec::new(),
    }
}

/// chi² per number of a unit against a history, linearised where the vehicle is claimed to be.
#[must_use]
pub fn forward_chi2(unit: &Unit, glider: &Glider, history: &Learnt, claimed: &Numbers) -> f64 {
    let linear = linear_about(unit, glider, claimed, &Numbers::zeros());
    let summary = Summary::of(&linear, linear.own_level(Some(history.usual_level)));
    chi2(&summary, &history.between.mean, &history.between.next())
}
