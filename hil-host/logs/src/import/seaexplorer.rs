//! Raw text files of a SeaExplorer: `seaNNN.M.gli.sub.C` of the navigation computer and `seaNNN.M.pld1.sub.C` or `.raw.C` of the
//! payload, plain or gzipped; C is the cycle, from one surfacing to the next, and becomes a segment.
//!
//! Pitch is nose up, roll starboard down, both degrees; ballast is cm³ buoyant; the battery's position is mm, forward.
//! Conductivity is mS/cm for LEGATO and S/m for GPCTD and SBD. A value of 9999 is none.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::assembly::{Log, Row};
use super::classes::Class;
use super::clocks::{CLOCKS_APART_S, LONGEST_MISSION_S, stray_times};
use super::position::{Fix, degrees_of_minutes};
use super::reader::Reader;
use super::report::list_of;
use super::two_computers::{Ctd, covered, rows_by_segment};
use super::{FileNote, ImportError, Imported, MappedName, Report, join, pressure_zero};
use crate::channels::Channels;
use crate::record::resample::Series;
use crate::record::seawater;

mod text;

use text::{Dates, Table};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Raw text of a SeaExplorer.
pub(super) const SEAEXPLORER: Reader =
    Reader { name: "SeaExplorer raw files", claims: |path| name_of(path).is_some(), import: |files, _| import(files), ..Reader::PLAIN };

/// What a file name says.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name {
    /// Glider.
    pub glider: u32,
    /// Mission.
    pub mission: u32,
    /// Cycle.
    pub cycle: u32,
    /// Payload, else navigation.
    pub payload: bool,
    /// All samples, as taken from the glider; else the few sent ashore.
    pub raw: bool,
}

/// Glider, mission, cycle and kind by the name, with the copies' "(1)" of browsers, in either case.
#[must_use]
pub fn name_of(path: &Path) -> Option<Name> {
    let mut name = path.file_name()?.to_str()?.to_ascii_lowercase();
    while let (Some(open), Some(close)) = (name.find(" ("), name.find(')')) {
        if close < open {
            break;
        }
        name.replace_range(open..=close, "");
    }
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let [glider, mission, stream, kind, cycle] = name.split('.').collect::<Vec<_>>()[..] else { return None };
    let payload = match stream {
        "gli" => false,
        "pld1" => true,
        _ => return None,
    };
    let raw = match kind {
        "sub" => false,
        "raw" => true,
        _ => return None,
    };
    let glider = glider.strip_prefix("sea")?.parse().ok()?;
    Some(Name { glider, mission: mission.parse().ok()?, cycle: cycle.parse().ok()?, payload, raw })
}

/// Imports the files of one mission of one glider.
///
/// # Errors
/// Files of two gliders or missions; no CTD pressure.
pub fn import(files: &[PathBuf]) -> Result<Imported, ImportError> {
    match import_dated(files, false)? {
        Some(imported) => Ok(imported),
        None => {
            let mut imported = import_dated(files, true)?.ok_or_else(|| ImportError::new(&files[0], "has dates of both orders"))?;
            imported.report.note("dates have the month first, unlike a glider's own: saved again by a program?".into());
            Ok(imported)
        }
    }
}

