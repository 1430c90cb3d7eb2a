//! TI ADS1115: four voltages at 16 bits, I²C. Single shots, so that a reading
//! is never older than its question; read twice, since the bus has no checksum.

use crate::Error;
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;

const ADC_ADDRESS: u8 = 0x48;
const CONVERSION: u8 = 0;
const ADC_CONFIG: u8 = 1;
/// Volts per step at the ±4.096 V range (SBAS444 table 3).
const VOLT_PER_STEP: f32 = 4.096 / 32_768.0;
/// A conversion takes 7.8 ms at 128 per second, ±10 % (SBAS444 table 5): the first look, ms, and looks after that, 1 ms each.
pub const CONVERSION_MS: u32 = 7;
const POLLS: u32 = 5;

/// What hangs on which input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Channel {
    /// Ballast pump position pot.
    Pump = 0,
    /// Battery mass position pot.
    Battery = 1,
    /// Internal pressure.
    Vacuum = 2,
    /// Leak detector: a wet pair of wires pulls it down.
    Leak = 3,
}

/// Voltage at an input, V.
///
/// # Errors
/// [`Error::Bus`], [`Error::Timeout`], [`Error::Check`] for an answer to another question or two that differ, or
/// [`Error::Range`] for a voltage the input cannot have (below −0.1 V: a broken wire or part).
pub fn volts<B: I2c>(bus: &mut B, delay: &mut impl DelayNs, channel: Channel) -> Result<f32, Error> {
    // OS start, single-ended input, ±4.096 V, single shot, 128/s, comparator off (SBAS444 table 8).
    let config = 0x8000u16 | (4 + channel as u16) << 12 | 1 << 9 | 1 << 8 | 4 << 5 | 3;
    let [hi, lo] = config.to_be_bytes();
    // A question put while the last one is converted would be answered with that one's voltage.
    let mut idle = false;
    for _ in 0..CONVERSION_MS + POLLS {
        idle = status(bus)? & 0x8000 != 0;
        if idle {
            break;
        }
        delay.delay_ms(1);
    }
    if !idle {
        return Err(Error::Timeout);
    }
    bus.write(ADC_ADDRESS, &[ADC_CONFIG, hi, lo]).map_err(|_| Error::Bus)?;
    if ready(bus, config)? {
        return Err(Error::Check); // it did not begin: what it has is the answer to the last question
    }
    delay.delay_ms(CONVERSION_MS);
    for _ in 0..POLLS {
        delay.delay_ms(1);
        if ready(bus, config)? {
            let (mut raw, mut again) = ([0; 2], [0; 2]);
            bus.write_read(ADC_ADDRESS, &[CONVERSION], &mut raw).map_err(|_| Error::Bus)?;
            bus.write_read(ADC_ADDRESS, &[CONVERSION], &mut again).map_err(|_| Error::Bus)?;
            if raw != again {
                return Err(Error::Check);
            }
            let volts = f32::from(i16::from_be_bytes(raw)) * VOLT_PER_STEP;
            return if volts > -0.1 { Ok(volts) } else { Err(Error::Range) };
        }
    }
    Err(Error::Timeout)
}

/// Whether it is idle, with the question that was asked.
fn ready<B: I2c>(bus: &mut B, config: u16) -> Result<bool, Error> {
    let state = status(bus)?;
    if state & 0x7fff != config & 0x7fff {
        return Err(Error::Check); // not what was asked: the part was reset, or the line is noisy
    }
    Ok(state & 0x8000 != 0)
}

fn status<B: I2c>(bus: &mut B) -> Result<u16, Error> {
    let mut state = [0; 2];
    bus.write_read(ADC_ADDRESS, &[ADC_CONFIG], &mut state).map_err(|_| Error::Bus)?;
    Ok(u16::from_be_bytes(state))
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal::i2c::ErrorKind;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

    fn ask(polls: &[[u8; 2]], raw: &[[u8; 2]]) -> Result<f32, Error> {
        // Idle, with its configuration after power-up.
        let mut t = vec![
            Transaction::write_read(ADC_ADDRESS, vec![ADC_CONFIG], vec![0x85, 0x83]),
            Transaction::write(ADC_ADDRESS, vec![ADC_CONFIG, 0xd3, 0x83]),
        ];
        t.extend(polls.iter().map(|p| Transaction::write_read(ADC_ADDRESS, vec![ADC_CONFIG], p.to_vec())));
        t.extend(raw.iter().map(|r| Transaction::write_read(ADC_ADDRESS, vec![CONVERSION], r.to_vec())));
        let mut bus = Mock::new(&t);
        let got = volts(&mut bus, &mut NoopDelay::new(), Channel::Battery);
        bus.done();
        got
    }

    #[test]
    fn waits_until_ready_and_scales() {
        let busy = [0x53, 0x83];
        let ready = [0xd3, 0x83];
        assert_eq!(ask(&[busy, busy, ready], &[[0x40, 0x00]; 2]), Ok(2.048));
        assert_eq!(ask(&[busy, ready], &[[0xc0, 0x00]; 2]), Err(Error::Range));
        assert_eq!(ask(&[busy, ready], &[[0x40, 0x00], [0x50, 0x00]]), Err(Error::Check), "a bit flipped on the line");
        assert_eq!(ask(&[busy; POLLS as usize + 1], &[]), Err(Error::Timeout), "never ready");
        assert_eq!(ask(&[ready], &[]), Err(Error::Check), "the bit that starts it flipped on the line");
        assert_eq!(ask(&[[0x85, 0x83]], &[]), Err(Error::Check), "the part forgot the question");
    }

    #[test]
    fn a_dead_bus_is_named() {
        let mut bus = Mock::new(&[
            Transaction::write_read(ADC_ADDRESS, vec![ADC_CONFIG], vec![0x05, 0x83]),
            Transaction::write_read(ADC_ADDRESS, vec![ADC_CONFIG], vec![0x85, 0x83]),
            Transaction::write(ADC_ADDRESS, vec![ADC_CONFIG, 0xc3, 0x83]).with_error(ErrorKind::Bus),
        ]);
        assert_eq!(volts(&mut bus, &mut NoopDelay::new(), Channel::Pump), Err(Error::Bus));
        bus.done();
    }
}
