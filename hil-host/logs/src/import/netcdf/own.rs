//! Files of our own export: each variable of a flight names its column, so nothing of it is guessed, and the vehicle stands in the file.
//! And Datasets of the Python package: each variable is the column of its own name.

use super::*;

/// Attribute of a variable that names its column in the flight format.
pub const COLUMN: &str = "flight_column";
/// Attribute of the variable [`MODEL`] that holds the vehicle file, as JSON.
pub const VEHICLE: &str = "vehicle";
/// Attribute of the time that states the first row's since the start of the flight, s, where it is not 0.
pub const FIRST: &str = "time_s_of_first_row";
/// The variable of the flight model.
pub const MODEL: &str = "FLIGHT_MODEL";
/// Global attribute of a Dataset: the name of the flight format.
pub const DATASET: &str = "flight_format";
/// Global attribute of a Dataset: Unix time at which the clock of the flight is zero, s.
pub const DATASET_START: &str = "start_unix_s";
/// What is said of times that count from the start of a flight.
pub const UNDATED: &str = "counted from the start of the flight: its date is not known";

/// Variables that are no columns: the number of each row's segment, and fixes on the globe.
const SEGMENTS: &str = "SEGMENT_NUMBER";
const FIXES: [&str; 2] = ["LATITUDE_GPS", "LONGITUDE_GPS"];

/// Coordinates of a Dataset that are computed from its columns.
const COMPUTED: [&str; 3] = ["latitude", "longitude", "depth"];

/// Whether a file is a Dataset of the Python package.
pub(super) fn is_dataset(file: &NcFile) -> bool {
    file.global_attribute(DATASET).is_ok()
}

/// Whether a variable is a GPS fix on the globe.
pub(super) fn is_fix(name: &str) -> bool {
    FIXES.iter().any(|fix| fix.eq_ignore_ascii_case(name))
}

/// Whether a variable of such a file is of the flight.
pub(super) fn is_read(v: &NcVariable, dataset: bool) -> bool {
    v.attribute(COLUMN).is_some() || v.name() == SEGMENTS || is_fix(v.name()) || (dataset && !COMPUTED.contains(&v.name()))
}

impl Reader<'_> {
    /// A variable under the name of its column.
    pub(super) fn own_column(&mut self, v: &NcVariable, dimensions: &[String]) {
        let dataset = is_dataset(self.file);
        let column = if dataset { v.name().to_owned() } else { in_one_line(&said(v, COLUMN)) };
        let table = Channels::usual();
        let time = &table.of(Channel::Time).stated[0].0;
        if dataset && (v.name() == "time" || column == *time) {
            return;
        }
        let Ok(values) = self.values(v.name()) else { return };
        let Some(clock) = self.clock(v.name(), dimensions, table) else { return };
        if v.name() == SEGMENTS || column == "segment" {
            self.raw.segments = Some(values.iter().map(|v| v.max(0.0) as u32).collect());
        } else if clock == 0 && !column.is_empty() && *time != column {
            // What was computed from a column may have lost its attributes.
            let stated = Channel::OF_FLIGHT.into_iter().map(|c| &table.of(c).stated[0]).find(|stated| stated.0 == column);
            let unit = stated.map(|s| Some(said(v, "units")).filter(|unit| !unit.is_empty()).unwrap_or_else(|| s.1.clone()));
            let unit = unit.unwrap_or_default();
            self.raw.series.push(RawSeries::column(&column, &unit, values));
        }
    }

    /// Whether the times of the file are Unix times.
    pub(super) fn is_dated(&self) -> bool {
        !self.is_undated_dataset() && self.text("TIME", "comment").as_deref() != Some(UNDATED)
    }

    /// Time of the first row since the start of the flight, s.
    pub(super) fn own_first_s(&self) -> f64 {
        let stated = numbers_of(self.file, "TIME", FIRST).and_then(|n| n.first().copied());
        stated.filter(|first| first.is_finite() && *first >= 0.0).unwrap_or(0.0)
    }

    /// Whether it is a Dataset whose times count from the start of the flight.
    pub(super) fn is_undated_dataset(&self) -> bool {
        is_dataset(self.file) && self.file.global_attribute(DATASET_START).is_err()
    }

    /// Unix time at which the clock of a Dataset is zero, s; 0 where its date is not known.
    pub(super) fn dataset_zero_s(&self) -> Option<f64> {
        let stated = self.file.global_attribute(DATASET_START).ok().and_then(|a| a.value.as_f64());
        is_dataset(self.file).then(|| stated.filter(|start| start.is_finite()).unwrap_or(0.0))
    }

    /// The vehicle file that the flight was exported with.
    pub(super) fn own_vehicle(&self) -> Option<String> {
        let dataset = || self.file.global_attribute(VEHICLE).ok().and_then(|a| a.value.as_string()).filter(|_| is_dataset(self.file));
        self.text(MODEL, VEHICLE).or_else(dataset).filter(|text| !text.trim().is_empty())
    }
}
