//! A csv of any origin: columns by name and unit, density recomputed where salinity is there.
//!
//! Read besides the flight format's own csv: units in a second line (ERDDAP tabledap) or in brackets behind the name (csvp), ISO
//! times, Latin-1 and UTF-16 text, a header behind a #, semicolons or tabs, a comma at the end of every row; and what `tidy` undoes.

use std::borrow::Cow;
use std::path::Path;

mod tidy;

use super::channels::{Log, Row};
use super::classes::Class;
use super::netcdf::names::{
    ABOUT_LATITUDE, ABOUT_LONGITUDE, BALLAST, BATTERY, CONDUCTIVITY, DEPTH, HEADING, LATITUDE, LONGITUDE, PITCH, PRESSURE, ROLL, SALINITY,
    TEMPERATURE, Wanted,
};
use super::netcdf::variables::undeclared_fill;
use super::{FileNote, ImportError, Imported, MappedName, Report, calendar};
use crate::record::csv as read;
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

/// Salinity columns, best first: practical (PSS-78) or absolute (g/kg).
const PRACTICAL: [&str; 4] = ["SP_psu", "salinity", "PSAL", "practical_salinity"];
const ABSOLUTE: [&str; 2] = ["SA_g_kg", "absolute_salinity"];

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let bytes = std::fs::read(path).map_err(|e| ImportError::new(path, e.to_string()))?;
    let mut report = Report::new("csv");
    let text = text_of(&bytes, path, &mut report)?;
    let text = tidy::decimal_points(&text, &mut report).into_owned();
    let table = Table::of(&text, &mut report);
    let name = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let mut flight = if let Some(table) = table.filter(|t| t.units.is_some() && !t.has_own_names()) {
        report.kind = "csv with units (ERDDAP)".into();
        table.flight(&name, &mut report).map_err(|what| ImportError::new(path, what))?
    } else {
        let plain = Table::of(&text, &mut report).map_or(Cow::Borrowed(text.as_str()), |t| Cow::Owned(t.plain(&mut report)));
        own_format(&plain, path, &name, &mut report)?
    };
    if flight.segment.iter().all(|s| *s == 0) {
        super::surface::cut(&mut flight);
    }
    report.files.push(FileNote { file: path.display().to_string(), rows: flight.len(), problems: Vec::new() });
    let vehicle = slocum_column(&text).map(|column| {
        let class = Class::slocum(quantile(&flight.pressure_pa, 1.0) * 1e-4);
        report.note(format!("vehicle: {column} is a Slocum's; usual numbers of the class {} with wide tolerances", class.name()));
        class.draft()
    });
    Ok(Imported { flight, report, vehicle })
}

/// A column that no other glider has: its pump's or its battery's, by the names and in the units of a Slocum.
fn slocum_column(text: &str) -> Option<&str> {
    const OWN: [&str; 5] = ["m_ballast_pumped", "m_de_oil_vol", "m_battpos", "battpos_in", "sci_m_present_time"];
    let header = text.lines().find(|l| !l.trim().is_empty() && !l.starts_with("##"))?;
    let names = header.trim_start_matches('#').split([',', ';', '\t']).map(|n| n.trim().trim_matches('"'));
    let name = |n: &'_ str| bracketed(n).map_or(n, |(name, _)| name).to_ascii_lowercase();
    names.into_iter().find(|n| OWN.contains(&name(n).as_str()))
}

/// The text, from whatever encoding.
fn text_of(bytes: &[u8], path: &Path, report: &mut Report) -> Result<String, ImportError> {
    let wide = |little: bool| {
        let units =
            bytes[2..].chunks_exact(2).map(|c| if little { u16::from_le_bytes([c[0], c[1]]) } else { u16::from_be_bytes([c[0], c[1]]) });
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect::<String>()
    };
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        report.note("the text is UTF-16: read as such".into());
        return Ok(wide(bytes[0] == 0xFF));
    }
    if bytes.contains(&0) {
        return Err(ImportError::new(path, "is not text (it holds zero bytes): a binary file of another name?"));
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.trim_start_matches('\u{feff}').to_owned()),
        Err(e) => {
            let at = e.valid_up_to();
            let line = 1 + bytes[..at].iter().filter(|b| **b == b'\n').count();
            report.note(format!("byte {:#04X} in line {line} is no UTF-8: read as Latin-1", bytes[at]));
            Ok(bytes.iter().map(|b| char::from(*b)).collect())
        }
    }
}

