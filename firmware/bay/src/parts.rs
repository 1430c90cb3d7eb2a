//! The vehicle's own sensors and actuators: what fills a frame when no host does.
//!
//! Little is kept from one cycle to the next: the air pressure at the surface,
//! the charge drawn, the attitude that holds. A part that does not answer is a
//! missing reading, and the law knows what to do. Not on this board: a second
//! depth, a CTD, an altimeter; the fin's servo has no feedback.

use crate::antenna::Antenna;
use crate::compass::Compass;
use crate::radio::Radio;
use crate::rudder::Rudder;
use crate::scale::{self, Scale};
use crate::supplies::{self, COMPASS_FRESH_MS, HULL_START_MS, POTS_START_MS, Supplies, SupplyPins};
use crate::trips::Trips;
use control::config::Settings;
use devices::adc::{self, Channel};
use devices::attitude::Attitude;
use devices::gauge::Gauge;
use devices::motor::{Doing, Motor};
use devices::pressure::{Measured, Pressure};
use devices::release::Release;
use devices::vacuum;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::i2c::I2c;
use embedded_hal::pwm::SetDutyCycle;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use signals::{ActuatorCommand, Micros, Phase, Reading, SensorFrame, Surface, Weight};

/// Capacity of the battery, A·s: 215 A·h of alkaline cells (guess).
pub const CAPACITY_C: f32 = 215.0 * 3600.0;
/// Air pressure until it was looked at, Pa.
pub const AIR_PA: f32 = 101_325.0;
/// Air pressures that are believed, Pa: from a lake at 5,500 m to the highest ever measured at sea.
pub const AIR_RANGE_PA: core::ops::RangeInclusive<f32> = 50_000.0..=109_000.0;
/// Time between two looks at motors and release that are at work, s.
const LOOK_S: f32 = 0.2;
/// And at those that rest, s: a pump that creeps is seen.
const REST_S: f32 = 2.0;

/// Which types the chip has for what is fitted.
pub trait Fitted {
    /// Bus of pressure transducer, ADC and battery gauge.
    type Bus: I2c;
    /// Waiting.
    type Delay: DelayNs;
    /// Inputs of the motor bridges.
    type Motor: SetDutyCycle;
    /// Switches.
    type Out: OutputPin;
    /// Sense lines.
    type In: InputPin;
    /// Servo of the fin.
    type Servo: SetDutyCycle;
    /// Port of the compass.
    type Compass: Read + ReadReady;
    /// Port of the GPS receiver.
    type Gps: Read + ReadReady;
    /// Port of the modem.
    type Modem: Read + ReadReady + Write + WriteReady;
    /// Switch of its supply.
    type ModemPower: OutputPin;
}

/// Everything on the pins.
pub struct Wiring<F: Fitted> {
    /// I²C.
    pub bus: F::Bus,
    /// Waiting.
    pub delay: F::Delay,
    /// Ballast pump: more and less displaced water.
    pub pump: (F::Motor, F::Motor),
    /// Battery mass: forward and aft.
    pub mass: (F::Motor, F::Motor),
    /// Drop weight: arm and fire.
    pub release: (F::Out, F::Out),
    /// Locator beacon.
    pub beacon: F::Out,
    /// Continuity of the burn wire: high while it is whole.
    pub wire: F::In,
    /// nFAULT of both bridges: low while one has switched itself off.
    pub bridge_fault: F::In,
    /// Fin.
    pub fin: F::Servo,
    /// Port of the compass.
    pub compass: F::Compass,
    /// Port of the GPS receiver.
    pub gps: F::Gps,
    /// Switches of the supplies.
    pub supplies: SupplyPins<F::Out>,
    /// Modem, fitted or not: its port, and its supply's switch.
    pub modem: (F::Modem, F::ModemPower),
}

/// The parts, at work.
pub struct Parts<F: Fitted> {
    bus: F::Bus,
    delay: F::Delay,
    pump: Motor<F::Motor, F::Motor>,
    mass: Motor<F::Motor, F::Motor>,
    release: Release<F::Out, F::Out>,
    beacon: F::Out,
    wire: F::In,
    trips: Trips<F::In>,
    rudder: Rudder<F::Servo, F::Out>,
    supplies: Supplies<F::Out>,
    /// The compass.
    pub compass: Compass<F::Compass>,
    /// The GPS receiver.
    pub antenna: Antenna<F::Gps>,
    /// The radio.
    pub radio: Radio<F::Modem, F::ModemPower>,
    pressure: Option<Pressure>,
    air_pa: f32,
    gauge: Gauge,
    scale: Scale,
    wanted: Option<ActuatorCommand>,
    looked_ms: u64,
    look_due_ms: u64,
    seq: u32,
}

