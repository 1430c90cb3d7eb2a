//! Real flights with a known injected error: does the diagnosis name what was changed, and nothing where nothing was?
//!
//! The truth of a real flight is unknown, but an error injected into its vehicle file or its log is known. Each flight gets a calibrated vehicle
//! file ([`flights::calibrated`]), then one injected error at a time ([`injected_errors`]), and `glider diagnose` is asked.
//!
//! * An injected error is **scored** where the flight can show it: its expected size after calibration and model discrepancy are marginalised
//!   ([`discovery::hypotheses::identifiability`]) is at least `shown_sigma` standard deviations. That is decided before anything is asked.
//! * **Named in class**: verdict `explained` or `ambiguous`, and the answer, or one of at most three equivalent ones, holds nothing but
//!   effects of the injected error's class: those that in its place leave less than `shown_sigma` standard deviations.
//! * **Quiet** (nothing changed, clock, pressure zero): verdict `adequate`; what is said of a sensor does not count against it.
//! * **Found** (clock, pressure zero): the sensor finding of that name is there.
//! * **Interval**: of an injected error named exactly, the stated interval holds its size, the tolerance of the calibrated file allowed for.

pub mod ask;
pub mod flights;
pub mod injected_errors;
pub mod missions;
pub mod replayed;

use std::path::Path;

use anyhow::Context as _;
use discovery::hypotheses::identifiability::Identifiability;
use discovery::model::parameters::{NINETY, calibration_of, tolerance_of};
use logs::vehicle::catalogue;
use logs::{Flight, export, vehicle};
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::score::contradictions::contradictions;
use crate::score::diagnosis::LARGEST_CLASS;
use ask::{Asked, Program};
use flights::{Data, Entry, Floors, Shipped, Split};
use injected_errors::{INJECTED_ERRORS, InjectedError};

/// A flight made ready: its calibrated vehicle file and what it is expected to show.
pub struct Ready {
    /// Entry in the list.
    pub entry: Entry,
    /// The flight.
    pub flight: Flight,
    /// Vehicle file as shipped.
    pub shipped: Value,
    /// Calibrated vehicle file.
    pub quiet: Value,
    /// What the flight is expected to show with it.
    pub expected: Identifiability,
}

/// One question and its answer.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Scored {
    /// Flight.
    pub flight: String,
    /// Split of the flight.
    pub split: Split,
    /// The injected error.
    #[serde(deserialize_with = "rig::shards::interned::text")]
    pub injected: rig::shards::interned::Text,
    /// Whether the effect of the injected error is asked for (else quiet is).
    pub names_an_effect: bool,
    /// Expected size, standard deviations; NaN for injected errors that no effect undoes.
    pub sigma: f64,
    /// Whether the flight can show it, so that it counts.
    pub scored: bool,
    /// Effects that count as named.
    pub class: Vec<String>,
    /// Verdict.
    pub verdict: String,
    /// Answer.
    pub answer: Vec<String>,
    /// Named in class, or quiet.
    pub right: bool,
    /// The answer is the injected error's effect alone.
    pub exact: bool,
    /// Whether the sensor finding is there, where one is asked for.
    pub found: Option<bool>,
    /// Whether the interval of an exact answer holds the truth.
    pub covered: Option<bool>,
    /// Block errors that the tool states, cm/s: nominal, recalibrated, best, noise floor.
    pub errors_cm_s: [f64; 4],
    /// Wall and CPU time, s.
    pub seconds: [f64; 2],
    /// Sentences that a number of the same answer denies.
    pub contradictions: Vec<String>,
    /// Why there is no answer.
    pub failure: Option<String>,
}

fn names(v: &Value) -> Vec<String> {
    let mut names: Vec<String> = v.as_array().into_iter().flatten().filter_map(|x| x.as_str().map(str::to_owned)).collect();
    names.sort();
    names
}

/// Reads and calibrates the flights of the list that are on disk; `missing` is told of the others.
///
/// # Errors
/// A calibration that is not of this list.
pub fn ready(root: &Path, data: &Data, wanted: &dyn Fn(&Entry) -> bool, missing: &dyn Fn(&str)) -> anyhow::Result<Vec<Ready>> {
    let mut out = Vec::new();
    for entry in data.flight.iter().filter(|e| wanted(e)) {
        let one = || -> anyhow::Result<Ready> {
            let (flight, shipped) = flights::load(root, entry)?;
            let quiet = match &entry.calibrate_on {
                None => flights::calibrated(&flight, &shipped, &entry.with)?,
                Some(name) => {
                    let other = data.entry(name)?;
                    let (flight, shipped) = flights::load(root, other)?;
                    flights::calibrated(&flight, &shipped, &other.with)?
                }
            };
            let expected = flights::expected(&flight, &quiet)?;
            Ok(Ready { entry: entry.clone(), flight, shipped, quiet, expected })
        };
        match one() {
            Ok(ready) => out.push(ready),
            Err(e) => missing(&format!("{}: {e:#}", entry.name)),
        }
    }
    Ok(out)
}

