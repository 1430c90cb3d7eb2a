//! Slocum files of one flight become one flight: engineering (dbd, sbd, mbd) and science (ebd, tbd, nbd) merged.
//!
//! Rows are the CTD's samples; engineering channels are interpolated to them.
//! Without science files the vehicle's own pressure gives the rows, and there is
//! no density. One file pair is one segment, as the vehicle cuts its files at
//! the surface.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::dbd::{self, DbdError};
use super::{FileNote, ImportError, Imported, MappedName, Report};
use crate::preprocess::clock_offset::ENGINEERING_PRESSURE;
use crate::record::flight::Flight;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

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
    ("sci_water_pressure", "pressure_dbar", &["bar"], 1e5),
    ("sci_water_temp", "sci_water_temp_degC", &["degc", "degC"], 1.0),
    ("sci_water_cond", "sci_density_kg_m3", &["S/m", "s/m"], 1.0),
    ("m_gps_lat", "gps_north_m", &["lat"], 1.0),
    ("m_gps_lon", "gps_east_m", &["lon"], 1.0),
    ("m_lat", "dr_north_m", &["lat"], 1.0),
    ("m_lon", "dr_east_m", &["lon"], 1.0),
    ("m_fin", "m_fin_rad", &["rad"], 1.0),
];
/// A channel that comes less often than this does not show a turn, which takes about a minute, s.
const SELDOM_S: f64 = 30.0;
/// Clocks.
const CLOCKS: [&str; 3] = ["m_present_time", "sci_m_present_time", "sci_ctd41cp_timestamp"];

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

/// Reads all `files` of one flight; sensor lists are looked for beside them, in a folder `cac` there, and in `caches`.
///
/// # Errors
/// [`ImportError`] when nothing usable remains; what is merely damaged is in the report.
pub fn import(files: &[PathBuf], caches: &[PathBuf]) -> Result<Imported, ImportError> {
    let stems = pairs(files);
    let mut report = Report { kind: "Slocum binary".into(), ..Report::default() };
    let mut all = Collected::default();
    let mut refused: Vec<String> = Vec::new();
    for (segment, (stem, members)) in (0_u32..).zip(stems) {
        let read: Vec<_> = members.into_iter().map(|path| (read_file(&path, caches), path)).collect();
        // The vehicle's own files may repeat a few of the CTD's values, late and on another clock.
        let of_science = |path: &Path| ending(path).is_some_and(|e| SCIENCE.contains(&e.as_str()));
        let has_ctd = |file: &dbd::DbdFile| file.columns.get("sci_water_pressure").is_some_and(|c| c.1.iter().any(|v| v.is_finite()));
        let science = read.iter().any(|(file, path)| of_science(path) && file.as_ref().is_ok_and(has_ctd));
        for (file, path) in read {
            match file {
                Ok(file) => {
                    report.files.push(FileNote { file: name_of(&path), rows: file.cycles, problems: file.problems.clone() });
                    collect(&mut all, &mut report, &file, segment, of_science(&path) || !science);
                }
                Err(what) => {
                    refused.push(format!("{} {what}", name_of(&path)));
                    report.files.push(FileNote { file: name_of(&path), rows: 0, problems: vec![what] });
                }
            }
        }
        report.segments.push(stem);
    }
    let flight = merge(all, &mut report);
    match flight {
        Some(flight) => Ok(Imported { flight, report }),
        None if refused.is_empty() => Err(ImportError {
            file: files.first().map_or_else(String::new, |f| name_of(f)),
            what: "no pressure in these files: sci_water_pressure or m_pressure is needed".into(),
        }),
        None => Err(ImportError { file: "no file can be used".into(), what: refused.join("; ") }),
    }
}

/// Files by stem, the fullest engineering and the fullest science file of each.
fn pairs(files: &[PathBuf]) -> Vec<(String, Vec<PathBuf>)> {
    let mut stems: BTreeMap<String, [Option<(usize, PathBuf)>; 2]> = BTreeMap::new();
    for path in files {
        let (Some(stem), Some(end)) = (path.file_stem(), ending(path)) else { continue };
        for (slot, list) in [ENGINEERING, SCIENCE].into_iter().enumerate() {
            let Some(rank) = list.iter().position(|e| *e == end) else { continue };
            let held = &mut stems.entry(stem.to_string_lossy().into_owned()).or_default()[slot];
            if held.as_ref().is_none_or(|(r, _)| rank < *r) {
                *held = Some((rank, path.clone()));
            }
        }
    }
    stems.into_iter().map(|(stem, slots)| (stem, slots.into_iter().flatten().map(|(_, p)| p).collect())).collect()
}

