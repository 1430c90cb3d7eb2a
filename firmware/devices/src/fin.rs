//! A servo that sets the fin: 50 Hz pulses, 1.1..1.9 ms over ±0.5 rad (Hitec
//! D646WP, 1.5 ms is the middle). Centred when the wish is not a number.

use embedded_hal::pwm::SetDutyCycle;

const PERIOD_US: f32 = 20_000.0;
const MIDDLE_US: f32 = 1_500.0;
const US_PER_RAD: f32 = 800.0;
const RANGE_RAD: f32 = 0.5;

/// Sets the fin, rad, positive turns to starboard; `false` if the timer refuses.
pub fn set(servo: &mut impl SetDutyCycle, fin_rad: f32) -> bool {
    let fin_rad = if fin_rad.is_finite() { fin_rad } else { 0.0 };
    let pulse_us = MIDDLE_US + US_PER_RAD * fin_rad.clamp(-RANGE_RAD, RANGE_RAD);
    let duty = pulse_us / PERIOD_US * f32::from(servo.max_duty_cycle());
    servo.set_duty_cycle(duty as u16).is_ok()
}

/// No pulses: a servo without supply must not be fed through its signal.
pub fn off(servo: &mut impl SetDutyCycle) -> bool {
    servo.set_duty_cycle(0).is_ok()
}

#[cfg(test)]
mod tests {
    use embedded_hal_mock::eh1::pwm::{Mock, Transaction};

    #[test]
    fn angles_become_pulses_within_the_servos_range() {
        // Timer of 20,000 steps: one step is one microsecond.
        for (rad, us) in [(0.0, 1500), (0.25, 1700), (9.0, 1900), (-9.0, 1100), (f32::NAN, 1500)] {
            let mut pwm = Mock::new(&[Transaction::max_duty_cycle(20_000), Transaction::set_duty_cycle(us)]);
            assert!(super::set(&mut pwm, rad));
            pwm.done();
        }
    }
}
