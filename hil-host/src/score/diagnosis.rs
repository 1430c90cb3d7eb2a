//! How well the diagnosis names what is hidden: sealed cases of [`plant::trials`] against `glider diagnose`.
//!
//! Each case is written to disk, diagnosed without its truth, and compared with it:
//!
//! * exact: the answer is the hidden effect (both of a pair), verdict `explained` or `ambiguous`;
//! * in class: exact, or the hidden set is one of at most three `equivalent` classes;
//! * false alarm: a clean case that is not called `adequate`;
//! * unexplained: a case outside the vocabulary with that verdict;
//! * interval: the stated interval of an exactly named effect contains the hidden value;
//! * error ratios: block error after, over the noise floor (observed rate minus the rate that the true relative velocity
//!   and the true missing effects give, so background motion and sensor noise only), and over the known-truth refit (told
//!   what is hidden, in nature's own form and size, and left to find the calibration quantities);
//! * can be told: nothing hidden has a twin ([`plant::trials::twin`]), or the log prefers the truth to it by ten to one when both
//!   are known in nature's own form. The rest is a coin's toss for anybody.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::score::contradictions::contradictions;
use anyhow::Context as _;
use discovery::model::parameters::{CALIBRATION, calibration_of};
use logs::vehicle::catalogue;
use plant::trials::catalogue::{OF_ANOTHER_FORM, Strength};
use plant::trials::mission::Mission;
use plant::trials::reference::{Log, block_error, floor, known_truth_error};
use plant::trials::vehicle::Scatter;
use plant::trials::{Case, Kind, Row, files, nature::Nature, twin};
use serde_json::{Value, json};

/// Largest number of equivalent classes that still counts as an answer.
pub const LARGEST_CLASS: usize = 3;

/// Odds of the truth over its twin from which a log is said to tell them apart.
const DISTINCT_ODDS: f64 = 10.0;

/// A case, and the dives of its vehicle before it.
#[derive(Debug)]
pub struct Posed {
    /// The case.
    pub case: Case,
    /// Healthy dives that its vehicle is calibrated on; none: its file is as drawn.
    pub before: Option<Mission>,
}

fn put(path: &Path, text: String) -> anyhow::Result<()> {
    path.parent().map_or(Ok(()), std::fs::create_dir_all).with_context(|| format!("{}: cannot create its folder", path.display()))?;
    rig::whole_file::write(path, text).with_context(|| format!("{}: cannot write", path.display()))
}

fn write_log(at: &Path, rows: &[Row], case: &Case) -> anyhow::Result<()> {
    put(&at.join("flight.csv"), files::csv(rows, case.vehicle.sensors.speed_m_s.is_some()))?;
    put(&at.join("vehicle.json"), format!("{:#}\n", case.vehicle.document(&case.name)))
}

/// Writes one case: `DIR/name/flight.csv`, `DIR/name/vehicle.json`, and the truth apart in `DIR/truth/name.json`.
///
/// # Errors
/// The file that cannot be written.
pub fn write_case(folder: &Path, case: &Case) -> anyhow::Result<PathBuf> {
    let flight = folder.join(&case.name);
    write_log(&flight, &case.rows, case)?;
    put(&folder.join("truth").join(format!("{}.json", case.name)), format!("{:#}\n", files::truth_document(case)))?;
    Ok(flight)
}

/// Writes a case and the dives before it, these as the flight directory `DIR/before/name`.
///
/// # Errors
/// The file that cannot be written.
pub fn write_posed(folder: &Path, Posed { case, before }: &Posed) -> anyhow::Result<(PathBuf, Option<PathBuf>)> {
    let earlier = before.as_ref().map(|_| folder.join("before").join(&case.name));
    earlier.iter().zip(before).try_for_each(|(at, before)| write_log(at, &before.rows, case))?;
    Ok((write_case(folder, case)?, earlier))
}

