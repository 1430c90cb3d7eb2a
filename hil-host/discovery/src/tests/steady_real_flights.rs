//! The steady comparison against published figures of real Slocum flights.
//!
//! The flights are public but not in this repository: set GLIDER_FLIGHTS to a
//! folder with `slocum_comet2016/comet2016_tidy.csv` and
//! `slocum_modena2015/modena-2015-*_tidy.csv`. Without it the tests say so and pass.

use std::path::PathBuf;

use logs::Flight;

use crate::steady::fit::Parameter;
use crate::steady::ladder::{Rung, Step, climb, ladder, rms_cm_s};
use crate::steady::samples::SteadySamples;
use crate::steady::{held_out, steady_report};
use logs::record::steady::{SteadyFilter, steady, vertical_velocity};

/// The published ladder was made by another tool on the same columns: 5 % is its
/// acceptance limit; two digits after the point are printed there.
const LADDER_TOLERANCE: f64 = 0.05;

fn flight(relative: &str) -> Option<Flight> {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS") else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return None;
    };
    let flight = logs::record::csv::flight(&PathBuf::from(root).join(relative)).expect("a readable flight");
    Some(flight)
}

fn comet() -> Option<Flight> {
    flight("slocum_comet2016/comet2016_tidy.csv")
}

fn modena(segment: &str) -> Option<Flight> {
    flight(&format!("slocum_modena2015/modena-2015-{segment}_tidy.csv"))
}

fn step(steps: &[Step], rung: Rung) -> &Step {
    steps.iter().find(|s| s.rung == rung).unwrap_or_else(|| panic!("no step {rung:?}"))
}

fn assert_ladder(flight: &Flight, published: [f64; 6]) {
    let samples = SteadySamples::of(flight).expect("steady samples");
    let steps = ladder(&samples, None).expect("ladder");
    let rungs = [
        Rung::Nominal,
        Rung::TrimConstantDensity,
        Rung::TrimMeasuredDensity,
        Rung::Compressibility,
        Rung::ThermalExpansion,
        Rung::PitchOffset,
    ];
    for (rung, published) in rungs.into_iter().zip(published) {
        let ours = step(&steps, rung).rms_cm_s;
        // Half a unit of the last printed digit on top of the relative limit.
        let limit = LADDER_TOLERANCE * published + 0.005;
        assert!((ours - published).abs() <= limit, "{rung:?}: ours {ours:.3} cm/s, published {published} cm/s");
    }
}

#[test]
fn validate_the_ladder_of_comet_2016() {
    if let Some(flight) = comet() {
        assert_ladder(&flight, [3.39, 0.99, 0.50, 0.45, 0.45, 0.44]);
    }
}

#[test]
fn validate_the_ladder_of_modena_187_0_12() {
    if let Some(flight) = modena("187-0-12") {
        assert_ladder(&flight, [6.51, 2.20, 2.15, 0.65, 0.65, 0.51]);
    }
}

#[test]
fn validate_the_ladder_of_modena_191_0_34() {
    if let Some(flight) = modena("191-0-34") {
        assert_ladder(&flight, [6.41, 1.72, 2.28, 0.72, 0.62, 0.54]);
    }
}

/// A true effect can barely help in sample and halve the error 22 days later.
#[test]
fn validate_modena_trained_on_the_first_day_and_tested_22_days_later() {
    let (Some(train), Some(test)) = (modena("175-0-1"), modena("191-0-34")) else { return };
    let train = SteadySamples::of(&train).expect("steady samples");
    let test = SteadySamples::of(&test).expect("steady samples");
    for (rung, published) in
        [(Rung::TrimConstantDensity, 1.74), (Rung::Compressibility, 1.22), (Rung::ThermalExpansion, 0.68), (Rung::PitchOffset, 0.69)]
    {
        let model = climb(&train, rung).expect("fit").model;
        let ours = rms_cm_s(&test, &model);
        assert!((ours - published).abs() <= LADDER_TOLERANCE * published, "{rung:?}: ours {ours:.3} cm/s, published {published} cm/s");
        if rung == Rung::ThermalExpansion {
            assert!(ours <= 0.70, "held-out error with compressibility and thermal expansion: {ours:.3} cm/s");
        }
    }
}

/// The same without a given order of steps: of all sets of effects the later flight asks for the two that a hull has, or for thermal
/// expansion with a pitch offset; nothing less does.
#[test]
fn validate_a_flight_22_days_later_names_compressibility_and_expansion() {
    let (Some(train), Some(test)) = (modena("175-0-1"), modena("191-0-34")) else { return };
    let found = held_out(&train, &test).expect("steady legs");
    assert_eq!(found.named[0], ["hull_compressibility", "thermal_expansion"]);
    assert!(found.test_cm_s <= 0.70, "{:.3} cm/s", found.test_cm_s);
    // What else does as well is said.
    assert_eq!(found.named[1..], [["thermal_expansion", "pitch_offset"]]);
}

