//! Alternates the search of hypotheses and the re-estimation of mask, noise and model discrepancy until the leader is stable.
//!
//! The first search knows no model discrepancy. Given its best hypothesis the size of the discrepancy is estimated (estimated where nothing
//! is named it would swallow the effect), rows near the stall and outliers are masked, and the size of the water motion is estimated;
//! the next search ranks under these.

use crate::diagnosis::{FEWEST_COMPARED, OUTLIER, worth_naming};
use crate::hypotheses::search::{Depth, SearchResult, search};
use crate::inference::gauss_newton::{Effort, fit_from};
use crate::inference::posterior::Fit;
use crate::likelihood::Problem;
use crate::likelihood::discrepancy::Sizes;
use crate::model::parameters::State;

/// One observation in so many, coming or going, is worth a new search.
const WORTH_A_SEARCH: usize = 40;
/// Searches after the first at most.
const MOST_SEARCHES: usize = 3;
/// Steps of a fit to other rows.
const REFIT_STEPS: usize = 4;

/// Searches until the leader is stable.
pub(crate) fn search_until_stable(problem: &mut Problem, depth: Depth, tick: &dyn Fn(&str, f64)) -> SearchResult {
    // Each search has its share of the progress, half of what the last one left: it never runs backward.
    let within = |from: f64, to: f64| move |what: &str, share: f64| tick(what, from + (to - from) * share);
    let (mut from, mut to) = (0.0, 0.5);
    let mut found = search(problem, None, depth, &within(from, to));
    problem.prepare_discrepancy(&found.null.state);
    for _ in 0..MOST_SEARCHES {
        let best = best_of(&found).clone();
        if !estimate_anew(problem, &best) {
            break;
        }
        (from, to) = (to, 0.5 * (1.0 + to));
        let led = found.leading();
        found = search(problem, Some(&found), depth, &within(from, to));
        if found.leading() == led {
            break;
        }
    }
    found
}

/// The best hypothesis that is worth naming, else nothing missing.
pub(crate) fn best_of(found: &SearchResult) -> &Fit {
    worth_naming(&found.candidates).map_or(&found.null, |c| &c.fit)
}

/// Estimates mask, noise and discrepancy given a fit; whether any of them has changed.
pub(crate) fn estimate_anew(problem: &mut Problem, best: &Fit) -> bool {
    let before = problem.discrepancy.sizes_m_s;
    let mut changed = problem.scale_moment_noise(&best.state);
    changed |= mask_anew(problem, best);
    // The noise of the water is that without a discrepancy, and the discrepancy is estimated given a fit without one.
    problem.set_discrepancy(Sizes::default());
    changed |= problem.tune_colour(&best.state);
    let fit = fit_from(problem, &best.state, Effort::of(REFIT_STEPS));
    let sizes = problem.discrepancy_sizes_at(&fit);
    problem.set_discrepancy(sizes);
    changed || sizes != before
}

/// Masks outliers and rows near the stall given a fit; whether that is worth a new search (otherwise all stays as it was).
fn mask_anew(problem: &mut Problem, best: &Fit) -> bool {
    let kept = problem.left_out();
    let outliers = problem.drop_outliers(&problem.innovations(&best.residual), OUTLIER);
    let moved = outliers + problem.settle_continuation(&best.state);
    if moved <= problem.data.len() / WORTH_A_SEARCH || problem.rows_compared() < FEWEST_COMPARED {
        problem.leave_out(kept);
        return false;
    }
    true
}

/// A fit that starts from a state, signatures taken anew on the way.
pub(crate) fn settled(problem: &Problem, state: &State) -> Fit {
    let from = |state: &State| fit_from(problem, state, Effort::of(REFIT_STEPS));
    from(&from(state).state)
}
