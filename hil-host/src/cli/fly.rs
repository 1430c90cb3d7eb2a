//! `glider fly`.

pub mod extctl;
pub mod own_parts;

use super::diagnose::load_and_ask;
use super::{Output, Verdict};
use crate::score::both_tables::{self, Drawn, WORLDS};
use crate::score::story;
use crate::terminal::{row, say};
use anyhow::{Context, anyhow, bail, ensure};
use discovery::hypotheses::search::Depth;
use discovery::workbench::add;
use indicatif::{ProgressBar, ProgressStyle};
use logs::Vehicle;
use logs::record::bounded;
use logs::vehicle;
use parts::iridium::Fault;
use plant::{Scenario, World};
use rig::flight::closed_loop::{End, FlightError, Outcome, Setup, fly, recover};
use rig::flight::config_file;
use rig::flight::file_kinds::{Kind, expect};
use rig::flight::mission_file::{self, wings_name};
use rig::flight::recorder::Recorder;
use rig::flight::vehicles::{self, Model};
use rig::flight::{other_goal, tables, worlds};
use rig::seats::CYCLE_S;
use rig::seats::{self, Choice, Seat};
use rig::spelling::{meant_path, near};
use serde_json::{Value, json};
use signals::{Mission, Wings};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:\n  glider fly --log out/first\n  glider fly --wings low-ar --seat qemu --log out/rail\n  \
glider fly --mission sea --fault depth:stuck@dive+120s --json\n  glider fly --mission sea --seat extctl --log out/backseat\n  glider fly --seat qemu --extctl\n  glider fly --mission sea --seat parts --log out/parts\n  glider fly --seat parts --modem no-network\n  glider fly --truth truth.toml --seed 7 --log out/hidden\n  \
glider fly --mission sea --table out/table/standard.bin --config out/table/controller.toml\n  \
glider fly --mission sea --world learnt.json --table learnt.json --beside before.json\n\n\
--world flies in the world that a vehicle file describes, or that a flight reveals once what it lacks is found and added; with\n\
--beside the old table flies there too, and the range gained is printed with its 90 % interval over worlds within the tolerances\n\
of the vehicle file.\n\
A fault is target:kind[=size][@phase][+delay][,duration]; a wrong one is answered with the list of all.")]
pub struct Args {
    /// Wings mounted: standard or low-ar; default: the mission's.
    #[arg(long)]
    pub wings: Option<String>,
    /// Built-in mission (shallow 3–27 m, sea 0–200 m, deep 0–1000 m, sweep of pitches to 180 m) or a TOML file.
    #[arg(long, default_value = "shallow")]
    pub mission: String,
    /// in-process, pty, qemu, or the serial port of a board; parts: on its own sensors and motors, the image's drivers on models of the
    /// fitted parts; extctl: as a Slocum's backseat, against a simulated front seat.
    #[arg(long, default_value = "in-process")]
    pub seat: String,
    /// Which law flies: ours or stock (in-process only).
    #[arg(long, default_value = "ours", value_parser = ["ours", "stock"])]
    pub controller: String,
    /// Flight table to fly with (.bin, as `glider table` writes it), or the vehicle file to make it from; default: the controller's own.
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
    /// Fly with this table first, in the same world, and say what --table gains.
    #[arg(long = "beside", value_name = "FILE", requires = "table", conflicts_with = "realtime")]
    pub first_table: Option<PathBuf>,
    /// Controller configuration (.toml); default: the built-in vehicle for the mission's depth.
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Fault to inject, again for more.
    #[arg(long = "fault", value_name = "SPEC")]
    pub faults: Vec<String>,
    /// What shall be true (TOML): vehicle, water, sensors, hidden effects; see docs/truth-file.md.
    #[arg(long, value_name = "FILE")]
    pub truth: Option<PathBuf>,
    /// The world of a vehicle file, or the one that a flight reveals (diagnosed, and what is named added).
    #[arg(long, value_name = "FLIGHT|VEHICLE", conflicts_with = "truth")]
    pub world: Option<PathBuf>,
    /// Seed of all noise.
    #[arg(long)]
    pub seed: Option<u64>,
    /// World seconds per wall second; default: as fast as the line allows.
    #[arg(long, value_name = "X")]
    pub realtime: Option<f64>,
    /// Where the flight log goes (a new directory).
    #[arg(long, value_name = "DIR")]
    pub log: Option<PathBuf>,
    /// Take a board first out of the simulated mission that it is in: called home, shown afloat, recovered.
    #[arg(long)]
    pub recover: bool,
    /// The board on the port, in real time, or the image in QEMU is a Slocum's backseat: the simulated front seat flies against it.
    #[arg(long)]
    pub extctl: bool,
    /// Speed of that line, baud.
    #[arg(long, default_value_t = 9600, requires = "extctl")]
    pub baud: u32,
    /// Modem on the board of --seat parts, and what is wrong with it: none, or dead as if there were no modem.
    #[arg(long, value_name = "FAULT", default_value = "none", value_parser = Fault::ALL.map(|(name, _)| name))]
    pub modem: String,
    /// Image for the QEMU seat; default: the one built by scripts/build-firmware.
    #[arg(long, value_name = "FILE")]
    pub elf: Option<PathBuf>,
}

