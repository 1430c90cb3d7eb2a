//! Option bytes of the STM32F405 (RM0090 rev 19, 3.6 and 3.8.6): brown-out level, hardware watchdog, resets on low power, read-out
//! protection. Read from FLASH_OPTCR, held against what this board needs, and set where that is possible.
//!
//! The read-out protection is never written as anything but what it is: level 2 could never be taken back, and going back from 1 to 0
//! erases the chip.

use crate::chip_flash::{BSY, FLASH_SR};
use crate::registers::Registers;

const OPTKEYR: u32 = 0x4002_3c08;
const OPTION_KEYS: [u32; 2] = [0x0819_2a3b, 0x4c5d_6e7f];
/// Option control register: the option bytes as loaded.
pub const OPTCR: u32 = 0x4002_3c14;
const OPTLOCK: u32 = 1;
const OPTSTRT: u32 = 1 << 1;
/// Brown-out level: 0 is level 3 (2.70 V and more, DS8626 section 5.3.5), 3 is off.
const BOR_LEV: u32 = 3 << 2;
/// 0: the independent watchdog runs from reset on.
pub const WDG_SW: u32 = 1 << 5;
/// 0: a reset instead of STOP, and of standby.
const NRST_STOP: u32 = 1 << 6;
const NRST_STDBY: u32 = 1 << 7;
const RDP: u32 = 0xff << 8;
const RDP_OPEN: u32 = 0xaa << 8;
const RDP_FOR_EVER: u32 = 0xcc << 8;
/// What is set, and to what.
const OURS: u32 = BOR_LEV | WDG_SW | NRST_STOP | NRST_STDBY;
const WANTED: u32 = NRST_STOP | NRST_STDBY;
/// Longest wait for the flash, readings: programming erases a sector of 16 KiB, 0.5 s (DS8626 table 39); a reading takes 4 cycles at least.
const OPTION_WAIT: u32 = 4_000_000;

/// Whether this write to a register erases and programs the option bytes.
#[must_use]
pub const fn starts_programming(address: u32, value: u32) -> bool {
    address == OPTCR && value & OPTSTRT != 0
}

/// What is not as this board needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deviation {
    /// Brown-out reset below level 3: flash is written, and the log, at a voltage at which the chip is wrong.
    BrownOut,
    /// A start that hangs is not ended: the watchdog waits for the program.
    Watchdog,
    /// STOP or standby would reset the chip.
    LowPowerReset,
    /// Read-out protection, level 1: a debugger sees nothing. Mended by a debugger only, which erases the chip.
    Protected,
    /// Read-out protection, level 2: nothing of this can be changed any more, ever.
    ProtectedForEver,
}

/// Everything that is not as it should be in this FLASH_OPTCR.
pub fn deviations(optcr: u32) -> impl Iterator<Item = Deviation> {
    let protection = match optcr & RDP {
        RDP_OPEN => None,
        RDP_FOR_EVER => Some(Deviation::ProtectedForEver),
        _ => Some(Deviation::Protected),
    };
    let unless = |right: bool, what: Deviation| if right { None } else { Some(what) };
    [
        unless(optcr & BOR_LEV == 0, Deviation::BrownOut),
        unless(optcr & WDG_SW == 0, Deviation::Watchdog),
        unless(optcr & (NRST_STOP | NRST_STDBY) == NRST_STOP | NRST_STDBY, Deviation::LowPowerReset),
        protection,
    ]
    .into_iter()
    .flatten()
}

/// FLASH_OPTCR; none: there is no such register (an emulator). With its write protection all 0 no chip could be programmed.
pub fn read(registers: &mut impl Registers) -> Option<u32> {
    Some(registers.read(OPTCR)).filter(|optcr| *optcr != 0 && *optcr != u32::MAX)
}

/// Sets brown-out level, watchdog and low-power resets; what is in force afterwards, which a reset may be needed for. The protection
/// stays as it is. Nothing is written where all is right, or where nothing can be. Half a second: feed the watchdog before.
pub fn set(registers: &mut impl Registers) -> Option<u32> {
    let found = read(registers)?;
    if found & OURS == WANTED || found & RDP == RDP_FOR_EVER || !is_idle(registers) {
        return Some(found);
    }
    for key in OPTION_KEYS {
        registers.write(OPTKEYR, key);
    }
    let unlocked = registers.read(OPTCR);
    // Only what is ours differs from what was just read: the protection cannot.
    if unlocked & OPTLOCK == 0 && unlocked & RDP == found & RDP {
        let wanted = unlocked & !(OURS | OPTSTRT) | WANTED;
        registers.write(OPTCR, wanted);
        registers.write(OPTCR, wanted | OPTSTRT);
        is_idle(registers);
    }
    let now = registers.read(OPTCR);
    registers.write(OPTCR, now & !OPTSTRT | OPTLOCK);
    read(registers)
}

