//! One flipped bit anywhere in the controller's memory, at any time of a flight: it comes home and is never deaf.
//!
//! Between two steps, where a controller rests 99.9 % of its time. The glider is a toy that does what it is told; `tests/bit_flips.rs`
//! of the workspace flies the same through the simulated sea.
#![allow(unsafe_code)]

use control::Config;
use helm::{Boot, Helm, RamStorage, Storage};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use signals::{
    Abort, ActuatorCommand, Answer, Leg, Micros, Mission, Object, Phase, Reading, Refusal, Request, SensorFrame, Surface, Switch, ToBoard,
    ToHost, Wings,
};

/// Memory of the controller, bits.
const BITS: u64 = 8 * size_of::<Helm<RamStorage>>() as u64;
/// Cycles of a flight: a dive, and the way home.
const CYCLES: u32 = 260;

const CYCLE_S: u64 = 4;

/// A glider that does what it is told: slew-limited actuators, pitch by the
/// trim law, 0.2 m/s at full drive.
struct Toy {
    depth_m: f32,
    pitch_rad: f32,
    ballast_m3: f32,
    battery_m: f32,
}

impl Toy {
    fn frame(&self, seq: u32, time: Micros) -> SensorFrame {
        let afloat = self.depth_m < 0.5;
        SensorFrame {
            seq,
            time,
            depth_m: Reading::now(self.depth_m),
            pitch_rad: Reading::now(self.pitch_rad),
            roll_rad: Reading::now(0.01),
            heading_rad: Reading::now(0.02),
            ballast_m3: Reading::now(self.ballast_m3),
            battery_mass_m: Reading::now(self.battery_m),
            fin_rad: Reading::now(0.0),
            density_kg_m3: Reading::now(1025.0),
            battery_v: Reading::now(14.5),
            charge: Reading::now(0.9),
            vacuum_pa: Reading::now(70_000.0),
            leak: Switch::Clear,
            surface: Surface { gps_fix: afloat, comms: afloat },
            ..SensorFrame::default()
        }
    }

    fn obey(&mut self, command: &ActuatorCommand) {
        let go = |at: f32, to: f32, most: f32| at + (to - at).clamp(-most, most);
        self.ballast_m3 = go(self.ballast_m3, command.ballast_m3, 52e-6);
        self.battery_m = go(self.battery_m, command.battery_mass_m, 10e-3);
        self.pitch_rad = 1785.0 * self.ballast_m3 - 24.0 * self.battery_m;
        self.depth_m = (self.depth_m - 4.0 * 870.0 * self.ballast_m3).max(0.1);
    }
}

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
    let mut toy = Toy { depth_m: 0.1, pitch_rad: 0.0, ballast_m3: 230e-6, battery_m: 0.0 };
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
