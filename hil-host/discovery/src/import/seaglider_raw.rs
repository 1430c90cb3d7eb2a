//! A Seaglider's own text files, `pGGGDDDD.log` and `.eng`, with `sg_calib_constants.m`: a flight without density, and the vehicle.
//!
//! `.log`: `start: m d yyy H M S` (year less 1900), then `$NAME,value,…` lines. `.eng`: `%columns:` and rows of numbers, depth in
//! cm, angles in degrees, heading magnetic. The volume of the buoyancy device stands in the eng file of older firmware (`vbdCC`);
//! newer firmware states it in the log's moves only: `(vbd_ad − C_VBD)·VBD_CNV` after each, linear in a move.
//! Conductivity and temperature are frequencies there: no density without the CTD's own calibration.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::channels::{Log, Row};
use super::classes::Class;
use super::netcdf::Scalars;
use super::position::Fix;
use super::{FileNote, ImportError, Imported, MappedName, Report, calendar, join, seaglider};
use crate::record::resample::Series;
use crate::record::seawater;

const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Name of the constants' file.
pub const CONSTANTS: &str = "sg_calib_constants.m";

/// Glider and dive of a name `pGGGDDDD.log` or `.eng`.
#[must_use]
pub fn dive_of(path: &Path) -> Option<(u32, u32)> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    let as_nc = path.with_extension("nc");
    (ending == "log" || ending == "eng").then(|| seaglider::dive_of(&as_nc)).flatten()
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
    if gliders.len() > 1 {
        return Err(ImportError::new(folder, format!("dives of {} gliders: import one at a time", gliders.len())));
    }
    let constants = files.iter().find(|f| f.file_name().is_some_and(|n| n.eq_ignore_ascii_case(CONSTANTS)));
    let read = |path: &Path| -> Result<String, String> {
        let bytes = std::fs::read(path).map_err(|e| format!("cannot be read: {e}"))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    let mut report = Report::new("Seaglider log and eng files");
    let (mut parts, mut logs, mut last_cc) = (Vec::new(), Vec::new(), f64::NAN);
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
            let cc = log.moves(last_cc);
            last_cc = cc.last().map_or(last_cc, |c| c.1);
            let part = one_dive(&read(eng)?, &log, &cc, *dive)?;
            logs.push(log);
            Ok(part)
        });
        match part {
            Ok(part) => parts.push((format!("dive {dive}"), part)),
            Err(why) => report.leave_out(format!("dive {dive}: {why}")),
        }
    }
    let left_out = report.left_out;
    let Some(mut imported) = join::join(&report.kind, parts) else {
        return Err(ImportError::new(folder, format!("no dive can be used: {}", left_out.join("; "))));
    };
    imported.report.left_out.extend(left_out);
    imported.report.density = "missing: these files hold the CTD as frequencies".into();
    imported.report.note("a comparison needs the density: import the base station's NetCDF of these dives, or calibrate the CTD".into());
    let glider = gliders.first().copied().unwrap_or_default();
    imported.flight.name = format!("sg{glider:03}");
    let mut draft = Class::Seaglider.draft();
    draft.say("case", &format!("sg{glider:03}"), "");
    let mut values = logs.last().map_or_else(BTreeMap::new, |l| l.scalars.clone());
    match constants.map(|c| read(c).map(|text| assignments(&text))) {
        Some(Ok(stated)) => values.extend(stated.into_iter().map(|(k, v)| (format!("sg_cal_{k}"), v))),
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
    fixes: Vec<Fix>,
    /// Magnetic variation, deg.
    variation: f64,
    /// Start and end of the pump's moves, s from the start, and the counts after.
    pump: Vec<(f64, f64, f64)>,
}

