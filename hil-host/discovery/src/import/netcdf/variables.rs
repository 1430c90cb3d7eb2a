//! One variable of a NetCDF file as a series in SI on Unix time: clock, unit, flags, fills.

use netcdf_reader::{NcFile, NcType};

use super::super::{MappedName, Report};
use super::names::Wanted;
use crate::record::resample::{Series, longest_in_order};

/// Nothing that a glider measures is larger: such numbers are fills that the file does not declare (NetCDF's own are about 1e37).
const LARGEST: f64 = 1e30;
/// Unix times outside 1970 to 2100 are no times, s: the least 64-bit integer stands for "no time" in files made from pandas.
const TIMES: std::ops::Range<f64> = 0.0..4.103e9;
/// Flags that say "bad" and "missing", in OG1, Argo, Seaglider and QARTOD alike.
const BAD: [u8; 2] = [4, 9];

pub(super) struct Reader<'a> {
    pub file: &'a NcFile,
    pub report: Report,
}

/// A variable found, with the name it had.
pub(super) struct Channel {
    pub name: String,
    pub series: Series,
    /// Samples whose time goes back.
    pub backwards: Option<Backwards>,
}

/// Samples out of the order of time.
pub(super) struct Backwards {
    /// Fewest samples without which time only increases, of how many.
    pub samples: (usize, usize),
    /// The first step back, as "from .. to .. at ..".
    pub first: String,
    /// The series without them.
    pub without: Series,
}

