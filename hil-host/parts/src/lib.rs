//! The fitted parts of the science bay, as their datasheets describe them:
//! registers, conversion times, bytes at a baud rate, erases that take time.
//!
//! | file | part |
//! |---|---|
//! | [`wires`] | the two I²C lines, bit by bit, with whoever pulls them |
//! | [`ms5837`] | TE MS5837-30BA pressure transducer (and its 2 bar sister) |
//! | [`ads1115`] | TI ADS1115 ADC with pots, hull pressure and leak loop at its inputs |
//! | [`ina226`] | TI INA226 battery monitor |
//! | [`talker`] | a port with bytes that come in time: [`os5000`] compass, [`gps`] receiver |
//! | [`iridium`] | Iridium 9602 modem, fitted or not |
//! | [`w25q128`] | Winbond W25Q128JV flash with BUSY times and torn writes |
//! | [`chip_flash`] | the chip's own flash with its controller, and what a power cut leaves of it |
//! | [`rtc`] | the chip's calendar clock, which goes on over a reset |
//! | [`stop`] | what else of the chip its STOP mode needs |
//! | [`options`] | the chip's option bytes |
//! | [`outputs`] | motor bridges, burn wire, beacon, servo |
//! | [`mod@bench`] | all of them together |
//! | [`faults`] | what goes wrong on the buses |
//!
//! Written from the datasheets and not from the drivers, which this room does
//! not see: what both understand wrongly alike stays hidden, what one does shows.
//! Time is virtual ([`Clock`]): waiting costs nothing and is exact.
//!
//! # Dependencies
//!
//! * `embedded-hal`, `embedded-io`: the traits under which drivers find a part
#![allow(clippy::disallowed_methods)] // host only: nothing here runs on the target

pub mod ads1115;
pub mod bench;
pub mod chip_flash;
pub mod clock;
pub mod faults;
pub mod gps;
pub mod ina226;
pub mod iridium;
pub mod ms5837;
pub mod options;
pub mod os5000;
pub mod outputs;
pub mod rtc;
pub mod stop;
pub mod talker;
pub mod w25q128;
pub mod wires;

pub use bench::Bench;
pub use clock::{Clock, Work};
use std::cell::RefCell;
use std::rc::Rc;

/// What there is to measure at one moment. `None`: the part gives nothing (broken wire, dead, out of its range).
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Absolute pressure at the transducer, Pa.
    pub pressure_pa: Option<f64>,
    /// Temperature of the transducer, °C.
    pub temperature_c: f64,
    /// Pitch, roll, heading, rad.
    pub attitude_rad: [Option<f64>; 3],
    /// Position of the pump's pot, -1 (in) to 1 (out).
    pub pump: Option<f64>,
    /// Position of the battery's pot, -1 (aft) to 1 (forward).
    pub mass: Option<f64>,
    /// Pressure inside the hull, Pa absolute.
    pub vacuum_pa: Option<f64>,
    /// Water at the leak detector; none: its loop is broken.
    pub wet: Option<bool>,
    /// Battery voltage, V.
    pub volts: Option<f64>,
    /// Current out of the battery, A.
    pub amps: f64,
    /// The burn wire is whole.
    pub wire: bool,
    /// The antenna is out and has a fix.
    pub fix: bool,
}

/// What the board's outputs do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Pump runs out or in.
    pub pump: Option<bool>,
    /// Battery runs forward or aft.
    pub mass: Option<bool>,
    /// Angle that the fin's servo is told, rad; none: it has no supply or no pulses, and its gear holds the fin.
    pub fin_rad: Option<f64>,
    /// Both switches of the burn wire are closed.
    pub fire: bool,
    /// Beacon on.
    pub beacon: bool,
}

/// What surrounds the parts.
pub trait Surroundings {
    /// What there is to measure at `now_ns`, which never runs backwards.
    fn sample(&mut self, now_ns: u64) -> Sample;
    /// Whether the antenna is out and there is a network over it, as the world stands: nothing is measured, no time passes.
    fn sky(&self) -> bool {
        false
    }
    /// The outputs changed at `now_ns`.
    fn drive(&mut self, now_ns: u64, drive: Drive);
}

/// The surroundings, shared by all parts.
pub type Around = Rc<RefCell<dyn Surroundings>>;
