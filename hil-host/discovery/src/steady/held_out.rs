//! Which effects of the steady glide does another flight ask for?
//!
//! A ladder trusts the order of its steps, and effects cancel: the true density alone raises the error until the hull's
//! compressibility is there too. Here every set of effects is fitted to one flight and judged on the other, leg by leg. Of the sets
//! that are not told apart from the best the smallest is named, and those as small beside it.
//!
//! The values come from the first flight alone. Which set is named is chosen on the second, so its error is a little flattered by
//! the choice among eight, and by nothing else.

use hydro::effects::{Effect, HULL_COMPRESSIBILITY, PITCH_OFFSET, THERMAL_EXPANSION};
use nalgebra::DVector;
use serde::Serialize;

use super::fit::{Channels, Parameter, fit, residuals};
use super::glide::GlideModel;
use super::ladder::{Rung, Step, ladder, rms_cm_s};
use super::report::SteadyError;
use super::samples::SteadySamples;
use logs::record::flight::Flight;

/// Effects that are asked, as the catalogue knows them.
static EFFECTS: [(Parameter, &Effect); 3] = [
    (Parameter::Compressibility, &HULL_COMPRESSIBILITY),
    (Parameter::ThermalExpansion, &THERMAL_EXPANSION),
    (Parameter::PitchOffset, &PITCH_OFFSET),
];
/// A leg ends where the samples change direction or stop for this long, s.
const LEG_GAP_S: f64 = 120.0;
/// Legs with fewer samples say little of their own.
const FEWEST_SAMPLES: usize = 10;
/// Fewest legs that a verdict is given on.
const FEWEST_LEGS: usize = 6;
/// Mean rise of the squared error over the legs, in its standard errors, from which a set is worse: one-sided 1 % with nine degrees
/// of freedom (Student's t).
const WORSE_T: f64 = 2.8;

/// A set of effects, fitted to one flight and judged on another.
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// Effects beside drag and trim.
    pub effects: Vec<&'static str>,
    /// Error on the fitted flight, rms of vertical velocity, cm/s.
    pub fitted_cm_s: f64,
    /// The same on the other flight, cm/s.
    pub test_cm_s: f64,
    /// Squared error above that of the best set, mean over the legs, in standard errors; 0 for the best.
    pub t: f64,
    /// Whether the legs do not tell it from the best.
    pub as_good: bool,
    /// The model.
    pub model: GlideModel,
}

/// A steady model fitted to one flight and judged on another.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOut {
    /// Fitted flight.
    pub fitted: String,
    /// Flight it is judged on.
    pub test: String,
    /// Every step in its usual order, with its error on both.
    pub ladder: Vec<Step>,
    /// Legs of the other flight.
    pub legs: usize,
    /// Every set of effects, best on the other flight first.
    pub sets: Vec<Judged>,
    /// The smallest sets that are as good as the best, the better one first: what is named.
    pub named: Vec<Vec<&'static str>>,
    /// Error of the first of them on the fitted flight, cm/s.
    pub fitted_cm_s: f64,
    /// The same on the other flight, cm/s.
    pub test_cm_s: f64,
}

/// Fits the steady model with every set of effects to `train` and judges it on `test`.
///
/// # Errors
/// [`SteadyError`]: too few steady samples or legs.
pub fn held_out(train: &Flight, test: &Flight) -> Result<HeldOut, SteadyError> {
    let (fitted, judged) = (SteadySamples::of(train)?, SteadySamples::of(test)?);
    let legs = legs(&judged);
    if legs.len() < FEWEST_LEGS {
        return Err(SteadyError::FewLegs { flight: test.name.clone(), legs: legs.len(), fewest: FEWEST_LEGS });
    }
    let warm = fitted.has_temperature() && judged.has_temperature();
    let effects: Vec<_> = EFFECTS.iter().filter(|(p, _)| warm || *p != Parameter::ThermalExpansion).collect();
    let start = fitted.nominal_model(false);
    let always = Rung::TrimMeasuredDensity.free();
    let mut sets = Vec::new();
    for chosen in 0..1_usize << effects.len() {
        let set = || effects.iter().enumerate().filter(|(k, _)| chosen >> k & 1 == 1).map(|(_, e)| e);
        let free: Vec<Parameter> = always.iter().copied().chain(set().map(|e| e.0)).collect();
        let model = fit(&fitted, &start, &free, Channels::Vertical)?.model;
        sets.push(Judged {
            effects: set().map(|e| e.1.name).collect(),
            fitted_cm_s: rms_cm_s(&fitted, &model),
            test_cm_s: rms_cm_s(&judged, &model),
            t: 0.0,
            as_good: true,
            model,
        });
    }
    sets.sort_by(|a, b| a.test_cm_s.total_cmp(&b.test_cm_s));
    let best = squares(&judged, &sets[0].model, &legs);
    for set in &mut sets[1..] {
        set.t = in_standard_errors(&(squares(&judged, &set.model, &legs) - &best));
        // Without a steady glide on some sample there is no error to compare.
        set.as_good = set.test_cm_s.is_finite() && set.t < WORSE_T;
    }
    let as_good = || sets.iter().filter(|s| s.as_good);
    let fewest = as_good().map(|s| s.effects.len()).min().unwrap_or(0);
    let named: Vec<&Judged> = as_good().filter(|s| s.effects.len() == fewest).collect();
    Ok(HeldOut {
        fitted: train.name.clone(),
        test: test.name.clone(),
        ladder: ladder(&fitted, Some(&judged))?,
        legs: legs.len(),
        named: named.iter().map(|s| s.effects.clone()).collect(),
        fitted_cm_s: named.first().map_or(f64::NAN, |s| s.fitted_cm_s),
        test_cm_s: named.first().map_or(f64::NAN, |s| s.test_cm_s),
        sets,
    })
}

