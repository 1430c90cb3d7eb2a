//! A GPS receiver's RMC sentences (NMEA 0183): whether there is a fix, and UTC.
//!
//! `$GPRMC,hhmmss.ss,A,llll.ll,N,yyyyy.yy,E,x.x,x.x,ddmmyy,…*hh` at 9,600 baud. Talkers GP, GN, GL and GA are heard; every
//! other sentence is passed over. Byte by byte, memory and work bounded.

/// One position fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fix {
    /// Seconds since 1970-01-01, UTC.
    pub utc_s: u32,
}

/// Longest sentence of the standard, bytes.
const LONGEST_SENTENCE: u8 = 82;
/// Field of the fix's validity, of the date, and (NMEA 0183 2.3 and later) of how it was made.
const STATUS_FIELD: u8 = 2;
const DATE: u8 = 9;
const MODE: u8 = 12;
/// Ways to make one that are a measurement: autonomous, differential, precise, real-time kinematic. Not: estimated (dead reckoning,
/// which goes on under water), manual, simulated, none.
const MEASURED: [u8; 5] = *b"ADPRF";

/// Reads sentences from bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reader {
    /// Inside a sentence; after its asterisk so many digits.
    inside: bool,
    sum_digits: Option<(u8, u8)>,
    length: u8,
    xor: u8,
    field: u8,
    /// Letters of the field so far.
    letters: u8,
    kind: [u8; 3],
    valid: bool,
    /// The sentence says that nothing was measured.
    reckoned: bool,
    /// Six digits of the time and of the date.
    time: [u8; 6],
    date: [u8; 6],
}

impl Reader {
    /// Takes one byte; a finished RMC sentence with its checksum right gives its fix, or `None` inside where there is none.
    pub fn push(&mut self, byte: u8) -> Option<Option<Fix>> {
        if byte == b'$' {
            *self = Self { inside: true, ..Self::default() };
            return None;
        }
        self.length = self.length.saturating_add(1);
        if !self.inside || self.length > LONGEST_SENTENCE {
            self.inside = false;
            return None;
        }
        if let Some((digits, value)) = self.sum_digits {
            return self.take_sum(byte, digits, value);
        }
        if byte == b'*' {
            self.sum_digits = Some((0, 0));
            return None;
        }
        self.xor ^= byte;
        if byte == b',' {
            (self.field, self.letters) = (self.field.saturating_add(1), 0);
            return None;
        }
        self.take(byte);
        self.letters = self.letters.saturating_add(1);
        None
    }

    fn take(&mut self, byte: u8) {
        let at = usize::from(self.letters);
        let put = |into: Option<&mut u8>| {
            if let Some(into) = into {
                *into = byte;
            }
        };
        match self.field {
            // Two letters of the talker, three of the sentence.
            0 => put(at.checked_sub(2).and_then(|i| self.kind.get_mut(i))),
            1 => put(self.time.get_mut(at)),
            MODE if at == 0 => self.reckoned = !MEASURED.contains(&byte),
            STATUS_FIELD => self.valid = byte == b'A' && at == 0,
            DATE => put(self.date.get_mut(at)),
            _ => {}
        }
    }

    fn take_sum(&mut self, byte: u8, digits: u8, value: u8) -> Option<Option<Fix>> {
        let Some(digit) = (byte as char).to_digit(16) else {
            self.inside = false;
            return None;
        };
        let value = value << 4 | digit as u8;
        if digits == 0 {
            self.sum_digits = Some((1, value));
            return None;
        }
        self.inside = false;
        (value == self.xor && self.kind == *b"RMC").then(|| if self.valid && !self.reckoned { self.fix() } else { None })
    }

    fn fix(&self) -> Option<Fix> {
        let [h, m, s] = pairs(self.time)?;
        let [day, month, year] = pairs(self.date)?;
        let plausible = h < 24 && m < 60 && s < 61 && (1..=31).contains(&day) && (1..=12).contains(&month);
        // In 2099 it is 4.1e9: nothing here leaves 32 bits.
        let of_day = h.wrapping_mul(3600).wrapping_add(m.wrapping_mul(60)).wrapping_add(s);
        plausible.then(|| Fix { utc_s: days(year.wrapping_add(2000), month, day).wrapping_mul(86_400).wrapping_add(of_day) })
    }
}

