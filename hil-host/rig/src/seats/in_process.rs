//! The controller called directly, with the bytes it would get from a line.

use super::link::Wire;
use control::Config;
use helm::{Boot, Helm, RamStorage};
use signals::encode;
use signals::link::MAX_WIRE;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A controller built for this computer, behind encoded bytes. The image's
/// loop does the same with its USART.
#[derive(Clone)]
pub struct Board {
    helm: Helm<RamStorage>,
    resets: u32,
    started: Instant,
}

impl Default for Board {
    /// A controller that was just started, with the configuration the image has built in.
    fn default() -> Self {
        Self { helm: Helm::new(Config::default(), Boot::default(), RamStorage::default()), resets: 0, started: Instant::now() }
    }
}

impl Board {
    /// The controller itself.
    pub fn helm(&mut self) -> &mut Helm<RamStorage> {
        &mut self.helm
    }

    /// A reset in the middle of whatever is going on: memory is lost, the mark on flash is not.
    pub fn reset(&mut self) {
        let storage = std::mem::take(self.helm.storage());
        let mark = self.helm.mark();
        self.resets += 1;
        let boot = Boot { mark, boots: self.resets, salt: self.resets << 16, ..Boot::default() };
        self.helm = Helm::new(Config::default(), boot, storage);
    }

    /// Takes bytes and hands every answer's bytes to `out`.
    pub fn take(&mut self, bytes: &[u8], mut out: impl FnMut(&[u8])) {
        self.helm.utc.tick(self.started.elapsed().as_millis() as u64);
        for byte in bytes {
            if let Some(answer) = self.helm.byte(*byte) {
                let mut wire = [0u8; MAX_WIRE];
                if let Ok(n) = encode(&answer, &mut wire) {
                    out(wire.get(..n).unwrap_or_default());
                }
            }
        }
    }
}

/// Wire to a [`Board`] in this process.
#[derive(Default)]
pub struct InProcess {
    board: Board,
    answers: VecDeque<u8>,
}

impl InProcess {
    /// The board behind the wire.
    pub fn board(&mut self) -> &mut Board {
        &mut self.board
    }
}

impl Wire for InProcess {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let answers = &mut self.answers;
        self.board.take(bytes, |answer| answers.extend(answer));
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _wait: Duration) -> std::io::Result<usize> {
        std::io::Read::read(&mut self.answers, into)
    }

    fn reset(&mut self) -> bool {
        self.answers.clear();
        self.board.reset();
        true
    }

    fn describe(&self) -> String {
        "controller built for this computer, called directly".to_owned()
    }
}
