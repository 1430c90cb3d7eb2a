//! Logs of other people's gliders, brought into the one flight type.
//!
//! * [`slocum`]: Slocum binary files of one flight ([`dbd`]: one such file).
//! * [`netcdf`]: Seaglider, OG1, IOOS. [`table`]: csv.
//! * [`comet`]: the public Comet 2016 flight ([`npy`]: numpy arrays).
//! * [`crate::record::seawater`]: density, always computed here from what the CTD measured.
//! * [`crate::record::resample`]: channels of one clock at the instants of another; [`position`]: degrees to metres.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::record::flight::Flight;

pub mod comet;
pub mod dbd;
pub mod netcdf;
pub mod npy;
pub mod position;
pub mod slocum;
pub mod table;

/// A flight and what was done to get it.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The flight.
    pub flight: Flight,
    /// What was read, mapped, missing, damaged.
    pub report: Report,
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
    /// Unix time of the first row, s.
    pub start_unix_s: Option<f64>,
    /// Anything else worth knowing.
    pub notes: Vec<String>,
}

impl Report {
    fn note(&mut self, what: String) {
        if !self.notes.contains(&what) {
            self.notes.push(what);
        }
    }

    fn map(&mut self, one: MappedName) {
        if !self.mapped.contains(&one) {
            self.mapped.push(one);
        }
    }

    fn density_from(&mut self, what: &str, place: Option<crate::record::seawater::Place>, known: bool) {
        let salinity = match place {
            Some(p) if p.is_baltic() => "Baltic absolute salinity",
            _ => "reference salinity (regional anomaly left out, at most 0.02 kg/m3)",
        };
        self.density = if known { format!("recomputed by TEOS-10 from {what}; {salinity}") } else { format!("missing: it needs {what}") };
    }

    /// Which columns of the flight format have no value.
    fn find_missing(&mut self, flight: &Flight) {
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

/// Why there is no flight.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportError {
    /// Which file or folder.
    pub file: String,
    /// What is wrong and what to do.
    pub what: String,
}

impl std::fmt::Display for ImportError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.file, self.what)
    }
}

impl std::error::Error for ImportError {}

/// Imports `path`: a file, or a folder of Slocum files; `caches` are further folders of sensor lists.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path, caches: &[PathBuf]) -> Result<Imported, ImportError> {
    let error = |what: String| ImportError { file: path.display().to_string(), what };
    let files = if path.is_dir() {
        let entries = std::fs::read_dir(path).map_err(|e| error(format!("cannot be read: {e}")))?;
        let mut files: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).filter(|p| slocum::is_slocum(p)).collect();
        files.sort();
        if files.is_empty() {
            return Err(error("has no Slocum files (dbd, ebd, sbd, tbd, mbd, nbd, dcd, ecd, scd, tcd, mcd, ncd)".into()));
        }
        files
    } else if path.is_file() {
        with_its_partner(path)
    } else {
        return Err(error("there is no such file or folder".into()));
    };
    let ending = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase());
    let mut imported = match ending.as_str() {
        _ if path.is_dir() || slocum::is_slocum(path) => slocum::import(&files, caches)?,
        "nc" | "nc4" | "cdf" => netcdf::import(path)?,
        "csv" | "txt" => table::import(path)?,
        _ => return Err(error("is of no known kind: Slocum binary (.dbd, .ebd ...), NetCDF (.nc) or csv is expected".into())),
    };
    imported.report.find_missing(&imported.flight);
    check(&mut imported).map_err(error)?;
    Ok(imported)
}

/// Refuses what cannot be in the unit it claims; notes what the flight cannot be used for.
fn check(imported: &mut Imported) -> Result<(), String> {
    let flight = &imported.flight;
    if let Some((column, why)) = crate::record::plausible::implausible(flight, ["pressure", "pitch", "ballast", "density"]) {
        return Err(format!("{column} {why}"));
    }
    let deep = crate::record::plausible::quantile(&flight.pressure_pa, 0.99);
    if deep < SHALLOW_PA {
        return Err(format!("pressure never exceeds {:.4} dbar: no dive to compare with, or kbar or MPa instead of dbar?", deep * 1e-4));
    }
    let mut steps: Vec<f64> = flight.time_s.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    match steps.get(steps.len() / 2) {
        Some(step) if *step < SHORTEST_STEP_S => {
            return Err(format!("the usual step of time is {step} s (a clock that counts in another unit than it states?)"));
        }
        Some(step) if *step > LONGEST_STEP_S => {
            imported.report.note(format!("samples are {step:.0} s apart: too sparse for a comparison, which needs one every 0.1 to 60 s"));
        }
        _ => {}
    }
    let needed = ["m_pitch_rad", "m_ballast_pumped_cc", "sci_density_kg_m3"];
    let lacking: Vec<&str> = needed.into_iter().filter(|n| imported.report.missing.iter().any(|m| m == n)).collect();
    if !lacking.is_empty() {
        imported.report.note(format!("a comparison needs {}, which this file does not have", lacking.join(" and ")));
    }
    Ok(())
}

/// The comparison leaves out what is shallower than 2 m.
const SHALLOW_PA: f64 = 2e4;
/// A flight is sampled every 0.1 to 60 s (the bounds of reading a csv).
const SHORTEST_STEP_S: f64 = 0.01;
const LONGEST_STEP_S: f64 = 120.0;

/// A Slocum file and the files of the same stem beside it.
fn with_its_partner(path: &Path) -> Vec<PathBuf> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let same_stem = |p: &PathBuf| p.file_stem() == path.file_stem() && slocum::is_slocum(p);
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).map_or_else(|_| Vec::new(), |d| d.filter_map(|e| e.ok().map(|e| e.path())).filter(same_stem).collect());
    if files.is_empty() {
        files.push(path.to_path_buf());
    }
    files.sort();
    files
}
