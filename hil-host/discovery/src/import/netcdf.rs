//! NetCDF of other gliders: Seaglider base-station files, OG1, IOOS; classic and HDF5-based alike.
//!
//! A channel is found by its usual names; its unit is read from the variable,
//! never guessed (a few Seaglider variables have none: their unit is fixed by the
//! name and the report says so). Every variable stands on the clock of its
//! dimension; rows are the instants with a pressure.
//!
//! A density in the file is not used when there is salinity: Seaglider's
//! `density_insitu` leaves out pressure, 2 kg/m³ at 500 m.

use std::path::Path;

use netcdf_reader::NcFile;

use super::align::Series;
use super::seawater::{self, Place};
use super::{FileNote, ImportError, Imported, MappedName, Report, position};
use crate::flight::Flight;

/// What a variable can be.
struct Wanted {
    /// Column of the flight format.
    column: &'static str,
    /// Usual names, best first.
    names: &'static [&'static str],
    /// Units it may have, with the factor to SI.
    units: &'static [(&'static str, f64)],
    /// Factor to SI if the variable has no unit but one of `names`; `None`: left out.
    without_unit: Option<f64>,
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const ANGLES: &[(&str, f64)] =
    &[("degrees", DEGREE), ("degree", DEGREE), ("deg", DEGREE), ("degrees true", DEGREE), ("rad", 1.0), ("radian", 1.0), ("radians", 1.0)];
const PLAIN: &[(&str, f64)] = &[("1", 1.0), ("1e-3", 1.0), ("psu", 1.0), ("PSU", 1.0), ("0.001", 1.0)];
const CELSIUS: &[(&str, f64)] = &[("degrees_celsius", 1.0), ("degree_celsius", 1.0), ("celsius", 1.0), ("degc", 1.0), ("c", 1.0)];
const DEGREES: &[(&str, f64)] = &[("degrees_north", 1.0), ("degrees_east", 1.0), ("degree_north", 1.0), ("degree_east", 1.0)];

const PRESSURE: Wanted = Wanted {
    column: "pressure_dbar",
    names: &["ctd_pressure", "PRES", "sci_water_pressure", "pressure", "sea_water_pressure"],
    units: &[("dbar", 1e4), ("decibar", 1e4), ("bar", 1e5), ("pa", 1.0), ("kpa", 1e3)],
    without_unit: None,
};
const TEMPERATURE: Wanted = Wanted {
    column: "sci_water_temp_degC",
    names: &["temperature", "TEMP", "sci_water_temp", "sea_water_temperature"],
    units: CELSIUS,
    without_unit: None,
};
const SALINITY: Wanted =
    Wanted { column: "sci_density_kg_m3", names: &["salinity", "PSAL", "practical_salinity"], units: PLAIN, without_unit: Some(1.0) };
const CONDUCTIVITY: Wanted = Wanted {
    column: "sci_density_kg_m3",
    names: &["conductivity", "CNDC", "sci_water_cond"],
    units: &[("s/m", 1.0), ("s m-1", 1.0), ("ms/cm", 0.1), ("ms cm-1", 0.1)],
    without_unit: None,
};
const DENSITY: Wanted =
    Wanted { column: "sci_density_kg_m3", names: &["DENSITY", "density"], units: &[("kg/m3", 1.0), ("kg m-3", 1.0)], without_unit: None };
const PITCH: Wanted = Wanted {
    column: "m_pitch_rad",
    names: &["eng_pitchAng", "PITCH", "GLIDER_PITCH", "pitch", "m_pitch"],
    units: ANGLES,
    without_unit: None,
};
const ROLL: Wanted =
    Wanted { column: "m_roll_rad", names: &["eng_rollAng", "ROLL", "GLIDER_ROLL", "roll", "m_roll"], units: ANGLES, without_unit: None };
const HEADING: Wanted = Wanted {
    column: "m_heading_rad",
    names: &["eng_head", "HEADING", "GLIDER_HEADING", "heading", "m_heading"],
    units: ANGLES,
    without_unit: None,
};
const BALLAST: Wanted = Wanted {
    column: "m_ballast_pumped_cc",
    names: &["eng_vbdCC", "vbdCC", "BALLAST", "GLIDER_BALLAST", "m_ballast_pumped", "m_de_oil_vol", "ballast"],
    units: &[("cc", 1e-6), ("cm3", 1e-6), ("cm^3", 1e-6), ("m3", 1.0), ("ml", 1e-6)],
    without_unit: Some(1e-6),
};
const BATTERY: Wanted = Wanted {
    column: "m_battpos_m",
    names: &["BATTERY_POSITION", "m_battpos"],
    units: &[("m", 1.0), ("in", 0.0254), ("inch", 0.0254)],
    without_unit: None,
};
const SPEED: Wanted = Wanted {
    column: "speed_water_m_s",
    names: &["SPEED_WATER", "speed_through_water"],
    units: &[("m/s", 1.0), ("m s-1", 1.0), ("cm/s", 0.01)],
    without_unit: None,
};
const LATITUDE: Wanted =
    Wanted { column: "gps_north_m", names: &["log_gps_lat", "LATITUDE_GPS", "gps_lat", "m_gps_lat"], units: DEGREES, without_unit: None };
