//! In-situ density from what a CTD measures, by TEOS-10 (crate `gsw`).
//!
//! ```text
//! SP = f(C, t, p)                          practical salinity, PSS-78
//! SA = (35.16504 / 35) SP                  absolute salinity, g/kg; in the Baltic
//! SA = ((35.16504 − 0.087) / 35) SP + 0.087    (Feistel et al. 2010)
//! (T0 + t) = (T0 + θ) ∂h/∂Θ / cp0          in-situ from potential temperature (McDougall 2003), solved for θ
//! ρ  = ρ(SA, Θ(SA, θ), p)                  75-term polynomial
//! ```
//! Left out: the small regional anomaly of SA outside the Baltic (the crate has
//! no atlas); it is at most 0.027 g/kg (North Pacific), 0.02 kg/m³, and below
//! 0.005 kg/m³ in the Atlantic and its gulfs.

/// T0, K, 0 °C.
const ZERO_CELSIUS_K: f64 = 273.15;
/// cp0, J/(kg K), of TEOS-10.
const CP0: f64 = 3_991.867_957_119_63;
/// Standard-ocean salinity, g/kg.
const SSO: f64 = 35.165_04;

/// Place on the globe, degrees; east and north positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Longitude, deg.
    pub lon_deg: f64,
    /// Latitude, deg.
    pub lat_deg: f64,
}

impl Place {
    /// Whether the Baltic's own salinity relation holds (polygon of the TEOS-10 toolbox).
    #[must_use]
    pub fn is_baltic(self) -> bool {
        let between = |points: &[(f64, f64)]| {
            points.windows(2).find(|w| (w[0].0..=w[1].0).contains(&self.lat_deg)).map(|w| {
                let share = (self.lat_deg - w[0].0) / (w[1].0 - w[0].0);
                w[0].1 + share * (w[1].1 - w[0].1)
            })
        };
        let west = between(&[(50.0, 12.6), (59.0, 7.0), (69.0, 26.0)]);
        let east = between(&[(50.0, 45.0), (69.0, 26.0)]);
        matches!((west, east), (Some(w), Some(e)) if w < self.lon_deg && self.lon_deg < e)
    }
}

/// SP from conductivity, S/m, in-situ temperature, °C, pressure, dbar; NaN where the CTD was in air.
#[must_use]
pub fn practical_salinity(conductivity_s_m: f64, temperature_degc: f64, pressure_dbar: f64) -> f64 {
    // The crate wants mS/cm.
    gsw::practical_salinity::sp_from_c(conductivity_s_m * 10.0, temperature_degc, pressure_dbar.max(0.0)).unwrap_or(f64::NAN)
}

/// SA, g/kg.
#[must_use]
pub fn absolute_salinity(practical: f64, place: Option<Place>) -> f64 {
    if place.is_some_and(Place::is_baltic) { (SSO - 0.087) / 35.0 * practical + 0.087 } else { SSO / 35.0 * practical }
}

/// Practical salinity below this is a cell in air (about 0.001) and not the freshest lake (Superior: 0.05).
const AIR: f64 = 0.02;

/// ρ, kg/m³, from practical salinity, in-situ temperature, °C, pressure, dbar; NaN where the cell was in air.
#[must_use]
pub fn density_of_water(practical: f64, place: Option<Place>, temperature_degc: f64, pressure_dbar: f64) -> f64 {
    if !(practical > AIR) {
        return f64::NAN;
    }
    density(absolute_salinity(practical, place), temperature_degc, pressure_dbar)
}

/// Gauge pressure, Pa, at a depth, m, positive down (standard ocean); what lies above the surface has none.
#[must_use]
pub fn pressure_pa(depth_m: f64, lat_deg: f64) -> f64 {
    gsw::conversions::p_from_z(-depth_m, lat_deg, None, None).map_or(f64::NAN, |dbar| dbar * 1e4)
}

