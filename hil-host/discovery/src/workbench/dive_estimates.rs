//! What one dive says of every number that a fleet may have in common: the six that are followed ([`crate::workbench::tracking`]) and
//! the size of every effect of the catalogue, one at a time.
//!
//! An estimate is the least-squares one of a number whose whitened sensitivity is x, given the numbers A that are not well known: the other
//! tracked ones within the vehicle file's tolerances, and the model discrepancy within its size, with prior precisions P:
//! ```text
//! C = AᵀA + P      y = C⁻¹ Aᵀ x      h = xᵀx − xᵀA y      estimate = (x − A y)ᵀ r / h      1 / h = noise² + Σ P_k y_k² / h²
//! ```
//! The sum is what the uncertain numbers put into the estimate. It does not average out over dives that share them, so it is kept apart
//! from the noise: the calibration's part is common to the dives of a vehicle, the discrepancy's to all dives of a fleet.
//!
//! Not covered: effects that begin at an angle (stall) and those that only a GPS fix shows; numbers of the law that are not tracked are held
//! at the file's values.

use crate::diagnosis::NothingToFit;
use crate::hypotheses::identifiability::discrepancy_of;
use crate::hypotheses::sensitivity::signatures;
use crate::likelihood::Column;
use crate::model::parameters::{State, calibration_of, is_law, tolerance_of};
use crate::preprocess::prepare;
use crate::workbench::timeline::first_dives;
use crate::workbench::tracking::{Dive, DiveFit, N, Reference, TRACKED, for_missions, start_precision};
use hydro::effects::{Effect, SeenIn};
use logs::record::flight::Flight;
use logs::vehicle::{Vehicle, catalogue};
use nalgebra::{DMatrix, DVector};

/// A number that dives are asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Name: one of [`TRACKED`], or that of an effect.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Whether it can only be above nothing.
    pub only_above: bool,
}

/// An estimate relative to the vehicle file, with the standard deviations of its three kinds of error, all in the unit of the number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Value; NaN where the dive says nothing.
    pub value: f64,
    /// Of water and sensors: another one in each dive.
    pub noise: f64,
    /// Of the vehicle's calibration, the number's own tolerance in it: the same in all dives of a vehicle.
    pub calibration: f64,
    /// Of the model discrepancy: the same in all dives.
    pub model: f64,
}

impl Estimate {
    const NONE: Self = Self { value: f64::NAN, noise: f64::NAN, calibration: f64::NAN, model: f64::NAN };

    /// Standard deviation of all three together: what the dive alone knows it by.
    #[must_use]
    pub fn sigma(&self) -> f64 {
        self.noise.hypot(self.calibration).hypot(self.model)
    }
}

/// Whether a fleet is asked for an effect: it is seen in the vertical motion, has no onset, and is not tracked or a sensor's own.
fn is_asked(effect: &Effect) -> bool {
    let own = calibration_of(effect).is_some_and(|k| !is_law(k) || TRACKED.iter().any(|t| t.index == k));
    effect.seen_in == SeenIn::VerticalMotion && effect.onset.is_none() && !own
}

/// The numbers that every dive is asked for, in order.
#[must_use]
pub fn asked() -> Vec<Asked> {
    let tracked = TRACKED.iter().map(|t| Asked { name: t.name, unit: t.unit, only_above: false });
    let effects = catalogue::all().filter(|e| is_asked(e)).map(|e| {
        let size = &e.parameters[0];
        Asked { name: e.name, unit: size.unit, only_above: size.low >= size.off }
    });
    tracked.chain(effects).collect()
}

/// A dive with what it says of every number of [`asked`].
#[derive(Clone, Debug)]
pub struct Estimated {
    /// The dive, with the information matrix of the tracked numbers.
    pub dive: Dive,
    /// In the order of [`asked`].
    pub estimates: Vec<Estimate>,
}

