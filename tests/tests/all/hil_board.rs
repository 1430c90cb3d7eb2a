//! The same asserts as on the host and in QEMU, on a plugged board:
//!
//! ```sh
//! GLIDER_PORT=/dev/ttyACM0 cargo test --release -p tests hil_board:: -- --ignored --nocapture
//! ```
//! The board runs the flight image, no mission on its own sensors is under way, and its vehicle's actuators are unplugged:
//! missions are flown. Each test says what it proves. A terminal of QEMU will do for a rehearsal.

use control::{Config, Settings};
use helm::{Boot, Content, Helm, RamStorage};
use hil_host::cli::launch::{Asked, Here, launch};
use plant::World;
use rig::campaign::lattice::cases;
use rig::campaign::{run, through_seat};
use rig::flight::autopsy::{Autopsy, reset};
use rig::flight::closed_loop::{End, Setup, fly, recover};
use rig::flight::image_file::ImageFile;
use rig::flight::image_lines::ImageLines;
use rig::flight::{mission_file, onboard_log, worlds};
use rig::seats::in_process::InProcess;
use rig::seats::link::upload::{read_back, rollback, upload};
use rig::seats::port::Port;
use rig::seats::{Choice, Link, Seat, SeatError, image, qemu};
use signals::link::{CRC32, MAX_WIRE};
use signals::{
    Abort, Counters, Mission, Object, Older, Phase, Refusal, Request, SensorFrame, Standing, Switch, ToBoard, ToHost, Wings, encode,
};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// There is one line.
static LINE: Mutex<()> = Mutex::new(());

/// The port, and the right to use it.
fn port() -> (String, MutexGuard<'static, ()>) {
    let line = LINE.lock().unwrap_or_else(PoisonError::into_inner);
    (std::env::var("GLIDER_PORT").expect("set GLIDER_PORT to the serial port of a board"), line)
}

/// The board, on deck.
fn board(name: &str) -> Link<Port> {
    let mut link = Link::new(Port::open(name).unwrap());
    assert!(link.hello().unwrap().hil, "a mission on the board's own sensors is under way");
    recover(&mut link).unwrap();
    link
}

fn counters(link: &mut Link<Port>) -> Counters {
    link.request("a report", &ToBoard::Report, |a| if let ToHost::Counters(c) = a { Some(c) } else { None }).unwrap()
}

