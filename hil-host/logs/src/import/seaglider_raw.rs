//! A Seaglider's own text files, `pGGGDDDD.log` and `.eng`, with `sg_calib_constants.m`: a flight without density, and the vehicle.
//!
//! `.log`: `start: m d yyy H M S` (year less 1900), then `$NAME,value,…` lines. `.eng`: `%columns:` and rows of numbers, depth in
//! cm, angles in degrees, heading magnetic. The volume of the buoyancy device stands in the eng file of older firmware (`vbdCC`);
//! newer firmware states it in the log's moves only: `(vbd_ad − C_VBD)·VBD_CNV` after each, linear in a move.
//! Such a log ends with `$GPS`, the fix after the dive.
//! Conductivity and temperature are frequencies there: no density without the CTD's own calibration.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::assembly::{Log, Row};
use super::classes::Class;
use super::netcdf::Scalars;
use super::position::Fix;
use super::reader::Reader;
use super::report::shown;
use super::variation::variation_deg;
use super::{FileNote, ImportError, Imported, MappedName, Report, calendar, join, pressure_zero, seaglider};
use crate::record::bounded;
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

mod constants;

pub use constants::Constants;

const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Its own text files.
pub(super) const SEAGLIDER_TEXTS: Reader =
    Reader { name: "Seaglider log and eng files", claims: is_raw, import: |files, _| import(files), ..Reader::PLAIN };
/// Name of the constants' file.
pub const CONSTANTS: &str = "sg_calib_constants.m";

/// Glider and dive of a name `pGGGDDDD.log` or `.eng`.
#[must_use]
pub fn dive_of(path: &Path) -> Option<(u32, u32)> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    // "p" and seven digits: a browser's copy is none.
    let plain = (ending == "log" || ending == "eng") && path.file_stem()?.len() == 8;
    plain.then(|| seaglider::dive_of(&path.with_extension("nc"))).flatten()
}

/// Whether the file is one of these.
#[must_use]
pub fn is_raw(path: &Path) -> bool {
    dive_of(path).is_some() || path.file_name().is_some_and(|n| n.eq_ignore_ascii_case(CONSTANTS))
}

