//! Names whose fit is unlike what they stand for: larger than it is anywhere, slower or faster than it happens, of every size where all
//! are alike. Then the name is that of the nearest thing in the catalogue, and what is missing has none.

use crate::hypotheses::candidate::{one_period_inside, size_at_end};
use crate::inference::estimate::{Estimate, estimate, estimates};
use crate::inference::gauss_newton::{Effort, Fit, fit_from};
use crate::inference::wave_train::{OF_NO_TRAIN, log_alike};
use crate::likelihood::Problem;
use hydro::effects::Active;

/// Share of a size at the end of what is possible below which its interval must not reach for it to be too large: 0.85 to 0.92 on
/// simulated flights with effects of no name, 0.48 and 0.71 on two where body–wing vortices were truly large and induced drag small.
const SURELY_AT_END: f64 = 0.78;
/// Powers of time within which growth on a hull raises the drag, beyond which an interval must lie: a guess. Drag that jumps once, where
/// something is caught or lost, looks like 0.35 to 0.5 if it does so before the middle; 58 simulated flights with growth of powers from
/// 0.75 to 1.4 had intervals that reached 0.8 and more, and 1.2 and less.
const GROWS_AS: [f64; 2] = [0.6, 1.8];
/// Fall of chi² that a wave needs to be surely beyond the periods of waves: what decides whether a name is said.
const SURELY_BEYOND: f64 = 8.0;
/// Steps of the fit of a wave one period further inside.
const STEPS: usize = 3;

/// Why what a fit names cannot be what it is called, where it cannot.
pub(crate) fn unlike(problem: &Problem, fit: &Fit) -> Vec<String> {
    let too_large = too_large(fit).map(|name| format!("{name} would have to be larger than it is anywhere"));
    let no_growth = no_growth(&estimates(fit))
        .then(|| "drag would have to grow by a jump, not day by day: something was caught, lost or broken".into());
    let no_wave = no_wave(problem, fit)
        .then(|| "the period of the wave would have to be shorter or longer than those of internal waves, 8 to 52 minutes".into());
    let no_train = log_alike(fit).is_some_and(|told| told < OF_NO_TRAIN).then(|| {
        "the wave would have to differ from segment to segment as no train of internal waves does: convection, eddies, or no water at all".into()
    });
    [too_large, no_growth, no_wave, no_train].into_iter().flatten().collect()
}

/// The effect of a fit whose size is at the end of what is possible and hardly below it by its interval: one that could as well be
/// half as large (a size that trades against the angle from which it acts) is not too large.
fn too_large(fit: &Fit) -> Option<&'static str> {
    let surely = |&(k, a): &(usize, &Active)| {
        let off = a.effect.parameters()[0].off;
        let reaches = |e: &Estimate| ((if e.value > off { e.low } else { e.high }) - off) / (e.value - off);
        let size = fit.sigma.iter().find(|s| (s.0, s.1) == (k, 0)).map(|s| estimate(fit, *s));
        size_at_end(a) && size.is_none_or(|e| reaches(&e) > SURELY_AT_END)
    };
    fit.state.effects.iter().enumerate().find(surely).map(|(_, a)| a.effect.name())
}

/// Whether growth on the hull would surely have to be no growth.
fn no_growth(estimates: &[Estimate]) -> bool {
    estimates.iter().any(|e| e.name == "biofouling_drag.power" && (e.high < GROWS_AS[0] || e.low > GROWS_AS[1]))
}

/// Whether a wave would surely rather have a shorter or a longer period than those that were tried.
fn no_wave(problem: &Problem, fit: &Fit) -> bool {
    let Some(period_s) = fit.state.wave.as_ref().and_then(|w| one_period_inside(w.kind.period_s)) else { return false };
    let mut inside = fit.state.clone();
    inside.wave.iter_mut().for_each(|w| w.kind.period_s = period_s);
    let inside = fit_from(problem, &inside, Effort::of(STEPS));
    !(inside.chi2 - fit.chi2 < SURELY_BEYOND)
}

#[cfg(test)]
mod tests {
    use super::no_growth;
    use crate::inference::estimate::Estimate;

    /// Something that a glider caught before the middle of its flight was called growth with the powers 0.35 and 0.42.
    #[test]
    fn regress_drag_that_jumps_is_no_growth_and_growth_that_settles_first_is() {
        let power = |low: f64, value: f64, high: f64| Estimate { name: "biofouling_drag.power".into(), value, low, high, unit: "1" };
        assert!(no_growth(&[power(0.30, 0.35, 0.46)]));
        assert!(no_growth(&[power(0.31, 0.42, 0.53)]));
        assert!(no_growth(&[power(1.9, 2.4, 2.9)]));
        // Of growth as others simulated it: settling first, and hardly known.
        for grown in [power(1.10, 1.19, 1.27), power(0.61, 0.79, 0.97), power(0.39, 0.72, 1.05), power(1.03, 1.64, 2.3)] {
            assert!(!no_growth(std::slice::from_ref(&grown)), "{grown:?}");
        }
        assert!(!no_growth(&[Estimate { name: "biofouling_drag.rate_per_day".into(), ..power(0.30, 0.35, 0.46) }]));
    }
}
