//! From the variables of a file to channels in SI: pressure or what a depth says, attitude, water, fixes, dives.

use super::assembly::{Column, Log, Row};
use super::clocks::{CLOCKS_APART_S, lonely_times};
use super::position::{self, Fix};
use super::pressure_zero::{self, UNDER_WATER_PA};
use super::raw_log::{Picked, RawLog, RawSeries, in_order};
use super::report::DensityIs;
use super::variation::variation_deg;
use super::{MappedName, Report};
use crate::channels::{Channel, Channels};
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Depth and pressure of one file grow alike within this share (1 dbar is 0.97 to 1.02 m), 10 dbar and more below the top.
const DEPTH_SHARE: f64 = 0.1;
/// Gliders that dive pitch by 15 to 40 degrees; nine tenths of a file within this many "degrees" are radians.
const FLATTEST: f64 = 2.0;
/// Less than this many "degrees" in nine tenths of a file is a pitch that was not measured.
const LEVEL: f64 = 0.05;
/// Gliders roll by up to 40 degrees in a spiral; nine tenths of a file within this many "degrees" may be radians.
const STEEPEST_ROLL: f64 = 0.9;
/// So many names of columns that are not read are listed: a Slocum's table has some 1,700.
const MOST_NAMES: usize = 60;
/// Sea water conducts 7 S/m at most; a median above this is in mS/cm, S/m.
const CONDUCTS_S_M: f64 = 8.0;
/// Salinity of the sea as a share of one.
const SHARE: std::ops::Range<f64> = 0.030..0.042;
/// Further than this a file's own density and the recomputed one are of different water, kg/m³: a density that leaves out pressure is
/// 2 off at 500 m and 4.5 at 1000.
const OTHER_DENSITY_KG_M3: f64 = 6.0;

