//! Reads a flight from csv: by column name, in the units the name states, into SI.
//!
//! Accepts the columns of `glider-trial/1` (FORMAT section 1) and the usual names of Slocum csv exports. Empty fields, `nan`, `NA` and
//! the like become NaN. Text in the `segment` column becomes numbers in order of appearance. Columns it does not know are kept in
//! [`Flight::extra`] where they hold numbers; a text in one of them is no value and is named in [`Flight::unread`]. What is refused, is
//! refused with file, line, column and a fix.

use crate::channels::{Channel, named};
use crate::record::bounded;
use crate::record::flight::Flight;
use crate::record::plausible::{SAMPLED_EVERY, Step, implausible, usual_step};
use crate::record::situations;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a file cannot be used.
#[derive(Debug)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be opened or is not text.
    File {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        why: String,
    },
    /// Something in the file is wrong.
    Content {
        /// Which file.
        path: PathBuf,
        /// Line, 1 = header; 0 if it concerns the whole file.
        line: u64,
        /// Column or key name.
        column: String,
        /// What is wrong and what to do.
        why: String,
    },
}

impl std::fmt::Display for ReadError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File { path, why } => write!(f, "{}: {why}", path.display()),
            Self::Content { path, line: 0, column, why } => write!(f, "{}: {column}: {why}", path.display()),
            Self::Content { path, line, column, why } => write!(f, "{}, line {line}, column {column}: {why}", path.display()),
        }
    }
}

impl std::error::Error for ReadError {}

/// What the names of a flight's files end in while it flies.
pub const UNFINISHED: &str = ".unfinished";

/// The csv file of `path`: itself, or `flight.csv` (else the only csv) of a directory.
///
/// # Errors
/// Nothing there, or more than one candidate.
pub fn csv_of(path: &Path) -> Result<PathBuf, ReadError> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let named = path.join("flight.csv");
    if named.is_file() {
        return Ok(named);
    }
    let file_error = |why: String| ReadError::File { path: path.to_path_buf(), why };
    let journal = path.join(format!("flight.csv{UNFINISHED}"));
    if journal.is_file() {
        let why = format!("this flight is not finished (still flying, or killed); for the rows it has, name {}", journal.display());
        return Err(file_error(why));
    }
    let mut found: Vec<PathBuf> = std::fs::read_dir(path)
        .map_err(|e| file_error(e.to_string()))?
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|x| x == "csv"))
        .collect();
    found.sort();
    match found.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(file_error("no flight.csv in this directory; name a csv file, or make one with `glider import`".into())),
        many => Err(file_error(format!("{} csv files here; name one of them with --flight", many.len()))),
    }
}

/// What a comparison needs beside time and pressure, the column that states it, and what cannot be asked of a flight without it.
const COMPARED: [(Channel, &str, &str); 3] = [
    (Channel::Pitch, "m_pitch_rad", "neither its glide path nor its lift and drag can be asked"),
    (
        Channel::Ballast,
        "m_ballast_pumped_cc",
        "the force that drives it is unknown: neither drag, lift and trim nor what is missing can be asked",
    ),
    (Channel::Density, "sci_density_kg_m3", "its weight in water is unknown: neither trim nor drag can be asked"),
];

/// What cannot be asked of a flight without a column that a comparison needs.
#[must_use]
pub fn cannot_be_asked(column: &str) -> Option<&'static str> {
    COMPARED.iter().find(|c| c.1 == column).map(|c| c.2)
}

/// Reads a flight from a csv file or a flight directory, with all that a comparison needs.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn flight(path: &Path) -> Result<Flight, ReadError> {
    let (text, file, name) = text_of(path)?;
    parse(&text, &file, &name)
}

/// Reads what there is of a flight: time and pressure, and every other column that the file has.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn log(path: &Path) -> Result<Flight, ReadError> {
    let (text, file, name) = text_of(path)?;
    parse_log(&text, &file, &name)
}

