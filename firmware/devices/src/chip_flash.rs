//! The STM32F405's own flash (RM0090 chapter 3): sectors of the image's slots and of their journal, erased and programmed by the chip
//! that runs from it.
//!
//! While a sector is erased the processor stands still at its next fetch: 2 s at most for 128 KiB, 0.5 s for 16 KiB (DS8626 table 48,
//! 32 bits at once, 2.7 to 3.6 V). The caches of the interface are off, as after a reset: nothing stale is read.

use crate::registers::Registers;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Key register, status, control.
const KEYR: u32 = 0x4002_3c04;
pub(crate) const FLASH_SR: u32 = 0x4002_3c0c;
const FLASH_CR: u32 = 0x4002_3c10;
const FLASH_KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
pub(crate) const BSY: u32 = 1 << 16;
/// OPERR, WRPERR, PGAERR, PGPERR, PGSERR; with EOP they are cleared by writing ones.
const ERRORS: u32 = 0xf2;
const EOP: u32 = 1;
const PG: u32 = 1;
const SER: u32 = 1 << 1;
/// Bytes, or words, at once.
const BY_BYTE: u32 = 0;
const BY_WORD: u32 = 2 << 8;
const STRT: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// Longest wait, looks of ≥ 5 cycles at 16 MHz: 6 s and more, an erase takes 2 s.
const LOOKS: u32 = 20_000_000;

/// Whether this write to a register erases a sector.
#[must_use]
pub const fn starts_erase(address: u32, value: u32) -> bool {
    address == FLASH_CR && value & STRT != 0
}

/// Registers, and the memory that flash is programmed through: a word is written as a register is.
pub trait Memory: Registers {
    /// Copies memory.
    fn copy(&mut self, address: u32, out: &mut [u8]);
    /// Writes one byte of memory.
    fn write_byte(&mut self, address: u32, byte: u8);
}

/// `COUNT` sectors of `SIZE` bytes from sector number `FIRST` at address `BASE` on.
#[derive(Debug)]
pub struct Sectors<M, const FIRST: u32, const BASE: u32, const COUNT: u32, const SIZE: usize>(M);

impl<M, const FIRST: u32, const BASE: u32, const COUNT: u32, const SIZE: usize> Sectors<M, FIRST, BASE, COUNT, SIZE> {
    /// Over this way to the chip.
    pub const fn new(memory: M) -> Self {
        Self(memory)
    }
}

/// Sectors 1 and 2.
pub type Journal<M> = Sectors<M, 1, 0x0800_4000, 2, 0x4000>;
/// Sectors 5 to 10: three slots of 256 KiB.
pub type Slots<M> = Sectors<M, 5, 0x0802_0000, 6, 0x2_0000>;

/// Why the flash did not do it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Beyond these sectors, or not whole ones.
    Place,
    /// It stays locked or busy.
    Timeout,
    /// Its error flags.
    Flags(u32),
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place => NorFlashErrorKind::OutOfBounds,
            _ => NorFlashErrorKind::Other,
        }
    }
}

impl<M: Memory, const FIRST: u32, const BASE: u32, const COUNT: u32, const SIZE: usize> Sectors<M, FIRST, BASE, COUNT, SIZE> {
    const LENGTH: u32 = COUNT * SIZE as u32;

    fn address(offset: u32, length: usize) -> Result<u32, Error> {
        match u32::try_from(length).ok().and_then(|length| offset.checked_add(length)) {
            Some(end) if end <= Self::LENGTH => Ok(BASE.saturating_add(offset)),
            _ => Err(Error::Place),
        }
    }

    /// Waits until the controller is free; says what went wrong with what it did.
    fn wait(&mut self) -> Result<(), Error> {
        for _ in 0..LOOKS {
            let status = self.0.read(FLASH_SR);
            if status & BSY == 0 {
                return if status & ERRORS == 0 { Ok(()) } else { Err(Error::Flags(status & ERRORS)) };
            }
        }
        Err(Error::Timeout)
    }

    /// Does something with the controller unlocked; it is locked again whatever comes of it.
    fn unlocked(&mut self, act: impl FnOnce(&mut Self) -> Result<(), Error>) -> Result<(), Error> {
        // Flags of whoever was here before.
        self.0.write(FLASH_SR, ERRORS | EOP);
        let free = self.wait();
        if self.0.read(FLASH_CR) & LOCK != 0 {
            FLASH_KEYS.iter().for_each(|key| self.0.write(KEYR, *key));
        }
        let done = free.and_then(|()| act(self));
        self.0.write(FLASH_CR, LOCK);
        done
    }

    fn program(&mut self, address: u32, bytes: &[u8], at_once: u32) -> Result<(), Error> {
        self.0.write(FLASH_CR, PG | at_once);
        let mut at = address;
        if at_once == BY_WORD {
            for word in bytes.as_chunks::<4>().0 {
                self.0.write(at, u32::from_le_bytes(*word));
                self.wait()?;
                at = at.saturating_add(4);
            }
        } else {
            for byte in bytes {
                self.0.write_byte(at, *byte);
                self.wait()?;
                at = at.saturating_add(1);
            }
        }
        Ok(())
    }
}

impl<M, const FIRST: u32, const BASE: u32, const COUNT: u32, const SIZE: usize> ErrorType for Sectors<M, FIRST, BASE, COUNT, SIZE> {
    type Error = Error;
}

impl<M: Memory, const FIRST: u32, const BASE: u32, const COUNT: u32, const SIZE: usize> ReadNorFlash
    for Sectors<M, FIRST, BASE, COUNT, SIZE>
{
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let address = Self::address(offset, bytes.len())?;
        self.0.copy(address, bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        Self::LENGTH as usize
    }
}

impl<M: Memory, const FIRST: u32, const BASE: u32, const COUNT: u32, const SIZE: usize> NorFlash for Sectors<M, FIRST, BASE, COUNT, SIZE> {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let size = SIZE as u32;
        if to > Self::LENGTH || from > to || !from.is_multiple_of(size) || !to.is_multiple_of(size) {
            return Err(Error::Place);
        }
        for sector in (0..COUNT).filter(|n| (from..to).contains(&n.saturating_mul(size))) {
            self.unlocked(|flash| {
                let number = FIRST.saturating_add(sector);
                flash.0.write(FLASH_CR, SER | BY_WORD | number << 3);
                flash.0.write(FLASH_CR, SER | BY_WORD | number << 3 | STRT);
                flash.wait()
            })?;
        }
        Ok(())
    }

    /// Whole words at once, what is left over byte by byte.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let address = Self::address(offset, bytes.len())?;
        let before = (address.wrapping_neg() & 3) as usize;
        let (head, rest) = bytes.split_at_checked(before).unwrap_or((bytes, &[]));
        let (words, tail) = rest.split_at_checked(rest.len() & !3).unwrap_or((&[], rest));
        let (at_words, at_tail) = (address.saturating_add(before as u32), (rest.len() & !3) as u32);
        for (at, part, at_once) in [(address, head, BY_BYTE), (at_words, words, BY_WORD), (at_words.saturating_add(at_tail), tail, BY_BYTE)]
        {
            if !part.is_empty() {
                self.unlocked(|flash| flash.program(at, part, at_once))?;
            }
        }
        Ok(())
    }
}
