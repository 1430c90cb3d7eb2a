//! Winbond W25Q128JV (rev F): instructions, BUSY times, and what a power cut leaves of a page or sector.

use crate::{Clock, Work};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

const SECTOR: usize = 4096;
const PAGE: usize = 256;
const LOG_FLASH_SIZE: u32 = 16 * 1024 * 1024;
/// Time of a byte at 8 MHz, ns.
const SPI_BYTE_NS: u64 = 1_000;
/// Typical times, ns (9.6): page program 0.7 ms, sector erase 45 ms; at most 3 and 400 ms.
const PROGRAM_NS: (u64, u64) = (700_000, 3_000_000);
const ERASE_NS: (u64, u64) = (45_000_000, 400_000_000);

/// The part; sectors that were never touched are erased.
pub struct W25q128 {
    clock: Clock,
    sectors: HashMap<u32, Box<[u8; SECTOR]>>,
    write_enabled: bool,
    busy_until_ns: u64,
    /// The sector that is being changed, as it was before.
    before: Option<(u32, Box<[u8; SECTOR]>)>,
    seed: u64,
    /// Every operation takes the longest that the datasheet allows.
    pub slow: bool,
    /// Bits turned in the bytes read next.
    pub noise: Vec<u8>,
    /// Nobody drives the bus until, ns: all ones.
    pub absent_until_ns: u64,
}

impl W25q128 {
    /// An erased part.
    #[must_use]
    pub fn new(clock: Clock) -> Self {
        Self {
            clock,
            sectors: HashMap::new(),
            write_enabled: false,
            busy_until_ns: 0,
            before: None,
            seed: 1,
            slow: false,
            noise: Vec::new(),
            absent_until_ns: 0,
        }
    }

    /// Whether an erase or a program is under way.
    #[must_use]
    pub fn busy(&self) -> bool {
        self.clock.now_ns() < self.busy_until_ns
    }

    fn random(&mut self) -> u64 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.seed >> 33
    }

    /// The supply fails now: what is under way is torn, each bit as it was or as it should become.
    pub fn power_cycle(&mut self) {
        if self.busy()
            && let Some((n, old)) = self.before.take()
        {
            let masks: Vec<u8> = (0..SECTOR).map(|_| self.random() as u8).collect();
            let new = self.sector(n);
            for ((new, old), mask) in new.iter_mut().zip(old.iter()).zip(masks) {
                *new = *new & mask | *old & !mask;
            }
        }
        (self.write_enabled, self.busy_until_ns, self.before) = (false, 0, None);
    }

    fn sector(&mut self, n: u32) -> &mut [u8; SECTOR] {
        self.sectors.entry(n).or_insert_with(|| Box::new([0xff; SECTOR]))
    }

    fn change(&mut self, at: u32, ns: (u64, u64), change: impl FnOnce(&mut [u8; SECTOR])) {
        if !std::mem::take(&mut self.write_enabled) {
            return;
        }
        let n = at % LOG_FLASH_SIZE / SECTOR as u32;
        let sector = self.sector(n);
        let before = Box::new(*sector);
        change(sector);
        self.before = Some((n, before));
        let takes_ns = if self.slow { ns.1 } else { ns.0 };
        self.clock.work(if ns == ERASE_NS { Work::Erase } else { Work::Program }, takes_ns);
        self.busy_until_ns = self.clock.now_ns() + takes_ns;
    }

    /// All that was sent in one selection; gives what is read behind it.
    fn select(&mut self, sent: &[u8], read: usize) -> Vec<u8> {
        let high = vec![0xff; read];
        if self.clock.now_ns() < self.absent_until_ns {
            return high;
        }
        let at = |sent: &[u8]| u32::from_be_bytes([0, sent[1], sent[2], sent[3]]);
        match sent {
            [0x05, ..] => vec![u8::from(self.busy()) | u8::from(self.write_enabled) << 1; read],
            _ if self.busy() => high,
            [0x9f] => [0xef, 0x40, 0x18].into_iter().chain(std::iter::repeat(0)).take(read).collect(),
            [0x06] => {
                self.write_enabled = true;
                high
            }
            [0x03, _, _, _] => {
                let from = at(sent);
                (0..read as u32)
                    .map(|i| {
                        let a = (from + i) % LOG_FLASH_SIZE;
                        self.sectors.get(&(a / SECTOR as u32)).map_or(0xff, |s| s[a as usize % SECTOR])
                    })
                    .collect()
            }
            [0x02, _, _, _, data @ ..] => {
                let start = at(sent) as usize;
                self.change(start as u32, PROGRAM_NS, |sector| {
                    let page = start % SECTOR / PAGE * PAGE;
                    for (i, byte) in data.iter().enumerate() {
                        sector[page + (start + i) % PAGE] &= byte;
                    }
                });
                high
            }
            [0x20, _, _, _] => {
                self.change(at(sent), ERASE_NS, |sector| sector.fill(0xff));
                high
            }
            _ => high,
        }
    }
}

/// The bus with its select line, as the board drives it.
#[derive(Clone)]
pub struct Bus(pub Rc<RefCell<W25q128>>);

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let mut part = self.0.borrow_mut();
        let (mut sent, mut read) = (Vec::new(), 0);
        for operation in operations.iter() {
            match operation {
                Operation::Write(bytes) => sent.extend_from_slice(bytes),
                Operation::Read(bytes) => read += bytes.len(),
                Operation::DelayNs(ns) => part.clock.pass_ns(u64::from(*ns)),
                _ => return Err(ErrorKind::Other),
            }
        }
        part.clock.pass_ns(SPI_BYTE_NS * (sent.len() + read) as u64);
        let mut answer = part.select(&sent, read);
        for byte in answer.iter_mut() {
            *byte ^= part.noise.pop().unwrap_or(0);
        }
        let mut answer = answer.into_iter();
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                for (to, from) in bytes.iter_mut().zip(answer.by_ref()) {
                    *to = from;
                }
            }
        }
        Ok(())
    }
}
