//! Columns by their names and the units that the file states, in SI; and the flight that they make.

use super::super::channels::{Log, Row};
use super::super::netcdf::names::{
    ABOUT_LATITUDE, ABOUT_LONGITUDE, BALLAST, BATTERY, CONDUCTIVITY, DENSITY, DEPTH, HEADING, LATITUDE, LONGITUDE, PITCH, PRESSURE, ROLL,
    SALINITY, TEMPERATURE, Wanted,
};
use super::super::{MappedName, Report, position};
use super::times::Clock;
use super::values::{Filled, without_fills};
use super::{CONDUCTIVITIES, SALINITIES, Table};
use crate::record::csv::{Channel, NAMES};
use crate::record::flight::Flight;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

/// A column found, in SI.
struct Found {
    column: usize,
    factor: f64,
    to: &'static str,
    filled: Filled,
    series: Series,
}

/// Which column became what.
struct Columns<'t> {
    table: &'t Table<'t>,
    time: &'t [f64],
    report: &'t mut Report,
    read: Vec<bool>,
}

impl Columns<'_> {
    /// The best filled of the wanted columns whose unit is known; `named` are further names, with the factor where no unit is stated.
    fn find(&mut self, wanted: &Wanted, named: &[(&str, f64)]) -> Option<Found> {
        let mut found: Vec<Found> = Vec::new();
        let further = named.iter().map(|n| n.0).filter(|n| !wanted.names.iter().any(|w| w.eq_ignore_ascii_case(n)));
        for name in wanted.names.iter().copied().chain(further) {
            let Some(column) = self.table.names.iter().position(|h| h.eq_ignore_ascii_case(name)) else { continue };
            if found.iter().any(|f| f.column == column) {
                continue;
            }
            let unit = self.table.unit(column);
            let by_name = || wanted.without_unit.iter().chain(named).find(|(n, _)| unit.is_empty() && n.eq_ignore_ascii_case(name));
            let Some((offset, factor)) = wanted.in_si(unit).or_else(|| by_name().map(|f| (0.0, f.1))) else {
                self.report.leave_out(format!("{name} is in \"{unit}\", which is not known for it: left out"));
                continue;
            };
            let mut values = self.table.numbers(column);
            let possible = wanted.possible();
            let possible = possible.start() / factor + offset..=possible.end() / factor + offset;
            without_fills(name, &mut values, Some(&possible), self.report);
            let filled = Filled::of(&self.table.names[column], &values);
            values.iter_mut().for_each(|v| *v = (*v - offset) * factor);
            let series = Series::new(self.time, &values);
            if !series.is_empty() {
                found.push(Found { column, factor, to: wanted.column, filled, series });
            }
        }
        let filled: Vec<Filled> = found.iter().map(|f| f.filled.clone()).collect();
        let best = Filled::best(&filled);
        for before in &filled[..best.min(filled.len())] {
            filled[best].note_instead_of(before, self.report);
        }
        (best < found.len()).then(|| found.swap_remove(best))
    }

    /// The values of a column that is found, and that it is read.
    fn take(&mut self, found: Option<Found>) -> Series {
        let Some(found) = found else { return Series::default() };
        self.table.report_texts(found.column, self.report);
        self.read[found.column] = true;
        let (from, unit) = (self.table.names[found.column].clone(), self.table.unit(found.column).to_owned());
        self.report.map(MappedName { from, unit, to: found.to.into(), factor: found.factor });
        found.series
    }

    fn get(&mut self, wanted: &Wanted) -> Series {
        let found = self.find(wanted, &[]);
        self.take(found)
    }

    /// The same, also by the names of the flight format.
    fn channel(&mut self, wanted: &Wanted, channel: Channel) -> Series {
        let found = self.find(wanted, &by_name(channel));
        self.take(found)
    }

    /// Pressure, else that of the depth; how many rows have one.
    fn pressure(&mut self, about: Option<Place>) -> (Series, usize) {
        let pressure = self.find(&PRESSURE, &by_name(Channel::Pressure));
        let depth = self.find(&DEPTH, &[]);
        let pair = pressure.as_ref().zip(depth.as_ref()).map(|(p, d)| [p.filled.clone(), d.filled.clone()]);
        let instead = pair.filter(|pair| Filled::best(pair) == 1);
        if let Some([passed, taken]) = &instead {
            taken.note_instead_of(passed, self.report);
        }
        if pressure.is_some() && instead.is_none() {
            let rows = pressure.as_ref().map_or(0, |p| p.filled.values());
            return (self.take(pressure), rows);
        }
        let rows = depth.as_ref().map_or(0, |d| d.filled.values());
        let lat_deg = about.map_or(45.0, |p| p.lat_deg);
        let (t, p): (Vec<f64>, Vec<f64>) = self.take(depth).pairs().map(|(t, z)| (t, seawater::pressure_pa(z, lat_deg))).unzip();
        (Series::new(&t, &p), rows)
    }

    /// The number of the segment of each row by a column of numbers or labels, which are counted as they appear.
    fn segments(&mut self) -> Option<Series> {
        let column = self.table.names.iter().position(|h| h.eq_ignore_ascii_case("segment"))?;
        self.read[column] = true;
        let mut labels: std::collections::BTreeMap<&str, u32> = std::collections::BTreeMap::new();
        let number = |row: &Vec<&'_ str>| row.get(column).copied().unwrap_or_default().parse::<u32>().ok();
        let plain = self.table.rows.iter().all(|r| number(r).is_some());
        let mut numbers = Vec::with_capacity(self.table.rows.len());
        for row in &self.table.rows {
            let next = u32::try_from(labels.len()).unwrap_or(u32::MAX);
            let label = || *labels.entry(row.get(column).copied().unwrap_or_default()).or_insert(next);
            numbers.push(f64::from(number(row).filter(|_| plain).unwrap_or_else(label)));
        }
        Some(Series::new(self.time, &numbers))
    }
}