fn read_file(path: &Path, caches: &[PathBuf]) -> Result<dbd::DbdFile, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("cannot be read: {e}"))?;
    if bytes.is_empty() {
        return Err("is empty".into());
    }
    let beside = path.parent().unwrap_or(Path::new("."));
    let folders = [beside.to_path_buf(), beside.join("cac"), beside.join("../cac")].into_iter().chain(caches.iter().cloned());
    let folders: Vec<PathBuf> = folders.collect();
    let cache = |crc: &str| {
        let names = [format!("{crc}.cac"), format!("{crc}.ccc"), format!("{}.CAC", crc.to_uppercase())];
        folders.iter().flat_map(|f| names.iter().map(move |n| f.join(n))).find_map(|p| std::fs::read(p).ok())
    };
    let wanted = |name: &str| CLOCKS.contains(&name) || SENSORS.iter().any(|s| s.0 == name);
    dbd::read(&bytes, cache, wanted).map_err(|e: DbdError| e.to_string())
}

/// Takes over what one file has; of the CTD only if `with_ctd`.
fn collect(all: &mut Collected, report: &mut Report, file: &dbd::DbdFile, segment: u32, with_ctd: bool) {
    let clock = |names: &[&str]| {
        names.iter().find_map(|n| file.columns.get(*n)).map_or_else(|| vec![f64::NAN; file.cycles], |(_, values)| values.clone())
    };
    let own = in_order(plausible_times(clock(&["m_present_time", "sci_m_present_time"])), "the file's clock", report);
    for (name, channel, units, factor) in SENSORS {
        let Some((unit, values)) = file.columns.get(*name) else { continue };
        if !units.contains(&unit.as_str()) {
            report.note(format!("{name} is in {unit}, not in {}: left out", units.join(" or ")));
            continue;
        }
        report.map(MappedName { from: (*name).into(), unit: unit.clone(), to: (*channel).into(), factor: *factor });
        if name.starts_with("sci_") {
            continue;
        }
        let held = all.channels.entry(name).or_default();
        held.time_s.extend(&own);
        held.value.extend(values.iter().map(|v| v * factor));
    }
    let finite = own.iter().copied().filter(|t| t.is_finite());
    if let (Some(first), Some(last)) = (finite.clone().reduce(f64::min), finite.reduce(f64::max)) {
        let span = all.spans.entry(segment).or_insert((first, last));
        *span = (span.0.min(first), span.1.max(last));
    }
    if !with_ctd {
        return;
    }
    let science = |name: &str, factor: f64| -> Vec<f64> {
        file.columns.get(name).map_or_else(|| vec![f64::NAN; file.cycles], |(_, v)| v.iter().map(|v| v * factor).collect())
    };
    // The CTD's own clock says which cycles carry a new sample; without it every cycle does.
    let has_stamp = file.columns.contains_key("sci_ctd41cp_timestamp");
    let stamp =
        if has_stamp { in_order(plausible_times(science("sci_ctd41cp_timestamp", 1.0)), "the CTD's clock", report) } else { own.clone() };
    let (pressure, temperature, conductivity) =
        (science("sci_water_pressure", 1e5), science("sci_water_temp", 1.0), science("sci_water_cond", 1.0));
    for k in 0..file.cycles {
        let time_s = stamp[k];
        // A CTD that has just been switched on reports zeros.
        let switched_on = pressure[k] != 0.0 || temperature[k] != 0.0 || conductivity[k] != 0.0;
        if time_s.is_finite() && pressure[k].is_finite() && switched_on {
            all.ctd.push(CtdRow {
                time_s,
                segment,
                pressure_pa: pressure[k],
                temperature_degc: temperature[k],
                conductivity_s_m: conductivity[k],
            });
        }
    }
}

/// Damaged stretches can yield any number: times further than 30 days from the middle one are none.
fn plausible_times(mut times: Vec<f64>) -> Vec<f64> {
    let middle = crate::record::plausible::quantile(&times.iter().copied().filter(|t| *t > 1e8).collect::<Vec<_>>(), 0.5);
    for t in &mut times {
        if !((*t - middle).abs() < 30.0 * 86400.0) {
            *t = f64::NAN;
        }
    }
    times
}

/// Cycles whose time goes back become none: sorted in, they would lie between those of another time.
fn in_order(mut times: Vec<f64>, clock: &str, report: &mut Report) -> Vec<f64> {
    let (place, known): (Vec<usize>, Vec<f64>) = times.iter().copied().enumerate().filter(|(_, t)| t.is_finite()).unzip();
    let kept = crate::record::resample::longest_in_order(&known);
    if kept.len() < known.len() {
        let file = report.files.last().map_or_else(String::new, |f| f.file.clone());
        let out = known.len() - kept.len();
        report.note(format!("{file}: {clock} goes backwards, {out} of {} cycles are out of order: left out", known.len()));
        let mut in_order = vec![false; known.len()];
        kept.into_iter().for_each(|k| in_order[k] = true);
        for (row, _) in place.into_iter().zip(in_order).filter(|(_, good)| !good) {
            times[row] = f64::NAN;
        }
    }
    times
}