impl RawLog {
    /// The flight called `name`, with what was done to get it.
    ///
    /// # Errors
    /// Why there is none.
    pub fn flight(mut self, name: &str) -> Result<(Flight, Report), String> {
        let about = self.about();
        let pressure = self.pressure(about)?;
        let rows: Vec<(f64, f64)> = if self.exact {
            self.clocks[0].times.iter().copied().zip(pressure.values.iter().copied()).collect()
        } else {
            pressure.series.pairs().collect()
        };
        if rows.len() < 2 {
            return Err(format!("{} has only {} value{}", pressure.name, rows.len(), if rows.len() == 1 { "" } else { "s" }));
        }
        let unix: Vec<f64> = rows.iter().map(|r| r.0).collect();
        let mut log = Log { exact: self.exact, zero_s: self.zero_s, about, without_salinity: true, ..Log::default() };
        let numbers = self.dives();
        log.rows = rows.iter().map(|r| Row::at(r.0, 0, r.1)).collect();
        if let Some((name, numbers)) = &numbers {
            number(&mut log.rows, name, numbers, self.exact || self.segments.is_some(), &mut self.report);
        }
        log.cut = log.rows.iter().all(|r| r.segment == 0) && !self.report.numbered;
        self.report.numbered |= numbers.is_some() && !log.cut;
        if let Some(temperature) = self.pick(Channel::Temperature) {
            let values = self.on_rows(&temperature, &unix);
            log.rows.iter_mut().zip(values).for_each(|(r, v)| r.temperature_degc = v);
        }
        let salt = self.salt(&mut log, &unix);
        log.fixes = self.fixes(&pressure.series);
        let place = log.fixes.first().map(|f| Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg }).or(about);
        let attitude = self.attitude(&pressure, place.zip(unix.first().copied()));
        log.true_heading = attitude[2].as_ref().is_some_and(|h| h.magnetic);
        let ballast = self.pick(Channel::Ballast);
        for (channel, column) in attitude.iter().chain([&ballast]).zip(["pitch", "roll", "heading", "ballast"]) {
            if let Some(channel) = channel.as_ref().filter(|c| c.clock != pressure.clock) {
                report_other_clock(&channel.series, column, &pressure, &mut self.report);
            }
        }
        let exact = self.exact;
        let column = |picked: Option<Picked>| match picked {
            None => Column::default(),
            Some(picked) if exact => Column::AtRows(picked.values),
            Some(picked) => Column::Between(picked.series),
        };
        [log.pitch, log.roll, log.heading] = attitude.map(column);
        log.ballast = column(ballast);
        log.battery = column(self.pick(Channel::Battery));
        log.steering_pressure = self.of_steering(&pressure);
        log.speed = self.pick(Channel::Speed).map(|c| Column::AtRows(self.on_rows(&c, &unix)));
        if let Some(thruster) = self.pick(Channel::Thruster).filter(|c| !c.is_zero()) {
            log.extra.insert(thruster.name.clone(), Column::AtRows(self.on_rows(&thruster, &unix)));
        }
        if exact {
            let none = || vec![f64::NAN; unix.len()];
            log.gps_plane = Some([Channel::GpsEast, Channel::GpsNorth].map(|c| self.pick(c).map_or_else(none, |c| c.values)));
            for (_, series) in self.series.iter_mut().enumerate().filter(|(k, _)| !self.used.contains(k)) {
                if let Ok(values) = &mut series.values {
                    log.extra.insert(series.name.clone(), Column::AtRows(std::mem::take(values)));
                }
            }
        }
        let unused = self.series.iter().enumerate().filter(|(k, _)| !self.used.contains(k));
        let unread: Vec<&str> = unused.filter(|_| self.repeats_are_lost).map(|(_, s)| s.name.as_str()).collect();
        if !unread.is_empty() {
            let more = unread.len().saturating_sub(MOST_NAMES);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            self.report.note(format!("not read: {}{more}", unread.into_iter().take(MOST_NAMES).collect::<Vec<_>>().join(", ")));
        }
        let table = self.table.as_deref().unwrap_or(Channels::usual());
        table.unused(self.names.iter().map(String::as_str)).into_iter().for_each(|what| self.report.note(what));
        let own_density = if salt.is_some() && !exact { self.aside(Channel::Density) } else { None };
        let mut flight = log.flight(name, &mut self.report).ok_or("has no row with a time and a pressure")?;
        if let Some(salt) = salt {
            check_water(&salt, &flight, &unix, own_density, &mut self.report);
        }
        flight.name = name.to_owned();
        Ok((flight, self.report))
    }

    /// Values at the rows: as they are where the channel stands on the rows' own clock, so that what was left out stays out; else between
    /// its values.
    fn on_rows(&self, picked: &Picked, unix: &[f64]) -> Vec<f64> {
        if self.exact {
            return picked.values.clone();
        }
        let exact = picked.series.on_within(unix, 0.0);
        let own_clock = 10 * exact.iter().filter(|v| v.is_finite()).count() >= 9 * picked.series.len();
        if own_clock { exact } else { picked.series.on(unix) }
    }

    /// Where it was, roughly, where there is no fix.
    fn about(&mut self) -> Option<Place> {
        if self.exact {
            return None;
        }
        let first = |c: Option<Picked>| c.and_then(|c| c.series.pairs().next()).map(|(_, v)| v);
        let [lat, lon] = [Channel::AboutLatitude, Channel::AboutLongitude].map(|c| {
            let used = self.series.iter().position(|s| self.entry(c).is_called(&s.name));
            let found = first(self.aside(c));
            self.used.extend(used);
            found
        });
        lat.zip(lon).map(|(lat_deg, lon_deg)| Place { lon_deg, lat_deg })
    }

    /// Pressure, or what depth says about it.
    fn pressure(&mut self, about: Option<Place>) -> Result<Picked, String> {
        let pressure = match self.pick(Channel::Pressure) {
            Some(pressure) => Some(self.upright(pressure)?),
            None => None,
        };
        let mapped = self.report.mapped.len();
        let depth = match &pressure {
            _ if self.exact => None,
            Some(_) => self.aside(Channel::Depth),
            None => self.pick(Channel::Depth),
        };
        self.report.mapped.truncate(mapped);
        let mut found = match (pressure, depth) {
            (Some(pressure), Some(depth)) if depth.coverage > 2.0 * pressure.coverage || (pressure.is_zero() && !depth.is_zero()) => {
                depth.instead_of(&pressure, &mut self.report);
                self.report.mapped.retain(|m| m.from != pressure.name);
                self.of_depth(depth, about)
            }
            (Some(pressure), depth) => {
                if let Some(depth) = depth {
                    compare_depth(&pressure, &depth, &mut self.report);
                }
                pressure
            }
            (None, Some(depth)) => self.of_depth(depth, about),
            (None, None) => return Err(self.no_pressure()),
        };
        if !self.exact {
            let (mut times, values): (Vec<f64>, Vec<f64>) = found.series.pairs().unzip();
            let alone = lonely_times(&mut times);
            if alone > 0 {
                self.report.leave_out(format!("{alone} of {} values of {} stand alone days off the others", values.len(), found.name));
                found.series = Series::new(&times, &values);
            }
        }
        Ok(found)
    }

    /// The pressure that a depth says.
    fn of_depth(&mut self, mut depth: Picked, about: Option<Place>) -> Picked {
        let lat_deg = about.map_or(45.0, |p| p.lat_deg);
        // Positive where the middle of the samples is, whatever the attribute says: nobody measures in the air.
        let sign = if quantile(&depth.values, 0.5) < 0.0 { -1.0 } else { 1.0 };
        depth.map(|z| seawater::pressure_pa(sign * z, lat_deg));
        let of = if about.is_some() { "" } else { " (latitude unknown, 45 deg taken)" };
        self.report.note(format!("no pressure: computed from {} by TEOS-10 at {lat_deg:.1} deg{of}", depth.name));
        let column = self.entry(Channel::Depth).column;
        self.report.map(MappedName { from: depth.name.clone(), unit: depth.unit.clone(), to: column, factor: 1e4 });
        depth
    }

    /// A pressure the right way round, in the order of time and without zeros of a sensor that was off for an instant.
    fn upright(&mut self, mut pressure: Picked) -> Result<Picked, String> {
        let mut values = pressure.values.clone();
        if pressure_zero::turn_upright(&mut values, &pressure.name, UNDER_WATER_PA, &mut self.report) {
            pressure.map(|v| -v);
        } else if !self.exact
            && let Some(series) = in_order(&pressure.name, &self.clocks[pressure.clock].times, &values, &mut self.report)?
        {
            pressure.series = series;
        }
        if !self.exact {
            let mut pairs: Vec<(f64, f64)> = pressure.series.pairs().collect();
            pressure_zero::drop_zeros(&mut pairs, |pair| *pair, &pressure.name, &mut self.report);
            if pairs.len() < pressure.series.len() {
                let (time, value): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
                pressure.series = Series::new(&time, &value);
            }
        }
        Ok(pressure)
    }

    /// Why there is no pressure.
    fn no_pressure(&self) -> String {
        if let Some(why) = &self.without_pressure {
            return why.clone();
        }
        let [pressure, depth] = [Channel::Pressure, Channel::Depth].map(|c| self.entry(c));
        let names = if self.exact {
            pressure.stated.iter().map(|s| s.0.as_str()).collect::<Vec<_>>()
        } else {
            pressure.names.iter().chain(&depth.names).map(String::as_str).collect()
        };
        let said: Vec<&str> = self.report.left_out.iter().chain(&self.report.notes).map(String::as_str).collect();
        let why = if said.is_empty() { String::new() } else { format!(" ({})", said.join("; ")) };
        let has: Vec<&str> = self.series.iter().take(40).map(|s| s.name.as_str()).collect();
        format!("has no pressure or depth with a time and a known unit: looked for {} (it has: {}){why}", names.join(", "), has.join(", "))
    }

    /// Numbers of the dives by time, with the name of what numbers them.
    fn dives(&mut self) -> Option<(String, Vec<(f64, f64)>)> {
        if let Some(numbers) = &self.segments {
            let pairs = self.clocks[0].times.iter().copied().zip(numbers.iter().map(|n| f64::from(*n)));
            return Some(("segment".into(), pairs.collect()));
        }
        let picked = if self.exact { None } else { self.pick(Channel::Segment) }?;
        Some((picked.name.clone(), picked.series.pairs().collect()))
    }

    /// Pitch, roll and true heading, rad; `at` is where and when the flight begins.
    fn attitude(&mut self, pressure: &Picked, at: Option<(Place, f64)>) -> [Option<Picked>; 3] {
        let mut channels = [Channel::Pitch, Channel::Roll, Channel::Heading].map(|channel| self.pick(channel));
        let report = &mut self.report;
        let moves = pressure.series.pairs().map(|(_, p)| p).fold(0.0, f64::max) > 1e5;
        let sizes = |c: &Picked, unit: f64, q: f64| quantile(&c.values.iter().map(|v| (v / unit).abs()).collect::<Vec<_>>(), q);
        let in_degrees = |c: &Picked| c.factor == DEGREE;
        let radians = channels[0].as_ref().is_some_and(|c| moves && in_degrees(c) && (LEVEL..FLATTEST).contains(&sizes(c, DEGREE, 0.9)));
        // A name without a unit is of radians or of degrees by the size of the pitch.
        let unstated = |c: &Picked| c.by_name && c.factor == 1.0 && !c.name.to_ascii_lowercase().ends_with("rad");
        let degrees = channels[0].as_ref().is_some_and(|c| unstated(c) && sizes(c, 1.0, 0.9) > std::f64::consts::FRAC_PI_2);
        // What a channel can be in radians: a roll is no more than a tight spiral's, a heading no more than a turn.
        let limits = [FLATTEST, STEEPEST_ROLL, std::f64::consts::TAU + 0.01];
        for (k, channel) in channels.iter_mut().enumerate().filter_map(|(k, c)| Some((k, c.as_mut()?))) {
            let share = if k == 2 { 1.0 } else { 0.9 };
            let factor = if radians && in_degrees(channel) && sizes(channel, DEGREE, share) < limits[k] {
                report.note(format!("{} states degrees but its values are radians: taken as radians", channel.name));
                1.0
            } else if degrees && unstated(channel) {
                report.note(format!("{} states no unit: taken as degrees by the size of the pitch", channel.name));
                DEGREE
            } else {
                continue;
            };
            let by = factor / channel.factor;
            channel.map(|v| if by == DEGREE { v * DEGREE } else { v / DEGREE });
            channel.factor = factor;
            report.mapped.iter_mut().filter(|m| m.from == channel.name).for_each(|m| m.factor = factor);
        }
        // Further than a turn and its rounding in nine tenths of the rows is no heading; it would be wrapped into one.
        if let Some(heading) = channels[2].take_if(|c| sizes(c, 1.0, 0.9) > 7.0) {
            let reach = sizes(&heading, 1.0, 0.9);
            report.note(format!("{} reaches {reach:.1} rad by its unit, more than a turn: left out", heading.name));
        }
        if let Some(heading) = channels[2].as_mut().filter(|h| h.magnetic) {
            let modelled = || at.and_then(|(place, unix_s)| variation_deg(place, unix_s));
            let variation = self.variation.map(|v| (v, "")).or_else(|| Some((modelled()?, " (geomagnetic field, IGRF)")));
            if let Some((degrees, of)) = variation {
                let degrees = if of.is_empty() { degrees } else { (10.0 * degrees).round() / 10.0 };
                report.note(format!("{} is magnetic: variation of {degrees} deg{of} added", heading.name));
                heading.map(|v| v + degrees * DEGREE);
            } else {
                report.note(format!("{} is magnetic, and without date and place its variation is unknown: left as it is", heading.name));
            }
        }
        channels
    }

    /// Salinity or conductivity of the rows, and the density that the file states; the name of what it is computed from.
    fn salt(&mut self, log: &mut Log, unix: &[f64]) -> Option<String> {
        let (picked, conducts) = if self.as_it_is { (None, false) } else { self.salinity(log) };
        let place = log.about;
        if let Some(mut picked) = picked {
            if conducts && quantile(&picked.values, 0.5) > CONDUCTS_S_M {
                self.report.note(format!("{} is more than sea water conducts in the unit it states: taken as mS/cm", picked.name));
                picked.map(|v| 0.1 * v);
            }
            let values = self.on_rows(&picked, unix);
            for (row, value) in log.rows.iter_mut().zip(values) {
                *(if conducts { &mut row.conductivity_s_m } else { &mut row.salinity }) = value;
            }
            log.without_salinity = false;
            self.report.density_from(&format!("{}, temperature, pressure", picked.name), place, true);
            if self.exact {
                log.density = self.pick(Channel::Density).map(|c| Column::AtRows(c.values));
            }
            return Some(picked.name);
        }
        match self.pick(Channel::Density) {
            Some(c) => {
                self.report.density = format!("as the file states it ({}): there is no salinity to recompute it from", c.name);
                self.report.density_is = DensityIs::Stated;
                log.density = Some(Column::AtRows(self.on_rows(&c, unix)));
            }
            None => self.report.density_from("salinity or conductivity, temperature, pressure", place, false),
        }
        None
    }

    /// The salinity, or where that has few values a conductivity that has more; and whether it is one.
    fn salinity(&mut self, log: &mut Log) -> (Option<Picked>, bool) {
        // In the flight format these are further columns, which stay.
        let exact = self.exact;
        let take = |raw: &mut Self, channel: Channel| if exact { raw.aside(channel) } else { raw.pick(channel) };
        let mut absolute = if exact { take(self, Channel::AbsoluteSalinity) } else { None };
        let salinity = if absolute.is_some() { None } else { take(self, Channel::Salinity) };
        if !exact && salinity.is_none() {
            absolute = take(self, Channel::AbsoluteSalinity);
        }
        if absolute.is_some() {
            log.absolute = true;
            return (absolute, false);
        }
        let conductivity = match &salinity {
            Some(s) if s.coverage >= 0.5 => None,
            // Kept as the second choice: its own loss is not one where salinity serves.
            Some(_) => self.aside(Channel::Conductivity),
            None => take(self, Channel::Conductivity),
        };
        match (salinity, conductivity) {
            (Some(s), Some(c)) if c.coverage > 2.0 * s.coverage => {
                c.instead_of(&s, &mut self.report);
                (Some(c), true)
            }
            (Some(s), _) => {
                if exact && s.name == super::assembly::SALINITY_COLUMN {
                    self.used.extend(self.series.iter().position(|o| o.name == s.name));
                }
                (Some(s), false)
            }
            (None, c) => (c, true),
        }
    }

    /// The pressure of another computer than that of the rows.
    fn of_steering(&mut self, pressure: &Picked) -> Series {
        let entry = self.entry(Channel::SteeringPressure);
        let other =
            |s: &RawSeries| entry.is_called(&s.name) && s.name != pressure.name && s.clock.as_ref().is_ok_and(|k| *k != pressure.clock);
        if self.exact || !self.series.iter().any(other) {
            return Series::default();
        }
        self.pick(Channel::SteeringPressure).filter(|p| p.name != pressure.name).map_or_else(Series::default, |p| p.series)
    }

    /// Fixes, those on the days of the pressure: receivers count the weeks of GPS anew after 1024.
    fn fixes(&mut self, pressure: &Series) -> Vec<Fix> {
        /// 1024 weeks, and how far off a fix is from its rows at most, s.
        const ERA_S: f64 = 1024.0 * 7.0 * 86_400.0;
        const REACH_S: f64 = 3.0 * 86_400.0;
        let [lat, lon] = [Channel::Latitude, Channel::Longitude].map(|c| self.pick(c));
        // A Slocum's own numbers are degrees and minutes in one.
        let of_slocum = |c: &Picked| c.name.starts_with("m_gps") && c.unit.is_empty();
        let minutes = lat.as_ref().is_some_and(of_slocum) && lon.as_ref().is_some_and(of_slocum);
        let [lat, lon] = [lat, lon].map(|c| c.map_or_else(Series::default, |c| c.series));
        let minutes = minutes && !position::in_degrees(&lat, &lon);
        let [lat, lon] = [lat, lon].map(|s| if minutes { position::of_minutes(&s) } else { s });
        let mut fixes = position::fixes(&lat, &lon);
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
}

