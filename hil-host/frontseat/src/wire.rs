//! Bytes per second, and what goes wrong on the way.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;

/// What the line does to bytes: probabilities per byte.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damage {
    /// One bit is flipped.
    pub flip: f64,
    /// It changes places with the next one: the checksum does not see it.
    pub swap: f64,
    /// It comes twice.
    pub double: f64,
    /// It does not come.
    pub lose: f64,
}

/// One direction of the line.
#[derive(Debug)]
pub struct Wire {
    bytes_per_s: f64,
    credit: f64,
    queue: VecDeque<u8>,
    /// What it does to bytes.
    pub damage: Damage,
    /// Nothing comes through.
    pub cut: bool,
    rng: ChaCha8Rng,
}

impl Wire {
    /// A line of so many baud (ten bits a byte).
    #[must_use]
    pub fn new(baud: f64, seed: u64) -> Self {
        Self {
            bytes_per_s: baud / 10.0,
            credit: 0.0,
            queue: VecDeque::new(),
            damage: Damage::default(),
            cut: false,
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Puts bytes on the line.
    pub fn put(&mut self, bytes: &[u8]) {
        self.queue.extend(bytes);
    }

    /// Bytes still waiting to be sent.
    #[must_use]
    pub fn waiting(&self) -> usize {
        self.queue.len()
    }

    /// What arrives in the next `dt_s`.
    pub fn carry(&mut self, dt_s: f64, out: &mut Vec<u8>) {
        self.credit = (self.credit + dt_s * self.bytes_per_s).min(self.bytes_per_s);
        let sent = (self.credit as usize).min(self.queue.len());
        self.credit -= sent as f64;
        let from = out.len();
        out.extend(self.queue.drain(..sent));
        if self.queue.is_empty() {
            self.credit = self.credit.min(dt_s * self.bytes_per_s);
        }
        if self.cut {
            out.truncate(from);
        } else if self.damage != Damage::default() {
            let damaged = self.spoil(out.get(from..).unwrap_or_default().to_vec());
            out.truncate(from);
            out.extend(damaged);
        }
    }

    fn spoil(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        let Damage { flip, swap, double, lose } = self.damage;
        for i in 1..bytes.len() {
            if self.rng.random::<f64>() < swap {
                bytes.swap(i - 1, i);
            }
        }
        let mut out = Vec::with_capacity(bytes.len());
        for byte in bytes {
            let flipped = if self.rng.random::<f64>() < flip { byte ^ 1 << (self.rng.random::<u32>() % 8) } else { byte };
            if self.rng.random::<f64>() < lose {
                continue;
            }
            out.push(flipped);
            if self.rng.random::<f64>() < double {
                out.push(flipped);
            }
        }
        out
    }
}