fn write(folder: &Path, flight: &Flight, vehicle: &Value) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot create the folder", folder.display()))?;
    let csv = folder.join("flight.csv");
    rig::whole_file::through(&csv, |file| export::csv::write(flight, file)).with_context(|| format!("{}: cannot write", csv.display()))?;
    let path = folder.join("vehicle.json");
    rig::whole_file::write(&path, format!("{vehicle:#}\n")).with_context(|| format!("{}: cannot write", path.display()))
}

/// Injects an error into a flight, which is written to the folder `here`, and scores what is said.
///
/// # Errors
/// A folder that cannot be written.
pub fn ask_one(ready: &Ready, injected: &InjectedError, data: &Data, program: Program<'_>, here: &Path) -> anyhow::Result<Scored> {
    let (mut flight, mut vehicle) = (ready.flight.clone(), ready.quiet.clone());
    injected.tell(&mut flight, &mut vehicle);
    write(here, &flight, &vehicle)?;
    let asked = ask::diagnose(program, here, data.limit_s);
    std::fs::remove_dir_all(here).ok();
    Ok(score(ready, injected, &asked, data.shown_sigma))
}

/// Injects every wanted error into every flight and scores what is said. `tick` is called after each.
///
/// # Errors
/// A folder that cannot be written, or a pool that cannot start.
pub fn run(
    ready: &[Ready],
    wanted: &(dyn Fn(&InjectedError) -> bool + Sync),
    data: &Data,
    program: Program<'_>,
    folder: &Path,
    jobs: usize,
    tick: &(dyn Fn(&Scored) + Sync),
) -> anyhow::Result<Vec<Scored>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().context("cannot start the worker threads")?;
    let asked: Vec<(&Ready, &InjectedError)> =
        ready.iter().flat_map(|r| INJECTED_ERRORS.iter().filter(|l| wanted(l)).map(move |l| (r, l))).collect();
    pool.install(|| {
        asked
            .par_iter()
            .enumerate()
            .map(|(i, (ready, injected))| {
                let scored = ask_one(ready, injected, data, program, &folder.join(i.to_string()))?;
                tick(&scored);
                Ok(scored)
            })
            .collect()
    })
}

/// Scores what was said.
#[must_use]
pub fn score(ready: &Ready, injected: &InjectedError, asked: &Asked, shown_sigma: f64) -> Scored {
    let empty = json!({});
    let d = asked.said.as_ref().unwrap_or(&empty);
    let verdict = d["verdict"].as_str().unwrap_or("failed").to_owned();
    let answer = names(&d["answer"]);
    let sigma = injected.effect.map_or(f64::NAN, |(effect, _)| ready.expected.shown_sigma(effect, injected.shift));
    let class: Vec<String> = injected.effect.map_or_else(Vec::new, |(effect, _)| {
        ready.expected.class_of(effect, injected.shift, shown_sigma).into_iter().map(str::to_owned).collect()
    });
    let named = verdict == "explained" || verdict == "ambiguous";
    let exact = named && injected.effect.is_some_and(|(effect, _)| answer == [effect]);
    let mut sets: Vec<Vec<String>> = d["equivalent"].as_array().into_iter().flatten().map(names).collect();
    if sets.len() > LARGEST_CLASS {
        sets.clear();
    }
    sets.push(answer.clone());
    let in_class = named && sets.iter().any(|set| !set.is_empty() && set.iter().all(|n| class.contains(n)));
    let quiet = verdict == "adequate";
    let findings = || d["sensor_findings"].as_array().into_iter().flatten();
    let error = |key: &str| d["error"][key].as_f64().unwrap_or(f64::NAN);
    Scored {
        flight: ready.entry.name.clone(),
        split: ready.entry.split,
        injected: injected.name,
        names_an_effect: injected.effect.is_some(),
        sigma,
        scored: injected.effect.is_none() || sigma >= shown_sigma,
        right: if injected.effect.is_some() { in_class } else { quiet },
        found: injected.finding.map(|name| findings().any(|f| f["name"].as_str() == Some(name))),
        covered: if exact { covered(ready, injected, d) } else { None },
        class,
        verdict,
        answer,
        exact,
        errors_cm_s: ["baseline", "recalibrated", "best", "noise_floor"].map(error),
        seconds: [asked.wall_s, asked.cpu_s],
        contradictions: contradictions(d),
        failure: asked.said.as_ref().err().cloned(),
    }
}

