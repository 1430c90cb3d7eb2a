//! An image of the firmware over the line: every message may come twice, a mission ends an upload, an older version needs leave, and a
//! finished step outside SAFE confirms.

#[allow(dead_code)] // what the cuts of `store` use
#[path = "../../../store/tests/all/nor/mod.rs"]
mod nor;

use crate::{Boot, Helm, Mark, RamStorage, Seat, Storage, WithImages};
use control::Config;
use nor::{Part, Supply};
use signals::link::CRC32;
use signals::messages::CHUNK;
use signals::{Mission, Object, Older, Reading, Refusal, SensorFrame, Standing, ToBoard, ToHost};
use store::image::{BOARD, FACTS, Facts, HEADER, Images, RUNS_AT};

type Shelf = WithImages<RamStorage, Part<512>, Part<1024>>;

fn image(version: u8) -> Vec<u8> {
    let length = 1_500;
    let facts = Facts { board: BOARD, length, firmware: [1, version, 0], wire: 7, id: u32::from(version) };
    let mut bytes = vec![0xff; HEADER as usize];
    bytes[..FACTS].copy_from_slice(&facts.bytes());
    bytes.extend(0x2000_4000u32.to_le_bytes());
    bytes.extend((RUNS_AT + HEADER + 9).to_le_bytes());
    bytes.extend((bytes.len()..length as usize).map(|i| i as u8 ^ version));
    bytes
}

/// A controller of version 1.2.0 on these parts, after the boot loader.
fn started(journal: Part<512>, slots: Part<1024>, mark: Mark) -> Helm<Shelf> {
    let mut images = Images::new(journal, slots);
    images.open();
    assert!(images.boot(false).is_some());
    let (journal, slots) = images.parts();
    let id = Facts::read(&slots.bytes).expect("facts").id;
    let mut shelf = WithImages::new(RamStorage::new(), Images::new(journal.clone(), slots.clone()));
    shelf.open(id);
    let mut helm = Helm::new(Config::default(), Boot { firmware: [1, 2, 0], mark, ..Boot::NEW }, shelf);
    helm.handle(ToBoard::Hello { nonce: 1 });
    helm
}

fn fresh() -> Helm<Shelf> {
    let supply = Supply::default();
    let mut slots = Part::new(6, &supply);
    let old = image(2);
    slots.bytes[..old.len()].copy_from_slice(&old);
    started(Part::new(2, &supply), slots, Mark::NONE)
}

fn again(helm: &mut Helm<Shelf>, mark: Mark) -> Helm<Shelf> {
    let (journal, slots) = helm.storage().images.parts();
    started(journal.clone(), slots.clone(), mark)
}

fn standing(helm: &mut Helm<Shelf>) -> Standing {
    helm.manifest().image.expect("an image").standing
}

/// Sends all of it, each message twice; the answer to the second commit.
fn upload(helm: &mut Helm<Shelf>, bytes: &[u8], older: Older) -> ToHost {
    let begin = ToBoard::UploadBegin { object: Object::Image(older), length: bytes.len() as u32, crc: CRC32.checksum(bytes) };
    for _ in 0..2 {
        assert_eq!(helm.handle(begin.clone()), ToHost::Continue { offset: 0 });
    }
    for (i, piece) in bytes.chunks(CHUNK).enumerate() {
        let offset = (i * CHUNK) as u32;
        let piece = ToBoard::UploadChunk { offset, data: heapless::Vec::from_slice(piece).expect("a chunk") };
        for _ in 0..2 {
            let end = (offset as usize + CHUNK).min(bytes.len()) as u32;
            assert_eq!(helm.handle(piece.clone()), ToHost::Continue { offset: end });
        }
    }
    assert_eq!(helm.handle(begin), ToHost::Continue { offset: bytes.len() as u32 }, "it goes on where it stands");
    let said = helm.handle(ToBoard::UploadCommit);
    assert_eq!(helm.handle(ToBoard::UploadCommit), said);
    said
}

fn step(helm: &mut Helm<Shelf>) -> ToHost {
    let said = helm.handle(ToBoard::Sensor(SensorFrame { depth_m: Reading::now(0.3), ..SensorFrame::default() }));
    assert!(matches!(said, ToHost::Answer(_)), "{said:?}");
    helm.keep_log();
    said
}

