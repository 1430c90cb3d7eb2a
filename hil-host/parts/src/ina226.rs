//! TI INA226 (SBOS547): registers; voltage and current of the battery over a shunt of 10 mΩ.

use crate::wires::Target;
use crate::{Around, Clock};

/// After power-up: both conversions, over and over.
const DEFAULT: u16 = 0x4127;
const SHUNT_OHM: f64 = 0.01;

/// The part.
pub struct Ina226 {
    clock: Clock,
    around: Around,
    config: u16,
    shunt: u16,
    bus: u16,
    pointer: u8,
    written: Vec<u8>,
    at: usize,
}

impl Ina226 {
    /// A part in its surroundings.
    #[must_use]
    pub fn new(clock: Clock, around: Around) -> Self {
        Self { clock, around, config: DEFAULT, shunt: 0, bus: 0, pointer: 0, written: Vec::new(), at: 0 }
    }

    fn value(&mut self) -> u16 {
        let sample = self.around.borrow_mut().sample(self.clock.now_ns());
        // Modes 5 to 7 convert by themselves; powered down it keeps the last result.
        if self.config & 7 >= 5 {
            let volts = sample.volts.filter(|v| v.is_finite()).unwrap_or(0.0);
            self.bus = (volts / 1.25e-3).round().clamp(0.0, 32_767.0) as u16;
            self.shunt = (sample.amps * SHUNT_OHM / 2.5e-6).round().clamp(-32_768.0, 32_767.0) as i16 as u16;
        }
        match self.pointer {
            0x00 => self.config,
            0x01 => self.shunt,
            0x02 => self.bus,
            0xfe => 0x5449,
            0xff => 0x2260,
            _ => 0,
        }
    }
}

impl Target for Ina226 {
    fn address(&self) -> u8 {
        0x40
    }

    fn listens(&mut self) -> bool {
        self.around.borrow_mut().sample(self.clock.now_ns()).volts.is_some()
    }

    fn begin(&mut self, _read: bool) {
        (self.written, self.at) = (Vec::new(), 0);
    }

    fn write(&mut self, byte: u8) -> bool {
        self.written.push(byte);
        match self.written[..] {
            [pointer] => self.pointer = pointer,
            [0, high, low] => {
                let config = u16::from_be_bytes([high, low]);
                self.config = if config & 0x8000 != 0 { DEFAULT } else { config };
            }
            _ => {}
        }
        true
    }

    fn read(&mut self) -> u8 {
        let byte = self.value().to_be_bytes()[self.at % 2];
        self.at += 1;
        byte
    }

    fn power_cycle(&mut self) {
        (self.config, self.pointer) = (DEFAULT, 0);
    }
}