/// The same with dates read in one order; none if it is the wrong one.
fn import_dated(files: &[PathBuf], month_first: bool) -> Result<Option<Imported>, ImportError> {
    let folder = files.first().and_then(|f| f.parent()).unwrap_or(Path::new("."));
    let named: Vec<(Name, &PathBuf)> = files.iter().filter_map(|f| Some((name_of(f)?, f))).collect();
    let missions: BTreeSet<(u32, u32)> = named.iter().map(|(n, _)| (n.glider, n.mission)).collect();
    let Some(&(glider, mission)) = missions.first() else { return Err(ImportError::new(folder, "has no SeaExplorer files")) };
    if missions.len() > 1 {
        let list: Vec<String> = missions.iter().map(|(g, m)| format!("SEA{g:03} mission {m}")).collect();
        return Err(ImportError::new(folder, format!("files of {}: import one mission at a time", list.join(", "))));
    }
    let mut report = Report::new("SeaExplorer raw files");
    let chosen = fullest(&named, month_first, &mut report);
    let cycles: Vec<u32> = chosen.keys().map(|k| k.0).collect::<BTreeSet<_>>().into_iter().collect();
    let Reading { mut log, mut columns, mut counts, starts, dates } = read(&chosen, &cycles, month_first, &mut report);
    if dates.turned() {
        return Ok(None);
    }
    compare_halves(&cycles, &starts, &mut report);
    let begins: Vec<(u32, f64)> =
        cycles.iter().filter_map(|c| Some((*c, *starts.get(&(*c, true)).or(starts.get(&(*c, false)))?))).collect();
    join::numbered("cycle", &begins, &mut report);
    if columns.without_pressure > 0 {
        report.note(format!("{} rows of the payload have no pressure of the CTD: no rows of the flight", columns.without_pressure));
    }
    columns.finish(&mut log, &mut report);
    columns.without_ctd(&mut log, &cycles, &mut report);
    counts.say(&mut report);
    log.fixes = std::mem::take(&mut counts.fixes);
    let step =
        |rows: &[Row]| crate::record::plausible::quantile(&rows.windows(2).map(|w| w[1].unix_s - w[0].unix_s).collect::<Vec<_>>(), 0.5);
    report.note(format!(
        "SEA{glider:03}, mission {mission}, cycles {} to {}: payload every {:.1} s, {}",
        cycles.first().unwrap_or(&0),
        cycles.last().unwrap_or(&0),
        step(&log.rows),
        if columns.step_s.is_finite() { format!("navigation every {:.1} s", columns.step_s) } else { "no navigation".into() }
    ));
    let place = log.fixes.first().map(|f| seawater::Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg });
    report.density_from("conductivity, temperature, pressure", place, log.rows.iter().any(|r| r.conductivity_s_m.is_finite()));
    report.segments = cycles.iter().map(|c| format!("cycle {c}")).collect();
    let problems: Vec<String> = report.files.iter().flat_map(|f| f.problems.iter().map(move |p| format!("{} {p}", f.file))).collect();
    let flight = log.flight(&format!("sea{glider:03}-{mission}"), &mut report).ok_or_else(|| {
        let problems: Vec<String> = problems.into_iter().chain(report.left_out.iter().cloned()).collect();
        let why = if problems.is_empty() {
            "no payload file with a CTD pressure beside it, and no depth".to_owned()
        } else {
            problems.join("; ")
        };
        ImportError::new(folder, why)
    })?;
    let mut vehicle = Class::SeaExplorer.draft();
    vehicle.say("case", &format!("sea{glider:03}"), "");
    Ok(Some(Imported { vehicle: Some(vehicle), ..Imported::new(flight, report) }))
}

