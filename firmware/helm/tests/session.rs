//! The session's rules, from outside: messages in, messages out.

use control::Config;
use helm::{Boot, Helm, RamStorage, Seat};
use signals::link::MAX_WIRE;
use signals::{Micros, Mission, Object, Reading, Refusal, SensorFrame, ToBoard, ToHost, encode};

fn helm() -> Helm<RamStorage> {
    Helm::new(Config::default(), Boot::default(), RamStorage::default())
}

fn frame(seq: u32) -> SensorFrame {
    SensorFrame { seq, time: Micros::from_secs(4 * u64::from(seq)), depth_m: Reading::now(0.1), ..SensorFrame::default() }
}

fn seq_of(answer: Option<ToHost>) -> Option<u32> {
    match answer {
        Some(ToHost::Answer(a)) => Some(a.command.seq),
        _ => None,
    }
}

fn flying() -> Helm<RamStorage> {
    let mut h = helm();
    assert!(matches!(h.handle(ToBoard::Hello { nonce: 1 }), Some(ToHost::Hello { nonce: 1, .. })));
    assert!(matches!(h.handle(ToBoard::Begin(Mission::default())), Some(ToHost::Ready { .. })));
    h
}

#[test]
fn frames_without_a_mission_are_refused() {
    assert_eq!(helm().handle(ToBoard::Sensor(frame(0))), Some(ToHost::Refused(Refusal::NotNow)));
}

#[test]
fn a_mission_needs_a_hello_and_an_old_hello_does_not_count_twice() {
    let mut h = helm();
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), Some(ToHost::Refused(Refusal::NotNow)));
    let mut h = flying();
    h.handle(ToBoard::Sensor(frame(1)));
    assert!(h.mission_in_progress());
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), Some(ToHost::Refused(Refusal::NotNow)));
}

#[test]
fn a_repeated_frame_is_answered_again_without_a_step_and_a_stale_one_not_at_all() {
    let mut h = flying();
    let first = h.handle(ToBoard::Sensor(frame(10)));
    assert!(matches!(first, Some(ToHost::Answer(_))));
    assert_eq!(h.handle(ToBoard::Sensor(frame(10))), first);
    assert_eq!(h.handle(ToBoard::Sensor(frame(9))), None);
    assert_eq!(h.handle(ToBoard::Sensor(frame(10 + helm::session::MAX_GAP + 1))), None);
    assert!(matches!(h.handle(ToBoard::Sensor(frame(11))), Some(ToHost::Answer(_))));
    let c = h.counters();
    assert_eq!((c.repeated, c.stale), (1, 2));
}

#[test]
fn a_late_copy_of_the_hello_does_not_let_a_frame_step_twice() {
    let mut h = flying();
    let first = h.handle(ToBoard::Sensor(frame(1)));
    h.handle(ToBoard::Hello { nonce: 1 });
    assert_eq!(h.handle(ToBoard::Sensor(frame(1))), first);
    assert_eq!(h.counters().repeated, 1);
    // A new conversation may count from anywhere.
    h.handle(ToBoard::Hello { nonce: 2 });
    assert!(matches!(h.handle(ToBoard::Sensor(frame(0))), Some(ToHost::Answer(_))));
}

#[test]
fn after_a_reset_during_a_mission_no_mission_is_taken_until_recovered() {
    let boot = Boot { reset_during_mission: true, ..Boot::default() };
    let mut h = Helm::new(Config::default(), boot, RamStorage::default());
    h.handle(ToBoard::Hello { nonce: 1 });
    assert_eq!(h.handle(ToBoard::Begin(Mission::default())), Some(ToHost::Refused(Refusal::Safe)));
    assert!(matches!(h.handle(ToBoard::UploadCommit), Some(ToHost::Refused(Refusal::Safe))));
    assert_eq!(h.handle(ToBoard::Recovered), Some(ToHost::Done { crc: 0 }));
    assert!(matches!(h.handle(ToBoard::Begin(Mission::default())), Some(ToHost::Ready { .. })));
}

