//! Logs of other people's gliders, brought into the one flight type.
//!
//! [`import`] finds out what it is given ([`reader`]), reads it, joins what belongs together and states the vehicle as far as the
//! files or the glider's class ([`classes`]) tell.
//!
//! * [`slocum`]: Slocum binary files of one flight ([`dbd`]: one such file).
//! * [`seaglider`]: dives of a Seaglider's base station. [`netcdf`]: OG1, IOOS and other NetCDF. [`table`]: csv.
//! * [`current_profiler`]: speed through the water of an AD2CP, beside a flight of any kind.
//! * [`comet`]: the public Comet 2016 flight ([`npy`]: numpy arrays).
//! * [`crate::record::seawater`]: density, always computed here from what the CTD measured.
//! * [`crate::record::resample`]: channels of one clock at the instants of another; [`position`]: degrees to metres.
//! * [`draft`]: the first vehicle file; [`trim`]: its hull volume from the flight.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub(crate) mod assembly;
mod bad_segments;
pub mod calendar;
mod checks;
pub mod classes;
mod clocks;
pub mod comet;
pub mod current_profiler;
pub mod dba;
pub mod dbd;
pub mod draft;
mod fills;
pub mod folder;
mod join;
mod lift_drag;
mod measured;
pub mod netcdf;
pub mod npy;
pub mod position;
mod pressure_zero;
mod raw_log;
#[cfg(test)]
mod raw_tests;
pub mod reader;
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
mod variation;

pub use report::{FileNote, ImportError, Imported, MappedName, Origin, Report};

use crate::channels::Channels;
use crate::record::bounded;
use crate::record::csv::in_one_line;
use crate::record::situations;
use classes::Class;
use reader::Reader;

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
    import_by(&READERS, paths, caches, class)
}

