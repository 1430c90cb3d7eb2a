//! TE MS5837-30BA (datasheet of 2019) and MS5837-02BA: commands, PROM, conversions.

use crate::wires::Target;
use crate::{Around, Clock, Work};

/// Conversion time per oversampling, ns: 0.60, 1.17, 2.28, 4.54, 9.04, 18.08 ms at most (datasheet page 4).
const CONVERSION_NS: [u64; 6] = [600_000, 1_170_000, 2_280_000, 4_540_000, 9_040_000, 18_080_000];
/// Time of a reset, ns (datasheet page 9: 10 ms reload).
const RELOAD_NS: u64 = 2_800_000;

/// Coefficients C1 to C6 of one part.
type Coefficients = [f64; 6];
/// Of the 30 bar datasheet's example (page 11).
const BAR_30: Coefficients = [34_982.0, 36_352.0, 20_328.0, 22_354.0, 26_646.0, 26_146.0];
/// Of the 2 bar datasheet's example (page 7).
const BAR_2: Coefficients = [46_372.0, 43_981.0, 29_059.0, 27_842.0, 31_553.0, 28_165.0];

/// Which of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// 30 bar.
    Bar30,
    /// 2 bar.
    Bar2,
}

/// The part.
pub struct Ms5837 {
    clock: Clock,
    around: Around,
    model: Model,
    /// What the next read gives, byte by byte.
    answer: Vec<u8>,
    at: usize,
    /// Conversion under way: its result and when it is there.
    converting: Option<(u32, u64)>,
    busy_until_ns: u64,
}

impl Ms5837 {
    /// A part in its surroundings.
    #[must_use]
    pub fn new(clock: Clock, around: Around, model: Model) -> Self {
        Self { clock, around, model, answer: Vec::new(), at: 0, converting: None, busy_until_ns: 0 }
    }

    fn coefficients(&self) -> Coefficients {
        match self.model {
            Model::Bar30 => BAR_30,
            Model::Bar2 => BAR_2,
        }
    }

    fn prom(&self) -> [u16; 7] {
        let c = self.coefficients();
        let type_number = match self.model {
            Model::Bar30 => 0x1a,
            Model::Bar2 => 0x15,
        };
        let mut words = [type_number << 5, c[0] as u16, c[1] as u16, c[2] as u16, c[3] as u16, c[4] as u16, c[5] as u16];
        words[0] |= u16::from(crc4(&words)) << 12;
        words
    }

    /// What the part's ADC says of a temperature, and of a pressure at that temperature.
    fn raw(&self, pressure_pa: f64, temperature_c: f64) -> (u32, u32) {
        let c = self.coefficients();
        let (mut low, mut high) = (0.0f64, 16_777_215.0f64);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.temperature(middle).0 < temperature_c { low = middle } else { high = middle }
        }
        let d2 = low.round();
        let (_, dt, below) = self.temperature(d2);
        let (offset, sensitivity) = match self.model {
            Model::Bar30 => (c[1] * 65_536.0 + c[3] * dt / 128.0, c[0] * 32_768.0 + c[2] * dt / 256.0),
            Model::Bar2 => (c[1] * 131_072.0 + c[3] * dt / 64.0, c[0] * 65_536.0 + c[2] * dt / 128.0),
        };
        let (less_offset, less_sensitivity) =
            if below < 0.0 { (1.5 * below * below, 0.625 * below * below) } else { (below * below / 16.0, 0.0) };
        let (offset, sensitivity) = (offset - less_offset, sensitivity - less_sensitivity);
        // The datasheets' unit: tenths of a millibar for 30 bar, hundredths for 2 bar.
        let counts = match self.model {
            Model::Bar30 => (pressure_pa / 10.0) * 8_192.0,
            Model::Bar2 => pressure_pa * 32_768.0,
        };
        let d1 = ((counts + offset) * 2_097_152.0 / sensitivity).round().clamp(1.0, 16_777_215.0);
        (d1 as u32, d2 as u32)
    }

    /// Temperature of second order, °C; dT; hundredths of a degree from 20 °C in first order.
    fn temperature(&self, d2: f64) -> (f64, f64, f64) {
        let c = self.coefficients();
        let dt = d2 - c[4] * 256.0;
        let below = dt * c[5] / 8_388_608.0;
        let less = if below < 0.0 { 3.0 * dt * dt / 8_589_934_592.0 } else { 2.0 * dt * dt / 137_438_953_472.0 };
        (0.01 * (2_000.0 + below - less), dt, below)
    }
}

