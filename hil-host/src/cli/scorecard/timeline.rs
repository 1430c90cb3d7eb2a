//! `glider scorecard timeline`: missions in which something changes at an unknown dive.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use plant::trials::Wing;
use plant::trials::mission::Change;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::super::shards::{Session, ShardArgs, To, file_report, said_of_shard};
use super::super::{Output, Verdict};
use super::cases_bar;
use crate::score::timeline::{CHANGES_FLOWN, Case, DIVES, Scored, document, false_alarms, plan, score};
use crate::terminal::{say, table};
use rig::shards::kept::key;
use rig::shards::part;
use rig::shards::work::Done;

/// Its name in parts.
pub(super) const TIMELINE_COMMAND: &str = "scorecard timeline";

/// Arguments of `scorecard timeline`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider scorecard timeline --cases 50 --seed 1
  glider scorecard timeline --cases 10 --only drag --list
  glider scorecard timeline --cases 0 --unchanged 10 --alarm-dives 20000 --json
  glider scorecard timeline --cases 50 --resume                 (goes on after Ctrl-C or a break)
  glider scorecard timeline --cases 50 --shard 2/8 --out part2.json

Each case is a vehicle calibrated on one simulated trial, then flown on a mission of 60 dives.
Exit code 1: less than 90 % right, or more than one false alarm in 1,000 unchanged dives.")]
pub struct TimelineArgs {
    /// Missions with a change.
    #[arg(long, default_value_t = 50)]
    cases: usize,
    /// Missions without one; their dives are what false alarms are counted on.
    #[arg(long, default_value_t = 10)]
    unchanged: usize,
    /// Unchanged dives that false alarms are counted on.
    #[arg(long, default_value_t = 20_000)]
    alarm_dives: usize,
    /// Only one kind: drag, fouling, trim, leak, lift; also pitch, pressure (steps of a sensor).
    #[arg(long)]
    only: Option<String>,
    /// Seed: the same seed gives the same cases.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Worker threads.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// List every mission, not only the table (always in JSON).
    #[arg(long)]
    list: bool,
    /// Write the scorecard as JSON, without the times that it took; of a shard its results.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    shards: ShardArgs,
}

/// What its missions depend on.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Plan {
    cases: usize,
    unchanged: usize,
    alarm_dives: usize,
    only: Option<String>,
    seed: u64,
}

/// Runs the command.
///
/// # Errors
/// A kind that is none, or a case that could not be flown.
pub fn run(args: &TimelineArgs, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(only) = &args.only {
        let all: Vec<&str> = CHANGES_FLOWN.into_iter().chain(["pitch", "pressure"]).collect();
        ensure!(all.contains(&only.as_str()), "--only {only}: no such kind; there are {}", all.join(", "));
    }
    let (cases, unchanged, alarm_dives, only) = (args.cases, args.unchanged, args.alarm_dives, args.only.clone());
    let plan = Plan { cases, unchanged, alarm_dives, only, seed: args.seed };
    let to = To { out: args.out.as_deref(), list: args.list };
    let session =
        Session::open(&args.shards, (TIMELINE_COMMAND, &json!(plan)), (to.out, Path::new("out/scorecard-timeline")), args.jobs, output)?;
    fly(&plan, &session, &to, output)
}

/// Flies the missions of a plan, or takes what was found from parts, and reports.
pub(super) fn fly(of: &Plan, session: &Session, to: &To, output: &Output) -> anyhow::Result<Verdict> {
    let mut cases = plan(of.cases, of.seed, of.only.as_deref());
    let wing = |k: usize| if k.is_multiple_of(2) { Wing::Standard } else { Wing::LowAspectRatio };
    cases.extend((0..of.unchanged).map(|k| Case { index: 100_000 + k, wing: wing(k), change: Change::Nothing, onset: DIVES }));
    let folder = std::env::temp_dir().join(format!("glider-missions-{}-{}", of.seed, std::process::id()));
    let bar = cases_bar(session.work.shard.items(&cases).count(), "missions");
    session.announce(&bar);
    let key = |case: &Case| key(&[TIMELINE_COMMAND, &format!("{} {DIVES} {case:?}", of.seed)]);
    let done: anyhow::Result<Vec<Done<Scored>>> =
        session.work.run(&cases, &key, &|case| score(*case, of.seed, DIVES, &folder), &|_, _| bar.inc(1));
    bar.finish_and_clear();
    std::fs::remove_dir_all(&folder).ok();
    let done = done.map_err(|e| session.explained(e))?;
    if let (false, Some(out)) = (session.is_whole(), to.out) {
        let about = session.leave_part(out, done.iter(), json!({ "missions": done.len() }))?;
        return Ok(said_of_shard(&about, &format!("{} missions", done.len()), "glider scorecard merge", output, false));
    }
    let scored: Vec<Scored> = done.into_iter().map(|d| d.value.of(cases[d.place])).collect();
    let unchanged: Vec<&Scored> = scored.iter().filter(|s| s.case.change == Change::Nothing).collect();
    let bar = cases_bar(of.alarm_dives.div_ceil(DIVES), "missions");
    let alarms = false_alarms(&unchanged, of.alarm_dives, of.seed, session.work.jobs, &|| bar.inc(1));
    bar.finish_and_clear();
    let alarms = alarms?;
    let mut d = document(&scored, &alarms);
    d["seed"] = json!(of.seed);
    d["sha256"] = file_report(to.out, part::report(&d).as_bytes())?.into();
    session.close();
    output.emit(&d, || print(&d, to.list));
    let share = |v: &Value| v["right"].as_f64().unwrap_or(0.0) / v["missions"].as_f64().unwrap_or(1.0).max(1.0);
    let found = of.cases == 0 || share(&d["changed"]) >= 0.9;
    let quiet = alarms.alarms * 1000 <= alarms.dives;
    Ok(if found && quiet { Verdict::Ok } else { Verdict::Negative })
}

fn print(d: &Value, list: bool) {
    let mut t = table(["change", "missions", "right", "onset ± 2", "size in 90 %", "named", "leads", "others"]);
    let kinds = d["by_kind"].as_object().into_iter().flatten().map(|(k, v)| (k.as_str(), v));
    for (name, v) in kinds.chain([("all", &d["changed"])]) {
        let of = |key: &str| v[key].to_string();
        t.add_row([
            name.to_owned(),
            of("missions"),
            of("right"),
            of("onset_within_2"),
            of("size_covered"),
            of("named"),
            of("leads"),
            of("other_changes"),
        ]);
    }
    println!("{t}");
    let a = &d["false_alarms"];
    say(&format!("unchanged missions: {}, changes named in them: {}", d["unchanged"]["missions"], d["unchanged"]["changes_named"]));
    say(&format!(
        "false alarms: {} on {} unchanged dives ({:.2} per 1,000)",
        a["alarms"],
        a["dives"],
        a["per_1000_dives"].as_f64().unwrap_or(f64::NAN)
    ));
    say(&format!("wall time per mission of {DIVES} dives (median): {:.1} s", d["wall_s_median"].as_f64().unwrap_or(f64::NAN)));
    if list {
        d["list"].as_array().into_iter().flatten().for_each(|c| say(&format!("{c}")));
    }
}
