//! What the board takes: the states that its loop enters on the models of its parts, and what it never does in them.

use parts::Work;
use plant::World;
use rig::flight::closed_loop::{End, Setup};
use rig::flight::power::{Budget, budget};
use rig::flight::{mission_file, own_parts, worlds};
use rig::seats::parts::OwnParts;
use rig::seats::{Link, Seat};
use signals::{Phase, Strap, Timebase};

/// Deepest dive that the board's transducer of 30 bar measures, m.
const DEEPEST_M: f32 = 285.0;

/// A built-in mission, no deeper than the transducer measures.
fn flown(mission: &str) -> Budget {
    let mut mission = mission_file::built_in(mission).unwrap();
    mission.legs.iter_mut().for_each(|leg| leg.depth_max_m = leg.depth_max_m.min(DEEPEST_M));
    let world = World::new(worlds::for_mission(&mission)).unwrap();
    budget(world, &Setup::new(mission)).unwrap()
}

fn share(found: &Budget, what: &str) -> f64 {
    found.rows.iter().find(|r| r.what.contains(what)).unwrap().share
}

/// Board milliseconds less bench milliseconds.
fn late_ms(board: &mut OwnParts) -> f64 {
    board.pass();
    // What it said at the beginning of that pass: within a pass and a rest.
    let said_ms = board.helm().utc.said().board_ms.unwrap();
    said_ms as f64 - board.passed_at_ns() as f64 * 1e-6
}

/// A mission under way, so many cycles long; `change` before it is launched.
fn under_way(cycles: u32, change: impl Fn(&OwnParts)) -> Link<OwnParts> {
    let mission = mission_file::built_in("sea").unwrap();
    let mut link = own_parts::board(World::new(worlds::for_mission(&mission)).unwrap(), &Setup::new(mission.clone()));
    change(link.wire());
    link.hello().unwrap();
    link.launch(&mission).unwrap();
    assert!((0..cycles).all(|_| link.wire().cycle(30.0).is_some()));
    link
}

fn stopped_s(link: &mut Link<OwnParts>) -> f64 {
    link.wire().bench.clock.worked_s(Work::Stop)
}

#[test]
fn hil_controller_and_sensors_take_at_most_8_ma_in_a_mission() {
    for (mission, most_ma) in [("deep", 8.0), ("sea", 8.0)] {
        let found = flown(mission);
        println!(
            "{mission}: {:.2} mA, motors {:.2} mA, {:.0} days, {:?}; stopped {:.3}, compass {:.3}, GPS {:.3}",
            found.electronics_ma,
            found.motors_ma,
            found.endurance_days(),
            found.flight.end,
            share(&found, "stopped"),
            share(&found, "compass"),
            share(&found, "GPS")
        );
        for row in &found.rows {
            println!("  {:40} {:8.4} {:8.3} mA", row.what, row.share, row.mean_ma);
        }
        assert_eq!(found.flight.end, End::Done, "{mission}");
        assert!(found.electronics_ma > 3.0 && found.electronics_ma <= most_ma, "{mission}: {}", found.electronics_ma);
    }
}

#[test]
fn the_power_budget_is_that_of_the_states_that_the_loop_enters() {
    let found = flown("sea");
    let [(pressure_s, least_pressure_s), (adc_s, least_adc_s), (compass_s, least_compass_s)] = found.per_cycle_s;
    // The transducer converts four times a cycle, for 9.04 of the 9.3 ms that are waited.
    assert!((pressure_s / least_pressure_s - 1.0).abs() < 0.1, "{pressure_s} s a cycle, {least_pressure_s} by the firmware's constant");
    // The ADC at least four times, and twice for each look at the motors.
    assert!(adc_s > least_adc_s && adc_s < 12.0 * least_adc_s, "{adc_s} {least_adc_s}");
    // The compass as long as the reading needs it, and all the time on deck.
    assert!(compass_s >= least_compass_s && compass_s < 1.15 * least_compass_s, "{compass_s} {least_compass_s}");
    let three = share(&found, "running") + share(&found, "sleeping") + share(&found, "stopped");
    assert!((three - 1.0).abs() < 1e-9 && share(&found, "running") < 0.1 && share(&found, "stopped") > 0.3, "{}", share(&found, "stopped"));
}

