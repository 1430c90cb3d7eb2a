//! All parts on one bench, and what a fault does to them.

use crate::ads1115::Ads1115;
use crate::faults::BusFault;
use crate::gps::Gps;
use crate::ina226::Ina226;
use crate::iridium::Iridium;
use crate::ms5837::{Model, Ms5837};
use crate::options::{Options, SET_UP};
use crate::os5000::Os5000;
use crate::outputs::{Name, Outputs};
use crate::rtc::Rtc;
use crate::talker::Talker;
use crate::w25q128::W25q128;
use crate::wires::Wires;
use crate::{Around, Clock};
use std::cell::RefCell;
use std::rc::Rc;

/// Bytes that each of the board's ports keeps: its queue of 1,024.
const PORT_ROOM: usize = 1_023;

/// Everything that is soldered on.
pub struct Bench {
    /// Time.
    pub clock: Clock,
    /// What surrounds the parts.
    pub around: Around,
    /// I²C.
    pub wires: Rc<RefCell<Wires>>,
    /// Output pins.
    pub outputs: Rc<RefCell<Outputs>>,
    /// Compass with its line.
    pub compass: Rc<RefCell<Talker<Os5000>>>,
    /// GPS receiver with its line.
    pub gps: Rc<RefCell<Talker<Gps>>>,
    /// Modem with its line: not fitted until its fault is another one.
    pub modem: Rc<RefCell<Iridium>>,
    /// Log flash.
    pub flash: Rc<RefCell<W25q128>>,
    /// The chip's option bytes.
    pub options: Rc<RefCell<Options>>,
    /// The chip's calendar clock.
    pub rtc: Rc<RefCell<Rtc>>,
}

impl Bench {
    /// A bench that was just switched on.
    #[must_use]
    pub fn new(around: Around, model: Model) -> Self {
        let clock = Clock::default();
        let wires = Wires::new(
            clock.clone(),
            vec![
                Box::new(Ms5837::new(clock.clone(), around.clone(), model)),
                Box::new(Ads1115::new(clock.clone(), around.clone())),
                Box::new(Ina226::new(clock.clone(), around.clone())),
            ],
        );
        let compass = Rc::new(RefCell::new(Talker::new(clock.clone(), around.clone(), PORT_ROOM)));
        let gps = Rc::new(RefCell::new(Talker::new(clock.clone(), around.clone(), PORT_ROOM)));
        let mut outputs = Outputs::new(clock.clone(), around.clone());
        let (on_compass, on_gps) = (compass.clone(), gps.clone());
        outputs.hang(Name::Compass, Box::new(move |on| on_compass.borrow_mut().supply(on)));
        outputs.hang(Name::Gps, Box::new(move |on| on_gps.borrow_mut().supply(on)));
        Self {
            wires: Rc::new(RefCell::new(wires)),
            outputs: Rc::new(RefCell::new(outputs)),
            compass,
            gps,
            modem: Rc::new(RefCell::new(Iridium::new(clock.clone(), around.clone(), PORT_ROOM))),
            flash: Rc::new(RefCell::new(W25q128::new(clock.clone()))),
            options: Rc::new(RefCell::new(Options::new(SET_UP))),
            rtc: Rc::new(RefCell::new(Rtc::new(clock.clone()))),
            clock,
            around,
        }
    }

    /// The supply dips: the processor is reset, and with `parts` everything else too.
    pub fn brown_out(&self, parts: bool) {
        self.outputs.borrow_mut().reset();
        self.compass.borrow_mut().forget();
        self.gps.borrow_mut().forget();
        self.modem.borrow_mut().reset();
        self.rtc.borrow_mut().reset();
        self.options.borrow_mut().reset();
        if parts {
            self.rtc.borrow_mut().power_cycle();
            self.wires.borrow_mut().power_cycle(None);
            self.flash.borrow_mut().power_cycle();
        }
    }

    /// Something goes wrong, from now on.
    pub fn disturb(&self, fault: BusFault) {
        let after = |ms: u32| self.clock.now_ns() + u64::from(ms) * 1_000_000;
        let mut wires = self.wires.borrow_mut();
        let d = &mut wires.disturbance;
        match fault {
            BusFault::Nack { bytes } => d.nack_in = Some(bytes),
            BusFault::Flip { bits, run } => d.flip_in = Some((bits, run)),
            BusFault::DataLow { ms } => d.data_low_until_ns = after(ms),
            BusFault::DataHeld { clocks } => d.data_low_clocks = clocks,
            BusFault::ClockLow { ms } => d.clock_low_until_ns = after(ms),
            BusFault::Deaf { address, ms } => d.deaf = Some((address, after(ms))),
            BusFault::PartReset { address } => wires.power_cycle(Some(address)),
            BusFault::CompassNoise { bytes } => {
                // Bits of each byte by its place: any pattern will do that is not one.
                let pattern = (0..bytes).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 13) as u8 & 0x7f);
                self.compass.borrow_mut().noise.extend(pattern.clone());
                self.gps.borrow_mut().noise.extend(pattern);
            }
            BusFault::CompassSilent { ms } => self.compass.borrow_mut().silent_until_ns = after(ms),
            BusFault::FlashNoise { bytes } => {
                self.flash.borrow_mut().noise.extend((0..bytes).map(|i| (i.wrapping_mul(0x85eb_ca6b) >> 11) as u8));
            }
            BusFault::FlashAbsent { ms } => self.flash.borrow_mut().absent_until_ns = after(ms),
            BusFault::FlashPace { slow } => self.flash.borrow_mut().slow = slow,
        }
    }
}
