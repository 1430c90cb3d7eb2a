//! What stands in a table for no value, what its flags say is bad, and whose rows they are.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::RangeInclusive;

use super::super::Report;
use super::super::netcdf::fills::undeclared_fill;
use super::super::netcdf::flags::{BAD, flagged_by, means_bad};
use super::super::netcdf::names::{DENSITY, PITCH, SALINITY, TEMPERATURE};
use super::super::report::shown;
use super::tidy::by_channel;
use super::{CONDUCTIVITIES, SALINITIES, Table, is_number};
use crate::record::csv::{Channel, no_value};

/// Columns that name the vehicle of a row, with or without `_id`; case does not matter.
const VEHICLES: [&str; 7] = ["trajectory", "platform", "platform_code", "wmo_id", "glider", "vehicle", "deployment"];
/// A column has no more fills than this.
const MOST_FILLS: usize = 8;

/// A value that comes three times and more and that its channel cannot have, of a channel whose other values it can have mostly (of
/// another unit all are impossible); and it is no more than half of them, but for numbers of nines. With its count.
fn impossible_fill(values: &[f64], possible: RangeInclusive<f64>) -> Option<(f64, usize)> {
    let (inside, mut outside): (Vec<f64>, Vec<f64>) = values.iter().filter(|v| v.is_finite()).partition(|v| possible.contains(v));
    outside.sort_by(f64::total_cmp);
    let (fill, count) = outside.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).max_by_key(|run| run.1)?;
    let digits = fill.abs().to_string();
    let nines = digits.matches('9').count() >= 2 && digits.chars().all(|c| matches!(c, '9' | '.'));
    let others = outside.len() - count;
    (count >= 3 && others < inside.len() && (nines || count <= inside.len())).then_some((fill, count))
}

/// Makes NaN of the values of `name` that stand for none, though nothing says so.
pub(super) fn without_fills(name: &str, values: &mut [f64], possible: Option<&RangeInclusive<f64>>, report: &mut Report) {
    for _ in 0..MOST_FILLS {
        let impossible = || possible.and_then(|p| impossible_fill(values, p.clone()));
        let Some((fill, count)) = undeclared_fill(values).or_else(impossible) else { break };
        report.note(format!("{count} of {} values of {name} are {fill}: a fill, left out", values.len()));
        values.iter_mut().filter(|v| **v == fill).for_each(|v| *v = f64::NAN);
    }
}

/// What a channel of the flight format can have, in SI.
fn possible(channel: Channel) -> Option<RangeInclusive<f64>> {
    match channel {
        Channel::Temperature => Some(TEMPERATURE.possible()),
        Channel::Density => Some(DENSITY.possible()),
        Channel::Pitch => Some(PITCH.possible()),
        _ => None,
    }
}

impl<'a> Table<'a> {
    /// Refuses rows of more than one vehicle.
    ///
    /// # Errors
    /// Their names.
    pub(super) fn one_vehicle(&self) -> Result<(), String> {
        for (column, name) in self.names.iter().enumerate().filter(|(_, name)| is_vehicle(name)) {
            let named: BTreeSet<&str> = self.rows.iter().filter_map(|r| r.get(column).copied()).filter(|f| !no_value(f)).collect();
            if named.len() > 1 {
                let list: Vec<&str> = named.iter().take(6).copied().collect();
                let more = if named.len() > list.len() { ", …" } else { "" };
                return Err(format!(
                    "rows of {} vehicles by the column {name} ({}{more}): import one glider's rows at a time",
                    named.len(),
                    list.join(", ")
                ));
            }
        }
        Ok(())
    }

    /// Empties the fields that say in words or by their size that there is no value.
    pub(super) fn empty_no_values(&mut self, report: &mut Report) {
        let (mut count, mut words) = (0, BTreeSet::new());
        for column in 0..self.names.len() {
            let fields = || self.rows.iter().filter_map(|r| r.get(column)).filter(|f| !no_value(f));
            let numbers = fields().filter(|f| is_number(f)).count();
            let segment = self.names[column].eq_ignore_ascii_case("segment");
            if segment || 2 * numbers < fields().count() {
                continue;
            }
            for field in self.rows.iter_mut().filter_map(|r| r.get_mut(column)).filter(|f| !f.is_empty() && no_value(f)) {
                if !field.eq_ignore_ascii_case("nan") {
                    count += 1;
                    words.insert(*field);
                }
                *field = "";
            }
        }
        if count > 0 {
            let list: Vec<&str> = words.iter().take(4).copied().collect();
            let more = if words.len() > list.len() { ", …" } else { "" };
            report.note(format!("{count} fields hold {}{more}: no value", list.join(", ")));
        }
    }

