//! The error figures of a flight are the same in every command and on the page, and a built-in vehicle is taken wherever a file is.

use discovery::diagnosis::diagnose;
use discovery::hypotheses::search::Depth;
use discovery::workbench::add::add;
use discovery::workbench::compare::compare;
use hil_host::score::diagnosis::write_case;
use hil_host::serve::Workbench;
use hil_host::serve::flights::{Evaluate, Open};
use logs::record::csv;
use logs::vehicle;
use plant::trials::{Site, Spec, Wing, generate};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn empty(name: &str) -> Folder {
    let folder = Folder(std::env::temp_dir().join(format!("glider-same-{name}-{}", std::process::id())));
    std::fs::create_dir_all(&folder.0).expect("a temporary folder");
    folder
}

/// The error as given by each of four ways, m/s.
fn as_given(path: &Path) -> [f64; 4] {
    let flight = csv::flight(path).expect("reads");
    let vehicle = vehicle::read(&vehicle::file_next_to(path).expect("one").expect("beside it")).expect("reads");
    let compared = compare(&flight, &vehicle).block_error_m_s;
    let printed = |[held_out, fitted]: [f64; 2]| if held_out.is_finite() { held_out } else { fitted };
    let found = diagnose(&flight, &vehicle, Depth::Singles, &|_, _| ()).expect("a diagnosis");
    let added = add(&flight, &vehicle, &[], b"").expect("a fit");
    let bench = Workbench { offered: vec![path.to_path_buf()], ..Workbench::default() };
    bench.open_flight(&Open { files: Vec::new(), listed: Some(0), example: false }).expect("opens");
    let page = bench.evaluate(&Evaluate { flight: 0, effects: BTreeMap::new() }).expect("known");
    [
        compared,
        printed([found.block_error_m_s[0], found.fitted_error_m_s[0]]),
        printed([added.heldout_m_s[0], added.fitted_m_s[0]]),
        page["error"]["nominal"].as_f64().expect("a figure"),
    ]
}

fn are_one(path: &Path) {
    let all = as_given(path);
    assert!(all[0].is_finite() && all.iter().all(|e| e.to_bits() == all[0].to_bits()), "{}: {all:?}", path.display());
}

/// A flight whose vehicle file says which segments check it, the same where it does not, and one of too few segments to keep any.
#[test]
fn regress_the_error_as_given_is_one_figure_in_every_command_and_page() {
    let folder = empty("figures");
    let clean = Spec::clean(Site::Lake, Wing::Standard);
    let path = write_case(&folder.0, &generate(&clean, 11, 0)).expect("written");
    let file = path.join("vehicle.json");
    let mut stated: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&file).expect("written")).expect("JSON");
    assert!(stated["segments"]["check"].is_array(), "{stated}");
    are_one(&path);
    stated.as_object_mut().expect("a vehicle").remove("segments");
    std::fs::write(&file, stated.to_string()).expect("written");
    are_one(&path);
    let log = std::fs::read_to_string(path.join("flight.csv")).expect("written");
    let few: Vec<&str> =
        log.lines().enumerate().filter(|(k, l)| *k == 0 || matches!(l.split(',').nth(1), Some("0" | "1"))).map(|l| l.1).collect();
    std::fs::write(path.join("flight.csv"), few.join("\n")).expect("written");
    are_one(&path);
}

/// The same of a raw log of a real glider, which names no segments to check it by.
#[test]
fn regress_the_error_as_given_of_a_real_log_is_one_figure() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let folder = empty("real");
    let log = root.join("seaglider_sg561").to_string_lossy().into_owned();
    assert_eq!(glider(&["import", &log, "--out", "mine"], &folder.0).0, 0);
    are_one(&folder.0.join("mine"));
}

/// Exit code, and all that was printed.
fn glider(args: &[&str], work: &Path) -> (i32, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).current_dir(work).stdin(Stdio::null()).output().expect("it starts");
    let text = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    (out.status.code().unwrap_or(-1), text)
}

/// Every command that takes a vehicle file.
const WITH_A_VEHICLE: [&str; 13] = [
    "compare --flight flight --vehicle NAME",
    "diagnose --quick --flight flight --vehicle NAME",
    "add drag_level_error --flight flight --vehicle NAME --out added.json",
    "calibrate --flight flight --vehicle NAME --out calibrated.json",
    "timeline flight --vehicle NAME",
    "fleet flight --vehicle NAME --out fleet.parquet",
    "plot residual --flight flight --before NAME --vehicle NAME --out residual.svg",
    "export flight --to netcdf --vehicle NAME --out flight.nc",
    "import flight/flight.csv --vehicle NAME --out again",
    "next-flight --flight flight --vehicle NAME",
    "polar --vehicle NAME",
    "table --vehicle NAME",
    "fly --mission shallow --table NAME --beside NAME",
];

#[test]
fn a_built_in_vehicle_is_taken_by_name_wherever_a_file_is() {
    let folder = empty("names");
    let work = &folder.0;
    assert_eq!(glider(&["fly", "--mission", "sweep", "--log", "flight"], work).0, 0);
    let mut bad = String::new();
    for line in WITH_A_VEHICLE {
        let line = line.replace("NAME", "slocum-standard");
        let (code, text) = glider(&line.split(' ').collect::<Vec<_>>(), work);
        if !matches!(code, 0 | 1) {
            bad += &format!("glider {line}\n  exit code {code}: {}\n", text.trim());
        }
    }
    assert!(bad.is_empty(), "{bad}");
    assert!(work.join("again/vehicle.toml").is_file(), "the file of the name lies beside the flight");
    // A file of that name goes first.
    let figure = |vehicle: &str| {
        let (code, text) = glider(&["compare", "--flight", "flight", "--vehicle", vehicle, "--json"], work);
        assert_eq!(code, 0, "{vehicle}: {text}");
        let document: serde_json::Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
        document["block_error_m_s"].as_f64().expect("a figure")
    };
    let (by_file, by_name) = (figure("flight/vehicle.json"), figure("slocum-low-ar"));
    assert!((by_file - by_name).abs() > 1e-6, "{by_file} {by_name}");
    std::fs::copy(work.join("flight/vehicle.json"), work.join("slocum-low-ar")).expect("copied");
    assert_eq!(figure("slocum-low-ar").to_bits(), by_file.to_bits());
}
