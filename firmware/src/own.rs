//! The vehicle's own sensors and actuators: what fills a frame when no host does.
//!
//! | pin | function |
//! |---|---|
//! | PB6, PB7 | I²C clock, data: pressure, ADC, battery gauge |
//! | PB10, PB11 | USART3: attitude |
//! | PC0, PC1 | ballast pump, more and less displaced water |
//! | PC2, PC3 | battery mass, forward and aft |
//! | PC4, PC5 | drop weight, arm and fire |
//! | PC6 | locator beacon |
//!
//! Nothing is kept from one cycle to the next but the air pressure at the
//! surface: a part that does not answer is a missing reading, and the law
//! knows what to do. No fin servo and no second depth on this board yet: the
//! fin's feedback is missing, and no antenna is heard.

use crate::board::pins::{Drive, Pin, Port, Wait};
use devices::adc::{self, Channel};
use devices::attitude::{Attitude, Reader};
use devices::gauge::Gauge;
use devices::motor::{Limits, Motor};
use devices::pressure::Pressure;
use devices::release::Release;
use devices::soft_i2c::SoftI2c;
use devices::vacuum;
use embedded_hal::digital::OutputPin;
use signals::{ActuatorCommand, Micros, Reading, SensorFrame, Switch};
use stm32f4::stm32f405::USART3;

/// Capacity of the battery, A·s: 215 A·h of alkaline cells (guess).
const CAPACITY_C: f32 = 215.0 * 3600.0;
/// Pot voltage range, V, over the whole stroke of pump and mass (guess: 0.2..3.1 V).
const POT_V: (f32, f32) = (0.2, 3.1);
/// Pump stroke either side of the middle, m³ (matches the default configuration).
const PUMP_M3: f32 = 236e-6;
/// Battery mass stroke either side of the middle, m (as above).
const MASS_M: f32 = 0.0254;
/// Leak input below this is wet, V (guess: pulled to 3.3 V, water pulls down).
const LEAK_V: f32 = 2.0;
/// Air pressure until the first look at the surface, Pa.
const AIR_PA: f32 = 101_325.0;

/// Times of a 13 cc/s pump over its whole stroke, 36 s, with half as much again.
const PUMP: Limits = Limits { dead_band: 2e-6, least_motion: 5e-6, stall_s: 6.0, longest_s: 55.0, blind_s: 40.0 };
/// Times of a 0.1 in/s mass over its whole stroke, 20 s, with half as much again.
const MASS: Limits = Limits { dead_band: 0.4e-3, least_motion: 1e-3, stall_s: 2.0, longest_s: 30.0, blind_s: 2.0 };

/// Everything on the pins.
pub struct Own {
    bus: SoftI2c<Pin, Pin, Wait>,
    pressure: Option<Pressure>,
    air_pa: f32,
    gauge: Gauge,
    pump: Motor<Pin, Pin>,
    mass: Motor<Pin, Pin>,
    release: Release<Pin, Pin>,
    beacon: Pin,
    attitude_port: USART3,
    reader: Reader,
    attitude: Option<(Attitude, u64)>,
    wanted: Option<ActuatorCommand>,
    seq: u32,
}

impl Own {
    /// Takes the pins and finds out who is there.
    pub fn start(attitude_port: USART3) -> Self {
        let out = |bit| Pin::new(Port::C, bit, Drive::PushPull);
        let clock = Pin::new(Port::B, 6, Drive::OpenDrain);
        let mut bus = SoftI2c::new(clock, Pin::new(Port::B, 7, Drive::OpenDrain), Wait);
        let divisor = crate::board::line::divisor(19_200); // the OS5000's default rate
        attitude_port.brr().write(|w| w.div_mantissa().set((divisor >> 4) as u16).div_fraction().set((divisor & 0xf) as u8));
        attitude_port.cr1().write(|w| w.ue().enabled().re().enabled());
        Self {
            pressure: Pressure::start(&mut bus, &mut Wait).ok(),
            bus,
            air_pa: AIR_PA,
            gauge: Gauge::full(CAPACITY_C),
            pump: Motor::new(out(0), out(1), PUMP),
            mass: Motor::new(out(2), out(3), MASS),
            release: Release::new(out(4), out(5)),
            beacon: out(6),
            attitude_port,
            reader: Reader::default(),
            attitude: None,
            wanted: None,
            seq: 0,
        }
    }

