//! Values of a NetCDF variable, without those that its attributes say to be none.

use netcdf_reader::NcAttrValue;
use netcdf_reader::masked::MaskParams;
use netcdf_reader::unpack::UnpackParams;

use super::super::fills::LARGEST;
use super::*;

/// A range that is meant for unpacked numbers keeps so much of the different values, read as such.
const MEANT: f64 = 0.95;

/// Attributes that say what a value can be.
const BOUNDS: [&str; 3] = ["valid_min", "valid_max", "valid_range"];

/// Whether the range of a variable of whole numbers is of fractions: by the NetCDF user guide it is one of unpacked numbers then.
fn states_unpacked(variable: &NcVariable) -> bool {
    let is_fraction =
        |name: &str| variable.attribute(name).is_some_and(|a| matches!(a.value, NcAttrValue::Floats(_) | NcAttrValue::Doubles(_)));
    !matches!(variable.dtype(), NcType::Float | NcType::Double) && BOUNDS.iter().any(|name| is_fraction(name))
}

impl Reader<'_> {
    /// All values of a variable, unpacked, fills as NaN.
    pub(super) fn values(&mut self, name: &str) -> Result<Vec<f64>, String> {
        self.fits(name)?;
        let array = self.file.read_variable_unpacked_masked(name).map_err(|e| reason(&e))?;
        let mut values: Vec<f64> = if array.is_standard_layout() {
            let (count, (mut all, first)) = (array.len(), array.into_raw_vec_and_offset());
            drop(all.drain(..first.unwrap_or(0)));
            all.truncate(count);
            all
        } else {
            array.into_iter().collect()
        };
        // Written as texts they are not applied by the reader.
        let number = |attribute: &str| self.text(name, attribute).and_then(|t| t.trim().parse::<f64>().ok());
        let (scale, offset) = (number("scale_factor").unwrap_or(1.0), number("add_offset").unwrap_or(0.0));
        if scale != 1.0 || offset != 0.0 {
            values.iter_mut().for_each(|v| *v = *v * scale + offset);
        }
        Ok(values)
    }

    /// Without what a text ("-99") instead of a number declares, and with what a range in other numbers than it is meant in takes out; what
    /// lies beyond a bound of the file is counted.
    pub(super) fn without_declared(&mut self, name: &str, values: Vec<f64>, notes: &mut Vec<Said>) -> Vec<f64> {
        let file = self.file;
        let number = |attribute: &str| text(file, name, attribute).and_then(|t| t.trim().parse::<f64>().ok());
        let (low, high) = (number("valid_min"), number("valid_max"));
        let declared = [number("missing_value"), number("_FillValue")];
        let (mut values, mut beyond) = self.in_bounds(name, values, notes);
        for v in values.iter_mut().filter(|v| v.is_finite()) {
            let outside = low.is_some_and(|l| *v < l) || high.is_some_and(|h| *v > h);
            beyond += usize::from(outside);
            if outside || declared.contains(&Some(*v)) {
                *v = f64::NAN;
            }
        }
        if beyond > 0 {
            notes.push(Said::Note(format!("{beyond} of {} values of {name} beyond its valid_min or valid_max left out", values.len())));
        }
        values
    }

    /// The values of a variable with a numeric range, and how many of them that takes out. A packed variable's range that is written in
    /// unpacked numbers takes out most values where it is read in packed numbers, as the CF conventions want it, and hardly any as what
    /// it is: then it is taken as such.
    fn in_bounds(&self, name: &str, values: Vec<f64>, notes: &mut Vec<Said>) -> (Vec<f64>, usize) {
        let Ok(variable) = self.file.variable(name) else { return (values, 0) };
        let numbers = |attribute: &str| variable.attribute(attribute).and_then(|a| a.value.as_f64_vec()).unwrap_or_default();
        let unsigned = variable.attribute("_Unsigned").is_some();
        if BOUNDS.iter().all(|a| numbers(a).is_empty()) || unsigned || self.room(name).is_err() {
            return (values, 0);
        }
        let Ok(stored) = self.file.read_variable_as_f64(name) else { return (values, 0) };
        let fills: Vec<f64> = [numbers("_FillValue"), numbers("missing_value")].concat();
        let is_value = |v: f64| v.is_finite() && v.abs() < LARGEST && !fills.contains(&v);
        let masked = || stored.iter().zip(&values).filter(|(stored, value)| value.is_nan() && is_value(**stored)).count();
        let packing = UnpackParams::from_variable(variable).zip(MaskParams::from_variable(variable));
        let Some((unpack, mask)) = packing else { return (values.clone(), masked()) };
        let range = mask.valid_min.unwrap_or(f64::NEG_INFINITY)..=mask.valid_max.unwrap_or(f64::INFINITY);
        // Each value counts once: a fill that nothing declares may stand in most rows.
        let mut different: Vec<f64> = stored.iter().copied().filter(|v| is_value(*v)).collect();
        different.sort_by(f64::total_cmp);
        different.dedup();
        let unpacked = |v: f64| v * unpack.scale_factor + unpack.add_offset;
        let packed_kept = different.iter().filter(|v| range.contains(v)).count();
        let unpacked_kept = different.iter().filter(|v| range.contains(&unpacked(**v))).count();
        let lost = 2 * packed_kept < different.len() || (states_unpacked(variable) && packed_kept < unpacked_kept);
        if !lost || (unpacked_kept as f64) < MEANT * different.len() as f64 {
            return (values.clone(), masked());
        }
        let (low, high) = (range.start(), range.end());
        let what = format!("valid range of {name} ({low} to {high}) is written in unpacked numbers, not in packed ones: taken as such");
        notes.push(Said::Note(what));
        let kept = |v: f64| if is_value(v) && range.contains(&unpacked(v)) { unpacked(v) } else { f64::NAN };
        (stored.iter().map(|v| kept(*v)).collect(), 0)
    }
}

/// What the reader says, with the way out where there is one.
fn reason(error: &netcdf_reader::Error) -> String {
    let said = error.to_string();
    let way_out = if said.contains("unsupported filter") { "; repack the file with `h5repack -f NONE IN OUT`" } else { "" };
    format!("{said}{way_out}")
}
