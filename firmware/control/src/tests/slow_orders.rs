//! Orders that take effect late: over a slow line, or a motor that is slow to start.

use super::toy::Toy;
use crate::{Config, State, step};
use signals::{Abort, ActuatorCommand, Micros, Mission, Phase, Reading};
use std::collections::VecDeque;

const CYCLE_S: f64 = 4.0;

/// Flies the default mission with every order `late` cycles old; `spoil` may move the battery. Its phase and abort at the end, and when it
/// was aborted, s.
fn fly(late: usize, mut spoil: impl FnMut(&mut Toy, Phase)) -> (Phase, Option<(Abort, f64)>) {
    let (config, mission) = (Config::default(), Mission::default());
    let table = polar::builtin(mission.wings).ok();
    let mut toy = Toy::new(&config);
    let mut state = State::new(&config, mission, Micros(0));
    let rest = ActuatorCommand { ballast_m3: config.pump_m3, ..ActuatorCommand::default() };
    let mut orders: VecDeque<ActuatorCommand> = std::iter::repeat_n(rest, late).collect();
    let (mut phase, mut first) = (Phase::Surface, None);
    for _ in 0..3000 {
        spoil(&mut toy, phase);
        let frame = toy.frame();
        let answer = step(&config, table.as_ref(), &mut state, frame.time, &frame);
        phase = answer.trace.phase;
        first = first.or(answer.trace.abort.map(|cause| (cause, toy.t)));
        if phase == Phase::Done || first.is_some() && toy.z < 0.5 {
            break;
        }
        orders.push_back(answer.command);
        let followed = orders.pop_front().expect("an order");
        toy.fly(&followed, CYCLE_S);
    }
    (phase, first)
}

/// The pitch loop bears 6.3 cycles; the watch of its motor bears six.
#[test]
fn orders_of_up_to_six_cycles_end_no_mission() {
    for late in 0..=6 {
        assert_eq!(fly(late, |_, _| ()), (Phase::Done, None), "{late} cycles late");
    }
}

/// At the surface the battery is on its way when the mission begins; a reading that is lost then is no runaway.
#[test]
fn regress_one_lost_reading_at_the_start_is_no_runaway() {
    let config = Config::default();
    for lost in 0..8u64 {
        let (mut toy, mut state) = (Toy::new(&config), State::new(&config, Mission::default(), Micros(0)));
        toy.battery = 0.016;
        for cycle in 0..40 {
            let mut frame = toy.frame();
            if cycle == lost {
                frame.battery_mass_m = Reading::Missing;
            }
            let answer = step(&config, None, &mut state, frame.time, &frame);
            assert_eq!(answer.trace.abort, None, "lost in cycle {lost}, at {} s", toy.t);
            toy.fly(&answer.command, CYCLE_S);
        }
    }
}

/// What runs away from the orders of now and of before is found in three cycles, however late orders are.
#[test]
fn a_battery_that_runs_away_is_found_at_once() {
    for late in [0, 4] {
        let mut began = None;
        let (_, first) = fly(late, |toy, phase| {
            // In a glide whose orders have been the same for a while.
            if began.is_some() || phase == Phase::Dive && toy.z > 15.0 {
                began = began.or(Some(toy.t));
                toy.battery = (toy.battery - 0.02).max(-0.0254);
                toy.battery_sticks = true;
            }
        });
        let (cause, at) = first.expect("an abort");
        assert!(
            cause == Abort::MassStuck && at - began.expect("ran away") <= 3.0 * CYCLE_S,
            "{late}: {cause:?} at {at} s, ran away at {began:?}"
        );
    }
}
