//! The file that a shard of a campaign leaves, and the text of a report.

use logs::record::bounded;
use std::collections::HashMap;
use std::path::Path;

use anyhow::{Context as _, bail, ensure};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::shards::kept::{Kept, program};
use crate::shards::shard::Shard;
use crate::shards::work::Done;

/// Results of a shard: which campaign they are of, and each under its key.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Command that makes it, as `faults`.
    pub command: String,
    /// Options that the plan depends on.
    pub plan: Value,
    /// Which shard.
    pub shard: Shard,
    /// Hash of the program that made it.
    pub program: String,
    /// Kept bytes under their keys.
    pub results: HashMap<String, Vec<u8>>,
}

impl Part {
    /// Of what this program did.
    ///
    /// # Errors
    /// The program's file cannot be read.
    pub fn new<'a, T: 'a>(command: &str, plan: &Value, shard: Shard, done: impl Iterator<Item = &'a Done<T>>) -> anyhow::Result<Self> {
        let results = done.map(|d| (d.key.clone(), d.bytes.clone())).collect();
        Ok(Self { command: command.to_owned(), plan: plan.clone(), shard, program: program()?, results })
    }

    /// As text: equal parts give equal text. `about` is for people.
    #[must_use]
    pub fn text(&self, about: &Value) -> String {
        let mut results: Vec<(&String, &Vec<u8>)> = self.results.iter().collect();
        results.sort();
        let results: serde_json::Map<String, Value> = results.into_iter().map(|(k, v)| (k.clone(), STANDARD.encode(v).into())).collect();
        let document = json!({
            "part_of": self.command, "shard": self.shard.to_string(), "plan": self.plan, "program": self.program, "about": about,
            "results": results,
        });
        format!("{document:#}\n")
    }

    /// Reads one.
    ///
    /// # Errors
    /// No such file, or none that a shard left.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        let text = bounded::text(path, bounded::LOG).with_context(|| format!("{name}: cannot be read"))?;
        let document: Value = serde_json::from_str(&text)
            .map_err(|e| anyhow::anyhow!("{name}: line {}, column {}: is no JSON, and no part of a campaign", e.line(), e.column()))?;
        let word = |key: &str| document[key].as_str().map(str::to_owned);
        let whole = || -> Option<Self> {
            let results = document["results"].as_object()?.iter();
            Some(Self {
                command: word("part_of")?,
                plan: document.get("plan")?.clone(),
                shard: word("shard")?.parse().ok()?,
                program: word("program")?,
                results: results.map(|(k, v)| Some((k.clone(), STANDARD.decode(v.as_str()?).ok()?))).collect::<Option<_>>()?,
            })
        };
        whole().with_context(|| format!("{name}: is no part of a campaign; a run with --shard I/N --out FILE leaves one"))
    }
}

/// Parts of one campaign put together.
#[derive(Debug)]
pub struct Merged {
    /// Command that made them.
    pub command: String,
    /// Options of the plan.
    pub plan: Value,
    /// Number of shards that the first part is one of.
    pub of: usize,
    /// The results.
    pub kept: Kept,
}

/// Reads parts.
///
/// # Errors
/// A file that is no part; parts of two campaigns, or made by another program.
pub fn merged(paths: &[impl AsRef<Path>], commands: &[&str]) -> anyhow::Result<Merged> {
    let mut first: Option<Part> = None;
    let mut results = HashMap::new();
    for path in paths {
        let name = path.as_ref().display();
        let mut part = Part::read(path.as_ref())?;
        let command = &part.command;
        ensure!(commands.contains(&command.as_str()), "{name}: is a part of glider {command}; merge it there");
        ensure!(
            part.program == program()?,
            "{name}: was made by another build of glider (program {}…); make it anew with this one, or merge with that one",
            part.program.get(..8).unwrap_or_default()
        );
        results.extend(std::mem::take(&mut part.results));
        match &first {
            None => first = Some(part),
            Some(first) if (&first.command, &first.plan) == (&part.command, &part.plan) => {}
            Some(first) => {
                bail!("{name}: is a part of another campaign ({}) than {} ({})", part.plan, paths[0].as_ref().display(), first.plan)
            }
        }
    }
    let Part { command, plan, shard, .. } = first.context("no part to merge")?;
    Ok(Merged { command, plan, of: shard.of, kept: Kept::Merged(results) })
}

/// Whether a key of a document is a time that it took: another one each time, and no part of a result.
fn is_duration(key: &str) -> bool {
    key.starts_with("wall_s") || key.starts_with("cpu_s")
}

/// The document without the times that it took.
#[must_use]
pub fn without_durations(document: &Value) -> Value {
    match document {
        Value::Object(map) => map.iter().filter(|(k, _)| !is_duration(k)).map(|(k, v)| (k.clone(), without_durations(v))).collect(),
        Value::Array(list) => list.iter().map(without_durations).collect(),
        other => other.clone(),
    }
}

/// A report as it is filed, without the times that it took: the same text, and so the same SHA-256, for any number of shards, in any
/// order, with or without breaks.
#[must_use]
pub fn report(document: &Value) -> String {
    format!("{:#}\n", without_durations(document))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(number: usize, plan: u64) -> Part {
        let results = HashMap::from([(format!("key{number}"), vec![number as u8, 255])]);
        let shard = Shard { number, of: 2 };
        Part { command: "faults".into(), plan: json!({ "seed": plan }), shard, program: program().expect("a program"), results }
    }

    #[test]
    fn parts_come_back_and_only_those_of_one_campaign_and_program_merge() {
        let folder = std::env::temp_dir().join(format!("glider-parts-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let put = |name: &str, part: &Part| {
            let path = folder.join(name);
            std::fs::write(&path, part.text(&json!({}))).expect("written");
            path
        };
        let (one, two) = (put("one.json", &part(1, 7)), put("two.json", &part(2, 7)));
        assert_eq!(Part::read(&one).expect("a part"), part(1, 7));
        let both = merged(&[&two, &one], &["faults"]).expect("merged");
        let Kept::Merged(results) = both.kept else { panic!("no results") };
        assert_eq!((results.len(), both.of, both.plan), (2, 2, json!({ "seed": 7 })));
        let said = |paths: &[&std::path::PathBuf], commands: &[&str]| format!("{:#}", merged(paths, commands).expect_err("refused"));
        assert!(said(&[&one], &["scorecard"]).contains("is a part of glider faults"));
        let other = put("other.json", &part(2, 8));
        assert!(said(&[&one, &other], &["faults"]).contains("other.json: is a part of another campaign"));
        let old = put("old.json", &Part { program: "0123456789".into(), ..part(2, 7) });
        assert!(said(&[&one, &old], &["faults"]).contains("another build of glider (program 01234567…)"));
        std::fs::write(&old, "{\"part_of\": \"faults\"}").expect("written");
        assert!(said(&[&old], &["faults"]).contains("is no part"));
        std::fs::write(&old, "{\n  x").expect("written");
        assert!(said(&[&old], &["faults"]).contains("line 2, column 3"));
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn a_report_does_not_change_with_the_time_it_took() {
        let of = |wall: f64, safe: u64| {
            report(&json!({ "summary": { "safe": safe, "wall_s": wall }, "list": [{ "cpu_s": { "median": wall } }] }))
        };
        assert!(of(1.0, 3) == of(2.0, 3) && of(1.0, 3) != of(1.0, 4));
    }
}
