//! Raw text files of a SeaExplorer: `seaNNN.M.gli.sub.C` of the navigation computer and `seaNNN.M.pld1.sub.C` or `.raw.C` of the
//! payload, plain or gzipped; C is the cycle, from one surfacing to the next, and becomes a segment.
//!
//! Pitch is nose up, roll starboard down, both degrees; ballast is cm³ buoyant; the battery's position is mm, forward.
//! Conductivity is mS/cm for LEGATO and S/m for GPCTD and SBD. A value of 9999 is none.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::channels::{self, LONGEST_MISSION_S, Log, Row};
use super::classes::Class;
use super::position::{Fix, degrees_of_minutes};
use super::{FileNote, ImportError, Imported, MappedName, Report};
use crate::record::resample::Series;
use crate::record::seawater;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

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
    let folder = files.first().and_then(|f| f.parent()).unwrap_or(Path::new("."));
    let named: Vec<(Name, &PathBuf)> = files.iter().filter_map(|f| Some((name_of(f)?, f))).collect();
    let missions: BTreeSet<(u32, u32)> = named.iter().map(|(n, _)| (n.glider, n.mission)).collect();
    let Some(&(glider, mission)) = missions.first() else { return Err(ImportError::new(folder, "has no SeaExplorer files")) };
    if missions.len() > 1 {
        let list: Vec<String> = missions.iter().map(|(g, m)| format!("SEA{g:03} mission {m}")).collect();
        return Err(ImportError::new(folder, format!("files of {}: import one mission at a time", list.join(", "))));
    }
    let mut report = Report::new("SeaExplorer raw files");
    // Of one cycle and stream the raw file has all that the sent one has.
    let mut chosen: BTreeMap<(u32, bool), (bool, &PathBuf)> = BTreeMap::new();
    for (name, path) in &named {
        let held = chosen.entry((name.cycle, name.payload)).or_insert((name.raw, path));
        if name.raw && !held.0 {
            *held = (true, path);
        }
    }
    let cycles: Vec<u32> = chosen.keys().map(|k| k.0).collect::<BTreeSet<_>>().into_iter().collect();
    let (mut log, mut columns, mut counts) = (Log::default(), Columns::default(), Counts::default());
    let mut starts: BTreeMap<(u32, bool), f64> = BTreeMap::new();
    for ((cycle, payload), (_, path)) in &chosen {
        let segment = cycles.binary_search(cycle).unwrap_or(0) as u32;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut note = FileNote { file: name.clone(), rows: 0, problems: Vec::new() };
        match Table::open(path) {
            Err(why) => note.problems.push(why),
            Ok(mut table) => {
                let (rows, times) = (log.rows.len(), columns.time.len());
                let got = if *payload {
                    columns.payload(&mut table, segment, &mut log, &mut report)
                } else {
                    columns.navigation(&mut table, &mut counts)
                };
                let read: Vec<f64> =
                    if *payload { log.rows[rows..].iter().map(|r| r.unix_s).collect() } else { columns.time[times..].to_vec() };
                starts.insert((*cycle, *payload), read.iter().copied().fold(f64::INFINITY, f64::min));
                note.rows = table.rows;
                note.problems.extend(table.problem.take());
                note.problems.extend(got.err());
                if table.undated > 0 {
                    report.leave_out(format!("{name}: {} rows without a time or before the clock was set", table.undated));
                }
            }
        }
        report.files.push(note);
    }
    compare_halves(&cycles, &starts, &mut report);
    columns.finish(&mut log, &mut report);
    counts.say(&mut report);
    log.fixes = std::mem::take(&mut counts.fixes);
    let step =
        |rows: &[Row]| crate::record::plausible::quantile(&rows.windows(2).map(|w| w[1].unix_s - w[0].unix_s).collect::<Vec<_>>(), 0.5);
    report.note(format!(
        "SEA{glider:03}, mission {mission}, cycles {} to {}: payload every {:.1} s, navigation every {:.1} s",
        cycles.first().unwrap_or(&0),
        cycles.last().unwrap_or(&0),
        step(&log.rows),
        columns.step_s
    ));
    let place = log.fixes.first().map(|f| seawater::Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg });
    report.density_from("conductivity, temperature, pressure", place, log.rows.iter().any(|r| r.salinity.is_finite()));
    report.segments = cycles.iter().map(|c| format!("cycle {c}")).collect();
    let problems: Vec<String> = report.files.iter().flat_map(|f| f.problems.iter().map(move |p| format!("{} {p}", f.file))).collect();
    let flight = log.flight(&format!("sea{glider:03}-{mission}"), &mut report).ok_or_else(|| {
        let why = if problems.is_empty() { "no payload file with a CTD pressure beside it".to_owned() } else { problems.join("; ") };
        ImportError::new(folder, why)
    })?;
    let mut vehicle = Class::SeaExplorer.draft();
    vehicle.say("case", &format!("sea{glider:03}"), "");
    Ok(Imported { flight, report, vehicle: Some(vehicle) })
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

