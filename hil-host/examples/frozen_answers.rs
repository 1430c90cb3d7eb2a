//! What the workbench answers on about two hundred fixed flights, as one file and one SHA-256.
//!
//! A change that only moves code leaves every byte of it; one that changes what is computed names the flights it changed:
//!
//! ```sh
//! cargo run --release -p hil-host --example frozen_answers -- --every 7 --out before.json
//! cargo run --release -p hil-host --example frozen_answers -- --every 7 --against before.json
//! ```
//!
//! Each flight is diagnosed, compared with its vehicle, the answer (or the best hypothesis) is added, and the next flight is planned.
//! Flights: sealed cases of the plant, plain and lifelike; the same with a hurt sensor; flights of our own controller in the simulated
//! sea; real flights of the folder named by GLIDER_FLIGHTS (without it they are left out, and the hash is another).

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context as _;
use clap::Parser;
use discovery::diagnosis::report;
use discovery::diagnosis::{Diagnosis, diagnose};
use discovery::hypotheses::search::Depth;
use discovery::workbench::{add, compare, next_flight};
use hil_host::cli;
use indicatif::{ProgressBar, ProgressStyle};
use logs::digest::{hex, sha256};
use logs::record::csv;
use logs::{Flight, Vehicle, vehicle};
use plant::trials::{Banking, Spec, files, generate};
use plant::{Effect, EffectKind, World};
use rayon::prelude::*;
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::recorder::Recorder;
use rig::flight::worlds;
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use serde_json::{Map, Value, json};
use sha2::{Digest as _, Sha256};
use signals::{Goal, Leg, Mission, Wings};

/// Answers on fixed flights and their SHA-256.
#[derive(Parser)]
#[command(after_help = "Exit code 0: done; 1: answers differ from --against; 2: bad input.")]
struct Args {
    /// Only every so many flights of the list.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Only flights whose name begins so (sealed, lifelike, hurt, loop, real).
    #[arg(long)]
    part: Option<String>,
    /// Where to write the answers.
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Answers of before: name the flights that differ.
    #[arg(long, value_name = "FILE.json")]
    against: Option<PathBuf>,
    /// Worker threads.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
}

/// One flight of the list: its name, and what makes it.
struct Entry {
    name: String,
    make: Box<dyn Fn() -> anyhow::Result<(Flight, Vehicle)> + Sync + Send>,
}

impl Entry {
    fn new(name: String, make: impl Fn() -> anyhow::Result<(Flight, Vehicle)> + Sync + Send + 'static) -> Self {
        Self { name, make: Box::new(make) }
    }
}

/// A sealed case, written in the flight format and read back.
fn case(spec: &Spec, seed: u64, index: usize) -> anyhow::Result<(Flight, Vehicle)> {
    let case = generate(spec, seed, index);
    let csv = files::csv(&case.rows, case.vehicle.sensors.speed_m_s.is_some());
    let document = case.vehicle.document(&case.name).to_string();
    Ok((csv::parse(&csv, Path::new("flight.csv"), &case.name)?, vehicle::parse_text(&document, Path::new("vehicle.json"))?))
}

fn sealed(list: &mut Vec<Entry>) {
    for (i, spec) in plant::trials::plan(120, 41, None).into_iter().enumerate() {
        list.push(Entry::new(format!("sealed-{i:03}"), move || case(&spec, 41, i)));
    }
    for (i, spec) in plant::trials::plan(12, 43, None).into_iter().enumerate() {
        let spec = Spec { lifelike: Some(if i % 2 == 0 { Banking::Tilts } else { Banking::Turns }), ..spec };
        list.push(Entry::new(format!("lifelike-{i:02}"), move || case(&spec, 43, i)));
    }
}

