//! Parts of the law one by one, where no flight of the toy takes them: calls home in each stage, dives and climbs without way, loads, and
//! memory that no flight can have written.

use super::toy::Toy;
use crate::glide::{Choice, steeper_rad, table_rate_m_s};
use crate::safety::{Release, Safety, Verdict, Watch};
use crate::senses::{Seen, Senses};
use crate::turn::{Turn, Underway};
use crate::voyage::{NO_WAY_S, Stage, Top, Voyage, longest_turn_s};
use crate::{Config, Settings, State, belief::Belief, step, within_range};
use signals::{Abort, ActuatorCommand, Goal, Leg, Micros, Mission, Phase, Reading, SensorFrame, Surface, Switch, Wings};

const NOW_S: u64 = 100_000;

fn ago(s: u64) -> Micros {
    Micros::from_secs(NOW_S - s)
}

/// A vehicle under water with its pump out and all its senses.
fn seen(depth_m: f32) -> Seen {
    let (config, depth) = (Config::default(), Reading::now(depth_m));
    let frame = SensorFrame { depth_m: depth, depth2_m: depth, surface: Surface::default(), ..Toy::new(&config).frame() };
    Senses::default().observe(&config, 4.0, &frame, 0.0)
}

#[test]
fn each_stage_hears_a_call_home_and_turns_round_without_way() {
    let (config, leg, now) = (Config::default(), Leg::default(), ago(0));
    let after = |stage: Stage, depth_m: f32, change: fn(&mut Voyage)| {
        let mut voyage = Voyage::new(Mission::default());
        voyage.stage = stage;
        change(&mut voyage);
        voyage.advance(&config, now, &seen(depth_m), &leg, 0.0);
        voyage
    };
    type Change = fn(&mut Voyage);
    let (keep, home): (Change, Change) = (|_| (), |v| v.homeward = true);
    let dive = |s| Stage::Dive { since: ago(s), mark_m: 10.0, mark_since: ago(s) };
    for (s, phase, turns) in [(u64::from(NO_WAY_S), Phase::Dive, 0), (u64::from(NO_WAY_S) + 1, Phase::InflectLow, 1)] {
        let voyage = after(dive(s), 10.5, keep);
        assert_eq!((voyage.phase(), voyage.no_way_turns), (phase, turns), "{s} s at one depth");
    }
    let turn = Underway { from_m: 20.0, speed_m_s: 0.1, ballast_m3: 2e-4, peak_m: 20.0 };
    let over = ago(longest_turn_s(&config) as u64 + 1);
    let low = Stage::InflectLow { since: over, turn };
    for (change, top) in [(keep, Top::Turn), (home, Top::End), (|v| v.surface_due = true, Top::Shore)] {
        assert_eq!(after(low, 20.0, change).stage, Stage::Climb { since: now, top, mark_m: 20.0, mark_since: now });
    }
    // A turn that only its time ended teaches nothing.
    let voyage = after(Stage::InflectHigh { since: over, turn }, 5.0, keep);
    assert_eq!((voyage.phase(), voyage.high), (Phase::Dive, Turn::default()));
    let climb = |mark_m| Stage::Climb { since: ago(100), top: Top::Turn, mark_m, mark_since: ago(1) };
    assert_eq!(after(climb(15.0), 10.0, home).stage, Stage::Climb { since: ago(100), top: Top::End, mark_m: 10.0, mark_since: now });
    assert_eq!(after(climb(1.0), 0.5, home).stage, Stage::Done);
    let comms = |s| Stage::Comms { since: ago(s), heard: false, fixed: false };
    let patience_s = config.comms_patience_s as u64;
    for (stage, depth_m, change, phase) in [
        (comms(patience_s), 10.0, home, Phase::Comms),
        (comms(patience_s), 4.0, home, Phase::Done),
        (comms(patience_s - 1), 4.0, home, Phase::Comms),
        (comms(patience_s), 4.0, keep, Phase::Dive),
        (Stage::Comms { since: ago(8), heard: true, fixed: true }, 10.0, home, Phase::Done),
    ] {
        assert_eq!(after(stage, depth_m, change).phase(), phase, "{stage:?} at {depth_m} m");
    }
    // A turn is near within twice its carry: 0.3 m at no rate.
    for (stage, depth_m, near) in [
        (dive(8), leg.depth_max_m - 0.59, true),
        (dive(8), leg.depth_max_m - 0.61, false),
        (climb(9.0), leg.depth_min_m + 0.59, true),
        (climb(9.0), leg.depth_min_m + 0.61, false),
        (Stage::Done, leg.depth_max_m, false),
    ] {
        let mut voyage = Voyage::new(Mission::default());
        voyage.stage = stage;
        assert_eq!(voyage.turn_is_near(&config, &seen(depth_m), &leg, 0.0), near, "{stage:?} at {depth_m} m");
    }
    for (change, phase) in [(keep, Phase::Surface), (home, Phase::Done)] {
        let mut voyage = after(Stage::Safe, 0.0, change);
        voyage.go_on(now);
        assert_eq!(voyage.phase(), phase);
    }
}

