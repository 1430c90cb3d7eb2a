//! A launch: what a board on deck says of itself, and that nothing is launched while something is bad.

use hil_host::cli::launch::{Asked, Found, Here, launch};
use hil_host::flight::closed_loop::Setup;
use hil_host::flight::{mission_file, own_parts, worlds};
use hil_host::seats::parts::OwnParts;
use hil_host::seats::{Link, Seat, SeatError};
use plant::{Scenario, World};
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
    launch(link, &Asked { config: None, mission: "sea", check: false }, &|| {}, &Here { utc_ms: &utc_ms, seconds: None }).unwrap()
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
