//! Slocum files of one flight become one flight: engineering (dbd, sbd, mbd) and science (ebd, tbd, nbd) merged.
//!
//! Rows are the CTD's samples; engineering channels are interpolated to them.
//! Without science files the vehicle's own pressure gives the rows, and there is
//! no density. One file pair is one segment, as the vehicle cuts its files at
//! the surface.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::assembly::Row;
use super::classes::Class;
use super::dba;
use super::dbd;
use super::reader::Reader;
use super::surface;
use super::{FileNote, ImportError, Imported, MappedName, Report};
use crate::channels::{Channel, Channels, Entry};
use crate::record::bounded;

mod clocks;
mod ctd;
mod files;
mod merge;

use clocks::{apart, in_order, plausible_times, report_untimed, set_clocks};
pub(super) use files::with_partners;
use files::{one_glider, one_of_copies, one_sided, pair_by_header, pairs, without_copies};

/// Slocum binary files.
pub(super) const SLOCUM: Reader =
    Reader { name: "Slocum binary", claims: is_slocum, partners: with_partners, import, class: Class::slocum, ..Reader::PLAIN };

/// The same as text, of which one may hold many segments under one name.
pub(super) const SLOCUM_TEXTS: Reader = Reader {
    name: "Slocum text (dba)",
    claims: is_text,
    import: |files, caches| {
        let mut imported = import(files, caches)?;
        if imported.report.segments.len() == 1 {
            surface::cut_anew(&mut imported, 2);
        }
        Ok(imported)
    },
    ..SLOCUM
};

fn is_text(path: &Path) -> bool {
    let mut head = Vec::new();
    let file = std::fs::File::open(path).map(|file| std::io::Read::take(file, dba::HEAD as u64));
    file.and_then(|mut file| std::io::Read::read_to_end(&mut file, &mut head)).is_ok() && dba::is_dba(&head)
}

/// Endings of engineering files, the fullest first.
const ENGINEERING_ENDINGS: [&str; 6] = ["dbd", "dcd", "mbd", "mcd", "sbd", "scd"];
/// Endings of science files, the fullest first.
const SCIENCE_ENDINGS: [&str; 6] = ["ebd", "ecd", "nbd", "ncd", "tbd", "tcd"];

/// What the receiver says of its fix.
const GPS_STATUS: &str = "m_gps_status";
/// Clocks.
const CLOCKS: [&str; 5] = ["m_present_time", "sci_m_present_time", STAMPS[0], STAMPS[1], STAMPS[2]];
/// Clocks of the CTDs: one of them says which cycles carry a new sample.
const STAMPS: [&str; 3] = ["sci_ctd41cp_timestamp", "sci_rbrctd_timestamp", "sci_ctd41_timestamp"];
/// With fewer values than this a CTD's clock was never set.
const LEAST_STAMPS: usize = 15;

/// Whether a file name is one of these files.
#[must_use]
pub fn is_slocum(path: &Path) -> bool {
    ending(path).is_some_and(|e| ENGINEERING_ENDINGS.contains(&e.as_str()) || SCIENCE_ENDINGS.contains(&e.as_str()))
}

/// Whether a file name is that of a list of sensors, plain or packed.
#[must_use]
pub fn is_list(path: &Path) -> bool {
    ending(path).is_some_and(|e| e == "cac" || e == "ccc")
}

fn ending(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// What a sensor of a Slocum measures.
fn sensor(name: &str) -> Option<&'static Entry> {
    const SENSED: [Channel; 16] = [
        Channel::Pressure,
        Channel::Pitch,
        Channel::Roll,
        Channel::Heading,
        Channel::Ballast,
        Channel::Battery,
        Channel::Temperature,
        Channel::Depth,
        Channel::Conductivity,
        Channel::Latitude,
        Channel::Longitude,
        Channel::FixStatus,
        Channel::ReckonedLatitude,
        Channel::ReckonedLongitude,
        Channel::Fin,
        Channel::Thruster,
    ];
    let of_slocum = name.starts_with("m_") || name.starts_with("sci_");
    SENSED.into_iter().map(Channel::usual).find(|e| of_slocum && e.names.iter().any(|n| n == name))
}