/// Imports the dives of one glider.
///
/// # Errors
/// Dives of two gliders; nothing usable.
pub fn import(files: &[PathBuf]) -> Result<Imported, ImportError> {
    let folder = files.first().and_then(|f| f.parent()).unwrap_or(Path::new("."));
    let dives: std::collections::BTreeSet<(u32, u32)> = files.iter().filter_map(|f| dive_of(f)).collect();
    let gliders: std::collections::BTreeSet<u32> = dives.iter().map(|d| d.0).collect();
    if dives.is_empty() {
        let what = "has no dive: .log and .eng named pGGGDDDD, three digits of the glider and four of the dive, are expected";
        return Err(ImportError::new(folder, what));
    }
    if gliders.len() > 1 {
        return Err(ImportError::new(folder, format!("dives of {} gliders: import one at a time", gliders.len())));
    }
    let constants = files.iter().find(|f| f.file_name().is_some_and(|n| n.eq_ignore_ascii_case(CONSTANTS)));
    let read = |path: &Path| -> Result<String, String> {
        let bytes = bounded::bytes(path, bounded::LOG).map_err(|e| format!("cannot be read: {e}"))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    let mut report = Report::new("Seaglider log and eng files");
    let (mut parts, mut numbers, mut logs, mut last_cc) = (Vec::new(), Vec::new(), Vec::<DiveLog>::new(), f64::NAN);
    let mut middles_cc: Vec<f64> = Vec::new();
    for (glider, dive) in &dives {
        let of = |ending: &str| {
            files.iter().find(|f| dive_of(f) == Some((*glider, *dive)) && f.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)))
        };
        let (Some(log), Some(eng)) = (of("log"), of("eng")) else {
            report.leave_out(format!("dive {dive}: needs both its .log and its .eng"));
            continue;
        };
        let log = read(log).map(|text| DiveLog::parse(&text));
        let part = log.and_then(|log| {
            // The middle of the buoyancy device may be set anew: readings of all dives are brought to the last one's.
            let number = |of: &DiveLog, name: &str| of.scalars.get(name).copied();
            let first = logs.first().unwrap_or(&log);
            let middle_cc = seaglider::middle_off_cc(|n| number(&log, n), |n| number(first, n)).unwrap_or(0.0);
            let cc = log.moves(last_cc - middle_cc);
            last_cc = cc.last().map_or(last_cc, |c| c.1 + middle_cc);
            let mut part = one_dive(&read(eng)?, &log, &cc, *dive)?;
            log.say_whose((*glider, *dive), &mut part.report);
            logs.push(log);
            middles_cc.push(middle_cc);
            Ok(part)
        });
        match part {
            Ok(part) => {
                numbers.push(*dive);
                parts.push((format!("dive {dive}"), part));
            }
            Err(why) => report.leave_out(format!("dive {dive}: {why}")),
        }
    }
    let newest_cc = middles_cc.last().copied().unwrap_or(0.0);
    parts.iter_mut().zip(&middles_cc).for_each(|((_, part), middle_cc)| seaglider::from_middle(part, middle_cc - newest_cc));
    let begins: Vec<(u32, f64)> = parts.iter().zip(&numbers).map(|((_, p), n)| (*n, p.report.start_unix_s.unwrap_or(f64::NAN))).collect();
    join::numbered("dive", &begins, &mut report);
    let Report { kind, left_out, notes, .. } = report;
    let Some(mut imported) = join::join(&kind, parts) else {
        return Err(ImportError::new(folder, format!("no dive can be used: {}", left_out.join("; "))));
    };
    imported.report.left_out.extend(left_out);
    imported.report.notes.extend(notes);
    imported.report.density = "missing: these files hold the CTD as frequencies".into();
    imported.report.note("a comparison needs the density: import the base station's NetCDF of these dives, or calibrate the CTD".into());
    let glider = gliders.first().copied().unwrap_or_default();
    imported.flight.name = format!("sg{glider:03}");
    let mut draft = Class::Seaglider.draft();
    draft.say("case", &format!("sg{glider:03}"), "");
    let mut values = logs.last().map_or_else(BTreeMap::new, |l| l.scalars.clone());
    match constants.map(|c| read(c).map(|text| Constants::parse(&text))) {
        Some(Ok(Constants { glider: Some(other), .. })) if other != glider => {
            imported.report.leave_out(format!("{CONSTANTS} is of SG{other:03}, the dives of SG{glider:03}: its numbers are not taken"));
        }
        Some(Ok(stated)) => {
            values.extend(stated.numbers.into_iter().map(|(k, v)| (format!("sg_cal_{k}"), v)));
            stated.problems.into_iter().for_each(|what| imported.report.leave_out(format!("{CONSTANTS}: {what}")));
        }
        Some(Err(why)) => imported.report.leave_out(format!("{CONSTANTS} {why}")),
        None => imported.report.note(format!("no {CONSTANTS} beside them: the vehicle is of the log's numbers")),
    }
    seaglider::from_constants(&mut draft, &Scalars::from_values(values), &mut imported.report);
    imported.vehicle = Some(draft);
    Ok(imported)
}

/// What a `.log` says.
#[derive(Default)]
struct DiveLog {
    /// Unix time of the start line, s.
    start: f64,
    /// Single numbers, as `log_NAME`.
    scalars: BTreeMap<String, f64>,
    /// The end of the dive before, by `$GPS1`.
    before: Option<Fix>,
    fixes: Vec<Fix>,
    /// Lines of fixes that cannot be read.
    bad_fixes: Vec<String>,
    /// Magnetic variation, deg; none without a fix that states it.
    variation: Option<f64>,
    /// Whether the fix after the dive is there, with which such a file ends.
    ended: bool,
    pump: Vec<Move>,
    /// Lines of moves that cannot be read.
    bad_moves: usize,
    /// Fixes whose date is days off the dive's.
    other_days: usize,
    /// Lines of fixes by which the receiver had none.
    no_fixes: usize,
    /// Numbers of the glider and the dive.
    glider: Option<u32>,
    dive: Option<u32>,
}

