//! The log flash's bus: SPI2 on PB13 (clock), PB14 (in), PB15 (out), with
//! PB12 as chip select; mode 0, 8 MHz.
//!
//! Every wait is bounded: a bus that does not answer (QEMU's) is an error and
//! never a stop.

use super::pins::{Drive, Pin, Port, Wait};
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use stm32f4::stm32f405::SPI2;

/// Longest wait for one byte, loops of ≥ 4 cycles: 25 µs, 25 byte times.
const BYTE_WAIT: u32 = 100;

/// The bus with the one part on it.
pub struct Spi {
    port: SPI2,
    select: Pin,
}

impl Spi {
    /// Takes the block and the chip select.
    pub fn open(port: SPI2) -> Self {
        let mut select = Pin::new(Port::B, 12, Drive::PushPull);
        let Ok(()) = select.set_high();
        port.cr1().write(|w| w.mstr().master().ssm().enabled().ssi().slave_not_selected().br().div2().spe().enabled());
        Self { port, select }
    }

    fn byte(&mut self, out: u8) -> Result<u8, ErrorKind> {
        if !(0..BYTE_WAIT).any(|_| self.port.sr().read().txe().bit_is_set()) {
            return Err(ErrorKind::Other);
        }
        self.port.dr().write(|w| w.dr().set(u16::from(out)));
        if !(0..BYTE_WAIT).any(|_| self.port.sr().read().rxne().bit_is_set()) {
            return Err(ErrorKind::Other);
        }
        Ok(self.port.dr().read().dr().bits() as u8)
    }

    fn run(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        for operation in operations {
            match operation {
                Operation::Read(words) => words.iter_mut().try_for_each(|word| self.byte(0).map(|got| *word = got))?,
                Operation::Write(words) => words.iter().try_for_each(|word| self.byte(*word).map(|_| ()))?,
                Operation::TransferInPlace(words) => words.iter_mut().try_for_each(|word| self.byte(*word).map(|got| *word = got))?,
                Operation::DelayNs(ns) => Wait.delay_ns(*ns),
                // The driver has no use for it.
                Operation::Transfer(..) => return Err(ErrorKind::Other),
            }
        }
        Ok(())
    }
}

impl ErrorType for Spi {
    type Error = ErrorKind;
}

impl SpiDevice for Spi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let Ok(()) = self.select.set_low();
        let done = self.run(operations);
        let Ok(()) = self.select.set_high();
        done
    }
}
