//! The detector on board: its factors against f64, its run length in healthy surfacings, what it needs to alarm, what it refuses.

use evidence::detector::{RUN_LENGTH, factors};
use evidence::factor::WIDTH;
use evidence::{Detector, History, NUMBERS, Packet};
use proptest::prelude::*;

/// Repeatable noise of variance 1, nearly normal: a sum of twelve uniform numbers.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

const LEVEL: f32 = 4e-4;

/// A history whose numbers scatter by a tenth of a size, the last two together.
fn history() -> History {
    let mut spread = [[0.0; NUMBERS]; NUMBERS];
    (0..NUMBERS).for_each(|i| spread[i][i] = 0.1);
    spread[7][0] = -0.06;
    History { vehicle_id: 7, usual_level: LEVEL, mean: [0.3, -0.2, 0.0, 0.1, 0.0, 0.2, 0.0, -0.1], spread }
}

/// The packet of a surfacing whose numbers are `at`, with noise of the usual level.
fn packet(at: &[f64; NUMBERS], noise: &mut Noise) -> Packet {
    let mut lines = [[0.0; WIDTH]; NUMBERS];
    for (i, line) in lines.iter_mut().enumerate() {
        let r: [f64; NUMBERS] = std::array::from_fn(|k| match k {
            k if k == i => [0.4, 0.3, 0.1, 0.05, 0.2, 0.1, 0.05, 0.03][i],
            k if k > i => 0.05 * f64::from(i as u8 + 2) / f64::from(k as u8 + 2),
            _ => 0.0,
        });
        line.iter_mut().zip(r).for_each(|(to, r)| *to = r as f32);
        line[NUMBERS] = (r.iter().zip(at).map(|(r, x)| r * x).sum::<f64>() + f64::from(LEVEL).sqrt() * noise.next()) as f32;
    }
    // So many directions of the usual scatter that the level is the usual one.
    Packet {
        vehicle_id: 7,
        rows: 200,
        climbing: 100,
        directions: 1004,
        scatter: 1000.0 * LEVEL,
        variance: 1e-6,
        lines,
        ..Packet::default()
    }
}

/// Numbers of a healthy surfacing.
fn healthy(history: &History, noise: &mut Noise) -> [f64; NUMBERS] {
    let z: [f64; NUMBERS] = std::array::from_fn(|_| noise.next());
    std::array::from_fn(|i| f64::from(history.mean[i]) + (0..=i).map(|k| f64::from(history.spread[i][k]) * z[k]).sum::<f64>())
}

/// ln of the normal density of r with covariance v but for a constant, by elimination in f64.
fn ln_density(mut v: [[f64; NUMBERS]; NUMBERS], mut r: [f64; NUMBERS]) -> f64 {
    let mut out = 0.0;
    for k in 0..NUMBERS {
        out -= 0.5 * (v[k][k].ln() + r[k] * r[k] / v[k][k]);
        for i in k + 1..NUMBERS {
            let share = v[i][k] / v[k][k];
            r[i] -= share * r[k];
            let pivot = v[k];
            (0..NUMBERS).for_each(|j| v[i][j] -= share * pivot[j]);
        }
    }
    out
}

#[test]
fn accuracy_factors_are_ratios_of_likelihoods() {
    let (history, mut noise) = (history(), Noise(1));
    for number in 0..NUMBERS {
        let mut at = healthy(&history, &mut noise);
        at[number] += 0.6;
        let packet = packet(&at, &mut noise);
        let r = |i: usize, k: usize| f64::from(packet.lines[i][k]);
        let left = std::array::from_fn(|i| r(i, NUMBERS) - (0..NUMBERS).map(|k| r(i, k) * f64::from(history.mean[k])).sum::<f64>());
        let root = |i: usize, k: usize| (0..NUMBERS).map(|j| r(i, j) * f64::from(history.spread[j][k])).sum::<f64>();
        let v = |free: Option<usize>| {
            std::array::from_fn(|i| {
                std::array::from_fn(|k| {
                    let own = if i == k { f64::from(LEVEL) } else { 0.0 };
                    own + (0..NUMBERS).map(|j| root(i, j) * root(k, j)).sum::<f64>() + free.map_or(0.0, |n| r(i, n) * r(k, n))
                })
            })
        };
        let null = ln_density(v(None), left);
        for (i, factor) in factors(&history, &packet).into_iter().enumerate() {
            let ln = (ln_density(v(Some(i)), left) - null).min(25.0);
            assert!((f64::from(factor).ln() - ln).abs() < 0.01 + 1e-3 * ln.abs(), "{i}: {} {ln}", f64::from(factor).ln());
        }
    }
}

