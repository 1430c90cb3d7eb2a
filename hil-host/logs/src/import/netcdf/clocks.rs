//! Clocks of a NetCDF file: which one a variable stands on, and what its numbers are in Unix time.

use netcdf_reader::NcType;

use super::super::calendar::{LATEST_S, days_from_1970, julian_origin_s, seconds_in, why_no_zone, zone_name, zone_s};
use super::super::clocks::{LONGEST_MISSION_S, spread_evenly, stray_times};
use super::super::raw_log::{Clock, Said};
use super::super::table::times::seconds_of;
use super::{Reader, Report};
use crate::channels::{Channel, Channels};
use crate::record::plausible::quantile;

/// Unix times outside 1970 to 2100 are no times, s: the least 64-bit integer stands for "no time" in files made from pandas.
const POSSIBLE_TIMES: std::ops::Range<f64> = 0.0..LATEST_S;
/// Unix times of gliders without an origin in their unit, s: 1995 to 2100.
const UNIX: std::ops::Range<f64> = 7.9e8..LATEST_S;

impl Reader<'_> {
    /// Unix times of a variable: what its `coordinates` name, else "time", else whatever counts "… since …" on the same dimensions.
    pub(super) fn clock(&mut self, name: &str, dimensions: &[String], table: &Channels) -> Option<usize> {
        let named = self.text(name, "coordinates").unwrap_or_default();
        let variables = self.file.variables().ok()?;
        let mut candidates: Vec<&str> = variables
            .iter()
            .filter(|v| self.dimensions(v.name()).as_deref() == Some(dimensions))
            .filter(|v| {
                let said = |attribute: &str| v.attribute(attribute).and_then(|a| a.value.as_string()).unwrap_or_default();
                v.name().to_ascii_lowercase().contains("time") || said("standard_name").trim() == "time" || said("axis").trim() == "T"
            })
            .map(|v| v.name())
            .collect();
        let rank = |n: &str| match n {
            _ if named.split_whitespace().any(|c| c == n) => 0,
            _ if n.eq_ignore_ascii_case("time") => 1,
            _ => 2,
        };
        // Of a Slocum's two computers each has a clock.
        let science = |n: &str| n.to_ascii_lowercase().starts_with("sci_");
        candidates.sort_by_key(|n| (rank(n), science(n) != science(name), n.len()));
        let candidates: Vec<String> = candidates.into_iter().map(str::to_owned).collect();
        candidates.into_iter().find_map(|clock| {
            if let Some(known) = self.clocks.get(&clock) {
                return *known;
            }
            let mut said = Report::default();
            let times = self.times(&clock, table, &mut said);
            if times.is_none() {
                // A clock that is meant but not understood must not give way to another one in silence.
                said.notes.into_iter().for_each(|n| self.raw.report.note(n));
                said.left_out.into_iter().for_each(|n| self.raw.report.leave_out(n));
                self.clocks.insert(clock, None);
                return None;
            }
            let said = said.notes.into_iter().map(Said::Note).chain(said.left_out.into_iter().map(Said::Lost)).collect();
            self.raw.clocks.push(Clock { times: times.unwrap_or_default(), said });
            self.clocks.insert(clock, Some(self.raw.clocks.len() - 1));
            Some(self.raw.clocks.len() - 1)
        })
    }

    /// Unix times of one clock, of the years that a glider can have been in.
    fn times(&mut self, clock: &str, table: &Channels, report: &mut Report) -> Option<Vec<f64>> {
        let times = if self.is_text(clock) { self.written_times(clock, report) } else { self.counted_times(clock, report) }?;
        let mut times: Vec<f64> = times.into_iter().map(|t| if POSSIBLE_TIMES.contains(&t) { t } else { f64::NAN }).collect();
        let stray = stray_times(&mut times, LONGEST_MISSION_S);
        if stray > 0 {
            self.raw.report.clock_not_set = true;
            report.leave_out(format!("{stray} of {} times of {clock} are years off the others: a clock that was not set", times.len()));
        }
        let of_one = self.one_row_each(clock, &times, table);
        let repeated = if of_one > 0 { 0 } else { spread_clock(&mut times) };
        if of_one > 0 {
            report.note(format!(
                "{of_one} of {} times of {clock} repeat the one before, with its pressure or none: the values of one time are one row",
                times.len()
            ));
        }
        if repeated > 0 {
            report.note(format!(
                "{repeated} of {} times of {clock} repeat the one before (a clock of whole seconds?): spread evenly up to the next",
                times.len()
            ));
        }
        if !times.iter().any(|t| t.is_finite()) {
            let unit = self.text(clock, "units").unwrap_or_default();
            report.note(format!("{clock} has no time between 1970 and 2100 by its unit \"{unit}\""));
        }
        Some(times)
    }

    /// Unix times of a clock of texts, such as "2013-04-02T08:00:00Z".
    fn written_times(&mut self, clock: &str, report: &mut Report) -> Option<Vec<f64>> {
        let unit = self.text(clock, "units").unwrap_or_default();
        let texts = self.fits(clock).and_then(|()| self.file.read_variable_as_strings(clock).map_err(|e| e.to_string()));
        let times = texts.and_then(|texts| {
            let fields: Vec<&str> = texts.iter().map(|t| t.trim_matches(['\0', ' '])).collect();
            seconds_of(&fields, clock, &unit, report)
        });
        match times {
            Ok(mut times) => {
                report.note(format!("{clock} is written in texts: read as dates"));
                self.without_bad(clock, &mut times, report);
                Some(times)
            }
            Err(why) => {
                report.note(format!("{why}; {clock} is not used"));
                None
            }
        }
    }

    /// Unix times of a clock of numbers, by its unit.
    fn counted_times(&mut self, clock: &str, report: &mut Report) -> Option<Vec<f64>> {
        let unit = self.text(clock, "units").unwrap_or_default();
        let known = since(&unit);
        // A clock that is meant but not understood must not give way to another one in silence.
        if known.is_none() && unit.contains(" since ") {
            let why = why_no_zone(&unit).map_or_else(|| ", which is not known".into(), |why| format!("; {why}"));
            report.note(format!("{clock} counts \"{unit}\"{why}: another clock is used if there is one"));
            return None;
        }
        if let Some(calendar) = self.text(clock, "calendar").filter(|c| !is_gregorian(c)) {
            report.note(format!("{clock} is in the calendar \"{calendar}\", which no clock of a glider runs by: not used"));
            return None;
        }
        let values = match self.values(clock) {
            Ok(values) => values,
            Err(why) => {
                report.leave_out(format!("{clock} cannot be read ({why})"));
                return None;
            }
        };
        let mut values = values;
        self.without_bad(clock, &mut values, report);
        let of_flight = if self.is_undated_dataset() { Some((1.0, 0.0)) } else { None };
        let (scale, epoch) = known.or(of_flight).or_else(|| without_origin(clock, &unit, &values, report))?;
        if let Some(step_s) = self.coarse_s(clock, &values, scale) {
            report.note(format!("{clock} is stored in 32-bit floats, {step_s:.0} s apart at such numbers: store it in 64 bits"));
            return None;
        }
        let mut epoch = epoch;
        let proleptic = self.text(clock, "calendar").is_some_and(|c| c.trim().eq_ignore_ascii_case("proleptic_gregorian"));
        if let Some((_, date)) = unit.split_once(" since ").filter(|(_, date)| julian_origin_s(date).is_some()) {
            if proleptic && !date.trim().starts_with("-4713-11-24") {
                report.note(format!(
                    "{clock} counts \"{unit}\" in the calendar \"proleptic_gregorian\", where Julian days count from -4713-11-24: not used"
                ));
                return None;
            }
            report.note(format!("{clock} counts \"{unit}\": read as Julian days, whose first one began at noon of 1 January 4713 BC"));
        } else if let Some(days) = julian_days(&unit).filter(|_| !proleptic) {
            report.note(format!("{clock} counts \"{unit}\": its origin is of the Julian calendar, {days:+} days, by the CF conventions"));
            epoch += 86_400.0 * days as f64;
        }
        Some(values.iter().map(|v| v * scale + epoch).collect())
    }

    /// How many times repeat the one before where rows of one time have one pressure between them, or the same: not those of a coarse clock.
    fn one_row_each(&mut self, clock: &str, times: &[f64], table: &Channels) -> usize {
        let dimensions = self.dimensions(clock);
        let names = [Channel::Pressure, Channel::Depth].into_iter().flat_map(|c| table.of(c).all_names());
        let variables = self.file.variables().unwrap_or_default();
        let called = |n: &str| variables.iter().map(|v| v.name()).find(|v| v.eq_ignore_ascii_case(n) && self.dimensions(v) == dimensions);
        let Some(name) = names.into_iter().find_map(called).map(str::to_owned) else { return 0 };
        let Some(values) = self.values(&name).ok().filter(|v| v.len() == times.len()) else { return 0 };
        let (mut repeats, mut alike) = (0, 0);
        let mut start = 0;
        for run in times.chunk_by(|a, b| a == b) {
            let mut known = values[start..start + run.len()].iter().filter(|v| v.is_finite());
            let first = known.next();
            repeats += run.len() - 1;
            alike += if known.all(|v| Some(v) == first) { run.len() - 1 } else { 0 };
            start += run.len();
        }
        if 2 * alike > repeats { repeats } else { 0 }
    }

    /// Times without those that a flag calls bad.
    fn without_bad(&self, clock: &str, times: &mut [f64], report: &mut Report) {
        self.flags_of(clock, times.len()).iter().for_each(|flag| flag.leave_out(clock, times, report));
    }

    /// How far apart the times of a clock are by the way they are stored, s, where that is more than a second.
    fn coarse_s(&self, clock: &str, values: &[f64], scale: f64) -> Option<f64> {
        let single = self.file.variable(clock).is_ok_and(|v| *v.dtype() == NcType::Float);
        let step_s = quantile(values, 0.5).abs() * f64::from(f32::EPSILON) * scale;
        (single && step_s > 1.0).then_some(step_s)
    }
}

