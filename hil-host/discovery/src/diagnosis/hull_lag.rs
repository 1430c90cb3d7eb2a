//! Does the hull follow the water's temperature late?
//!
//! Every hull does, by some seconds to half a minute; the flight format's nominal hull is as warm as the water. Through a thermocline
//! that moves the trim by cubic centimetres, which is no missing effect but looks like one that follows the temperature. So the model
//! with a late hull is asked whether it tells the flight better, beside what leads and beside nothing. A lag of minutes is none of a
//! hull's and stays unexplained.

use crate::criticism::residual_tests::{Family, families};
use crate::hypotheses::bank::{CLEARLY, linear_share, odds, settled};
use crate::hypotheses::search::Found;
use crate::inference::gauss_newton::Fit;
use crate::likelihood::Problem;
use crate::model::branch::Branch;

/// The name that a lag goes by.
const TAKEN_FOR: &str = "thermal_expansion";
/// What a late hull looks like when it is asked as something unknown.
const KIN: [&str; 2] = ["temperature some time ago (trim)", "density some time ago (trim)"];
/// Share of the expansion that signatures are differenced over: a lag of six seconds.
const STEP: f64 = 0.2;
/// Least and largest shares that are a hull's: lags of 2 and 50 s. Linear theory has 1.4 for a hull of half a minute.
const SHARES: (f64, f64) = (0.07, 1.6);

/// What a flight is said to show where the hull is late.
pub const NOTE: &str = "the hull follows the water's temperature late here, as bodies do and the nominal model does not (hull_lag_share of the vehicle file; 1 is half a minute)";

/// Share of the hull's expansion that follows late, if that tells better what was found, or tells it without what was found; not asked
/// where the vehicle file says it.
#[must_use]
pub fn told(problem: &Problem, found: &Found) -> Option<f64> {
    let best = found.candidates.first().filter(|c| c.log_odds > 0.0).map(|c| &c.fit);
    let before = best.map_or(f64::NEG_INFINITY, |fit| odds(problem, fit)).max(odds(problem, &found.null));
    // A lag is taken for an expansion too: asked without one, too.
    let expanding = best.filter(|fit| fit.state.effects.iter().any(|a| a.effect.name() == TAKEN_FOR));
    let without = expanding.map(|fit| {
        let mut state = fit.state.clone();
        state.effects.retain(|a| a.effect.name() != TAKEN_FOR);
        settled(problem, &state)
    });
    let asked = best.into_iter().chain(&without).chain([&found.null]);
    let told = asked.filter_map(|fit| beside(problem, fit).map(|late| (odds(&late.0, &late.1), late.0.branch.hull_lag_share, fit)));
    let (after, share, fit) = told.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if !(after > before + CLEARLY) {
        return None;
    }
    // A pump that is late, or air that pressure shrinks, moves the trim near the thermocline too: what tells more than the hull does is
    // left to be unknown.
    let gained = after - odds(problem, fit);
    let is_kin = |f: &Family| KIN.contains(&f.variable);
    let others = families(problem, &[(fit, gained)]).concat();
    others.iter().all(|f| is_kin(f) || f.log_bayes < gained).then_some(share)
}

/// The problem with a late hull, and the effects that somebody asked for fitted to it, where these are told better so.
#[must_use]
pub fn tells_fit_better<'a>(problem: &Problem<'a>, with: &Fit) -> Option<(Problem<'a>, Fit)> {
    beside(problem, with).filter(|(late, fit)| odds(late, fit) > odds(problem, with) + CLEARLY)
}

/// The problem with the lag that linear theory has beside a fit, and the fit to it; none where the lag is no hull's or gains too little.
fn beside<'a>(problem: &Problem<'a>, fit: &Fit) -> Option<(Problem<'a>, Fit)> {
    let constants = &problem.vehicle.constants;
    let untold = constants.hull_lag_share == 0.0 && problem.branch.hull_lag_share == 0.0 && constants.thermal_expansion_per_k != 0.0;
    let late = |share: f64| Problem { branch: Branch { hull_lag_share: share, ..problem.branch }, ..problem.clone() };
    if !untold {
        return None;
    }
    let (share, promised) = linear_share(problem, &late(STEP), STEP, fit)?;
    if !(promised > CLEARLY && (SHARES.0..=SHARES.1).contains(&share)) {
        return None;
    }
    let late = late(share);
    let fit = settled(&late, &fit.state);
    Some((late, fit))
}
