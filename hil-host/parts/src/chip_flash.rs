//! The STM32F405RG's own flash (RM0090 chapter 3): 1 MiB in twelve sectors, its controller register by register, and what a power cut
//! leaves of a word or a sector.

/// First address.
pub const BASE: u32 = 0x0800_0000;
const SIZE: usize = 1 << 20;
/// Registers (RM0090 3.9).
const KEYR: u32 = 0x4002_3c04;
const SR: u32 = 0x4002_3c0c;
const CR: u32 = 0x4002_3c10;
const WRPERR: u32 = 1 << 4;
const PGAERR: u32 = 1 << 5;
const PGPERR: u32 = 1 << 6;
const PGSERR: u32 = 1 << 7;
const CLEARABLE: u32 = 0xf3;
const LOCK: u32 = 1 << 31;
const STRT: u32 = 1 << 16;

/// Start and length of a sector, bytes from the first (RM0090 table 5).
#[must_use]
pub fn sector(number: usize) -> Option<(usize, usize)> {
    const KIB: usize = 1024;
    match number {
        0..=3 => Some((number * 16 * KIB, 16 * KIB)),
        4 => Some((64 * KIB, 64 * KIB)),
        5..=11 => Some(((number - 4) * 128 * KIB, 128 * KIB)),
        _ => None,
    }
}

/// The block.
#[derive(Clone)]
pub struct ChipFlash {
    /// What is in it.
    pub memory: Vec<u8>,
    control: u32,
    status: u32,
    key: u32,
    /// A wrong key was written: locked until the next reset.
    is_shut: bool,
    /// Operations (a word or byte programmed, a sector erased) until the power is cut; none: it lasts.
    pub left: Option<usize>,
    /// Operations done.
    pub done: usize,
    /// The power was cut: nothing is done any more.
    pub is_off: bool,
    /// Looks at the status that say busy, after each operation.
    pub busy: u32,
    busy_left: u32,
    seed: u64,
}

impl Default for ChipFlash {
    fn default() -> Self {
        Self {
            memory: vec![0xff; SIZE],
            control: LOCK,
            status: 0,
            key: 0,
            is_shut: false,
            left: None,
            done: 0,
            is_off: false,
            busy: 2,
            busy_left: 0,
            seed: 1,
        }
    }
}

impl ChipFlash {
    /// The supply comes back, or the chip is reset: it lasts for so many operations.
    pub fn power_up(&mut self, lasts: Option<usize>) {
        (self.control, self.status, self.key, self.is_shut, self.busy_left) = (LOCK, 0, 0, false, 0);
        (self.left, self.done, self.is_off) = (lasts, 0, false);
    }

