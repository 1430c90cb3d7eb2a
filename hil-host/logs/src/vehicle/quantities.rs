//! TOML in which every number has a unit, an uncertainty and a source; nothing is assumed, and nothing unknown is passed over.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::IntoDeserializer as _;
use strsim::levenshtein;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::record::csv::ReadError;
use crate::vehicle::text::{below, column_of};

/// One number as the file gives it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// Dotted key.
    #[serde(skip)]
    pub key: String,
    /// Value in `unit`.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// 1-sigma uncertainty in `unit`.
    pub sigma: f64,
    /// Where it comes from.
    pub source: String,
    /// Line in the file.
    #[serde(skip)]
    pub line: u64,
}

enum Entry {
    Number(Quantity),
    Text(String),
}

pub(super) struct Document {
    path: PathBuf,
    entries: BTreeMap<String, (u64, Entry)>,
    taken: Vec<String>,
}

fn line_of(text: &str, at: usize) -> u64 {
    1 + text.as_bytes().iter().take(at).filter(|b| **b == b'\n').count() as u64
}

impl Document {
    pub(super) fn bad(&self, line: u64, key: &str, why: String) -> ReadError {
        ReadError::Content { path: self.path.clone(), line, column: key.into(), why }
    }

    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, ReadError> {
        let mut doc = Self { path: path.to_path_buf(), entries: BTreeMap::new(), taken: Vec::new() };
        let root = DeTable::parse(text).map_err(|e| {
            let (line, column) = e.span().map_or((0, 0), |s| (line_of(text, s.start), column_of(text, s.start)));
            doc.bad(line, &column.to_string(), e.message().to_string())
        })?;
        doc.walk(text, "", root.into_inner())?;
        Ok(doc)
    }

    fn walk(&mut self, text: &str, prefix: &str, table: DeTable<'_>) -> Result<(), ReadError> {
        for (name, value) in table {
            let key = below(prefix, name.get_ref());
            let line = line_of(text, name.span().start);
            let is_number = value.get_ref().as_table().map(|t| t.contains_key("value"));
            let entry = match (is_number, value.get_ref()) {
                (Some(true), _) => Entry::Number(self.quantity(&key, line, value)?),
                (_, DeValue::String(s)) => Entry::Text(s.to_string()),
                _ => match value.into_inner() {
                    DeValue::Table(inside) => {
                        self.walk(text, &key, inside)?;
                        continue;
                    }
                    _ => return Err(self.bad(
                        line,
                        &key,
                        "a bare number has no unit, uncertainty and source; write { value = …, unit = \"…\", sigma = …, source = \"…\" }"
                            .into(),
                    )),
                },
            };
            self.entries.insert(key, (line, entry));
        }
        Ok(())
    }

    fn quantity(&self, key: &str, line: u64, table: Spanned<DeValue<'_>>) -> Result<Quantity, ReadError> {
        let bad = |why: String| self.bad(line, key, why);
        let stated = Quantity::deserialize(table.into_deserializer());
        let stated = stated.map_err(|e| bad(format!("{}; a number has value, unit, sigma, source", e.message())))?;
        if !(stated.value.is_finite() && stated.sigma.is_finite()) {
            return Err(bad(format!("value is {}, sigma {}: a number is finite", stated.value, stated.sigma)));
        }
        if stated.sigma < 0.0 {
            return Err(bad(format!("sigma is {}; expected 0 or more", stated.sigma)));
        }
        if stated.source.trim().is_empty() {
            return Err(bad("source is empty; name paper, file or measurement, or say \"guess\"".into()));
        }
        Ok(Quantity { key: key.into(), line, ..stated })
    }

    pub(super) fn has(&self, prefix: &str) -> bool {
        self.entries.keys().any(|k| k.starts_with(prefix))
    }

    pub(super) fn number(&mut self, key: &str, unit: &str, low: f64, high: f64) -> Result<f64, ReadError> {
        self.taken.push(key.into());
        match self.entries.get(key) {
            None => Err(self.bad(0, key, format!("is missing; expected a number in {unit}, {low} to {high}"))),
            Some((line, Entry::Text(t))) => Err(self.bad(*line, key, format!("is the text `{t}`; expected a number in {unit}"))),
            Some((line, Entry::Number(q))) => {
                if q.unit != unit {
                    return Err(self.bad(*line, key, format!("has unit `{}`; expected `{unit}` (files are SI)", q.unit)));
                }
                if !(low..=high).contains(&q.value) {
                    return Err(self.bad(*line, key, format!("is {} {unit}; physical is {low} to {high}", q.value)));
                }
                Ok(q.value)
            }
        }
    }

    pub(super) fn text(&mut self, key: &str) -> Result<(u64, String), ReadError> {
        self.taken.push(key.into());
        match self.entries.get(key) {
            None => Err(self.bad(0, key, "is missing; expected a text".into())),
            Some((line, Entry::Number(_))) => Err(self.bad(*line, key, "is a number; expected a text".into())),
            Some((line, Entry::Text(t))) => Ok((*line, t.clone())),
        }
    }

    pub(super) fn choice<T: Copy>(&mut self, key: &str, choices: &[(&str, T)]) -> Result<T, ReadError> {
        let (line, t) = self.text(key)?;
        choices.iter().find(|c| c.0 == t).map(|c| c.1).ok_or_else(|| {
            let all: Vec<&str> = choices.iter().map(|c| c.0).collect();
            self.bad(line, key, format!("is `{t}`; expected one of {}", all.join(", ")))
        })
    }

    /// Line of an entry; 0 if there is none.
    pub(super) fn line(&self, key: &str) -> u64 {
        self.entries.get(key).map_or(0, |e| e.0)
    }

    /// Every entry must have been asked for by now.
    pub(super) fn finish(self) -> Result<Vec<Quantity>, ReadError> {
        for (key, (line, _)) in &self.entries {
            if !self.taken.contains(key) {
                let near = self.taken.iter().filter(|k| !self.entries.contains_key(*k)).min_by_key(|k| levenshtein(k, key));
                let hint = near.filter(|k| levenshtein(k, key) <= 4).map_or(String::new(), |k| format!("; did you mean `{k}`?"));
                return Err(self.bad(*line, key, format!("unknown key{hint}")));
            }
        }
        let mut all: Vec<Quantity> =
            self.entries.into_values().filter_map(|(_, e)| if let Entry::Number(q) = e { Some(q) } else { None }).collect();
        all.sort_by_key(|q| q.line);
        Ok(all)
    }

    /// An unknown key is the likelier cause of a missing one: say so first.
    pub(super) fn misspelt(&self, missing: ReadError) -> ReadError {
        let ReadError::Content { line: 0, column: wanted, .. } = &missing else { return missing };
        match self.entries.iter().filter(|(k, _)| levenshtein(k, wanted) <= 4).min_by_key(|(k, _)| levenshtein(k, wanted)) {
            Some((key, (line, _))) if !self.taken.contains(key) => self.bad(*line, key, format!("unknown key; did you mean `{wanted}`?")),
            _ => missing,
        }
    }
}