/// Lines cut into fields.
struct Table<'a> {
    names: Vec<String>,
    units: Option<Vec<String>>,
    rows: Vec<Vec<&'a str>>,
}

impl<'a> Table<'a> {
    /// The columns and rows of a text; none of one that needs no mending or has quotes around commas, which the reader knows.
    fn of(text: &'a str, report: &mut Report) -> Option<Self> {
        let mut lines = text.lines().filter(|l| !l.trim().is_empty()).peekable();
        // A header behind a # is one if it has as many fields as the line after it, which is none.
        let mut header = lines.next()?;
        while header.starts_with('#') {
            let next = *lines.peek()?;
            let fields = |l: &str| l.matches([',', ';', '\t']).count();
            if !next.starts_with('#') && fields(header) == fields(next) && fields(next) > 1 && next.split([',', ';', '\t']).any(is_number) {
                report.note("the header stands behind a #".into());
                header = header.trim_start_matches(['#', ' ']);
                break;
            }
            header = lines.next()?;
        }
        let separator = [',', ';', '\t'].into_iter().max_by_key(|s| header.matches(*s).count())?;
        let cut = |line: &'a str| line.split(separator).map(|f| f.trim().trim_matches('"').trim()).collect::<Vec<&str>>();
        if text.contains("\",") && text.lines().take(3).any(|l| l.split('"').skip(1).step_by(2).any(|quoted| quoted.contains(separator))) {
            return None;
        }
        let mut names: Vec<String> = cut(header).into_iter().map(str::to_owned).collect();
        let mut rows: Vec<Vec<&str>> = lines.filter(|l| !l.starts_with('#')).map(cut).collect();
        // A separator at the end of every row is no field.
        let most = rows.iter().map(Vec::len).max().unwrap_or(0);
        let open = |row: &Vec<&str>| row.len() == most && row.last().is_some_and(|f| f.is_empty());
        if names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        if most == names.len() + 1 && rows.iter().all(open) {
            rows.iter_mut().for_each(|r| {
                r.pop();
            });
            report.note("every row ends with a separator: an empty last field left out".into());
        }
        let mut units = None;
        if names.iter().filter(|n| bracketed(n).is_some()).count() * 2 > names.len() {
            units = Some(names.iter().map(|n| bracketed(n).map_or(String::new(), |(_, u)| u.to_owned())).collect());
            names = names.iter().map(|n| bracketed(n).map_or_else(|| n.clone(), |(n, _)| n.to_owned())).collect();
        } else if rows.first().is_some_and(|first| is_units(&names, first)) {
            units = Some(rows.remove(0).into_iter().map(str::to_owned).collect());
            report.note("the second line holds units".into());
        }
        Some(Self { names, units, rows })
    }

    /// Whether names of the flight format, which state their units, carry all that a flight needs.
    fn has_own_names(&self) -> bool {
        let named = |channel: read::Channel| {
            read::NAMES.iter().filter(|n| n.1 == channel).any(|n| self.names.iter().any(|h| h.eq_ignore_ascii_case(n.0)))
        };
        [read::Channel::Pressure, read::Channel::Pitch, read::Channel::Ballast, read::Channel::Density].into_iter().all(named)
    }

    fn time_column(&self) -> Option<usize> {
        ["time", "time_s", "m_present_time", "precise_time", "TIME"]
            .iter()
            .find_map(|n| self.names.iter().position(|h| h.eq_ignore_ascii_case(n)))
    }

    /// Values of a column, as they stand.
    fn numbers(&self, column: usize) -> Vec<f64> {
        let number = |row: &Vec<&str>| row.get(column).and_then(|f| f.parse::<f64>().ok()).filter(|v| v.is_finite()).unwrap_or(f64::NAN);
        self.rows.iter().map(number).collect()
    }

