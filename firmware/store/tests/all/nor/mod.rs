//! NOR flash in memory whose power fails after a number of byte operations; several parts may hang on one supply.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use std::cell::RefCell;
use std::rc::Rc;

/// One supply.
#[derive(Clone, Default)]
pub struct Supply(Rc<RefCell<Power>>);

#[derive(Default)]
struct Power {
    /// Operations (a byte programmed, a byte erased) until the cut; none: it lasts.
    left: Option<usize>,
    done: usize,
    seed: u32,
}

impl Supply {
    /// Switches on; it fails after so many operations.
    pub fn lasts(&self, operations: Option<usize>) {
        let mut power = self.0.borrow_mut();
        power.seed = power.seed.wrapping_add(operations.unwrap_or(7) as u32);
        (power.left, power.done) = (operations, 0);
    }
    /// Operations since it was switched on.
    pub fn done(&self) -> usize {
        self.0.borrow().done
    }
    fn tick(&self) -> bool {
        let mut power = self.0.borrow_mut();
        power.done += 1;
        match &mut power.left {
            Some(0) => false,
            Some(n) => {
                *n -= 1;
                true
            }
            None => true,
        }
    }
    fn noise(&self) -> u8 {
        let mut power = self.0.borrow_mut();
        power.seed = power.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (power.seed >> 24) as u8
    }
}

/// A part of `SECTOR` bytes a sector.
#[derive(Clone)]
pub struct Part<const SECTOR: usize> {
    pub bytes: Vec<u8>,
    pub supply: Supply,
    /// Erases of each sector.
    pub erases: Vec<u32>,
}

/// The power is gone.
#[derive(Debug)]
pub struct Cut;

impl NorFlashError for Cut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const SECTOR: usize> Part<SECTOR> {
    pub fn new(sectors: usize, supply: &Supply) -> Self {
        Self { bytes: vec![0xff; sectors * SECTOR], supply: supply.clone(), erases: vec![0; sectors] }
    }
}

impl<const SECTOR: usize> ErrorType for Part<SECTOR> {
    type Error = Cut;
}

impl<const SECTOR: usize> ReadNorFlash for Part<SECTOR> {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Cut> {
        bytes.copy_from_slice(&self.bytes[offset as usize..offset as usize + bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const SECTOR: usize> NorFlash for Part<SECTOR> {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Cut> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(SECTOR) && to.is_multiple_of(SECTOR), "whole sectors");
        let way = self.supply.noise() % 4;
        for i in 0..to - from {
            if !self.supply.tick() {
                // From either end so far and no farther, or every byte somewhere on its way to ones.
                for j in from..to {
                    let n = self.supply.noise();
                    self.bytes[j] |= if way >= 2 && self.supply.noise() & 1 == 0 { n } else { 0 };
                }
                return Err(Cut);
            }
            self.bytes[if way & 1 == 0 { from + i } else { to - 1 - i }] = 0xff;
        }
        (from / SECTOR..to / SECTOR).for_each(|sector| self.erases[sector] += 1);
        Ok(())
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Cut> {
        for (b, at) in bytes.iter().zip(offset as usize..) {
            if !self.supply.tick() {
                // Only some of the bits that should fall have fallen.
                let n = self.supply.noise();
                self.bytes[at] &= b | n;
                return Err(Cut);
            }
            self.bytes[at] &= b;
        }
        Ok(())
    }
}
