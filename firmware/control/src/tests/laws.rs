//! Laws the controller keeps whatever it is shown, and flights of the toy.

use super::toy::Toy;
use crate::{Config, Settings, State, step, stock};
use proptest::prelude::*;
use signals::{Abort, ActuatorCommand, Answer, Flags, Leg, Micros, Mission, Phase, Reading, SensorFrame, Surface, Switch, Weight};

const CYCLE_S: f64 = 4.0;

/// One cycle of a toy flight.
struct Cycle {
    t: f64,
    z: f64,
    answer: Answer,
}

/// Flies the toy; `spoil` may change each frame and the vehicle.
fn fly(mission: Mission, cycles: usize, mut spoil: impl FnMut(&mut Toy, &mut SensorFrame, Phase)) -> (Toy, Vec<Cycle>) {
    let config = Config::default();
    let table = polar::builtin(mission.wings).ok();
    let mut toy = Toy::new(&config);
    let mut state = State::new(&config, mission, Micros(0));
    let mut log: Vec<Cycle> = Vec::new();
    for _ in 0..cycles {
        let mut frame = toy.frame();
        let phase = log.last().map_or(Phase::Surface, |c| c.answer.trace.phase);
        spoil(&mut toy, &mut frame, phase);
        let answer = step(&config, table.as_ref(), &mut state, frame.time, &frame);
        log.push(Cycle { t: toy.t, z: toy.z, answer });
        let home = answer.trace.phase == Phase::Safe && toy.z < 0.5 && toy.t > 200.0;
        if answer.trace.phase == Phase::Done || home {
            break;
        }
        toy.fly(&answer.command, CYCLE_S);
    }
    (toy, log)
}

fn cause(log: &[Cycle]) -> Option<(Abort, f64)> {
    log.iter().find_map(|c| c.answer.trace.abort.map(|a| (a, c.t)))
}

/// Time at which `phase` was first entered, s.
fn entered(log: &[Cycle], phase: Phase) -> f64 {
    log.iter().find(|c| c.answer.trace.phase == phase).map_or(f64::NAN, |c| c.t)
}

#[test]
fn flies_the_default_mission_and_comes_home() {
    let (toy, log) = fly(Mission::default(), 3000, |_, _, _| ());
    let last = log.last().expect("flew").answer.trace;
    assert_eq!((last.phase, last.dives, last.abort), (Phase::Done, 4, None));
    assert!(toy.z_max < 28.0 && toy.z_max > 25.0, "{}", toy.z_max);
    // The toy's own (L/D)max is 2.49, its drag 15 % above the table's.
    assert!(toy.x / toy.way > 0.9 * 2.49, "L/D {}", toy.x / toy.way);
}

#[test]
fn a_leak_ends_the_dive_in_the_cycle_it_is_seen() {
    let (_, log) = fly(Mission::default(), 3000, |toy, frame, _| {
        if toy.t > 200.0 {
            frame.leak = Switch::Alarm;
        }
    });
    let (cause, at) = cause(&log).expect("aborts");
    assert_eq!(cause, Abort::Leak);
    assert!(at - 200.0 <= CYCLE_S, "{at}");
    assert!(log.last().is_some_and(|c| c.z < 0.5));
}

#[test]
fn each_lost_sense_brings_the_vehicle_home_with_its_own_cause_and_in_time() {
    type Spoil = fn(&mut SensorFrame);
    let depth: Spoil = |f| (f.depth_m, f.depth2_m) = (Reading::now(f32::NAN), Reading::now(9999.0));
    let pitch: Spoil = |f| f.pitch_rad = Reading::now(f32::INFINITY);
    let pump: Spoil = |f| f.ballast_m3 = Reading::Missing;
    let all: Spoil = |f| *f = SensorFrame { seq: f.seq, time: f.time, ..SensorFrame::default() };
    for (spoil, want, bound_s) in [
        (depth, Abort::SensorDepth, 604.0),
        (pitch, Abort::SensorPitch, 70.0),
        (pump, Abort::BallastFeedback, 184.0),
        (all, Abort::LinkLost, 34.0),
    ] {
        let (toy, log) = fly(Mission::default(), 3000, |toy, frame, _| {
            if toy.t >= 160.0 {
                spoil(frame);
            }
        });
        let (got, at) = cause(&log).unwrap_or_else(|| panic!("{want:?} not seen"));
        assert_eq!(got, want);
        assert!(at - 160.0 <= bound_s, "{want:?} after {} s", at - 160.0);
        assert!(toy.z < 1.0, "{want:?}: at {} m in the end", toy.z);
    }
}

