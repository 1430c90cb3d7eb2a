//! Files of our own export: each variable of a flight names its column, so nothing of it is guessed, and the vehicle stands in the file.

use super::*;

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

/// Variables that are no columns: the number of each row's segment, and fixes on the globe.
const SEGMENTS: &str = "SEGMENT_NUMBER";
pub(super) const FIXES: [&str; 2] = ["LATITUDE_GPS", "LONGITUDE_GPS"];

/// Whether a variable of such a file is of the flight.
pub(super) fn is_read(v: &NcVariable) -> bool {
    v.attribute(COLUMN).is_some() || v.name() == SEGMENTS || FIXES.contains(&v.name())
}

impl Reader<'_> {
    /// A variable under the name of its column.
    pub(super) fn own_column(&mut self, v: &NcVariable, dimensions: &[String]) {
        let column = in_one_line(&said(v, COLUMN));
        let table = Channels::usual();
        let Ok(values) = self.values(v.name()) else { return };
        let Some(clock) = self.clock(v.name(), dimensions, table) else { return };
        if v.name() == SEGMENTS {
            self.raw.segments = Some(values.iter().map(|v| v.max(0.0) as u32).collect());
        } else if clock == 0 && !column.is_empty() && table.of(Channel::Time).stated[0].0 != column {
            let named = Channel::OF_FLIGHT.into_iter().any(|c| table.of(c).stated[0].0 == column);
            let unit = if named { said(v, "units") } else { String::new() };
            self.raw.series.push(RawSeries::column(&column, &unit, values));
        }
    }

    /// Whether the times of the file are Unix times.
    pub(super) fn is_dated(&self) -> bool {
        self.text("TIME", "comment").as_deref() != Some(UNDATED)
    }

    /// Time of the first row since the start of the flight, s.
    pub(super) fn own_first_s(&self) -> f64 {
        let stated = numbers_of(self.file, "TIME", FIRST).and_then(|n| n.first().copied());
        stated.filter(|first| first.is_finite() && *first >= 0.0).unwrap_or(0.0)
    }

    /// The vehicle file that the flight was exported with.
    pub(super) fn own_vehicle(&self) -> Option<String> {
        self.text(MODEL, VEHICLE).filter(|text| !text.trim().is_empty())
    }
}
