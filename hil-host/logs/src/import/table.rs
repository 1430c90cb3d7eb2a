//! A csv of any origin: columns by name and unit, density recomputed where salinity or conductivity is there.
//!
//! Read besides the flight format's own csv: units in a second line (ERDDAP tabledap) or in brackets behind the name (csvp), times and
//! dates of other programs (`times`), Latin-1 and UTF-16 text, a header behind a # or %, semicolons or tabs, a comma at the end of every
//! row; what stands for no value or is flagged as bad (`values`); and what `tidy` undoes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

mod columns;
mod thousands;
mod tidy;
pub(super) mod times;
mod values;

use columns::Column;

use super::classes::Class;
use super::clocks::SET_CLOCK_S;
use super::raw_log::{Clock, RawLog, RawSeries, Said};
use super::reader::{Reader, ends_in};
use super::{FileNote, ImportError, Imported, MappedName, Report};
use crate::channels::{Channel, Channels};
use crate::record::bounded;
use crate::record::csv as read;
use crate::record::plausible::quantile;

/// Text with columns.
pub(super) const TABLES: Reader = Reader {
    name: "csv",
    claims: |path| ends_in(path, &["csv", "csvp", "csv0", "tsv", "txt"]),
    joins: false,
    import: |files, _| if let [one] = files { import(one) } else { two_computers(files) },
    ..Reader::PLAIN
};

/// What stands for a minus in texts that were typeset.
const MINUS: char = '\u{2212}';

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    flight_of(&[path.to_path_buf()], vec![read_file(path, false)?])
}

/// What a file holds, and a column that only a Slocum has; of one that is a `half` of a flight the rows are none of the flight format's.
fn read_file(path: &Path, half: bool) -> Result<(RawLog, Option<String>), ImportError> {
    let bytes = bounded::bytes(path, bounded::LOG).map_err(|e| ImportError::new(path, e.to_string()))?;
    let mut report = Report::new("csv");
    let mut text = text_of(bytes, path, &mut report)?;
    if text.contains(MINUS) {
        report.note("minus signs are those of a typesetter (U+2212): read as -".into());
        text = text.replace(MINUS, "-");
    }
    if let Some(rest) = text.strip_prefix("sep=").and_then(|t| t.split_once('\n')) {
        text = rest.1.to_owned();
    }
    let ends = |end: u8| text.bytes().filter(|b| *b == end).count();
    if ends(b'\r') > 2 * ends(b'\n') {
        text = text.replace('\r', "\n");
    }
    let text = thousands::without_grouping(&text, &mut report);
    let text = tidy::decimal_points(&text, &mut report);
    let error = |what: String| ImportError::new(path, what);
    let Some(table) = Table::of(&text, &mut report) else { return Err(error("is empty; a flight needs a header line and rows".into())) };
    let slocum = table.slocum_column();
    let lab = super::lab_table(path).map_err(error)?;
    Ok((table.raw_log(lab, half, report).map_err(error)?, slocum))
}

/// The flight of one table, or of the two of a vehicle's computers.
fn flight_of(paths: &[PathBuf], logs: Vec<(RawLog, Option<String>)>) -> Result<Imported, ImportError> {
    let error = |what: String| ImportError::new(&paths[0], what);
    let slocum = logs.iter().find_map(|l| l.1.clone());
    let raw = logs.into_iter().map(|l| l.0).reduce(RawLog::joined_with).ok_or_else(|| error("no table is named".into()))?;
    let first = raw.clocks[0].times.iter().copied().find(|t| t.is_finite()).filter(|start| *start > SET_CLOCK_S);
    let name = paths[0].file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let (flight, mut report) = raw.flight(&name).map_err(error)?;
    report.start_unix_s = report.start_unix_s.filter(|start| *start > SET_CLOCK_S).or(first);
    let note = |path: &PathBuf| FileNote { file: path.display().to_string(), rows: flight.len(), problems: Vec::new() };
    report.files.extend(paths.iter().map(note));
    let vehicle = slocum.map(|column| {
        let class = Class::slocum(quantile(&flight.pressure_pa, 1.0) * 1e-4);
        report.note_of_vehicle(format!("{column} is a Slocum's; usual numbers of the class {} with wide tolerances", class.name()));
        class.draft()
    });
    Ok(Imported { vehicle, ..Imported::new(flight, report) })
}