/// Seats that have a name of their own; any other word is a serial port.
const SEATS: [&str; 5] = ["in-process", "pty", "qemu", "parts", "extctl"];

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let (mission, scenario, vehicle) = mission_and_world(args)?;
    let realtime = match args.realtime {
        Some(x) if !(1e-3..=1e6).contains(&x) => bail!("--realtime {x}: a number from 0.001 to 1000000, such as 1 or 100"),
        x => x,
    };
    let choice = choice(args)?;
    ensure!(
        args.modem == "none" || choice == Choice::Parts,
        "--modem {}: only --seat parts has one; add it, or leave this out",
        args.modem
    );
    if args.extctl || choice == Choice::Extctl {
        return extctl::run(args, output, &mission, &scenario, &choice);
    }
    if choice == Choice::Parts {
        return own_parts::run(args, output, mission, scenario);
    }
    ensure!(args.first_table.is_none() || args.controller == "ours", "--controller stock flies no table; leave out --beside");
    let mut seat = seat(args, &choice)?;
    if args.recover {
        recover(&mut *seat)?;
    }
    let mut setup = Setup { realtime, ..Setup::new(mission.clone()) };
    if let Some(path) = &args.config {
        setup.config = config_file::load(path)?;
    }
    setup.table = args.table.as_deref().map(|path| table_of(path, mission.wings)).transpose()?;
    let both = args.first_table.as_deref().map(|old| with_the_old(old, &setup, &scenario, vehicle.as_ref())).transpose()?;
    // With a fault, another law or a clock that is waited for it would say nothing.
    let alike = choice == Choice::InProcess && args.controller == "ours" && args.faults.is_empty() && realtime.is_none();
    let other = if alike { other_goal::flown(&setup, &scenario)? } else { None };
    let mut world = World::new(scenario).map_err(|e| anyhow!("{e}"))?;
    let mut recorder = match &args.log {
        Some(dir) => Some(Recorder::create(dir, &world, &setup)?),
        None => None,
    };
    let out = match watched(&mut world, &mut *seat, &setup, recorder.as_mut()) {
        Ok(out) => out,
        Err(e) => return Err(recorder.map_or(anyhow!("{e}"), |r| r.cut_short(anyhow!("{e}")))),
    };
    let mut document = summary(&out, &world, args, &mission, &seat.describe());
    if let Some((before, drawn)) = &both {
        let old = before.achieved_l_over_d();
        let other_flight = json!({
            "table": args.first_table, "table_id": format!("{:08x}", before.table_id), "achieved_l_over_d": round(old, 4),
            "distance_m": round(before.distance_m, 2), "end": before.end.to_string(),
        });
        both_tables::add_to(&mut document, other_flight, [old, out.achieved_l_over_d()], Some(drawn));
    }
    if let Some((goal, other)) = &other {
        document["other_goal"] = json!({
            "goal": goal, "joule_per_m": other.joule_per_m().map(|j| round(j, 3)), "achieved_l_over_d": round(other.achieved_l_over_d(), 4),
            "distance_m": round(other.distance_m, 2), "duration_s": round(other.duration_s, 1), "end": other.end.to_string(),
        });
    }
    if let Some(note) = elsewhere(args) {
        document["note"] = json!(note);
    }
    if let Some(r) = recorder {
        r.finish(document.clone())?;
    }
    output.emit(&document, || print(&document, args));
    Ok(verdict(&out, args))
}

