//! Winbond W25Q128JV: 16 MiB of NOR flash over SPI, for slots and log.
//!
//! Instructions of the datasheet's table 8.1.2. Every wait is bounded by the
//! part's own maximum (9.6): page program 3 ms, sector erase 400 ms.

use crate::Error;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Operation, SpiDevice};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

const WRITE_ENABLE: u8 = 0x06;
const READ_STATUS: u8 = 0x05;
const READ: u8 = 0x03;
const PROGRAM: u8 = 0x02;
const ERASE_SECTOR: u8 = 0x20;
const JEDEC: u8 = 0x9f;
const BUSY: u8 = 1;
const WRITE_ENABLED: u8 = 2;
/// W25Q128JV: Winbond EFh, 40h 18h.
const IDENTITY: [u8; 3] = [0xef, 0x40, 0x18];
const PAGE: usize = 256;
const SECTOR: usize = 4096;
/// Bytes.
pub const CAPACITY: usize = 16 * 1024 * 1024;
const PROGRAM_MS: u32 = 4;
const ERASE_MS: u32 = 420;

/// The part on its bus.
#[derive(Debug)]
pub struct Flash<S, D> {
    spi: S,
    delay: D,
}

impl<S: SpiDevice, D: DelayNs> Flash<S, D> {
    /// Waits for what a reset interrupted (an erase goes on in the part, which answers nothing else meanwhile), then makes sure
    /// that it is this part.
    ///
    /// # Errors
    /// [`Error::Bus`] or [`Error::Identity`].
    pub fn start(spi: S, delay: D) -> Result<Self, Error> {
        let mut flash = Self { spi, delay };
        for _ in 0..ERASE_MS {
            if flash.status()? & BUSY == 0 {
                break;
            }
            flash.delay.delay_ms(1);
        }
        let mut id = [0; 3];
        flash.spi.transaction(&mut [Operation::Write(&[JEDEC]), Operation::Read(&mut id)]).map_err(|_| Error::Bus)?;
        let [maker, kind, _] = id;
        if id == IDENTITY { Ok(flash) } else { Err(Error::Identity(u16::from_be_bytes([maker, kind]))) }
    }

    fn status(&mut self) -> Result<u8, Error> {
        let mut status = [0; 1];
        self.spi.transaction(&mut [Operation::Write(&[READ_STATUS]), Operation::Read(&mut status)]).map_err(|_| Error::Bus)?;
        let [status] = status;
        Ok(status)
    }

    fn command(&mut self, instruction: u8, at: u32, bytes: &[u8], most_ms: u32) -> Result<(), Error> {
        self.spi.write(&[WRITE_ENABLE]).map_err(|_| Error::Bus)?;
        if self.status()? & WRITE_ENABLED == 0 {
            return Err(Error::Check); // write-protected, or nobody there
        }
        let [_, a, b, c] = at.to_be_bytes();
        self.spi.transaction(&mut [Operation::Write(&[instruction, a, b, c]), Operation::Write(bytes)]).map_err(|_| Error::Bus)?;
        for _ in 0..most_ms {
            if self.status()? & BUSY == 0 {
                return Ok(());
            }
            self.delay.delay_ms(1);
        }
        Err(Error::Timeout)
    }
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Range => NorFlashErrorKind::OutOfBounds,
            _ => NorFlashErrorKind::Other,
        }
    }
}

impl<S, D> ErrorType for Flash<S, D> {
    type Error = Error;
}

