//! The two I²C lines, bit by bit (NXP UM10204), and the parts that listen.

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// A part on the bus, byte by byte.
pub trait Target {
    /// Its address, 7 bits.
    fn address(&self) -> u8;
    /// Whether it acknowledges its address now.
    fn listens(&mut self) -> bool {
        true
    }
    /// Addressed, to be written or read.
    fn begin(&mut self, read: bool);
    /// A byte written to it; false: not acknowledged.
    fn write(&mut self, byte: u8) -> bool;
    /// The next byte it gives.
    fn read(&mut self) -> u8;
    /// Its supply was interrupted.
    fn power_cycle(&mut self);
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Idle,
    Address,
    Write,
    Read,
    Ignore,
}

/// What disturbs the lines.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disturbance {
    /// Bits until one is seen wrongly by whoever reads it, and how many in a row then.
    pub flip_in: Option<(u32, u32)>,
    /// Bytes until one is not acknowledged.
    pub nack_in: Option<u32>,
    /// The data line is held low until, ns.
    pub data_low_until_ns: u64,
    /// The data line is held low for so many clocks: a part that was cut off in the middle of a byte.
    pub data_low_clocks: u32,
    /// The clock is held low until, ns.
    pub clock_low_until_ns: u64,
    /// Nobody at this address answers until, ns.
    pub deaf: Option<(u8, u64)>,
}

/// The lines and their parts.
pub struct Wires {
    clock: crate::Clock,
    targets: Vec<Box<dyn Target>>,
    /// What the master lets be: clock, data.
    master: (bool, bool),
    /// A part pulls data low.
    pulled: bool,
    was: (bool, bool),
    state: State,
    bits: u32,
    shift: u8,
    selected: Option<usize>,
    reading: bool,
    out: u8,
    wrong_bit: bool,
    /// What goes wrong.
    pub disturbance: Disturbance,
    /// Bits on the lines so far.
    pub bits_seen: u64,
}

impl Wires {
    /// Lines with these parts.
    #[must_use]
    pub fn new(clock: crate::Clock, targets: Vec<Box<dyn Target>>) -> Self {
        Self {
            clock,
            targets,
            master: (true, true),
            pulled: false,
            was: (true, true),
            state: State::Idle,
            bits: 0,
            shift: 0,
            selected: None,
            reading: false,
            out: 0,
            wrong_bit: false,
            disturbance: Disturbance::default(),
            bits_seen: 0,
        }
    }

    /// Interrupts the supply of the part at an address; of all without one.
    pub fn power_cycle(&mut self, address: Option<u8>) {
        for target in self.targets.iter_mut().filter(|t| address.is_none_or(|a| t.address() == a)) {
            target.power_cycle();
        }
        if address.is_none() {
            (self.state, self.pulled, self.disturbance) = (State::Idle, false, Disturbance::default());
        }
    }

    /// Puts another part in the place of the one at its address.
    pub fn replace(&mut self, part: Box<dyn Target>) -> Option<Box<dyn Target>> {
        let place = self.targets.iter_mut().find(|t| t.address() == part.address())?;
        Some(std::mem::replace(place, part))
    }

    /// Clock and data as they are on the lines.
    fn lines(&self) -> (bool, bool) {
        let (d, now) = (&self.disturbance, self.clock.now_ns());
        let clock = self.master.0 && now >= d.clock_low_until_ns;
        (clock, self.master.1 && !self.pulled && now >= d.data_low_until_ns && d.data_low_clocks == 0)
    }

    fn settle(&mut self) {
        let (was, now) = (self.was, self.lines());
        self.was = now;
        match (was, now) {
            ((true, true), (true, false)) => (self.state, self.bits, self.shift) = (State::Address, 0, 0),
            ((true, false), (true, true)) => {
                (self.state, self.pulled, self.selected) = (State::Idle, false, None);
            }
            ((false, _), (true, data)) => {
                self.disturb();
                self.bits_seen += 1;
                self.bits += 1;
                self.shift = self.shift << 1 | u8::from(data ^ self.wrong_bit);
            }
            ((true, _), (false, _)) => self.fall(),
            _ => {}
        }
        self.was = self.lines();
    }