impl DiveLog {
    fn parse(text: &str) -> Self {
        let mut log = Self { start: f64::NAN, ..Self::default() };
        let mut heads: Vec<String> = Vec::new();
        for line in text.lines() {
            if let Some(start) = line.strip_prefix("start:") {
                log.start = start_line(start).unwrap_or(f64::NAN);
            }
            let Some(line) = line.strip_prefix('$') else { continue };
            let fields: Vec<&str> = line.split(',').map(str::trim).collect();
            match fields[0] {
                "GCHEAD" => heads = fields[1..].iter().map(|f| (*f).to_owned()).collect(),
                "GC" => {
                    let of = |name: &str| heads.iter().position(|h| h == name).and_then(|k| fields.get(k + 1)?.parse::<f64>().ok());
                    if let (Some(from), Some(counts)) = (of("st_secs"), of("vbd_ad")) {
                        let to = of("vbd_secs").map(|s| from + s).or_else(|| of("end_secs")).unwrap_or(from);
                        log.pump.push((from, to, counts));
                    }
                }
                "GPS1" | "GPS2" | "GPS" => {
                    log.fixes.extend(fix(&fields));
                    log.variation = fields.get(8).and_then(|f| f.parse().ok()).unwrap_or(log.variation);
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

    /// Time from the start, s, and volume, cm³, at the corners of the pump's moves; `before` is the volume before the first.
    fn moves(&self, before: f64) -> Vec<(f64, f64)> {
        let (Some(c), Some(cc)) = (self.scalars.get("log_C_VBD"), self.scalars.get("log_VBD_CNV")) else { return Vec::new() };
        let mut corners = Vec::new();
        let mut volume = before;
        for (from, to, counts) in &self.pump {
            corners.push((*from, volume));
            volume = (counts - c) * cc;
            corners.push((*to, volume));
        }
        corners
    }
}

/// Unix time of "m d yyy H M S", yyy the year less 1900.
fn start_line(text: &str) -> Option<f64> {
    let numbers: Vec<i64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let [month, day, year, hour, minute, second] = numbers[..] else { return None };
    let days = calendar::days_from_1970(year.checked_add(1900)?, month, day)?;
    Some((days * 86400 + hour * 3600 + minute * 60 + second) as f64)
}

/// A `$GPS` line: date ddmmyy, time hhmmss, latitude ddmm.mmm, longitude dddmm.mmm.
fn fix(fields: &[&str]) -> Option<Fix> {
    let [_, date, clock, lat, lon, ..] = fields else { return None };
    let pair = |text: &str, at: usize| text.get(at..at + 2)?.parse::<i64>().ok();
    let days = calendar::days_from_1970(2000 + pair(date, 4)?, pair(date, 2)?, pair(date, 0)?)?;
    let time_s = (days * 86400 + pair(clock, 0)? * 3600 + pair(clock, 2)? * 60 + pair(clock, 4)?) as f64;
    let degrees = |text: &str| text.parse::<f64>().ok().map(super::position::degrees_of_minutes);
    Some(Fix { time_s, lat_deg: degrees(lat)?, lon_deg: degrees(lon)? })
}

fn one_dive(eng: &str, log: &DiveLog, pump: &[(f64, f64)], dive: u32) -> Result<Imported, String> {
    let columns = eng.lines().find_map(|l| l.strip_prefix("%columns:")).ok_or("its .eng has no line %columns:")?;
    let names: Vec<&str> = columns.split(',').map(str::trim).collect();
    let mut values: BTreeMap<&str, Vec<f64>> = names.iter().map(|n| (*n, Vec::new())).collect();
    let mut cut = 0;
    for line in eng.lines().skip_while(|l| !l.starts_with("%data")).skip(1).filter(|l| !l.trim().is_empty()) {
        let fields: Vec<f64> = line.split_whitespace().map(|f| f.parse().unwrap_or(f64::NAN)).collect();
        if fields.len() != names.len() {
            cut += 1;
            continue;
        }
        for (name, value) in names.iter().zip(fields) {
            values.entry(name).or_default().push(value);
        }
    }
    let mut report = Report::new("Seaglider log and eng files");
    let file = format!("dive {dive}");
    report.files.push(FileNote { file, rows: values.values().next().map_or(0, Vec::len), problems: Vec::new() });
    if cut > 0 {
        report.leave_out(format!("{cut} rows of the .eng have another number of values than there are columns"));
    }
    let header_start = eng.lines().find_map(|l| l.strip_prefix("%start:")).and_then(start_line);
    let start = if log.start.is_finite() { log.start } else { header_start.ok_or("has no start line")? };
    let column = |name: &str| values.get(name).cloned().unwrap_or_default();
    let time: Vec<f64> = column("elaps_t").iter().map(|t| t + start).collect();
    let lat_deg = log.fixes.first().map_or(45.0, |f| f.lat_deg);
    let rows = time.iter().zip(column("depth"));
    let rows = rows.map(|(unix_s, cm)| Row {
        unix_s: *unix_s,
        segment: 0,
        pressure_pa: seawater::pressure_pa((cm * 0.01).max(0.0), lat_deg),
        temperature_degc: f64::NAN,
        salinity: f64::NAN,
    });
    let angle = |name: &str, add: f64| Series::new(&time, &column(name).iter().map(|v| (v + add) * DEGREE).collect::<Vec<_>>());
    let ballast = if values.contains_key("vbdCC") {
        Series::new(&time, &column("vbdCC").iter().map(|v| v * 1e-6).collect::<Vec<_>>())
    } else {
        report.note("ballast from the pump's moves in the log: the .eng has none".into());
        Series::new(&time, &time.iter().map(|t| between(pump, t - start) * 1e-6).collect::<Vec<_>>())
    };
    report.note(format!("heading is magnetic: variation of {} deg added", log.variation));
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
        pitch: angle("pitchAng", 0.0),
        roll: angle("rollAng", 0.0),
        heading: angle("head", log.variation),
        ballast,
        // The first is the end of the dive before.
        fixes: log.fixes.get(1..).unwrap_or_default().to_vec(),
        ..Log::default()
    };
    let flight = out.flight(&format!("dive {dive}"), &mut report).ok_or("its .eng has no row")?;
    Ok(Imported { flight, report, vehicle: None })
}

/// Linear between the corners, as the first before them and the last behind.
fn between(corners: &[(f64, f64)], t: f64) -> f64 {
    let k = corners.partition_point(|c| c.0 <= t);
    let (Some(a), b) = (k.checked_sub(1).and_then(|k| corners.get(k)), corners.get(k)) else {
        return corners.first().map_or(f64::NAN, |c| c.1);
    };
    let Some(b) = b else { return a.1 };
    a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0)
}

/// Numbers that a `sg_calib_constants.m` assigns: literals and + − * / ^ ( ) of earlier names, nothing else.
#[must_use]
pub fn assignments(text: &str) -> BTreeMap<String, f64> {
    let mut out: BTreeMap<String, f64> = BTreeMap::new();
    for line in statements(text) {
        for statement in line.split(';') {
            let Some((name, value)) = statement.split_once('=') else { continue };
            let (name, value) = (name.trim().replace('.', "_"), value.trim());
            let skipped = name.starts_with("override_") || value.contains(['[', '\'', '"', '{']);
            if skipped || value.len() > 200 || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
                continue;
            }
            let number = Sum { text: value, at: 0, known: &out, depth: 0 }.whole();
            if let Some(number) = number.filter(|v| v.is_finite()) {
                out.insert(name, number);
            }
        }
    }
    out
}

/// Lines without comments, those of a block (`%{` to `%}`) too; one that ends in `...` goes on in the next.
fn statements(text: &str) -> Vec<String> {
    let (mut lines, mut blocks, mut open) = (Vec::<String>::new(), 0_u32, false);
    for line in text.lines().take(MOST_LINES) {
        match line.trim() {
            "%{" => blocks += 1,
            "%}" => blocks = blocks.saturating_sub(1),
            _ if blocks > 0 => {}
            _ => {
                let line = without_comment(line).trim_end();
                // What stands behind the dots is a comment.
                let dots = line.find("...").filter(|at| line[..*at].matches(['\'', '"']).count().is_multiple_of(2));
                let (line, goes_on) = dots.map_or((line, false), |at| (&line[..at], true));
                match lines.last_mut().filter(|_| open) {
                    Some(before) => before.push_str(line),
                    None => lines.push(line.to_owned()),
                }
                open = goes_on;
            }
        }
    }
    lines
}

/// A sum of numbers and names, read from left to right.
struct Sum<'a> {
    text: &'a str,
    at: usize,
    known: &'a BTreeMap<String, f64>,
    depth: usize,
}

