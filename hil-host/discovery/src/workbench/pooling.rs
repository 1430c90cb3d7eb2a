//! Information of several flights or dives about the same numbers, combined without fitting their logs together.
//!
//! Near its best state a flight is a quadratic in the numbers z that it is fitted by:
//! ```text
//! −2 ln L(z) = zᵀ H z − 2 bᵀ z + const         H = Jᵀ J    b = Jᵀ (r + J z₀)
//! ```
//! with J its whitened sensitivities and r its residual at z₀. Priors are not in it, so independent flights add up, and a number of one
//! flight alone is integrated out under its own prior (a Schur complement). What comes of it is what one fit to all logs together would
//! give, at a hundredth of the size.
//!
//! **Scatter between flights.** A vehicle is not quite the same on two flights, and no model is its law: the numbers of flight i are
//! `z + u_i`, `u_i ~ N(0, T)` with T diagonal (random-effects model of meta-analysis: DerSimonian and Laird 1986; Higgins, Thompson and
//! Spiegelhalter 2009 for its Bayesian form). With two or three flights a moment estimate of T is mostly zero by chance; so T has a
//! prior and its posterior mean is taken, number by number, over a grid. With one flight that is the prior.

use crate::likelihood::jacobian::ln_det;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// What data say of some numbers, without their prior.
#[derive(Clone, Debug)]
pub struct Information {
    /// H.
    pub matrix: DMatrix<f64>,
    /// b.
    pub vector: DVector<f64>,
}

impl Information {
    /// Of `n` numbers, none yet.
    #[must_use]
    pub fn none(n: usize) -> Self {
        Self { matrix: DMatrix::zeros(n, n), vector: DVector::zeros(n) }
    }

    /// Adds independent data.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.vector += &other.vector;
    }

    /// With independent normal priors about nothing.
    #[must_use]
    pub fn with_prior(&self, precision: impl IntoIterator<Item = f64>) -> Self {
        let mut out = self.clone();
        precision.into_iter().enumerate().for_each(|(i, p)| out.matrix[(i, i)] += p);
        out
    }

    /// Of the numbers `keep`; the others are integrated out. None where what is known of them is not positive.
    #[must_use]
    pub fn marginal(&self, keep: &[usize]) -> Option<Self> {
        let other: Vec<usize> = (0..self.vector.len()).filter(|i| !keep.contains(i)).collect();
        let block =
            |rows: &[usize], columns: &[usize]| DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.matrix[(rows[i], columns[j])]);
        let part = |rows: &[usize]| DVector::from_fn(rows.len(), |i, _| self.vector[rows[i]]);
        let mut out = Self { matrix: block(keep, keep), vector: part(keep) };
        if !other.is_empty() {
            let across = block(&other, keep);
            let inner = factor(&block(&other, &other))?;
            out.matrix -= across.transpose() * inner.solve(&across);
            out.vector -= across.transpose() * inner.solve(&part(&other));
        }
        Some(out)
    }

    /// Mean and covariance. None where they are not determined.
    #[must_use]
    pub fn estimate(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let inverse = factor(&self.matrix)?.inverse();
        Some((&inverse * &self.vector, inverse))
    }

    /// The same about the mean of numbers that scatter with these variances, and minus twice the log likelihood lost by that.
    pub(crate) fn scattered(&self, variance: &[f64]) -> Option<(Self, f64)> {
        let n = variance.len();
        // (1 + H T) from the left: rows and columns with their square roots, so that it stays symmetric.
        let root = |i: usize| variance[i].max(0.0).sqrt();
        let inner = factor(&DMatrix::from_fn(n, n, |i, j| root(i) * self.matrix[(i, j)] * root(j) + if i == j { 1.0 } else { 0.0 }))?;
        let scaled = DMatrix::from_fn(n, n, |i, j| root(i) * self.matrix[(i, j)]);
        let vector = DVector::from_fn(n, |i, _| root(i) * self.vector[i]);
        let by = inner.solve(&vector);
        let matrix = &self.matrix - scaled.transpose() * inner.solve(&scaled);
        let lost = ln_det(&inner) - vector.dot(&by);
        Some((Self { matrix, vector: &self.vector - scaled.transpose() * by }, lost))
    }
}

/// Cholesky factor with a relative ridge that keeps a number of which nothing is known from breaking it.
fn factor(matrix: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let mut m = 0.5 * (matrix + matrix.transpose());
    (0..m.nrows()).for_each(|i| m[(i, i)] = (m[(i, i)] * (1.0 + 1e-10)).max(1e-12));
    m.cholesky()
}