    /// Of each column the one whose flags it holds.
    pub(super) fn flagged(&self) -> Vec<Option<usize>> {
        let mut places: HashMap<String, usize> = HashMap::with_capacity(self.names.len());
        for (k, name) in self.names.iter().enumerate() {
            places.entry(name.to_ascii_lowercase()).or_insert(k);
        }
        self.names.iter().map(|name| flagged_by(name).iter().filter_map(|n| places.get(n).copied()).min()).collect()
    }

    /// Empties the fields whose flag is "bad" or "missing", as a number or in words.
    pub(super) fn leave_out_bad(&mut self, report: &mut Report) {
        let pairs: Vec<(usize, usize)> = self.flagged().into_iter().enumerate().filter_map(|(flags, of)| Some((of?, flags))).collect();
        for (column, flags) in pairs {
            let (mut left_out, mut words) = (0, BTreeSet::new());
            for row in &mut self.rows {
                let flag = row.get(flags).copied().unwrap_or_default();
                let number = flag.parse::<f64>().ok();
                let bad = number.map_or_else(|| means_bad(flag), |f| BAD.contains(&f));
                if let Some(field) = row.get_mut(column).filter(|f| bad && !f.is_empty()) {
                    *field = "";
                    left_out += 1;
                    words.extend(number.is_none().then_some(flag));
                }
            }
            if left_out > 0 {
                let (name, flag) = (&self.names[column], &self.names[flags]);
                let list: Vec<String> = words.iter().take(4).map(|w| format!("\"{}\"", shown(w))).collect();
                let says = if list.is_empty() { "bad (4) or missing (9)".into() } else { list.join(", ") };
                report.note(format!("{left_out} of {} values of {name} left out: {flag} says {says}", self.rows.len()));
            }
        }
    }

    /// Empties the fields of the flight format's channels that stand for no value, though nothing says so.
    pub(super) fn empty_fills(&mut self, report: &mut Report) {
        let mut columns: BTreeMap<usize, Option<RangeInclusive<f64>>> = BTreeMap::new();
        for (channel, found) in by_channel(&self.names) {
            // A fix at the origin, a first segment, are values.
            if matches!(channel, Channel::Time | Channel::Segment | Channel::GpsEast | Channel::GpsNorth) {
                continue;
            }
            for (column, factor) in found {
                columns.insert(column, possible(channel).map(|p| p.start() / factor..=p.end() / factor));
            }
        }
        let named = |names: &[(&str, f64)], name: &str| names.iter().any(|n| n.0.eq_ignore_ascii_case(name));
        for (column, name) in self.names.iter().enumerate() {
            if named(&SALINITIES, name) {
                columns.insert(column, Some(SALINITY.possible()));
            } else if named(&CONDUCTIVITIES, name) {
                columns.insert(column, None);
            }
        }
        for (column, possible) in columns {
            let mut values = self.numbers(column);
            without_fills(&self.names[column], &mut values, possible.as_ref(), report);
            for (row, value) in self.rows.iter_mut().zip(values) {
                if let Some(field) = row.get_mut(column).filter(|f| value.is_nan() && is_number(f)) {
                    *field = "";
                }
            }
        }
    }

    /// Columns of the flight format that a better filled one of another name stands in for.
    pub(super) fn passed_over(&self, report: &mut Report) -> Vec<usize> {
        let mut out = Vec::new();
        for (channel, columns) in by_channel(&self.names) {
            if matches!(channel, Channel::Time | Channel::Segment) {
                continue;
            }
            let filled: Vec<Filled> = columns.iter().map(|c| Filled::of(&self.names[c.0], &self.numbers(c.0))).collect();
            let best = Filled::best(&filled);
            for before in 0..best {
                filled[best].note_instead_of(&filled[before], report);
                out.push(columns[before].0);
            }
        }
        out
    }

