//! Angles in flight maths: micromath where its error is small enough,
//! refined where it was measured not to be.
//!
//! Measured over |x| ≤ 1.2 (micromath 2.1): sin 1.1e-3, cos 0.8e-3, atan
//! 2.8e-3 absolute, tan 5.7e-3 absolute, sqrt 6.1 % relative. A pitch setpoint
//! needs 1e-3 rad (0.06°), the trim law 1e-3 of tan, a speed 1 %: so tan and
//! atan are rational approximations here and sqrt gets two Newton steps on
//! top of micromath's. `accuracy_` tests hold the figures.

use crate::bound::Bound;
use core::f32::consts::{PI, TAU};
use micromath::F32Ext;

/// tan x for |x| ≤ 0.9 rad (clamped), error ≤ 7e-4. Padé (3,2).
#[must_use]
pub fn tan(x: f32) -> f32 {
    let x = x.at_least(-0.9).at_most(0.9);
    let x2 = x * x;
    x * (15.0 - x2) / (15.0 - 6.0 * x2)
}

/// atan of any finite number, rad, error ≤ 1e-4: micromath's, and one Newton
/// step against [`tan`] where that holds.
#[must_use]
pub fn atan(t: f32) -> f32 {
    // Outside ±1 the complement is the small angle.
    if t.abs() > 1.0 {
        let rest = atan_small(1.0 / t);
        return if t > 0.0 { PI / 2.0 - rest } else { -PI / 2.0 - rest };
    }
    atan_small(t)
}

/// |t| ≤ 1.
fn atan_small(t: f32) -> f32 {
    let x = F32Ext::atan(t);
    let tan_x = tan(x);
    x + (t - tan_x) / (1.0 + t * tan_x)
}

/// Square root of a non-negative number, relative error ≤ 1e-5; 0 for what is not positive.
#[must_use]
pub fn sqrt(v: f32) -> f32 {
    if !(v > 1e-30) {
        return 0.0;
    }
    let s = F32Ext::sqrt(v);
    let s = 0.5 * (s + v / s);
    0.5 * (s + v / s)
}

/// The same heading difference in −π..π; any finite input, bounded work.
#[must_use]
pub fn wrap(x: f32) -> f32 {
    let turns = F32Ext::floor((x + PI) / TAU);
    (x - turns * TAU).at_least(-PI).at_most(PI)
}

#[cfg(test)]
mod tests {
    use super::{atan, sqrt, tan, wrap};

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
        assert!(a < 1.5e-4, "atan {a}");
        let s = worst(1e-6..=100.0, |x| (f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0).abs());
        assert!(s < 1e-5, "sqrt {s}");
        assert_eq!(sqrt(-1.0), 0.0);
        assert_eq!(sqrt(f32::NAN), 0.0);
    }

    #[test]
    fn headings_wrap_the_short_way_round() {
        for (x, want) in
            [(0.1, 0.1), (3.2, 3.2 - 6.283_185_5), (-3.2, -3.2 + 6.283_185_5), (6.2, 6.2 - 6.283_185_5), (12.6, 12.6 - 12.566_371)]
        {
            assert!((wrap(x) - want).abs() < 1e-5, "{x}");
        }
        assert!(wrap(1e9).abs() <= 3.2);
    }
}
