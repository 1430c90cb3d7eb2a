//! Power is cut at every byte of every write and erase of staging, installing, confirming and going back: afterwards the board
//! starts the old image or the new one, whole.

use crate::nor::{Part, Supply};
use crc::{CRC_32_ISO_HDLC, Crc};
use store::image::{BOARD, Error, FACTS, Facts, HEADER, Images, NO_ID, RUNS_AT, Standing, State, TRIALS};

/// Sectors of the journal: 32 notes and the next is opened.
const JOURNAL: usize = 320;
/// Two sectors to a slot.
const SECTOR: usize = 512;

type Board = Images<Part<JOURNAL>, Part<SECTOR>>;

/// An image of this version, its bytes as they are uploaded.
fn image(version: u8, length: usize) -> Vec<u8> {
    let facts = Facts { board: BOARD, length: length as u32, firmware: [1, version, 0], wire: 7, id: id(version) };
    let mut bytes = vec![0xff; HEADER as usize];
    bytes[..FACTS].copy_from_slice(&facts.bytes());
    bytes.extend(0x2000_4000u32.to_le_bytes());
    bytes.extend((RUNS_AT + HEADER + 9).to_le_bytes());
    bytes.extend((bytes.len()..length).map(|i| (i as u8).wrapping_mul(11) ^ version));
    bytes
}

fn id(version: u8) -> u32 {
    0xabc0 + u32::from(version)
}

fn crc(bytes: &[u8]) -> u32 {
    Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}

/// A board that a probe has flashed with this image.
fn flashed(image: &[u8]) -> Board {
    let supply = Supply::default();
    let mut slots = Part::new(6, &supply);
    slots.bytes[..image.len()].copy_from_slice(image);
    slots.bytes[24..28].copy_from_slice(&NO_ID.to_le_bytes());
    let mut board = Images::new(Part::new(2, &supply), slots);
    board.open();
    board
}

/// The same parts, switched on again.
fn copy(board: &mut Board, lasts: Option<usize>) -> Board {
    let supply = Supply::default();
    supply.lasts(lasts);
    let (journal, slots) = board.parts();
    let (mut journal, mut slots) = (journal.clone(), slots.clone());
    (journal.supply, slots.supply) = (supply.clone(), supply);
    let mut board = Images::new(journal, slots);
    board.open();
    board
}

fn done(board: &mut Board) -> usize {
    board.parts().0.supply.done()
}

/// Version that is in slot 0, byte for byte but for seal and identity; none: neither of these two.
fn runs(board: &mut Board, images: &[&[u8]]) -> Option<u8> {
    let slot = &board.parts().1.bytes;
    let same = |image: &&&[u8]| slot[..24] == image[..24] && slot[HEADER as usize..image.len()] == image[HEADER as usize..];
    images.iter().find(same).map(|image| image[17])
}

fn stage(board: &mut Board, image: &[u8]) -> Result<bool, Error> {
    board.begin(image.len() as u32)?;
    for (i, piece) in image.chunks(100).enumerate() {
        board.piece(100 * i as u32, piece)?;
    }
    board.commit(image.len() as u32, crc(image), false, [1, 0, 0])
}

/// Has one image run, confirmed, the other before it.
fn updated(old: &[u8], new: &[u8]) -> Board {
    let mut board = flashed(old);
    assert_eq!(stage(&mut board, new), Ok(true));
    assert!(board.boot(false).expect("starts").trial);
    board.confirm(id(new[17])).expect("confirms");
    board
}

/// Cuts the power at every operation of `act` on copies of `before`, then a second time at some operation of the boot after it, and
/// boots: what starts is one of these images, and the same at the next boot. Returns which started, by cut.
fn cut_everywhere(before: &mut Board, images: &[&[u8]], act: impl Fn(&mut Board)) -> Vec<u8> {
    let mut whole = copy(before, None);
    act(&mut whole);
    let operations = done(&mut whole);
    assert!(operations > 0);
    let mut started = Vec::new();
    for cut in 0..=operations {
        let mut torn = copy(before, Some(cut));
        act(&mut torn);
        // A second cut, somewhere in what mends the first one.
        let mut again = copy(&mut torn, Some(cut.wrapping_mul(7919) % 2000));
        let _ = again.boot(false);
        for (mut board, cuts) in [(torn, 1), (again, 2)] {
            let mut board = copy(&mut board, None);
            assert!(board.boot(false).is_some(), "cut {cut}, {cuts}: nothing to start, {:?}", board.state());
            let version =
                runs(&mut board, images).unwrap_or_else(|| panic!("cut {cut}, {cuts}: slot 0 is neither image, {:?}", board.state()));
            if cuts == 1 {
                started.push(version);
            }
        }
    }
    started
}

const LENGTH: usize = 900;