/// The old table in this world, and both in worlds that are drawn.
fn with_the_old(path: &Path, setup: &Setup, scenario: &Scenario, vehicle: Option<&Vehicle>) -> anyhow::Result<(Outcome, Drawn)> {
    let old = table_of(path, setup.mission.wings)?;
    let new = setup.table.as_deref().context("--beside asks for --table")?;
    let before = story::fly_table(&old, setup, scenario).with_context(|| format!("with the table of {}", path.display()))?;
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} worlds  {elapsed}").unwrap_or(ProgressStyle::default_bar());
    let bar = ProgressBar::new(WORLDS).with_style(style);
    let drawn = both_tables::in_drawn_worlds([&old, new], setup, scenario, vehicle, &|_| bar.inc(1));
    bar.finish_and_clear();
    Ok((before, drawn))
}

/// What is said of the table of a vehicle file that flies in the world of another vehicle.
fn elsewhere(args: &Args) -> Option<String> {
    let file =
        [&args.table, &args.first_table].into_iter().flatten().find(|t| t.extension().is_some_and(|e| e == "json" || e == "toml"))?;
    let own = args.truth.is_none() && args.world.is_none();
    own.then(|| format!("flown by the built-in vehicle; `--world {}` flies the vehicle of this file", file.display()))
}

/// A mission flown whole, or one ended in SAFE by a fault that was asked for.
pub(super) fn verdict(out: &Outcome, args: &Args) -> Verdict {
    if matches!(out.end, End::Done) || (!args.faults.is_empty() && matches!(out.end, End::Safe(_))) {
        Verdict::Ok
    } else {
        Verdict::Negative
    }
}

/// The mission, the world that truth file, vehicle, seed and faults make of it, and the vehicle of `--world`.
fn mission_and_world(args: &Args) -> anyhow::Result<(Mission, Scenario, Option<Vehicle>)> {
    let mut mission = mission_file::load(&args.mission, worlds::limits)?;
    let asked = args
        .wings
        .as_deref()
        .map(|w| mission_file::parse_wings(w).ok_or_else(|| anyhow!("--wings {w}: standard or low-ar")))
        .transpose()?;
    let mut scenario = worlds::for_mission(&mission);
    if let Some(path) = &args.truth {
        scenario = worlds::overlay(&scenario, path)?;
    }
    let revealed = args.world.as_deref().map(revealed_by).transpose()?;
    let given = revealed.as_ref().map(|(m, _)| m.wings).or(args.truth.is_some().then_some(scenario.wings));
    mission.wings = asked.or(given).unwrap_or(mission.wings);
    if let Some((model, _)) = &revealed {
        ensure!(
            model.wings == mission.wings,
            "--wings {}: the vehicle of --world has {} wings",
            wings_name(mission.wings),
            wings_name(model.wings)
        );
        scenario = story::world_of(model, &mission);
    }
    scenario.wings = mission.wings;
    scenario.seed = args.seed.unwrap_or(scenario.seed);
    for spec in &args.faults {
        scenario.faults.push(spec.parse().map_err(|e: String| anyhow!("{e}"))?);
    }
    Ok((mission, scenario, revealed.map(|(_, vehicle)| vehicle)))
}

/// The seat that is asked for.
fn choice(args: &Args) -> anyhow::Result<Choice> {
    let choice: Choice = args.seat.parse().unwrap_or(Choice::InProcess);
    if let Choice::Port(name) = &choice
        && !Path::new(name).exists()
        && let Some(meant) = near(name, SEATS)
    {
        bail!("--seat {name}: no seat and no port of that name; did you mean `{meant}`?");
    }
    if args.extctl {
        ensure!(
            matches!(choice, Choice::Port(_) | Choice::Qemu),
            "--extctl needs a board: --seat PORT --extctl, or its image: --seat qemu --extctl; without either, --seat extctl"
        );
    }
    Ok(choice)
}