impl<S: SpiDevice, D: DelayNs> ReadNorFlash for Flash<S, D> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        if (offset as usize).saturating_add(bytes.len()) > CAPACITY {
            return Err(Error::Range);
        }
        let [_, a, b, c] = offset.to_be_bytes();
        self.spi.transaction(&mut [Operation::Write(&[READ, a, b, c]), Operation::Read(bytes)]).map_err(|_| Error::Bus)
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl<S: SpiDevice, D: DelayNs> NorFlash for Flash<S, D> {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let sector = SECTOR as u32;
        if !from.is_multiple_of(sector) || !to.is_multiple_of(sector) || to as usize > CAPACITY {
            return Err(Error::Range);
        }
        (from / sector..to / sector).try_for_each(|n| self.command(ERASE_SECTOR, n.saturating_mul(sector), &[], ERASE_MS))
    }

    /// A page program wraps inside its page, so writes are cut at page borders.
    fn write(&mut self, offset: u32, mut bytes: &[u8]) -> Result<(), Error> {
        if (offset as usize).saturating_add(bytes.len()) > CAPACITY {
            return Err(Error::Range);
        }
        let mut at = offset;
        while !bytes.is_empty() {
            let room = PAGE.saturating_sub(at as usize % PAGE);
            let (now, later) = bytes.split_at_checked(room).unwrap_or((bytes, &[]));
            self.command(PROGRAM, at, now, PROGRAM_MS)?;
            at = at.saturating_add(now.len() as u32);
            bytes = later;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::spi::{Mock, Transaction};

    type Steps = Vec<Transaction<u8>>;
    type Started = Result<Flash<Mock<u8>, NoopDelay>, Error>;

    fn ask(out: &[u8], back: &[u8]) -> Steps {
        vec![
            Transaction::transaction_start(),
            Transaction::write_vec(out.to_vec()),
            Transaction::read_vec(back.to_vec()),
            Transaction::transaction_end(),
        ]
    }

    fn program(at: [u8; 3], bytes: &[u8]) -> Steps {
        let enable = vec![Transaction::transaction_start(), Transaction::write_vec(vec![WRITE_ENABLE]), Transaction::transaction_end()];
        let write = vec![
            Transaction::transaction_start(),
            Transaction::write_vec(vec![PROGRAM, at[0], at[1], at[2]]),
            Transaction::write_vec(bytes.to_vec()),
            Transaction::transaction_end(),
        ];
        [enable, ask(&[READ_STATUS], &[WRITE_ENABLED]), write].concat()
    }

    fn started(steps: Steps) -> (Mock<u8>, Started) {
        let spi = Mock::new(&[ask(&[READ_STATUS], &[0]), ask(&[JEDEC], &IDENTITY), steps].concat());
        (spi.clone(), Flash::start(spi, NoopDelay::new()))
    }

    #[test]
    fn another_part_or_none_is_refused() {
        let floating = [vec![ask(&[READ_STATUS], &[0xff]); ERASE_MS as usize].concat(), ask(&[JEDEC], &[0xff; 3])].concat();
        let mut spi = Mock::new(&floating);
        assert_eq!(Flash::start(spi.clone(), NoopDelay::new()).err(), Some(Error::Identity(0xffff)));
        spi.done();
    }

    #[test]
    fn a_part_that_a_reset_left_erasing_is_waited_for() {
        let steps =
            [ask(&[READ_STATUS], &[BUSY]), ask(&[READ_STATUS], &[BUSY]), ask(&[READ_STATUS], &[0]), ask(&[JEDEC], &IDENTITY)].concat();
        let mut spi = Mock::new(&steps);
        assert!(Flash::start(spi.clone(), NoopDelay::new()).is_ok());
        spi.done();
    }

    #[test]
    fn writes_are_cut_at_page_borders_and_wait_until_done() {
        let steps = [
            program([0, 0, 254], &[1, 2]),
            ask(&[READ_STATUS], &[BUSY]),
            ask(&[READ_STATUS], &[0]),
            program([0, 1, 0], &[3]),
            ask(&[READ_STATUS], &[0]),
        ];
        let (mut spi, flash) = started(steps.concat());
        flash.unwrap().write(254, &[1, 2, 3]).unwrap();
        spi.done();
    }

    #[test]
    fn a_part_that_never_gets_ready_is_given_up() {
        let steps = [vec![program([0, 0, 0], &[9])], vec![ask(&[READ_STATUS], &[BUSY]); PROGRAM_MS as usize]].concat();
        let (mut spi, flash) = started(steps.concat());
        assert_eq!(flash.unwrap().write(0, &[9]), Err(Error::Timeout));
        spi.done();
    }

    #[test]
    fn beyond_the_end_is_refused_without_a_word_on_the_bus() {
        let (mut spi, flash) = started(vec![]);
        let mut flash = flash.unwrap();
        assert_eq!(flash.read(CAPACITY as u32 - 1, &mut [0; 2]), Err(Error::Range));
        assert_eq!(flash.erase(1, 4097), Err(Error::Range));
        spi.done();
    }
}