/// What the tool said about one case.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Scored {
    /// Case name.
    pub case: String,
    /// Kind.
    pub kind: Kind,
    /// Size class.
    pub strength: Option<Strength>,
    /// Site, wing and background colour, for slicing.
    pub setting: [String; 3],
    /// Hidden names, sorted.
    pub hidden: Vec<String>,
    /// The verdict.
    pub verdict: String,
    /// Names in the answer, sorted.
    pub answer: Vec<String>,
    /// The answer is what is hidden.
    pub exact: bool,
    /// What is hidden is the answer or in a class of at most three.
    pub in_class: bool,
    /// Number of classes called equivalent.
    pub classes: usize,
    /// Per comparable parameter of an exact answer: inside the interval, relative error.
    pub parameters: Vec<(String, bool, f64)>,
    /// Block errors, m/s: nominal (ours), noise floor (ours), after (the tool's).
    pub errors_m_s: [f64; 3],
    /// Block error of the refit that is told the truth, m/s (NaN outside the vocabulary).
    pub known_truth_m_s: f64,
    /// Log odds of the truth over its twin, both in nature's own form; none without a twin.
    pub twin_log_odds: Option<f64>,
    /// Wall time of the diagnosis, s.
    pub wall_s: f64,
    /// Sentences that a number of the same answer denies.
    pub contradictions: Vec<String>,
    /// Message if the tool failed.
    pub failure: Option<String>,
}

impl Scored {
    /// Whether anybody could tell what is hidden from its twin.
    fn is_distinct(&self) -> bool {
        self.twin_log_odds.is_none_or(|odds| odds > DISTINCT_ODDS.ln())
    }
}

fn sorted(v: &Value) -> Vec<String> {
    let mut names: Vec<String> = v.as_array().into_iter().flatten().filter_map(|x| x.as_str().map(str::to_owned)).collect();
    names.sort();
    names
}

/// Compares a diagnosis (the JSON of `glider diagnose`) with the truth.
#[must_use]
pub fn score(case: &Case, diagnosis: &Result<Value, String>, wall_s: f64) -> Scored {
    let mut hidden: Vec<String> = case.truth.hidden.iter().map(|h| h.name.to_owned()).collect();
    hidden.sort();
    let log = Log::new(&case.rows, case.vehicle.gravity);
    let blocks = log.blocks(&Nature::new(&case.vehicle, &Scatter::none()), case.vehicle.gravity, |s| case.vehicle.check.contains(&s));
    let empty = json!({});
    let d = diagnosis.as_ref().unwrap_or(&empty);
    let verdict = d["verdict"].as_str().unwrap_or("failed").to_owned();
    let mut answer = sorted(&d["answer"]);
    // What is a nuisance of every hypothesis is told as a finding of the calibration number that it is the error of, not as an effect.
    let found = |name: &str| d["sensor_findings"].as_array().into_iter().flatten().any(|f| f["name"] == name);
    let number = |name: &str| catalogue::by_name(name).and_then(calibration_of).map(|k| CALIBRATION[k]);
    let as_sensors: Vec<String> = hidden.iter().filter(|h| number(h).is_some_and(found)).cloned().collect();
    let named = verdict == "explained" || verdict == "ambiguous" || (!as_sensors.is_empty() && verdict == "adequate");
    answer.extend(as_sensors.into_iter().filter(|b| !answer.contains(b)).collect::<Vec<_>>());
    answer.sort();
    let classes: Vec<Vec<String>> = d["equivalent"].as_array().into_iter().flatten().map(sorted).collect();
    let has_names = matches!(case.truth.kind, Kind::Single | Kind::Pair);
    let exact = has_names && named && answer == hidden;
    let in_class = exact || (has_names && named && classes.len() <= LARGEST_CLASS && classes.contains(&hidden));
    let mut parameters = Vec::new();
    if exact {
        let candidate = d["candidates"].as_array().and_then(|c| c.iter().find(|c| sorted(&c["effects"]) == hidden)).unwrap_or(&empty);
        for h in case.truth.hidden.iter().filter(|h| !OF_ANOTHER_FORM.contains(&h.name)) {
            let p = &candidate["parameters"][format!("{}.{}", h.name, h.parameter)];
            if let (Some(value), Some(low), Some(high)) = (p["value"].as_f64(), p["low"].as_f64(), p["high"].as_f64()) {
                parameters.push((h.name.to_owned(), low <= h.value && h.value <= high, (value - h.value) / h.value.abs()));
            }
        }
    }
    Scored {
        case: case.name.clone(),
        kind: case.truth.kind,
        strength: case.truth.strength,
        setting: [case.vehicle.site.id(), case.vehicle.wing.id(), case.truth.colour.id()].map(str::to_owned),
        hidden,
        verdict,
        answer,
        exact,
        in_class,
        classes: classes.len(),
        parameters,
        errors_m_s: [block_error(&blocks), floor(&blocks), d["block_error_m_s"]["after"].as_f64().unwrap_or(f64::NAN)],
        known_truth_m_s: known_truth_error(&log, &case.vehicle, &case.truth).unwrap_or(f64::NAN),
        twin_log_odds: twin::log_odds(&log, &case.vehicle, &case.truth),
        wall_s,
        contradictions: contradictions(d),
        failure: diagnosis.as_ref().err().cloned(),
    }
}