/// Opens it.
fn seat(args: &Args, choice: &Choice) -> anyhow::Result<Box<dyn Seat>> {
    args.elf.as_deref().filter(|e| e.exists()).map_or(Ok(()), |e| expect(e, Kind::Image))?;
    let board_log = args.log.as_ref().map(|d| d.join("board.defmt"));
    match args.controller.as_str() {
        "stock" if *choice != Choice::InProcess => bail!("--controller stock flies in-process only; leave out --seat {choice}"),
        "stock" => Ok(Box::new(seats::stock::Stock::default())),
        _ => {
            if let (Choice::Qemu, Some(dir)) = (choice, &args.log) {
                std::fs::create_dir_all(dir).with_context(|| format!("{}: cannot create this log directory", dir.display()))?;
            }
            Ok(seats::open(choice, args.elf.as_deref(), board_log)?)
        }
    }
}

/// Flies with a progress bar, and records every cycle if asked to.
fn watched(world: &mut World, seat: &mut dyn Seat, setup: &Setup, mut recorder: Option<&mut Recorder>) -> Result<Outcome, FlightError> {
    let bar = progress(&setup.mission);
    let flown = fly(world, seat, setup, &mut |cycle| {
        bar.set_position(u64::from(cycle.answer.trace.dives));
        if ((cycle.time_s / CYCLE_S) as u64).is_multiple_of(64) {
            let t = &cycle.answer.trace;
            bar.set_message(format!("{:.0} s, {:?} at {:.1} m", cycle.time_s, t.phase, cycle.truth.depth_m));
        }
        recorder.as_mut().map_or(Ok(()), |r| r.push(cycle))
    });
    bar.finish_and_clear();
    flown
}

/// The vehicle that a file states, or that a flight reveals.
fn revealed_by(path: &Path) -> anyhow::Result<(Model, Vehicle)> {
    if !path.is_dir() && path.extension().is_none_or(|e| e != "csv") {
        return Ok((Model::load(path, None)?, vehicles::read(path)?));
    }
    let (flight, vehicle, found) = load_and_ask(path, None, Depth::Pairs)?;
    let effects: Vec<_> = found.answer.iter().filter_map(|n| hydro::effects::by_name(n)).collect();
    ensure!(
        !effects.is_empty(),
        "--world {}: this flight reveals no missing effect (verdict: {}); name a vehicle file",
        path.display(),
        found.verdict.name()
    );
    let parent = vehicles::text(&vehicle.path)?.into_bytes();
    let text = add::add(&flight, &vehicle, &effects, &parent)?.vehicle.to_string();
    let vehicle = vehicle::parse_text(&text, &vehicle.path)?;
    Ok((Model::of_coefficients(&vehicle, polar::crc32(text.as_bytes()))?, vehicle))
}

/// The bytes of a table file, or of the table of a vehicle file.
pub(super) fn table_of(path: &Path, wings: Wings) -> anyhow::Result<Vec<u8>> {
    if path.extension().is_some_and(|e| e == "json" || e == "toml") || vehicles::is_built_in(path) {
        let model = Model::load(path, None)?;
        ensure!(
            model.wings == wings,
            "{}: {} wings, and the mission is flown with {}",
            path.display(),
            wings_name(model.wings),
            wings_name(wings)
        );
        return Ok(tables::build(&model, wings, model.id, 0).with_context(|| path.display().to_string())?.bytes);
    }
    ensure!(path.exists(), "{}: no such table{}", path.display(), meant_path(path));
    expect(path, Kind::Table)?;
    let bytes = bounded::bytes(path, bounded::DOCUMENT).with_context(|| format!("{}: cannot read this table", path.display()))?;
    tables::for_wings(&bytes, wings).with_context(|| path.display().to_string())?;
    Ok(bytes)
}

pub(super) fn progress(mission: &Mission) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} dives  {elapsed}  {msg}").unwrap_or(ProgressStyle::default_bar());
    ProgressBar::new(u64::from(mission.dives())).with_style(style)
}

