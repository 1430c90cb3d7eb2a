//! What the STM32F405 needs for its STOP mode beside the calendar clock (RM0090 rev 19: 5.3.5, 7.3, 12.3): interrupts that end it, the
//! core's deep sleep, and the clock that is gone afterwards.

/// Lines 22 (wake-up timer) and 10 (receiver of the line).
const TIMER_LINE: u32 = 1 << 22;
const RECEIVER_LINE: u32 = 1 << 10;
/// Readings of RCC_CR until the crystal runs again.
const CRYSTAL_READS: u32 = 400;

/// Those registers.
#[derive(Debug)]
pub struct Stop {
    imr: u32,
    rtsr: u32,
    ftsr: u32,
    pr: u32,
    /// Interrupts 0 to 31 and 32 to 63: enabled, pending.
    enabled: [u32; 2],
    pending: [u32; 2],
    scr: u32,
    rcc_cr: u32,
    cfgr: u32,
    reads: u32,
    /// The crystal does not start again.
    pub crystal_fails: bool,
}

impl Stop {
    /// After a reset and the image's start: on the crystal.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            imr: 0,
            rtsr: 0,
            ftsr: 0,
            pr: 0,
            enabled: [0; 2],
            pending: [0; 2],
            scr: 0,
            rcc_cr: 0x000b_0083,
            cfgr: 0x5,
            reads: 0,
            crystal_fails: false,
        }
    }

    /// A reset: as new, but for what is broken.
    pub(crate) const fn after_reset(&self) -> Self {
        Self { crystal_fails: self.crystal_fails, ..Self::new() }
    }

    /// Whether the chip runs on its crystal, watched by the clock security system.
    #[must_use]
    pub const fn on_crystal(&self) -> bool {
        self.cfgr & 0xc == 0x4 && self.rcc_cr & 0x000b_0000 == 0x000b_0000
    }

    /// Whether anything is left that an interrupt would be served for.
    #[must_use]
    pub fn is_quiet(&self) -> bool {
        let served = |i: usize| self.enabled[i] & self.pending[i] != 0;
        self.scr == 0 && self.imr & (TIMER_LINE | RECEIVER_LINE) == 0 && !served(0) && !served(1)
    }

    /// WFI stops the clocks.
    pub(crate) const fn is_deep(&self) -> bool {
        self.scr & 4 != 0
    }

    /// The wake-up timer would end it.
    pub(crate) const fn hears_timer(&self) -> bool {
        self.imr & self.rtsr & TIMER_LINE != 0 && self.enabled[0] & 1 << 3 != 0
    }

    /// The receiver of the line would end it.
    pub(crate) const fn hears_line(&self) -> bool {
        self.imr & self.ftsr & RECEIVER_LINE != 0 && self.enabled[1] & 1 << 8 != 0
    }

    /// It ended: on the internal oscillator.
    pub(crate) const fn ended(&mut self, by_line: bool) {
        (self.cfgr, self.rcc_cr, self.reads) = (self.cfgr & !0xf, self.rcc_cr & !0x0003_0000, 0);
        self.pr |= if by_line { RECEIVER_LINE } else { TIMER_LINE };
        self.pending[by_line as usize] |= if by_line { 1 << 8 } else { 1 << 3 };
    }

    /// Reads a register.
    pub fn read(&mut self, address: u32) -> u32 {
        match address {
            0x4001_3c00 => self.imr,
            0x4001_3c08 => self.rtsr,
            0x4001_3c0c => self.ftsr,
            0x4001_3c14 => self.pr,
            0xe000_ed10 => self.scr,
            0x4002_3800 => {
                self.reads += 1;
                let runs = self.rcc_cr & 1 << 16 != 0 && self.reads >= CRYSTAL_READS && !self.crystal_fails;
                self.rcc_cr |= u32::from(runs) << 17;
                self.rcc_cr
            }
            0x4002_3808 => self.cfgr,
            _ => 0,
        }
    }

    /// Writes a register.
    pub fn write(&mut self, address: u32, value: u32) {
        match address {
            0x4001_3c00 => self.imr = value,
            0x4001_3c08 => self.rtsr = value,
            0x4001_3c0c => self.ftsr = value,
            0x4001_3c14 => self.pr &= !value,
            0xe000_ed10 => self.scr = value,
            0x4002_3800 => self.rcc_cr = value & !(1 << 17) | self.rcc_cr & (value & 1 << 16) << 1,
            // It goes over to a clock that runs, and to no other.
            0x4002_3808 if value & 3 == 1 && self.rcc_cr & 1 << 17 == 0 => {}
            0x4002_3808 => self.cfgr = value & !0xc | (value & 3) << 2,
            0xe000_e100 | 0xe000_e104 => self.enabled[(address & 4) as usize / 4] |= value,
            0xe000_e180 | 0xe000_e184 => self.enabled[(address & 4) as usize / 4] &= !value,
            // A line that is still pending makes it pending again.
            0xe000_e280 if self.pr & TIMER_LINE == 0 => self.pending[0] &= !value,
            0xe000_e284 if self.pr & RECEIVER_LINE == 0 => self.pending[1] &= !value,
            _ => {}
        }
    }
}

impl Default for Stop {
    fn default() -> Self {
        Self::new()
    }
}
