//! NetCDF of other gliders: Seaglider base-station files, OG1, IOOS; classic and HDF5-based alike.
//!
//! A channel is found by its usual names; its unit is read from the variable,
//! never guessed (a few Seaglider variables have none: their unit is fixed by the
//! name and the report says so). Every variable stands on the clock that its
//! `coordinates` name; rows are the instants with a pressure. Values flagged bad or
//! missing are left out.
//!
//! Met in files of real gliders, and mended with a note in the report:
//! * angles that state degrees and are radians (Slocum through pyglider 0.0.9);
//! * magnetic headings, turned to true ones where the file gives the variation;
//! * "GPS fixes" interpolated through the dive;
//! * depth instead of pressure, up or down positive;
//! * time in nanoseconds; several clocks on one dimension.
//!
//! A density in the file is not used when there is salinity: Seaglider's
//! `density_insitu` leaves out pressure, 2 kg/m³ at 500 m.

use std::path::Path;

use netcdf_reader::{NcFile, NcOpenOptions};

use super::channels::SALINITY as SALINITY_COLUMN;
use super::{FileNote, ImportError, Imported, Report, position};
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

pub(super) mod names;
mod scalars;
pub(super) mod variables;

pub use scalars::{Scalars, scalars, speed_witness, trajectory};

use names::{
    ABOUT_LATITUDE, ABOUT_LONGITUDE, BALLAST, BATTERY, CONDUCTIVITY, DEGREE, DENSITY, DEPTH, DIVE, EAST, HEADING, LATITUDE, LONGITUDE,
    NORTH, PITCH, PRESSURE, ROLL, SALINITY, SPEED, TEMPERATURE,
};
use variables::{Channel, Reader};

/// Values of a file take at most so many times its bytes, and this much more: a declared size is no size.
const UNPACKED: u64 = 20;
const SMALLEST_BUDGET: u64 = 8 << 20;

/// Bytes that the values of a file may take.
pub(super) fn budget(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |m| m.len()).saturating_mul(UNPACKED).saturating_add(SMALLEST_BUDGET)
}

pub(super) fn open(path: &Path) -> netcdf_reader::Result<NcFile> {
    let limit = usize::try_from(budget(path)).unwrap_or(usize::MAX);
    NcFile::open_with_options(path, NcOpenOptions { max_read_bytes: limit, max_chunk_bytes: limit, ..NcOpenOptions::default() })
}

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let name = path.display().to_string();
    let error = |what: String| ImportError { file: name.clone(), what };
    if std::fs::metadata(path).is_ok_and(|m| m.len() == 0) {
        return Err(error("is empty".into()));
    }
    let file = open(path).map_err(|e| error(format!("is no NetCDF file that can be read: {e}")))?;
    file.variables().map_err(|e| error(format!("is damaged or cut: its variables cannot be listed ({e})")))?;
    let mut reader = Reader {
        file: &file,
        report: Report::new("NetCDF"),
        budget: budget(path),
        clocks: std::collections::BTreeMap::new(),
        salinity: None,
    };
    let mut pressure = reader.pressure().ok_or_else(|| error(reader.without_pressure()))?;
    if let Some(back) = pressure.backwards.take() {
        let (out, of) = back.samples;
        let said = format!("{}: time goes backwards, {out} of {of} samples are out of order, first {}", pressure.name, back.first);
        if out as f64 > BACKWARDS * of as f64 {
            return Err(error(format!("{said}; sort the samples by time, or cut the file where its clock was set")));
        }
        reader.report.leave_out(said);
        pressure.series = back.without;
    }
    let rows: Vec<(f64, f64)> = pressure.series.pairs().collect();
    if rows.len() < 2 {
        return Err(error(format!("{} has {} values", pressure.name, rows.len())));
    }
    let unix: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let on = |series: Option<Channel>| series.map_or_else(|| vec![f64::NAN; unix.len()], |c| c.series.on(&unix));
    let temperature = reader.channel(&TEMPERATURE).map_or_else(|| vec![f64::NAN; unix.len()], |c| on_rows(&c.series, &unix));
    let fixes = reader.fixes(&pressure.series);
    let place = fixes.first().map(|f| Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg }).or_else(|| reader.about());
    let density = reader.density(&unix, &rows, &temperature, place);
    let [pitch, roll, heading] = reader.attitude(&pressure.series);
    let mut flight = Flight {
        name: path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        time_s: unix.iter().map(|t| t - unix[0]).collect(),
        segment: vec![0; unix.len()],
        pressure_pa: rows.iter().map(|r| r.1).collect(),
        pitch_rad: pitch.on(&unix),
        roll_rad: roll.on(&unix),
        heading_rad: heading.angle_on(&unix),
        ballast_m3: on(reader.channel(&BALLAST)),
        battery_mass_m: on(reader.channel(&BATTERY)),
        temperature_degc: temperature,
        density_kg_m3: density,
        gps_east_m: vec![f64::NAN; unix.len()],
        gps_north_m: vec![f64::NAN; unix.len()],
        speed_m_s: reader.channel(&SPEED).map(|c| c.series.on(&unix)),
        ..Flight::default()
    };
    reader.segments(&mut flight, &unix);
    if let Some(salinity) = reader.salinity.take() {
        flight.extra.insert(SALINITY_COLUMN.into(), salinity);
    }
    for (wanted, column) in [(&EAST, &mut flight.gps_east_m), (&NORTH, &mut flight.gps_north_m)] {
        // A fix holds at its instant only.
        for (t, v) in reader.channel(wanted).iter().flat_map(|c| c.series.pairs()) {
            let row = unix.partition_point(|u| *u < t);
            if unix.get(row) == Some(&t) {
                column[row] = v;
            }
        }
    }
    let mut report = reader.report;
    position::place(&mut flight, &unix, &fixes, &mut report);
    report.start_unix_s = Some(unix[0]);
    report.files.push(FileNote { file: name, rows: unix.len(), problems: Vec::new() });
    Ok(Imported { flight, report, vehicle: None })
}

