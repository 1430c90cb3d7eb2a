//! What the workbench says of flights that our own controller flew in the simulated sea: fast turns, half of the time in them,
//! dives that start under way at depth.

use discovery::diagnose::{Diagnosis, Verdict, diagnose};
use discovery::search::Depth;
use discovery::{Flight, Vehicle};
use hil_host::closed_loop::{Setup, fly};
use hil_host::flightlog::recorder::Recorder;
use hil_host::seats::Link;
use hil_host::seats::in_process::InProcess;
use hil_host::worlds;
use plant::{Effect, EffectKind, World};
use serde_json::json;
use signals::{Leg, Mission, Wings};

/// Twelve dives of 3 to 27 m in ordinary water (3 mm/s of vertical motion, as in the format's lake).
fn flown(wings: Wings, hidden: Option<Effect>, seed: u64) -> (Flight, Vehicle) {
    let leg = Leg { dives: 12, ..Leg::default() };
    let mission = Mission { wings, legs: [leg].into_iter().collect(), max_duration_s: 24 * 3600, surface_every: 0 };
    let mut scenario = worlds::for_mission(&mission);
    scenario.ocean.background_rms_m_s = 0.003;
    scenario.effects = hidden.into_iter().collect();
    scenario.seed = seed;
    let folder = std::env::temp_dir().join(format!("closed-loop-{}-{wings:?}-{seed}-{}", std::process::id(), scenario.effects.len()));
    let mut world = World::new(scenario).expect("a world");
    let mut recorder = Recorder::create(&folder, &world, &mission).expect("a log");
    let seat = &mut Link::new(InProcess::default());
    fly(&mut world, seat, &Setup::new(mission), &mut |c| recorder.push(c)).expect("flies");
    recorder.finish(json!({})).expect("written");
    let read = (discovery::read::flight(&folder).expect("reads"), discovery::vehicle::read(&folder.join("vehicle.json")).expect("reads"));
    std::fs::remove_dir_all(&folder).expect("removed");
    read
}

fn asked(wings: Wings, hidden: Option<Effect>, seed: u64) -> Diagnosis {
    let (flight, vehicle) = flown(wings, hidden, seed);
    diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}).expect("a diagnosis")
}

fn size(d: &Diagnosis, effect: &str) -> f64 {
    let best = d.candidates.first().expect("one");
    best.parameters.iter().find(|p| p.name.starts_with(effect)).map_or(f64::NAN, |p| p.value)
}

#[test]
fn regress_nothing_is_missing_in_a_closed_loop_flight_of_the_standard_wings() {
    // Once unexplained: the swings of turns were taken for spikes, and dives that start at depth for dives from rest, stalled deeply.
    for seed in [11, 12] {
        let d = asked(Wings::Standard, None, seed);
        assert_eq!((d.verdict, d.brink), (Verdict::Adequate, 0), "seed {seed}: {:?} {:?}", d.answer, d.notes);
    }
}

#[test]
fn validate_the_rail_wings_flown_table_overstates_the_drag_due_to_lift_of_the_simulated_sea() {
    // Table and plant are written apart: the paper's polar against a force law with measured cross-flow.
    for seed in [11, 12] {
        let d = asked(Wings::LowAspectRatio, None, seed);
        assert_eq!(d.answer, ["induced_drag_error"], "seed {seed}: {:?}", d.verdict);
        let v = size(&d, "induced_drag_error");
        assert!((-0.45..-0.25).contains(&v), "seed {seed}: {v}");
    }
}

#[test]
fn validate_drag_in_climbs_is_found_in_a_closed_loop_flight() {
    let hidden = Effect { value: 0.4, ..Effect::typical(EffectKind::ClimbDrag) };
    let d = asked(Wings::Standard, Some(hidden), 5);
    assert_eq!((d.verdict, d.answer.as_slice()), (Verdict::Explained, ["climb_drag"].as_slice()), "{:?}", d.notes);
    // The plant's increase grows in over the first degrees of angle of attack.
    let v = size(&d, "climb_drag");
    assert!((0.3..0.55).contains(&v), "{v}");
}
