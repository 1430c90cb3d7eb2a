//! The lake trial again: both wing sets through the plant, with the real controller in this process.
//!
//! The paper's vehicles held a commanded pitch (stock missions: 26°) between 3 and 27 m. The plant is a world of its own
//! (it shares no code with the model), so what comes out here is a test, not an echo.

use anyhow::anyhow;
use rayon::prelude::*;
use signals::{Goal, Leg, Mission, Phase, Wings};

use plant::World;
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::worlds;
use rig::seats::{self, Choice};

/// What one trial gave.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Horizontal over vertical way, the paper's overall L/D.
    pub l_over_d: f64,
    /// True angle of attack while gliding, deg, absolute.
    pub alpha_deg: Vec<f64>,
    /// Pitch while gliding, deg, absolute.
    pub pitch_deg: Vec<f64>,
    /// Path angle while gliding, deg, absolute.
    pub glide_deg: Vec<f64>,
    /// tan⁻¹ of path: horizontal over vertical speed of each sample, 1.
    pub sample_l_over_d: Vec<f64>,
    /// Mean |α| while gliding, deg.
    pub mean_alpha_deg: f64,
}

/// Depth bands flown, m.
pub const SHALLOW_M: (f32, f32) = (3.0, 27.0);
/// The deep band, m.
pub const DEEP_M: (f32, f32) = (5.0, 195.0);

/// Flies one trial.
///
/// # Errors
/// The plant or the controller refused, or the flight did not end well.
pub fn trial(wings: Wings, band_m: (f32, f32), goal: Goal) -> anyhow::Result<Trial> {
    let dives = if band_m.1 > 100.0 { 3 } else { 12 };
    let leg = Leg { dives, depth_min_m: band_m.0, depth_max_m: band_m.1, goal, ..Leg::default() };
    let mission = Mission { wings, legs: [leg].into_iter().collect(), max_duration_s: 12 * 3600, surface_every: 0 };
    let mut scenario = worlds::for_mission(&mission);
    scenario.wings = wings;
    let mut world = World::new(scenario).map_err(|e| anyhow!("{e}"))?;
    let mut seat = seats::open(&Choice::InProcess, None, None)?;
    let mut t = Trial {
        l_over_d: 0.0,
        alpha_deg: Vec::new(),
        pitch_deg: Vec::new(),
        glide_deg: Vec::new(),
        sample_l_over_d: Vec::new(),
        mean_alpha_deg: 0.0,
    };
    let out = fly(&mut world, &mut *seat, &Setup::new(mission), &mut |cycle| {
        if matches!(cycle.answer.trace.phase, Phase::Dive | Phase::Climb) && cycle.truth.speed_m_s > 0.05 {
            t.alpha_deg.push(cycle.truth.alpha_rad.to_degrees().abs());
            t.pitch_deg.push(cycle.truth.pitch_rad.to_degrees().abs());
            let glide = cycle.truth.glide_angle_rad.to_degrees().abs();
            t.glide_deg.push(glide);
            t.sample_l_over_d.push(1.0 / glide.to_radians().tan());
        }
        Ok(())
    })
    .map_err(|e| anyhow!("{e}"))?;
    anyhow::ensure!(!t.alpha_deg.is_empty(), "the trial never glided: {}", out.end);
    t.l_over_d = out.achieved_l_over_d();
    t.mean_alpha_deg = t.alpha_deg.iter().sum::<f64>() / t.alpha_deg.len() as f64;
    Ok(t)
}

/// The trials the claims need, both wing sets each.
#[derive(Clone, Debug)]
pub struct Trials {
    /// Shallow at the stock pitch of 26°: the paper's trial. (standard, low-ar)
    pub stock: [Trial; 2],
    /// Deep at 26°.
    pub stock_deep: [Trial; 2],
    /// Shallow at 18° pitch.
    pub shallow_pitch: [Trial; 2],
    /// Deep at 18°.
    pub shallow_pitch_deep: [Trial; 2],
    /// Shallow, controller at (L/D)max.
    pub best: [Trial; 2],
    /// Deep, controller at (L/D)max.
    pub best_deep: [Trial; 2],
}

/// Pitch that stock missions command, rad: 26° (0.4538 rad in public mission files).
pub const STOCK_PITCH_RAD: f32 = 0.4538;

/// Flies all trials, on all cores.
///
/// # Errors
/// A trial failed.
pub fn all() -> anyhow::Result<Trials> {
    let stock = Goal::FixedPitch { pitch_rad: STOCK_PITCH_RAD };
    let flat = Goal::FixedPitch { pitch_rad: 18f32.to_radians() };
    let kinds =
        [(SHALLOW_M, stock), (DEEP_M, stock), (SHALLOW_M, flat), (DEEP_M, flat), (SHALLOW_M, Goal::BestGlide), (DEEP_M, Goal::BestGlide)];
    let jobs: Vec<_> = kinds.iter().flat_map(|k| [Wings::Standard, Wings::LowAspectRatio].map(|w| (w, k.0, k.1))).collect();
    let flown: Vec<Trial> = jobs.into_par_iter().map(|(w, band, goal)| trial(w, band, goal)).collect::<anyhow::Result<_>>()?;
    let mut pairs = flown.into_iter();
    let mut pair = || -> anyhow::Result<[Trial; 2]> {
        match (pairs.next(), pairs.next()) {
            (Some(a), Some(b)) => Ok([a, b]),
            _ => Err(anyhow!("a trial is missing")),
        }
    };
    Ok(Trials {
        stock: pair()?,
        stock_deep: pair()?,
        shallow_pitch: pair()?,
        shallow_pitch_deep: pair()?,
        best: pair()?,
        best_deep: pair()?,
    })
}

/// Share of values in `[low, high)`.
#[must_use]
pub fn share_within(values: &[f64], low: f64, high: f64) -> f64 {
    values.iter().filter(|v| (low..high).contains(*v)).count() as f64 / values.len() as f64
}