impl<F: Fitted> Parts<F> {
    /// Takes the pins; nothing moves.
    pub fn new(wiring: Wiring<F>, settings: &Settings) -> Self {
        let scale = Scale::of(settings);
        let Wiring { bus, delay, pump, mass, release, beacon, wire, bridge_fault, fin, compass, gps, supplies, modem } = wiring;
        let (supplies, servo) = Supplies::new(supplies);
        let mut parts = Self {
            bus,
            delay,
            pump: Motor::new(pump.0, pump.1, scale.pump),
            mass: Motor::new(mass.0, mass.1, scale.mass),
            release: Release::new(release.0, release.1),
            beacon,
            wire,
            trips: Trips::new(bridge_fault),
            rudder: Rudder::new(fin, servo),
            supplies,
            compass: Compass::new(compass),
            antenna: Antenna::new(gps),
            radio: Radio::new(modem.0, modem.1),
            pressure: None,
            air_pa: AIR_PA,
            gauge: Gauge::full(CAPACITY_C),
            scale,
            wanted: None,
            looked_ms: 0,
            look_due_ms: 0,
            seq: 0,
        };
        parts.rest();
        parts
    }

    /// The mission's configuration: ranges, rates and times of what is fitted.
    pub fn fit(&mut self, settings: &Settings) {
        self.scale = Scale::of(settings);
        self.pump.limit(self.scale.pump);
        self.mass.limit(self.scale.mass);
    }

    /// Takes the bytes that compass, GPS receiver and modem have sent: call often.
    pub fn listen(&mut self, now_ms: u64) {
        self.compass.listen(now_ms);
        self.antenna.listen(now_ms);
        self.radio.poll(now_ms);
    }

    /// Air pressure that depth is reckoned from, Pa.
    pub const fn air_pa(&self) -> f32 {
        self.air_pa
    }

    /// Takes an air pressure that was measured before.
    pub fn remember_air(&mut self, air_pa: f32) {
        if AIR_RANGE_PA.contains(&air_pa) {
            self.air_pa = air_pa;
        }
    }

    /// Takes the zero of depth: the vehicle is on deck or afloat. False: no believable air pressure, the last one stays.
    pub fn zero_depth(&mut self) -> bool {
        let measured = self.measure_pressure().map(|m| m.pressure_pa).filter(|pa| AIR_RANGE_PA.contains(pa));
        self.air_pa = measured.unwrap_or(self.air_pa);
        measured.is_some()
    }

    fn measure_pressure(&mut self) -> Option<Measured> {
        if self.pressure.is_none() {
            self.pressure = Pressure::start(&mut self.bus, &mut self.delay).ok();
        }
        let measured = self.pressure.as_ref()?.measure(&mut self.bus, &mut self.delay).ok();
        if measured.is_none() {
            self.pressure = None; // started anew in the next cycle
        }
        measured
    }

    fn volts(&mut self, channel: Channel) -> Option<f32> {
        adc::volts(&mut self.bus, &mut self.delay, channel).ok()
    }

    /// Switches compass and GPS receiver on: on deck, and at a bench.
    pub fn wake(&mut self) {
        self.wake_compass();
        self.supplies.gps.put(true);
    }

    /// Switches the compass on: in time for the next reading.
    pub fn wake_compass(&mut self) {
        if self.supplies.compass.put(true) {
            self.compass.begin();
        }
    }

    /// Switches off what this reading no longer needs. A compass that gave nothing stays on, so that it is heard as soon as it speaks.
    /// What it has said is heard now: afterwards nobody could tell how old that is.
    pub fn doze(&mut self, now_ms: u64, phase: Phase, depth: Reading) {
        self.compass.listen(now_ms);
        let fresh = self.compass.attitude().is_some_and(|(_, at_ms)| now_ms.saturating_sub(*at_ms) <= COMPASS_FRESH_MS);
        if fresh {
            self.supplies.compass.put(false);
        }
        self.supplies.gps.put(supplies::gps_wanted(phase, depth));
    }

    /// Nothing moves, speaks or is about to fire: the chip's clocks may stand still.
    pub fn are_still(&self) -> bool {
        let quiet = self.supplies.are_off() && self.radio.is_off();
        quiet && self.rudder.due_ms().is_none() && !self.wanted.is_some_and(|wanted| wanted.drop_weight)
    }

    /// ADC and what hangs on its inputs: on, and standing.
    fn wake_analog(&mut self, start_ms: u32) {
        if self.supplies.analog.put(true) || start_ms > POTS_START_MS {
            self.delay.delay_ms(start_ms);
        }
    }

    /// Off again, but while a motor is driven: then its pot is looked at five times a second.
    fn doze_analog(&mut self) {
        if !self.supplies.bridges.is_on() {
            self.supplies.analog.put(false);
        }
    }

