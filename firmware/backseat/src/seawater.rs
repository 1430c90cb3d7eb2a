//! Density from conductivity, temperature and pressure, in f32 on the board.
//!
//! Practical salinity of 1978 and equation of state of 1980 (UNESCO technical papers in marine science 44, 1983). Valid for 2..42, −2..40
//! °C, 0..10,000 dbar; below 2 the salinity's error is below 0.1, 0.08 kg/m³. Against TEOS-10 the density differs by less than 0.05
//! kg/m³ in the sea above 1000 m. Temperatures of 1990 are taken for those of 1968 (0.01 K at 40 °C, below the sensor's noise in density).

/// Conductivity of sea water of 35, 15 °C, 0 dbar, S/m.
const C_35_15_0: f32 = 4.2914;

/// c0 + x (c1 + x (c2 + …)).
fn polynomial<const N: usize>(c: [f32; N], x: f32) -> f32 {
    c.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Practical salinity; 0 where there is none.
#[must_use]
pub fn practical_salinity(conductivity_s_m: f32, temperature_degc: f32, pressure_dbar: f32) -> f32 {
    let (r, t, p) = (conductivity_s_m / C_35_15_0, temperature_degc, pressure_dbar);
    let for_pressure =
        p * polynomial([2.070e-5, -6.370e-10, 3.989e-15], p) / (1.0 + 3.426e-2 * t + 4.464e-4 * t * t + (0.4215 - 3.107e-3 * t) * r);
    let of_temperature = polynomial([0.676_609_7, 2.005_64e-2, 1.104_259e-4, -6.969_8e-7, 1.003_1e-9], t);
    let ratio = r / (of_temperature * (1.0 + for_pressure));
    if !(ratio > 0.0 && ratio < 4.0) {
        return 0.0;
    }
    let root = libm::sqrtf(ratio);
    let main = polynomial([0.0080, -0.1692, 25.3851, 14.0941, -7.0261, 2.7081], root);
    let warm = polynomial([0.0005, -0.0056, -0.0066, -0.0375, 0.0636, -0.0144], root);
    let salinity = main + (t - 15.0) / (1.0 + 0.0162 * (t - 15.0)) * warm;
    if salinity > 0.0 { salinity } else { 0.0 }
}

/// In-situ density, kg/m³.
#[must_use]
pub fn density_kg_m3(salinity: f32, temperature_degc: f32, pressure_dbar: f32) -> f32 {
    let (s, t, bar) = (salinity, temperature_degc, pressure_dbar * 0.1);
    let s32 = s * libm::sqrtf(s);
    // Over 1000 kg/m³: f32 has steps of 6e-5 there.
    let sigma = polynomial([-0.157_406, 6.793_952e-2, -9.095_290e-3, 1.001_685e-4, -1.120_083e-6, 6.536_332e-9], t)
        + s * polynomial([0.824_493, -4.089_9e-3, 7.643_8e-5, -8.246_7e-7, 5.387_5e-9], t)
        + s32 * polynomial([-5.724_66e-3, 1.022_7e-4, -1.654_6e-6], t)
        + s * s * 4.831_4e-4;
    let k0 = polynomial([19_652.21, 148.420_6, -2.327_105, 1.360_477e-2, -5.155_288e-5], t)
        + s * polynomial([54.674_6, -0.603_459, 1.099_87e-2, -6.167_0e-5], t)
        + s32 * polynomial([7.944e-2, 1.648_3e-2, -5.300_9e-4], t);
    let a = polynomial([3.239_908, 1.437_13e-3, 1.160_92e-4, -5.779_05e-7], t)
        + s * polynomial([2.283_8e-3, -1.098_1e-5, -1.607_8e-6], t)
        + s32 * 1.910_75e-4;
    let b = polynomial([8.509_35e-5, -6.122_93e-6, 5.278_7e-8], t) + s * polynomial([-9.934_8e-7, 2.081_6e-8, 9.169_7e-10], t);
    let modulus = k0 + bar * (a + bar * b);
    (1000.0 + sigma) / (1.0 - bar / modulus)
}

#[cfg(test)]
mod tests {
    use super::{C_35_15_0, density_kg_m3, practical_salinity};

    /// Check values printed in UNESCO technical papers in marine science 44.
    #[test]
    fn validate_against_the_check_values_of_the_standards() {
        for (ratio, t, p, salinity) in [(1.0, 15.0, 0.0, 35.0), (1.2, 20.0, 2000.0, 37.245_628), (0.65, 5.0, 1500.0, 27.995_347)] {
            let s = practical_salinity(ratio * C_35_15_0, t, p);
            assert!((s - salinity).abs() < 2e-4, "{s} {salinity}");
        }
        for (s, t, p, density) in [
            (0.0, 5.0, 0.0, 999.966_75),
            (35.0, 5.0, 0.0, 1027.67547),
            (35.0, 25.0, 0.0, 1023.34306),
            (0.0, 5.0, 10_000.0, 1044.12802),
            (35.0, 5.0, 10_000.0, 1069.48914),
            (35.0, 25.0, 10_000.0, 1062.53817),
        ] {
            let rho = density_kg_m3(s, t, p);
            assert!((rho - density).abs() < 5e-4, "{s} {t} {p}: {rho} {density}");
        }
    }

    #[test]
    fn air_and_nonsense_give_no_salt() {
        assert!(practical_salinity(1e-5, 24.3, 0.0) < 0.05);
        assert_eq!(practical_salinity(f32::NAN, 10.0, 0.0), 0.0);
        assert_eq!(practical_salinity(-1.0, 10.0, 0.0), 0.0);
    }
}
