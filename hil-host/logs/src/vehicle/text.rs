//! The text of a vehicle file, JSON or TOML, as a document: what a reader of the one or the other would pass over in silence is refused
//! with its line.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::Path;

use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use toml::de::{DeTable, DeValue};

use crate::record::bounded;
use crate::record::csv::ReadError;

/// The text of a file, which is to be UTF-8.
///
/// # Errors
/// What the system says, or that it is UTF-16.
pub fn of_file(path: &Path) -> Result<String, ReadError> {
    let bad = |why: String| ReadError::File { path: path.to_path_buf(), why };
    of_bytes(bounded::bytes(path, bounded::DOCUMENT).map_err(|e| bad(e.to_string()))?).map_err(bad)
}

/// The text of the bytes of a file.
///
/// # Errors
/// What else they are, and what to do.
pub fn of_bytes(bytes: Vec<u8>) -> Result<String, String> {
    // Without its mark, every other byte of plain letters is 0.
    let utf16 = matches!(bytes.as_slice(), [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [0, _, 0, _, ..] | [_, 0, _, 0, ..]);
    if utf16 {
        return Err("is UTF-16: save it as UTF-8".into());
    }
    String::from_utf8(bytes).map_err(|e| {
        let line = 1 + e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        format!("line {line} is not UTF-8: save it as UTF-8")
    })
}

/// The document of a text: TOML where `path`, which messages name, ends in `.toml`, else JSON.
pub(super) fn document(text: &str, path: &Path) -> Result<Value, ReadError> {
    let bad = |line: usize, column: &str, why: String| ReadError::Content {
        path: path.to_path_buf(),
        line: line as u64,
        column: column.into(),
        why,
    };
    if path.extension().is_some_and(|e| e == "toml") {
        let line = |start: usize| 1 + text.as_bytes()[..start].iter().filter(|b| **b == b'\n').count();
        let refused = |e: toml::de::Error| {
            let (line, column) = e.span().map_or((0, 0), |s| (line(s.start), column_of(text, s.start)));
            bad(line, &column.to_string(), e.message().to_string())
        };
        if let Some((key, start, number)) = not_finite(DeTable::parse(text).map_err(refused)?.get_ref(), "") {
            return Err(bad(line(start), &key, format!("is {number}, which is not finite; expected a number, or no such key")));
        }
        return toml::from_str::<Value>(text).map_err(refused);
    }
    let twice = RefCell::new(None);
    let seen = Unique { twice: &twice, key: String::new() }.deserialize(&mut serde_json::Deserializer::from_str(text));
    match (seen, twice.take()) {
        (Err(e), Some(key)) => Err(bad(e.line(), &key, "stands here a second time: which one is meant? Take the other out".into())),
        _ => serde_json::from_str(text).map_err(|e| {
            let (what, place) = (e.to_string(), format!(" at line {} column {}", e.line(), e.column()));
            bad(e.line(), &e.column().to_string(), what.trim_end_matches(&place).to_owned())
        }),
    }
}

/// Column of a place in a text, the first is 1.
pub(super) fn column_of(text: &str, at: usize) -> usize {
    1 + text.get(..at).unwrap_or(text).chars().rev().take_while(|c| *c != '\n').count()
}

pub(super) fn below(prefix: &str, name: &str) -> String {
    if prefix.is_empty() { name.to_owned() } else { format!("{prefix}.{name}") }
}

/// The first number that is `nan` or `inf`, by its key, with the place of the key and what is written there.
fn not_finite(table: &DeTable<'_>, prefix: &str) -> Option<(String, usize, String)> {
    table.iter().find_map(|(name, value)| of_value(value.get_ref(), &below(prefix, name.get_ref()), name.span().start))
}

fn of_value(value: &DeValue<'_>, key: &str, start: usize) -> Option<(String, usize, String)> {
    match value {
        DeValue::Table(inside) => not_finite(inside, key),
        DeValue::Array(all) => all.iter().find_map(|v| of_value(v.get_ref(), key, v.span().start)),
        DeValue::Float(x) => {
            let is_finite = x.as_str().replace('_', "").parse::<f64>().is_ok_and(f64::is_finite);
            (!is_finite).then(|| (key.to_owned(), start, x.as_str().to_owned()))
        }
        _ => None,
    }
}

/// A JSON value in which no key stands twice in one table; where one does, `twice` has it.
struct Unique<'a> {
    twice: &'a RefCell<Option<String>>,
    key: String,
}

impl<'de> DeserializeSeed<'de> for Unique<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        from.deserialize_any(self)
    }
}

/// What is no table and no list has no keys.
macro_rules! of_no_table {
    ($($visit:ident: $value:ty),*) => { $(fn $visit<E>(self, _: $value) -> Result<(), E> { Ok(()) })* };
}

impl<'de> Visitor<'de> for Unique<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a value")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut from: A) -> Result<(), A::Error> {
        let mut names = BTreeSet::new();
        while let Some(name) = from.next_key::<String>()? {
            let key = below(&self.key, &name);
            if !names.insert(name) {
                *self.twice.borrow_mut() = Some(key);
                return Err(A::Error::custom("a key stands twice"));
            }
            from.next_value_seed(Unique { twice: self.twice, key })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<(), A::Error> {
        while from.next_element_seed(Unique { twice: self.twice, key: self.key.clone() })?.is_some() {}
        Ok(())
    }

    of_no_table!(visit_str: &str, visit_bool: bool, visit_i64: i64, visit_u64: u64, visit_f64: f64);

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}

/// The error with the line of its key, or of the table that lacks it.
pub(super) fn located(error: ReadError, text: &str) -> ReadError {
    let ReadError::Content { path, line: 0, column, why } = error else { return error };
    ReadError::Content { line: line_of(text, &column), path, column, why }
}

/// Line of a dotted key in TOML or JSON: each part is looked for below the one before; 0 if not even the first is there.
fn line_of(text: &str, key: &str) -> u64 {
    let lines: Vec<&str> = text.lines().map(|l| l.split('#').next().unwrap_or_default()).collect();
    // A key stands alone, quoted, or as the last part of a table's head.
    let names = |line: &str, part: &str| {
        line.match_indices(part).any(|(start, _)| {
            let end = start + part.len();
            let edge = |c: Option<char>| c.is_none_or(|c| !(c.is_alphanumeric() || c == '_'));
            let after = line[end..].trim_start_matches(['"', '\'', ' ', '\t']);
            edge(line[..start].chars().next_back()) && edge(line[end..].chars().next()) && after.starts_with(['=', ':', ']', '.'])
        })
    };
    let mut found = 0;
    for part in key.split('.') {
        let from = if found > 0 { found - 1 } else { 0 };
        match (from..lines.len()).find(|&i| names(lines[i], part)) {
            Some(i) => found = i + 1,
            None => break,
        }
    }
    found as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_an_empty_key_has_a_line_too() {
        let text = "{\n \"effects\": {\n  \"\": {\"k\": 1}\n }\n}";
        // It looked for the empty name without end.
        assert!((2..=3).contains(&line_of(text, "effects.")) && line_of(text, "") > 0);
        assert_eq!(line_of(text, "effects"), 2);
        assert_eq!(line_of("a = 1\nhydro.cd0 = 2\n[x]\ncd0 = 3", "hydro.cd0"), 2);
    }
}
