//! Depth sensors that drift, leap or stand still, and legs that change: flights of the toy.

use super::toy::Toy;
use crate::{Config, State, step};
use signals::{Abort, Goal, Leg, Micros, Mission, Phase, Reading, SensorFrame};

const CYCLE_S: f64 = 4.0;

/// Ends of a flight: phase, cause, time of the abort, s, deepest, m.
#[derive(Debug)]
struct Outcome {
    phase: Phase,
    abort: Option<Abort>,
    abort_s: f64,
    deepest_m: f64,
    surfacings: u32,
}

/// Flies the toy for at most `hours`; `spoil` may change each frame.
fn fly(legs: &[Leg], hours: f64, mut spoil: impl FnMut(&Toy, &mut SensorFrame)) -> Outcome {
    let config = Config::default();
    let mission = Mission { legs: legs.iter().copied().collect(), max_duration_s: 2_000_000, ..Mission::default() };
    let table = polar::builtin(mission.wings).ok();
    let (mut toy, mut state) = (Toy::new(&config), State::new(&config, mission, Micros(0)));
    let mut out = Outcome { phase: Phase::Surface, abort: None, abort_s: f64::NAN, deepest_m: 0.0, surfacings: 0 };
    while toy.t < hours * 3600.0 && !(toy.t > 300.0 && matches!(out.phase, Phase::Safe | Phase::Done) && toy.z < 0.5) {
        let mut frame = toy.frame();
        spoil(&toy, &mut frame);
        let answer = step(&config, table.as_ref(), &mut state, frame.time, &frame);
        if out.abort.is_none() && answer.trace.abort.is_some() {
            (out.abort, out.abort_s) = (answer.trace.abort, toy.t);
        }
        out.surfacings += u32::from(answer.trace.phase == Phase::Comms && out.phase != Phase::Comms);
        out.phase = answer.trace.phase;
        toy.fly(&answer.command, CYCLE_S);
        out.deepest_m = out.deepest_m.max(toy.z);
    }
    out
}

fn leg(depth_min_m: f32, depth_max_m: f32, dives: u16) -> Leg {
    Leg { depth_min_m, depth_max_m, dives, ..Leg::default() }
}

fn alone(_: &Toy, frame: &mut SensorFrame) {
    frame.depth2_m = Reading::Missing;
}

#[test]
fn a_leg_far_above_the_one_before_it_is_no_over_depth() {
    let out = fly(&[leg(60.0, 95.0, 1), leg(3.0, 27.0, 2), leg(100.0, 180.0, 1)], 12.0, |_, _| ());
    assert_eq!((out.phase, out.abort), (Phase::Done, None), "{out:?}");
}

#[test]
fn a_flat_pitch_after_a_steep_one_is_no_fault_of_the_pitch_sensor() {
    let at = |pitch_rad, ballast_m3| Leg { goal: Goal::FixedPitch { pitch_rad }, ballast_m3, ..leg(5.0, 60.0, 2) };
    let out = fly(&[at(0.77, 230e-6), at(0.105, 230e-6), at(0.8, 100e-6), at(0.1, 100e-6)], 24.0, |_, _| ());
    assert_eq!((out.phase, out.abort), (Phase::Done, None), "{out:?}");
}

#[test]
fn one_drifting_depth_sensor_never_takes_it_near_the_crush_depth() {
    for metres_per_hour in [-60.0, -20.0, -5.0, 5.0, 20.0, 60.0] {
        let out = fly(&[leg(5.0, 190.0, 12)], 30.0, |toy, frame| {
            alone(toy, frame);
            frame.depth_m = Reading::now((toy.z + metres_per_hour * toy.t / 3600.0) as f32);
        });
        assert!(out.deepest_m < 235.0 && out.abort == Some(Abort::SensorDepth), "{metres_per_hour} m/h: {out:?}");
    }
}

#[test]
fn a_lone_sensor_is_checked_afloat_after_deep_dives_seldom_in_shallows() {
    let near = fly(&[leg(5.0, 190.0, 3)], 12.0, alone);
    assert_eq!((near.phase, near.abort, near.surfacings), (Phase::Done, None, 2), "{near:?}");
    let shallow = fly(&[leg(5.0, 27.0, 8)], 12.0, alone);
    assert_eq!((shallow.phase, shallow.abort, shallow.surfacings), (Phase::Done, None, 0), "{shallow:?}");
    // Two that agree are trusted for longer.
    let both = fly(&[leg(5.0, 190.0, 3)], 12.0, |_, _| ());
    assert_eq!((both.phase, both.abort, both.surfacings), (Phase::Done, None, 0), "{both:?}");
}

#[test]
fn a_lone_sensor_that_jumps_is_found_at_once_and_one_deep_while_afloat() {
    let leaps = fly(&[leg(5.0, 190.0, 1)], 4.0, |toy, frame| {
        alone(toy, frame);
        if toy.t > 600.0 {
            frame.depth_m = Reading::now(toy.z as f32 - 30.0);
        }
    });
    assert_eq!(leaps.abort, Some(Abort::SensorDepth), "{leaps:?}");
    assert!(leaps.abort_s - 600.0 <= 12.0, "{leaps:?}");
    let off = fly(&[leg(5.0, 27.0, 1), leg(5.0, 27.0, 1)], 4.0, |toy, frame| {
        alone(toy, frame);
        frame.depth_m = Reading::now(toy.z as f32 + 5.0);
    });
    assert!(off.abort == Some(Abort::SensorDepth) && off.abort_s < 13.0, "{off:?}");
}