fn merge(mut all: Collected, report: &mut Report) -> Option<Flight> {
    let series: BTreeMap<&str, Series> = all.channels.iter().map(|(name, c)| (*name, Series::new(&c.time_s, &c.value))).collect();
    let empty = Series::default();
    let get = |name: &str| series.get(name).unwrap_or(&empty);
    let from_ctd = !all.ctd.is_empty();
    if !from_ctd {
        report.note("no CTD in these files: rows are the vehicle's own pressure, and density is missing".into());
        for (time_s, pressure_pa) in get("m_pressure").pairs() {
            let segment = all.spans.iter().find(|(_, s)| (s.0..=s.1).contains(&time_s)).map_or(0, |(k, _)| *k);
            all.ctd.push(CtdRow { time_s, segment, pressure_pa, temperature_degc: f64::NAN, conductivity_s_m: f64::NAN });
        }
    }
    all.ctd.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    all.ctd.dedup_by(|b, a| a.time_s == b.time_s);
    let first = all.ctd.first()?;
    let start_s = first.time_s;
    let unix: Vec<f64> = all.ctd.iter().map(|r| r.time_s).collect();
    let lat: Series = degrees(get("m_gps_lat"));
    let lon: Series = degrees(get("m_gps_lon"));
    let place = lat.pairs().next().zip(lon.pairs().next()).map(|((_, lat_deg), (_, lon_deg))| Place { lon_deg, lat_deg });
    report.density_from("sci_water_cond, sci_water_temp, sci_water_pressure", place, !all.ctd[0].conductivity_s_m.is_nan());
    // Shallow gliders have a pump, deep ones an oil bladder; the reading of the other is a fill, now and then.
    let (oil, other) = if get("m_ballast_pumped").len() >= get("m_de_oil_vol").len() {
        ("m_ballast_pumped", "m_de_oil_vol")
    } else {
        ("m_de_oil_vol", "m_ballast_pumped")
    };
    for name in ["m_pitch", oil] {
        let step_s = get(name).step_s();
        if step_s > SELDOM_S {
            report.note(format!("{name} comes every {step_s:.0} s only: interpolated, what happens in between, such as a turn, is lost"));
        }
    }
    report.mapped.retain(|m| m.from != other);
    for m in report.mapped.iter_mut().filter(|m| from_ctd && m.from == "m_pressure") {
        m.to = ENGINEERING_PRESSURE.into();
    }
    let mut flight = Flight {
        name: report.segments.first().cloned().unwrap_or_default(),
        time_s: unix.iter().map(|t| t - start_s).collect(),
        segment: all.ctd.iter().map(|r| r.segment).collect(),
        pressure_pa: all.ctd.iter().map(|r| r.pressure_pa).collect(),
        pitch_rad: get("m_pitch").on(&unix),
        roll_rad: get("m_roll").on(&unix),
        heading_rad: get("m_heading").angle_on(&unix),
        ballast_m3: get(oil).on(&unix),
        battery_mass_m: get("m_battpos").on(&unix),
        temperature_degc: all.ctd.iter().map(|r| r.temperature_degc).collect(),
        density_kg_m3: all.ctd.iter().map(|r| density(r, place)).collect(),
        gps_east_m: vec![f64::NAN; unix.len()],
        gps_north_m: vec![f64::NAN; unix.len()],
        ..Flight::default()
    };
    number_segments(&mut flight, report);
    let fixes = super::position::fixes(&lat, &lon);
    super::position::place(&mut flight, &unix, &fixes, report);
    super::position::dead_reckoning(&mut flight, &unix, &degrees(get("m_lat")), &degrees(get("m_lon")), &fixes);
    if !get("m_fin").is_empty() {
        flight.extra.insert("m_fin_rad".into(), get("m_fin").on(&unix));
    }
    // Beside the CTD's pressure that of the steering computer tells how far the two clocks are apart.
    if from_ctd && !get("m_pressure").is_empty() {
        let pressure = get("m_pressure").on(&unix);
        flight.extra.insert(ENGINEERING_PRESSURE.into(), pressure.iter().map(|p| p * 1e-4).collect());
    }
    report.start_unix_s = Some(start_s);
    Some(flight)
}

/// Segment numbers without holes, in the order of time.
fn number_segments(flight: &mut Flight, report: &mut Report) {
    let mut seen: Vec<u32> = Vec::new();
    for s in &mut flight.segment {
        let k = seen.iter().position(|k| k == s).unwrap_or_else(|| {
            seen.push(*s);
            seen.len() - 1
        });
        *s = k as u32;
    }
    report.segments = seen.iter().filter_map(|k| report.segments.get(*k as usize).cloned()).collect();
}

/// Slocum positions are ddmm.mmmm; fills such as 69696969 are no positions.
fn degrees(series: &Series) -> Series {
    let (time, value): (Vec<f64>, Vec<f64>) = series
        .pairs()
        .map(|(t, v)| {
            let whole = (v / 100.0).trunc();
            (t, whole + (v - 100.0 * whole) / 60.0)
        })
        .filter(|(_, v)| v.abs() <= 180.0 && *v != 0.0)
        .unzip();
    Series::new(&time, &value)
}

fn density(row: &CtdRow, place: Option<Place>) -> f64 {
    let pressure_dbar = row.pressure_pa * 1e-4;
    let practical = seawater::practical_salinity(row.conductivity_s_m, row.temperature_degc, pressure_dbar);
    seawater::density_of_water(practical, place, row.temperature_degc, pressure_dbar)
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