/// Two tables of one flight, one of each computer: each has channels that the other lacks, on a clock of its own.
fn two_computers(files: &[PathBuf]) -> Result<Imported, ImportError> {
    let list: Vec<_> = files.iter().take(6).filter_map(|f| f.file_name()).map(|n| n.to_string_lossy()).collect();
    let (count, list) = (files.len(), list.join(", "));
    let folder = files[0].parent().filter(|_| count > 1).unwrap_or(&files[0]);
    let alike = || {
        let what = format!(
            "{count} files of csv here, and one csv is one flight: import one at a time ({list}), or concatenate them under one header \
             line; two of them are one flight where each has channels that the other lacks"
        );
        ImportError::new(folder, what)
    };
    let [_, _] = files else { return Err(alike()) };
    let mut logs = files.iter().map(|path| read_file(path, true)).collect::<Result<Vec<_>, _>>()?;
    // What a computer repeats of the other one's comes late, and on another clock.
    let clock = |log: &RawLog| log.report.mapped.first().map(|m| m.from.to_ascii_lowercase()).unwrap_or_default();
    let of_science = [0, 1].map(|k| clock(&logs[k].0).starts_with(OF_SCIENCE));
    if of_science[0] != of_science[1] {
        for (log, science) in logs.iter_mut().zip(of_science) {
            log.0.series.retain(|s| s.name.to_ascii_lowercase().starts_with(OF_SCIENCE) == science);
        }
    }
    let has = |k: usize, name: &str| logs[k].0.series.iter().any(|s| s.name.eq_ignore_ascii_case(name));
    let known = |s: &&RawSeries| Channels::usual().knows(&s.name, "", "") && !Channel::Time.usual().is_called(&s.name);
    let own = |k: usize| logs[k].0.series.iter().filter(known).any(|s| !has(1 - k, &s.name));
    let shared = logs[0].0.series.iter().filter(known).any(|s| has(1, &s.name));
    if shared || !own(0) || !own(1) {
        return Err(alike());
    }
    let mut imported = flight_of(files, logs)?;
    imported.report.note(format!("{list} are of a vehicle's two computers: joined on their clocks"));
    Ok(imported)
}

/// How a Slocum's names begin of what its science computer measures, its clock among them.
const OF_SCIENCE: &str = "sci_";

/// The text, from whatever encoding.
fn text_of(bytes: Vec<u8>, path: &Path, report: &mut Report) -> Result<String, ImportError> {
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
    match String::from_utf8(bytes) {
        Ok(text) if text.starts_with(MARK) => Ok(text.trim_start_matches(MARK).to_owned()),
        Ok(text) => Ok(text),
        Err(e) => {
            let (at, bytes) = (e.utf8_error().valid_up_to(), e.into_bytes());
            let line = 1 + bytes[..at].iter().filter(|b| **b == b'\n').count();
            report.note(format!("byte {:#04X} in line {line} is no UTF-8: read as Latin-1", bytes[at]));
            Ok(bytes.iter().map(|b| char::from(*b)).collect())
        }
    }
}

/// What an editor may put in front of UTF-8.
const MARK: char = '\u{feff}';

/// Lines cut into fields, by column.
struct Table<'a> {
    names: Vec<String>,
    units: Option<Vec<String>>,
    columns: Vec<Column<'a>>,
    /// Number of rows.
    rows: usize,
}

/// Whether a line is one of comments.
fn is_comment(line: &str) -> bool {
    line.starts_with(['#', '%'])
}

/// The fields of a line, without blanks and quotes around them; a separator in quotes is none.
fn cut<'a>(line: &'a str, separator: char, into: &mut Vec<&'a str>) {
    into.clear();
    if !line.as_bytes().contains(&b'"') {
        // Byte by byte: fields are short, and a separator is one byte.
        let mut start = 0;
        for end in (0..line.len()).filter(|k| line.as_bytes()[*k] == separator as u8) {
            into.push(trimmed(&line[start..end]));
            start = end + 1;
        }
        into.push(trimmed(&line[start..]));
        return;
    }
    let pairs = line.matches('"').count().is_multiple_of(2);
    let mut quoted = false;
    let parts = line.split(|c: char| {
        quoted ^= c == '"' && pairs;
        c == separator && !quoted
    });
    into.extend(parts.map(|field| field.trim().trim_matches('"').trim()));
}

