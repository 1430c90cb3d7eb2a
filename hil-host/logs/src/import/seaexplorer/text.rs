//! Rows of a SeaExplorer's text files, plain or gzipped: one header line, fields between semicolons.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::import::clocks::SET_CLOCK_S;
use crate::import::report::shown;

/// A gzipped text is at most so many times its file, and this much more; beyond it is no log.
const GUNZIPPED: u64 = 100;
const SMALLEST: u64 = 1 << 20;

/// A text file of one header line, fields between semicolons.
pub(super) struct Table {
    lines: Box<dyn BufRead>,
    header: Vec<String>,
    columns: usize,
    pub rows: usize,
    pub undated: usize,
    /// Rows of another number of values than the header has.
    pub other_length: usize,
    /// What stands where a time should, first.
    pub no_time: Option<String>,
    pub dates: Dates,
    /// Whether a row has commas: decimal ones, as fields stand between semicolons.
    pub commas: bool,
    pub problem: Option<String>,
}

/// Which way round dates are written. A glider writes the day first; what was saved again by a program may have the month first.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Dates {
    pub month_first: bool,
    /// Dates that can only have the day first.
    pub of_days: usize,
    /// And that can only have the month first.
    pub of_months: usize,
}

/// Fields of one line.
pub(super) struct Fields<'a>(Vec<&'a str>);

impl Table {
    pub fn open(path: &Path, month_first: bool) -> Result<Self, String> {
        let file = std::fs::File::open(path).map_err(|e| format!("cannot be read: {e}"))?;
        let length = file.metadata().map_err(|e| e.to_string())?.len();
        let packed = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        let bytes: Box<dyn Read> = if packed {
            Box::new(flate2::read::MultiGzDecoder::new(file).take(length.saturating_mul(GUNZIPPED).saturating_add(SMALLEST)))
        } else {
            Box::new(file)
        };
        let mut table = Self {
            lines: Box::new(BufReader::new(bytes)),
            header: Vec::new(),
            columns: 0,
            rows: 0,
            undated: 0,
            other_length: 0,
            no_time: None,
            dates: Dates { month_first, ..Dates::default() },
            commas: false,
            problem: None,
        };
        let mut line = String::new();
        table.line(&mut line);
        if let Some(why) = table.problem.take() {
            return Err(why);
        }
        table.header = line.trim_start_matches('\u{feff}').trim_end().split(';').map(|f| f.trim().to_owned()).collect();
        table.columns = columns(&line);
        if table.header.len() < 3 {
            return Err("has no header line of columns between semicolons".into());
        }
        Ok(table)
    }

    /// One line without its end; longer than any row is damage.
    fn line(&mut self, into: &mut String) -> bool {
        const LONGEST: u64 = 1 << 16;
        let mut bytes = Vec::new();
        match (&mut self.lines).take(LONGEST).read_until(b'\n', &mut bytes) {
            Ok(0) => return false,
            Ok(n) if n as u64 == LONGEST => {
                self.problem = Some(format!("a line after row {} is longer than {LONGEST} bytes: the rest is left out", self.rows));
                return false;
            }
            Ok(_) => {}
            Err(e) => {
                self.problem = Some(format!("is damaged after row {} ({e}): the rest is left out", self.rows));
                return false;
            }
        }
        into.clear();
        into.push_str(&String::from_utf8_lossy(&bytes));
        true
    }

    pub fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|h| h.eq_ignore_ascii_case(name))
    }

    /// Names of the columns.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.header.iter().map(String::as_str)
    }

    /// How many rows it has.
    pub fn count(mut self) -> usize {
        let mut line = String::new();
        while self.next(&mut line).is_some() {}
        self.rows
    }

    /// A name that two columns have.
    pub fn twice(&self) -> Option<&str> {
        let named = |(k, name): &(usize, &String)| !name.is_empty() && self.column(name) != Some(*k);
        self.header.iter().enumerate().find(named).map(|(_, name)| name.as_str())
    }

    /// The next row that is not empty.
    pub fn next<'a>(&mut self, line: &'a mut String) -> Option<Fields<'a>> {
        loop {
            if !self.line(line) {
                return None;
            }
            if line.trim().is_empty() {
                continue;
            }
            if line.split(';').next().is_some_and(|f| Some(f.trim()) == self.header.first().map(String::as_str)) {
                if line.trim_end().split(';').map(str::trim).eq(self.header.iter().map(String::as_str)) {
                    continue;
                }
                self.problem = Some(format!("has another header after row {}: the rest is left out", self.rows));
                return None;
            }
            if columns(line) == self.columns {
                break;
            }
            // Cut, or run together with the next: its values stand under other columns.
            self.other_length += 1;
        }
        self.rows += 1;
        self.commas |= line.contains(',');
        let fields: Vec<&str> = line.split(';').map(str::trim).collect();
        Some(Fields(fields))
    }
}

impl Table {
    /// Unix time of dd/mm/yyyy HH:MM:SS.mmm, of a clock that was set; a row without one is counted.
    pub fn time(&mut self, fields: &Fields, place: usize) -> Option<f64> {
        let field = fields.0.get(place).copied().unwrap_or_default();
        let time = self.dates.read(field).filter(|unix| *unix > SET_CLOCK_S && unix.is_finite());
        if time.is_none() {
            self.undated += 1;
            self.no_time.get_or_insert_with(|| shown(field));
        }
        time
    }
}

impl Dates {
    fn read(&mut self, field: &str) -> Option<f64> {
        let (date, clock) = field.split_once(' ')?;
        let mut date = date.split('/').map(str::parse::<i64>);
        let (first, second, year) = (date.next()?.ok()?, date.next()?.ok()?, date.next()?.ok()?);
        self.of_days += usize::from(first > 12 && second <= 12);
        self.of_months += usize::from(second > 12 && first <= 12);
        let (day, month) = if self.month_first { (second, first) } else { (first, second) };
        let mut clock = clock.trim().split(':').map(number);
        let (hour, minute, second) = (clock.next()??, clock.next()??, clock.next()??);
        let days = crate::import::calendar::days_from_1970(year, month, day)?;
        Some(days as f64 * 86400.0 + hour * 3600.0 + minute * 60.0 + second)
    }

    /// Counts those of another file.
    pub fn join(&mut self, other: Self) {
        self.of_days += other.of_days;
        self.of_months += other.of_months;
    }

    /// Whether they were read the wrong way round.
    pub fn turned(self) -> bool {
        !self.month_first && self.of_months > 0 && self.of_days == 0
    }
}

/// Fields of a line; what stands behind the last semicolon may be nothing.
fn columns(line: &str) -> usize {
    let line = line.trim_end();
    line.strip_suffix(';').unwrap_or(line).split(';').count()
}

/// A number with a decimal point or comma.
fn number(text: &str) -> Option<f64> {
    let plain = || text.parse::<f64>().ok();
    plain().or_else(|| text.replacen(',', ".", 1).parse().ok()).filter(|v| v.is_finite())
}

impl Fields<'_> {
    /// Number in a field; NaN for none and for the fill 9999.
    pub fn number(&self, place: usize) -> f64 {
        self.0.get(place).and_then(|f| number(f)).filter(|v| v.abs() != 9999.0).unwrap_or(f64::NAN)
    }
}
