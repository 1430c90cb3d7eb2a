//! Effects outside the catalogue, in the same table as the named ones.
//!
//! For each covariate the best hypothesis, or nothing, with an unknown effect that follows it: its log odds are those of what it is beside
//! and the log Bayes factor of [`crate::criticism::residual_tests::families`]. It is as probable before the flight as a name is.

use crate::criticism::residual_tests::{Family, families};
use crate::diagnosis::verdict::Unknown;
use crate::hypotheses::candidate::Candidate;
use crate::hypotheses::search::{Found, prior_of};
use crate::inference::evidence::log_evidence;
use crate::inference::gauss_newton::{Fit, beyond_limits};
use crate::likelihood::Problem;
use crate::model::internal_wave::ordinary_amplitude_m_s;
use hydro::effects::WAVE;

/// Log Bayes factor that an unknown effect beside the best hypothesis needs.
const REMAINS: f64 = 9.0;
/// And its share of what the best hypothesis explained: forms of nature differ from ours by that much.
const REMAINS_SHARE: f64 = 0.12;
/// Or a mean square of innovations (1 for noise) that no difference of form explains.
const REMAINS_MISFIT: f64 = 1.3;
/// Share of the explained misfit that a difference of form may leave; a wave is never quite a sine.
const FORM_MISFIT: f64 = 0.02;
const FORM_MISFIT_WAVE: f64 = 0.1;
/// Log Bayes factor from which an unknown effect may tell the story better than any name does.
const TELLS: f64 = 6.0;
/// What it must be better by than the best name: log odds, and share of them. On simulated flights the right name is ahead by 3 and
/// more; a hypothesis with a wave by 20, and a wrong one with a wave, which follows anything slow, by 7 at most.
const HANDICAP: f64 = 1.0;
const HANDICAP_WAVE: f64 = -10.0;
const SHARE: f64 = 0.01;

/// What was found of effects outside the catalogue.
pub(crate) struct Unknowns {
    /// One that is likelier than the best name, or than nothing missing.
    pub leads: Option<Unknown>,
    /// One that remains beside the best.
    pub remains: Option<Unknown>,
    /// All that were asked, the best teller first.
    pub remainder: Vec<Family>,
    /// Mean square of innovations that a difference of form forgives.
    pub forgiven: f64,
}

/// Asks for effects outside the catalogue beside the best hypothesis, beside nothing, and beside the best single effect.
pub(crate) fn unknowns(problem: &Problem, found: &Found, named: Option<&Candidate>) -> Unknowns {
    let Found { null, candidates, .. } = found;
    // Asked beside calibrations that deviate as they like: what those can follow is no effect.
    let relaxed = |f: &Fit| {
        let free = beyond_limits(problem, f);
        let gained = log_evidence(problem, &free) - log_evidence(problem, f);
        (free, gained)
    };
    let waves = named.is_some_and(|c| c.effects.contains(&WAVE));
    // Ordinary water motion may have a period; and a wave that is not quite a sine leaves some of itself.
    let ordinary = ordinary_amplitude_m_s(problem.vehicle);
    let counts = |f: &&Family| !f.may_be_water() || (!waves && f.scale_m_s.is_some_and(|amplitude| amplitude > ordinary));
    let (free, head_start) = relaxed(null);
    let explained = named.map_or(0.0, |c| 0.5 * (free.chi2 - c.fit.chi2).max(0.0));
    let best_fit = named.map_or(null, |c| &c.fit);
    let misfit = best_fit.mean_square();
    // The larger what is explained, the more its form may differ from nature's: a wave's most of all.
    let form = if waves { FORM_MISFIT_WAVE } else { FORM_MISFIT };
    let forgiven = REMAINS_MISFIT + form * 2.0 * explained / problem.data.len().max(1) as f64;
    let handicap = if waves { HANDICAP_WAVE } else { HANDICAP };
    let (free_best, gained_best) = named.map_or_else(|| (free.clone(), head_start), |c| relaxed(&c.fit));
    let to_beat =
        |share: f64, odds: f64, least: f64| named.map_or(f64::INFINITY, |c| c.log_odds * (1.0 + share) + handicap - odds).max(least);
    let remains = REMAINS.max(if misfit > forgiven { 0.0 } else { REMAINS_SHARE / (1.0 - REMAINS_SHARE) * explained });
    let alone = named.filter(|c| c.effects.len() == 1 && !waves);
    // Beside the best hypothesis itself the question is what remains, and asks for as much.
    let decides = alone.map_or(remains, |c| remains.min(to_beat(SHARE, c.log_odds + gained_best, REMAINS)));
    let single = named.and_then(|_| candidates.iter().find(|c| c.effects.len() == 1 && !c.effects.contains(&WAVE)));
    let apart = single.filter(|c| !named.is_some_and(|best| std::ptr::eq(*c, best))).map(|c| {
        let (fit, gained) = relaxed(&c.fit);
        // An unknown effect beside a name is a second thing missing, as a second name would be.
        (fit, c.log_odds + gained + (prior_of(2) / prior_of(1)).ln())
    });
    // Each fit with what decides there, and the log odds of what is told beside it and the least it has to be told with.
    let best_too = single.filter(|_| apart.is_none()).map(|c| (c.log_odds + gained_best, REMAINS));
    let mut beside = vec![(&free_best, decides, best_too)];
    if named.is_some() {
        let others = std::iter::once((&free, head_start)).chain(apart.iter().map(|(fit, odds)| (fit, *odds)));
        beside.extend(others.map(|(fit, odds)| (fit, to_beat(SHARE, odds, TELLS), Some((odds, TELLS)))));
    }
    let found = families(problem, &beside.iter().map(|(fit, decides, _)| (*fit, *decides)).collect::<Vec<_>>());
    let after_best = &found[0];
    let ahead = |of: &Family, ahead: f64| Unknown { variable: of.variable, ahead };
    let strongest = after_best.iter().filter(counts).max_by(|a, b| a.log_bayes.total_cmp(&b.log_bayes));
    let left_over = strongest.filter(|f| f.log_bayes > remains).map(|f| ahead(f, f.log_bayes));
    let mut tellers: Vec<(f64, &Family)> = Vec::new();
    for (left, (.., told)) in found.iter().zip(&beside) {
        let Some((odds, least)) = *told else { continue };
        // A depth rate of its own, by leg or depth, mends any law a little; what acts through trim or pitch is a cause.
        let share = |f: &Family| if f.scale_m_s.is_some() { REMAINS_SHARE } else { SHARE };
        let tells = |f: &&Family| !f.may_be_water() && f.log_bayes > to_beat(share(f), odds, least);
        tellers.extend(left.iter().filter(tells).map(|f| (odds + f.log_bayes, f)));
    }
    tellers.sort_by(|a, b| b.0.total_cmp(&a.0));
    let leads = tellers.first().map(|(odds, f)| ahead(f, odds - named.map_or(0.0, |c| c.log_odds)));
    let mut remainder: Vec<Family> = Vec::new();
    for f in tellers.into_iter().map(|t| t.1).chain(after_best) {
        if !remainder.iter().any(|r| (r.variable, r.period_s) == (f.variable, f.period_s)) {
            remainder.push(f.clone());
        }
    }
    Unknowns { leads, remains: left_over, remainder, forgiven }
}