#[test]
fn accuracy_healthy_surfacings_to_an_alarm_are_no_fewer_than_stated() {
    let (history, mut noise) = (history(), Noise(5));
    let (mut detector, mut alarms) = (Detector::new(), 0);
    let surfacings = 60_000;
    for _ in 0..surfacings {
        let at = healthy(&history, &mut noise);
        alarms += usize::from(detector.take(&history, &packet(&at, &mut noise)));
    }
    let stated = surfacings as f64 / f64::from(RUN_LENGTH);
    eprintln!("{alarms} alarms in {surfacings} healthy surfacings, at most {stated} stated in the mean");
    // Of 200 or fewer more than 250 have a probability below 1e-3.
    assert!((alarms as f64) < stated + 50.0, "{alarms}");
}

#[test]
fn half_as_much_drag_again_is_an_alarm_in_the_first_or_second_surfacing() {
    let (history, mut noise) = (history(), Noise(9));
    for _ in 0..200 {
        let mut detector = Detector::new();
        assert!((0..5).all(|_| !detector.take(&history, &packet(&healthy(&history, &mut noise), &mut noise))));
        let mut fouled = || {
            let mut at = healthy(&history, &mut noise);
            at[0] += 1.5_f64.ln() / 0.3;
            packet(&at, &mut noise)
        };
        assert!([fouled(), fouled()].iter().any(|p| detector.take(&history, p)));
    }
    // What is no number is no evidence.
    let mut broken = packet(&[0.0; NUMBERS], &mut noise);
    for bad in [f32::NAN, f32::INFINITY] {
        broken.lines[3][NUMBERS] = bad;
        assert!(!Detector::new().take(&history, &broken), "{:?}", factors(&history, &broken));
    }
    // Packets of other constants say nothing.
    let other = Packet { vehicle_id: 8, ..packet(&[9.0; NUMBERS], &mut noise) };
    let mut detector = Detector::new();
    assert!((0..9).all(|_| !detector.take(&history, &other)) && detector == Detector::new());
}

#[test]
fn a_history_comes_back_and_a_damaged_one_is_refused() {
    let bytes = history().encode().expect("sound");
    assert_eq!(History::decode(&bytes), Some(history()));
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(History::decode(&damaged), None, "bit {bit}");
    }
    assert_eq!(History::decode(&bytes[..191]), None);
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut off = history();
        off.spread[7][0] = bad;
        assert_eq!(off.encode(), None);
        assert_eq!(History { mean: [bad; NUMBERS], ..history() }.encode(), None);
        assert_eq!(History { usual_level: bad, ..history() }.encode(), None);
    }
}

proptest! {
    #[test]
    fn prop_whatever_a_packet_says_the_odds_are_numbers(
        numbers in prop::collection::vec(prop_oneof![-1e15f32..1e15, -1f32..1.0, Just(0.0), -1e-30f32..1e-30], 72),
        (scatter, variance, directions) in (0f32..1e12, 0f32..1e12, any::<u16>()),
        mean in prop::array::uniform8(-100f32..100.0),
    ) {
        let mut lines = [[0.0; WIDTH]; NUMBERS];
        let mut next = numbers.iter();
        lines.iter_mut().flatten().for_each(|x| *x = *next.next().unwrap());
        let history = History { mean, ..history() };
        let packet = Packet { vehicle_id: 7, scatter, variance, directions, lines, ..Packet::default() };
        let mut detector = Detector::new();
        for _ in 0..3 {
            prop_assert!(factors(&history, &packet).iter().all(|f| *f >= 0.0 && f.is_finite()), "{:?}", factors(&history, &packet));
            detector.take(&history, &packet);
        }
    }
}
