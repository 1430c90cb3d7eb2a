//! The chip's own flash, where the images lie: registers and memory for [`devices::chip_flash`].

use super::clock;
use devices::chip_flash::{Memory, starts_erase};
use devices::options::starts_programming;
use devices::registers::Registers;
use stm32f4::stm32f405::TIM2;

/// The way to the controller and to the slots of images.
#[derive(Debug)]
pub struct ChipFlash(());

impl ChipFlash {
    /// The handle.
    ///
    /// # Safety
    /// Nobody else may be using the flash controller.
    pub const unsafe fn new() -> Self {
        Self(())
    }
}

impl Registers for ChipFlash {
    fn read(&mut self, address: u32) -> u32 {
        // SAFETY: a register of the controller, by the driver's table.
        unsafe { core::ptr::read_volatile(address as *const u32) }
    }

    fn write(&mut self, address: u32, value: u32) {
        if !starts_erase(address, value) && !starts_programming(address, value) {
            // SAFETY: a register of the controller, or a word of a slot or the journal.
            return unsafe { core::ptr::write_volatile(address as *mut u32, value) };
        }
        // The processor stands still until the sector is erased; TIM2 counts on from the same 16 MHz.
        // SAFETY: reading a counter has no effect.
        let count = || unsafe { (*TIM2::ptr()).cnt().read().bits() };
        let (began_ms, began) = (clock::now_ms(), count());
        // SAFETY: as above.
        unsafe { core::ptr::write_volatile(address as *mut u32, value) };
        let passed_ms = u64::from(count().wrapping_sub(began) / (clock::CORE_HZ / 1_000));
        clock::stood_still(passed_ms.saturating_sub(clock::now_ms().saturating_sub(began_ms)));
    }
}

impl Memory for ChipFlash {
    fn copy(&mut self, address: u32, out: &mut [u8]) {
        let mut at = address;
        for to in out {
            // SAFETY: flash, inside the driver's sectors.
            *to = unsafe { core::ptr::read_volatile(at as *const u8) };
            at = at.wrapping_add(1);
        }
    }

    fn write_byte(&mut self, address: u32, byte: u8) {
        // SAFETY: a byte of a slot or the journal.
        unsafe { core::ptr::write_volatile(address as *mut u8, byte) }
    }
}
