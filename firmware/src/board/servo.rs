//! The fin's servo: pulses of TIM4 channel 3 on PB8, 20,000 steps of 1 µs.

use core::convert::Infallible;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use stm32f4::stm32f405::TIM4;

/// Steps of a period of 20 ms.
const STEPS: u16 = 20_000;

/// The timer, running; no pulse until the first angle.
pub struct Servo(TIM4);

impl Servo {
    /// Starts it.
    pub fn start(timer: TIM4) -> Self {
        timer.psc().write(|w| w.psc().set((super::clock::CORE_HZ / 1_000_000 - 1) as u16));
        timer.arr().write(|w| w.arr().set(STEPS.into()));
        timer.ccmr2_output().write(|w| w.oc3m().pwm_mode1().oc3pe().enabled());
        timer.ccer().write(|w| w.cc3e().set_bit());
        timer.cr1().write(|w| w.arpe().enabled().cen().enabled());
        Self(timer)
    }
}

impl ErrorType for Servo {
    type Error = Infallible;
}

impl SetDutyCycle for Servo {
    fn max_duty_cycle(&self) -> u16 {
        STEPS
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.ccr3().write(|w| w.ccr().set(duty.into()));
        if duty == 0 {
            // At once, and not at the end of the period: the timer may be about to stand still.
            self.0.egr().write(|w| w.ug().set_bit());
        }
        Ok(())
    }
}
