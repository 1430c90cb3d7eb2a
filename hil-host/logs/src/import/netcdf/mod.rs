//! NetCDF of other gliders: Seaglider base-station files, OG1, IOOS; classic and HDF5-based alike; and our own export.
//!
//! A variable is read if the table of channels knows its name, its standard name or the sensor it is from. Every variable stands on the
//! clock that its `coordinates` name. What a file declares is heeded here (packing, ranges, fills, flags); all else is a repair.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use netcdf_reader::{NcFile, NcOpenOptions, NcType, NcVariable};

use super::raw_log::{RawLog, RawSeries, Said};
use super::{FileNote, ImportError, Imported, Report, join, reader, surface};
use crate::channels::{Channel, Channels};
use crate::record::csv::in_one_line;

mod clocks;
mod declared;
pub(super) mod flags;
mod groups;
pub mod own;
mod scalars;
mod stated_vehicle;

pub use scalars::{Identity, Scalars, scalars, speed_witness};

/// Values of a file take at most so many times its bytes, and this much more: a declared size is no size.
const UNPACKED: u64 = 20;
const SMALLEST_BUDGET: u64 = 8 << 20;

/// Bytes that the values of a file may take.
pub(super) fn budget(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |m| m.len()).saturating_mul(UNPACKED).saturating_add(SMALLEST_BUDGET)
}

pub(super) fn open(path: &Path) -> netcdf_reader::Result<NcFile> {
    groups::have_an_end(path).map_err(netcdf_reader::Error::InvalidData)?;
    let limit = usize::try_from(budget(path)).unwrap_or(usize::MAX);
    NcFile::open_with_options(path, NcOpenOptions { max_read_bytes: limit, max_chunk_bytes: limit, ..NcOpenOptions::default() })
}

/// A file of one vehicle with variables that can be listed; else why it is none.
fn sound(path: &Path) -> Result<NcFile, String> {
    if std::fs::metadata(path).is_ok_and(|m| m.len() == 0) {
        return Err("is empty".into());
    }
    let file = open(path).map_err(|e| format!("is no NetCDF file that can be read: {e}"))?;
    file.variables().map_err(|e| format!("is damaged or cut: its variables cannot be listed ({e})"))?;
    if let Some(mixed) = Identity::of(&file).mixed() {
        return Err(format!("holds rows {mixed}"));
    }
    let trajectories = Identity::trajectories(&file);
    if trajectories > 1 {
        return Err(format!("holds {trajectories} trajectories (dimension {}): import one at a time", scalars::TRAJECTORY));
    }
    Ok(file)
}

/// NetCDF files of any origin.
pub(super) const NETCDF: reader::Reader = reader::Reader {
    name: "NetCDF",
    claims: |path| reader::ends_in(path, &["nc", "nc4", "cdf"]),
    import: |files, _| if let [one] = files { import(one) } else { profiles(files) },
    ..reader::Reader::PLAIN
};

/// Files of one profile each, or of parts of a deployment, in the order of time.
fn profiles(files: &[PathBuf]) -> Result<Imported, ImportError> {
    let folder = files[0].parent().unwrap_or(Path::new("."));
    let (mut parts, mut refused) = (Vec::new(), Vec::new());
    let mut identity = Identity::default();
    for path in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match import(path) {
            Ok(part) => {
                identity.join(Identity::of_path(path));
                parts.push((name, part));
            }
            Err(e) => refused.push(format!("{name}: {}", e.what)),
        }
    }
    if let Some(mixed) = identity.mixed() {
        return Err(ImportError::new(folder, format!("files {mixed}")));
    }
    let Some(mut imported) = join::join("NetCDF, a file a profile", parts) else {
        return Err(ImportError::new(folder, format!("no file can be used: {}", refused.join("; "))));
    };
    refused.into_iter().for_each(|what| imported.report.leave_out(what));
    imported.flight.name = folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    if imported.report.numbered {
        surface::unite_named(&mut imported);
    } else {
        surface::cut_anew(&mut imported, 1);
    }
    Ok(imported)
}

