//! How much the form of a named effect may be another than ours.
//!
//! Nature's law is never quite the one that is fitted, and a second effect can mend that. So an effect is allowed to act somewhat
//! more or less by depth, time, speed, angle of attack, roll, and on the way down than up; what the flight wants of that beside one
//! hypothesis and no more beside another is no reason to name a second effect.

use crate::hypotheses::candidate::{Candidate, has_guessed_form};
use crate::hypotheses::sensitivity::Offer;
use crate::inference::evidence::{TIED, log_mean_exp};
use crate::inference::gauss_newton::Fit;
use crate::likelihood::{Column, Problem};

/// Share of a single effect's log odds that its form may be wrong by, and the log odds up to which: a guess, seen to hold for the forms
/// that others gave nature.
const FORM_SHARE: f64 = 0.02;
const FORM_MOST: f64 = 10.0;
/// However strong an effect is, a form that differs from nature's by 2.2 % leaves the square of that of what it explains.
const FORM_LEAVES: f64 = 0.0005;

/// By how much of itself the effect may act more or less, 1 sigma (guess).
const SHARES: [f64; 3] = [0.03, 0.1, 0.3];
/// Share of its size that its action is differenced over.
const STEP: f64 = 0.1;
/// Largest deviation of a variable from its mean, in mean deviations.
const FURTHEST: f64 = 3.0;

/// Forms of nature differ a little from ours, and one effect more can mend that: it must be worth more than the difference, or what a
/// free form of the others leaves of it. A number that is wrong has no form to mend. `beside` are smaller sets that are marked already;
/// their fits may be of other rows.
pub(crate) fn mark_down_larger_sets(problem: &Problem, found: &mut [Candidate], beside: &[Candidate]) {
    let top = found.iter().chain(beside).map(|c| c.log_odds).fold(0.0, f64::max);
    let best_part = |of: &'_ [Candidate], c: &Candidate| {
        let parts = of.iter().enumerate().filter(|(_, s)| c.adds_one_to(s) && s.effects.iter().any(|e| has_guessed_form(e)));
        parts.map(|(k, s)| (k, s.log_odds)).max_by(|a, b| a.1.total_cmp(&b.1)).filter(|part| part.1 > 0.0)
    };
    let margin = |c: &Candidate| {
        let fresh = best_part(found, c);
        let first = fresh.into_iter().chain(best_part(beside, c)).map(|part| part.1).fold(0.0, f64::max);
        let most = (FORM_SHARE * first).min(FORM_MOST).max(FORM_LEAVES * first);
        let asked = fresh.filter(|part| part.1 == first && c.log_odds > top - TIED);
        let explained = asked.and_then(|part| explains(problem, &found[part.0].fit, &c.fit));
        explained.map_or(most, |explained| explained.clamp(0.0, most))
    };
    let margins: Vec<f64> = found.iter().map(margin).collect();
    for (c, margin) in found.iter_mut().zip(margins) {
        c.log_odds -= margin;
    }
}

/// Log Bayes factor by which a `part` of a hypothesis wants other forms of its effects more than the `whole` does: what the rest of
/// the whole explains that another form would too. None where nothing in the part has a form that is a guess, or has one that cannot be
/// asked: a wave follows anything slow, and a stall does not act more the larger its angle is.
#[must_use]
fn explains(problem: &Problem, part: &Fit, whole: &Fit) -> Option<f64> {
    let effects = &part.state.effects;
    let bent: Vec<&str> = effects.iter().map(|a| a.effect.name()).filter(|e| has_guessed_form(e)).collect();
    if bent.is_empty() || bent.contains(&"stall") || whole.state.wave.is_some() {
        return None;
    }
    Some(log_bayes(problem, part, &bent)? - log_bayes(problem, whole, &bent)?)
}

/// Log Bayes factor of free forms of these effects against the forms that are fitted; none where the fit has no curvature.
fn log_bayes(problem: &Problem, fit: &Fit, bent: &[&str]) -> Option<f64> {
    let ground = fit.ground()?;
    let whole = problem.fitted_tracks(&fit.state);
    let mut columns: Vec<Column> = Vec::new();
    for k in (0..fit.state.effects.len()).filter(|&k| bent.contains(&fit.state.effects[k].effect.name())) {
        let mut less = fit.state.clone();
        let off = less.effects[k].effect.parameters()[0].off;
        less.effects[k].values[0] -= STEP * (less.effects[k].values[0] - off);
        let less = problem.fitted_tracks(&less);
        let acts = |run: usize, row: usize| (whole[run].sink_m_s[row] - less[run].sink_m_s[row]) / STEP;
        let by: [&dyn Fn(usize, usize) -> f64; 6] = [
            &|run, row| whole[run].depth_m[row],
            &|run, row| problem.runs[run].time_s[row],
            &|run, row| whole[run].speed_m_s[row],
            &|run, row| whole[run].alpha_rad[row].abs(),
            &|run, row| roll_rad(problem, run, row).abs(),
            &|run, row| whole[run].sink_m_s[row].signum(),
        ];
        for variable in by {
            let (mean, deviation) = spread(problem, variable);
            if deviation > 0.0 {
                let away = |run: usize, row: usize| ((variable(run, row) - mean) / deviation).clamp(-FURTHEST, FURTHEST);
                columns.push(problem.rate_column(&|run, row| acts(run, row) * away(run, row)));
            }
        }
    }
    let offer = Offer::new(&columns, &ground);
    Some(log_mean_exp(&SHARES.map(|share| offer.log_bayes(share))))
}

fn roll_rad(problem: &Problem, k: usize, row: usize) -> f64 {
    problem.runs[k].input_at_row(row, 0.0).roll_rad
}

/// Mean and mean deviation of a variable over all rows.
fn spread(problem: &Problem, of: &dyn Fn(usize, usize) -> f64) -> (f64, f64) {
    let rows = || (0..problem.runs.len()).flat_map(|k| (0..problem.runs[k].time_s.len()).map(move |row| (k, row)));
    let count = rows().count() as f64;
    let mean = rows().map(|(k, row)| of(k, row)).sum::<f64>() / count;
    let deviation = rows().map(|(k, row)| (of(k, row) - mean).abs()).sum::<f64>() / count;
    (mean, if deviation.is_finite() { deviation } else { 0.0 })
}