#[test]
fn hil_the_chip_stops_only_while_nothing_moves_and_nobody_speaks() {
    let mut link = under_way(1, |_| {});
    let launched_s = link.wire().bench.clock.now_ns() as f64 * 1e-9;
    let (mut stops, mut first_s) = (0, f64::INFINITY);
    for _ in 0..60_000 {
        let board = link.wire();
        let before_s = board.bench.clock.worked_s(Work::Stop);
        board.pass();
        let stop_s = board.bench.clock.worked_s(Work::Stop) - before_s;
        if stop_s == 0.0 {
            continue;
        }
        stops += 1;
        first_s = first_s.min(board.bench.clock.now_ns() as f64 * 1e-9 - stop_s - launched_s);
        // The watchdog cannot be stopped: 8.1 s at its fastest.
        assert!(stop_s <= devices::stop::MOST_MS as f64 * 1e-3 + 0.01, "{stop_s} s");
        let drive = board.bench.outputs.borrow().drive();
        assert!(drive.pump.is_none() && drive.mass.is_none() && drive.fin_rad.is_none() && !drive.fire, "{drive:?}");
        for work in [Work::Compass, Work::Gps, Work::Analog, Work::Bridges, Work::Servo] {
            assert_eq!(board.bench.clock.on_ns(work), None, "{work:?}");
        }
        let rtc = board.bench.rtc.borrow();
        assert!(rtc.stop.on_crystal() && rtc.stop.is_quiet(), "the clock is as it was, nothing is left to be served");
    }
    // A minute after the last byte of the launch, which came a cycle before.
    assert!(stops > 500 && first_s >= 55.0, "{stops} stops, the first {first_s} s after the launch");
    assert_eq!((link.wire().hangs, link.wire().resets), (0, 0));
}

#[test]
fn hil_no_stop_on_deck_at_a_bench_or_with_a_host_on_the_line() {
    // On deck.
    let mission = mission_file::built_in("sea").unwrap();
    let mut link = own_parts::board(World::new(worlds::for_mission(&mission)).unwrap(), &Setup::new(mission));
    link.hello().unwrap();
    (0..20_000).for_each(|_| link.wire().pass());
    assert_eq!(stopped_s(&mut link), 0.0, "on deck");
    // Someone fits the strap, or somebody speaks.
    let mut link = under_way(100, |_| {});
    let before_s = stopped_s(&mut link);
    assert!(before_s > 50.0, "{before_s}");
    link.wire().strap(Strap::Bench);
    link.wire().pass();
    let fitted_s = stopped_s(&mut link);
    (0..20).for_each(|_| assert!(link.wire().cycle(30.0).is_some()));
    assert_eq!(stopped_s(&mut link), fitted_s, "strap fitted");
    link.wire().strap(Strap::Deployment);
    (0..20).for_each(|_| assert!(link.wire().cycle(30.0).is_some()));
    assert!(stopped_s(&mut link) > fitted_s + 10.0);
    let said_s = stopped_s(&mut link);
    link.hello().unwrap();
    assert!(link.resent > 0 || stopped_s(&mut link) == said_s, "the byte that ends a stop is lost, the request repeated");
    let said_s = stopped_s(&mut link);
    (0..14).for_each(|_| assert!(link.wire().cycle(30.0).is_some()));
    assert_eq!(stopped_s(&mut link), said_s, "a minute after the last byte");
    (0..10).for_each(|_| assert!(link.wire().cycle(30.0).is_some()));
    assert!(stopped_s(&mut link) > said_s);
}

