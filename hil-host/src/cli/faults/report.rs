//! What a fault campaign prints, files and returns.

use super::super::shards::{To, file_report};
use super::super::{Output, Verdict};
use crate::terminal::table;
use rig::campaign::{self, Summary};
use rig::seats::Choice;
use rig::shards::part::without_durations;
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Verdicts as a list.
struct Cases<'a>([&'a [campaign::Verdict]; 2]);

impl Serialize for Cases<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(self.0.iter().copied().flatten().map(campaign::Verdict::document))
    }
}

/// A document with all its cases; they are made one by one.
struct WithCases<'a>(&'a Value, Cases<'a>);

impl Serialize for WithCases<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut map = to.serialize_map(None)?;
        self.0.as_object().into_iter().flatten().try_for_each(|(key, value)| map.serialize_entry(key, value))?;
        map.serialize_entry("cases", &self.1)?;
        map.end()
    }
}

/// Reports what was flown: healthy missions, and those with faults; `seat` is what a seat made of them; since when, and of how many parts.
///
/// # Errors
/// A file that cannot be written.
pub fn report(
    [healthy, faulty]: &[Vec<campaign::Verdict>; 2],
    (seed, choice): (u64, &Choice),
    seat: Option<Value>,
    (started, merges): (Instant, Option<usize>),
    (to, html): (&To, &Path),
    output: &Output,
) -> anyhow::Result<Verdict> {
    let summary = Summary::of(faulty, healthy);
    let wall_s = started.elapsed().as_secs_f64();
    let bad: Vec<&campaign::Verdict> = faulty.iter().chain(healthy).filter(|v| v.wrong()).collect();
    let apart: Vec<Value> = faulty.iter().filter(|v| v.apart()).map(campaign::Verdict::document).collect();
    let mut document = json!({
        "summary": { "missions": summary.missions, "safe": summary.safe, "below_crush": summary.below_crush, "home": summary.home, "finished": summary.finished, "false_aborts": summary.false_aborts,
            "wall_s": (wall_s * 100.0).round() / 100.0, "twins": summary.twins, "expectation_not_met": summary.unmet, "beyond_any_controller": summary.apart, "of_these_home": summary.apart_home,
            "deeper_than_100_m": summary.at_depth, "pairs_at_depth": summary.pairs_at_depth, "bad_line_changed_commands": summary.line_changed, "seed": seed, "seat": choice.to_string() },
        "not_as_expected": bad.iter().map(|v| v.document()).collect::<Vec<_>>(),
        "no_means_left": apart,
        "by_fault": campaign::tally::rows(faulty).iter().map(campaign::tally::Row::document).collect::<Vec<_>>(),
    });
    if let (Some(map), Some(seat)) = (document.as_object_mut(), &seat) {
        map.insert("through_seat".to_owned(), seat.clone());
    }
    let mut text = serde_json::to_vec_pretty(&WithCases(&without_durations(&document), Cases([faulty, healthy])))?;
    text.push(b'\n');
    document["sha256"] = file_report(to.out, &text)?.into();
    let through = seat.as_ref().map_or_else(String::new, |s| {
        let different = s["different"].as_array().map_or(0, Vec::len);
        format!(
            "; {} of them through {} too, {different} with another verdict or actuator stream",
            s["missions"],
            s["seat"].as_str().unwrap_or_default()
        )
    });
    let flown = merges.map_or_else(|| format!("{wall_s:.0} s, in this process{through}"), |of| format!("in {of} parts"));
    crate::pages::fault_campaign::page(&summary, faulty, healthy, &flown).write(html)?;
    document["report"] = json!(html);
    output.emit(&document, || {
        print(&summary, faulty, &bad, wall_s, seat.as_ref(), (to, html));
        if let Some(out) = to.out {
            println!("{}  SHA-256 {}", out.display(), document["sha256"].as_str().unwrap_or_default());
        }
    });
    let seat_equal = seat.is_none_or(|s| s["different"].as_array().is_some_and(Vec::is_empty));
    Ok(if summary.passed() && seat_equal { Verdict::Ok } else { Verdict::Negative })
}

fn print(
    s: &Summary,
    faulty: &[campaign::Verdict],
    bad: &[&campaign::Verdict],
    wall_s: f64,
    seat: Option<&Value>,
    (to, html): (&To, &Path),
) {
    let mut targets: BTreeMap<&str, [u64; 4]> = BTreeMap::new();
    let mut latencies: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for v in faulty.iter().filter(|v| !v.apart()) {
        let name = match (v.case.faults.as_slice(), v.case.line) {
            ([one], _) => one.target.name(),
            (_, Some(_)) => "line",
            _ => "pairs",
        };
        let row = targets.entry(name).or_default();
        row[0] += 1;
        row[1] += u64::from(v.safe());
        row[2] += u64::from(v.abort.is_some());
        row[3] += u64::from(v.unmet.is_some());
        if let (Some((_, after)), true) = (v.abort, v.case.faults.len() == 1) {
            latencies.entry(name).or_default().push(after);
        }
    }
    let mut t = table(["fault in", "missions", "safe", "aborted", "not as expected", "median latency, s"]);
    for (name, [missions, safe, aborted, unmet]) in targets {
        let median = latencies.get_mut(name).map(|l| {
            l.sort_by(f64::total_cmp);
            l.get(l.len() / 2).copied().unwrap_or(f64::NAN)
        });
        t.add_row([
            name.to_owned(),
            missions.to_string(),
            safe.to_string(),
            aborted.to_string(),
            unmet.to_string(),
            median.map_or(String::new(), |m| format!("{m:.0}")),
        ]);
    }
    println!("{t}");
    println!("{} of them deeper than 100 m, {} with two faults at once there", s.at_depth, s.pairs_at_depth);
    println!("{} fault missions: {} safe, {} below crush depth, {} not as expected", s.missions, s.safe, s.below_crush, s.unmet);
    println!("of these and those that nobody could bring home {} came home, {} flew their mission to its end", s.home, s.finished);
    println!(
        "{} healthy twins: {} false aborts; {} more missions that nobody could bring home by their budgets, {} of them home all the same",
        s.twins, s.false_aborts, s.apart, s.apart_home
    );
    println!("bad line: {} missions with other commands than their twin; {wall_s:.0} s", s.line_changed);
    if let Some(seat) = seat {
        let different = seat["different"].as_array().map_or(0, Vec::len);
        println!(
            "{}: {} missions, {different} with another verdict or actuator stream",
            seat["seat"].as_str().unwrap_or(""),
            seat["missions"]
        );
    }
    let shown = if to.list { bad.len() } else { 20 };
    for v in bad.iter().take(shown) {
        let why = v.broken.iter().copied().chain(v.unmet).collect::<Vec<_>>().join(", ");
        let abort = v.abort.map_or_else(|| "no abort".to_owned(), |(cause, after)| format!("{cause:?} after {after:.0} s"));
        println!(
            "  {:?} {:?} seed {} {}: {why} ({abort}, {}, {:.0} m)",
            v.case.water,
            v.case.wings,
            v.case.seed,
            v.case.name(),
            v.end,
            v.max_depth_m
        );
    }
    if bad.len() > shown {
        println!("  … {} more: --list", bad.len() - shown);
    }
    println!("report: {}", html.display());
}
