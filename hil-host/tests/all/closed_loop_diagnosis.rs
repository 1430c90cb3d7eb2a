//! What the workbench says of flights that our own controller flew in the simulated sea: fast turns, half of the time in them,
//! dives that start under way at depth.

use discovery::diagnosis::{Diagnosis, Verdict, diagnose};
use discovery::hypotheses::search::Depth;
use logs::{Flight, Vehicle};
use plant::{Effect, EffectKind, World};
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::recorder::Recorder;
use rig::flight::worlds;
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use serde_json::json;
use signals::{Goal, Leg, Mission, Wings};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Flights flown so far: each has a folder of its own.
static FLIGHTS: AtomicUsize = AtomicUsize::new(0);

/// Twelve dives of 3 to 27 m.
fn shallow(wings: Wings) -> Mission {
    let leg = Leg { dives: 12, ..Leg::default() };
    Mission { wings, legs: [leg].into_iter().collect(), max_duration_s: 24 * 3600, surface_every: 0 }
}

/// So many dives of 3 to 27 m with a drive, cm³, on a heading, degrees.
fn leg(dives: u16, goal: Goal, ballast_cc: i16, heading_deg: i16) -> Leg {
    let (ballast_m3, heading_rad) = (f32::from(ballast_cc) * 1e-6, f32::from(heading_deg).to_radians());
    Leg { dives, goal, ballast_m3, heading_rad, ..Leg::default() }
}

fn fixed_pitch(degrees: i8) -> Goal {
    Goal::FixedPitch { pitch_rad: f32::from(degrees).to_radians() }
}

/// Six dives to 180 m at pitches, drives and headings of their own, each from the surface.
fn sweep_at_sea(wings: Wings) -> Mission {
    sweep(wings, 1, 180.0)
}

/// At each of six settings so many dives without a surfacing between them.
fn sweep(wings: Wings, dives: u16, depth_max_m: f32) -> Mission {
    let settings = [(18, 230, 0), (26, 150, 90), (35, 200, 180), (22, 100, 270), (30, 230, 45), (24, 120, 200)];
    let leg = |(pitch, ballast, heading)| Leg { depth_max_m, ..leg(dives, fixed_pitch(pitch), ballast, heading) };
    Mission { wings, legs: settings.into_iter().map(leg).collect(), max_duration_s: 48 * 3600, surface_every: dives }
}

/// A mission in ordinary water (3 mm/s of vertical motion, as in the format's lake).
fn flown(mission: Mission, hidden: Option<Effect>, seed: u64) -> (Flight, Vehicle) {
    flown_in(0.003, mission, hidden, seed)
}

/// The same in water of so much vertical motion, m/s rms.
fn flown_in(background_rms_m_s: f64, mission: Mission, hidden: Option<Effect>, seed: u64) -> (Flight, Vehicle) {
    let mut scenario = worlds::for_mission(&mission);
    scenario.ocean.background_rms_m_s = background_rms_m_s;
    scenario.effects = hidden.into_iter().collect();
    scenario.seed = seed;
    let flight = FLIGHTS.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("closed-loop-{}-{flight}", std::process::id()));
    let mut world = World::new(scenario).expect("a world");
    let setup = Setup::new(mission);
    let mut recorder = Recorder::create(&folder, &world, &setup).expect("a log");
    let seat = &mut Link::new(InProcess::default());
    fly(&mut world, seat, &setup, &mut |c| recorder.push(c)).expect("flies");
    recorder.finish(json!({})).expect("written");
    let read = (logs::record::csv::flight(&folder).expect("reads"), logs::vehicle::read(&folder.join("vehicle.json")).expect("reads"));
    std::fs::remove_dir_all(&folder).expect("removed");
    read
}

fn asked(mission: Mission, hidden: Option<Effect>, seed: u64) -> Diagnosis {
    let (flight, vehicle) = flown(mission, hidden, seed);
    diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}).expect("a diagnosis")
}

fn size(d: &Diagnosis, effect: &str) -> f64 {
    let best = d.candidates.first().expect("one");
    best.parameters.iter().find(|p| p.name.starts_with(effect)).map_or(f64::NAN, |p| p.value)
}

#[test]
fn regress_nothing_is_missing_in_a_closed_loop_flight() {
    // Once unexplained: the swings of turns were taken for spikes, and dives that start at depth for dives from rest, stalled deeply.
    // Once a wrong drag due to lift on rail wings: the log stated the table flown with in place of the vehicle.
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for seed in [11, 12] {
            let d = asked(shallow(wings), None, seed);
            assert_eq!((d.verdict, d.rows_near_stall), (Verdict::Adequate, 0), "{wings:?}, seed {seed}: {:?} {:?}", d.answer, d.notes);
        }
    }
}

