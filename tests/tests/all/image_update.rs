//! An image of the firmware over the line of a board with its own chip's flash: staged, installed, tried, confirmed, taken back; and the
//! driver of that flash on a model of its controller, the power cut in an image of full size.

use devices::chip_flash::{Journal, Slots};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use hil_host::cli::launch::{Asked, Here, launch};
use parts::chip_flash::{BASE, ChipFlash, sector};
use plant::World;
use rig::flight::closed_loop::Setup;
use rig::flight::{mission_file, own_parts, worlds};
use rig::seats::parts::{OwnFlash, OwnParts};
use rig::seats::{Link, Seat, SeatError, image};
use signals::link::CRC32;
use signals::{Older, Refusal, SensorFrame, Standing, Strap};
use std::cell::RefCell;
use std::rc::Rc;
use store::image::{BOARD, FACTS, Facts, HEADER, Images, NO_ID, RUNS_AT};

/// Where slot 0 lies in flash.
const SLOT: usize = (RUNS_AT - BASE) as usize;

/// An image of this version and identity, as it is uploaded.
fn made(version: u8, id: u32, length: usize) -> Vec<u8> {
    let facts = Facts { board: BOARD, length: length as u32, firmware: [0, version, 0], wire: signals::WIRE_VERSION, id };
    let mut bytes = vec![0xff; HEADER as usize];
    bytes[..FACTS].copy_from_slice(&facts.bytes());
    bytes.extend(0x2000_4000u32.to_le_bytes());
    bytes.extend((RUNS_AT + HEADER + 9).to_le_bytes());
    bytes.extend((bytes.len()..length).map(|i| (i * i / 7) as u8 ^ version));
    bytes
}

/// Flash as a probe leaves it.
fn flashed(image: &[u8]) -> ChipFlash {
    let mut flash = ChipFlash::default();
    flash.memory[SLOT..SLOT + image.len()].copy_from_slice(image);
    flash
}

fn board(image: &[u8]) -> Link<OwnParts> {
    let mission = mission_file::built_in("sea").expect("built in");
    let mut link = own_parts::board(World::new(worlds::for_mission(&mission)).expect("a world"), &Setup::new(mission));
    *link.wire().own_flash().0.borrow_mut() = flashed(image);
    link.wire().restart(true);
    link
}

fn standing(link: &mut Link<OwnParts>) -> (u32, Standing) {
    let image = link.hello().expect("answers").image.expect("an image");
    (image.id, image.standing)
}

fn refused<T: std::fmt::Debug>(said: Result<T, SeatError>) -> Refusal {
    match said {
        Err(SeatError::Refused { why, .. }) => why,
        other => panic!("{other:?}"),
    }
}

/// One frame on the bench, or none: what the answer says is not looked at.
fn one_step(link: &mut Link<OwnParts>) {
    link.wire().strap(Strap::Bench);
    link.hello().expect("answers");
    link.begin(&mission_file::built_in("sea").expect("built in")).expect("begins");
    link.exchange(&SensorFrame::default()).expect("steps");
}

#[test]
fn hil_an_image_is_uploaded_tried_on_the_bench_and_confirmed() {
    let (old, new) = (made(1, NO_ID, 9_000), made(2, 0xbbbb, 7_001));
    let mut link = board(&old);
    assert_eq!(standing(&mut link), (NO_ID, Standing::Flashed));
    let mut sent = 0;
    image::stage(&mut link, &new, Older::Refused, |n| sent = n).expect("staged");
    assert_eq!((sent, standing(&mut link)), (new.len(), (NO_ID, Standing::Leaving)));
    let runs = image::restart(&mut link).expect("starts again");
    assert_eq!((runs.id, runs.standing), (0xbbbb, Standing::Trial { boots_left: 2 }));

    // On trial it launches nothing, and says what to do.
    let clock = link.wire().bench.clock.clone();
    let utc_ms = || parts::gps::utc_ms(clock.now_ns()) as f64;
    let here = Here { utc_ms: &utc_ms, seconds: None };
    let found =
        launch(&mut link, &Asked { config: None, mission: "sea", check: false, set_options: false }, &|| {}, &here).expect("checks");
    let bad: Vec<_> = found.items.iter().filter(|i| !i.good).collect();
    assert!(bad.len() == 1 && bad[0].what == "image" && bad[0].found.contains("0000bbbb, ON TRIAL, 2 more boots"), "{bad:?}");
    assert_eq!(refused(link.launch(&mission_file::built_in("sea").expect("built in"))), Refusal::OnTrial);
    assert_eq!(refused(image::stage(&mut link, &old, Older::Taken, |_| {})), Refusal::OnTrial);

    one_step(&mut link);
    assert_eq!(standing(&mut link), (0xbbbb, Standing::Confirmed));
    assert_eq!(refused(image::stage(&mut link, &old, Older::Taken, |_| {})), Refusal::UnderWay, "not in a mission");
    assert_eq!(refused(image::restart(&mut link)), Refusal::UnderWay);
    assert_eq!(refused(image::go_back(&mut link)), Refusal::UnderWay);
}

