//! Effects outside the catalogue, in the same table as the named ones.
//!
//! Given nothing missing, given the best hypothesis and given the best single effect, an unknown effect for each variable: its log odds
//! are those of what it is added to, the log Bayes factor of [`crate::criticism::residual_tests::families`], and what one effect more costs.

use crate::ablation::is_on;
use crate::criticism::residual_tests::{Family, families};
use crate::diagnosis::verdict::Unknown;
use crate::hypotheses::candidate::Candidate;
use crate::hypotheses::search::{SearchResult, prior_of};
use crate::inference::evidence::SPEAK_UP;
use crate::inference::posterior::Fit;
use crate::likelihood::Problem;
use logs::vehicle::catalogue;

/// How much rarer what has no name is than what has one: one flight in seven; a guess.
const UNKNOWN: f64 = 0.15;
/// Variables that are asked, all as probable.
const VARIABLES_ASKED: f64 = 24.0;

/// What was found of effects outside the catalogue.
pub(crate) struct Unknowns {
    /// One that is likelier than the best name, or than nothing missing.
    pub leads: Option<Unknown>,
    /// All that were asked given the best hypothesis; one that leads comes first.
    pub remainder: Vec<Family>,
}

/// Asks for effects outside the catalogue. One leads that is ahead of the best name, or of nothing missing, by what naming asks.
pub(crate) fn unknowns(problem: &Problem, found: &SearchResult, named: Option<&Candidate>) -> Unknowns {
    let best = named.map_or(0.0, |c| c.log_odds);
    let one_more = |effects: usize| (prior_of(effects + 1) / prior_of(effects)).ln();
    let of = |c: &Candidate| c.log_odds + one_more(c.effects.len());
    let single = found.candidates.iter().find(|c| c.effects.len() == 1).filter(|c| !named.is_some_and(|best| std::ptr::eq(*c, best)));
    let mut fits: Vec<(&Fit, f64)> = vec![(named.map_or(&found.null, |c| &c.fit), named.map_or(one_more(0), of))];
    if named.is_some() {
        fits.push((&found.null, one_more(0)));
        fits.extend(single.map(|c| (&c.fit, of(c))));
    }
    fits.iter_mut().for_each(|(_, odds)| *odds += (UNKNOWN * catalogue::all().count() as f64 / VARIABLES_ASKED).ln());
    let asked = families(problem, &fits.iter().map(|(fit, odds)| (*fit, best + SPEAK_UP - odds)).collect::<Vec<_>>());
    let ahead = |(odds, family): (f64, &Family)| odds + family.log_bayes - best;
    let larger = |a: &(f64, &Family), b: &(f64, &Family)| ahead(*a).total_cmp(&ahead(*b));
    let best_of = |at: usize, wanted: &dyn Fn(&Family) -> bool| {
        let competes = |f: &&Family| is_on("unknown") && !f.may_be_water() && wanted(f);
        asked[at].iter().filter(competes).map(|f| (fits[at].1, f)).max_by(larger)
    };
    // A velocity of its own describes any effect, the named ones too: it can say what the best leaves. What acts through the
    // inputs is a cause, and may stand in the place of a name.
    let added = best_of(0, &|_| true);
    let cause = (1..fits.len()).filter_map(|at| best_of(at, &|f| f.scale_m_s.is_none())).max_by(larger);
    let leader = added.into_iter().chain(cause).max_by(larger).filter(|l| ahead(*l) > SPEAK_UP);
    let mut remainder: Vec<Family> = leader.map(|(_, f)| f.clone()).into_iter().collect();
    for f in &asked[0] {
        if !remainder.iter().any(|r| (r.variable, r.period_s) == (f.variable, f.period_s)) {
            remainder.push(f.clone());
        }
    }
    Unknowns { leads: leader.map(|l| Unknown { variable: l.1.variable, ahead: ahead(l) }), remainder }
}