/// Sends bytes that are no request.
fn shout(link: &mut Link<Port>, bytes: &[u8]) {
    use rig::seats::Wire;
    link.wire().send(bytes).unwrap();
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_flies_both_wing_sets_to_the_bit_like_this_computer() {
    let (name, _line) = port();
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let mission = Mission { wings, ..mission_file::built_in("shallow").unwrap() };
        let flown = |seat: &mut dyn Seat| {
            let mut world = World::new(worlds::for_mission(&mission)).unwrap();
            fly(&mut world, seat, &Setup::new(mission.clone()), &mut |_| Ok(())).unwrap()
        };
        let here = flown(&mut Link::new(InProcess::default()));
        let there = flown(&mut board(&name));
        assert_eq!((here.end, here.dives), (End::Done, 4));
        assert_eq!((there.actuator_hash, there.table_id, there.end), (here.actuator_hash, here.table_id, here.end), "{wings:?}");
        println!("{wings:?}: {} cycles, every command equal to the bit", there.cycles);
    }
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_answers_like_the_session_on_the_host() {
    let (name, _line) = port();
    let mut link = board(&name);
    let before = counters(&mut link);
    let mut host = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    let manifest = link.hello().unwrap();
    link.configure(&manifest, &Config::default()).unwrap();
    link.begin(&Mission::default()).unwrap();
    host.handle(ToBoard::Hello { nonce: 1 });
    host.handle(ToBoard::Begin(Mission::default()));
    let mut world = World::new(worlds::for_mission(&Mission::default())).unwrap();
    for n in 0..100u32 {
        let frame = world.sense();
        if n % 10 == 3 {
            // A frame with one flipped bit: refused, and nothing answered.
            let mut wire = [0; MAX_WIRE];
            let request = Request { session: 1, id: 1, message: ToBoard::Sensor(frame) };
            let length = encode(&request, &mut wire).unwrap();
            wire[length / 2] ^= 0x10;
            shout(&mut link, &wire[..length]);
        }
        let answer = link.exchange(&frame).unwrap();
        assert_eq!(ToHost::Answer(answer), host.handle(ToBoard::Sensor(frame)), "frame {n}");
        // The same frame again is answered again and not stepped.
        if n % 10 == 7 {
            assert_eq!(link.exchange(&frame).unwrap(), answer);
        }
        world.advance(&answer.command, 4.0);
    }
    let after = counters(&mut link);
    let refused = |c: &Counters| c.damaged + c.unknown;
    assert!(refused(&after) - refused(&before) >= 10 && after.repeated - before.repeated >= 10, "{before:?} {after:?}");
    println!("100 frames equal; {} damaged ones refused", refused(&after) - refused(&before));
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_keeps_and_gives_back_every_object() {
    let (name, _line) = port();
    let mut link = board(&name);
    let config = |settings| {
        let mut bytes = Content::new();
        helm::objects::config_bytes(&Config::new(settings).unwrap(), &mut bytes);
        bytes.to_vec()
    };
    let (first, second) = (config(Settings::slocum_100()), config(Settings::slocum_200()));
    let mission = Mission { surface_every: 3, ..Mission::default() };
    let mission = postcard::to_slice(&mission, &mut [0; 400]).unwrap().to_vec();
    for (object, bytes) in [
        (Object::Config, &first),
        (Object::Config, &second),
        (Object::Mission, &mission),
        (Object::Table(Wings::Standard), &polar::generated::STANDARD.to_vec()),
        (Object::Table(Wings::LowAspectRatio), &polar::generated::LOW_ASPECT_RATIO.to_vec()),
    ] {
        let stored = upload(&mut link, object, bytes, |_, _| {}).unwrap();
        assert_eq!(stored.crc, CRC32.checksum(bytes));
        println!(
            "{object:?}: {} bytes, {}",
            bytes.len(),
            if stored.for_good { "kept on flash" } else { "in RAM: this board has no log flash" }
        );
    }
    rollback(&mut link, Object::Config).unwrap();
    assert_eq!(read_back(&mut link, Object::Config, |_| {}).unwrap(), first);
    // What cannot be flown is refused by name, and what was in use still is.
    let refused = upload(&mut link, Object::Config, &[1, 2, 3], |_, _| {}).unwrap_err().to_string();
    assert!(refused.contains("Corrupt"), "{refused}");
    assert_eq!(read_back(&mut link, Object::Config, |_| {}).unwrap(), first);
    upload(&mut link, Object::Config, &second, |_, _| {}).unwrap();
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_runs_this_image_and_tells_its_last_reset() {
    let (name, _line) = port();
    let bytes = read_back(&mut board(&name), Object::Autopsy, |_| {}).unwrap();
    let found = Autopsy::read(&bytes).unwrap().expect("a board keeps a record over a reset");
    let present = found.present.expect("a whole note");
    let image = ImageLines::read(&qemu::find_image().unwrap()).unwrap();
    assert_eq!(present.image, image.id, "the board runs another image than the one built here");
    assert!(!found.is_damaged);
    println!("run {}, last reset by {}; kept of a fault: {:?}", present.run + 1, reset(present.began), found.fault.map(|f| f.note));
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_says_what_its_sensors_say_and_launches_nothing_on_a_bench() {
    let (name, _line) = port();
    let mut link = board(&name);
    let started = Instant::now();
    let utc_ms = || SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs_f64() * 1e3;
    let here = Here { utc_ms: &utc_ms, seconds: Some(&|| started.elapsed().as_secs_f64()) };
    let asked = Asked { config: None, mission: "sea", check: true, set_options: false };
    let found = launch(&mut link, &asked, &|| std::thread::sleep(Duration::from_millis(500)), &here).unwrap();
    // Its strap is fitted, its motors are unplugged: not all can be good. Each part has to be named, with what it says.
    for what in ["strap", "air pressure", "pitch", "battery", "leak loop", "pump", "clock", "option bytes"] {
        let line = found.items.iter().find(|i| i.what == what).unwrap_or_else(|| panic!("no line for {what}"));
        println!("{} {what:14} {}", if line.good { "ok  " } else { "BAD " }, line.found);
        assert!(!line.found.is_empty());
    }
    assert!(found.launched.is_none());
    let said = link.launch(&mission_file::built_in("sea").unwrap());
    assert!(matches!(said, Err(SeatError::Refused { why: Refusal::Strap, .. })), "the strap of a bench is not fitted: {said:?}");
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_takes_an_image_tries_it_and_puts_the_one_before_back() {
    let (name, _line) = port();
    let mut link = board(&name);
    let file = ImageFile::read(&qemu::find_image().unwrap()).unwrap();
    image::stage(&mut link, &file.bytes, Older::Taken, |_| {}).unwrap();
    let runs = image::restart(&mut link).unwrap();
    assert!(runs.id == file.facts.id && matches!(runs.standing, Standing::Trial { .. }), "{runs:?}");
    // A finished cycle confirms it.
    let mut world = World::new(worlds::for_mission(&Mission::default())).unwrap();
    link.begin(&Mission::default()).unwrap();
    link.exchange(&world.sense()).unwrap();
    recover(&mut link).unwrap();
    assert_eq!(image::running(&mut link).unwrap().standing, Standing::Confirmed);
    image::go_back(&mut link).unwrap();
    assert_eq!(image::restart(&mut link).unwrap().standing, Standing::RolledBack);
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_aborts_for_a_leak_and_leaves_safe_only_when_recovered() {
    let (name, _line) = port();
    let mut link = board(&name);
    link.hello().unwrap();
    link.begin(&Mission::default()).unwrap();
    let mut world = World::new(worlds::for_mission(&Mission::default())).unwrap();
    let mut last = None;
    for n in 0..30 {
        let frame = SensorFrame { leak: if n < 20 { Switch::Clear } else { Switch::Alarm }, ..world.sense() };
        let answer = link.exchange(&frame).unwrap();
        world.advance(&answer.command, 4.0);
        last = Some(answer);
    }
    let last = last.unwrap();
    assert_eq!((last.trace.phase, last.trace.abort), (Phase::Safe, Some(Abort::Leak)));
    assert!(last.command.ballast_m3 > 0.0 && last.command.beacon);
    link.hello().unwrap();
    assert!(matches!(link.begin(&Mission::default()), Err(SeatError::Refused { why: Refusal::Safe, .. })));
    // Its log has the flight, if it has a flash.
    match onboard_log::read(&mut link, &onboard_log::Wanted::newest(4), |_| {}) {
        Ok(found) => assert!(found.cycles.iter().rev().take(3).any(|c| c.2.trace.abort == Some(Abort::Leak)), "the log holds the abort"),
        Err(e) => println!("{e}"),
    }
    // On deck again: seen at the surface it is believed.
    assert!(link.recover().is_err());
    recover(&mut link).unwrap();
}

#[test]
#[ignore = "needs a board; set GLIDER_PORT"]
fn hil_board_ends_a_sample_of_the_fault_campaign_as_this_computer() {
    let (name, _line) = port();
    drop(board(&name));
    let choice = Choice::Port(name);
    let here: Vec<_> = through_seat::sample(cases(), &choice, 12).iter().map(|c| run(c).unwrap()).collect();
    let different = through_seat::compare(&here, &choice, None, 1, &|| {}).unwrap();
    let told: Vec<_> = different.iter().map(|(here, there)| (here.document(), there.document())).collect();
    assert!(told.is_empty(), "{told:#?}");
    println!("{} fault missions, every verdict and command equal", here.len());
}