    fn random(&mut self) -> u8 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.seed >> 33) as u8
    }

    /// Whether the power holds for one more operation.
    fn tick(&mut self) -> bool {
        self.done += 1;
        self.busy_left = self.busy;
        match &mut self.left {
            Some(0) => {
                self.is_off = true;
                false
            }
            Some(n) => {
                *n -= 1;
                true
            }
            None => true,
        }
    }

    /// Copies memory.
    pub fn copy(&self, address: u32, out: &mut [u8]) {
        let at = address.wrapping_sub(BASE) as usize;
        let there = self.memory.get(at..at.saturating_add(out.len())).expect("an address of flash");
        out.copy_from_slice(there);
    }

    /// Reads a register.
    #[must_use]
    pub fn read(&mut self, address: u32) -> u32 {
        match address {
            SR => {
                let is_busy = self.busy_left > 0 && !self.is_off;
                self.busy_left = self.busy_left.saturating_sub(1);
                self.status | if is_busy { 1 << 16 } else { 0 }
            }
            CR => self.control,
            _ => 0,
        }
    }

    /// Writes a register, or a word of memory.
    pub fn write(&mut self, address: u32, value: u32) {
        match address {
            _ if self.is_off => {}
            KEYR => match (self.key, value) {
                (0, 0x4567_0123) => self.key = value,
                (0x4567_0123, 0xcdef_89ab) if !self.is_shut => (self.control, self.key) = (self.control & !LOCK, 0),
                _ => self.is_shut = true,
            },
            SR => self.status &= !(value & CLEARABLE),
            CR if self.control & LOCK == 0 => {
                self.control = value;
                if value & STRT != 0 {
                    self.erase();
                    self.control &= !STRT;
                }
            }
            CR => {}
            _ => self.program(address, &value.to_le_bytes()),
        }
    }

    /// Writes a byte of memory.
    pub fn write_byte(&mut self, address: u32, byte: u8) {
        if !self.is_off {
            self.program(address, &[byte]);
        }
    }

    fn program(&mut self, address: u32, bytes: &[u8]) {
        let at = address.wrapping_sub(BASE) as usize;
        assert!(at + bytes.len() <= SIZE, "{address:#x} is no flash");
        // PSIZE 0: bytes, 2: words.
        let psize = match bytes.len() {
            1 => 0,
            _ => 2,
        };
        if self.control & LOCK != 0 {
            self.status |= WRPERR;
        } else if self.control & 1 == 0 || self.control & 2 != 0 {
            self.status |= PGSERR;
        } else if self.control >> 8 & 3 != psize {
            self.status |= PGPERR;
        } else if !at.is_multiple_of(bytes.len()) {
            self.status |= PGAERR;
        } else {
            let holds = self.tick();
            for (offset, byte) in bytes.iter().enumerate() {
                // Only some of the bits that should fall have fallen.
                let mask = if holds { 0 } else { self.random() };
                self.memory[at + offset] &= byte | mask;
            }
        }
    }

    fn erase(&mut self) {
        let number = (self.control >> 3 & 0xf) as usize;
        let Some((start, length)) = sector(number).filter(|_| self.control & 3 == 2) else {
            self.status |= PGSERR;
            return;
        };
        if self.tick() {
            self.memory[start..start + length].fill(0xff);
            return;
        }
        // Torn: so far and no farther from either end, or every byte somewhere on its way to ones.
        let (way, part) = (self.random() % 3, length * usize::from(self.random()) / 256);
        match way {
            0 => self.memory[start..start + part].fill(0xff),
            1 => self.memory[start + part..start + length].fill(0xff),
            _ => {
                for at in start..start + length {
                    self.memory[at] |= self.random();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unlocked() -> ChipFlash {
        let mut flash = ChipFlash::default();
        flash.write(KEYR, 0x4567_0123);
        flash.write(KEYR, 0xcdef_89ab);
        flash
    }

    #[test]
    fn bits_fall_one_by_one_and_rise_a_sector_at_a_time() {
        let mut flash = unlocked();
        flash.write(CR, 1);
        flash.write_byte(BASE + 0x2_0001, 0x5a);
        flash.write_byte(BASE + 0x2_0001, 0xf0);
        assert_eq!(flash.memory[0x2_0001], 0x50);
        flash.write(CR, 2 | 5 << 3 | STRT);
        assert_eq!((flash.memory[0x2_0001], flash.status, flash.done), (0xff, 0, 3));
        assert_eq!(
            [sector(3), sector(4), sector(5), sector(11), sector(12)].map(|s| s.map(|s| s.0)),
            [Some(0xc000), Some(0x1_0000), Some(0x2_0000), Some(0xe_0000), None]
        );
    }

    #[test]
    fn what_the_manual_forbids_changes_nothing_and_sets_its_flag() {
        let mut locked = ChipFlash::default();
        locked.write_byte(BASE, 0);
        assert_eq!((locked.status, locked.memory[0]), (WRPERR, 0xff));
        let mut shut = ChipFlash::default();
        [1, 0x4567_0123, 0xcdef_89ab].iter().for_each(|key| shut.write(KEYR, *key));
        assert_eq!(shut.control, LOCK, "after a wrong key until the next reset");
        for (control, address, flag) in [(0, BASE, PGSERR), (1, BASE, PGPERR), (1 | 2 << 8, BASE + 2, PGAERR)] {
            let mut flash = unlocked();
            flash.write(CR, control);
            flash.write(address, 0);
            assert_eq!((flash.status, flash.done), (flag, 0));
            flash.write(SR, CLEARABLE);
            assert_eq!(flash.status, 0);
        }
    }

    #[test]
    fn a_cut_tears_a_word_or_a_sector_and_nothing_else() {
        let mut flash = unlocked();
        flash.left = Some(0);
        flash.write(CR, 1 | 2 << 8);
        flash.write(BASE + 8, 0);
        let word = &flash.memory[8..12];
        assert!(flash.is_off && word != [0; 4] && word != [0xff; 4], "{word:?}");
        flash.write(BASE + 12, 0);
        assert_eq!(flash.memory[12], 0xff, "nothing without power");
        for _ in 0..9 {
            let mut flash = ChipFlash { memory: vec![0; SIZE], seed: flash.random().into(), ..unlocked() };
            flash.left = Some(0);
            flash.write(CR, 2 | 1 << 3 | STRT);
            let torn = &flash.memory[0x4000..0x8000];
            assert!(torn.contains(&0xff) && torn.iter().any(|b| *b != 0xff));
            assert!(flash.memory[..0x4000].iter().chain(&flash.memory[0x8000..]).all(|b| *b == 0));
        }
    }
}