#[test]
fn an_image_is_staged_restarted_tried_and_confirmed_by_a_step() {
    let mut helm = fresh();
    assert!(matches!(upload(&mut helm, &image(3), Older::Refused), ToHost::Done { .. }));
    assert_eq!(standing(&mut helm), Standing::Leaving);
    assert_eq!((helm.take_restart(), helm.handle(ToBoard::Restart), helm.take_restart()), (false, ToHost::Done { crc: 0 }, true));
    assert!(!helm.take_restart(), "once");
    let mut helm = again(&mut helm, Mark::NONE);
    assert_eq!(helm.manifest().image.map(|image| image.id), Some(3));
    assert_eq!(helm.handle(ToBoard::Launch(Mission::default())), ToHost::Refused(Refusal::OnTrial));
    assert_eq!(helm.begin_backseat(|s| *s), Err(Refusal::NoMission));
    let ToHost::Ready { image: Some(said), .. } = helm.handle(ToBoard::Begin(Mission::default())) else { panic!("not taken") };
    assert_eq!((said.id, said.standing), (3, Standing::Trial { boots_left: 2 }));
    step(&mut helm);
    assert_eq!(standing(&mut helm), Standing::Confirmed);
    assert_eq!(helm.handle(ToBoard::Restart), ToHost::Refused(Refusal::UnderWay));
    assert!(!helm.take_restart());
}

#[test]
fn a_step_in_safe_after_a_reset_in_flight_confirms_nothing() {
    let mut helm = fresh();
    upload(&mut helm, &image(3), Older::Refused);
    let mut helm = again(&mut helm, Mark::mission(Seat::Host, None, false));
    let ToHost::Answer(answer) = step(&mut helm) else { panic!("no answer") };
    assert_eq!(answer.trace.phase, signals::Phase::Safe);
    assert_eq!(standing(&mut helm), Standing::Trial { boots_left: 2 });
}

#[test]
fn an_older_image_needs_leave_and_a_mission_ends_an_upload() {
    let mut helm = fresh();
    assert_eq!(upload(&mut helm, &image(1), Older::Refused), ToHost::Refused(Refusal::Older));
    assert_eq!(standing(&mut helm), Standing::Flashed);
    assert!(matches!(upload(&mut helm, &image(1), Older::Taken), ToHost::Done { .. }));
    let mut helm = fresh();
    assert!(matches!(helm.handle(ToBoard::Launch(Mission::default())), ToHost::Ready { .. }), "on no trial");
    helm.handle(ToBoard::Recall);
    let new = image(3);
    let begin = ToBoard::UploadBegin { object: Object::Image(Older::Refused), length: new.len() as u32, crc: CRC32.checksum(&new) };
    let piece = |offset: usize| ToBoard::UploadChunk {
        offset: offset as u32,
        data: heapless::Vec::from_slice(&new[offset..][..CHUNK]).expect("fits"),
    };
    helm.handle(begin.clone());
    assert_eq!(helm.handle(piece(0)), ToHost::Continue { offset: 128 });
    assert_eq!(helm.handle(piece(256)), ToHost::Refused(Refusal::OutOfOrder));
    let beyond = ToBoard::UploadChunk { offset: new.len() as u32 - 1, data: heapless::Vec::from_slice(&[0; 2]).expect("fits") };
    assert_eq!(helm.handle(beyond), ToHost::Refused(Refusal::TooLong));
    assert_eq!(helm.handle(ToBoard::UploadCommit), ToHost::Refused(Refusal::OutOfOrder));
    assert!(matches!(helm.handle(ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    for message in [piece(128), begin.clone(), ToBoard::UploadCommit, ToBoard::Rollback(Object::Image(Older::Refused))] {
        assert_eq!(helm.handle(message), ToHost::Refused(Refusal::UnderWay));
    }
    helm.handle(ToBoard::Recall);
    assert_eq!(helm.handle(piece(128)), ToHost::Refused(Refusal::OutOfOrder), "the upload is gone");
    assert_eq!(helm.handle(begin), ToHost::Continue { offset: 0 });
    // Another object on its way ends it as well, and an image the other.
    helm.handle(ToBoard::UploadBegin { object: Object::Mission, length: 5, crc: 0 });
    assert_eq!(helm.storage().images.staged(), None);
    assert_eq!(helm.handle(ToBoard::Rollback(Object::Image(Older::Refused))), ToHost::Refused(Refusal::NothingBefore));
    assert!(helm.storage().image().is_some());
}
