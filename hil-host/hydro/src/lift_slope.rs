//! Lift-curve slope of a wing against aspect ratio: equations 4, 5, 6, 9.
//!
//! Glossary: A aspect ratio (span²/area of whatever is called the wing: one
//! panel or the pair, see [`crate::geometry`]), Λ_c/2 sweep at half chord,
//! c_lα section slope. All slopes are per **radian** on the wing's own area;
//! eq. 9 is printed per degree and has both forms here.
//!
//! Limits every correct form obeys: A → 0 gives π A/2 (slender wing, R. T.
//! Jones), A → ∞ gives c_lα cos Λ. Eq. 4 misses the first (2.244 A instead of
//! 1.571 A with τ = 0.4), eq. 9 the second.

use core::f64::consts::PI;

/// τ, 1: departure of the planform from elliptic loading in eq. 4; 0.4, paper sec. III from Torres & Mueller 2004.
pub const TAU: f64 = 0.4;

/// Degrees per radian, 1; for eq. 9 alone, which its source states per degree.
const DEGREES_PER_RADIAN: f64 = 57.295_779_513_082_32;

/// Largest A eq. 9 may be used for, 1: it peaks at A = 4.27 and then falls; its source fits A ≤ 2.5–3.
pub const HOERNER_ASPECT_RATIO_MAX: f64 = 3.0;

/// Slender-wing limit π A/2, 1/rad. Range A ≤ 0.5 (within 5 % of lifting surfaces below 0.3).
#[must_use]
pub fn slender(aspect_ratio: f64) -> f64 {
    0.5 * PI * aspect_ratio
}

/// Eq. 4, Prandtl's lifting line: C_Lα = c_lα / [1 + c_lα (1 + τ)/(π A)], 1/rad.
///
/// As printed. Range A ≥ 4. Below, it tends to π A/(1 + τ) and not to π A/2: 29 % above eq. 9 at
/// A = 0.3155, against the paper's remark that eqs. 4 and 9 fit best (their source tested A ≥ 0.5).
#[must_use]
pub fn prandtl(section_slope_per_rad: f64, aspect_ratio: f64, tau: f64) -> f64 {
    section_slope_per_rad / (1.0 + section_slope_per_rad * (1.0 + tau) / (PI * aspect_ratio))
}

/// Eq. 5, Lowry & Polhamus (NACA TN 3911): C_Lα = 2πA / {2 + sqrt[A²/η² (1 + tan² Λ_c/2) + 4]}, 1/rad.
///
/// Printed as `2 + sqrt((A²/η²)(1 + tan² Λ)) + 4`, with the 4 outside the root: that tends to π A/3 for
/// A → 0 and stays below c_lα cos Λ at every A. Inside the root both limits hold. Range: any A, subsonic.
#[must_use]
pub fn lowry_polhamus(section_slope_per_rad: f64, aspect_ratio: f64, sweep_half_chord_rad: f64) -> f64 {
    let eta = crate::section::eta(section_slope_per_rad);
    let t = libm::tan(sweep_half_chord_rad);
    let a2 = aspect_ratio * aspect_ratio;
    2.0 * PI * aspect_ratio / (2.0 + libm::sqrt(a2 / (eta * eta) * (1.0 + t * t) + 4.0))
}

/// Eq. 5 exactly as printed (4 outside the root); kept so that the misprint's size can be shown, never used by a model.
#[must_use]
pub fn lowry_polhamus_as_printed(section_slope_per_rad: f64, aspect_ratio: f64, sweep_half_chord_rad: f64) -> f64 {
    let eta = crate::section::eta(section_slope_per_rad);
    let t = libm::tan(sweep_half_chord_rad);
    let a2 = aspect_ratio * aspect_ratio;
    2.0 * PI * aspect_ratio / (2.0 + libm::sqrt(a2 / (eta * eta) * (1.0 + t * t)) + 4.0)
}

/// Eq. 6, Roskam (= USAF DATCOM): C_Lα = 2πA / {2 + sqrt[A²β²/κ² (1 + tan² Λ_c/2 / β²) + 4]}, 1/rad.
///
/// Printed with κ² under tan² Λ (a second κ² instead of β², not dimension but limit fails: A → ∞ would not
/// give c_lα cos Λ) and with the 4 outside the root (as eq. 5). κ must be formed with the section slope at M
/// ([`crate::section::kappa`]). In water M = 2e-4 and eq. 6 equals eq. 5 to 1e-7. Range: M < 0.7.
#[must_use]
pub fn roskam(section_slope_per_rad: f64, aspect_ratio: f64, sweep_half_chord_rad: f64, mach: f64) -> f64 {
    let beta = crate::section::beta(mach);
    let kappa = crate::section::kappa(crate::section::compressible_slope_per_rad(section_slope_per_rad, mach), mach);
    let t = libm::tan(sweep_half_chord_rad);
    let (a2, b2) = (aspect_ratio * aspect_ratio, beta * beta);
    2.0 * PI * aspect_ratio / (2.0 + libm::sqrt(a2 * b2 / (kappa * kappa) * (1.0 + t * t / b2) + 4.0))
}

