//! What the board's pins switch: motor bridges (TI DRV8873), burn wire, beacon, servo, and the supplies of parts.

use crate::{Around, Clock, Drive, Work};
use embedded_hal::digital::{self, InputPin, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// Which pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    /// Pump, more displaced water.
    PumpOut = 0,
    /// Pump, less.
    PumpIn = 1,
    /// Battery forward.
    MassForward = 2,
    /// Battery aft.
    MassAft = 3,
    /// Burn wire, first switch.
    Arm = 4,
    /// Burn wire, second switch.
    Fire = 5,
    /// Beacon.
    Beacon = 6,
    /// Supply of the compass.
    Compass = 7,
    /// Supply of the GPS receiver.
    Gps = 8,
    /// Supply of ADC, pots, hull pressure sensor and leak loop.
    Analog = 9,
    /// Both bridges awake (nSLEEP). They take 1.5 ms to wake: less than a pot can see, and not modelled.
    Bridges = 10,
    /// Supply of the servo.
    Servo = 11,
}

/// What is told that its supply was switched.
pub type Switched = Box<dyn FnMut(bool)>;

/// All pins with what hangs on them.
pub struct Outputs {
    clock: Clock,
    around: Around,
    pins: [bool; 12],
    /// What the pulses say; none: there are none.
    fin_rad: Option<f64>,
    last: Drive,
    /// Parts that hang on the supplies of compass and GPS receiver.
    hung: Vec<(Name, Switched)>,
    /// Both inputs of a bridge were high at once.
    pub shorted: bool,
    /// A bridge has switched itself off for too much current, until it is put to sleep.
    pub tripped: bool,
    /// It does so so many times more, whenever a motor begins.
    pub trips_left: u32,
    /// Its nFAULT line is held low whatever it does.
    pub fault_shorted: bool,
}

impl Outputs {
    /// All low: the state before any program runs.
    #[must_use]
    pub fn new(clock: Clock, around: Around) -> Self {
        Self {
            clock,
            around,
            pins: [false; 12],
            fin_rad: None,
            last: Drive::default(),
            hung: Vec::new(),
            shorted: false,
            tripped: false,
            trips_left: 0,
            fault_shorted: false,
        }
    }

    /// A part hangs on a supply.
    pub fn hang(&mut self, name: Name, part: Switched) {
        self.hung.push((name, part));
    }

    /// A reset: all pins are inputs, pulled low at the bridges and at the switches; the timer of the servo stands still.
    pub fn reset(&mut self) {
        (self.pins, self.fin_rad) = ([false; 12], None);
        self.tell();
    }

    fn put(&mut self, name: Name, high: bool) {
        self.pins[name as usize] = high;
        self.tell();
    }

    /// What the outputs do now.
    #[must_use]
    pub const fn drive(&self) -> Drive {
        self.last
    }

    fn tell(&mut self) {
        let [out, inward, forward, aft, arm, fire, beacon, compass, gps, analog, bridges, servo] = self.pins;
        for (work, on) in [(Work::Analog, analog), (Work::Bridges, bridges), (Work::Servo, servo)] {
            self.clock.switch(work, on);
        }
        for (name, part) in &mut self.hung {
            part(if *name == Name::Compass { compass } else { gps });
        }
        self.tripped &= bridges;
        if bridges && !self.tripped && self.trips_left > 0 && (out != inward || forward != aft) {
            (self.tripped, self.trips_left) = (true, self.trips_left - 1);
        }
        let tripped = self.tripped;
        let bridge = |a: bool, b: bool| (bridges && !tripped && a != b).then_some(a);
        self.shorted |= out && inward || forward && aft;
        let fin_rad = self.fin_rad.filter(|_| servo);
        let drive = Drive { pump: bridge(out, inward), mass: bridge(forward, aft), fin_rad, fire: arm && fire, beacon };
        if drive != self.last {
            self.last = drive;
            self.around.borrow_mut().drive(self.clock.now_ns(), drive);
        }
    }
}

/// One pin.
#[derive(Clone)]
pub struct Pin {
    outputs: Rc<RefCell<Outputs>>,
    name: Name,
}

impl Pin {
    /// The pin of this name.
    #[must_use]
    pub fn new(outputs: &Rc<RefCell<Outputs>>, name: Name) -> Self {
        Self { outputs: outputs.clone(), name }
    }
}

impl digital::ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.outputs.borrow_mut().put(self.name, false);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.outputs.borrow_mut().put(self.name, true);
        Ok(())
    }
}

impl pwm::ErrorType for Pin {
    type Error = Infallible;
}

impl SetDutyCycle for Pin {
    fn max_duty_cycle(&self) -> u16 {
        1
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.outputs.borrow_mut().put(self.name, duty > 0);
        Ok(())
    }
}

/// A servo at a timer of 20,000 steps in 20 ms (Hitec D646WP: 1.5 ms is the middle, 0.8 ms a radian).
#[derive(Clone)]
pub struct Servo(pub Rc<RefCell<Outputs>>);

impl pwm::ErrorType for Servo {
    type Error = Infallible;
}

impl SetDutyCycle for Servo {
    fn max_duty_cycle(&self) -> u16 {
        20_000
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        let mut outputs = self.0.borrow_mut();
        outputs.fin_rad = (duty > 0).then(|| (f64::from(duty) - 1_500.0) / 800.0);
        outputs.tell();
        Ok(())
    }
}

/// A line that the board reads.
#[derive(Clone)]
pub enum Sense {
    /// The burn wire: high while it is whole.
    Wire(Clock, Around),
    /// nFAULT of both bridges, open drain, pulled up: low while one has switched itself off.
    BridgeFault(Rc<RefCell<Outputs>>),
}

impl digital::ErrorType for Sense {
    type Error = Infallible;
}

impl InputPin for Sense {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(match self {
            Self::Wire(clock, around) => around.borrow_mut().sample(clock.now_ns()).wire,
            Self::BridgeFault(outputs) => !outputs.borrow().tripped && !outputs.borrow().fault_shorted,
        })
    }
    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}
