//! Parts that speak by themselves: sentences byte by byte at their baud rate, and the port's buffer behind them.

use crate::{Around, Clock, Sample};
use embedded_io::{ErrorType, Read, ReadReady};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::marker::PhantomData;
use std::rc::Rc;

/// What a part says.
pub trait Says {
    /// Speed of its line, baud.
    const BAUD: u64;
    /// Time between two sentences, ns.
    const PERIOD_NS: u64;
    /// One sentence, with its end.
    fn sentence(sample: &Sample, now_ns: u64) -> String;
}

/// The part and the line from it.
pub struct Talker<S> {
    clock: Clock,
    around: Around,
    /// Bytes the port's interrupt can keep.
    room: usize,
    kept: VecDeque<u8>,
    /// Bytes on their way, with the time at which each is there.
    coming: VecDeque<(u64, u8)>,
    next_ns: u64,
    /// Until when nothing is said, and until when bytes are disturbed, ns.
    pub silent_until_ns: u64,
    /// Bits turned in the bytes that come next, one byte each.
    pub noise: VecDeque<u8>,
    /// Sentences said.
    pub said: u64,
    /// Bytes for which there was no room.
    pub lost: u64,
    says: PhantomData<S>,
}

impl<S: Says> Talker<S> {
    /// A part whose port keeps `room` bytes.
    #[must_use]
    pub fn new(clock: Clock, around: Around, room: usize) -> Self {
        let next_ns = clock.now_ns() + S::PERIOD_NS;
        let (kept, coming, noise) = Default::default();
        Self { clock, around, room, kept, coming, next_ns, silent_until_ns: 0, noise, said: 0, lost: 0, says: PhantomData }
    }

    /// The receiver was reset: what it kept is gone, what is on the line is not.
    pub fn forget(&mut self) {
        self.kept.clear();
    }

    fn speak(&mut self) {
        let sample = self.around.borrow_mut().sample(self.next_ns);
        let (start, byte_ns) = (self.next_ns, 10 * 1_000_000_000 / S::BAUD);
        let sentence = S::sentence(&sample, start);
        self.coming.extend(sentence.bytes().enumerate().map(|(i, b)| (start + byte_ns * (i as u64 + 1), b)));
        self.said += 1;
    }

    /// Everything that has come by now is with the port.
    pub fn listen(&mut self) {
        let now = self.clock.now_ns();
        while self.next_ns <= now {
            if self.next_ns >= self.silent_until_ns {
                self.speak();
            }
            self.next_ns += S::PERIOD_NS;
        }
        while let Some((_, byte)) = self.coming.front().copied().filter(|(at, _)| *at <= now) {
            self.coming.pop_front();
            let byte = byte ^ self.noise.pop_front().unwrap_or(0);
            if self.kept.len() < self.room { self.kept.push_back(byte) } else { self.lost += 1 }
        }
    }
}

/// The port, as the board reads it.
pub struct Port<S>(pub Rc<RefCell<Talker<S>>>);

impl<S> ErrorType for Port<S> {
    type Error = Infallible;
}

impl<S: Says> Read for Port<S> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        // A queue in memory does not fail.
        Ok(std::io::Read::read(&mut self.0.borrow_mut().kept, out).unwrap_or(0))
    }
}

impl<S: Says> ReadReady for Port<S> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        let mut part = self.0.borrow_mut();
        part.listen();
        Ok(!part.kept.is_empty())
    }
}
