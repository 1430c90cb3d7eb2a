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

pub mod calendar;
pub(crate) mod channels;
pub mod classes;
pub mod comet;
pub mod current_profiler;
pub mod dba;
pub mod dbd;
pub mod draft;
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
mod surface;
pub mod table;
pub mod trim;

pub use report::{FileNote, ImportError, Imported, MappedName, Origin, Report};

use crate::record::csv;
use crate::record::flight::Flight;
use crate::record::plausible::{SAMPLED_EVERY, Step, implausible, quantile, usual_step};
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
        Err(e) => Err(ImportError { file: e.file, what: csv::in_one_line(&e.what) }),
    }
}

/// The same, with what the files say as they say it.
fn import_as_it_says(paths: &[PathBuf], caches: &[PathBuf], class: Option<Class>) -> Result<Imported, ImportError> {
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
    impossible_water(&mut imported);
    if kind == Kind::SlocumText && imported.report.segments.len() == 1 {
        surface::cut_anew(&mut imported, 2);
    }
    imported.report.find_missing(&imported.flight);
    pressure_zero::take_out_of_flight(&mut imported);
    check(&mut imported).map_err(|what| match imported.report.left_out.as_slice() {
        [] => ImportError::new(first, what),
        // What was lost before may be the cause.
        lost => ImportError::new(first, format!("{what} (left out before: {})", lost.join("; "))),
    })?;
    state_vehicle(&mut imported, kind, class);
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
    surface::cut_anew(&mut imported, 1);
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
            in_folders.extend(kind::files_of(path).map_err(|e| ImportError::new(path, format!("cannot be read: {e}")))?);
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
    if let [one] = files.as_slice()
        && matches!(kind, Kind::Slocum | Kind::SlocumText)
    {
        files = slocum::with_its_partner(&one.clone());
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
    let mut notes = Vec::new();
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
    folders.retain(|f| kind::files_of(f).is_ok_and(|files| files.iter().any(|p| Kind::of(p).is_some())));
    let names: Vec<String> = folders.iter().take(6).map(|f| f.display().to_string()).collect();
    if names.is_empty() { String::new() } else { format!(" itself; name a folder in it ({})", names.join(", ")) }
}

const KNOWN: &str = "Slocum binary (.dbd, .ebd ...), Seaglider dives (pNNNNNNN.nc), SeaExplorer (seaNNN.M.gli.sub.C with pld1), NetCDF (.nc) or csv is expected";

/// The vehicle: what the files say, else the class's usual numbers, and the hull volume checked against the flight.
fn state_vehicle(imported: &mut Imported, kind: Kind, class: Option<Class>) {
    let flight = &imported.flight;
    let deepest_dbar = quantile(&flight.pressure_pa, 1.0) * 1e-4;
    let mut draft = match (class, imported.vehicle.take()) {
        (None, Some(draft)) => draft,
        (Some(class), _) => class.draft(),
        (None, None) => {
            let class = match kind {
                Kind::Slocum | Kind::SlocumText => Class::slocum(deepest_dbar),
                _ => Class::Unknown,
            };
            imported
                .report
                .note(format!("vehicle: the files do not state it; usual numbers of the class {} with wide tolerances", class.name()));
            class.draft()
        }
    };
    let number = |key: &str| draft.get(key).unwrap_or(0.0);
    let hull = trim::Hull {
        mass_kg: number("mass_kg"),
        compressibility_per_pa: number("hull_compressibility_per_pa"),
        expansion_per_k: number("hull_thermal_expansion_per_k"),
        reference_degc: number("reference_temperature_degc"),
    };
    let stated = draft.get("hull_volume_m3");
    match (trim::find(flight, hull), stated) {
        (Some(found), None) => {
            draft.set("hull_volume_m3", found.hull_volume_m3, "from the flight: rises and sinks where it does");
            draft.set("tolerance_1sigma.trim_volume_cc", (found.sigma_m3 * 1e6).max(TRIM_CC), "of the volume found");
            imported.report.note(format!(
                "vehicle: hull volume from the flight {:.2} l, +- {:.0} cc for a mass of {} kg",
                found.hull_volume_m3 * 1e3,
                (found.sigma_m3 * 1e6).max(TRIM_CC),
                hull.mass_kg
            ));
        }
        (Some(found), Some(stated)) => {
            let off_cc = (found.hull_volume_m3 - stated) * 1e6;
            let floats = |volume: f64| hull.mass_kg / volume;
            let sigma_cc = draft.get("tolerance_1sigma.trim_volume_cc").unwrap_or(TRIM_CC).hypot(found.sigma_m3 * 1e6);
            if off_cc.abs() > 3.0 * sigma_cc {
                draft.set("hull_volume_m3", found.hull_volume_m3, &format!("from the flight; the files say {stated:.6}"));
                imported.report.note(format!(
                    "vehicle: as stated it floats at {:.1} kg/m3, the flight shows {:.1}: hull volume set to {:.2} l, +- {:.0} cc",
                    floats(stated),
                    floats(found.hull_volume_m3),
                    found.hull_volume_m3 * 1e3,
                    sigma_cc
                ));
            } else {
                imported.report.note(format!("vehicle: the flight shows {off_cc:+.0} cc of trim against the stated hull volume"));
            }
        }
        (None, stated) => {
            let water = quantile(&flight.density_kg_m3, 0.5);
            let water = if water.is_finite() { water } else { 1025.0 };
            if stated.is_none() {
                draft.set("hull_volume_m3", hull.mass_kg / water, "guess: neutral at ballast 0 in the middle of the water");
                draft.set("tolerance_1sigma.trim_volume_cc", 200.0, "guess");
                imported
                    .report
                    .note("vehicle: no steady dives and climbs to find the hull volume from; set to float in this water, +- 200 cc".into());
            }
        }
    }
    imported.vehicle = Some(draft);
}

/// Least tolerance of a hull volume found from a flight, cm³: what currents and the drag's unlike sides leave open.
const TRIM_CC: f64 = 50.0;

/// Refuses what cannot be in the unit it claims; notes what the flight cannot be used for.
fn check(imported: &mut Imported) -> Result<(), String> {
    let flight = &imported.flight;
    if !flight.time_s.windows(2).all(|w| w[1] > w[0]) {
        return Err("its times do not increase from row to row (a clock of damage?)".into());
    }
    if let Some((column, why)) = implausible(flight, ["pressure", "pitch", "ballast", "density"]) {
        return Err(format!("{column} {why}"));
    }
    let mut falling: Vec<f64> = flight.pressure_pa.iter().copied().filter(|p| p.is_finite()).collect();
    falling.sort_by(|a, b| b.total_cmp(a));
    // A few wrong rows make no dive, days at the surface do not hide one.
    let deep = falling.get(STRAY_ROWS.min(falling.len() / 100)).copied().unwrap_or(f64::NAN);
    if !(deep >= SHALLOW_PA) {
        return Err(format!("pressure never exceeds {:.4} dbar: no dive to compare with, or kbar or MPa instead of dbar?", deep * 1e-4));
    }
    let under_water = || (0..flight.len()).filter(|i| flight.pressure_pa[*i] > SHALLOW_PA);
    let without = under_water().filter(|i| flight.density_kg_m3[*i].is_nan()).count();
    if without * 100 > under_water().count() && flight.density_kg_m3.iter().any(|d| d.is_finite()) {
        imported.report.note(format!(
            "{without} of {} rows under water have no density: salinity, conductivity or temperature is missing there, or cannot be",
            under_water().count()
        ));
    }
    if let Some(share) = nose_up_in_descent(flight) {
        imported.report.note(format!(
            "pitch: the nose is up in {:.0} % of the rows that sink, or down where they rise: is nose down positive there? Turn its sign",
            100.0 * share
        ));
    }
    if let Some(off) = heavy_in_ascent(flight) {
        imported.report.note(format!(
            "ballast: it reads {:.0} cc more where the vehicle sinks than where it rises: does it count what weighs? Turn its sign",
            off * 1e6
        ));
    }
    let mut steps: Vec<f64> = flight.time_s.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    match steps.get(steps.len() / 2) {
        Some(step) if usual_step(*step) == Step::TooShort => {
            return Err(format!(
                "the usual step of time is {step} s; {SAMPLED_EVERY} (a clock that counts in another unit than it states?)"
            ));
        }
        Some(step) if usual_step(*step) == Step::TooLong => {
            imported.report.note(format!("samples are {step:.0} s apart: too sparse for a comparison: {SAMPLED_EVERY}"));
        }
        Some(step) if *step > BLOCK_STEP_S => {
            imported
                .report
                .note(format!("samples are {step:.0} s apart: blocks of 20 s, as the flight format has them, hold fewer than three"));
        }
        _ => {}
    }
    let needed = ["m_pitch_rad", "m_ballast_pumped_cc", "sci_density_kg_m3"];
    let lacking: Vec<&str> = needed.into_iter().filter(|n| imported.report.missing.iter().any(|m| m == n)).collect();
    if !lacking.is_empty() {
        imported.report.note(format!("a comparison needs {}, which this file does not have", lacking.join(" and ")));
        for column in lacking {
            let cannot = csv::cannot_be_asked(column).unwrap_or_default();
            imported.report.note(format!("without {column} {cannot}"));
        }
    }
    Ok(())
}

/// Temperatures and salinities that no water has become none, with the density that was computed from them.
fn impossible_water(imported: &mut Imported) {
    let flight = &mut imported.flight;
    let (degc, practical) = (netcdf::names::TEMPERATURE.possible(), netcdf::names::SALINITY.possible());
    let is_wrong = |t: f64| t.is_finite() && !degc.contains(&t);
    // Where most are it is the unit, which is refused with its name.
    let most = 2 * flight.temperature_degc.iter().filter(|t| is_wrong(**t)).count() > flight.len();
    let (mut hot, mut salty) = (0, 0);
    let mut salinity = flight.extra.get_mut(channels::SALINITY);
    for i in 0..flight.temperature_degc.len() {
        let wrong = !most && is_wrong(flight.temperature_degc[i]);
        let salinity = salinity.as_mut().and_then(|s| s.get_mut(i));
        let too_salty = !wrong && salinity.as_ref().is_some_and(|s| **s > *practical.end());
        if wrong {
            flight.temperature_degc[i] = f64::NAN;
        }
        if let Some(salinity) = salinity.filter(|_| wrong || too_salty) {
            *salinity = f64::NAN;
            flight.density_kg_m3[i] = f64::NAN;
        }
        hot += usize::from(wrong);
        salty += usize::from(too_salty);
    }
    let rows = flight.len();
    if hot > 0 {
        imported.report.note(format!("{hot} of {rows} temperatures are none of water (-3 to 45 degC): left out"));
    }
    if salty > 0 {
        let what = "salinities are above 45, from this conductivity: another unit than it states? They and their density are";
        imported.report.leave_out(format!("{salty} of {rows} {what} left out"));
    }
}

/// Share of the rows under way whose nose points up where they sink or down where they rise, where these are nearly all.
fn nose_up_in_descent(flight: &Flight) -> Option<f64> {
    let rows: Vec<(usize, f64)> = under_way(flight).filter(|(i, _)| flight.pitch_rad[*i].abs() > UNDER_WAY_RAD).collect();
    let against = rows.iter().filter(|(i, rate)| (*rate > 0.0) == (flight.pitch_rad[*i] > 0.0)).count();
    let share = against as f64 / rows.len() as f64;
    (rows.len() >= 50 && share > 0.9).then_some(share)
}

/// By how much the ballast reads more where the vehicle sinks than where it rises, m³, where that is more than hulls and water make.
fn heavy_in_ascent(flight: &Flight) -> Option<f64> {
    let known = |sinks: bool| under_way(flight).filter(move |(i, rate)| (*rate > 0.0) == sinks && flight.ballast_m3[*i].is_finite());
    let mean = |sinks: bool| known(sinks).map(|(i, _)| flight.ballast_m3[i]).sum::<f64>() / known(sinks).count() as f64;
    let off = mean(true) - mean(false);
    (known(true).count().min(known(false).count()) >= 25 && off > BALLAST_M3).then_some(off)
}

/// Rows that sink or rise, and how fast, Pa/s.
fn under_way(flight: &Flight) -> impl Iterator<Item = (usize, f64)> + '_ {
    let rate = |i: usize| (flight.pressure_pa[i + 1] - flight.pressure_pa[i]) / (flight.time_s[i + 1] - flight.time_s[i]);
    (0..flight.len().saturating_sub(1)).map(move |i| (i, rate(i))).filter(|(_, rate)| rate.abs() > UNDER_WAY_PA_S)
}

/// So many rows too deep may be wrong ones (guess).
const STRAY_ROWS: usize = 20;
/// Half of what a pump moves at the least, m³ (guess).
const BALLAST_M3: f64 = 20e-6;
/// A glider under way sinks or rises faster than 3 cm/s, Pa/s, with its nose more than 5 deg off the horizontal, rad.
const UNDER_WAY_PA_S: f64 = 300.0;
const UNDER_WAY_RAD: f64 = 0.087;
/// The comparison leaves out what is shallower than 2 m.
const SHALLOW_PA: f64 = 2e4;
/// Three samples in a block of 20 s.
const BLOCK_STEP_S: f64 = 9.0;