/// Of a flight: every dive of it that can be compared with the model, by itself.
///
/// # Errors
/// No dive that a model could be compared with.
pub fn dive_estimates(flight: &Flight, vehicle: &Vehicle, tick: &dyn Fn(usize, usize)) -> Result<Vec<Estimated>, NothingToFit> {
    let vehicle = for_missions(vehicle);
    let prepared = prepare(flight, &vehicle);
    let waiting = [(flight.name.clone(), 0.0, prepared)];
    let reference = Reference::of(&vehicle, &first_dives(&waiting), &flight.name)?;
    let prepared = &waiting[0].2;
    let known = Known::of(&vehicle, &reference);
    let mut start = reference.start();
    let mut out = Vec::with_capacity(prepared.runs.len());
    for (k, run) in prepared.runs.iter().enumerate() {
        let from = |start: &State| reference.dive_and(prepared, run, start, |fit| known.estimates(fit));
        // A dive that went astray must not lead the next one astray.
        if let Some((dive, state, estimates)) = from(&start).or_else(|| from(&reference.start())) {
            start = state;
            out.push(Estimated { dive, estimates });
        }
        tick(k + 1, prepared.runs.len());
    }
    if out.is_empty() {
        return Err(NothingToFit::because("no dive of this flight could be compared with the model"));
    }
    Ok(out)
}

/// What is known before a dive.
struct Known {
    /// Precision of the tracked numbers, per step².
    precision: [f64; N],
    /// Tolerance of the tracked numbers' own values, steps.
    own: [f64; N],
    /// Tolerances of the asked effects that are numbers of the law, in their units; 0 for the others.
    of_effects: Vec<f64>,
    discrepancy_m_s: f64,
}

impl Known {
    fn of(vehicle: &Vehicle, reference: &Reference) -> Self {
        let tolerance = |effect: &Effect| calibration_of(effect).map_or(0.0, |k| tolerance_of(vehicle, k));
        Self {
            precision: start_precision(vehicle),
            own: std::array::from_fn(|k| TRACKED[k].in_steps(tolerance_of(vehicle, TRACKED[k].index))),
            of_effects: catalogue::all().filter(|e| is_asked(e)).map(tolerance).collect(),
            discrepancy_m_s: reference.discrepancy_m_s,
        }
    }

    fn estimates(&self, fit: &DiveFit) -> Vec<Estimate> {
        let error_m_s = self.discrepancy_m_s.hypot(fit.problem.noise_floor_m_s());
        let (discrepancy, _) = discrepancy_of(fit.problem, fit.state, error_m_s);
        // The residual of the vehicle as its file stands, as far as that is linear.
        let mut at_file = fit.residual.values.to_vec();
        for (t, column) in TRACKED.iter().zip(fit.columns) {
            let z = fit.state.calibration[t.index];
            at_file.iter_mut().zip(column.values.iter()).for_each(|(r, c)| *r += c * z);
        }
        let at_file = fit.problem.column(0, at_file);
        let uncertain: Vec<&Column> = fit.columns.iter().chain(&discrepancy).collect();
        let precision: Vec<f64> = (0..uncertain.len()).map(|k| self.precision.get(k).copied().unwrap_or(1.0)).collect();
        let given = Uncertain::new(&uncertain, &precision, &at_file);
        let tracked = (0..N).map(|k| given.estimate(&fit.columns[k], &at_file, Some(k), self.own[k]).times(TRACKED[k].step));
        let signs = signatures(fit.problem, fit.state, None);
        let signs = signs.iter().filter(|s| is_asked(s.effect));
        let effects = signs.zip(&self.of_effects).map(|(s, own)| given.estimate(&s.column, &at_file, None, *own));
        tracked.chain(effects).collect()
    }
}

impl Estimate {
    fn times(self, step: f64) -> Self {
        Self { value: self.value * step, noise: self.noise * step, calibration: self.calibration * step, model: self.model * step }
    }
}

/// The nuisance numbers: those not well known, fitted together with the one that is asked for.
struct Uncertain<'a> {
    columns: &'a [&'a Column],
    precision: &'a [f64],
    gram: DMatrix<f64>,
    match_: DVector<f64>,
}

/// Share of a sensitivity that must be left once the uncertain numbers are fitted, or the dive says nothing.
const LEAST_SHARE: f64 = 1e-8;