/// One move of the pump: start and end, s from the start of the dive, counts before (newer firmware) and after.
struct Move {
    from: f64,
    to: f64,
    before: Option<f64>,
    after: f64,
}

impl DiveLog {
    fn parse(text: &str) -> Self {
        let mut log = Self { start: f64::NAN, ..Self::default() };
        let mut heads: Vec<String> = Vec::new();
        for line in text.lines() {
            if let Some(start) = line.strip_prefix("start:") {
                log.start = start_line(start).unwrap_or(f64::NAN);
            }
            for (key, number) in [("glider:", &mut log.glider), ("dive:", &mut log.dive)] {
                *number = line.strip_prefix(key).and_then(|n| n.trim().parse().ok()).or(*number);
            }
            let Some(line) = line.strip_prefix('$') else { continue };
            let fields: Vec<&str> = line.split(',').map(str::trim).collect();
            match fields[0] {
                "GCHEAD" => heads = fields[1..].iter().map(|f| (*f).to_owned()).collect(),
                "GC" => {
                    let of = |name: &str| heads.iter().position(|h| h == name).and_then(|k| fields.get(k + 1)?.parse::<f64>().ok());
                    match (of("st_secs"), of("vbd_ad")) {
                        (Some(from), Some(after)) => {
                            let to = of("vbd_secs").map(|s| from + s).or_else(|| of("end_secs")).unwrap_or(from);
                            log.pump.push(Move { from, to, before: of("vbd_ad_start"), after });
                        }
                        _ => log.bad_moves += 1,
                    }
                }
                "GPS1" | "GPS2" | "GPS" => {
                    match fix(&fields, log.start) {
                        Some(Logged { hdop, .. }) if hdop.is_some_and(|h| h >= NO_FIX_HDOP) => log.no_fixes += 1,
                        Some(Logged { mut fix, variation, .. }) => {
                            let days = ((fix.time_s - log.start) / DAY_S).round();
                            if days.abs() >= OTHER_DAYS {
                                fix.time_s -= days * DAY_S;
                                log.other_days += 1;
                            }
                            if fields[0] == "GPS1" {
                                log.before = Some(fix)
                            } else {
                                log.fixes.push(fix)
                            }
                            log.variation = variation.or(log.variation);
                        }
                        None => log.bad_fixes.push(shown(line)),
                    }
                    log.ended |= fields[0] == "GPS";
                }
                name => {
                    if let [_, value] = fields[..]
                        && let Ok(value) = value.parse::<f64>()
                    {
                        log.scalars.insert(format!("log_{name}"), value);
                    }
                }
            }
        }
        log
    }

    /// Names what is not as it should be of a dive whose samples end `eng_end` seconds after its start.
    fn say(&self, eng_end: Option<f64>, report: &mut Report) {
        if self.no_fixes > 0 {
            report.note(format!("{} lines of fixes have a dilution (HDOP) of {NO_FIX_HDOP}: no fixes", self.no_fixes));
        }
        match self.variation {
            Some(degrees) => report.note(format!("heading is magnetic: variation of {degrees} deg added")),
            None => match self.modelled_variation() {
                Some(degrees) => report.note(format!("heading is magnetic: variation of {degrees:.1} deg (geomagnetic field, IGRF) added")),
                None => report.note("heading is magnetic and stays so: the .log states no variation and no fix".into()),
            },
        }
        if !self.ended {
            report.leave_out(
                "its .log has no $GPS line, the fix after the dive: it is cut, and what the pump did at the end is missing too".into(),
            );
        }
        if let Some(first) = self.bad_fixes.first() {
            report.leave_out(format!("{} lines of fixes that cannot be read, first \"${first}\"", self.bad_fixes.len()));
        }
        // The last move of the pump is at the surface.
        let surfaced = self.pump.last().map_or(f64::NAN, |p| p.from);
        if self.bad_moves > 0 {
            report.leave_out(format!("{} lines of the pump's moves ($GC) that cannot be read", self.bad_moves));
        }
        if let Some(end) = eng_end.filter(|end| SAMPLED * *end > surfaced) {
            report.leave_out(format!(
                "the .log's last move of the pump is at {surfaced:.0} s, the dive ends at {end:.0} s: moves are missing"
            ));
        }
        if self.other_days > 0 {
            let count = self.other_days;
            report.note(format!("dates of {count} fixes are days off the dive's (weeks of GPS counted anew?): the dive's day is taken"));
        }
        if let Some(end) = eng_end.filter(|end| *end < SAMPLED * surfaced) {
            report.leave_out(format!("its .eng ends {end:.0} s after the start, the dive at {surfaced:.0} s by the .log: it is cut"));
        }
    }