/// A way to hurt a log, over part of it.
type Damage = (&'static str, fn(&mut Flight));

const DAMAGES: [Damage; 8] = [
    ("pressure-stuck", |f| stick(&mut f.pressure_pa)),
    ("pitch-stuck", |f| stick(&mut f.pitch_rad)),
    ("ballast-gap", |f| third(&mut f.ballast_m3).iter_mut().take(30).for_each(|v| *v = f64::NAN)),
    ("ballast-zeros", |f| f.ballast_m3.iter_mut().skip(40).step_by(97).for_each(|v| *v = 0.0)),
    ("heading-stuck", |f| stick(&mut f.heading_rad)),
    ("pressure-zero", |f| f.pressure_pa.iter_mut().for_each(|v| *v += 1.5e4)),
    ("pitch-spikes", |f| f.pitch_rad.iter_mut().skip(11).step_by(173).for_each(|v| *v = -*v)),
    ("density-silent", |f| third(&mut f.density_kg_m3).iter_mut().for_each(|v| *v = f64::NAN)),
];

/// The middle third of a channel.
fn third(values: &mut [f64]) -> &mut [f64] {
    let n = values.len();
    &mut values[n / 3..2 * n / 3]
}

/// A tenth of a channel keeps its first value.
fn stick(values: &mut [f64]) {
    let rows = third(values);
    let held = rows.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    rows.iter_mut().take(40).filter(|v| v.is_finite()).for_each(|v| *v = held);
}

fn damaged(list: &mut Vec<Entry>) {
    for (i, spec) in plant::trials::plan(24, 20_261_146, None).into_iter().enumerate() {
        let (what, damaged) = DAMAGES[i % DAMAGES.len()];
        list.push(Entry::new(format!("hurt-{i:02}-{what}"), move || {
            let (mut flight, vehicle) = case(&spec, 20_261_146, i)?;
            damaged(&mut flight);
            Ok((flight, vehicle))
        }));
    }
}

/// Six dives at pitches, drives and headings of their own, flown by our controller.
fn closed_loop(name: &str, wings: Wings, depth_max_m: f32, hidden: Option<Effect>, seed: u64) -> anyhow::Result<(Flight, Vehicle)> {
    let settings = [(18.0, 230, 0.0), (26.0, 150, 90.0), (35.0, 200, 180.0), (22.0, 100, 270.0), (30.0, 230, 45.0), (24.0, 120, 200.0_f32)];
    let leg = |(pitch, ballast, heading): (f32, i16, f32)| Leg {
        dives: 1,
        depth_max_m,
        goal: Goal::FixedPitch { pitch_rad: pitch.to_radians() },
        ballast_m3: f32::from(ballast) * 1e-6,
        heading_rad: heading.to_radians(),
        ..Leg::default()
    };
    let mission = Mission { wings, legs: settings.into_iter().map(leg).collect(), max_duration_s: 48 * 3600, surface_every: 1 };
    let mut scenario = worlds::for_mission(&mission);
    scenario.ocean.background_rms_m_s = 0.003;
    scenario.effects = hidden.into_iter().collect();
    scenario.seed = seed;
    let parent = std::env::temp_dir().join(format!("frozen-answers-{}-{name}", std::process::id()));
    // The folder's own name gets into the log: it is the same every time.
    let folder = parent.join(name);
    let mut world = World::new(scenario).map_err(|e| anyhow::anyhow!("{e}"))?;
    let setup = Setup::new(mission);
    let mut recorder = Recorder::create(&folder, &world, &setup)?;
    fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |c| recorder.push(c))?;
    recorder.finish(json!({}))?;
    let document = std::fs::read_to_string(folder.join("vehicle.json"))?;
    let flown = (csv::flight(&folder)?, vehicle::parse_text(&document, Path::new("vehicle.json"))?);
    std::fs::remove_dir_all(&parent)?;
    Ok(flown)
}

fn loops(list: &mut Vec<Entry>) {
    let hidden = std::iter::once(None).chain(EffectKind::ALL.iter().map(|k| Some(*k)));
    for (i, kind) in hidden.enumerate() {
        let (wings, depth) = if i % 2 == 0 { (Wings::Standard, 60.0) } else { (Wings::LowAspectRatio, 40.0) };
        let name = format!("loop-{i:02}-{}", kind.map_or("nothing", EffectKind::name));
        let of = name.clone();
        list.push(Entry::new(name, move || closed_loop(&of, wings, depth, kind.map(Effect::typical), 500 + i as u64)));
    }
}

