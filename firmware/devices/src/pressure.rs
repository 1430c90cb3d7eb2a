//! TE MS5837-30BA: absolute pressure to 30 bar (300 m), I²C.
//!
//! Compensation and its second order from the datasheet (page 11, 12); the
//! CRC-4 over the factory coefficients from TE AN520. Its 2 bar sister
//! MS5837-02BA answers at the same address, reads twenty times too deep, and is
//! told by its sensitivity. Conversions come without a checksum, so each
//! measurement is made twice and both must agree. A deep vehicle takes a
//! Keller 9LD instead; only this file changes.

use crate::Error;
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;

const PRESSURE_ADDRESS: u8 = 0x76;
const RESET: u8 = 0x1e;
const PROM: u8 = 0xa0;
const READ_ADC: u8 = 0x00;
/// Oversampling 4096: 9.04 ms at most, 0.28 mbar of noise (datasheet page 4).
const CONVERT_PRESSURE: u8 = 0x48;
const CONVERT_TEMPERATURE: u8 = 0x58;
/// Time waited for one, µs.
pub const CONVERSION_US: u32 = 9_300;
/// Sensitivity C1 of the 30 bar part; those of the 2 bar part lie above (C1 of some 10,000 parts as ArduPilot's and Blue Robotics'
/// drivers tell them; the type number in the first word is not set in older ones).
const SENSITIVITY: core::ops::RangeInclusive<u16> = 26_000..=37_000;
/// Two measurements 19 ms apart do not differ by more, Pa (0.2 m: ten times a glider's way, forty times the part's noise).
const AGREE_PA: f32 = 2_000.0;
/// And in temperature, °C.
const AGREE_C: f32 = 0.5;
/// Pressure range of the part, Pa.
const RANGE_PA: core::ops::RangeInclusive<f32> = 0.0..=3_000_000.0;
/// Nominal sea water density, kg/m³ (35 g/kg, 10 °C).
const DENSITY_KG_M3: f32 = 1027.0;
/// Standard gravity, m/s².
const GRAVITY_M_S2: f32 = 9.80665;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Absolute pressure, Pa.
    pub pressure_pa: f32,
    /// Temperature of the part, °C.
    pub temperature_c: f32,
}

impl Measured {
    /// Depth below the surface, m, for the air pressure at the surface, Pa.
    #[must_use]
    pub fn depth_m(&self, surface_pa: f32) -> f32 {
        (self.pressure_pa - surface_pa) / (DENSITY_KG_M3 * GRAVITY_M_S2)
    }
}

/// Factory coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coefficients([u16; 7]);

impl Coefficients {
    /// Checks the CRC-4 in the first word.
    ///
    /// # Errors
    /// [`Error::Check`].
    pub fn new(words: [u16; 7]) -> Result<Self, Error> {
        let [first, ..] = words;
        if first >> 12 == crc4(words) { Ok(Self(words)) } else { Err(Error::Check) }
    }

    /// Compensates raw conversions (datasheet page 11, 12).
    ///
    /// # Errors
    /// [`Error::Range`] if the result is not what the part can measure.
    pub fn compensate(&self, raw_pressure: u32, raw_temperature: u32) -> Result<Measured, Error> {
        let [_, c1, c2, c3, c4, c5, c6] = self.0.map(i64::from);
        // D1 and D2 have 24 bits and the coefficients 16: nothing here leaves i64.
        let (d1, d2) = (i64::from(raw_pressure & 0xff_ffff), i64::from(raw_temperature & 0xff_ffff));
        let dt = d2.wrapping_sub(c5 << 8);
        let first_order = 2000i64.wrapping_add(dt.wrapping_mul(c6) >> 23);
        let below = first_order.wrapping_sub(2000);
        let square = below.wrapping_mul(below);
        let (ti, mut off_i, mut sens_i);
        if first_order < 2000 {
            ti = dt.wrapping_mul(dt).wrapping_mul(3) >> 33;
            off_i = square.wrapping_mul(3) >> 1;
            sens_i = square.wrapping_mul(5) >> 3;
            let deep = first_order.wrapping_add(1500);
            if deep < 0 {
                off_i = off_i.wrapping_add(deep.wrapping_mul(deep).wrapping_mul(7));
                sens_i = sens_i.wrapping_add(deep.wrapping_mul(deep).wrapping_mul(4));
            }
        } else {
            ti = dt.wrapping_mul(dt).wrapping_mul(2) >> 37;
            off_i = square >> 4;
            sens_i = 0;
        }
        let off = (c2 << 16).wrapping_add(c4.wrapping_mul(dt) >> 7).wrapping_sub(off_i);
        let sens = (c1 << 15).wrapping_add(c3.wrapping_mul(dt) >> 8).wrapping_sub(sens_i);
        let tenth_mbar = (d1.wrapping_mul(sens) >> 21).wrapping_sub(off) >> 13;
        let measured = Measured { pressure_pa: tenth_mbar as f32 * 10.0, temperature_c: first_order.wrapping_sub(ti) as f32 * 0.01 };
        let plausible = RANGE_PA.contains(&measured.pressure_pa) && (-20.0..=85.0).contains(&measured.temperature_c);
        if plausible { Ok(measured) } else { Err(Error::Range) }
    }
}

