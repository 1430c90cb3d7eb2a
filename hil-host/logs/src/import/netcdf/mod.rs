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

use super::channels::{CLOCKS_APART_S, SALINITY_COLUMN, lonely_times, report_seldom};
use super::position::FIX_DEPTH_PA;
use super::{FileNote, ImportError, Imported, Report, position, pressure_zero};
use crate::record::flight::Flight;
use crate::record::resample::Series;
use crate::record::seawater::Place;

mod attitude;
mod backwards;
mod clocks;
pub(super) mod fills;
pub(super) mod flags;
mod groups;
pub(super) mod names;
pub mod own;
mod pressure;
mod scalars;
mod stated_vehicle;
pub(super) mod variables;
mod water;

pub use scalars::{Identity, Scalars, scalars, speed_witness};

use names::{ABOUT_LATITUDE, ABOUT_LONGITUDE, BALLAST, BATTERY, DIVE, EAST, LATITUDE, LONGITUDE, NORTH, SPEED, TEMPERATURE};
use variables::{Channel, Reader};
use water::at_rows;

/// Values of a file take at most so many times its bytes, and this much more: a declared size is no size.
const UNPACKED: u64 = 20;
const SMALLEST_BUDGET: u64 = 8 << 20;

/// Bytes that the values of a file may take.
pub(super) fn budget(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |m| m.len()).saturating_mul(UNPACKED).saturating_add(SMALLEST_BUDGET)
}

pub(super) fn open(path: &Path) -> netcdf_reader::Result<NcFile> {
    groups::have_an_end(path).map_err(netcdf_reader::Error::InvalidData)?;
    let limit = usize::try_from(budget(path)).unwrap_or(usize::MAX);
    NcFile::open_with_options(path, NcOpenOptions { max_read_bytes: limit, max_chunk_bytes: limit, ..NcOpenOptions::default() })
}

/// A file of one vehicle with variables that can be listed; else why it is none.
fn sound(path: &Path) -> Result<NcFile, String> {
    if std::fs::metadata(path).is_ok_and(|m| m.len() == 0) {
        return Err("is empty".into());
    }
    let file = open(path).map_err(|e| format!("is no NetCDF file that can be read: {e}"))?;
    file.variables().map_err(|e| format!("is damaged or cut: its variables cannot be listed ({e})"))?;
    if let Some(mixed) = Identity::of(&file).mixed() {
        return Err(format!("holds rows {mixed}"));
    }
    let trajectories = Identity::trajectories(&file);
    if trajectories > 1 {
        return Err(format!("holds {trajectories} trajectories (dimension {}): import one at a time", scalars::TRAJECTORY));
    }
    Ok(file)
}

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let name = path.display().to_string();
    let error = |what: String| ImportError { file: name.clone(), what };
    let file = sound(path).map_err(error)?;
    let mut reader = Reader {
        file: &file,
        report: Report::new("NetCDF"),
        budget: budget(path),
        clocks: std::collections::BTreeMap::new(),
        salinity: None,
    };
    let (pressure, rows) = reader.rows().map_err(error)?;
    let unix: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let own = reader.is_own();
    let on = |series: &Series| if own { at_rows(series, &unix) } else { series.on(&unix) };
    let temperature = reader.channel(&TEMPERATURE).map_or_else(|| vec![f64::NAN; unix.len()], |c| reader.on_rows(&c.series, &unix));
    let fixes = reader.fixes(&pressure.series);
    let place = fixes.first().map(|f| Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg }).or_else(|| reader.about());
    let density = reader.density(&unix, &rows, &temperature, place);
    let [pitch, roll, heading] = reader.attitude(&pressure.series);
    let ballast = reader.channel(&BALLAST).map_or_else(Series::default, |c| c.series);
    for (series, column) in [(&pitch, "pitch"), (&roll, "roll"), (&heading, "heading"), (&ballast, "ballast")] {
        reader.report_other_clock(series, column, &pressure);
        if !own && ["pitch", "ballast"].contains(&column) {
            report_seldom(column, series, &series.on(&unix), &mut reader.report);
        }
    }
    let mut flight = Flight {
        name: path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned()),
        time_s: unix.iter().map(|t| t - unix[0]).collect(),
        segment: vec![0; unix.len()],
        pressure_pa: rows.iter().map(|r| r.1).collect(),
        pitch_rad: on(&pitch),
        roll_rad: on(&roll),
        heading_rad: if own { at_rows(&heading, &unix) } else { heading.angle_on(&unix) },
        ballast_m3: on(&ballast),
        battery_mass_m: on(&reader.channel(&BATTERY).map_or_else(Series::default, |c| c.series)),
        temperature_degc: temperature,
        density_kg_m3: density,
        gps_east_m: vec![f64::NAN; unix.len()],
        gps_north_m: vec![f64::NAN; unix.len()],
        speed_m_s: reader.channel(&SPEED).map(|c| reader.on_rows(&c.series, &unix)),
        ..Flight::default()
    };
    reader.segments(&mut flight, &unix);
    if let Some(salinity) = reader.salinity.take() {
        flight.extra.insert(SALINITY_COLUMN.into(), salinity);
    }
    reader.own_extra(&mut flight, &unix);
    for (wanted, column) in [(&EAST, &mut flight.gps_east_m), (&NORTH, &mut flight.gps_north_m)] {
        // A fix holds at its instant only.
        for (t, v) in reader.channel(wanted).iter().flat_map(|c| c.series.pairs()) {
            let row = unix.partition_point(|u| *u < t);
            if unix.get(row) == Some(&t) {
                column[row] = v;
            }
        }
    }
    let (dated, first_s, vehicle_file) = (reader.is_dated(), reader.own_first_s(), reader.own_vehicle());
    let vehicle = reader.stated_vehicle().filter(|_| vehicle_file.is_none());
    let mut report = reader.report;
    position::place(&mut flight, &unix, &fixes, &mut report);
    flight.time_s.iter_mut().for_each(|t| *t += first_s);
    report.start_unix_s = dated.then_some(unix[0] - first_s);
    report.files.push(FileNote { file: name, rows: unix.len(), problems: Vec::new() });
    Ok(Imported { vehicle, vehicle_file, ..Imported::new(flight, report) })
}

