//! Keys of a vehicle file that are nobody's own remark but a slip in one that is read: refused, so that no number is passed over.

use std::collections::BTreeSet;

use serde_json::{Map, Value};

use strsim::levenshtein;

/// The key of a document that is a slip in another one: of a key that was asked for, and that the document does not state.
pub(super) fn find(document: &Value, asked: &BTreeSet<String>) -> Option<(String, String)> {
    in_table(document.as_object()?, "", asked)
}

fn in_table(table: &Map<String, Value>, prefix: &str, asked: &BTreeSet<String>) -> Option<(String, String)> {
    // Names below the prefix, and whether they are of tables.
    let known: BTreeSet<(&str, bool)> =
        asked.iter().filter_map(|key| key.strip_prefix(prefix)).map(|k| k.split_once('.').map_or((k, false), |(t, _)| (t, true))).collect();
    table.iter().find_map(|(name, value)| {
        let of_name = || known.iter().filter(|k| k.0 == name);
        if of_name().next().is_some() {
            let inside = value.as_object().filter(|_| of_name().any(|k| k.1))?;
            return in_table(inside, &format!("{prefix}{name}."), asked);
        }
        let open = known.iter().filter(|k| !table.contains_key(k.0));
        let near = open.filter(|k| is_slip(name, k.0) || k.1 && value.is_object() && is_head(name, k.0));
        let meant = near.min_by_key(|k| levenshtein(name, k.0))?.0;
        Some((format!("{prefix}{name}"), format!("{prefix}{meant}")))
    })
}

/// Keys that are read in another table only, each with where: a line behind the last table of a TOML belongs to that table.
pub(super) fn misplaced(document: &Value, asked: &BTreeSet<String>) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut tables: Vec<(String, &Value)> = vec![(String::new(), document)];
    while let Some((prefix, table)) = tables.pop() {
        for (name, value) in table.as_object().into_iter().flatten() {
            let key = format!("{prefix}{name}");
            let inside = format!("{key}.");
            if asked.iter().any(|a| a.starts_with(&inside)) {
                tables.push((inside, value));
            } else if !asked.contains(&key)
                && let Some(meant) = asked.iter().find(|a| a.rsplit('.').next() == Some(name))
            {
                found.push((key, meant.clone()));
            }
        }
    }
    found.sort();
    found
}

/// Units in which somebody may state a number that is read in another one; those of two parts first.
const UNITS: [&str; 32] = [
    "m_s2", "m_s", "cm_s", "kg_m3", "m", "cm", "mm", "km", "m2", "m3", "cm3", "cc", "ml", "l", "kg", "g", "lb", "rad", "deg", "degrees",
    "degc", "k", "dbar", "bar", "pa", "psi", "s", "min", "h", "percent", "relative", "1sigma",
];

/// Whether a name is another one with a slip of the finger, or with another unit or none.
fn is_slip(name: &str, known: &str) -> bool {
    let name = name.to_lowercase().replace('-', "_");
    let known = known.to_lowercase();
    // A word of four letters is soon another word, but for two of them that changed places.
    let slips = if known.len().min(name.len()) < 5 { 1 } else { 2 };
    let letters = |word: &str| {
        let mut all: Vec<char> = word.chars().collect();
        all.sort_unstable();
        all
    };
    if levenshtein(&name, &known) <= slips || letters(&name) == letters(&known) {
        return true;
    }
    let stem = |key: &str| UNITS.iter().find_map(|unit| Some(key.strip_suffix(unit)?.strip_suffix('_')?.to_owned()));
    stem(&known).is_some_and(|s| s == name || stem(&name) == Some(s))
}

/// Whether a name is the head of a longer one: `tolerances` of `tolerance_1sigma`.
fn is_head(name: &str, known: &str) -> bool {
    let head = name.trim_end_matches('s');
    head.len() > 7 && known.starts_with(head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn regress_keys_in_another_table_are_found() {
        let asked: BTreeSet<String> =
            ["mass_kg", "hydro.cd0", "hydro.wide.cd0", "sensors.pitch_noise_rad", "segments.fit"].map(str::to_owned).into();
        for (document, wrong, meant) in [
            (json!({"mass_kg": 60, "segments": {"mass_kg": 80}}), "segments.mass_kg", "mass_kg"),
            (json!({"hydro": {"fit": [1]}}), "hydro.fit", "segments.fit"),
            (json!({"pitch_noise_rad": 0.1}), "pitch_noise_rad", "sensors.pitch_noise_rad"),
        ] {
            assert_eq!(misplaced(&document, &asked), [(wrong.to_owned(), meant.to_owned())], "{document}");
        }
        let own = json!({"mass_kg": 60, "provenance": {"mass_kg": 1}, "hydro": {"cd0": 0.1, "colour": 1, "wide": {"cd0": 0.1}}});
        assert!(misplaced(&own, &asked).is_empty());
    }

    #[test]
    fn slips_are_found_at_every_level_and_own_keys_stay() {
        let asked: BTreeSet<String> =
            ["mass_kg", "hydro.cd0", "hydro.wide.cd0", "sensors.pitch_noise_rad", "tolerance_1sigma.cd0_relative", "segments.fit"]
                .map(str::to_owned)
                .into();
        for (document, wrong, meant) in [
            (json!({"mass_kgs": 1}), "mass_kgs", "mass_kg"),
            (json!({"mass_lb": 1}), "mass_lb", "mass_kg"),
            (json!({"mass": 1}), "mass", "mass_kg"),
            (json!({"Hydro": {}}), "Hydro", "hydro"),
            (json!({"hydro": {"CD0": 1}}), "hydro.CD0", "hydro.cd0"),
            (json!({"hydro": {"wide": {"cd_0": 1}}}), "hydro.wide.cd_0", "hydro.wide.cd0"),
            (json!({"hydro": {"wied": {}}}), "hydro.wied", "hydro.wide"),
            (json!({"sensor": {}}), "sensor", "sensors"),
            (json!({"sensors": {"pitch_noise_deg": 1}}), "sensors.pitch_noise_deg", "sensors.pitch_noise_rad"),
            (json!({"sensors": {"pitch-noise-rad": 1}}), "sensors.pitch-noise-rad", "sensors.pitch_noise_rad"),
            (json!({"tolerances": {}}), "tolerances", "tolerance_1sigma"),
            (json!({"tolerance_1sigma": {"cdo_relative": 1}}), "tolerance_1sigma.cdo_relative", "tolerance_1sigma.cd0_relative"),
            (json!({"segments": {"fits": 1}}), "segments.fits", "segments.fit"),
        ] {
            assert_eq!(find(&document, &asked), Some((wrong.to_owned(), meant.to_owned())), "{document}");
        }
        for document in [
            json!({"colour": "yellow", "hull": {"length_m": 1.8}, "reference": "own report"}),
            json!({"mass_kg": 60, "mass_lb": 132}),
            json!({"sensors": {"roll_noise_rad": 1, "sample_period_s": 1}, "hydro": {"cd0": 1, "cd1": 1}, "provenance": {"mass": 1}}),
        ] {
            assert_eq!(find(&document, &asked), None, "{document}");
        }
    }
}
