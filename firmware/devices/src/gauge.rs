//! TI INA226: battery voltage and current over a shunt, I²C.

use crate::Error;
use embedded_hal::i2c::I2c;

const ADDRESS: u8 = 0x40;
const SHUNT: u8 = 0x01;
const BUS: u8 = 0x02;
const MAKER: u8 = 0xfe;
const DIE: u8 = 0xff;
/// Volts per step of the bus register (SBOS547 table 8).
const BUS_V: f32 = 1.25e-3;
/// Volts per step of the shunt register (SBOS547 table 7).
const SHUNT_V: f32 = 2.5e-6;
/// Shunt of the bay board, Ω (guess until there is a board).
const SHUNT_OHM: f32 = 0.01;
/// Highest bus voltage of the part, V.
const MAX_V: f32 = 36.0;

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
    /// [`Error::Bus`], [`Error::Identity`] or [`Error::Range`].
    pub fn measure<B: I2c>(&mut self, bus: &mut B, dt_s: f32) -> Result<Supply, Error> {
        for (register, expected) in [(MAKER, 0x5449), (DIE, 0x2260)] {
            let found = word(bus, register)?;
            if found != expected {
                return Err(Error::Identity(found));
            }
        }
        let volts = f32::from(word(bus, BUS)?) * BUS_V;
        let amps = f32::from(word(bus, SHUNT)? as i16) * SHUNT_V / SHUNT_OHM;
        if volts > MAX_V {
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
    bus.write_read(ADDRESS, &[register], &mut raw).map_err(|_| Error::Bus)?;
    Ok(u16::from_be_bytes(raw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

    fn registers(values: &[(u8, u16)]) -> Mock {
        let t: Vec<_> = values.iter().map(|(r, v)| Transaction::write_read(ADDRESS, vec![*r], v.to_be_bytes().to_vec())).collect();
        Mock::new(&t)
    }

    #[test]
    fn scales_and_counts() {
        let mut gauge = Gauge::full(3600.0);
        let mut bus = registers(&[(MAKER, 0x5449), (DIE, 0x2260), (BUS, 11_600), (SHUNT, 4_000)]);
        let supply = gauge.measure(&mut bus, 4.0).unwrap();
        bus.done();
        assert!((supply.volts - 14.5).abs() < 1e-4 && (supply.amps - 1.0).abs() < 1e-4, "{supply:?}");
        assert!((gauge.charge() - (1.0 - 4.0 / 3600.0)).abs() < 1e-6);
    }

    #[test]
    fn another_part_is_refused() {
        let mut bus = registers(&[(MAKER, 0xffff)]);
        assert_eq!(Gauge::full(1.0).measure(&mut bus, 1.0), Err(Error::Identity(0xffff)));
        bus.done();
    }
}