fn text_of(path: &Path) -> Result<(String, PathBuf, String), ReadError> {
    let file = csv_of(path)?;
    let text = bounded::text(&file, bounded::LOG).map_err(|e| {
        let binary = e.kind() == std::io::ErrorKind::InvalidData;
        let why = if binary { "is not text; a glider's binary or NetCDF file is read by `glider import`".into() } else { e.to_string() };
        ReadError::File { path: file.clone(), why }
    })?;
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() }.map_or_else(String::new, |n| n.to_string_lossy().into());
    Ok((text, file, name))
}

/// Which columns of a header are channels, with the factor to SI.
type Channels = BTreeMap<Channel, (usize, f64)>;

/// A table of numbers as read, and where its rows stand in the file.
struct Table<'a> {
    file: &'a Path,
    header: csv::StringRecord,
    channels: Channels,
    columns: Vec<Vec<f64>>,
    /// Of each column that is no channel: how many of its fields are no numbers, and the first of them with its line.
    texts: Vec<Option<(usize, String, u64)>>,
    /// What stands in the column of segments, in the order of appearance, with the row of the first; and which of them a row has.
    labels: Vec<(String, usize)>,
    segments: Vec<u32>,
    lines: Vec<u64>,
}

/// The channels of a header; those that no flight can be without must be there, and those that a comparison needs if it is `compared`.
fn channels_of(header: &csv::StringRecord, compared: bool, bad: &dyn Fn(u64, &str, String) -> ReadError) -> Result<Channels, ReadError> {
    let plain = |h: &str| h.trim_start_matches('\u{feff}').to_ascii_lowercase();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for (i, name) in header.iter().enumerate().filter(|(_, h)| !h.is_empty()) {
        let first = *seen.entry(plain(name)).or_insert(i);
        // Channels are known whatever their case, other columns are not.
        if first != i && (&header[first] == name || named().any(|n| n.0.eq_ignore_ascii_case(name))) {
            let why =
                format!("stands twice in the header, as columns {} and {}: which one is meant? Rename or remove one", first + 1, i + 1);
            return Err(bad(1, name, why));
        }
    }
    let mut channels = Channels::new();
    for (alias, channel, factor) in named() {
        if let Some(i) = seen.get(&alias.to_ascii_lowercase()) {
            channels.entry(channel).or_insert((*i, factor));
        }
    }
    let compared = COMPARED.iter().map(|c| (c.0, c.1)).filter(|_| compared);
    for (channel, column) in [(Channel::Time, "time_s"), (Channel::Pressure, "pressure_dbar")].into_iter().chain(compared) {
        if !channels.contains_key(&channel) {
            let accepted: Vec<&str> = named().filter(|(_, c, _)| *c == channel).map(|(n, _, _)| n).collect();
            let without = cannot_be_asked(column).map_or_else(String::new, |what| format!("; without it {what}"));
            return Err(bad(
                1,
                column,
                format!(
                    "is missing{without}; accepted names: {} (the file has: {}{})",
                    accepted.join(", "),
                    header.iter().collect::<Vec<_>>().join(", "),
                    if header.len() == 1 { "; columns must be separated by commas" } else { "" }
                ),
            ));
        }
    }
    Ok(channels)
}

