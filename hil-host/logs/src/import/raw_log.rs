//! A raw log: the variables of a file as they stand there, each with its unit, its clock and its flags; and the choice of the one that
//! a channel is read from.

use super::fills::{without_fills, without_impossible};
use super::{MappedName, Report};
use crate::channels::{Channel, Channels, Entry};
use crate::record::resample::{Series, longest_in_order};

/// Practical salinity of one gram of absolute salinity a kilogram, where the sea has its usual salts (TEOS-10).
const PRACTICAL_PER_ABSOLUTE: f64 = 35.0 / 35.165_04;

/// Something to be said of a variable or a clock once it is used.
#[derive(Clone, Debug)]
pub(super) enum Said {
    Note(String),
    Lost(String),
}

/// Times of one clock, Unix s or from anywhere; NaN where there is none.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock {
    pub times: Vec<f64>,
    pub said: Vec<Said>,
}

/// Which rows of a variable a flag calls bad or missing, and how it says so.
#[derive(Clone, Debug)]
pub(super) struct Flag {
    pub name: String,
    pub says: String,
    pub bad: Vec<bool>,
}

/// One variable or column.
#[derive(Clone, Debug)]
pub(super) struct RawSeries {
    pub name: String,
    /// As the file states it; empty where it does not.
    pub unit: String,
    /// Its CF standard name.
    pub standard: String,
    /// The sensor that its attribute `source` names.
    pub source: String,
    /// Whether it is called magnetic.
    pub magnetic: bool,
    /// Its clock; none with what is said of that.
    pub clock: Result<usize, Option<String>>,
    /// Declared fills are NaN; why there are none.
    pub values: Result<Vec<f64>, String>,
    pub flags: Vec<Flag>,
    pub said: Vec<Said>,
}

impl Flag {
    /// Values that it calls bad become none.
    pub fn leave_out(&self, name: &str, values: &mut [f64], report: &mut Report) {
        let mut left_out = 0;
        for (value, _) in values.iter_mut().zip(&self.bad).filter(|(v, bad)| v.is_finite() && **bad) {
            *value = f64::NAN;
            left_out += 1;
        }
        if left_out > 0 {
            let Self { name: flag, says, .. } = self;
            report.note(format!("{left_out} of {} values of {name} left out: {flag} says {says}", values.len()));
        }
    }
}

impl RawSeries {
    /// A column of numbers on the first clock.
    pub fn column(name: &str, unit: &str, values: Vec<f64>) -> Self {
        let (name, unit) = (name.to_owned(), unit.to_owned());
        let none = String::new;
        Self {
            name,
            unit,
            standard: none(),
            source: none(),
            magnetic: false,
            clock: Ok(0),
            values: Ok(values),
            flags: Vec::new(),
            said: Vec::new(),
        }
    }
}

/// What a file holds.
#[derive(Debug, Default)]
pub(super) struct RawLog {
    pub clocks: Vec<Clock>,
    pub series: Vec<RawSeries>,
    /// The flight format: each row of the first clock is a row of the flight, and values stand at their own rows alone.
    pub exact: bool,
    /// The same, and its density is not computed anew from a salinity.
    pub as_it_is: bool,
    /// Rows of one time are a loss.
    pub repeats_are_lost: bool,
    /// Number of the segment of each row of the first clock, where the file labels its rows.
    pub segments: Option<Vec<u32>>,
    /// Magnetic variation that the file states, deg.
    pub variation: Option<f64>,
    /// All that the file has a name for, to say what of it is known and not used.
    pub names: Vec<String>,
    /// Unix time of the instant from which a flight's times count; none: its first row.
    pub zero_s: Option<f64>,
    /// What else is to be said where there is no pressure.
    pub without_pressure: Option<String>,
    /// Which of the series were read.
    pub used: std::collections::BTreeSet<usize>,
    /// Whether a column that is read stays: it may be another channel, or a further column.
    pub keeps: bool,
    pub report: Report,
    /// The table of channels, with the lab's own names.
    pub table: Option<Box<Channels>>,
}

/// A channel found, in SI.
pub(super) struct Picked {
    pub name: String,
    /// Its values on its clock.
    pub values: Vec<f64>,
    pub clock: usize,
    pub series: Series,
    /// Share of the clock's run in which it has values.
    pub coverage: f64,
    pub unit: String,
    pub factor: f64,
    pub magnetic: bool,
    /// Whether the file states no unit.
    pub by_name: bool,
}