    /// Magnetic variation of the place, deg, where the log states none.
    fn modelled_variation(&self) -> Option<f64> {
        let fix = self.fixes.iter().chain(&self.before).find(|f| f.lat_deg != 0.0 || f.lon_deg != 0.0)?;
        variation_deg(Place { lon_deg: fix.lon_deg, lat_deg: fix.lat_deg }, self.start)
    }

    /// Names a dive whose own numbers are not those of its file's name.
    fn say_whose(&self, (glider, dive): (u32, u32), report: &mut Report) {
        let (own_glider, own_dive) = (self.glider.unwrap_or(glider), self.dive.unwrap_or(dive));
        if (own_glider, own_dive) != (glider, dive) {
            report.leave_out(format!("its .log says that it is dive {own_dive} of SG{own_glider:03}: a file of another name?"));
        }
    }

    /// Questions depths that reach about a hundredth of the dive's target.
    fn say_scale(&self, deepest_m: f64, report: &mut Report) {
        let target_m = self.scalars.get("log_D_TGT").copied().unwrap_or(f64::NAN);
        if (1.0 / 150.0..1.0 / 60.0).contains(&(deepest_m / target_m)) {
            report.note(format!("depth reaches {deepest_m:.2} m of a target of {target_m:.0} m: is it in m, not in cm, in this .eng?"));
        }
    }

    /// Fixes before and after the dive, judged with the one of the dive before.
    fn sound_fixes(&self, report: &mut Report) -> Vec<Fix> {
        let mut fixes = super::position::sound(self.before.iter().chain(&self.fixes).copied().collect(), report);
        fixes.retain(|f| Some(*f) != self.before);
        fixes
    }

    /// Time from the start, s, and volume, cm³, at the corners of the pump's moves; `before` is the volume before the first.
    fn moves(&self, before: f64) -> Vec<(f64, f64)> {
        let (Some(c), Some(cc)) = (self.scalars.get("log_C_VBD"), self.scalars.get("log_VBD_CNV")) else { return Vec::new() };
        let mut corners = Vec::new();
        let mut volume = before;
        for one in &self.pump {
            corners.push((one.from, one.before.map_or(volume, |counts| (counts - c) * cc)));
            volume = (one.after - c) * cc;
            corners.push((one.to, volume));
        }
        corners
    }
}

/// Unix time of "m d yyy H M S", yyy the year less 1900.
fn start_line(text: &str) -> Option<f64> {
    let numbers: Vec<i64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let [month, day, year, hour, minute, second] = numbers[..] else { return None };
    // Years are counted from 1900; one before any Seaglider is that of a century.
    let year = if year < FIRST_YEAR { year.checked_add(2000)? } else { year.checked_add(1900)? };
    let days = calendar::days_from_1970(year, month, day)?;
    Some((days * 86400 + hour * 3600 + minute * 60 + second) as f64)
}

/// The year of the first Seagliders, less 1900.
const FIRST_YEAR: i64 = 95;
/// What a receiver without a fix states as its dilution of precision.
const NO_FIX_HDOP: f64 = 99.0;
/// A day, s; and how many a dive and its fixes never take (guess).
const DAY_S: f64 = 86_400.0;
const OTHER_DAYS: f64 = 3.0;
/// The samples of a dive last to the surface, for a share of its time at the least (guess).
const SAMPLED: f64 = 0.8;