    /// What is measured now. About 100 ms with all parts there.
    pub fn measure(&mut self, now_ms: u64, dt_s: f32) -> SensorFrame {
        self.seq = self.seq.wrapping_add(1);
        self.listen(now_ms);
        let measured = self.measure_pressure();
        let supply = self.gauge.measure(&mut self.bus, dt_s).ok();
        self.wake_analog(HULL_START_MS);
        let (ballast_m3, battery_mass_m) = (self.pump_m3(), self.mass_m());
        let vacuum_pa = self.volts(Channel::Vacuum).and_then(|volts| vacuum::pascals(volts).ok());
        let leak = scale::leak(self.volts(Channel::Leak));
        self.doze_analog();
        let held = self.compass.attitude();
        let attitude = |of: fn(&Attitude) -> f32| match held {
            Some((a, at_ms)) => Reading::Sampled { value: of(a), age_ms: u32::try_from(now_ms.saturating_sub(*at_ms)).unwrap_or(u32::MAX) },
            None => Reading::Missing,
        };
        let (pitch_rad, roll_rad, heading_rad) = (attitude(|a| a.pitch_rad), attitude(|a| a.roll_rad), attitude(|a| a.heading_rad));
        SensorFrame {
            seq: self.seq,
            time: Micros::from_millis(now_ms),
            depth_m: reading(measured.map(|m| m.depth_m(self.air_pa))),
            pitch_rad,
            roll_rad,
            heading_rad,
            ballast_m3: reading(ballast_m3),
            battery_mass_m: reading(battery_mass_m),
            battery_v: reading(supply.map(|s| s.volts)),
            charge: reading(supply.map(|_| self.gauge.charge())),
            vacuum_pa: reading(vacuum_pa),
            leak,
            weight: match self.wire.is_high() {
                Ok(true) => Weight::Held,
                Ok(false) => Weight::Released,
                Err(_) => Weight::Unknown,
            },
            surface: Surface { gps_fix: self.antenna.has_fix(now_ms), comms: self.radio.take_heard(now_ms) },
            ..SensorFrame::default()
        }
    }

    fn pump_m3(&mut self) -> Option<f32> {
        scale::position(self.volts(Channel::Pump)?, self.scale.pump_m3)
    }

    fn mass_m(&mut self) -> Option<f32> {
        scale::position(self.volts(Channel::Battery)?, self.scale.mass_m)
    }

    /// What shall be done until the next command.
    pub fn command(&mut self, wanted: ActuatorCommand) {
        self.wanted = Some(wanted);
        self.look_due_ms = 0;
    }

    /// Nothing shall be done: motors, release and beacon off until the next command.
    pub fn rest(&mut self) {
        self.wanted = None;
        self.pump.stop();
        self.mass.stop();
        self.release.stop();
        let _ = self.beacon.set_low();
        self.rudder.rest();
        self.supplies.bridges.put(false);
        self.supplies.analog.put(false);
    }

    /// Absolute pressure at the transducer, Pa.
    pub fn pressure_pa(&mut self) -> Reading {
        reading(self.measure_pressure().map(|m| m.pressure_pa))
    }

    /// What the motors' strokes and times are.
    pub const fn scale(&self) -> &Scale {
        &self.scale
    }

    /// When the next look at the motors is due; none: nothing is wanted.
    pub fn look_due_ms(&self) -> Option<u64> {
        self.wanted.map(|_| self.look_due_ms)
    }

    /// Moves towards what is wanted: call when it is due. Says where pump and battery mass are.
    pub fn act(&mut self, now_ms: u64) -> (Option<f32>, Option<f32>) {
        let Some(wanted) = self.wanted else { return (None, None) };
        let dt_s = (now_ms.saturating_sub(self.looked_ms).min(10_000) as f32) * 1e-3;
        self.looked_ms = now_ms;
        self.wake_analog(POTS_START_MS);
        let (pump, mass) = (self.pump_m3(), self.mass_m());
        let doing = [self.pump.look(pump, wanted.ballast_m3, dt_s), self.mass.look(mass, wanted.battery_mass_m, dt_s)];
        let driving = doing.iter().any(|doing| matches!(doing, Doing::Driving(_)));
        let awake = self.trips.awake(driving, self.supplies.bridges.is_on());
        self.supplies.bridges.put(awake);
        self.doze_analog();
        self.release.look(wanted.drop_weight, dt_s);
        self.rudder.look(wanted.fin_rad, now_ms);
        let _ = if wanted.beacon { self.beacon.set_high() } else { self.beacon.set_low() };
        let firing_s = wanted.drop_weight.then_some(LOOK_S);
        let due = [self.pump.next_look_s(LOOK_S), self.mass.next_look_s(LOOK_S), firing_s];
        let due_s = due.into_iter().flatten().fold(REST_S, |least: f32, s| if s < least { s } else { least });
        let due_ms = now_ms.saturating_add((due_s * 1e3) as u64);
        self.look_due_ms = self.rudder.due_ms().map_or(due_ms, |rudder_ms| rudder_ms.min(due_ms));
        (pump, mass)
    }
}

fn reading(value: Option<f32>) -> Reading {
    value.map_or(Reading::Missing, Reading::now)
}