/// An error injected into a vehicle file or a log.
type Injected = (&'static str, fn(&mut Flight, &mut Vehicle));

const INJECTED: [Injected; 5] = [
    ("as-given", |_, _| {}),
    ("rigid", |_, v| v.constants.compressibility_per_pa = 0.0),
    ("athermal", |_, v| v.constants.thermal_expansion_per_k = 0.0),
    ("ballast", |f, _| f.ballast_m3.iter_mut().for_each(|b| *b /= 1.1)),
    ("pressure-zero", |f, _| f.pressure_pa.iter_mut().for_each(|p| *p += 1.5e4)),
];

fn real(list: &mut Vec<Entry>) {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS); the hash is of the others alone");
        return;
    };
    let vehicles = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../vehicles");
    let files = [
        ("slocum_comet2016/comet2016_tidy.csv", vehicles.join("comet.toml"), 5),
        ("slocum_modena2015/modena-2015-175-0-1_tidy.csv", vehicles.join("modena.toml"), 3),
        ("slocum_modena2015/modena-2015-187-0-12_tidy.csv", vehicles.join("modena.toml"), 3),
        ("slocum_modena2015/modena-2015-191-0-34_tidy.csv", vehicles.join("modena.toml"), 3),
        ("example_trials/example_lake/flight.csv", root.join("example_trials/example_lake/vehicle.json"), 4),
        ("example_trials/example_sea/flight.csv", root.join("example_trials/example_sea/vehicle.json"), 4),
    ];
    for (file, vehicle_file, count) in files {
        for (what, inject) in &INJECTED[..count] {
            let (log, vehicle_file) = (root.join(file), vehicle_file.clone());
            list.push(Entry::new(format!("real-{}-{what}", file.replace('/', "-")), move || {
                let text = std::fs::read_to_string(&log).with_context(|| log.display().to_string())?;
                let document = std::fs::read_to_string(&vehicle_file).with_context(|| vehicle_file.display().to_string())?;
                let name = vehicle_file.file_name().map(PathBuf::from).unwrap_or_default();
                let (mut flight, mut vehicle) = (csv::parse(&text, Path::new(file), file)?, vehicle::parse_text(&document, &name)?);
                inject(&mut flight, &mut vehicle);
                Ok((flight, vehicle))
            }));
        }
    }
    for file in ["slocum_comet2019/raw", "seaglider_sg561/p5610005.nc", "seaglider_sg171/p1710104.nc"] {
        let log = root.join(file);
        let vehicle_file = vehicles.join("comet.toml");
        list.push(Entry::new(format!("real-{}", file.replace('/', "-")), move || {
            let flight = logs::import::import(&log, &[])?.flight;
            Ok((Flight { name: file.to_owned(), ..flight }, vehicle::read(&vehicle_file)?))
        }));
    }
}

/// The numbers a verdict rests on to the last bit: the documents round.
fn bits(d: &Diagnosis) -> String {
    let errors = d.block_error_m_s.iter().chain(&d.fitted_error_m_s).copied();
    let numbers = errors.chain(d.candidates.iter().map(|c| c.log_odds)).chain(d.recalibrated.calibration.iter().copied());
    let mut sum = Sha256::new();
    numbers.for_each(|x| sum.update(x.to_bits().to_le_bytes()));
    hex(&sum.finalize())
}

