//! A board's UTC: set at the launch or by fixes, kept over a reset by the chip's calendar clock, unknown where nobody knows.

use devices::rtc::Oscillator;
use parts::gps::utc_ms;
use plant::World;
use rig::flight::closed_loop::Setup;
use rig::flight::onboard_log::{self, Wanted};
use rig::flight::{mission_file, own_parts, worlds};
use rig::seats::clock::{self, Setting};
use rig::seats::parts::OwnParts;
use rig::seats::{Link, Seat};
use signals::{TimeSource, Utc};

/// A board on deck, under a roof: no fixes until it is launched.
fn board() -> Link<OwnParts> {
    let mission = mission_file::built_in("sea").unwrap();
    own_parts::board(World::new(worlds::for_mission(&mission)).unwrap(), &Setup::new(mission))
}

fn set(link: &mut Link<OwnParts>) -> Setting {
    let clock = link.wire().bench.clock.clone();
    clock::set(link, &|| utc_ms(clock.now_ns()) as f64).unwrap()
}

fn known(link: &mut Link<OwnParts>) -> Option<Utc> {
    link.wire().helm().utc.utc()
}

/// How far the board's UTC is from the truth, ms, now that it has just made a pass.
fn error_ms(link: &mut Link<OwnParts>) -> f64 {
    let utc = known(link).expect("known");
    let now_ms = link.wire().helm().utc.said().board_ms.unwrap();
    utc.ms as f64 - utc_ms(now_ms * 1_000_000) as f64
}

/// Lets the board run.
fn run(link: &mut Link<OwnParts>, seconds: f64) {
    let board = link.wire();
    let until_ns = board.bench.clock.now_ns() + (seconds * 1e9) as u64;
    while board.bench.clock.now_ns() < until_ns {
        board.pass();
    }
}

/// The processor is held in reset for so long.
fn held_in_reset(link: &mut Link<OwnParts>, seconds: f64) {
    let board = link.wire();
    board.bench.clock.pass_ns((seconds * 1e9) as u64);
    board.restart(false);
    board.pass();
}

/// Nothing comes from the receiver.
fn no_fixes(link: &mut Link<OwnParts>) {
    link.wire().bench.gps.borrow_mut().silent_until_ns = u64::MAX;
}

#[test]
fn hil_utc_set_by_the_host_outlives_resets_within_its_bound() {
    for (crystal_ppm, internal_ppm, by) in [
        (Some(20.0), 0.0, Oscillator::Crystal),
        (Some(-95.0), 0.0, Oscillator::Crystal),
        (None, 450_000.0, Oscillator::Internal),
        (None, -450_000.0, Oscillator::Internal),
    ] {
        let mut link = board();
        no_fixes(&mut link);
        {
            let mut rtc = link.wire().bench.rtc.borrow_mut();
            (rtc.crystal_ppm, rtc.internal_ppm) = (crystal_ppm, internal_ppm);
        }
        link.hello().unwrap();
        assert_eq!(known(&mut link), None, "unknown, and not 1970");
        let setting = set(&mut link);
        assert!(matches!(setting, Setting::Set { before: None, after, .. } if after.off_s.abs() < 0.02), "{setting:?}");
        run(&mut link, 20.0);
        for held_s in [0.0, 600.0] {
            let before = known(&mut link).unwrap().within_ms;
            held_in_reset(&mut link, held_s);
            let utc = known(&mut link).expect("kept");
            assert_eq!(utc.source, TimeSource::Kept);
            let error = error_ms(&mut link).abs();
            assert!(error <= f64::from(utc.within_ms), "{by:?}: {error} ms off, said {}", utc.within_ms);
            // No wider than by what was counted since it was kept.
            let pace = 1.0 + 1e-6 * crystal_ppm.unwrap_or(internal_ppm);
            let most = f64::from(before) + 20.0 + (held_s + 2.0) * pace * 1e-3 * f64::from(by.ppm());
            assert!(f64::from(utc.within_ms) <= most, "{by:?}: {} of {most}", utc.within_ms);
            run(&mut link, 20.0);
        }
        link.wire().restart(true);
        link.wire().pass();
        assert_eq!(known(&mut link), None, "the supply was gone, that of the calendar clock too");
        let Setting::Set { before: None, .. } = set(&mut link) else { panic!("set anew") };
    }
}

#[test]
fn hil_a_calendar_clock_that_is_not_there_or_stands_still_is_unknown() {
    let mut link = board();
    no_fixes(&mut link);
    link.wire().bench.rtc.borrow_mut().absent = true;
    link.wire().restart(true);
    link.hello().unwrap();
    set(&mut link);
    run(&mut link, 20.0);
    assert!(error_ms(&mut link).abs() < 20.0, "as long as the board runs, it is known");
    held_in_reset(&mut link, 0.0);
    assert_eq!(known(&mut link), None);
    assert_eq!(link.wire().hangs, 0);

    // Its crystal breaks off: seen by its count, or at the reset.
    for watched_s in [10.0, 0.0] {
        let mut link = board();
        no_fixes(&mut link);
        link.hello().unwrap();
        set(&mut link);
        run(&mut link, 20.0);
        link.wire().bench.rtc.borrow_mut().crystal_ppm = None;
        run(&mut link, watched_s);
        if watched_s > 0.0 {
            // Soldered on again: what was kept before is not believed.
            link.wire().bench.rtc.borrow_mut().crystal_ppm = Some(20.0);
        }
        held_in_reset(&mut link, 300.0);
        assert_eq!(known(&mut link), None, "watched for {watched_s} s");
    }
}

#[test]
fn hil_fixes_set_an_unknown_clock_and_records_are_dated() {
    let mut link = board();
    let mission = mission_file::built_in("sea").unwrap();
    link.hello().unwrap();
    link.launch(&mission).unwrap();
    let dives = |link: &mut Link<OwnParts>, cycles: u32| assert!((0..cycles).all(|_| link.wire().cycle(30.0).is_some()));
    dives(&mut link, 100);
    assert_eq!(known(&mut link), None, "unknown, and not 1970");
    // Up again: at the surface there are fixes.
    link.recall().unwrap();
    dives(&mut link, 300);
    let utc = known(&mut link).expect("it was at the surface");
    assert!(utc.source == TimeSource::Gps && error_ms(&mut link).abs() <= f64::from(utc.within_ms), "{utc:?}");
    held_in_reset(&mut link, 2.0);
    dives(&mut link, 100);
    let found = onboard_log::read(&mut link, &Wanted::ALL, |_| {}).unwrap();
    assert!(found.cycles.len() > 400, "{}", found.cycles.len());
    let dated = found.cycles.iter().skip_while(|c| c.0.is_none());
    for (utc, frame, _) in dated {
        let utc = utc.expect("from the first fixes on each record has its UTC, after the reset too");
        let due = utc_ms(frame.time.0 * 1_000);
        // A record is dated when it is written, a moment after its frame.
        assert!(utc.ms.abs_diff(due) <= u64::from(utc.within_ms) + 500, "{utc:?} {due}");
    }
    let by = |source| found.cycles.iter().filter(|c| c.0.is_some_and(|utc| utc.source == source)).count();
    println!("{} records, {} by fixes, {} kept over the reset", found.cycles.len(), by(TimeSource::Gps), by(TimeSource::Kept));
    assert!(by(TimeSource::Gps) > 20 && found.cycles[0].0.is_none());
}

#[test]
fn the_log_is_reckoned_for_the_flash_that_is_soldered_on() {
    assert_eq!(helm::thinning::PART as usize, devices::flash::CAPACITY);
}
