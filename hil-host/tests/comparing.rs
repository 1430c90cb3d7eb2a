//! What `compare` says where a log is sparse, and where the vehicle file is of another water.

mod case;

use discovery::diagnosis::diagnose;
use discovery::hypotheses::search::Depth;
use discovery::record::csv;
use discovery::workbench::compare::compare;
use discovery::{Flight, Vehicle, vehicle};
use hil_host::score::diagnosis::write_case;
use plant::trials::{Kind, Site, Spec, Wing, generate_natural};

fn clean(site: Site) -> Spec {
    Spec { site, wing: Wing::Standard, kind: Kind::Clean, effects: Vec::new(), outside: None, strength: None, lifelike: None }
}

/// The first natural case at sea that is sampled this sparsely, s.
fn sparse(least_s: f64) -> (Flight, Vehicle) {
    let folder = std::env::temp_dir().join(format!("glider-sparse-{}", std::process::id()));
    let case = (0..40).map(|i| generate_natural(&clean(Site::Sea), 11, i)).find(|c| c.vehicle.sensors.period_s >= least_s).expect("sparse");
    let path = write_case(&folder, &case).expect("written");
    let read = (csv::flight(&path).expect("reads"), vehicle::read(&path.join("vehicle.json")).expect("reads"));
    std::fs::remove_dir_all(folder).ok();
    read
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