/// CRC-4 of AN520 over seven words (an eighth is zero), the CRC's own nibble taken as zero.
fn crc4(words: [u16; 7]) -> u16 {
    let mut remainder = 0u16;
    let mut take = |byte: u16| {
        remainder ^= byte;
        for _ in 0..8 {
            remainder = if remainder & 0x8000 != 0 { remainder << 1 ^ 0x3000 } else { remainder << 1 };
        }
    };
    let [first, c1, c2, c3, c4, c5, c6] = words;
    for word in [first & 0x0fff, c1, c2, c3, c4, c5, c6, 0] {
        take(word >> 8);
        take(word & 0xff);
    }
    remainder >> 12
}

/// The part, started.
#[derive(Debug)]
pub struct Pressure {
    coefficients: Coefficients,
}

impl Pressure {
    /// Resets the part and reads its coefficients.
    ///
    /// # Errors
    /// [`Error::Bus`], [`Error::Check`], or [`Error::Identity`] of another part: its sensitivity.
    pub fn start<B: I2c>(bus: &mut B, delay: &mut impl DelayNs) -> Result<Self, Error> {
        bus.write(PRESSURE_ADDRESS, &[RESET]).map_err(|_| Error::Bus)?;
        delay.delay_ms(10);
        let mut words = [0u16; 7];
        for (i, word) in words.iter_mut().enumerate() {
            let mut raw = [0; 2];
            bus.write_read(PRESSURE_ADDRESS, &[PROM + 2 * i as u8], &mut raw).map_err(|_| Error::Bus)?;
            *word = u16::from_be_bytes(raw);
        }
        let coefficients = Coefficients::new(words)?;
        let [_, sensitivity, ..] = words;
        if SENSITIVITY.contains(&sensitivity) { Ok(Self { coefficients }) } else { Err(Error::Identity(sensitivity)) }
    }

    /// One measurement, 37 ms.
    ///
    /// # Errors
    /// [`Error::Bus`], [`Error::Timeout`] (a conversion that is not ready reads 0), [`Error::Range`], or [`Error::Check`] for two
    /// conversions that do not agree.
    pub fn measure<B: I2c>(&self, bus: &mut B, delay: &mut impl DelayNs) -> Result<Measured, Error> {
        let (first, second) = (self.once(bus, delay)?, self.once(bus, delay)?);
        let near = |a: f32, b: f32, most: f32| (a - b).abs() <= most;
        let agree = near(first.pressure_pa, second.pressure_pa, AGREE_PA) && near(first.temperature_c, second.temperature_c, AGREE_C);
        if agree { Ok(second) } else { Err(Error::Check) }
    }

    fn once<B: I2c>(&self, bus: &mut B, delay: &mut impl DelayNs) -> Result<Measured, Error> {
        let d1 = convert(bus, delay, CONVERT_PRESSURE)?;
        let d2 = convert(bus, delay, CONVERT_TEMPERATURE)?;
        self.coefficients.compensate(d1, d2)
    }
}

