//! `glider timeline`.

use super::calibrate::named_once;
use super::diagnose::bar;
use super::{Output, Verdict, surfacing};
use crate::fleet::archive::read_dated;
use crate::pages::plots::Paper;
use crate::pages::timeline_document::document;
use crate::pages::timeline_figure::figure;
use crate::terminal::{rounded, say, table, wrapped};
use anyhow::{Context as _, bail};
use discovery::history::kinds::DIVES_PER_ALARM;
use discovery::history::shown::{LEVELS_SHOWN, name_and_unit, place};
use discovery::workbench::mission_clock::{When, one_clock};
use discovery::workbench::timeline::{Event, Level, Mission, Timeline};
use logs::Flight;
use logs::export::table::Table;
use rig::flight::file_kinds::is_surfacings;
use rig::flight::vehicles;
use rig::spelling::meant_path;
use rig::whole_file;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider timeline mission_dir --vehicle calibrated.json
  glider timeline june.csv july.csv --vehicle calibrated.json --out mission.png --out mission.parquet
  glider timeline missions_dir --vehicle calibrated.json --json
  glider timeline mission.srf --vehicle calibrated.json --config controller.toml
The vehicle file is best one that glider calibrate wrote: levels are relative to it.

A PATH is a flight directory (flight.csv), a csv, a glider's own files as glider import takes them, or a folder of flight directories,
taken in the order of their names. Where packets of surfacings are all there is, it is their files (.srf, in the order of time) or
the log of a glider's terminal. Flights that all have a date (import.json) are taken by it, whatever the order.
Each dive (or segment with its yos) is one point.
The ending of --out decides: .svg, .pdf, .png (figure), .csv, .json, .parquet (one row a dive). It may be given more than once.
Exit code 0: done, whether or not a change is named; 2: bad input.")]
pub struct Args {
    /// Flights of one mission, in order.
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// Vehicle file that the mission is judged by, or a built-in one by name.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: PathBuf,
    /// Of messages of surfacings: the controller's configuration that the board flew with; default: its hull is that of the vehicle file.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where the figure or the numbers go.
    #[arg(long, value_name = "FILE")]
    out: Vec<PathBuf>,
    /// Dives in which one false alarm is accepted.
    #[arg(long, value_name = "N", default_value_t = DIVES_PER_ALARM)]
    dives_per_alarm: f64,
}

/// The flights behind a path, in order.
fn flights_behind(path: &Path) -> anyhow::Result<Vec<PathBuf>> {
    anyhow::ensure!(path.exists(), "{}: no such flight{}", path.display(), meant_path(path));
    if !path.is_dir() || path.join("flight.csv").is_file() {
        return Ok(vec![path.to_path_buf()]);
    }
    let entries = std::fs::read_dir(path).with_context(|| path.display().to_string())?;
    let mut inside: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    inside.retain(|p| p.join("flight.csv").is_file() || p.extension().is_some_and(|e| e == "srf"));
    inside.sort();
    Ok(if inside.is_empty() { vec![path.to_path_buf()] } else { inside })
}

/// A flight as it was named.
struct Named {
    path: PathBuf,
    flight: Flight,
    zero_unix_s: Option<f64>,
}

/// Reads the flights, each once; those of one name are known by their paths.
fn flights(paths: &[PathBuf]) -> anyhow::Result<Vec<Named>> {
    let mut out: Vec<Named> = Vec::with_capacity(paths.len());
    for path in paths {
        logs::stop::here();
        let (flight, zero_unix_s) = read_dated(std::slice::from_ref(path))?;
        named_once(path, &flight, out.iter().map(|n| (&n.path, &n.flight)))?;
        out.push(Named { path: path.clone(), flight, zero_unix_s });
    }
    let names: Vec<String> = out.iter().map(|n| n.flight.name.clone()).collect();
    for one in &mut out {
        if names.iter().filter(|name| **name == one.flight.name).count() > 1 {
            one.flight.name = one.path.display().to_string();
        }
    }
    Ok(out)
}

/// What is said where the flights' own vehicle files name several wing sets.
fn wings_of_several(paths: &[PathBuf]) -> Option<String> {
    let own = paths.iter().flat_map(|p| logs::vehicle::files_next_to(p)).filter_map(|file| vehicles::read(&file).ok());
    let wings: BTreeSet<String> = own.filter_map(|v| v.document["wing"]["name"].as_str().map(Into::into)).collect();
    let all = wings.into_iter().collect::<Vec<_>>().join(" and ");
    all.contains(" and ")
        .then(|| format!("these are flights of several vehicles, of {all} wings: what changed between them is the vehicle"))
}

