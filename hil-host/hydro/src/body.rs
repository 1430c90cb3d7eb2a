//! The hull alone: equation 10 and the form behind it.
//!
//! ```text
//! C_N = a1 α + a2 α|α|                                              (10)
//! C_N = (k2−k1)(S0/S) sin 2α cos(α/2) + η C_dc (Sp/S) sin α |sin α|
//! C_A = C_A0 cos² α
//! C_L = C_N cos α − C_A sin α,  C_D = C_N sin α + C_A cos α
//! ```
//! | symbol | meaning | unit |
//! |---|---|---|
//! | k2−k1 | apparent-mass factor of the hull as a spheroid (Munk) | 1 |
//! | S0 | cross-section where the flow stops being potential | m² |
//! | η | cross-flow drag of a finite over an endless cylinder | 1 |
//! | C_dc | cross-flow drag coefficient of the cylinder | 1 |
//! | Sp | planform area | m² |
//!
//! Source: Fidler & Smith 1977 (NEAR TR 139, the paper's ref. 11) in the form of Allen & Perkins (NACA 1048) and
//! Jorgensen (NASA TR R-474), from memory; η digitised from Jorgensen's curve: 0.652 at length/diameter 7.04.
//! The paper prints α² in eq. 10; force must change sign with α, so it is α|α|.
//! Valid to |α| ≈ 25° (paper sec. IV-A) and for subcritical cross-flow, Re_d sin α < 3e4.
//! Not covered: moments, base drag apart from the form factor.

use crate::drag::{self, Layer};
use crate::effects::LiftDrag;

/// Geometry and constants of a hull; areas in m², named, so that no reference area hides in a coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Length without boom, m.
    pub length_m: f64,
    /// Largest diameter, m.
    pub diameter_m: f64,
    /// Wetted area, m².
    pub wetted_area_m2: f64,
    /// Planform area Sp, m².
    pub planform_area_m2: f64,
    /// S0, m².
    pub potential_area_m2: f64,
    /// k2−k1, 1.
    pub munk_factor: f64,
    /// η, 1.
    pub crossflow_eta: f64,
    /// C_dc, 1.
    pub crossflow_cd: f64,
    /// Boundary layer.
    pub layer: Layer,
    /// Reynolds number for friction, 1, on the hull's length.
    pub reynolds: f64,
}

impl Body {
    /// a1 of eq. 10 as area, m²/rad: 2 (k2−k1) S0.
    #[must_use]
    pub fn linear_area_m2(&self) -> f64 {
        2.0 * self.munk_factor * self.potential_area_m2
    }

    /// a2 of eq. 10 as area, m²/rad²: η C_dc Sp.
    #[must_use]
    pub fn crossflow_area_m2(&self) -> f64 {
        self.crossflow_eta * self.crossflow_cd * self.planform_area_m2
    }

    /// C_A0·S, m²: friction with Hoerner's form factor (eq. 15).
    #[must_use]
    pub fn axial_drag_area_m2(&self) -> f64 {
        let form = drag::body_form_factor(self.diameter_m / self.length_m);
        drag::hull_drag_area_m2(drag::friction(self.layer, self.reynolds), form, self.wetted_area_m2)
    }

    /// Normal-force area C_N·S, m², split in (potential, cross-flow).
    #[must_use]
    pub fn normal_area_m2(&self, alpha_rad: f64) -> (f64, f64) {
        self.normal_area_of(libm::sin(alpha_rad), libm::cos(alpha_rad))
    }

    /// [`Self::normal_area_m2`] from sin α and cos α; cos(α/2) = sqrt((1 + cos α)/2) for |α| ≤ 180°.
    fn normal_area_of(&self, s: f64, c: f64) -> (f64, f64) {
        let potential = self.munk_factor * self.potential_area_m2 * 2.0 * s * c * libm::sqrt(0.5 * (1.0 + c));
        (potential, self.crossflow_area_m2() * s * s.abs())
    }

    /// Eq. 10 as it stands, C_N on `reference_area_m2`: a1 α + a2 α|α|. Within 8 % of [`Self::normal_area_m2`] to 20°.
    #[must_use]
    pub fn normal_force_series(&self, alpha_rad: f64, reference_area_m2: f64) -> f64 {
        (self.linear_area_m2() * alpha_rad + self.crossflow_area_m2() * alpha_rad * alpha_rad.abs()) / reference_area_m2
    }

    /// Lift and drag areas, m².
    #[must_use]
    pub fn force_area_m2(&self, alpha_rad: f64) -> LiftDrag {
        self.force_area_with(self.axial_drag_area_m2(), libm::sin(alpha_rad), libm::cos(alpha_rad))
    }

    /// [`Self::force_area_m2`] with the axial drag area, sin α and cos α worked out before.
    pub(crate) fn force_area_with(&self, axial_drag_area_m2: f64, s: f64, c: f64) -> LiftDrag {
        let (potential, crossflow) = self.normal_area_of(s, c);
        let normal = potential + crossflow;
        let axial = axial_drag_area_m2 * c * c;
        LiftDrag { cl: normal * c - axial * s, cd: normal * s + axial * c }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slocum() -> Body {
        Body {
            length_m: 1.5,
            diameter_m: 0.213,
            wetted_area_m2: 0.9,
            planform_area_m2: 0.28,
            potential_area_m2: 0.021,
            munk_factor: 0.9,
            crossflow_eta: 0.652,
            crossflow_cd: 1.15,
            layer: Layer::Laminar,
            reynolds: 3e5,
        }
    }

    #[test]
    fn prop_lift_is_odd_and_drag_is_even() {
        let b = slocum();
        for i in 0..=90 {
            let a = f64::from(i).to_radians();
            let (p, m) = (b.force_area_m2(a), b.force_area_m2(-a));
            assert!((p.cl + m.cl).abs() < 1e-15 && (p.cd - m.cd).abs() < 1e-15);
            assert!((b.normal_force_series(a, 0.1) + b.normal_force_series(-a, 0.1)).abs() < 1e-15);
        }
        assert_eq!(b.force_area_m2(0.0).cl, 0.0);
    }

    #[test]
    fn body_is_linear_below_six_degrees_and_grows_faster_above() {
        let b = slocum();
        let (potential, crossflow) = b.normal_area_m2(6f64.to_radians());
        assert!(crossflow / (crossflow + potential) < 0.45);
        let normal = |deg: f64| {
            let (p, c) = b.normal_area_m2(deg.to_radians());
            p + c
        };
        for i in 7..25 {
            let d = f64::from(i);
            assert!(normal(d + 1.0) - 2.0 * normal(d) + normal(d - 1.0) > 0.0, "{i} deg: not convex");
        }
        // Drag least at zero.
        assert!((1..=250).all(|i| b.force_area_m2(f64::from(i) * 2e-3).cd > b.force_area_m2(0.0).cd));
    }

    #[test]
    fn accuracy_series_of_equation_10_to_twenty_degrees() {
        let b = slocum();
        for i in 1..=20 {
            let a = f64::from(i).to_radians();
            let (p, c) = b.normal_area_m2(a);
            // 8 %: sin 2α cos(α/2) against 2α and sin² α against α² at 20°.
            assert!((b.normal_force_series(a, 1.0) / (p + c) - 1.0).abs() < 0.08, "{i} deg: {}", b.normal_force_series(a, 1.0) / (p + c));
        }
    }
}