/// Payload and navigation of a cycle begin within minutes of one another, s (guess).
const CLOCKS_APART_S: f64 = 1500.0;

/// Channels of the navigation computer as they are read.
#[derive(Default)]
struct Columns {
    time: Vec<f64>,
    /// Pitch, roll, heading, ballast, battery, depth.
    values: [Vec<f64>; 6],
    step_s: f64,
    lat_deg: f64,
    ctd: Option<&'static str>,
}

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
    ("Depth", crate::preprocess::clock_offset::ENGINEERING_PRESSURE, 1.0),
];

/// CTDs by the start of their columns, with the factor of conductivity to S/m.
const CTDS: [(&str, f64); 3] = [("LEGATO", 0.1), ("GPCTD", 1.0), ("SBD", 1.0)];

/// States in which the position is a fix: at the surface, and so in newer firmware.
const AT_SURFACE: [f64; 2] = [116.0, 119.0];

impl Columns {
    fn navigation(&mut self, table: &mut Table, counts: &mut Counts) -> Result<(), String> {
        let time = table.column("Timestamp").ok_or("has no column Timestamp")?;
        let places = NAVIGATION.map(|(name, ..)| table.column(name));
        let [state, lat, lon, computed] = ["NavState", "Lat", "Lon", "DeadReckoning"].map(|n| table.column(n));
        let mut under_water: Option<(f64, f64)> = None;
        let mut raw = String::new();
        while let Some(fields) = table.next(&mut raw) {
            let Some(unix) = fields.time(time) else {
                table.undated += 1;
                continue;
            };
            self.time.push(unix);
            for (column, place) in self.values.iter_mut().zip(places) {
                column.push(place.map_or(f64::NAN, |p| fields.number(p)));
            }
            let number = |place: Option<usize>| place.map_or(f64::NAN, |p| fields.number(p));
            let (lat, lon) = (degrees_of_minutes(number(lat)), degrees_of_minutes(number(lon)));
            if !lat.is_finite() || !lon.is_finite() {
                continue;
            }
            if lat == 0.0 || lon == 0.0 {
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
        let mut raw = String::new();
        while let Some(fields) = table.next(&mut raw) {
            let number = |place: Option<usize>| place.map_or(f64::NAN, |p| fields.number(p));
            let dbar = fields.number(pressure);
            let Some(unix_s) = fields.time(time) else {
                table.undated += 1;
                continue;
            };
            if !dbar.is_finite() {
                continue;
            }
            let temperature_degc = number(temperature);
            let salinity = seawater::practical_salinity(number(conductivity) * factor, temperature_degc, dbar);
            log.rows.push(Row { unix_s, segment, pressure_pa: dbar * 1e4, temperature_degc, salinity });
        }
        Ok(())
    }

    /// Channels from what was read of all navigation files.
    fn finish(&mut self, log: &mut Log, report: &mut Report) {
        let stray = channels::stray_times(&mut self.time, LONGEST_MISSION_S);
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
        let [pitch, roll, heading, ballast, battery, depth] = &self.values;
        let series = |values: &[f64]| Series::new(&self.time, values);
        (log.pitch, log.roll, log.heading) = (series(pitch), series(roll), series(heading));
        (log.ballast, log.battery) = (series(ballast), series(battery));
        let pressure: Vec<f64> = depth.iter().map(|z| if *z > 0.0 { seawater::pressure_pa(*z, self.lat_deg) } else { f64::NAN }).collect();
        log.steering_pressure = series(&pressure);
        self.step_s = log.pitch.step_s();
        if !log.heading.is_empty() {
            report.note("heading as logged: whether it holds the declination of the file is not documented".into());
        }
    }
}

/// A gzipped text is at most so many times its file, and this much more; beyond it is no log.
const UNPACKED: u64 = 100;
const SMALLEST: u64 = 1 << 20;

/// A text file of one header line, fields between semicolons.
struct Table {
    lines: Box<dyn BufRead>,
    header: Vec<String>,
    rows: usize,
    undated: usize,
    problem: Option<String>,
}

/// Fields of one line.
struct Fields<'a>(Vec<&'a str>);

impl Table {
    fn open(path: &Path) -> Result<Self, String> {
        let file = std::fs::File::open(path).map_err(|e| format!("cannot be read: {e}"))?;
        let length = file.metadata().map_err(|e| e.to_string())?.len();
        let packed = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        let bytes: Box<dyn Read> = if packed {
            Box::new(flate2::read::MultiGzDecoder::new(file).take(length.saturating_mul(UNPACKED).saturating_add(SMALLEST)))
        } else {
            Box::new(file)
        };
        let mut table = Self { lines: Box::new(BufReader::new(bytes)), header: Vec::new(), rows: 0, undated: 0, problem: None };
        let mut line = String::new();
        table.line(&mut line);
        if let Some(why) = table.problem.take() {
            return Err(why);
        }
        table.header = line.trim_start_matches('\u{feff}').trim_end().split(';').map(|f| f.trim().to_owned()).collect();
        if table.header.len() < 3 {
            return Err("has no header line of columns between semicolons".into());
        }
        Ok(table)
    }