/// Our own filter chooses the published samples and finds the published velocity.
#[test]
fn validate_the_steady_filter_and_the_observed_velocity() {
    for (flight, max_depth_m, density_tolerance) in
        [(comet(), 41.0, 0.025), (modena("175-0-1"), 189.0, 0.005), (modena("187-0-12"), 189.0, 0.005), (modena("191-0-34"), 189.0, 0.005)]
    {
        let Some(flight) = flight else { return };
        let ours = steady(&flight, &SteadyFilter::for_depth(max_depth_m));
        let theirs: Vec<bool> = flight.extra["steady"].iter().map(|v| *v == 1.0).collect();
        let count = theirs.iter().filter(|s| **s).count();
        let differ = ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
        // Their depth is that of a standard ocean, 2.2 % off in brackish water, so the borders move a little.
        assert!((differ as f64) < 0.03 * count as f64, "{}: {differ} of {count} samples differ", flight.name);
        let velocity = vertical_velocity(&flight);
        let published = &flight.extra["w_obs_m_s"];
        let mut ratio = Vec::new();
        for i in 0..flight.len() {
            if theirs[i] && velocity[i].is_finite() {
                ratio.push(velocity[i] / published[i]);
            }
        }
        ratio.sort_by(f64::total_cmp);
        let median = ratio[ratio.len() / 2];
        assert!((median - 1.0).abs() < density_tolerance, "{}: our w is {median} of theirs", flight.name);
    }
}

/// The speed channel finds the pitch scale that the owner measured on the bench (0.86), and the speed with it.
#[test]
fn validate_the_pitch_scale_of_comet_2016_is_found_from_speed() {
    let Some(flight) = comet() else { return };
    let report = steady_report(&flight).expect("report");
    let before = report.speed.expect("a speed channel");
    assert!((before.bias_percent + 14.0).abs() < 2.0, "raw pitch: speed {:.1} % off, published 14 % low", before.bias_percent);
    let with_speed = report.with_speed.expect("a speed channel");
    assert!((with_speed.pitch_scale - 0.87).abs() <= 0.03, "pitch scale {}", with_speed.pitch_scale);
    assert!(with_speed.speed.bias_cm_s.abs() <= 0.3, "speed bias {} cm/s", with_speed.speed.bias_cm_s);
    assert!(with_speed.rms_cm_s <= 0.50, "w {} cm/s", with_speed.rms_cm_s);
    assert!(with_speed.identification.identified, "{:?}", with_speed.identification);
}

/// And vertical velocity alone tells neither lift slope nor pitch scale (so not the speed).
#[test]
fn validate_vertical_velocity_alone_identifies_neither_lift_nor_speed() {
    for flight in [comet(), modena("187-0-12"), modena("191-0-34")] {
        let Some(flight) = flight else { return };
        let report = steady_report(&flight).expect("report");
        let lift = report.identification.iter().find(|i| i.parameter == Parameter::LiftSlope).expect("asked for");
        assert!(!lift.identified, "{}: {lift:?}", flight.name);
        let pitch = report.identification.iter().find(|i| i.parameter == Parameter::PitchScale).expect("asked for");
        assert!(!pitch.identified, "{}: {pitch:?}", flight.name);
    }
}

/// The same flight as the public Python package carries it: other interpolation, no temperature, pitch already corrected.
#[test]
fn validate_the_flight_of_the_public_package_gives_the_same_error() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS") else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let bytes = std::fs::read(PathBuf::from(root).join("slocum_comet2016/gliderflight_data.npy")).expect("the array");
    let flight = logs::import::comet::flight(&bytes).expect("the flight");
    let report = steady_report(&flight).expect("report");
    // Published 0.50 cm/s; 10 % for its depth from local density (2 % more velocity) and its own interpolation.
    assert!((report.after_cm_s - 0.50).abs() <= 0.05, "{:.3} cm/s", report.after_cm_s);
    // Pitch is corrected already: no scale is left to find, and the speed agrees.
    let with_speed = report.with_speed.expect("a speed channel");
    assert!((with_speed.pitch_scale - 1.0).abs() <= 0.03, "pitch scale {}", with_speed.pitch_scale);
    assert!(with_speed.speed.bias_cm_s.abs() <= 0.3, "speed bias {} cm/s", with_speed.speed.bias_cm_s);
    eprintln!("{}", report.identified);
}

/// The vehicle files state the very coefficients that the steady model starts from.
#[test]
fn vehicle_files_and_the_nominal_steady_model_agree() {
    for name in ["comet", "modena"] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("../../vehicles/{name}.toml"));
        let vehicle = logs::vehicle::read(&path).expect("a vehicle");
        let nominal = crate::steady::glide::GlideModel::nominal(1.0, 10.0);
        let c = vehicle.constants;
        assert!((c.lift_slope_per_rad - nominal.lift_slope_per_rad).abs() < 1e-9);
        assert!((c.cd0 - nominal.cd0).abs() < 1e-12 && (c.hull_drag_per_rad2 - nominal.drag_per_rad2).abs() < 1e-12);
        assert!((c.mass_kg - crate::steady::glide::MASS_KG).abs() < 1e-12);
    }
}
