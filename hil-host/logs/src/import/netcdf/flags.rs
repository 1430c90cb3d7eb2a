//! Quality flags of a NetCDF file: which values they say are bad or missing.

use netcdf_reader::{NcType, NcVariable};

use super::super::raw_log::Flag;
use super::{Reader, numbers_of};

/// Flags that say "bad" and "missing" where the file does not say what its flags mean: OG1, Argo, Seaglider and QARTOD alike.
pub(in crate::import) const BAD: [f64; 2] = [4.0, 9.0];

/// Which flags are bad: a number, or bits under a mask that are a number.
enum Scheme {
    Values(Vec<f64>),
    Bits(Vec<(u64, u64)>),
}

impl Scheme {
    fn is_bad(&self, flag: f64) -> bool {
        match self {
            Self::Values(bad) => bad.contains(&digit_of_code(flag)),
            Self::Bits(bad) => flag >= 0.0 && flag.fract() == 0.0 && bad.iter().any(|(mask, value)| (flag as u64) & mask == *value),
        }
    }

    fn says(&self) -> String {
        match self {
            Self::Values(bad) => bad.iter().map(f64::to_string).collect::<Vec<_>>().join(" or "),
            Self::Bits(bad) => format!("bits {}", bad.iter().map(|(_, value)| value.to_string()).collect::<Vec<_>>().join(" or ")),
        }
    }
}

/// Tests of QARTOD, Argo and OOI whose failure is that of a value; those of the sea it is in (climatology, a neighbour) only make it suspect.
const TESTS: [&str; 12] = [
    "spike",
    "range",
    "gradient",
    "stuck",
    "flat_line",
    "flatline",
    "frozen",
    "rate_of_change",
    "inversion",
    "outlier",
    "impossible",
    "syntax",
];
/// Words of meanings by which a value is not to be used.
const WORDS: [&str; 13] = [
    "bad",
    "fail",
    "missing",
    "invalid",
    "not_pass",
    "reject",
    "unusable",
    "not_usable",
    "do_not_use",
    "erroneous",
    "error",
    "not_good",
    "not_valid",
];
/// Words of meanings by which a value may be used, whatever test they name besides.
const STAYS: [&str; 17] = [
    "correct",
    "probably",
    "possibly",
    "not_",
    "no_",
    "pass",
    "good",
    "valid_range",
    "in_range",
    "within",
    "interpolated",
    "adjusted",
    "changed",
    "suspect",
    "estimated",
    "questionable",
    "replaced",
];

/// Whether a meaning is that of a value which is not to be used, in words or by the test that it did not pass; what may be corrected or is
/// only suspected stays.
pub(in crate::import) fn means_bad(meaning: &str) -> bool {
    let m = meaning.to_ascii_lowercase().replace([' ', '-'], "_");
    let of = |words: &[&str]| words.iter().any(|w| m.contains(w));
    let named = of(&WORDS) && !of(&["correctable", "probably", "not_bad", "not_fail", "no_bad", "no_error", "not_reject", "error_free"]);
    named || (of(&TESTS) && !of(&STAYS))
}

/// Names, in small letters, of what may have its flags in what is called `flag`.
pub(in crate::import) fn flagged_by(flag: &str) -> Vec<String> {
    const ENDS: [&str; 7] =
        ["_qc", "_flag", "_quality_flag", "_primary_flag", "_summary_flag", "_qartod_summary_flag", "_qartod_primary_flag"];
    let flag = flag.to_ascii_lowercase();
    let plain = flag.strip_prefix("qartod_").unwrap_or(&flag);
    ENDS.iter().filter_map(|end| plain.strip_suffix(end)).chain(flag.strip_prefix("qc_")).map(str::to_owned).collect()
}

