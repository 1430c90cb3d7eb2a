//! The numbers of the moments in pitch that a vehicle file states.

/// The numbers of the moments in pitch, SI (FORMAT section 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PitchMoments {
    /// I, kg m².
    pub inertia_kg_m2: f64,
    /// h, m.
    pub metacentric_height_m: f64,
    /// m_b, kg.
    pub battery_mass_kg: f64,
    /// x_p, m.
    pub ballast_arm_m: f64,
    /// l, m.
    pub length_m: f64,
    /// cm_α, 1/rad on S l.
    pub cm_alpha: f64,
    /// cm_q, on S l².
    pub cm_q: f64,
    /// Tolerance of the battery's zero x_b0, m.
    pub battery_zero_m: f64,
}

/// Tolerance of the battery's zero where a file states none, m: as the format's examples.
const BATTERY_ZERO_M: f64 = 0.002;
impl PitchMoments {
    /// Those of a vehicle file, if it states all of them. `number` gives a key's value within its range, if it is there.
    pub(crate) fn stated<E>(number: impl Fn(&str, f64, f64, &str) -> Result<Option<f64>, E>) -> Result<Option<Self>, E> {
        let [inertia, height, battery, arm, length, alpha, q] = [
            number("pitch.inertia_kg_m2", 0.1, 1e4, "kg m2")?,
            number("pitch.metacentric_height_m", 1e-4, 1.0, "m")?,
            number("pitch.battery_mass_kg", 0.1, 1e3, "kg")?,
            number("pitch.ballast_arm_m", -10.0, 10.0, "m")?,
            number("pitch.length_m", 0.1, 20.0, "m")?,
            number("pitch.cm_alpha", -100.0, 100.0, "1/rad")?,
            number("pitch.cm_q", -1000.0, 0.0, "1")?,
        ];
        let zero = number("tolerance_1sigma.battpos_zero_m", 0.0, 1.0, "m")?.unwrap_or(BATTERY_ZERO_M);
        let all = || {
            Some(Self {
                inertia_kg_m2: inertia?,
                metacentric_height_m: height?,
                battery_mass_kg: battery?,
                ballast_arm_m: arm?,
                length_m: length?,
                cm_alpha: alpha?,
                cm_q: q?,
                battery_zero_m: zero,
            })
        };
        Ok(all())
    }
}
