//! Which rows take part (near the stall, wrong samples), how large the ordinary water motion is, how far the moments in pitch are to be
//! trusted, and what every body does.
//!
//! The first look takes them as the recalibrated vehicle flies, or as the vehicle as given does where that is told better. The second
//! settles them anew by what the first search has taught; where another hypothesis leads then, so does a third. Rows move only together
//! with a new search.

use crate::diagnosis::hull_lag;
use crate::diagnosis::{FEWEST_COMPARED, OUTLIER, worth_naming};
use crate::hypotheses::bank::{self, settled};
use crate::hypotheses::candidate::{is_strained, named};
use crate::hypotheses::search::{Depth, Found, MAY_WIN, MAY_WIN_RECOLOURED, search, weigh_again};
use crate::inference::evidence::{TIED, log_evidence};
use crate::inference::gauss_newton::{Effort, Fit, fit_from};
use crate::likelihood::Problem;
use crate::likelihood::stall_mask::WORTH_TRYING;
use crate::model::parameters::State;
use crate::preprocess::Prepared;

/// One observation in so many, coming or going, is worth a new search.
const WORTH_A_SEARCH: usize = 40;
/// Steps of the fit of a hypothesis from all rows to those away from the stall.
const ELSEWHERE_STEPS: usize = 6;
/// By how much the rows near the stall may raise the mean square of innovations.
const WORSE_OVERALL: f64 = 1.06;

/// Times at most that rows, water motion, the bank and the lag of the hull are settled anew by what the last search has named.
const LOOKS: usize = 2;

/// Searches, and settles rows, water motion, tilt and the lag of the hull by what is found, until the same hypothesis leads.
pub(crate) fn look(problem: &mut Problem, prepared: &Prepared, depth: Depth, tick: &dyn Fn(&str, f64), notes: &mut Vec<String>) -> Found {
    let mut found = first_look(problem, prepared, depth, tick);
    for _ in 0..LOOKS {
        let (bank, late) = (bank::told(problem, &found), hull_lag::told(problem, &found));
        if let Some(bank) = bank {
            problem.branch.bank = bank;
        }
        if let Some(share) = late {
            problem.branch.hull_lag_share = share;
            notes.push(hull_lag::NOTE.into());
        }
        let state = best_of(problem, &found).state.clone();
        let doubted = problem.doubt_moments(&state);
        if bank.is_some() || late.is_some() || doubted {
            found = search(problem, Some(&found), depth, tick);
        }
        let settled_by = found.leading();
        found = second_look(problem, found, depth, tick);
        if found.leading() == settled_by {
            break;
        }
    }
    // The last look may have taken another than the first did.
    notes.extend(problem.branch.bank.note());
    found
}

/// The best hypothesis that is worth naming, else nothing missing.
fn best_of<'a>(problem: &Problem, found: &'a Found) -> &'a Fit {
    worth_naming(problem, &found.candidates).map_or(&found.null, |c| &c.fit)
}

/// The problem with the rows that the vehicle as given asks for, where the recalibrated one leaves out many near the stall and twice as
/// many: a calibration that strains for what is missing may fly it into a stall where there is none.
pub(crate) fn as_given_flies<'a>(problem: &Problem<'a>) -> Option<Problem<'a>> {
    if !problem.much_near_stall() {
        return None;
    }
    let mut given = problem.clone();
    given.leave_nothing_out();
    given.settle_continuation(&problem.start);
    if 2 * given.brink_rows() > problem.brink_rows() {
        return None;
    }
    let null = fit_from(&given, &given.start, Effort::of(3));
    given.drop_outliers(&null.residual, OUTLIER);
    given.tune_colour(&null.state);
    Some(given)
}

/// Whether what is fitted to other rows tells all dives better, and is bearable on the rows of the first, which lie away from the stall.
pub(crate) fn tells_all_better(prepared: &Prepared, (problem, mine): (&Problem, &Fit), (other, its): (&Problem, &Fit)) -> bool {
    if !(other.fitted_error_m_s(prepared, &its.state) < problem.fitted_error_m_s(prepared, &mine.state)) {
        return false;
    }
    let elsewhere = fit_from(problem, &its.state, Effort::of(ELSEWHERE_STEPS));
    let bearable = elsewhere.mean_square() < mine.mean_square().max(1.0) * WORSE_OVERALL;
    // One effect more that only rows near the stall ask for is the form of nature's lift there.
    let more = its.state.effects_in_all() > mine.state.effects_in_all();
    bearable && (!more || log_evidence(problem, &elsewhere) > log_evidence(problem, mine))
}

/// Searches, and where it is open which rows take part, the rows are those whose best hypothesis tells all dives better.
fn first_look(problem: &mut Problem, prepared: &Prepared, depth: Depth, tick: &dyn Fn(&str, f64)) -> Found {
    let found = search(problem, None, depth, tick);
    let Some(other) = as_given_flies(problem) else { return found };
    let again = search(&other, None, depth, tick);
    if tells_all_better(prepared, (problem, best_of(problem, &found)), (&other, best_of(&other, &again))) {
        *problem = other;
        return again;
    }
    found
}