/// Depth, m, positive down, at a gauge pressure, Pa (standard ocean).
#[must_use]
pub fn depth_m(pressure_pa: f64, lat_deg: f64) -> f64 {
    -gsw::conversions::z_from_p(pressure_pa * 1e-4, lat_deg, 0.0, 0.0)
}

/// ρ, kg/m³, from SA, g/kg, in-situ temperature, °C, pressure, dbar; NaN outside the equation's range.
#[must_use]
pub fn density(absolute_salinity: f64, temperature_degc: f64, pressure_dbar: f64) -> f64 {
    density_or(absolute_salinity, temperature_degc, pressure_dbar.max(0.0)).unwrap_or(f64::NAN)
}

/// Speed of sound, m/s, from practical salinity, in-situ temperature, °C (taken for the conservative one: 0.1 K is 0.4 m/s), pressure,
/// dbar; NaN outside the equation's range.
#[must_use]
pub fn sound_speed_m_s(practical: f64, temperature_degc: f64, pressure_dbar: f64) -> f64 {
    gsw::volume::sound_speed(absolute_salinity(practical, None), temperature_degc, pressure_dbar.max(0.0)).unwrap_or(f64::NAN)
}

fn density_or(sa: f64, t: f64, p: f64) -> Result<f64, gsw::Error> {
    let mut theta = t;
    // Contraction by 1e-4 a step: three reach rounding.
    for _ in 0..4 {
        let ct = gsw::conversions::ct_from_pt(sa, theta)?;
        let (_, h_ct) = gsw::volume::enthalpy_first_derivatives(sa, ct, p)?;
        theta += t - ((ZERO_CELSIUS_K + theta) * h_ct / CP0 - ZERO_CELSIUS_K);
    }
    gsw::volume::rho(sa, gsw::conversions::ct_from_pt(sa, theta)?, p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check values of the TEOS-10 toolbox, gsw_rho_t_exact (its documentation's example):
    /// the 75-term polynomial differs from the exact function by less than 0.001 kg/m³ there.
    #[test]
    fn validate_density_against_the_toolbox_check_values() {
        let check = [
            (34.7118, 28.7856, 10.0, 1_021.840_173_185_531),
            (34.8915, 28.4329, 50.0, 1_022.262_689_926_782),
            (35.0256, 22.8103, 125.0, 1_024.427_715_941_676),
            (34.8472, 10.2600, 250.0, 1_027.790_201_811_623),
            (34.7366, 6.8863, 600.0, 1_029.837_714_725_961),
            (34.7324, 4.4036, 1000.0, 1_032.002_404_116_447),
        ];
        for (sa, t, p, rho) in check {
            let ours = density(sa, t, p);
            assert!((ours - rho).abs() < 0.001, "SA {sa}, t {t}, p {p}: {ours}, toolbox {rho}");
        }
    }

    #[test]
    fn the_baltic_is_found_and_the_gulf_of_mexico_is_not() {
        assert!(Place { lon_deg: 15.1, lat_deg: 54.75 }.is_baltic());
        assert!(!Place { lon_deg: -90.6, lat_deg: 27.4 }.is_baltic());
        assert!(!Place { lon_deg: 3.0, lat_deg: 54.75 }.is_baltic());
    }

    /// gsw_p_from_z of the TEOS-10 toolbox (Python package gsw 3.6.23) at 1000 m, 4 deg N.
    #[test]
    fn validate_pressure_from_depth_against_the_toolbox() {
        assert!((pressure_pa(1000.0, 4.0) * 1e-4 - 1_007.990_337_692_001_3).abs() < 1e-6);
        assert!(pressure_pa(-8.0, 4.0).is_nan());
    }

    #[test]
    fn air_has_no_density() {
        assert!(density_of_water(0.003, None, 20.0, 0.0).is_nan());
        assert!(density(f64::NAN, 20.0, 0.0).is_nan());
    }
}
