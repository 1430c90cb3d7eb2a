//! `glider forecast` on a mission made here: five dives on course 060 at 26°, a current of 10 cm/s to the north, the log in two parts.

use logs::Flight;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

const STEP_S: f64 = 10.0;
/// Rows of a dive and of the whole stay around it.
const ROWS: usize = 240;
const CURRENT_M_S: f64 = 0.1;

/// A dive to 60 m and back in a log of its own clock, from `first` on; fixes count from its launch point.
fn log(dives: usize, first: usize) -> Flight {
    let mut f = Flight::blank(dives * ROWS);
    let path_rad = 30f64.to_radians();
    for i in 0..f.len() {
        let (dive, row) = (i / ROWS, i % ROWS);
        let down = (row as f64 - 120.0).abs();
        f.time_s[i] = STEP_S * (i + first * ROWS) as f64;
        f.segment[i] = dive as u32;
        f.pressure_pa[i] = (60.0 - 0.6 * down).max(0.0) * 1025.0 * 9.81;
        f.pitch_rad[i] = 0.45 * if row < 120 { -1.0 } else { 1.0 };
        f.heading_rad[i] = 60f64.to_radians();
        f.ballast_m3[i] = 2e-4 * if row < 120 { -1.0 } else { 1.0 };
        f.density_kg_m3[i] = 1025.0;
        f.temperature_degc[i] = 10.0;
        let gone = if row < 120 { 0.0 } else { 2000.0 * 0.06 / path_rad.tan() };
        if !(5..=235).contains(&row) {
            f.gps_east_m[i] = gone * 60f64.to_radians().sin();
            f.gps_north_m[i] = gone * 60f64.to_radians().cos() + CURRENT_M_S * STEP_S * row as f64;
        }
    }
    f
}

struct Mission(PathBuf);

impl Mission {
    fn new(name: &str) -> Self {
        let root = std::env::temp_dir().join(format!("glider-forecast-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&root).expect("a folder");
        for (part, log) in [("one.csv", log(3, 0)), ("two.csv", log(2, 3))] {
            let file = std::fs::File::create(root.join(part)).expect("a file");
            logs::export::csv::write(&log, file).expect("written");
        }
        Self(root)
    }

    fn glider(&self, line: &str) -> (i32, Value) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
        let out = command.args(line.split(' ')).arg("--json").current_dir(&self.0).output().expect("runs");
        let document = serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{line}: {e}"));
        (out.status.code().expect("a code"), document)
    }
}

impl Drop for Mission {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

const LOGS: &str = "forecast --flight one.csv --flight two.csv --vehicle slocum-standard-sea";

#[test]
fn surfacings_are_forecast_with_the_current_and_written_as_maps() {
    let mission = Mission::new("maps");
    let (code, d) = mission.glider(&format!("{LOGS} --origin 27.4,-90.6 --geojson a.geojson --kml a.kml --to 27.5,-90.6"));
    assert_eq!(code, 0, "{d}");
    let f = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{v}"));
    assert!((f(&d["current_m_s"]["north"]) - CURRENT_M_S).abs() < 0.03, "{}", d["current_m_s"]);
    assert_eq!((&d["coverage"]["surfacings"], &d["coverage"]["inside"]), (&Value::from(4), &Value::from(4)));
    // The next dive is as far as the last one was.
    let first = &d["surfacings"][0];
    let (east, north) = (f(&first["east_m"]) - f(&d["last_fix"]["east_m"]), f(&first["north_m"]) - f(&d["last_fix"]["north_m"]));
    let expected = (2000.0 * 0.06 / 30f64.to_radians().tan() * 60f64.to_radians().sin(), 104.0 + 0.1 * 2320.0);
    assert!((east - expected.0).hypot(north - expected.1) < 30.0, "{east} {north} for {expected:?}");
    assert_eq!(d["surfacings"].as_array().map(Vec::len), Some(3));
    assert!(f(&d["to"]["low"]) < f(&d["to"]["hours"]) && f(&d["to"]["hours"]) < 24.0, "{}", d["to"]);
    let geojson = std::fs::read_to_string(mission.0.join("a.geojson")).expect("written");
    let map: Value = serde_json::from_str(&geojson).expect("JSON");
    assert_eq!(map["features"].as_array().map(Vec::len), Some(7));
    assert!(std::fs::read_to_string(mission.0.join("a.kml")).expect("written").contains("<Polygon>"));
    // The ellipse as a polygon holds nine tenths.
    let ellipse = serde_json::to_string(&map["features"][2]).expect("text");
    std::fs::write(mission.0.join("area.geojson"), ellipse).expect("written");
    let (_, d) = mission.glider(&format!("{LOGS} --origin 27.4,-90.6 --polygon area.geojson"));
    assert!((f(&d["surfacings"][0]["inside"]) - 0.9).abs() < 0.01, "{}", d["surfacings"][0]);
}

#[test]
fn a_forecast_without_a_place_or_without_fixes_says_the_remedy() {
    let mission = Mission::new("remedy");
    let says = |line: &str, what: &str| {
        let (code, d) = mission.glider(line);
        assert!(code == 2 && d["error"].as_str().is_some_and(|e| e.contains(what)), "{line}: {d}");
    };
    says(&format!("{LOGS} --kml a.kml"), "--origin");
    assert!(!Path::new(&mission.0.join("a.kml")).exists());
    says(&format!("{LOGS} --circle 27.4,-90.6,500"), "--origin");
    says(&format!("{LOGS} --origin 27.4"), "expected 2 numbers");
    says("forecast --flight one.csv", "--vehicle");
    let mut bare = log(2, 0);
    bare.gps_east_m.fill(f64::NAN);
    logs::export::csv::write(&bare, std::fs::File::create(mission.0.join("bare.csv")).expect("a file")).expect("written");
    says("forecast --flight bare.csv --vehicle slocum-standard-sea", "GPS fixes before and after");
}

#[test]
fn a_folder_of_logs_is_scored_as_one_mission() {
    let mission = Mission::new("score");
    let (code, d) = mission.glider("scorecard forecast --flights . --vehicle slocum-standard-sea");
    assert_eq!((code, &d["missions"][0]["stretches"]["all"]["surfacings"]), (0, &Value::from(4)), "{d}");
}
