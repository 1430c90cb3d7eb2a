//! `glider fleet`.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use indicatif::ProgressBar;
use logs::digest::sha256;
use serde_json::{Value, json};

use super::diagnose::bar;
use super::{Output, Verdict};
use crate::fleet::archive::items;
use crate::fleet::map::map;
use crate::fleet::part::Part;
use crate::fleet::pooled::{FleetNumber, pooled};
use crate::terminal::{rounded, table, wrapped};
use rig::shards::kept::Kept;
use rig::shards::shard::Shard;
use rig::shards::work::Work;
use rig::spelling::meant_path;
use rig::whole_file;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    subcommand_negates_reqs = true,
    subcommand_precedence_over_arg = true,
    after_help = "Examples:
  glider fleet archive --vehicle known.json --out fleet.parquet
  glider fleet archive --out fleet.parquet --resume              (goes on after a break, or with new flights)
  glider fleet archive --shard 2/8 --out part2.parquet           (the second of eight machines)
  glider fleet merge part1.parquet part2.parquet --out fleet.parquet

An archive is folders in folders. A flight is a folder with flight.csv, a csv, or a glider's own files; flights in one folder are one
deployment. Without --vehicle each flight is judged by the nearest vehicle.json or vehicle.toml in its folder or above.
The table has one row a dive: what it says of drag, lift, trim and of every effect of the catalogue, each with its uncertainty. Pooled over
dives, deployments and vehicles, numbers are named so that at most --false-names of the names are expected to be false.
Its SHA-256 does not depend on shards, their order, or a run that was killed and taken up again.
Exit code 0: nothing is named (or a shard is done); 1: something is named; 2: bad input."
)]
pub struct Args {
    #[command(subcommand)]
    then: Option<Then>,
    /// Folders of flights, or flights.
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// Vehicle file for all flights, or a built-in one by name; best one that glider calibrate wrote.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Where the table of dives goes (.parquet).
    #[arg(long, value_name = "FILE", required = true)]
    out: Option<PathBuf>,
    /// Only the flights of one part of the work.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Take what an earlier run has done already.
    #[arg(long)]
    resume: bool,
    /// Folder where what is done is kept, flight by flight; default: beside the table. A folder named here is always used, and may be shared.
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Flights that are asked at a time.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: u16,
    /// Share of the names that may be false.
    #[arg(long, value_name = "SHARE", default_value_t = FALSE_NAMES)]
    false_names: f64,
}

#[derive(clap::Subcommand, Debug)]
enum Then {
    /// Put the parts of shards together and pool them.
    Merge(MergeArgs),
}

/// Arguments of `fleet merge`.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider fleet merge part1.parquet part2.parquet --out fleet.parquet
  glider fleet merge fleet.parquet --false-names 0.01 --json        (pools a whole table again)
Exit code 0: nothing is named; 1: something is named; 2: bad input, as a shard that is missing.")]
struct MergeArgs {
    /// Parts that glider fleet wrote.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Where the whole table goes (.parquet).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Share of the names that may be false.
    #[arg(long, value_name = "SHARE", default_value_t = FALSE_NAMES)]
    false_names: f64,
}

const FALSE_NAMES: f64 = 0.05;

fn check_share(share: f64) -> anyhow::Result<()> {
    ensure!(share > 0.0 && share <= 0.5, "--false-names {share}: expected a share above 0 and at most 0.5; 0.05 is usual");
    Ok(())
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(Then::Merge(merged)) = &args.then {
        let alone = args.paths.is_empty() && args.vehicle.is_none() && args.out.is_none() && args.shard.is_none();
        ensure!(alone, "what merge is to do stands after it: glider fleet merge PART… --out FILE");
        return merge(merged, output);
    }
    let out = args.out.as_deref().context("--out FILE.parquet says where the table goes")?;
    check_share(args.false_names)?;
    let inputs: Vec<&Path> = args.paths.iter().chain(&args.vehicle).map(PathBuf::as_path).collect();
    whole_file::may_write(out, &inputs, &["parquet"], output.force || args.resume)?;
    let found = items(&args.paths, args.vehicle.as_deref())?;
    let cache = cache_folder(args, out, output)?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let bar = flights_bar(shard.items(&found).count());
    let work = Work { shard, jobs: usize::from(args.jobs), kept: Kept::Folder(cache.clone()) };
    let done = map(&found, &work, &|flight| {
        bar.inc(1);
        bar.set_message(flight.to_owned());
    });
    bar.finish_and_clear();
    let done = done?;
    let left_out = done.part.rows.iter().find(|r| !r.left_out.is_empty());
    if let Some(row) = left_out.filter(|_| done.part.shard.is_none() && done.part.rows.iter().all(|r| r.dive.dive == 0)) {
        bail!("no dive of these flights can be asked; {}/{}: {}", row.deployment, row.flight, row.left_out);
    }
    let bytes = done.part.bytes()?;
    put(out, &bytes)?;
    let mut about = json!({
        "out": out.display().to_string(), "sha256": sha256(&bytes), "shard": args.shard.map(|s| s.to_string()),
        "cache": cache.display().to_string(), "flights": done.flights[0], "flights_from_cache": done.flights[1],
    });
    if let Some(shard) = args.shard.filter(|s| *s != Shard::WHOLE) {
        counted(&mut about, &done.part);
        output.emit(&about, || {
            said_of_flights(&about);
            println!("Shard {shard}: put all {} together with glider fleet merge", shard.of);
        });
        return Ok(Verdict::Ok);
    }
    Ok(conclude(&done.part, about, args.false_names, output))
}