fn convert<B: I2c>(bus: &mut B, delay: &mut impl DelayNs, command: u8) -> Result<u32, Error> {
    bus.write(PRESSURE_ADDRESS, &[command]).map_err(|_| Error::Bus)?;
    delay.delay_us(CONVERSION_US);
    let mut raw = [0; 3];
    bus.write_read(PRESSURE_ADDRESS, &[READ_ADC], &mut raw).map_err(|_| Error::Bus)?;
    let [a, b, c] = raw;
    match u32::from_be_bytes([0, a, b, c]) {
        0 => Err(Error::Timeout),
        value => Ok(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

    /// C1..C6 of the datasheet's example (page 11), with a CRC that fits.
    fn example() -> [u16; 7] {
        let mut words = [0, 34982, 36352, 20328, 22354, 26646, 26146];
        words[0] = crc4(words) << 12;
        words
    }

    fn start(words: [u16; 7]) -> Vec<Transaction> {
        let mut t = vec![Transaction::write(PRESSURE_ADDRESS, vec![RESET])];
        for (i, w) in words.iter().enumerate() {
            t.push(Transaction::write_read(PRESSURE_ADDRESS, vec![PROM + 2 * i as u8], w.to_be_bytes().to_vec()));
        }
        t
    }

    #[test]
    fn validate_crc4_of_the_application_note() {
        // AN520's example words; its eighth word 0x4500 is zero here, so the nibble is checked by its property:
        // every single flipped bit of a good set of words is refused.
        let good = example();
        assert!(Coefficients::new(good).is_ok());
        for bit in 0..7 * 16 {
            let mut bad = good;
            bad[bit / 16] ^= 1 << (bit % 16);
            assert_eq!(Coefficients::new(bad), Err(Error::Check), "bit {bit}");
        }
    }

    #[test]
    fn validate_the_datasheets_example() {
        let c = Coefficients::new(example()).unwrap();
        let m = c.compensate(4_958_179, 6_815_414).unwrap();
        // Page 11: TEMP 19.81 °C, P 3999.8 mbar in first order; second order (page 12) moves both by less than 0.02 %.
        assert!((m.temperature_c - 19.81).abs() < 0.02, "{m:?}");
        assert!((m.pressure_pa - 399_980.0).abs() < 100.0, "{m:?}");
        assert!((m.depth_m(101_325.0) - 29.65).abs() < 0.02, "{}", m.depth_m(101_325.0));
    }

    fn measured(raw: [u32; 4]) -> Result<Measured, Error> {
        let mut t = start(example());
        // A first measurement out of range is not made again.
        let asked = if Coefficients::new(example()).unwrap().compensate(raw[0], raw[1]).is_ok() { 4 } else { 2 };
        let commands = [CONVERT_PRESSURE, CONVERT_TEMPERATURE, CONVERT_PRESSURE, CONVERT_TEMPERATURE];
        for (command, raw) in commands.into_iter().zip(raw).take(asked) {
            t.push(Transaction::write(PRESSURE_ADDRESS, vec![command]));
            t.push(Transaction::write_read(PRESSURE_ADDRESS, vec![READ_ADC], raw.to_be_bytes()[1..].to_vec()));
        }
        let mut bus = Mock::new(&t);
        let part = Pressure::start(&mut bus, &mut NoopDelay::new()).unwrap();
        let measured = part.measure(&mut bus, &mut NoopDelay::new());
        bus.done();
        measured
    }

    #[test]
    fn measures_over_the_bus_and_believes_two_that_agree() {
        assert!(measured([4_958_179, 6_815_414, 4_958_190, 6_815_420]).is_ok());
        for bit in 14..23 {
            assert!(measured([4_958_179 ^ 1 << bit, 6_815_414, 4_958_179, 6_815_414]).is_err(), "pressure bit {bit}");
            assert!(measured([4_958_179, 6_815_414, 4_958_179, 6_815_414 ^ 1 << (bit + 1).min(22)]).is_err(), "temperature bit {bit}");
        }
    }

    #[test]
    fn the_2_bar_part_is_refused_by_its_sensitivity() {
        let mut words = [0, 46_372, 43_981, 29_059, 27_842, 31_553, 28_165]; // MS5837-02BA datasheet, page 7
        words[0] = crc4(words) << 12;
        let mut bus = Mock::new(&start(words));
        assert_eq!(Pressure::start(&mut bus, &mut NoopDelay::new()).unwrap_err(), Error::Identity(46_372));
        bus.done();
    }

    #[test]
    fn bad_crc_nack_and_unready_are_named() {
        let mut words = example();
        words[3] ^= 4;
        let mut bus = Mock::new(&start(words));
        assert_eq!(Pressure::start(&mut bus, &mut NoopDelay::new()).unwrap_err(), Error::Check);
        bus.done();

        let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
        let mut bus = Mock::new(&[Transaction::write(PRESSURE_ADDRESS, vec![RESET]).with_error(nack)]);
        assert_eq!(Pressure::start(&mut bus, &mut NoopDelay::new()).unwrap_err(), Error::Bus);
        bus.done();

        let part = Pressure { coefficients: Coefficients::new(example()).unwrap() };
        let mut bus = Mock::new(&[
            Transaction::write(PRESSURE_ADDRESS, vec![CONVERT_PRESSURE]),
            Transaction::write_read(PRESSURE_ADDRESS, vec![READ_ADC], vec![0, 0, 0]),
        ]);
        assert_eq!(part.measure(&mut bus, &mut NoopDelay::new()), Err(Error::Timeout));
        bus.done();
        assert_eq!(part.coefficients.compensate(0xff_ffff, 1), Err(Error::Range));
    }
}