impl<'a> Table<'a> {
    fn read(text: &str, file: &'a Path, compared: bool) -> Result<Self, ReadError> {
        let bad = |line: u64, column: &str, why: String| ReadError::Content {
            path: file.to_path_buf(),
            line,
            column: in_one_line(column),
            why: in_one_line(&why),
        };
        let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| bad(1, "header", e.to_string()))?.clone();
        let channels = channels_of(&header, compared, &bad)?;
        // A row of all columns has a byte and more of each.
        let rows = text.bytes().filter(|b| *b == b'\n').count().min(text.len() / header.len().max(1));
        let mut columns: Vec<Vec<f64>> = (0..header.len()).map(|_| Vec::with_capacity(rows)).collect();
        let mut texts = vec![None; header.len()];
        let (mut lines, mut segments, mut labels) = (Vec::new(), Vec::new(), Vec::<(String, usize)>::new());
        let mut places: BTreeMap<String, u32> = BTreeMap::new();
        let mut known_channel = vec![false; header.len()];
        channels.values().for_each(|v| known_channel[v.0] = true);
        let [segment_column, time_column] = [Channel::Segment, Channel::Time].map(|c| channels.get(&c).map(|v| v.0));
        let mut record = csv::StringRecord::new();
        loop {
            let more = reader.read_record(&mut record);
            if !more.map_err(|e| bad(e.position().map_or(0, csv::Position::line), "row", e.to_string()))? {
                break;
            }
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() != header.len() {
                let why = format!("has {} fields, the header {}; the file may have been cut off here", record.len(), header.len());
                return Err(bad(line, "row", why));
            }
            lines.push(line);
            for (i, field) in record.iter().enumerate() {
                let value = match field.parse::<f64>() {
                    _ if Some(i) == segment_column => {
                        let last = segments.last().copied().filter(|k: &u32| labels[*k as usize].0 == field);
                        let label = last.or_else(|| places.get(field).copied()).unwrap_or_else(|| {
                            labels.push((field.to_owned(), segments.len()));
                            places.insert(field.to_owned(), labels.len() as u32 - 1);
                            labels.len() as u32 - 1
                        });
                        segments.push(label);
                        continue;
                    }
                    // No unit brings it out of the range of numbers.
                    Ok(v) if v.is_nan() || v.abs() < LARGEST => v,
                    Err(_) if no_value(field) => f64::NAN,
                    Err(_) if Some(i) == time_column => {
                        return Err(bad(
                            line,
                            &header[i],
                            format!("`{field}` is no time; write {TIME_AS}; dates only where `glider import` reads the file"),
                        ));
                    }
                    _ if known_channel[i] => {
                        let why = format!("`{field}` is not a number; leave the field empty where there is no value");
                        return Err(bad(line, &header[i], why));
                    }
                    _ => {
                        texts[i].get_or_insert_with(|| (0, in_one_line(field), line)).0 += 1;
                        f64::NAN
                    }
                };
                columns[i].push(value);
            }
        }
        Ok(Self { file, header, channels, columns, texts, labels, segments, lines })
    }

    fn bad(&self, line: u64, column: &str, why: String) -> ReadError {
        ReadError::Content { path: self.file.to_path_buf(), line, column: column.into(), why }
    }

    /// Name that the file gives to a channel's column.
    fn column_of(&self, channel: Channel) -> String {
        self.channels.get(&channel).map_or_else(String::new, |(i, _)| self.header[*i].to_string())
    }

    /// A channel in SI, where the file has it; once.
    fn take(&mut self, channel: Channel) -> Option<Vec<f64>> {
        let (column, factor) = *self.channels.get(&channel)?;
        let mut values = std::mem::take(&mut self.columns[column]);
        values.iter_mut().for_each(|v| *v *= factor);
        Some(values)
    }

    fn or_nan(&mut self, channel: Channel) -> Vec<f64> {
        self.take(channel).unwrap_or_else(|| vec![f64::NAN; self.lines.len()])
    }

    /// Time of each row, s; Unix time counts from the first row.
    fn time_s(&mut self) -> Result<Vec<f64>, ReadError> {
        let column = self.column_of(Channel::Time);
        let mut time_s = self.or_nan(Channel::Time);
        for (i, t) in time_s.iter().enumerate() {
            if !t.is_finite() {
                return Err(self.bad(self.lines[i], &column, "time is empty; delete the row or give it a time".into()));
            }
            if i > 0 && *t <= time_s[i - 1] {
                let why =
                    format!("time goes from {} to {t} s; it must increase from row to row (sort the rows, remove doubles)", time_s[i - 1]);
                return Err(self.bad(self.lines[i], &column, why));
            }
        }
        if time_s.len() > 2 {
            let mut steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
            steps.sort_by(f64::total_cmp);
            let median = steps[steps.len() / 2];
            if usual_step(median) != Step::Usable {
                let why = format!("the usual step is {median} s; {SAMPLED_EVERY} (milliseconds or days instead of seconds?)");
                return Err(self.bad(0, &column, why));
            }
        }
        // Unix time would make "days since the start" meaningless.
        let start = if time_s[0] > 1e8 { time_s[0] } else { 0.0 };
        time_s.iter_mut().for_each(|t| *t -= start);
        Ok(time_s)
    }

    /// Segment number of each row: as stated, or labels in the order of appearance; all zero without a column of them.
    fn segment(&self) -> Result<Vec<u32>, ReadError> {
        let column = self.column_of(Channel::Segment);
        if column.is_empty() {
            return Ok(vec![0; self.lines.len()]);
        }
        if let Some((_, row)) = self.labels.iter().find(|l| no_value(&l.0)) {
            return Err(self.bad(self.lines[*row], &column, "has no segment here; state one in each row, or remove the column".into()));
        }
        // One word among them makes labels of all: numbers of words would fall together with numbers that are stated.
        if self.labels.iter().any(|l| l.0.parse::<f64>().is_err()) {
            return Ok(self.segments.clone());
        }
        let whole = |s: &str| s.parse::<f64>().ok().filter(|v| v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(v));
        let number = |(s, row): &(String, usize)| {
            let no_number = || self.bad(self.lines[*row], &column, format!("`{s}` is not a segment number (0, 1, 2 …)"));
            whole(s).map(|v| v as u32).ok_or_else(no_number)
        };
        let numbers = self.labels.iter().map(number).collect::<Result<Vec<u32>, _>>()?;
        Ok(self.segments.iter().map(|k| numbers[*k as usize]).collect())
    }

    /// Columns that are no channel and hold numbers, and what of such columns is no number, in words.
    fn extra(&mut self) -> (BTreeMap<String, Vec<f64>>, Vec<String>) {
        let (mut extra, mut unread) = (BTreeMap::new(), Vec::new());
        let known: Vec<usize> = self.channels.values().map(|v| v.0).collect();
        for (i, name) in self.header.iter().enumerate().filter(|(i, h)| !known.contains(i) && !h.is_empty()) {
            let numbers = self.columns[i].iter().filter(|v| v.is_finite()).count();
            if let Some((texts, first, line)) = &self.texts[i] {
                let of = self.lines.len();
                unread.push(in_one_line(&format!(
                    "column {name}: {texts} of {of} fields are no numbers, the first is `{first}` in line {line}"
                )));
                if numbers == 0 {
                    continue;
                }
            }
            extra.insert(name.to_owned(), std::mem::take(&mut self.columns[i]));
        }
        (extra, unread)
    }
}

