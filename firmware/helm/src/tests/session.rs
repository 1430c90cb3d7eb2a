//! The session's rules, from outside: messages in, messages out.

use super::toy::Toy;
use crate::storage::MAX_OBJECT;
use crate::{Boot, Helm, Mark, RamStorage, Seat, Storage, objects};
use control::Config;
use signals::link::MAX_WIRE;
use signals::{
    Abort, Clock, Micros, Mission, Object, Phase, Reading, Refusal, Reply, Request, SensorFrame, Switch, TimeSource, Timebase, ToBoard,
    ToHost, Utc, encode,
};

fn helm() -> Helm<RamStorage> {
    Helm::new(Config::default(), Boot::default(), RamStorage::default())
}

fn frame(seq: u32) -> SensorFrame {
    SensorFrame { seq, time: Micros::from_secs(4 * u64::from(seq)), depth_m: Reading::now(0.1), ..SensorFrame::default() }
}

fn seq_of(answer: ToHost) -> Option<u32> {
    match answer {
        ToHost::Answer(a) => Some(a.command.seq),
        _ => None,
    }
}

fn flying() -> Helm<RamStorage> {
    let mut h = helm();
    assert!(matches!(h.handle(ToBoard::Hello { nonce: 1 }), ToHost::Hello { nonce: 1, .. }));
    assert!(matches!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    h
}

/// A request of a session; the message of the reply.
fn ask(h: &mut Helm<RamStorage>, session: u32, message: ToBoard) -> ToHost {
    let id = session as u16 ^ 0x55;
    let Reply { to, message } = h.request(Request { session, id, message });
    assert_eq!(to, id, "a reply names its request");
    message
}

fn hello(h: &mut Helm<RamStorage>, nonce: u32) -> u32 {
    let ToHost::Hello { nonce: n, session, .. } = ask(h, 0, ToBoard::Hello { nonce }) else { panic!("no hello") };
    assert_eq!(n, nonce);
    session
}

/// A controller that was reset in a mission of the host's frames.
fn interrupted() -> Helm<RamStorage> {
    Helm::new(Config::default(), Boot { mark: Mark::mission(Seat::Host, None, false), ..Boot::default() }, RamStorage::default())
}

/// Frames at the surface, seen by both sensors, from `seq` on.
fn afloat(h: &mut Helm<RamStorage>, seq: u32) {
    for seq in seq..seq + 12 {
        let frame = SensorFrame { depth2_m: Reading::now(0.2), ..frame(seq) };
        assert!(matches!(h.handle(ToBoard::Sensor(frame)), ToHost::Answer(_)));
    }
}

#[test]
fn frames_without_a_mission_are_refused() {
    assert_eq!(helm().handle(ToBoard::Sensor(frame(0))), ToHost::Refused(Refusal::NoMission));
    assert_eq!(helm().handle(ToBoard::Recall), ToHost::Refused(Refusal::NoMission));
}

#[test]
fn utc_is_read_without_a_session_and_set_on_deck_within_one() {
    let set = |ms| ToBoard::Clock { set: Some((ms, 20)) };
    let noon = 1_795_780_800_000;
    let mut h = helm();
    let session = hello(&mut h, 1);
    assert_eq!(ask(&mut h, session, set(noon)), ToHost::Refused(Refusal::Time), "whoever runs it has no clock");
    assert_eq!(ask(&mut h, 0, ToBoard::Clock { set: None }), ToHost::Clock(Clock::default()));
    h.utc.tick(5_000);
    assert_eq!(ask(&mut h, 0, set(noon)), ToHost::Refused(Refusal::Session), "recorded bytes set nothing");
    assert_eq!(ask(&mut h, session, set(1_000)), ToHost::Refused(Refusal::Time), "1970");
    let known = |ms, within_ms| Some(Utc { ms, within_ms, source: TimeSource::Host });
    assert_eq!(
        ask(&mut h, session, set(noon)),
        ToHost::Clock(Clock { base: Timebase::Elsewhere, board_ms: Some(5_000), utc: known(noon, 20) })
    );
    h.utc.tick(6_000);
    let now = ToHost::Clock(Clock { base: Timebase::Elsewhere, board_ms: Some(6_000), utc: known(noon + 1_000, 60) });
    assert_eq!(ask(&mut h, 0, ToBoard::Clock { set: None }), now);
    // In a mission records go on as they began.
    assert!(matches!(ask(&mut h, session, ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    assert!(matches!(ask(&mut h, session, ToBoard::Sensor(frame(0))), ToHost::Answer(_)));
    assert_eq!(ask(&mut h, session, set(noon)), ToHost::Refused(Refusal::UnderWay));
    assert_eq!(ask(&mut h, 0, ToBoard::Clock { set: None }), now);
}

#[test]
fn a_mission_needs_a_hello_and_an_old_hello_does_not_count_twice() {
    let mut h = helm();
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Refused(Refusal::NotNow));
    let mut h = flying();
    h.handle(ToBoard::Sensor(frame(1)));
    assert!(h.mission_in_progress());
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Refused(Refusal::UnderWay));
}

#[test]
fn what_was_recorded_in_another_session_does_nothing() {
    let mut h = helm();
    let old = hello(&mut h, 1);
    let present = hello(&mut h, 2);
    assert!(old != present && old != 0 && present != 0);
    let bytes = postcard::to_vec::<_, 512>(&Mission::default()).unwrap();
    let crc = signals::link::CRC32.checksum(&bytes);
    let recorded = [
        ToBoard::Begin(Mission::default()),
        ToBoard::Launch(Mission::default()),
        ToBoard::Sensor(frame(0)),
        ToBoard::Recall,
        ToBoard::Recovered,
        ToBoard::UploadBegin { object: Object::Config, length: 3, crc },
        ToBoard::UploadChunk { offset: 0, data: heapless::Vec::new() },
        ToBoard::UploadCommit,
        ToBoard::Rollback(Object::Config),
    ];
    for session in [old, 0, 77] {
        for message in recorded.clone() {
            assert_eq!(ask(&mut h, session, message), ToHost::Refused(Refusal::Session));
        }
    }
    assert!(matches!(ask(&mut h, present, ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    // A controller that starts again gives other sessions to the same recorded hello.
    let again = |salt| hello(&mut Helm::new(Config::default(), Boot { salt, ..Boot::default() }, RamStorage::default()), 1);
    assert_ne!(again(0), again(1));
}

#[test]
fn a_hello_changes_nothing_of_a_flight_under_way() {
    let mut h = helm();
    let own = hello(&mut h, 1);
    assert!(matches!(ask(&mut h, own, ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    for seq in 0..200 {
        assert!(matches!(ask(&mut h, own, ToBoard::Sensor(frame(seq))), ToHost::Answer(_)));
    }
    let stranger = hello(&mut h, 2);
    for session in [own, stranger] {
        for seq in 100..150 {
            assert_eq!(ask(&mut h, session, ToBoard::Sensor(frame(seq))), ToHost::Refused(Refusal::Sequence { last: 199 }));
        }
    }
    assert!(matches!(ask(&mut h, own, ToBoard::Sensor(frame(200))), ToHost::Answer(_)), "the flight goes on in its own session");
    assert_eq!(ask(&mut h, own, ToBoard::Recall), ToHost::Refused(Refusal::Session), "orders are of the present one");
    assert_eq!(ask(&mut h, stranger, ToBoard::Recall), ToHost::Done { crc: 0 });
}

#[test]
fn a_far_first_frame_does_not_silence_the_line() {
    let mut h = flying();
    let far = ToHost::Refused(Refusal::Sequence { last: u32::MAX });
    for seq in [u32::MAX, 1 << 31, crate::session::MAX_GAP] {
        assert_eq!(h.handle(ToBoard::Sensor(frame(seq))), far, "{seq}");
    }
    assert!(matches!(h.handle(ToBoard::Sensor(frame(0))), ToHost::Answer(_)));
}

#[test]
fn ready_names_table_configuration_and_mission() {
    let mut h = helm();
    hello(&mut h, 1);
    let manifest = h.manifest();
    let ToHost::Ready { table_id, config, mission, .. } = h.handle(ToBoard::Begin(Mission::default())) else { panic!() };
    assert_eq!((table_id, config), (manifest.table_standard, manifest.config));
    let other = Mission { surface_every: 1, ..Mission::default() };
    assert_eq!(mission, crate::objects::mission_id(&Mission::default()));
    assert_ne!(mission, crate::objects::mission_id(&other));
}

#[test]
fn a_repeated_frame_is_answered_without_a_step_a_stale_one_refused() {
    let mut h = flying();
    let first = h.handle(ToBoard::Sensor(frame(10)));
    assert!(matches!(first, ToHost::Answer(_)));
    assert_eq!(h.handle(ToBoard::Sensor(frame(10))), first);
    let old = ToHost::Refused(Refusal::Sequence { last: 10 });
    assert_eq!(h.handle(ToBoard::Sensor(frame(9))), old);
    assert_eq!(h.handle(ToBoard::Sensor(frame(10 + crate::session::MAX_GAP + 1))), old);
    assert!(matches!(h.handle(ToBoard::Sensor(frame(11))), ToHost::Answer(_)));
    let c = h.counters();
    assert_eq!((c.repeated, c.stale), (1, 2));
}

#[test]
fn no_hello_lets_a_frame_step_twice() {
    let mut h = flying();
    let first = h.handle(ToBoard::Sensor(frame(1)));
    for nonce in [1, 2] {
        h.handle(ToBoard::Hello { nonce });
        assert_eq!(h.handle(ToBoard::Sensor(frame(1))), first);
    }
    assert_eq!(h.counters().repeated, 2);
}

#[test]
fn after_a_reset_during_a_mission_no_mission_is_taken_until_seen_afloat() {
    let mut h = interrupted();
    h.handle(ToBoard::Hello { nonce: 1 });
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Refused(Refusal::Safe));
    assert_eq!(h.handle(ToBoard::UploadCommit), ToHost::Refused(Refusal::Safe));
    assert_eq!(h.handle(ToBoard::Recovered), ToHost::Refused(Refusal::NotAfloat), "no frame yet is not afloat");
    afloat(&mut h, 100);
    assert_eq!(h.handle(ToBoard::Recovered), ToHost::Done { crc: 0 });
    assert!(matches!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
}

#[test]
fn a_leak_at_depth_is_not_forgotten_because_a_depth_is_missing() {
    let mut h = flying();
    for seq in 0..10 {
        let leak = if seq < 3 { Switch::Clear } else { Switch::Alarm };
        let at = Reading::now(20.0);
        h.handle(ToBoard::Sensor(SensorFrame { depth_m: if seq < 9 { at } else { Reading::Missing }, depth2_m: at, leak, ..frame(seq) }));
    }
    assert_eq!(h.last().and_then(|(_, a)| a.trace.abort), Some(Abort::Leak));
    assert_eq!(h.handle(ToBoard::Recovered), ToHost::Refused(Refusal::NotAfloat));
    h.handle(ToBoard::Hello { nonce: 9 });
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Refused(Refusal::Safe));
    // And a single shallow reading is not the surface.
    h.handle(ToBoard::Sensor(SensorFrame { depth2_m: Reading::now(0.1), ..frame(10) }));
    assert_eq!(h.handle(ToBoard::Recovered), ToHost::Refused(Refusal::NotAfloat));
}

#[test]
fn the_weight_is_fired_on_after_a_reset() {
    let boot = Boot { mark: Mark::mission(Seat::Host, Some(Abort::Leak), true), ..Boot::default() };
    let mut h = Helm::new(Config::default(), boot, RamStorage::default());
    let at = Reading::now(60.0);
    let ToHost::Answer(answer) = h.handle(ToBoard::Sensor(SensorFrame { depth_m: at, depth2_m: at, ..frame(7) })) else { panic!() };
    assert!(answer.command.drop_weight);
    assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, Some(Abort::Leak)));
    assert_eq!(h.mark(), boot.mark);
}

#[test]
fn a_launched_mission_flies_on_own_sensors_and_takes_no_frame_of_the_line() {
    let mut h = helm();
    h.handle(ToBoard::Hello { nonce: 3 });
    assert_eq!(h.cycle(&frame(1)), None, "nothing to fly on deck");
    assert!(matches!(h.handle(ToBoard::Launch(Mission::default())), ToHost::Ready { .. }));
    assert!(!h.manifest().hil);
    assert_eq!(h.handle(ToBoard::Sensor(frame(1))), ToHost::Refused(Refusal::OwnSensors));
    assert_eq!(h.cycle(&frame(1)).map(|a| a.command.seq), Some(1));
    assert!(h.mark().seat() == Seat::Sensors);
}

#[test]
fn a_configuration_of_another_vehicle_is_flown_in_simulation_only() {
    let mut h = helm();
    let mut bytes = crate::Content::new();
    crate::objects::config_bytes(&Config::new(control::Settings::slocum_1000()).unwrap(), &mut bytes);
    crate::Storage::save(h.storage(), Object::Config, &bytes).unwrap();
    h.handle(ToBoard::Hello { nonce: 3 });
    assert_eq!(h.handle(ToBoard::Launch(Mission::default())), ToHost::Refused(Refusal::Limit(signals::Limit::Class)));
    assert!(matches!(h.handle(ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
}

#[test]
fn own_cycles_that_come_late_again_and_again_are_an_overrun() {
    let late = |every_s: u64| {
        let mut h = helm();
        h.handle(ToBoard::Hello { nonce: 3 });
        h.handle(ToBoard::Launch(Mission::default()));
        let mut abort = None;
        for i in 0..5u32 {
            let time = Micros::from_secs(every_s * u64::from(i));
            let frame = SensorFrame { time, pitch_rad: Reading::now(0.0), ballast_m3: Reading::now(0.0), ..frame(i) };
            abort = h.cycle(&frame).and_then(|a| a.trace.abort);
        }
        abort
    };
    assert_eq!(late(4), None);
    assert_eq!(late(9), Some(Abort::Overrun));
}

#[test]
fn a_line_that_falls_silent_after_a_reset_is_stepped_too() {
    let mut h = interrupted();
    let due = Micros::from_millis(crate::silence::PATIENCE_MS + u64::from(crate::session::CYCLE_MS));
    let answer = h.silent(due).expect("a step");
    assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, Some(Abort::Reset)));
    assert!(answer.command.ballast_m3 > 0.0);
}

#[test]
fn a_silent_line_steps_only_after_patience_and_once_per_cycle() {
    let mut h = flying();
    h.handle(ToBoard::Sensor(frame(1)));
    assert_eq!(h.silent(Micros::from_millis(crate::silence::PATIENCE_MS)), None);
    let due = Micros::from_millis(crate::silence::PATIENCE_MS + u64::from(crate::session::CYCLE_MS));
    assert!(h.silent(due).is_some());
    assert_eq!(h.silent(due), None);
}

#[test]
fn an_upload_is_taken_piece_by_piece_and_every_message_may_come_twice() {
    let mut h = helm();
    let bytes = postcard::to_vec::<_, 512>(&Mission::default()).unwrap();
    let crc = signals::link::CRC32.checksum(&bytes);
    let begin = ToBoard::UploadBegin { object: Object::Mission, length: bytes.len() as u32, crc };
    let chunk = ToBoard::UploadChunk { offset: 0, data: heapless::Vec::from_slice(&bytes).unwrap() };
    for _ in 0..2 {
        assert_eq!(h.handle(begin.clone()), ToHost::Continue { offset: 0 });
    }
    for _ in 0..2 {
        assert_eq!(h.handle(chunk.clone()), ToHost::Continue { offset: bytes.len() as u32 });
    }
    for _ in 0..2 {
        assert_eq!(h.handle(ToBoard::UploadCommit), ToHost::Volatile { crc });
    }
    let read = h.handle(ToBoard::ReadBack { object: Object::Mission, offset: 0 });
    let ToHost::Content { data, length, .. } = read else { panic!("{read:?}") };
    assert_eq!((&data[..], length as usize), (&bytes[..], bytes.len()));
    assert_eq!(h.handle(ToBoard::Rollback(Object::Mission)), ToHost::Volatile { crc: 0 });
}

#[test]
fn a_corrupt_upload_changes_nothing() {
    let mut h = helm();
    h.handle(ToBoard::UploadBegin { object: Object::Mission, length: 3, crc: 1 });
    h.handle(ToBoard::UploadChunk { offset: 0, data: heapless::Vec::from_slice(&[1, 2, 3]).unwrap() });
    assert_eq!(h.handle(ToBoard::UploadCommit), ToHost::Refused(Refusal::Corrupt));
    assert!(matches!(h.handle(ToBoard::ReadBack { object: Object::Mission, offset: 0 }), ToHost::Content { length: 0, .. }));
    // What is longer than an object, or than it said, has no room.
    let (long, too_long) = ([7; MAX_OBJECT + 1], ToHost::Refused(Refusal::TooLong));
    assert_eq!(h.handle(ToBoard::UploadBegin { object: Object::Mission, length: long.len() as u32, crc: 1 }), too_long);
    assert_eq!(h.handle(ToBoard::UploadBegin { object: Object::Mission, length: 3, crc: 1 }), ToHost::Continue { offset: 0 });
    assert_eq!(h.handle(ToBoard::UploadChunk { offset: 0, data: heapless::Vec::from_slice(&[1; 4]).unwrap() }), too_long);
    assert_eq!(h.storage().save(Object::Mission, &long), Err(Refusal::TooLong));
    assert!(!h.storage().holds(Object::Mission));
}

#[test]
fn a_mission_without_legs_is_the_stored_one_if_that_is_one() {
    let none = Mission { legs: heapless::Vec::new(), ..Mission::default() };
    let stored = Mission { surface_every: 3, ..Mission::default() };
    let bytes = postcard::to_vec::<_, 512>(&stored).unwrap();
    for (kept, id) in [(None, None), (Some(&bytes[1..]), None), (Some(&bytes[..]), Some(objects::mission_id(&stored)))] {
        let mut h = helm();
        hello(&mut h, 1);
        kept.map(|bytes| h.storage().save(Object::Mission, bytes).unwrap());
        let ready = match h.handle(ToBoard::Begin(none.clone())) {
            ToHost::Ready { mission, .. } => Some(mission),
            other => {
                assert!(matches!(other, ToHost::Refused(Refusal::Mission(_))), "{other:?}");
                None
            }
        };
        assert_eq!(ready, id, "{kept:?}");
    }
}

#[test]
fn before_its_first_message_a_controller_marks_what_it_was_booted_with() {
    assert_eq!((helm().mark(), interrupted().mark()), (Mark::NONE, Mark::mission(Seat::Host, None, false)));
    // A seal that was broken since the last step: nothing of it is logged, and the mission goes on in SAFE.
    let mut h = flying();
    h.handle(ToBoard::Sensor(frame(0)));
    h.flight.silent_steps ^= 1;
    h.keep_log();
    assert_eq!((h.last().copied(), h.manifest().phase), (None, Phase::Safe));
}

#[test]
fn bytes_and_messages_move_it_alike() {
    let (mut by_byte, mut by_message) = (flying(), flying());
    let sessions = (hello(&mut by_byte, 1), hello(&mut by_message, 1));
    for seq in 1..50 {
        let message = ToBoard::Sensor(frame(seq));
        let mut wire = [0; MAX_WIRE];
        let n = encode(&Request { session: sessions.0, id: 1, message: message.clone() }, &mut wire).unwrap();
        let answers: Vec<_> = wire[..n].iter().filter_map(|b| by_byte.byte(*b)).map(|reply| reply.message).collect();
        assert_eq!(answers, [by_message.handle(message)]);
        assert_eq!(seq_of(answers[0].clone()), Some(seq));
    }
}

/// A controller in the role of a backseat, with a mission in store.
fn as_backseat(mark: Mark) -> Helm<RamStorage> {
    let mut h = Helm::new(Config::default(), Boot { mark, ..Boot::default() }, RamStorage::default());
    let mut bytes = crate::Content::new();
    objects::mission_bytes(&Mission::default(), &mut bytes);
    h.storage().save(Object::Mission, &bytes).unwrap();
    h.deck.strapped(signals::Strap::Backseat);
    h
}

#[test]
fn as_a_backseat_only_the_glider_begins_and_only_its_frames_are_flown() {
    let mut h = as_backseat(Mark::NONE);
    let ToHost::Hello { session, .. } = h.handle(ToBoard::Hello { nonce: 1 }) else { panic!("no hello") };
    let ask = |h: &mut Helm<RamStorage>, message| h.request(Request { session, id: 1, message }).message;
    for begins in [ToBoard::Begin(Mission::default()), ToBoard::Launch(Mission::default())] {
        assert_eq!(ask(&mut h, begins), ToHost::Refused(Refusal::Strap));
    }
    let deepest = h.begin_backseat(|s| control::Settings { pump_m3: 200e-6, ..*s }).unwrap();
    assert_eq!((deepest, h.seat(), h.config().pump_m3), (Mission::default().legs[0].depth_max_m, Seat::Backseat, 200e-6));
    assert_eq!(ask(&mut h, ToBoard::Sensor(frame(0))), ToHost::Refused(Refusal::OwnSensors));
    assert!(matches!(h.handle(ToBoard::Sensor(frame(0))), ToHost::Answer(_)));
    assert_eq!(h.mark().seat(), Seat::Backseat);
    // A line that is lost is one here too.
    let lost = h.silent(Micros::from_secs(70)).expect("a step");
    assert_eq!(lost.trace.abort, Some(Abort::LinkLost));
}

#[test]
fn as_a_backseat_a_reset_goes_on_in_safe_and_none_stored_is_none_flown() {
    let mut h = as_backseat(Mark::mission(Seat::Backseat, None, false));
    assert_eq!(h.begin_backseat(|s| *s), Ok(Mission::default().legs[0].depth_max_m));
    let ToHost::Answer(answer) = h.handle(ToBoard::Sensor(frame(0))) else { panic!("no answer") };
    assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, Some(Abort::Reset)));
    let mut h = Helm::new(Config::default(), Boot::NEW, RamStorage::default());
    assert_eq!(h.begin_backseat(|s| *s), Err(Refusal::NoMission));
}

#[test]
fn as_a_backseat_no_host_flies_it_and_an_unheard_vehicle_is_not_afloat() {
    assert!(!as_backseat(Mark::NONE).manifest().hil, "on deck");
    let mut h = as_backseat(Mark::mission(Seat::Backseat, None, false));
    assert!(!h.manifest().hil);
    for seq in 0..12 {
        let shallow = Reading::now(0.3);
        let now = SensorFrame { depth_m: shallow, depth2_m: shallow, time: Micros::from_secs(4 * u64::from(seq)), ..frame(seq) };
        assert!(matches!(h.handle(ToBoard::Sensor(now)), ToHost::Answer(_)));
    }
    h.unheard(Micros::from_secs(12));
    assert_eq!(h.clone().handle(ToBoard::Recovered), ToHost::Done { crc: 0 });
    h.unheard(Micros::from_secs(13));
    assert_eq!(h.handle(ToBoard::Recovered), ToHost::Refused(Refusal::NotAfloat));
}

#[test]
fn as_a_backseat_a_mission_that_is_done_is_not_begun_again_by_a_reset() {
    let mut h = as_backseat(Mark::NONE);
    h.begin_backseat(|s| *s).unwrap();
    let (mut toy, mut phase) = (Toy::new(870.0), Phase::Surface);
    for seq in 0..4000 {
        let now = toy.frame(seq, Micros::from_secs(4 * u64::from(seq)));
        let ToHost::Answer(answer) = h.handle(ToBoard::Sensor(now)) else { panic!("no answer") };
        toy.obey(&answer.command);
        phase = answer.trace.phase;
        if phase == Phase::Done {
            break;
        }
    }
    assert_eq!(phase, Phase::Done);
    // Afloat, and the glider's program still runs: a reset comes up in SAFE, and only a recovery ends it.
    let mut again = as_backseat(h.mark());
    again.begin_backseat(|s| *s).unwrap();
    let ToHost::Answer(answer) = again.handle(ToBoard::Sensor(frame(0))) else { panic!("no answer") };
    assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, Some(Abort::Reset)));
    assert_eq!(h.begin_backseat(|s| *s), Err(Refusal::NotNow));
    let session = hello(&mut h, 2);
    assert_eq!(ask(&mut h, session, ToBoard::Recovered), ToHost::Done { crc: 0 });
    assert!(!h.mark().in_mission());
}