impl<'a> Uncertain<'a> {
    fn new(columns: &'a [&'a Column], precision: &'a [f64], residual: &Column) -> Self {
        let n = columns.len();
        let gram = DMatrix::from_fn(n, n, |i, j| columns[i].dot(columns[j]) + if i == j { precision[i] } else { 0.0 });
        Self { columns, precision, gram, match_: DVector::from_fn(n, |i, _| columns[i].dot(residual)) }
    }

    /// Estimate of the number with this sensitivity; `own` is its place among the uncertain ones, if it is one of them, and `tolerance`
    /// what its value in the file is uncertain by.
    fn estimate(&self, column: &Column, residual: &Column, own: Option<usize>, tolerance: f64) -> Estimate {
        let others: Vec<usize> = (0..self.columns.len()).filter(|k| Some(*k) != own).collect();
        let n = others.len();
        let gram = DMatrix::from_fn(n, n, |i, j| self.gram[(others[i], others[j])]);
        let cross = DVector::from_fn(n, |i, _| self.columns[others[i]].dot(column));
        let Some(factor) = gram.cholesky() else { return Estimate::NONE };
        let y = factor.solve(&cross);
        let whole = column.dot(column);
        let h = whole - cross.dot(&y);
        if !(h > LEAST_SHARE * whole && h.is_finite()) {
            return Estimate::NONE;
        }
        let match_ = column.dot(residual) - (0..n).map(|i| y[i] * self.match_[others[i]]).sum::<f64>();
        let part = |wanted: &dyn Fn(usize) -> bool| -> f64 {
            (0..n).filter(|i| wanted(others[*i])).map(|i| self.precision[others[i]] * y[i] * y[i]).sum::<f64>() / (h * h)
        };
        let (calibration, model) = (part(&|k| k < N), part(&|k| k >= N));
        // 1 / h is the sum of the three; what rounding leaves of the noise is at least a millionth.
        let noise = (1.0 / h - calibration - model).max(1e-6 / h);
        Estimate { value: match_ / h, noise: noise.sqrt(), calibration: calibration.sqrt().hypot(tolerance), model: model.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wobble(seed: f64) -> Column {
        let values = (0..80).map(|i| ((f64::from(i) + 1.0) * seed).sin() + 0.3 * (f64::from(i) * seed * 0.37).cos()).collect();
        Column::with_shadow(0, values, Vec::new())
    }

    /// The three parts of the variance are those of the estimator itself, worked out by shifting what they come from.
    #[test]
    fn accuracy_the_parts_of_an_estimate_are_what_shifts_of_their_causes_make() {
        let columns: Vec<Column> = (0..N + 2).map(|k| wobble(0.31 + 0.17 * k as f64)).collect();
        let uncertain: Vec<&Column> = columns.iter().collect();
        let precision: Vec<f64> = (0..N + 2).map(|k| 3.0 + k as f64).collect();
        let x = wobble(0.41);
        let of = |residual: &Column| Uncertain::new(&uncertain, &precision, residual).estimate(&x, residual, None, 0.0);
        let nothing = Column::with_shadow(0, vec![0.0; 80], Vec::new());
        let parts = of(&nothing);
        assert!(parts.value.abs() < 1e-12);
        // A truth of 2 and nothing else is found.
        let two = Column::with_shadow(0, x.values.iter().map(|v| 2.0 * v).collect(), Vec::new());
        assert!((of(&two).value - 2.0).abs() < 1e-9, "{:?}", of(&two));
        let variance = |range: std::ops::Range<usize>| -> f64 { range.map(|k| of(&columns[k]).value.powi(2) / precision[k]).sum() };
        assert!((variance(0..N).sqrt() - parts.calibration).abs() < 1e-9 * parts.calibration, "{parts:?}");
        assert!((variance(N..N + 2).sqrt() - parts.model).abs() < 1e-9 * parts.model, "{parts:?}");
        // Noise of one sigma in each row.
        let unit = |i: usize| Column::with_shadow(0, (0..80).map(|j| f64::from(u8::from(j == i))).collect(), Vec::new());
        let noise: f64 = (0..80).map(|i| of(&unit(i)).value.powi(2)).sum();
        assert!((noise.sqrt() - parts.noise).abs() < 1e-9 * parts.noise, "{noise} {parts:?}");
    }

    #[test]
    fn numbers_are_asked_for_once_and_the_tracked_ones_first() {
        let all = asked();
        let mut names: Vec<&str> = all.iter().map(|a| a.name).collect();
        assert!(names.len() > 15 && names[..N] == TRACKED.map(|t| t.name), "{names:?}");
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
    }
}
