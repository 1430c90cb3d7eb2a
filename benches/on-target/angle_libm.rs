//! The functions of `control::angle` by libm: the alternative that the flown ones are measured against.

use crate::bound::Bound;
use core::f32::consts::{PI, TAU};

/// tan x for |x| ≤ 0.9 rad (clamped).
#[must_use]
pub fn tan(x: f32) -> f32 {
    libm::tanf(x.at_least(-0.9).at_most(0.9))
}

/// atan of any finite number, rad.
#[must_use]
pub fn atan(t: f32) -> f32 {
    libm::atanf(t)
}

/// One over the square root of a positive number; 0 for what is not positive.
#[must_use]
pub fn inverse_sqrt(v: f32) -> f32 {
    if v > 1e-30 { 1.0 / libm::sqrtf(v) } else { 0.0 }
}

/// Square root of a non-negative number; 0 for what is not positive.
#[must_use]
pub fn sqrt(v: f32) -> f32 {
    if v > 1e-30 { libm::sqrtf(v) } else { 0.0 }
}

/// The same heading difference in −π..π.
#[must_use]
pub fn wrap(x: f32) -> f32 {
    (x - libm::floorf((x + PI) / TAU) * TAU).at_least(-PI).at_most(PI)
}
