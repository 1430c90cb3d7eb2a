//! Every fault does what its name says, and nothing before its time.

use super::command;
use crate::faults::{Fault, Kind, Target, catalogue};
use crate::{Scenario, Truth, World};
use signals::{ActuatorCommand, Phase, Reading, SensorFrame, Switch, Weight, Wings};

fn saw(world: &World) -> ActuatorCommand {
    let down = (world.time_s() % 300.0) < 120.0;
    let sign = if down { -1.0 } else { 1.0 };
    command(sign * 200e-6, sign * 0.003, 0.02 * sign)
}

/// Frames and truths of 12 min at 4 s; a fault begins after 200 s.
fn fly(fault: Option<Fault>) -> (Vec<SensorFrame>, Vec<Truth>) {
    let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
    world.inject("depth:off@dive".parse().unwrap()); // never told of a dive: never happens, but keeps both twins on the same path
    if let Some(f) = fault {
        world.inject(Fault { delay_s: 200.0, ..f });
    }
    let (mut frames, mut truths) = (Vec::new(), Vec::new());
    for _ in 0..180 {
        frames.push(world.sense());
        truths.push(world.truth());
        let c = saw(&world);
        world.advance(&c, 4.0);
    }
    (frames, truths)
}

fn value(r: Reading) -> f32 {
    match r {
        Reading::Sampled { value, .. } => value,
        Reading::Missing => f32::NAN,
    }
}

#[test]
fn every_fault_changes_something_after_its_onset_and_nothing_before() {
    let (frames, truths) = fly(None);
    let onset = 200 / 4;
    // What cannot show in this flight, and why.
    let silent = |t, k| {
        matches!(
            (t, k),
            (Target::LeakDetector, Kind::Stuck)         // no leak to hide
                | (Target::Charge, Kind::Stuck)         // less than its resolution is spent
                | (Target::Release, Kind::Stuck)        // weight not fired
                | (Target::Power, Kind::BrownOut) // a flag for the caller, own test
        )
    };
    for (target, kind, _, _) in catalogue() {
        let fault = Fault::new(target, kind).unwrap();
        let (f, t) = fly(Some(fault));
        assert_eq!(format!("{:?}", &f[..onset]), format!("{:?}", &frames[..onset]), "{fault} shows before its onset");
        assert_eq!(t[..onset], truths[..onset], "{fault} shows before its onset");
        let differs = format!("{:?}", &f[onset..]) != format!("{:?}", &frames[onset..]) || t[onset..] != truths[onset..];
        assert_eq!(differs, !silent(target, kind), "{fault}: {differs}");
        // Whatever breaks, the world itself stays finite.
        assert!(t.iter().all(|t| t.depth_m.is_finite() && t.speed_m_s < 5.0 && t.pitch_rad.abs() < 3.2), "{fault}");
    }
}

#[test]
fn sensor_faults_show_as_they_are_called() {
    let after = |text: &str| -> Vec<(Reading, f64)> {
        let (f, t) = fly(Some(text.parse().unwrap()));
        f.iter().zip(&t).skip(51).map(|(f, t)| (f.depth_m, t.depth_m)).collect()
    };
    assert!(after("depth:off").iter().all(|r| r.0 == Reading::Missing));
    let stuck = after("depth:stuck");
    assert!(stuck.iter().all(|r| r.0 == stuck[0].0), "one value for good");
    assert!(after("depth:nan").iter().all(|r| value(r.0).is_nan() && r.0 != Reading::Missing));
    assert!(after("depth:inf").iter().all(|r| value(r.0) == f32::INFINITY));
    assert!(after("depth:sentinel").iter().all(|r| value(r.0) == 9999.0));
    assert!(after("depth:bias=3").iter().all(|r| (f64::from(value(r.0)) - r.1 - 3.0).abs() < 0.3));
    assert!(after("depth:flip").iter().all(|r| (f64::from(value(r.0)) + r.1).abs() < 0.3));
    let slow = after("depth:slow=30");
    let changes = slow.windows(2).filter(|w| value(w[0].0) != value(w[1].0)).count();
    assert!((15..=18).contains(&changes), "516 s at 30 s in a 4 s cycle: {changes} new values");
    let delayed = after("depth:delayed=20");
    assert!(delayed[10..].iter().all(|r| matches!(r.0, Reading::Sampled { age_ms: 20_000, .. })), "stamped 20 s old");
    let missing = after("depth:intermittent=0.5").iter().filter(|r| r.0 == Reading::Missing).count();
    assert!((40..90).contains(&missing), "half of 129: {missing}");
    let drift = after("depth:drift=36");
    let last = drift.last().unwrap();
    assert!((f64::from(value(last.0)) - last.1 - 36.0 * 516.0 / 3600.0).abs() < 0.4);
    let wild = after("depth:spike").iter().filter(|r| (f64::from(value(r.0)) - r.1).abs() > 10.0).count();
    assert!((1..20).contains(&wild), "one in twenty of 129: {wild}");
    let wide = after("depth:garbage").iter().filter(|r| value(r.0).abs() > 200.0).count();
    assert!(wide > 50, "{wide}");
}

