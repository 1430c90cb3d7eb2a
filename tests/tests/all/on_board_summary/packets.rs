//! A packet comes back to its steps; what is not finite or no dive can give is refused.

use evidence::factor::WIDTH;
use evidence::packet::Refused;
use evidence::{NUMBERS, PACKET_BYTES, Packet};
use proptest::prelude::*;

fn packet(numbers: &[f32], powers: &[i32]) -> Packet {
    let mut lines = [[0.0; WIDTH]; NUMBERS];
    let mut next = numbers.iter();
    for (i, line) in lines.iter_mut().enumerate() {
        line.iter_mut().skip(i).for_each(|x| *x = next.next().unwrap() * 2f64.powi(powers[i]) as f32);
    }
    Packet {
        vehicle_id: 0x1234_5678,
        start_s: 86_400,
        duration_s: 10_800,
        rows: 240,
        climbing: 110,
        refused: 3,
        blocks: 12,
        directions: 48,
        scatter: 3.25e-4,
        variance: 1.5e-5,
        pitch_rad: 0.4537,
        roll_rad: 0.031,
        drive_m3: 215.3e-6,
        deepest_pa: 1.893e6,
        lines,
    }
}

proptest! {
    #[test]
    fn prop_numbers_come_back_to_half_a_step_of_their_row(
        numbers in prop::collection::vec(-1f32..1.0, 44),
        powers in prop::collection::vec(-40i32..40, 8),
    ) {
        let sent = packet(&numbers, &powers);
        let read = Packet::decode(&sent.encode().unwrap()).unwrap();
        for (i, (a, b)) in sent.lines.iter().zip(&read.lines).enumerate() {
            let largest = a.iter().fold(0f32, |m, x| m.max(x.abs()));
            // The next power of two over the largest, in 2047 steps: at most a step of 1/1023 of it.
            for (a, b) in a.iter().zip(b) {
                prop_assert!((a - b).abs() <= largest * (0.5 / 1023.0), "row {} {} {}", i, a, b);
            }
        }
        prop_assert!((read.pitch_rad - sent.pitch_rad).abs() < 1e-6 && (read.drive_m3 - sent.drive_m3).abs() < 1e-9);
        let (pitch_rad, drive_m3) = (sent.pitch_rad, sent.drive_m3);
        prop_assert_eq!(Packet { lines: sent.lines, pitch_rad, drive_m3, ..read }, sent);
    }

    #[test]
    fn prop_any_bytes_are_a_sound_packet_or_refused(bytes in prop::collection::vec(any::<u8>(), PACKET_BYTES)) {
        if let Ok(read) = Packet::decode(bytes.as_slice().try_into().unwrap()) {
            prop_assert!(read.lines.iter().flatten().chain([&read.scatter, &read.variance]).all(|x| x.is_finite()));
            prop_assert!(read.encode().is_some());
        }
    }
}

#[test]
fn what_is_not_finite_or_no_dive_can_give_is_refused() {
    let good = packet(&[0.5; 44], &[0; 8]);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut lines = good.lines;
        lines[2][5] = bad;
        let all = [
            Packet { lines, ..good },
            Packet { scatter: bad, ..good },
            Packet { variance: bad, ..good },
            Packet { pitch_rad: bad, ..good },
            Packet { drive_m3: bad, ..good },
            Packet { deepest_pa: bad, ..good },
        ];
        assert!(all.iter().all(|p| p.encode().is_none()), "{bad}");
    }
    assert!(Packet { climbing: 241, ..good }.encode().is_none() && Packet { directions: 49, ..good }.encode().is_none());
    let bytes = good.encode().unwrap();
    // An exponent beyond all rows, the one mantissa that no number has, a scatter that is none.
    for (at, value) in [(35, 255), (35, 187), (43, 0), (19, 0)] {
        let mut other = bytes;
        other[at] = value;
        match at {
            43 => other[44] = (other[44] & 0xf0) | 8,
            19 => other[19..23].copy_from_slice(&f32::NAN.to_le_bytes()),
            _ => {}
        }
        assert_eq!(Packet::decode(&other), Err(Refused::Content), "{at} {value}");
    }
}

#[test]
fn an_empty_packet_comes_back() {
    let none = Packet::default();
    assert_eq!(Packet::decode(&none.encode().unwrap()), Ok(none));
}