impl Picked {
    /// Whether it measured nothing: it is zero throughout.
    pub fn is_zero(&self) -> bool {
        self.series.pairs().all(|(_, v)| v == 0.0)
    }

    /// The same with other values.
    pub fn map(&mut self, f: impl Fn(f64) -> f64) {
        let (time, value): (Vec<f64>, Vec<f64>) = self.series.pairs().map(|(t, v)| (t, f(v))).unzip();
        self.series = Series::new(&time, &value);
        self.values.iter_mut().for_each(|v| *v = f(*v));
    }

    /// Why another is taken.
    fn passed_over(&self) -> String {
        if self.is_zero() { "is 0 throughout".into() } else { format!("has {} values", self.series.len()) }
    }

    /// Says that this one is taken in the place of another.
    pub fn instead_of(&self, other: &Self, report: &mut Report) {
        report.note(format!("{} {}: {} is taken, which has {}", other.name, other.passed_over(), self.name, self.series.len()));
    }
}

/// Why a variable is not a channel: with a text where its values would be lost by it.
struct Unread(Option<String>);

impl RawLog {
    /// Both, each on its own clocks; no series has a name of the other's.
    pub fn joined_with(mut self, other: Self) -> Self {
        let before = self.clocks.len();
        self.clocks.extend(other.clocks);
        self.series.extend(other.series.into_iter().map(|s| RawSeries { clock: s.clock.map(|k| k + before), ..s }));
        for (all, more) in [(&mut self.report.notes, other.report.notes), (&mut self.report.left_out, other.report.left_out)] {
            more.into_iter().for_each(|what| {
                if !all.contains(&what) {
                    all.push(what)
                }
            });
        }
        other.report.mapped.into_iter().for_each(|m| self.report.map(m));
        Self { segments: None, ..self }
    }

    /// What is known of a channel.
    pub fn entry(&self, channel: Channel) -> Entry {
        self.table.as_deref().unwrap_or(Channels::usual()).of(channel).clone()
    }

    /// Variables that may be a channel: by name whatever its case, then by what the file says it is.
    fn called(&self, entry: &Entry, channel: Channel) -> Vec<usize> {
        let mut found: Vec<usize> = Vec::new();
        let all = || self.series.iter().enumerate();
        for name in entry.all_names() {
            // The exact spelling first.
            let spelt =
                |exact: bool| all().filter(move |(_, s)| (s.name == name) == exact && s.name.eq_ignore_ascii_case(name)).map(|(k, _)| k);
            for k in spelt(true).chain(spelt(false)) {
                if !found.contains(&k) {
                    found.push(k);
                }
            }
        }
        // A ballast of any name names the sensor it is from.
        let sensor = |s: &RawSeries| channel == Channel::Ballast && entry.names.iter().any(|n| n.eq_ignore_ascii_case(&s.source));
        let further = all().filter(|(k, s)| (entry.standard.contains(&s.standard) || sensor(s)) && !found.contains(k)).map(|(k, _)| k);
        let further: Vec<usize> = further.collect();
        found.extend(further);
        found
    }

    /// The first of the wanted names that is there with a clock and a unit, in SI; one that has values in a small part of the run only,
    /// or is zero throughout, gives way to a fuller one.
    pub fn pick(&mut self, channel: Channel) -> Option<Picked> {
        let entry = self.entry(channel);
        let (mut found, mut unread) = (Vec::new(), Vec::new());
        let called = self.called(&entry, channel);
        let keeps = self.keeps;
        self.keeps |= called.len() > 1;
        for k in called {
            match self.one(k, channel, &entry) {
                Ok(picked) => {
                    let full = picked.coverage >= 0.5 && !picked.is_zero();
                    found.push((k, picked));
                    if full {
                        break;
                    }
                }
                Err(Unread(why)) => unread.extend(why),
            }
        }
        self.keeps = keeps;
        let most = found.iter().filter(|(_, c)| !c.is_zero()).map(|(_, c)| c.coverage).fold(0.0, f64::max);
        let best = found.iter().position(|(_, c)| !c.is_zero() && 2.0 * c.coverage >= most).unwrap_or(0);
        for why in unread {
            if found.is_empty() { self.report.leave_out(why) } else { self.report.note(why) }
        }
        for (k, passed) in found.iter().take(best) {
            found[best].1.instead_of(passed, &mut self.report);
            self.used.insert(*k);
        }
        let (k, picked) = (best < found.len()).then(|| found.swap_remove(best))?;
        self.used.insert(k);
        let (unit, factor) = (picked.unit.clone(), picked.factor);
        self.report.map(MappedName { from: picked.name.clone(), unit, to: entry.column, factor });
        Some(picked)
    }