impl Reader<'_> {
    /// What the flags of a variable of so many rows say.
    pub(super) fn flags_of(&self, name: &str, rows: usize) -> Vec<Flag> {
        let of = |name: String| {
            let flags = self.flags(&name, rows)?;
            let scheme = self.scheme(&name);
            let bad = flags.iter().map(|f| f.is_some_and(|f| scheme.is_bad(f))).collect();
            Some(Flag { says: format!("bad or missing ({})", scheme.says()), name, bad })
        };
        self.flag_variables(name).into_iter().filter_map(of).collect()
    }

    /// Variables that may hold the flags of `name`, the summary of several tests first.
    fn flag_variables(&self, name: &str) -> Vec<String> {
        let Ok(variables) = self.file.variables() else { return Vec::new() };
        let declared = self.text(name, "ancillary_variables").unwrap_or_default();
        let named = |n: &str| {
            let n = n.to_ascii_lowercase();
            n.ends_with("qc") || ["flag", "primary", "summary", "aggregate", "qartod"].iter().any(|w| n.contains(w))
        };
        let is_declared = |n: &str| declared.split([' ', ',']).any(|d| d == n);
        let of_flags = |v: &NcVariable| v.attribute("flag_meanings").is_some() || named(v.name());
        // Which tests were made says nothing of a value, and in OOI's results of bits 1 is "passed".
        let of_runs = |v: &NcVariable| ["executed", "performed", "passed"].iter().any(|w| v.name().to_ascii_lowercase().contains(w));
        let passed = |v: &NcVariable| of_runs(v) || (v.name().ends_with("_qc_results") && v.attribute("flag_masks").is_some());
        let lower = name.to_ascii_lowercase();
        let is_flag = |v: &&NcVariable| ((is_declared(v.name()) && of_flags(v)) || flagged_by(v.name()).contains(&lower)) && !passed(v);
        let mut found: Vec<&str> = variables.iter().filter(is_flag).map(|v| v.name()).collect();
        let is_summary = |n: &str| ["_qc", "primary", "summary", "aggregate"].iter().any(|w| n.to_ascii_lowercase().contains(w));
        found.sort_by_key(|n| !is_summary(n));
        if let (true, Some(raw)) = (found.is_empty(), name.strip_suffix("_ADJUSTED")) {
            return self.flag_variables(raw);
        }
        found.into_iter().map(str::to_owned).collect()
    }

    /// What the flags of a variable mean, by its own attributes.
    fn scheme(&self, flag: &str) -> Scheme {
        let usual = || Scheme::Values(BAD.to_vec());
        let Some(meanings) = self.text(flag, "flag_meanings") else { return usual() };
        let bad: Vec<bool> = meanings.split([' ', ',', '\n', '\t']).filter(|m| !m.is_empty()).map(means_bad).collect();
        let numbers = |attribute: &str| numbers_of(self.file, flag, attribute).filter(|n| n.len() == bad.len());
        let values = numbers("flag_values");
        if let Some(masks) = numbers("flag_masks") {
            // Without values a bit that is set says it (CF conventions 3.5).
            let whole = |n: &f64| if *n > 0.0 { *n as u64 } else { 0 };
            let values = values.as_ref().unwrap_or(&masks);
            let all = masks.iter().zip(values).zip(&bad).filter(|((mask, _), bad)| **bad && whole(mask) > 0);
            return Scheme::Bits(all.map(|((mask, value), _)| (whole(mask), whole(value))).collect());
        }
        let pick = |numbers: Vec<f64>| numbers.into_iter().map(digit_of_code).zip(&bad).filter(|(_, bad)| **bad).map(|(n, _)| n).collect();
        values.map_or_else(usual, |numbers| Scheme::Values(pick(numbers)))
    }

    /// Flags as numbers; they come as integers, as floats and as characters.
    fn flags(&self, name: &str, rows: usize) -> Option<Vec<Option<f64>>> {
        self.room(name).ok()?;
        let variable = self.file.variable(name).ok()?;
        let digit = |c: char| c.to_digit(10).map(f64::from);
        let flags: Vec<Option<f64>> = match variable.dtype() {
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
                numbers.iter().map(|v| v.is_finite().then_some(*v)).collect()
            }
        };
        (flags.len() == rows).then_some(flags)
    }
}

/// 4 of 52: SeaDataNet stores its flags as the codes of the characters 0 to 9.
fn digit_of_code(number: f64) -> f64 {
    if (48.0..58.0).contains(&number) { number - 48.0 } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_meaning_says_which_values_are_not_to_be_used() {
        for bad in ["unusable", "rejected", "error", "not_good", "erroneous_value", "do_not_use"] {
            assert!(means_bad(bad), "{bad}");
        }
        for bad in ["BAD", "fail", "missing_value", "bad_data", "FAILED", "invalid"] {
            assert!(means_bad(bad), "{bad}");
        }
        for test in ["spike", "gradient", "range_test", "GROSS_RANGE", "stuck_value", "density_inversion", "spike_test_not_passed"] {
            assert!(means_bad(test), "{test}");
        }
        for stays in ["no_error", "not_rejected", "usable"] {
            assert!(!means_bad(stays), "{stays}");
        }
        for stays in ["no_bad_data", "interpolated", "spike_corrected", "suspect_gradient", "spike_test_passed", "no_spike", "climatology"]
        {
            assert!(!means_bad(stays), "{stays}");
        }
        for stays in ["good", "SUSPECT", "probably_bad", "bad_data_that_are_potentially_correctable", "not_evaluated", "value_changed"] {
            assert!(!means_bad(stays), "{stays}");
        }
        let bits = Scheme::Bits(vec![(2, 2), (4, 4)]);
        assert!(bits.is_bad(2.0) && bits.is_bad(5.0) && !bits.is_bad(1.0) && !bits.is_bad(f64::NAN) && !bits.is_bad(-1.0));
    }
}