/// Settles rows and water motion anew by what is found, and searches or weighs again where they are others.
fn second_look(problem: &mut Problem, first: Found, depth: Depth, tick: &dyn Fn(&str, f64)) -> Found {
    let mut found = first;
    let large = problem.data.len() / WORTH_A_SEARCH;
    let mut kept = problem.left_out();
    let mut restored = problem.much_near_stall() && problem.restore_brink(&best_of(problem, &found).state, WORTH_TRYING) > 0;
    if restored {
        let again = search(problem, Some(&found), depth, tick);
        let other = best_of(problem, &again);
        let whole = problem.left_out();
        problem.leave_out(kept.clone());
        restored = holds_elsewhere(problem, best_of(problem, &found), other);
        if restored {
            found = again;
            problem.leave_out(whole.clone());
            kept = whole;
        }
    }
    let best = best_of(problem, &found).clone();
    let outliers = problem.drop_outliers(&best.residual, OUTLIER);
    let before = problem.left_out();
    let mut widened = if restored { 0 } else { problem.settle_continuation(&best.state) };
    if problem.rows_compared() < FEWEST_COMPARED {
        // Nothing to judge by would be left.
        problem.leave_out(before.clone());
        widened = 0;
    }
    let explained = widened > 0 && problem.explains_near_stall(&best.state, &before);
    let recoloured = problem.tune_colour(&best.state);
    if widened + outliers > large {
        // Rows that depend on the continuation are out. What says the same without them needs no new search, unless all rest in the
        // hollow that those rows had led to.
        let weighed = weigh_again(problem, found.clone(), MAY_WIN, tick);
        if name_the_same(best_of(problem, &weighed), &best) && !is_strained(&best_of(problem, &weighed).state) {
            return weighed;
        }
        // Where only the power to tell is lost with them, they come back: the fit explains them, the others name part of what it
        // names, and ask for the rest.
        let again = search(problem, Some(&found), depth, tick);
        if explained && is_part(best_of(problem, &again), &best) && is_asked_for(problem, &best) {
            problem.leave_out(before);
            return weigh_again(problem, found, MAY_WIN, tick);
        }
        found = again;
    } else if recoloured {
        found = weigh_again(problem, found, MAY_WIN_RECOLOURED, tick);
    } else {
        problem.leave_out(kept);
    }
    found
}

/// Looks again at what somebody asked for: which rows take part and how large the ordinary water motion is, by what has been fitted. The
/// fit to these, where they are much else than by the vehicle as given.
pub(crate) fn look_again(problem: &mut Problem, first: &Fit) -> Option<Fit> {
    let large = problem.data.len() / WORTH_A_SEARCH;
    let kept = problem.left_out();
    if problem.much_near_stall() && problem.restore_brink(&first.state, WORTH_TRYING) > 0 {
        let whole = problem.left_out();
        let again = settled(problem, &first.state);
        problem.leave_out(kept.clone());
        if holds_elsewhere(problem, first, &again) {
            problem.leave_out(whole);
            return Some(again);
        }
    }
    let moved = problem.drop_outliers(&first.residual, OUTLIER) + problem.settle_continuation(&first.state);
    if problem.tune_colour(&first.state) || (moved > large && problem.rows_compared() >= FEWEST_COMPARED) {
        return Some(settled(problem, &first.state));
    }
    problem.leave_out(kept);
    None
}

/// Whether two fits name the same effects.
fn name_the_same(a: &Fit, b: &Fit) -> bool {
    let [mut a, mut b] = [named(&a.state), named(&b.state)];
    a.sort_unstable();
    b.sort_unstable();
    a == b
}

/// Whether all that a fit names is named by another that names more. A wave follows whatever is slow, a wrong law near the stall too:
/// nothing is part of a fit with one.
fn is_part(fit: &Fit, of: &Fit) -> bool {
    let (part, whole) = (&fit.state, &of.state);
    let named = |name: &str| whole.effects.iter().any(|a| a.effect.name() == name);
    whole.wave.is_none()
        && part.wave.is_none()
        && part.effects.len() < whole.effects.len()
        && part.effects.iter().all(|a| named(a.effect.name()))
}

/// Whether the rows of today ask for every effect of a fit: their evidence falls whichever is left out. (That more effects are rarer
/// has been counted where the fit was chosen.)
fn is_asked_for(problem: &Problem, of: &Fit) -> bool {
    let here = |state: &State| log_evidence(problem, &fit_from(problem, state, Effort::of(ELSEWHERE_STEPS)));
    let whole = here(&of.state);
    (0..of.state.effects.len()).all(|k| {
        let mut one_less = of.state.clone();
        one_less.effects.remove(k);
        here(&one_less) < whole
    })
}

/// Whether what all rows say holds on those away from the stall, which the first look saw alone: nature may go on otherwise near the
/// stall than any of our laws.
fn holds_elsewhere(problem: &Problem, first: &Fit, other: &Fit) -> bool {
    let elsewhere = fit_from(problem, &other.state, Effort::of(ELSEWHERE_STEPS));
    let gained = log_evidence(problem, &elsewhere) - log_evidence(problem, first);
    // One effect more that only rows near the stall ask for is the form of nature's stall: a clean flight of a vehicle whose lift
    // goes on otherwise than by any of our laws was told to have edge lift.
    let more = other.state.effects_in_all() > first.state.effects_in_all();
    let bearable = if more { 0.0 } else { -TIED };
    other.mean_square() < first.mean_square().max(1.0) * WORSE_OVERALL && gained > bearable
}
