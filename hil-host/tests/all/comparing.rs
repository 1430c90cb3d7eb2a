//! What `compare` says where a log is sparse, and where the vehicle file is of another water.

use crate::case::{self, log_every, written};
use discovery::diagnosis::diagnose;
use discovery::hypotheses::search::Depth;
use discovery::workbench::compare::{Comparison, compare};
use logs::{Flight, Vehicle};
use plant::trials::catalogue::{Effect, Strength};
use plant::trials::{Site, Spec, Wing, generate, generate_natural};

fn clean(site: Site) -> Spec {
    Spec::clean(site, Wing::Standard)
}

/// The first natural case at sea that is sampled this sparsely, s.
fn sparse(least_s: f64) -> (Flight, Vehicle) {
    let case = (0..40).map(|i| generate_natural(&clean(Site::Sea), 11, i)).find(|c| c.vehicle.sensors.period_s >= least_s).expect("sparse");
    written(&case)
}

/// A log of every minute missed nothing at all by its own figures: no four samples in any window, and no rate is no residual.
#[test]
fn regress_a_log_of_every_minute_misses_what_a_dense_one_misses() {
    let spec = Spec::single(Site::Sea, Wing::Standard, Effect::DragLevelError, Strength::Strong);
    let mut case = generate(&spec, 11, 0);
    let (dense, vehicle) = written(&case);
    log_every(60.0, &mut case.rows);
    let (sparse, _) = written(&case);
    let [dense, sparse] = [dense, sparse].map(|flight| compare(&flight, &vehicle));
    let ratio = |of: fn(&Comparison) -> f64| of(&sparse) / of(&dense);
    // Of both the same drag is missing; the window of the sparse log is twelve times as long.
    assert!((0.7..1.1).contains(&ratio(|c| c.steady_rms_m_s)), "{} {}", sparse.steady_rms_m_s, dense.steady_rms_m_s);
    assert!((0.7..1.1).contains(&ratio(|c| c.block_error_m_s)), "{} {}", sparse.block_error_m_s, dense.block_error_m_s);
    assert!(dense.rate_window_s == 21.0 && sparse.rate_window_s > 240.0, "{} s", sparse.rate_window_s);
    let spikes = |c: &Comparison| {
        let of = |note: &String| note.split_once(" spikes removed").and_then(|(count, _)| count.parse::<usize>().ok());
        c.notes.iter().filter_map(of).sum::<usize>()
    };
    // One row of fifteen is left; the ends of dives are no spikes.
    assert!(spikes(&sparse) <= 1 + spikes(&dense) / 30, "{:?} {:?}", sparse.notes, dense.notes);
}

#[test]
fn regress_a_log_sampled_every_20_s_has_blocks_and_finite_errors() {
    let (flight, vehicle) = sparse(20.0);
    let c = compare(&flight, &vehicle);
    assert!(c.block_s >= 80.0 && c.blocks.0 > 20, "{} blocks of {} s", c.blocks.0, c.block_s);
    assert!(c.block_error_m_s.is_finite() && c.block_error_m_s < 0.05, "{}", c.block_error_m_s);
    // Longer blocks average more of the water's motion: less than in the 20 s of a dense log.
    assert!(c.noise_floor_m_s > 0.0 && c.noise_floor_m_s < vehicle.background.0, "{} of {}", c.noise_floor_m_s, vehicle.background.0);
}

#[test]
fn regress_for_a_vehicle_file_of_another_water_the_volume_is_named() {
    let (flight, vehicle) = case::read_back(&clean(Site::Sea), 3, 0);
    assert!(compare(&flight, &vehicle).notes.iter().all(|n| !n.contains("floats at")));
    let mut baltic = vehicle.clone();
    // Trimmed for water that is 2 % lighter: about 1,300 cm³ too much hull.
    baltic.constants.hull_volume_m3 *= 1.02;
    let note = compare(&flight, &baltic).notes.into_iter().find(|n| n.contains("floats at")).expect("told");
    let volume: f64 =
        note.split("set hull_volume_m3 to ").nth(1).and_then(|t| t.split(',').next()).and_then(|t| t.parse().ok()).expect("a number");
    // The middle of the water that the dives go through, not that of the tank: 1 part in 2,000.
    assert!((volume / vehicle.constants.hull_volume_m3 - 1.0).abs() < 5e-4, "{note}");
    let refused = diagnose(&flight, &baltic, Depth::Pairs, &|_, _| {}).expect_err("nothing dives");
    assert!(refused.to_string().contains("floats at"), "{refused}");
}

/// JSON of a command that must succeed, in `work`.
fn answer(line: &str, work: &std::path::Path) -> serde_json::Value {
    let args = line.split_whitespace().chain(["--json"]);
    let out = std::process::Command::new(env!("CARGO_BIN_EXE_glider")).args(args).current_dir(work).output().expect("it starts");
    assert_eq!(out.status.code(), Some(0), "{line}: {}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{line}: {e}"))
}

/// The effects of a vehicle and the gaps of a log were lost on the way through NetCDF, and a flight without a date came back as of 1970.
#[test]
fn regress_a_flight_exported_and_imported_again_compares_alike() {
    let work = std::env::temp_dir().join(format!("glider-round-trip-{}", std::process::id()));
    std::fs::create_dir_all(&work).expect("a folder");
    answer("fly --mission shallow --log flight", &work);
    let read = |name: &str| std::fs::read_to_string(work.join(name)).expect(name);
    let json = |name: &str| -> serde_json::Value { serde_json::from_str(&read(name)).expect("JSON") };
    let mut vehicle = json("flight/vehicle.json");
    vehicle["effects"] = serde_json::json!({"own_cd": {"expression": "cd += k*abs(roll)", "k": 0.7}});
    std::fs::write(work.join("flight/vehicle.json"), vehicle.to_string()).expect("written");
    let notes = answer("export flight --to netcdf --out out/f.nc", &work)["notes"].to_string();
    assert!(notes.contains("the flight has no date"), "{notes}");
    answer("import out/f.nc --out again", &work);
    assert_eq!(json("again/vehicle.json"), vehicle);
    assert!(json("again/import.json")["report"]["start_unix_s"].is_null());
    let [first, again] = ["flight", "again"].map(|f| answer(&format!("compare --flight {f}"), &work));
    for key in ["rms_cm_s", "block_error_m_s"] {
        let [a, b] = [&first, &again].map(|c| c[key].as_f64().unwrap_or_else(|| panic!("{key} of {c}")));
        assert!((a / b - 1.0).abs() < 1e-6, "{key}: {a} and {b}");
    }
    // A date is kept, and one that replaces it is not taken in silence; a csv has none.
    answer("export again --to netcdf --start 2026-05-02T09:15:00Z --out out/dated.nc", &work);
    answer("import out/dated.nc --out dated", &work);
    assert_eq!(json("dated/import.json")["report"]["start_unix_s"], 1_777_713_300.0);
    let notes = answer("export dated --to netcdf --start 2026-05-03T09:15:00Z --out out/other.nc", &work)["notes"].to_string();
    assert!(notes.contains("takes the place of the date of import.json") && notes.contains("+86400 s"), "{notes}");
    let notes = answer("export dated --to csv --out out/f.csv", &work)["notes"].to_string();
    assert!(notes.contains("20260502T091500") && notes.contains("keep the flight's import.json"), "{notes}");
    std::fs::remove_dir_all(&work).ok();
}