/// Sizes of scatter that are tried, in what is usual.
const SCATTERS: [f64; 15] = [0.0, 0.15, 0.3, 0.5, 0.75, 1.2, 2.0, 3.0, 4.5, 6.5, 10.0, 15.0, 25.0, 40.0, 70.0];
/// Sweeps over the numbers.
const SWEEPS: usize = 3;

/// What several flights say together.
#[derive(Clone, Debug)]
pub struct Pooled {
    /// The shared numbers: those of one fit to all flights.
    pub mean: DVector<f64>,
    /// Covariance of their mean where flights scatter.
    pub covariance: DMatrix<f64>,
    /// Scatter of each number between flights, 1 sigma.
    pub scatter: Vec<f64>,
}

impl Pooled {
    /// Standard deviation that the next flight's number is expected within: of the mean and of its own scatter.
    #[must_use]
    pub fn next(&self, i: usize) -> f64 {
        self.covariance[(i, i)].max(0.0).sqrt().hypot(self.scatter[i])
    }
}

/// Sum over flights that scatter, and minus twice its log evidence.
fn sum(flights: &[Information], precision: &[f64], variance: &[f64]) -> Option<(Information, f64)> {
    let mut all = Information::none(precision.len());
    let mut cost = 0.0;
    for flight in flights {
        let (one, lost) = flight.scattered(variance)?;
        all.add(&one);
        cost += lost;
    }
    let all = all.with_prior(precision.iter().copied());
    let factor = factor(&all.matrix)?;
    cost += ln_det(&factor) - all.vector.dot(&factor.solve(&all.vector));
    Some((all, cost))
}

/// Pools flights under normal priors of these precisions about nothing; `usual` is the mean of the exponential prior of each number's
/// scatter. The numbers are those of the joint fit, and what they are uncertain by is that of flights that scatter. None where the
/// information is not positive.
#[must_use]
pub fn pool(flights: &[Information], precision: &[f64], usual: &[f64]) -> Option<Pooled> {
    let scatter = pool_scatter(flights, precision, usual)?;
    let variance: Vec<f64> = scatter.iter().map(|s| s * s).collect();
    let (mean, _) = joint(flights, precision)?;
    let (_, covariance) = sum(flights, precision, &variance)?.0.estimate()?;
    Some(Pooled { mean, covariance, scatter })
}

/// The numbers of one fit to all flights, and their covariance if flights do not scatter.
#[must_use]
pub fn joint(flights: &[Information], precision: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let mut all = Information::none(precision.len());
    flights.iter().for_each(|f| all.add(f));
    all.with_prior(precision.iter().copied()).estimate()
}