#[test]
fn each_gauge_ends_the_mission_in_the_cycle_of_its_third_alarm() {
    type Spoil = fn(&mut SensorFrame);
    let vacuum: Spoil = |f| f.vacuum_pa = Reading::now(99e3);
    let volts: Spoil = |f| f.battery_v = Reading::now(9.4);
    let charge: Spoil = |f| f.charge = Reading::now(0.05);
    for (spoil, want) in [(vacuum, Abort::Vacuum), (volts, Abort::Undervoltage), (charge, Abort::LowCharge)] {
        for first in 40..46u32 {
            let mut n = 0u32;
            let (_, log) = fly(Mission::default(), 60, |_, frame, _| {
                // Two of five before it change nothing: they are out of the last five by then.
                if n >= first || n == first - 7 || n == first - 5 {
                    spoil(frame);
                }
                n += 1;
            });
            let (got, at) = cause(&log).unwrap_or_else(|| panic!("{want:?} not seen"));
            // Cycles `first`, `first` + 1, `first` + 2: 8 s after the first reading beyond the limit.
            assert_eq!((got, at.round() as u32), (want, 4 * (first + 2)), "from cycle {first} on");
        }
    }
    // An old reading, one out of range and no number are none, however often.
    for reading in [Reading::Sampled { value: 9.4, age_ms: 61_000 }, Reading::now(-999.0), Reading::now(f32::NAN), Reading::Missing] {
        let (_, log) = fly(Mission::default(), 60, |_, f, _| (f.battery_v, f.charge, f.vacuum_pa) = (reading, reading, reading));
        assert_eq!(cause(&log), None, "{reading:?}");
    }
}

#[test]
fn a_stuck_depth_is_found_by_expected_motion_and_never_while_parked() {
    let (_, log) = fly(Mission::default(), 3000, |toy, frame, _| {
        if toy.t >= 160.0 {
            (frame.depth_m, frame.depth2_m) = (Reading::now(11.0), Reading::now(11.0));
        }
    });
    let (got, at) = cause(&log).expect("aborts");
    assert_eq!(got, Abort::StuckDepth);
    assert!(at - 160.0 <= 64.0, "after {} s", at - 160.0);

    // Four hours at the surface waiting for a shore that does not answer: the reading is constant, and right.
    let config = Config::new(Settings { comms_patience_s: 14_000.0, ..Settings::default() }).expect("valid");
    let mut state = State::new(&config, Mission { surface_every: 1, ..Mission::default() }, Micros(0));
    let mut toy = Toy::new(&config);
    for i in 0..3600u64 {
        let mut frame = toy.frame();
        frame.surface = Surface::default();
        let answer = step(&config, None, &mut state, Micros::from_secs(4 * i), &frame);
        assert_eq!(answer.trace.abort, None, "after {} s", 4 * i);
        // Held at the quay: the commands move the actuators, not the vehicle.
        toy.ballast = f64::from(answer.command.ballast_m3);
        if answer.trace.phase == Phase::Dive {
            break;
        }
    }
}

#[test]
fn a_stuck_pump_is_retried_reversed_and_then_the_weight_goes() {
    let (toy, log) = fly(Mission::default(), 3000, |toy, _, phase| toy.pump_sticks = phase == Phase::InflectLow || toy.pump_sticks);
    let (got, at) = cause(&log).expect("aborts");
    assert_eq!(got, Abort::PumpStuck);
    let turn = entered(&log, Phase::InflectLow);
    assert!(at - turn < 70.0, "{} s after the turn", at - turn);
    assert!(toy.weight_kg == 0.0 && toy.z < 1.0, "weight {} at {} m", toy.weight_kg, toy.z);
    assert!(toy.z_max < 200.0, "{}", toy.z_max);
}

#[test]
fn a_stuck_battery_is_found_and_the_pitch_is_not_blamed_for_it() {
    // At its forward end, where it stands at the surface: a steep dive, and a climb with the nose down.
    for from in [Phase::Dive, Phase::InflectLow] {
        let mut began = false;
        let (toy, log) = fly(Mission::default(), 900, |toy, frame, phase| {
            began |= phase == from;
            if began && !toy.battery_sticks {
                (toy.battery_sticks, toy.battery) = (true, 0.0254);
                frame.battery_mass_m = Reading::now(0.0254);
            }
        });
        let (cause, at) = cause(&log).expect("an abort");
        // 8 s, then stopped for six waits of eight until 120 s are counted, less what they take back: 172 s; a turn makes it
        // begin anew.
        let turn_s = f64::from(crate::waits::longest_turn_s(&Config::default()));
        let after = at - entered(&log, from);
        assert!(cause == Abort::MassStuck && after <= 172.0 + turn_s, "{from:?}: {cause:?} after {after} s");
        assert!(toy.z < 1.0, "{from:?}: {} m", toy.z);
    }
}