#[test]
fn actuator_faults_show_as_they_are_called() {
    let end = |text: &str| *fly(Some(text.parse().unwrap())).1.last().unwrap();
    let (_, healthy) = fly(None);
    let at_onset = healthy[50];
    assert_eq!(end("pump:stuck").ballast_m3, at_onset.ballast_m3);
    assert!((end("pump:runaway=-1").ballast_m3 + 230e-6).abs() < 1e-12);
    assert!(end("mass_motor:runaway=1").battery_mass_m > 0.0253);
    assert!(end("fin_motor:runaway=1").fin_rad > 0.449);
    let lost = end("command:lost");
    assert!((lost.ballast_m3 - 230e-6).abs() < 1e-9 && lost.at_surface, "three missed commands send it up: {lost:?}");
    let sunk = end("pump:runaway=-1");
    assert!(sunk.on_bottom);
    // Creeping valve: 0.5 cc/s to the sink side while not driven.
    let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
    world.inject("pump:leak_back=5e-7".parse().unwrap());
    world.advance(&command(230e-6, 0.0, 0.0), 4.0);
    world.advance(&command(230e-6, 0.0, 0.0), 4.0);
    assert!(world.truth().ballast_m3 < 229e-6);
}

#[test]
fn the_weight_falls_when_fired_unless_it_sticks() {
    let drop = |fault: Option<&str>| {
        let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
        if let Some(f) = fault {
            world.inject(f.parse().unwrap());
        }
        world.advance(&ActuatorCommand { drop_weight: true, ..command(-230e-6, 0.0, 0.0) }, 100.0);
        assert!(!world.truth().weight_dropped && world.truth().weight_fired, "it burns for 120 s");
        world.advance(&command(-230e-6, 0.0, 0.0), 600.0);
        (world.truth(), world.sense().weight)
    };
    let (t, w) = drop(None);
    assert!(t.weight_dropped && t.at_surface && w == Weight::Released, "0.45 kg lift it against a full sink: {t:?}");
    let (t, w) = drop(Some("release:stuck"));
    assert!(t.weight_fired && !t.weight_dropped && t.on_bottom && w == Weight::Held);
    let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
    world.inject("release:spurious+10s".parse().unwrap());
    world.advance(&command(230e-6, 0.0, 0.0), 20.0);
    world.advance(&command(230e-6, 0.0, 0.0), 200.0);
    assert!(world.truth().weight_dropped);
}

#[test]
fn water_and_hull_faults_show_as_they_are_called() {
    let run = |text: &str, ballast: f64, seconds: f64| {
        let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
        world.advance(&command(-230e-6, 0.0, 0.0), 150.0);
        let before = world.truth();
        world.inject(text.parse().unwrap());
        for _ in 0..(seconds / 4.0) as usize {
            world.advance(&command(ballast, 0.0, 0.0), 4.0);
        }
        (before, world.truth(), world)
    };
    let (before, t, _) = run("vehicle:net", 230e-6, 600.0);
    assert!((t.depth_m - before.depth_m).abs() < 0.2, "held: {} {}", before.depth_m, t.depth_m);
    let (_, t, mut world) = run("sea:ice=1.5", 230e-6, 900.0);
    assert!((1.3..1.6).contains(&t.depth_m) && !t.at_surface, "under the ice: {}", t.depth_m);
    assert!(!world.sense().surface.gps_fix);
    let (_, t, _) = run("vehicle:dragged=8", 230e-6, 900.0);
    assert!(t.on_bottom, "8 N beat 2.3 N: {}", t.depth_m);
    let (_, t, _) = run("sea:lens=-6", 230e-6, 1200.0);
    assert!((5.0..9.0).contains(&t.depth_m), "cannot enter water 6 kg/m3 lighter (312 g): {}", t.depth_m);
    let (before, t, _) = run("sea:current=0.6", 230e-6, 400.0);
    assert!((t.east_m - before.east_m - 240.0).abs() < 1.0);
    let (_, t, mut world) = run("hull:leak=20", 230e-6, 1200.0);
    let frame = world.sense();
    assert!(frame.leak == Switch::Alarm && t.on_bottom, "400 g in 20 min sink it");
    let (_, _, mut world) = run("hull:vacuum_loss=60", 230e-6, 600.0);
    assert!(value(world.sense().vacuum_pa) > 101_000.0);
    let (_, _, mut world) = run("power:undervoltage=9.5", 230e-6, 60.0);
    assert!((value(world.sense().battery_v) - 9.5).abs() < 0.2);
    let (_, _, mut world) = run("power:brown_out", 230e-6, 60.0);
    assert!(world.take_brown_out() && !world.take_brown_out(), "once");
    let (_, t, _) = run("vehicle:wing_loss", 230e-6, 120.0);
    assert!(t.roll_rad.abs() > 0.1 && t.turn_rate_rad_s.abs() > 1e-3, "{t:?}");
}

#[test]
fn the_antenna_is_deaf_when_set_so() {
    for (text, gps, comms) in [("gps:off", false, true), ("comms:off", true, false), ("hull:leak", true, true)] {
        let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
        world.inject(text.parse().unwrap());
        world.advance(&command(230e-6, 0.01, 0.0), 60.0);
        let s = world.sense().surface;
        assert_eq!((s.gps_fix, s.comms), (gps, comms), "{text}");
    }
}

#[test]
fn a_fault_waits_for_the_phase_the_caller_tells() {
    let mut s = Scenario::shallow(Wings::Standard);
    s.faults = vec!["depth:off@climb+8s,20s".parse().unwrap()];
    let mut world = World::new(s).unwrap();
    let mut missing = Vec::new();
    for n in 0..40 {
        if n >= 10 {
            world.observe_phase(Phase::Climb);
        }
        if world.sense().depth_m == Reading::Missing {
            missing.push(n);
        }
        world.advance(&command(-230e-6, 0.0, 0.0), 4.0);
    }
    assert_eq!(missing, [12, 13, 14, 15, 16]);
}