/// Endings of `--out`.
const ENDINGS: [&str; 6] = ["svg", "pdf", "png", "csv", "json", "parquet"];

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let inputs: Vec<&Path> = args.paths.iter().chain([&args.vehicle]).map(PathBuf::as_path).collect();
    for out in &args.out {
        whole_file::may_write(out, &inputs, &ENDINGS, output.force)?;
    }
    if !(10.0..=1e9).contains(&args.dives_per_alarm) {
        bail!("--dives-per-alarm {}: expected 10 to 1000000000; 1000 is usual", args.dives_per_alarm);
    }
    let vehicle = vehicles::read(&args.vehicle)?;
    let mut paths = Vec::new();
    for path in &args.paths {
        paths.extend(flights_behind(path)?);
    }
    if paths.iter().any(|p| is_surfacings(p)) {
        return surfacings(args, &paths, output);
    }
    let flights = flights(&paths)?;
    let clock = one_clock(&flights.iter().map(|f| When::of(&f.flight, f.zero_unix_s)).collect::<Vec<_>>());
    let bar = bar();
    bar.set_message("what changed");
    let mut mission = Mission::new(&vehicle);
    for (which, zero_s) in &clock.flights {
        logs::stop::here();
        mission.add(&flights[*which].flight, *zero_s);
    }
    let done = mission.finish(args.dives_per_alarm);
    bar.finish_and_clear();
    let mut done = done?;
    done.notes.splice(0..0, clock.notes.into_iter().chain(wings_of_several(&paths)));
    for out in &args.out {
        write(out, &done)?;
    }
    let mut document = document(&done, &args.vehicle);
    // Days count from it.
    let dated = flights.iter().all(|f| f.zero_unix_s.is_some());
    document["start_unix_s"] = clock.flights.first().filter(|_| dated).and_then(|(which, _)| flights[*which].zero_unix_s).into();
    output.emit(&document, || said(&done, &args.out));
    Ok(Verdict::Ok)
}

/// A mission of which packets are all there is.
fn surfacings(args: &Args, paths: &[PathBuf], output: &Output) -> anyhow::Result<Verdict> {
    if let Some(log) = paths.iter().find(|p| !is_surfacings(p)) {
        bail!("{}: no messages of surfacings as the others are; name files of one kind", log.display());
    }
    let judges = surfacing::Judges::read(None, Some(&args.vehicle), args.config.as_deref())?.context("a vehicle is named")?;
    let done = judges.judge().mission(&surfacing::messages(paths)?)?.finish(args.dives_per_alarm)?;
    for out in &args.out {
        write(out, &done)?;
    }
    let mut document = document(&done, &args.vehicle);
    document["start_unix_s"] = Value::Null;
    output.emit(&document, || said(&done, &args.out));
    Ok(Verdict::Ok)
}

fn write(out: &Path, done: &Timeline) -> anyhow::Result<()> {
    let ending = out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let bytes: Vec<u8> = match ending.as_str() {
        "svg" | "pdf" | "png" => figure(&[document(done, Path::new(""))])?.bytes(&ending, &Paper::SCREEN)?,
        "csv" => rows_csv(done).into(),
        "parquet" => {
            let mut bytes = Vec::new();
            columns(done).write("dives", &mut bytes).with_context(|| out.display().to_string())?;
            bytes
        }
        _ => format!("{:#}\n", document(done, Path::new(""))).into(),
    };
    whole_file::write(out, bytes).with_context(|| format!("cannot write {}", out.display()))
}

