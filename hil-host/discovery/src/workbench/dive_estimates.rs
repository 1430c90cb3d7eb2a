//! What one dive says of every number that a fleet may have in common, one at a time: the eight of the vehicle's history
//! ([`crate::history::numbers`]) and the effects beyond them that have a form ([`crate::history::structure`]).
//!
//! An estimate is the least-squares one of a number given those of the eight that are not well known, A, with the precisions P of the
//! vehicle file's tolerances. With N and u the dive's summary over its own noise:
//! ```text
//! y = (N_AA + P)⁻¹ N_Ak     h = N_kk − N_kA y     estimate = (u_k − yᵀ u_A) / h     1 / h = noise² + Σ P_i y_i² / h²
//! ```
//! The sum is what the uncertain numbers put into the estimate. It is common to the dives of a vehicle and does not average out over
//! them, so it is kept apart from the noise.

use crate::diagnosis::NothingToFit;
use crate::history::glide::Glider;
use crate::history::learn::{levels, start_of_first, wide_about};
use crate::history::numbers::{NUMBERS, Numbers};
use crate::history::rows::{Unit, units};
use crate::history::shown::{name_and_unit, value};
use crate::history::structure::{DEPARTURES, FORMS, OF_FORMS};
use crate::history::summary::{Linear, Summary};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};

/// A number that dives are asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
}

/// An estimate relative to the vehicle file, with the standard deviations of its two kinds of error, all in the unit of the number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Value; NaN where the dive says nothing.
    pub value: f64,
    /// Of water and sensors: another one in each dive.
    pub noise: f64,
    /// Of the vehicle's calibration, the number's own tolerance in it: the same in all dives of a vehicle.
    pub calibration: f64,
}

impl Estimate {
    const NONE: Self = Self { value: f64::NAN, noise: f64::NAN, calibration: f64::NAN };
}

/// The numbers that every dive is asked for, in order.
#[must_use]
pub fn asked() -> Vec<Asked> {
    const UNITS: [&str; FORMS] = ["%", "1", "1/rad2", "kg"];
    let numbers = (0..NUMBERS).map(name_and_unit).map(|(name, unit)| Asked { name, unit });
    numbers.chain(DEPARTURES.iter().zip(UNITS).map(|(d, unit)| Asked { name: d.name, unit })).collect()
}

/// A dive with what it says of every number of [`asked`].
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Its steady rows.
    pub unit: Unit,
    /// Standard deviation of the noise of a row, m/s.
    pub noise_m_s: f64,
    /// What it says of the eight numbers beyond the file, in sizes, over its noise.
    pub says: Summary,
    /// In the order of [`asked`].
    pub estimates: Vec<Estimate>,
}

/// Of a flight: every steady dive of it, by itself.
///
/// # Errors
/// No dive that can be asked.
pub fn dive_estimates(flight: &Flight, vehicle: &Vehicle) -> Result<Vec<Estimated>, NothingToFit> {
    let units = units(flight);
    if units.is_empty() {
        return Err(NothingToFit::because("no dive of this flight has steady rows enough on both legs"));
    }
    let glider = Glider::of_units(vehicle, &units);
    let at = start_of_first(&units, &glider);
    let linear = |u: &Unit| {
        let mut linear = wide_about(u, &glider, &at, &Numbers::zeros());
        linear.count_from(&-at);
        linear
    };
    let all: Vec<Linear> = units.iter().map(linear).collect();
    let (own, _) = levels(&all, None);
    let one = |((unit, linear), level): ((Unit, Linear), f64)| {
        let says = Summary::of(&linear, level);
        let estimates = estimates(&says, &glider);
        Estimated { unit, noise_m_s: level.sqrt(), says: says.of_numbers(), estimates }
    };
    Ok(units.into_iter().zip(all).zip(own).map(one).collect())
}