    /// The first wanted column with a unit that is known, in SI.
    fn channel(&self, wanted: &Wanted, time: &[f64], report: &mut Report) -> Series {
        for name in wanted.names {
            let Some(column) = self.names.iter().position(|h| h.eq_ignore_ascii_case(name)) else { continue };
            let unit = self.units.as_ref().and_then(|u| u.get(column)).map_or("", String::as_str);
            let stated = wanted.units.iter().find(|(u, _)| u.eq_ignore_ascii_case(unit));
            let factor = stated.or_else(|| wanted.without_unit.iter().find(|(n, _)| unit.is_empty() && n == name)).map(|f| f.1);
            let Some(factor) = factor else {
                report.note(format!("{name} is in \"{unit}\", which is not known for it: left out"));
                continue;
            };
            let mut values = self.numbers(column);
            while let Some((fill, count)) = undeclared_fill(&values) {
                values.iter_mut().filter(|v| **v == fill).for_each(|v| *v = f64::NAN);
                report.note(format!("{count} of {} values of {name} are {fill}: a fill, left out", values.len()));
            }
            values.iter_mut().for_each(|v| *v *= factor);
            let series = Series::new(time, &values);
            if !series.is_empty() {
                report.map(MappedName { from: self.names[column].clone(), unit: unit.into(), to: wanted.column.into(), factor });
                return series;
            }
        }
        Series::default()
    }

    /// The flight by the units of the columns.
    fn flight(&self, name: &str, report: &mut Report) -> Result<Flight, String> {
        let column = self.time_column().ok_or_else(|| format!("has no column time (it has: {})", self.names.join(", ")))?;
        let number = |text: &str| text.parse::<f64>().ok().or_else(|| calendar::iso_8601(text)).unwrap_or(f64::NAN);
        let mut time: Vec<f64> = self.rows.iter().map(|r| r.get(column).map_or(f64::NAN, |t| number(t))).collect();
        let undated = time.iter().filter(|t| !t.is_finite()).count();
        let stray = super::channels::stray_times(&mut time, super::channels::LONGEST_MISSION_S);
        if undated + stray > 0 {
            report.leave_out(format!("{} of {} rows have no time, or one years off the others", undated + stray, time.len()));
        }
        let mut get = |wanted: &Wanted| self.channel(wanted, &time, report);
        let (lat, lon) = (get(&ABOUT_LATITUDE), get(&ABOUT_LONGITUDE));
        let about = lat.pairs().next().zip(lon.pairs().next()).map(|((_, lat_deg), (_, lon_deg))| Place { lon_deg, lat_deg });
        let mut pressure = get(&PRESSURE);
        if pressure.is_empty() {
            let lat_deg = about.map_or(45.0, |p| p.lat_deg);
            let (t, p): (Vec<f64>, Vec<f64>) = get(&DEPTH).pairs().map(|(t, z)| (t, seawater::pressure_pa(z, lat_deg))).unzip();
            pressure = Series::new(&t, &p);
        }
        let (temperature, salinity, conductivity) = (get(&TEMPERATURE), get(&SALINITY), get(&CONDUCTIVITY));
        let fixes = super::position::fixes(&get(&LATITUDE), &get(&LONGITUDE));
        let mut log = Log { fixes, about, ..Log::default() };
        (log.pitch, log.roll, log.heading) = (get(&PITCH), get(&ROLL), get(&HEADING));
        (log.ballast, log.battery) = (get(&BALLAST), get(&BATTERY));
        let bad = |wanted: &Wanted| format!("has no pressure or depth with a known unit: looked for {}", wanted.names.join(", "));
        if pressure.is_empty() {
            return Err(bad(&PRESSURE));
        }
        let with = time.iter().filter(|t| t.is_finite()).count();
        if pressure.len() < with {
            report.note(format!("{} of {with} rows have no pressure or repeat a time: left out", with - pressure.len()));
        }
        let exact = |s: &Series, t: f64| s.at_within(t, 0.0);
        log.rows = pressure
            .pairs()
            .map(|(unix_s, pressure_pa)| {
                let temperature_degc = exact(&temperature, unix_s);
                let salinity = if salinity.is_empty() {
                    seawater::practical_salinity(exact(&conductivity, unix_s), temperature_degc, pressure_pa * 1e-4)
                } else {
                    exact(&salinity, unix_s)
                };
                Row { unix_s, segment: 0, pressure_pa, temperature_degc, salinity }
            })
            .collect();
        report.density_from("salinity, temperature, pressure", about, log.rows.iter().any(|r| r.salinity.is_finite()));
        log.flight(name, report).ok_or_else(|| "has no row with a time and a pressure".into())
    }
}

