//! One variable of a NetCDF file as a series in SI on Unix time: clock, unit, flags, fills.

use std::collections::BTreeMap;

use netcdf_reader::{NcFile, NcType};

use super::super::{MappedName, Report};
use super::backwards::{Backwards, backwards};
use super::names::{BALLAST, DENSITY, PRESSURE, SALINITY, Wanted};
use crate::record::resample::Series;

/// Nothing that a glider measures is larger: such numbers are fills that the file does not declare (NetCDF's own are about 1e37).
pub(super) const LARGEST: f64 = 1e30;
/// Practical salinity of one gram of absolute salinity a kilogram, where the sea has its usual salts (TEOS-10).
const PRACTICAL_PER_ABSOLUTE: f64 = 35.0 / 35.165_04;

/// What is said of rows without a pressure, once.
const NO_ROWS: &str = ": no rows of the flight";

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
    /// Share of the clock's run in which it has values.
    pub coverage: f64,
    unit: String,
    factor: f64,
}

impl Channel {
    /// Whether it measured nothing: it is zero throughout.
    pub(super) fn is_zero(&self) -> bool {
        self.series.pairs().all(|(_, v)| v == 0.0)
    }
}

/// Why a variable is not a channel: with a text where its values would be lost by it.
struct Unread(Option<String>);