#[test]
fn a_cut_at_every_byte_of_staging_leaves_the_old_or_the_new_image() {
    let (old, new) = (image(1, LENGTH), image(2, LENGTH - 90));
    let both = [&old[..], &new];
    for mut before in [flashed(&old), updated(&image(0, LENGTH), &old)] {
        let started = cut_everywhere(&mut before, &both, |board| {
            let _ = stage(board, &new);
        });
        let first_new = started.iter().position(|v| *v == 2).expect("the last one is new");
        assert!(started[first_new..].iter().all(|v| *v == 2) && first_new + 30 > started.len(), "new with its entry, and not before");
    }
}

#[test]
fn a_cut_at_every_byte_of_an_installation_ends_in_the_new_image() {
    let (older, old, new) = (image(0, LENGTH), image(1, LENGTH - 200), image(2, LENGTH));
    for mut before in [flashed(&old), updated(&older, &old)] {
        assert_eq!(stage(&mut before, &new), Ok(true));
        let started = cut_everywhere(&mut before, &[&old, &new], |board| {
            let _ = board.boot(false);
        });
        assert!(started.len() > 2 * SECTOR && started.iter().all(|v| *v == 2));
    }
}

#[test]
fn after_a_cut_installation_the_way_back_is_still_there() {
    let (old, new) = (image(1, LENGTH), image(2, LENGTH));
    let mut before = flashed(&old);
    assert_eq!(stage(&mut before, &new), Ok(true));
    let mut whole = copy(&mut before, None);
    whole.boot(false);
    for cut in 0..=done(&mut whole) {
        let mut board = copy(&mut before, Some(cut));
        let _ = board.boot(false);
        // Never confirmed: it boots on until it is given up.
        for _ in 0..=TRIALS {
            board = copy(&mut board, None);
            assert!(board.boot(false).is_some(), "cut {cut}");
        }
        assert_eq!((runs(&mut board, &[&old, &new]), board.standing()), (Some(1), Standing::RolledBack), "cut {cut}");
    }
}

#[test]
fn a_cut_at_every_byte_of_going_back_ends_in_the_old_image() {
    let (old, new) = (image(1, LENGTH), image(2, LENGTH));
    let mut before = flashed(&old);
    assert_eq!(stage(&mut before, &new), Ok(true));
    for _ in 0..TRIALS {
        assert!(before.boot(false).expect("starts").trial);
    }
    assert_eq!(before.standing(), Standing::Trial(0));
    let started = cut_everywhere(&mut before, &[&old, &new], |board| {
        let _ = board.boot(false);
    });
    assert!(started.len() > SECTOR && started.iter().all(|v| *v == 1));
    // By a watchdog after the first boot, and because somebody asks: the same.
    let mut watched = updated(&old, &image(3, LENGTH));
    assert_eq!(stage(&mut watched, &new), Ok(true));
    assert!(watched.boot(true).expect("starts").trial, "the watchdog was that of the image before");
    assert_eq!(copy(&mut watched, None).boot(false).map(|start| start.trial), Some(true), "a second boot");
    assert_eq!((watched.boot(true).map(|start| start.trial), runs(&mut watched, &[&image(3, LENGTH)])), (Some(false), Some(3)));
    let mut asked = updated(&old, &new);
    let started = cut_everywhere(&mut asked, &[&old, &new], |board| {
        if board.go_back().is_ok() {
            let _ = board.boot(false);
        }
    });
    assert_eq!((started.first(), started.last()), (Some(&2), Some(&1)));
}

#[test]
fn a_cut_at_every_byte_of_the_confirmation_is_a_trial_or_a_confirmed_one() {
    let (old, new) = (image(1, LENGTH), image(2, LENGTH));
    // So many notes before it that the confirmation meets every place of the journal's sectors, and an erase of one.
    for notes in 0..40 {
        let mut before = flashed(&old);
        for _ in 0..notes {
            let _ = stage(&mut before, &new);
            before.begin(LENGTH as u32).expect("withdrawn");
        }
        assert_eq!(stage(&mut before, &new), Ok(true));
        assert!(before.boot(false).is_some());
        let started = cut_everywhere(&mut before, &[&old, &new], |board| {
            let _ = board.confirm(id(2));
        });
        assert!(started.iter().all(|v| *v == 2), "{notes} notes before");
        before.confirm(id(2)).expect("confirms");
        assert_eq!(before.standing(), Standing::Confirmed);
        for _ in 0..9 {
            assert_eq!(copy(&mut before, None).boot(true).map(|start| start.trial), Some(false), "a watchdog later is no reason");
        }
    }
}

#[test]
fn the_journal_wears_evenly_over_years_of_updates() {
    let mut board = flashed(&image(0, LENGTH));
    for version in 1..200 {
        assert_eq!(stage(&mut board, &image(version, LENGTH)), Ok(true), "{version}");
        assert!(board.boot(false).expect("starts").trial);
        board.confirm(id(version)).expect("confirms");
        board = copy(&mut board, None);
    }
    let (journal, slots) = board.parts();
    assert!(journal.erases.iter().all(|n| *n < 30), "{:?}", journal.erases);
    assert!(slots.erases.iter().all(|n| *n < 200), "{:?}", slots.erases);
}

