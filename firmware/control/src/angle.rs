//! Angles and roots in flight maths, cheap on a processor that divides and
//! has no library: polynomials and Newton steps whose error is measured.
//!
//! A pitch setpoint needs 1e-3 rad (0.06°), the trim law 1e-3 of tan, a speed
//! 1 %: tan is a rational approximation, atan a polynomial, the root comes of
//! its inverse by two Newton steps. `accuracy_` tests hold the figures.

use crate::bound::Bound;
use core::f32::consts::{PI, TAU};
use micromath::F32;

/// tan x for |x| ≤ 0.9 rad (clamped), error ≤ 7e-4. Padé (3,2).
#[must_use]
pub fn tan(x: f32) -> f32 {
    let x = x.at_least(-0.9).at_most(0.9);
    let x2 = x * x;
    x * (15.0 - x2) / (15.0 - 6.0 * x2)
}

/// atan of any finite number, rad, error ≤ 2e-5: the polynomial of Abramowitz and Stegun, 4.4.47.
#[must_use]
pub fn atan(t: f32) -> f32 {
    // Outside ±1 the complement is the small angle.
    let (x, from) = if t.abs() > 1.0 { (-1.0 / t, if t > 0.0 { PI / 2.0 } else { -PI / 2.0 }) } else { (t, 0.0) };
    let x2 = x * x;
    from + x * (0.999_866 + x2 * (-0.330_299_5 + x2 * (0.180_141 + x2 * (-0.085_133 + x2 * 0.020_835_1))))
}

/// One over the square root of a positive number, relative error ≤ 1e-5; 0 for what is not positive.
///
/// micromath gives a first guess (half the exponent, mirrored: 3 % off); each Newton step squares the error.
#[must_use]
pub fn inverse_sqrt(v: f32) -> f32 {
    if !(v > 1e-30) {
        return 0.0;
    }
    let y = F32(v).invsqrt().0;
    let half = 0.5 * v;
    let y = y * (1.5 - half * y * y);
    y * (1.5 - half * y * y)
}

/// Square root of a non-negative number, relative error ≤ 1e-5; 0 for a negative one, NaN for NaN.
#[must_use]
pub fn sqrt(v: f32) -> f32 {
    v * inverse_sqrt(v)
}

/// The same heading difference in −π..π, from within ±8 turns; what is farther gives a bound.
#[must_use]
pub fn wrap(x: f32) -> f32 {
    // Eight turns more and the number is positive: then to cut is to floor.
    let turns = ((x + 17.0 * PI) * (1.0 / TAU)) as u32 as f32 - 8.0;
    (x - turns * TAU).at_least(-PI).at_most(PI)
}

#[cfg(test)]
mod tests {
    use super::{atan, inverse_sqrt, sqrt, tan, wrap};

    /// Largest error over the sweep, with NaN refused.
    fn worst(range: std::ops::RangeInclusive<f64>, error: impl Fn(f32) -> f64) -> f64 {
        let mut worst = 0.0;
        for i in 0..=100_000 {
            let x = (range.start() + (range.end() - range.start()) * f64::from(i) / 1e5) as f32;
            let e = error(x);
            assert!(e.is_finite(), "at {x}");
            worst = f64::max(worst, e);
        }
        worst
    }

    /// Budget: 1e-3 rad of pitch is 0.06°, a tenth of the battery dead-band.
    #[test]
    fn accuracy_angles_stay_inside_the_budget_of_the_module_doc() {
        let t = worst(-0.9..=0.9, |x| (f64::from(tan(x)) - f64::from(x).tan()).abs());
        assert!(t < 7e-4, "tan {t}");
        let a = worst(-20.0..=20.0, |x| (f64::from(atan(x)) - f64::from(x).atan()).abs());
        assert!(a < 2e-5, "atan {a}");
        let s = worst(1e-6..=100.0, |x| (f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0).abs());
        assert!(s < 1e-5, "sqrt {s}");
        assert_eq!((sqrt(0.0), sqrt(-1.0)), (0.0, 0.0));
        assert_eq!((inverse_sqrt(0.0), inverse_sqrt(f32::NAN)), (0.0, 0.0));
    }

    #[test]
    fn headings_wrap_the_short_way_round() {
        for (x, want) in
            [(0.1, 0.1), (3.2, 3.2 - 6.283_185_5), (-3.2, -3.2 + 6.283_185_5), (6.2, 6.2 - 6.283_185_5), (12.6, 12.6 - 12.566_371)]
        {
            assert!((wrap(x) - want).abs() < 1e-5, "{x}");
        }
        assert!(wrap(1e9).abs() <= 3.2 && wrap(-1e9).abs() <= 3.2 && wrap(f32::NAN).abs() <= 3.2);
    }
}
