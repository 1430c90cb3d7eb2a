//! Logs of other people's gliders, brought into the one flight type.
//!
//! [`import`] finds out what it is given ([`kind`]), reads it, joins what belongs together and states the vehicle as far as the
//! files or the glider's class ([`classes`]) tell.
//!
//! * [`slocum`]: Slocum binary files of one flight ([`dbd`]: one such file).
//! * [`seaglider`]: dives of a Seaglider's base station. [`netcdf`]: OG1, IOOS and other NetCDF. [`table`]: csv.
//! * [`current_profiler`]: speed through the water of an AD2CP, beside a flight of any kind.
//! * [`comet`]: the public Comet 2016 flight ([`npy`]: numpy arrays).
//! * [`crate::record::seawater`]: density, always computed here from what the CTD measured.
//! * [`crate::record::resample`]: channels of one clock at the instants of another; [`position`]: degrees to metres.
//! * [`draft`]: the first vehicle file; [`trim`]: its hull volume from the flight.

use std::path::{Path, PathBuf};

mod bad_segments;
pub mod calendar;
pub(crate) mod channels;
mod checks;
pub mod classes;
pub mod comet;
pub mod current_profiler;
pub mod dba;
pub mod dbd;
pub mod draft;
pub mod folder;
mod join;
pub mod kind;
pub mod netcdf;
pub mod npy;
pub mod position;
mod pressure_zero;
#[cfg(test)]
mod raw_tests;
mod report;
pub mod seaexplorer;
pub mod seaglider;
pub mod seaglider_raw;
pub mod slocum;
mod stated_vehicle;
mod surface;
pub mod table;
pub mod trim;
mod two_computers;

pub use report::{FileNote, ImportError, Imported, MappedName, Origin, Report};

use crate::record::csv::in_one_line;
use classes::Class;
use kind::Kind;

/// Imports one file or folder; `caches` are further folders of Slocum sensor lists.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path, caches: &[PathBuf]) -> Result<Imported, ImportError> {
    import_all(&[path.to_path_buf()], caches, None)
}

/// Imports the files and folders of one flight; the vehicle is of `class` where the files do not say it.
///
/// # Errors
/// [`ImportError`].
pub fn import_all(paths: &[PathBuf], caches: &[PathBuf], class: Option<Class>) -> Result<Imported, ImportError> {
    match import_as_it_says(paths, caches, class) {
        Ok(mut imported) => {
            imported.report.in_one_line();
            Ok(imported)
        }
        Err(e) => Err(ImportError { file: e.file, what: in_one_line(&e.what) }),
    }
}

/// The same, with what the files say as they say it.
fn import_as_it_says(paths: &[PathBuf], caches: &[PathBuf], class: Option<Class>) -> Result<Imported, ImportError> {
    let (lists, other): (Vec<PathBuf>, Vec<PathBuf>) = paths.iter().cloned().partition(|p| p.is_file() && slocum::is_list(p));
    // Sensor lists among the files named are no flight, but where to look for lists.
    let paths = if other.is_empty() { paths } else { &other };
    let folders = lists.iter().filter_map(|list| list.parent()).map(Path::to_path_buf);
    let caches: &Vec<PathBuf> = &caches.iter().cloned().chain(folders).collect();
    let first = paths.first().ok_or_else(|| ImportError { file: "import".into(), what: "names no file or folder".into() })?;
    let (kind, files, witnesses, passed) = files_of_one_kind(paths)?;
    let mut imported = match kind {
        Kind::Slocum | Kind::SlocumText => slocum::import(&files, caches)?,
        Kind::SeagliderDive => seaglider::import(&files)?,
        Kind::SeagliderRaw => seaglider_raw::import(&files)?,
        Kind::SeaExplorer => seaexplorer::import(&files)?,
        Kind::Netcdf if files.len() > 1 => profiles(&files)?,
        Kind::Netcdf => netcdf::import(&files[0])?,
        Kind::Csv => table::import(&files[0])?,
    };
    for what in passed {
        imported.report.note(what);
    }
    checks::impossible_water(&mut imported);
    if kind == Kind::SlocumText && imported.report.segments.len() == 1 {
        surface::cut_anew(&mut imported, 2);
    }
    imported.report.find_missing(&imported.flight);
    pressure_zero::take_out_of_flight(&mut imported);
    checks::sound(&mut imported).map_err(|what| match imported.report.left_out.as_slice() {
        [] => ImportError::new(first, what),
        // What was lost before may be the cause.
        lost => ImportError::new(first, format!("{what} (left out before: {})", lost.join("; "))),
    })?;
    stated_vehicle::state(&mut imported, kind, class);
    for path in &witnesses {
        current_profiler::witness(path, &mut imported)?;
    }
    imported.report.find_missing(&imported.flight);
    Ok(imported)
}