/// Of each cycle and stream (payload: true) the file with the most rows, of as many the raw one, which has all that the sent one has.
fn fullest<'a>(named: &[(Name, &'a PathBuf)], month_first: bool, report: &mut Report) -> BTreeMap<(u32, bool), &'a PathBuf> {
    let mut all: BTreeMap<(u32, bool), Vec<(&Name, &'a PathBuf)>> = BTreeMap::new();
    named.iter().for_each(|(name, path)| all.entry((name.cycle, name.payload)).or_default().push((name, path)));
    let rows = |path: &Path| Table::open(path, month_first).map_or(0, Table::count);
    let one = |(key, files): ((u32, bool), Vec<(&Name, &'a PathBuf)>)| {
        let [single] = files.as_slice() else {
            let mut counted: Vec<(usize, &(&Name, &'a PathBuf))> = files.iter().map(|f| (rows(f.1), f)).collect();
            // Of two alike the first by name.
            counted.sort_by_key(|(rows, (name, _))| (std::cmp::Reverse(*rows), !name.raw));
            let (most, taken) = counted[0];
            for (rows, passed) in counted.iter().skip(1).filter(|c| c.0 < most && (c.1.0.raw || !taken.0.raw)) {
                let name = |file: &(&Name, &PathBuf)| file.1.file_name().unwrap_or_default().to_string_lossy().into_owned();
                report.note(format!("{} passed over for {}: it has {rows} rows, the other {most}", name(passed), name(taken)));
            }
            return (key, taken.1);
        };
        (key, single.1)
    };
    all.into_iter().map(one).collect()
}

/// What the files of a mission hold.
#[derive(Default)]
struct Reading {
    log: Log,
    columns: Columns,
    counts: Counts,
    /// First time of each cycle and stream (payload: true), Unix s.
    starts: BTreeMap<(u32, bool), f64>,
    dates: Dates,
}

/// Reads the files `chosen` of each cycle and stream.
fn read(chosen: &BTreeMap<(u32, bool), &PathBuf>, cycles: &[u32], month_first: bool, report: &mut Report) -> Reading {
    let mut all = Reading { dates: Dates { month_first, ..Dates::default() }, ..Reading::default() };
    let Reading { log, columns, counts, starts, dates } = &mut all;
    let mut names = BTreeSet::new();
    for ((cycle, payload), path) in chosen {
        let segment = cycles.binary_search(cycle).unwrap_or(0) as u32;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut note = FileNote { file: name.clone(), rows: 0, problems: Vec::new() };
        match Table::open(path, month_first) {
            Err(why) => note.problems.push(why),
            Ok(mut table) => {
                let (rows, times) = (log.rows.len(), columns.time.len());
                let got = if *payload {
                    columns.payload(&mut table, segment, log, report)
                } else {
                    columns.navigation(&mut table, segment, counts)
                };
                let read: Vec<f64> =
                    if *payload { log.rows[rows..].iter().map(|r| r.unix_s).collect() } else { columns.time[times..].to_vec() };
                if !read.is_empty() {
                    starts.insert((*cycle, *payload), read.iter().copied().fold(f64::INFINITY, f64::min));
                }
                note.rows = table.rows;
                note.problems.extend(table.problem.take());
                names.extend(table.names().map(str::to_owned));
                if let Some(name) = table.twice() {
                    note.problems.push(format!("column {name} stands twice: the first one is read"));
                }
                note.problems.extend(got.err());
                if let Some(first) = table.no_time.take() {
                    let count = table.undated;
                    let expected = "dd/mm/yyyy HH:MM:SS is expected";
                    report.leave_out(format!(
                        "{name}: {count} rows without a time or before the clock was set ({expected}, first: \"{first}\")"
                    ));
                }
                if table.other_length > 0 {
                    let count = table.other_length;
                    report.leave_out(format!("{name}: {count} rows have another number of values than there are columns: cut?"));
                }
                if table.commas {
                    report.note("decimal commas in these files: a program saved them again?".into());
                }
                dates.join(table.dates);
            }
        }
        report.files.push(note);
    }
    Channels::usual().unused(names.iter().map(String::as_str)).into_iter().for_each(|what| report.note(what));
    all
}

/// Names cycles without one of their two files, and those whose two clocks differ; `starts` are of each cycle and stream (payload: true).
fn compare_halves(cycles: &[u32], starts: &BTreeMap<(u32, bool), f64>, report: &mut Report) {
    for cycle in cycles {
        let apart_s = starts.get(&(*cycle, true)).zip(starts.get(&(*cycle, false))).map_or(0.0, |(a, b)| a - b);
        if apart_s.is_finite() && apart_s.abs() > CLOCKS_APART_S {
            report.leave_out(format!("cycle {cycle}: the clocks of payload and navigation stand {apart_s:+.0} s apart"));
        }
        match [false, true].map(|payload| starts.contains_key(&(*cycle, payload))) {
            [true, false] => {
                report.leave_out(format!("cycle {cycle}: no payload file (pld1) that can be read: its navigation has no rows to stand on"))
            }
            [false, true] => report.note(format!("cycle {cycle} has no navigation file (gli): without pitch and ballast")),
            _ => {}
        }
    }
}

/// Channels of the navigation computer as they are read.
#[derive(Default)]
struct Columns {
    time: Vec<f64>,
    segment: Vec<u32>,
    /// Pitch, roll, heading, ballast, battery, depth.
    values: [Vec<f64>; 6],
    step_s: f64,
    lat_deg: f64,
    /// Rows of the payload in which the CTD has no pressure.
    without_pressure: usize,
    ctd: Option<&'static str>,
}

/// A cycle goes deeper than this, Pa; a CTD that shows less than a share of what the depth says was off (guess).
const DIVE_PA: f64 = 1e5;
const CTD_OFF: f64 = 0.2;

/// Depths whose middle lies further than this in the air grow upward, m.
const UPWARD_M: f64 = 1.0;

/// Fixes used, and what was no fix.
#[derive(Default)]
struct Counts {
    fixes: Vec<Fix>,
    computed: usize,
    repeated: usize,
    zero: usize,
    under_way: usize,
}

impl Counts {
    fn say(&self, report: &mut Report) {
        report.note(format!(
            "{} GPS fixes; no fixes are {} computed positions, {} repeated ones, {} of zero, {} under way",
            self.fixes.len(),
            self.computed,
            self.repeated,
            self.zero,
            self.under_way
        ));
    }
}

/// Columns of the navigation file: name, channel of the flight, factor to SI.
const NAVIGATION: [(&str, &str, f64); 6] = [
    ("Pitch", "m_pitch_rad", DEGREE),
    ("Roll", "m_roll_rad", DEGREE),
    ("Heading", "m_heading_rad", DEGREE),
    ("BallastPos", "m_ballast_pumped_cc", 1e-6),
    ("LinPos", "m_battpos_m", 1e-3),
    ("Depth", crate::record::clock_offset::ENGINEERING_PRESSURE, 1.0),
];

/// CTDs by the start of their columns, with the factor of conductivity to S/m.
const CTDS: [(&str, f64); 3] = [("LEGATO", 0.1), ("GPCTD", 1.0), ("SBD", 1.0)];

/// States in which the position is a fix: at the surface, and so in newer firmware.
const AT_SURFACE: [f64; 2] = [116.0, 119.0];

impl Columns {
    fn navigation(&mut self, table: &mut Table, segment: u32, counts: &mut Counts) -> Result<(), String> {
        let time = table.column("Timestamp").ok_or("has no column Timestamp")?;
        let places = NAVIGATION.map(|(name, ..)| table.column(name));
        let [state, lat, lon, computed] = ["NavState", "Lat", "Lon", "DeadReckoning"].map(|n| table.column(n));
        let mut under_water: Option<(f64, f64)> = None;
        let mut raw = String::new();
        while let Some(fields) = table.next(&mut raw) {
            let Some(unix) = table.time(&fields, time) else { continue };
            self.time.push(unix);
            self.segment.push(segment);
            for (column, place) in self.values.iter_mut().zip(places) {
                column.push(place.map_or(f64::NAN, |p| fields.number(p)));
            }
            let number = |place: Option<usize>| place.map_or(f64::NAN, |p| fields.number(p));
            let (lat, lon) = (degrees_of_minutes(number(lat)), degrees_of_minutes(number(lon)));
            if !lat.is_finite() || !lon.is_finite() {
                continue;
            }
            if lat == 0.0 && lon == 0.0 {
                counts.zero += 1;
            } else if !AT_SURFACE.contains(&number(state)) {
                counts.under_way += 1;
                under_water = Some((lat, lon));
            } else if number(computed) == 1.0 {
                counts.computed += 1;
            } else if under_water == Some((lat, lon)) {
                // What was shown under water is the fix before.
                counts.repeated += 1;
            } else {
                counts.fixes.push(Fix { time_s: unix, lat_deg: lat, lon_deg: lon });
            }
        }
        Ok(())
    }

    fn payload(&mut self, table: &mut Table, segment: u32, log: &mut Log, report: &mut Report) -> Result<(), String> {
        let time = table.column("PLD_REALTIMECLOCK").ok_or("has no column PLD_REALTIMECLOCK")?;
        let found = CTDS.iter().find_map(|(ctd, factor)| Some((*ctd, *factor, table.column(&format!("{ctd}_PRESSURE"))?)));
        let (ctd, factor, pressure) = found.ok_or("has no column LEGATO_PRESSURE, GPCTD_PRESSURE or SBD_PRESSURE")?;
        let [temperature, conductivity] = ["TEMPERATURE", "CONDUCTIVITY"].map(|n| table.column(&format!("{ctd}_{n}")));
        self.ctd = Some(ctd);
        for (name, unit, to, factor) in [
            ("PRESSURE", "dbar", "pressure_dbar", 1e4),
            ("TEMPERATURE", "degC", "sci_water_temp_degC", 1.0),
            ("CONDUCTIVITY", if factor == 1.0 { "S/m" } else { "mS/cm" }, "sci_density_kg_m3", factor),
        ] {
            report.map(MappedName { from: format!("{ctd}_{name}"), unit: unit.into(), to: to.into(), factor });
        }
        let (mut raw, mut without) = (String::new(), 0);
        while let Some(fields) = table.next(&mut raw) {
            let number = |place: Option<usize>| place.map_or(f64::NAN, |p| fields.number(p));
            let dbar = fields.number(pressure);
            let Some(unix_s) = table.time(&fields, time) else { continue };
            if !dbar.is_finite() {
                without += 1;
                continue;
            }
            let row = Row::at(unix_s, segment, dbar * 1e4);
            log.rows.push(Row { temperature_degc: number(temperature), conductivity_s_m: number(conductivity) * factor, ..row });
        }
        self.without_pressure += without;
        Ok(())
    }

    /// Cycles whose CTD was off lose its samples; without any of the CTD the depth of the navigation makes the rows.
    fn without_ctd(&self, log: &mut Log, cycles: &[u32], report: &mut Report) {
        let segment_at: BTreeMap<u64, u32> = self.time.iter().map(|t| t.to_bits()).zip(self.segment.iter().copied()).collect();
        let of_cycle = |(t, p): (f64, f64)| Some((*segment_at.get(&t.to_bits())?, t, p));
        let own = rows_by_segment(log.steering_pressure.pairs().filter_map(of_cycle));
        let ctd = rows_by_segment(log.rows.iter().map(|r| (r.segment, r.unix_s, r.pressure_pa)));
        let deepest = |of: &[(f64, f64)]| of.iter().map(|r| r.1).filter(|p| p.is_finite()).fold(0.0, f64::max);
        let (mut holes, mut off_min, mut all_min, mut off) = (Vec::new(), 0, 0, BTreeSet::new());
        for (segment, cycle) in (0_u32..).zip(cycles) {
            let [own, ctd] = [&own, &ctd].map(|of| of.get(&segment).map_or(&[][..], Vec::as_slice));
            let (depth, reached, had) = (deepest(own), deepest(ctd), ctd.len());
            if had > 0 && depth > DIVE_PA && reached < CTD_OFF * depth {
                let (reached, depth) = (reached * 1e-4, depth * 1e-4);
                report.leave_out(format!(
                    "cycle {cycle}: the CTD was off: its {had} samples reach {reached:.1} dbar, the vehicle {depth:.1} dbar"
                ));
                off.insert(segment);
                continue;
            }
            let (off, all) = match covered(own, ctd) {
                Ctd::Missing(off, all) => (off, all),
                Ctd::Off(ran, all) if had > 0 => (all.saturating_sub(ran), all),
                _ => continue,
            };
            holes.push(cycle.to_string());
            (off_min, all_min) = (off_min + off, all_min + all);
        }
        log.rows.retain(|r| !off.contains(&r.segment));
        if !holes.is_empty() {
            let cycles = list_of(&holes);
            // A payload is switched off to save energy, too.
            report
                .note(format!("cycles {cycles}: the CTD has no samples in {off_min} of {all_min} minutes under water, which have no rows"));
        }
        if log.rows.is_empty() && own.values().any(|of| deepest(of) > DIVE_PA) {
            report.leave_out("no CTD: rows are the vehicle's own depth, and density is missing".into());
            let row = |segment: u32, (unix_s, pressure_pa)| Row::at(unix_s, segment, pressure_pa);
            log.rows = own.into_iter().flat_map(|(segment, rows)| rows.into_iter().map(move |r| row(segment, r))).collect();
            log.steering_pressure = Series::default();
        }
    }

    /// Channels from what was read of all navigation files.
    fn finish(&mut self, log: &mut Log, report: &mut Report) {
        let stray = stray_times(&mut self.time, LONGEST_MISSION_S);
        if stray > 0 {
            report.leave_out(format!("{stray} rows of navigation further than 400 days from the others: a clock that was not set"));
        }
        for ((name, to, factor), column) in NAVIGATION.iter().zip(&mut self.values) {
            if column.iter().any(|v| v.is_finite()) {
                let unit = if *factor == DEGREE {
                    "deg"
                } else if *factor == 1e-6 {
                    "ml"
                } else if *factor == 1e-3 {
                    "mm"
                } else {
                    "m"
                };
                report.map(MappedName { from: (*name).into(), unit: unit.into(), to: (*to).into(), factor: *factor });
            }
            column.iter_mut().for_each(|v| *v *= factor);
        }
        pressure_zero::turn_upright(&mut self.values[5], "Depth", UPWARD_M, report);
        let [pitch, roll, heading, ballast, battery, depth] = &self.values;
        let series = |values: &[f64]| Series::new(&self.time, values);
        self.step_s = series(pitch).step_s();
        [log.pitch, log.roll, log.heading, log.ballast, log.battery] = [pitch, roll, heading, ballast, battery].map(|c| series(c).into());
        let pressure: Vec<f64> = depth.iter().map(|z| if *z > 0.0 { seawater::pressure_pa(*z, self.lat_deg) } else { f64::NAN }).collect();
        log.steering_pressure = series(&pressure);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_cycles_without_a_half_or_with_clocks_apart_are_named() {
        let starts: BTreeMap<(u32, bool), f64> =
            [((1, false), 0.0), ((1, true), 40.0), ((2, false), 1e4), ((2, true), 13.6e3), ((3, false), 2e4), ((4, true), 3e4)].into();
        let mut report = Report::new("made");
        compare_halves(&[1, 2, 3, 4], &starts, &mut report);
        assert_eq!(report.left_out.len(), 2, "{:?}", report.left_out);
        assert!(report.left_out[0].contains("cycle 2: the clocks") && report.left_out[0].contains("+3600 s apart"));
        assert!(report.left_out[1].contains("cycle 3: no payload file") && report.notes[0].contains("cycle 4 has no navigation file"));
    }

    #[test]
    fn names_are_read_in_either_case_and_with_the_copies_of_browsers() {
        let name = |s: &str| name_of(Path::new(s));
        let of = |cycle, payload, raw| Some(Name { glider: 35, mission: 10, cycle, payload, raw });
        assert_eq!(name("SEA035.10.gli.sub.012"), of(12, false, false));
        assert_eq!(name("sea035.10.pld1.raw.9.gz"), of(9, true, true));
        assert_eq!(name("SEA035.10.gli.sub (1).012"), of(12, false, false));
        assert_eq!(name("sea035.10.ad2cp.raw.9"), None);
        assert_eq!(name("sea035.10.msn"), None);
    }
}
