//! What `compare` says where a log is sparse, and where the vehicle file is of another water.

mod case;

use case::{log_every, written};
use discovery::diagnosis::diagnose;
use discovery::hypotheses::search::Depth;
use discovery::workbench::compare::{Comparison, compare};
use discovery::{Flight, Vehicle};
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