    /// A channel that is only asked for a check or in the place of another: what cannot be read of it is no loss.
    pub fn aside(&mut self, channel: Channel) -> Option<Picked> {
        let (mapped, lost, used) = (self.report.mapped.len(), self.report.left_out.len(), self.used.clone());
        let outer = std::mem::replace(&mut self.keeps, true);
        let picked = self.pick(channel);
        self.keeps = outer;
        self.report.mapped.truncate(mapped);
        self.used = used;
        for why in self.report.left_out.split_off(lost) {
            self.report.note(why);
        }
        picked
    }

    fn say(&mut self, said: Vec<Said>) {
        for what in said {
            match what {
                Said::Note(what) => self.report.note(what),
                Said::Lost(what) => self.report.leave_out(what),
            }
        }
    }

    fn one(&mut self, k: usize, channel: Channel, entry: &Entry) -> Result<Picked, Unread> {
        let (name, unit) = (self.series[k].name.clone(), self.series[k].unit.clone());
        let (offset, factor) = self.in_si(k, channel, entry)?;
        let clock = match &self.series[k].clock {
            Ok(clock) => *clock,
            Err(why) => {
                let why = why.clone();
                why.into_iter().for_each(|what| self.report.note(what));
                return Err(Unread(None));
            }
        };
        let said = std::mem::take(&mut self.clocks[clock].said);
        self.say(said);
        // A column of the flight format that becomes a channel is needed no more.
        let mut values = match &mut self.series[k].values {
            Ok(values) if self.exact && !self.keeps => std::mem::take(values),
            Ok(values) => values.clone(),
            Err(why) => {
                let what = format!("{name} cannot be read ({why})");
                self.report.leave_out(what);
                return Err(Unread(None));
            }
        };
        let said = std::mem::take(&mut self.series[k].said);
        self.say(said);
        // A fix at the origin, a first segment, are values.
        if ![Channel::Segment, Channel::GpsEast, Channel::GpsNorth].contains(&channel) {
            let possible = entry.possible();
            let possible = possible.start() / factor + offset..=possible.end() / factor + offset;
            without_fills(&name, &mut values, &possible, &mut self.report);
        }
        values.iter_mut().for_each(|v| *v = (*v - offset) * factor);
        self.series[k].flags.iter().for_each(|flag| flag.leave_out(&name, &mut values, &mut self.report));
        if !self.exact {
            without_impossible(&name, &entry.possible(), &mut values, &mut self.report);
        }
        let times = &self.clocks[clock].times;
        let series = Series::new(times, &values);
        if channel == Channel::Pressure || channel == Channel::Depth {
            let (report, exact, repeats_are_lost) = (&mut self.report, self.exact, self.repeats_are_lost);
            report_untimed(&name, times, &values, if repeats_are_lost { series.len() } else { usize::MAX }, exact, report);
        }
        if series.is_empty() && self.exact {
            // A column of the flight format without values is no other.
            self.used.insert(k);
            return Err(Unread(None));
        }
        if series.is_empty() {
            self.report.note(format!("{name} has no value: left out"));
            return Err(Unread(None));
        }
        let coverage = coverage(times, &values);
        let (magnetic, by_name) = (self.series[k].magnetic, unit.is_empty());
        Ok(Picked { name, values, clock, series, coverage, unit, factor, magnetic, by_name })
    }