/// The same by these readers.
fn import_by(readers: &[&'static Reader], paths: &[PathBuf], caches: &[PathBuf], class: Option<Class>) -> Result<Imported, ImportError> {
    match import_as_it_says(readers, paths, caches, class) {
        Ok(mut imported) => {
            imported.report.in_one_line();
            Ok(imported)
        }
        Err(e) => Err(ImportError { file: e.file, what: in_one_line(&e.what) }),
    }
}

/// Mends one kind of defect of a flight and says so, or why the flight cannot be used.
type Repair = fn(&mut Imported) -> Result<(), String>;

/// What is mended, left out or refused in a flight of any source, in this order; the rows of a log are put in order by [`assembly`], and
/// its channels chosen and cleaned by [`raw_log`] and `measured` before.
const REPAIRS: [Repair; 6] = [
    checks::impossible_water,
    find_missing,
    pressure_zero::take_out_of_flight,
    bad_segments::leave_out,
    checks::sound,
    leave_out_situations,
];

/// Columns without any value, before the checks speak of them.
fn find_missing(imported: &mut Imported) -> Result<(), String> {
    imported.report.find_missing(&imported.flight);
    Ok(())
}

/// Rows on the sea bed and under a thruster, positions that are no fixes.
fn leave_out_situations(imported: &mut Imported) -> Result<(), String> {
    situations::leave_out(&mut imported.flight)?.into_iter().for_each(|what| imported.report.note(what));
    Ok(())
}

/// The readers, those whose files say most by their names first.
pub const READERS: [&Reader; 7] = [
    &slocum::SLOCUM,
    &seaglider::SEAGLIDER_DIVES,
    &seaglider_raw::SEAGLIDER_TEXTS,
    &seaexplorer::SEAEXPLORER,
    &netcdf::NETCDF,
    // By its first bytes, whatever its ending.
    &slocum::SLOCUM_TEXTS,
    &table::TABLES,
];

/// Place of the reader of a file, none if there is none.
#[must_use]
pub fn reader_of(path: &Path) -> Option<usize> {
    place_in(&READERS, path)
}

fn place_in(readers: &[&'static Reader], path: &Path) -> Option<usize> {
    readers.iter().position(|r| (r.claims)(path))
}

/// The same, with what the files say as they say it.
fn import_as_it_says(
    readers: &[&'static Reader],
    paths: &[PathBuf],
    caches: &[PathBuf],
    class: Option<Class>,
) -> Result<Imported, ImportError> {
    let (lists, other): (Vec<PathBuf>, Vec<PathBuf>) = paths.iter().cloned().partition(|p| p.is_file() && slocum::is_list(p));
    // Sensor lists among the files named are no flight, but where to look for lists.
    let paths = if other.is_empty() { paths } else { &other };
    let folders = lists.iter().filter_map(|list| list.parent()).map(Path::to_path_buf);
    let caches: &Vec<PathBuf> = &caches.iter().cloned().chain(folders).collect();
    let first = paths.first().ok_or_else(|| ImportError { file: "import".into(), what: "names no file or folder".into() })?;
    let FilesOfFlight { reader, files, witnesses, passed } = files_of_one_kind(readers, paths)?;
    let mut imported = (reader.import)(&files, caches)?;
    passed.into_iter().for_each(|what| imported.report.note(what));
    for repair in REPAIRS {
        repair(&mut imported).map_err(|what| match imported.report.left_out.as_slice() {
            [] => ImportError::new(first, what),
            // What was lost before may be the cause.
            lost => ImportError::new(first, format!("{what} (left out before: {})", lost.join("; "))),
        })?;
    }
    stated_vehicle::state(&mut imported, reader.class, class);
    for path in &witnesses {
        current_profiler::witness(path, &mut imported)?;
    }
    imported.report.find_missing(&imported.flight);
    Ok(imported)
}

/// What the paths hold: the reader of a flight's files, these, files of a current profiler beside them, and notes on what else lies there.
struct FilesOfFlight {
    reader: &'static Reader,
    files: Vec<PathBuf>,
    witnesses: Vec<PathBuf>,
    passed: Vec<String>,
}

/// Files that are named, and those in the folders that are.
fn files_of(readers: &[&'static Reader], paths: &[PathBuf]) -> Result<[Vec<PathBuf>; 2], ImportError> {
    let (mut named, mut in_folders) = (Vec::new(), Vec::new());
    for path in paths {
        if path.is_dir() {
            let files = folder::files_of(path).map_err(|e| ImportError::new(path, format!("cannot be read: {e}")))?;
            if !files.iter().any(|f| place_in(readers, f).is_some()) {
                in_folders.extend(folder::of_two_computers(path));
            }
            in_folders.extend(files);
        } else if path.is_file() {
            named.push(path.clone());
        } else if path.exists() {
            let what = "is no regular file but a pipe, a socket or a device: copy what comes out of it to a file first";
            return Err(ImportError::new(path, what));
        } else {
            return Err(ImportError::new(path, "there is no such file or folder"));
        }
    }
    Ok([named, in_folders])
}

/// The first kind of file among them, and its files.
fn files_of_one_kind(readers: &[&'static Reader], paths: &[PathBuf]) -> Result<FilesOfFlight, ImportError> {
    let [mut named, mut in_folders] = files_of(readers, paths)?;
    let reader_of = |path: &Path| place_in(readers, path);
    let mut witnesses = Vec::new();
    for list in [&mut named, &mut in_folders] {
        witnesses.extend(list.extract_if(.., |p| current_profiler::is_midas(p)));
    }
    let known: Vec<(usize, &PathBuf)> = named.iter().chain(&in_folders).filter_map(|p| Some((reader_of(p)?, p))).collect();
    if let Some(profiler) = witnesses.first().filter(|_| known.is_empty()) {
        let what = "holds the speeds of a current profiler alone: name the files of its flight too (glider import FLIGHT… THIS --out DIR)";
        return Err(ImportError::new(profiler, what));
    }
    if let Some(unknown) = named.iter().find(|p| reader_of(p).is_none()) {
        let what = reader::way_to_readable(unknown).map_or(format!("is of no known kind: {KNOWN}"), str::to_owned);
        return Err(ImportError::new(unknown, what));
    }
    let kinds: BTreeSet<usize> = known.iter().map(|k| k.0).collect();
    let names = |of: &BTreeSet<usize>| of.iter().map(|k| readers[*k].name).collect::<Vec<_>>().join(", ");
    let named_kinds: BTreeSet<usize> = named.iter().filter_map(|p| reader_of(p)).collect();
    if named_kinds.len() > 1 {
        let what = format!("files of several kinds are named ({}): import one kind at a time", names(&named_kinds));
        return Err(ImportError::new(&named[0], what));
    }
    let Some(&kind) = named_kinds.first().or(kinds.first()) else {
        let compressed = in_folders.iter().find_map(|f| Some(ImportError::new(f, reader::way_to_readable(f)?)));
        return Err(
            compressed.unwrap_or_else(|| ImportError::new(&paths[0], format!("has no file of a known kind{}: {KNOWN}", inside(&paths[0]))))
        );
    };
    let reader = readers[kind];
    let mut files: Vec<PathBuf> = known.iter().filter(|f| f.0 == kind).map(|f| f.1.clone()).collect();
    if named.len() == files.len() {
        files = (reader.partners)(&files);
    }
    let others = named.iter().chain(&in_folders).filter(|f| !files.contains(f)).count();
    let mut passed: Vec<String> = paths.iter().filter(|p| p.is_dir()).flat_map(|p| folder::dangling(p)).collect();
    if kinds.len() > 1 {
        let rest = kinds.into_iter().filter(|k| *k != kind).collect();
        passed.push(format!("{} here too ({others} other files in all): {} is taken", names(&rest), reader.name));
    }
    Ok(FilesOfFlight { reader, files, witnesses, passed })
}

/// Folders in this one that hold files of a known kind.
fn inside(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(|e| e.ok().map(|e| e.path()));
    let mut folders: Vec<PathBuf> = entries.filter(|p| p.is_dir()).collect();
    folders.sort();
    folders.retain(|f| folder::files_of(f).is_ok_and(|files| files.iter().any(|p| reader_of(p).is_some())));
    let names: Vec<String> = folders.iter().take(6).map(|f| f.display().to_string()).collect();
    if names.is_empty() {
        String::new()
    } else {
        format!(" itself; name a folder in it, or all that are of one flight ({})", names.join(" "))
    }
}

/// The table of channels with the names and units of a lab whose own table lies beside its log; none where there is none.
///
/// # Errors
/// It cannot be read.
fn lab_table(log: &Path) -> Result<Option<Box<Channels>>, String> {
    let path = log.with_file_name("channels.toml");
    if !path.is_file() {
        return Ok(None);
    }
    let text = bounded::text(&path, bounded::DOCUMENT).map_err(|e| e.to_string());
    let table = text.and_then(|text| Channels::usual().with(&text)).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(Some(Box::new(table)))
}

const KNOWN: &str = "Slocum binary (.dbd, .ebd ...), Seaglider dives (pNNNNNNN.nc), SeaExplorer (seaNNN.M.gli.sub.C with pld1), NetCDF (.nc) or csv is expected";
