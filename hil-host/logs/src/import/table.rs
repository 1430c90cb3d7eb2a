//! A csv of any origin: columns by name and unit, density recomputed where salinity or conductivity is there.
//!
//! Read besides the flight format's own csv: units in a second line (ERDDAP tabledap) or in brackets behind the name (csvp), times and
//! dates of other programs (`times`), Latin-1 and UTF-16 text, a header behind a # or %, semicolons or tabs, a comma at the end of every
//! row; what stands for no value or is flagged as bad (`values`); and what `tidy` undoes.

use std::path::Path;

mod channel;
mod thousands;
pub(super) mod tidy;
pub(super) mod times;
mod values;

use super::channels::{SALINITY_COLUMN, SET_CLOCK_S};
use super::classes::Class;
use super::report::shown;
use super::{FileNote, ImportError, Imported, MappedName, Report};
use crate::record::bounded;
use crate::record::csv as read;
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::seawater;

/// Salinity columns, best first, of practical salinity (PSS-78); case does not matter.
const SALINITIES: [(&str, f64); 9] = [
    ("SP_psu", 1.0),
    ("salinity", 1.0),
    ("PSAL", 1.0),
    ("practical_salinity", 1.0),
    ("sci_water_salinity", 1.0),
    ("sci_salinity", 1.0),
    ("salinity_psu", 1.0),
    ("practical_salinity_psu", 1.0),
    ("sea_water_practical_salinity", 1.0),
];
/// The same of absolute salinity (g/kg).
const ABSOLUTE: [(&str, f64); 2] = [("SA_g_kg", 1.0), ("absolute_salinity", 1.0)];
/// Conductivity columns whose unit is in their name, with the factor to S/m.
const CONDUCTIVITIES: [(&str, f64); 4] =
    [("sci_water_cond", 1.0), ("conductivity_S_m", 1.0), ("sci_water_cond_S_m", 1.0), ("conductivity_mS_cm", 0.1)];

/// What stands for a minus in texts that were typeset.
const MINUS: char = '\u{2212}';

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let bytes = bounded::bytes(path, bounded::LOG).map_err(|e| ImportError::new(path, e.to_string()))?;
    let mut report = Report::new("csv");
    let mut text = text_of(&bytes, path, &mut report)?;
    if text.contains(MINUS) {
        report.note("minus signs are those of a typesetter (U+2212): read as -".into());
        text = text.replace(MINUS, "-");
    }
    if let Some(rest) = text.strip_prefix("sep=").and_then(|t| t.split_once('\n')) {
        text = rest.1.to_owned();
    }
    let ends = |c: char| text.matches(c).count();
    if ends('\r') > 2 * ends('\n') {
        text = text.replace('\r', "\n");
    }
    let text = thousands::without_grouping(&text, &mut report);
    let text = tidy::decimal_points(&text, &mut report);
    let name = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let mut slocum = None;
    let flight = match Table::of(&text, &mut report) {
        Some(table) => {
            slocum = table.slocum_column();
            from_table(table, path, &name, &mut report)?
        }
        None => own_format(&text, path, &name, None, &mut report)?,
    };
    let uncut = flight.segment.iter().all(|s| *s == 0);
    report.files.push(FileNote { file: path.display().to_string(), rows: flight.len(), problems: Vec::new() });
    let vehicle = slocum.map(|column| {
        let class = Class::slocum(quantile(&flight.pressure_pa, 1.0) * 1e-4);
        report.note(format!("vehicle: {column} is a Slocum's; usual numbers of the class {} with wide tolerances", class.name()));
        class.draft()
    });
    let mut imported = Imported { vehicle, ..Imported::new(flight, report) };
    if uncut {
        // Fixes of each dive count from its own first one.
        super::surface::cut_anew(&mut imported, 2);
    }
    Ok(imported)
}