#[test]
fn one_spike_changes_no_phase_and_no_cause() {
    let (_, log) = fly(Mission::default(), 3000, |toy, frame, _| {
        if (toy.t / CYCLE_S) as u64 % 17 == 5 {
            frame.depth_m = Reading::now(180.0);
            frame.depth2_m = Reading::now(180.0);
        }
    });
    let last = log.last().expect("flew").answer.trace;
    assert_eq!((last.phase, last.abort), (Phase::Done, None));
}

#[test]
fn after_a_reset_the_vehicle_never_dives() {
    let config = Config::default();
    let mut state = State::after_reset(Abort::Reset);
    let mut toy = Toy::new(&config);
    for _ in 0..500 {
        let frame = toy.frame();
        let answer = step(&config, None, &mut state, frame.time, &frame);
        assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, Some(Abort::Reset)));
        assert!(answer.command.ballast_m3 >= config.pump_m3 && answer.command.beacon);
        toy.fly(&answer.command, CYCLE_S);
    }
}

#[test]
fn a_mission_too_deep_for_the_vehicle_is_not_begun() {
    let mut mission = Mission::default();
    mission.legs[0].depth_max_m = 300.0;
    let mut state = State::new(&Config::default(), mission, Micros(0));
    let answer = step(&Config::default(), None, &mut state, Micros(0), &SensorFrame::default());
    assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, Some(Abort::BadMission)));
}

#[test]
fn a_vehicle_slower_than_expected_is_called_home_at_its_time_limit() {
    let leg = Leg { dives: 2, depth_min_m: 5.0, depth_max_m: 150.0, ballast_m3: 95e-6, ..Leg::default() };
    let mut mission = Mission { legs: [leg].into_iter().collect(), ..Mission::default() };
    mission.max_duration_s = mission.least_duration_s().ceil() as u32;
    let limit_s = f64::from(mission.max_duration_s);
    // Weed: 150 times the drag, slower than the slowest that was reckoned with (0.04 m/s). It makes its way all the same.
    let (toy, log) = fly(mission.clone(), 20_000, |toy, _, _| toy.drag_area = 150.0 * 0.015);
    let (cause, at_s) = cause(&log).unwrap_or_else(|| panic!("{:?} after {} s of {limit_s}", log.last().map(|c| c.answer.trace), toy.t));
    assert_eq!(cause, Abort::OverTime, "after {at_s} s of {limit_s}");
    assert!((limit_s..limit_s + 2.0 * CYCLE_S).contains(&at_s), "after {at_s} s of {limit_s}");
    assert!(toy.z < 0.5, "home, at {} m", toy.z);
    let (_, log) = fly(mission, 20_000, |_, _, _| ());
    assert_eq!(log.last().map(|c| (c.answer.trace.phase, c.answer.trace.abort)), Some((Phase::Done, None)));
}

#[test]
fn a_shore_never_heard_calls_the_vehicle_home_when_its_patience_is_over() {
    let limit_s = f64::from(Config::default().no_comms_s);
    let leg = Leg { dives: 2000, ..Leg::default() };
    let mut mission = Mission { legs: [leg].into_iter().collect(), ..Mission::default() };
    mission.max_duration_s = mission.least_duration_s().ceil() as u32;
    let (_, log) = fly(mission, 100_000, |_, frame, _| frame.surface.comms = false);
    let (cause, at_s) = cause(&log).expect("called home");
    assert_eq!(cause, Abort::NoComms, "after {at_s} s");
    assert!((limit_s..limit_s + 2.0 * CYCLE_S).contains(&at_s), "after {at_s} s of {limit_s}");
}

#[test]
fn five_dives_in_a_row_that_the_bottom_ends_call_the_vehicle_home() {
    let leg = Leg { dives: 9, ..Leg::default() };
    let mission = Mission { legs: [leg].into_iter().collect(), max_duration_s: 200_000, ..Mission::default() };
    let (toy, log) = fly(mission, 20_000, |toy, frame, _| frame.altitude_m = Reading::now((22.0 - toy.z) as f32));
    assert_eq!(cause(&log).map(|c| c.0), Some(Abort::Bottom));
    assert!(toy.z_max < 22.0 && log.last().is_some_and(|c| c.answer.trace.dives == 4), "{} m", toy.z_max);
}