#[test]
fn hil_a_bad_image_is_given_up_after_its_boots_and_when_asked() {
    let (old, new) = (made(1, NO_ID, 9_000), made(2, 0xbbbb, 7_001));
    let upload = || {
        let mut link = board(&old);
        image::stage(&mut link, &new, Older::Refused, |_| {}).expect("staged");
        assert_eq!(image::restart(&mut link).expect("starts again").id, 0xbbbb);
        link
    };
    let mut link = upload();
    for boots_left in [1, 0] {
        link.wire().restart(true);
        assert_eq!(standing(&mut link), (0xbbbb, Standing::Trial { boots_left }));
    }
    link.wire().restart(true);
    assert_eq!(standing(&mut link), (NO_ID, Standing::RolledBack));
    let mut link = upload();
    image::go_back(&mut link).expect("taken back");
    assert_eq!(standing(&mut link), (0xbbbb, Standing::Leaving));
    let runs = image::restart(&mut link).expect("starts again");
    assert_eq!((runs.id, runs.standing), (NO_ID, Standing::RolledBack));
    // The new one is before it now in no slot: what was put back is what is there.
    assert_eq!(refused(image::go_back(&mut link)), Refusal::NothingBefore);
}

#[test]
fn hil_an_image_that_may_not_come_is_refused_and_the_old_one_goes_on() {
    let old = made(3, NO_ID, 9_000);
    // The version that runs is 0.0.0 in this seat: nothing is older. `store` tests that.
    let mut other = made(4, 1, 9_000);
    other[5] ^= 1;
    let mut short = made(4, 1, 9_000);
    short.truncate(8_999);
    let mut link = board(&old);
    let too_long = vec![0xff; 256 * 1024 + 1];
    for (bytes, why) in [(other, Refusal::OtherBoard), (short, Refusal::Corrupt), (too_long, Refusal::TooLong)] {
        assert_eq!(refused(image::stage(&mut link, &bytes, Older::Refused, |_| {})), why);
        assert_eq!(standing(&mut link), (NO_ID, Standing::Flashed));
    }
    link.wire().restart(true);
    assert_eq!(standing(&mut link), (NO_ID, Standing::Flashed));
    let mut simulated = Link::new(rig::seats::in_process::InProcess::default());
    simulated.hello().expect("answers");
    assert_eq!(refused(image::stage(&mut simulated, &old, Older::Refused, |_| {})), Refusal::NoImages);
    let words = SeatError::Refused { asked: "x", why: Refusal::NoImages }.to_string();
    assert!(words.contains("cargo flash"), "{words}");
}

