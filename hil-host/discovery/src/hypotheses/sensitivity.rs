//! Signatures of effects in the whitened observations, and their geometry once everything that is fitted is projected out.

use crate::inference::evidence::log_size_prior;
use crate::inference::posterior::Linearisation;
use crate::inference::projected_columns::ProjectedColumns;
use crate::likelihood::finite_difference::LEAP_IF_FELT;
use crate::likelihood::jacobian::Jacobian;
use crate::likelihood::{Column, Problem};
use crate::model::parameters::{State, calibration_of, is_law, tolerance_of};
use hydro::effects::{Effect, SeenIn};
use logs::vehicle::catalogue;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// A state with an effect of this size added to what is there.
fn with(problem: &Problem, at: &State, effect: &'static Effect, size: f64) -> State {
    let mut with = at.clone();
    let mut active = problem.active(effect, size);
    if effect.seen_in == SeenIn::Displacement {
        active.values[1] = 0.0;
    }
    with.effects.push(active);
    with
}

/// An effect's signature.
pub struct Signature {
    /// Which effect.
    pub effect: &'static Effect,
    /// Whitened change of the observations per unit of size.
    pub column: Column,
}

/// Signatures of all effects at a state. With a `jacobian` taken there, calibration numbers lend theirs.
#[must_use]
pub fn signatures(problem: &Problem, at: &State, jacobian: Option<&Jacobian>) -> Vec<Signature> {
    let mut tried: Vec<(&'static Effect, f64)> = Vec::new();
    let lent = |effect: &Effect| jacobian.zip(calibration_of(effect));
    for effect in catalogue::all().filter(|e| e.seen_in == SeenIn::VerticalMotion) {
        let p = &effect.parameters[0];
        // A nuisance of every hypothesis.
        if calibration_of(effect).is_some_and(|k| !is_law(k)) {
            continue;
        }
        match effect.onset {
            Some(onset) => tried.extend(onset.tried_rad.map(|angle| (effect, angle))),
            None => tried.push((effect, p.off + 0.25 * p.typical)),
        }
    }
    let simulated = tried.iter().filter(|t| lent(t.0).is_none()).map(|t| with(problem, at, t.0, t.1));
    let states: Vec<State> = std::iter::once(at.clone()).chain(simulated).collect();
    let mut models = problem.models(&states).into_iter();
    let base = models.next().unwrap_or_default();
    let seen = problem.seen(LEAP_IF_FELT);
    let column = |(effect, size): (&'static Effect, f64)| {
        let values = match lent(effect) {
            // A calibration number's own signature, in the effect's unit.
            Some((j, k)) => {
                let unit = tolerance_of(problem.vehicle, k);
                j.columns[k].values.iter().map(|v| v / unit).collect()
            }
            // Difference of the model per unit of size, at a size that is felt.
            None => {
                let ahead = models.next().unwrap_or_default();
                let off = effect.parameters[0].off;
                match effect.onset {
                    Some(_) => ahead.iter().zip(&base).map(|(a, b)| a - b).collect(),
                    None => seen.slope(&base, &ahead, size - off, |back| problem.model(&with(problem, at, effect, off + back))),
                }
            }
        };
        Signature { effect, column: problem.column(0, values) }
    };
    tried.into_iter().map(column).collect()
}

pub(crate) fn log_size_prior_of(problem: &Problem, s: &Signature, value: f64, sigma: f64) -> f64 {
    if s.effect.onset.is_some() {
        // Amplitude one is the effect itself.
        return -0.5 * (value - 1.0).powi(2) / (0.25 + sigma * sigma);
    }
    log_size_prior(problem, s.effect, s.effect.parameters[0].off + value, sigma) + sigma.ln() + 0.5 * (2.0 * PI).ln()
}

/// Inner products of signatures and their match with the residual, what is fitted projected out.
pub(crate) fn project(linearisation: &Linearisation, signs: &[Signature]) -> (DMatrix<f64>, DVector<f64>) {
    let projected = ProjectedColumns::new(&signs.iter().map(|s| &s.column).collect::<Vec<_>>(), linearisation);
    (projected.gram(), projected.match_)
}

pub(crate) fn pair_score(problem: &Problem, signs: &[Signature], gram_and_match: &(DMatrix<f64>, DVector<f64>), i: usize, j: usize) -> f64 {
    let (g, b) = gram_and_match;
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