/// CRC-4 of TE's application note AN520: polynomial x⁴+x+1 over all bits, most significant first, its own nibble as zero.
fn crc4(words: &[u16; 7]) -> u8 {
    let bits = words.iter().enumerate().flat_map(|(i, word)| {
        let word = if i == 0 { word & 0x0fff } else { *word };
        (0..16).rev().map(move |bit| word >> bit & 1 == 1)
    });
    // As a long division of the seven words and the twelve zeros that the note's 16-bit register has behind them.
    let mut remainder = 0u8;
    for bit in bits.chain([false; 12]) {
        let out = remainder & 8 != 0;
        remainder = (remainder << 1 | u8::from(bit)) & 0xf;
        if out {
            remainder ^= 0b0011;
        }
    }
    remainder
}

impl Target for Ms5837 {
    fn address(&self) -> u8 {
        0x76
    }

    fn listens(&mut self) -> bool {
        let now = self.clock.now_ns();
        now >= self.busy_until_ns && self.around.borrow_mut().sample(now).pressure_pa.is_some()
    }

    fn begin(&mut self, _read: bool) {
        self.at = 0;
    }

    fn write(&mut self, byte: u8) -> bool {
        let now = self.clock.now_ns();
        self.answer = Vec::new();
        match byte {
            0x1e => {
                self.converting = None;
                self.busy_until_ns = now + RELOAD_NS;
            }
            0x40..=0x4a | 0x50..=0x5a if byte & 1 == 0 => {
                let sample = self.around.borrow_mut().sample(now);
                let (d1, d2) = match sample.pressure_pa {
                    Some(pa) if pa.is_finite() => self.raw(pa, sample.temperature_c),
                    // A dead cell: the converter gives nothing.
                    _ => (0, 0),
                };
                let result = if byte & 0x10 == 0 { d1 } else { d2 };
                let takes_ns = CONVERSION_NS[usize::from(byte & 0xf) / 2];
                self.clock.work(Work::Pressure, takes_ns);
                self.converting = Some((result, now + takes_ns));
            }
            0x00 => {
                // Too early it reads zero, and the conversion is lost.
                let result = self.converting.take().filter(|(_, at)| now >= *at).map_or(0, |(r, _)| r);
                self.answer = result.to_be_bytes()[1..].to_vec();
            }
            0xa0..=0xad => self.answer = self.prom()[usize::from(byte - 0xa0) / 2].to_be_bytes().to_vec(),
            _ => {}
        }
        true
    }

    fn read(&mut self) -> u8 {
        let byte = self.answer.get(self.at).copied().unwrap_or(0);
        self.at += 1;
        byte
    }

    fn power_cycle(&mut self) {
        (self.converting, self.answer) = (None, Vec::new());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Drive, Sample, Surroundings};
    use std::cell::RefCell;
    use std::rc::Rc;

    struct Still;
    impl Surroundings for Still {
        fn sample(&mut self, _: u64) -> Sample {
            Sample { pressure_pa: Some(399_980.0), temperature_c: 19.81, ..Sample::default() }
        }
        fn drive(&mut self, _: u64, _: Drive) {}
    }

    #[test]
    fn validate_the_datasheets_example_backwards() {
        let part = Ms5837::new(Clock::default(), Rc::new(RefCell::new(Still)), Model::Bar30);
        // Page 11: D1 4958179 and D2 6815414 are 3999.8 mbar and 19.81 °C in first order; the second order moves both a little.
        let (d1, d2) = part.raw(399_980.0, 19.81);
        assert!((f64::from(d1) - 4_958_179.0).abs() < 600.0 && (f64::from(d2) - 6_815_414.0).abs() < 400.0, "{d1} {d2}");
    }

    #[test]
    fn a_conversion_read_too_early_is_zero_and_one_in_time_is_there_once() {
        let clock = Clock::default();
        let mut part = Ms5837::new(clock.clone(), Rc::new(RefCell::new(Still)), Model::Bar30);
        let mut ask = |wait_ns: u64| {
            part.write(0x48);
            clock.pass_ns(wait_ns);
            [(); 2].map(|()| {
                part.write(0);
                part.begin(true);
                (0..3).fold(0u32, |n, _| n << 8 | u32::from(part.read()))
            })
        };
        assert_eq!(ask(9_000_000), [0, 0]);
        let [first, second] = ask(9_100_000);
        assert!(first > 4_900_000 && second == 0);
    }
}
