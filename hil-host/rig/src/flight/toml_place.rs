//! Where in a TOML file something is wrong, in one line: file, line, column, what, and the name that was probably meant.

use crate::spelling::meant;
use anyhow::anyhow;

/// What is wrong at a byte of a text.
#[must_use]
pub fn wrong(text: &str, name: &str, start: usize, what: &str) -> anyhow::Error {
    let before = text.get(..start).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    anyhow!("{name}:{line}:{column}: {what}")
}

/// What the TOML reader found wrong.
#[must_use]
pub fn refused(text: &str, name: &str, e: &toml::de::Error) -> anyhow::Error {
    let what = e.message().lines().collect::<Vec<_>>().join(", ").replace("i64", "a whole number").replace("f64", "a number");
    wrong(text, name, e.span().map_or(0, |s| s.start), &suggested(&what))
}

/// Names that are listed whole; more than these only drown the one that was meant.
const LISTED: usize = 12;

/// An unknown name with the one that was probably meant: the reader says "unknown field `a`, expected one of `b`, `c`".
fn suggested(what: &str) -> String {
    let names: Vec<&str> = what.split('`').skip(1).step_by(2).collect();
    let [unknown, known @ ..] = names.as_slice() else { return what.to_owned() };
    if !what.starts_with("unknown ") {
        return what.to_owned();
    }
    let meant = meant(unknown, known.iter().copied());
    match what.split_once(", expected") {
        Some((first, _)) if known.len() > LISTED && !meant.is_empty() => format!("{first}{meant}"),
        _ => format!("{what}{meant}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_placed_and_answered_with_what_was_meant() {
        #[derive(serde::Deserialize, Debug)]
        #[serde(deny_unknown_fields)]
        #[allow(dead_code, reason = "read by the test of its names alone")]
        struct File {
            depth_max_m: Option<f64>,
            dives: Option<i64>,
        }
        let said = |text: &str| refused(text, "m.toml", &toml::from_str::<File>(text).expect_err("refused")).to_string();
        let slip = said("dives = 2\ndepht_max_m = 3\n");
        assert!(slip.starts_with("m.toml:2:1: unknown field `depht_max_m`") && slip.ends_with("did you mean `depth_max_m`?"), "{slip}");
        assert!(said("dives = 1.5\n").starts_with("m.toml:1:9: ") && said("dives = 1.5\n").contains("a whole number"));
        let many: Vec<String> = (0..30).map(|k| format!("`effect_number_{k}`")).collect();
        let short = suggested(&format!("unknown variant `efect_number_7`, expected one of {}", many.join(", ")));
        assert_eq!(short, "unknown variant `efect_number_7`; did you mean `effect_number_7`?");
    }
}
