//! A mission of the plant is watched: what changed is named, dated and sized, and an unchanged one is quiet. The whole campaign is
//! `glider scorecard timeline`.

use crate::case::log_every;
use discovery::history::numbers::DRAG_LEVEL;
use discovery::history::shown::place;
use discovery::workbench::timeline::Mission;
use hil_host::score::timeline::{Alarms, Case, DIVES, Scored, false_alarms, score};
use logs::record::csv;
use logs::vehicle;
use plant::trials::mission::{Change, fly};
use plant::trials::{Site, Spec, Wing, files};
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

const SEED: u64 = 20_261_126;

fn folder(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("glider-watching-{name}-{}", std::process::id()))
}

fn watched(index: usize, dives: usize, change: Change, onset: usize) -> Scored {
    let folder = folder(&format!("{index}"));
    let done = score(Case { index, wing: Wing::Standard, change, onset }, SEED, dives, &folder).expect("a mission can be flown");
    std::fs::remove_dir_all(folder).ok();
    done
}

/// Dives of a vehicle differ by up to 2 % of drag and 6 cm³ when nothing happened.
#[test]
fn scorecard_steps_of_drag_and_trim_are_named_dated_and_sized() {
    for (index, change) in [(0, Change::Drag(0.3)), (1, Change::Trim(-45.0))] {
        let done = watched(index, 24, change, 13);
        assert!(done.near() && done.others == 0, "{change:?}: {:?}", done.named);
        let event = &done.named[0];
        assert!(done.covered, "{change:?}: {event:?}");
    }
}

#[test]
fn scorecard_an_unchanged_mission_raises_alarms_as_often_as_calculated() {
    let done = watched(2, 24, Change::Nothing, 24);
    assert!(done.named.is_empty(), "{:?}", done.named);
    // The whole count, 20,000 dives of ten missions, is the scorecard's.
    let Alarms { dives, alarms, .. } = false_alarms(&[&done], 20 * DIVES, SEED, 2, &|| ()).expect("counted");
    // 1.2 are calculated; five have a probability of 1 %.
    assert!(dives == 20 * DIVES && alarms < 5, "{alarms} in {dives}");
}

