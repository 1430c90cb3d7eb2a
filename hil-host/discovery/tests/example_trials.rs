//! The example trials: nominal model against the stated error figures. Needs `GLIDER_FLIGHTS`.

use discovery::{dynamics, metric, prepare, read, vehicle};
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
    let flight = read::flight(case).expect("flight");
    let prepared = prepare::prepare(&flight, &vehicle);
    let mut errors = Vec::new();
    for run in prepared.runs.iter().filter(|r| vehicle.check_segments.contains(&r.segment)) {
        let track = dynamics::track(run, vehicle.constants, &[], vehicle.water_depth_m, 0.0, Default::default());
        for b in metric::blocks(run) {
            errors.push(b.observed_m_s - metric::modelled_m_s(run, &b, &track.depth_m));
        }
    }
    (metric::rms(errors.iter().copied()), errors.len())
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