/// "name (unit)".
fn bracketed(name: &str) -> Option<(&str, &str)> {
    name.strip_suffix(')')?.rsplit_once(" (")
}

fn is_number(field: &str) -> bool {
    field.trim().parse::<f64>().is_ok()
}

/// Whether the line under the names holds units: "UTC" under the time, or no number and a unit that is known.
fn is_units(names: &[String], fields: &[&str]) -> bool {
    let utc = names.iter().zip(fields).any(|(n, f)| n.to_ascii_lowercase().contains("time") && f.eq_ignore_ascii_case("utc"));
    let known = ["dbar", "degree_C", "Celsius", "m", "rad", "degrees", "kg m-3", "s", "S m-1"];
    let words = fields.iter().all(|f| !is_number(f) || *f == "1") && fields.iter().any(|f| known.iter().any(|k| k.eq_ignore_ascii_case(f)));
    utc || words
}

/// A csv of the flight format, or of Slocum names.
fn own_format(text: &str, path: &Path, name: &str, report: &mut Report) -> Result<Flight, ImportError> {
    let mut flight = read::parse_log(text, path, name).map_err(|e| match e {
        read::ReadError::File { path, why } => ImportError { file: path.display().to_string(), what: why },
        read::ReadError::Content { path, line: 0, column, why } => {
            ImportError { file: path.display().to_string(), what: format!("{column}: {why}") }
        }
        read::ReadError::Content { path, line, column, why } => {
            ImportError { file: format!("{}, line {line}", path.display()), what: format!("column {column}: {why}") }
        }
    })?;
    let header: Vec<&str> = text.lines().find(|l| !l.starts_with('#')).unwrap_or("").split(',').map(str::trim).collect();
    let mut filled = Vec::new();
    for (name, channel, factor) in read::NAMES {
        if !filled.contains(channel) && header.iter().any(|h| h.eq_ignore_ascii_case(name)) {
            filled.push(*channel);
            report.map(MappedName { from: (*name).into(), unit: "by its name".into(), to: format!("{channel:?}"), factor: *factor });
        }
    }
    recompute_density(&mut flight, report);
    Ok(flight)
}
fn recompute_density(flight: &mut Flight, report: &mut Report) {
    let of = |names: &[&str]| names.iter().find_map(|n| flight.extra.get(*n).map(|v| ((*n).to_owned(), v.clone())));
    let (name, absolute) = match (of(&ABSOLUTE), of(&PRACTICAL)) {
        (Some(found), _) => found,
        (None, Some((name, practical))) => (name, practical.iter().map(|sp| seawater::absolute_salinity(*sp, None)).collect()),
        (None, None) => {
            report.density = "as the file states it: there is no salinity column to recompute it from".into();
            return;
        }
    };
    report.density_from(&format!("{name}, temperature, pressure"), None, true);
    let mut largest = 0.0_f64;
    for (i, sa) in absolute.iter().enumerate() {
        let ours = seawater::density(*sa, flight.temperature_degc[i], flight.pressure_pa[i] * 1e-4);
        let change = (ours - flight.density_kg_m3[i]).abs();
        if change > largest {
            largest = change;
        }
        flight.density_kg_m3[i] = ours;
    }
    report.note(format!("density changed by at most {largest:.4} kg/m3 against the file's own"));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60 rows of a dive, 4 s apart: time, dbar, pitch, ballast, density.
    fn rows(time: impl Fn(f64) -> String) -> String {
        (0..60)
            .map(|i| {
                let i = f64::from(i);
                format!("{},{:.2},-0.45,-200,1025.1\n", time(4.0 * i), 40.0 - (i - 30.0).abs())
            })
            .collect()
    }

    fn read(name: &str, bytes: &[u8]) -> Result<Imported, String> {
        let path = std::env::temp_dir().join(format!("glider-table-{}-{name}.csv", std::process::id()));
        std::fs::write(&path, bytes).expect("written");
        let got = import(&path).map_err(|e| e.to_string());
        std::fs::remove_file(&path).expect("removed");
        got
    }

    const HEADER: &str = "time_s,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n";

    #[test]
    fn regress_tables_that_spreadsheets_write_are_read() {
        let plain = HEADER.to_owned() + &rows(|t| t.to_string());
        let want = read("plain", plain.as_bytes()).expect("plain").flight;
        let same = |name: &str, bytes: &[u8]| {
            let got = read(name, bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(got.flight.pressure_pa, want.pressure_pa, "{name}");
            assert!(got.flight.time_s.iter().zip(&want.time_s).all(|(a, b)| (a - b).abs() < 1e-3), "{name}");
            got.report
        };
        let iso = HEADER.to_owned() + &rows(|t| format!("2020-09-13T12:{:02}:{:02}Z", 26 + (t / 60.0) as u32, t as u32 % 60));
        same("iso", iso.as_bytes());
        let commas: String = plain.lines().enumerate().map(|(k, l)| format!("{l}{}\n", if k > 0 { "," } else { "" })).collect();
        same("commas at row ends", commas.as_bytes());
        same("semicolons", plain.replace(',', ";").as_bytes());
        same("a header behind #", format!("# made by hand\n# {plain}").as_bytes());
        let latin: Vec<u8> = plain
            .replace("sci_density_kg_m3", "sci_density_kg_m3,temp (\u{b0}C)")
            .lines()
            .enumerate()
            .flat_map(|(k, l)| {
                let line = if k > 0 { format!("{l},12.0\n") } else { format!("{l}\n") };
                line.chars().map(|c| c as u8).collect::<Vec<u8>>()
            })
            .collect();
        let report = same("Latin-1", &latin);
        assert!(report.notes.iter().any(|n| n.contains("0xB0 in line 1")), "{:?}", report.notes);
        let wide: Vec<u8> = [0xFF, 0xFE].into_iter().chain(plain.encode_utf16().flat_map(u16::to_le_bytes)).collect();
        same("UTF-16", &wide);
        let e = read("binary", &[&plain.as_bytes()[..50], &[0, 1, 2]].concat()).expect_err("refused");
        assert!(e.contains("zero bytes"), "{e}");
    }

    #[test]
    fn a_line_of_units_under_the_formats_own_names_is_left_out() {
        let table = HEADER.to_owned() + "s,dbar,rad,cm3,kg m-3\n" + &rows(|t| t.to_string());
        let got = read("own-units", table.as_bytes()).expect("reads");
        assert_eq!((got.flight.len(), got.flight.pressure_pa[30]), (60, 40e4));
    }

    #[test]
    fn a_line_of_units_makes_the_columns() {
        let table = "time,depth,pressure,temperature,salinity,m_pitch\nUTC,m,dbar,Celsius,1,degrees\n".to_owned()
            + &(0..60)
                .map(|i| format!("2026-05-02T09:15:{i:02}Z,{i},{i}.1,12.5,35.0,{}\n", if i == 7 { "NaN" } else { "-20" }))
                .collect::<String>();
        let got = read("units", table.as_bytes()).expect("reads");
        assert_eq!(got.flight.len(), 60);
        assert!((got.flight.pitch_rad[3] + 20f64.to_radians()).abs() < 1e-12 && (got.flight.density_kg_m3[0] - 1026.5).abs() < 0.1);
        assert_eq!(got.report.start_unix_s, calendar::iso_8601("2026-05-02T09:15:00Z"));
    }
}