    /// One line without its end; longer than any row is damage.
    fn line(&mut self, into: &mut String) -> bool {
        const LONGEST: u64 = 1 << 16;
        let mut bytes = Vec::new();
        match (&mut self.lines).take(LONGEST).read_until(b'\n', &mut bytes) {
            Ok(0) => return false,
            Ok(n) if n as u64 == LONGEST => {
                self.problem = Some(format!("a line after row {} is longer than {LONGEST} bytes: the rest is left out", self.rows));
                return false;
            }
            Ok(_) => {}
            Err(e) => {
                self.problem = Some(format!("is damaged after row {} ({e}): the rest is left out", self.rows));
                return false;
            }
        }
        into.clear();
        into.push_str(&String::from_utf8_lossy(&bytes));
        true
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|h| h.eq_ignore_ascii_case(name))
    }

    /// The next row that is not empty.
    fn next<'a>(&mut self, line: &'a mut String) -> Option<Fields<'a>> {
        loop {
            if !self.line(line) {
                return None;
            }
            if !line.trim().is_empty() {
                break;
            }
        }
        self.rows += 1;
        let fields: Vec<&str> = line.split(';').map(str::trim).collect();
        Some(Fields(fields))
    }
}

impl Fields<'_> {
    /// Number in a field; NaN for none and for the fill 9999.
    fn number(&self, place: usize) -> f64 {
        let value = self.0.get(place).and_then(|f| f.parse::<f64>().ok()).filter(|v| v.is_finite());
        value.filter(|v| v.abs() != 9999.0).unwrap_or(f64::NAN)
    }

    /// Unix time of dd/mm/yyyy HH:MM:SS.mmm, of a clock that was set.
    fn time(&self, place: usize) -> Option<f64> {
        let (date, clock) = self.0.get(place)?.split_once(' ')?;
        let mut date = date.split('/').map(str::parse::<i64>);
        let (day, month, year) = (date.next()?.ok()?, date.next()?.ok()?, date.next()?.ok()?);
        let mut clock = clock.trim().split(':').map(str::parse::<f64>);
        let (hour, minute, second) = (clock.next()?.ok()?, clock.next()?.ok()?, clock.next()?.ok()?);
        let days = super::calendar::days_from_1970(year, month, day)?;
        let unix = days as f64 * 86400.0 + hour * 3600.0 + minute * 60.0 + second;
        (unix > channels::SET_CLOCK_S && unix.is_finite()).then_some(unix)
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