    fn disturb(&mut self) {
        let d = &mut self.disturbance;
        d.data_low_clocks = d.data_low_clocks.saturating_sub(1);
        self.wrong_bit = false;
        d.flip_in = match d.flip_in {
            Some((0, n)) => {
                self.wrong_bit = true;
                (n > 1).then_some((0, n - 1))
            }
            Some((left, n)) => Some((left - 1, n)),
            None => None,
        };
    }

    fn refused(&mut self) -> bool {
        let d = &mut self.disturbance;
        let refused = d.nack_in == Some(0);
        d.nack_in = d.nack_in.filter(|_| !refused).map(|n| n - 1);
        refused
    }

    fn fall(&mut self) {
        match (self.state, self.bits) {
            (State::Idle | State::Ignore, _) | (_, 0) => {}
            (State::Read, 8) => self.pulled = false,
            (State::Read, 9) if self.shift & 1 == 1 => (self.state, self.pulled) = (State::Ignore, false),
            (State::Read, 9) => self.give_byte(),
            (State::Read, bits) => self.pulled = self.out >> (7 - bits) & 1 == 0,
            (State::Address, 8) => self.addressed(),
            (State::Write, 8) => {
                let byte = self.shift;
                let taken = self.selected.is_some_and(|i| self.targets[i].write(byte));
                self.pulled = taken && !self.refused();
            }
            (State::Address, 9) if self.selected.is_none() => self.state = State::Ignore,
            (State::Address, 9) if self.reading => {
                self.state = State::Read;
                self.give_byte();
            }
            (_, 9) => (self.state, self.pulled, self.bits, self.shift) = (State::Write, false, 0, 0),
            _ => {}
        }
    }

    fn addressed(&mut self) {
        let (address, now) = (self.shift >> 1, self.clock.now_ns());
        self.reading = self.shift & 1 == 1;
        let deaf = self.disturbance.deaf.is_some_and(|(a, until)| a == address && now < until);
        self.selected = self.targets.iter().position(|t| t.address() == address).filter(|_| !deaf);
        if self.selected.is_some() && self.refused() {
            self.selected = None;
        }
        if let Some(i) = self.selected {
            if self.targets[i].listens() {
                self.targets[i].begin(self.reading);
                self.pulled = true;
            } else {
                self.selected = None;
            }
        }
    }

    fn give_byte(&mut self) {
        self.out = self.selected.map_or(0xff, |i| self.targets[i].read());
        self.pulled = self.out >> 7 == 0;
        (self.bits, self.shift) = (0, 0);
    }
}

/// One of the two lines, as the master's pin.
#[derive(Clone)]
pub struct WirePin {
    wires: Rc<RefCell<Wires>>,
    clock: bool,
}

impl WirePin {
    /// Clock and data pins.
    #[must_use]
    pub fn pair(wires: &Rc<RefCell<Wires>>) -> (Self, Self) {
        (Self { wires: wires.clone(), clock: true }, Self { wires: wires.clone(), clock: false })
    }

    fn put(&self, high: bool) {
        let mut wires = self.wires.borrow_mut();
        let master = if self.clock { &mut wires.master.0 } else { &mut wires.master.1 };
        *master = high;
        wires.settle();
    }
}

impl ErrorType for WirePin {
    type Error = Infallible;
}

impl OutputPin for WirePin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.put(false);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.put(true);
        Ok(())
    }
}

impl InputPin for WirePin {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let mut wires = self.wires.borrow_mut();
        // A line that a fault let go rises without anybody's doing.
        if wires.lines() != wires.was {
            wires.settle();
        }
        let (clock, data) = wires.lines();
        Ok(if self.clock { clock } else { data ^ (wires.wrong_bit && clock) })
    }
    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}