/// Single samples out of order happen where a clock is set; more is a damaged file. Share of the samples, guess.
const BACKWARDS: f64 = 0.01;
/// A fix needs the aerial in air; deeper than this it is interpolated, Pa (3 dbar: pressure zero and the vehicle's length).
const FIX_DEPTH_PA: f64 = 3e4;
/// Gliders that dive pitch by 15 to 40 degrees; nine tenths of a file within this many "degrees" are radians.
const FLATTEST: f64 = 2.0;
/// Depth and pressure of one file agree within this share (1 dbar is 0.97 to 1.02 m) where it is below 10 dbar.
const DEPTH_SHARE: f64 = 0.1;

impl Reader<'_> {
    /// Pressure, or what depth says about it.
    fn pressure(&mut self) -> Option<Channel> {
        let pressure = self.channel(&PRESSURE);
        let mapped = self.report.mapped.len();
        let depth = self.channel(&DEPTH);
        self.report.mapped.truncate(mapped);
        match (pressure, depth) {
            (Some(pressure), Some(depth)) => {
                let shares: Vec<f64> = pressure
                    .series
                    .pairs()
                    .filter(|(_, p)| *p > 1e5)
                    .map(|(t, p)| depth.series.at(t).abs() / (p * 1e-4))
                    .filter(|s| s.is_finite())
                    .collect();
                let share = quantile(&shares, 0.5);
                if (share - 1.0).abs() > DEPTH_SHARE {
                    self.report.note(format!(
                        "{} and {} do not agree: 1 dbar is {share:.4} m there; one of them states a wrong unit",
                        pressure.name, depth.name
                    ));
                }
                Some(pressure)
            }
            (Some(pressure), None) => Some(pressure),
            (None, Some(mut depth)) => {
                let place = self.about();
                let lat_deg = place.map_or(45.0, |p| p.lat_deg);
                let (time, z): (Vec<f64>, Vec<f64>) = depth.series.pairs().unzip();
                // Positive where the middle of the samples is, whatever the attribute says: nobody measures in the air.
                let sign = if quantile(&z, 0.5) < 0.0 { -1.0 } else { 1.0 };
                let pa: Vec<f64> = z.iter().map(|z| seawater::pressure_pa(sign * z, lat_deg)).collect();
                depth.series = Series::new(&time, &pa);
                depth.backwards = None;
                let about = if place.is_some() { "" } else { " (latitude unknown, 45 deg taken)" };
                self.report.note(format!("no pressure: computed from {} by TEOS-10 at {lat_deg:.1} deg{about}", depth.name));
                self.report.map(super::MappedName {
                    from: depth.name.clone(),
                    unit: self.text(&depth.name, "units").unwrap_or_default(),
                    to: DEPTH.column.into(),
                    factor: 1e4,
                });
                Some(depth)
            }
            (None, None) => None,
        }
    }

    fn without_pressure(&self) -> String {
        let names = PRESSURE.names.iter().chain(DEPTH.names).copied().collect::<Vec<_>>().join(", ");
        let said: Vec<&str> = self.report.left_out.iter().chain(&self.report.notes).map(String::as_str).collect();
        let why = if said.is_empty() { String::new() } else { format!(" ({})", said.join("; ")) };
        format!("has no pressure or depth with a time: looked for {names}{why}")
    }

    /// Fixes at the surface.
    fn fixes(&mut self, pressure: &Series) -> Vec<position::Fix> {
        let series = |c: Option<Channel>| c.map_or_else(Series::default, |c| c.series);
        let (lat, lon) = (series(self.channel(&LATITUDE)), series(self.channel(&LONGITUDE)));
        let mut fixes = position::fixes(&lat, &lon);
        let all = fixes.len();
        fixes.retain(|f| !(pressure.at(f.time_s) > FIX_DEPTH_PA) && f.lat_deg.abs() <= 90.0 && f.lon_deg.abs() <= 360.0);
        if fixes.len() < all {
            self.report.note(format!("{} of {all} GPS fixes lie below 3 dbar or off the globe: they are no fixes", all - fixes.len()));
        }
        fixes
    }

    /// Where it was, roughly, where there is no fix.
    fn about(&mut self) -> Option<Place> {
        let mapped = self.report.mapped.len();
        let first = |c: Option<Channel>| c.and_then(|c| c.series.pairs().next()).map(|(_, v)| v);
        let place = first(self.channel(&ABOUT_LATITUDE)).zip(first(self.channel(&ABOUT_LONGITUDE)));
        self.report.mapped.truncate(mapped);
        place.map(|(lat_deg, lon_deg)| Place { lon_deg, lat_deg })
    }

    /// Pitch, roll and true heading, rad.
    fn attitude(&mut self, pressure: &Series) -> [Series; 3] {
        let mut channels = [&PITCH, &ROLL, &HEADING].map(|wanted| self.channel(wanted));
        let moves = pressure.pairs().map(|(_, p)| p).fold(0.0, f64::max) > 1e5;
        let small =
            |c: &Channel, limit: f64, q: f64| quantile(&c.series.pairs().map(|(_, v)| (v / DEGREE).abs()).collect::<Vec<_>>(), q) < limit;
        let stated_degrees = |report: &Report, name: &str| report.mapped.iter().any(|m| m.from == name && m.factor == DEGREE);
        let radians = channels[0].as_ref().is_some_and(|c| moves && small(c, FLATTEST, 0.9) && stated_degrees(&self.report, &c.name));
        if radians {
            for channel in channels.iter_mut().flatten() {
                // The largest angle in radians is a full turn.
                if stated_degrees(&self.report, &channel.name) && small(channel, std::f64::consts::TAU + 0.01, 1.0) {
                    self.report.note(format!("{} states degrees but its values are radians: taken as radians", channel.name));
                    for m in self.report.mapped.iter_mut().filter(|m| m.from == channel.name) {
                        m.factor = 1.0;
                    }
                    channel.series = scaled(&channel.series, |v| v / DEGREE);
                }
            }
        }
        // Further than a turn and its rounding in nine tenths of the rows is no heading; it would be wrapped into one.
        if let Some(heading) = channels[2].take_if(|c| quantile(&c.series.pairs().map(|(_, v)| v.abs()).collect::<Vec<_>>(), 0.9) > 7.0) {
            let reach = quantile(&heading.series.pairs().map(|(_, v)| v.abs()).collect::<Vec<_>>(), 0.9);
            self.report.note(format!("{} reaches {reach:.1} rad by its unit, more than a turn: left out", heading.name));
        }
        if let Some(heading) = &mut channels[2] {
            let magnetic = self.text(&heading.name, "comment").is_some_and(|c| c.to_ascii_lowercase().contains("magnetic"));
            if let Some(variation) = self.scalar("magnetic_variation").filter(|_| magnetic || heading.name == "eng_head") {
                self.report.note(format!("{} is magnetic: variation of {variation} deg added", heading.name));
                heading.series = scaled(&heading.series, |v| v + variation * DEGREE);
            } else if magnetic {
                self.report.note(format!("{} is magnetic and the file gives no variation: left as it is", heading.name));
            }
        }
        channels.map(|c| c.map_or_else(Series::default, |c| c.series))
    }

    fn density(&mut self, unix: &[f64], rows: &[(f64, f64)], temperature: &[f64], place: Option<Place>) -> Vec<f64> {
        let dbar = |i: usize| rows[i].1 * 1e-4;
        let practical: Option<(String, Vec<f64>)> = match self.channel(&SALINITY) {
            Some(c) => Some((c.name, on_rows(&c.series, unix))),
            None => self.channel(&CONDUCTIVITY).map(|c| {
                let values = on_rows(&c.series, unix);
                (c.name, (0..unix.len()).map(|i| seawater::practical_salinity(values[i], temperature[i], dbar(i))).collect())
            }),
        };
        if let Some((name, practical)) = practical {
            self.report.density_from(&format!("{name}, temperature, pressure"), place, true);
            self.salinity = Some(practical.clone());
            return (0..unix.len()).map(|i| seawater::density_of_water(practical[i], place, temperature[i], dbar(i))).collect();
        }
        match self.channel(&DENSITY) {
            Some(c) => {
                self.report.density = format!("as the file states it ({}): there is no salinity to recompute it from", c.name);
                c.series.on(unix)
            }
            None => {
                self.report.density_from("salinity or conductivity, temperature, pressure", place, false);
                vec![f64::NAN; unix.len()]
            }
        }
    }

    /// One segment a dive where the file numbers its dives, else a new one after each long silence.
    fn segments(&mut self, flight: &mut Flight, unix: &[f64]) {
        if let Some((name, dives)) = DIVE.iter().find_map(|n| Some((*n, self.numbers(n)?))) {
            let numbers: Vec<(f64, f64)> = dives.pairs().collect();
            let of = |t: f64| numbers[numbers.partition_point(|n| n.0 <= t).max(1) - 1].1;
            for i in 1..flight.len() {
                flight.segment[i] = flight.segment[i - 1] + u32::from(of(unix[i]) > of(unix[i - 1]));
            }
            self.report.note(format!("segments are what {name} numbers"));
            self.report.segments = segment_names(flight, |i| format!("{name} {}", of(unix[i])));
        } else {
            super::surface::cut(flight);
            let name = flight.name.clone();
            self.report.segments = segment_names(flight, |i| format!("{name} row {}", i + 1));
        }
    }
}

/// What `name` calls the first row of each segment.
fn segment_names(flight: &Flight, name: impl Fn(usize) -> String) -> Vec<String> {
    (0..flight.len()).filter(|i| *i == 0 || flight.segment[*i] != flight.segment[*i - 1]).map(name).collect()
}

/// Values at the rows: as they are where the channel stands on the rows' own clock, so that what was left out stays out; else
/// between its values.
fn on_rows(series: &Series, unix: &[f64]) -> Vec<f64> {
    let exact: Vec<f64> = unix.iter().map(|t| series.at_within(*t, 0.0)).collect();
    let own_clock = 10 * exact.iter().filter(|v| v.is_finite()).count() >= 9 * series.len();
    if own_clock { exact } else { series.on(unix) }
}

fn scaled(series: &Series, f: impl Fn(f64) -> f64) -> Series {
    let (time, value): (Vec<f64>, Vec<f64>) = series.pairs().map(|(t, v)| (t, f(v))).unzip();
    Series::new(&time, &value)
}

#[cfg(test)]
mod tests;
