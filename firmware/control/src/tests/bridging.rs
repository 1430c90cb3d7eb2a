//! Readings that are missing for a while: the mission goes on when they are back.

use super::toy::Toy;
use crate::waits::comes_back;
use crate::{Config, State, step};
use proptest::prelude::*;
use signals::{Abort, Flags, Leg, Micros, Mission, Phase, Reading, SensorFrame, Surface, Switch, Weight};

const CYCLE_S: f64 = 4.0;

/// A flight of the toy with one depth sensor.
#[derive(Debug)]
struct Outcome {
    phase: Phase,
    abort: Option<Abort>,
    first: Option<(Abort, f64)>,
    flags: Flags,
    dives: u16,
    deepest_m: f64,
    /// Last time in a dive, s.
    dived_s: f64,
    /// Times that SAFE was left.
    resumed: u32,
    /// Largest error of the depth believed while it was not measured, m.
    reckoned_m: f64,
}

fn fly(legs: &[Leg], hours: f64, mut spoil: impl FnMut(&Toy, &mut SensorFrame)) -> Outcome {
    let config = Config::default();
    let mission = Mission { legs: legs.iter().copied().collect(), max_duration_s: 2_000_000, ..Mission::default() };
    let table = polar::builtin(mission.wings).ok();
    let (mut toy, mut state) = (Toy::new(&config), State::new(&config, mission, Micros(0)));
    let mut out = Outcome {
        phase: Phase::Surface,
        abort: None,
        first: None,
        flags: Flags::default(),
        dives: 0,
        deepest_m: 0.0,
        dived_s: 0.0,
        resumed: 0,
        reckoned_m: 0.0,
    };
    let mut home_s = 0.0;
    while toy.t < hours * 3600.0 && home_s < 300.0 {
        let mut frame = toy.frame();
        frame.depth2_m = Reading::Missing;
        spoil(&toy, &mut frame);
        let answer = step(&config, table.as_ref(), &mut state, frame.time, &frame);
        let trace = &answer.trace;
        out.first = out.first.or(trace.abort.map(|a| (a, toy.t)));
        if out.phase == Phase::Safe && trace.phase != Phase::Safe {
            assert!(toy.z < 0.5 && !answer.command.drop_weight, "SAFE is left afloat only: {} m", toy.z);
            out.resumed += 1;
        }
        if trace.flags.contains(Flags::DEPTH_PROJECTED) {
            out.reckoned_m = out.reckoned_m.max((f64::from(trace.depth_m) - toy.z).abs());
        }
        if trace.phase == Phase::Dive {
            out.dived_s = toy.t;
        }
        (out.phase, out.abort, out.dives) = (trace.phase, trace.abort, trace.dives);
        out.flags = out.flags.with(trace.flags);
        home_s = if matches!(out.phase, Phase::Done | Phase::Safe) && toy.z < 0.5 { home_s + CYCLE_S } else { 0.0 };
        toy.fly(&answer.command, CYCLE_S);
        out.deepest_m = out.deepest_m.max(toy.z);
    }
    out
}

fn leg(depth_max_m: f32, dives: u16) -> Leg {
    Leg { depth_min_m: 5.0, depth_max_m, dives, ..Leg::default() }
}

fn within(t: f64, from_s: f64, span_s: f64) -> bool {
    t >= from_s && t < from_s + span_s
}

#[test]
fn regress_a_gap_of_the_only_depth_ends_no_mission() {
    for (depth_max_m, dives) in [(27.0, 6), (190.0, 2)] {
        for span_s in [4.0, 8.0, 12.0, 30.0, 60.0, 120.0] {
            for from_s in [60.0, 200.0, 300.0, 700.0, 1200.0] {
                let out = fly(&[leg(depth_max_m, dives)], 12.0, |toy, frame| {
                    if within(toy.t, from_s, span_s) {
                        frame.depth_m = Reading::Missing;
                    }
                });
                let whole = (out.phase, out.first, out.dives) == (Phase::Done, None, dives);
                assert!(whole && out.deepest_m < f64::from(depth_max_m) + 8.0, "{span_s} s from {from_s} s: {out:?}");
            }
        }
    }
}

