//! Signatures of effects in the whitened observations, and their geometry once everything that is fitted is projected out.

use crate::evidence::log_size_prior;
use crate::fit::{Ground, Jacobian, start_at, symmetric};
use crate::problem::{Column, Problem, State, calibration_of, tolerance_of};
use crate::search::WAVE;
use hydro::effects::{CATALOGUE, Effect};
use nalgebra::{DMatrix, DVector};
use std::borrow::Borrow;
use std::f64::consts::PI;

/// Extra columns offered to a residual, with what is fitted already projected out.
pub struct Offer {
    /// Inner products of the columns.
    pub gram: DMatrix<f64>,
    /// Their match with the residual.
    pub match_: DVector<f64>,
}

impl Offer {
    /// Projects the columns.
    #[must_use]
    pub fn new<C: Borrow<Column>>(extra: &[C], ground: &Ground) -> Self {
        let base = &ground.fit.columns;
        let m = extra.len();
        let cross = DMatrix::from_fn(base.len(), m, |i, j| base[i].dot(extra[j].borrow()));
        let mut gram = symmetric(m, |i, j| extra[i].borrow().dot(extra[j].borrow()));
        let through = ground.curvature.solve(&cross);
        gram -= cross.transpose() * &through;
        // A pull that the fit has left on its own numbers is not to be made good by the offer.
        let match_ = DVector::from_fn(m, |j, _| extra[j].borrow().dot(&ground.residual)) - through.transpose() * &ground.fit.gradient;
        Self { gram, match_ }
    }

    /// Log Bayes factor for normal amplitudes of this scale.
    #[must_use]
    pub fn log_bayes(&self, scale: f64) -> f64 {
        let s2 = scale * scale;
        let mut scaled = &self.gram * s2;
        for i in 0..self.match_.len() {
            scaled[(i, i)] += 1.0;
        }
        let Some(c) = scaled.cholesky() else { return f64::NEG_INFINITY };
        let log_det: f64 = 2.0 * c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        0.5 * s2 * self.match_.dot(&c.solve(&self.match_)) - 0.5 * log_det
    }
}

/// Signature of an effect at a state: difference of the model per unit of size, at a size that is felt.
fn signature(problem: &Problem, at: &State, base: &[f64], effect: &'static dyn Effect, size: f64) -> Column {
    let mut with = at.clone();
    let mut active = start_at(effect, size);
    if effect.name() == "horizontal_current" {
        active.values[1] = 0.0;
    }
    with.effects.push(active);
    let unit = if effect.name() == "stall" { 1.0 } else { size - effect.parameters()[0].off };
    let values = problem.model(&with).iter().zip(base).map(|(a, b)| (a - b) / unit).collect();
    Column { from: 0, values }
}

/// An effect's signature.
pub struct Signature {
    /// Which effect.
    pub effect: &'static dyn Effect,
    /// Whitened change of the observations per unit of size.
    pub column: Column,
}

/// Signatures of all effects at a state. With a `jacobian` taken there, calibration numbers lend theirs.
#[must_use]
pub fn signatures(problem: &Problem, at: &State, jacobian: Option<&Jacobian>) -> Vec<Signature> {
    let base = problem.model(at);
    let mut out = Vec::new();
    for effect in CATALOGUE.iter().copied() {
        let p = &effect.parameters()[0];
        let sizes: Vec<f64> = match effect.name() {
            WAVE | "horizontal_current" => continue,
            "stall" => vec![0.05, 0.09, 0.15],
            _ => vec![p.off + 0.25 * p.typical],
        };
        if let (Some(j), Some(k)) = (jacobian, calibration_of(effect.name())) {
            // A calibration number's own signature, in the effect's unit.
            let unit = tolerance_of(problem.vehicle, k);
            let column = Column { from: 0, values: j.columns[k].values.iter().map(|v| v / unit).collect() };
            out.push(Signature { effect, column });
            continue;
        }
        for size in sizes {
            out.push(Signature { effect, column: signature(problem, at, &base, effect, size) });
        }
    }
    out
}

pub(crate) fn log_size_prior_of(problem: &Problem, s: &Signature, value: f64, sigma: f64) -> f64 {
    if s.effect.name() == "stall" {
        // Amplitude one is the effect itself.
        return -0.5 * (value - 1.0).powi(2) / (0.25 + sigma * sigma);
    }
    log_size_prior(problem, s.effect, s.effect.parameters()[0].off + value, sigma) + sigma.ln() + 0.5 * (2.0 * PI).ln()
}

/// Signatures offered to a fit.
pub(crate) fn project(ground: &Ground, signs: &[Signature]) -> Offer {
    Offer::new(&signs.iter().map(|s| &s.column).collect::<Vec<_>>(), ground)
}

pub(crate) fn pair_score(problem: &Problem, signs: &[Signature], projected: &Offer, i: usize, j: usize) -> f64 {
    let (g, b) = (&projected.gram, &projected.match_);
    let (a, c, d) = (g[(i, i)] * (1.0 + 1e-6) + 1e-300, g[(i, j)], g[(j, j)] * (1.0 + 1e-6) + 1e-300);
    let det = a * d - c * c;
    if !(det > 0.0) {
        return f64::NEG_INFINITY;
    }
    let (x, y) = ((d * b[i] - c * b[j]) / det, (a * b[j] - c * b[i]) / det);
    let gain = x * b[i] + y * b[j];
    let (sx, sy) = ((d / det).sqrt(), (a / det).sqrt());
    0.5 * gain + log_size_prior_of(problem, &signs[i], x, sx) + log_size_prior_of(problem, &signs[j], y, sy)
}
