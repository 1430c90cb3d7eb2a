//! Effects that have a twin: another effect that does nearly the same to a vehicle.
//!
//! Water that is denser than the sensor says and more displaced volume are one force, but for the per mille by which the hull's volume
//! and the water's density vary. A pitch sensor that is misaligned and a hull whose lift is zero at an angle fly one glide; what tells
//! them apart is how the hull's drag turns with the angle, and the turns. A stall that reattaches late is a plain stall but for the legs
//! flown attached where it also is flown separated. How far a log tells the twin from the truth is found here as
//! in [`super::reference`]: both in nature's own form, with the calibration fitted to either, against the noise that this flight
//! really had. It needs the truth, so it says what can be told at all, not what a tool would tell.

use super::nature::{Nature, Stall};
use super::reference::{Block, Log, recalibrated};
use super::vehicle::{Nominal, Scatter, TOLERANCE};
use super::{Kind, Truth};

/// The vehicle with a hidden effect exchanged for its twin of the same force; none for an effect without one.
fn exchanged(of: &Nature, name: &str, value: f64, density_kg_m3: f64) -> Option<Nature> {
    let mut v = of.clone();
    // Volume whose weight of water is the error of weight of the displaced water.
    let volume = |bias: f64| of.volume * bias / density_kg_m3;
    match name {
        "density_bias" => {
            v.volume -= volume(value);
            v.density_bias = 0.0;
        }
        "ballast_offset" => {
            v.density_bias = -value * 1e-6 * density_kg_m3 / of.volume;
            v.volume -= value * 1e-6;
        }
        "zero_lift_angle" => {
            v.pitch_zero += value;
            (v.zero_lift, v.zero_lift_hull) = (0.0, 0.0);
        }
        "pitch_offset" => {
            v.pitch_zero -= value;
            // Crooked as a whole: what comes nearest.
            (v.zero_lift, v.zero_lift_hull) = (value, 1.0);
        }
        _ => return None,
    }
    Some(v)
}

/// Steps of the search for the plain stall that comes nearest to one with hysteresis: of its angle, rad, and of its loss and width,
/// relative.
const FIRST_STEPS: [f64; 3] = [0.0225, 0.25, 0.5];
/// Rounds of that search, each with smaller steps and the calibration fitted anew.
const ROUNDS: usize = 3;

/// The vehicle with the plain stall that comes nearest to its own with hysteresis.
fn plainly_stalled(of: &Nature, fitted: impl Fn(&Nature) -> Nature, misfit: impl Fn(&Nature) -> f64) -> Option<Nature> {
    let late = of.stall.filter(|s| s.hysteresis > 0.0)?;
    let mut plain = Stall { angle: late.angle - 0.5 * late.hysteresis, width: 0.02, hysteresis: 0.0, ..late };
    let mut steps = FIRST_STEPS;
    for _ in 0..ROUNDS {
        let calibrated = fitted(&Nature { stall: Some(plain), ..of.clone() });
        let ask = |stall: Stall| misfit(&Nature { stall: Some(stall), ..calibrated.clone() });
        let mut best = ask(plain);
        for _ in 0..4 {
            let before = best;
            for (k, step) in steps.iter().enumerate() {
                for sign in [-1.0, 1.0] {
                    let mut other = plain;
                    match k {
                        0 => other.angle += sign * step,
                        1 => other.loss *= 1.0 + sign * step,
                        _ => other.width *= (sign * step).exp(),
                    }
                    let now = ask(other);
                    if now < best {
                        (best, plain) = (now, other);
                    }
                }
            }
            if best > before - 0.5 {
                break;
            }
        }
        steps = steps.map(|s| 0.5 * s);
    }
    Some(Nature { stall: Some(plain), ..of.clone() })
}

/// Log odds by which the segments to fit prefer the truth to the twin of what is hidden; of a pair, to the twin that comes nearest. Near
/// 0 and below, nobody can tell which of the two it was who may not look at the others. `None` where nothing hidden has a twin.
#[must_use]
pub fn log_odds(log: &Log, nominal: &Nominal, truth: &Truth) -> Option<f64> {
    let calm = log.clone().without_stirring();
    let density = calm.mean_density();
    // What a tool may look at: pressure on the check segments is not.
    let shown = |segment: usize| !nominal.check.contains(&segment);
    let as_it_flew = |vehicle: &Nature| whitened(&calm.blocks(vehicle, nominal.gravity, shown));
    let fitted = |vehicle: &Nature| {
        let build = |s: &Scatter| vehicle.rescattered(&truth.scatter, s);
        let scatter = recalibrated(&calm, nominal, build);
        (build(&scatter), scatter)
    };
    let misfit = |vehicle: &Nature| {
        let (calibrated, scatter) = fitted(vehicle);
        let prior: f64 = scatter.values.iter().zip(TOLERANCE).map(|(x, (_, tolerance))| (x / tolerance).powi(2)).sum();
        prior + as_it_flew(&calibrated)
    };
    let mut twins: Vec<Nature> = truth.hidden.iter().filter_map(|h| exchanged(&truth.nature, h.name, h.value, density)).collect();
    if truth.kind == Kind::Off {
        twins.extend(plainly_stalled(&truth.nature, |vehicle| fitted(vehicle).0, as_it_flew));
    }
    let nearest = twins.iter().map(misfit).reduce(f64::min)?;
    Some(0.5 * (nearest - misfit(&truth.nature)))
}

/// Sum of squares of the model's errors in units of this flight's noise (what was observed less what is known to be true), whose
/// correlation from block to block is taken out.
fn whitened(blocks: &[Block]) -> f64 {
    // The water motion that was hidden is taken out of what was observed here, and is in what is known.
    let noise = |b: &Block| b.observed + b.stirred - b.known;
    let neighbours = || blocks.windows(2).filter(|w| w[0].segment == w[1].segment);
    let square: f64 = blocks.iter().map(|b| noise(b).powi(2)).sum();
    let product: f64 = neighbours().map(|w| noise(&w[0]) * noise(&w[1])).sum();
    let variance = square / blocks.len() as f64;
    let likeness = (product / square).clamp(-0.9, 0.9);
    let error = |b: &Block| b.observed - b.modelled;
    let firsts = blocks.iter().enumerate().filter(|(i, b)| *i == 0 || blocks[i - 1].segment != b.segment);
    let first: f64 = firsts.map(|(_, b)| error(b).powi(2)).sum();
    let rest: f64 = neighbours().map(|w| (error(&w[1]) - likeness * error(&w[0])).powi(2)).sum();
    (first + rest / (1.0 - likeness * likeness)) / variance
}