/// Three numbers of two digits.
fn pairs(digits: [u8; 6]) -> Option<[u32; 3]> {
    let [a, b, c, d, e, f] = digits.map(|byte| (byte as char).to_digit(10));
    let two = |tens: u32, ones: u32| tens.wrapping_mul(10).wrapping_add(ones);
    Some([two(a?, b?), two(c?, d?), two(e?, f?)])
}

/// Days since 1970-01-01 of a date from 2000 to 2099: every fourth year is a leap year.
pub(crate) const fn days(year: u32, month: u32, day: u32) -> u32 {
    // The year begins in March, so that a leap day is its last one.
    let (y, m) = if month > 2 { (year, month.wrapping_sub(3)) } else { (year.wrapping_sub(1), month.wrapping_add(9)) };
    let since = y.wrapping_sub(1999);
    // 1999-03-01 is day 10,651.
    let years = since.wrapping_mul(365).wrapping_add(since.wrapping_add(3) / 4);
    let in_year = (153u32.wrapping_mul(m).wrapping_add(2) / 5).wrapping_add(day).wrapping_sub(1);
    10_651u32.wrapping_add(years).wrapping_add(in_year)
}

#[cfg(test)]
mod tests {
    use super::{Fix, Reader, days};

    fn read(text: &str) -> Vec<Option<Fix>> {
        let mut reader = Reader::default();
        text.bytes().filter_map(|b| reader.push(b)).collect()
    }

    fn sentence(body: &str) -> String {
        format!("${body}*{:02X}\r\n", body.bytes().fold(0, |x, b| x ^ b))
    }

    #[test]
    fn validate_dates_against_the_calendar() {
        // `date -u -d DATE +%s` / 86400.
        for (date, day) in [((2000, 1, 1), 10_957), ((2000, 2, 29), 11_016), ((2026, 11, 26), 20_783), ((2099, 12, 31), 47_481)] {
            assert_eq!(days(date.0, date.1, date.2), day, "{date:?}");
        }
    }

    #[test]
    fn a_position_that_nobody_measured_is_no_fix() {
        let with = |mode: &str| read(&sentence(&format!("GPRMC,225446,A,4916.45,N,12311.12,W,000.5,054.7,191126,,,{mode}")));
        for (mode, fix) in [
            ("A", true),
            ("D", true),
            ("R", true),
            ("F", true),
            ("P", true),
            ("", true),
            ("E", false),
            ("M", false),
            ("S", false),
            ("N", false),
        ] {
            assert_eq!(with(mode).first().map(Option::is_some), Some(fix), "{mode}");
        }
        // A later version says of a fix in a field more whether it is safe to navigate by.
        assert!(with("A,V").first().is_some_and(Option::is_some) && with("E,V").first().is_some_and(Option::is_none));
    }

    #[test]
    fn a_fix_is_read_and_no_fix_is_none() {
        // The standard's own example.
        let fix = read("$GPRMC,225446,A,4916.45,N,12311.12,W,000.5,054.7,191194,020.3,E*68\r\n");
        assert_eq!(fix.len(), 1);
        assert_eq!(fix[0].map(|f| f.utc_s % 86_400), Some(22 * 3600 + 54 * 60 + 46));
        assert_eq!(read(&sentence("GNRMC,120000.00,V,,,,,,,261126,,,N")), [None]);
        assert_eq!(read(&sentence("GNRMC,120000.00,A,,,,,,,261126,,,A")), [Some(Fix { utc_s: 20_783 * 86_400 + 43_200 })]);
        assert_eq!(read(&sentence("GPGGA,120000,,,,,0,,,,,,,,")), []);
        assert_eq!(read(&sentence("GNRMC,996000,A,,,,,,,269926,,,A")), [None], "no such time");
    }

    #[test]
    fn a_flipped_bit_is_no_fix() {
        let good = sentence("GNRMC,120000.00,A,4916.45,N,12311.12,W,0.5,054.7,261126,,,A").into_bytes();
        for bit in 0..8 * (good.len() - 2) {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let mut reader = Reader::default();
            let same = bad.eq_ignore_ascii_case(&good) && bit / 8 > good.len() - 5;
            assert!(same || bad.iter().filter_map(|b| reader.push(*b)).all(|f| f.is_none()), "bit {bit}");
        }
    }
}