fn is_idle(registers: &mut impl Registers) -> bool {
    (0..OPTION_WAIT).any(|_| registers.read(FLASH_SR) & BSY == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As a chip leaves the factory.
    const FACTORY: u32 = 0x0fff_aaed;

    /// The option part of the flash interface (RM0090 3.9).
    struct Chip {
        optcr: u32,
        keys: usize,
        busy: u32,
        stuck: bool,
        programmed: Vec<u32>,
    }

    impl Chip {
        fn new(optcr: u32) -> Self {
            Self { optcr, keys: 0, busy: 0, stuck: false, programmed: Vec::new() }
        }
    }

    impl Registers for Chip {
        fn read(&mut self, address: u32) -> u32 {
            match address {
                FLASH_SR => {
                    self.busy = self.busy.saturating_sub(1);
                    if self.busy > 0 || self.stuck { BSY } else { 0 }
                }
                OPTCR => self.optcr,
                _ => 0,
            }
        }
        fn write(&mut self, address: u32, value: u32) {
            match address {
                OPTKEYR => {
                    self.keys = if OPTION_KEYS.get(self.keys) == Some(&value) { self.keys + 1 } else { 9 };
                    if self.keys == 2 && self.optcr & RDP != RDP_FOR_EVER {
                        self.optcr &= !OPTLOCK;
                    }
                }
                OPTCR if self.optcr & OPTLOCK == 0 => {
                    assert!(self.busy == 0, "written while busy");
                    self.optcr = value & !OPTSTRT;
                    if value & OPTSTRT != 0 {
                        self.programmed.push(self.optcr);
                        self.busy = 1_000;
                    }
                }
                _ => {}
            }
        }
    }

    #[test]
    fn a_new_chip_is_named_and_set_and_then_left_alone() {
        let mut chip = Chip::new(FACTORY);
        assert_eq!(deviations(FACTORY).collect::<Vec<_>>(), [Deviation::BrownOut, Deviation::Watchdog]);
        let now = set(&mut chip).unwrap();
        assert_eq!(deviations(now).count(), 0, "{now:#x}");
        assert_eq!((now, chip.programmed.len()), (0x0fff_aac1, 1), "level 3, hardware watchdog, locked; the rest as it was");
        set(&mut chip);
        assert_eq!(chip.programmed.len(), 1, "nothing to do");
    }

    #[test]
    fn prop_the_protection_is_never_written_as_another_one() {
        for rdp in 0..=255u32 {
            for low in [0xed, 0xe1, 0x2d, 0xad, 0x6d, 0x01, 0xcd] {
                let before = 0x0fff_0001 | rdp << 8 | low;
                let mut chip = Chip::new(before);
                let now = set(&mut chip).unwrap();
                assert!(chip.programmed.iter().all(|p| p & RDP == before & RDP), "{before:#x}");
                assert_eq!(now & !OURS, before & !OURS, "{before:#x}");
                assert_eq!(now & OURS, if rdp == 0xcc { before & OURS } else { WANTED }, "{before:#x}");
                let protection = deviations(now).find(|d| matches!(d, Deviation::Protected | Deviation::ProtectedForEver));
                let due = [(0xaa, None), (0xcc, Some(Deviation::ProtectedForEver))];
                assert_eq!(protection, due.iter().find(|(r, _)| *r == rdp).map_or(Some(Deviation::Protected), |(_, due)| *due));
            }
        }
    }

    #[test]
    fn where_there_is_no_such_register_or_the_flash_hangs_nothing_is_written() {
        for word in [0, u32::MAX] {
            let mut chip = Chip::new(word);
            assert_eq!((read(&mut chip), set(&mut chip)), (None, None));
            assert!(chip.programmed.is_empty());
        }
        let mut chip = Chip { stuck: true, ..Chip::new(FACTORY) };
        assert_eq!(set(&mut chip), Some(FACTORY));
        assert!(chip.programmed.is_empty());
        assert_eq!(deviations(FACTORY & !NRST_STOP).filter(|d| *d == Deviation::LowPowerReset).count(), 1);
    }
}
