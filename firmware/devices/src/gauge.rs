//! TI INA226: battery voltage and current over a shunt, I²C. Identity and
//! configuration are looked at each time (a disturbed write may have changed
//! it), and the registers read twice: the bus has no checksum.

use crate::Error;
use embedded_hal::i2c::I2c;

const GAUGE_ADDRESS: u8 = 0x40;
const GAUGE_CONFIG: u8 = 0x00;
const SHUNT: u8 = 0x01;
const BUS: u8 = 0x02;
const MAKER: u8 = 0xfe;
const DIE: u8 = 0xff;
/// Both conversions over and over, 1.1 ms each, no averaging: as after power-up (SBOS547 table 6).
const CONTINUOUS: u16 = 0x4127;
/// Volts per step of the bus register (SBOS547 table 8).
const BUS_V: f32 = 1.25e-3;
/// Volts per step of the shunt register (SBOS547 table 7).
const SHUNT_V: f32 = 2.5e-6;
/// Shunt of the bay board, Ω (guess until there is a board).
const SHUNT_OHM: f32 = 0.01;
/// Bus voltages that are believed, V: from that at which this board's own regulator still works to the highest of the part.
const RANGE_V: core::ops::RangeInclusive<f32> = 5.0..=36.0;
/// Two looks at a register do not differ by more: 0.16 V, and 0.08 A (a motor that starts in between costs one reading).
const AGREE_STEPS: u16 = 128;
const AGREE_SHUNT: u16 = 320;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// Battery voltage, V.
    pub volts: f32,
    /// Current drawn, A, positive out of the battery.
    pub amps: f32,
}

/// The gauge: counts what was drawn.
#[derive(Clone, Copy, Debug)]
pub struct Gauge {
    capacity_c: f32,
    drawn_c: f32,
}

impl Gauge {
    /// A full battery of this capacity, A·s.
    #[must_use]
    pub const fn full(capacity_c: f32) -> Self {
        Self { capacity_c, drawn_c: 0.0 }
    }

    /// One measurement; `dt_s` seconds of it are counted as drawn.
    ///
    /// # Errors
    /// [`Error::Bus`], [`Error::Identity`], [`Error::Check`] (configuration lost, and written anew; two looks that differ) or
    /// [`Error::Range`].
    pub fn measure<B: I2c>(&mut self, bus: &mut B, dt_s: f32) -> Result<Supply, Error> {
        for (register, expected) in [(MAKER, 0x5449), (DIE, 0x2260)] {
            let found = word(bus, register)?;
            if found != expected {
                return Err(Error::Identity(found));
            }
        }
        if word(bus, GAUGE_CONFIG)? != CONTINUOUS {
            let [hi, lo] = CONTINUOUS.to_be_bytes();
            bus.write(GAUGE_ADDRESS, &[GAUGE_CONFIG, hi, lo]).map_err(|_| Error::Bus)?;
            return Err(Error::Check);
        }
        let volts = f32::from(twice(bus, BUS, AGREE_STEPS)?) * BUS_V;
        let amps = f32::from(twice(bus, SHUNT, AGREE_SHUNT)? as i16) * SHUNT_V / SHUNT_OHM;
        if !RANGE_V.contains(&volts) {
            return Err(Error::Range);
        }
        if amps > 0.0 && dt_s > 0.0 {
            self.drawn_c += amps * dt_s;
        }
        Ok(Supply { volts, amps })
    }

    /// Charge left, 0..1.
    #[must_use]
    pub fn charge(&self) -> f32 {
        let left = 1.0 - self.drawn_c / self.capacity_c;
        if left > 0.0 { left } else { 0.0 }
    }
}

fn word<B: I2c>(bus: &mut B, register: u8) -> Result<u16, Error> {
    let mut raw = [0; 2];
    bus.write_read(GAUGE_ADDRESS, &[register], &mut raw).map_err(|_| Error::Bus)?;
    Ok(u16::from_be_bytes(raw))
}

fn twice<B: I2c>(bus: &mut B, register: u8, agree: u16) -> Result<u16, Error> {
    let (first, second) = (word(bus, register)?, word(bus, register)?);
    // As two's complement both voltage and current differ by little across zero.
    let apart = (first.wrapping_sub(second) as i16).unsigned_abs();
    if apart <= agree { Ok(second) } else { Err(Error::Check) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

    fn registers(values: &[(u8, u16)]) -> Mock {
        let t: Vec<_> = values.iter().map(|(r, v)| Transaction::write_read(GAUGE_ADDRESS, vec![*r], v.to_be_bytes().to_vec())).collect();
        Mock::new(&t)
    }

    #[test]
    fn scales_and_counts() {
        let mut gauge = Gauge::full(3600.0);
        let mut bus = registers(&[
            (MAKER, 0x5449),
            (DIE, 0x2260),
            (GAUGE_CONFIG, CONTINUOUS),
            (BUS, 11_601),
            (BUS, 11_600),
            (SHUNT, 4_002),
            (SHUNT, 4_000),
        ]);
        let supply = gauge.measure(&mut bus, 4.0).unwrap();
        bus.done();
        assert!((supply.volts - 14.5).abs() < 1e-4 && (supply.amps - 1.0).abs() < 1e-4, "{supply:?}");
        assert!((gauge.charge() - (1.0 - 4.0 / 3600.0)).abs() < 1e-6);
    }

    #[test]
    fn what_a_disturbed_line_did_is_refused_and_mended() {
        let mut bus = registers(&[(MAKER, 0x5449), (DIE, 0x2260), (GAUGE_CONFIG, CONTINUOUS), (BUS, 11_600), (BUS, 11_600 ^ 1 << 12)]);
        assert_eq!(Gauge::full(1.0).measure(&mut bus, 1.0), Err(Error::Check));
        bus.done();
        let lost = [(MAKER, 0x5449u16), (DIE, 0x2260), (GAUGE_CONFIG, 0x4120)];
        let mut t: Vec<_> = lost.iter().map(|(r, v)| Transaction::write_read(GAUGE_ADDRESS, vec![*r], v.to_be_bytes().to_vec())).collect();
        t.push(Transaction::write(GAUGE_ADDRESS, vec![GAUGE_CONFIG, 0x41, 0x27]));
        let mut bus = Mock::new(&t);
        assert_eq!(Gauge::full(1.0).measure(&mut bus, 1.0), Err(Error::Check), "powered down by a flipped write");
        bus.done();
    }

    #[test]
    fn a_battery_without_voltage_that_supplies_the_board_is_no_reading() {
        let mut bus = registers(&[(MAKER, 0x5449), (DIE, 0x2260), (GAUGE_CONFIG, CONTINUOUS), (BUS, 0), (BUS, 0), (SHUNT, 0), (SHUNT, 0)]);
        assert_eq!(Gauge::full(1.0).measure(&mut bus, 1.0), Err(Error::Range));
        bus.done();
    }

    #[test]
    fn another_part_is_refused() {
        let mut bus = registers(&[(MAKER, 0xffff)]);
        assert_eq!(Gauge::full(1.0).measure(&mut bus, 1.0), Err(Error::Identity(0xffff)));
        bus.done();
    }
}