/// Values of one sensor over all files, each with its time.
#[derive(Default)]
struct Sensed {
    time_s: Vec<f64>,
    value: Vec<f64>,
}

#[derive(Default)]
struct Collected {
    channels: BTreeMap<String, Sensed>,
    ctd: Vec<Row>,
    /// First and last time of each segment's engineering file, s.
    spans: BTreeMap<u32, (f64, f64)>,
}

/// A file that was read.
struct Loaded {
    name: String,
    science: bool,
    segment: u32,
    file: dbd::DbdFile,
}

/// What is to be said of all files: which cannot be used, and names in them that are no channel.
#[derive(Default)]
struct Said {
    refused: Vec<String>,
    others: BTreeSet<String>,
}

/// Reads all `files` of one flight; sensor lists are looked for beside them, in a folder `cac` there, and in `caches`.
///
/// # Errors
/// [`ImportError`] when nothing usable remains, or files of two gliders are given; what is merely damaged is in the report.
pub fn import(files: &[PathBuf], caches: &[PathBuf]) -> Result<Imported, ImportError> {
    let mut report = Report::new(if files.iter().any(|f| is_slocum(f)) { "Slocum binary" } else { "Slocum text (dba)" });
    let files = &without_copies(files, &mut report);
    let mut loaded: Vec<Loaded> = Vec::new();
    let mut said = Said::default();
    for (segment, (stem, sides)) in (0_u32..).zip(pairs(files)) {
        for (candidates, science) in sides.into_iter().zip([false, true]) {
            loaded.extend(read_half(candidates, (segment, science), caches, &mut report, &mut said));
        }
        report.segments.push(stem);
    }
    let Said { mut refused, others } = said;
    Channels::usual().unused(others.iter().map(String::as_str)).into_iter().for_each(|what| report.note(what));
    one_of_copies(&mut loaded, &mut report);
    pair_by_header(&mut loaded, &mut report);
    set_clocks(&mut loaded, &mut report, &mut refused);
    let all = collected(&loaded, &mut report);
    one_glider(&loaded, &all, &report)?;
    apart(&loaded, &mut report);
    one_sided(&loaded, &mut report);
    match merge::merge(all, &mut report) {
        Some(flight) => Ok(Imported::new(flight, report)),
        None if refused.is_empty() => Err(ImportError {
            file: files.first().map_or_else(String::new, |f| name_of(f)),
            what: "no pressure in these files: sci_water_pressure, m_pressure or m_depth is needed".into(),
        }),
        None => Err(ImportError { file: "no file can be used".into(), what: refused.join("; ") }),
    }
}

/// Reads one computer's file of a segment (`of`: its number, and whether it is that of science), of `candidates` the first that can be
/// read; where that one is damaged, what the others have after its end too.
fn read_half(candidates: Vec<PathBuf>, of: (u32, bool), caches: &[PathBuf], report: &mut Report, said: &mut Said) -> Vec<Loaded> {
    let mut out: Vec<Loaded> = Vec::new();
    let mut failed: Option<String> = None;
    for path in candidates {
        if out.last().is_some_and(|l| l.file.problems.is_empty()) {
            break;
        }
        let name = name_of(&path);
        match read_file(&path, caches, &mut said.others) {
            Ok(mut file) if file.cycles > 0 => {
                if let Some(cut) = out.last() {
                    let end = clocks::span(&cut.file).map_or(f64::NAN, |s| s.1);
                    clocks::keep(&mut file, |t| t > end);
                    if file.cycles == 0 {
                        continue;
                    }
                    report.note(format!("{} is damaged: after its end {} cycles of {name} are taken", cut.name, file.cycles));
                }
                report.files.push(FileNote { file: name.clone(), rows: file.cycles, problems: file.problems.clone() });
                if let Some(failed) = failed.take() {
                    report.note(format!("{name} is used in the place of {failed}"));
                }
                out.push(Loaded { name, science: of.1, segment: of.0, file });
            }
            other => {
                let what = other.map_or_else(|e| e, |_| "holds no cycle".into());
                said.refused.push(format!("{name} {what}"));
                failed = Some(name.clone());
                report.files.push(FileNote { file: name, rows: 0, problems: vec![what] });
            }
        }
    }
    out
}