/// All that is said of one flight; a refusal is an answer too.
fn answers(entry: &Entry) -> Value {
    let (flight, vehicle) = match (entry.make)() {
        Ok(both) => both,
        Err(e) => return json!({"refused": format!("{e:#}").replace(env!("CARGO_MANIFEST_DIR"), "")}),
    };
    let mut out = Map::new();
    out.insert("compare".into(), cli::compare::document(&compare::compare(&flight, &vehicle), &entry.name, "vehicle"));
    let found = match diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}) {
        Ok(found) => found,
        Err(e) => {
            out.insert("diagnose".into(), json!({"refused": e.to_string()}));
            return Value::Object(out);
        }
    };
    let mut document = report::document(&found, &vehicle, &entry.name);
    document["vehicle"] = Value::Null;
    out.insert("diagnose".into(), document);
    out.insert("bits".into(), bits(&found).into());
    let best = found.candidates.iter().map(|c| c.effects.clone()).find(|e| !e.is_empty()).unwrap_or_default();
    let names = if found.answer.is_empty() { best } else { found.answer.clone() };
    let effects: Vec<_> = names.iter().filter_map(|n| hydro::effects::by_name(n)).collect();
    let added = match add::add(&flight, &vehicle, &effects, b"parent") {
        Ok(added) => json!({"said": cli::add::document(&added, &effects, &entry.name), "vehicle": added.vehicle}),
        Err(e) => json!({"refused": e.to_string()}),
    };
    out.insert("add".into(), added);
    let next = next_flight::plan(&found, &vehicle, |_| next_flight::Reach::UNKNOWN).ok().map(|p| cli::next_flight::document(&found, &p));
    out.insert("next_flight".into(), next.into());
    Value::Object(out)
}

/// A document as it is written: numbers are compared to their last digit, of whatever type they were read.
fn text(v: &Value) -> String {
    v.to_string()
}

/// Whether the answers are those of a file of before; names those that are not.
fn same(all: &Map<String, Value>, file: &Path) -> anyhow::Result<bool> {
    let kept = std::fs::read_to_string(file).with_context(|| format!("{}: cannot be read", file.display()))?;
    let before: Map<String, Value> = serde_json::from_str(&kept).with_context(|| format!("{}: no file of answers", file.display()))?;
    let mut differ = 0;
    for (name, now) in all {
        match before.get(name) {
            None => println!("{name}: not in {}", file.display()),
            Some(then) if text(then) != text(now) => {
                let parts = now.as_object().into_iter().flatten().filter(|(k, v)| text(&then[k.as_str()]) != text(v));
                println!("{name}: other answers ({})", parts.map(|(k, _)| k.as_str()).collect::<Vec<_>>().join(", "));
            }
            Some(_) => continue,
        }
        differ += 1;
    }
    println!("{differ} of {} flights differ from {}", all.len(), file.display());
    Ok(differ == 0)
}

static BAR: OnceLock<ProgressBar> = OnceLock::new();

fn run() -> anyhow::Result<bool> {
    let args = Args::parse();
    let mut list = Vec::new();
    sealed(&mut list);
    damaged(&mut list);
    loops(&mut list);
    real(&mut list);
    let mut list: Vec<Entry> = list.into_iter().step_by(args.every as usize).collect();
    list.retain(|e| args.part.as_ref().is_none_or(|p| e.name.starts_with(p.as_str())));
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} flights, {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = BAR.get_or_init(|| ProgressBar::new(list.len() as u64).with_style(style));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs).build()?;
    let all: Map<String, Value> = pool
        .install(|| list.par_iter().map(|e| (e.name.clone(), answers(e))).inspect(|_| bar.inc(1)).collect::<Vec<_>>())
        .into_iter()
        .collect();
    bar.finish_and_clear();
    let text = format!("{:#}\n", Value::Object(all.clone()));
    if let Some(out) = &args.out {
        std::fs::write(out, &text).with_context(|| format!("{}: cannot be written", out.display()))?;
    }
    println!("{}  {} flights", sha256(text.as_bytes()), all.len());
    args.against.as_deref().map_or(Ok(true), |file| same(&all, file))
}

fn main() -> std::process::ExitCode {
    match run() {
        Ok(true) => 0.into(),
        Ok(false) => 1.into(),
        Err(e) => {
            eprintln!("frozen_answers: {e:#}");
            2.into()
        }
    }
}
