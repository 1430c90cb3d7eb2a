//! Effects on top of any vehicle.
//!
//! The catalogue's effects act on the coefficient form of a vehicle ([`ForceModel`]). A vehicle from geometry is first
//! projected onto that form; what the effects change there is added to what the geometry says:
//! ```text
//! force = geometry(α) + [coefficients with effects − coefficients without]
//! ```
//! For a vehicle that *is* coefficients this is the force model itself. With every effect off the bracket is zero.

use crate::effects::{Flow, ForceModel, LiftDrag};
use crate::polar::Polar;

/// A polar with effects.
#[derive(Clone, Copy, Debug)]
pub struct Added<'a, P> {
    /// The vehicle without effects.
    pub base: P,
    /// Its coefficients with the effects on.
    pub with: ForceModel<'a>,
    /// Its coefficients without.
    pub without: ForceModel<'a>,
}

impl<P: Polar> Polar for Added<'_, P> {
    fn reference_area_m2(&self) -> f64 {
        self.base.reference_area_m2()
    }

    fn force(&self, flow: &Flow) -> LiftDrag {
        let to_base = self.with.constants.reference_area_m2 / self.base.reference_area_m2();
        let change = self.with.coefficients(flow) + self.without.coefficients(flow) * -1.0;
        self.base.force(flow) + change * to_base
    }

    fn alpha_valid_rad(&self) -> f64 {
        let (a, b) = (self.base.alpha_valid_rad(), self.with.alpha_valid_rad());
        if a < b { a } else { b }
    }
}
