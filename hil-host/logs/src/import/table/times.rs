//! The time of each row of a table: numbers of any unit, dates as programs write them, a date and a time of day in two columns.

use std::borrow::Cow;

use super::super::Report;
use super::super::calendar::{
    DayMonth, LATEST_S, date_time, day_and_month, digits, is_of_several_zones, julian_origin_s, seconds_in, why_no_zone, zone_name, zone_s,
};
use super::Table;
use crate::channels::Channel;
use crate::record::csv::{TIME_AS, no_value};
use crate::record::plausible::quantile;

const DATES: [&str; 2] = ["date", "date_utc"];

/// The times of a table's rows.
pub(super) struct Clock {
    /// Column of the time.
    pub column: usize,
    /// Column of the date, where it has one of its own.
    pub date: Option<usize>,
    /// Unix time, or seconds from anywhere; NaN where there is none.
    pub seconds: Vec<f64>,
}

/// How a column counts: seconds a unit, Unix time of its zero, seconds east of UTC of dates that state no zone.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Count {
    scale: f64,
    zero_s: f64,
    east_s: f64,
}

impl Count {
    /// By the unit, else by the name of the column.
    ///
    /// # Errors
    /// A zone in the unit that may be one of several.
    fn of(unit: &str, name: &str) -> Result<Self, String> {
        if let Some(zone) = unit.split_whitespace().last().filter(|word| is_of_several_zones(word)) {
            return Err(format!("{name} is in \"{unit}\": {}", why_no_zone(zone).unwrap_or_default()));
        }
        Ok(Self::of_unit(unit, name))
    }

    fn of_unit(unit: &str, name: &str) -> Self {
        let seconds = Self { scale: 1.0, zero_s: 0.0, east_s: 0.0 };
        let unit = unit.trim();
        if let Some((unit, zero)) = unit.split_once(" since ") {
            let known = seconds_in(unit).zip(julian_origin_s(zero).or_else(|| date_time(zero, None)));
            return known.map_or(seconds, |(scale, zero_s)| Self { scale, zero_s, east_s: 0.0 });
        }
        let zone = unit.strip_prefix("UTC").or_else(|| unit.strip_prefix("GMT")).unwrap_or(unit);
        if let Some(east_s) = zone_s(zone) {
            return Self { east_s, ..seconds };
        }
        let unit = if unit.is_empty() && name.to_ascii_lowercase().ends_with("_ms") { "ms" } else { unit };
        Self { scale: seconds_in(unit).unwrap_or(1.0), ..seconds }
    }

    /// Seconds of a field; none where it is neither a number nor a date.
    fn seconds(self, field: &str, order: Option<DayMonth>) -> Option<f64> {
        if let Ok(number) = field.parse::<f64>() {
            return Some(number * self.scale + self.zero_s);
        }
        let zoned = zone_name(field).is_some() || field.get(10..).is_some_and(|rest| rest.contains(['+', '-']));
        Some(date_time(field, order)? - if zoned { 0.0 } else { self.east_s })
    }
}

/// "09:15", "9:15:31.25": a time of day without its date.
fn is_time_of_day(field: &str) -> bool {
    field.split_once(':').is_some_and(|(hour, _)| matches!(hour.len(), 1 | 2) && hour.bytes().all(|b| b.is_ascii_digit()))
}

/// A name without the unit in brackets behind it.
fn plain_name(name: &str) -> &str {
    super::bracketed(name).map_or(name, |(name, _)| name)
}

/// Whether a column is kept as it stands: times, dates, segments, names of vehicles.
pub(super) fn is_of_texts(name: &str) -> bool {
    let name = plain_name(name);
    let time = || Channel::Time.usual().names.iter().any(|n| n.eq_ignore_ascii_case(name));
    let date = || DATES.iter().any(|d| d.eq_ignore_ascii_case(name));
    time() || date() || name.eq_ignore_ascii_case("segment") || super::values::is_vehicle(name)
}

