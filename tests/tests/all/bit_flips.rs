//! One flipped bit anywhere in the controller's memory, at any time of a flight: the vehicle comes home and is never deaf.
//!
//! Here in this process, between two steps, where a controller rests; `hil_bit_flips.rs` does it to the image in QEMU.
#![allow(unsafe_code)]

use helm::{Helm, RamStorage};
use plant::World;
use rig::flight::closed_loop::{End, Setup, fly};
use rig::flight::{mission_file, worlds};
use rig::seats::in_process::InProcess;
use rig::seats::{Link, Seat, SeatError};
use signals::{Abort, Answer, Manifest, Mission, SensorFrame, Wings};
use std::collections::BTreeMap;

/// Memory of the controller, bits.
const BITS: u64 = 8 * size_of::<Helm<RamStorage>>() as u64;

/// A seat whose controller is hit once.
struct Hit {
    link: Link<InProcess>,
    cycle: u64,
    at: u64,
    bit: u64,
}

fn flip(helm: &mut Helm<RamStorage>, bit: u64) {
    let byte = (&raw mut *helm).cast::<u8>().wrapping_add((bit / 8) as usize);
    // SAFETY: inside the value. What it makes of its fields is what is tested: nothing may look at them as such before the seal.
    unsafe { byte.write_volatile(byte.read_volatile() ^ 1 << (bit % 8)) };
}

impl Seat for Hit {
    fn hello(&mut self) -> Result<Manifest, SeatError> {
        self.link.hello()
    }
    fn configure(&mut self, manifest: &Manifest, config: &control::Config) -> Result<(), SeatError> {
        self.link.configure(manifest, config)
    }
    fn tabulate(&mut self, wings: Wings, table: &[u8]) -> Result<(), SeatError> {
        self.link.tabulate(wings, table)
    }
    fn recover(&mut self) -> Result<(), SeatError> {
        self.link.recover()
    }
    fn begin(&mut self, mission: &Mission) -> Result<u32, SeatError> {
        self.link.begin(mission)
    }
    fn exchange(&mut self, frame: &SensorFrame) -> Result<Answer, SeatError> {
        if self.cycle == self.at {
            flip(self.link.wire().board().helm(), self.bit);
        }
        self.cycle += 1;
        self.link.exchange(frame)
    }
    fn recall(&mut self) -> Result<(), SeatError> {
        self.link.recall()
    }
    fn reset(&mut self) -> Result<(), SeatError> {
        self.link.reset()
    }
    fn describe(&self) -> String {
        format!("hit in cycle {} at bit {}", self.at, self.bit)
    }
}

/// A dive of the shallow mission, and home.
fn mission() -> Mission {
    let mut mission = mission_file::built_in("shallow").unwrap();
    for leg in &mut mission.legs {
        leg.dives = 1;
    }
    mission
}

fn flown(mission: &Mission, at: u64, bit: u64) -> (End, u64) {
    let mut seat = Hit { link: Link::new(InProcess::default()), cycle: 0, at, bit };
    // The uploaded table is in memory as well.
    seat.hello().unwrap();
    seat.tabulate(Wings::Standard, polar::generated::STANDARD).unwrap();
    let mut world = World::new(worlds::for_mission(mission)).unwrap();
    match fly(&mut world, &mut seat, &Setup::new(mission.clone()), &mut |_| Ok(())) {
        Ok(out) => (out.end, out.cycles),
        Err(e) => panic!("dead: {}: {e}", seat.describe()),
    }
}

fn flips(count: u64, seed: u64) {
    let mission = mission();
    let (end, cycles) = flown(&mission, u64::MAX, 0);
    assert_eq!(end, End::Done);
    let mut ends: BTreeMap<String, u32> = BTreeMap::new();
    let mut random = seed;
    let mut next = |below: u64| {
        // SplitMix64 (Steele et al. 2014).
        random = random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (random ^ random >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ z >> 31) % below
    };
    for _ in 0..count {
        // In flight: one that is hit while armed on deck forgets its mission and says so.
        let (at, bit) = (1 + next(cycles - 1), next(BITS));
        let (end, _) = flown(&mission, at, bit);
        assert!(end.home(), "cycle {at}, bit {bit} of {BITS}: {end}");
        assert!(matches!(end, End::Done | End::Safe(Some(Abort::Internal))), "cycle {at}, bit {bit} of {BITS}: {end}");
        *ends.entry(end.to_string()).or_default() += 1;
    }
    println!("{count} flips over {} bytes and {cycles} cycles: {ends:?}; 0 not home, 0 dead", BITS / 8);
    assert!(ends.len() == 2, "some flips find the seal, some hit nothing: {ends:?}");
}

#[test]
fn prop_a_flipped_bit_in_flight_ends_at_home() {
    flips(400, 1);
}

#[test]
#[ignore = "a minute or two: cargo test --release -p tests prop_ten_thousand -- --ignored --nocapture"]
fn prop_ten_thousand_flipped_bits_in_flight_end_at_home() {
    flips(10_000, 2);
}
