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
    /// Compass with its supply on.
    Compass = 6,
    /// ADC, pots, hull pressure sensor and leak loop with their supply on.
    Analog = 7,
    /// Motor bridges awake.
    Bridges = 8,
    /// Servo with its supply on.
    Servo = 9,
    /// Processor in STOP mode.
    Stop = 10,
    /// Modem with its supply on.
    Modem = 11,
    /// Modem in a session with a satellite.
    ModemSession = 12,
}

/// How many there are.
const WORKS: usize = 13;

/// Nanoseconds since the bench was switched on; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Clock(Rc<State>);

#[derive(Debug, Default)]
struct State {
    now_ns: Cell<u64>,
    worked_ns: [Cell<u64>; WORKS],
    /// Supplies that are on, and since when.
    on_ns: [Cell<Option<u64>>; WORKS],
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

    /// A supply is switched; it works as long as it is on.
    pub fn switch(&self, work: Work, on: bool) {
        let Some(since) = self.0.on_ns.get(work as usize) else { return };
        match (on, since.get()) {
            (true, None) => since.set(Some(self.now_ns())),
            (false, Some(at)) => {
                self.work(work, self.now_ns() - at);
                since.set(None);
            }
            _ => {}
        }
    }

    /// Time that a supply has been on by now, ns; none: it is off.
    #[must_use]
    pub fn on_ns(&self, work: Work) -> Option<u64> {
        self.0.on_ns.get(work as usize)?.get().map(|at| self.now_ns() - at)
    }

    /// Time that a part has worked, s.
    #[must_use]
    pub fn worked_s(&self, work: Work) -> f64 {
        let ended = self.0.worked_ns.get(work as usize).map_or(0, Cell::get);
        (ended + self.on_ns(work).unwrap_or(0)) as f64 * 1e-9
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
