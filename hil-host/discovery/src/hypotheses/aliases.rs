//! Effects that do the same as a member of a hypothesis: what one explains the other does, so both are fitted from the same place.
//!
//! A fit rests where its own way has led it, some units of chi² above where another way leads. Of two effects with one signature that
//! would make one a culprit and leave the other unnamed.

use crate::hypotheses::candidate::{Candidate, Screen, named};
use crate::hypotheses::search::prior_of;
use crate::hypotheses::sensitivity::{Signature, signatures};
use crate::inference::gauss_newton::Fit;

/// Cosine of signatures from which two effects do the same.
const TWINS: f64 = 0.99;
/// The same where nothing else is missing, from which it is worth asking.
const ALIKE: f64 = 0.9;

/// What does the same as the best hypothesis is as likely, wherever it was found before: it is fitted again from where that one is.
pub(crate) fn level_twins(screen: &Screen, contenders: &mut Vec<Candidate>, others: &mut Vec<Candidate>, likeness: &[(&str, &str, f64)]) {
    let best = contenders.iter().filter(|c| c.fit.state.wave.is_none()).max_by(|a, b| a.log_odds.total_cmp(&b.log_odds)).cloned();
    let Some(best) = best else { return };
    let has_alike = |effect: &str| likeness.iter().any(|(a, b, cos)| (*a == effect || *b == effect) && cos.abs() > ALIKE);
    for given in (0..best.fit.state.effects.len()).filter(|&k| has_alike(best.fit.state.effects[k].effect.name())) {
        for f in twins(screen, &best, given) {
            let effects = named(&f.state);
            let twin = screen.candidate(f, prior_of(effects.len()), best.correction);
            if contenders.iter().any(|c| c.is(&effects) && c.fit.chi2 <= twin.fit.chi2) {
                continue;
            }
            for list in [&mut *contenders, &mut *others] {
                list.retain(|c| !c.is(&effects));
            }
            contenders.push(twin);
        }
    }
}

/// A hypothesis with one of its effects exchanged for each that does the same there, fitted from where it is.
pub(crate) fn twins(screen: &Screen, of: &Candidate, given: usize) -> Vec<Fit> {
    let mut alone = of.fit.state.clone();
    let given = alone.effects.remove(given);
    let signs = signatures(screen.problem, &alone, None);
    let Some(own) = signs.iter().find(|s| s.effect.name() == given.effect.name()) else { return Vec::new() };
    let size = given.values[0] - given.effect.parameters()[0].off;
    let is_other = |s: &&Signature| of.fit.state.effects.iter().all(|a| a.effect.name() != s.effect.name());
    let mut fits = Vec::new();
    for other in signs.iter().filter(is_other) {
        let (both, of_other) = (own.column.dot(&other.column), other.column.dot(&other.column));
        if both.abs() < TWINS * (own.column.dot(&own.column) * of_other).sqrt() {
            continue;
        }
        let (low, high) = screen.problem.size_limits(other.effect);
        let as_large = (other.effect.parameters()[0].off + size * both / of_other).clamp(low, high);
        let mut state = alone.clone();
        state.effects.push(screen.problem.active(other.effect, as_large));
        fits.push(screen.fit(screen.beside(Some(of)), &state, 6));
    }
    fits
}
