//! The shallow mission over the backseat line, and what came of it.

#![allow(dead_code)] // each test uses its part of it

use crate::flight::{Outcome, Setup, Trial};
use control::{Config, Settings};
use plant::Scenario;
use signals::{Mission, Wings};

pub const BOTH: [Wings; 2] = [Wings::Standard, Wings::LowAspectRatio];

pub fn shallow(wings: Wings) -> Trial {
    let mut scenario = Scenario::shallow(wings);
    scenario.vehicle.crush_depth_m = 125.0;
    Trial { scenario, mission: Mission { wings, ..Mission::default() }, config: Config::new(Settings::slocum_100()).expect("valid") }
}

pub fn flown(change: impl FnOnce(&mut Setup)) -> Outcome {
    let trial = shallow(Wings::Standard);
    trial.over_the_line(&mut trial.board().expect("a board"), change).expect("a flight")
}

/// Values of a parameter that the board wrote from a time on.
pub fn written(out: &Outcome, index: u16, from_s: f64) -> Vec<f64> {
    let prefix = format!("{index}:");
    let of = |body: &str| body.split(',').find_map(|pair| pair.strip_prefix(&prefix).and_then(|v| v.parse().ok()));
    out.taken.iter().filter(|(t, body)| *t >= from_s && body.starts_with("SW,")).filter_map(|(_, body)| of(body)).collect()
}

/// Aborts that the board's law wrote into the glider's log; −1: none.
pub fn aborts(out: &Outcome) -> Vec<f64> {
    written(out, 7, 0.0)
}

/// The middle of the longest dive of an undisturbed flight, s.
pub fn mid_dive() -> f64 {
    let out = flown(|_| ());
    let phase =
        |body: &str| body.strip_prefix("SW,5:").and_then(|b| b.split("6:").nth(1)).and_then(|b| b.split(',').next()).map(str::to_owned);
    let phases: Vec<(f64, String)> = out.taken.iter().filter_map(|(t, body)| Some((*t, phase(body)?))).collect();
    let (mut best, mut from) = ((0.0, 0.0), None);
    for (t, phase) in &phases {
        match (phase.as_str(), from) {
            ("1.000000", None) => from = Some(*t),
            ("1.000000", Some(start)) if t - start > best.1 - best.0 => best = (start, *t),
            ("1.000000", _) => {}
            _ => from = None,
        }
    }
    0.5 * (best.0 + best.1)
}

/// A number from 0 to 1 from a seed: splitmix64.
pub fn unit(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
