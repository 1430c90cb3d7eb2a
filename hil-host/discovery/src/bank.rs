//! Does lift tilt out of the vertical plane as the vehicle banks?
//!
//! Geometry says so; the flight format's nominal model knows no roll. In turns of 15 to 20 degrees it takes 3 to 6 % of the lift,
//! which is no missing effect but looks like drag in turns, beside whatever else is missing. So where drag in turns is named, or
//! nearly is, the model with the tilt is asked whether it tells the flight better.

use crate::brink::Branch;
use crate::calibration::State;
use crate::evidence::{TIED, log_evidence};
use crate::fit::{Effort, Fit, Jacobian, fit};
use crate::problem::Problem;
use crate::screen::Candidate;
use crate::search::{Found, prior_of};

/// The name that a tilt goes by.
const TAKEN_FOR: &str = "roll_turn_drag";
/// Log odds that the tilt has to be ahead by: twenty to one.
const CLEARLY: f64 = 3.0;
/// Iterations of each fit.
const ITERATIONS: usize = 6;

/// Whether what was found is told better by lift that tilts with the roll; not asked where the vehicle file says how far it does.
#[must_use]
pub fn tells_better(problem: &Problem, found: &Found) -> bool {
    let Some(best) = found.candidates.first().filter(|c| c.log_odds > 0.0) else { return false };
    let is_it = |c: &&Candidate| c.effects.contains(&TAKEN_FOR) && best.log_odds - c.log_odds < TIED;
    let untold = problem.vehicle.constants.bank_tilt == 0.0;
    let Some(turning) = found.candidates.iter().find(is_it).filter(|_| untold) else { return false };
    let banked = Problem { branch: Branch { banked: true, ..problem.branch }, ..problem.clone() };
    let odds = |problem: &Problem, fit: &Fit| log_evidence(problem, fit) + prior_of(fit.state.effects_in_all()).ln();
    let settled = |state: &State| fit(&banked, &Jacobian::new(&banked, state), state, Effort::of(ITERATIONS));
    let again = |state: &State| odds(&banked, &settled(&settled(state).state));
    let mut without = turning.fit.state.clone();
    without.effects.retain(|a| a.effect.name() != TAKEN_FOR);
    again(&turning.fit.state).max(again(&without)) > odds(problem, &best.fit) + CLEARLY
}