#[test]
fn recovered_is_not_believed_below_five_metres() {
    let boot = Boot { reset_during_mission: true, ..Boot::default() };
    let mut h = Helm::new(Config::default(), boot, RamStorage::default());
    let deep = SensorFrame { depth_m: Reading::now(40.0), ..frame(1) };
    assert!(matches!(h.handle(ToBoard::Sensor(deep)), Some(ToHost::Answer(_))));
    assert_eq!(h.handle(ToBoard::Recovered), Some(ToHost::Refused(Refusal::NotNow)));
}

#[test]
fn own_sensors_latch_out_frames_from_the_line() {
    let boot = Boot { seat: Seat::Sensors, ..Boot::default() };
    let mut h = Helm::new(Config::default(), boot, RamStorage::default());
    let Some(ToHost::Hello { manifest, .. }) = h.handle(ToBoard::Hello { nonce: 3 }) else { panic!() };
    assert!(!manifest.hil);
    h.handle(ToBoard::Begin(Mission::default()));
    assert_eq!(h.handle(ToBoard::Sensor(frame(1))), Some(ToHost::Refused(Refusal::NotNow)));
    assert_eq!(h.cycle(&frame(1)).map(|a| a.command.seq), Some(1));
}

#[test]
fn a_silent_line_steps_only_after_patience_and_once_per_cycle() {
    let mut h = flying();
    h.handle(ToBoard::Sensor(frame(1)));
    assert_eq!(h.silent(Micros::from_millis(helm::silence::PATIENCE_MS)), None);
    let due = Micros::from_millis(helm::silence::PATIENCE_MS + u64::from(helm::session::CYCLE_MS));
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
        assert_eq!(h.handle(begin.clone()), Some(ToHost::Continue { offset: 0 }));
    }
    for _ in 0..2 {
        assert_eq!(h.handle(chunk.clone()), Some(ToHost::Continue { offset: bytes.len() as u32 }));
    }
    for _ in 0..2 {
        assert_eq!(h.handle(ToBoard::UploadCommit), Some(ToHost::Volatile { crc }));
    }
    let read = h.handle(ToBoard::ReadBack { object: Object::Mission, offset: 0 });
    let Some(ToHost::Content { data, length, .. }) = read else { panic!("{read:?}") };
    assert_eq!((&data[..], length as usize), (&bytes[..], bytes.len()));
    assert_eq!(h.handle(ToBoard::Rollback(Object::Mission)), Some(ToHost::Volatile { crc: 0 }));
}

#[test]
fn a_corrupt_upload_changes_nothing() {
    let mut h = helm();
    h.handle(ToBoard::UploadBegin { object: Object::Mission, length: 3, crc: 1 });
    h.handle(ToBoard::UploadChunk { offset: 0, data: heapless::Vec::from_slice(&[1, 2, 3]).unwrap() });
    assert_eq!(h.handle(ToBoard::UploadCommit), Some(ToHost::Refused(Refusal::Corrupt)));
    assert!(matches!(h.handle(ToBoard::ReadBack { object: Object::Mission, offset: 0 }), Some(ToHost::Content { length: 0, .. })));
}

#[test]
fn bytes_and_messages_move_it_alike() {
    let (mut by_byte, mut by_message) = (flying(), flying());
    for seq in 1..50 {
        let message = ToBoard::Sensor(frame(seq));
        let mut wire = [0; MAX_WIRE];
        let n = encode(&message, &mut wire).unwrap();
        let answers: Vec<_> = wire[..n].iter().filter_map(|b| by_byte.byte(*b)).collect();
        assert_eq!(answers, [by_message.handle(message).unwrap()]);
        assert_eq!(seq_of(Some(answers[0].clone())), Some(seq));
    }
}