impl<'a> Table<'a> {
    /// The column of the time, whatever its case and a unit in brackets behind it: of a table of the flight format `time_s` before `time`, as its reader takes them.
    pub(super) fn time_column(&self, own: bool) -> Option<usize> {
        let named = |name: &str| self.names.iter().position(|h| plain_name(h).eq_ignore_ascii_case(name));
        let first = if own { named("time_s") } else { None };
        first.or_else(|| Channel::Time.usual().names.iter().find_map(|n| named(n)))
    }

    /// The times of the rows; none without a column of them.
    ///
    /// # Errors
    /// Times that cannot be read, or in two ways.
    pub(super) fn clock(&self, own: bool, report: &mut Report) -> Result<Option<Clock>, String> {
        let Some(column) = self.time_column(own) else { return Ok(None) };
        let (name, unit) = (&self.names[column], self.unit(column));
        let unit = if unit.is_empty() { super::bracketed(name).map_or("", |(_, unit)| unit) } else { unit };
        let times = self.columns[column].fields();
        let day = self.names.iter().position(|h| DATES.iter().any(|d| plain_name(h).eq_ignore_ascii_case(d)));
        let days = |day: usize| self.columns[day].fields();
        let day = day.filter(|day| times.iter().zip(days(*day)).any(|(time, day)| is_time_of_day(time) && !day.is_empty()));
        let joined: Option<Vec<Cow<'_, str>>> = day.map(|day| {
            let join = |(time, day): (&&'a str, &&'a str)| match is_time_of_day(time) {
                true => Cow::Owned(format!("{day} {time}")),
                false => Cow::Borrowed(*time),
            };
            times.iter().zip(days(day)).map(join).collect()
        });
        if let Some(day) = day {
            report.note(format!("{} and {name} are joined to one time", self.names[day]));
        }
        let joined: Option<Vec<&str>> = joined.as_ref().map(|joined| joined.iter().map(Cow::as_ref).collect());
        let seconds = seconds_of(joined.as_deref().unwrap_or(times), name, unit, report).map_err(|why| format!("column {why}"))?;
        Ok(Some(Clock { column, date: day, seconds }))
    }
}