/// Writes, diagnoses and scores a case, its vehicle calibrated on the dives before where there are some.
///
/// # Errors
/// A case that cannot be written.
pub fn diagnose_case(posed: &Posed, folder: &Path, binary: &Path) -> anyhow::Result<Scored> {
    let (flight, earlier) = write_posed(folder, posed)?;
    let ready = earlier.as_ref().map_or(Ok(Value::Null), |earlier| {
        let words = [Path::new("calibrate"), Path::new("--force"), Path::new("--flight"), earlier, Path::new("--out")];
        asked(binary, &[&words[..], &[&flight.join("vehicle.json")]].concat())
    });
    let clock = Instant::now();
    let said = ready.and_then(|_| asked(binary, &[Path::new("diagnose"), Path::new("--flight"), &flight]));
    let scored = score(&posed.case, &said, clock.elapsed().as_secs_f64());
    std::iter::once(flight).chain(earlier).for_each(|made| _ = std::fs::remove_dir_all(made));
    Ok(scored)
}

/// The document of a command of a `glider` binary, or what it wrote to standard error.
fn asked(binary: &Path, words: &[&Path]) -> Result<Value, String> {
    let out = std::process::Command::new(binary).args(words).arg("--json").output().map_err(|e| format!("{}: {e}", binary.display()))?;
    serde_json::from_slice(&out.stdout).map_err(|_| String::from_utf8_lossy(&out.stderr).trim().to_owned())
}

/// A share with its count.
fn share(list: &[&Scored], what: impl Fn(&Scored) -> bool) -> Value {
    let hits = list.iter().filter(|s| what(s)).count();
    json!({ "share": if list.is_empty() { Value::Null } else { json!(hits as f64 / list.len() as f64) }, "of": list.len() })
}

fn median(mut values: Vec<f64>) -> Value {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    if values.is_empty() { Value::Null } else { json!(values[values.len() / 2]) }
}

