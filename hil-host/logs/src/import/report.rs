//! What an import says of itself: names and units, what is missing, what was left out.

use serde::Serialize;

use super::draft::Draft;
use crate::record::csv::{cannot_be_asked, in_one_line};
use crate::record::flight::Flight;
use crate::record::seawater::Place;

/// What a vehicle file is called beside its flight.
pub(super) const VEHICLE_JSON: &str = "vehicle.json";

/// The first six of some names, and that there are more.
pub(super) fn list_of(names: &[String]) -> String {
    let more = if names.len() > 6 { format!(" and {} more", names.len() - 6) } else { String::new() };
    names.iter().take(6).cloned().collect::<Vec<_>>().join(", ") + &more
}

/// A flight, what was done to get it, and the vehicle as far as its files or its class tell.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The flight.
    pub flight: Flight,
    /// What was read, mapped, missing, damaged.
    pub report: Report,
    /// The vehicle that flew it, where the files or its class tell.
    pub vehicle: Option<Draft>,
    /// Its vehicle file as JSON, where the flight was exported with one: it takes the place of `vehicle`.
    pub vehicle_file: Option<String>,
}

impl Imported {
    /// A flight without a vehicle.
    pub(super) fn new(flight: Flight, report: Report) -> Self {
        Self { flight, report, vehicle: None, vehicle_file: None }
    }

    /// Name and text of the vehicle file that is to lie beside the flight.
    #[must_use]
    pub fn vehicle_text(&self) -> Option<(&'static str, String)> {
        let made = || self.vehicle.as_ref().map(|draft| ("vehicle.toml", draft.toml()));
        self.vehicle_file.clone().map(|text| (VEHICLE_JSON, text)).or_else(made)
    }
}

/// One source name that became a column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MappedName {
    /// Name in the source.
    pub from: String,
    /// Its unit there.
    pub unit: String,
    /// Column of the flight format.
    pub to: String,
    /// Factor from the source's unit to SI.
    pub factor: f64,
}

/// What one file gave.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FileNote {
    /// File name.
    pub file: String,
    /// Rows (cycles, samples).
    pub rows: usize,
    /// Damage and refusals, each with its place.
    pub problems: Vec<String>,
}

/// Where the local plane of a segment lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Origin {
    /// Segment.
    pub segment: u32,
    /// Unix time of the fix, s.
    pub unix_s: f64,
    /// Latitude, deg.
    pub lat_deg: f64,
    /// Longitude, deg.
    pub lon_deg: f64,
}

/// Where the density of a flight is from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum DensityIs {
    #[default]
    Missing,
    /// As the source has it.
    Stated,
    /// Computed here from a salinity or conductivity.
    Computed,
}

/// What was read, mapped, missing, damaged.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Kind of source.
    pub kind: String,
    /// Files.
    pub files: Vec<FileNote>,
    /// Names and units that became columns.
    pub mapped: Vec<MappedName>,
    /// Columns of the format that have no value at all.
    pub missing: Vec<String>,
    /// Names of the segments, in the order of their numbers.
    pub segments: Vec<String>,
    /// How density was computed.
    pub density: String,
    /// Unix time of the start of the flight, from which its times count, s.
    pub start_unix_s: Option<f64>,
    /// First fix of each segment that has one: east and north of the flight count from it.
    pub origins: Vec<Origin>,
    /// Rows, dives and files that were left out, and why: with one of them the exit code is 1.
    pub left_out: Vec<String>,
    /// Anything else worth knowing.
    pub notes: Vec<String>,
    /// Whether the file numbers its segments: they are not cut at the surface then.
    #[serde(skip)]
    pub numbered: bool,
    /// Where the density is from.
    #[serde(skip)]
    pub(super) density_is: DensityIs,
    /// Notes on the vehicle that is made.
    #[serde(skip)]
    pub(super) of_vehicle: Vec<String>,
    /// Whether a clock was found that was not set, and rows without a pressure are counted.
    #[serde(skip)]
    pub(super) clock_not_set: bool,
    #[serde(skip)]
    pub(super) rows_lost: bool,
}