    /// What is taken off the numbers of a variable, and by what they are multiplied then, to be in SI.
    fn in_si(&mut self, k: usize, channel: Channel, entry: &Entry) -> Result<(f64, f64), Unread> {
        let RawSeries { name, unit, standard, .. } = &self.series[k];
        if channel == Channel::Density && (standard.contains("potential_density") || standard.contains("sigma")) {
            let what = format!("{name} is {standard} by its standard_name, not the density where it was measured: left out");
            return Err(Unread(Some(what)));
        }
        if channel == Channel::Segment {
            return Ok((0.0, 1.0));
        }
        let stated = if unit.is_empty() { entry.by_name(name) } else { None };
        let (offset, factor) = match (entry.in_si(unit), stated) {
            (Some(known), _) => known,
            (None, Some(known)) => {
                if !self.exact {
                    self.report.note(format!("{name} states no unit: factor {} to SI by its name", known.1));
                }
                known
            }
            // In the flight format a column without a unit that is known is one of its own.
            _ if self.exact => return Err(Unread(None)),
            _ => return Err(Unread(Some(format!("{name} is in \"{unit}\", which is not known for it: left out")))),
        };
        if channel == Channel::Salinity && standard == "sea_water_absolute_salinity" {
            self.report.note(format!("{name} is absolute salinity by its standard_name: turned into the practical one"));
            return Ok((offset, factor * PRACTICAL_PER_ABSOLUTE));
        }
        Ok((offset, factor))
    }
}

/// Says which values of a pressure have no time, which rows no pressure, and which are of one time, where `distinct` are.
fn report_untimed(name: &str, times: &[f64], values: &[f64], distinct: usize, exact: bool, report: &mut Report) {
    let count = |f: &dyn Fn(f64, f64) -> bool| times.iter().zip(values).filter(|(t, v)| f(**t, **v)).count();
    let lost = count(&|t, v| t.is_nan() && v.is_finite());
    // Those of a clock that was not set are counted where it is read.
    if lost > 0 && !report.clock_not_set {
        report.leave_out(format!("{lost} of {} values of {name} have no time", values.len()));
    }
    let without = count(&|t, v| t.is_finite() && v.is_nan());
    if without > 0 && !exact && !std::mem::replace(&mut report.rows_lost, true) {
        report.note(format!("{without} of {} rows have no {name}: no rows of the flight", values.len()));
    }
    let known = count(&|t, v| t.is_finite() && v.is_finite());
    if known > distinct {
        report.leave_out(format!("{} of {known} rows repeat a time: the first of each stays", known - distinct));
    }
}

/// Share of a clock's run in which a variable has values: of as many as 50 equal parts of the run that have times.
fn coverage(time: &[f64], values: &[f64]) -> f64 {
    let (first, last) = time.iter().filter(|t| t.is_finite()).fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(*t), b.max(*t)));
    let (mut timed, mut filled) = ([false; 50], [false; 50]);
    for (t, v) in time.iter().zip(values).filter(|(t, _)| t.is_finite()) {
        let part = if last > first { ((t - first) / (last - first) * 50.0).min(49.0) as usize } else { 0 };
        timed[part] = true;
        filled[part] |= v.is_finite();
    }
    let count = |parts: [bool; 50]| parts.iter().filter(|p| **p).count() as f64;
    count(filled) / count(timed).max(1.0)
}

/// Single samples out of order happen where a clock is set; more is a damaged file. Share of the samples, guess.
const BACKWARDS: f64 = 0.01;

/// The samples of a pressure in the order of its clock, without those whose time goes back.
///
/// # Errors
/// Too many do.
pub(super) fn in_order(name: &str, times: &[f64], values: &[f64], report: &mut Report) -> Result<Option<Series>, String> {
    let finite: Vec<(usize, f64, f64)> =
        times.iter().zip(values).enumerate().filter(|(_, (t, v))| t.is_finite() && v.is_finite()).map(|(i, (t, v))| (i, *t, *v)).collect();
    let Some(first) = finite.windows(2).find(|w| w[1].1 < w[0].1) else { return Ok(None) };
    let kept = longest_in_order(&finite.iter().map(|f| f.1).collect::<Vec<_>>());
    let (out, of) = (finite.len() - kept.len(), finite.len());
    let first = format!("from {:.3} to {:.3} s at sample {}", first[0].1, first[1].1, first[1].0 + 1);
    let said = format!("{name}: time goes backwards, {out} of {of} samples are out of order, first {first}");
    if out as f64 > BACKWARDS * of as f64 {
        return Err(format!("{said}; sort the samples by time, or cut the file where its clock was set"));
    }
    report.leave_out(said);
    let (time, value): (Vec<f64>, Vec<f64>) = kept.into_iter().map(|k| (finite[k].1, finite[k].2)).unzip();
    Ok(Some(Series::new(&time, &value)))
}