/// One row a dive.
fn columns(done: &Timeline) -> Table {
    let rows = &done.rows;
    let whole = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
    let whole_numbers = vec![
        ("dive".to_owned(), rows.iter().map(|r| whole(r.number)).collect()),
        ("segment".to_owned(), rows.iter().map(|r| whole(r.segment as usize)).collect()),
        ("rows".to_owned(), rows.iter().map(|r| whole(r.rows)).collect()),
    ];
    let texts = vec![("flight".to_owned(), rows.iter().map(|r| r.flight.clone()).collect())];
    let mut numbers = vec![
        ("day".to_owned(), rows.iter().map(|r| r.day).collect()),
        ("depth_m".to_owned(), rows.iter().map(|r| r.depth_m).collect()),
        ("chance".to_owned(), rows.iter().map(|r| r.compared.as_ref().map_or(f64::NAN, |c| c.chance.0)).collect()),
    ];
    for (k, t) in LEVELS_SHOWN.iter().enumerate() {
        let unit = if t.unit == "%" { "percent" } else { t.unit };
        type Part = (&'static str, fn(&Level) -> f64);
        let parts: [Part; 3] = [("", |l| l.value), ("_low", |l| l.low), ("_high", |l| l.high)];
        for (part, of) in parts {
            numbers.push((format!("{}_{unit}{part}", t.name), rows.iter().map(|r| of(&r.levels[k])).collect()));
        }
    }
    Table { whole: whole_numbers, texts, numbers, ..Table::default() }
}

fn rows_csv(done: &Timeline) -> String {
    let Table { whole, texts, numbers, .. } = columns(done);
    let heads = whole.iter().map(|c| &c.0).chain(texts.iter().map(|c| &c.0)).chain(numbers.iter().map(|c| &c.0));
    let mut out = heads.cloned().collect::<Vec<_>>().join(",") + "\n";
    for i in 0..done.rows.len() {
        let number = |v: f64| if v.is_finite() { format!("{v:.6}") } else { String::new() };
        let fields = whole.iter().map(|c| c.1[i].to_string());
        let fields = fields.chain(texts.iter().map(|c| c.1[i].replace(',', ";"))).chain(numbers.iter().map(|c| number(c.1[i])));
        out += &(fields.collect::<Vec<_>>().join(",") + "\n");
    }
    out
}

fn with_interval(l: &Level, unit: &str) -> String {
    let [value, low, high] = [l.value, l.low, l.high].map(|v| rounded(v, l.low, l.high));
    let sign = if l.value > 0.0 { "+" } else { "" };
    format!("{sign}{value} {unit} (90 %: {low} to {high})")
}

fn sentence(e: &Event) -> String {
    let t = &LEVELS_SHOWN[place(e.change.kind.number)];
    let when = if e.between.0 == e.between.1 {
        format!("from dive {} (day {:.2})", e.dive, e.day)
    } else {
        format!("from dive {} (day {:.2}; 90 %: dive {} to {})", e.dive, e.day, e.between.0, e.between.1)
    };
    if !e.several.is_empty() {
        let one = |(column, size): &(usize, Level)| {
            let (name, unit) = name_and_unit(*column);
            format!("{} {}", name.replace('_', " "), with_interval(size, unit))
        };
        return format!("unnamed: {when} these moved together: {}.", e.several.iter().map(one).collect::<Vec<_>>().join("; "));
    }
    let mut out = format!("{}: {} {}, {when}", e.name(), t.name.replace('_', " "), with_interval(&e.size, t.unit));
    if let Some(per_day) = e.per_day {
        out += &format!(", {per_day:+.2} {} a day", t.unit);
    }
    if let Some(range) = e.range_percent {
        out += &format!("; range {range:+.1} %");
    }
    out + "."
}

/// Most rows of the table on a terminal.
const MOST_ROWS_SHOWN: usize = 40;

fn said(done: &Timeline, out: &[PathBuf]) {
    for note in &done.notes {
        say(&wrapped(&format!("Note: {note}"), 6));
    }
    let mut t = table(["dive", "day", "m", "drag, %", "lift, %", "trim, cc", "pitch, °", "hull, %"]);
    let every = done.rows.len().div_ceil(MOST_ROWS_SHOWN).max(1);
    for r in done.rows.iter().step_by(every) {
        let cell = |k: usize| {
            let l = &r.levels[k];
            let half = 0.5 * (l.high - l.low);
            format!("{}±{}", rounded(l.value, l.low, l.high), rounded(half, l.low, l.high))
        };
        t.add_row([
            r.number.to_string(),
            format!("{:.2}", r.day),
            format!("{:.0}", r.depth_m),
            cell(0),
            cell(1),
            cell(2),
            cell(3),
            cell(4),
        ]);
    }
    say(&format!(
        "{t}\npitch: zero of the sensor; hull: compressibility; levels relative to the vehicle file, ± 90 %{}",
        if every > 1 { format!("; one dive in {every} is shown") } else { String::new() }
    ));
    say(&format!(
        "False alarms expected in {} dives: {:.2} (threshold {:.2} sigma)",
        done.rows.len(),
        done.expected_false_alarms,
        done.threshold
    ));
    for path in out {
        say(&path.display().to_string());
    }
    let odd = done.rows.iter().filter_map(|r| Some((r, r.departs()?)));
    for (r, what) in odd.take(MOST_ROWS_SHOWN) {
        say(&wrapped(&format!("dive {} (day {:.2}) departs from those before it: {what}.", r.number, r.day), 2));
    }
    if done.events.is_empty() {
        say("No change is named.");
    }
    for e in &done.events {
        say(&wrapped(&sentence(e), 2));
        say(&wrapped(&format!("  {}", e.about()), 2));
        if e.several.is_empty() && !e.others.is_empty() {
            let others = e.others.iter().map(|(c, size)| {
                let t = &LEVELS_SHOWN[place(c.kind.number)];
                format!("{} ({})", c.kind.name, with_interval(size, t.unit))
            });
            say(&wrapped(&format!("  not distinguished from it: {}", others.collect::<Vec<_>>().join("; ")), 2));
        }
    }
}
