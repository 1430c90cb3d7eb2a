//! What the antenna says: whether there was a fix of late, and what time it is.

use crate::next_byte;
use devices::gps::{Fix, Reader};
use embedded_io::{Read, ReadReady};

/// A fix is of this cycle when it is not older, ms.
const FRESH_MS: u64 = 4_000;
/// Most bytes taken at once: what the port's buffer holds.
const MOST: usize = 1024;

/// The GPS receiver behind its port.
#[derive(Debug)]
pub struct Antenna<U> {
    port: U,
    reader: Reader,
    fix: Option<(Fix, u64)>,
}

impl<U: Read + ReadReady> Antenna<U> {
    /// A receiver that has not spoken yet.
    pub fn new(port: U) -> Self {
        Self { port, reader: Reader::default(), fix: None }
    }

    /// Takes the bytes that have come.
    pub fn listen(&mut self, now_ms: u64) {
        for _ in 0..MOST {
            let Some(byte) = next_byte(&mut self.port) else { return };
            if let Some(Some(fix)) = self.reader.push(byte) {
                self.fix = Some((fix, now_ms));
            }
        }
    }

    /// Whether there was a fix in this cycle.
    pub fn has_fix(&self, now_ms: u64) -> bool {
        self.fix.is_some_and(|(_, at_ms)| now_ms.saturating_sub(at_ms) < FRESH_MS)
    }

    /// Seconds since 1970 now, UTC, reckoned on from the last fix by the board's clock.
    pub fn utc_s(&self, now_ms: u64) -> Option<u64> {
        self.fix.map(|(fix, at_ms)| u64::from(fix.utc_s).saturating_add(now_ms.saturating_sub(at_ms) / 1000))
    }
}
