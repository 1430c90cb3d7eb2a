//! Slocum files of one flight become one flight: engineering (dbd, sbd, mbd) and science (ebd, tbd, nbd) merged.
//!
//! Rows are the CTD's samples; engineering channels are interpolated to them.
//! Without science files the vehicle's own pressure gives the rows, and there is
//! no density. One file pair is one segment, as the vehicle cuts its files at
//! the surface.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::dba;
use super::dbd::{self, DbdError};
use super::netcdf::names;
use super::{FileNote, ImportError, Imported, MappedName, Report};

mod clocks;
mod ctd;
mod merge;

use clocks::{apart, in_order, plausible_times, report_untimed, set_clocks};

/// Endings of engineering files, the fullest first.
const ENGINEERING: [&str; 6] = ["dbd", "dcd", "mbd", "mcd", "sbd", "scd"];
/// Endings of science files, the fullest first.
const SCIENCE: [&str; 6] = ["ebd", "ecd", "nbd", "ncd", "tbd", "tcd"];

/// Sensor names, the channel they fill, the unit they must have in the file, and the factor to SI.
const SENSORS: &[(&str, &str, &[&str], f64)] = &[
    ("m_pitch", "m_pitch_rad", &["rad"], 1.0),
    ("m_roll", "m_roll_rad", &["rad"], 1.0),
    ("m_heading", "m_heading_rad", &["rad"], 1.0),
    ("m_ballast_pumped", "m_ballast_pumped_cc", &["cc"], 1e-6),
    ("m_de_oil_vol", "m_ballast_pumped_cc", &["cc"], 1e-6),
    ("m_battpos", "m_battpos_m", &["in"], 0.0254),
    ("m_pressure", "pressure_dbar", &["bar"], 1e5),
    ("m_water_pressure", "pressure_dbar", &["bar"], 1e5),
    ("m_depth", "depth_m", &["m"], 1.0),
    ("sci_water_pressure", "pressure_dbar", &["bar"], 1e5),
    ("sci_water_temp", "sci_water_temp_degC", &["degc"], 1.0),
    ("sci_water_cond", "sci_density_kg_m3", &["s/m"], 1.0),
    ("sci_rbrctd_seapressure_00", "pressure_dbar", &["dbar"], 1e4),
    ("sci_rbrctd_pressure_00", "pressure_dbar", &["dbar"], 1e4),
    ("sci_rbrctd_temperature_00", "sci_water_temp_degC", &["degc"], 1.0),
    ("sci_rbrctd_conductivity_00", "sci_density_kg_m3", &["ms/cm"], 0.1),
    ("m_gps_lat", "gps_north_m", &["lat"], 1.0),
    ("m_gps_lon", "gps_east_m", &["lon"], 1.0),
    ("m_lat", "dr_north_m", &["lat"], 1.0),
    ("m_lon", "dr_east_m", &["lon"], 1.0),
    ("m_fin", "m_fin_rad", &["rad"], 1.0),
];
/// Clocks.
const CLOCKS: [&str; 5] = ["m_present_time", "sci_m_present_time", STAMPS[0], STAMPS[1], STAMPS[2]];
/// Clocks of the CTDs: one of them says which cycles carry a new sample.
const STAMPS: [&str; 3] = ["sci_ctd41cp_timestamp", "sci_rbrctd_timestamp", "sci_ctd41_timestamp"];
/// With fewer values than this a CTD's clock was never set.
const LEAST_STAMPS: usize = 15;

/// Whether a file name is one of these files.
#[must_use]
pub fn is_slocum(path: &Path) -> bool {
    ending(path).is_some_and(|e| ENGINEERING.contains(&e.as_str()) || SCIENCE.contains(&e.as_str()))
}