/// Every file's channels; of the CTD only what stands on the CTD's own computer where there is such a file.
fn collected(loaded: &[Loaded], report: &mut Report) -> Collected {
    let mut all = Collected::default();
    for one in loaded {
        // The vehicle's own files may repeat a few of the CTD's values, late and on another clock.
        let science = loaded.iter().any(|l| l.segment == one.segment && l.science && ctd::sensors_of(&l.file).is_some());
        collect(&mut all, report, one, one.science || !science);
    }
    all
}

/// Reads a file; of its names those that are no channel join the `others`.
fn read_file(path: &Path, caches: &[PathBuf], others: &mut BTreeSet<String>) -> Result<dbd::DbdFile, String> {
    let bytes = bounded::bytes(path, bounded::LOG).map_err(|e| format!("cannot be read: {e}"))?;
    if bytes.is_empty() {
        return Err("is empty".into());
    }
    let others = std::cell::RefCell::new(others);
    let wanted = |name: &str| {
        let wanted = CLOCKS.contains(&name) || sensor(name).is_some();
        if !wanted {
            others.borrow_mut().insert(name.to_owned());
        }
        wanted
    };
    if dba::is_dba(&bytes) {
        return dba::read(&bytes, wanted);
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    // "cache" is where dbd2asc looks.
    let usual = ["", "cac", "../cac", "cache", "../cache", "state/cache", "../state/cache"].map(|name| folder.join(name));
    let folders: Vec<PathBuf> = usual.into_iter().chain(caches.iter().cloned()).collect();
    let cache = |crc: &str| {
        folders.iter().find_map(|folder| {
            let named = |p: &PathBuf| {
                let stem = p.file_stem().is_some_and(|s| s.eq_ignore_ascii_case(crc));
                stem && is_list(p)
            };
            super::folder::files_of(folder).ok()?.into_iter().find(named).and_then(|p| bounded::bytes(&p, bounded::DOCUMENT).ok())
        })
    };
    dbd::read(&bytes, cache, wanted)
}

/// Takes over what one file has; of the CTD only if `with_ctd`.
fn collect(all: &mut Collected, report: &mut Report, one: &Loaded, with_ctd: bool) {
    let (file, segment) = (&one.file, one.segment);
    let stated = clocks::clock(file).cloned().unwrap_or_else(|| vec![f64::NAN; file.cycles]);
    report_untimed(one, &stated, report);
    let own = in_order(plausible_times(stated), one, "the file's clock", report);
    for (name, (unit, values)) in &file.columns {
        let Some(entry) = sensor(name) else { continue };
        if name.starts_with("sci_rbrctd") && !ctd::sensors_of(file).is_some_and(|of| of.contains(&name.as_str())) {
            continue;
        }
        let Some((offset, factor)) = entry.in_si(unit) else {
            report.leave_out(format!("{name} is in {unit}, which is not known for it"));
            continue;
        };
        if name != GPS_STATUS {
            report.map(MappedName { from: name.clone(), unit: unit.clone(), to: entry.column.clone(), factor });
        }
        if name.starts_with("sci_") {
            continue;
        }
        let held = all.channels.entry(name.clone()).or_default();
        held.time_s.extend(&own);
        held.value.extend(values.iter().map(|v| (v - offset) * factor));
    }
    let finite = own.iter().copied().filter(|t| t.is_finite() && (!one.science || !all.spans.contains_key(&segment)));
    if let (Some(first), Some(last)) = (finite.clone().reduce(f64::min), finite.reduce(f64::max)) {
        let span = all.spans.entry(segment).or_insert((first, last));
        *span = (span.0.min(first), span.1.max(last));
    }
    if with_ctd {
        ctd::ctd_rows(all, report, one, own);
    }
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
