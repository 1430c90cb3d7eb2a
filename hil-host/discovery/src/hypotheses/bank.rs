//! What does the vehicle do as it banks?
//!
//! The flight format's nominal model knows no roll. By geometry lift tilts out of the vertical plane, 3 to 6 % of it in turns of 15 to 20
//! degrees; and a body in a turn without sideslip has its nose's lead over the path out of that plane too, and carries its added mass
//! round, which pulls as a tenth more drag does. Neither is a missing effect, but both look like drag in turns, beside whatever else is
//! missing. So a model with the tilt, and one with the whole turn, are asked whether they tell the flight better: beside what is named or
//! beside nothing, and in the place of drag in turns where that is named or nearly is.

use crate::hypotheses::candidate::Candidate;
use crate::hypotheses::search::{Found, prior_of};
use crate::hypotheses::sensitivity::Offer;
use crate::inference::evidence::{TIED, log_evidence};
use crate::inference::gauss_newton::{Effort, Fit, fit_from};
use crate::likelihood::{Column, Problem};
use crate::model::branch::{Bank, Branch};
use crate::model::parameters::State;
use hydro::effects::Active;

/// The name that a bank goes by.
const TAKEN_FOR: &str = "roll_turn_drag";
/// Log odds that what a bank does, or what else every body does, has to be ahead by: twenty to one.
pub(crate) const CLEARLY: f64 = 3.0;
/// The same for a drag in turns that is hardly as large as what a turn does to every body (a tenth more drag at 17 degrees of roll is 0.13
/// per squared radian): a body that slips does not turn quite as any of ours. A guess; in two clean flights that another author
/// simulated 0.03 of it, beside lift that tilts, was 4 and 9 ahead of a turn without it.
const HARDLY_MORE: f64 = 10.0;
const LITTLE_PER_RAD2: f64 = 0.1;
/// Least and largest share of a turn without sideslip that is one: a hull that slips turns less (0.75 where its side force is 2.6 per
/// radian on the wings' area), and a share is known to a fifth at best.
const SHARES: (f64, f64) = (0.4, 1.2);
/// Iterations of each fit.
const ITERATIONS: usize = 6;

/// What tells what was found, or that nothing is missing, better than a model that knows no bank; not asked where the vehicle file says
/// what it does.
#[must_use]
pub fn told(problem: &Problem, found: &Found) -> Option<Bank> {
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
    // What every body does comes before a name: without the name it need not be ahead.
    let names = |state: &State| state.effects.iter().any(|a| a.effect.name() == TAKEN_FOR);
    let is_little = |a: &Active| a.effect.name() == TAKEN_FOR && a.values[0].abs() < LITTLE_PER_RAD2;
    let worth = if told.state.effects.iter().any(is_little) { HARDLY_MORE } else { CLEARLY };
    let spared = |state: &State| if names(&told.state) && !names(state) { worth } else { 0.0 };
    let of =
        |state: &State| banked(problem, state).iter().map(|(p, fit)| (odds(p, fit) + spared(state), p.branch.bank)).collect::<Vec<_>>();
    let best = asked.iter().flat_map(of).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|best| best.0 > before + CLEARLY).map(|best| best.1)
}

/// The problem with what tells best of a bank, and the effects that somebody asked for fitted to it, where these are told better so.
#[must_use]
pub fn tells_fit_better<'a>(problem: &Problem<'a>, with: &Fit) -> Option<(Problem<'a>, Fit)> {
    // From where they were: near a stall a start from nothing may end in a hollow.
    let (banked, fit) = banked(problem, &with.state).into_iter().max_by(|a, b| odds(&a.0, &a.1).total_cmp(&odds(&b.0, &b.1)))?;
    (odds(&banked, &fit) > odds(problem, with) + CLEARLY).then_some((banked, fit))
}

/// The problem with each model that knows of a bank otherwise than now, and the fit to it from a state; none where the vehicle file says
/// what a bank does.
fn banked<'a>(problem: &Problem<'a>, state: &State) -> Vec<(Problem<'a>, Fit)> {
    let constants = &problem.vehicle.constants;
    if constants.bank_tilt != 0.0 || constants.banked_turn != 0.0 {
        return Vec::new();
    }
    let with = |bank: Bank| Problem { branch: Branch { bank, ..problem.branch }, ..problem.clone() };
    let level = with(Bank::Level);
    let turn = turned(&level, &settled(&level, state)).map(Bank::Turn);
    let others = std::iter::once(Bank::Tilt).chain(turn).filter(|bank| *bank != problem.branch.bank);
    others
        .map(|bank| {
            let banked = with(bank);
            let fit = settled(&banked, state);
            (banked, fit)
        })
        .collect()
}

/// The share of a turn that linear theory has beside a fit that knows no bank; none where it is not that of a turn.
fn turned(level: &Problem, fit: &Fit) -> Option<f64> {
    let turn = Problem { branch: Branch { bank: Bank::Turn(1.0), ..level.branch }, ..level.clone() };
    let (share, _) = linear_share(level, &turn, 1.0, fit)?;
    (share > SHARES.0).then(|| share.min(SHARES.1))
}

/// How much of what another problem has more linear theory wants beside a fit, and by how much log likelihood grows with it; the other
/// has `step` of it.
pub(crate) fn linear_share(problem: &Problem, other: &Problem, step: f64, fit: &Fit) -> Option<(f64, f64)> {
    let model = |problem: &Problem| problem.models(std::slice::from_ref(&fit.state)).remove(0);
    let values = model(other).iter().zip(&model(problem)).map(|(a, b)| (a - b) / step).collect();
    let offer = Offer::new(&[Column { from: 0, values }], &fit.ground()?);
    let share = offer.match_[0] / offer.gram()[(0, 0)];
    Some((share, 0.5 * offer.match_[0] * share))
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