impl Reader<'_> {
    /// The first of the wanted names that is there with a clock and a unit, in SI on Unix time.
    pub fn channel(&mut self, wanted: &Wanted) -> Option<Channel> {
        let found = wanted.names.iter().find_map(|name| self.one(name, wanted));
        if let Some((channel, unit, factor)) = found {
            self.report.map(MappedName { from: channel.name.clone(), unit, to: wanted.column.into(), factor });
            return Some(channel);
        }
        None
    }

    fn one(&mut self, name: &str, wanted: &Wanted) -> Option<(Channel, String, f64)> {
        let variable = self.file.variable(name).ok()?;
        let dimensions: Vec<String> = variable.dimensions().iter().map(|d| d.name.clone()).collect();
        if dimensions.is_empty() {
            return None;
        }
        let unit = self.text(name, "units").unwrap_or_default().trim().to_owned();
        let known = wanted.units.iter().find(|(u, _)| u.eq_ignore_ascii_case(&unit)).map(|(_, f)| *f);
        let stated = wanted.without_unit.iter().find(|(n, _)| *n == name).map(|(_, f)| *f);
        let factor = match (known, stated) {
            (Some(factor), _) => factor,
            (None, Some(factor)) if unit.is_empty() => {
                self.report.note(format!("{name} states no unit: factor {factor} to SI by its name"));
                factor
            }
            _ => {
                self.report.note(format!("{name} is in \"{unit}\", which is not known for it: left out"));
                return None;
            }
        };
        let Some(time) = self.clock(name, &dimensions) else {
            let what = if dimensions.len() > 1 {
                format!("{name} is a table of {}, not a series in time (a gridded product?): left out", dimensions.join(" x "))
            } else {
                format!("{name} has no time on its dimension {}: left out", dimensions[0])
            };
            self.report.note(what);
            return None;
        };
        let mut values = match self.file.read_variable_unpacked_masked(name) {
            Ok(values) => values.iter().map(|v| if v.abs() < LARGEST { v * factor } else { f64::NAN }).collect::<Vec<_>>(),
            Err(e) => {
                self.report.note(format!("{name} cannot be read ({}): left out", reason(&e)));
                return None;
            }
        };
        self.leave_out_bad(name, &mut values);
        let backwards = (dimensions.len() == 1).then(|| backwards(&time, &values)).flatten();
        let series = Series::new(&time, &values);
        if series.is_empty() {
            self.report.note(format!("{name} has no value: left out"));
            return None;
        }
        Some((Channel { name: name.to_owned(), series, backwards }, unit, factor))
    }

    /// Values whose flag is "bad" or "missing" become none.
    fn leave_out_bad(&mut self, name: &str, values: &mut [f64]) {
        let declared = self.text(name, "ancillary_variables").unwrap_or_default();
        let declared = declared.split_whitespace().filter(|n| {
            let n = n.to_ascii_lowercase();
            n.ends_with("_qc") || n.contains("primary_flag") || n.contains("aggregate")
        });
        let usual = [format!("{name}_qc"), format!("{name}_QC")];
        let names = declared.chain(usual.iter().map(String::as_str));
        let Some((flag, flags)) = names.into_iter().find_map(|n| Some((n.to_owned(), self.flags(n, values.len())?))) else { return };
        let mut left_out = 0;
        for (value, flag) in values.iter_mut().zip(&flags) {
            if value.is_finite() && flag.is_some_and(|f| BAD.contains(&f)) {
                *value = f64::NAN;
                left_out += 1;
            }
        }
        if left_out > 0 {
            self.report.note(format!("{left_out} of {} values of {name} left out: {flag} says bad (4) or missing (9)", values.len()));
        }
    }

    /// Flags as numbers; they come as integers, as floats and as characters.
    fn flags(&self, name: &str, rows: usize) -> Option<Vec<Option<u8>>> {
        let variable = self.file.variable(name).ok()?;
        let digit = |c: char| c.to_digit(10).and_then(|d| u8::try_from(d).ok());
        let flags: Vec<Option<u8>> = match variable.dtype() {
            NcType::Char | NcType::String => {
                let texts = self.file.read_variable_as_strings(name).ok()?;
                if texts.len() == rows {
                    texts.iter().map(|t| t.chars().next().and_then(digit)).collect()
                } else {
                    // One text of one character a row; what is cut off at its end says nothing.
                    let mut flags: Vec<_> = texts.concat().chars().map(digit).collect();
                    if flags.len() < rows && texts.len() == 1 {
                        flags.resize(rows, None);
                    }
                    flags
                }
            }
            _ => {
                let numbers = self.file.read_variable_as_f64(name).ok()?;
                numbers.iter().map(|v| (v.fract() == 0.0 && (0.0..10.0).contains(v)).then_some(*v as u8)).collect()
            }
        };
        (flags.len() == rows).then_some(flags)
    }

    /// Unix times of a variable: what its `coordinates` name, else "time", else whatever counts "… since …" on the same dimensions.
    fn clock(&mut self, name: &str, dimensions: &[String]) -> Option<Vec<f64>> {
        let named = self.text(name, "coordinates").unwrap_or_default();
        let variables = self.file.variables().ok()?;
        let mut candidates: Vec<&str> = variables
            .iter()
            .filter(|v| v.dimensions().iter().map(|d| &d.name).eq(dimensions))
            .map(|v| v.name())
            .filter(|n| n.to_ascii_lowercase().contains("time"))
            .collect();
        let rank = |n: &str| match n {
            _ if named.split_whitespace().any(|c| c == n) => 0,
            _ if n.eq_ignore_ascii_case("time") => 1,
            _ => 2,
        };
        candidates.sort_by_key(|n| (rank(n), n.len()));
        let candidates: Vec<String> = candidates.into_iter().map(str::to_owned).collect();
        candidates.into_iter().find_map(|clock| {
            let unit = self.text(&clock, "units").unwrap_or_default();
            let Some((scale, epoch)) = since(&unit) else {
                // A clock that is meant but not understood must not give way to another one in silence.
                if unit.contains(" since ") {
                    self.report.note(format!("{clock} counts \"{unit}\", which is not known: another clock is used if there is one"));
                }
                return None;
            };
            let values = match self.file.read_variable_unpacked_masked(&clock) {
                Ok(values) => values,
                Err(e) => {
                    self.report.note(format!("{clock} cannot be read ({})", reason(&e)));
                    return None;
                }
            };
            let times: Vec<f64> = values.iter().map(|v| v * scale + epoch).map(|t| if TIMES.contains(&t) { t } else { f64::NAN }).collect();
            if !times.iter().any(|t| t.is_finite()) {
                self.report.note(format!("{clock} has no time between 1970 and 2100 by its unit \"{unit}\""));
            }
            Some(times)
        })
    }

    /// A whole number of each row, on the clock of its dimension, e.g. of the dive.
    pub fn numbers(&mut self, name: &str) -> Option<Series> {
        let variable = self.file.variable(name).ok()?;
        let dimensions: Vec<String> = variable.dimensions().iter().map(|d| d.name.clone()).collect();
        let time = (!dimensions.is_empty()).then(|| self.clock(name, &dimensions)).flatten()?;
        let values = self.file.read_variable_unpacked_masked(name).ok()?;
        let values: Vec<f64> = values.iter().copied().collect();
        Some(Series::new(&time, &values)).filter(|s| !s.is_empty())
    }

    /// The one value of a variable without dimensions.
    pub fn scalar(&self, name: &str) -> Option<f64> {
        let variable = self.file.variable(name).ok()?;
        let one = variable.dimensions().is_empty().then(|| self.file.read_variable_unpacked_masked(name).ok())??;
        one.iter().next().copied().filter(|v| v.abs() < LARGEST)
    }

    pub fn text(&self, variable: &str, attribute: &str) -> Option<String> {
        let variable = self.file.variable(variable).ok()?;
        let found = variable.attributes().iter().find(|a| a.name == attribute)?;
        found.value.as_string()
    }
}

