//! A million faults on the line: no bad frame is accepted, nothing hangs, and
//! the actuator stream is the one of a clean line, bit for bit.
//!
//! A lockstep host sends every frame until it is answered. Between it and the
//! board, and on the way back, a seeded channel drops, flips, truncates,
//! duplicates, reorders, delays, stalls mid-frame, and adds whole frames with
//! a valid CRC and an absurd content.

use crate::{Boot, Helm, RamStorage};
use control::Config;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use signals::link::{CRC32, MAX_WIRE};
use signals::{
    Answer, Counters, Micros, Mission, Object, Reading, Receiver, Reply, Request, SensorFrame, Switch, ToBoard, ToHost, WIRE_VERSION,
    Wings, decode, encode,
};
use std::collections::VecDeque;

/// Faults to inject.
const FAULTS: u64 = 1_000_000;
/// Cycles of one mission; then both sides start another, so that the law is
/// met in all its phases again and again.
const MISSION_CYCLES: u32 = 1_500;
/// Sends of one frame before the line counts as hung: with at most 3 in 4
/// sends damaged, 200 in a row are not bad luck (1e-25).
const MAX_SENDS: u32 = 200;

fn wire(session: u32, message: &ToBoard) -> Vec<u8> {
    let mut out = [0; MAX_WIRE];
    let n = encode(&Request { session, id: 7, message: message.clone() }, &mut out).unwrap();
    out[..n].to_vec()
}

fn frame(seq: u32) -> SensorFrame {
    let t = (seq % 200) as f32;
    let down = t < 100.0;
    let depth = if down { 0.3 * t } else { 0.3 * (200.0 - t) };
    SensorFrame {
        seq,
        time: Micros::from_secs(4 * u64::from(seq)),
        depth_m: Reading::now(depth),
        pitch_rad: Reading::now(if down { -0.35 } else { 0.35 }),
        roll_rad: Reading::now(0.01),
        heading_rad: Reading::now(1.0),
        ballast_m3: Reading::now(if down { -2e-4 } else { 2e-4 }),
        battery_mass_m: Reading::now(0.0),
        fin_rad: Reading::now(0.0),
        density_kg_m3: Reading::now(1025.0),
        temperature_degc: Reading::now(12.0),
        battery_v: Reading::now(14.5),
        charge: Reading::now(0.9),
        vacuum_pa: Reading::now(70_000.0),
        leak: Switch::Clear,
        ..SensorFrame::default()
    }
}

