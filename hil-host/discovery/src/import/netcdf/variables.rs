//! One variable of a NetCDF file as a series in SI on Unix time: clock, unit, flags, fills.

use std::collections::BTreeMap;

use netcdf_reader::{NcFile, NcType};

use super::super::calendar::{days_from_1970, zone_s};
use super::super::channels::{LONGEST_MISSION_S, stray_times};
use super::super::{MappedName, Report};
use super::names::{BALLAST, Wanted};
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
    /// Bytes that values may still take.
    pub budget: u64,
    /// Clocks read before, by name.
    pub clocks: BTreeMap<String, Option<Vec<f64>>>,
    /// Practical salinity of each row, once it is known.
    pub salinity: Option<Vec<f64>>,
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
        let found = self.called(wanted).into_iter().find_map(|name| self.one(&name, wanted));
        if let Some((channel, unit, factor)) = found {
            self.report.map(MappedName { from: channel.name.clone(), unit, to: wanted.column.into(), factor });
            return Some(channel);
        }
        None
    }

    /// Variables that may be what is wanted: by name whatever its case, then by what the file says it is.
    fn called(&self, wanted: &Wanted) -> Vec<String> {
        let Ok(variables) = self.file.variables() else { return Vec::new() };
        let mut found: Vec<String> = Vec::new();
        for name in wanted.names {
            // The exact spelling first.
            let spelt =
                |exact: bool| variables.iter().map(|v| v.name()).filter(move |n| (*n == *name) == exact && n.eq_ignore_ascii_case(name));
            found.extend(spelt(true).chain(spelt(false)).map(str::to_owned));
        }
        for v in variables {
            let said = |attribute: &str| v.attribute(attribute).and_then(|a| a.value.as_string()).unwrap_or_default();
            let standard = said("standard_name");
            let source = said("source");
            // A ballast of any name names the sensor it is from.
            let sensor = wanted.column == BALLAST.column && BALLAST.names.iter().any(|n| n.eq_ignore_ascii_case(source.trim()));
            if (wanted.standard.contains(&standard.trim()) || sensor) && !found.iter().any(|n| n == v.name()) {
                found.push(v.name().to_owned());
            }
        }
        found
    }

    /// Names of the dimensions that are more than one value long.
    fn dimensions(&self, name: &str) -> Option<Vec<String>> {
        let variable = self.file.variable(name).ok()?;
        Some(variable.dimensions().iter().filter(|d| d.size != 1).map(|d| d.name.clone()).collect())
    }

    fn one(&mut self, name: &str, wanted: &Wanted) -> Option<(Channel, String, f64)> {
        let dimensions = self.dimensions(name).filter(|d| !d.is_empty())?;
        let unit = self.text(name, "units").unwrap_or_default().trim().to_owned();
        let known = wanted.units.iter().find(|(u, _)| u.eq_ignore_ascii_case(&unit)).map(|(_, f)| *f);
        let stated = wanted.without_unit.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, f)| *f);
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
        let mut values = match self.values(name) {
            Ok(values) => {
                let values = self.without_fills(name, values);
                values.iter().map(|v| if v.abs() < LARGEST { v * factor } else { f64::NAN }).collect::<Vec<_>>()
            }
            Err(why) => {
                self.report.leave_out(format!("{name} cannot be read ({why})"));
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

    /// Whether the values of `name` have room: what a file declares may be a thousand times what it holds.
    fn fits(&mut self, name: &str) -> Result<(), String> {
        let rows = self.file.variable(name).and_then(|v| Ok(v.num_elements()?)).map_err(|e| e.to_string())?;
        let bytes = rows.saturating_mul(8);
        if bytes > self.budget {
            return Err(format!("declares {rows} values, more than a file of this size holds"));
        }
        self.budget -= bytes;
        Ok(())
    }

    /// All values of a variable, unpacked, fills as NaN.
    fn values(&mut self, name: &str) -> Result<Vec<f64>, String> {
        self.fits(name)?;
        let values = self.file.read_variable_unpacked_masked(name).map_err(|e| reason(&e))?;
        Ok(values.iter().copied().collect())
    }

    /// Without what the file does not declare to be a fill: one value, over and over, far outside of all others; and what lies
    /// beyond a `valid_min` or `valid_max` that is written as a text.
    fn without_fills(&mut self, name: &str, mut values: Vec<f64>) -> Vec<f64> {
        let bound = |attribute: &str| self.text(name, attribute).and_then(|t| t.trim().parse::<f64>().ok());
        let (low, high) = (bound("valid_min"), bound("valid_max"));
        let mut beyond = 0;
        for v in &mut values {
            if low.is_some_and(|l| *v < l) || high.is_some_and(|h| *v > h) {
                *v = f64::NAN;
                beyond += 1;
            }
        }
        if beyond > 0 {
            self.report.note(format!("{beyond} values of {name} beyond its valid_min or valid_max left out"));
        }
        for _ in 0..2 {
            let Some((fill, count)) = undeclared_fill(&values) else { break };
            values.iter_mut().filter(|v| **v == fill).for_each(|v| *v = f64::NAN);
            self.report
                .note(format!("{count} of {} values of {name} are {fill}: a fill that the file does not declare, left out", values.len()));
        }
        values
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
    fn flags(&mut self, name: &str, rows: usize) -> Option<Vec<Option<u8>>> {
        self.fits(name).ok()?;
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
            .filter(|v| v.dimensions().iter().filter(|d| d.size != 1).map(|d| &d.name).eq(dimensions))
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
        candidates.sort_by_key(|n| (rank(n), n.len()));
        let candidates: Vec<String> = candidates.into_iter().map(str::to_owned).collect();
        candidates.into_iter().find_map(|clock| {
            if let Some(known) = self.clocks.get(&clock) {
                return known.clone();
            }
            let times = self.times(&clock);
            self.clocks.insert(clock, times.clone());
            times
        })
    }

    /// Unix times of one clock.
    fn times(&mut self, clock: &str) -> Option<Vec<f64>> {
        let unit = self.text(clock, "units").unwrap_or_default();
        let Some((scale, epoch)) = since(&unit) else {
            // A clock that is meant but not understood must not give way to another one in silence.
            if unit.contains(" since ") {
                self.report.note(format!("{clock} counts \"{unit}\", which is not known: another clock is used if there is one"));
            }
            return None;
        };
        let values = match self.values(clock) {
            Ok(values) => values,
            Err(why) => {
                self.report.leave_out(format!("{clock} cannot be read ({why})"));
                return None;
            }
        };
        let times: Vec<f64> = values.iter().map(|v| v * scale + epoch).map(|t| if TIMES.contains(&t) { t } else { f64::NAN }).collect();
        let mut times = times;
        let stray = stray_times(&mut times, LONGEST_MISSION_S);
        if stray > 0 {
            self.report
                .leave_out(format!("{stray} of {} times of {clock} are years off the others: a clock that was not set", times.len()));
        }
        let repeated = spread(&mut times);
        if repeated > 0 {
            self.report.note(format!(
                "{repeated} of {} times of {clock} repeat the one before (a clock of whole seconds?): spread evenly up to the next",
                times.len()
            ));
        }
        if !times.iter().any(|t| t.is_finite()) {
            self.report.note(format!("{clock} has no time between 1970 and 2100 by its unit \"{unit}\""));
        }
        Some(times)
    }

    /// A whole number of each row, on the clock of its dimension, e.g. of the dive.
    pub fn numbers(&mut self, name: &str) -> Option<Series> {
        let dimensions = self.dimensions(name)?;
        let time = (!dimensions.is_empty()).then(|| self.clock(name, &dimensions)).flatten()?;
        let values = self.values(name).ok()?;
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

/// A value that comes three times and more, lies further from all others than they span ten times over, and is ten times larger or
/// smaller (a pump that is out as often as it is in has two values too); for numbers of nines, such as -9999, beyond them by a tenth of
/// their span. With its count.
pub(crate) fn undeclared_fill(values: &[f64]) -> Option<(f64, usize)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite() && v.abs() < LARGEST).collect();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    for (fill, others) in
        [(high, &sorted[..sorted.partition_point(|v| *v < high)]), (low, &sorted[sorted.partition_point(|v| *v <= low)..])]
    {
        let count = sorted.len() - others.len();
        let (Some(first), Some(last)) = (others.first(), others.last()) else { continue };
        let (span, away) = (last - first, (fill - last).max(first - fill));
        let nines = {
            let digits = format!("{}", fill.abs());
            let nines = digits.chars().filter(|c| *c == '9').count();
            nines >= 3 && digits.chars().all(|c| c == '9' || c == '.')
        };
        let (least, most) = (first.abs().min(last.abs()), first.abs().max(last.abs()));
        let another_size = fill.abs() > 10.0 * most || 10.0 * fill.abs() < least;
        if count >= 3 && span > 0.0 && ((away > 10.0 * span && another_size) || (nines && away > 0.1 * span)) {
            return Some((fill, count));
        }
    }
    None
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
    let zone_s = zone.map_or(Some(0.0), zone_s)?;
    Some((scale, days_from_1970(year as i64, month as i64, day as i64)? as f64 * 86400.0 + clock - zone_s))
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
    fn times_of_whole_seconds_are_spread() {
        let mut times = [0.0, 0.0, 1.0, 1.0, 2.0, f64::NAN, 5.0, 5.0];
        assert_eq!(spread(&mut times), 2);
        assert_eq!(times[..5], [0.0, 0.5, 1.0, 1.5, 2.0]);
        let mut stuck = [7.0; 4];
        assert_eq!(spread(&mut stuck), 0);
    }

    #[test]
    fn fills_that_nothing_declares_are_found_and_measurements_are_not() {
        let wave: Vec<f64> = (0..300).map(|i| 10.0 + 5.0 * (0.1 * f64::from(i)).sin()).collect();
        assert_eq!(undeclared_fill(&wave), None);
        // Held at a rail three times, near the others: no fill.
        let held: Vec<f64> = wave.iter().map(|v| v.min(14.0)).collect();
        assert_eq!(undeclared_fill(&held), None);
        for fill in [-9999.9, 9999.0, -999.0, -32768.0, 1e20] {
            let mut with = wave.clone();
            (0..100).for_each(|k| with[3 * k] = fill);
            assert_eq!(undeclared_fill(&with), Some((fill, 100)), "{fill}");
        }
        // A deep pressure and its -999.
        let mut deep: Vec<f64> = (0..1000).map(f64::from).collect();
        deep.extend([-999.0; 5]);
        assert_eq!(undeclared_fill(&deep), Some((-999.0, 5)));
        // One large number is a spike.
        let mut spike = wave;
        spike[7] = 9999.0;
        assert_eq!(undeclared_fill(&spike), None);
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