/// The scorecard as one document.
#[must_use]
pub fn summary(scored: &[Scored]) -> Value {
    let pick = |kind: Kind, strength: Option<Strength>| -> Vec<&Scored> {
        scored.iter().filter(|s| s.kind == kind && (strength.is_none() || s.strength == strength)).collect()
    };
    let named = |kind: Kind| -> Value {
        let mut out = serde_json::Map::new();
        for strength in Strength::ALL {
            let list = pick(kind, Some(strength));
            let distinct: Vec<&Scored> = list.iter().copied().filter(|s| s.is_distinct()).collect();
            out.insert(
                strength.id().to_owned(),
                json!({
                    "exact": share(&list, |s| s.exact),
                    "exact_where_it_can_be_told": share(&distinct, |s| s.exact),
                    "in_class": share(&list, |s| s.in_class),
                    "at_least_one": share(&list, |s| s.hidden.iter().any(|h| s.answer.contains(h))),
                    "error_after_over_floor_median": median(list.iter().map(|s| s.errors_m_s[2] / s.errors_m_s[1]).collect()),
                    "nominal_over_floor_median": median(list.iter().map(|s| s.errors_m_s[0] / s.errors_m_s[1]).collect()),
                }),
            );
        }
        Value::Object(out)
    };
    let clean = pick(Kind::Clean, None);
    let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for s in scored {
        let truth = match (s.kind, s.strength) {
            (Kind::Clean, _) => "(nothing)".to_owned(),
            (Kind::Off, Some(x)) => format!("off:{} {}", s.hidden.join("+"), x.id()),
            (_, Some(x)) => format!("{} {}", s.hidden.join("+"), x.id()),
            _ => s.hidden.join("+"),
        };
        let said = match s.verdict.as_str() {
            "explained" | "ambiguous" => s.answer.join("+"),
            other => format!("({other})"),
        };
        *confusion.entry(truth).or_default().entry(said).or_default() += 1;
    }
    let mut off = serde_json::Map::new();
    for strength in [Strength::Medium, Strength::Strong] {
        let list = pick(Kind::Off, Some(strength));
        let distinct: Vec<&Scored> = list.iter().copied().filter(|s| s.is_distinct()).collect();
        off.insert(strength.id().to_owned(), share(&list, |s| s.verdict == "unexplained"));
        off.insert(format!("{}_where_it_can_be_told", strength.id()), share(&distinct, |s| s.verdict == "unexplained"));
    }
    let parameters: Vec<&(String, bool, f64)> = scored.iter().flat_map(|s| &s.parameters).collect();
    let covered = parameters.iter().filter(|p| p.1).count();
    let answered: Vec<&Scored> = scored.iter().filter(|s| s.exact).collect();
    json!({
        "cases": scored.len(),
        "singles": named(Kind::Single),
        "pairs": named(Kind::Pair),
        "clean": {
            "adequate": share(&clean, |s| s.verdict == "adequate"),
            "false_alarms": share(&clean, |s| s.verdict != "adequate"),
        },
        "off": off,
        "intervals": {
            "coverage": if parameters.is_empty() { Value::Null } else { json!(covered as f64 / parameters.len() as f64) },
            "of": parameters.len(),
            "relative_error_median": median(parameters.iter().map(|p| p.2.abs()).collect()),
        },
        "error_after_over_known_truth_median": median(
            scored.iter().filter(|s| s.kind != Kind::Off).map(|s| s.errors_m_s[2] / s.known_truth_m_s).collect(),
        ),
        "error_after_over_known_truth_of_exact_answers": median(answered.iter().map(|s| s.errors_m_s[2] / s.known_truth_m_s).collect()),
        "error_after_over_floor_of_exact_answers": median(answered.iter().map(|s| s.errors_m_s[2] / s.errors_m_s[1]).collect()),
        "wall_s_per_case_median": median(scored.iter().map(|s| s.wall_s).collect()),
        "failures": scored.iter().filter(|s| s.failure.is_some()).count(),
        "contradictions": scored.iter().flat_map(|s| s.contradictions.iter().map(|c| format!("{}: {c}", s.case))).collect::<Vec<_>>(),
        "confusion": confusion,
    })
}