/// The folder of the cache, empty unless it is to be used again.
fn cache_folder(args: &Args, out: &Path, output: &Output) -> anyhow::Result<PathBuf> {
    if let Some(cache) = &args.cache {
        ensure!(!cache.is_file(), "--cache {}: is a file; name a folder", cache.display());
        return Ok(cache.clone());
    }
    let name = out.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let cache = out.with_file_name(format!("{name}.cache"));
    let is_used = std::fs::read_dir(&cache).is_ok_and(|mut d| d.next().is_some());
    if is_used && !args.resume {
        if !output.force {
            bail!("{}: has what an earlier run did; go on from it with --resume, or start anew with --force", cache.display());
        }
        std::fs::remove_dir_all(&cache).with_context(|| cache.display().to_string())?;
    }
    Ok(cache)
}

fn flights_bar(flights: usize) -> ProgressBar {
    let bar = bar();
    bar.set_length(flights as u64);
    if let Ok(style) = indicatif::ProgressStyle::with_template("{bar:30} {pos} of {len} flights, {eta} left {msg}") {
        bar.set_style(style);
    }
    bar
}

fn put(out: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    whole_file::write(out, bytes).with_context(|| format!("cannot write {}", out.display()))
}

fn merge(args: &MergeArgs, output: &Output) -> anyhow::Result<Verdict> {
    check_share(args.false_names)?;
    let inputs: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
    if let Some(out) = &args.out {
        whole_file::may_write(out, &inputs, &["parquet"], output.force)?;
    }
    let mut parts = Vec::new();
    for path in &args.parts {
        ensure!(path.is_file(), "{}: no such file{}", path.display(), meant_path(path));
        parts.push(Part::read(path)?);
    }
    let names: Vec<String> = args.parts.iter().map(|p| p.display().to_string()).collect();
    let part = Part::merged(parts, &names)?;
    let bytes = part.bytes()?;
    if let Some(out) = &args.out {
        put(out, &bytes)?;
    }
    let about = json!({"out": args.out.as_ref().map(|o| o.display().to_string()), "sha256": sha256(&bytes), "parts": names});
    Ok(conclude(&part, about, args.false_names, output))
}

/// Counts of a table and what was left out of it.
fn counted(about: &mut Value, part: &Part) {
    let distinct = |of: fn(&crate::fleet::part::Row) -> String| {
        let mut all: Vec<String> = part.rows.iter().map(of).collect();
        all.sort();
        all.dedup();
        all.len()
    };
    about["vehicles"] = distinct(|r| r.vehicle.clone()).into();
    about["deployments"] = distinct(|r| format!("{}\n{}", r.vehicle, r.deployment)).into();
    about["dives"] = part.rows.iter().filter(|r| r.dive.dive > 0).count().into();
    let out = part.rows.iter().filter(|r| !r.left_out.is_empty());
    about["left_out"] = out.map(|r| json!({"flight": format!("{}/{}", r.deployment, r.flight), "why": r.left_out})).collect();
}

/// Pools a whole table and says what comes of it.
fn conclude(part: &Part, mut about: Value, share: f64, output: &Output) -> Verdict {
    let numbers = pooled(part);
    counted(&mut about, part);
    about["false_names"] = share.into();
    about["named"] = numbers.iter().filter(|n| n.q < share).map(|n| n.asked.name).collect();
    about["numbers"] = numbers.iter().map(|n| n.document(share)).collect();
    output.emit(&about, || said(&about, &numbers, share));
    if numbers.iter().any(|n| n.q < share) { Verdict::Negative } else { Verdict::Ok }
}

fn said_of_flights(about: &Value) {
    for out in about["left_out"].as_array().into_iter().flatten() {
        let text = |key: &str| out[key].as_str().unwrap_or_default().to_owned();
        println!("{}", wrapped(&format!("Left out: {}: {}", text("flight"), text("why")), 10));
    }
    let from_cache =
        about["flights_from_cache"].as_u64().filter(|n| *n > 0).map_or_else(String::new, |n| format!(", {n} flights done before"));
    println!("{} dives, {} deployments, {} vehicles{from_cache}", about["dives"], about["deployments"], about["vehicles"]);
    if let Some(out) = about["out"].as_str() {
        println!("{out}  SHA-256 {}", about["sha256"].as_str().unwrap_or_default());
    }
}

fn said(about: &Value, numbers: &[FleetNumber], share: f64) {
    let mut t = table(["number", "fleet, 90 %", "unit", "best dive p", "q", "named"]);
    for n in numbers.iter().take(12) {
        let (low, high) = n.interval();
        t.add_row([
            n.asked.name.to_owned(),
            format!("{} ± {}", rounded(n.pooled.value, low, high), rounded(high - n.pooled.value, low, high)),
            n.asked.unit.to_owned(),
            format!("{:.0e}", n.pooled.best_dive_p),
            format!("{:.0e}", n.q),
            if n.q < share { "yes" } else { "" }.to_owned(),
        ]);
    }
    println!("{t}\nfleet: beyond the vehicle files, one number at a time; q: share of false names among all down to this one");
    if numbers.iter().all(|n| n.q >= share) {
        println!("No number is named.");
    }
    said_of_flights(about);
}