/// Whether the interval of an exact answer holds the size of the injected error; the calibrated file's own tolerance is allowed for.
fn covered(ready: &Ready, injected: &InjectedError, d: &Value) -> Option<bool> {
    let (effect, parameter) = injected.effect?;
    let candidate = d["candidates"].as_array()?.iter().find(|c| names(&c["effects"]) == [effect])?;
    let p = &candidate["parameters"][format!("{effect}.{parameter}")];
    let (value, low, high) = (p["value"].as_f64()?, p["low"].as_f64()?, p["high"].as_f64()?);
    let file = vehicle::parse(ready.quiet.clone(), Path::new("vehicle.json")).ok()?;
    let tolerance = catalogue::by_name(effect).and_then(calibration_of).map_or(0.0, |k| tolerance_of(&file, k));
    let truth = injected.value(&ready.quiet)?;
    // A relative tolerance is of the true number: in terms of the changed file it is as many times larger.
    let tolerance = if parameter == "rel_error" { tolerance * (1.0 + truth).abs() } else { tolerance };
    Some((value - truth).abs() <= (0.5 * (high - low)).hypot(NINETY * tolerance))
}

/// What is said of the vehicle file as shipped, against what is known.
#[must_use]
pub fn shipped(ready: &Ready, known: &Shipped, data: &Data, program: Program<'_>, folder: &Path) -> Value {
    let here = folder.join(format!("shipped-{}", ready.entry.name));
    let mut vehicle = ready.shipped.clone();
    if let Some(c) = known.stated_per_dbar {
        vehicle["hull_compressibility_per_pa"] = json!(c * 1e-4);
    }
    let asked = match write(&here, &ready.flight, &vehicle) {
        Ok(()) => ask::diagnose(program, &here, data.limit_s),
        Err(e) => Asked { said: Err(format!("{e:#}")), wall_s: 0.0, cpu_s: f64::NAN },
    };
    std::fs::remove_dir_all(&here).ok();
    let empty = json!({});
    let d = asked.said.as_ref().unwrap_or(&empty);
    let named = names(&d["answer"]).contains(&known.effect);
    let answer = names(&d["answer"]);
    let answered = d["candidates"].as_array().into_iter().flatten().find(|c| names(&c["effects"]) == answer).unwrap_or(&empty);
    let parameter = if known.parameter.is_empty() { "rel_error" } else { &known.parameter };
    let p = &answered["parameters"][format!("{}.{parameter}", known.effect)];
    let stated = vehicle["hull_compressibility_per_pa"].as_f64().unwrap_or(f64::NAN);
    let (low, high) = known.compressibility_per_dbar.map_or((known.low, known.high), |c| {
        let error = c * 1e-4 / stated - 1.0;
        (error, error)
    });
    let meets = p["low"].as_f64().is_some_and(|l| l <= high) && p["high"].as_f64().is_some_and(|h| h >= low);
    json!({
        "flight": ready.entry.name, "effect": known.effect, "verdict": d["verdict"], "answer": d["answer"], "told": p,
        "wanted": [low, high], "right": named && meets, "cpu_s": asked.cpu_s, "failure": asked.said.as_ref().err(),
    })
}

/// A share with its count.
fn share(list: &[&Scored], what: impl Fn(&Scored) -> bool) -> Value {
    let hits = list.iter().filter(|s| what(s)).count();
    json!({ "share": if list.is_empty() { Value::Null } else { json!(hits as f64 / list.len() as f64) }, "of": list.len() })
}

/// Summary figures of some answers.
#[must_use]
pub fn summary(scored: &[&Scored]) -> Value {
    let pick = |what: &dyn Fn(&Scored) -> bool| -> Vec<&Scored> { scored.iter().copied().filter(|s| what(s)).collect() };
    let injected_errors = pick(&|s| s.names_an_effect && s.scored);
    let still = pick(&|s| !s.names_an_effect);
    let sensors = pick(&|s| s.found.is_some());
    let exact = pick(&|s| s.covered.is_some());
    let mut cpu: Vec<f64> = scored.iter().map(|s| s.seconds[1]).filter(|s| s.is_finite()).collect();
    cpu.sort_by(f64::total_cmp);
    let at = |q: usize| cpu.get((cpu.len() * q / 100).min(cpu.len().saturating_sub(1))).copied();
    json!({
        "asked": scored.len(),
        "named": share(&injected_errors, |s| s.right),
        "exact": share(&injected_errors, |s| s.exact),
        "quiet": share(&still, |s| s.right),
        "found": share(&sensors, |s| s.found == Some(true)),
        "interval": share(&exact, |s| s.covered == Some(true)),
        "cpu_s": { "median": at(50), "largest": cpu.last() },
        "failures": scored.iter().filter(|s| s.failure.is_some()).count(),
        "contradictions": scored.iter().flat_map(|s| s.contradictions.iter().map(|c| format!("{}, {}: {c}", s.flight, s.injected))).collect::<Vec<_>>(),
    })
}