/// Samples of each leg: one direction, no long gap.
fn legs(samples: &SteadySamples) -> Vec<std::ops::Range<usize>> {
    let rows: Vec<_> = samples.rows().map(|(_, row)| row).collect();
    let mut out = Vec::new();
    let mut start = 0;
    for i in 1..=rows.len() {
        let ends = rows.get(i).is_none_or(|row| {
            row.vertical_m_s.signum() != rows[i - 1].vertical_m_s.signum() || row.time_s - rows[i - 1].time_s > LEG_GAP_S
        });
        if ends {
            if i - start >= FEWEST_SAMPLES {
                out.push(start..i);
            }
            start = i;
        }
    }
    out
}

/// Mean squared error of each leg.
fn squares(samples: &SteadySamples, model: &GlideModel, legs: &[std::ops::Range<usize>]) -> DVector<f64> {
    let r = residuals(samples, model, Channels::Vertical);
    DVector::from_iterator(legs.len(), legs.iter().map(|leg| r.rows(leg.start, leg.len()).norm_squared() / leg.len() as f64))
}

/// Mean in its standard errors; 0 where nothing varies.
fn in_standard_errors(x: &DVector<f64>) -> f64 {
    // The variance is over n, that of a sample over n − 1.
    let error = (x.variance() / (x.len() as f64 - 1.0)).sqrt();
    if error > 0.0 { x.mean() / error } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steady::glide::Input;

    /// Twelve legs between 12 and 180 m over a thermocline at this depth, with water motion of 0.5 cm/s that differs from leg to leg.
    fn flown(truth: &GlideModel, thermocline_m: f64) -> Flight {
        let mut f = Flight { name: "made".into(), ..Flight::default() };
        let (mut w, mut t) = (Vec::new(), 0.0);
        for leg in 0..12 {
            for k in 0..168 {
                let down = leg % 2 == 0;
                let depth_m = if down { 12.0 + f64::from(k) } else { 180.0 - f64::from(k) };
                let temperature_degc = 18.0 - 8.0 * ((depth_m - thermocline_m) / 15.0).tanh();
                let sign = if down { -1.0 } else { 1.0 };
                // Salt and cold weigh, depth presses: a made-up but possible sea.
                let density_kg_m3 = 1024.0 - 0.25 * (temperature_degc - 18.0) + 0.0045 * depth_m;
                let input = Input {
                    pitch_rad: sign * (0.40 + 0.01 * f64::from(leg % 3)),
                    ballast_m3: sign * 230e-6,
                    density_kg_m3,
                    pressure_pa: 1e4 * depth_m,
                    temperature_degc,
                };
                let water = 0.005 * (f64::from(leg) * 2.1 + f64::from(k) * 0.07).sin();
                w.push(truth.glide(&input).vertical_m_s + water);
                f.time_s.push(t);
                f.segment.push(0);
                f.pressure_pa.push(input.pressure_pa);
                f.pitch_rad.push(input.pitch_rad);
                f.ballast_m3.push(input.ballast_m3);
                f.density_kg_m3.push(density_kg_m3);
                f.temperature_degc.push(temperature_degc);
                t += 6.0;
            }
            t += 200.0;
        }
        f.extra.insert("steady".into(), vec![1.0; f.len()]);
        f.extra.insert("w_obs_m_s".into(), w);
        f
    }

    fn scattered() -> GlideModel {
        let nominal = GlideModel::nominal(1025.0, 14.0);
        GlideModel { constant_density: false, cd0: 1.1 * nominal.cd0, trim_mass_kg: 0.02, ..nominal }
    }

    #[test]
    fn two_hidden_effects_are_named_on_a_flight_that_was_not_fitted() {
        let truth = GlideModel { compressibility_per_pa: 5e-10, thermal_expansion_per_k: 6e-5, ..scattered() };
        let found = held_out(&flown(&truth, 40.0), &flown(&truth, 90.0)).expect("steady");
        assert_eq!(found.named, [["hull_compressibility", "thermal_expansion"]], "{:?}", found.sets);
        // Water motion of 0.5 cm/s amplitude leaves 0.35 cm/s rms.
        assert!((found.test_cm_s - 0.354).abs() < 0.05, "{}", found.test_cm_s);
        assert_eq!((found.legs, found.sets.len()), (12, 8));
    }

    #[test]
    fn nothing_is_named_where_drag_and_trim_are_all_that_scatters() {
        let found = held_out(&flown(&scattered(), 40.0), &flown(&scattered(), 90.0)).expect("steady");
        assert_eq!(found.named, [[""; 0]], "{:?}", found.sets);
    }

    #[test]
    fn too_few_legs_are_an_error_that_says_how_many_there_are() {
        let truth = scattered();
        let mut short = flown(&truth, 40.0);
        short.extra.insert("steady".into(), (0..short.len()).map(|i| f64::from(u8::from(i < 500))).collect());
        let said = held_out(&flown(&truth, 40.0), &short).unwrap_err().to_string();
        assert!(said.contains("made: 3 steady legs; at least 6"), "{said}");
    }

    #[test]
    fn accuracy_a_mean_in_standard_errors_is_students_t() {
        // Mean 3, sample variance 2.5, n 5: t = 3 / sqrt(2.5 / 5), by hand 4.2426.
        let t = in_standard_errors(&DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0, 5.0]));
        assert!((t - 4.242_640_687).abs() < 1e-9, "{t}");
        assert_eq!(in_standard_errors(&DVector::from_vec(vec![1.0; 4])), 0.0);
    }
}
