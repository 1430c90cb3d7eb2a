//! Fleets that the plant flies: a weak effect that all vehicles have is named, and the table of dives has one digest however it is made.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use discovery::workbench::calibrate::{Logged, Options, calibrate};
use logs::record::csv;
use logs::vehicle;
use plant::trials::mission::{Change, fly};
use plant::trials::{Row, Site, Spec, Wing, files, generate_natural};
use rayon::prelude::*;
use serde_json::Value;

const SEED: u64 = 20_261_127;

fn spec(wing: Wing) -> Spec {
    Spec::clean(Site::Sea, wing)
}

fn put(folder: &Path, rows: &[Row], speed: bool, vehicle: Option<&Value>) {
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::write(folder.join("flight.csv"), files::csv(rows, speed)).expect("written");
    if let Some(vehicle) = vehicle {
        std::fs::write(folder.join("vehicle.json"), format!("{vehicle:#}\n")).expect("written");
    }
}

/// Flies one vehicle: `deployments` folders of flights with `dives` each. Calibrated on its natural trial first, if asked.
fn vehicle_flies(archive: &Path, index: usize, change: Change, deployments: usize, dives: usize, known: bool) {
    let spec = spec(if index.is_multiple_of(2) { Wing::Standard } else { Wing::LowAspectRatio });
    let trial = generate_natural(&spec, SEED, index);
    let speed = trial.vehicle.sensors.speed_m_s.is_some();
    let home = archive.join(format!("vehicle{index}"));
    let given = trial.vehicle.document(&format!("v{index}"));
    let document = if known {
        let scratch = archive.with_extension(format!("trial{index}"));
        put(&scratch, &trial.rows, speed, Some(&given));
        let log = Logged { flight: csv::flight(&scratch).expect("a log"), sha256: String::new() };
        let file = vehicle::read(&scratch.join("vehicle.json")).expect("a vehicle");
        std::fs::remove_dir_all(&scratch).expect("removed");
        calibrate(&[log], &file, &Options::default(), b"", &|_, _| ()).expect("calibrated").vehicle
    } else {
        given
    };
    let flown = fly(&spec, SEED, index, deployments * dives, change, 0);
    let mut segments: Vec<u32> = flown.rows.iter().map(|r| r.segment as u32).collect();
    segments.dedup();
    for (d, mine) in segments.chunks(dives).enumerate() {
        let rows: Vec<Row> = flown.rows.iter().filter(|r| mine.contains(&(r.segment as u32))).cloned().collect();
        put(&home.join(format!("deployment{d}/flight")), &rows, speed, None);
    }
    std::fs::write(home.join("vehicle.json"), format!("{document:#}\n")).expect("written");
}

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("glider-fleets-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }

    fn fleet(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("the program starts")
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
        command.current_dir(&self.0).args(["--json", "fleet"]).args(args);
        command
    }

    fn done(&self, args: &[&str]) -> Value {
        let out = self.fleet(args);
        assert!(out.status.code().is_some_and(|c| c < 2), "{args:?}: {}", String::from_utf8_lossy(&out.stdout));
        serde_json::from_slice(&out.stdout).expect("a document")
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn digest(document: &Value) -> String {
    document["sha256"].as_str().expect("a digest").to_owned()
}

/// One digest: whole, in 3 and in 17 shards in any order, by more workers, with a shared cache, and after kills.
#[test]
fn regress_a_fleet_has_one_digest_however_it_is_worked_through() {
    let here = Scratch::new("digest");
    (0..4_usize).into_par_iter().for_each(|v| vehicle_flies(&here.0.join("archive"), v, Change::Nothing, 3, 2, false));
    std::fs::create_dir_all(here.0.join("archive/vehicle0/broken")).expect("a folder");
    std::fs::write(here.0.join("archive/vehicle0/broken/flight.csv"), "time_s,pressure_dbar\n0,1\nx,2\n").expect("written");
    let whole = here.done(&["archive", "--out", "whole.parquet", "--jobs", "1"]);
    let owed = digest(&whole);
    assert_eq!((&whole["dives"], &whole["vehicles"], &whole["deployments"]), (&24.into(), &4.into(), &13.into()), "{whole}");
    let left_out = whole["left_out"].as_array().expect("a list");
    assert!(left_out.len() == 1 && left_out[0]["why"].as_str().is_some_and(|w| w.contains("flight.csv")), "{left_out:?}");
    let bytes = std::fs::read(here.0.join("whole.parquet")).expect("there");
    assert_eq!(logs::digest::sha256(&bytes), owed, "the digest is the file's");
    for n in [3, 17] {
        let parts: Vec<String> = (1..=n).rev().map(|i| format!("part{i}of{n}.parquet")).collect();
        for (i, part) in (1..=n).rev().zip(&parts) {
            let shard = format!("{i}/{n}");
            here.done(&["archive", "--out", part, "--shard", &shard, "--cache", &format!("cache{n}")]);
        }
        let mut line = vec!["merge", "--out"];
        let out = format!("merged{n}.parquet");
        line.push(&out);
        line.extend(parts.iter().map(String::as_str));
        let merged = here.done(&line);
        assert_eq!(digest(&merged), owed, "{n} shards");
        assert_eq!(merged["numbers"], whole["numbers"], "{n} shards");
        let short: Vec<&str> = std::iter::once("merge").chain(parts.iter().skip(1).map(String::as_str)).collect();
        let refused = here.fleet(&short);
        let said = String::from_utf8_lossy(&refused.stdout).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(&format!("--shard {n}/{n}")), "{said}");
        // --json may stand before merge too.
        let before = Command::new(env!("CARGO_BIN_EXE_glider")).current_dir(&here.0).args(["fleet", "--json"]).args(&short).output();
        assert_eq!(before.expect("the program starts").stdout, refused.stdout);
    }
    // All of it is in the cache: no flight is asked again.
    let again = here.done(&["archive", "--out", "again.parquet", "--cache", "cache17"]);
    assert_eq!((digest(&again), &again["flights_from_cache"]), (owed.clone(), &13.into()));
}

/// A flight that lay in an archive as an export and in a backup as well was counted three times.
#[test]
fn regress_copies_of_one_log_are_counted_once_and_named() {
    let here = Scratch::new("copies");
    vehicle_flies(&here.0.join("archive"), 0, Change::Nothing, 2, 2, false);
    let home = here.0.join("archive/vehicle0");
    let once = here.done(&["archive", "--out", "once.parquet"]);
    let log = std::fs::read_to_string(home.join("deployment0/flight/flight.csv")).expect("a log");
    for backup in ["old/backup/flight", "old/second/flight"] {
        std::fs::create_dir_all(home.join(backup)).expect("a folder");
        std::fs::write(home.join(backup).join("flight.csv"), &log).expect("written");
    }
    let export = Command::new(env!("CARGO_BIN_EXE_glider"))
        .current_dir(&here.0)
        .args(["export", "archive/vehicle0/deployment1/flight", "--to", "netcdf", "--start", "2026-05-02T09:15:00Z"])
        .args(["--vehicle", "archive/vehicle0/vehicle.json", "--out", "archive/vehicle0/deployment1/june.nc"])
        .output();
    let export = export.expect("it starts");
    assert!(export.status.success(), "{export:?}");
    let copied = here.done(&["archive", "--out", "copied.parquet"]);
    assert_eq!((&once["dives"], &copied["dives"]), (&4.into(), &4.into()), "{copied}");
    let drag = |of: &Value| of["numbers"].as_array().expect("numbers").iter().find(|n| n["name"] == "drag").cloned().expect("drag");
    assert_eq!(drag(&copied)["dives"], 4, "{copied}");
    let left_out = copied["left_out"].to_string();
    for (flight, why) in [
        ("archive/vehicle0/old/backup/flight", "the same log as archive/vehicle0/deployment0/flight"),
        ("archive/vehicle0/old/second/flight", "the same log as archive/vehicle0/deployment0/flight"),
        ("archive/vehicle0/deployment1/june.nc", "the same log as archive/vehicle0/deployment1/flight"),
    ] {
        assert!(left_out.contains(flight) && left_out.contains(why), "{left_out}");
    }
    // Shards find the same copies.
    for shard in ["1/2", "2/2"] {
        here.done(&["archive", "--out", &format!("part{}.parquet", &shard[..1]), "--shard", shard]);
    }
    assert_eq!(digest(&here.done(&["merge", "part1.parquet", "part2.parquet", "--out", "merged.parquet"])), digest(&copied));
}

/// Killed each time as soon as one more flight was asked, and taken up again where it was.
#[test]
fn regress_a_killed_fleet_goes_on_to_the_same_digest() {
    let here = Scratch::new("killed");
    (0..3_usize).into_par_iter().for_each(|v| vehicle_flies(&here.0.join("archive"), v, Change::Nothing, 3, 2, false));
    let owed = digest(&here.done(&["archive", "--out", "whole.parquet", "--jobs", "1"]));
    let entries = || {
        std::fs::read_dir(here.0.join("killed.parquet.cache"))
            .map_or(0, |d| d.flatten().filter(|e| e.path().extension().is_some_and(|x| x == "kept")).count())
    };
    let mut between = 0;
    for kill in 0..9 {
        let mut command = here.command(&["archive", "--out", "killed.parquet", "--resume", "--jobs", "1"]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
        while entries() <= kill && child.try_wait().expect("it is asked").is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        let _ = child.kill();
        let _ = child.wait();
        between += u32::from((1..9).contains(&entries()));
        let table = here.0.join("killed.parquet");
        assert!(!table.exists() || logs::export::table::Table::read(std::fs::File::open(&table).expect("opens")).is_ok(), "kill {kill}");
    }
    assert!(between > 0, "no kill came while flights were being asked");
    // What is left of a file that was cut by hand is asked anew.
    let cut = std::fs::read_dir(here.0.join("killed.parquet.cache"))
        .expect("a cache")
        .flatten()
        .map(|e| e.path())
        .find(|p| p.extension().is_some_and(|x| x == "kept"));
    let cut = cut.expect("an entry");
    let text = std::fs::read(&cut).expect("reads");
    std::fs::write(&cut, &text[..text.len() / 3]).expect("written");
    let refused = here.fleet(&["archive", "--out", "killed.parquet"]);
    assert_eq!(refused.status.code(), Some(2), "a cache that nobody asked to use");
    assert!(String::from_utf8_lossy(&refused.stdout).contains("--"), "{refused:?}");
    assert_eq!(digest(&here.done(&["archive", "--out", "killed.parquet", "--resume"])), owed);
}

/// Six calibrated vehicles of which each has a tenth more drag than its file says, and six that have not.
#[test]
fn scorecard_a_drag_that_all_vehicles_have_is_named_and_sized() {
    let here = Scratch::new("named");
    let said = [("draggy", Change::Drag(0.15)), ("clean", Change::Nothing)].map(|(name, change)| {
        (0..6_usize).into_par_iter().for_each(|v| vehicle_flies(&here.0.join(name), v, change, 2, 3, true));
        here.done(&[name, "--out", &format!("{name}.parquet")])
    });
    let number =
        |of: &Value, name: &str| of["numbers"].as_array().expect("numbers").iter().find(|n| n["name"] == name).cloned().expect("a number");
    for (of, truth) in said.iter().zip([15.0, 0.0]) {
        let drag = number(of, "drag");
        eprintln!("{truth} %: {drag}\nnamed: {}", of["named"]);
        let (low, high) = (drag["low"].as_f64().expect("a number"), drag["high"].as_f64().expect("a number"));
        assert!(low < truth && truth < high, "{truth} %: {drag}");
        assert_eq!(drag["named"], truth > 0.0, "{drag}");
        assert_eq!((&drag["dives"], &drag["deployments"], &drag["vehicles"]), (&36.into(), &12.into(), &6.into()));
    }
}