/// A `$GPS` line: date ddmmyy, time hhmmss, latitude ddmm.mmm, longitude dddmm.mmm, and behind four more the magnetic variation, deg.
/// The oldest firmware states no date: it is the day on which the time of day is nearest to `start`.
fn fix(fields: &[&str], start: f64) -> Option<Logged> {
    let pair = |text: &str, at: usize| text.get(at..at + 2)?.parse::<i64>().ok();
    let undated = fields.get(2)?.contains('.');
    let rest = fields.get(if undated { 1 } else { 2 }..)?;
    let [clock, lat, lon, ..] = rest else { return None };
    let of_day = (pair(clock, 0)? * 3600 + pair(clock, 2)? * 60 + pair(clock, 4)?) as f64;
    let days = if undated {
        ((start - of_day) / DAY_S).round()
    } else {
        let date = fields[1];
        calendar::days_from_1970(2000 + pair(date, 4)?, pair(date, 2)?, pair(date, 0)?)? as f64
    };
    let degrees = |text: &str| text.parse::<f64>().ok().map(super::position::degrees_of_minutes);
    let fix = Fix { time_s: days * DAY_S + of_day, lat_deg: degrees(lat)?, lon_deg: degrees(lon)? };
    let number = |k: usize| rest.get(k).and_then(|f| f.parse().ok());
    Some(Logged { fix, variation: number(6), hdop: number(4) }).filter(|l| l.fix.time_s.is_finite())
}

/// A fix with the magnetic variation there, deg, and the receiver's dilution of precision.
struct Logged {
    fix: Fix,
    variation: Option<f64>,
    hdop: Option<f64>,
}

/// Columns of an `.eng`, by their names; a file note and what is wrong with its rows go to the report.
///
/// # Errors
/// No columns, no data, or no time or depth among them.
fn eng_columns(eng: &str, dive: u32, report: &mut Report) -> Result<BTreeMap<String, Vec<f64>>, String> {
    let columns = eng.lines().find_map(|l| l.strip_prefix("%columns:")).ok_or("its .eng has no line %columns:")?;
    if !eng.lines().any(|l| l.starts_with("%data")) {
        return Err("its .eng has no line %data:".into());
    }
    let names: Vec<String> = columns.split(',').map(|n| n.trim().to_ascii_lowercase()).collect();
    if let Some(lacking) = ["elaps_t", "depth"].into_iter().find(|name| !names.iter().any(|n| n == name)) {
        return Err(format!("its .eng has no column {lacking} (it has:{columns})"));
    }
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    let mut cut = 0;
    for line in eng.lines().skip_while(|l| !l.starts_with("%data")).skip(1).filter(|l| !l.trim().is_empty()) {
        let fields: Vec<f64> = line.split_whitespace().map(|f| f.parse().unwrap_or(f64::NAN)).collect();
        if fields.len() == names.len() {
            values.iter_mut().zip(fields).for_each(|(column, value)| column.push(value));
        } else {
            cut += 1;
        }
    }
    report.files.push(FileNote { file: format!("dive {dive}"), rows: values.first().map_or(0, Vec::len), problems: Vec::new() });
    if cut > 0 {
        report.leave_out(format!("{cut} rows of the .eng have another number of values than there are columns"));
    }
    if eng.lines().filter_map(|l| l.strip_prefix("%columns:")).any(|other| other != columns) {
        report.leave_out("its .eng has another line %columns: further on: rows behind it are read by the first one".into());
    }
    Ok(names.into_iter().zip(values).collect())
}

