//! The drop weight of a vehicle that takes on water or weight: soon enough, and not for nothing.

use super::toy::Toy;
use crate::{Config, State, step};
use signals::{Abort, Leg, Micros, Mission, Switch};

const CYCLE_S: f64 = 4.0;

/// What came of a flight, in cycles after the event.
#[derive(Debug)]
struct Outcome {
    abort: Option<Abort>,
    fired: Option<usize>,
    home: bool,
}

/// Dives to `depth_m`; then the leak detector says `leak`, and `water_kg` more hang on the vehicle.
fn after(depth_m: f64, leak: Switch, water_kg: f64) -> Outcome {
    let config = Config::default();
    let leg = Leg { dives: 1, depth_min_m: 5.0, depth_max_m: if depth_m > 27.0 { 190.0 } else { 27.0 }, ..Leg::default() };
    let mission = Mission { legs: [leg].into_iter().collect(), ..Mission::default() };
    let mut state = State::new(&config, mission, Micros(0));
    let mut toy = Toy::new(&config);
    let (mut since, mut dropped) = (None, false);
    let mut out = Outcome { abort: None, fired: None, home: false };
    for _ in 0..2000 {
        let mut frame = toy.frame();
        if toy.z > depth_m || since.is_some() {
            since = Some(since.map_or(0, |n| n + 1));
            frame.leak = leak;
        }
        let answer = step(&config, None, &mut state, frame.time, &frame);
        out.abort = answer.trace.abort;
        if answer.command.drop_weight && out.fired.is_none() {
            out.fired = since;
        }
        dropped |= answer.command.drop_weight;
        toy.weight_kg = if dropped { 0.0 } else { 0.5 } + if since.is_some() { water_kg } else { 0.0 };
        // The weight is gone in the toy's own step too: as soon as it is fired.
        toy.fly(&signals::ActuatorCommand { drop_weight: false, ..answer.command }, CYCLE_S);
        out.home = toy.z < 0.5;
    }
    out
}

#[test]
fn a_deep_leak_drops_the_weight_at_the_third_reading_a_shallow_one_not() {
    let deep = after(150.0, Switch::Alarm, 0.0);
    assert_eq!((deep.abort, deep.fired, deep.home), (Some(Abort::Leak), Some(2), true));
    let shallow = after(12.0, Switch::Alarm, 0.0);
    assert_eq!((shallow.abort, shallow.fired, shallow.home), (Some(Abort::Leak), None, true));
}

#[test]
fn the_way_home_from_a_leak_is_the_steepest_climb_all_the_way() {
    let config = Config::default();
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let mut toy = Toy::new(&config);
    let (mut under_way, mut home) = (0, false);
    for _ in 0..600 {
        let mut frame = toy.frame();
        if toy.t > 100.0 {
            frame.leak = Switch::Alarm;
        }
        let answer = step(&config, None, &mut state, frame.time, &frame);
        if answer.trace.abort.is_some() && toy.z > 3.0 {
            // From the sixth cycle on the second way home holds for the same cause: it must not take the attitude.
            under_way += 1;
            assert_eq!((answer.command.battery_mass_m, answer.command.ballast_m3), (-config.battery_m, config.pump_m3));
        }
        toy.fly(&signals::ActuatorCommand { drop_weight: false, ..answer.command }, CYCLE_S);
        home = toy.z < 0.5;
    }
    assert!(home && under_way > 6, "{under_way}");
}

#[test]
fn a_leak_whose_vehicle_sinks_on_takes_the_weight_near_the_surface_too() {
    let out = after(12.0, Switch::Alarm, 0.4);
    // Pump out in 36 s, three samples, two cycles of the depth filter.
    assert!(out.home && out.fired.is_some_and(|n| n <= 9 + 3 + 2 + 6), "{out:?}");
}

#[test]
fn a_vehicle_that_sinks_on_with_its_pump_out_comes_home_on_the_weight() {
    let heavy = after(12.0, Switch::Clear, 0.4);
    assert!(heavy.home && heavy.abort == Some(Abort::Stalled) && heavy.fired.is_some(), "{heavy:?}");
    // Twice a minute and the pump's 36 s after the turn, which comes after at most 2 min of dive.
    assert!(heavy.fired.is_some_and(|n| n < 100), "{heavy:?}");
    let healthy = after(12.0, Switch::Clear, 0.0);
    assert_eq!((healthy.abort, healthy.fired, healthy.home), (None, None, true));
}

#[test]
fn a_vehicle_too_heavy_to_rise_glides_until_it_can_and_comes_home() {
    let config = Config::default();
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let mut toy = Toy::new(&config);
    let (mut fired_s, mut on_wings, mut home) = (None, 0.0f64, false);
    for _ in 0..1500 {
        let answer = step(&config, None, &mut state, Micros((toy.t * 1e6) as u64), &toy.frame());
        let since_s = fired_s.map_or(0.0, |at| toy.t - at);
        if answer.command.drop_weight && fired_s.is_none() {
            fired_s = Some(toy.t);
        }
        // From the first dive on 1.05 kg too many, for 20 minutes: 0.3 kg more than pump (0.24 kg) and weight (0.5 kg) lift.
        let load_kg = if toy.t > 100.0 && since_s < 1200.0 { 1.05 } else { 0.0 };
        toy.weight_kg = load_kg + if fired_s.is_some() { 0.0 } else { 0.5 };
        let before_m = toy.z;
        toy.fly(&signals::ActuatorCommand { drop_weight: false, ..answer.command }, CYCLE_S);
        let sinks_m_s = (toy.z - before_m) / CYCLE_S;
        if since_s > 300.0 && since_s < 1200.0 {
            assert!(answer.trace.pitch_setpoint_rad < 0.0 && toy.theta < 0.0, "nose down, {since_s} s after the firing");
            on_wings = on_wings.max(sinks_m_s);
        } else if since_s > 1300.0 {
            assert!(answer.trace.pitch_setpoint_rad > 0.0, "nose up as soon as it rises");
        }
        home = toy.z < 0.5;
    }
    // Tail first it would sink at 0.11 m/s with this load.
    assert!(home && fired_s.is_some() && on_wings < 0.1, "{fired_s:?}: {on_wings} m/s on its wings");
}

#[test]
fn regress_a_load_without_a_detector_is_weighed_and_dropped_in_time() {
    for load_kg in [0.08, 0.22] {
        let light = after(60.0, Switch::Clear, load_kg);
        assert_eq!((light.abort, light.fired, light.home), (None, None, true), "{load_kg} kg are less than the pump lifts");
    }
    for load_kg in [0.28, 0.32] {
        let heavy = after(60.0, Switch::Clear, load_kg);
        assert!(heavy.home && heavy.abort == Some(Abort::Stalled), "{load_kg} kg: {heavy:?}");
        assert!(heavy.fired.is_some_and(|n| n < 225), "within a quarter of an hour: {load_kg} kg: {heavy:?}");
    }
}