#[test]
fn hil_the_lines_first_edge_ends_a_stop() {
    let mut link = under_way(100, |_| {});
    let board = link.wire();
    let now_ns = board.bench.clock.now_ns();
    board.bench.rtc.borrow_mut().line_ns = Some(now_ns + 1);
    // In the next stop the line speaks; then there is none for a minute.
    let mut speaking = || {
        for _ in 0..4_000 {
            let next_ns = board.bench.clock.now_ns() + 300_000_000;
            board.bench.rtc.borrow_mut().line_ns = Some(next_ns);
            let before_s = board.bench.clock.worked_s(Work::Stop);
            board.pass();
            if board.bench.clock.worked_s(Work::Stop) > before_s && board.bench.rtc.borrow().line_ns.is_none() {
                return board.bench.clock.worked_s(Work::Stop) - before_s;
            }
        }
        panic!("no stop");
    };
    let stopped = speaking();
    assert!(stopped <= 0.3 + 1e-6, "{stopped} s");
    let before_s = board.bench.clock.worked_s(Work::Stop);
    (0..14).for_each(|_| assert!(board.cycle(30.0).is_some()));
    assert_eq!(board.bench.clock.worked_s(Work::Stop), before_s);
}

#[test]
fn hil_time_over_stops_is_right_to_100_ppm_and_8_ms() {
    for crystal_ppm in [-95.0, 0.0, 95.0] {
        let mut link = under_way(1_000, |board| board.bench.rtc.borrow_mut().crystal_ppm = Some(crystal_ppm));
        let stopped = stopped_s(&mut link);
        let board = link.wire();
        let seconds = board.bench.clock.now_ns() as f64 * 1e-9;
        let late_ms = late_ms(board);
        println!("crystal {crystal_ppm:+} ppm: {stopped:.0} of {seconds:.0} s stopped, {late_ms:+.1} ms");
        assert!(stopped > 0.3 * seconds);
        assert!(late_ms.abs() <= 1e-3 * 100.0 * seconds + 8.0, "{late_ms} ms in {seconds} s");
        assert_eq!((board.hangs, board.resets), (0, 0));
    }
}

#[test]
fn hil_without_a_calendar_clock_that_can_be_trusted_it_only_sleeps() {
    let absent = |board: &OwnParts| board.bench.rtc.borrow_mut().absent = true;
    let internal = |board: &OwnParts| board.bench.rtc.borrow_mut().crystal_ppm = None;
    let fast = |board: &OwnParts| board.bench.rtc.borrow_mut().crystal_ppm = Some(100_000.0);
    for (what, change) in [("absent", absent as fn(&OwnParts)), ("internal", internal), ("another crystal", fast)] {
        let mut link = under_way(100, change);
        assert_eq!(stopped_s(&mut link), 0.0, "{what}");
        assert_eq!((link.wire().hangs, link.wire().resets), (0, 0), "{what}");
    }
}

#[test]
fn hil_a_crystal_that_does_not_start_again_is_known_and_flown_without() {
    let mut link = under_way(100, |_| {});
    let board = link.wire();
    board.bench.rtc.borrow_mut().stop.crystal_fails = true;
    (0..10).for_each(|_| assert!(board.cycle(30.0).is_some()));
    assert_eq!(board.helm().utc.said().base, Timebase::NoCrystal);
    assert_eq!((board.hangs, board.resets), (0, 0));
}

#[test]
fn hil_a_calendar_clock_that_breaks_costs_at_most_one_reset_into_safe() {
    let mut resets = 0;
    for nth in 1..12 {
        let mut link = under_way(60, |_| {});
        let board = link.wire();
        // After the so manyth stop: within the next one, or seen before it by the chip's own clock.
        for _ in 0..nth {
            let before_s = board.bench.clock.worked_s(Work::Stop);
            assert!((0..4_000).any(|_| {
                board.pass();
                board.bench.clock.worked_s(Work::Stop) > before_s
            }));
        }
        board.bench.rtc.borrow_mut().crystal_ppm = None;
        let phases: Vec<_> = (0..20).filter_map(|_| board.cycle(60.0)).map(|made| made.answer.trace.phase).collect();
        assert!(board.hangs <= 1 && board.hangs == board.resets, "{nth}: {} hangs", board.hangs);
        assert_eq!(phases.last() == Some(&Phase::Safe), board.hangs == 1, "{nth}: {:?}", phases.last());
        let stopped_s = board.bench.clock.worked_s(Work::Stop);
        assert!((0..10).all(|_| board.cycle(30.0).is_some()));
        assert_eq!(board.bench.clock.worked_s(Work::Stop), stopped_s, "{nth}: it stops no more");
        resets += board.resets;
    }
    println!("{resets} resets of 11");
}
