//! The backseat line whole: board, simulated front seat, plant. The board's half alone is tested in `firmware/backseat`; numbers of the
//! tests are those of the protocol's list of acceptance tests (docs/backseat.md).

use super::flights::{BOTH, aborts, flown, mid_dive, shallow, unit, written};
use crate::behaviours::{Abort, Doing, FlightComputer, Motors};
use crate::board::{Flown, Terminal};
use crate::flight::{Backseat, Event, Outcome, Setup, Trial};
use crate::measured::Measured;
use crate::mission::{self, Pilot};
use crate::wire::Damage;
use crate::{OnBadWrite, Switches};
use backseat::{Law, Limits};
use control::{Config, Settings};
use plant::Scenario;
use rayon::prelude::*;
use signals::{Flags, Leg, Micros, Mission, Reading, SensorFrame, Wings};

fn sea(wings: Wings) -> Trial {
    let mut mission = Mission { wings, surface_every: 1, max_duration_s: 12 * 3600, ..Mission::default() };
    mission.legs[0] = Leg { dives: 2, depth_min_m: 0.0, depth_max_m: 200.0, ..Leg::default() };
    Trial { scenario: Scenario::sea(wings), mission, config: Config::new(Settings::slocum_200()).expect("valid") }
}

/// A board that says what it is told to say.
struct Script {
    lines: Vec<(f64, &'static str)>,
    heard: String,
}

impl Backseat for Script {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        self.heard += &String::from_utf8_lossy(heard);
        while self.lines.first().is_some_and(|(at, _)| *at <= now.0 as f64 * 1e-6) {
            said.extend(self.lines.remove(0).1.bytes());
        }
        Ok(())
    }
}

