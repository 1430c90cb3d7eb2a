//! A diagnosis where a history of the vehicle decides: its class is the answer. Where it names none of its numbers, what the fits name
//! beyond them, or by a form that departs from the history, stands; else nothing departs.

use super::{Diagnosis, Ranked, Verdict};
use crate::history::flight::Said;
use crate::history::numbers::{ALL, NUMBERS};
use crate::history::structure::DEPARTURES;
use crate::inference::estimate::Estimate;

/// Whether an effect is nothing that a history has a column for: none of its numbers, no mirror of one, no form that may depart.
fn is_beyond(effect: &str) -> bool {
    ALL.iter().all(|n| n.effect != effect && n.mirror != Some(effect)) && DEPARTURES.iter().all(|d| d.effect != Some(effect))
}

impl Diagnosis {
    /// What the vehicle's history says takes the place of the answer, where the history judges.
    pub(super) fn take_history(&mut self, said: Option<Said>) {
        if let Some(said) = said.as_ref().filter(|s| s.decides()) {
            let departs = said.judgement.departs.and_then(|(d, _)| d.effect);
            let stands = |effect: &&'static str| is_beyond(effect) || departs == Some(*effect);
            let named_beyond = matches!(self.verdict, Verdict::Explained | Verdict::Ambiguous) && self.answer.iter().any(stands);
            if !(said.class().is_empty() && named_beyond) {
                self.answer_by(said);
            }
            self.parts.set_hidden((0..NUMBERS).map(|number| (ALL[number].effect, said.least_named(number))));
            self.parts.hidden.retain(|h| !self.answer.contains(&h.effect));
        }
        self.history = said;
    }

    /// The history, where its words are the answer.
    #[must_use]
    pub fn answered_by(&self) -> Option<&Said> {
        self.history.as_ref().filter(|said| said.decides() && (self.answer.is_empty() || !said.class().is_empty()))
    }

    fn answer_by(&mut self, said: &Said) {
        let class = said.class();
        self.verdict = match class.len() {
            0 if said.judgement.departs.is_some() => Verdict::Unexplained,
            0 => Verdict::Adequate,
            1 => Verdict::Explained,
            _ => Verdict::Ambiguous,
        };
        self.reasons.clear();
        self.equivalent = class.iter().map(|effect| vec![*effect]).collect();
        self.answer = class.first().copied().into_iter().collect();
        self.candidates.retain(|c| !self.equivalent.contains(&c.effects));
        let named: Vec<Ranked> = said.judgement.class.iter().map(|number| self.ranked(said, *number)).collect();
        self.candidates.splice(0..0, named);
    }

    /// A number of the class as a hypothesis. The errors of the whole flight are not fitted to it.
    fn ranked(&self, said: &Said, number: usize) -> Ranked {
        let (effect, parameter) = (ALL[number].effect, ALL[number].parameter());
        let [value, low, high] = said.size(number, said.judgement.alone[number]);
        let name = format!("{effect}.{}", parameter.name);
        let log_odds = said.judgement.ln_bayes[number];
        let all: f64 = said.judgement.ln_bayes.iter().map(|l| l.exp()).sum::<f64>() + 1.0;
        Ranked {
            effects: vec![effect],
            parameters: vec![Estimate { name, value, low, high, unit: parameter.unit }],
            error_fitted_m_s: f64::NAN,
            error_check_m_s: f64::NAN,
            probability: if all.is_finite() { log_odds.exp() / all } else { 1.0 },
            log_odds,
            gain: 2.0 * log_odds,
            state: self.recalibrated.clone(),
        }
    }
}
