//! `glider forecast` on a mission made here: five dives on course 060 at 26°, a current of 10 cm/s to the north, the log in two parts.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use logs::Flight;
use serde_json::Value;
use signals::Surfacing;
use signals::surfacing::Glide;
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

/// The same dives flown again by order: as long and as far as they were, and known.
#[test]
fn planned_dives_are_as_long_and_as_far_as_those_flown() {
    let mission = Mission::new("planned");
    let leg = "[[leg]]\ndives = 6\ndepth_min_m = 5\ndepth_max_m = 120\nheading_deg = 60\ngoal = \"fixed-pitch\"\npitch_deg = 26\n";
    std::fs::write(mission.0.join("six.toml"), format!("wings = \"standard\"\nsurface_every = 1\n\n{leg}")).expect("written");
    assert_eq!(mission.glider("fly --mission six.toml --seed 4 --log six").0, 0);
    let (_, flown) = mission.glider("forecast --flight six");
    let (code, planned) = mission.glider("forecast --flight six --mission six.toml --surfacings 6");
    assert_eq!(
        (code, &planned["plan"]["known"], planned["surfacings"].as_array().map(Vec::len)),
        (0, &Value::Bool(true), Some(6)),
        "{planned}"
    );
    let off = |a: &Value, b: &Value| a.as_f64().zip(b.as_f64()).map_or(f64::NAN, |(a, b)| a / b - 1.0);
    // By 4 % shorter: the turns of 5 m are not planned.
    assert!(off(&planned["plan"]["hours"], &flown["plan"]["hours"]).abs() < 0.06, "{} {}", planned["plan"], flown["plan"]);
    let [east, north] = ["east_m", "north_m"].map(|key| off(&planned["surfacings"][0][key], &flown["surfacings"][0][key]).abs());
    assert!(east < 0.03 && north < 0.03, "{east} {north}");
    assert!(planned["plan"]["drag_percent"]["value"].as_f64().is_some_and(|d| d.abs() < 10.0), "{}", planned["plan"]);
}

/// Hours from call to call, and what the glides of each dive are.
const CALLS_H: u32 = 3;
const GLIDE: Glide = Glide { time_s: 5000.0, way_m: 600.0, pitch_rad: 0.45, path_rad: 0.52, speed_m_s: 0.25 };

/// The log of a call `k`: the glider's dialogue as public logs have it, and the message of the surfacing. Dives lead to the north-east,
/// a current to the north.
fn call(k: u32) -> String {
    let minutes = |deg: f64| (100.0 * deg.trunc() + 60.0 * deg.fract()) as f32;
    let (way_m, metres) = (f64::from(k) * 10_000.0 * 0.25 * 0.52f64.cos() * 0.5f64.sqrt(), 111_195.0);
    let drift_m = f64::from(k) * f64::from(CALLS_H) * 3600.0 * CURRENT_M_S;
    let (lat, lon) = (33.0 + (way_m + drift_m) / metres, -117.0 + way_m / (metres * 33f64.to_radians().cos()));
    // Far off, on the course that every dive is on.
    let wpt = [33.0 + way_m / metres + drift_m / metres + 1.0, lon + 1.0 / 33f64.to_radians().cos()];
    let glides = [Glide { path_rad: -GLIDE.path_rad, pitch_rad: -GLIDE.pitch_rad, ..GLIDE }, GLIDE];
    let message = STANDARD.encode(Surfacing { glides, ..Surfacing::default() }.encode());
    format!(
        "Vehicle Name: unit\nCurr Time: Sat Mar 28 {:02}:00:38 2026 MT:  169339\nDR  Location:  3310.021 N -11741.800 E measured     60.812 secs ago\n\
GPS TooFar:   69696969.000 N 69696969.000 E measured     1e+308 secs ago\nGPS Location:  {:.4} N {:.4} E measured     38.0 secs ago\n   \
sensor:c_wpt_lat(lat)={:.4}        259.8 secs ago\n   sensor:c_wpt_lon(lon)={:.4}        259.8 secs ago\nextctl: surfacing,{message}\n",
        k * CALLS_H,
        minutes(lat),
        minutes(lon),
        minutes(wpt[0]),
        minutes(wpt[1]),
    )
}

#[test]
fn calls_with_messages_of_surfacings_are_a_mission_that_is_forecast() {
    let mission = Mission::new("calls");
    let logs: String = (0..7)
        .map(|k| {
            std::fs::write(mission.0.join(format!("{k}.log")), call(k)).expect("written");
            format!(" --flight {k}.log")
        })
        .collect();
    let (code, d) = mission.glider(&format!("forecast{logs} --out map.html --circle 33.2,-116.8,5000"));
    assert_eq!((code, &d["coverage"]["surfacings"]), (0, &Value::from(5)), "{d}");
    assert!(d["current_m_s"]["north"].as_f64().is_some_and(|v| (v - CURRENT_M_S).abs() < 0.02), "{}", d["current_m_s"]);
    assert!(d["notes"][0].as_str().is_some_and(|n| n.contains("waypoint")), "{}", d["notes"]);
    let first = &d["surfacings"][0];
    let [lat, lon] = ["lat_deg", "lon_deg"].map(|key| first[key].as_f64().expect("a place"));
    let again = call(7);
    let line = again.lines().find(|l| l.starts_with("GPS Location")).expect("a fix").split_whitespace().collect::<Vec<_>>();
    let degrees = |word: &str| logs::import::position::degrees_of_minutes(word.parse().expect("a number"));
    assert!((lat - degrees(line[2])).hypot(lon - degrees(line[4])) < 0.004, "{lat} {lon} {line:?}");
    let page = std::fs::read_to_string(mission.0.join("map.html")).expect("a page");
    assert!(page.contains("90 % ellipse") && page.contains("area asked for"));
    // A message alone has no place.
    std::fs::write(mission.0.join("alone.srf"), Surfacing { glides: [GLIDE; 2], ..Surfacing::default() }.encode()).expect("written");
    let (code, d) = mission.glider("forecast --flight alone.srf");
    assert!(code == 2 && d["error"].as_str().is_some_and(|e| e.contains("`GPS Location`")), "{d}");
}