fn scripted(lines: Vec<(f64, &'static str)>, switches: Switches) -> (Outcome, String) {
    let mut script = Script { lines, heard: String::new() };
    let change = |setup: &mut Setup| (setup.limit_s, setup.switches) = (120.0, switches);
    let out = shallow(Wings::Standard).over_the_line(&mut script, change).expect("a flight");
    (out, script.heard)
}

#[test]
fn test_03_the_front_seat_notes_a_jump_that_the_checksum_cannot_see() {
    let (out, _) = scripted(vec![(10.0, "$SW,0:25.5*3E\r\n"), (14.0, "$SW,0:52.5*3E\r\n")], Switches::default());
    assert_eq!(out.taken.len(), 2, "both pass the framing");
    assert!(out.log.iter().any(|l| l.contains("jumps from 25.5 to 52.5")), "{:?}", out.log);
}

#[test]
fn test_05_a_write_to_no_sensor_changes_nothing() {
    for (bad_index, says) in [(OnBadWrite::Ignore, false), (OnBadWrite::Error, true)] {
        let (out, heard) = scripted(vec![(10.0, "$SW,40:1.0*39\r\n")], Switches { bad_index, ..Switches::default() });
        assert_eq!(heard.contains("$ER,1*0a"), says);
        assert!(out.log.is_empty(), "{:?}", out.log);
        // The board of the other tests survives such answers.
        let out = flown(|setup| setup.switches = Switches { bad_index, input_write: bad_index, ..Switches::default() });
        assert!(out.home && aborts(&out).iter().all(|a| *a == -1.0));
    }
}

#[test]
fn test_07_a_volume_in_the_wrong_unit_is_a_pump_that_does_not_follow() {
    let Trial { mission, config, .. } = shallow(Wings::Standard);
    let limits = Limits { ballast_m3: config.pump_m3, battery_m: config.battery_m, fin_rad: config.fin_rad, battery_step_m: 1.8e-3 };
    let mut law = Flown::new(&mission, config);
    law.begin(&limits).expect("a mission");
    let reported = (0..90u32).any(|seq| {
        let frame = SensorFrame {
            seq,
            time: Micros::from_secs(u64::from(seq) * 4),
            depth_m: Reading::now(0.1),
            depth2_m: Reading::now(0.1),
            pitch_rad: Reading::now(0.0),
            ballast_m3: Reading::now(2.36e-10),
            // Far out of the pressures that exist: refused at the line's door, so the law sees none.
            vacuum_pa: Reading::Missing,
            ..SensorFrame::default()
        };
        let t = law.step(&frame).expect("an answer").trace;
        assert_ne!(t.abort, Some(signals::Abort::Vacuum));
        t.flags.contains(Flags::PUMP_OPEN_LOOP) || matches!(t.abort, Some(signals::Abort::PumpStuck | signals::Abort::BallastFeedback))
    });
    assert!(reported, "the law says that the pump does not follow");
}

#[test]
fn test_08_the_front_seats_narrow_battery_is_no_stuck_mass() {
    let out = flown(|setup| setup.motors.battery_in.0 = 0.382);
    assert!(out.home && out.aborted.is_none(), "{:?}", out.doing);
    assert!(aborts(&out).iter().all(|a| *a == -1.0));
    assert!(written(&out, 1, 0.0).iter().all(|inches| inches.abs() <= 0.382));
    assert_eq!(out.dives, 4);
}

#[test]
fn test_09_a_front_seat_that_falls_silent_is_answered_with_full_buoyancy() {
    let at = mid_dive();
    let out = flown(|setup| setup.events = vec![(at, Event::GliderSilent(true)), (at + 300.0, Event::GliderSilent(false))]);
    assert!(written(&out, 0, at - 60.0).iter().any(|cc| *cc < -200.0), "it was gliding down");
    let after = written(&out, 0, at + 72.0);
    assert!(!after.is_empty() && after.iter().all(|cc| *cc > 229.0), "{after:?}");
    let emergency: Vec<f64> = out.taken.iter().filter(|(_, b)| b == "MD,67,2").map(|(t, _)| *t).collect();
    assert!(emergency.first().is_some_and(|t| (at + 59.0..at + 72.0).contains(t)), "{emergency:?}");
    assert!(emergency.windows(2).take(12).all(|w| w[1] - w[0] <= 17.0), "{emergency:?}");
    assert!(out.home);
}

#[test]
fn test_10_a_silent_board_leaves_its_orders_and_the_mission_surfaces() {
    let at = mid_dive();
    let silent = |setup: &mut Setup| setup.events = vec![(at, Event::BoardSilent(true))];
    // The orders stand: the glider goes on to its own turn, 3 m below ours, again and again, until the shore was not heard for long.
    let out = flown(silent);
    assert!(out.home && out.aborted.is_none() && out.duration_s > 5.0 * 3600.0, "{:?} {}", out.doing, out.duration_s);
    assert!(out.max_depth_m > 29.0 && out.max_depth_m < 33.0, "{}", out.max_depth_m);
    for (index, kept) in (0u16..5).zip(out.parameters) {
        assert_eq!(written(&out, index, 0.0).last().map(|v| *v as f32), Some(kept), "parameter {index} as it was ordered last");
    }
    // A mission file whose own turn is too deep: over-depth acts.
    let out = flown(|setup| {
        silent(setup);
        setup.mission =
            setup.mission.replace("overdepth(m) 102", "overdepth(m) 35").replace("d_target_depth(m) 1000003", "d_target_depth(m) 500");
    });
    assert!(out.home && out.aborted == Some(Abort::OverDepth), "{:?}", out.aborted);
    // With a front seat that minds.
    let out = flown(|setup| {
        silent(setup);
        setup.switches.silence_s = Some(60);
    });
    assert!(out.home && out.duration_s < at + 900.0, "{}", out.duration_s);
}

#[test]
fn test_10_the_same_depth_for_too_long_is_an_abort() {
    let mission = Mission::default();
    let text = mission::text(&mission, Pilot::Backseat, 100.0, 8 * 3600).replace("hover_for(sec) 300", "hover_for(sec) 99999");
    let motors = Motors { pump_cc: (230.0, 42.0), battery_in: (1.0, 0.068), fin_rad: (0.45, 0.02) };
    let mut computer = FlightComputer::new(mission::read(&text).expect("reads"), motors, 0.0);
    computer.parameters[3] = 30.0;
    let hangs = Measured { depth_m: 20.0, volts: 13.0, vacuum_inhg: 7.0, ..Measured::default() };
    let mut t = 0.0;
    while t < 1790.0 {
        computer.cycle(t, 4.0, &hangs, 0.0, false);
        t += 4.0;
    }
    assert_eq!(computer.doing, Doing::Dive);
    while t < 1840.0 {
        computer.cycle(t, 4.0, &hangs, 0.0, false);
        t += 4.0;
    }
    assert_eq!(computer.doing, Doing::Aborted(Abort::SameDepth));
    assert_eq!(computer.ordered[0], 230.0);
}

#[test]
fn test_11_a_pause_of_the_program_is_no_lost_line() {
    let at = mid_dive();
    let out = flown(|setup| setup.events = vec![(at, Event::Program(false)), (at + 20.0, Event::Noise), (at + 20.0, Event::Program(true))]);
    assert!(out.home && out.dives == 4 && aborts(&out).iter().all(|a| *a == -1.0), "{:?}", out.doing);
    let again = out.taken.iter().filter(|(_, b)| b.starts_with("FR,")).count();
    assert_eq!(again, 2, "the list is checked again");
    assert!(!written(&out, 0, at + 22.0 + 8.0).is_empty());
}

#[test]
fn test_12_a_glider_with_another_list_is_never_written_to() {
    let out = flown(|setup| setup.ini = setup.ini.replace("m_pitch rad\nm_roll rad", "m_roll rad\nm_pitch rad"));
    assert!(!out.taken.iter().any(|(_, b)| b.starts_with("SW") || b.starts_with("MD")));
    assert_eq!(out.log.iter().filter(|l| l.contains("extctl.ini")).count(), 1, "{:?}", out.log);
    assert!(out.max_depth_m < 2.0, "start values float: {}", out.max_depth_m);
}

/// One byte in 5,000 damaged, swapped, doubled or lost: every tenth cycle. All come home. A swapped digit in an order passes the checksum
/// and moves the pump for a cycle; where the law then takes the pump for stuck, it comes up. Flown whole when written: 14 of 16.
#[test]
fn prop_over_a_damaged_line_every_flight_comes_home_most_complete() {
    let r = 5e-5;
    let damage = Damage { flip: r, swap: r, double: r, lose: r };
    let change = |seed: u64| move |setup: &mut Setup| (setup.seed, setup.events) = (seed, vec![(0.0, Event::Damage(damage))]);
    let flights: Vec<Outcome> = (1..=16u64).into_par_iter().map(|seed| flown(change(seed))).collect();
    assert!(flights.iter().all(|out| out.home && out.max_depth_m < 33.0));
    let whole = flights.iter().filter(|out| out.dives == 4).count();
    println!("{whole} of 16 whole");
    assert!(whole >= 12, "{whole}");
}

/// The same bytes through a real pseudo-terminal.
#[test]
fn hil_the_pseudo_terminal_says_what_the_board_says() {
    let trial = shallow(Wings::Standard);
    let direct = flown(|setup| setup.limit_s = 1200.0);
    let mut terminal = Terminal::start(trial.board().expect("a board")).expect("a terminal");
    let through = trial.over_the_line(&mut terminal, |setup| setup.limit_s = 1200.0).expect("a flight");
    assert_eq!(direct.taken, through.taken);
    assert!(!direct.taken.is_empty());
}

#[test]
fn scorecard_over_the_line_the_law_keeps_nine_tenths_beats_the_servo() {
    let cases: Vec<_> = BOTH.into_iter().flat_map(|w| [(w, "3-27 m", shallow(w)), (w, "0-200 m", sea(w))]).collect();
    let shares: Vec<_> = cases
        .into_par_iter()
        .map(|(wings, name, trial)| {
            let out = trial.over_the_line(&mut trial.board().expect("a board"), |_| ()).expect("a flight");
            (wings, name, out, trial.frames_share().expect("a flight"), trial.own_servo().expect("a flight"))
        })
        .collect();
    for (wings, name, out, frames, own) in shares {
        println!("{wings:?} {name}: line {:.3}, frames {frames:.3}, own servo {:.3}", out.share(), own.share());
        assert!(out.home && own.home && aborts(&out).iter().all(|a| *a == -1.0), "{wings:?} {name}: {:?} {:?}", out.doing, own.doing);
        assert!(out.share() >= 0.9 * frames && out.share() > own.share(), "{wings:?} {name}: {} {frames} {}", out.share(), own.share());
    }
}

/// The board dies at any time of 500 missions, from before the link to after the last dive: the file alone brings the vehicle up.
#[test]
fn prop_with_a_silent_board_the_mission_file_brings_the_vehicle_up() {
    let flights: Vec<_> = (0..500u64)
        .into_par_iter()
        .map(|seed| {
            let draw = |n: u64| unit(seed * 64 + n);
            let depth_max_m = (15.0 + 70.0 * draw(1)) as f32;
            let leg = Leg {
                dives: 1 + (3.0 * draw(2)) as u16,
                depth_max_m,
                depth_min_m: (8.0 * draw(3)) as f32,
                heading_rad: (6.0 * draw(4)) as f32,
                ..Leg::default()
            };
            let mut trial = shallow(BOTH[(seed % 2) as usize]);
            trial.mission.legs[0] = leg;
            trial.mission.max_duration_s = trial.mission.least_duration_s() as u32 + 60;
            trial.scenario.seed = seed;
            trial.scenario.ocean.water_depth_m = 120.0;
            // Over the time that such a mission takes; one in twenty about the link.
            let span_s = if seed % 20 == 0 { 40.0 } else { 0.3 * f64::from(trial.mission.max_duration_s) };
            let at = draw(5) * span_s;
            let mut board = trial.board().expect("a board");
            let out = trial.over_the_line(&mut board, |setup| setup.events = vec![(at, Event::BoardSilent(true))]).expect("a flight");
            let phase = written(&out, 6, 0.0).last().map_or(-1, |phase| *phase as i32);
            let beyond_m = out.max_depth_m - f64::from(depth_max_m);
            let fine = out.home && beyond_m < 8.0;
            let said = format!(
                "seed {seed}, silent at {at:.0} s: {:?} {:?}, deepest {:.1} of {depth_max_m}",
                out.doing, out.aborted, out.max_depth_m
            );
            (phase, beyond_m, out.duration_s - at, (!fine).then_some(said))
        })
        .collect();
    let mut phases = std::collections::BTreeMap::<i32, usize>::new();
    flights.iter().for_each(|(phase, ..)| *phases.entry(*phase).or_default() += 1);
    let beyond_m = flights.iter().fold(f64::NEG_INFINITY, |most, flight| most.max(flight.1));
    let longest_s = flights.iter().fold(f64::NEG_INFINITY, |most, flight| most.max(flight.2));
    println!(
        "{} missions, by the phase that the silence began in (-1: before the first order): {phases:?}; at most {beyond_m:.1} m below the turn, {:.1} h to the surface",
        flights.len(),
        longest_s / 3600.0
    );
    let lost: Vec<&String> = flights.iter().filter_map(|f| f.3.as_ref()).collect();
    assert!(lost.is_empty(), "{lost:#?}");
    assert!([-1, 1, 2, 3, 4].iter().all(|phase| phases.contains_key(phase)), "a phase was missed: {phases:?}");
    assert!(phases.get(&6).is_none_or(|done| *done < 100), "most after the mission: {phases:?}");
}

#[test]
fn the_list_of_a_deep_vehicle_asks_for_its_oil() {
    let trial = Trial { config: Config::new(Settings::slocum_1000()).expect("valid"), ..shallow(Wings::Standard) };
    let ini = crate::flight::ini(trial.list());
    assert!(
        ini.contains("m_de_oil_vol cc\n") && ini.contains("x_de_oil_vol_max cc\n") && ini.starts_with("mp\nu_mission_param_a\n"),
        "{ini}"
    );
}
