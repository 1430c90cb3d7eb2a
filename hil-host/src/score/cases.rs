//! A folder of sealed cases that somebody else made from the flight format alone: `DIR/name/flight.csv` and `vehicle.json`, the truth
//! apart in `DIR/truth/name.json` with `kind` (clean, single, pair, off), `strength` and `effects` (each with a `name`).

use logs::record::bounded;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::diagnosis::LARGEST_CLASS;
use super::real::ask::{Asked, Program, diagnose};

/// A case on disk.
#[derive(Clone, Debug)]
pub struct Sealed {
    /// Folder of the flight.
    pub flight: PathBuf,
    /// Truth.
    pub truth: Value,
}

/// The cases of a folder, by name.
///
/// # Errors
/// A folder without cases, or a case without its truth.
pub fn read(folder: &Path) -> anyhow::Result<Vec<Sealed>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{}: cannot be read", folder.display()))?;
    let mut flights: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.join("flight.csv").is_file()).collect();
    flights.sort();
    ensure!(!flights.is_empty(), "{}: no case in it (a folder with flight.csv and vehicle.json each)", folder.display());
    let sealed = |flight: PathBuf| {
        let name = flight.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let path = folder.join("truth").join(format!("{name}.json"));
        let text = bounded::text(&path, bounded::DOCUMENT).with_context(|| format!("{}: the truth of a case", path.display()))?;
        let truth = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
        Ok(Sealed { flight, truth })
    };
    flights.into_iter().map(sealed).collect()
}

fn names(list: &Value) -> Vec<String> {
    let name = |v: &Value| v.as_str().or_else(|| v["name"].as_str()).map(str::to_owned);
    let mut names: Vec<String> = list.as_array().into_iter().flatten().filter_map(name).collect();
    names.sort();
    names
}

/// Whether what was said is right: adequate for a clean case, unexplained for one outside the catalogue, else named, alone or in a class
/// of at most three.
#[must_use]
pub fn is_right(truth: &Value, said: &Value) -> bool {
    let verdict = said["verdict"].as_str().unwrap_or("");
    let hidden = names(&truth["effects"]);
    match truth["kind"].as_str() {
        Some("clean") => verdict == "adequate",
        Some("off") => verdict == "unexplained",
        _ => {
            let classes: Vec<Vec<String>> = said["equivalent"].as_array().into_iter().flatten().map(names).collect();
            let in_class = classes.len() <= LARGEST_CLASS && classes.contains(&hidden);
            matches!(verdict, "explained" | "ambiguous") && (names(&said["answer"]) == hidden || in_class)
        }
    }
}

/// Diagnoses the cases and counts what is right by kind and strength: `{"single strong": [right, of]}`, and CPU seconds in all.
///
/// # Errors
/// A pool that cannot start.
pub fn score(cases: &[Sealed], program: Program<'_>, limit_s: f64, jobs: usize, tick: &(dyn Fn() + Sync)) -> anyhow::Result<Value> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().context("cannot start the worker threads")?;
    let asked: Vec<Asked> = pool.install(|| {
        let one = |c: &Sealed| {
            let asked = diagnose(program, &c.flight, limit_s);
            tick();
            asked
        };
        cases.par_iter().map(one).collect()
    });
    let mut counts = serde_json::Map::new();
    for (case, asked) in cases.iter().zip(&asked) {
        let kind = case.truth["kind"].as_str().unwrap_or("");
        let group = format!("{kind} {}", case.truth["strength"].as_str().unwrap_or("")).trim().to_owned();
        let right = asked.said.as_ref().is_ok_and(|said| is_right(&case.truth, said));
        let at = counts.entry(group).or_insert_with(|| json!([0, 0]));
        let [hits, of] = [0, 1].map(|k| at[k].as_u64().unwrap_or(0));
        *at = json!([hits + u64::from(right), of + 1]);
    }
    let cpu: f64 = asked.iter().map(|a| a.cpu_s).filter(|s| s.is_finite()).sum();
    Ok(json!({ "right": counts, "cpu_s": cpu, "failures": asked.iter().filter(|a| a.said.is_err()).count() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_right_by_its_own_verdict() {
        let single = json!({"kind": "single", "effects": [{"name": "stall"}]});
        let said =
            |verdict: &str, answer: Value, equivalent: Value| json!({"verdict": verdict, "answer": answer, "equivalent": equivalent});
        assert!(is_right(&single, &said("explained", json!(["stall"]), json!([]))));
        assert!(is_right(&single, &said("ambiguous", json!(["roll_drag"]), json!([["roll_drag"], ["stall"]]))));
        assert!(!is_right(&single, &said("unexplained", json!(["stall"]), json!([]))));
        assert!(!is_right(&single, &said("ambiguous", json!(["a"]), json!([["a"], ["b"], ["c"], ["stall"]]))));
        let none = json!([]);
        assert!(is_right(&json!({"kind": "clean"}), &said("adequate", none.clone(), none.clone())));
        assert!(!is_right(&json!({"kind": "clean"}), &said("unexplained", none.clone(), none.clone())));
        assert!(is_right(&json!({"kind": "off", "effects": [{"name": "leak"}]}), &said("unexplained", none.clone(), none)));
    }
}