/// What every flight's document begins with.
#[must_use]
pub fn summary_head(args: &Args, mission: &Mission, seat: &str) -> Value {
    json!({
        "wings": wings_name(mission.wings), "controller": args.controller, "seat": args.seat, "seat_detail": seat, "mission": args.mission,
        "tool": env!("CARGO_PKG_VERSION"),
    })
}

/// The JSON document of a flight.
#[must_use]
pub fn summary(out: &Outcome, world: &World, args: &Args, mission: &Mission, seat: &str) -> Value {
    let max = world.best_glide().l_over_d;
    json!({
        "wings": wings_name(mission.wings), "controller": args.controller, "seat": args.seat, "seat_detail": seat,
        "mission": args.mission, "dives": out.dives,
        "distance_m": round(out.distance_m, 2), "displacement_m": round(out.displacement_m, 2), "duration_s": round(out.duration_s, 1),
        "achieved_l_over_d": round(out.achieved_l_over_d(), 4), "max_l_over_d": round(max, 4), "share_of_max": round(out.achieved_l_over_d() / max, 4),
        "share_of_time_near_best": round(out.share_near_best, 4),
        "max_depth_m": round(out.max_depth_m, 2), "depth_band_m": [out.upper_turn_m.map(|u| round(u, 2)), round(out.max_depth_m, 2)],
        "energy_j": round(out.energy_j.1, 1), "pump_energy_j": round(out.energy_j.0, 1),
        "joule_per_m": out.joule_per_m().map(|j| round(j, 3)),
        "actuator_hash": format!("{:016x}", out.actuator_hash), "table_id": format!("{:08x}", out.table_id),
        "seed": world.scenario().seed, "faults": world.scenario().faults.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "cycles": out.cycles, "wall_s": round(out.wall_s, 3), "times_real": round(out.duration_s / out.wall_s.max(1e-9), 0),
        "log": args.log, "end": out.end.to_string(), "tool": env!("CARGO_PKG_VERSION"),
    })
}

fn round(x: f64, decimals: i32) -> f64 {
    let p = 10f64.powi(decimals);
    (x * p).round() / p
}

pub(super) fn print(d: &Value, args: &Args) {
    let n = |k: &str| d[k].as_f64().unwrap_or(f64::NAN);
    let s = |k: &str| d[k].as_str().unwrap_or("").to_owned();
    say(&format!("{} wings, {} controller, mission {} — {}", s("wings"), s("controller"), s("mission"), s("seat_detail")));
    say(&format!("commands       hash {}, {} cycles, {:.0} × real time", s("actuator_hash"), d["cycles"], n("times_real")));
    if let Some(dir) = &args.log {
        say(&format!("log            {}", dir.display()));
    }
    say(&format!("dives          {} in {:.0} s, deepest {:.1} m", d["dives"], n("duration_s"), n("max_depth_m")));
    say(&format!("over ground    {:.0} m, pump {:.0} J, all {:.0} J", n("distance_m"), n("pump_energy_j"), n("energy_j")));
    say(&format!(
        "L/D            {:.3} achieved, {:.3} best, share {:.1} %",
        n("achieved_l_over_d"),
        n("max_l_over_d"),
        100.0 * n("share_of_max")
    ));
    let other = &d["other_goal"];
    let would = match (other["goal"].as_str(), other["joule_per_m"].as_f64(), other["achieved_l_over_d"].as_f64()) {
        (Some(goal), Some(cost), Some(glide)) => format!("; {goal} would take {cost:.2} J/m at L/D {glide:.3}"),
        _ => String::new(),
    };
    say(&format!("energy         {:.2} J/m{would}", n("joule_per_m")));
    if let Some(gain) = d["range_gain_in_words"].as_str() {
        row("beside", &format!("{:.3} with the other table: {gain}", d["beside"]["achieved_l_over_d"].as_f64().unwrap_or(f64::NAN)));
    }
    if let Some(note) = d["note"].as_str() {
        row("note", note);
    }
    say(&format!("end            {}", s("end")));
}
