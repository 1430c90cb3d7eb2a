//! What is flown for each goal, with levels learned apart, and by the stock controller.

use super::toy::Toy;
use crate::{Config, Settings, State, step, stock};
use signals::{Abort, Answer, Goal, Leg, Micros, Mission, Phase, Reading, SensorFrame, Switch};

const CYCLE_S: f64 = 4.0;

/// Flies the toy under a law; the answers.
fn fly(config: &Config, mut law: impl FnMut(&SensorFrame) -> Answer, mut spoil: impl FnMut(f64, &mut SensorFrame)) -> Vec<Answer> {
    let mut toy = Toy::new(config);
    let mut answers: Vec<Answer> = Vec::new();
    while answers.len() < 6000 && answers.last().is_none_or(|a| a.trace.phase != Phase::Done) {
        let mut frame = toy.frame();
        spoil(toy.t, &mut frame);
        let answer = law(&frame);
        answers.push(answer);
        toy.fly(&answer.command, CYCLE_S);
    }
    answers
}

fn mission(legs: &[Leg], surface_every: u16) -> Mission {
    Mission { legs: legs.iter().copied().collect(), max_duration_s: 80_000, surface_every, ..Mission::default() }
}

/// Pitch wanted at the end of each dive, rad.
fn pitches(config: &Config, goal: Goal, dives: u16) -> Vec<f32> {
    let mission = mission(&[Leg { dives, depth_max_m: 60.0, goal, ..Leg::default() }], 0);
    let table = polar::builtin(mission.wings).ok();
    let mut state = State::new(config, mission, Micros(0));
    let answers = fly(config, |f| step(config, table.as_ref(), &mut state, f.time, f), |_, _| ());
    let last = answers.last().expect("flew").trace;
    assert_eq!((last.phase, last.dives, last.abort), (Phase::Done, dives, None), "{goal:?}");
    let of = |dive: u16| answers.iter().filter(move |a| a.trace.phase == Phase::Dive && a.trace.dives == dive);
    (0..dives).map(|dive| of(dive).next_back().map_or(0.0, |a| a.trace.pitch_setpoint_rad.abs())).collect()
}

#[test]
fn validate_each_goal_is_flown_home_and_what_wants_speed_is_steeper() {
    let config = Config::default();
    let last = |goal| *pitches(&config, goal, 4).last().expect("dives");
    let glide = last(Goal::BestGlide);
    assert!(last(Goal::BestSpeed) > glide + 0.1, "the fastest way is steep");
    let (with, against) = (last(Goal::Current { along_track_m_s: 0.3 }), last(Goal::Current { along_track_m_s: -0.15 }));
    assert!(against > with, "against a current it is steeper: {against} and {with}");
    // A current that is stronger than the vehicle loses least ground in the fastest glide.
    assert!(last(Goal::Current { along_track_m_s: -1.0 }) >= against - 0.02);
    let (idle, hungry) = (last(Goal::BestRange { hotel_w: 0.0 }), last(Goal::BestRange { hotel_w: 50.0 }));
    assert!(hungry > idle, "what costs by the hour is flown faster: {hungry} and {idle}");
}

#[test]
fn validate_levels_that_are_learned_apart_take_two_steep_dives() {
    let apart = Config::new(Settings { learns_levels: true, ..Settings::slocum_100() }).expect("valid");
    let apart = pitches(&apart, Goal::BestGlide, 6);
    let steep: Vec<usize> = (1..6).filter(|k| apart[*k] > apart[5] + 0.05).collect();
    assert_eq!(steep, [1, 2], "{apart:?}");
}

/// The law over four dives with this surfacing, what it is shown changed: the answers.
fn law(every: u16, spoil: impl FnMut(f64, &mut SensorFrame)) -> Vec<Answer> {
    let config = Config::default();
    let mission = mission(&[Leg { dives: 4, ..Leg::default() }], every);
    let table = polar::builtin(mission.wings).ok();
    let mut state = State::new(&config, mission, Micros(0));
    fly(&config, |f| step(&config, table.as_ref(), &mut state, f.time, f), spoil)
}

/// Times that the shore was called before the end.
fn calls(answers: &[Answer]) -> usize {
    answers.windows(2).filter(|w| w[0].trace.phase != Phase::Comms && w[1].trace.phase == Phase::Comms).count()
}

#[test]
fn validate_the_surface_is_reached_as_often_as_ordered() {
    for (every, expected) in [(0, 0), (1, 3), (2, 1), (3, 1)] {
        let answers = law(every, |_, _| ());
        let last = answers.last().expect("flew").trace;
        assert_eq!((last.phase, last.dives, last.abort, calls(&answers)), (Phase::Done, 4, None, expected), "every {every}");
    }
}

#[test]
fn validate_a_lost_second_depth_ends_the_mission_unless_it_comes_back() {
    for (until_s, whole) in [(f64::INFINITY, false), (500.0, true)] {
        for heard in [true, false] {
            let answers = law(2, |t, f| {
                if t > 400.0 && t < until_s {
                    f.depth2_m = Reading::Missing;
                }
                f.surface.comms &= heard;
                f.surface.gps_fix &= heard;
            });
            let last = answers.last().expect("flew").trace;
            assert_eq!((last.phase, last.abort, last.dives == 4), (Phase::Done, None, whole), "until {until_s}, heard {heard}: {last:?}");
        }
    }
}

#[test]
fn validate_the_stock_controller_flies_legs_and_aborts_for_three_causes() {
    let config = Config::default();
    let legs = [Leg { dives: 2, ..Leg::default() }, Leg { dives: 1, depth_max_m: 20.0, ..Leg::default() }];
    let flown = |mission: Mission, spoil: &dyn Fn(f64, &mut SensorFrame)| {
        let mut state = stock::State::new(&config, mission, Micros(0));
        fly(&config, |f| stock::step(&config, &mut state, f.time, f), spoil)
    };
    for (every, heard) in [(0, false), (1, true)] {
        let whole = flown(mission(&legs, every), &|_, _| ());
        let last = whole.last().expect("flew").trace;
        assert_eq!((last.phase, last.dives, last.abort), (Phase::Done, 3, None));
        assert_eq!(whole.iter().any(|a| a.trace.phase == Phase::Comms), heard, "surfacing every {every}");
    }
    let cause = |spoil: &dyn Fn(f64, &mut SensorFrame)| flown(mission(&legs, 0), spoil).last().expect("flew").trace;
    let broken = cause(&|t, f| f.leak = if t > 200.0 { Switch::Alarm } else { Switch::Clear });
    assert_eq!((broken.phase, broken.abort), (Phase::Safe, Some(Abort::Leak)));
    let deep = cause(&|t, f| {
        if t > 200.0 {
            f.depth_m = Reading::now((t as f32 - 190.0).min(230.0));
            f.depth2_m = f.depth_m;
        }
    });
    assert_eq!((deep.phase, deep.abort), (Phase::Safe, Some(Abort::OverDepth)));
    let blind = cause(&|t, f| {
        if t > 200.0 {
            (f.depth_m, f.depth2_m) = (Reading::Missing, Reading::Missing);
        }
    });
    assert_eq!((blind.phase, blind.abort), (Phase::Safe, Some(Abort::SensorDepth)));
    let refused = flown(mission(&[], 0), &|_, _| ());
    assert_eq!(refused.last().expect("flew").trace.abort, Some(Abort::BadMission));
}