#[test]
fn a_table_for_the_other_wings_is_refused_and_the_preset_pitch_flown() {
    let config = Config::default();
    let table = polar::builtin(signals::Wings::LowAspectRatio).expect("built-in table");
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let mut toy = Toy::new(&config);
    let mut last = Answer::default();
    for _ in 0..30 {
        let frame = toy.frame();
        last = step(&config, Some(&table), &mut state, frame.time, &frame);
        toy.fly(&last.command, CYCLE_S);
    }
    assert!(last.trace.flags.contains(Flags::TABLE_REFUSED) && last.trace.table_id == 0);
    assert!((last.trace.pitch_setpoint_rad + config.preset_pitch_rad).abs() < 1e-6);
}

#[test]
fn the_clock_may_repeat_jump_and_go_back_without_an_abort_or_a_dive_lost() {
    let config = Config::default();
    let table = polar::builtin(signals::Wings::Standard).ok();
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let mut toy = Toy::new(&config);
    let mut offset = (1u64 << 32) * 1000 - 200_000_000;
    let mut last = Answer::default();
    for i in 0..3000u64 {
        match i {
            100 => offset += 3_600_000_000,
            150 => offset -= 3_600_000_000,
            _ => {}
        }
        let frame = toy.frame();
        let now = Micros(frame.time.0 + offset);
        last = step(&config, table.as_ref(), &mut state, now, &frame);
        if i % 50 == 0 {
            // The same tick again.
            last = step(&config, table.as_ref(), &mut state, now, &frame);
        }
        if last.trace.phase == Phase::Done {
            break;
        }
        toy.fly(&last.command, CYCLE_S);
    }
    assert_eq!((last.trace.phase, last.trace.dives, last.trace.abort), (Phase::Done, 4, None));
}

/// FNV-1a over the bits of a command.
fn mix(hash: u64, c: &ActuatorCommand) -> u64 {
    let words = [c.ballast_m3.to_bits(), c.battery_mass_m.to_bits(), c.fin_rad.to_bits(), u32::from(c.drop_weight), u32::from(c.beacon)];
    words.iter().flat_map(|w| w.to_le_bytes()).fold(hash, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

/// Frames from a recipe of whole numbers, commands out, bit-equal to what was
/// recorded. A change of the law changes this figure on purpose or not at all.
#[test]
fn replay_of_recorded_frames_gives_the_same_bits() {
    let config = Config::default();
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut ballast = 0.0f32;
    for i in 0..600u32 {
        // A saw-tooth of depth, pitch by its slope, a pump that follows: exact in f32.
        let saw = (i % 150) as f32;
        let (depth, pitch) = if saw < 75.0 { (saw * 0.375, -0.25) } else { ((150.0 - saw) * 0.375, 0.25) };
        let frame = SensorFrame {
            seq: i,
            depth_m: Reading::now(depth),
            pitch_rad: Reading::now(pitch),
            heading_rad: Reading::now((i % 32) as f32 * 0.125),
            ballast_m3: Reading::now(ballast),
            battery_mass_m: Reading::now(0.001_953_125),
            ..SensorFrame::default()
        };
        let answer = step(&config, None, &mut state, Micros::from_secs(4 * u64::from(i)), &frame);
        ballast = answer.command.ballast_m3;
        hash = mix(hash, &answer.command);
    }
    assert_eq!(hash, GOLDEN, "{hash:#x}");
}

const GOLDEN: u64 = 0x887c_59e9_0992_c814;

fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -60.0f32..300.0,
        2 => -0.5f32..0.5,
        2 => -3e-4f32..3e-4,
        1 => any::<f32>(),
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 9999.0, 0.0, -0.0, f32::MIN_POSITIVE, 1e-40, f32::MAX]),
    ]
}

fn any_reading() -> impl Strategy<Value = Reading> {
    prop_oneof![
        6 => any_number().prop_map(Reading::now),
        1 => Just(Reading::Missing),
        1 => (any_number(), any::<u32>()).prop_map(|(value, age_ms)| Reading::Sampled { value, age_ms }),
    ]
}

