//! Values of a NetCDF variable that stand for none.

use netcdf_reader::masked::MaskParams;
use netcdf_reader::unpack::UnpackParams;
use netcdf_reader::{NcAttrValue, NcType, NcVariable};

use super::names::Wanted;
use super::variables::{LARGEST, Reader};

/// A range that is meant for unpacked numbers keeps so much of the different values, read as such.
const MEANT: f64 = 0.95;

/// Whether the range of a variable of whole numbers is of fractions: by the NetCDF user guide it is one of unpacked numbers then.
fn states_unpacked(variable: &NcVariable) -> bool {
    let is_fraction =
        |name: &str| variable.attribute(name).is_some_and(|a| matches!(a.value, NcAttrValue::Floats(_) | NcAttrValue::Doubles(_)));
    !matches!(variable.dtype(), NcType::Float | NcType::Double) && BOUNDS.iter().any(|name| is_fraction(name))
}

/// Attributes that say what a value can be.
const BOUNDS: [&str; 3] = ["valid_min", "valid_max", "valid_range"];

impl Reader<'_> {
    /// The values of a packed variable whose range is written in unpacked numbers; none of any other. Such a range takes out most values
    /// where it is read in packed numbers, as the CF conventions want it, and hardly any as what it is.
    pub(super) fn in_unpacked_range(&mut self, name: &str) -> Option<Vec<f64>> {
        let variable = self.file.variable(name).ok()?;
        let (unpack, mask) = UnpackParams::from_variable(variable).zip(MaskParams::from_variable(variable))?;
        let bounded = mask.valid_min.is_some() || mask.valid_max.is_some();
        if !bounded || variable.attribute("_Unsigned").is_some() || self.room(name).is_err() {
            return None;
        }
        let range = mask.valid_min.unwrap_or(f64::NEG_INFINITY)..=mask.valid_max.unwrap_or(f64::INFINITY);
        let mut stored = self.file.read_variable_as_f64(name).ok()?;
        MaskParams { valid_min: None, valid_max: None, ..mask }.apply(&mut stored);
        // Each value counts once: a fill that nothing declares may stand in most rows.
        let mut different: Vec<f64> = stored.iter().copied().filter(|v| v.is_finite()).collect();
        different.sort_by(f64::total_cmp);
        different.dedup();
        let unpacked = |v: f64| v * unpack.scale_factor + unpack.add_offset;
        let packed_kept = different.iter().filter(|v| range.contains(v)).count();
        let unpacked_kept = different.iter().filter(|v| range.contains(&unpacked(**v))).count();
        let lost = 2 * packed_kept < different.len() || (states_unpacked(variable) && packed_kept < unpacked_kept);
        if !lost || (unpacked_kept as f64) < MEANT * different.len() as f64 {
            return None;
        }
        let (low, high) = (range.start(), range.end());
        self.report
            .note(format!("valid range of {name} ({low} to {high}) is written in unpacked numbers, not in packed ones: taken as such"));
        Some(stored.iter().map(|v| unpacked(*v)).map(|v| if range.contains(&v) { v } else { f64::NAN }).collect())
    }

    /// Without what the file does not declare to be a fill: one value, over and over, far outside of all others; and what is declared
    /// in a text ("-99") instead of a number. What lies beyond a bound of the file is counted.
    pub(super) fn without_fills(&mut self, name: &str, mut values: Vec<f64>) -> Vec<f64> {
        let number = |attribute: &str| self.text(name, attribute).and_then(|t| t.trim().parse::<f64>().ok());
        let (low, high) = (number("valid_min"), number("valid_max"));
        let declared = [number("missing_value"), number("_FillValue")];
        values.iter_mut().filter(|v| declared.contains(&Some(**v))).for_each(|v| *v = f64::NAN);
        let mut beyond = self.masked_by_bounds(name, &values);
        for v in &mut values {
            if low.is_some_and(|l| *v < l) || high.is_some_and(|h| *v > h) {
                *v = f64::NAN;
                beyond += 1;
            }
        }
        if beyond > 0 {
            self.report.note(format!("{beyond} of {} values of {name} beyond its valid_min or valid_max left out", values.len()));
        }
        for _ in 0..2 {
            let Some((fill, count)) = undeclared_fill(&values) else { break };
            values.iter_mut().filter(|v| **v == fill).for_each(|v| *v = f64::NAN);
            self.report
                .note(format!("{count} of {} values of {name} are {fill}: a fill that the file does not declare, left out", values.len()));
        }
        values
    }

    /// Without values that are outside of what the channel can be, where these are few: of many the unit is wrong, which is said elsewhere.
    pub(super) fn without_impossible(&mut self, name: &str, wanted: &Wanted, values: &mut [f64]) {
        let possible = wanted.possible();
        let all = values.iter().filter(|v| v.is_finite()).count();
        let outside = values.iter().filter(|v| v.is_finite() && !possible.contains(v)).count();
        if outside == 0 || 2 * outside > all {
            return;
        }
        values.iter_mut().filter(|v| !possible.contains(v)).for_each(|v| *v = f64::NAN);
        self.report.note(format!("{outside} of {all} values of {name} are outside of what it can be: left out"));
    }

    /// How many values a numeric `valid_min`, `valid_max` or `valid_range` has taken out; of packed numbers it counts as they are stored.
    fn masked_by_bounds(&mut self, name: &str, values: &[f64]) -> usize {
        let Ok(variable) = self.file.variable(name) else { return 0 };
        let numbers = |attribute: &str| variable.attribute(attribute).and_then(|a| a.value.as_f64_vec()).unwrap_or_default();
        if BOUNDS.iter().all(|a| numbers(a).is_empty()) || variable.attribute("_Unsigned").is_some() {
            return 0;
        }
        let fills: Vec<f64> = [numbers("_FillValue"), numbers("missing_value")].concat();
        if self.fits(name).is_err() {
            return 0;
        }
        let Ok(stored) = self.file.read_variable_as_f64(name) else { return 0 };
        let is_value = |v: f64| v.is_finite() && v.abs() < LARGEST && !fills.contains(&v);
        stored.iter().zip(values).filter(|(stored, value)| value.is_nan() && is_value(**stored)).count()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