/// Brackets and signs within one another; more is damage.
const DEEPEST: usize = 40;

impl Sum<'_> {
    /// All of the text, none if something is left over.
    fn whole(mut self) -> Option<f64> {
        let value = self.sum()?;
        self.rest().trim().is_empty().then_some(value)
    }

    fn rest(&self) -> &str {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// The next sign if it is one of `signs`.
    fn sign(&mut self, signs: &[char]) -> Option<char> {
        let blanks = self.rest().len() - self.rest().trim_start().len();
        let next = self.rest().trim_start().chars().next().filter(|c| signs.contains(c))?;
        self.at += blanks + next.len_utf8();
        Some(next)
    }

    fn sum(&mut self) -> Option<f64> {
        let mut value = self.product()?;
        while let Some(sign) = self.sign(&['+', '-']) {
            let next = self.product()?;
            value = if sign == '+' { value + next } else { value - next };
        }
        Some(value)
    }

    fn product(&mut self) -> Option<f64> {
        let mut value = self.power()?;
        while let Some(sign) = self.sign(&['*', '/']) {
            let next = self.power()?;
            value = if sign == '*' { value * next } else { value / next };
        }
        Some(value)
    }

    fn power(&mut self) -> Option<f64> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return None;
        }
        if let Some(sign) = self.sign(&['+', '-']) {
            let value = self.power()?;
            return Some(if sign == '-' { -value } else { value });
        }
        let base = self.atom()?;
        let value = if self.sign(&['^']).is_some() { base.powf(self.power()?) } else { base };
        self.depth -= 1;
        Some(value)
    }

    fn atom(&mut self) -> Option<f64> {
        if self.sign(&['(']).is_some() {
            let value = self.sum()?;
            return self.sign(&[')']).map(|_| value);
        }
        self.at += self.rest().len() - self.rest().trim_start().len();
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        let rest = self.rest();
        let mut end = rest.find(|c: char| !word(c)).unwrap_or(rest.len());
        let number = rest.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        // The sign of an exponent belongs to the number.
        if number && rest[..end].ends_with(['e', 'E']) && rest[end..].starts_with(['+', '-']) {
            end += 1 + rest[end + 1..].find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len() - end - 1);
        }
        let token = rest[..end].to_owned();
        self.at += end;
        if number { token.parse().ok() } else { self.known.get(&token.replace('.', "_")).copied() }
    }
}