/// Whether a path is a file that the Python package made of a flight, which has been imported before.
#[must_use]
pub fn is_dataset(path: &Path) -> bool {
    (NETCDF.claims)(path) && path.is_file() && open(path).is_ok_and(|file| own::is_dataset(&file))
}

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let error = |what: String| ImportError::new(path, what);
    let file = sound(path).map_err(error)?;
    let table = super::lab_table(path).map_err(error)?;
    let mut reader = Reader { file: &file, budget: budget(path), clocks: BTreeMap::new(), raw: RawLog { table, ..RawLog::default() } };
    reader.read();
    let (dated, vehicle_file) = (reader.is_dated(), reader.own_vehicle());
    let (first_s, dataset_zero_s) = (reader.own_first_s(), reader.dataset_zero_s());
    let mut raw = reader.raw;
    raw.report.kind = "NetCDF".into();
    if raw.exact {
        raw.zero_s = dataset_zero_s.or_else(|| raw.clocks.first().and_then(|c| c.times.first()).map(|t| t - first_s));
    }
    let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let (flight, mut report) = raw.flight(&stem).map_err(error)?;
    let vehicle = stated_vehicle::stated_vehicle(&file, &mut report).filter(|_| vehicle_file.is_none());
    report.start_unix_s = report.start_unix_s.filter(|_| dated);
    report.files.push(FileNote { file: path.display().to_string(), rows: flight.len(), problems: Vec::new() });
    Ok(Imported { vehicle, vehicle_file, ..Imported::new(flight, report) })
}

pub(super) struct Reader<'a> {
    pub file: &'a NcFile,
    /// Bytes that values may still take.
    pub budget: u64,
    /// Places of the clocks read, by name.
    pub clocks: BTreeMap<String, Option<usize>>,
    pub raw: RawLog,
}

/// A text attribute of a variable.
fn said(v: &NcVariable, attribute: &str) -> String {
    v.attribute(attribute).and_then(|a| a.value.as_string()).unwrap_or_default().trim().to_owned()
}