/// Single samples out of order happen where a clock is set; more is a damaged file. Share of the samples, guess.
const BACKWARDS: f64 = 0.01;

impl Reader<'_> {
    /// The pressure, and its instants with what it is there, in order and with its zero taken out.
    fn rows(&mut self) -> Result<(Channel, Vec<(f64, f64)>), String> {
        let mut pressure = self.pressure().ok_or_else(|| self.without_pressure())?;
        if let Some(back) = pressure.backwards.take() {
            let (out, of) = back.samples;
            let said = format!("{}: time goes backwards, {out} of {of} samples are out of order, first {}", pressure.name, back.first);
            if out as f64 > BACKWARDS * of as f64 {
                return Err(format!("{said}; sort the samples by time, or cut the file where its clock was set"));
            }
            self.report.leave_out(said);
            pressure.series = back.without;
        }
        let (mut times, values): (Vec<f64>, Vec<f64>) = pressure.series.pairs().unzip();
        let alone = lonely_times(&mut times);
        if alone > 0 {
            self.report.leave_out(format!("{alone} of {} values of {} stand alone days off the others", values.len(), pressure.name));
            pressure.series = Series::new(&times, &values);
        }
        let mut rows: Vec<(f64, f64)> = pressure.series.pairs().collect();
        if rows.len() < 2 {
            return Err(format!("{} has {} values", pressure.name, rows.len()));
        }
        if pressure_zero::take_out(&mut rows, |r| (r.0, &mut r.1), |_| 0, &mut self.report).is_some() {
            let (time, value): (Vec<f64>, Vec<f64>) = rows.iter().copied().unzip();
            pressure.series = Series::new(&time, &value);
        }
        Ok((pressure, rows))
    }

    /// Fixes at the surface.
    fn fixes(&mut self, pressure: &Series) -> Vec<position::Fix> {
        let series = |c: Option<Channel>| c.map_or_else(Series::default, |c| c.series);
        let (lat, lon) = (series(self.channel(&LATITUDE)), series(self.channel(&LONGITUDE)));
        let fixes = self.of_this_era(position::fixes(&lat, &lon), pressure);
        let mut fixes = position::sound(fixes, &mut self.report);
        let all = fixes.len();
        fixes.retain(|f| !(pressure.at(f.time_s) > FIX_DEPTH_PA) && f.lat_deg.abs() <= 90.0 && f.lon_deg.abs() <= 360.0);
        if fixes.len() < all {
            self.report.note(format!("{} of {all} GPS fixes lie below 3 dbar or off the globe: they are no fixes", all - fixes.len()));
        }
        fixes
    }

    /// Fixes whose receiver counted the weeks of GPS anew are of the days of the pressure.
    fn of_this_era(&mut self, mut fixes: Vec<position::Fix>, pressure: &Series) -> Vec<position::Fix> {
        /// 1024 weeks, and how far off a fix is from its rows at most, s.
        const ERA_S: f64 = 1024.0 * 7.0 * 86_400.0;
        const REACH_S: f64 = 3.0 * 86_400.0;
        let Some((first, _)) = pressure.pairs().next() else { return fixes };
        let mut moved = 0;
        for fix in &mut fixes {
            let eras = ((first - fix.time_s) / ERA_S).round();
            if eras != 0.0 && (fix.time_s + eras * ERA_S - first).abs() < REACH_S {
                fix.time_s += eras * ERA_S;
                moved += 1;
            }
        }
        if moved > 0 {
            self.report
                .note(format!("{moved} GPS fixes are 1024 weeks off (weeks of GPS counted anew): brought to the days of the pressure"));
        }
        fixes
    }

    /// A channel whose run is not that of the pressure: begun and ended earlier, or later, by the same time, on another clock.
    fn report_other_clock(&mut self, series: &Series, what: &str, pressure: &Channel) {
        let span = |s: &Series| Some((s.pairs().next()?.0, s.pairs().last()?.0));
        let (Some(own), Some(rows)) = (span(series), span(&pressure.series)) else { return };
        let (begins_s, ends_s) = (own.0 - rows.0, own.1 - rows.1);
        let apart = own.1 < rows.0 || own.0 > rows.1;
        let shifted = begins_s.abs() > CLOCKS_APART_S && (begins_s - ends_s).abs() < 0.2 * begins_s.abs();
        if apart || shifted {
            self.report.leave_out(format!(
                "{what} runs on another clock than {}: {begins_s:+.0} s at its begin, {ends_s:+.0} s at its end; set one of the two",
                pressure.name
            ));
        }
    }

    /// Where it was, roughly, where there is no fix.
    fn about(&mut self) -> Option<Place> {
        let first = |c: Option<Channel>| c.and_then(|c| c.series.pairs().next()).map(|(_, v)| v);
        let place = first(self.aside(&ABOUT_LATITUDE)).zip(first(self.aside(&ABOUT_LONGITUDE)));
        place.map(|(lat_deg, lon_deg)| Place { lon_deg, lat_deg })
    }

    /// One segment a dive where the file numbers its dives, else a new one after each long silence.
    fn segments(&mut self, flight: &mut Flight, unix: &[f64]) {
        if let Some((name, dives)) = DIVE.iter().find_map(|n| Some((*n, self.numbers(n)?))) {
            let numbers: Vec<(f64, f64)> = dives.pairs().collect();
            let of = |t: f64| numbers[numbers.partition_point(|n| n.0 <= t).max(1) - 1].1;
            for i in 1..flight.len() {
                flight.segment[i] = flight.segment[i - 1] + u32::from(of(unix[i]) != of(unix[i - 1]));
            }
            if self.is_own() {
                // Its vehicle names segments by these numbers.
                flight.segment = unix.iter().map(|t| of(*t) as u32).collect();
            }
            self.report.note(format!("segments are what {name} numbers"));
            self.report.numbered = true;
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

#[cfg(test)]
mod lab_tests;
#[cfg(test)]
mod mistake_tests;
#[cfg(test)]
mod tests;