#[test]
fn the_flash_driver_does_what_its_controller_asks_for() {
    let mut flash = ChipFlash::default();
    flash.memory.fill(0);
    let own = OwnFlash(Rc::new(RefCell::new(flash)));
    let (mut journal, mut slots) = (Journal::new(own.clone()), Slots::new(own.clone()));
    assert_eq!((journal.capacity(), slots.capacity()), (0x8000, 0xc_0000));
    journal.erase(0x4000, 0x8000).expect("erases");
    slots.erase(0x2_0000, 0x6_0000).expect("erases");
    let erased: Vec<usize> = (0..12).filter(|n| sector(*n).is_some_and(|(at, _)| own.0.borrow().memory[at] == 0xff)).collect();
    assert_eq!(erased, [2, 6, 7], "sector 2 of the journal, the second half of slot 0 and the first of slot 1");
    // Every alignment of beginning and end, words and bytes.
    let text: Vec<u8> = (1..60).collect();
    for begin in 0..5u32 {
        for length in 0..=text.len() {
            let at = 0x2_0000 + 0x1000 * (begin + 1) + 64 * length as u32 + begin;
            slots.write(at, &text[..length]).expect("programs");
            let mut back = vec![0; length + 2];
            slots.read(at - 1, &mut back).expect("reads");
            assert_eq!((&back[1..=length], back[0], back[length + 1]), (&text[..length], 0xff, 0xff), "{begin} {length}");
        }
    }
    journal.write(0x4001, &[1, 2, 3]).expect("programs");
    for (from, to) in [(1, 0x4000), (0, 0x4001), (0, 0xc000)] {
        assert!(journal.erase(from, to).is_err());
    }
    assert!(journal.write(0x7fff, &[0, 0]).is_err() && journal.read(0x8000, &mut [0]).is_err() && journal.write(u32::MAX, &[0]).is_err());
    own.0.borrow_mut().busy = u32::MAX;
    assert!(slots.write(0x3_0000, &[0]).is_err(), "a controller that stays busy is given up");
}

/// Power is cut at operations of `act` all over an image of full size; afterwards one of these images is there, whole.
fn cut_all_over(before: &ChipFlash, images: [&[u8]; 2], act: impl Fn(&OwnFlash)) -> [usize; 2] {
    let run = |lasts: Option<usize>| {
        let own = OwnFlash(Rc::new(RefCell::new(before.clone())));
        own.0.borrow_mut().power_up(lasts);
        own.0.borrow_mut().busy = 0;
        act(&own);
        own
    };
    let operations = run(None).0.borrow().done;
    let mut counts = [0; 2];
    let cuts = (0..operations).step_by(operations / 40).chain([1, 2, operations - 3, operations - 2, operations - 1, operations]);
    for cut in cuts {
        let own = run(Some(cut));
        own.0.borrow_mut().power_up(None);
        let mut after = own.images();
        after.open();
        assert!(after.boot(false).is_some(), "cut {cut} of {operations}");
        let flash = own.0.borrow();
        let same = |image: &&[u8]| flash.memory[SLOT + HEADER as usize..SLOT + image.len()] == image[HEADER as usize..];
        counts[images.iter().position(same).unwrap_or_else(|| panic!("cut {cut} of {operations}: neither"))] += 1;
    }
    counts
}

fn stage(images: &mut Images<Journal<OwnFlash>, Slots<OwnFlash>>, image: &[u8]) -> Result<bool, store::image::Error> {
    images.open();
    images.begin(image.len() as u32)?;
    for (at, piece) in (0..).step_by(128).zip(image.chunks(128)) {
        images.piece(at, piece)?;
    }
    images.commit(image.len() as u32, CRC32.checksum(image), false, [0; 3])
}

#[test]
fn a_cut_anywhere_in_an_image_of_full_size_leaves_one_that_starts() {
    let (old, new) = (made(1, NO_ID, 125_596), made(2, 0xbbbb, 256 * 1024));
    let both = [&old[..], &new];
    let [olds, news] = cut_all_over(&flashed(&old), both, |own| {
        let _ = stage(&mut own.images(), &new);
    });
    assert!(olds > 30 && news > 0, "{olds} {news}");
    let staged = OwnFlash(Rc::new(RefCell::new(flashed(&old))));
    assert_eq!(stage(&mut staged.images(), &new), Ok(true));
    let boot = |own: &OwnFlash| {
        let mut images = own.images();
        images.open();
        images.boot(false);
    };
    let [olds, news] = cut_all_over(&staged.0.borrow(), both, boot);
    assert!(olds == 0 && news > 30, "{olds} {news}");
    (0..3).for_each(|_| boot(&staged));
    let [olds, news] = cut_all_over(&staged.0.borrow(), both, boot);
    assert!(olds > 30 && news == 0, "{olds} {news}");
}