impl Reader<'_> {
    /// The first of the wanted names that is there with a clock and a unit, in SI on Unix time; one that has values in a small part of
    /// the run only, or is zero throughout, gives way to a fuller one.
    pub fn channel(&mut self, wanted: &Wanted) -> Option<Channel> {
        let (mut found, mut unread) = (Vec::new(), Vec::new());
        for name in self.called(wanted) {
            match self.one(&name, wanted) {
                Ok(channel) => {
                    let full = channel.coverage >= 0.5 && !channel.is_zero();
                    found.push(channel);
                    if full {
                        break;
                    }
                }
                Err(Unread(why)) => unread.extend(why),
            }
        }
        let most = found.iter().filter(|c| !c.is_zero()).map(|c| c.coverage).fold(0.0, f64::max);
        let best = found.iter().position(|c| !c.is_zero() && 2.0 * c.coverage >= most).unwrap_or(0);
        for why in unread {
            if found.is_empty() { self.report.leave_out(why) } else { self.report.note(why) }
        }
        for passed in found.iter().take(best) {
            let why = if passed.is_zero() { "is 0 throughout".into() } else { format!("has {} values", passed.series.len()) };
            self.report.note(format!("{} {why}: {} is taken, which has {}", passed.name, found[best].name, found[best].series.len()));
        }
        let channel = (best < found.len()).then(|| found.swap_remove(best))?;
        let (unit, factor) = (channel.unit.clone(), channel.factor);
        self.report.map(MappedName { from: channel.name.clone(), unit, to: wanted.column.into(), factor });
        Some(channel)
    }

    /// A channel that is only asked for a check or in the place of another: what cannot be read of it is no loss.
    pub fn aside(&mut self, wanted: &Wanted) -> Option<Channel> {
        let (mapped, lost) = (self.report.mapped.len(), self.report.left_out.len());
        let channel = self.channel(wanted);
        self.report.mapped.truncate(mapped);
        for why in self.report.left_out.split_off(lost) {
            self.report.note(why);
        }
        channel
    }

    /// Variables that may be what is wanted: by name whatever its case, then by what the file says it is.
    pub(super) fn called(&self, wanted: &Wanted) -> Vec<String> {
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

    /// Names of the dimensions that are more than one value long; the length of texts of characters is none.
    pub(super) fn dimensions(&self, name: &str) -> Option<Vec<String>> {
        let variable = self.file.variable(name).ok()?;
        let of = variable.dimensions();
        let values = if *variable.dtype() == NcType::Char { of.split_last().map_or(of, |(_, values)| values) } else { of };
        Some(values.iter().filter(|d| d.size != 1).map(|d| d.name.clone()).collect())
    }

    /// Whether a variable holds texts.
    pub(super) fn is_text(&self, name: &str) -> bool {
        self.file.variable(name).is_ok_and(|v| matches!(v.dtype(), NcType::Char | NcType::String))
    }

    fn one(&mut self, name: &str, wanted: &Wanted) -> Result<Channel, Unread> {
        let dimensions = self.dimensions(name).filter(|d| !d.is_empty()).ok_or(Unread(None))?;
        let unit = self.text(name, "units").unwrap_or_default().trim().to_owned();
        let (offset, factor) = self.offset_and_factor(name, &unit, wanted)?;
        let Some(time) = self.clock(name, &dimensions) else {
            let what = if dimensions.len() > 1 {
                format!("{name} is a table of {}, not a series in time (a gridded product?): left out", dimensions.join(" x "))
            } else {
                format!("{name} has no time on its dimension {}: left out", dimensions[0])
            };
            self.report.note(what);
            return Err(Unread(None));
        };
        let mut values = match self.values(name) {
            Ok(values) => {
                let values = self.without_fills(name, values);
                values.iter().map(|v| if v.abs() < LARGEST { (v - offset) * factor } else { f64::NAN }).collect::<Vec<_>>()
            }
            Err(why) => {
                self.report.leave_out(format!("{name} cannot be read ({why})"));
                return Err(Unread(None));
            }
        };
        self.leave_out_bad(name, &mut values);
        self.without_impossible(name, wanted, &mut values);
        if wanted.column == PRESSURE.column {
            self.report_undated(name, &time, &values);
            let without = time.iter().zip(&values).filter(|(t, v)| t.is_finite() && v.is_nan()).count();
            if without > 0 && !self.report.notes.iter().any(|n| n.ends_with(NO_ROWS)) {
                self.report.note(format!("{without} of {} rows have no {name}{NO_ROWS}", values.len()));
            }
        }
        let backwards = (dimensions.len() == 1).then(|| backwards(&time, &values)).flatten();
        let series = Series::new(&time, &values);
        if series.is_empty() {
            self.report.note(format!("{name} has no value: left out"));
            return Err(Unread(None));
        }
        Ok(Channel { name: name.to_owned(), coverage: coverage(&time, &values), series, backwards, unit, factor })
    }

    /// What is taken off the numbers of a variable, and by what they are multiplied then, to be in SI.
    fn offset_and_factor(&mut self, name: &str, unit: &str, wanted: &Wanted) -> Result<(f64, f64), Unread> {
        let standard = self.text(name, "standard_name").unwrap_or_default();
        if wanted.column == DENSITY.column && (standard.contains("potential_density") || standard.contains("sigma")) {
            let what = format!("{name} is {standard} by its standard_name, not the density where it was measured: left out");
            return Err(Unread(Some(what)));
        }
        let stated = wanted.without_unit.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, f)| *f);
        let (offset, factor) = match (wanted.in_si(unit), stated) {
            (Some(known), _) => known,
            (None, Some(factor)) if unit.is_empty() => {
                self.report.note(format!("{name} states no unit: factor {factor} to SI by its name"));
                (0.0, factor)
            }
            _ => return Err(Unread(Some(format!("{name} is in \"{unit}\", which is not known for it: left out")))),
        };
        if wanted.names == SALINITY.names && standard.trim() == "sea_water_absolute_salinity" {
            self.report.note(format!("{name} is absolute salinity by its standard_name: turned into the practical one"));
            return Ok((offset, factor * PRACTICAL_PER_ABSOLUTE));
        }
        Ok((offset, factor))
    }

    /// Values without a time are lost.
    fn report_undated(&mut self, name: &str, time: &[f64], values: &[f64]) {
        let lost = time.iter().zip(values).filter(|(t, v)| t.is_nan() && v.is_finite()).count();
        // Those of a clock that was not set are counted where it is read.
        if lost > 0 && !self.report.left_out.iter().any(|l| l.contains("a clock that was not set")) {
            self.report.leave_out(format!("{lost} of {} values of {name} have no time", values.len()));
        }
    }

    /// The bytes that the values of `name` take, where there is room for them: what a file declares may be a thousand times what it holds.
    pub(super) fn room(&self, name: &str) -> Result<u64, String> {
        let rows = self.file.variable(name).and_then(|v| Ok(v.num_elements()?)).map_err(|e| e.to_string())?;
        let bytes = rows.saturating_mul(8);
        if bytes > self.budget {
            return Err(format!("declares {rows} values, more than a file of this size holds"));
        }
        Ok(bytes)
    }

    /// The same, taken off what is left.
    pub(super) fn fits(&mut self, name: &str) -> Result<(), String> {
        self.budget -= self.room(name)?;
        Ok(())
    }

    /// All values of a variable, unpacked, fills as NaN.
    pub(super) fn values(&mut self, name: &str) -> Result<Vec<f64>, String> {
        self.fits(name)?;
        let values = match self.in_unpacked_range(name) {
            Some(values) => values,
            None => self.file.read_variable_unpacked_masked(name).map_err(|e| reason(&e))?.into_iter().collect(),
        };
        // Written as texts they are not applied by the reader.
        let number = |attribute: &str| self.text(name, attribute).and_then(|t| t.trim().parse::<f64>().ok());
        let (scale, offset) = (number("scale_factor").unwrap_or(1.0), number("add_offset").unwrap_or(0.0));
        Ok(values.iter().map(|v| v * scale + offset).collect())
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

/// Share of a clock's run in which a variable has values: of as many as 50 equal parts of the run that have times.
fn coverage(time: &[f64], values: &[f64]) -> f64 {
    let (first, last) = time.iter().filter(|t| t.is_finite()).fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(*t), b.max(*t)));
    let (mut timed, mut filled) = ([false; 50], [false; 50]);
    for (t, v) in time.iter().zip(values).filter(|(t, _)| t.is_finite()) {
        let part = if last > first { ((t - first) / (last - first) * 50.0).min(49.0) as usize } else { 0 };
        timed[part] = true;
        filled[part] |= v.is_finite();
    }
    let count = |parts: [bool; 50]| parts.iter().filter(|p| **p).count() as f64;
    count(filled) / count(timed).max(1.0)
}

/// What the reader says, with the way out where there is one.
fn reason(error: &netcdf_reader::Error) -> String {
    let said = error.to_string();
    let way_out = if said.contains("unsupported filter") { "; repack the file with `h5repack -f NONE IN OUT`" } else { "" };
    format!("{said}{way_out}")
}