/// What a file says, in one line of a message: without control characters, which may also steer a terminal.
#[must_use]
pub fn in_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Nothing that a glider measures is larger: such numbers are fills (1e35, NetCDF's 9.96921e36) or damage. Below, no unit brings a
/// number out of range.
const LARGEST: f64 = 1e30;

/// How a time is written, for messages.
pub(crate) const TIME_AS: &str = "time as ISO 8601 (2026-05-02T09:15:31Z) or as seconds";

/// Whether a field says that there is no value: nothing, a word for it, or a number that nothing measures.
#[must_use]
pub fn no_value(field: &str) -> bool {
    const WORDS: [&str; 7] = ["NA", "N/A", "#N/A", "NULL", "None", "-", "--"];
    // Some digits with a sign and a point are a number, and not one of 1e30.
    let plain = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+');
    if field.len() < 30 && field.bytes().any(|b| b.is_ascii_digit()) && field.as_bytes().iter().all(plain) {
        return false;
    }
    let number = || field.parse::<f64>().is_ok_and(|v| v.is_nan() || v.abs() >= LARGEST);
    field.is_empty() || WORDS.iter().any(|w| w.eq_ignore_ascii_case(field)) || number()
}

/// Reads a flight from csv text, with all that a comparison needs; `file` is only for messages.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn parse(text: &str, file: &Path, name: &str) -> Result<Flight, ReadError> {
    read(text, file, name, true)
}