const LONGITUDE: Wanted =
    Wanted { column: "gps_east_m", names: &["log_gps_lon", "LONGITUDE_GPS", "gps_lon", "m_gps_lon"], units: DEGREES, without_unit: None };

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let name = path.display().to_string();
    let error = |what: String| ImportError { file: name.clone(), what };
    let file = NcFile::open(path).map_err(|e| error(format!("is no NetCDF file that can be read: {e}")))?;
    let mut reader = Reader { file: &file, report: Report { kind: "NetCDF".into(), ..Report::default() } };
    let (pressure_name, pressure) =
        reader.channel(&PRESSURE).ok_or_else(|| error(format!("has no pressure with a time: looked for {}", PRESSURE.names.join(", "))))?;
    let rows: Vec<(f64, f64)> = pressure.pairs().collect();
    if rows.len() < 2 {
        return Err(error(format!("{pressure_name} has {} values", rows.len())));
    }
    let unix: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let on = |series: Option<(String, Series)>| series.map_or_else(|| vec![f64::NAN; unix.len()], |(_, s)| s.on(&unix));
    let temperature = on(reader.channel(&TEMPERATURE));
    let lat = reader.channel(&LATITUDE).map_or_else(Series::default, |(_, s)| s);
    let lon = reader.channel(&LONGITUDE).map_or_else(Series::default, |(_, s)| s);
    let fixes = position::fixes(&lat, &lon);
    let place = fixes.first().map(|f| Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg });
    let density = reader.density(&unix, &rows, &temperature, place);
    let mut flight = Flight {
        name: path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        time_s: unix.iter().map(|t| t - unix[0]).collect(),
        segment: vec![0; unix.len()],
        pressure_pa: rows.iter().map(|r| r.1).collect(),
        pitch_rad: on(reader.channel(&PITCH)),
        roll_rad: on(reader.channel(&ROLL)),
        heading_rad: reader.channel(&HEADING).map_or_else(|| vec![f64::NAN; unix.len()], |(_, s)| s.angle_on(&unix)),
        ballast_m3: on(reader.channel(&BALLAST)),
        battery_mass_m: on(reader.channel(&BATTERY)),
        temperature_degc: temperature,
        density_kg_m3: density,
        gps_east_m: vec![f64::NAN; unix.len()],
        gps_north_m: vec![f64::NAN; unix.len()],
        speed_m_s: reader.channel(&SPEED).map(|(_, s)| s.on(&unix)),
        ..Flight::default()
    };
    let mut report = reader.report;
    segments_at_gaps(&mut flight);
    position::place(&mut flight, &unix, &fixes, &mut report);
    report.start_unix_s = Some(unix[0]);
    report.segments = vec![flight.name.clone()];
    report.files.push(FileNote { file: name, rows: unix.len(), problems: Vec::new() });
    Ok(Imported { flight, report })
}

/// Silence longer than this ends a segment, s: nothing in the file says where the glider surfaced.
const SEGMENT_GAP_S: f64 = 600.0;

fn segments_at_gaps(flight: &mut Flight) {
    for i in 1..flight.len() {
        flight.segment[i] = flight.segment[i - 1] + u32::from(flight.time_s[i] - flight.time_s[i - 1] > SEGMENT_GAP_S);
    }
}

struct Reader<'a> {
    file: &'a NcFile,
    report: Report,
}

