//! The wing section and what compressibility would do to it: equations 1, 2, 3, 7, 8.
//!
//! Both wing sets are taken as NACA 0006 (paper sec. III): thin, symmetric, close to a flat plate.

/// Eq. 1: c_lα, 1/rad, section lift slope of NACA 0006; paper eq. 1, = 0.108 per degree (Roskam Part VI;
/// Abbott & von Doenhoff at Re 9e6). Range: attached flow, |α| below about 7°.
pub const NACA0006_LIFT_SLOPE_PER_RAD: f64 = 6.188;

/// Eq. 2: c_l,max, 1, of NACA 0006; paper eq. 2. A high-Re value (9e6): at the chord Reynolds numbers of a glider
/// (2e4 to 1e5) about 0.6–0.7 (literature from memory). Not used by the L/D model.
pub const NACA0006_CL_MAX: f64 = 0.92;

/// Eq. 3: α at c_l,max, rad (9.0°); paper eq. 3. A high-Re value: about 7–8° at glider chord Re (from memory).
/// Not used by the L/D model.
pub const NACA0006_ALPHA_CL_MAX_RAD: f64 = 0.157_079_632_679_489_66;

/// Speed of sound in sea water, m/s: 1480 (textbook value for 10 °C at the surface; between 1400 and 1580 anywhere).
pub const SOUND_SPEED_WATER_M_S: f64 = 1480.0;

/// Eq. 7: β = (1 − M²)^1/2, 1, Prandtl–Glauert factor at Mach number `mach`.
///
/// As printed. Range 0 ≤ M < 1; a glider has M = 0.3/1480 = 2e-4, so 1 − β = 2e-8.
#[must_use]
pub fn beta(mach: f64) -> f64 {
    libm::sqrt(1.0 - mach * mach)
}

/// Eq. 8: κ = c_lα(M) / (2π/β), 1: section slope at M over its thin-aerofoil value.
///
/// As printed; `section_slope_per_rad` must be the one *at that M* (see [`compressible_slope_per_rad`]).
#[must_use]
pub fn kappa(section_slope_per_rad: f64, mach: f64) -> f64 {
    section_slope_per_rad * beta(mach) / (2.0 * core::f64::consts::PI)
}

/// c_lα at Mach number M by Prandtl–Glauert, 1/rad: c_lα(0)/β. Range M < 0.7.
#[must_use]
pub fn compressible_slope_per_rad(section_slope_per_rad: f64, mach: f64) -> f64 {
    section_slope_per_rad / beta(mach)
}

/// η = c_lα / 2π, 1 (text below eq. 5); 0.98485 for eq. 1.
#[must_use]
pub fn eta(section_slope_per_rad: f64) -> f64 {
    section_slope_per_rad / (2.0 * core::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validate_the_constants_are_the_papers() {
        assert_eq!((NACA0006_LIFT_SLOPE_PER_RAD, NACA0006_CL_MAX), (6.188, 0.92));
        assert!((NACA0006_ALPHA_CL_MAX_RAD.to_degrees() - 9.0).abs() < 1e-12);
        // 0.108 per degree, the tabulated value, to its three digits.
        assert!((NACA0006_LIFT_SLOPE_PER_RAD / 57.295_779_513 - 0.108).abs() < 5e-6);
        assert!((eta(NACA0006_LIFT_SLOPE_PER_RAD) - 0.984_85).abs() < 5e-6);
    }

    #[test]
    fn water_is_incompressible_for_a_glider() {
        let m = 0.3 / SOUND_SPEED_WATER_M_S;
        assert!((1.0 - beta(m)).abs() < 3e-8);
        let at_m = compressible_slope_per_rad(NACA0006_LIFT_SLOPE_PER_RAD, m);
        assert!((kappa(at_m, m) / eta(NACA0006_LIFT_SLOPE_PER_RAD) - 1.0).abs() < 1e-12);
    }
}