/// Reads what there is of a flight from csv text: time and pressure, and every other column that the file has.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn parse_log(text: &str, file: &Path, name: &str) -> Result<Flight, ReadError> {
    read(text, file, name, false)
}

fn read(text: &str, file: &Path, name: &str, compared: bool) -> Result<Flight, ReadError> {
    let empty = |why: &str| ReadError::Content { path: file.to_path_buf(), line: 0, column: "file".into(), why: why.into() };
    if text.trim().is_empty() {
        return Err(empty("is empty; a flight needs a header line and rows"));
    }
    let mut table = Table::read(text, file, compared)?;
    if table.lines.is_empty() {
        return Err(empty("has a header and no rows"));
    }
    let (extra, unread) = table.extra();
    let mut flight = Flight {
        name: name.to_string(),
        time_s: table.time_s()?,
        segment: table.segment()?,
        pressure_pa: table.or_nan(Channel::Pressure),
        pitch_rad: table.or_nan(Channel::Pitch),
        roll_rad: table.or_nan(Channel::Roll),
        heading_rad: table.or_nan(Channel::Heading),
        ballast_m3: table.or_nan(Channel::Ballast),
        battery_mass_m: table.or_nan(Channel::Battery),
        temperature_degc: table.or_nan(Channel::Temperature),
        density_kg_m3: table.or_nan(Channel::Density),
        gps_east_m: table.or_nan(Channel::GpsEast),
        gps_north_m: table.or_nan(Channel::GpsNorth),
        speed_m_s: table.take(Channel::Speed).filter(|s| s.iter().any(|v| v.is_finite())),
        extra,
        unread,
    };
    let [pressure, pitch, ballast, density] =
        [Channel::Pressure, Channel::Pitch, Channel::Ballast, Channel::Density].map(|c| table.column_of(c));
    plausible(&flight, file, compared, [pressure, pitch, ballast, density])?;
    if compared {
        let situations = situations::leave_out(&mut flight).map_err(|why| empty(&why))?;
        flight.unread.extend(situations);
    }
    Ok(flight)
}

/// Refuses columns that are empty, of those that the comparison needs if the flight is `compared`, or whose bulk cannot be in the unit
/// they claim.
fn plausible(f: &Flight, file: &Path, compared: bool, names: [String; 4]) -> Result<(), ReadError> {
    let bad = |column: String, why: String| ReadError::Content { path: file.to_path_buf(), line: 0, column, why };
    let [pressure, pitch, ballast, density] = names;
    let needed = [(&f.pressure_pa, &pressure), (&f.pitch_rad, &pitch), (&f.ballast_m3, &ballast), (&f.density_kg_m3, &density)];
    for (values, column) in needed.into_iter().take(if compared { 4 } else { 1 }) {
        let filled = values.iter().filter(|v| v.is_finite()).count();
        if filled < 10 {
            let without = cannot_be_asked(column).map_or_else(String::new, |what| format!("; without them {what}"));
            return Err(bad(column.clone(), format!("has only {filled} values; at least 10 are needed{without}")));
        }
    }
    implausible(f, [&pressure, &pitch, &ballast, &density]).map_or(Ok(()), |(column, why)| Err(bad(column, why)))
}

#[cfg(test)]
#[path = "csv_tests.rs"]
mod tests;