/// Seconds of what stands for times under `name`: numbers that count in `unit`, or dates as programs write them; NaN where there is none.
///
/// # Errors
/// Times that cannot be read, or in two ways.
pub(in crate::import) fn seconds_of(fields: &[&str], name: &str, unit: &str, report: &mut Report) -> Result<Vec<f64>, String> {
    let written: Vec<&str> = fields.iter().copied().filter(|f| !no_value(f)).collect();
    let dense = !written.is_empty() && written.iter().all(|f| digits(f).is_some());
    if dense {
        report.note(format!("{name} is written as YYYYMMDDhhmmss: read as dates"));
    }
    let order = order_of(&written, name, report)?;
    let count = Count::of(unit, name)?;
    let seconds: Vec<f64> = fields
        .iter()
        .map(|f| if dense { digits(f) } else { count.seconds(f, order).filter(|_| !no_value(f)) })
        .map(|t| t.unwrap_or(f64::NAN))
        .collect();
    let unread: Vec<&str> = fields.iter().zip(&seconds).filter(|(f, t)| t.is_nan() && !no_value(f)).map(|(f, _)| *f).collect();
    let mostly = 2 * unread.len() > written.len();
    let of_zone = |f: &&&str| mostly || zone_name(f).is_some_and(is_of_several_zones);
    if let Some((example, why)) = unread.iter().filter(of_zone).find_map(|f| Some((f, why_no_zone(f)?))) {
        return Err(format!("{name}: `{example}`: {why}"));
    }
    if let Some(example) = unread.first() {
        if mostly {
            return Err(format!("{name}: `{example}` is no time; write {TIME_AS}"));
        }
        report.note(format!("{} of {} times cannot be read, such as `{example}`", unread.len(), written.len()));
    }
    let latest = seconds.iter().copied().filter(|t| t.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    if latest > LATEST_S && (dense || count.scale != 1.0 || count.zero_s != 0.0) {
        let year = 1970.0 + latest / (365.25 * 86_400.0);
        let what = "days of MATLAB or Julian days count from another one";
        return Err(format!("{name} reaches the year {year:.0} by its unit \"{unit}\": {what}; state it as \"days since DATE\""));
    }
    if !dense && count.scale == 1.0 && count.zero_s == 0.0 {
        no_seconds(&seconds, name)?;
    }
    if count.scale != 1.0 || count.zero_s != 0.0 || count.east_s != 0.0 {
        report.note(format!("{name} counts in \"{}\": brought to seconds of UTC", if unit.is_empty() { "ms" } else { unit }));
    }
    Ok(seconds)
}

/// Which number of dates with slashes is the day: one above 12 says it.
fn order_of(fields: &[&str], name: &str, report: &mut Report) -> Result<Option<DayMonth>, String> {
    let pairs: Vec<(i64, i64)> = fields.iter().filter(|f| f.parse::<f64>().is_err()).filter_map(|f| day_and_month(f)).collect();
    let Some(example) = fields.iter().find(|f| day_and_month(f).is_some()).filter(|_| !pairs.is_empty()) else { return Ok(None) };
    let (first, second) = (pairs.iter().any(|p| p.0 > 12), pairs.iter().any(|p| p.1 > 12));
    let order = match (first, second) {
        (true, false) => DayMonth::DayFirst,
        (false, true) => DayMonth::MonthFirst,
        (true, true) | (false, false) => {
            let why = if first { "days above 12 stand in both places" } else { "no day above 12 says which" };
            return Err(format!("{name}: `{example}` is dd/mm/yyyy or mm/dd/yyyy, and {why}; write {TIME_AS}"));
        }
    };
    let read = if order == DayMonth::DayFirst { "dd/mm/yyyy" } else { "mm/dd/yyyy" };
    report.note(format!("dates in {name} are read as {read}: a day above 12 says so"));
    Ok(Some(order))
}

/// Refuses times that can only count a smaller unit than seconds.
fn no_seconds(seconds: &[f64], name: &str) -> Result<(), String> {
    let middle = quantile(seconds, 0.5);
    let counts = match middle {
        m if (1e12..1e13).contains(&m) => "milliseconds",
        m if (1e15..1e16).contains(&m) => "microseconds",
        m if (1e18..1e19).contains(&m) => "nanoseconds",
        _ => return Ok(()),
    };
    Err(format!("{name} is {middle} in the middle: counts {counts}? State the unit, as in \"time (ms)\", or write seconds"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_units_and_zones_of_a_time_column() {
        let of = |unit: &str, name: &str, field: &str| Count::of(unit, name).expect("a unit").seconds(field, None);
        assert_eq!(of("ms", "time", "1600000000500"), Some(1_600_000_000.5));
        assert_eq!(of("", "TIME_MS", "1500"), Some(1.5));
        assert_eq!(of("days since 1970-01-01", "time", "2"), Some(172_800.0));
        assert_eq!(of("UTC+2", "Time", "2020-09-13T14:26:40"), Some(1.6e9));
        assert_eq!(of("UTC+2", "Time", "2020-09-13T12:26:40Z"), Some(1.6e9));
        assert_eq!((of("UTC", "time", "7"), of("fortnights since 1970-01-01", "time", "7")), (Some(7.0), Some(7.0)));
        assert_eq!(of("CEST", "Time", "2020-09-13T14:26:40"), Some(1.6e9));
        assert_eq!(of("CEST", "Time", "2020-09-13T12:26:40 UTC"), Some(1.6e9));
        assert_eq!(of("days since -4713-01-01T12:00:00", "time", "2440588.5"), Some(86_400.0));
        assert!(Count::of("CST", "Time").is_err_and(|e| e.contains("the zone CST stands for several")));
        assert!(is_time_of_day("9:15") && !is_time_of_day("2026-05-02 09:15") && !is_time_of_day(":"));
    }
}
