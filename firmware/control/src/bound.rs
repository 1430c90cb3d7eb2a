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

#[cfg(test)]
mod tests {
    use super::Bound;

    #[test]
    fn nan_never_passes() {
        assert_eq!(f32::NAN.at_least(1.0), 1.0);
        assert_eq!(f32::NAN.at_most(1.0), 1.0);
        assert_eq!(2.0f32.at_least(1.0).at_most(1.5), 1.5);
        assert_eq!((-2.0f32).at_least(-1.0).at_most(1.0), -1.0);
    }
}