/// What the command prints and writes: table, JSON, figure, Parquet; exit code 0 where nothing changed, nothing half-written.
#[test]
fn a_mission_becomes_a_table_a_document_a_figure_and_a_parquet_file() {
    let work = folder("command");
    std::fs::create_dir_all(&work).expect("a temporary folder");
    let glider = |args: &[&str]| {
        let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).current_dir(&work).output().expect("it starts");
        (out.status.code(), String::from_utf8_lossy(&out.stdout).into_owned(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let flown = glider(&["fly", "--mission", "sweep", "--log", "flight"]);
    assert_eq!(flown.0, Some(0), "{flown:?}");
    let calibrated = glider(&["calibrate", "--flight", "flight", "--out", "known.json", "--json"]);
    let done: serde_json::Value = serde_json::from_str(&calibrated.1).unwrap_or_else(|e| panic!("{e}: {calibrated:?}"));
    assert_eq!(done["flights"][0]["sha256"].as_str().map(str::len), Some(64));
    assert!(done["numbers"].as_array().is_some_and(|n| n.len() == 12), "{done}");
    // Which segments checked this flight is no property of the vehicle: a shorter flight has others.
    let has_segments = |file: &str| std::fs::read_to_string(work.join(file)).expect("there").contains("\"segments\"");
    assert!(has_segments("flight/vehicle.json") && !has_segments("known.json"));
    let outs = ["--out", "m.svg", "--out", "m.parquet", "--out", "m.csv", "--out", "m.json"];
    let line: Vec<&str> = ["timeline", "flight", "--vehicle", "known.json"].into_iter().chain(outs).collect();
    let said = glider(&line);
    assert!(said.1.contains("False alarms expected") && said.0 == Some(0), "{said:?}");
    let document: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(work.join("m.json")).expect("written")).expect("a document");
    let dives = document["dives"].as_array().expect("a list").len();
    assert!(dives >= 8 && document["dives"][0]["levels"]["drag"]["value"].is_f64(), "{document}");
    assert_eq!(std::fs::read_to_string(work.join("m.csv")).expect("written").lines().count(), dives + 1);
    let parquet = std::fs::read(work.join("m.parquet")).expect("written");
    assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1"));
    assert!(std::fs::read_to_string(work.join("m.svg")).expect("written").contains("</svg>"));
    // Nothing is overwritten.
    assert_eq!(glider(&line).0, Some(2));
    std::fs::remove_dir_all(work).ok();
}

/// A log of every 60 s was compared with nothing, and a mission of it, whatever happened, was quiet.
#[test]
fn regress_a_log_of_every_minute_shows_a_change_of_drag() {
    let spec = Spec::clean(Site::Sea, Wing::Standard);
    let mut flown = fly(&spec, SEED, 3, 16, Change::Drag(0.5), 8);
    log_every(60.0, &mut flown.rows);
    let folder = folder("minute");
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    std::fs::write(folder.join("flight.csv"), files::csv(&flown.rows, false)).expect("written");
    std::fs::write(folder.join("vehicle.json"), flown.vehicle.document("minute").to_string()).expect("written");
    let known = vehicle::read(&folder.join("vehicle.json")).expect("a vehicle");
    let mut mission = Mission::new(&known);
    mission.add(&csv::flight(&folder).expect("a flight"), 0.0);
    let timeline = mission.finish(1000.0).expect("dives");
    std::fs::remove_dir_all(folder).ok();
    let drag = &timeline.rows[0].levels[place(DRAG_LEVEL)];
    assert!(drag.high - drag.low < 40.0 && timeline.rows.len() >= 12, "{drag:?}, {} dives", timeline.rows.len());
    let snag = timeline.events.iter().find(|e| e.change.kind.number == DRAG_LEVEL);
    assert!(snag.is_some_and(|e| e.dive.abs_diff(9) <= 2 && e.size.low < 60.0 && e.size.high > 40.0), "{:?}", timeline.events);
}

/// Dives of equal number in flights of equal name were taken for parts of one dive, times were added up, and dates were not looked at.
#[test]
fn regress_flights_of_one_name_stay_apart_and_have_their_days() {
    let work = folder("names");
    let flown = fly(&Spec::clean(Site::Sea, Wing::Standard), SEED, 4, 3, Change::Nothing, 0);
    let mut segments: Vec<_> = flown.rows.iter().map(|r| r.segment).collect();
    segments.dedup();
    let day = |n: usize| format!("d{n}/flight");
    let mut begin_days = Vec::new();
    for (n, segment) in segments.iter().enumerate() {
        let mut rows: Vec<_> = flown.rows.iter().filter(|r| r.segment == *segment).cloned().collect();
        rows.iter_mut().for_each(|r| r.segment = 0);
        begin_days.push(rows[0].time_s / 86_400.0);
        std::fs::create_dir_all(work.join(day(n))).expect("a temporary folder");
        std::fs::write(work.join(day(n)).join("flight.csv"), files::csv(&rows, false)).expect("written");
    }
    std::fs::write(work.join("v.json"), flown.vehicle.document("names").to_string()).expect("written");
    let watched = |order: &[usize]| -> (Option<i32>, Value) {
        let named: Vec<String> = order.iter().map(|n| day(*n)).collect();
        let mut line = Command::new(env!("CARGO_BIN_EXE_glider"));
        let out = line.current_dir(&work).args(["--json", "timeline", "--vehicle", "v.json"]).args(named).output().expect("it starts");
        (out.status.code(), serde_json::from_slice(&out.stdout).expect("a document"))
    };
    let days =
        |of: &Value| -> Vec<f64> { of["dives"].as_array().expect("dives").iter().map(|d| d["day"].as_f64().expect("a day")).collect() };
    // A dive is compared from a minute or more after it was begun.
    let near =
        |days: &[f64], expected: &[f64]| days.len() == expected.len() && days.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.02);
    let one_clock = watched(&[0, 1, 2]).1;
    assert!(near(&days(&one_clock), &begin_days), "{begin_days:?}: {one_clock}");
    assert_eq!(one_clock["dives"][2]["flight"], day(2), "flights of one name are known by their paths");
    let undated = watched(&[1, 0, 2]).1;
    assert!(undated["notes"].to_string().contains("they have no date") && days(&undated).len() == 3, "{undated}");
    for n in 0..3 {
        let date = serde_json::json!({"report": {"start_unix_s": 1.7e9 + 864_000.0 * n as f64}});
        std::fs::write(work.join(day(n)).join("import.json"), date.to_string()).expect("written");
    }
    let dated = watched(&[2, 0, 1]).1;
    let expected: Vec<f64> = begin_days.iter().enumerate().map(|(n, day)| day + 10.0 * n as f64).collect();
    assert!(near(&days(&dated), &expected) && dated["dives"][0]["flight"] == day(0), "{expected:?}: {dated}");
    assert!(dated["notes"].to_string().contains("order of their dates"), "{dated}");
    let (code, twice) = watched(&[0, 1, 0]);
    assert!(code == Some(2) && twice.to_string().contains("the same log as d0/flight"), "{code:?} {twice}");
    std::fs::remove_dir_all(work).ok();
}