/// Posterior root mean square of the scatter of each number about the shared one; of one flight that is the prior's.
#[must_use]
pub fn pool_scatter(flights: &[Information], precision: &[f64], usual: &[f64]) -> Option<Vec<f64>> {
    let mut variance: Vec<f64> = usual.iter().map(|u| 2.0 * u * u).collect();
    let sweeps = if flights.len() < 2 { 0 } else { SWEEPS };
    let width = |k: usize| 0.5 * (SCATTERS.get(k + 1).unwrap_or(&SCATTERS[k]) - SCATTERS[k.saturating_sub(1)]);
    for _ in 0..sweeps {
        for (i, usual) in usual.iter().enumerate() {
            let mut weighed: Vec<(f64, f64, f64)> = Vec::with_capacity(SCATTERS.len());
            for (k, s) in SCATTERS.iter().enumerate() {
                variance[i] = (s * usual).powi(2);
                let (_, cost) = sum(flights, precision, &variance)?;
                weighed.push((-0.5 * cost - s, width(k), variance[i]));
            }
            let top = weighed.iter().map(|w| w.0).fold(f64::NEG_INFINITY, f64::max);
            let weight = |w: &(f64, f64, f64)| (w.0 - top).exp() * w.1;
            variance[i] = weighed.iter().map(|w| weight(w) * w.2).sum::<f64>() / weighed.iter().map(weight).sum::<f64>();
        }
    }
    Some(variance.iter().map(|v| v.sqrt()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wobble(i: usize, j: usize, seed: f64) -> f64 {
        ((i as f64 + 1.3) * (j as f64 + 0.7) * seed).sin()
    }

    /// A linear "flight" of `m` rows: sensitivities to two shared numbers and one of its own, and rows.
    fn flight(m: usize, seed: f64, truth: [f64; 3]) -> (DMatrix<f64>, DVector<f64>) {
        let j = DMatrix::from_fn(m, 3, |r, c| wobble(r, c, seed));
        let y = &j * DVector::from_row_slice(&truth) + DVector::from_fn(m, |r, _| 0.5 * wobble(r, 9, 2.1 * seed));
        (j, y)
    }

    fn of(j: &DMatrix<f64>, y: &DVector<f64>) -> Information {
        Information { matrix: j.transpose() * j, vector: j.transpose() * y }
    }

    /// Pooled information against one fit to all rows, with a number of its own per flight: the same equations, to rounding.
    #[test]
    fn accuracy_pooled_information_is_the_joint_fit() {
        let flights = [flight(30, 0.37, [1.0, -2.0, 3.0]), flight(40, 0.91, [1.0, -2.0, -1.0]), flight(25, 1.7, [1.0, -2.0, 0.5])];
        let mut all = Information::none(2);
        for (j, y) in &flights {
            all.add(&of(j, y).with_prior([0.0, 0.0, 0.25]).marginal(&[0, 1]).expect("positive"));
        }
        let (mean, covariance) = all.with_prior([1.0, 1.0]).estimate().expect("positive");
        // One fit: columns 0 and 1 shared, one more for each flight.
        let rows: usize = flights.iter().map(|f| f.0.nrows()).sum();
        let (mut j, mut y, mut at) = (DMatrix::zeros(rows, 5), DVector::zeros(rows), 0);
        for (k, (jk, yk)) in flights.iter().enumerate() {
            for r in 0..jk.nrows() {
                (j[(at, 0)], j[(at, 1)], j[(at, 2 + k)], y[at]) = (jk[(r, 0)], jk[(r, 1)], jk[(r, 2)], yk[r]);
                at += 1;
            }
        }
        let joint = of(&j, &y).with_prior([1.0, 1.0, 0.25, 0.25, 0.25]);
        let inverse = joint.matrix.clone().try_inverse().expect("positive");
        let exact = &inverse * &joint.vector;
        // The ridge of 1e-10 is what they may differ by.
        for i in 0..2 {
            assert!((mean[i] - exact[i]).abs() < 1e-7, "{mean} {exact}");
            for k in 0..2 {
                assert!((covariance[(i, k)] - inverse[(i, k)]).abs() < 1e-8);
            }
        }
    }

    /// The scatter is integrated out as the dense covariance has it: estimates with covariance H⁻¹ + T.
    #[test]
    fn accuracy_scatter_adds_to_the_covariance_of_a_flight() {
        let (j, y) = flight(30, 0.53, [0.4, 0.2, -0.3]);
        let one = of(&j, &y);
        let variance = [0.3, 0.0, 0.02];
        let (got, lost) = one.scattered(&variance).expect("positive");
        let mut covariance = one.matrix.clone().try_inverse().expect("positive");
        let mean = &covariance * &one.vector;
        (0..3).for_each(|i| covariance[(i, i)] += variance[i]);
        let exact = covariance.clone().try_inverse().expect("positive");
        assert!((&got.matrix - &exact).abs().max() < 1e-8 * exact.abs().max());
        assert!((&got.vector - &exact * &mean).abs().max() < 1e-8);
        // ln det (1 + T H) − bᵀ T (1 + H T)⁻¹ b by its definition.
        let t = DMatrix::from_diagonal(&DVector::from_row_slice(&variance));
        let inner = DMatrix::identity(3, 3) + &one.matrix * &t;
        let dense = inner.determinant().ln() - (one.vector.transpose() * &t * inner.try_inverse().expect("positive") * &one.vector)[(0, 0)];
        assert!((lost - dense).abs() < 1e-8 * (1.0 + dense.abs()), "{lost} {dense}");
    }

    #[test]
    fn accuracy_flights_that_disagree_widen_what_the_next_is_expected_within() {
        // Each flight knows one number to a hundredth.
        let one = |z: f64| Information { matrix: DMatrix::from_element(1, 1, 1e4), vector: DVector::from_element(1, 1e4 * z) };
        let next = |z: &[f64]| pool(&z.iter().map(|z| one(*z)).collect::<Vec<_>>(), &[1.0], &[0.2]).expect("positive").next(0);
        let (single, agreeing, apart) = (next(&[0.3]), next(&[0.30, 0.31, 0.30, 0.29]), next(&[0.0, 1.0, -0.8, 0.4]));
        // One: the prior's mean square of scatter, 2 · 0.2² of an exponential, once for the flight that was flown (with its noise, under the
        // prior of the number) and once for the next. Four that agree: less. Four that scatter by 0.77: about that.
        let scatter = 2.0 * 0.2_f64.powi(2);
        let expected = (1.0 / (1.0 / (scatter + 1e-4) + 1.0) + scatter).sqrt();
        assert!((single - expected).abs() < 1e-6, "{single}, {expected} by hand");
        assert!(agreeing < 0.5 * single && (0.5..1.6).contains(&apart), "{agreeing} {apart}");
    }
}
