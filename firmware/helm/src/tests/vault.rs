//! The vault over a flash part whose power may be cut at any byte: uploads
//! live in slots, the mark of a mission is there before its first command, and
//! a flight goes on without its log.

use crate::storage::OBJECTS;
use crate::vault::{CYCLE, Logged};
use crate::{Boot, Content, Helm, Kept, Mark, RamStorage, Seat, Storage, Vault};
use control::Config;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use signals::{Abort, Answer, Flags, Micros, Mission, Object, Phase, Reading, SensorFrame, ToBoard, ToHost};
use std::cell::RefCell;
use std::rc::Rc;
use store::Ring;

const SECTOR: usize = 4096;
const SECTORS: usize = 12;

#[derive(Default)]
struct Chip {
    bytes: Vec<u8>,
    /// Byte operations until the power is cut.
    left: Option<usize>,
    done: usize,
    /// Writes say Ok and do nothing, reads give zeros: QEMU's internal flash.
    deaf: bool,
    /// Every write fails from now on.
    broken: bool,
}

/// NOR flash in memory that outlives its driver.
#[derive(Clone)]
struct Part(Rc<RefCell<Chip>>);

#[derive(Debug)]
struct Cut;

impl NorFlashError for Cut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Part {
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Chip { bytes: vec![0xff; SECTORS * SECTOR], left: None, done: 0, deaf: false, broken: false })))
    }
}

impl Chip {
    fn power(&mut self) -> Result<(), Cut> {
        self.done += 1;
        match &mut self.left {
            Some(0) => Err(Cut),
            Some(n) => {
                *n -= 1;
                Ok(())
            }
            None => Ok(()),
        }
    }
}

impl ErrorType for Part {
    type Error = Cut;
}

impl ReadNorFlash for Part {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Cut> {
        let chip = self.0.borrow();
        let at = offset as usize;
        if chip.deaf {
            bytes.fill(0)
        } else {
            bytes.copy_from_slice(&chip.bytes[at..at + bytes.len()])
        }
        Ok(())
    }
    fn capacity(&self) -> usize {
        SECTORS * SECTOR
    }
}

