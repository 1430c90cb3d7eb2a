//! One flipped bit anywhere in the controller's memory, at any time of a flight: it comes home and is never deaf.
//!
//! Between two steps, where a controller rests 99.9 % of its time. The glider is a toy that does what it is told; `tests/bit_flips.rs`
//! of the workspace flies the same through the simulated sea.
#![allow(unsafe_code)]

use super::toy::Toy;
use crate::{Boot, Helm, RamStorage, Storage};
use control::Config;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use signals::{Abort, Answer, Leg, Micros, Mission, Object, Phase, Refusal, Request, ToBoard, ToHost, Wings};

/// Memory of the controller, bits.
const BITS: u64 = 8 * size_of::<Helm<RamStorage>>() as u64;
/// Cycles of a flight: a dive, and the way home.
const CYCLES: u32 = 260;

const CYCLE_S: u64 = 4;

fn flip(helm: &mut Helm<RamStorage>, bit: u64) {
    let byte = (&raw mut *helm).cast::<u8>().wrapping_add((bit / 8) as usize);
    // SAFETY: inside the value. What it makes of its fields is what is tested: nothing may look at them as such before the seal.
    unsafe { byte.write_volatile(byte.read_volatile() ^ 1 << (bit % 8)) };
}

fn hello(helm: &mut Helm<RamStorage>) -> u32 {
    match helm.request(Request { session: 0, id: 0, message: ToBoard::Hello { nonce: 1 } }).message {
        ToHost::Hello { session, .. } => session,
        other => panic!("no hello: {other:?}"),
    }
}

/// The last answer of a flight in which `bit` is flipped before cycle `at`, and the depth then.
fn fly(at: u32, bit: u64) -> (Answer, f32) {
    let mut helm = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    helm.storage().save(Object::Table(Wings::Standard), polar::generated::STANDARD).unwrap();
    let mut session = hello(&mut helm);
    let mission = Mission { legs: heapless::Vec::from_slice(&[Leg { dives: 1, ..Leg::default() }]).unwrap(), ..Mission::default() };
    assert!(matches!(helm.request(Request { session, id: 1, message: ToBoard::Begin(mission) }).message, ToHost::Ready { .. }));
    let mut toy = Toy::new(870.0); // 0.2 m/s at full drive
    let mut last = Answer::default();
    for seq in 0..CYCLES {
        if seq == at {
            flip(&mut helm, bit);
        }
        let message = ToBoard::Sensor(toy.frame(seq, Micros::from_secs(CYCLE_S * u64::from(seq))));
        let mut reply = helm.request(Request { session, id: 2, message: message.clone() }).message;
        if reply == ToHost::Refused(Refusal::Session) {
            session = hello(&mut helm);
            reply = helm.request(Request { session, id: 3, message }).message;
        }
        let ToHost::Answer(answer) = reply else { panic!("dead: cycle {at}, bit {bit} of {BITS}: {reply:?} in cycle {seq}") };
        toy.obey(&answer.command);
        last = answer;
    }
    (last, toy.depth_m)
}

fn flips(count: u32, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut done, mut safe) = (0, 0);
    for _ in 0..count {
        // In flight: one that is hit while armed on deck forgets its mission and says so.
        let (at, bit) = (1 + rng.next_u32() % (CYCLES - 1), u64::from(rng.next_u32()) % BITS);
        let (last, depth_m) = fly(at, bit);
        assert!(depth_m < 1.0, "not home: cycle {at}, bit {bit} of {BITS}: {last:?}");
        match (last.trace.phase, last.trace.abort) {
            (Phase::Done, None) => done += 1,
            (Phase::Safe, Some(Abort::Internal)) => safe += 1,
            other => panic!("cycle {at}, bit {bit} of {BITS}: {other:?}"),
        }
    }
    println!("{count} flips over {} bytes and {CYCLES} cycles: {done} missions done, {safe} in SAFE; 0 not home, 0 dead", BITS / 8);
    assert!(done > 0 && safe > 0);
}

#[test]
fn prop_ten_thousand_flipped_bits_in_flight_end_at_home() {
    let (last, depth_m) = fly(u32::MAX, 0);
    assert_eq!((last.trace.phase, depth_m < 1.0), (Phase::Done, true), "the toy's mission ends within {CYCLES} cycles: {last:?}");
    flips(10_000, 1);
}