fn ending(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// Values of one sensor over all files, each with its time and segment.
#[derive(Default)]
struct Channel {
    time_s: Vec<f64>,
    value: Vec<f64>,
}

#[derive(Default)]
struct Collected {
    channels: BTreeMap<&'static str, Channel>,
    ctd: Vec<CtdRow>,
    /// First and last time of each segment's engineering file, s.
    spans: BTreeMap<u32, (f64, f64)>,
}

#[derive(Clone, Copy)]
struct CtdRow {
    time_s: f64,
    segment: u32,
    pressure_pa: f64,
    temperature_degc: f64,
    conductivity_s_m: f64,
}

/// A file that was read.
struct Loaded {
    name: String,
    science: bool,
    segment: u32,
    file: dbd::DbdFile,
}

/// Reads all `files` of one flight; sensor lists are looked for beside them, in a folder `cac` there, and in `caches`.
///
/// # Errors
/// [`ImportError`] when nothing usable remains, or files of two gliders are given; what is merely damaged is in the report.
pub fn import(files: &[PathBuf], caches: &[PathBuf]) -> Result<Imported, ImportError> {
    let mut report = Report::new(if files.iter().any(|f| is_slocum(f)) { "Slocum binary" } else { "Slocum text (dba)" });
    let files = &without_copies(files, &mut report);
    let mut loaded: Vec<Loaded> = Vec::new();
    let mut refused: Vec<String> = Vec::new();
    for (segment, (stem, sides)) in (0_u32..).zip(pairs(files)) {
        for (side, candidates) in sides.into_iter().enumerate() {
            let mut failed: Option<String> = None;
            for path in candidates {
                let name = name_of(&path);
                match read_file(&path, caches) {
                    Ok(file) if file.cycles > 0 => {
                        report.files.push(FileNote { file: name.clone(), rows: file.cycles, problems: file.problems.clone() });
                        if let Some(failed) = failed {
                            report.note(format!("{name} is used in the place of {failed}"));
                        }
                        loaded.push(Loaded { name, science: side == 1, segment, file });
                        break;
                    }
                    other => {
                        let what = other.map_or_else(|e| e, |_| "holds no cycle".into());
                        refused.push(format!("{name} {what}"));
                        failed = Some(name.clone());
                        report.files.push(FileNote { file: name, rows: 0, problems: vec![what] });
                    }
                }
            }
        }
        report.segments.push(stem);
    }
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

/// Halves of one segment whose files were renamed apart become one again, by the name that both headers state.
fn pair_by_header(loaded: &mut [Loaded], report: &mut Report) {
    let stated = |one: &Loaded| one.file.header.get("full_filename").cloned();
    let has = |all: &[Loaded], segment: u32, science: bool| all.iter().any(|l| l.segment == segment && l.science == science);
    for k in (0..loaded.len()).filter(|k| loaded[*k].science).collect::<Vec<_>>() {
        let (own, name) = (loaded[k].segment, stated(&loaded[k]));
        let of_name = |l: &&Loaded| !l.science && stated(l) == name && !has(loaded, l.segment, true);
        let mut others = loaded.iter().filter(of_name).filter(|_| name.is_some() && !has(loaded, own, false));
        if let (Some(other), None) = (others.next(), others.next()) {
            let segment = other.segment;
            report.note(format!("{} and {} are of one segment by their headers", loaded[k].name, other.name));
            loaded[k].segment = segment;
        }
    }
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

/// Files of one glider follow one another; so much of an overlap is a clock that was set, s.
const OVERLAP_S: f64 = 60.0;

/// Files that overlap in time are of two gliders.
fn one_glider(loaded: &[Loaded], all: &Collected, report: &Report) -> Result<(), ImportError> {
    let error = |what: String| Err(ImportError { file: "files do not belong together".into(), what });
    let names: std::collections::BTreeSet<String> = loaded.iter().filter_map(|l| glider_of(&l.file)).collect();
    if names.len() > 1 {
        let list: Vec<String> = names.into_iter().collect();
        return error(format!(
            "files of {} gliders by their headers ({}): import one glider's files at a time",
            list.len(),
            list.join(", ")
        ));
    }
    let spans: Vec<(u32, (f64, f64))> = all.spans.iter().map(|(k, s)| (*k, *s)).collect();
    let named = |segment: u32| report.segments.get(segment as usize).cloned().unwrap_or_default();
    for (k, (a, span_a)) in spans.iter().enumerate() {
        for (b, span_b) in &spans[k + 1..] {
            let overlap = span_a.1.min(span_b.1) - span_a.0.max(span_b.0);
            if overlap > OVERLAP_S {
                let (a, b) = (named(*a), named(*b));
                let why = if names.is_empty() {
                    "files of two gliders? import one glider's files at a time"
                } else {
                    "two copies of one segment, a clock that was set, or two gliders? name the files of one"
                };
                return error(format!("{a} and {b} overlap by {overlap:.0} s: {why}"));
            }
        }
    }
    Ok(())
}

/// Names segments without one of the two computers' files where others have both.
fn one_sided(loaded: &[Loaded], report: &mut Report) {
    let has = |segment: u32, science: bool| loaded.iter().any(|l| l.segment == segment && l.science == science);
    let segments: std::collections::BTreeSet<u32> = loaded.iter().map(|l| l.segment).collect();
    if !segments.iter().any(|s| has(*s, true) && has(*s, false)) {
        return;
    }
    for segment in segments {
        let what = match (has(segment, false), has(segment, true)) {
            (true, false) => "no science file (.ebd, .tbd): without density",
            (false, true) => "no engineering file (.dbd, .sbd): without pitch and ballast",
            _ => continue,
        };
        let name = report.segments.get(segment as usize).cloned().unwrap_or_default();
        report.note(format!("{name} has {what}"));
    }
}

/// The files without those that hold the same bytes as one before them.
fn without_copies(files: &[PathBuf], report: &mut Report) -> Vec<PathBuf> {
    let length = |p: &PathBuf| std::fs::metadata(p).map_or(0, |m| m.len());
    let mut kept: BTreeMap<u64, Vec<&PathBuf>> = BTreeMap::new();
    let mut out = Vec::new();
    // Of two alike the one stays whose other half has the same name.
    let mut stems: BTreeMap<Option<&std::ffi::OsStr>, usize> = BTreeMap::new();
    files.iter().for_each(|p| *stems.entry(p.file_stem()).or_default() += 1);
    let mut files: Vec<&PathBuf> = files.iter().collect();
    files.sort_by_key(|p| stems.get(&p.file_stem()).is_none_or(|n| *n < 2));
    for path in files {
        let alike = kept.entry(length(path)).or_default();
        let bytes = |p: &PathBuf| std::fs::read(p).ok().filter(|b| !b.is_empty());
        let own = if alike.is_empty() { None } else { bytes(path) };
        match alike.iter().find(|other| own.is_some() && bytes(other) == own) {
            Some(other) => report.note(format!("{} holds the same bytes as {}: read once", name_of(path), name_of(other))),
            None => {
                alike.push(path);
                out.push(path.clone());
            }
        }
    }
    out
}

/// The glider's name in the header of a file: what stands before the date in "unit_777-2026-122-1-0".
fn glider_of(file: &dbd::DbdFile) -> Option<String> {
    let full = file.header.get("full_filename").or_else(|| file.header.get("segment_filename_0"))?;
    let parts: Vec<&str> = full.split('-').collect();
    let number = |p: &&str| p.bytes().all(|b| b.is_ascii_digit()) && !p.is_empty();
    let date = (1..parts.len().checked_sub(3)?).find(|k| parts[*k].len() == 4 && parts[*k..].iter().all(number))?;
    Some(parts[..date].join("-").to_ascii_lowercase())
}

/// What a file is by its ending, or by its header if it is text: stem, side (engineering, science) and rank.
fn source(path: &Path) -> Option<(String, usize, usize)> {
    let (stem, end) = match ending(path).filter(|_| is_slocum(path)) {
        Some(end) => (path.file_stem()?.to_string_lossy().into_owned(), end),
        None => {
            let mut head = Vec::new();
            std::io::Read::read_to_end(&mut std::io::Read::take(std::fs::File::open(path).ok()?, 4096), &mut head).ok()?;
            let (header, _) = dba::header(&String::from_utf8_lossy(&head));
            let stem = header.get("segment_filename_0").or_else(|| header.get("the8x3_filename")).or_else(|| header.get("filename"))?;
            (stem.clone(), header.get("filename_extension")?.to_ascii_lowercase())
        }
    };
    let rank = |list: &[&str]| list.iter().position(|e| *e == end);
    rank(&ENGINEERING).map(|r| (stem.clone(), 0, r)).or_else(|| rank(&SCIENCE).map(|r| (stem, 1, r)))
}

/// Files by stem: of engineering and of science, the fullest first. Texts whose headers name the same file and kind hold parts of it, or a
/// name was never set: each is a segment of its own, under its file's name too.
fn pairs(files: &[PathBuf]) -> BTreeMap<String, [Vec<PathBuf>; 2]> {
    let known: Vec<(String, usize, usize, &PathBuf)> =
        files.iter().filter_map(|p| source(p).map(|(s, side, rank)| (s, side, rank, p))).collect();
    let mut of: BTreeMap<(&str, usize, usize), usize> = BTreeMap::new();
    known.iter().filter(|k| !is_slocum(k.3)).for_each(|k| *of.entry((&k.0, k.1, k.2)).or_default() += 1);
    let shared: std::collections::BTreeSet<&str> = of.into_iter().filter(|(_, n)| *n > 1).map(|((stem, ..), _)| stem).collect();
    let mut stems: BTreeMap<String, [Vec<(usize, PathBuf)>; 2]> = BTreeMap::new();
    for (stem, side, rank, path) in &known {
        let own = || name_of(path).split('.').next().unwrap_or_default().to_owned();
        let stem = if shared.contains(stem.as_str()) { format!("{stem} ({})", own()) } else { stem.clone() };
        stems.entry(stem).or_default()[*side].push((*rank, (*path).clone()));
    }
    let sorted = |mut side: Vec<(usize, PathBuf)>| {
        side.sort();
        side.into_iter().map(|(_, p)| p).collect()
    };
    stems.into_iter().map(|(stem, sides)| (stem, sides.map(sorted))).collect()
}

/// `named`, and beside it the file of the other computer: the fullest of the same stem.
#[must_use]
pub fn with_its_partner(named: &Path) -> Vec<PathBuf> {
    let folder = named.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some((stem, side, _)) = source(named) else { return vec![named.to_path_buf()] };
    let folder_files = super::kind::files_of(folder).unwrap_or_default();
    let partner = folder_files
        .into_iter()
        .filter(|p| is_slocum(p) == is_slocum(named) && p.as_path() != named)
        .filter_map(|p| Some((source(&p)?, p)))
        .filter(|((s, other, _), _)| *s == stem && *other != side)
        .min_by_key(|((.., rank), _)| *rank);
    [Some(named.to_path_buf()), partner.map(|p| p.1)].into_iter().flatten().collect()
}

fn read_file(path: &Path, caches: &[PathBuf]) -> Result<dbd::DbdFile, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("cannot be read: {e}"))?;
    if bytes.is_empty() {
        return Err("is empty".into());
    }
    let wanted = |name: &str| CLOCKS.contains(&name) || SENSORS.iter().any(|s| s.0 == name);
    if dba::is_dba(&bytes) {
        return dba::read(&bytes, wanted);
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    let folders = [folder.to_path_buf(), folder.join("cac"), folder.join("../cac")].into_iter().chain(caches.iter().cloned());
    let folders: Vec<PathBuf> = folders.collect();
    let cache = |crc: &str| {
        folders.iter().find_map(|folder| {
            let named = |p: &PathBuf| {
                let stem = p.file_stem().is_some_and(|s| s.eq_ignore_ascii_case(crc));
                stem && p.extension().is_some_and(|e| e.eq_ignore_ascii_case("cac") || e.eq_ignore_ascii_case("ccc"))
            };
            super::kind::files_of(folder).ok()?.into_iter().find(named).and_then(|p| std::fs::read(p).ok())
        })
    };
    dbd::read(&bytes, cache, wanted).map_err(|e: DbdError| e.to_string())
}

/// Takes over what one file has; of the CTD only if `with_ctd`.
fn collect(all: &mut Collected, report: &mut Report, one: &Loaded, with_ctd: bool) {
    let (file, segment) = (&one.file, one.segment);
    let clock = |names: &[&str]| {
        names.iter().find_map(|n| file.columns.get(*n)).map_or_else(|| vec![f64::NAN; file.cycles], |(_, values)| values.clone())
    };
    let stated = clock(&["m_present_time", "sci_m_present_time"]);
    report_untimed(one, &stated, report);
    let own = in_order(plausible_times(stated), one, "the file's clock", report);
    for (name, channel, units, factor) in SENSORS {
        let Some((unit, values)) = file.columns.get(*name) else { continue };
        if name.starts_with("sci_rbrctd") && !ctd::sensors_of(file).is_some_and(|of| of.contains(name)) {
            continue;
        }
        let Some((offset, factor)) = in_si(name, unit, units, *factor) else {
            report.leave_out(format!("{name} is in {unit}, not in {}", units.join(" or ")));
            continue;
        };
        report.map(MappedName { from: (*name).into(), unit: unit.clone(), to: (*channel).into(), factor });
        if name.starts_with("sci_") {
            continue;
        }
        let held = all.channels.entry(name).or_default();
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

/// What is taken off a sensor's numbers, and by what they are multiplied then: by its usual units, else by those that other files have.
fn in_si(name: &str, unit: &str, usual: &[&str], factor: f64) -> Option<(f64, f64)> {
    if usual.iter().any(|u| u.eq_ignore_ascii_case(unit)) {
        return Some((0.0, factor));
    }
    let wanted = match name {
        "m_pressure" | "m_water_pressure" | "sci_water_pressure" | "sci_rbrctd_seapressure_00" | "sci_rbrctd_pressure_00" => {
            &names::PRESSURE
        }
        "sci_water_temp" | "sci_rbrctd_temperature_00" => &names::TEMPERATURE,
        "sci_water_cond" | "sci_rbrctd_conductivity_00" => &names::CONDUCTIVITY,
        "m_pitch" => &names::PITCH,
        "m_roll" => &names::ROLL,
        "m_heading" => &names::HEADING,
        "m_ballast_pumped" | "m_de_oil_vol" => &names::BALLAST,
        _ => return None,
    };
    wanted.in_si(unit)
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