/// Seconds since 1970 where a clock states no origin and its numbers can be nothing else; else what its unit lacks is noted.
fn without_origin(clock: &str, unit: &str, values: &[f64], report: &mut Report) -> Option<(f64, f64)> {
    let counts = ["", "1", "s", "sec", "second", "seconds", "utc", "timestamp"].contains(&unit.trim().to_ascii_lowercase().as_str());
    if !counts {
        return None;
    }
    if UNIX.contains(&quantile(values, 0.5)) {
        report.note(format!("{clock} states no origin (its unit is \"{unit}\"): taken as seconds since 1970"));
        return Some((1.0, 0.0));
    }
    let name = clock.to_ascii_lowercase();
    if name == "time" || name.ends_with("_time") {
        report.note(format!("{clock} has the unit \"{unit}\", which states no origin: `seconds since DATE` is needed"));
    }
    None
}

/// Whether the days of a calendar of the CF conventions are those of the Gregorian one after 1582; "julian" is what files say that count
/// Julian days, which are these too.
fn is_gregorian(calendar: &str) -> bool {
    ["", "standard", "gregorian", "proleptic_gregorian", "julian"].contains(&calendar.trim().to_ascii_lowercase().as_str())
}

/// Times of a clock of whole seconds or minutes, set evenly apart as those of a table; else single repeats. How many repeat one.
fn spread_clock(times: &mut [f64]) -> usize {
    let of: Vec<usize> = (0..times.len()).filter(|k| times[*k].is_finite()).collect();
    let finite: Vec<f64> = of.iter().map(|k| times[*k]).collect();
    let Some(even) = spread_evenly(&finite) else { return spread(times) };
    of.into_iter().zip(even).for_each(|(k, t)| times[k] = t);
    finite.windows(2).filter(|w| w[0] == w[1]).count()
}

