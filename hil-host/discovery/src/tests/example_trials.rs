//! The example trials: nominal model against the stated error figures. Needs `GLIDER_FLIGHTS`.

use crate::likelihood::block_error;
use crate::model::integrator;
use crate::workbench::next_flight;
use crate::{diagnosis, preprocess};
use logs::record::csv;
use logs::vehicle;
use std::path::PathBuf;

fn trials() -> Option<PathBuf> {
    let folder = std::env::var_os("GLIDER_FLIGHTS").map(|f| PathBuf::from(f).join("example_trials")).filter(|f| f.is_dir());
    if folder.is_none() {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS)");
    }
    folder
}

fn block_error(case: &std::path::Path) -> (f64, usize) {
    let vehicle = vehicle::read(&case.join("vehicle.json")).expect("vehicle");
    let flight = csv::flight(case).expect("flight");
    let prepared = preprocess::prepare(&flight, &vehicle);
    let mut errors = Vec::new();
    for run in prepared.runs.iter().filter(|r| vehicle.check_segments.contains(&r.segment)) {
        let track = integrator::track(run, vehicle.constants, &[], vehicle.water_depth_m, Default::default());
        for b in block_error::blocks(run) {
            errors.push(b.observed_m_s - block_error::modelled_m_s(run, &b, &track.depth_m));
        }
    }
    (block_error::rms(errors.iter().copied()), errors.len())
}

/// FORMAT.md states 0.0022 m/s over 37 blocks and 0.0047 m/s over 288 blocks, two implementations agreeing to 2 %; rounding of the
/// stated figures adds 2.3 % and 1.1 %.
#[test]
fn validate_nominal_error_of_the_example_trials() {
    let Some(folder) = trials() else { return };
    for (name, stated, blocks, tolerance) in [("example_lake", 0.0022, 37, 0.05), ("example_sea", 0.0047, 288, 0.05)] {
        let (error, n) = block_error(&folder.join(name));
        eprintln!("{name}: {error:.5} m/s over {n} blocks");
        assert_eq!(n, blocks, "{name}");
        assert!((error / stated - 1.0).abs() < tolerance, "{name}: {error} m/s, stated {stated}");
    }
}

#[test]
fn example_trials_are_adequate_and_plans_ignore_their_pressure() {
    let Some(folder) = trials() else { return };
    for name in ["example_lake", "example_sea"] {
        let case = folder.join(name);
        let vehicle = vehicle::read(&case.join("vehicle.json")).expect("vehicle");
        let flight = csv::flight(&case).expect("flight");
        let d = diagnosis::diagnose(&flight, &vehicle, crate::hypotheses::search::Depth::Pairs, &|_, _| {}).expect("diagnosis");
        assert_eq!(d.verdict, diagnosis::Verdict::Adequate, "{name}");
        // Launches and turns, not the glides after them: once 485 rows of 807 of the lake flight.
        assert!(d.rows_near_stall * 5 < d.rows, "{name}: {} rows left out, {} observations fitted", d.rows_near_stall, d.rows);
        // Recalibration inside the tolerances must not hurt: 10 % of a 37-block rms is its own sampling error.
        assert!(d.block_error_m_s[1] < d.block_error_m_s[0] * 1.1, "{name}: {:?}", d.block_error_m_s);
        // The pressure of check segments must influence nothing: the same fit with that pressure replaced by nonsense (not by a
        // constant: a sensor that is stuck all the time has no depth to run the model by).
        let mut blind = flight.clone();
        for i in 0..blind.len() {
            if vehicle.check_segments.contains(&blind.segment[i]) {
                blind.pressure_pa[i] = 5e4 + 100.0 * ((i * 7) % 23) as f64;
            }
        }
        let b = diagnosis::diagnose(&blind, &vehicle, crate::hypotheses::search::Depth::Pairs, &|_, _| {}).expect("diagnosis");
        assert_eq!(b.recalibrated.calibration, d.recalibrated.calibration, "{name}");
        let p = next_flight::plan(&d, &vehicle, |_| next_flight::Reach::UNKNOWN).expect("two hypotheses at least");
        assert!(p.separation.windows(2).all(|w| w[1] >= w[0] - 1e-9), "{:?}", p.separation);
        assert!(p.separation[p.separation.len() - 1] > p.default_separation, "{name}: {:?} {}", p.separation, p.default_separation);
    }
}

#[test]
fn a_log_without_a_dive_is_refused_with_the_reason() {
    let mut text = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
    for i in 0..200 {
        text += &format!("{},0,0.{},0.1,200,1025.0\n", i * 4, i % 3);
    }
    let flight = csv::parse(&text, std::path::Path::new("f.csv"), "f").expect("reads");
    let json = r#"{"mass_kg":68,"hull_volume_m3":0.068,"hull_compressibility_per_pa":5e-10,"hull_thermal_expansion_per_k":5e-5,
        "wing":{"area_m2":0.11},"hydro":{"reference_area_m2":0.11,"wing_lift_slope_per_rad":3.45,"hull_lift_slope_per_rad":1.2,
        "hull_area_m2":0.0356,"cd0":0.15}}"#;
    let vehicle = vehicle::parse(serde_json::from_str(json).expect("json"), std::path::Path::new("v.json")).expect("vehicle");
    let why = diagnosis::diagnose(&flight, &vehicle, crate::hypotheses::search::Depth::Pairs, &|_, _| {}).expect_err("refused").to_string();
    assert!(why.contains("deeper than 2 m") && why.contains("dbar"), "{why}");
}