/// One line per case.
#[must_use]
pub fn case_document(s: &Scored) -> Value {
    json!({
        "case": s.case,
        "kind": s.kind.id(),
        "strength": s.strength.map(Strength::id),
        "site": s.setting[0],
        "wing": s.setting[1],
        "background": s.setting[2],
        "hidden": s.hidden,
        "verdict": s.verdict,
        "answer": s.answer,
        "exact": s.exact,
        "in_class": s.in_class,
        "classes": s.classes,
        "parameters": s.parameters.iter().map(|(n, inside, e)| json!({ "name": n, "inside": inside, "relative_error": e })).collect::<Vec<_>>(),
        "error_nominal_m_s": s.errors_m_s[0],
        "error_floor_m_s": s.errors_m_s[1],
        "error_after_m_s": if s.errors_m_s[2].is_finite() { json!(s.errors_m_s[2]) } else { Value::Null },
        "error_known_truth_m_s": if s.known_truth_m_s.is_finite() { json!(s.known_truth_m_s) } else { Value::Null },
        "twin_log_odds": s.twin_log_odds,
        "wall_s": s.wall_s,
        "failure": s.failure,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::trials::{generate, plan};

    /// Cases of every kind under a diagnosis that is given the truth.
    fn under(diagnose: impl Fn(&Case) -> Value) -> Value {
        let scored: Vec<Scored> = plan(20, 3, None)
            .iter()
            .enumerate()
            .map(|(i, spec)| {
                let case = generate(spec, 3, i);
                let said = diagnose(&case);
                score(&case, &Ok(said), 0.0)
            })
            .collect();
        summary(&scored)
    }

    fn each_share(d: &Value) -> Vec<(String, f64)> {
        let mut out = Vec::new();
        for kind in ["singles", "pairs"] {
            for size in ["weak", "medium", "strong"] {
                for what in ["exact", "in_class"] {
                    if let Some(x) = d[kind][size][what]["share"].as_f64() {
                        out.push((format!("{kind} {size} {what}"), x));
                    }
                }
            }
        }
        out
    }

    #[test]
    fn scorecard_is_full_for_the_truth_and_empty_for_silence() {
        let knowing = under(|case| {
            let names: Vec<&str> = case.truth.hidden.iter().map(|h| h.name).collect();
            let parameters: serde_json::Map<String, Value> = case
                .truth
                .hidden
                .iter()
                .map(|h| (format!("{}.{}", h.name, h.parameter), json!({ "value": h.value, "low": h.value - 0.1, "high": h.value + 0.1 })))
                .collect();
            match case.truth.kind {
                Kind::Clean => json!({ "verdict": "adequate", "answer": [] }),
                Kind::Off => json!({ "verdict": "unexplained", "answer": [] }),
                _ => json!({ "verdict": "explained", "answer": names, "equivalent": [names],
                    "candidates": [{ "effects": names, "parameters": parameters }] }),
            }
        });
        for (what, share) in each_share(&knowing) {
            assert_eq!(share, 1.0, "{what}");
        }
        assert_eq!(knowing["clean"]["adequate"]["share"], 1.0);
        assert_eq!(knowing["off"]["strong"]["share"].as_f64().unwrap_or(1.0), 1.0);
        assert_eq!(knowing["intervals"]["coverage"], 1.0);
        assert_eq!(knowing["intervals"]["relative_error_median"], 0.0);

        let silent = under(|_| json!({ "verdict": "adequate", "answer": [] }));
        for (what, share) in each_share(&silent) {
            assert_eq!(share, 0.0, "{what}");
        }
        assert_eq!(silent["clean"]["adequate"]["share"], 1.0);
        assert_eq!(silent["off"]["strong"]["share"].as_f64().unwrap_or(0.0), 0.0);
    }

    #[test]
    fn scorecard_counts_classes_of_three_and_no_names_of_the_unexplained() {
        let with = |verdict: &str, others: usize| {
            let verdict = verdict.to_owned();
            under(move |case| {
                let names: Vec<&str> = case.truth.hidden.iter().map(|h| h.name).collect();
                let mut classes = vec![json!(names)];
                classes.extend((0..others).map(|k| json!([format!("other_{k}")])));
                json!({ "verdict": verdict, "answer": ["other_0"], "equivalent": classes })
            })
        };
        for (d, exact, in_class) in [(with("ambiguous", 2), 0.0, 1.0), (with("ambiguous", 3), 0.0, 0.0), (with("unexplained", 1), 0.0, 0.0)]
        {
            for (what, share) in each_share(&d) {
                assert_eq!(share, if what.ends_with("exact") { exact } else { in_class }, "{what}");
            }
        }
    }
}