#[test]
fn regress_nothing_is_missing_in_still_water() {
    // Once a wrong drag due to lift, or unexplained: a law in the format's coefficients leaves 1.6 mm/s of the plant's own, which in
    // water stated to be still had to be something.
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let (flight, vehicle) = flown_in(0.0, sweep(wings, 3, 40.0), None, 1);
        let d = diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
        assert_eq!(d.verdict, Verdict::Adequate, "{wings:?}: {:?} {:?}", d.answer, d.notes);
    }
}

#[test]
fn validate_the_rail_wings_flown_table_overstates_drag_due_to_lift() {
    // Table and plant are written apart: the paper's polar against a force law with measured cross-flow. What is stated of the
    // vehicle is the plant's (tested in `worlds`).
    let world = World::new(worlds::for_mission(&shallow(Wings::LowAspectRatio))).expect("a world");
    let table = polar::builtin(Wings::LowAspectRatio).expect("a table");
    let due_to_lift = |at: &dyn Fn(f64) -> f64| (at(0.15) - at(0.0)) / at(0.0);
    let truth = |a: f64| world.lift_drag_area_m2(a).1;
    let flown = |a: f64| f64::from(table.at(a as f32).cd);
    let ratio = due_to_lift(&flown) / due_to_lift(&truth);
    assert!((1.2..2.0).contains(&ratio), "{ratio}");
}

#[test]
fn validate_what_is_hidden_is_named_alone_on_both_wing_sets() {
    // Medium sizes. Each once came with a wrong drag due to lift beside it on rail wings; the offset was told as something unknown
    // that follows the heading, of which this flight has one.
    let hidden = [
        (EffectKind::ClimbDrag, 0.4, "climb_drag"),
        (EffectKind::PitchOffset, 0.02, "pitch_offset"),
        (EffectKind::VerticalCurrent, 0.01, "vertical_current"),
    ];
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for (kind, value, name) in hidden {
            let d = asked(shallow(wings), Some(Effect { value, ..Effect::typical(kind) }), 5);
            assert_eq!(d.answer, [name], "{wings:?}: {:?} {:?}", d.verdict, d.notes);
        }
    }
}

/// Eight dives each at best glide, at 28 and at 22 degrees of pitch, with a surfacing every four.
fn three_settings(wings: Wings) -> Mission {
    let legs = [leg(8, Goal::BestGlide, 230, 40), leg(8, fixed_pitch(28), 160, 120), leg(8, fixed_pitch(22), 230, 230)];
    Mission { wings, legs: legs.into_iter().collect(), max_duration_s: 24 * 3600, surface_every: 4 }
}

#[test]
fn regress_no_drag_due_to_lift_is_named_with_what_is_hidden() {
    // Once each of these came with a wrong drag due to lift: what a log states of the standard wings was 14 % low in it where they glide.
    let hidden = [EffectKind::ClimbDrag, EffectKind::ThermalExpansion, EffectKind::VerticalCurrent, EffectKind::AddedMass];
    for kind in hidden {
        let d = asked(three_settings(Wings::Standard), Some(Effect::typical(kind)), 5);
        assert_eq!(d.answer, [kind.name()], "{:?} {:?}", d.verdict, d.notes);
    }
    let d = asked(three_settings(Wings::Standard), None, 5);
    assert_eq!((d.verdict, d.answer.len()), (Verdict::Adequate, 0), "{:?}", d.notes);
}

fn lift_is_named_alone(lost: &[(Wings, f64)]) {
    // Once with a wrong drag due to lift beside it, or unexplained: the log stated a law of the glides of a healthy vehicle alone, 12 %
    // off in drag and 10 % in lift at the 0.22 rad that a vehicle without 40 % of its lift flies at.
    for &(wings, value) in lost {
        let d = asked(three_settings(wings), Some(Effect { value, ..Effect::typical(EffectKind::LiftSlopeError) }), 5);
        assert_eq!(d.candidates[0].effects, ["lift_slope_error"], "{wings:?} {value}: {:?} {:?}", d.verdict, d.notes);
        // Near the stall a refit may do better than the name on dives kept out: then it is not given as the answer.
        let no_help = d.reasons.iter().any(|r| r.code() == "worse_than_recalibration") && d.block_error_m_s[1] < d.block_error_m_s[0];
        assert!(no_help || d.answer == ["lift_slope_error"], "{wings:?} {value}: {:?} {:?}", d.verdict, d.notes);
    }
}

#[test]
fn regress_wings_far_beyond_their_usual_angle_are_no_second_effect() {
    lift_is_named_alone(&[(Wings::Standard, -0.3), (Wings::LowAspectRatio, -0.2)]);
}

