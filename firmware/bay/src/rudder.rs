//! The fin's servo, and when it has its supply: while the fin is on its way, and once a minute. Its gear holds it in between.

use crate::supplies::{FIN_HOLD_MS, FIN_RATE_RAD_S, Supply};
use devices::fin;
use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

/// Nearer than this to where it was told it is left there, rad: the dead band of its gear (guess).
const DEAD_RAD: f32 = 0.005;
/// It is told again after this time, ms.
const AGAIN_MS: u64 = 60_000;
/// The whole way, rad: where the fin is at first nobody knows.
const WHOLE_RAD: f32 = 1.0;

/// Servo and supply.
#[derive(Debug)]
pub struct Rudder<S, O> {
    servo: S,
    supply: Supply<O>,
    /// What it was told, and when.
    told: Option<(f32, u64)>,
    /// Until when it is on its way, ms.
    until_ms: u64,
}

impl<S: SetDutyCycle, O: OutputPin> Rudder<S, O> {
    /// Off.
    pub const fn new(servo: S, supply: Supply<O>) -> Self {
        Self { servo, supply, told: None, until_ms: 0 }
    }

    /// Towards an angle, rad; what is no number is the middle.
    pub fn look(&mut self, wanted_rad: f32, now_ms: u64) {
        let wanted_rad = if wanted_rad.is_finite() { wanted_rad } else { 0.0 };
        let way_rad = self.told.map_or(WHOLE_RAD, |(told, _)| (wanted_rad - told).abs());
        let again = self.told.is_none_or(|(_, at_ms)| now_ms.saturating_sub(at_ms) >= AGAIN_MS);
        if way_rad > DEAD_RAD || again {
            self.supply.put(true);
            let _ = fin::set(&mut self.servo, wanted_rad);
            self.told = Some((wanted_rad, now_ms));
            let way_ms = (way_rad.min(WHOLE_RAD) / FIN_RATE_RAD_S * 1e3) as u64;
            // A way that was not ended is still to be made.
            let left_ms = self.until_ms.saturating_sub(now_ms);
            self.until_ms = now_ms.saturating_add(way_ms).saturating_add(left_ms.max(FIN_HOLD_MS));
        } else if now_ms >= self.until_ms {
            self.rest();
        }
    }

    /// When the next look is due; none: it rests.
    pub const fn due_ms(&self) -> Option<u64> {
        if self.supply.is_on() { Some(self.until_ms) } else { None }
    }

    /// Neither pulses nor supply.
    pub fn rest(&mut self) {
        let _ = fin::off(&mut self.servo);
        self.supply.put(false);
    }
}

#[cfg(test)]
mod tests {
    use super::Rudder;
    use crate::supplies::Supply;
    use core::convert::Infallible;
    use std::cell::Cell;
    use std::rc::Rc;

    #[derive(Clone, Default)]
    struct Pin(Rc<Cell<u16>>);
    impl embedded_hal::digital::ErrorType for Pin {
        type Error = Infallible;
    }
    impl embedded_hal::digital::OutputPin for Pin {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.set(0);
            Ok(())
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0.set(1);
            Ok(())
        }
    }
    impl embedded_hal::pwm::ErrorType for Pin {
        type Error = Infallible;
    }
    impl embedded_hal::pwm::SetDutyCycle for Pin {
        fn max_duty_cycle(&self) -> u16 {
            20_000
        }
        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0.set(duty);
            Ok(())
        }
    }

    #[test]
    fn the_servo_has_its_supply_while_the_fin_moves() {
        let (servo, supply) = (Pin::default(), Pin::default());
        let mut rudder = Rudder::new(servo.clone(), Supply::new(supply.clone()));
        let mut at = |wanted: f32, now_ms: u64| {
            rudder.look(wanted, now_ms);
            (supply.0.get(), servo.0.get())
        };
        assert_eq!(at(0.0, 0), (1, 1_500), "the first time it may have the whole way to go");
        assert_eq!(at(0.0, 10_299), (1, 1_500));
        assert_eq!(at(0.0, 10_300), (0, 0), "no pulses without supply");
        assert_eq!(at(0.004, 10_400), (0, 0), "its gear has more play");
        assert_eq!(at(0.1, 20_000), (1, 1_580));
        assert_eq!(at(0.25, 20_500), (1, 1_700), "a new wish on the way");
        assert_eq!(at(0.25, 22_799), (1, 1_700));
        assert_eq!(at(0.25, 22_800), (0, 0));
        assert_eq!(at(0.25, 80_400), (0, 0));
        assert_eq!(at(0.25, 80_500), (1, 1_700), "once a minute");
        assert_eq!(at(f32::NAN, 90_000), (1, 1_500));
    }
}
