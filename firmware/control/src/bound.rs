//! The larger and the smaller of two numbers, as the processor compares them.
//!
//! `f32::max` and `f32::min` promise what IEEE's maxNum does with NaN; the
//! Cortex-M4F has no instruction for it, so each becomes a call of some thirty
//! instructions, and `f32::clamp` between variables can panic. These are one
//! comparison; where `x` is NaN the bound is returned, so NaN never passes.

/// Bounds of a number.
pub(crate) trait Bound {
    /// `self`, or `low` where that is larger.
    fn at_least(self, low: Self) -> Self;
    /// `self`, or `high` where that is smaller.
    fn at_most(self, high: Self) -> Self;
}

impl Bound for f32 {
    #[inline(always)]
    fn at_least(self, low: Self) -> Self {
        if self > low { self } else { low }
    }

    #[inline(always)]
    fn at_most(self, high: Self) -> Self {
        if self < high { self } else { high }
    }
}

/// Whether all of them are finite: 0 times such numbers stays 0, any other makes it NaN for good,
/// so one product answers for all without a branch.
#[inline(always)]
pub(crate) fn all_finite<const N: usize>(numbers: [f32; N]) -> bool {
    let mut product = 0.0;
    for number in numbers {
        product *= number;
    }
    product == 0.0
}

#[cfg(test)]
mod tests {
    use super::{Bound, all_finite};

    #[test]
    fn one_number_that_is_not_finite_is_found_among_large_ones() {
        assert!(all_finite([0.0, -0.0, 1.0, f32::MAX, f32::MIN, 1e-40]));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(!all_finite([1.0, f32::MAX, bad]) && !all_finite([bad, -bad]));
        }
    }

    #[test]
    fn nan_never_passes() {
        assert_eq!(f32::NAN.at_least(1.0), 1.0);
        assert_eq!(f32::NAN.at_most(1.0), 1.0);
        assert_eq!(2.0f32.at_least(1.0).at_most(1.5), 1.5);
        assert_eq!((-2.0f32).at_least(-1.0).at_most(1.0), -1.0);
    }
}
