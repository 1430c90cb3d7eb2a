//! Power is cut at every byte of every write and in every erase; what was
//! valid before is valid after, or what replaces it is.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use heapless::Vec as Bytes;
use store::{Ring, Slots};

const SECTOR: usize = 512;

/// NOR flash in memory whose power fails after a number of byte operations.
#[derive(Clone)]
struct Part {
    bytes: Vec<u8>,
    /// Operations (a byte programmed, a byte erased) until the cut.
    left: Option<usize>,
    done: usize,
    /// Noise of the half-done byte.
    seed: u32,
}

#[derive(Debug)]
struct Cut;

impl NorFlashError for Cut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Part {
    fn new(sectors: usize) -> Self {
        Self { bytes: vec![0xff; sectors * SECTOR], left: None, done: 0, seed: 1 }
    }

    fn noise(&mut self) -> u8 {
        self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.seed >> 24) as u8
    }

    /// Whether the power still holds for one more byte.
    fn tick(&mut self) -> bool {
        self.done += 1;
        match &mut self.left {
            Some(0) => false,
            Some(n) => {
                *n -= 1;
                true
            }
            None => true,
        }
    }

    fn powered_again(mut self) -> Self {
        self.left = None;
        self
    }
}

impl ErrorType for Part {
    type Error = Cut;
}

