//! TI ADS1115 (SBAS444): registers, single shots of 7.8 ms, and what hangs on its inputs.

use crate::wires::Target;
use crate::{Around, Clock, Sample, Work};

const ADC_CONVERSION_NS: u64 = 7_812_500;
/// From its supply to its first answer, ns (SBAS444: 50 µs).
const START_NS: u64 = 50_000;
/// Until pots and leak loop stand, ns: five times 1 ms of their filters (guess).
const POTS_NS: u64 = 5_000_000;
/// Warm-up of the hull's pressure sensor, ns (MPXA6115A table 1).
const HULL_NS: u64 = 20_000_000;
const CONFIG: usize = 1;
/// After power-up (SBAS444 table 8).
const DEFAULTS: [u16; 4] = [0, 0x8583, 0x8000, 0x7fff];
/// Full scale of each gain, V.
const FULL_SCALE_V: [f64; 8] = [6.144, 4.096, 2.048, 1.024, 0.512, 0.256, 0.256, 0.256];

/// The part.
pub struct Ads1115 {
    clock: Clock,
    around: Around,
    registers: [u16; 4],
    pointer: usize,
    written: Vec<u8>,
    at: usize,
    /// Result of the conversion under way, and when it is there.
    converting: Option<(u16, u64)>,
    /// When its supply was switched on, ns.
    since_ns: u64,
}

impl Ads1115 {
    /// A part in its surroundings.
    #[must_use]
    pub fn new(clock: Clock, around: Around) -> Self {
        Self { clock, around, registers: DEFAULTS, pointer: 0, written: Vec::new(), at: 0, converting: None, since_ns: 0 }
    }

    fn settle(&mut self) {
        if let Some((result, _)) = self.converting.filter(|(_, at)| self.clock.now_ns() >= *at) {
            self.registers[0] = result;
            self.converting = None;
        }
    }

    fn store(&mut self, register: usize, value: u16) {
        if register == 0 {
            return; // the result is read only
        }
        self.registers[register] = value;
        if register == CONFIG && value & 0x8000 != 0 && self.converting.is_none() {
            let now = self.clock.now_ns();
            let sample = self.around.borrow_mut().sample(now);
            let full_scale_v = FULL_SCALE_V[usize::from(value >> 9 & 7)];
            let mut volts = inputs(&sample);
            // What has just been switched on gives nothing yet.
            let on_ns = self.clock.on_ns(Work::Analog).unwrap_or(0);
            for (volts, start_ns) in volts.iter_mut().zip([POTS_NS, POTS_NS, HULL_NS, POTS_NS]) {
                *volts *= f64::from(u8::from(on_ns >= start_ns));
            }
            let volts = match value >> 12 & 7 {
                0 => volts[0] - volts[1],
                1 => volts[0] - volts[3],
                2 => volts[1] - volts[3],
                3 => volts[2] - volts[3],
                single => volts[usize::from(single - 4)],
            };
            let steps = (volts / full_scale_v * 32_768.0).round().clamp(-32_768.0, 32_767.0) as i16;
            self.clock.work(Work::Adc, ADC_CONVERSION_NS);
            self.converting = Some((steps.cast_unsigned(), now + ADC_CONVERSION_NS));
        }
    }
}

/// Voltages at the inputs: pump pot, battery pot, hull pressure, leak loop.
fn inputs(s: &Sample) -> [f64; 4] {
    // 0.2 to 3.1 V over the stroke; a broken wire is pulled to ground.
    let pot = |share: Option<f64>| share.filter(|x| x.is_finite()).map_or(0.0, |x| (0.2 + 1.45 * (x + 1.0)).clamp(0.0, 3.3));
    // NXP MPXA6115A figure 4 at 5 V, halved.
    let hull = s.vacuum_pa.filter(|x| x.is_finite()).map_or(0.0, |pa| (2.5 * (9e-6 * pa - 0.095)).clamp(0.1, 2.4));
    // A loop with its resistor at the end: 2.5 V when dry, pulled down by water, up to the supply when it is broken.
    let leak = match s.wet {
        Some(true) => 0.6,
        Some(false) => 2.5,
        None => 3.3,
    };
    [pot(s.pump), pot(s.mass), hull, leak]
}

impl Target for Ads1115 {
    fn address(&self) -> u8 {
        0x48
    }

    fn listens(&mut self) -> bool {
        match self.clock.on_ns(Work::Analog) {
            Some(on_ns) => {
                // Switched off and on since it was last asked: as after power-up.
                if self.clock.now_ns() - on_ns != self.since_ns {
                    self.since_ns = self.clock.now_ns() - on_ns;
                    self.power_cycle();
                }
                on_ns >= START_NS
            }
            None => false,
        }
    }

    fn begin(&mut self, _read: bool) {
        (self.written, self.at) = (Vec::new(), 0);
    }

    fn write(&mut self, byte: u8) -> bool {
        self.settle();
        self.written.push(byte);
        match self.written[..] {
            [pointer] => self.pointer = usize::from(pointer & 3),
            [_, high, low] => self.store(self.pointer, u16::from_be_bytes([high, low])),
            _ => {}
        }
        true
    }

    fn read(&mut self) -> u8 {
        self.settle();
        let mut value = self.registers[self.pointer];
        if self.pointer == CONFIG {
            value = value & 0x7fff | if self.converting.is_none() { 0x8000 } else { 0 };
        }
        let byte = value.to_be_bytes()[self.at % 2];
        self.at += 1;
        byte
    }

    fn power_cycle(&mut self) {
        (self.registers, self.pointer, self.converting) = (DEFAULTS, 0, None);
    }
}
