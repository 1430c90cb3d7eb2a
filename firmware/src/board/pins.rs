//! Single pins as embedded-hal sees them.

use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use stm32f4::stm32f405::{GPIOA, GPIOB, GPIOC, gpioa};

/// Port of a pin. Zero is left free for "no pin", so that a static without
/// one is all zeros and takes no flash.
#[derive(Clone, Copy)]
pub enum Port {
    B = 1,
    C = 2,
    A = 3,
}

/// How a pin drives.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    /// High and low.
    PushPull,
    /// Low only, pulled up.
    OpenDrain,
    /// Not at all: an input, pulled down.
    Sense,
    /// An input, pulled up.
    Strap,
}

/// One general-purpose pin that can be read.
pub struct Pin {
    port: Port,
    bit: u32,
}

impl Pin {
    /// Makes it an output, low (push-pull) or released (open drain), or an input.
    pub fn new(port: Port, bit: u32, drive: Drive) -> Self {
        let mut pin = Self { port, bit: bit & 15 };
        let open = drive == Drive::OpenDrain;
        let one = |value: u32| value.wrapping_shl(pin.bit);
        let two = |value: u32| value.wrapping_shl(2 * pin.bit);
        let (mode, pull) = match drive {
            Drive::PushPull => (1, 0),
            Drive::OpenDrain => (1, 1),
            Drive::Sense => (0, 2),
            Drive::Strap => (0, 1),
        };
        let (mask, both, output, pull) = (one(1), two(3), two(mode), two(pull));
        pin.put(open);
        let registers = pin.registers();
        // SAFETY: only this pin's bits change; every pin has one owner (see `own`).
        unsafe {
            registers.otyper().modify(|r, w| w.bits(if open { r.bits() | mask } else { r.bits() & !mask }));
            registers.pupdr().modify(|r, w| w.bits(r.bits() & !both | pull));
            registers.moder().modify(|r, w| w.bits(r.bits() & !both | output));
        }
        pin
    }

    fn registers(&self) -> &'static gpioa::RegisterBlock {
        // SAFETY: the ports have the same registers as far as they are
        // used here; set and reset go through BSRR, which is atomic.
        unsafe {
            match self.port {
                Port::A => &*GPIOA::ptr(),
                Port::B => &*GPIOB::ptr().cast(),
                Port::C => &*GPIOC::ptr().cast(),
            }
        }
    }

    fn put(&mut self, high: bool) {
        let mask = 1u32.wrapping_shl(if high { self.bit } else { self.bit.wrapping_add(16) });
        // SAFETY: BSRR takes any bits; one is set.
        self.registers().bsrr().write(|w| unsafe { w.bits(mask) });
    }
}

impl ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.put(false);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.put(true);
        Ok(())
    }
}

impl InputPin for Pin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.registers().idr().read().bits().wrapping_shr(self.bit) & 1 == 1)
    }
    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

impl pwm::ErrorType for Pin {
    type Error = Infallible;
}

/// Fully on or fully off: all that the motors ask for.
impl SetDutyCycle for Pin {
    fn max_duty_cycle(&self) -> u16 {
        1
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.put(duty > 0);
        Ok(())
    }
}

/// Waiting by counting cycles.
#[derive(Clone, Copy)]
pub struct Wait;

impl embedded_hal::delay::DelayNs for Wait {
    fn delay_ns(&mut self, ns: u32) {
        // 16 cycles per µs; never less than asked.
        cortex_m::asm::delay(ns / 62 + 1);
    }
}