/// Equal times that follow one another are set evenly apart up to the next; how many there are.
fn spread(times: &mut [f64]) -> usize {
    let mut repeated = 0;
    let mut start = 0;
    while start < times.len() {
        let t = times[start];
        let end = (start..times.len()).find(|k| times[*k] != t).unwrap_or(times.len());
        let k = end - start;
        if k > 1 && t.is_finite() {
            // Without a next one, as far apart as before.
            let ahead = times.get(end).map(|next| next - t).filter(|step| *step > 0.0);
            let behind = start.checked_sub(1).map(|before| t - times[before]).filter(|step| *step > 0.0);
            if let Some(step) = ahead.or(behind) {
                (0..k).for_each(|m| times[start + m] = t + step * m as f64 / k as f64);
                repeated += k - 1;
            }
        }
        start = end.max(start + 1);
    }
    repeated
}

/// By how many days the origin of "days since 0001-01-01" is later in the Julian calendar, which the standard one of the CF conventions
/// follows before 15 October 1582, than in the Gregorian; none after it.
fn julian_days(units: &str) -> Option<i64> {
    let date = units.split_once(" since ")?.1;
    let mut numbers = date.split(|c: char| !c.is_ascii_digit()).filter(|s| !s.is_empty()).map(str::parse::<i64>);
    let mut next = || numbers.next().and_then(Result::ok);
    let (year, month, day) = (next()?, next()?, next()?);
    let century = (if month < 3 { year - 1 } else { year }).div_euclid(100);
    ((year, month, day) < (1582, 10, 15)).then_some(century - century.div_euclid(4) - 2)
}

