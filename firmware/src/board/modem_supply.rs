//! The modem's supply, PC11, and its serial lines with it: driven while it has its supply, inputs pulled down while it has not. A part
//! without supply is not fed through its inputs.

use super::pins::{Drive, Pin, Port};
use super::registers::Registers;
use core::convert::Infallible;
use devices::pins::{MODEM, connect, release};
use embedded_hal::digital::{ErrorType, OutputPin};

/// The switch, off.
pub struct ModemSupply {
    switch: Pin,
    registers: Registers,
}

impl ModemSupply {
    /// Off. `registers`: for the pins of the modem's lines, which nobody else sets up from here on.
    pub fn new(registers: Registers) -> Self {
        Self { switch: Pin::new(Port::C, 11, Drive::PushPull), registers }
    }
}

impl ErrorType for ModemSupply {
    type Error = Infallible;
}

impl OutputPin for ModemSupply {
    fn set_low(&mut self) -> Result<(), Infallible> {
        MODEM.iter().for_each(|pin| release(&mut self.registers, pin));
        self.switch.set_low()
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        let Ok(()) = self.switch.set_high();
        MODEM.iter().for_each(|pin| connect(&mut self.registers, pin));
        Ok(())
    }
}
