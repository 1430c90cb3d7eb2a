//! Drag: equations 14, 15, 16, friction laws and the zero-suction bound.
//!
//! ```text
//! C_D  = C_D0 + K C_L²                 (14)
//! C_D0 = 2 C_f F   wing on its area;  C_f F S_wet/S   hull     (15)
//! K    = 1/(π e A)                     (16)
//! K C_L² ≤ C_L tan α                   zero-suction bound
//! ```
//! Eq. 14 holds for attached lift. Vortex and cross-flow lift act normal to the plate, so their drag is C_L tan α:
//! no leading-edge suction is left. With A = 0.3155, e = 0.85 eq. 14 exceeds that bound above 10–15°, which alone
//! makes the paper's low-aspect-ratio model too draggy at large α.

use core::f64::consts::PI;

/// Eq. 14: C_D = C_D0 + K C_L², 1. Range: attached lift.
#[must_use]
pub fn parabolic(cd0: f64, k: f64, cl: f64) -> f64 {
    cd0 + k * cl * cl
}

/// Eq. 15 for a wing: C_D0 = 2 C_f F on the wing's area, 1 (both sides are wetted).
///
/// Printed as C_D0 = C_f; C_f is per *wetted* area, so the printed form halves the wing's friction.
#[must_use]
pub fn wing_cd0(cf: f64, form_factor: f64) -> f64 {
    2.0 * cf * form_factor
}

/// Eq. 15 for a hull, as drag area, m²: C_f F S_wet.
#[must_use]
pub fn hull_drag_area_m2(cf: f64, form_factor: f64, wetted_area_m2: f64) -> f64 {
    cf * form_factor * wetted_area_m2
}

/// Eq. 16: K = 1/(π e A), 1. As printed; the paper used an empirical K whose value it does not give.
#[must_use]
pub fn induced_factor(oswald_e: f64, aspect_ratio: f64) -> f64 {
    1.0 / (PI * oswald_e * aspect_ratio)
}

/// Largest drag due to lift a flat plate can have, 1: C_L tan α (no suction at any edge). Range |α| < 90°.
#[must_use]
pub fn zero_suction(cl: f64, alpha_rad: f64) -> f64 {
    cl * libm::tan(alpha_rad)
}

/// State of the boundary layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Blasius: C_f = 1.328 Re^-1/2; Re below about 5e5 on a smooth plate.
    Laminar,
    /// Prandtl: C_f = 0.074 Re^-1/5 − nothing for a laminar run; 5e5 < Re < 1e7, used below as an upper bound.
    Turbulent,
}

/// Friction coefficient of a flat plate on its wetted area, 1, at Reynolds number `reynolds`.
#[must_use]
pub fn friction(layer: Layer, reynolds: f64) -> f64 {
    match layer {
        Layer::Laminar => 1.328 / libm::sqrt(reynolds),
        // 0.455/(log10 Re)^2.58, Prandtl–Schlichting: 0.00565 at 3e5.
        Layer::Turbulent => 0.455 / libm::pow(libm::log10(reynolds), 2.58),
    }
}

/// Form factor of a streamlined body, 1: 1 + 1.5 (d/l)^1.5 + 7 (d/l)³ (Hoerner, Fluid-Dynamic Drag, 1965, from memory).
#[must_use]
pub fn body_form_factor(diameter_over_length: f64) -> f64 {
    let x = diameter_over_length;
    1.0 + 1.5 * x * libm::sqrt(x) + 7.0 * x * x * x
}

/// How drag follows from a low-aspect-ratio wing's lift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DragRule {
    /// Eq. 14 at any α: the paper's choice.
    Parabolic,
    /// Eq. 14, but never above the zero-suction bound.
    Bounded,
    /// C_L tan α: sharp or thin edges, all lift normal to the plate.
    ZeroSuction,
}

/// Drag due to lift by a rule, 1.
#[must_use]
pub fn due_to_lift(rule: DragRule, k: f64, cl: f64, alpha_rad: f64) -> f64 {
    match rule {
        DragRule::Parabolic => k * cl * cl,
        DragRule::ZeroSuction => zero_suction(cl, alpha_rad),
        DragRule::Bounded => {
            let (parabolic, bound) = (k * cl * cl, zero_suction(cl, alpha_rad));
            if parabolic < bound { parabolic } else { bound }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validate_friction_and_induced_numbers() {
        // Reference reading: Blasius 0.00242, turbulent 0.00565 at 3e5: factor 2.3.
        assert!((friction(Layer::Laminar, 3e5) - 0.002_42).abs() < 5e-6);
        assert!((friction(Layer::Turbulent, 3e5) - 0.005_65).abs() < 5e-5);
        assert!((induced_factor(0.85, 5.536) - 0.067_645).abs() < 1e-5);
        assert!((wing_cd0(0.01, 1.0) - 0.02).abs() < 1e-15);
        assert_eq!(parabolic(0.02, 0.1, 0.5), 0.045);
        // Equivalent zero-suction K = tan α/C_L of the rail wing: 1.2 at 10°, 1.0 at 15°, 0.78 at 25°: not a constant.
        for (deg, want) in [(10.0, 1.2), (15.0, 1.0), (25.0, 0.78)] {
            let a = f64::to_radians(deg);
            let cl = crate::wing::bartlett_vidal(0.4925, 2.0, a);
            assert!((a.tan() / cl - want).abs() < 0.06 * want, "{deg}: {}", a.tan() / cl);
        }
    }

    #[test]
    fn prop_bounded_drag_never_exceeds_either_rule() {
        let k = induced_factor(0.85, 0.3155);
        for i in -45..=45 {
            let a = f64::from(i).to_radians();
            let cl = crate::wing::bartlett_vidal(0.4925, 2.0, a);
            let [p, b, z] = [DragRule::Parabolic, DragRule::Bounded, DragRule::ZeroSuction].map(|r| due_to_lift(r, k, cl, a));
            assert!(b <= p && b <= z && b >= 0.0, "{i}");
            let m = due_to_lift(DragRule::Bounded, k, -cl, -a);
            assert!((m - b).abs() < 1e-15);
        }
        // Eq. 14 breaks the bound above 10–15° as the module says.
        let breaks = |deg: f64| {
            let a = deg.to_radians();
            let cl = crate::wing::bartlett_vidal(0.4925, 2.0, a);
            k * cl * cl > zero_suction(cl, a)
        };
        assert!(!breaks(8.0) && breaks(15.0) && breaks(25.0));
    }
}