fn one_dive(eng: &str, log: &DiveLog, pump: &[(f64, f64)], dive: u32) -> Result<Imported, String> {
    let mut report = Report::new("Seaglider log and eng files");
    let values = eng_columns(eng, dive, &mut report)?;
    let header_start = eng.lines().find_map(|l| l.strip_prefix("%start:")).and_then(start_line);
    let start = if log.start.is_finite() { log.start } else { header_start.ok_or("has no start line")? };
    let column = |name: &str| values.get(&name.to_ascii_lowercase()).cloned().unwrap_or_default();
    let time: Vec<f64> = column("elaps_t").iter().map(|t| t + start).collect();
    let lat_deg = log.before.iter().chain(&log.fixes).map(|f| f.lat_deg).find(|lat| *lat != 0.0).unwrap_or(45.0);
    let mut depth_cm = column("depth");
    pressure_zero::turn_upright(&mut depth_cm, "depth", UPWARD_CM, &mut report);
    log.say_scale(quantile(&depth_cm, 1.0) * 0.01, &mut report);
    let rows = time.iter().zip(depth_cm);
    let pressure = |cm: f64| if cm.is_nan() { f64::NAN } else { seawater::pressure_pa((cm * 0.01).max(0.0), lat_deg) };
    let rows = rows.map(|(unix_s, cm)| Row::at(*unix_s, 0, pressure(cm)));
    let angle = |name: &str, add: f64| Series::new(&time, &column(name).iter().map(|v| (v + add) * DEGREE).collect::<Vec<_>>());
    let unread = column("depth").iter().filter(|cm| cm.is_nan()).count();
    if unread > 0 {
        report.leave_out(format!("{unread} rows of the .eng have no depth"));
    }
    // A column of nothing but zeros or no values says nothing.
    let ballast = if column("vbdCC").iter().any(|v| v.is_finite() && *v != 0.0) {
        Series::new(&time, &column("vbdCC").iter().map(|v| v * 1e-6).collect::<Vec<_>>())
    } else {
        match pump {
            [] => report.leave_out("no ballast: the .eng has no vbdCC, and the .log no move of the pump ($GC)".into()),
            _ => report.note("ballast from the pump's moves in the log: the .eng has none".into()),
        }
        Series::new(&time, &time.iter().map(|t| between(pump, t - start) * 1e-6).collect::<Vec<_>>())
    };
    log.say(column("elaps_t").last().copied(), &mut report);
    for (from, unit, to, factor) in [
        ("depth", "cm", "pressure_dbar", 0.01),
        ("pitchAng", "deg", "m_pitch_rad", DEGREE),
        ("rollAng", "deg", "m_roll_rad", DEGREE),
        ("head", "deg", "m_heading_rad", DEGREE),
    ] {
        report.map(MappedName { from: from.into(), unit: unit.into(), to: to.into(), factor });
    }
    let rows: Vec<Row> = rows.collect();
    report.segments.push(format!("dive {dive}"));
    let out = Log {
        rows,
        pitch: angle("pitchAng", 0.0).into(),
        roll: angle("rollAng", 0.0).into(),
        heading: angle("head", log.variation.or_else(|| log.modelled_variation()).unwrap_or(0.0)).into(),
        ballast: ballast.into(),
        fixes: log.sound_fixes(&mut report),
        true_heading: true,
        ..Log::default()
    };
    let flight = out.flight(&format!("dive {dive}"), &mut report).ok_or("its .eng has no row")?;
    Ok(Imported::new(flight, report))
}

/// Depths whose middle lies further than this above the surface grow upward, cm.
const UPWARD_CM: f64 = 200.0;

/// Linear between the corners, as the first before them and the last behind.
fn between(corners: &[(f64, f64)], t: f64) -> f64 {
    let k = corners.partition_point(|c| c.0 <= t);
    let (Some(a), b) = (k.checked_sub(1).and_then(|k| corners.get(k)), corners.get(k)) else {
        return corners.first().map_or(f64::NAN, |c| c.1);
    };
    let Some(b) = b else { return a.1 };
    a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pump_moves_linearly() {
        let corners = [(10.0, -100.0), (20.0, 100.0)];
        assert_eq!((between(&corners, 0.0), between(&corners, 15.0), between(&corners, 99.0)), (-100.0, 0.0, 100.0));
        assert!(between(&[], 1.0).is_nan());
    }
}
