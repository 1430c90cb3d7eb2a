//! What the antenna says: whether there was a fix of late, and which.

use crate::next_byte;
use devices::gps::{Fix, Reader};
use embedded_io::{Read, ReadReady};

/// A fix is of this cycle when it is not older, ms.
const FRESH_FIX_MS: u64 = 4_000;
/// Most bytes taken at once: what the port's buffer holds.
const MOST: usize = 1024;

/// The GPS receiver behind its port.
#[derive(Debug)]
pub struct Antenna<U> {
    port: U,
    reader: Reader,
    /// When the last fix came, and that fix until it is taken.
    fix_ms: Option<u64>,
    new: Option<(Fix, u64)>,
}

impl<U: Read + ReadReady> Antenna<U> {
    /// A receiver that has not spoken yet.
    pub fn new(port: U) -> Self {
        Self { port, reader: Reader::default(), fix_ms: None, new: None }
    }

    /// Takes the bytes that have come.
    pub fn listen(&mut self, now_ms: u64) {
        for _ in 0..MOST {
            let Some(byte) = next_byte(&mut self.port) else { return };
            if let Some(Some(fix)) = self.reader.push(byte) {
                (self.fix_ms, self.new) = (Some(now_ms), Some((fix, now_ms)));
            }
        }
    }

    /// Whether there was a fix in this cycle.
    pub fn has_fix(&self, now_ms: u64) -> bool {
        self.fix_ms.is_some_and(|at_ms| now_ms.saturating_sub(at_ms) < FRESH_FIX_MS)
    }

    /// The last fix and when it came, once.
    pub const fn take_fix(&mut self) -> Option<(Fix, u64)> {
        self.new.take()
    }
}
