//! A launch: what a board on deck says of itself, and that nothing is launched while something is bad.

use hil_host::cli::launch::{Asked, Found, Here, launch};
use plant::{Scenario, World};
use rig::flight::closed_loop::Setup;
use rig::flight::{mission_file, own_parts, worlds};
use rig::seats::parts::OwnParts;
use rig::seats::{Link, Seat, SeatError, options};
use signals::{Refusal, Strap};

fn board(change: impl Fn(&mut Scenario)) -> Link<OwnParts> {
    let mission = mission_file::built_in("sea").unwrap();
    let mut scenario = worlds::for_mission(&mission);
    change(&mut scenario);
    own_parts::board(World::new(scenario).unwrap(), &Setup::new(mission))
}

fn asked(link: &mut Link<OwnParts>) -> Found {
    let clock = link.wire().bench.clock.clone();
    let utc_ms = || parts::gps::utc_ms(clock.now_ns()) as f64;
    let asked = Asked { config: None, mission: "sea", check: false, set_options: false };
    launch(link, &asked, &|| {}, &Here { utc_ms: &utc_ms, seconds: None }).unwrap()
}

fn bad(found: &Found) -> Vec<&'static str> {
    found.items.iter().filter(|i| !i.good).map(|i| i.what).collect()
}

#[test]
fn hil_a_sound_vehicle_is_checked_launched_and_dives() {
    let mut link = board(|_| {});
    let found = asked(&mut link);
    assert!(found.good() && found.launched.is_some(), "{:?}", found.items);
    let board = link.wire();
    assert!((board.air_pa() - 101_325.0).abs() < 500.0, "zero of depth: {}", board.air_pa());
    let afloat = board.around.borrow().world.truth().max_depth_m;
    assert!(afloat < 1.0, "it floated through the strokes: {afloat} m");
    let deepest = (0..200).filter_map(|_| board.cycle(30.0)).map(|made| made.truth.depth_m).fold(0.0, f64::max);
    assert!(deepest > 20.0, "{deepest} m after 800 s");
}

#[test]
fn hil_each_thing_wrong_is_named_and_keeps_the_vehicle_on_deck() {
    for (fault, what) in [
        ("depth:off", "air pressure"),
        ("pitch:off", "compass"),
        ("pump:stuck", "pump"),
        ("ballast:off", "pump"),
        ("mass_motor:stuck", "battery mass"),
        ("voltage:bias=-6", "battery"),
        ("hull:vacuum_loss=1", "hull vacuum"),
        ("leak:alarm", "leak loop"),
        ("leak:off", "leak loop"),
        ("weight:alarm", "drop weight"),
    ] {
        let mut link = board(|s| s.faults.push(fault.parse().unwrap()));
        let found = asked(&mut link);
        assert!(found.launched.is_none() && bad(&found).contains(&what), "{fault}: {:?}", found.items);
        assert!(!link.hello().unwrap().under_way, "{fault}");
    }
}

#[test]
fn hil_the_strap_decides_between_bench_and_deployment() {
    let mut link = board(|_| {});
    link.hello().unwrap();
    // Hellos of other programs change nothing: a deployed board flies no frames.
    let refused = link.begin(&mission_file::built_in("sea").unwrap());
    assert!(matches!(refused, Err(SeatError::Refused { why: Refusal::Strap, .. })), "{refused:?}");
    link.wire().strap(Strap::Bench);
    assert_eq!(bad(&asked(&mut link)), ["strap"]);
    let refused = link.launch(&mission_file::built_in("sea").unwrap());
    assert!(matches!(refused, Err(SeatError::Refused { why: Refusal::Strap, .. })), "{refused:?}");
}

#[test]
fn hil_option_bytes_are_named_and_set_on_deck_only() {
    for (optcr, named) in [
        (parts::options::FACTORY, "brown-out"),
        (0x0fff_aae1, "watchdog"),
        (0x0fff_aa81, "STOP"),
        (0x0fff_bbc1, "protection 1"),
        (0x0fff_ccc1, "protection 2"),
    ] {
        let mut link = board(|_| {});
        link.wire().bench.options.borrow_mut().optcr = optcr;
        link.wire().restart(false);
        let found = asked(&mut link);
        let line = found.items.iter().find(|i| i.what == "option bytes").unwrap();
        assert!(!line.good && line.found.contains(named) && found.launched.is_none(), "{line:?}");
        assert!(link.wire().bench.options.borrow().programmed.is_empty(), "a check sets nothing");
        // Set: what can be is mended, the protection is what it was.
        let now = options::set(&mut link, &|| {}).unwrap();
        assert_eq!(now.unwrap() >> 8 & 0xff, optcr >> 8 & 0xff, "{optcr:08x}");
        assert_eq!(options::words(now).is_ok(), optcr >> 8 & 0xff == 0xaa, "{optcr:08x}");
        assert!(link.wire().bench.options.borrow().programmed.iter().all(|p| p >> 8 & 0xff == optcr >> 8 & 0xff));
    }
    // In a mission: reported, not set.
    let mut link = board(|_| {});
    assert!(asked(&mut link).good());
    assert!(matches!(options::set(&mut link, &|| {}), Err(SeatError::Refused { why: Refusal::UnderWay, .. })));
    assert_eq!(options::read(&mut link).unwrap(), Some(parts::options::SET_UP));
}

#[test]
fn hil_a_cut_while_option_bytes_are_set_leaves_a_board_that_boots() {
    let mut link = board(|_| {});
    *link.wire().bench.options.borrow_mut() = parts::options::Options::new(parts::options::FACTORY);
    link.wire().bench.options.borrow_mut().cut = true;
    link.wire().restart(false);
    link.hello().unwrap();
    options::set(&mut link, &|| {}).unwrap();
    link.wire().restart(true);
    let found = asked(&mut link);
    let line = found.items.iter().find(|i| i.what == "option bytes").unwrap();
    assert_eq!(bad(&found), ["option bytes"], "{line:?}");
    assert!(["brown-out", "watchdog", "protection 1"].iter().all(|name| line.found.contains(name)), "{line:?}");
    // Set again: all but the protection, which a debugger alone takes away.
    let now = options::set(&mut link, &|| {}).unwrap();
    assert_eq!(now, Some(parts::options::ERASED & 0x0fff_ffff & !0x2c), "{now:08x?}");
}