impl Report {
    pub(super) fn new(kind: &str) -> Self {
        Self { kind: kind.into(), ..Self::default() }
    }

    pub(super) fn note(&mut self, what: String) {
        if !self.notes.contains(&what) {
            self.notes.push(what);
        }
    }

    /// Something worth knowing of the vehicle that is made.
    pub(super) fn note_of_vehicle(&mut self, what: String) {
        let what = format!("vehicle: {what}");
        self.of_vehicle.push(what.clone());
        self.note(what);
    }

    /// Without what is said of a vehicle that was made: another one is taken.
    pub fn forget_vehicle(&mut self) {
        self.notes.retain(|n| !self.of_vehicle.contains(n));
    }

    /// Something of the source is not in the flight.
    pub(super) fn leave_out(&mut self, what: String) {
        if !self.left_out.contains(&what) {
            self.left_out.push(what);
        }
    }

    pub(super) fn map(&mut self, one: MappedName) {
        if !self.mapped.contains(&one) {
            self.mapped.push(one);
        }
    }

    /// Names and units of the files without control characters.
    pub(super) fn in_one_line(&mut self) {
        let mapped = self.mapped.iter_mut().flat_map(|m| [&mut m.from, &mut m.unit]);
        let files = self.files.iter_mut().flat_map(|f| std::iter::once(&mut f.file).chain(&mut f.problems));
        let all = self.segments.iter_mut().chain(&mut self.left_out).chain(&mut self.notes).chain(mapped).chain(files);
        for text in all.filter(|t| t.contains(char::is_control)) {
            *text = in_one_line(text);
        }
    }

    /// Why this flight cannot be compared with a model; none if it can.
    #[must_use]
    pub fn not_comparable(&self) -> Option<String> {
        self.missing.iter().find_map(|column| Some(format!("has no {column}: without it {}", cannot_be_asked(column)?)))
    }

    /// Whether all that the files hold is in the flight.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.left_out.is_empty() && self.files.iter().all(|f| f.problems.is_empty())
    }

    pub(super) fn density_from(&mut self, what: &str, place: Option<Place>, known: bool) {
        let salinity = match place {
            Some(p) if p.is_baltic() => "Baltic absolute salinity",
            _ => "reference salinity (regional anomaly left out, at most 0.02 kg/m3)",
        };
        self.density_is = if known { DensityIs::Computed } else { DensityIs::Missing };
        self.density = if known { format!("recomputed by TEOS-10 from {what}; {salinity}") } else { format!("missing: it needs {what}") };
    }

    /// Which columns of the flight format have no value.
    pub(super) fn find_missing(&mut self, flight: &Flight) {
        let columns: [(&str, &[f64]); 11] = [
            ("pressure_dbar", &flight.pressure_pa),
            ("m_pitch_rad", &flight.pitch_rad),
            ("m_roll_rad", &flight.roll_rad),
            ("m_heading_rad", &flight.heading_rad),
            ("m_ballast_pumped_cc", &flight.ballast_m3),
            ("m_battpos_m", &flight.battery_mass_m),
            ("sci_water_temp_degC", &flight.temperature_degc),
            ("sci_density_kg_m3", &flight.density_kg_m3),
            ("gps_east_m", &flight.gps_east_m),
            ("gps_north_m", &flight.gps_north_m),
            ("speed_water_m_s", flight.speed_m_s.as_deref().unwrap_or(&[])),
        ];
        self.missing = columns.iter().filter(|(_, v)| !v.iter().any(|x| x.is_finite())).map(|(name, _)| (*name).to_owned()).collect();
    }
}

/// What is shown of a damaged text in a message: its first 40 characters.
pub(super) fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Why there is no flight.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportError {
    /// Which file or folder.
    pub file: String,
    /// What is wrong and what to do.
    pub what: String,
}

impl ImportError {
    pub(super) fn new(path: &std::path::Path, what: impl Into<String>) -> Self {
        Self { file: path.display().to_string(), what: what.into() }
    }
}

impl std::fmt::Display for ImportError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.file, self.what)
    }
}

impl std::error::Error for ImportError {}
