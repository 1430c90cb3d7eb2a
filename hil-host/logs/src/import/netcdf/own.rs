//! Files of our own export: each variable of a flight names its column, so nothing of it is guessed, and the vehicle stands in the file.

use super::variables::Reader;
use super::water::at_rows;
use crate::record::csv::{NAMES, in_one_line};
use crate::record::flight::Flight;

/// Attribute of a variable that names its column in the flight format.
pub const COLUMN: &str = "flight_column";
/// Attribute of the variable [`MODEL`] that holds the vehicle file, as JSON.
pub const VEHICLE: &str = "vehicle";
/// Attribute of the time that states the first row's since the start of the flight, s, where it is not 0.
pub const FIRST: &str = "time_s_of_first_row";
/// The variable of the flight model.
pub const MODEL: &str = "FLIGHT_MODEL";
/// What is said of times that count from the start of a flight.
pub const UNDATED: &str = "counted from the start of the flight: its date is not known";

/// Whether the flight format names this column: the first name of a channel.
fn is_named(column: &str) -> bool {
    let first = |k: usize| NAMES[..k].iter().all(|n| n.1 != NAMES[k].1);
    NAMES.iter().enumerate().any(|(k, n)| n.0 == column && first(k))
}

impl Reader<'_> {
    /// Variables that name their column, with the column.
    fn own_columns(&self) -> Vec<(String, String)> {
        let named = |v: &netcdf_reader::NcVariable| Some((v.name().to_owned(), v.attribute(COLUMN)?.value.as_string()?));
        self.file.variables().unwrap_or_default().iter().filter_map(named).collect()
    }

    /// Whether our own export wrote the file.
    pub(super) fn is_own(&self) -> bool {
        !self.own_columns().is_empty()
    }

    /// Whether the times of the file are Unix times.
    pub(super) fn is_dated(&self) -> bool {
        self.text("TIME", "comment").as_deref() != Some(UNDATED)
    }

    /// Columns that the flight format does not name; and how many rows have no pressure, without which they are none here.
    pub(super) fn own_extra(&mut self, flight: &mut Flight, unix: &[f64]) {
        let all = self.file.variable("TIME").and_then(|v| Ok(v.num_elements()?)).unwrap_or(0);
        if self.is_own() && all > unix.len() as u64 {
            self.report.leave_out(format!("{} of {all} rows have no pressure", all - unix.len() as u64));
        }
        for (variable, column) in self.own_columns() {
            let column = in_one_line(&column);
            if is_named(&column) || column.is_empty() || flight.extra.contains_key(&column) {
                continue;
            }
            if let Some(values) = self.numbers(&variable) {
                flight.extra.insert(column, at_rows(&values, unix));
            }
        }
    }

    /// Time of the first row since the start of the flight, s.
    pub(super) fn own_first_s(&self) -> f64 {
        self.numbers_of("TIME", FIRST).and_then(|n| n.first().copied()).filter(|first| first.is_finite() && *first >= 0.0).unwrap_or(0.0)
    }

    /// The vehicle file that the flight was exported with.
    pub(super) fn own_vehicle(&self) -> Option<String> {
        self.text(MODEL, VEHICLE).filter(|text| !text.trim().is_empty())
    }
}