#[test]
fn turns_begin_and_end_where_depth_bottom_and_dwell_say() {
    let (config, now) = (Config::default(), ago(0));
    let legs = [Leg { dives: 2, depth_min_m: 10.0, ..Leg::default() }, Leg::default()];
    let mut mission = Mission::default();
    mission.legs.clear();
    mission.legs.extend(legs);
    let fresh = Voyage::new(mission);
    let after = |voyage: &Voyage, stage: Stage, seen: Seen, ballast_m3: f32| {
        let mut voyage = voyage.clone();
        voyage.stage = stage;
        voyage.advance(&config, now, &seen, &legs[0], ballast_m3);
        voyage
    };
    let climb = |top, s| Stage::Climb { since: ago(s), top, mark_m: 1.0, mark_since: ago(s) };
    // At rest the pump is started 0.3 m early; after the last dive of a leg where the next one turns, if that is shallower.
    let first = after(&fresh, climb(Top::Turn, 8), seen(10.29), 0.0);
    assert_eq!((first.phase(), first.dives), (Phase::InflectHigh, 1));
    for (voyage, depth_m, phase) in
        [(&fresh, 10.31, Phase::Climb), (&first, 10.29, Phase::Climb), (&first, 3.31, Phase::Climb), (&first, 3.29, Phase::InflectHigh)]
    {
        assert_eq!(after(voyage, climb(Top::Turn, 8), seen(depth_m), 0.0).phase(), phase, "{depth_m} m");
    }
    // A depth that is off does not keep it waiting: near the surface, and still for a minute.
    for (depth_m, s, phase) in [(4.9, 60, Phase::Climb), (4.9, 61, Phase::Done), (5.1, 61, Phase::Climb), (0.9, 8, Phase::Done)] {
        assert_eq!(after(&fresh, climb(Top::End, s), seen(depth_m), 0.0).phase(), phase, "{depth_m} m, {s} s");
    }
    for (rate_m_s, ballast_m3, s, phase) in [
        (-0.02, 1e-4, 4, Phase::InflectLow),
        (-0.02, 1e-4, 8, Phase::Climb),
        (0.02, 1e-4, 8, Phase::InflectLow),
        (-0.02, -1e-4, 8, Phase::InflectLow),
    ] {
        let low = Stage::InflectLow { since: ago(s), turn: Underway::default() };
        assert_eq!(after(&fresh, low, Seen { rate_m_s, ..seen(20.0) }, ballast_m3).phase(), phase, "{rate_m_s} {ballast_m3} {s}");
    }
    for (above_m, phase, turns) in [(0.29, Phase::InflectLow, 1), (0.31, Phase::Dive, 0)] {
        let mut voyage = fresh.clone();
        voyage.stage = Stage::Dive { since: ago(8), mark_m: 20.0, mark_since: ago(8) };
        let near = Seen { altitude_m: Some(config.min_altitude_m + above_m), ..seen(20.0) };
        for phase in [Phase::Dive, Phase::Dive, phase] {
            voyage.advance(&config, now, &near, &legs[0], 0.0);
            assert_eq!(voyage.phase(), phase, "{above_m} m");
        }
        assert_eq!(voyage.bottom_turns, turns);
    }
}

