//! Registers of the chip by address, for drivers that are written over them and tested on a laptop: calendar clock, crystal.

/// The chip's registers.
pub struct Registers(());

impl Registers {
    /// The handle.
    ///
    /// # Safety
    /// Nobody else may be writing to the registers of the driver it is given to, while that is at work.
    pub const unsafe fn new() -> Self {
        Self(())
    }
}

impl devices::registers::Registers for Registers {
    fn read(&mut self, address: u32) -> u32 {
        // SAFETY: a register of this chip, by the driver's table.
        unsafe { core::ptr::read_volatile(address as *const u32) }
    }

    fn write(&mut self, address: u32, value: u32) {
        // SAFETY: as above, and see `new`.
        unsafe { core::ptr::write_volatile(address as *mut u32, value) }
    }
}
