//! `glider scorecard timeline`: missions in which something changes at an unknown dive.

use anyhow::ensure;
use indicatif::{ProgressBar, ProgressStyle};
use plant::trials::Wing;
use plant::trials::mission::Change;
use serde_json::json;

use super::{Output, Verdict};
use crate::score::timeline::{Case, DIVES, KINDS, Scored, document, false_alarms, plan, run as fly_all};
use crate::terminal::{say, table};

/// Arguments of `scorecard timeline`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider scorecard timeline --cases 50 --seed 1
  glider scorecard timeline --cases 10 --only drag --list
  glider scorecard timeline --cases 0 --unchanged 10 --alarm-dives 20000 --json

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
}

/// Runs the command.
///
/// # Errors
/// A kind that is none, or a case that could not be flown.
pub fn run(args: &TimelineArgs, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(only) = &args.only {
        let all: Vec<&str> = KINDS.into_iter().chain(["pitch", "pressure"]).collect();
        ensure!(all.contains(&only.as_str()), "--only {only}: no such kind; there are {}", all.join(", "));
    }
    let mut cases = plan(args.cases, args.seed, args.only.as_deref());
    let wing = |k: usize| if k.is_multiple_of(2) { Wing::Standard } else { Wing::LowAspectRatio };
    cases.extend((0..args.unchanged).map(|k| Case { index: 100_000 + k, wing: wing(k), change: Change::Nothing, onset: DIVES }));
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} missions, {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let folder = std::env::temp_dir().join(format!("glider-missions-{}-{}", args.seed, std::process::id()));
    let bar = ProgressBar::new(cases.len() as u64).with_style(style.clone());
    let scored = fly_all(&cases, args.seed, &folder, args.jobs, &|| bar.inc(1));
    bar.finish_and_clear();
    std::fs::remove_dir_all(&folder).ok();
    let scored = scored?;
    let unchanged: Vec<&Scored> = scored.iter().filter(|s| s.case.change == Change::Nothing).collect();
    let bar = ProgressBar::new(args.alarm_dives.div_ceil(DIVES) as u64).with_style(style);
    let alarms = false_alarms(&unchanged, args.alarm_dives, args.seed, args.jobs, &|| bar.inc(1));
    bar.finish_and_clear();
    let alarms = alarms?;
    let mut d = document(&scored, &alarms);
    d["seed"] = json!(args.seed);
    output.emit(&d, || {
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
        if args.list {
            d["list"].as_array().into_iter().flatten().for_each(|c| say(&format!("{c}")));
        }
    });
    let share = |v: &serde_json::Value| v["right"].as_f64().unwrap_or(0.0) / v["missions"].as_f64().unwrap_or(1.0).max(1.0);
    let found = args.cases == 0 || share(&d["changed"]) >= 0.9;
    let quiet = alarms.alarms * 1000 <= alarms.dives;
    Ok(if found && quiet { Verdict::Ok } else { Verdict::Negative })
}
