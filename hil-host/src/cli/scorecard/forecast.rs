//! `glider scorecard forecast`: forecasts of surfacings on missions that were flown, against persistence.

use std::path::PathBuf;

use anyhow::ensure;
use discovery::forecast::mission::Mission;
use discovery::forecast::passages::passages;
use discovery::forecast::region::COVERAGE;
use discovery::forecast::summary::{Ahead, COMPARED_S, Miss, Summary};
use rig::flight::vehicles;
use serde_json::{Value, json};

use super::super::{Output, Verdict};
use crate::fleet::archive::{Item, items, read_placed};
use crate::fleet::joined::joined;
use crate::terminal::{say, table, wrapped};

/// Arguments of `scorecard forecast`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider scorecard forecast --flights missions
  glider scorecard forecast --flights mission_dir --latitude 27.5 --json

A flight directory is a mission; so are all other logs of one folder together. Every surfacing is forecast with what was known before its
dive. Known plan: the dive's own heading, pitch and duration stand in for those that were ordered. Unknown plan: the dive before is flown
again. Known flight with the last current, and persistence of the last velocity over ground, stand for comparison.
Misses are scaled to 5 h; 5 h ahead: over as many known dives as last so long together. Exit code 1: no mission has four surfacings to forecast.")]
pub struct ForecastArgs {
    /// Folder of missions, or one mission.
    #[arg(long, value_name = "FOLDER", required = true)]
    flights: Vec<PathBuf>,
    /// Vehicle file of all of them, or a built-in one by name; default: the nearest in their folder or above.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Latitude of missions whose import.json does not say it, deg.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
}

/// Fewest surfacings of a mission that is shown.
const FEWEST: usize = 4;
const STRETCHES: [&str; 4] = ["all", "first third", "second third", "last third"];

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &ForecastArgs, output: &Output) -> anyhow::Result<Verdict> {
    ensure!(args.latitude.is_none_or(|l| l.abs() <= 89.0), "--latitude: expected -89 to 89 deg");
    let (mut missions, mut left_out) = (Vec::new(), Vec::new());
    for logs in items(&args.flights, args.vehicle.as_deref())?.chunk_by(same_mission) {
        logs::stop::here();
        let name = format!("{}/{}", logs[0].deployment, if logs.len() == 1 { &logs[0].flight } else { "*" });
        match judged(logs, args.latitude) {
            Ok((thirds, ahead, latitude_deg)) => missions.push(document(&name, &thirds, ahead, latitude_deg)),
            Err(why) => left_out.push(json!({"mission": name, "why": format!("{why:#}")})),
        }
    }
    let d = json!({"asked": COVERAGE, "missions": missions, "left_out": left_out});
    output.emit(&d, || print(&d));
    Ok(if missions.is_empty() { Verdict::Negative } else { Verdict::Ok })
}

/// A flight directory is a mission of its own; files of one folder are one.
fn same_mission(a: &Item, b: &Item) -> bool {
    let is_folder = |i: &Item| i.files.first().is_some_and(|f| f.is_dir());
    a.deployment == b.deployment && a.vehicle == b.vehicle && !is_folder(a) && !is_folder(b)
}

fn judged(logs: &[Item], latitude_deg: Option<f64>) -> anyhow::Result<([Summary; 4], Option<Ahead>, Option<f64>)> {
    let vehicle = vehicles::read(&logs[0].vehicle)?;
    let (log, _) = joined(logs.iter().map(|l| read_placed(&l.files)).collect::<anyhow::Result<_>>()?)?;
    let found = passages(&log.flight, &vehicle, &log.origins);
    let latitude_deg = found.latitude_deg.or(latitude_deg);
    let judged = Mission::of(latitude_deg, &found.all).1;
    let thirds = Summary::thirds(&judged).filter(|_| judged.len() >= FEWEST);
    let thirds = thirds.ok_or_else(|| anyhow::anyhow!("{} surfacings to forecast, {FEWEST} are the fewest", judged.len()))?;
    let ahead = Ahead::of(&Mission::later(latitude_deg, &found.all[found.same_frame_from..], COMPARED_S));
    Ok((thirds, ahead, latitude_deg))
}

fn document(name: &str, thirds: &[Summary; 4], ahead: Option<Ahead>, latitude_deg: Option<f64>) -> Value {
    let stretches: serde_json::Map<String, Value> =
        STRETCHES.iter().zip(thirds).map(|(name, s)| (name.replace(' ', "_"), json!(s))).collect();
    let [all, ..] = thirds;
    // Against persistence in median and 90 %: the larger ratio of the two.
    let ratio = |of: &Miss| (of.median_m / all.persistence.median_m).max(of.most_m / all.persistence.most_m);
    json!({"mission": name, "latitude_deg": latitude_deg, "stretches": stretches, "five_hours_ahead": ahead, "worst_to_persistence": all.forecast.each_ref().map(ratio)})
}

fn print(d: &Value) {
    let whole = |v: &Value| v.as_f64().map_or_else(|| "-".to_owned(), |x| format!("{x:.0}"));
    let miss = |v: &Value| format!("{} / {}", whole(&v["median_m"]), whole(&v["most_m"]));
    for m in d["missions"].as_array().into_iter().flatten() {
        say(&format!("{}: inside the 90 % ellipse, and misses scaled to 5 h, median / 90 %, m", m["mission"].as_str().unwrap_or("")));
        let heads = [
            "",
            "n",
            "inside: known plan",
            "unknown plan",
            "not learnt",
            "miss: known plan",
            "unknown plan",
            "last current",
            "persistence",
        ];
        let mut t = table(heads);
        for name in STRETCHES {
            let s = &m["stretches"][name.replace(' ', "_")];
            let of = |v: &Value| v.to_string();
            t.add_row([
                name.to_owned(),
                of(&s["surfacings"]),
                of(&s["inside"][0]),
                of(&s["inside"][1]),
                of(&s["inside_unlearnt"]),
                miss(&s["forecast"][0]),
                miss(&s["forecast"][1]),
                miss(&s["last_current"]),
                miss(&s["persistence"]),
            ]);
        }
        say(&format!("{t}"));
        if let Some(n) = m["five_hours_ahead"]["surfacings"].as_u64() {
            let a = &m["five_hours_ahead"];
            let [forecast, persistence] = [&a["forecast"], &a["persistence"]].map(miss);
            say(&wrapped(
                &format!(
                    "5 h ahead over several dives, known plan: {forecast} m, by persistence {persistence} m; inside the ellipse {} of {n}",
                    a["inside"]
                ),
                2,
            ));
        }
    }
    say(&wrapped("Known plan: the dive's own heading, pitch and duration stand in for the order. Unknown plan: the dive before again.", 2));
    for one in d["left_out"].as_array().into_iter().flatten() {
        let text = |key: &str| one[key].as_str().unwrap_or("").to_owned();
        say(&wrapped(&format!("left out: {}: {}", text("mission"), text("why")), 2));
    }
}
