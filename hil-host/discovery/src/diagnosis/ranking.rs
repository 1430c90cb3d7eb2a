//! All hypotheses in the order of their probability, with the block errors that each leaves.

use crate::diagnosis::judged::{Judged, as_given_m_s};
use crate::hypotheses::candidate::Candidate;
use crate::hypotheses::search::SearchResult;
use crate::inference::estimate::{Estimate, estimates};
use crate::likelihood::Problem;
use crate::likelihood::block_error::block_errors;
use crate::model::parameters::State;
use crate::preprocess::Prepared;

/// Hypotheses that get full figures, for a reader to look at; the others are only ranked.
const SHOWN: usize = 12;

/// One hypothesis in the report.
#[derive(Clone, Debug)]
pub struct Ranked {
    /// Its effects.
    pub effects: Vec<&'static str>,
    /// Parameters with intervals.
    pub parameters: Vec<Estimate>,
    /// Block error on the fitted segments, m/s.
    pub error_fitted_m_s: f64,
    /// Block error on the check segments, m/s.
    pub error_check_m_s: f64,
    /// Probability among all hypotheses.
    pub probability: f64,
    /// Log odds against nothing missing.
    pub log_odds: f64,
    /// Fall of chi².
    pub gain: f64,
    /// Where the model is.
    pub state: State,
}

/// All hypotheses with their probabilities, and block errors of the vehicle as given, recalibrated, and after the answer.
pub(super) struct Ranking {
    pub(super) candidates: Vec<Ranked>,
    pub(super) probability_nothing: f64,
    pub(super) fitted_error_m_s: [f64; 3],
    pub(super) block_error_m_s: [f64; 3],
}

/// Ranks everything that was asked; `after` is the state of the answer.
pub(super) fn rank(problem: &Problem, prepared: &Prepared, found: &SearchResult, after: &State, judged: &Judged) -> Ranking {
    let candidates = &found.candidates;
    let top = candidates.iter().map(|c| c.log_odds).fold(0.0, f64::max);
    let total: f64 = (-top).exp() + candidates.iter().map(|c| (c.log_odds - top).exp()).sum::<f64>();
    let mut states = vec![&found.null.state, after];
    states.extend(candidates.iter().take(SHOWN).map(|c| &c.fit.state));
    let on_fitted = block_errors(problem, prepared, &states, &judged.fitted, true);
    let on_check = block_errors(problem, prepared, &states, &judged.kept_out, false);
    let as_given = |of| as_given_m_s(prepared, problem.vehicle, of);
    let ranked = |(k, c): (usize, &Candidate)| Ranked {
        effects: c.effects.clone(),
        parameters: estimates(&c.fit),
        error_fitted_m_s: on_fitted.get(2 + k).copied().unwrap_or(f64::NAN),
        error_check_m_s: on_check.get(2 + k).copied().unwrap_or(f64::NAN),
        probability: (c.log_odds - top).exp() / total,
        log_odds: c.log_odds,
        gain: c.gain,
        state: c.fit.state.clone(),
    };
    Ranking {
        candidates: candidates.iter().enumerate().map(ranked).collect(),
        probability_nothing: (-top).exp() / total,
        fitted_error_m_s: [as_given(&judged.fitted), on_fitted[0], on_fitted[1]],
        block_error_m_s: [as_given(&judged.kept_out), on_check[0], on_check[1]],
    }
}
