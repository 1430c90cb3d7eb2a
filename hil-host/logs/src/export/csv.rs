//! Writes a flight as `flight.csv` of the project's format.
//!
//! Named columns first, in the format's order and units, then what the flight
//! carries beyond them. An empty field is "no value".

use std::io::{self, Write};

use crate::record::flight::Flight;

/// Writes `flight`.
///
/// # Errors
/// What the writer says.
pub fn write(flight: &Flight, out: impl Write) -> io::Result<()> {
    let columns = super::columns(flight);
    let mut out = io::BufWriter::new(out);
    write!(out, "time_s,segment")?;
    for c in &columns {
        write!(out, ",{}", quoted(c.name))?;
    }
    writeln!(out)?;
    let mut line = Vec::new();
    for i in 0..flight.len() {
        line.clear();
        number(flight.time_s[i], 4, &mut line);
        line.push(b',');
        number(f64::from(flight.segment[i]), 0, &mut line);
        for c in &columns {
            line.push(b',');
            let value = c.values[i] * c.factor;
            match c.digits {
                _ if !value.is_finite() => {}
                Some(digits) => number(value, digits, &mut line),
                // A sensor that is not known: all that it has where it is small, such as backscatter in 1/m.
                None if value != 0.0 && value.abs() < 1e-2 => write!(line, "{value:e}")?,
                None => number(value, 7, &mut line),
            }
        }
        line.push(b'\n');
        out.write_all(&line)?;
    }
    out.flush()
}

/// A name as a field of a csv: in quotes where it holds what parts fields or rows.
fn quoted(name: &str) -> std::borrow::Cow<'_, str> {
    if name.contains([',', '"', '\n', '\r']) || name.trim() != name {
        format!("\"{}\"", name.replace('"', "\"\"")).into()
    } else {
        name.into()
    }
}

/// Fixed digits behind the point without the zeros that say nothing.
fn number(value: f64, digits: usize, out: &mut Vec<u8>) {
    let power = 10_u64.pow(digits as u32);
    let scaled = value.abs() * power as f64;
    let from_half = (scaled.fract() - 0.5).abs();
    // Beyond, or near the middle of two numbers, the product's own rounding could decide.
    if !(scaled < MOST_SCALED && from_half > NEAR_HALF) {
        let text = format!("{value:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        out.extend(if text == "-0" { "0" } else { text }.bytes());
        return;
    }
    let whole = scaled.round() as u64;
    if value < 0.0 && whole > 0 {
        out.push(b'-');
    }
    digits_of(whole / power, 1, out);
    let (mut part, mut width) = (whole % power, digits);
    if part > 0 {
        while part.is_multiple_of(10) {
            (part, width) = (part / 10, width - 1);
        }
        out.push(b'.');
        digits_of(part, width, out);
    }
}

/// So far a product of two doubles is good to this and a tenth of it: 1e12 · 2⁻⁵³ is 1.1e-4.
const MOST_SCALED: f64 = 1e12;
const NEAR_HALF: f64 = 1e-3;

/// "00", "01" … "99".
const PAIRS: [u8; 200] = {
    let mut pairs = [b'0'; 200];
    let mut k = 0;
    while k < 100 {
        (pairs[2 * k], pairs[2 * k + 1]) = (b'0' + (k / 10) as u8, b'0' + (k % 10) as u8);
        k += 1;
    }
    pairs
};

/// The digits of a whole number, `least` of them and more.
fn digits_of(mut value: u64, least: usize, out: &mut Vec<u8>) {
    let mut buffer = [b'0'; 20];
    let mut at = buffer.len();
    while value > 9 {
        at -= 2;
        buffer[at..at + 2].copy_from_slice(&PAIRS[2 * (value % 100) as usize..][..2]);
        value /= 100;
    }
    while value > 0 || buffer.len() - at < least {
        at -= 1;
        buffer[at] = b'0' + (value % 10) as u8;
        value /= 10;
    }
    out.extend(&buffer[at..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// As the standard library writes them, without zeros at the end; ties, signs, sizes.
    #[test]
    fn prop_numbers_are_rounded_as_exact_arithmetic_does() {
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let ties =
            [0.5, 1.5, 2.5, 0.125, 0.375, 1e-9, 4.5e-8, 0.000_05, 1.000_05, 123_456.789_95, -0.4, -0.000_01, 1e15, 2e22, f64::MAX, -0.0];
        let some: Vec<f64> = (0..200_000).map(|k| (random() - 0.5) * 10_f64.powi(k % 16 - 6)).collect();
        for value in ties.into_iter().chain(some) {
            for digits in [0, 1, 3, 4, 5, 7] {
                let exact = format!("{value:.digits$}");
                let exact = if exact.contains('.') { exact.trim_end_matches('0').trim_end_matches('.') } else { &exact };
                let mut got = Vec::new();
                number(value, digits, &mut got);
                assert_eq!(String::from_utf8(got).expect("text"), if exact == "-0" { "0" } else { exact }, "{value:e} {digits}");
            }
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let n = 12;
        let column = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(f64::from(i))).collect::<Vec<_>>();
        let mut flight = Flight {
            name: "f".into(),
            time_s: column(&|i| i * 4.0 + 0.25),
            segment: (0..n as u32).map(|i| i / 6).collect(),
            pressure_pa: column(&|i| i * 1e4),
            pitch_rad: column(&|i| -0.4 + 0.01 * i),
            roll_rad: column(&|_| f64::NAN),
            heading_rad: column(&|i| 0.5 * i),
            ballast_m3: column(&|i| -2e-4 + 1e-6 * i),
            battery_mass_m: column(&|i| 0.001 * i),
            temperature_degc: column(&|i| 15.0 - 0.1 * i),
            density_kg_m3: column(&|i| 1020.0 + 0.01 * i),
            gps_east_m: column(&|i| if i == 0.0 { 3.5 } else { f64::NAN }),
            gps_north_m: column(&|i| if i == 0.0 { -3.5 } else { f64::NAN }),
            speed_m_s: Some(column(&|i| 0.3 + 0.001 * i)),
            ..Flight::default()
        };
        flight.extra.insert("oxygen".into(), column(&|i| i));
        flight.extra.insert("oxygen, \"raw\"".into(), column(&|i| -i));
        flight.extra.insert("bb700_per_m".into(), column(&|i| 3.276_592_51e-5 + 1e-12 * i));
        let mut bytes = Vec::new();
        write(&flight, &mut bytes).expect("written");
        let text = String::from_utf8(bytes).expect("text");
        let again = crate::record::csv::parse(&text, Path::new("f.csv"), "f").expect("read");
        assert_eq!(again.segment, flight.segment);
        assert_eq!(again.extra, flight.extra);
        for (a, b) in [
            (&again.time_s, &flight.time_s),
            (&again.pressure_pa, &flight.pressure_pa),
            (&again.pitch_rad, &flight.pitch_rad),
            (&again.roll_rad, &flight.roll_rad),
            (&again.heading_rad, &flight.heading_rad),
            (&again.ballast_m3, &flight.ballast_m3),
            (&again.battery_mass_m, &flight.battery_mass_m),
            (&again.temperature_degc, &flight.temperature_degc),
            (&again.density_kg_m3, &flight.density_kg_m3),
            (&again.gps_east_m, &flight.gps_east_m),
            (again.speed_m_s.as_ref().expect("speed"), flight.speed_m_s.as_ref().expect("speed")),
        ] {
            for (a, b) in a.iter().zip(b) {
                // These values have fewer digits than are written.
                assert!((a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-12 * b.abs().max(1.0), "{a} {b}");
            }
        }
    }
}