#[test]
fn a_depth_that_stays_away_takes_the_vehicle_up_and_no_dive_follows() {
    for (from_s, bad) in [(250.0, Reading::Missing), (700.0, Reading::now(f32::NAN)), (700.0, Reading::now(9999.0))] {
        let out = fly(&[leg(190.0, 4)], 12.0, |toy, frame| {
            if toy.t >= from_s {
                frame.depth_m = bad;
            }
        });
        let (cause, at_s) = out.first.expect("aborted at last");
        assert!(cause == Abort::SensorDepth && at_s - from_s <= 604.0 && at_s - from_s > 300.0, "{out:?}");
        assert!(out.dived_s - from_s <= 28.0 && out.deepest_m < 195.0, "{out:?}");
    }
}

#[test]
fn without_pump_or_pitch_to_reckon_by_a_missing_depth_is_an_abort_at_once() {
    type Spoil = fn(&mut SensorFrame);
    let pitch: Spoil = |f| f.pitch_rad = Reading::Missing;
    let pump: Spoil = |f| f.ballast_m3 = Reading::Missing;
    for spoil in [pitch, pump] {
        let out = fly(&[leg(190.0, 2)], 6.0, |toy, frame| {
            if toy.t >= 400.0 {
                frame.depth_m = Reading::Missing;
                spoil(frame);
            }
        });
        assert!(out.first.is_some_and(|(cause, at_s)| cause == Abort::SensorDepth && at_s - 400.0 <= 20.0), "{out:?}");
    }
    // A depth reserve of 25 m, and somebody at 188 m.
    let out = fly(&[leg(199.0, 2)], 6.0, |toy, frame| {
        if toy.t >= 1200.0 {
            frame.depth_m = Reading::Missing;
        }
    });
    assert!(out.first.is_some_and(|(_, at_s)| at_s - 1200.0 < 620.0), "{out:?}");
}

#[test]
fn accuracy_dead_reckoning_over_two_minutes_is_within_twenty_metres() {
    let out = fly(&[leg(190.0, 2)], 6.0, |toy, frame| {
        if within(toy.t, 500.0, 120.0) {
            frame.depth_m = Reading::Missing;
        }
    });
    assert!(out.reckoned_m > 0.1 && out.reckoned_m < 20.0, "{out:?}");
}

#[test]
fn three_samples_lost_in_a_hundred_end_no_mission() {
    let mut random = 0x9e37_79b9_7f4a_7c15u64;
    let mut lost = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random % 100 < 3
    };
    for round in 0..20 {
        let out = fly(&[leg(27.0, 12)], 12.0, |_, frame| {
            if lost() {
                *frame = SensorFrame { seq: frame.seq, time: frame.time, surface: frame.surface, ..SensorFrame::default() };
            }
            for reading in [&mut frame.depth_m, &mut frame.pitch_rad, &mut frame.ballast_m3, &mut frame.battery_mass_m] {
                if lost() {
                    *reading = Reading::Missing;
                }
            }
        });
        assert_eq!((out.phase, out.first, out.dives), (Phase::Done, None, 12), "{round}: {out:?}");
    }
}

#[test]
fn a_mission_that_a_glitch_ended_goes_on_afloat_and_not_for_ever() {
    // A minute and a half without pitch: aborted, and flown to its end.
    let out = fly(&[leg(27.0, 4)], 12.0, |toy, frame| {
        if within(toy.t, 200.0, 90.0) {
            frame.pitch_rad = Reading::Missing;
        }
    });
    assert_eq!((out.phase, out.abort, out.resumed), (Phase::Done, None, 1), "{out:?}");
    assert!(out.first.is_some_and(|f| f.0 == Abort::SensorPitch) && out.flags.contains(Flags::RESUMED), "{out:?}");
    // Again and again: twice it goes on.
    let out = fly(&[leg(27.0, 20)], 24.0, |toy, frame| {
        if toy.z > 10.0 {
            frame.pitch_rad = Reading::Missing;
        }
    });
    assert_eq!((out.phase, out.abort, out.resumed), (Phase::Safe, Some(Abort::SensorPitch), 2), "{out:?}");
}

