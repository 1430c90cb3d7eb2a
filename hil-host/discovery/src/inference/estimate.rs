//! Parameters of the effects of a fit, with their 90 % intervals.

use crate::inference::posterior::Fit;
use crate::model::parameters::NINETY;
use hydro::effects::WAVE;

/// By how much of itself a size is uncertain because nature's form is not ours; guess from simulated flights.
const FORM: f64 = 0.05;
/// One parameter with its 90 % interval.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// `effect.parameter`.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit.
    pub unit: &'static str,
}

/// One free number of an effect of a fit, by its effect, its parameter and its uncertainty.
pub(crate) fn estimate(fit: &Fit, (effect, parameter, sigma): (usize, usize, f64)) -> Estimate {
    let a = &fit.state.effects[effect];
    let p = &a.effect.parameters[parameter];
    let value = a.values[parameter];
    let sigma = if parameter == 0 { sigma.hypot(FORM * value) } else { sigma };
    Estimate {
        name: format!("{}.{}", a.effect.name, p.name),
        value,
        // Beyond its bounds the parameter means nothing.
        low: (value - NINETY * sigma).max(p.low.min(value)),
        high: (value + NINETY * sigma).min(p.high.max(value)),
        unit: p.unit,
    }
}

/// Parameters of the effects of a fit with 90 % intervals.
#[must_use]
pub fn estimates(fit: &Fit) -> Vec<Estimate> {
    let mut out: Vec<Estimate> = fit.sigma.iter().map(|s| estimate(fit, *s)).collect();
    if let Some(w) = &fit.state.wave {
        let runs = w.amplitude_m_s.len() as f64;
        let (mut power, mut variance) = (0.0, 0.0);
        for ([a, b], v) in fit.wave_amplitudes() {
            power += (a * a + b * b + v) / runs;
            variance += v / runs;
        }
        let amplitude = power.sqrt();
        let sigma = (0.5 * variance / runs).sqrt();
        let name = |p: &str| format!("{WAVE}.{p}");
        out.push(Estimate {
            name: name("amplitude_m_s"),
            value: amplitude,
            low: (amplitude - NINETY * sigma).max(0.0),
            high: amplitude + NINETY * sigma,
            unit: "m/s",
        });
        let spread = w.kind.period_s * 0.12;
        out.push(Estimate {
            name: name("period_s"),
            value: w.kind.period_s,
            low: w.kind.period_s - spread,
            high: w.kind.period_s + spread,
            unit: "s",
        });
        let mode = f64::from(w.kind.mode);
        out.push(Estimate { name: name("mode"), value: mode, low: mode, high: mode, unit: "1" });
    }
    out
}
