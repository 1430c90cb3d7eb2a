//! Flipped bits in the RAM of the flight image in QEMU, statics and stack, while it flies: written through QEMU's gdb stub.
//!
//! A fault resets the chip, which comes up in SAFE by its mark. QEMU has no watchdog: a board that does not answer for
//! [`DEAF`] is reset by its monitor as the watchdog would, and must come up in SAFE too.

use object::{Object, ObjectSection};
use plant::World;
use rig::flight::{mission_file, worlds};
use rig::seats::qemu::{self, Qemu};
use rig::seats::{Link, Seat, SeatError};
use signals::{Mission, Phase};
use std::path::Path;
use std::time::Duration;
use tests::gdb_stub::Stub;

/// Longest wait for an answer before the watchdog's stand-in: its longest time is 23 s of the board's own, QEMU answers in a few ms.
const DEAF: Duration = Duration::from_secs(12);
/// Stack in use while the image waits, from its top down, bytes.
const STACK: u64 = 3 * 1024;
/// Cycles flown after each flip before the next one.
const CYCLES: u32 = 12;

/// RAM in use: statics by the sections of the image, and the top of the stack.
fn ram(elf: &Path) -> Vec<(u64, u64)> {
    use object::ObjectSymbol;
    let bytes = std::fs::read(elf).expect("the image");
    let file = object::File::parse(&*bytes).expect("an ELF");
    let top = file.symbol_by_name("_stack_start").expect("a stack").address();
    let statics = file.sections().filter(|s| s.address() >= top && s.address() < top + (1 << 17) && s.size() > 0);
    let mut ranges: Vec<(u64, u64)> = statics.map(|s| (s.address(), s.size())).collect();
    ranges.push((top - STACK, STACK));
    ranges
}

struct Random(u64);

impl Random {
    fn below(&mut self, below: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ z >> 31) % below
    }
}

/// What came of the flips.
#[derive(Debug, Default)]
struct Tally {
    flips: u32,
    flights: u32,
    safe: u32,
    done: u32,
    watchdog: u32,
}

/// One flight, hit again and again until it ends in SAFE or Done, at the surface.
fn flight(elf: &Path, mission: &Mission, random: &mut Random, tally: &mut Tally, most: u32) {
    let ranges = ram(elf);
    let bytes: u64 = ranges.iter().map(|r| r.1).sum();
    let mut link = Link::new(Qemu::start(elf, None).expect("QEMU")).patience(DEAF);
    let manifest = link.hello().expect("a hello");
    link.configure(&manifest, &worlds::config(mission)).expect("a configuration");
    link.begin(mission).expect("a mission");
    let mut stub = Stub::attach(link.wire());
    let mut world = World::new(worlds::for_mission(mission)).expect("a world");
    tally.flights += 1;
    let first = 3 + random.below(100);
    let (mut cycle, mut surfaced) = (0u64, 0);
    let mut told = String::new();
    loop {
        if surfaced == 0 && tally.flips < most && cycle >= first && (cycle - first).is_multiple_of(u64::from(CYCLES)) {
            let mut at = random.below(bytes);
            let range = ranges
                .iter()
                .find(|r| {
                    if at < r.1 {
                        true
                    } else {
                        at -= r.1;
                        false
                    }
                })
                .expect("inside");
            let bit = random.below(8) as u32;
            told = format!("{told} cycle {cycle}: {:#x} bit {bit};", range.0 + at);
            stub.flip(range.0 + at, bit);
            tally.flips += 1;
        }
        let frame = world.sense();
        let answer = match link.exchange(&frame) {
            Ok(answer) => answer,
            Err(SeatError::NoAnswer { .. }) => {
                tally.watchdog += 1;
                link.wire().monitor("system_reset").expect("QEMU's monitor");
                std::thread::sleep(Duration::from_millis(500));
                let answer = link.exchange(&frame).unwrap_or_else(|e| panic!("dead after the watchdog:{told} {e}"));
                assert_eq!(answer.trace.phase, Phase::Safe, "after the watchdog:{told}");
                answer
            }
            Err(e) => panic!("dead:{told} {e}"),
        };
        let truth = world.truth();
        assert!(truth.depth_m < world.scenario().vehicle.crush_depth_m, "crushed:{told}");
        surfaced = if matches!(answer.trace.phase, Phase::Safe | Phase::Done) && truth.depth_m < 1.0 { surfaced + 1 } else { 0 };
        if surfaced >= 10 {
            *(if answer.trace.phase == Phase::Safe { &mut tally.safe } else { &mut tally.done }) += 1;
            return;
        }
        assert!(cycle < 4_000, "not home:{told} {:?} at {} m", answer.trace, truth.depth_m);
        world.advance(&answer.command, 4.0);
        cycle += 1;
    }
}

fn flips(most: u32, seed: u64) {
    if !qemu::is_installed() {
        println!("skipped: no qemu-system-arm on this machine (scripts/setup-target installs it)");
        return;
    }
    let elf = match qemu::find_image() {
        Ok(elf) => elf,
        Err(e) => return println!("skipped: {e:#}"),
    };
    let mut mission = mission_file::built_in("shallow").expect("a mission");
    for leg in &mut mission.legs {
        leg.dives = 1;
    }
    let (mut random, mut tally) = (Random(seed), Tally::default());
    while tally.flips < most {
        flight(&elf, &mission, &mut random, &mut tally, most);
        println!("{tally:?}");
    }
    println!("{tally:?}: 0 not home, 0 dead");
}

#[test]
#[ignore = "half a minute: cargo test --release -p tests hil_bit_flips:: -- --ignored --nocapture"]
fn hil_flipped_bits_in_the_ram_of_the_image_end_at_home() {
    flips(16, 1);
}

#[test]
#[ignore = "some minutes: cargo test --release -p tests hil_bit_flips:: -- --ignored --nocapture"]
fn hil_five_hundred_flipped_bits_in_the_ram_of_the_image_end_at_home() {
    flips(500, 2);
}
