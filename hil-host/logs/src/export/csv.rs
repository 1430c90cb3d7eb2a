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
    for i in 0..flight.len() {
        write!(out, "{},{}", number(flight.time_s[i], 4), flight.segment[i])?;
        for c in &columns {
            let value = c.values[i] * c.factor;
            if value.is_finite() {
                write!(out, ",{}", c.digits.map_or_else(|| unknown(value), |digits| number(value, digits)))?;
            } else {
                write!(out, ",")?;
            }
        }
        writeln!(out)?;
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

/// A number of an unknown sensor: seven digits after the point, and all it has where it is small, such as backscatter in 1/m.
fn unknown(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-2 { format!("{value:e}") } else { number(value, 7) }
}

/// Fixed digits without the zeros that say nothing.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if !text.contains('.') {
        return text;
    }
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

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