/// What the reader says, with the way out where there is one.
fn reason(error: &netcdf_reader::Error) -> String {
    let said = error.to_string();
    let way_out = if said.contains("unsupported filter") { "; repack the file with `h5repack -f NONE IN OUT`" } else { "" };
    format!("{said}{way_out}")
}

fn backwards(time: &[f64], values: &[f64]) -> Option<Backwards> {
    let finite: Vec<(usize, f64, f64)> =
        time.iter().zip(values).enumerate().filter(|(_, (t, v))| t.is_finite() && v.is_finite()).map(|(i, (t, v))| (i, *t, *v)).collect();
    let first = finite.windows(2).find(|w| w[1].1 < w[0].1)?;
    let first = format!("from {:.3} to {:.3} s at sample {}", first[0].1, first[1].1, first[1].0 + 1);
    let times: Vec<f64> = finite.iter().map(|f| f.1).collect();
    let kept = longest_in_order(&times);
    let samples = (finite.len() - kept.len(), finite.len());
    let (time, value): (Vec<f64>, Vec<f64>) = kept.into_iter().map(|k| (finite[k].1, finite[k].2)).unzip();
    Some(Backwards { samples, first, without: Series::new(&time, &value) })
}

/// Seconds per unit and Unix time of the origin of "seconds since 1970-01-01 00:00:00".
fn since(units: &str) -> Option<(f64, f64)> {
    let (unit, date) = units.split_once(" since ")?;
    let scale = match unit.trim().to_ascii_lowercase().as_str() {
        "nanoseconds" | "nanosecond" | "ns" => 1e-9,
        "microseconds" | "microsecond" | "us" => 1e-6,
        "milliseconds" | "millisecond" | "msec" | "ms" => 1e-3,
        "seconds" | "second" | "s" | "sec" | "secs" => 1.0,
        "minutes" | "minute" | "min" | "mins" => 60.0,
        "hours" | "hour" | "hr" | "h" => 3600.0,
        "days" | "day" | "d" => 86400.0,
        _ => return None,
    };
    // A zone other than UTC: "+02:00" after the time of day.
    let (date, zone) = match date.trim().rfind(['+', '-']).filter(|at| date.trim()[..*at].contains(':')) {
        Some(at) => (&date.trim()[..at], Some(&date.trim()[at..])),
        None => (date.trim(), None),
    };
    let mut numbers = date.split(|c: char| !c.is_ascii_digit() && c != '.').filter(|s| !s.is_empty()).map(str::parse::<f64>);
    let mut next = || numbers.next().and_then(Result::ok);
    let (year, month, day) = (next()?, next()?, next()?);
    let clock = next().unwrap_or(0.0) * 3600.0 + next().unwrap_or(0.0) * 60.0 + next().unwrap_or(0.0);
    let zone_s = match zone {
        Some(zone) => {
            let digits: String = zone[1..].chars().filter(char::is_ascii_digit).collect();
            let (hours, minutes) = digits.split_at_checked(2)?;
            let minutes = if minutes.is_empty() { 0.0 } else { minutes.parse::<f64>().ok()? };
            let east = hours.parse::<f64>().ok()? * 3600.0 + minutes * 60.0;
            if zone.starts_with('-') { -east } else { east }
        }
        None => 0.0,
    };
    Some((scale, days_from_1970(year as i64, month as i64, day as i64)? as f64 * 86400.0 + clock - zone_s))
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
    fn the_fewest_samples_are_called_out_of_order() {
        assert!(backwards(&[0.0, 1.0, f64::NAN, 2.0], &[0.0; 4]).is_none());
        let found = backwards(&[0.0, 1.0, 9.0, 2.0, 3.0], &[0.0; 5]).expect("one step back");
        assert_eq!((found.samples, found.first.as_str()), ((1, 5), "from 9.000 to 2.000 s at sample 4"));
    }

    #[test]
    fn origins_of_time_are_read() {
        assert_eq!(since("seconds since 1970-1-1 00:00:00"), Some((1.0, 0.0)));
        assert_eq!(since("days since 1950-01-01T00:00:00Z"), Some((86400.0, -7305.0 * 86400.0)));
        assert_eq!(since("seconds since 2000-03-01 12:00"), Some((1.0, 951_912_000.0)));
        assert_eq!(since("seconds since 1970-01-01T00:00:00+00:00"), Some((1.0, 0.0)));
        assert_eq!(since("hours since 1970-01-01 02:00:00 +02:00"), Some((3600.0, 0.0)));
        assert_eq!(since("nanoseconds since 1970-01-01 00:00:01"), Some((1e-9, 1.0)));
        assert_eq!(since("metres"), None);
        assert_eq!(since("fortnights since 1970-01-01"), None);
    }
}
