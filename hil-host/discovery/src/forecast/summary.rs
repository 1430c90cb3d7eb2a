//! How good the forecasts of a mission were, by thirds of it.

use super::mission::{Judged, Later};
use logs::record::plausible::quantile;
use serde::Serialize;

/// Misses are compared as if every passage took so long, s: they grow with time.
pub const COMPARED_S: f64 = 5.0 * 3600.0;

/// Median and 90 % quantile of misses, m, as if each passage took [`COMPARED_S`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Miss {
    /// Median.
    pub median_m: f64,
    /// 90 % are no larger.
    pub most_m: f64,
}

impl Miss {
    fn of(judged: &[Judged], miss_m: impl Fn(&Judged) -> f64) -> Self {
        Self::scaled(judged.iter().map(|j| (miss_m(j), j.time_s)))
    }

    fn scaled(misses: impl Iterator<Item = (f64, f64)>) -> Self {
        let scaled: Vec<f64> = misses.map(|(miss_m, time_s)| miss_m * COMPARED_S / time_s).collect();
        Self { median_m: quantile(&scaled, 0.5), most_m: quantile(&scaled, 0.9) }
    }
}

/// Forecasts of the surfacing 5 h ahead or more, over several known dives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ahead {
    /// Surfacings forecast.
    pub surfacings: usize,
    /// Inside the ellipse.
    pub inside: usize,
    /// The forecast.
    pub forecast: Miss,
    /// Velocity over ground of the passage before.
    pub persistence: Miss,
}

impl Ahead {
    /// Of forecasts; none of no forecast.
    #[must_use]
    pub fn of(later: &[Later]) -> Option<Self> {
        (!later.is_empty()).then(|| Self {
            surfacings: later.len(),
            inside: later.iter().filter(|l| l.held).count(),
            forecast: Miss::scaled(later.iter().map(|l| (l.miss_m, l.time_s))),
            persistence: Miss::scaled(later.iter().map(|l| (l.persistence_m, l.time_s))),
        })
    }
}

/// Forecasts of a stretch of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Surfacings forecast.
    pub surfacings: usize,
    /// Median time from fix to fix, h.
    pub hours: f64,
    /// Inside the learnt ellipse: plan known, passage before repeated; and inside the ellipse of the filters alone, plan known.
    pub inside: [usize; 2],
    /// See above.
    pub inside_unlearnt: usize,
    /// Median of the ellipse's mean half axis, m, by plan.
    pub radius_m: [f64; 2],
    /// Forecast with the plan known, and with the passage before repeated.
    pub forecast: [Miss; 2],
    /// The passage's own flight with the current of the passage before.
    pub last_current: Miss,
    /// Velocity over ground of the passage before.
    pub persistence: Miss,
}

impl Summary {
    /// Of forecasts; none of no forecast.
    #[must_use]
    pub fn of(judged: &[Judged]) -> Option<Self> {
        let median = |of: &dyn Fn(&Judged) -> f64| quantile(&judged.iter().map(of).collect::<Vec<_>>(), 0.5);
        let count = |of: &dyn Fn(&Judged) -> bool| judged.iter().filter(|j| of(j)).count();
        (!judged.is_empty()).then(|| Self {
            surfacings: judged.len(),
            hours: median(&|j| j.time_s / 3600.0),
            inside: [0, 1].map(|k| count(&|j| j.held[k])),
            inside_unlearnt: count(&|j| j.held_unlearnt),
            radius_m: [0, 1].map(|k| median(&|j| j.radius_m[k])),
            forecast: [0, 1].map(|k| Miss::of(judged, |j| j.miss_m[k])),
            last_current: Miss::of(judged, |j| j.last_current_m),
            persistence: Miss::of(judged, |j| j.persistence_m),
        })
    }

    /// Of the whole mission, and of its thirds.
    #[must_use]
    pub fn thirds(judged: &[Judged]) -> Option<[Self; 4]> {
        let at = |k: usize| k * judged.len() / 3;
        let third = |k: usize| Self::of(&judged[at(k)..at(k + 1)]);
        Some([Self::of(judged)?, third(0)?, third(1)?, third(2)?])
    }
}
