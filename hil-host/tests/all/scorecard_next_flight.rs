//! Does the flight that `next-flight` plans tell tied effects apart with fewer dives than a default sawtooth?
//!
//! Truth is the plant: its own force law, coloured water motion, calibration scatter, sensor noise. A flight of two dives at one
//! pitch is diagnosed; what it cannot tell is planned for; then the same vehicle flies those two dives and N more, once as planned
//! and once as the same sawtooth again. Right is an answer that names exactly what is hidden, with nothing tied to it. A test for each
//! N of the sawtooth: what is compared is a sum over all flights.

use discovery::diagnosis;
use discovery::workbench::next_flight::{Reach, plan};
use logs::record::csv;
use logs::{Vehicle, vehicle};
use plant::trials::catalogue::{Effect, Strength};
use plant::trials::{Site, Spec, Wing, files, generate_flown};
use std::path::Path;

/// The sawtooth everybody flies: pitch, rad, and stroke, m³.
const SAWTOOTH: [f64; 2] = [0.454, 230e-6];
/// Dives of the first flight.
const FIRST: usize = 2;
/// Dives more.
const FEW_DIVES: usize = 4;
const MANY_DIVES: usize = 8;
const PLANNED_DIVES: usize = 4;

struct Flown {
    diagnosis: diagnosis::Diagnosis,
    vehicle: Vehicle,
}

fn fly(spec: &Spec, seed: u64, legs: &[[f64; 2]]) -> Option<Flown> {
    let case = generate_flown(spec, seed, 0, None, Some(legs));
    let flight = csv::parse(&files::csv(&case.rows, case.vehicle.sensors.speed_m_s.is_some()), Path::new("flight.csv"), "flight").ok()?;
    let mut vehicle = vehicle::parse(case.vehicle.document(&case.name), Path::new("vehicle.json")).ok()?;
    // All dives are for learning here.
    vehicle.fit_segments = (0..legs.len() as u32).collect();
    vehicle.check_segments = vec![99];
    Some(Flown {
        diagnosis: diagnosis::diagnose(&flight, &vehicle, discovery::hypotheses::search::Depth::Pairs, &|_, _| {}).ok()?,
        vehicle,
    })
}

/// Right answers of 40: after so many dives more of the sawtooth, and after the planned ones.
fn right_answers(sawtooth_dives: usize) -> [usize; 2] {
    let hidden = [Effect::BallastScale, Effect::DragLevelError, Effect::LiftSlopeError, Effect::InducedDragError, Effect::PitchOffset];
    let mut right = [0; 2];
    let mut asked = 0;
    for seed in 1..=8_u64 {
        for effect in hidden {
            let spec = Spec::single(Site::Lake, Wing::Standard, effect, Strength::Medium);
            let Some(first) = fly(&spec, seed, &[SAWTOOTH; FIRST]) else { continue };
            let Ok(p) = plan(&first.diagnosis, &first.vehicle, |_| Reach::UNKNOWN) else { continue };
            asked += 1;
            let planned: Vec<[f64; 2]> = p.legs.iter().map(|l| [l.pitch_rad, l.ballast_m3]).collect();
            let arms = [vec![SAWTOOTH; sawtooth_dives], planned[..PLANNED_DIVES].to_vec()];
            for (right, extra) in right.iter_mut().zip(arms) {
                let legs: Vec<[f64; 2]> = [SAWTOOTH; FIRST].into_iter().chain(extra).collect();
                let Some(f) = fly(&spec, seed, &legs) else { continue };
                let d = &f.diagnosis;
                *right += usize::from(d.answer == [effect.names().0] && d.verdict == diagnosis::Verdict::Explained);
            }
        }
    }
    let [sawtooth, planned] = right;
    println!("of {asked}: {sawtooth} after {sawtooth_dives} dives more of the sawtooth, {planned} after {PLANNED_DIVES} as planned");
    assert_eq!(asked, 40, "every first flight can be planned from");
    right
}

#[test]
fn scorecard_planned_dives_name_what_is_hidden_sooner_than_a_sawtooth() {
    let [few, planned] = right_answers(FEW_DIVES);
    assert!(planned > few, "{PLANNED_DIVES} planned dives: {planned}, as many of the sawtooth: {few}");
}

#[test]
fn scorecard_planned_dives_name_as_much_as_twice_the_sawtooth() {
    let [many, planned] = right_answers(MANY_DIVES);
    assert!(planned >= many, "{PLANNED_DIVES} planned dives: {planned}, {MANY_DIVES} of the sawtooth: {many}");
}