#[test]
fn a_mission_that_is_flown_is_not_flown_again_after_a_glitch_afloat() {
    let mut over_s = f64::NAN;
    let (config, mut toy) = (Config::default(), Toy::new(&Config::default()));
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let (mut phases, mut t_done) = (Vec::new(), f64::NAN);
    for _ in 0..1500 {
        let mut frame = toy.frame();
        // The mission is over; then the pitch is gone for 100 s.
        if within(toy.t, over_s, 100.0) {
            frame.pitch_rad = Reading::Missing;
        }
        let answer = step(&config, None, &mut state, frame.time, &frame);
        phases.push(answer.trace.phase);
        if answer.trace.phase == Phase::Done && over_s.is_nan() {
            (over_s, t_done) = (toy.t, toy.t);
        }
        toy.fly(&answer.command, CYCLE_S);
    }
    let after = phases.iter().skip_while(|p| **p != Phase::Done);
    assert!(t_done.is_finite() && after.clone().any(|p| *p == Phase::Safe), "done at {t_done} s");
    assert!(after.into_iter().all(|p| matches!(p, Phase::Done | Phase::Safe)) && phases.last() == Some(&Phase::Done));
}

#[test]
fn no_mission_goes_on_after_a_leak_nor_while_something_is_missing() {
    type Spoil = fn(&Toy, &mut SensorFrame);
    let leak: Spoil = |toy, f| f.leak = if within(toy.t, 200.0, 20.0) { Switch::Alarm } else { f.leak };
    let detector: Spoil = |toy, f| {
        if within(toy.t, 200.0, 90.0) {
            f.pitch_rad = Reading::Missing;
        }
        f.leak = if toy.t > 250.0 { Switch::Unknown } else { f.leak };
    };
    let antenna: Spoil = |toy, f| {
        if within(toy.t, 200.0, 90.0) {
            f.pitch_rad = Reading::Missing;
        }
        f.surface = if toy.t > 200.0 { signals::Surface::default() } else { f.surface };
    };
    for spoil in [leak, detector, antenna] {
        let out = fly(&[leg(27.0, 4)], 2.0, spoil);
        assert!(out.phase == Phase::Safe && out.first.is_some() && out.resumed == 0, "{out:?}");
    }
}

#[test]
fn a_recalled_mission_never_goes_on() {
    let (config, mut toy) = (Config::default(), Toy::new(&Config::default()));
    let mut state = State::new(&config, Mission::default(), Micros(0));
    for i in 0..600u32 {
        let mut frame = toy.frame();
        if within(toy.t, 150.0, 90.0) {
            frame.pitch_rad = Reading::Missing;
        }
        if i == 90 {
            state.recall();
        }
        let answer = step(&config, None, &mut state, frame.time, &frame);
        assert!(i < 90 || answer.trace.abort == Some(Abort::SensorPitch), "{i}: {answer:?}");
        toy.fly(&answer.command, CYCLE_S);
    }
    assert!(toy.z < 0.5, "{} m", toy.z);
}

#[test]
fn a_leak_detector_that_falls_silent_takes_the_vehicle_home() {
    let silent = |span_s: f64| {
        fly(&[leg(190.0, 3)], 12.0, |toy, frame| {
            if within(toy.t, 400.0, span_s) {
                frame.leak = Switch::Unknown;
            }
        })
    };
    let lost = silent(1e6);
    assert_eq!((lost.phase, lost.first), (Phase::Done, None), "{lost:?}");
    assert!(lost.dives == 1 && lost.dived_s - 400.0 <= 42.0 && lost.deepest_m < 60.0, "{lost:?}");
    for span_s in [20.0, 90.0] {
        let back = silent(span_s);
        assert_eq!((back.phase, back.first, back.dives), (Phase::Done, None, 3), "{span_s} s: {back:?}");
    }
}

#[test]
fn regress_an_antenna_heard_at_depth_is_not_believed() {
    let mut mission_over_at = f64::NAN;
    let out = fly(&[leg(190.0, 2)], 6.0, |toy, frame| {
        if toy.z > 80.0 || mission_over_at.is_finite() {
            mission_over_at = toy.t;
            frame.surface.gps_fix = true;
        }
    });
    // The receiver or the depth is wrong: aborted, home, and never taken for the surface on the way.
    assert!(out.first.is_some_and(|f| f.0 == Abort::SensorDepth) && out.deepest_m < 100.0, "{out:?}");
    // Nobody but the release can bring this one home: 0.4 kg too many, with a receiver that goes on saying that it has a fix.
    let (config, mut toy) = (Config::default(), Toy::new(&Config::default()));
    let mission = Mission { legs: [leg(190.0, 1)].into_iter().collect(), ..Mission::default() };
    let (mut state, mut fired) = (State::new(&config, mission, Micros(0)), false);
    for _ in 0..1500 {
        let mut frame = toy.frame();
        frame.surface.gps_fix |= toy.z > 80.0;
        let answer = step(&config, None, &mut state, frame.time, &frame);
        fired |= answer.command.drop_weight;
        toy.weight_kg = if fired { 0.4 } else { 0.5 + if toy.z > 80.0 || toy.weight_kg > 0.5 { 0.4 } else { 0.0 } };
        toy.fly(&signals::ActuatorCommand { drop_weight: false, ..answer.command }, CYCLE_S);
    }
    assert!(fired && toy.z < 0.5 && toy.z_max < 180.0, "fired {fired}, {} m, deepest {} m", toy.z, toy.z_max);
}

