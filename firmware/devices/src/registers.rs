//! The chip's registers as its own blocks' drivers see them: words by address, of the chip or of a model of it.

/// Registers of the chip, by address.
pub trait Registers {
    /// Reads one.
    fn read(&mut self, address: u32) -> u32;
    /// Writes one.
    fn write(&mut self, address: u32, value: u32);
}