impl NorFlash for Part {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Cut> {
        let mut chip = self.0.borrow_mut();
        if chip.broken {
            return Err(Cut);
        }
        chip.power()?; // a cut erase is store's own test
        if !chip.deaf {
            chip.bytes[from as usize..to as usize].fill(0xff);
        }
        Ok(())
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Cut> {
        let mut chip = self.0.borrow_mut();
        if chip.broken {
            return Err(Cut);
        }
        for (i, b) in bytes.iter().enumerate() {
            chip.power()?;
            if !chip.deaf {
                chip.bytes[offset as usize + i] &= b;
            }
        }
        Ok(())
    }
}

fn vault(part: &Part) -> (Vault<Part>, Mark) {
    let mut vault = Vault::new();
    let mark = vault.attach(part.clone());
    (vault, mark)
}

fn loaded(vault: &mut Vault<Part>) -> Option<Vec<u8>> {
    let mut out = Content::new();
    vault.load(Object::Mission, &mut out).then(|| out.to_vec())
}

/// Boots as the board does: the mark on flash says whether a mission was under way.
fn boot(part: &Part) -> (Helm<Vault<Part>>, Mark) {
    let (vault, mark) = vault(part);
    let boot = Boot { mark, ..Boot::default() };
    (Helm::new(Config::default(), boot, vault), mark)
}

/// One message as the board's loop handles it: mark, answer out, log.
fn ask(helm: &mut Helm<Vault<Part>>, message: ToBoard) -> ToHost {
    let answer = helm.handle(message);
    helm.keep_mark();
    let out = answer.clone();
    helm.keep_log();
    out
}

fn frame(seq: u32) -> SensorFrame {
    let depth_m = Reading::now(0.05 * seq as f32);
    SensorFrame { seq, time: Micros::from_secs(4 * u64::from(seq)), depth_m, pitch_rad: Reading::now(-0.3), ..SensorFrame::default() }
}

/// Seen at the surface by both sensors for long enough.
fn afloat(helm: &mut Helm<Vault<Part>>, seq: u32) {
    for seq in seq..seq + 12 {
        ask(helm, ToBoard::Sensor(SensorFrame { depth_m: Reading::now(0.1), depth2_m: Reading::now(0.2), ..frame(seq) }));
    }
}

fn begin(helm: &mut Helm<Vault<Part>>) -> ToHost {
    ask(helm, ToBoard::Hello { nonce: 1 });
    ask(helm, ToBoard::Begin(Mission::default()))
}

#[test]
fn uploads_outlive_the_power_and_roll_back() {
    let part = Part::new();
    let (mut v, _) = vault(&part);
    assert_eq!(v.save(Object::Mission, &[1, 2, 3]), Ok(Kept::ForGood));
    assert_eq!(v.save(Object::Mission, &[4]), Ok(Kept::ForGood));
    let (mut v, _) = vault(&part);
    assert_eq!(loaded(&mut v), Some(vec![4]));
    assert_eq!(v.rollback(Object::Mission), Ok(Kept::ForGood));
    let (mut v, _) = vault(&part);
    assert_eq!(loaded(&mut v), Some(vec![1, 2, 3]));
}

#[test]
fn a_part_that_keeps_nothing_or_breaks_gives_way_to_ram_and_says_so() {
    let part = Part::new();
    part.0.borrow_mut().deaf = true;
    let (mut v, mark) = vault(&part);
    assert_eq!(mark, Mark::NONE);
    assert_eq!(v.save(Object::Mission, &[7]), Ok(Kept::UntilReset));
    assert_eq!(loaded(&mut v), Some(vec![7]));

    let part = Part::new();
    let (mut v, _) = vault(&part);
    assert_eq!(v.save(Object::Mission, &[1]), Ok(Kept::ForGood));
    part.0.borrow_mut().broken = true;
    assert_eq!(v.save(Object::Mission, &[2]), Ok(Kept::UntilReset));
    assert_eq!(loaded(&mut v), Some(vec![2]), "the newest is in use");
    assert_eq!(v.rollback(Object::Mission), Ok(Kept::UntilReset));
    assert_eq!(loaded(&mut v), Some(vec![1]), "and the one on flash behind it");
    part.0.borrow_mut().broken = false;
    assert_eq!(v.save(Object::Mission, &[3]), Ok(Kept::ForGood));
    assert_eq!(loaded(&mut v), Some(vec![3]));
}

#[test]
fn without_a_part_all_is_in_ram() {
    let mut v = Vault::<Part>::new();
    assert_eq!(v.save(Object::Mission, &[1]), Ok(Kept::UntilReset));
    assert_eq!(v.rollback(Object::Mission), Ok(Kept::UntilReset));
    assert_eq!(loaded(&mut v), None);
    assert_eq!(v.read_log(0, &mut [0; 4]), 0);
    assert!(!v.log_lost(), "a bench board without a part answers like the session on the host");
}

/// Flies from boot until the power goes; says whether a command of the mission
/// got out, and whether its end was answered.
fn until_the_cut(part: &Part) -> (bool, bool) {
    let alive = |part: &Part| part.0.borrow().left != Some(0);
    let (mut helm, _) = boot(part);
    begin(&mut helm);
    let mut commanded = false;
    for seq in 1..30 {
        let answer = helm.handle(ToBoard::Sensor(frame(seq)));
        helm.keep_mark();
        if !alive(part) {
            return (commanded, false);
        }
        commanded |= matches!(answer, ToHost::Answer(_));
        helm.keep_log();
        if !alive(part) {
            return (commanded, false);
        }
    }
    ask(&mut helm, ToBoard::Recall);
    afloat(&mut helm, 30);
    ask(&mut helm, ToBoard::Recovered);
    (commanded, alive(part))
}

#[test]
fn a_cut_at_any_byte_of_a_mission_boots_safe_if_a_command_was_out() {
    let whole = Part::new();
    assert_eq!(until_the_cut(&whole), (true, true));
    assert_eq!(boot(&whole).1, Mark::NONE, "the mission is over");
    let operations = whole.0.borrow().done;
    assert!(operations > 1000, "{operations}");
    let mut safe = 0;
    for cut in 0..operations {
        let part = Part::new();
        part.0.borrow_mut().left = Some(cut);
        let (commanded, ended) = until_the_cut(&part);
        part.0.borrow_mut().left = None;
        let (mut helm, mark) = boot(&part);
        if mark == Mark::NONE {
            // Either nothing was out yet, or the very last operations were those of clearing the mark.
            assert!(!commanded || ended || cut + 10 > operations, "cut at {cut}");
            continue;
        }
        safe += 1;
        let ToHost::Answer(answer) = ask(&mut helm, ToBoard::Sensor(frame(40))) else { panic!("no answer, cut at {cut}") };
        assert_eq!((answer.trace.phase, answer.trace.abort), (Phase::Safe, mark.first_cause().or(Some(Abort::Reset))), "cut at {cut}");
        assert!(answer.command.ballast_m3 > 0.0);
        assert!(matches!(begin(&mut helm), ToHost::Refused(_)), "no dive after it, cut at {cut}");
        afloat(&mut helm, 41);
        assert_eq!(ask(&mut helm, ToBoard::Recovered), ToHost::Done { crc: 0 }, "cut at {cut}");
        assert_eq!(boot(&part).1, Mark::NONE, "recovered clears it, cut at {cut}");
    }
    assert!(safe > operations / 2, "{safe} of {operations}");
}

fn log_of(part: &Part) -> Vec<(SensorFrame, Answer)> {
    let mut part = part.clone();
    let ring = Ring::mount(&mut part, (2 * OBJECTS * SECTOR) as u32).unwrap();
    let mut got = vec![];
    ring.read(&mut part, |kind, data| {
        if kind == CYCLE {
            let (utc, frame, answer): Logged = postcard::from_bytes(data).unwrap();
            assert_eq!(utc, None, "nobody set a clock");
            got.push((frame, answer));
        }
    })
    .unwrap();
    got
}

#[test]
fn every_cycle_is_in_the_log_once_and_the_oldest_go_first() {
    let part = Part::new();
    let (mut helm, _) = boot(&part);
    begin(&mut helm);
    let mut sent = vec![];
    for seq in 1..400 {
        let frame = frame(seq % 300 + seq / 300 * 300);
        for _ in 0..2 {
            let ToHost::Answer(answer) = ask(&mut helm, ToBoard::Sensor(frame)) else { panic!() };
            if sent.last() != Some(&(frame, answer)) {
                sent.push((frame, answer));
            }
        }
    }
    let got = log_of(&part);
    assert!(got.len() > 60 && got.len() < sent.len(), "{} of {}", got.len(), sent.len());
    assert_eq!(got, sent[sent.len() - got.len()..]);
    assert!(!sent.iter().any(|(_, a)| a.trace.flags.contains(Flags::LOG_FULL)));
}

/// The answers of a flight during which writes fail from cycle 10 to `mended`.
fn flight_with_a_failing_log(part: &Part, mended: u32) -> Vec<u32> {
    let (mut helm, _) = boot(part);
    let mut twin = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    begin(&mut helm);
    twin.handle(ToBoard::Hello { nonce: 1 });
    twin.handle(ToBoard::Begin(Mission::default()));
    let mut flagged = vec![];
    for seq in 1..40 {
        part.0.borrow_mut().broken = (10..mended).contains(&seq);
        let ToHost::Answer(answer) = ask(&mut helm, ToBoard::Sensor(frame(seq))) else { panic!() };
        let ToHost::Answer(without) = twin.handle(ToBoard::Sensor(frame(seq))) else { panic!() };
        assert_eq!((answer.command, answer.trace.abort), (without.command, without.trace.abort), "cycle {seq}");
        if answer.trace.flags.contains(Flags::LOG_FULL) {
            flagged.push(seq);
        }
    }
    flagged
}

#[test]
fn a_log_that_fails_is_flagged_and_the_flight_goes_on() {
    let seqs = |part: &Part| log_of(part).iter().map(|(f, _)| f.seq).collect::<Vec<u32>>();
    let part = Part::new();
    // Told from the answer after the first lost entry on, for good: entries are missing.
    assert_eq!(flight_with_a_failing_log(&part, 15), (11..40).collect::<Vec<_>>());
    assert_eq!(seqs(&part), (1..10).chain(15..40).collect::<Vec<_>>());
    // A part that goes on failing is left alone.
    let part = Part::new();
    assert_eq!(flight_with_a_failing_log(&part, 30), (11..40).collect::<Vec<_>>());
    assert_eq!(seqs(&part), (1..10).collect::<Vec<_>>());
    assert_ne!(boot(&part).1, Mark::NONE, "the mark of the mission is still there");
}

#[test]
fn the_first_cause_survives_a_reset_and_every_mark_is_read_back() {
    let part = Part::new();
    let (mut helm, _) = boot(&part);
    ask(&mut helm, ToBoard::Hello { nonce: 1 });
    ask(&mut helm, ToBoard::Begin(Mission::default()));
    ask(&mut helm, ToBoard::Sensor(frame(1)));
    let leak = SensorFrame { leak: signals::Switch::Alarm, ..frame(2) };
    let ToHost::Answer(answer) = ask(&mut helm, ToBoard::Sensor(leak)) else { panic!("no answer") };
    assert_eq!(answer.trace.abort, Some(Abort::Leak));
    drop(helm);
    let (mut helm, mark) = boot(&part);
    assert_eq!(mark, Mark::mission(Seat::Host, Some(Abort::Leak), false));
    let ToHost::Answer(answer) = ask(&mut helm, ToBoard::Sensor(frame(3))) else { panic!("no answer") };
    assert_eq!((answer.trace.phase, answer.trace.abort), (signals::Phase::Safe, Some(Abort::Leak)));

    for seat in [Seat::Host, Seat::Sensors, Seat::Backseat] {
        assert_eq!(Mark::mission(seat, None, false).first_cause(), None);
        for note in 0..=255u8 {
            let mark = Mark(note);
            assert_eq!(mark.in_mission(), note != 0);
            if let Some(cause) = mark.first_cause() {
                let again = Mark::mission(seat, Some(cause), mark.weight_fired());
                assert_eq!(
                    (again.first_cause(), again.seat(), again.in_mission(), again.weight_fired()),
                    (Some(cause), seat, true, mark.weight_fired())
                );
            }
        }
    }
    assert_eq!(
        (0..=127).filter(|n| n & 3 == 1 && Mark(*n).first_cause().is_some()).count(),
        Abort::Bottom as usize + 1,
        "every cause is kept"
    );
}

/// The bytes of an object of every kind, a first and a second version; both are usable.
fn versions(object: Object) -> [Vec<u8>; 2] {
    // The built-in table as if fitted to another flight (bytes 8..12, then the CRC).
    let table = |wings| {
        [1, 2].map(|fit: u32| {
            let mut bytes = crate::objects::built_in(wings).to_vec();
            bytes[8..12].copy_from_slice(&fit.to_le_bytes());
            let end = bytes.len() - 4;
            let crc = signals::link::CRC32.checksum(&bytes[..end]);
            bytes[end..].copy_from_slice(&crc.to_le_bytes());
            bytes
        })
    };
    match object {
        Object::Table(wings) => table(wings),
        Object::Config => [control::Settings::slocum_100(), control::Settings::slocum_1000()].map(|settings| {
            let mut bytes = Content::new();
            crate::objects::config_bytes(&Config::new(settings).unwrap(), &mut bytes);
            bytes.to_vec()
        }),
        Object::Mission | Object::Log | Object::Autopsy => [2u16, 3]
            .map(|surface_every| postcard::to_slice(&Mission { surface_every, ..Mission::default() }, &mut [0; 400]).unwrap().to_vec()),
        Object::History => [1, 2].map(|vehicle_id| {
            let history = evidence::History { vehicle_id, usual_level: 1e-5, mean: [0.1; 8], spread: [[0.0; 8]; 8] };
            history.encode().expect("sound").to_vec()
        }),
        Object::Image(_) => panic!("images lie on the chip's own flash, not in the vault"),
    }
}

/// An upload as the host makes it; whether it was answered as stored for good.
fn upload(helm: &mut Helm<Vault<Part>>, object: Object, bytes: &[u8]) -> bool {
    let crc = signals::link::CRC32.checksum(bytes);
    helm.handle(ToBoard::UploadBegin { object, length: bytes.len() as u32, crc });
    for (i, piece) in bytes.chunks(signals::messages::CHUNK).enumerate() {
        let offset = (i * signals::messages::CHUNK) as u32;
        helm.handle(ToBoard::UploadChunk { offset, data: heapless::Vec::from_slice(piece).unwrap() });
    }
    helm.handle(ToBoard::UploadCommit) == ToHost::Done { crc }
}

fn in_use(helm: &mut Helm<Vault<Part>>, object: Object) -> Vec<u8> {
    let mut got = vec![];
    loop {
        match helm.handle(ToBoard::ReadBack { object, offset: got.len() as u32 }) {
            ToHost::Content { data, length, .. } if !data.is_empty() => {
                got.extend_from_slice(&data);
                if got.len() >= length as usize {
                    return got;
                }
            }
            _ => return got,
        }
    }
}

#[test]
fn a_cut_at_any_byte_of_an_upload_leaves_one_of_the_two_versions() {
    for object in [
        Object::Table(signals::Wings::Standard),
        Object::Table(signals::Wings::LowAspectRatio),
        Object::Config,
        Object::Mission,
        Object::History,
    ] {
        let [first, second] = versions(object);
        let built_in = in_use(&mut boot(&Part::new()).0, object);
        // The whole way once, without a cut: first version, second version, back to the first, back to what is built in.
        let old = Part::new();
        assert!(upload(&mut boot(&old).0, object, &first));
        let both = Part(Rc::new(RefCell::new(Chip { bytes: old.0.borrow().bytes.clone(), ..Chip::default() })));
        assert!(upload(&mut boot(&both).0, object, &second));
        assert_eq!(in_use(&mut boot(&both).0, object), second, "{object:?}");
        let back = Part(Rc::new(RefCell::new(Chip { bytes: both.0.borrow().bytes.clone(), ..Chip::default() })));
        assert!(matches!(boot(&back).0.handle(ToBoard::Rollback(object)), ToHost::Done { .. }));
        assert_eq!(in_use(&mut boot(&back).0, object), first, "{object:?}");
        assert!(matches!(boot(&back).0.handle(ToBoard::Rollback(object)), ToHost::Done { .. }));
        assert_eq!(in_use(&mut boot(&back).0, object), built_in, "{object:?}");

        for (from, back) in [(&old, false), (&both, true)] {
            let fresh = |left| Part(Rc::new(RefCell::new(Chip { bytes: from.0.borrow().bytes.clone(), left, ..Chip::default() })));
            let act = |part: &Part| {
                let mut helm = boot(part).0;
                if back {
                    matches!(helm.handle(ToBoard::Rollback(object)), ToHost::Done { .. })
                } else {
                    upload(&mut helm, object, &second)
                }
            };
            let whole = fresh(None);
            assert!(act(&whole));
            let operations = whole.0.borrow().done;
            assert!(operations >= if back { 4 } else { second.len() });
            for cut in 0..operations {
                let part = fresh(Some(cut));
                assert!(!act(&part) || back, "an upload that was cut does not say it is kept for good: {object:?}, cut at {cut}");
                part.0.borrow_mut().left = None;
                let got = in_use(&mut boot(&part).0, object);
                assert!(got == first || got == second, "{object:?}, back {back}, cut at {cut}");
            }
        }
    }
}

#[test]
fn the_log_is_read_over_the_line_byte_by_byte_as_it_lies_on_flash() {
    let part = Part::new();
    let (mut helm, _) = boot(&part);
    begin(&mut helm);
    for seq in 1..20 {
        ask(&mut helm, ToBoard::Sensor(frame(seq)));
    }
    let log = in_use(&mut helm, Object::Log);
    assert_eq!(log, part.0.borrow().bytes[2 * OBJECTS * SECTOR..]);
    let end = log.len() as u32;
    for offset in [end, end + 1, u32::MAX] {
        assert_eq!(
            helm.handle(ToBoard::ReadBack { object: Object::Log, offset }),
            ToHost::Content { offset: end, length: end, data: heapless::Vec::new() }
        );
    }
    // A board without a part keeps none; nobody can write one.
    let mut bench = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    assert_eq!(
        bench.handle(ToBoard::ReadBack { object: Object::Log, offset: 0 }),
        ToHost::Content { offset: 0, length: 0, data: heapless::Vec::new() }
    );
    assert!(!upload(&mut boot(&Part::new()).0, Object::Log, &[1, 2, 3]));
}