impl Reader<'_> {
    /// The first of the wanted names that is there with a clock and a unit, in SI on Unix time.
    fn channel(&mut self, wanted: &Wanted) -> Option<(String, Series)> {
        for name in wanted.names {
            let Ok(variable) = self.file.variable(name) else { continue };
            let [dimension] = variable.dimensions() else { continue };
            let dimension = dimension.name.clone();
            let unit = self.text(name, "units").unwrap_or_default();
            let known = wanted.units.iter().find(|(u, _)| u.eq_ignore_ascii_case(unit.trim())).map(|(_, f)| *f);
            let factor = match (known, wanted.without_unit) {
                (Some(factor), _) => factor,
                (None, Some(factor)) if unit.trim().is_empty() => {
                    self.report.note(format!("{name} states no unit; taken as {} to SI", factor));
                    factor
                }
                _ => {
                    self.report.note(format!("{name} is in \"{unit}\", which is not known for it: left out"));
                    continue;
                }
            };
            let Some(time) = self.clock(&dimension) else {
                self.report.note(format!("{name} has no time on its dimension {dimension}: left out"));
                continue;
            };
            let Ok(values) = self.file.read_variable_unpacked_masked(name) else {
                self.report.note(format!("{name} cannot be read: left out"));
                continue;
            };
            let values: Vec<f64> = values.iter().map(|v| v * factor).collect();
            let series = Series::new(&time, &values);
            if series.is_empty() {
                continue;
            }
            self.report.map(MappedName { from: (*name).into(), unit, to: wanted.column.into(), factor });
            return Some(((*name).to_owned(), series));
        }
        None
    }

    /// Unix times of a dimension: the variable on it whose unit is "… since …".
    fn clock(&self, dimension: &str) -> Option<Vec<f64>> {
        let variables = self.file.variables().ok()?;
        let mut candidates: Vec<&str> = variables
            .iter()
            .filter(|v| matches!(v.dimensions(), [d] if d.name == dimension))
            .map(|v| v.name())
            .filter(|name| name.to_ascii_lowercase().contains("time"))
            .collect();
        // "time" and "TIME" before "..._time_of_something".
        candidates.sort_by_key(|name| name.len());
        candidates.into_iter().find_map(|name| {
            let (scale, epoch) = since(&self.text(name, "units")?)?;
            let values = self.file.read_variable_unpacked_masked(name).ok()?;
            Some(values.iter().map(|v| v * scale + epoch).collect())
        })
    }

    fn text(&self, variable: &str, attribute: &str) -> Option<String> {
        let variable = self.file.variable(variable).ok()?;
        let found = variable.attributes().iter().find(|a| a.name == attribute)?;
        found.value.as_string()
    }

    fn density(&mut self, unix: &[f64], rows: &[(f64, f64)], temperature: &[f64], place: Option<Place>) -> Vec<f64> {
        let dbar = |i: usize| rows[i].1 * 1e-4;
        let practical: Option<(String, Vec<f64>)> = match self.channel(&SALINITY) {
            Some((name, s)) => Some((name, s.on(unix))),
            None => self.channel(&CONDUCTIVITY).map(|(name, s)| {
                let c = s.on(unix);
                (name, (0..unix.len()).map(|i| seawater::practical_salinity(c[i], temperature[i], dbar(i))).collect())
            }),
        };
        if let Some((name, practical)) = practical {
            self.report.density_from(&format!("{name}, temperature, pressure"), place, true);
            return (0..unix.len())
                .map(|i| seawater::density(seawater::absolute_salinity(practical[i], place), temperature[i], dbar(i)))
                .collect();
        }
        match self.channel(&DENSITY) {
            Some((name, s)) => {
                self.report.density = format!("as the file states it ({name}): there is no salinity to recompute it from");
                s.on(unix)
            }
            None => {
                self.report.density_from("salinity or conductivity, temperature, pressure", place, false);
                vec![f64::NAN; unix.len()]
            }
        }
    }
}

/// Seconds per unit and Unix time of the origin of "seconds since 1970-01-01 00:00:00".
fn since(units: &str) -> Option<(f64, f64)> {
    let (unit, date) = units.split_once(" since ")?;
    let scale = match unit.trim().to_ascii_lowercase().as_str() {
        "seconds" | "second" | "s" | "secs" => 1.0,
        "minutes" | "minute" => 60.0,
        "hours" | "hour" => 3600.0,
        "days" | "day" => 86400.0,
        _ => return None,
    };
    let mut numbers = date.split(|c: char| !c.is_ascii_digit() && c != '.').filter(|s| !s.is_empty()).map(str::parse::<f64>);
    let mut next = || numbers.next().and_then(Result::ok);
    let (year, month, day) = (next()?, next()?, next()?);
    let clock = next().unwrap_or(0.0) * 3600.0 + next().unwrap_or(0.0) * 60.0 + next().unwrap_or(0.0);
    Some((scale, days_from_1970(year as i64, month as i64, day as i64)? as f64 * 86400.0 + clock))
}

/// Days from 1970-01-01 of the Gregorian calendar (Fliegel and Van Flandern 1968, Comm. ACM 11, 657).
fn days_from_1970(year: i64, month: i64, day: i64) -> Option<i64> {
    if !((1..=12).contains(&month) && (1..=31).contains(&day) && (1..4000).contains(&year)) {
        return None;
    }
    let m = (month - 14) / 12;
    let julian = (1461 * (year + 4800 + m)) / 4 + (367 * (month - 2 - 12 * m)) / 12 - (3 * ((year + 4900 + m) / 100)) / 4 + day - 32_075;
    Some(julian - 2_440_588)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_of_time_are_read() {
        assert_eq!(since("seconds since 1970-1-1 00:00:00"), Some((1.0, 0.0)));
        assert_eq!(since("days since 1950-01-01T00:00:00Z"), Some((86400.0, -7305.0 * 86400.0)));
        assert_eq!(since("seconds since 2000-03-01 12:00"), Some((1.0, 951_912_000.0)));
        assert_eq!(since("metres"), None);
        assert_eq!(since("fortnights since 1970-01-01"), None);
    }
}
