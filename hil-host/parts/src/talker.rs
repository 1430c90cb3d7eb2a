//! Parts that speak by themselves: sentences byte by byte at their baud rate, and the port's buffer behind them.

use crate::{Around, Clock, Sample, Work};
use embedded_io::{ErrorType, Read, ReadReady};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

/// What a part says.
pub trait Says {
    /// Speed of its line, baud.
    const BAUD: u64;
    /// Time between two sentences, ns.
    const PERIOD_NS: u64;
    /// Time from its supply to the first measurement, ns.
    const START_NS: u64;
    /// Its supply, for the budget.
    const WORK: Work;
    /// One sentence, with its end.
    fn sentence(&mut self, sample: &Sample, now_ns: u64) -> String;
    /// Its supply was switched off.
    fn forget(&mut self) {}
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
    /// When it speaks next; none: it has no supply.
    next_ns: Option<u64>,
    /// Until when nothing is said, and until when bytes are disturbed, ns.
    pub silent_until_ns: u64,
    /// Bits turned in the bytes that come next, one byte each.
    pub noise: VecDeque<u8>,
    /// Sentences said to their end.
    pub said: u64,
    /// Bytes for which there was no room.
    pub lost: u64,
    part: S,
}

impl<S: Says + Default> Talker<S> {
    /// A part without supply, whose port keeps `room` bytes.
    #[must_use]
    pub fn new(clock: Clock, around: Around, room: usize) -> Self {
        let (kept, coming, noise) = Default::default();
        Self { clock, around, room, kept, coming, next_ns: None, silent_until_ns: 0, noise, said: 0, lost: 0, part: S::default() }
    }
}

impl<S: Says> Talker<S> {
    /// Its supply is switched.
    pub fn supply(&mut self, on: bool) {
        if on == self.next_ns.is_some() {
            return;
        }
        self.clock.switch(S::WORK, on);
        if on {
            self.next_ns = Some(self.clock.now_ns() + S::START_NS + S::PERIOD_NS);
            return;
        }
        self.listen();
        // A sentence is torn: it was not said. Without its line end it is whole.
        self.said -= u64::from(self.coming.len() > 2);
        self.coming.clear();
        self.next_ns = None;
        self.part.forget();
    }

    /// The receiver was reset: what it kept is gone, what is on the line is not.
    pub fn forget(&mut self) {
        self.kept.clear();
    }

    fn speak(&mut self, start: u64) {
        let sample = self.around.borrow_mut().sample(start);
        let byte_ns = 10 * 1_000_000_000 / S::BAUD;
        let sentence = self.part.sentence(&sample, start);
        self.coming.extend(sentence.bytes().enumerate().map(|(i, b)| (start + byte_ns * (i as u64 + 1), b)));
        self.said += 1;
    }

    /// Everything that has come by now is with the port.
    pub fn listen(&mut self) {
        let now = self.clock.now_ns();
        while let Some(next_ns) = self.next_ns.filter(|next_ns| *next_ns <= now) {
            if next_ns >= self.silent_until_ns {
                self.speak(next_ns);
            }
            self.next_ns = Some(next_ns + S::PERIOD_NS);
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