/// Estimates of one dive in their units.
fn estimates(says: &Summary, glider: &Glider) -> Vec<Estimate> {
    let precision = glider.tolerance.map(|t| t.powi(-2));
    let claims = Numbers::from_column_slice(&glider.claims());
    let in_unit = |k: usize| {
        let own = if k < NUMBERS { glider.tolerance[k] } else { 0.0 };
        let e = estimate(says, precision.as_slice(), k, own);
        let of = |x: f64| if k < NUMBERS { value(k, x, &glider.sizes, &claims) } else { x * OF_FORMS[k - NUMBERS] * form_unit(k) };
        // Relative numbers are followed by their logarithms.
        let slope = (of(e.value + 0.01) - of(e.value - 0.01)).abs() / 0.02;
        Estimate { value: of(e.value), noise: e.noise * slope, calibration: e.calibration * slope }
    };
    (0..NUMBERS + FORMS).map(in_unit).collect()
}

/// Per cent of a form whose size is a share.
fn form_unit(k: usize) -> f64 {
    if k == NUMBERS { 100.0 } else { 1.0 }
}

/// Share of a number's information that must be left once the others are fitted, or the dive says nothing.
const LEAST_SHARE: f64 = 1e-8;

/// Estimate of one column in its size; `tolerance` is what its value in the file is uncertain by.
fn estimate(says: &Summary, precision: &[f64], k: usize, tolerance: f64) -> Estimate {
    let others: Vec<usize> = (0..NUMBERS).filter(|i| *i != k).collect();
    let n = others.len();
    let gram = DMatrix::from_fn(n, n, |i, j| says.n[(others[i], others[j])] + if i == j { precision[others[i]] } else { 0.0 });
    let cross = DVector::from_fn(n, |i, _| says.n[(others[i], k)]);
    let Some(factor) = gram.cholesky() else { return Estimate::NONE };
    let y = factor.solve(&cross);
    let h = says.n[(k, k)] - cross.dot(&y);
    if !(h > LEAST_SHARE * says.n[(k, k)] && h.is_finite()) {
        return Estimate::NONE;
    }
    let pull = says.u[k] - (0..n).map(|i| y[i] * says.u[others[i]]).sum::<f64>();
    let calibration = (0..n).map(|i| precision[others[i]] * y[i] * y[i]).sum::<f64>() / (h * h);
    // 1 / h is the sum of both; what rounding leaves of the noise is at least a millionth.
    let noise = (1.0 / h - calibration).max(1e-6 / h);
    Estimate { value: pull / h, noise: noise.sqrt(), calibration: calibration.sqrt().hypot(tolerance) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both parts of the variance are those of the estimator itself, worked out by shifting what they come from.
    #[test]
    fn accuracy_the_parts_of_an_estimate_are_what_shifts_of_their_causes_make() {
        let wobble = |i: usize, seed: f64| ((i as f64 + 1.0) * seed).sin() + 0.3 * (i as f64 * seed * 0.37).cos();
        let j = DMatrix::from_fn(200, NUMBERS + FORMS, |i, k| wobble(i, 0.31 + 0.17 * k as f64));
        let precision: Vec<f64> = (0..NUMBERS).map(|k| 3.0 + k as f64).collect();
        let of = |rows: &DVector<f64>, k| estimate(&Summary { n: j.tr_mul(&j), u: j.tr_mul(rows) }, &precision, k, 0.0);
        let k = 2;
        let parts = of(&DVector::zeros(200), k);
        assert!(parts.value.abs() < 1e-12);
        // A truth of 2 and nothing else is found.
        let two = of(&(j.column(k) * 2.0), k);
        assert!((two.value - 2.0).abs() < 1e-9, "{two:?}");
        let others = (0..NUMBERS).filter(|i| *i != k);
        let variance: f64 = others.map(|i| of(&j.column(i).into_owned(), k).value.powi(2) / precision[i]).sum();
        assert!((variance.sqrt() - parts.calibration).abs() < 1e-6 * parts.calibration, "{parts:?}");
        // Noise of one sigma in each row.
        let unit = |i: usize| DVector::from_fn(200, |r, _| f64::from(u8::from(r == i)));
        let noise: f64 = (0..200).map(|i| of(&unit(i), k).value.powi(2)).sum();
        assert!((noise.sqrt() - parts.noise).abs() < 1e-6 * parts.noise, "{noise} {parts:?}");
    }

    #[test]
    fn numbers_are_asked_for_once() {
        let mut names: Vec<&str> = asked().iter().map(|a| a.name).collect();
        assert!(names.len() == NUMBERS + FORMS && names[0] == "drag", "{names:?}");
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), NUMBERS + FORMS);
    }
}
