//! The flash interface of an STM32F405 as far as its option bytes go (RM0090 rev 19, 3.6 and 3.9).

/// As a chip leaves the factory.
pub const FACTORY: u32 = 0x0fff_aaed;
/// As this board's chips are set up.
pub const SET_UP: u32 = 0x0fff_aac1;
/// As a cut leaves them that comes when they are erased and not yet programmed: level 1 of the protection.
pub const ERASED: u32 = 0x0fff_ffed;

/// The registers OPTKEYR, SR and OPTCR.
#[derive(Debug)]
pub struct Options {
    /// FLASH_OPTCR.
    pub optcr: u32,
    keys: usize,
    busy: u32,
    /// What was programmed, in order.
    pub programmed: Vec<u32>,
    /// The power is cut at the next setting, between erase and programming.
    pub cut: bool,
}

impl Options {
    /// A chip with these option bytes, locked.
    #[must_use]
    pub const fn new(optcr: u32) -> Self {
        Self { optcr: optcr | 1, keys: 0, busy: 0, programmed: Vec::new(), cut: false }
    }

    /// A reset: locked.
    pub const fn reset(&mut self) {
        (self.optcr, self.keys, self.busy) = (self.optcr | 1, 0, 0);
    }

    /// Reads a register.
    pub fn read(&mut self, address: u32) -> u32 {
        match address {
            0x4002_3c0c => {
                self.busy = self.busy.saturating_sub(1);
                u32::from(self.busy > 0) << 16
            }
            0x4002_3c14 => self.optcr,
            _ => 0,
        }
    }

    /// Writes a register.
    pub fn write(&mut self, address: u32, value: u32) {
        match (address, value, self.keys) {
            (0x4002_3c08, 0x0819_2a3b, 0) => self.keys = 1,
            // With read-out protection of level 2 they stay locked.
            (0x4002_3c08, 0x4c5d_6e7f, 1) if self.optcr >> 8 & 0xff != 0xcc => (self.keys, self.optcr) = (2, self.optcr & !1),
            // Wrong keys lock until the next reset.
            (0x4002_3c08, ..) => self.keys = 9,
            (0x4002_3c14, ..) if self.optcr & 1 == 0 && self.busy == 0 => {
                self.optcr = value & !2;
                if value & 2 != 0 {
                    self.programmed.push(self.optcr);
                    self.busy = 1_000;
                }
                self.keys = if value & 1 != 0 { 0 } else { self.keys };
                if value & 2 != 0 && std::mem::take(&mut self.cut) {
                    (self.optcr, self.keys) = (ERASED, 9);
                }
            }
            _ => {}
        }
    }
}