/// Eq. 9, Hoerner & Borst, thin rectangular plates: C_Lα = 1/(36.5/A + 2A), per **degree**.
///
/// As printed, but the paper mixes it with slopes per radian: 57.296/36.5 = 1.5698 = π/2 is the slender
/// limit, which proves the degree. Range A ≤ [`HOERNER_ASPECT_RATIO_MAX`].
#[must_use]
pub fn hoerner_borst_per_degree(aspect_ratio: f64) -> f64 {
    1.0 / (36.5 / aspect_ratio + 2.0 * aspect_ratio)
}

/// Eq. 9 per radian: [`hoerner_borst_per_degree`] · 57.2958.
#[must_use]
pub fn hoerner_borst(aspect_ratio: f64) -> f64 {
    DEGREES_PER_RADIAN * hoerner_borst_per_degree(aspect_ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::NACA0006_LIFT_SLOPE_PER_RAD as CLA;
    use core::f64::consts::FRAC_PI_4;

    /// One unit of the sixth significant digit: two independent calculations may round it differently.
    fn six_digits(value: f64) -> f64 {
        10f64.powi(value.log10().floor() as i32 - 5)
    }

    #[test]
    fn validate_slopes_to_six_digits() {
        // (A, eq. 4, eq. 5 unswept, eq. 5 at 45 deg or NaN, eq. 9), 1/rad; independently calculated.
        let rows = [
            (0.3155, 0.635_295, 0.492_448, 0.489_387, 0.492_569),
            (0.5, 0.949_784, 0.773_138, f64::NAN, 0.774_267),
            (2.0, 2.601_316, 2.590_860, 2.284_906, 2.575_090),
            (5.536, 4.130_523, 4.366_327, 3.411_086, 3.243_427),
        ];
        for (a, eq4, eq5, eq5_45, eq9) in rows {
            let got = [prandtl(CLA, a, TAU), lowry_polhamus(CLA, a, 0.0), hoerner_borst(a)];
            for (g, w) in got.iter().zip([eq4, eq5, eq9]) {
                assert!((g - w).abs() < six_digits(w), "A = {a}: {g} against {w}");
            }
            let swept = lowry_polhamus(CLA, a, FRAC_PI_4);
            assert!(eq5_45.is_nan() || (swept - eq5_45).abs() < six_digits(eq5_45), "A = {a} at 45 deg: {swept}");
        }
        assert!((hoerner_borst_per_degree(0.3155) - 0.008_596_95).abs() < 5.1e-9);
        assert!((slender(0.3155) - 0.495_586).abs() < six_digits(0.3));
        assert!((lowry_polhamus_as_printed(CLA, 0.3155, FRAC_PI_4) - 0.307_195).abs() < six_digits(0.3));
    }

    #[test]
    fn prop_slender_limit_holds_for_all_but_prandtl() {
        for i in 1..=50 {
            let a = f64::from(i) * 1e-3;
            // 1 % at A = 0.05 (reference reading), proportionally closer below.
            let tol = 0.01 * a / 0.05 + 1e-3;
            for sweep in [0.0, 0.5, FRAC_PI_4] {
                assert!((lowry_polhamus(CLA, a, sweep) / slender(a) - 1.0).abs() < tol);
                assert!((roskam(CLA, a, sweep, 2e-4) / slender(a) - 1.0).abs() < tol);
            }
            assert!((hoerner_borst(a) / slender(a) - 1.0).abs() < tol);
        }
        assert!((prandtl(CLA, 1e-6, TAU) / 1e-6 - PI / 1.4).abs() < 1e-4);
        assert!((lowry_polhamus_as_printed(CLA, 1e-6, 0.0) / 1e-6 - PI / 3.0).abs() < 1e-4);
    }

    #[test]
    fn prop_two_dimensional_limit_is_the_section_slope_times_cosine_of_sweep() {
        for i in 0..=60 {
            let sweep = f64::from(i).to_radians();
            let want = CLA * sweep.cos();
            // 2/A of the slope remains at A = 1e4: 4e-4.
            assert!((lowry_polhamus(CLA, 1e4, sweep) / want - 1.0).abs() < 4e-4, "{i}");
            assert!((roskam(CLA, 1e4, sweep, 2e-4) / want - 1.0).abs() < 4e-4, "{i}");
        }
        assert!((prandtl(CLA, 1e7, TAU) / CLA - 1.0).abs() < 1e-6);
    }

    #[test]
    fn prop_equation_6_is_equation_5_in_water() {
        for i in 1..=400 {
            let a = 0.05 * f64::from(i);
            for s in 0..=12 {
                let sweep = f64::from(5 * s).to_radians();
                let (five, six) = (lowry_polhamus(CLA, a, sweep), roskam(CLA, a, sweep, 2e-4));
                assert!((six / five - 1.0).abs() < 1e-7, "A = {a}, sweep {s}");
            }
        }
    }

    #[test]
    fn prop_slopes_grow_with_aspect_ratio_inside_their_ranges() {
        for i in 1..1000 {
            let (a, b) = (0.01 * f64::from(i), 0.01 * f64::from(i + 1));
            assert!(prandtl(CLA, b, TAU) > prandtl(CLA, a, TAU));
            assert!(lowry_polhamus(CLA, b, 0.3) > lowry_polhamus(CLA, a, 0.3));
            assert!(b > HOERNER_ASPECT_RATIO_MAX || hoerner_borst(b) > hoerner_borst(a));
        }
        // Its peak, beyond its range: A = sqrt(36.5/2).
        assert!(hoerner_borst(4.28) < hoerner_borst(4.272) && hoerner_borst(4.26) < hoerner_borst(4.272));
    }
}
