//! A line that damages what it carries.

use super::lattice::LineFault;
use crate::seats::Wire;
use crate::seats::in_process::InProcess;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::time::Duration;

/// One transmission in this many is hit.
const ONE_IN: u32 = 10;

/// The in-process wire, with a fault of its own.
pub(super) struct BadLine {
    inner: InProcess,
    fault: LineFault,
    rng: ChaCha8Rng,
}

impl BadLine {
    pub(super) fn new(fault: LineFault, seed: u64) -> Self {
        Self { inner: InProcess::default(), fault, rng: ChaCha8Rng::seed_from_u64(seed ^ 0x11e) }
    }

    /// Damages bytes; they keep their order.
    fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = bytes.to_vec();
        if !self.rng.next_u32().is_multiple_of(ONE_IN) || out.is_empty() {
            return out;
        }
        let at = self.rng.next_u32() as usize % out.len();
        match self.fault {
            LineFault::Drop => out.clear(),
            LineFault::Flip => {
                if let Some(byte) = out.get_mut(at) {
                    *byte ^= 1 << (self.rng.next_u32() % 8);
                }
            }
            LineFault::Truncate => out.truncate(at),
            LineFault::Duplicate => out.extend_from_slice(bytes),
            LineFault::Noise => {
                let mut noise: Vec<u8> = (0..at).map(|_| self.rng.next_u32() as u8).collect();
                noise.append(&mut out);
                return noise;
            }
        }
        out
    }
}

impl Wire for BadLine {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let bytes = self.damaged(bytes);
        self.inner.send(&bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        let n = self.inner.receive(into, wait)?;
        let out = self.damaged(into.get(..n).unwrap_or_default());
        // What does not fit is lost, as in a UART.
        for (to, from) in into.iter_mut().zip(&out) {
            *to = *from;
        }
        Ok(out.len().min(into.len()))
    }

    fn describe(&self) -> String {
        format!("controller behind a bad line ({:?})", self.fault)
    }
}
