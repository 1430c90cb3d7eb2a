//! Damaged, swapped, doubled, lost and late bytes: no hang, nothing believed or ordered out of its range or rate.

use super::bench::{Bench, line};
use crate::sensors::List;
use proptest::prelude::*;
use signals::{Reading, SensorFrame};

/// What is said of a frame's field in the list's units, and what the line's gate promises of it: range, rate per second, step.
type Field = (fn(&SensorFrame) -> Reading, f32, f32, f32, f32);

const BAR: f32 = 1e5 / (1025.0 * 9.81);
const FIELDS: [Field; 10] = [
    (|f| f.depth_m, -10.0, 1200.0, 2.0, 2.0),
    (|f| f.depth2_m, -1.001 * BAR, 125.01 * BAR, 0.2001 * BAR, 0.2001 * BAR),
    (|f| f.pitch_rad, -1.6, 1.6, 0.3, 0.1),
    (|f| f.roll_rad, -3.2, 3.2, 0.5, 0.3),
    (|f| f.ballast_m3, -321e-6, 321e-6, 50.1e-6, 10.1e-6),
    (|f| f.battery_mass_m, -1.701 * 0.0254, 1.701 * 0.0254, 0.2501 * 0.0254, 0.1001 * 0.0254),
    (|f| f.fin_rad, -0.6, 0.6, 0.5, 0.1),
    (|f| f.battery_v, 0.0, 60.0, 2.0, 4.0),
    (|f| f.vacuum_pa, 0.0, 118_300.0, 1_694.0, 3_388.0),
    (|f| f.temperature_degc, -5.0, 45.0, 2.0, 2.0),
];
/// Beyond this the gate stays as wide as it is, s.
const LONGEST_GAP_S: f32 = 20.0;

/// What was believed last of a field, when it was sampled, and how many new levels there had been.
#[derive(Clone, Copy)]
struct Believed(f32, u64, u32);

fn judge(bench: &Bench, believed: &mut [Option<Believed>; FIELDS.len()]) -> Result<(), TestCaseError> {
    let frame = bench.session.frame(bench.now());
    let levels = bench.session.counters().new_levels;
    for ((reading, low, high, rate, slack), before) in FIELDS.iter().zip(believed) {
        let Reading::Sampled { value, age_ms } = reading(&frame) else { continue };
        prop_assert!((*low..=*high).contains(&value), "{low} {value} {high}");
        let sampled_ms = (bench.now_ms + 2000).saturating_sub(u64::from(age_ms));
        if let Some(Believed(old, then_ms, then_levels)) = *before {
            let reach = slack + rate * ((sampled_ms.saturating_sub(then_ms)) as f32 * 1e-3).min(LONGEST_GAP_S);
            prop_assert!((value - old).abs() <= reach * 1.001 || levels > then_levels, "{old} to {value} in {} ms", sampled_ms - then_ms);
        }
        *before = Some(Believed(value, sampled_ms, levels));
    }
    let limits = bench.session.limits();
    prop_assert!(limits.ballast_m3 <= 320.1e-6 && limits.battery_m <= 1.71 * 0.0254 && limits.fin_rad <= 0.61);
    Ok(())
}

/// A sentence of a healthy glider whose values wander, in random order and number.
fn sentence(now_ms: u64, values: &mut [f64; 10], noise: u8, place: u16) -> Vec<u8> {
    const INDEX: [u16; 10] = [9, 10, 11, 12, 14, 15, 16, 21, 23, 17];
    const STEP: [f64; 10] = [1.0, 0.1, 0.05, 0.05, 20.0, 0.1, 0.05, 0.02, 0.02, 1.0];
    const RANGE: [(f64, f64); 10] = [
        (0.0, 900.0),
        (0.0, 90.0),
        (-0.6, 0.6),
        (-0.3, 0.3),
        (-226.0, 226.0),
        (-0.38, 0.38),
        (-0.45, 0.45),
        (11.0, 15.0),
        (6.0, 9.0),
        (0.0, 30.0),
    ];
    let mut body = format!("SD,8:{}", 1_767_225_600.0 + now_ms as f64 * 1e-3);
    for i in 0..10 {
        if place >> i & 1 == 1 {
            values[i] = (values[i] + STEP[i] * (f64::from(noise) / 127.5 - 1.0)).clamp(RANGE[i].0, RANGE[i].1);
            body += &format!(",{}:{:.4}", INDEX[i], values[i]);
        }
    }
    body += ",31:0,24:0";
    line(&body).into_bytes()
}

/// Orders as they leave the board.
fn orders(said: &str) -> Result<(), TestCaseError> {
    const MOST: [f64; 8] = [236.0, 1.0, 0.45, 195.0, 10.0, 999.0, 7.0, 24.0];
    for text in said.lines() {
        prop_assert!(text.len() < 110 && !text.to_ascii_lowercase().contains("nan"), "{text}");
        let Some(body) = text.strip_prefix("$SW,").and_then(|b| b.split('*').next()) else { continue };
        for pair in body.split(',') {
            let (index, value) = pair.split_once(':').expect("a pair");
            let most = MOST[index.parse::<usize>().expect("an index")];
            prop_assert!(value.parse::<f64>().expect("a number").abs() <= most + 1e-3, "{text}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A million bytes over all cases.
    #[test]
    fn prop_no_byte_makes_a_value_out_of_range_or_rate(
        moves in prop::collection::vec((0u8..9, any::<u16>(), any::<u8>(), 0u16..3000), 16_000)
    ) {
        let mut bench = Bench::new(List::default());
        bench.open();
        let (mut values, mut believed) = ([20.0, 2.0, 0.0, 0.0, -100.0, 0.1, 0.0, 13.0, 7.0, 12.0], [None; FIELDS.len()]);
        let (mut text, mut at): (Vec<u8>, usize) = (Vec::new(), 0);
        for (kind, place, noise, wait) in moves {
            if at >= text.len() {
                text = sentence(bench.now_ms, &mut values, noise, place);
                at = 0;
                bench.now_ms += u64::from(wait);
            }
            let byte = text[at];
            match kind {
                0 if place % 16 == 0 => bench.hear(&[byte ^ (1 << (noise % 8))]),
                1 if place % 8 == 0 && at + 1 < text.len() => {
                    text.swap(at, at + 1);
                    let swapped = [text[at], text[at + 1]];
                    bench.hear(&swapped);
                    at += 1;
                }
                2 if place % 16 == 0 => bench.hear(&[byte, byte]),
                3 if place % 16 == 0 => {}
                4 if place % 64 == 0 => bench.hear(&[noise]),
                // Late: in the middle of a sentence, once in a while for longer than any patience.
                5 if place % 64 == 0 => {
                    bench.wait(u64::from(wait) * if noise < 8 { 100 } else { 1 });
                    bench.hear(&[byte]);
                }
                _ => bench.hear(&[byte]),
            }
            at += 1;
            judge(&bench, &mut believed)?;
        }
        orders(&bench.said())?;
        // It hangs in no state: a healthy line is heard again.
        bench.hear(b"\r\n");
        let ini = bench.ini();
        for _ in 0..20 {
            bench.hear(line("SD,31:0,9:20,11:0").as_bytes());
            bench.serve(&ini, 4_000);
        }
        prop_assert!(matches!(bench.session.state(), crate::State::Ready | crate::State::Listen), "{:?}", bench.session.state());
    }
}