/// What a stretch of frames shows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shown {
    Afloat,
    Under,
    NoPitch,
    NoDepth,
    NoPump,
    Leak,
    LowVolts,
    NoAntenna,
    WeightGone,
}

fn shown(what: Shown, answer: &signals::Answer) -> SensorFrame {
    let depth = Reading::now(if what == Shown::Under { 12.0 } else { 0.2 });
    let up = !matches!(what, Shown::Under | Shown::NoAntenna);
    let or = |reading, missing| if what == missing { Reading::Missing } else { reading };
    SensorFrame {
        depth_m: or(depth, Shown::NoDepth),
        depth2_m: or(depth, Shown::NoDepth),
        pitch_rad: or(Reading::now(0.4), Shown::NoPitch),
        heading_rad: Reading::now(1.0),
        ballast_m3: or(Reading::now(answer.command.ballast_m3), Shown::NoPump),
        battery_mass_m: Reading::now(answer.command.battery_mass_m),
        fin_rad: Reading::now(answer.command.fin_rad),
        battery_v: Reading::now(if what == Shown::LowVolts { 9.0 } else { 15.0 }),
        charge: Reading::now(0.9),
        leak: if what == Shown::Leak { Switch::Alarm } else { Switch::Clear },
        weight: if what == Shown::WeightGone { Weight::Released } else { Weight::Held },
        surface: Surface { gps_fix: up, comms: up },
        ..SensorFrame::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever is missing and comes back: an abort is taken back for a cause that may come back, after two minutes in which nothing
    /// was missing, the last 40 s of them afloat, with the weight on board, and twice at most.
    #[test]
    fn prop_safe_is_left_afloat_and_sound_only(stretches in prop::collection::vec((prop::sample::select(vec![
        Shown::Afloat, Shown::Afloat, Shown::Afloat, Shown::Under, Shown::NoPitch, Shown::NoDepth, Shown::NoPump, Shown::Leak,
        Shown::LowVolts, Shown::NoAntenna, Shown::WeightGone]), 1usize..60), 1..14)) {
        let config = Config::default();
        let mut state = State::new(&config, Mission::default(), Micros(0));
        let mut answer = signals::Answer::default();
        let (mut t, mut resumed, mut sound, mut afloat, mut gone, mut low, mut fired) = (0u64, 0, 0, 0, 0, 0, false);
        for (what, n) in stretches {
            for _ in 0..n {
                let before = answer.trace;
                answer = step(&config, None, &mut state, Micros::from_secs(t), &shown(what, &answer));
                t += 4;
                // Three low voltages of five are one; fewer are none.
                low = if what == Shown::LowVolts { low + 1 } else { 0 };
                let is_sound = matches!(what, Shown::Afloat | Shown::Under | Shown::NoAntenna) || (1..3).contains(&low);
                sound = if is_sound { sound + 4 } else { 0 };
                afloat = if matches!(what, Shown::Under | Shown::NoAntenna) { 0 } else { afloat + 4 };
                if before.abort.is_some() && answer.trace.abort != before.abort {
                    resumed += 1;
                    prop_assert!(before.abort.is_some_and(comes_back) && answer.trace.abort.is_none(), "{before:?}");
                    prop_assert!(sound >= 120 && afloat >= 40 && !fired && resumed <= 2, "{sound} {afloat} {resumed}");
                }
                gone = if what == Shown::WeightGone { gone + 1 } else { 0 };
                fired |= answer.command.drop_weight || gone >= 3;
            }
        }
    }
}