/// Without blanks around it; most fields have none.
fn trimmed(field: &str) -> &str {
    match field.as_bytes() {
        [] => field,
        [b'!'..=b'~', .., b'!'..=b'~'] | [b'!'..=b'~'] => field,
        _ => field.trim(),
    }
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
        let mut written = Vec::new();
        cut(header, separator, &mut written);
        let mut names: Vec<String> = written.iter().map(|n| (*n).to_owned()).collect();
        if names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        let mut lines = lines.filter(|l| !is_comment(l)).peekable();
        let (mut row, mut units, mut said) = (Vec::new(), None, None);
        if let Some(line) = lines.peek() {
            cut(line, separator, &mut row);
        }
        if names.iter().filter(|n| bracketed(n).is_some()).count() * 2 > names.len() {
            units = Some(names.iter().map(|n| bracketed(n).map_or(String::new(), |(_, u)| u.to_owned())).collect());
            names = names.iter().map(|n| bracketed(n).map_or_else(|| n.clone(), |(n, _)| n.to_owned())).collect();
        } else if !row.is_empty() && is_units(&names, &row) {
            lines.next();
            units = Some(row.iter().map(|u| (*u).to_owned()).collect());
            said = Some(row.clone());
        }
        // A row of all columns has a byte and more of each.
        let most_rows = text.bytes().filter(|b| *b == b'\n').count().min(text.len() / names.len().max(1));
        let mut table =
            Self { columns: names.iter().map(|n| Column::new(times::is_of_texts(n), most_rows)).collect(), names, units, rows: 0 };
        // Of files put one behind the other.
        let first = written.first().copied().unwrap_or_default();
        let again = |r: &[&str]| {
            let begins = r.first().is_some_and(|f| f.ends_with(first) && f.trim_start_matches(MARK) == first);
            begins && r.get(1..) == written.get(1..)
        };
        let (mut repeated, mut most, mut open) = (0, 0, 0);
        for line in lines {
            cut(line, separator, &mut row);
            if again(&row) || said.as_ref() == Some(&row) {
                repeated += 1;
                continue;
            }
            table.columns.iter_mut().enumerate().for_each(|(k, column)| column.push(row.get(k).copied().unwrap_or_default()));
            table.rows += 1;
            most = most.max(row.len());
            open += usize::from(row.len() == table.names.len() + 1 && row.last().is_some_and(|f| f.is_empty()));
        }
        // A separator at the end of every row is no field.
        if most == table.names.len() + 1 && open == table.rows {
            report.note("every row ends with a separator: an empty last field left out".into());
        }
        if said.is_some() {
            report.note("the second line holds units".into());
        }
        if repeated > 0 {
            report.note(format!("{repeated} lines repeat the header: left out"));
        }
        Some(table)
    }

    /// A column that no other glider has: its pump's or its battery's, by the names and in the units of a Slocum.
    fn slocum_column(&self) -> Option<String> {
        const OWN: [&str; 5] = ["m_ballast_pumped", "m_de_oil_vol", "m_battpos", "battpos_in", "sci_m_present_time"];
        let is_own = |n: &&String| OWN.iter().any(|own| bracketed(n).map_or(n.as_str(), |(name, _)| name).eq_ignore_ascii_case(own));
        self.names.iter().find(is_own).cloned()
    }

    /// The columns as they are, in the order of time.
    ///
    /// # Errors
    /// Rows of two vehicles or logs; times or numbers that cannot be read; no row.
    fn raw_log(mut self, lab: Option<Box<Channels>>, half: bool, mut report: Report) -> Result<RawLog, String> {
        let channels = lab.as_deref().unwrap_or(Channels::usual());
        self.one_vehicle()?;
        self.empty_no_values(&mut report);
        self.no_grouping(channels)?;
        self.leave_out_bad(&mut report);
        let own = !half && (self.units.is_none() || self.has_own_names());
        let Some(mut clock) = self.clock(own, &mut report)? else {
            return Err(format!(
                "has no column of times; accepted names: {} (it has: {})",
                channels.of(Channel::Time).names.join(", "),
                self.names.join(", ")
            ));
        };
        self.arrange(&mut clock, own, channels, &mut report)?;
        if self.rows == 0 {
            return Err(format!("column {} has no time in any row; write {}", self.names[clock.column], read::TIME_AS));
        }
        if own && let Some(k) = (1..clock.seconds.len()).find(|k| clock.seconds[*k] <= clock.seconds[k - 1]) {
            let (from, to) = (clock.seconds[k - 1], clock.seconds[k]);
            return Err(format!(
                "time goes from {from} to {to} s in row {}; it must increase from row to row (sort the rows, remove doubles)",
                k + 1
            ));
        }
        report.kind = if own || half { "csv" } else { "csv with units (ERDDAP)" }.into();
        let first = clock.seconds.first().copied().unwrap_or(0.0);
        let (from, unit) = (self.names[clock.column].clone(), self.unit(clock.column).to_owned());
        report.map(MappedName { from, unit, to: Channel::Time.usual().column.clone(), factor: 1.0 });
        let mut raw = RawLog { exact: own, repeats_are_lost: !own, report, table: lab.clone(), ..RawLog::default() };
        // Unix time would make "days since the start" meaningless.
        raw.zero_s = own.then_some(if first > SET_CLOCK_S { first } else { 0.0 });
        raw.segments = self.segments()?;
        raw.clocks.push(Clock { times: std::mem::take(&mut clock.seconds), said: Vec::new() });
        let flagged = self.flagged();
        let is_time = |name: &str| own && Channel::Time.usual().by_name(name).is_some();
        let mut unread = Vec::new();
        for (k, name) in self.names.iter().enumerate().filter(|(_, name)| !name.is_empty()) {
            let passed = k == clock.column
                || clock.date == Some(k)
                || name.eq_ignore_ascii_case("segment")
                || is_time(name)
                || values::is_vehicle(name);
            if passed || (flagged[k].is_some() && !own) {
                continue;
            }
            let (values, texts) = self.columns[k].take_numbers();
            let said =
                texts.map(|(none, of, first)| Said::Lost(format!("{none} of {of} fields of {name} are no numbers, first \"{first}\"")));
            if values.iter().all(|v| v.is_nan()) && said.is_some() {
                unread.extend(flagged[k].is_none().then_some(name.as_str()));
                continue;
            }
            let mut series = RawSeries::column(name, if own { "" } else { self.unit(k) }, values);
            series.said.extend(said);
            raw.series.push(series);
        }
        if !unread.is_empty() {
            raw.report.note(format!("not read: {}", unread.join(", ")));
        }
        Ok(raw)
    }

    /// The number of the segment of each row by a column of numbers or labels, which are counted as they appear.
    fn segments(&self) -> Result<Option<Vec<u32>>, String> {
        let Some(column) = self.names.iter().position(|h| h.eq_ignore_ascii_case("segment")) else { return Ok(None) };
        let fields = self.columns[column].fields();
        if let Some(row) = fields.iter().position(|s| read::no_value(s)) {
            return Err(format!("row {}, column segment: has no segment here; state one in each row, or remove the column", row + 1));
        }
        let number =
            |s: &str| s.parse::<f64>().ok().filter(|v| v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(v)).map(|v| v as u32);
        // One word among them makes labels of all: numbers of words would fall together with numbers that are stated.
        if fields.iter().all(|s| s.parse::<f64>().is_ok()) {
            let stated = |s: &&str| number(s).ok_or_else(|| format!("column segment: `{s}` is not a segment number (0, 1, 2 …)"));
            return fields.iter().map(stated).collect::<Result<_, _>>().map(Some);
        }
        let mut labels: BTreeMap<&str, u32> = BTreeMap::new();
        let mut label = |s| {
            let next = labels.len() as u32;
            *labels.entry(s).or_insert(next)
        };
        Ok(Some(fields.iter().copied().map(&mut label).collect()))
    }

    /// The unit of a column, as the file states it.
    fn unit(&self, column: usize) -> &str {
        self.units.as_ref().and_then(|u| u.get(column)).map_or("", String::as_str)
    }

    /// Whether names of the flight format, which state their units, carry all that a flight needs.
    fn has_own_names(&self) -> bool {
        let is_there = |channel: Channel| self.names.iter().any(|h| h.eq_ignore_ascii_case(&channel.usual().column));
        [Channel::Pressure, Channel::Pitch, Channel::Ballast, Channel::Density].into_iter().all(is_there)
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

#[cfg(test)]
mod field_tests;
#[cfg(test)]
mod tests;