/// The flight of a table, by units or by the names of the flight format.
fn from_table(mut table: Table, path: &Path, name: &str, report: &mut Report) -> Result<Flight, ImportError> {
    let error = |what: String| ImportError::new(path, what);
    table.one_vehicle().map_err(error)?;
    table.empty_no_values(report);
    table.no_grouping().map_err(error)?;
    table.leave_out_bad(report);
    let own = table.units.is_none() || table.has_own_names();
    let mut clock = table.clock(own, report).map_err(error)?;
    if let Some(clock) = &mut clock {
        let rows = table.rows.len();
        table.arrange(clock, own, report).map_err(error)?;
        if rows > 0 && table.rows.is_empty() {
            return Err(error(format!("column {} has no time in any row; write {}", table.names[clock.column], read::TIME_AS)));
        }
    }
    if !own {
        report.kind = "csv with units (ERDDAP)".into();
        let clock = clock.ok_or_else(|| error(format!("has no column time (it has: {})", table.names.join(", "))))?;
        let flight = table.flight(&clock, name, report).map_err(error)?;
        report.start_unix_s = report.start_unix_s.filter(|start| *start > SET_CLOCK_S);
        return Ok(flight);
    }
    table.empty_fills(report);
    let mut drop = table.passed_over(report);
    // Flags in words are read by now.
    let flagged = table.flagged();
    drop.extend((0..table.names.len()).filter(|k| flagged[*k].is_some() && !table.is_read_by_name(*k)));
    let plain = table.plain(clock.as_ref(), &drop);
    let time = clock.as_ref().map(|c| table.names[c.column].as_str());
    let flight = own_format(&plain, path, name, time, report)?;
    let of_time = |k: usize| clock.as_ref().is_some_and(|c| c.column == k || c.date == Some(k));
    table.note_unread(|k| of_time(k) || (!drop.contains(&k) && table.is_read_by_name(k)), report);
    report.start_unix_s = clock.and_then(|c| c.seconds.first().copied()).filter(|start| *start > SET_CLOCK_S);
    Ok(flight)
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

/// Whether a line is one of comments.
fn is_comment(line: &str) -> bool {
    line.starts_with(['#', '%'])
}

/// The fields of a line, without blanks and quotes around them; a separator in quotes is none.
fn cut(line: &str, separator: char) -> Vec<&str> {
    let pairs = line.matches('"').count().is_multiple_of(2);
    let mut quoted = false;
    line.split(|c: char| {
        quoted ^= c == '"' && pairs;
        c == separator && !quoted
    })
    .map(|field| field.trim().trim_matches('"').trim())
    .collect()
}

impl<'a> Table<'a> {
    /// The columns and rows of a text; none of an empty one.
    fn of(text: &'a str, report: &mut Report) -> Option<Self> {
        let mut lines = text.lines().filter(|l| !l.trim().is_empty()).peekable();
        // A header behind a # or % is one if it has as many fields as the line after it, which is none.
        let mut header = lines.next()?;
        while is_comment(header) {
            let next = *lines.peek()?;
            let fields = |l: &str| l.matches([',', ';', '\t']).count();
            if !is_comment(next) && fields(header) == fields(next) && fields(next) > 1 && next.split([',', ';', '\t']).any(is_number) {
                report.note(format!("the header stands behind a {}", &header[..1]));
                header = header.trim_start_matches(['#', '%', ' ']);
                break;
            }
            header = lines.next()?;
        }
        let separator = [',', ';', '\t'].into_iter().max_by_key(|s| header.matches(*s).count())?;
        let written = cut(header, separator);
        let mut names: Vec<String> = written.iter().map(|n| (*n).to_owned()).collect();
        let mut rows: Vec<Vec<&str>> = lines.filter(|l| !is_comment(l)).map(|l| cut(l, separator)).collect();
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
        let mut said = None;
        if names.iter().filter(|n| bracketed(n).is_some()).count() * 2 > names.len() {
            units = Some(names.iter().map(|n| bracketed(n).map_or(String::new(), |(_, u)| u.to_owned())).collect());
            names = names.iter().map(|n| bracketed(n).map_or_else(|| n.clone(), |(n, _)| n.to_owned())).collect();
        } else if rows.first().is_some_and(|first| is_units(&names, first)) {
            let line = rows.remove(0);
            units = Some(line.iter().map(|u| (*u).to_owned()).collect());
            said = Some(line);
            report.note("the second line holds units".into());
        }
        // Of files put one behind the other.
        let all = rows.len();
        let first = written.first().copied().unwrap_or_default();
        let again = |r: &Vec<&str>| r.first().is_some_and(|f| f.trim_start_matches('\u{feff}') == first) && r.get(1..) == written.get(1..);
        rows.retain(|r| !again(r) && said.as_ref() != Some(r));
        if rows.len() < all {
            report.note(format!("{} lines repeat the header: left out", all - rows.len()));
        }
        Some(Self { names, units, rows })
    }

    /// A column that no other glider has: its pump's or its battery's, by the names and in the units of a Slocum.
    fn slocum_column(&self) -> Option<String> {
        const OWN: [&str; 5] = ["m_ballast_pumped", "m_de_oil_vol", "m_battpos", "battpos_in", "sci_m_present_time"];
        let is_own = |n: &&String| OWN.iter().any(|own| bracketed(n).map_or(n.as_str(), |(name, _)| name).eq_ignore_ascii_case(own));
        self.names.iter().find(is_own).cloned()
    }

    /// The unit of a column, as the file states it.
    fn unit(&self, column: usize) -> &str {
        self.units.as_ref().and_then(|u| u.get(column)).map_or("", String::as_str)
    }

    /// Whether names of the flight format, which state their units, carry all that a flight needs.
    fn has_own_names(&self) -> bool {
        let named = |channel: read::Channel| {
            read::NAMES.iter().filter(|n| n.1 == channel).any(|n| self.names.iter().any(|h| h.eq_ignore_ascii_case(n.0)))
        };
        [read::Channel::Pressure, read::Channel::Pitch, read::Channel::Ballast, read::Channel::Density].into_iter().all(named)
    }

    /// Names a column of numbers some of whose fields are none.
    fn report_texts(&self, column: usize, report: &mut Report) {
        let fields = || self.rows.iter().filter_map(|r| r.get(column)).filter(|f| !read::no_value(f));
        let mut texts = fields().filter(|f| !is_number(f));
        if let Some(first) = texts.next().filter(|_| fields().any(|f| is_number(f))) {
            let (count, all, name) = (1 + texts.count(), fields().count(), &self.names[column]);
            report.leave_out(format!("{count} of {all} fields of {name} are no numbers, first \"{}\"", shown(first)));
        }
    }

    /// Values of a column, as they stand.
    fn numbers(&self, column: usize) -> Vec<f64> {
        let number = |row: &Vec<&str>| row.get(column).and_then(|f| f.parse::<f64>().ok()).filter(|v| v.is_finite()).unwrap_or(f64::NAN);
        self.rows.iter().map(number).collect()
    }

    /// Whether the reader of the flight format takes a column: a channel of its, or any numbers.
    fn is_read_by_name(&self, column: usize) -> bool {
        let channel = read::NAMES.iter().any(|n| n.0.eq_ignore_ascii_case(&self.names[column]));
        let fields = || self.rows.iter().filter_map(|r| r.get(column)).filter(|f| !read::no_value(f));
        channel || fields().any(|f| is_number(f)) || fields().next().is_none()
    }
}

/// "name (unit)", "name [unit]".
fn bracketed(name: &str) -> Option<(&str, &str)> {
    match name.strip_suffix(']') {
        Some(name) => name.rsplit_once('[').map(|(name, unit)| (name.trim_end(), unit)).filter(|(name, _)| !name.is_empty()),
        None => name.strip_suffix(')')?.rsplit_once(" ("),
    }
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

/// A csv of the flight format, or of Slocum names, whose time the source calls `time`.
fn own_format(text: &str, path: &Path, name: &str, time: Option<&str>, report: &mut Report) -> Result<Flight, ImportError> {
    let mut flight = read::parse_log(text, path, name).map_err(|e| match e {
        read::ReadError::File { path, why } => ImportError { file: path.display().to_string(), what: why },
        read::ReadError::Content { path, line: 0, column, why } => {
            ImportError { file: path.display().to_string(), what: format!("{column}: {why}") }
        }
        read::ReadError::Content { path, line, column, why } => {
            ImportError { file: format!("{}, line {line}", path.display()), what: format!("column {column}: {why}") }
        }
    })?;
    std::mem::take(&mut flight.unread).into_iter().for_each(|what| report.note(what));
    let header: Vec<&str> = text.lines().find(|l| !l.starts_with('#')).unwrap_or("").split(',').map(str::trim).collect();
    let mut filled = Vec::new();
    for (name, channel, factor) in read::NAMES {
        if !filled.contains(channel) && header.iter().any(|h| h.eq_ignore_ascii_case(name)) {
            filled.push(*channel);
            let from = time.filter(|_| *channel == read::Channel::Time).unwrap_or(name);
            report.map(MappedName { from: from.into(), unit: "by its name".into(), to: format!("{channel:?}"), factor: *factor });
        }
    }
    recompute_density(&mut flight, report);
    Ok(flight)
}

/// The first of the named columns that a flight keeps, whatever their case, by its name there.
fn kept(flight: &Flight, names: &[(&str, f64)]) -> Option<(String, Vec<f64>)> {
    let find = |(name, factor): &(&str, f64)| {
        let (spelt, values) = flight.extra.iter().find(|(h, v)| h.eq_ignore_ascii_case(name) && v.iter().any(|x| x.is_finite()))?;
        Some((spelt.clone(), values.iter().map(|x| x * factor).collect()))
    };
    names.iter().find_map(find)
}

/// Density anew from what the CTD measured, where there is salinity or conductivity for half as many rows as the file has densities.
fn recompute_density(flight: &mut Flight, report: &mut Report) {
    let dbar = |i: usize| flight.pressure_pa[i] * 1e-4;
    let mut practical = None;
    let (name, absolute): (String, Vec<f64>) = if let Some(found) = kept(flight, &ABSOLUTE) {
        found
    } else {
        let salinity = kept(flight, &SALINITIES).or_else(|| {
            let (name, s_m) = kept(flight, &CONDUCTIVITIES)?;
            let of = |(i, c): (usize, &f64)| seawater::practical_salinity(*c, flight.temperature_degc[i], dbar(i));
            Some((name, s_m.iter().enumerate().map(of).collect()))
        });
        let Some((name, salinity)) = salinity else {
            report.density = "as the file states it: there is no salinity column to recompute it from".into();
            return;
        };
        let absolute = salinity.iter().map(|sp| seawater::absolute_salinity(*sp, None)).collect();
        practical = Some(salinity);
        (name, absolute)
    };
    let ours: Vec<f64> = absolute.iter().enumerate().map(|(i, sa)| seawater::density(*sa, flight.temperature_degc[i], dbar(i))).collect();
    let count = |values: &[f64]| values.iter().filter(|v| v.is_finite()).count();
    let (new, stated) = (count(&ours), count(&flight.density_kg_m3));
    if 2 * new < stated {
        report.density = format!("as the file states it: {name} and temperature give {new} values of it, the file {stated}");
        return;
    }
    report.density_from(&format!("{name}, temperature, pressure"), None, new > 0);
    let largest = ours.iter().zip(&flight.density_kg_m3).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    if stated > 0 {
        report.note(format!("density changed by at most {largest:.4} kg/m3 against the file's own"));
    }
    flight.density_kg_m3 = ours;
    if let Some(practical) = practical.filter(|_| kept(flight, &[(SALINITY_COLUMN, 1.0)]).is_none()) {
        flight.extra.insert(SALINITY_COLUMN.into(), practical);
    }
}

#[cfg(test)]
mod field_tests;
#[cfg(test)]
mod tests;
