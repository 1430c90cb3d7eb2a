//! What stands in a table for no value, what its flags say is bad, and whose rows they are.

use std::collections::{BTreeSet, HashMap};

use super::super::Report;
use super::super::netcdf::flags::{BAD, flagged_by, means_bad};
use super::super::report::shown;
use super::Table;
use crate::record::csv::no_value;

/// Columns that name the vehicle of a row, with or without `_id`; case does not matter.
const VEHICLES: [&str; 7] = ["trajectory", "platform", "platform_code", "wmo_id", "glider", "vehicle", "deployment"];

impl Table<'_> {
    /// Refuses rows of more than one vehicle.
    ///
    /// # Errors
    /// Their names.
    pub(super) fn one_vehicle(&self) -> Result<(), String> {
        for (column, name) in self.columns.iter().zip(&self.names).filter(|(_, name)| is_vehicle(name)) {
            let named: BTreeSet<&str> = column.fields().iter().copied().filter(|f| !no_value(f)).collect();
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
        for (column, name) in self.columns.iter_mut().zip(&self.names) {
            let (numbers, texts) = (column.count(), column.texts());
            let written = texts.iter().filter(|t| !no_value(t.1)).count();
            if name.eq_ignore_ascii_case("segment") || numbers < written {
                continue;
            }
            for (row, field) in texts.into_iter().filter(|t| no_value(t.1)) {
                if !field.eq_ignore_ascii_case("nan") {
                    count += 1;
                    words.insert(field);
                }
                column.clear(row as usize);
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
            for row in 0..self.rows {
                let (number, word) = (self.columns[flags].number(row), self.columns[flags].text(row));
                let bad = if number.is_nan() { word.parse::<f64>().is_err() && means_bad(word) } else { BAD.contains(&number) };
                if bad && !self.columns[column].is_empty(row) {
                    self.columns[column].clear(row);
                    left_out += 1;
                    words.extend(number.is_nan().then_some(word));
                }
            }
            if left_out > 0 {
                let (name, flag) = (&self.names[column], &self.names[flags]);
                let list: Vec<String> = words.iter().take(4).map(|w| format!("\"{}\"", shown(w))).collect();
                let says = if list.is_empty() { "bad (4) or missing (9)".into() } else { list.join(", ") };
                report.note(format!("{left_out} of {} values of {name} left out: {flag} says {says}", self.rows));
            }
        }
    }
}

pub(super) fn is_vehicle(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    VEHICLES.contains(&name.as_str()) || name.strip_suffix("_id").is_some_and(|base| VEHICLES.contains(&base))
}
