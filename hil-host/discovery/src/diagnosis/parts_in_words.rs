//! What moved, what could hide and what it is worth, in words and as JSON.

use super::four_parts::{FourParts, Hidden};
use super::report::{in_words, number};
use crate::model::reported_numbers::Number;
use serde_json::{Value, json};

/// Effects of which no more than this share of a usual size could hide are not listed in words.
const LISTED: f64 = 0.5;
/// Most that one sentence lists.
const MOST_LISTED: usize = 6;
/// Gain of range from which a new table is worth its upload: less is lost in the trim of one dive. A guess.
const WORTH_AN_UPLOAD: f64 = 0.005;

/// Tolerances of the file by which a number moved.
fn tolerances(n: &Number) -> f64 {
    n.tolerance.map_or(f64::NAN, |[file, _]| (n.value[1] - n.value[0]) / file)
}

fn moved(n: &Number) -> String {
    let [file, here] = both(n);
    format!("{} from {file} to {here}, {:+.1} tolerances of the file", n.name, tolerances(n))
}

/// Value of the file, and of this flight with its interval.
fn both(n: &Number) -> [String; 2] {
    let (low, high) = n.interval().unwrap_or((f64::NAN, f64::NAN));
    [plain(n.value[0], n.unit), in_words(n.value[1], low, high, n.unit)]
}

/// A value of a vehicle file with three digits, angles in degrees.
fn plain(value: f64, unit: &str) -> String {
    let (value, unit) = if unit == "rad" { (value.to_degrees(), " deg") } else { (value, "") };
    let digits = if value == 0.0 { 0.0 } else { (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) };
    if value != 0.0 && value.abs() < 1e-4 { format!("{value:.2e}{unit}") } else { format!("{value:.*}{unit}", digits as usize) }
}

fn hides(h: &Hidden) -> String {
    format!("{} {}", h.effect.replace('_', " "), h.size_in_words())
}

impl Hidden {
    /// How much of it could hide.
    #[must_use]
    pub fn size_in_words(&self) -> String {
        let unit = if self.unit == "1" || self.unit == "rad" { "" } else { self.unit };
        if self.least.is_finite() {
            format!("up to {} {unit}", plain(self.least, self.unit)).trim_end().to_owned()
        } else {
            "of any size".into()
        }
    }
}

/// A list with an end.
fn listed(all: &[String]) -> String {
    let more = all.len().saturating_sub(MOST_LISTED);
    let shown = all[..all.len().min(MOST_LISTED)].join("; ");
    if more > 0 { format!("{shown}; and {more} more") } else { shown }
}

impl FourParts {
    /// What moved of each number that has an interval: its value and 90 % interval in tolerances of the file from the file's value, and
    /// both values in words.
    pub fn moved_in_tolerances(&self) -> impl Iterator<Item = (&'static str, [f64; 3], String)> + '_ {
        self.moved.iter().filter_map(|n| {
            let ([file, _], (low, high)) = (n.tolerance?, n.interval()?);
            let [given, here] = both(n);
            (file > 0.0).then(|| (n.name, [n.value[1], low, high].map(|v| (v - n.value[0]) / file), format!("file {given}, here {here}")))
        })
    }

    /// Which numbers of the file are outside this flight's interval.
    #[must_use]
    pub fn moved_in_words(&self) -> String {
        let all: Vec<String> = self.changed().map(moved).collect();
        if all.is_empty() { "no number of the file is outside this flight's 90 % interval".into() } else { listed(&all) }
    }

    /// What could hide.
    #[must_use]
    pub fn hidden_in_words(&self) -> String {
        let all: Vec<String> = self.hidden.iter().filter(|h| h.least > LISTED * h.typical).map(hides).collect();
        if all.is_empty() { "no effect of the catalogue of half its usual size".into() } else { listed(&all) }
    }

    /// What the refitted polar is worth, and how to fly by it.
    #[must_use]
    pub fn worth_in_words(&self) -> String {
        let w = match self.worth {
            Ok(w) => w,
            Err(why) => return format!("not known: {why}"),
        };
        let [gain, low, high] = [w.gain, w.low, w.high].map(|v| 100.0 * v);
        let gain = format!(
            "held at the best pitch of the refitted polar, the vehicle glides {gain:.1} % farther in still water than held at the file's (90 %: {low:.1} to {high:.1})"
        );
        if w.high < WORTH_AN_UPLOAD {
            return format!("{gain}: the table flown is as good");
        }
        // In the default world the table of another vehicle loses range.
        format!(
            "{gain}. A mission gains more or less than that, for the law changes its pitch by what it measures: `glider calibrate` or `glider add` with --out learnt.json writes the vehicle, `glider fly --mission sea --world learnt.json --table learnt.json --beside` with the old vehicle file flies both tables in its world"
        )
    }

    /// As JSON: `moved`, `could_hide`, `worth`.
    #[must_use]
    pub fn document(&self) -> Value {
        let of_number = |n: &Number| {
            let (low, high) = n.interval().unwrap_or((f64::NAN, f64::NAN));
            json!({"name": n.name, "unit": n.unit, "file": number(n.value[0]), "here": number(n.value[1]), "low": number(low), "high": number(high),
                "tolerances": number(tolerances(n))})
        };
        json!({
            "moved": self.moved.iter().map(of_number).collect::<Vec<_>>(),
            "could_hide": self.hidden.iter().map(|h| json!({"effect": h.effect, "parameter": h.parameter, "unit": h.unit, "up_to": number(h.least),
                "usual_size": number(h.typical)})).collect::<Vec<_>>(),
            "worth": self.worth.ok().map(|w| json!({"range_gain": number(w.gain), "low": number(w.low), "high": number(w.high)})),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::numbers::{ALL, PITCH_OFFSET};

    #[test]
    fn regress_what_could_hide_of_an_angle_is_in_degrees() {
        let hidden = |unit, least| Hidden { effect: ALL[PITCH_OFFSET].effect, parameter: "offset", unit, least, typical: 0.03 };
        assert_eq!(hides(&hidden("rad", 0.087_266)), "pitch offset up to 5.00 deg");
        assert_eq!(hides(&hidden("cm^3", 12.34)), "pitch offset up to 12.3 cm^3");
        assert_eq!(hides(&hidden("1", 0.5)), "pitch offset up to 0.500");
        assert_eq!(hides(&hidden("1", f64::INFINITY)), "pitch offset of any size");
    }
}
