//! Sixty days, and clocks that start 30 s before both 32-bit wraps: the same
//! commands as from zero, bit for bit. Other vehicles broke at 71.6 min (2^32
//! µs) and 49.7 days (2^32 ms).

use super::toy::Toy;
use crate::{Boot, Helm, RamStorage};
use control::Config;
use signals::link::CRC32;
use signals::{Leg, Micros, Mission, Phase, ToBoard, ToHost};

const CYCLE_S: u64 = 4;

/// What a flight of `cycles` came to, and the phases' hash and dives.
fn fly(start: Micros, mission: &Mission, cycles: u32) -> (u32, u16, Phase, Option<signals::Abort>) {
    let mut helm = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    helm.handle(ToBoard::Hello { nonce: 1 });
    assert!(matches!(helm.handle(ToBoard::Begin(mission.clone())), ToHost::Ready { .. }));
    let mut toy = Toy::new(500.0); // 0.12 m/s at full drive
    let mut digest = CRC32.digest();
    let mut end = (0, Phase::Surface, None);
    for seq in 0..cycles {
        let time = start.plus(Micros::from_secs(CYCLE_S * u64::from(seq)));
        let ToHost::Answer(answer) = helm.handle(ToBoard::Sensor(toy.frame(seq, time))) else { panic!("frame {seq}") };
        let c = &answer.command;
        for number in [c.ballast_m3, c.battery_mass_m, c.fin_rad] {
            digest.update(&number.to_bits().to_le_bytes());
        }
        digest.update(&[u8::from(c.drop_weight), u8::from(c.beacon), answer.trace.phase as u8]);
        toy.obey(c);
        end = (answer.trace.dives, answer.trace.phase, answer.trace.abort);
    }
    (digest.finalize(), end.0, end.1, end.2)
}

#[test]
fn a_boot_30_s_before_either_wrap_flies_like_one_from_zero() {
    let mission = Mission::default();
    let cycles = 1200;
    let zero = fly(Micros(0), &mission, cycles);
    assert_eq!((zero.1, zero.3), (4, None), "the toy completes the mission: {zero:?}");
    for (what, wrap_us) in [("ms", (1u64 << 32) * 1000), ("us", 1 << 32), ("nothing: half of all time", u64::MAX / 2)] {
        let start = Micros(wrap_us - 30_000_000);
        assert_eq!(fly(start, &mission, cycles), zero, "through the wrap of 32 bits of {what}");
    }
}

#[test]
fn sixty_days_of_dives_end_as_planned() {
    let leg = Leg { dives: 700, depth_max_m: 150.0, ..Leg::default() };
    let mission =
        Mission { legs: heapless::Vec::from_slice(&[leg]).unwrap(), max_duration_s: 60 * 86_400, surface_every: 4, ..Mission::default() };
    let cycles = 60 * 86_400 / CYCLE_S as u32;
    // As many dives as a slow glide makes in that time: more are refused.
    let (_, dives, phase, abort) = fly(Micros::from_millis((1 << 32) - 30_000), &mission, cycles - 10);
    assert_eq!((dives, phase, abort), (700, Phase::Done, None));
}