#[test]
fn what_may_not_run_is_refused_and_what_runs_goes_on() {
    let old = image(3, LENGTH);
    let mut wrong_board = image(4, LENGTH);
    wrong_board[4] ^= 1;
    let mut wrong_place = image(4, LENGTH);
    wrong_place[HEADER as usize + 6] = 0x00;
    let mut sealed = image(4, LENGTH);
    sealed[FACTS] = 0;
    for (bytes, why) in [
        (wrong_board, Error::Board),
        (wrong_place, Error::Board),
        (sealed, Error::Flash),
        (image(4, 2 * SECTOR + 1), Error::Length),
        (image(4, LENGTH)[..HEADER as usize].to_vec(), Error::Length),
        (image(4, LENGTH)[..LENGTH - 1].to_vec(), Error::Corrupt),
        (vec![0; LENGTH], Error::Flash),
    ] {
        let mut board = flashed(&old);
        assert_eq!(stage(&mut board, &bytes), Err(why));
        assert_eq!((board.standing(), runs(&mut board, &[&old])), (Standing::Flashed, Some(3)));
        assert_eq!(board.boot(false).map(|start| start.trial), Some(false));
    }
    let mut board = flashed(&old);
    let new = image(4, LENGTH);
    board.begin(LENGTH as u32).expect("begins");
    assert_eq!(board.piece(100, &new[100..200]), Err(Error::OutOfOrder), "a gap");
    assert_eq!(board.piece(0, &new[..100]), Ok(100));
    assert_eq!(board.piece(0, &new[..100]), Ok(100), "the same again");
    assert_eq!(board.piece(10, &new[0..40]), Err(Error::OutOfOrder), "not a repetition");
    assert_eq!(board.commit(LENGTH as u32, crc(&new), false, [1, 0, 0]), Err(Error::OutOfOrder), "not complete");
    for (i, piece) in new[100..].chunks(100).enumerate() {
        board.piece(100 + 100 * i as u32, piece).expect("staged");
    }
    assert_eq!(board.commit(LENGTH as u32, crc(&new) ^ 1, false, [1, 0, 0]), Err(Error::Corrupt));
    assert_eq!(board.commit(LENGTH as u32, crc(&new), false, [1, 4, 1]), Err(Error::Older));
    assert_eq!(board.commit(LENGTH as u32, crc(&new), true, [1, 4, 1]), Ok(true), "older with leave");
    assert_eq!(board.standing(), Standing::Leaving);
    assert_eq!((board.go_back(), board.boot(false).map(|start| start.trial)), (Ok(()), Some(false)), "withdrawn");
    assert_eq!(runs(&mut board, &[&old]), Some(3));
    assert_eq!(board.go_back(), Err(Error::NothingBefore));
}

#[test]
fn a_trial_takes_no_upload_and_only_its_own_identity_confirms_it() {
    let (old, new) = (image(1, LENGTH), image(2, LENGTH));
    let mut board = flashed(&old);
    assert_eq!(stage(&mut board, &new), Ok(true));
    board.boot(false);
    assert_eq!(board.standing(), Standing::Trial(TRIALS - 1));
    assert_eq!(stage(&mut board, &image(3, LENGTH)), Err(Error::OnTrial));
    assert_eq!((board.confirm(id(1)), board.standing()), (Err(Error::Corrupt), Standing::Trial(TRIALS - 1)));
    assert_eq!((board.confirm(id(2)), board.standing()), (Ok(()), Standing::Confirmed));
    assert_eq!(stage(&mut board, &new), Ok(false), "it runs already");
    assert_eq!((board.standing(), board.state()), (Standing::Confirmed, State::Steady));
}

#[test]
fn a_rotten_image_is_mended_from_its_copy_or_the_one_before() {
    let (old, new) = (image(1, LENGTH), image(2, LENGTH));
    for (rotten, version) in [(&[0][..], 2), (&[0, 1], 1)] {
        let mut board = updated(&old, &new);
        for slot in rotten {
            board.parts().1.bytes[slot * 2 * SECTOR + 700] ^= 4;
        }
        assert!(board.boot(false).is_some());
        assert_eq!(runs(&mut board, &[&old, &new]), Some(version));
    }
    let mut trial = flashed(&old);
    assert_eq!((stage(&mut trial, &new), trial.boot(false).is_some()), (Ok(true), true));
    trial.parts().1.bytes[700] ^= 4;
    assert_eq!((trial.boot(false).map(|start| start.trial), runs(&mut trial, &[&old])), (Some(false), Some(1)), "rotten on trial");
    let mut board = updated(&old, &new);
    (0..3).for_each(|slot| board.parts().1.bytes[slot * 2 * SECTOR + 700] ^= 4);
    assert_eq!(board.boot(false), None, "nothing is whole, nothing is started");
}

#[test]
fn flash_that_takes_nothing_and_reads_zeros_behind_the_image_starts_it() {
    // As in an emulator without a flash controller.
    let mut board = flashed(&image(1, LENGTH));
    board.parts().0.bytes.fill(0);
    board.open();
    assert_eq!(board.boot(false).map(|start| start.trial), Some(false));
}