/// Files of one profile each, or of parts of a deployment, in the order of time.
fn profiles(files: &[PathBuf]) -> Result<Imported, ImportError> {
    let folder = files[0].parent().unwrap_or(Path::new("."));
    let (mut parts, mut refused) = (Vec::new(), Vec::new());
    let mut identity = netcdf::Identity::default();
    for path in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match netcdf::import(path) {
            Ok(part) => {
                identity.join(netcdf::Identity::of_path(path));
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

/// The kind of a flight's files, these, files of a current profiler beside them, and a note on what else lies there.
type FilesOfFlight = (Kind, Vec<PathBuf>, Vec<PathBuf>, Vec<String>);

/// What the paths hold.
fn files_of_one_kind(paths: &[PathBuf]) -> Result<FilesOfFlight, ImportError> {
    let mut named = Vec::new();
    let mut in_folders = Vec::new();
    for path in paths {
        if path.is_dir() {
            in_folders.extend(folder::files_of(path).map_err(|e| ImportError::new(path, format!("cannot be read: {e}")))?);
        } else if path.is_file() {
            named.push(path.clone());
        } else {
            let what = if path.exists() {
                "is no regular file but a pipe, a socket or a device: copy what comes out of it to a file first"
            } else {
                "there is no such file or folder"
            };
            return Err(ImportError::new(path, what));
        }
    }
    let mut witnesses = Vec::new();
    for list in [&mut named, &mut in_folders] {
        witnesses.extend(list.extract_if(.., |p| current_profiler::is_midas(p)));
    }
    if let [profiler, ..] = witnesses.as_slice()
        && !named.iter().chain(&in_folders).any(|p| Kind::of(p).is_some())
    {
        let what = "holds the speeds of a current profiler alone: name the files of its flight too (glider import FLIGHT… THIS --out DIR)";
        return Err(ImportError::new(profiler, what));
    }
    if let Some(unknown) = named.iter().find(|p| Kind::of(p).is_none()) {
        return Err(ImportError::new(
            unknown,
            kind::way_to_readable(unknown).map_or(format!("is of no known kind: {KNOWN}"), str::to_owned),
        ));
    }
    let of: Vec<(Kind, PathBuf)> = named.iter().chain(&in_folders).filter_map(|p| Some((Kind::of(p)?, p.clone()))).collect();
    let mut kinds: Vec<Kind> = of.iter().map(|f| f.0).collect();
    kinds.sort();
    kinds.dedup();
    let Some(&kind) = kinds.first() else {
        if let Some((file, way)) = in_folders.iter().find_map(|f| Some((f, kind::way_to_readable(f)?))) {
            return Err(ImportError::new(file, way));
        }
        return Err(ImportError::new(&paths[0], format!("has no file of a known kind{}: {KNOWN}", inside(&paths[0]))));
    };
    let named_kinds: std::collections::BTreeSet<Kind> = named.iter().filter_map(|p| Kind::of(p)).collect();
    if named_kinds.len() > 1 {
        let names: Vec<&str> = named_kinds.iter().map(|k| k.name()).collect();
        return Err(ImportError::new(
            &named[0],
            format!("files of several kinds are named ({}): import one kind at a time", names.join(", ")),
        ));
    }
    let kind = named_kinds.first().copied().unwrap_or(kind);
    let mut files: Vec<PathBuf> = of.into_iter().filter(|f| f.0 == kind).map(|f| f.1).collect();
    if matches!(kind, Kind::Slocum | Kind::SlocumText) && named.len() == files.len() {
        files = slocum::with_partners(&files);
    }
    if files.len() > 1 && !kind.joins() {
        let names: Vec<_> = files.iter().take(6).filter_map(|f| f.file_name()).map(|n| n.to_string_lossy()).collect();
        let what = format!(
            "{} files of {} here, and one {} is one flight: import one at a time ({}), or concatenate them under one header line",
            files.len(),
            kind.name(),
            kind.name(),
            names.join(", ")
        );
        return Err(ImportError::new(&paths[0], what));
    }
    let others = named.len() + in_folders.len() - files.iter().filter(|f| named.contains(f) || in_folders.contains(f)).count();
    let mut notes: Vec<String> = paths.iter().filter(|p| p.is_dir()).flat_map(|p| folder::dangling(p)).collect();
    if kinds.len() > 1 {
        let names: Vec<&str> = kinds.iter().filter(|k| **k != kind).map(|k| k.name()).collect();
        notes.push(format!("{} here too ({others} other files in all): {} is taken", names.join(", "), kind.name()));
    }
    Ok((kind, files, witnesses, notes))
}

/// Folders in this one that hold files of a known kind.
fn inside(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path()));
    let mut folders: Vec<PathBuf> = entries.filter(|p| p.is_dir()).collect();
    folders.sort();
    folders.retain(|f| folder::files_of(f).is_ok_and(|files| files.iter().any(|p| Kind::of(p).is_some())));
    let names: Vec<String> = folders.iter().take(6).map(|f| f.display().to_string()).collect();
    if names.is_empty() {
        String::new()
    } else {
        format!(" itself; name a folder in it, or all that are of one flight ({})", names.join(" "))
    }
}

const KNOWN: &str = "Slocum binary (.dbd, .ebd ...), Seaglider dives (pNNNNNNN.nc), SeaExplorer (seaNNN.M.gli.sub.C with pld1), NetCDF (.nc) or csv is expected";
