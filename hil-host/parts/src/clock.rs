//! Virtual time, shared by everything on the bench, and for how long each part was at work.

use embedded_hal::delay::DelayNs;
use std::cell::Cell;
use std::rc::Rc;

/// A state of a part that takes more current than its rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// Pressure transducer converting.
    Pressure = 0,
    /// ADC converting.
    Adc = 1,
    /// Flash programming a page.
    Program = 2,
    /// Flash erasing a sector.
    Erase = 3,
    /// Processor running, not asleep.
    Processor = 4,
    /// GPS receiver with its supply on.
    Gps = 5,
}

/// How many there are.
const WORKS: usize = 6;

/// Nanoseconds since the bench was switched on; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Clock(Rc<State>);

#[derive(Debug, Default)]
struct State {
    now_ns: Cell<u64>,
    worked_ns: [Cell<u64>; WORKS],
}

impl Clock {
    /// Now, ns.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.0.now_ns.get()
    }

    /// Lets time pass.
    pub fn pass_ns(&self, ns: u64) {
        self.0.now_ns.set(self.now_ns().saturating_add(ns));
    }

    /// A part works for so long.
    pub fn work(&self, work: Work, ns: u64) {
        if let Some(worked) = self.0.worked_ns.get(work as usize) {
            worked.set(worked.get() + ns);
        }
    }

    /// Time that a part has worked, s.
    #[must_use]
    pub fn worked_s(&self, work: Work) -> f64 {
        self.0.worked_ns.get(work as usize).map_or(0.0, |ns| ns.get() as f64 * 1e-9)
    }

    /// Goes on to a later moment.
    pub fn until_ns(&self, ns: u64) {
        self.0.now_ns.set(self.now_ns().max(ns));
    }
}

impl DelayNs for Clock {
    fn delay_ns(&mut self, ns: u32) {
        self.pass_ns(u64::from(ns));
    }
}
