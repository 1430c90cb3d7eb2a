//! Does lift tilt out of the vertical plane as the vehicle banks?
//!
//! Geometry says so; the flight format's nominal model knows no roll. In turns of 15 to 20 degrees it takes 3 to 6 % of the lift,
//! which is no missing effect but looks like drag in turns, beside whatever else is missing. So the model with the tilt is asked whether
//! it tells the flight better: beside what is named or beside nothing, and in the place of drag in turns where that is named or nearly is.

use crate::brink::Branch;
use crate::calibration::State;
use crate::evidence::{TIED, log_evidence};
use crate::fit::{Effort, Fit, fit_from};
use crate::problem::Problem;
use crate::screen::Candidate;
use crate::search::{Found, prior_of};

/// The name that a tilt goes by.
const TAKEN_FOR: &str = "roll_turn_drag";
/// Log odds that the tilt, or what else every body does, has to be ahead by: twenty to one.
pub(crate) const CLEARLY: f64 = 3.0;
/// Iterations of each fit.
const ITERATIONS: usize = 6;

/// What a flight is said to show where the tilt is taken.
pub const NOTE: &str =
    "lift tilts with the roll here, as geometry has it and the nominal model does not (hydro.bank_tilt of the vehicle file, 1)";

/// Whether what was found, or that nothing is missing, is told better by lift that tilts with the roll; not asked where the vehicle file
/// says how far it does.
#[must_use]
pub fn tells_better(problem: &Problem, found: &Found) -> bool {
    let Some(banked) = banked(problem) else { return false };
    let best = found.candidates.first().filter(|c| c.log_odds > 0.0);
    let is_it = |c: &&Candidate| c.effects.contains(&TAKEN_FOR) && best.is_some_and(|best| best.log_odds - c.log_odds < TIED);
    let told = best.map_or(&found.null, |best| &best.fit);
    let mut asked = vec![told.state.clone()];
    if let Some(turning) = found.candidates.iter().find(is_it) {
        let mut without = turning.fit.state.clone();
        without.effects.retain(|a| a.effect.name() != TAKEN_FOR);
        asked.extend(best.filter(|best| best.effects != turning.effects).map(|_| turning.fit.state.clone()));
        asked.push(without);
    }
    let before = odds(problem, told);
    asked.iter().any(|state| odds(&banked, &settled(&banked, state)) > before + CLEARLY)
}

/// The problem with the tilt, and the effects that somebody asked for fitted to it, where these are told better so.
#[must_use]
pub fn tells_fit_better<'a>(problem: &Problem<'a>, with: &Fit) -> Option<(Problem<'a>, Fit)> {
    let banked = banked(problem)?;
    // From where they were: near a stall a start from nothing may end in a hollow.
    let with_tilt = settled(&banked, &with.state);
    (odds(&banked, &with_tilt) > odds(problem, with) + CLEARLY).then_some((banked, with_tilt))
}

/// The problem with lift that tilts, where it does not yet and the vehicle file does not say how far it does.
fn banked<'a>(problem: &Problem<'a>) -> Option<Problem<'a>> {
    let untold = problem.vehicle.constants.bank_tilt == 0.0 && !problem.branch.banked;
    untold.then(|| Problem { branch: Branch { banked: true, ..problem.branch }, ..problem.clone() })
}

/// Log evidence of a fit and the prior of its effects.
pub(crate) fn odds(problem: &Problem, fit: &Fit) -> f64 {
    log_evidence(problem, fit) + prior_of(fit.state.effects_in_all()).ln()
}

/// A fit that starts from a state, signatures taken anew on the way.
pub(crate) fn settled(problem: &Problem, state: &State) -> Fit {
    let from = |state: &State| fit_from(problem, state, Effort::of(ITERATIONS));
    from(&from(state).state)
}