fn any_frame() -> impl Strategy<Value = SensorFrame> {
    let switch = prop::sample::select(vec![Switch::Clear, Switch::Clear, Switch::Clear, Switch::Alarm, Switch::Unknown]);
    let weight = prop::sample::select(vec![Weight::Held, Weight::Held, Weight::Released, Weight::Unknown]);
    (prop::array::uniform14(any_reading()), switch, weight, any::<(bool, bool, u32)>()).prop_map(|(r, leak, weight, (fix, comms, seq))| {
        let [
            depth_m,
            depth2_m,
            pitch_rad,
            roll_rad,
            heading_rad,
            ballast_m3,
            battery_mass_m,
            fin_rad,
            density_kg_m3,
            temperature_degc,
            altitude_m,
            battery_v,
            charge,
            vacuum_pa,
        ] = r;
        SensorFrame {
            seq,
            time: Micros(0),
            depth_m,
            depth2_m,
            pitch_rad,
            roll_rad,
            heading_rad,
            ballast_m3,
            battery_mass_m,
            fin_rad,
            density_kg_m3,
            temperature_degc,
            altitude_m,
            battery_v,
            charge,
            vacuum_pa,
            leak,
            weight,
            surface: Surface { gps_fix: fix && comms, comms: comms && !fix },
        }
    })
}

fn in_range(config: &Config, c: &ActuatorCommand) -> bool {
    c.ballast_m3.abs() <= config.pump_m3 && c.battery_mass_m.abs() <= config.battery_m && c.fin_rad.abs() <= config.fin_rad
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever the frames and the clock: commands finite and in range, the first cause latched, no dive after it.
    #[test]
    fn prop_commands_stay_in_range_and_an_abort_is_for_good(
        frames in prop::collection::vec((any_frame(), prop_oneof![4 => Just(4_000_000u64), 1 => any::<u64>()]), 1..80)
    ) {
        let config = Config::default();
        let table = polar::builtin(signals::Wings::Standard).ok();
        let mut state = State::new(&config, Mission::default(), Micros(0));
        let mut plain = stock::State::new(&config, Mission::default(), Micros(0));
        let mut now = 0u64;
        let mut first = None;
        for (frame, ahead) in frames {
            now = now.wrapping_add(ahead);
            let answer = step(&config, table.as_ref(), &mut state, Micros(now), &frame);
            prop_assert!(in_range(&config, &answer.command), "{:?}", answer.command);
            let t = &answer.trace;
            prop_assert!([t.pitch_setpoint_rad, t.alpha_rad, t.speed_m_s, t.glide_angle_rad, t.depth_m].iter().all(|v| v.is_finite()), "{t:?}");
            if first.is_some() {
                prop_assert_eq!(t.abort, first);
                prop_assert_eq!(t.phase, Phase::Safe);
                prop_assert!(answer.command.beacon);
                // Full buoyancy, but for the freeing moves of a pump that does not follow.
                let freeing = (answer.command.ballast_m3 - config.pump_m3).abs() > 1e-9;
                prop_assert!(!freeing || frame.ballast_m3 != Reading::Missing, "{:?}", answer.command);
            }
            first = first.or(t.abort);
            let answer = stock::step(&config, &mut plain, Micros(now), &frame);
            prop_assert!(in_range(&config, &answer.command), "stock {:?}", answer.command);
        }
    }

    /// Any one number of the memory damaged: in range at once, and flying or coming home two cycles later.
    #[test]
    fn prop_one_damaged_number_is_survived(which in 0usize..6, bad in any_number(), at in 20usize..400) {
        let config = Config::default();
        let table = polar::builtin(signals::Wings::Standard).ok();
        let mut toy = Toy::new(&config);
        let mut state = State::new(&config, Mission::default(), Micros(0));
        for i in 0..at + 40 {
            if i == at {
                match which {
                    0 => state.ballast_m3 = bad,
                    1 => state.pitch_wanted_rad = bad,
                    2 => state.pump_rate_m3_s = bad,
                    3 => state.steady_s = bad,
                    4 => state.estimate.alpha_rad = bad,
                    _ => state.last.battery_mass_m = bad,
                }
            }
            let frame = toy.frame();
            let answer = step(&config, table.as_ref(), &mut state, frame.time, &frame);
            prop_assert!(in_range(&config, &answer.command), "{:?}", answer.command);
            if i > at + 2 {
                let t = &answer.trace;
                let sound = t.pitch_setpoint_rad.is_finite() && t.alpha_rad.is_finite() && t.speed_m_s.is_finite();
                prop_assert!(sound || t.abort.is_some(), "{t:?}");
            }
            toy.fly(&answer.command, CYCLE_S);
        }
    }
}