/// A file of constants has some hundred lines.
const MOST_LINES: usize = 5000;

/// The line up to its `%` outside of quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (k, c) in line.char_indices() {
        match (quote, c) {
            (None, '%') => return &line[..k],
            (None, '\'' | '"') => quote = Some(c),
            (Some(q), c) if q == c => quote = None,
            _ => {}
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_numbers_and_sums_of_earlier_ones_only() {
        let text = "id_str = '099';\nmass = 54.12 ; % (kg)\n%mass = 99.9;\nrho0=1027.5; hd_a = 3.8e-3;\nhalf = 0.5;\nabs_compress = 8.2e-6*half;\n\
            override.RHO = 1.03;\nm = [1 2; 3 4];\nlate = never + 1;\na.b = (1+2)^2\nx = system('rm');\n\
            deep = ((((1e-3 - -2E+0))))/4; open = (1; two = 1 2;\n%{\nmass = 2;\n%}\nvolmax = ... in cm3\n 53285.5;";
        let got = assignments(text);
        assert_eq!((got.get("mass"), got.get("volmax")), (Some(&54.12), Some(&53285.5)));
        assert_eq!(got.get("a_b"), Some(&9.0));
        assert!((got["abs_compress"] - 4.1e-6).abs() < 1e-18 && got["hd_a"] == 3.8e-3 && got["rho0"] == 1027.5);
        assert_eq!(got.get("deep"), Some(&(2.001 / 4.0)));
        assert!(!got.contains_key("open") && !got.contains_key("two"));
        assert!(!got.contains_key("late") && !got.contains_key("override_RHO") && !got.contains_key("m") && !got.contains_key("x"));
    }

    #[test]
    fn the_pump_moves_linearly() {
        let corners = [(10.0, -100.0), (20.0, 100.0)];
        assert_eq!((between(&corners, 0.0), between(&corners, 15.0), between(&corners, 99.0)), (-100.0, 0.0, 100.0));
        assert!(between(&[], 1.0).is_nan());
    }
}