/// Numbers the rows by those of the dives: as they stand where they are `stated`, else counted as they change. Halves of a dive ("12.5")
/// are one dive.
fn number(rows: &mut [Row], name: &str, numbers: &[(f64, f64)], stated: bool, report: &mut Report) {
    let of = |t: f64| numbers[numbers.partition_point(|n| n.0 <= t).max(1) - 1].1.floor();
    let mut count = 0;
    for i in 0..rows.len() {
        let number = of(rows[i].unix_s);
        let begins = i == 0 || number != of(rows[i - 1].unix_s);
        count += u32::from(begins && i > 0);
        rows[i].segment = if stated { number.max(0.0) as u32 } else { count };
        if begins {
            report.segments.push(format!("{name} {number}"));
        }
    }
    if !stated {
        report.note(format!("segments are what {name} numbers"));
        report.numbered = true;
    }
}

/// Says where depth and pressure do not grow alike; a zero of one of them is none of its unit.
fn compare_depth(pressure: &Picked, depth: &Picked, report: &mut Report) {
    let pairs = || pressure.series.pairs().map(|(t, p)| (depth.series.at(t), p)).filter(|(z, _)| z.is_finite());
    let Some((top_m, top_pa)) = pairs().min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let below = pairs().filter(|(z, p)| p - top_pa > 1e5 || z - top_m > 10.0);
    let share = quantile(&below.map(|(z, p)| ((z - top_m) / ((p - top_pa) * 1e-4)).abs()).collect::<Vec<_>>(), 0.5);
    if (share - 1.0).abs() > DEPTH_SHARE {
        let (pressure, depth) = (&pressure.name, &depth.name);
        report.note(format!("{pressure} and {depth} do not agree: 1 dbar is {share:.4} m there; one of them states a wrong unit"));
    }
}

