//! NXP MPXA6115A: pressure inside the hull, through the ADC.
//!
//! V_out = V_s (0.009 P − 0.095), P in kPa, 15..115 kPa (datasheet figure 4).

use crate::Error;

/// Supply of the sensor, V; its output is halved by the board before the ADC.
const SUPPLY_V: f32 = 5.0;
const DIVIDER: f32 = 2.0;

/// Internal pressure, Pa absolute, for the ADC's voltage.
///
/// # Errors
/// [`Error::Range`] outside 15..115 kPa: wire broken or sensor dead.
pub fn pascals(adc_v: f32) -> Result<f32, Error> {
    let pa = ((adc_v * DIVIDER / SUPPLY_V + 0.095) / 0.009) * 1000.0;
    if (15_000.0..=115_000.0).contains(&pa) { Ok(pa) } else { Err(Error::Range) }
}

#[cfg(test)]
mod tests {
    use super::pascals;

    #[test]
    fn follows_the_datasheet_and_refuses_a_broken_wire() {
        // 100 kPa: 5 V × (0.9 − 0.095) = 4.025 V, halved.
        assert!((pascals(2.0125).unwrap() - 100_000.0).abs() < 10.0);
        assert!(pascals(0.0).is_err());
        assert!(pascals(2.5).is_err());
        assert!(pascals(f32::NAN).is_err());
    }
}