#[test]
fn a_climb_without_way_or_drive_takes_all_the_pump_has() {
    let config = Config::default();
    let full = config.pump_m3;
    for (top, still_s, ballast_m3, want) in [
        (Top::Turn, 120, 1e-4, 1e-4),
        (Top::Turn, 121, 1e-4, full),
        (Top::Turn, 0, 0.0, 0.0),
        (Top::Shore, 0, f32::NAN, full),
        (Top::Turn, 0, f32::INFINITY, full),
    ] {
        let mut voyage = Voyage::new(Mission::default());
        voyage.stage = Stage::Climb { since: ago(still_s), top, mark_m: 20.0, mark_since: ago(still_s) };
        assert_eq!(voyage.order(&config, ago(0), &Leg { ballast_m3, ..Leg::default() }).ballast_m3, want, "{top:?} {still_s} {ballast_m3}");
    }
}

fn watch<T>(seen: &Seen, change: fn(&mut Watch<'_>), judge: impl FnOnce(&Watch<'_>) -> T) -> T {
    let config = Config::default();
    let frame = Toy::new(&config).frame();
    let commanded = ActuatorCommand { ballast_m3: config.pump_m3, ..ActuatorCommand::default() };
    let mut watch = Watch {
        config: &config,
        clock: Micros::from_secs(1_000),
        seen,
        frame: &frame,
        commanded: &commanded,
        ballast_m3: config.pump_m3,
        table_rate_m_s: None,
        phase: Phase::Climb,
        leg_max_m: 30.0,
        max_duration_s: 86_400,
        climb_stalled: false,
        no_way_turns: 0,
        bottom_turns: 0,
    };
    change(&mut watch);
    judge(&watch)
}