/// The names of the flight format for a channel, with the factor to SI.
fn by_name(channel: Channel) -> Vec<(&'static str, f64)> {
    NAMES.iter().filter(|n| n.1 == channel).map(|n| (n.0, n.2)).collect()
}

impl Table<'_> {
    /// The flight by the units of the columns.
    ///
    /// # Errors
    /// No pressure.
    pub(super) fn flight(&self, clock: &Clock, name: &str, report: &mut Report) -> Result<Flight, String> {
        let read: Vec<bool> = (0..self.names.len()).map(|k| k == clock.column || clock.date == Some(k)).collect();
        let mut columns = Columns { table: self, time: &clock.seconds, report, read };
        let (lat, lon) = (columns.get(&ABOUT_LATITUDE), columns.get(&ABOUT_LONGITUDE));
        let about = lat.pairs().next().zip(lon.pairs().next()).map(|((_, lat_deg), (_, lon_deg))| Place { lon_deg, lat_deg });
        let (pressure, with) = columns.pressure(about);
        if pressure.is_empty() {
            return Err(format!("has no pressure or depth with a known unit: looked for {}", PRESSURE.names.join(", ")));
        }
        let temperature = columns.channel(&TEMPERATURE, Channel::Temperature);
        let salinity = columns.find(&SALINITY, &SALINITIES);
        let salinity = columns.take(salinity);
        let conductivity = if salinity.is_empty() { columns.find(&CONDUCTIVITY, &CONDUCTIVITIES) } else { None };
        let conductivity = columns.take(conductivity);
        let fixes = position::fixes(&columns.get(&LATITUDE), &columns.get(&LONGITUDE));
        let mut log = Log { fixes, about, ..Log::default() };
        log.pitch = columns.channel(&PITCH, Channel::Pitch);
        log.roll = columns.channel(&ROLL, Channel::Roll);
        log.heading = columns.channel(&HEADING, Channel::Heading);
        log.ballast = columns.channel(&BALLAST, Channel::Ballast);
        log.battery = columns.channel(&BATTERY, Channel::Battery);
        let segments = columns.segments();
        if with < self.rows.len() {
            columns.report.note(format!("{} of {} rows have no pressure: left out", self.rows.len() - with, self.rows.len()));
        }
        if pressure.len() < with {
            columns.report.leave_out(format!("{} of {with} rows repeat a time: the first of each stays", with - pressure.len()));
        }
        let exact = |s: &Series, t: f64| s.at_within(t, 0.0);
        log.rows = pressure
            .pairs()
            .map(|(unix_s, pressure_pa)| {
                let temperature_degc = exact(&temperature, unix_s);
                let salinity = if salinity.is_empty() {
                    seawater::practical_salinity(exact(&conductivity, unix_s), temperature_degc, pressure_pa * 1e-4)
                } else {
                    exact(&salinity, unix_s)
                };
                let segment = segments.as_ref().map_or(0, |s| exact(s, unix_s).max(0.0) as u32);
                Row { unix_s, segment, pressure_pa, temperature_degc, salinity }
            })
            .collect();
        let computed = log.rows.iter().any(|r| r.salinity.is_finite() && r.temperature_degc.is_finite());
        let stated = if computed { None } else { columns.find(&DENSITY, &by_name(Channel::Density)) };
        let stated = columns.take(stated);
        let read = std::mem::take(&mut columns.read);
        self.note_unread(|k| read[k], report);
        report.density_from("salinity, temperature, pressure", about, computed);
        let mut flight = log.flight(name, report).ok_or("has no row with a time and a pressure")?;
        if !stated.is_empty() {
            report.density = "as the file states it: there is no salinity with a temperature to recompute it from".into();
            let start = report.start_unix_s.unwrap_or(0.0);
            flight.density_kg_m3 = flight.time_s.iter().map(|t| stated.at(t + start)).collect();
        }
        Ok(flight)
    }
}