impl Reader<'_> {
    /// Reads every variable that may be a channel.
    fn read(&mut self) {
        let file = self.file;
        let variables = file.variables().unwrap_or_default();
        let dataset = own::is_dataset(file);
        self.raw.as_it_is = dataset;
        self.raw.exact = dataset || variables.iter().any(|v| v.attribute(own::COLUMN).is_some());
        let table = self.raw.table.as_deref().unwrap_or(Channels::usual()).clone();
        for v in variables {
            let (standard, source) = (said(v, "standard_name"), said(v, "source"));
            let known = if self.raw.exact { own::is_read(v, dataset) } else { table.knows(v.name(), &standard, &source) };
            let Some(dimensions) = self.dimensions(v.name()).filter(|d| known && !d.is_empty()) else { continue };
            if self.raw.exact && !own::is_fix(v.name()) {
                self.own_column(v, &dimensions);
            } else {
                self.variable(v, &dimensions, &table);
            }
        }
        if !self.raw.exact {
            self.raw.names = variables.iter().map(|v| v.name().to_owned()).collect();
        }
        self.raw.variation = scalar(file, "magnetic_variation");
        self.raw.without_pressure = self.without_pressure(variables, &table);
    }

    fn variable(&mut self, v: &NcVariable, dimensions: &[String], table: &Channels) {
        let name = v.name();
        let mut series = RawSeries::column(name, &said(v, "units"), Vec::new());
        (series.standard, series.source) = (said(v, "standard_name"), said(v, "source"));
        series.magnetic = name == "eng_head" || said(v, "comment").to_ascii_lowercase().contains("magnetic");
        series.clock = self.clock(name, dimensions, table).ok_or_else(|| {
            Some(if dimensions.len() > 1 {
                format!("{name} is a table of {}, not a series in time (a gridded product?): left out", dimensions.join(" x "))
            } else {
                format!("{name} has no time on its dimension {}: left out", dimensions[0])
            })
        });
        if series.clock.is_ok() {
            series.values = self.values(name).map(|values| self.without_declared(name, values, &mut series.said));
            if let Ok(values) = &series.values {
                series.flags = self.flags_of(name, values.len());
            }
        }
        self.raw.series.push(series);
    }

    /// Why there is no pressure, where the file's own structure says it.
    fn without_pressure(&self, variables: &[NcVariable], table: &Channels) -> Option<String> {
        let is_wanted = |n: &str| [Channel::Pressure, Channel::Depth].into_iter().any(|c| table.of(c).is_called(n));
        if let Some(short) = variables.iter().find(|v| is_wanted(v.name()) && v.num_elements().is_ok_and(|n| n < 2)) {
            return Some(format!("{} has {} values: no dive", short.name(), short.num_elements().unwrap_or(0)));
        }
        let groups = self.file.root_group().map(|g| g.groups.iter().map(|g| g.name.as_str()).collect::<Vec<_>>()).unwrap_or_default();
        let hidden = !groups.is_empty() && variables.is_empty();
        hidden
            .then(|| format!("has its variables in groups ({}), which are not read: copy them to the root of the file", groups.join(", ")))
    }

    /// Names of the dimensions that are more than one value long; the length of texts of characters is none.
    fn dimensions(&self, name: &str) -> Option<Vec<String>> {
        let variable = self.file.variable(name).ok()?;
        let of = variable.dimensions();
        let values = if *variable.dtype() == NcType::Char { of.split_last().map_or(of, |(_, values)| values) } else { of };
        Some(values.iter().filter(|d| d.size != 1).map(|d| d.name.clone()).collect())
    }

    /// Whether a variable holds texts.
    fn is_text(&self, name: &str) -> bool {
        self.file.variable(name).is_ok_and(|v| matches!(v.dtype(), NcType::Char | NcType::String))
    }

    /// The bytes that the values of `name` take, where there is room for them: what a file declares may be a thousand times what it holds.
    fn room(&self, name: &str) -> Result<u64, String> {
        let rows = self.file.variable(name).and_then(|v| Ok(v.num_elements()?)).map_err(|e| e.to_string())?;
        let bytes = rows.saturating_mul(8);
        if bytes > self.budget {
            return Err(format!("declares {rows} values, more than a file of this size holds"));
        }
        Ok(bytes)
    }

    /// The same, taken off what is left.
    fn fits(&mut self, name: &str) -> Result<(), String> {
        self.budget -= self.room(name)?;
        Ok(())
    }

    fn text(&self, variable: &str, attribute: &str) -> Option<String> {
        text(self.file, variable, attribute)
    }
}

fn text(file: &NcFile, variable: &str, attribute: &str) -> Option<String> {
    file.variable(variable).ok()?.attributes().iter().find(|a| a.name == attribute)?.value.as_string()
}

/// The one value of a variable without dimensions.
fn scalar(file: &NcFile, name: &str) -> Option<f64> {
    let variable = file.variable(name).ok()?;
    let one = variable.dimensions().is_empty().then(|| file.read_variable_unpacked_masked(name).ok())??;
    one.iter().next().copied().filter(|v| v.abs() < super::fills::LARGEST)
}

/// Numbers of an attribute, also of one that is written as text ("0, 1, 2" or "012").
fn numbers_of(file: &NcFile, variable: &str, attribute: &str) -> Option<Vec<f64>> {
    let variable = file.variable(variable).ok()?;
    let value = &variable.attribute(attribute)?.value;
    let of_text = |text: String| {
        let words: Vec<f64> = text.split([' ', ',']).filter_map(|w| w.trim_end_matches(['b', 'B']).parse().ok()).collect();
        if words.len() > 1 { words } else { text.chars().filter_map(|c| c.to_digit(10)).map(f64::from).collect() }
    };
    value.as_f64_vec().or_else(|| value.as_string().map(of_text))
}

#[cfg(test)]
mod quirk_tests;
#[cfg(test)]
mod tests;