    /// Whether the pressure transducer answered at start.
    pub fn has_pressure(&self) -> bool {
        self.pressure.is_some()
    }

    /// Takes a waiting byte of the attitude sensor: call often.
    pub fn listen(&mut self, now_ms: u64) {
        if self.attitude_port.sr().read().rxne().bit_is_set() {
            let byte = self.attitude_port.dr().read().dr().bits() as u8;
            if let Some(Ok(attitude)) = self.reader.push(byte) {
                self.attitude = Some((attitude, now_ms));
            }
        }
    }

    /// What is measured now. About 90 ms with all parts there.
    pub fn measure(&mut self, now_ms: u64, dt_s: f32) -> SensorFrame {
        self.seq = self.seq.wrapping_add(1);
        if self.pressure.is_none() {
            self.pressure = Pressure::start(&mut self.bus, &mut Wait).ok();
        }
        let measured = self.pressure.as_ref().and_then(|p| p.measure(&mut self.bus, &mut Wait).ok());
        if measured.is_none() {
            self.pressure = None; // started anew in the next cycle
        }
        let supply = self.gauge.measure(&mut self.bus, dt_s).ok();
        let vacuum_pa = adc::volts(&mut self.bus, &mut Wait, Channel::Vacuum).and_then(vacuum::pascals).ok();
        let leak = match adc::volts(&mut self.bus, &mut Wait, Channel::Leak) {
            Ok(volts) if volts < LEAK_V => Switch::Alarm,
            Ok(_) => Switch::Clear,
            Err(_) => Switch::Unknown,
        };
        let attitude = |of: fn(&Attitude) -> f32| match &self.attitude {
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
            ballast_m3: reading(self.stroke(Channel::Pump, PUMP_M3)),
            battery_mass_m: reading(self.stroke(Channel::Battery, MASS_M)),
            battery_v: reading(supply.map(|s| s.volts)),
            charge: reading(supply.map(|_| self.gauge.charge())),
            vacuum_pa: reading(vacuum_pa),
            leak,
            ..SensorFrame::default()
        }
    }

    /// Position of a pot over a stroke of `range` either side.
    fn stroke(&mut self, channel: Channel, range: f32) -> Option<f32> {
        let volts = adc::volts(&mut self.bus, &mut Wait, channel).ok()?;
        let share = (volts - POT_V.0) / (POT_V.1 - POT_V.0);
        (-0.05..=1.05).contains(&share).then_some((2.0 * share - 1.0) * range)
    }

    /// What shall be done until the next command.
    pub fn command(&mut self, wanted: ActuatorCommand) {
        self.wanted = Some(wanted);
    }

    /// Nothing shall be done: motors, release and beacon off until the next command.
    pub fn rest(&mut self) {
        self.wanted = None;
        self.pump.stop();
        self.mass.stop();
        self.release.stop();
        let _ = self.beacon.set_low();
    }

    /// Whether there is anything to do; until the first command nothing moves.
    pub fn has_command(&self) -> bool {
        self.wanted.is_some()
    }

    /// Moves towards what is wanted: call every 200 ms or so.
    pub fn act(&mut self, dt_s: f32) {
        let Some(wanted) = self.wanted else { return };
        let (pump, mass) = (self.stroke(Channel::Pump, PUMP_M3), self.stroke(Channel::Battery, MASS_M));
        self.pump.look(pump, wanted.ballast_m3, dt_s);
        self.mass.look(mass, wanted.battery_mass_m, dt_s);
        self.release.look(wanted.drop_weight, dt_s);
        let _ = if wanted.beacon { self.beacon.set_high() } else { self.beacon.set_low() };
    }
}

fn reading(value: Option<f32>) -> Reading {
    value.map_or(Reading::Missing, Reading::now)
}