#[test]
fn regress_wings_at_twice_their_usual_angle_are_no_second_effect() {
    lift_is_named_alone(&[(Wings::Standard, -0.4)]);
}

#[test]
fn validate_drag_in_climbs_is_found_in_a_closed_loop_flight() {
    let hidden = Effect { value: 0.4, ..Effect::typical(EffectKind::ClimbDrag) };
    let d = asked(shallow(Wings::Standard), Some(hidden), 5);
    assert_eq!((d.verdict, d.answer.as_slice()), (Verdict::Explained, ["climb_drag"].as_slice()), "{:?}", d.notes);
    // The plant's increase grows in over the first degrees of angle of attack.
    let v = size(&d, "climb_drag");
    assert!((0.3..0.55).contains(&v), "{v}");
}

#[test]
fn regress_fixes_count_from_the_launch_point_of_their_segment() {
    // Once the first fix of every segment but the first counted from the launch point of the segment before.
    let (flight, vehicle) = flown(sweep_at_sea(Wings::Standard), None, 3);
    let last = *flight.segment.last().expect("rows");
    for segment in 0..=last {
        let (mut before, mut after, mut dived) = (Vec::new(), Vec::new(), false);
        for i in (0..flight.len()).filter(|&i| flight.segment[i] == segment) {
            dived |= flight.pressure_pa[i] > 1e6;
            let far_m = flight.gps_east_m[i].hypot(flight.gps_north_m[i]);
            if far_m.is_finite() {
                if dived { &mut after } else { &mut before }.push(far_m);
            }
        }
        // Five standard deviations of a fix; a dive makes some 600 m of way. The first launch comes before the first fix.
        assert!(segment == 0 || !before.is_empty(), "segment {segment} has no fix before its dive");
        assert!(before.iter().all(|m| *m < 5.0 * vehicle.sensors.gps_noise_m), "segment {segment}: {before:?}");
        assert!(!after.is_empty() && after.iter().all(|m| *m > 200.0), "segment {segment}: {after:?}");
    }
}

#[test]
fn regress_nothing_is_missing_in_dives_at_sea_from_surfacing_to_surfacing() {
    // Once unexplained, or a current and a pitch scale: the displacements between the fixes were wrong.
    for seed in [100, 101] {
        let d = asked(sweep_at_sea(Wings::Standard), None, seed);
        assert_eq!(d.verdict, Verdict::Adequate, "seed {seed}: {:?} {:?}", d.answer, d.notes);
    }
}

#[test]
fn validate_a_current_is_found_in_dives_from_surface_to_surface() {
    let hidden = Effect { value: 0.15, ..Effect::typical(EffectKind::HorizontalCurrent) };
    let d = asked(sweep_at_sea(Wings::Standard), Some(hidden), 5);
    assert_eq!((d.verdict, d.answer.as_slice()), (Verdict::Explained, ["horizontal_current"].as_slice()), "{:?}", d.notes);
    // 2 cm/s: the fixes alone know the mean current of a dive of an hour to 0.1 cm/s, the model's own way through the water to a tenth.
    assert!((size(&d, "horizontal_current.speed") - 0.15).abs() < 0.02, "{}", size(&d, "horizontal_current.speed"));
}

#[test]
fn validate_a_current_is_found_from_three_dives_between_two_fixes() {
    // No dive of the first two of three has a fix at both ends: the way counts from the fix before the first to that after the third.
    let hidden = Effect { value: 0.15, ..Effect::typical(EffectKind::HorizontalCurrent) };
    let (flight, vehicle) = flown(sweep(Wings::Standard, 3, 40.0), Some(hidden), 5);
    assert_eq!(vehicle.check_segments, [6, 7, 8], "dives between two surfacings judge together or not at all");
    let d = diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    assert_eq!((d.verdict, d.answer.as_slice()), (Verdict::Explained, ["horizontal_current"].as_slice()), "{:?}", d.notes);
    assert!((size(&d, "horizontal_current.speed") - 0.15).abs() < 0.02, "{}", size(&d, "horizontal_current.speed"));
}

#[test]
fn validate_fixes_three_dives_apart_separate_the_pitch_scale() {
    // By depth alone 0.13 and not told apart from a ballast scale with a zero-lift angle: the way made good is what they differ in.
    let hidden = Effect { value: 0.1, ..Effect::typical(EffectKind::PitchScale) };
    let d = asked(sweep(Wings::Standard, 3, 40.0), Some(hidden), 101);
    assert_eq!((d.verdict, d.answer.as_slice()), (Verdict::Explained, ["pitch_scale"].as_slice()), "{:?}", d.notes);
    // 0.02: the stated interval of this flight is half of that; nature's law is not the model's.
    assert!((size(&d, "pitch_scale") - 0.1).abs() < 0.02, "{}", size(&d, "pitch_scale"));
}