/// Seconds per unit and Unix time of the origin of "seconds since 1970-01-01 00:00:00".
fn since(units: &str) -> Option<(f64, f64)> {
    let (unit, date) = units.split_once(" since ")?;
    let scale = seconds_in(unit)?;
    if let Some(origin) = julian_origin_s(date) {
        return Some((scale, origin));
    }
    // A zone other than UTC: "+02:00" after the time of day.
    let (date, zone) = match date.trim().rfind(['+', '-']).filter(|at| date.trim()[..*at].contains(':')) {
        Some(at) => (&date.trim()[..at], Some(&date.trim()[at..])),
        None => (date.trim(), None),
    };
    let mut numbers = date.split(|c: char| !c.is_ascii_digit() && c != '.').filter(|s| !s.is_empty()).map(str::parse::<f64>);
    let mut next = || numbers.next().and_then(Result::ok);
    let (year, month, day) = if date.eq_ignore_ascii_case("epoch") { (1970.0, 1.0, 1.0) } else { (next()?, next()?, next()?) };
    let clock = next().unwrap_or(0.0) * 3600.0 + next().unwrap_or(0.0) * 60.0 + next().unwrap_or(0.0);
    let word = date.rsplit(|c: char| !c.is_ascii_alphabetic()).next().unwrap_or_default();
    let zone_s = match zone {
        Some(zone) => zone_s(zone)?,
        // "PST" is a zone whose hours are not stated.
        None if ["", "T", "epoch"].iter().any(|none| word.eq_ignore_ascii_case(none)) => 0.0,
        None => zone_s(zone_name(date)?)?,
    };
    Some((scale, days_from_1970(year as i64, month as i64, day as i64)? as f64 * 86400.0 + clock - zone_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_whole_seconds_are_spread() {
        let mut times = [0.0, 0.0, 1.0, 1.0, 2.0, f64::NAN, 5.0, 5.0];
        assert_eq!(spread(&mut times), 2);
        assert_eq!(times[..5], [0.0, 0.5, 1.0, 1.5, 2.0]);
        let mut stuck = [7.0; 4];
        assert_eq!(spread(&mut stuck), 0);
    }

    #[test]
    fn origins_before_the_gregorian_calendar_are_julian() {
        // Julian days of noon: 1721424 of 1 January 1 Julian, 1721426 Gregorian (Meeus, Astronomical Algorithms, chapter 7).
        assert_eq!(julian_days("days since 0001-01-01 00:00:00"), Some(-2));
        assert_eq!((julian_days("days since 1500-03-01"), julian_days("days since 1582-10-15")), (Some(10), None));
        assert_eq!(julian_days("seconds since 1970-01-01"), None);
    }

    #[test]
    fn origins_of_time_are_read() {
        assert_eq!(since("seconds since 1970-1-1 00:00:00"), Some((1.0, 0.0)));
        assert_eq!(since("days since 1950-01-01T00:00:00Z"), Some((86400.0, -7305.0 * 86400.0)));
        assert_eq!(since("seconds since 2000-03-01 12:00"), Some((1.0, 951_912_000.0)));
        assert_eq!(since("seconds since 1970-01-01T00:00:00+00:00"), Some((1.0, 0.0)));
        assert_eq!(since("hours since 1970-01-01 02:00:00 +02:00"), Some((3600.0, 0.0)));
        assert_eq!(since("nanoseconds since 1970-01-01 00:00:01"), Some((1e-9, 1.0)));
        assert_eq!(since("seconds since epoch"), Some((1.0, 0.0)));
        assert_eq!(since("seconds since 1970-01-01 00:00:00 UTC"), Some((1.0, 0.0)));
        assert_eq!(since("seconds since 1970-01-01 00:00:00 PST"), None);
        assert_eq!(since("seconds since 1970-01-01 02:00:00 CEST"), Some((1.0, 0.0)));
        assert_eq!(since("days since -4713-01-01T12:00:00"), Some((86_400.0, -2_440_587.5 * 86_400.0)));
        assert_eq!(since("metres"), None);
        assert_eq!(since("fortnights since 1970-01-01"), None);
    }
}