    /// Names the columns that are not read: text, or numbers that no channel takes.
    pub(super) fn note_unread(&self, read: impl Fn(usize) -> bool, report: &mut Report) {
        let flagged = self.flagged();
        let unread = |k: &usize| !read(*k) && !self.names[*k].is_empty() && !is_vehicle(&self.names[*k]) && flagged[*k].is_none();
        let names: Vec<&str> = (0..self.names.len()).filter(unread).map(|k| self.names[k].as_str()).collect();
        if !names.is_empty() {
            report.note(format!("not read: {}", names.join(", ")));
        }
    }
}

fn is_vehicle(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    VEHICLES.contains(&name.as_str()) || name.strip_suffix("_id").is_some_and(|base| VEHICLES.contains(&base))
}

/// How much a column of a channel holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Filled {
    name: String,
    values: usize,
    zero: bool,
}

impl Filled {
    pub fn of(name: &str, values: &[f64]) -> Self {
        let finite = || values.iter().filter(|v| v.is_finite());
        Self { name: name.to_owned(), values: finite().count(), zero: finite().all(|v| *v == 0.0) }
    }

    /// How many values it has.
    pub fn values(&self) -> usize {
        self.values
    }

    /// The first, by its place, with half as many values as the fullest and not zero throughout; the first where there is none.
    pub fn best(all: &[Self]) -> usize {
        let most = all.iter().filter(|f| !f.zero).map(|f| f.values).max().unwrap_or(0);
        all.iter().position(|f| !f.zero && 2 * f.values >= most).unwrap_or(0)
    }

    /// Says why `other`, of a better name, was passed over.
    pub fn note_instead_of(&self, other: &Self, report: &mut Report) {
        let why = if other.values == 0 {
            return;
        } else if other.zero {
            "it is 0 throughout".to_owned()
        } else {
            format!("it has {} values, the other {}", other.values, self.values)
        };
        report.note(format!("{} passed over for {}: {why}", other.name, self.name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_repeated_values_that_a_channel_cannot_have_are_fills() {
        let wave: Vec<f64> = (0..300).map(|i| 10.0 + 5.0 * (0.1 * f64::from(i)).sin()).collect();
        assert_eq!(impossible_fill(&wave, TEMPERATURE.possible()), None);
        for fill in [-99.0, 99.0, -99.9, -10.0] {
            let mut with = wave.clone();
            (60..75).for_each(|k| with[k] = fill);
            assert_eq!(impossible_fill(&with, TEMPERATURE.possible()), Some((fill, 15)), "{fill}");
        }
        let mut mostly = vec![-99.0; 200];
        mostly.extend(&wave[..50]);
        assert_eq!(impossible_fill(&mostly, TEMPERATURE.possible()), Some((-99.0, 200)));
        // Two values are spikes; kelvin, and degrees named radians, are another unit.
        let mut spikes = wave.clone();
        spikes[..2].fill(99.0);
        assert_eq!(impossible_fill(&spikes, TEMPERATURE.possible()), None);
        let kelvin: Vec<f64> = wave.iter().map(|t| (t + 273.15).round()).collect();
        assert_eq!(impossible_fill(&kelvin, TEMPERATURE.possible()), None);
        let degrees: Vec<f64> = (0..300)
            .map(|i| {
                if i % 10 < 4 {
                    26.0
                } else if i % 10 < 8 {
                    -26.0
                } else {
                    0.0
                }
            })
            .collect();
        assert_eq!(impossible_fill(&degrees, PITCH.possible()), None);
        assert_eq!(impossible_fill(&[f64::NAN], TEMPERATURE.possible()), None);
    }

    #[test]
    fn regress_a_full_column_is_taken_before_a_sparse_or_zero_one() {
        let of = |name: &str, values: &[f64]| Filled::of(name, values);
        let (zero, few, full) = (of("a", &[0.0; 9]), of("b", &[1.0, 2.0]), of("c", &[1.0; 5]));
        assert_eq!(Filled::best(&[zero.clone(), few.clone(), full.clone()]), 2);
        assert_eq!(Filled::best(&[of("d", &[1.0; 3]), full.clone()]), 0);
        assert_eq!((Filled::best(&[zero.clone(), zero.clone()]), Filled::best(&[])), (0, 0));
        let mut report = Report::new("csv");
        full.note_instead_of(&zero, &mut report);
        full.note_instead_of(&few, &mut report);
        assert_eq!(report.notes, ["a passed over for c: it is 0 throughout", "b passed over for c: it has 2 values, the other 5"]);
    }
}