/// Which figures of a summary are below their floors; a figure that nothing was counted for is below none.
#[must_use]
pub fn below(summary: &Value, floors: &Floors) -> Vec<String> {
    let figures = [("named", floors.named), ("quiet", floors.quiet), ("interval", floors.interval)];
    let low = figures.iter().filter_map(|(name, floor)| {
        let share = summary[name]["share"].as_f64()?;
        (!(share >= *floor)).then(|| format!("{name} {share:.2} is below {floor:.2}"))
    });
    low.collect()
}

/// The whole scorecard.
#[must_use]
pub fn document(ready: &[Ready], scored: &[Scored], shipped: &[Value], data: &Data) -> Value {
    let of = |split: Split| summary(&scored.iter().filter(|s| s.split == split).collect::<Vec<_>>());
    let list = |s: &Scored| {
        json!({
            "flight": s.flight, "split": s.split.id(), "lie": s.injected, "expected_sigma": finite(s.sigma), "scored": s.scored, "class": s.class,
            "verdict": s.verdict, "answer": s.answer, "right": s.right, "exact": s.exact, "found": s.found, "covered": s.covered,
            "error_cm_s": { "nominal": finite(s.errors_cm_s[0]), "recalibrated": finite(s.errors_cm_s[1]), "best": finite(s.errors_cm_s[2]),
                "noise_floor": finite(s.errors_cm_s[3]) },
            "wall_s": finite(s.seconds[0]), "cpu_s": finite(s.seconds[1]), "failure": s.failure,
        })
    };
    let flight = |r: &Ready| {
        json!({
            "name": r.entry.name, "split": r.entry.split.id(), "rows": r.flight.len(), "calibrated_on": r.entry.calibrate_on,
            "discrepancy_cm_s": 100.0 * r.expected.discrepancy_m_s, "tolerance_1sigma": r.quiet["tolerance_1sigma"],
        })
    };
    json!({
        "shown_sigma": data.shown_sigma,
        "flights": ready.iter().map(flight).collect::<Vec<_>>(),
        "all": summary(&scored.iter().collect::<Vec<_>>()),
        "development": of(Split::Development),
        "judging": of(Split::Judging),
        "shipped": shipped,
        "list": scored.iter().map(list).collect::<Vec<_>>(),
    })
}

fn finite(v: f64) -> Value {
    if v.is_finite() { json!(v) } else { Value::Null }
}

/// One line of summary figures.
#[must_use]
pub fn line(d: &Value) -> String {
    let of = |v: &Value| v["share"].as_f64().map_or_else(|| "none".to_owned(), |s| format!("{:.0} % of {}", 100.0 * s, v["of"]));
    let a = &d["all"];
    format!(
        "real flights: named in class {}, exact {}, quiet {}, sensor found {}, intervals {}; CPU s median {:.1}, largest {:.1}; no answer {}",
        of(&a["named"]),
        of(&a["exact"]),
        of(&a["quiet"]),
        of(&a["found"]),
        of(&a["interval"]),
        a["cpu_s"]["median"].as_f64().unwrap_or(f64::NAN),
        a["cpu_s"]["largest"].as_f64().unwrap_or(f64::NAN),
        a["failures"]
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(injected: &'static str, names_an_effect: bool, scored: bool, right: bool) -> Scored {
        Scored {
            flight: "f".into(),
            split: Split::Development,
            injected,
            names_an_effect,
            sigma: 6.0,
            scored,
            class: Vec::new(),
            verdict: String::new(),
            answer: Vec::new(),
            right,
            exact: right,
            found: None,
            covered: None,
            errors_cm_s: [f64::NAN; 4],
            seconds: [1.0, f64::NAN],
            contradictions: Vec::new(),
            failure: None,
        }
    }

    #[test]
    fn scorecard_real_counts_what_a_flight_can_show_and_fails_below_a_floor() {
        let scored = [
            one("cd0 /1.5", true, true, true),
            one("lift /1.3", true, true, false),
            one("expansion x3", true, false, false),
            one("nothing", false, true, true),
        ];
        let s = summary(&scored.iter().collect::<Vec<_>>());
        assert_eq!((&s["named"]["share"], &s["named"]["of"]), (&json!(0.5), &json!(2)));
        assert_eq!((&s["quiet"]["share"], &s["quiet"]["of"]), (&json!(1.0), &json!(1)));
        assert!(below(&s, &Floors { named: 0.5, quiet: 1.0, interval: 0.9 }).is_empty());
        assert_eq!(below(&s, &Floors { named: 0.51, quiet: 1.0, interval: 0.0 }), ["named 0.50 is below 0.51"]);
        assert_eq!(below(&s, &Floors { named: f64::NAN, quiet: 0.0, interval: 0.0 }).len(), 1);
    }
}
