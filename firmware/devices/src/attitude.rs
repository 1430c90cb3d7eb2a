//! OceanServer OS5000: heading, pitch and roll as text over a UART.
//!
//! `$C92.8P-1.2R3.3T23.6*1D` and CR LF: degrees with a decimal, checksum the
//! XOR of what is between `$` and `*` in hex (OS5000 manual, "output format 1").
//! Bytes go in one by one; memory and work per byte are bounded, numbers are
//! read as integers of a hundredth so that no float parser is needed.

use crate::Error;

/// Longest sentence, bytes.
const LONGEST_ATTITUDE: u32 = 64;
/// Radians in a hundredth of a degree.
const RAD_PER_CENTIDEGREE: f32 = core::f32::consts::PI / 18_000.0;

/// One sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Heading, rad, 0..2π.
    pub heading_rad: f32,
    /// Pitch, rad, nose up positive.
    pub pitch_rad: f32,
    /// Roll, rad, starboard down positive.
    pub roll_rad: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Place {
    #[default]
    Outside,
    Fields,
    Checksum {
        digits: u8,
        value: u8,
    },
}

/// Reads sentences from bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reader {
    place: Place,
    length: u32,
    xor: u8,
    field: u8,
    /// Number under way: hundredths, decimals seen, negative.
    number: Option<(i32, Option<u8>, bool)>,
    heading: Option<i32>,
    pitch: Option<i32>,
    roll: Option<i32>,
}

impl Reader {
    /// Takes one byte; says what a finished sentence meant, or why it is refused.
    pub fn push(&mut self, byte: u8) -> Option<Result<Attitude, Error>> {
        if byte == b'$' {
            *self = Self { place: Place::Fields, ..Self::default() };
            return None;
        }
        self.length = self.length.saturating_add(1);
        match self.place {
            Place::Outside => None,
            _ if self.length > LONGEST_ATTITUDE => self.refuse(Error::Range),
            Place::Fields if byte == b'*' => {
                if !self.close_field() {
                    return self.refuse(Error::Range);
                }
                self.place = Place::Checksum { digits: 0, value: 0 };
                None
            }
            Place::Fields => {
                self.xor ^= byte;
                if self.take(byte) { None } else { self.refuse(Error::Range) }
            }
            Place::Checksum { digits, value } => {
                let Some(digit) = (byte as char).to_digit(16) else { return self.refuse(Error::Check) };
                let value = value << 4 | digit as u8;
                if digits == 0 {
                    self.place = Place::Checksum { digits: 1, value };
                    return None;
                }
                self.place = Place::Outside;
                Some(if value == self.xor { self.attitude() } else { Err(Error::Check) })
            }
        }
    }

    fn refuse(&mut self, why: Error) -> Option<Result<Attitude, Error>> {
        self.place = Place::Outside;
        Some(Err(why))
    }

    fn take(&mut self, byte: u8) -> bool {
        match byte {
            b'A'..=b'Z' => {
                let closed = self.close_field();
                self.field = byte;
                self.number = Some((0, None, false));
                closed
            }
            b'-' => match self.number {
                Some((0, None, false)) => {
                    self.number = Some((0, None, true));
                    true
                }
                _ => false,
            },
            b'.' => match self.number {
                Some((value, None, negative)) => {
                    self.number = Some((value, Some(0), negative));
                    true
                }
                _ => false,
            },
            b'0'..=b'9' => {
                let digit = i32::from(byte.wrapping_sub(b'0'));
                self.number = match self.number {
                    Some((value, None, negative)) if value < 100_000 => {
                        Some((value.saturating_mul(10).saturating_add(digit * 100), None, negative))
                    }
                    Some((value, Some(0), negative)) => Some((value.saturating_add(digit * 10), Some(1), negative)),
                    Some((value, Some(1), negative)) => Some((value.saturating_add(digit), Some(2), negative)),
                    Some((value, Some(more), negative)) => Some((value, Some(more), negative)),
                    _ => return false,
                };
                true
            }
            _ => false,
        }
    }

    fn close_field(&mut self) -> bool {
        let Some((value, _, negative)) = self.number.take() else { return self.field == 0 };
        let value = if negative { value.saturating_neg() } else { value };
        match self.field {
            b'C' => self.heading = Some(value),
            b'P' => self.pitch = Some(value),
            b'R' => self.roll = Some(value),
            _ => {} // temperature and what later firmware adds
        }
        true
    }

    fn attitude(&self) -> Result<Attitude, Error> {
        let (Some(heading), Some(pitch), Some(roll)) = (self.heading, self.pitch, self.roll) else { return Err(Error::Range) };
        let plausible = (0..=36_000).contains(&heading) && (-9_000..=9_000).contains(&pitch) && (-18_000..=18_000).contains(&roll);
        let rad = |hundredths: i32| hundredths as f32 * RAD_PER_CENTIDEGREE;
        if plausible { Ok(Attitude { heading_rad: rad(heading), pitch_rad: rad(pitch), roll_rad: rad(roll) }) } else { Err(Error::Range) }
    }
}

#[cfg(test)]
mod tests {
    use super::{Attitude, Reader};
    use crate::Error;

    fn read(reader: &mut Reader, text: &[u8]) -> Vec<Result<Attitude, Error>> {
        text.iter().filter_map(|b| reader.push(*b)).collect()
    }

    fn sentence(body: &str) -> Vec<u8> {
        let sum = body.bytes().fold(0, |x, b| x ^ b);
        format!("${body}*{sum:02X}\r\n").into_bytes()
    }

    #[test]
    fn reads_a_sentence_and_refuses_a_wrong_checksum() {
        let mut reader = Reader::default();
        let good = sentence("C92.8P-1.2R3.3T23.6");
        let got = read(&mut reader, &good)[0].unwrap();
        for (got, degrees) in [(got.heading_rad, 92.8f32), (got.pitch_rad, -1.2), (got.roll_rad, 3.3)] {
            assert!((got - degrees.to_radians()).abs() < 1e-5);
        }
        for bit in 8..8 * (good.len() - 2) {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let answers = read(&mut reader, &bad);
            // Hex digits have two cases: a flip of that bit in a letter changes nothing.
            let same = bad.eq_ignore_ascii_case(&good) && bit / 8 > good.len() - 5;
            assert!(same || answers.iter().all(Result::is_err), "bit {bit}: {answers:?}");
        }
    }

    #[test]
    fn absurd_angles_and_missing_fields_are_refused() {
        let mut reader = Reader::default();
        for body in ["C400.0P0.0R0.0", "C1.0P91.0R0.0", "C1.0P1.0", "C1.0P1.0R181.0", "C--1P1R1", "C1..2P1R1", "C999999999999P1R1"] {
            assert!(read(&mut reader, &sentence(body)).iter().all(Result::is_err), "{body}");
        }
    }

    #[test]
    fn noise_never_panics_nor_passes_and_the_next_sentence_is_read() {
        let mut reader = Reader::default();
        let mut seed = 1u32;
        let alphabet = b"$C*PRT0123456789.-ABCDEF\r\n";
        let mut passed = 0;
        for _ in 0..3_000_000 {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let byte = if seed >> 31 == 0 { alphabet[(seed >> 16) as usize % alphabet.len()] } else { (seed >> 16) as u8 };
            if let Some(Ok(a)) = reader.push(byte) {
                passed += 1;
                assert!(a.heading_rad.is_finite() && a.pitch_rad.abs() < 1.6 && a.roll_rad.abs() < 3.2);
            }
        }
        assert_eq!(passed, 0);
        assert!(read(&mut reader, &sentence("C0.0P0.0R0.0"))[0].is_ok());
    }
}