/// A channel whose run is not that of the pressure: begun and ended earlier, or later, by the same time, on another clock.
fn report_other_clock(series: &Series, what: &str, pressure: &Picked, report: &mut Report) {
    let span = |s: &Series| Some((s.pairs().next()?.0, s.pairs().last()?.0));
    let (Some(own), Some(rows)) = (span(series), span(&pressure.series)) else { return };
    let (begins_s, ends_s) = (own.0 - rows.0, own.1 - rows.1);
    let apart = own.1 < rows.0 || own.0 > rows.1;
    let shifted = begins_s.abs() > CLOCKS_APART_S && (begins_s - ends_s).abs() < 0.2 * begins_s.abs();
    if apart || shifted {
        report.leave_out(format!(
            "{what} runs on another clock than {}: {begins_s:+.0} s at its begin, {ends_s:+.0} s at its end; set one of the two",
            pressure.name
        ));
    }
}

/// Says where the water is fresh by its salinity, or another one than the file's own density.
fn check_water(name: &str, flight: &Flight, unix: &[f64], own: Option<Picked>, report: &mut Report) {
    let Some(practical) = flight.extra.get(super::assembly::SALINITY_COLUMN) else { return };
    let known = practical.iter().filter(|s| s.is_finite()).count();
    let zero = practical.iter().filter(|s| **s == 0.0).count();
    if zero > 0 && 2 * zero > known {
        report.leave_out(format!("density: {name} is 0 in {zero} of {known} rows: fresh water, or a cell in air?"));
    }
    let middle = quantile(practical, 0.5);
    if SHARE.contains(&middle) {
        report.note(format!("{name} is {middle:.4} in the middle: nearly fresh water, or sea water's as a share of one?"));
    }
    let Some(own) = own else { return };
    // Files also store the density less 1000.
    let stated = own.series.on(unix);
    let off = quantile(&stated.iter().zip(&flight.density_kg_m3).map(|(a, b)| a - b).collect::<Vec<_>>(), 0.5);
    let off = if (-1100.0..-900.0).contains(&off) { off + 1000.0 } else { off };
    if off.abs() > OTHER_DENSITY_KG_M3 {
        report.note(format!("{} is {off:+.1} kg/m3 off the density recomputed from {name}: is {name} in the unit it states?", own.name));
    }
}