#[test]
fn each_count_of_the_mission_calls_home_at_its_limit() {
    for (change, cause) in [
        ((|_| ()) as fn(&mut Watch<'_>), None),
        (|w| w.climb_stalled = true, Some(Abort::Stalled)),
        (|w| w.no_way_turns = 1, None),
        (|w| w.no_way_turns = 2, Some(Abort::Stalled)),
        (|w| w.bottom_turns = 4, None),
        (|w| w.bottom_turns = 5, Some(Abort::Bottom)),
    ] {
        assert_eq!(watch(&seen(10.0), change, |w| Safety::default().judge(w).abort), cause);
    }
    // Twice in vain at the surface with the antenna under water; once may be ice.
    let waits = Seen { dt_s: Config::default().comms_patience_s, ..seen(5.0) };
    let mut safety = Safety::default();
    let causes = [(); 2].map(|()| watch(&waits, |w| w.phase = Phase::Comms, |w| safety.judge(w).abort));
    assert_eq!(causes, [None, Some(Abort::Stalled)]);
}

#[test]
fn too_deep_is_five_metres_or_a_fiftieth_below_the_working_depth() {
    let shelf: fn(&mut Watch<'_>) = |w| w.leg_max_m = 200.0;
    let deep: fn(&mut Watch<'_>) = |w| {
        w.config = Box::leak(Box::new(Config::new(Settings::slocum_1000()).expect("valid")));
        w.leg_max_m = 1000.0;
    };
    for (depth_m, change, found) in [(204.5, shelf, false), (205.5, shelf, true), (1019.0, deep, false), (1021.0, deep, true)] {
        let mut safety = Safety::default();
        let causes = [(); 2].map(|()| watch(&Seen { depth_m, ..seen(10.0) }, change, |w| safety.judge(w).abort));
        assert_eq!(causes, [None, found.then_some(Abort::OverDepth)], "{depth_m}");
    }
}

#[test]
fn numbers_that_are_none_leave_nothing_in_the_watches() {
    let (mut safety, mut fresh, none) = (Safety::default(), Safety::default(), f32::NAN);
    let bad = Seen { dt_s: none, depth_m: none, rate_m_s: none, heading_rad: Some(none), ..seen(10.0) };
    let _ = watch(&bad, |_| (), |w| safety.judge(w));
    for cycle in 0..30 {
        let (hit, new) = watch(&Seen { rate_m_s: -0.1, ..seen(10.0) }, |_| (), |w| (safety.judge(w), fresh.judge(w)));
        // How long the depth was not held against the surface is not known any more.
        assert_eq!(hit, Verdict { surface: true, ..new }, "cycle {cycle}");
    }
}

/// Cycles in which the vehicle is found to sink on, or its weight is fired, the first two.
fn found(seen: Seen, change: fn(&mut Watch<'_>), mut judge: impl FnMut(&Watch<'_>) -> bool) -> Vec<usize> {
    (1..40).filter(|_| watch(&seen, change, &mut judge)).take(2).collect()
}

#[test]
fn a_load_that_is_known_of_is_found_to_sink_sooner_until_the_weight_goes() {
    let half: fn(&mut Watch<'_>) = |w| w.ballast_m3 *= 0.5;
    for (rate_m_s, loaded, fired, change, cycles) in [
        (0.0, false, false, (|_| ()) as fn(&mut Watch<'_>), &[][..]),
        (0.05, false, false, |_| (), &[15, 16]),
        (0.0, true, false, |_| (), &[10, 11]),
        (0.0, true, true, |_| (), &[]),
        // With pump left, all of it is tried before the vehicle counts as one that sinks on.
        (0.05, false, false, half, &[15, 24]),
    ] {
        let mut release = Release::default();
        if fired {
            release.fire_on();
        }
        assert_eq!(found(Seen { rate_m_s, ..seen(20.0) }, change, |w| release.sinks(w, false, loaded)), cycles);
    }
}

#[test]
fn the_weight_goes_sooner_with_a_load_and_late_under_a_keel() {
    let config = Config::default();
    let v = Verdict { abort: Some(Abort::Stalled), ..Verdict::default() };
    let sinks = |v: Verdict| (Seen { rate_m_s: 0.05, ..seen(20.0) }, v);
    let held = |depth_m, ballast_m3| (Seen { dt_s: config.min_burn_s, ballast_m3, ..seen(depth_m) }, v);
    let (out, not) = (Some(config.pump_m3), None);
    let waits = |s: f32| Some((s / config.min_burn_s).ceil() as usize);
    for ((seen, v), first) in [
        (sinks(v), Some(15)),
        (sinks(Verdict { loaded: true, ..v }), Some(3)),
        (sinks(Verdict { leak_stands: true, ..v }), Some(3)),
        ((seen(24.1), Verdict { leak_stands: true, ..v }), Some(1)),
        ((seen(23.9), Verdict { leak_stands: true, ..v }), None),
        (held(20.0, out), waits(config.max_burn_s)),
        (held(20.0, not), Some(1)),
        (held(7.9, out), waits(2.0 * config.max_burn_s)),
        (held(2.1, not), Some(1)),
        (held(1.9, not), waits(2.0 * config.max_burn_s)),
        (held(0.6, out), None),
        // Higher than any wave: no depth at all.
        (held(-3.1, out), waits(config.max_burn_s)),
    ] {
        let mut release = Release::default();
        let fires = |w: &Watch<'_>| {
            release.sinks(w, true, false);
            release.fire(w, &v)
        };
        assert_eq!(found(seen, |_| (), fires).first().copied(), first, "{} m, {:?} m³", seen.depth_m, seen.ballast_m3);
    }
    // Less than a metre in the time that it has is no rise.
    for (way_m, fires) in [(1.1, false), (0.9, true)] {
        let mut release = Release::default();
        let at = |i: u8| Seen { dt_s: 0.6 * config.max_burn_s, ..seen(100.0 - way_m * f32::from(i)) };
        assert_eq!((0..10).any(|i| watch(&at(i), |_| (), |w| release.fire(w, &v))), fires, "{way_m} m");
    }
}

#[test]
fn the_second_way_home_alone_commands_all_of_it() {
    let config = Config::default();
    let mut state = State::new(&config, Mission::default(), Micros(0));
    let frame = Toy::new(&config).frame();
    let limits = crate::backup_limits(&config, &Mission::default());
    assert_eq!(state.learned(), [1.0; 3], "the table as it is");
    let leaks = SensorFrame { leak: Switch::Alarm, ..frame };
    assert!((0..5).any(|_| state.backup.check(&limits, Micros(0), &leaks).is_some()));
    let answer = step(&config, None, &mut state, Micros::from_secs(4), &frame);
    assert_eq!((answer.trace.phase, answer.trace.abort, state.first_cause()), (Phase::Safe, Some(Abort::Leak), Some(Abort::Leak)));
    let c = answer.command;
    assert_eq!((c.ballast_m3, c.battery_mass_m, c.fin_rad, c.drop_weight, c.beacon), (config.pump_m3, 0.0, 0.0, false, true));
}

#[test]
fn damaged_stages_come_home_and_damaged_orders_stay_in_range() {
    let (config, none) = (Config::default(), f32::NAN);
    let (m, since) = (1.0, Micros(0));
    let low = |from_m, speed_m_s, ballast_m3, peak_m| Stage::InflectLow { since, turn: Underway { from_m, speed_m_s, ballast_m3, peak_m } };
    for (stage, cause) in [
        (low(m, m, m, m), None),
        (low(none, m, m, m), Some(Abort::Internal)),
        (low(m, none, m, m), Some(Abort::Internal)),
        (low(m, m, none, m), Some(Abort::Internal)),
        (low(m, m, m, f32::INFINITY), Some(Abort::Internal)),
        (Stage::Dive { since, mark_m: none, mark_since: since }, Some(Abort::Internal)),
        (Stage::Climb { since, top: Top::Turn, mark_m: none, mark_since: since }, Some(Abort::Internal)),
    ] {
        let mut state = State::new(&config, Mission::default(), Micros(0));
        (state.voyage.stage, state.last.fin_rad, state.last.battery_mass_m) = (stage, none, 0.01);
        state.heal();
        assert_eq!((state.last.fin_rad, state.last.battery_mass_m), (0.0, 0.01), "what is a number stays");
        let answer = step(&config, None, &mut state, Micros::from_secs(4), &Toy::new(&config).frame());
        assert_eq!((answer.trace.abort, state.first_cause()), (cause, cause), "{stage:?}");
    }
    let (pump, mass, fin) = (config.pump_m3, config.battery_m, config.fin_rad);
    // What is no number lifts, and pitches and turns nowhere.
    for ((b, m, f), want) in [
        ((-pump, mass, -fin), (-pump, mass, -fin)),
        ((-2.0 * pump, mass, fin), (-pump, mass, fin)),
        ((0.0, 2.0 * mass, fin), (0.0, mass, fin)),
        ((0.0, mass, -2.0 * fin), (0.0, mass, -fin)),
        ((none, none, none), (pump, 0.0, 0.0)),
        ((f32::NEG_INFINITY, 0.0, f32::INFINITY), (pump, 0.0, 0.0)),
    ] {
        let c = within_range(&config, ActuatorCommand { ballast_m3: b, battery_mass_m: m, fin_rad: f, ..ActuatorCommand::default() });
        assert_eq!((c.ballast_m3, c.battery_mass_m, c.fin_rad), want);
    }
}

#[test]
fn the_pitch_follows_table_and_goal_and_a_fixed_one_stays() {
    let (config, best) = (Config::default(), Leg::default());
    let table = polar::builtin(Wings::Standard).expect("built in");
    let fixed = Leg { goal: Goal::FixedPitch { pitch_rad: 0.4 }, ..best };
    let searched = |choice: &mut Choice, leg: &Leg| {
        (0..16).for_each(|_| choice.search(&config, &table, leg, 0));
        choice.settle(&config, &table, leg);
        choice.pitch_rad(&config, 0.0)
    };
    let mut choice = Choice::default();
    assert_eq!(choice.pitch_rad(&config, 0.0), config.preset_pitch_rad, "before any leg");
    choice.follow(&config, None, 0, 0, &best);
    assert!(choice.is_preset() && !choice.wants_lesson(0));
    assert_eq!(searched(&mut choice, &best), config.preset_pitch_rad);
    choice.follow(&config, Some(&table), 1, 0, &best);
    let first = choice.pitch_rad(&config, 0.0);
    assert!(!choice.is_preset() && choice.wants_lesson(0) && choice.wants_lesson(2) && !choice.wants_lesson(3));
    assert!(first > 0.2 && first < config.preset_pitch_rad, "{first}");
    // Wings that let go there make it steeper; that is of this table, not of another.
    choice.retreat();
    assert!(choice.pitch_rad(&config, 0.0) > first + 0.03);
    choice.follow(&config, Some(&table), 1, 0, &best);
    assert!(searched(&mut choice, &best) > first + 0.03 && !choice.is_steep(), "not that flat again");
    choice.follow(&config, Some(&table), 2, 0, &best);
    assert!(choice.is_steep(), "nothing is known of a new table's wings");
    choice.follow(&config, Some(&table), 2, 1, &fixed);
    assert_eq!((searched(&mut choice, &fixed), choice.pitch_rad(&config, 0.1), choice.wants_lesson(0)), (0.4, 0.4, false));
    // Levels are learned apart where the pitch is chosen for the best glide only.
    let levels = Config::new(Settings { learns_levels: true, ..Settings::default() }).expect("valid");
    let speed = Leg { goal: Goal::BestSpeed, ..best };
    assert!(steeper_rad(&levels, &best, 1, false) > 0.1 && steeper_rad(&levels, &best, 3, false) == 0.0);
    assert!(steeper_rad(&levels, &speed, 1, false) == 0.0 && steeper_rad(&config, &best, 1, false) == 0.0);
    assert_eq!(Belief::of(&table).steady(&table, 0.0, 2e-4), None, "no lift, no glide");
    for alpha_rad in [0.6, 1.0, 1.4].map(|share| share * table.best_alpha_rad()) {
        let glide = Belief::of(&table).steady(&table, alpha_rad, 2e-4).expect("a glide");
        let rate_m_s = table_rate_m_s(&table, glide.gamma_rad() - alpha_rad, 2e-4).expect("a glide");
        assert!((rate_m_s / (glide.speed_m_s() * glide.sin_gamma) - 1.0).abs() < 0.01, "{alpha_rad}: {rate_m_s}");
    }
}

#[test]
fn an_impossible_reading_is_refused_and_a_place_seen_thrice_taken() {
    type Put = fn(&mut SensorFrame, Reading);
    type Get = fn(&Seen) -> Option<f32>;
    let c = Config::default();
    for (put, get, low, high) in [
        ((|f, r| f.ballast_m3 = r) as Put, (|s| s.ballast_m3) as Get, -1.2 * c.pump_m3, 1.2 * c.pump_m3),
        (|f, r| f.battery_mass_m = r, |s| s.battery_m, -1.2 * c.battery_m, 1.2 * c.battery_m),
        (|f, r| f.pitch_rad = r, |s| s.pitch_rad, -1.6, 1.6),
        (|f, r| f.heading_rad = r, |s| s.heading_rad, -7.0, 13.0),
        (|f, r| f.density_kg_m3 = r, |s| (!s.density_default).then_some(s.density_kg_m3), 990.0, 1060.0),
        (|f, r| f.depth_m = r, |s| s.measured_m, -10.0, 1.5 * c.crush_depth_m),
        (|f, r| f.depth2_m = r, |s| s.measured_m, -10.0, 1.5 * c.crush_depth_m),
    ] {
        let (near, age_ms) = (0.001 * (high - low), u32::MAX);
        let mut readings = [(low - near, false), (low + near, true), (high - near, true), (high + near, false)]
            .map(|(v, ok)| (Reading::now(v), ok))
            .to_vec();
        readings.push((Reading::Sampled { value: 0.5 * (low + high), age_ms }, false));
        for (reading, taken) in readings {
            let mut frame = SensorFrame::default();
            put(&mut frame, reading);
            let seen = Senses::default().observe(&c, 4.0, &frame, 0.0);
            assert_eq!((get(&seen).is_some(), seen.refused), (taken, !taken), "{reading:?} of {low} to {high}");
        }
    }
    for (places, taken) in
        [([-2e-4, 2e-4, 2e-4, 2e-4], [true, false, false, true]), ([-2e-4, 2e-4, 0.5e-4, 2e-4], [true, false, false, false])]
    {
        let mut senses = Senses::default();
        let at = |at| SensorFrame { ballast_m3: Reading::now(at), ..SensorFrame::default() };
        assert_eq!(places.map(|place| senses.observe(&c, 1.0, &at(place), 0.0).ballast_m3.is_some()), taken, "{places:?}");
    }
}

/// By hand: 823.4 J against 1.03 MPa at half efficiency, and twice 9.62 W for 30.8 s and 2 W for 7.9 s.
#[test]
fn accuracy_the_energy_of_a_dive_is_that_of_a_sum_by_hand() {
    let dive_j = crate::dive_j(&Config::default(), &Leg { ballast_m3: 2e-4, depth_max_m: 100.0, ..Leg::default() });
    assert!((dive_j - 1_446.7).abs() < 0.5, "{dive_j}");
}