fn started() -> (Helm<RamStorage>, u32) {
    let mut helm = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    let ToHost::Hello { session, .. } = helm.handle(ToBoard::Hello { nonce: 5 }) else { panic!("no hello") };
    assert!(matches!(helm.handle(ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    (helm, session)
}

/// Order-dependent hash of a stream of answers, from the bytes on the wire.
fn hash(sum: u32, answer: &Answer) -> u32 {
    let mut out = [0; MAX_WIRE];
    let n = encode(&ToHost::Answer(*answer), &mut out).unwrap();
    let mut digest = CRC32.digest();
    digest.update(&sum.to_le_bytes());
    digest.update(&out[..n]);
    digest.finalize()
}

/// A frame with a right CRC and a wrong content.
fn absurd(rng: &mut ChaCha8Rng, session: u32, seq: u32) -> Vec<u8> {
    let message = match rng.next_u32() % 11 {
        0 => ToBoard::Sensor(SensorFrame { depth_m: Reading::now(f32::NAN), ..frame(seq.wrapping_sub(1 + rng.next_u32() % 1000)) }),
        1 => ToBoard::Sensor(SensorFrame { depth_m: Reading::now(1e38), ..frame(seq.wrapping_add(5000 + rng.next_u32() % 1_000_000)) }),
        9 => ToBoard::Hello { nonce: 5 + rng.next_u32() % 3 },
        10 => return wire(session ^ 1 << (rng.next_u32() % 32), &ToBoard::Sensor(frame(seq.wrapping_add(1)))), // of another session
        2 => ToBoard::Sensor(SensorFrame { time: Micros(u64::MAX), ..frame(seq) }), // another frame under a number already used
        3 => ToBoard::Begin(Mission { max_duration_s: u32::MAX, ..Mission::default() }),
        4 => ToBoard::UploadBegin { object: Object::Table(Wings::Standard), length: u32::MAX, crc: 0 },
        5 => ToBoard::UploadChunk { offset: u32::MAX, data: heapless::Vec::from_slice(&[0xff; 128]).unwrap() },
        6 => ToBoard::ReadBack { object: Object::Config, offset: u32::MAX },
        7 => {
            let mut raw = vec![WIRE_VERSION];
            raw.extend((0..rng.next_u32() % 60).map(|_| rng.next_u32() as u8 | 0x80)); // no such message
            return framed(raw);
        }
        _ => return framed(vec![WIRE_VERSION.wrapping_add(1 + (rng.next_u32() % 200) as u8), 2, 3]),
    };
    wire(session, &message)
}

fn framed(mut raw: Vec<u8>) -> Vec<u8> {
    let crc = CRC32.checksum(&raw);
    raw.extend(crc.to_le_bytes());
    let mut out = vec![0; raw.len() + 8];
    let n = cobs::encode(&raw, &mut out);
    out.truncate(n);
    out.push(0);
    out
}

/// One direction of the line.
struct Channel {
    session: u32,
    rng: ChaCha8Rng,
    /// Frames held back, with the number of sends until they come.
    late: VecDeque<(u32, Vec<u8>)>,
    faults: u64,
}

impl Channel {
    /// What arrives when `bytes` are sent.
    fn pass(&mut self, bytes: Vec<u8>, absurd_seq: Option<u32>) -> Vec<u8> {
        let mut out = Vec::new();
        for held in &mut self.late {
            held.0 = held.0.saturating_sub(1);
        }
        while self.late.front().is_some_and(|(wait, _)| *wait == 0) {
            out.extend(self.late.pop_front().unwrap().1);
        }
        let kind = self.rng.next_u32() % 11;
        if kind < 9 {
            self.faults += 1;
        }
        let at = self.rng.next_u32() as usize % bytes.len();
        match kind {
            0 => {}
            1 => {
                let mut b = bytes;
                for _ in 0..=self.rng.next_u32() % 4 {
                    let i = self.rng.next_u32() as usize % b.len();
                    b[i] ^= 1 << (self.rng.next_u32() % 8);
                }
                out.extend(b);
            }
            2 => out.extend(&bytes[..at]), // the delimiter is lost too
            3 => {
                out.extend(&bytes);
                out.extend(&bytes);
            }
            4 => self.late.push_back((1, bytes)), // comes after the next
            5 => self.late.push_back((2 + self.rng.next_u32() % 20, bytes)),
            6 => {
                // Stalls mid-frame; the rest comes with a later send.
                out.extend(&bytes[..at]);
                self.late.push_back((1, bytes[at..].to_vec()));
            }
            7 | 8 => {
                let extra = match absurd_seq {
                    Some(seq) if kind == 7 => absurd(&mut self.rng, self.session, seq),
                    _ => (0..1 + self.rng.next_u32() % 500).map(|_| self.rng.next_u32() as u8).collect(),
                };
                out.extend(extra);
                out.extend(bytes);
            }
            _ => out.extend(bytes),
        }
        out
    }
}

#[test]
fn a_million_link_faults_change_no_actuator_command() {
    let channel = |seed: u8| Channel { session: 0, rng: ChaCha8Rng::from_seed([seed; 32]), late: VecDeque::new(), faults: 0 };
    let (mut there, mut back) = (channel(1), channel(2));
    let ((mut board, mut session), (mut clean, _)) = (started(), started());
    let mut host = Receiver::new();
    let (mut sum, mut clean_sum) = (0, 0);
    let mut refused_before = vec![];
    let (mut cycles, mut sends, mut worst_sends) = (0u32, 0u64, 0u32);
    while there.faults + back.faults < FAULTS {
        let seq = cycles % MISSION_CYCLES;
        if seq == 0 {
            refused_before.push(board.counters());
            ((board, session), (clean, _)) = (started(), started());
            there.session = session;
            (there.late, back.late) = (VecDeque::new(), VecDeque::new());
        }
        let message = ToBoard::Sensor(frame(seq));
        let ToHost::Answer(expected) = clean.handle(message.clone()) else { panic!("clean line, frame {seq}") };
        clean_sum = hash(clean_sum, &expected);
        let mut tries = 0;
        let answer = 'sent: loop {
            tries += 1;
            assert!(tries < MAX_SENDS, "frame {seq} was never answered");
            let arrived = there.pass(wire(session, &message), (seq > 0).then(|| seq - 1));
            let mut heard = None;
            for byte in arrived {
                let Some(said) = board.byte(byte) else { continue };
                let mut out = [0; MAX_WIRE];
                let n = encode(&said, &mut out).unwrap();
                for byte in back.pass(out[..n].to_vec(), None) {
                    if let Some(Ok(Reply { message: ToHost::Answer(a), .. })) = host.push::<Reply>(byte)
                        && a.command.seq == seq
                    {
                        heard = Some(a);
                    }
                }
            }
            if let Some(a) = heard {
                break 'sent a;
            }
        };
        assert_eq!(answer, expected, "frame {seq}");
        sum = hash(sum, &answer);
        sends += u64::from(tries);
        worst_sends = worst_sends.max(tries);
        cycles += 1;
    }
    assert_eq!(sum, clean_sum);
    let total = |of: fn(&Counters) -> u32| refused_before.iter().map(|c| u64::from(of(c))).sum::<u64>();
    let refused = [
        ("damaged", total(|c| c.damaged)),
        ("version", total(|c| c.version)),
        ("unknown", total(|c| c.unknown)),
        ("overflow", total(|c| c.overflow)),
        ("repeated", total(|c| c.repeated)),
        ("stale", total(|c| c.stale)),
    ];
    println!(
        "{} faults in {cycles} cycles, {sends} sends (at most {worst_sends} of one frame); refused: {refused:?}; actuator hash {sum:08x}",
        there.faults + back.faults
    );
    for (what, count) in refused {
        assert!(count > 0, "the channel made nothing {what}");
    }
}

#[test]
fn the_line_is_read_from_the_middle_of_a_frame_on() {
    let bytes = wire(started().1, &ToBoard::Sensor(frame(1)));
    for start in 1..bytes.len() {
        let (mut helm, _) = started();
        let answers = bytes[start..].iter().chain(&bytes).chain(&bytes).filter_map(|b| helm.byte(*b)).count();
        assert_eq!(answers, 2, "joined at byte {start}");
    }
}

#[test]
fn a_flood_of_anything_is_one_bounded_answer_per_frame_at_most() {
    let (mut helm, session) = started();
    let mut rng = ChaCha8Rng::from_seed([9; 32]);
    let mut delimiters = 0u32;
    let mut answers = 0u32;
    for _ in 0..2_000_000 {
        let byte = rng.next_u32() as u8;
        delimiters += u32::from(byte == 0);
        answers += u32::from(helm.byte(byte).is_some());
    }
    assert_eq!(answers, 0, "noise is not answered");
    assert!(helm.counters().damaged > 0 && helm.counters().damaged <= delimiters);
    let bytes = wire(session, &ToBoard::Sensor(frame(1)));
    let after = [0].iter().chain(&bytes).filter_map(|b| helm.byte(*b)).count();
    assert_eq!(after, 1, "the next frame after the flood is read");
    assert!(decode::<Request>(&mut bytes.clone()[..bytes.len() - 1]).is_ok());
}