impl ReadNorFlash for Part {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Cut> {
        bytes.copy_from_slice(&self.bytes[offset as usize..offset as usize + bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Part {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Cut> {
        for i in from as usize..to as usize {
            if !self.tick() {
                // A cut erase leaves every byte of the sector somewhere on its way to ones.
                for j in from as usize..to as usize {
                    let n = self.noise();
                    self.bytes[j] |= n;
                }
                return Err(Cut);
            }
            self.bytes[i] = 0xff;
        }
        Ok(())
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Cut> {
        for (i, b) in bytes.iter().enumerate() {
            let at = offset as usize + i;
            if !self.tick() {
                // Only some of the bits that should fall have fallen.
                let n = self.noise();
                self.bytes[at] &= b | n;
                return Err(Cut);
            }
            self.bytes[at] &= b;
        }
        Ok(())
    }
}

fn load(part: &mut Part, object: usize) -> Option<Vec<u8>> {
    let mut out = Bytes::<u8, 400>::new();
    Slots::<_, 2>::new(part.clone()).load(object, &mut out).unwrap().map(|_| out.to_vec())
}

fn content(n: u8) -> Vec<u8> {
    (0..200 + usize::from(n)).map(|i| (i as u8).wrapping_mul(7) ^ n).collect()
}

/// The part after `steps`, with the power cut after `cut` operations; the number of operations done.
fn run(part: &Part, cut: Option<usize>, steps: impl FnOnce(&mut Slots<Part, 2>) -> Result<(), store::Error>) -> (Part, usize, bool) {
    let mut part = part.clone();
    (part.left, part.done) = (cut, 0);
    part.seed = part.seed.wrapping_add(cut.unwrap_or(0) as u32);
    let mut slots = Slots::new(part);
    let ok = steps(&mut slots).is_ok();
    let part = slots.flash().clone();
    let done = part.done;
    (part.powered_again(), done, ok)
}

#[test]
fn a_cut_at_any_byte_of_a_save_leaves_the_old_or_the_new() {
    let mut part = Part::new(4);
    let mut old = None;
    for n in 0..5u8 {
        let new = content(n);
        let (complete, operations, ok) = run(&part, None, |s| s.save(1, &new).map(|_| ()));
        assert!(ok && operations > 200);
        for cut in 0..operations {
            let (mut after, _, ok) = run(&part, Some(cut), |s| s.save(1, &new).map(|_| ()));
            assert!(!ok, "a save that was cut does not say it succeeded");
            let got = load(&mut after, 1);
            assert!(got == old || got.as_ref() == Some(&new), "generation {n}, cut at {cut}");
            // And the next save works whatever the cut left.
            let (mut mended, _, ok) = run(&after, None, |s| s.save(1, &new).map(|_| ()));
            assert!(ok);
            assert_eq!(load(&mut mended, 1).as_ref(), Some(&new), "generation {n}, cut at {cut}");
        }
        part = complete;
        assert_eq!(load(&mut part, 1).as_ref(), Some(&new));
        assert_eq!(load(&mut part, 0), None, "the other object's slots are not touched");
        old = Some(new);
    }
}

#[test]
fn a_cut_at_any_byte_of_a_rollback_leaves_one_or_the_other() {
    let mut slots = Slots::<_, 2>::new(Part::new(4));
    slots.save(0, &content(1)).unwrap();
    slots.save(0, &content(2)).unwrap();
    let part = slots.flash().clone();
    for cut in 0..4 {
        let (mut after, _, _) = run(&part, Some(cut), |s| s.rollback(0));
        let got = load(&mut after, 0).unwrap();
        assert!(got == content(1) || got == content(2), "cut at {cut}");
    }
    let (mut after, _, ok) = run(&part, None, |s| s.rollback(0));
    assert!(ok);
    assert_eq!(load(&mut after, 0), Some(content(1)));
    let (mut after, _, _) = run(&after, None, |s| s.rollback(0));
    assert_eq!(load(&mut after, 0), None, "both revoked: what is built in is in use");
    let (mut after, _, ok) = run(&after, None, |s| s.save(0, &content(3)).map(|_| ()));
    assert!(ok);
    assert_eq!(load(&mut after, 0), Some(content(3)));
}

#[test]
fn rotten_content_gives_way_to_the_generation_before() {
    let mut slots = Slots::<_, 2>::new(Part::new(4));
    slots.save(0, &content(1)).unwrap();
    slots.save(0, &content(2)).unwrap();
    let mut part = slots.flash().clone();
    part.bytes[SECTOR + 100] ^= 0x10; // slot B holds generation 2
    assert_eq!(load(&mut part, 0), Some(content(1)));
}

#[test]
fn a_part_that_stores_nothing_is_found_out() {
    /// As QEMU's: says yes, keeps nothing, reads zeros.
    struct Deaf;
    impl ErrorType for Deaf {
        type Error = Cut;
    }
    impl ReadNorFlash for Deaf {
        const READ_SIZE: usize = 1;
        fn read(&mut self, _: u32, bytes: &mut [u8]) -> Result<(), Cut> {
            bytes.fill(0);
            Ok(())
        }
        fn capacity(&self) -> usize {
            8 * SECTOR
        }
    }
    impl NorFlash for Deaf {
        const WRITE_SIZE: usize = 1;
        const ERASE_SIZE: usize = SECTOR;
        fn erase(&mut self, _: u32, _: u32) -> Result<(), Cut> {
            Ok(())
        }
        fn write(&mut self, _: u32, _: &[u8]) -> Result<(), Cut> {
            Ok(())
        }
    }
    assert_eq!(Slots::<_, 2>::new(Deaf).save(0, &[1, 2, 3]), Err(store::Error::Flash));
    let mut ring = Ring::mount(&mut Deaf, 0).unwrap();
    assert_eq!(ring.append(&mut Deaf, 1, &[1]), Err(store::Error::Flash));
}

fn entry(n: u32) -> Vec<u8> {
    let mut e = n.to_le_bytes().to_vec();
    e.extend((0..n % 90).map(|i| (i ^ n) as u8));
    e
}

fn numbers(ring: &Ring, part: &mut Part) -> Vec<u32> {
    let mut got = vec![];
    ring.read(part, |kind, data| {
        if kind == 1 {
            let n = u32::from_le_bytes(data[..4].try_into().unwrap());
            assert_eq!(data, entry(n));
            got.push(n);
        }
    })
    .unwrap();
    got
}

#[test]
fn a_cut_at_any_byte_of_the_log_costs_at_most_the_entry_being_written() {
    const ENTRIES: u32 = 40;
    let write = |part: &mut Part| -> u32 {
        let mut ring = Ring::mount(part, 0).unwrap();
        (0..ENTRIES).take_while(|n| ring.append(part, 1, &entry(*n)).is_ok()).count() as u32
    };
    let mut whole = Part::new(8);
    assert_eq!(write(&mut whole), ENTRIES);
    for cut in 0..whole.done {
        let mut part = Part { left: Some(cut), seed: cut as u32, ..Part::new(8) };
        let written = write(&mut part);
        let mut part = part.powered_again();
        let mut ring = Ring::mount(&mut part, 0).unwrap();
        let got = numbers(&ring, &mut part);
        // The half-done last byte of an entry may have come out right.
        assert!(got.len() as u32 == written || got.len() as u32 == written + 1, "cut at {cut}: {} of {written}", got.len());
        assert_eq!(got, (0..got.len() as u32).collect::<Vec<_>>(), "cut at {cut}");
        ring.append(&mut part, 1, &entry(1000)).unwrap();
        let ring = Ring::mount(&mut part, 0).unwrap();
        assert_eq!(numbers(&ring, &mut part).last(), Some(&1000), "cut at {cut}");
    }
}

#[test]
fn the_ring_goes_round_and_keeps_the_newest_with_even_wear() {
    let mut part = Part::new(6);
    let mut ring = Ring::mount(&mut part, SECTOR as u32).unwrap();
    for n in 0..1000 {
        ring.append(&mut part, 1, &entry(n)).unwrap();
        if n % 37 == 0 {
            ring = Ring::mount(&mut part, SECTOR as u32).unwrap();
        }
    }
    let got = numbers(&ring, &mut part);
    assert!(got.len() > 20);
    assert_eq!(got, (1000 - got.len() as u32..1000).collect::<Vec<_>>(), "the newest, in order, without a gap");
    assert!(part.bytes[..SECTOR].iter().all(|b| *b == 0xff), "what lies before the ring is not touched");
}

#[test]
fn the_note_survives_laps_and_cuts() {
    let mut part = Part::new(3);
    let mut ring = Ring::mount(&mut part, 0).unwrap();
    assert_eq!(ring.note(), 0);
    ring.set_note(&mut part, 3).unwrap();
    for n in 0..300 {
        ring.append(&mut part, 1, &entry(n)).unwrap();
        if n % 10 == 0 {
            assert_eq!(Ring::mount(&mut part, 0).unwrap().note(), 3, "after {n} entries");
        }
    }
    ring.set_note(&mut part, 0).unwrap();
    assert_eq!(Ring::mount(&mut part, 0).unwrap().note(), 0);
}
