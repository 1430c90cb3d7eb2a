//! A flight's own world, refitted to its log, with another law, table, mission, fault or effect flown in it.
//!
//! The vehicle is that of the file, its eight numbers as all dives of the log and its fixes have them together; the water is the
//! measured profile and the mean current between the fixes. Worlds are drawn from what the fit leaves open, each with its own noise, and both laws fly
//! in the same ones: the difference has an interval. How many dives of the log lie inside what the law that flew does in these worlds
//! says how far they can be trusted.

mod track;

use crate::score::story::{in_the_plant, revealed};
use anyhow::{Context, anyhow, bail, ensure};
use discovery::forecast::passages::{Passage, passages};
use discovery::history::glide::Glider;
use discovery::history::numbers::{ALL, NUMBERS, Numbers, in_effect};
use discovery::history::posterior::posterior;
use discovery::history::rows::{median, units};
use discovery::model::parameters::NINETY;
use logs::{Flight, Vehicle};
use nalgebra::{DMatrix, DVector};
use plant::ocean::{CurrentLevel, Level, Profile};
use plant::{Effect, EffectKind, Scenario, World};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rig::flight::closed_loop::{Outcome, Setup, fly};
use rig::flight::recorder::Recorder;
use rig::flight::worlds;
use rig::seats::Seat;
use signals::{Mission, Wings};
use std::path::Path;
use track::Sample;

/// Thickness of a layer of the measured profile, Pa.
const LAYER_PA: f64 = 5e4;
/// Seed of the samples of the fit.
const SAMPLED: u64 = 1;
/// Noise of a way between two fixes, m in each direction, and of a duration by the control cycle, s.
const FIXES_M: f64 = worlds::GPS_NOISE_M * std::f64::consts::SQRT_2;
const CYCLE_S: f64 = rig::seats::CYCLE_S;
/// What a deepest depth is known by, m: the turn of a cycle, and the pressure sensor.
const DEEPEST_M: f64 = 0.5;
/// 90 % of two directions together: chi² of two.
const NINETY_OF_TWO: f64 = 4.605;

/// A dive between two fixes; of a log without fixes a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dive {
    /// Time from fix to fix, s.
    pub time_s: f64,
    /// Deepest, m.
    pub deepest_m: f64,
    /// Way over ground to the east and north, m; NaN without fixes.
    pub way_m: [f64; 2],
}

/// The dives of a log.
#[must_use]
pub fn dives(flight: &Flight, vehicle: &Vehicle) -> Vec<Dive> {
    let deepest = |from_s: f64, to_s: f64| {
        let under_way = flight.time_s.iter().zip(&flight.pressure_pa).filter(|(t, _)| (from_s..=to_s).contains(*t));
        under_way.fold(0.0_f64, |deepest, (_, pa)| deepest.max(*pa)) / 1e4
    };
    let all = passages(flight, vehicle, &[]).all;
    if !all.is_empty() {
        let one =
            |p: &Passage| Dive { time_s: p.time_s(), deepest_m: deepest(p.from.time_s, p.to.time_s), way_m: [p.way().re, p.way().im] };
        return all.iter().map(one).collect();
    }
    let rows: Vec<usize> = (0..flight.len()).collect();
    let one = |rows: &[usize]| {
        let [from_s, to_s] = [rows.first(), rows.last()].map(|i| i.map_or(f64::NAN, |i| flight.time_s[*i]));
        Dive { time_s: to_s - from_s, deepest_m: deepest(from_s, to_s), way_m: [f64::NAN; 2] }
    };
    rows.chunk_by(|a, b| flight.segment[*a] == flight.segment[*b]).map(one).collect()
}

/// What worlds are drawn from.
pub struct Refit {
    base: Scenario,
    /// What the log says of the numbers and the current.
    samples: Vec<Sample>,
    sizes: Numbers,
    claims: [f64; NUMBERS],
    hull_m3: f64,
    /// Whether the dives of the log glide steadily for long enough to say something of the numbers.
    pub is_fitted: bool,
    /// The dives of the log.
    pub recorded: Vec<Dive>,
}

impl Refit {
    /// Fits a world to a log; of one whose dives are too short the numbers are the file's, within its tolerances.
    ///
    /// # Errors
    /// A number without an interval.
    pub fn of(flight: &Flight, vehicle: &Vehicle, mission: &Mission, wings: Wings) -> anyhow::Result<Self> {
        let units = units(flight);
        let glider = Glider::of_units(vehicle, &units);
        let fitted = posterior(&units, &glider);
        let is_fitted = fitted.is_some();
        let as_stated =
            || (Numbers::zeros(), DMatrix::from_diagonal(&DVector::from_iterator(NUMBERS, glider.tolerance.iter().map(|t| t * t))));
        let (mean, covariance) = fitted.unwrap_or_else(as_stated);
        let samples = track::samples(flight, vehicle, &glider, &units, (&mean, &covariance), SAMPLED);
        ensure!(!samples.is_empty(), "{}: the fit leaves a number without an interval", flight.name);
        let mut base = worlds::for_mission(mission);
        let c = &vehicle.constants;
        base.wings = wings;
        base.vehicle.aero = Some(revealed(wings, c));
        base.vehicle.mass_kg = c.mass_kg;
        base.vehicle.compressibility_per_pa = c.compressibility_per_pa;
        base.vehicle.thermal_expansion_per_k = c.thermal_expansion_per_k;
        base.vehicle.reference_temperature_degc = c.reference_temperature_degc;
        base.vehicle.added_mass_surge_kg = c.added_mass_surge * c.mass_kg;
        base.vehicle.added_mass_heave_kg = c.added_mass_heave * c.mass_kg;
        base.effects = in_the_plant(&vehicle.effects, |_| true);
        base.ocean.profile = profile(flight).map_or(base.ocean.profile, Profile::Levels);
        base.ocean.background_rms_m_s = vehicle.background.0;
        if vehicle.water_depth_m.is_finite() {
            base.ocean.water_depth_m = vehicle.water_depth_m;
        }
        let recorded = dives(flight, vehicle);
        Ok(Self { base, samples, sizes: glider.sizes, claims: glider.claims(), hull_m3: c.hull_volume_m3, is_fitted, recorded })
    }

    /// A world drawn from what the fit leaves open.
    ///
    /// # Errors
    /// No such world can be.
    pub fn drawn(&self, seed: u64) -> anyhow::Result<Scenario> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut left: f64 = StandardUniform.sample(&mut rng);
        let drawn = self.samples.iter().find(|s| {
            left -= s.weight;
            left <= 0.0
        });
        let Some(Sample { x, current: (current, known_by), .. }) = drawn.or(self.samples.last()) else { bail!("nothing to draw from") };
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut scenario = self.base.clone();
        scenario.seed = seed;
        for (i, number) in ALL.iter().enumerate() {
            let value = in_effect(i, x[i] * self.sizes[i], self.claims[i]);
            let kind = EffectKind::ALL.iter().find(|k| k.name() == number.effect);
            scenario.effects.extend(kind.map(|kind| Effect { kind: *kind, value, aux: None }));
        }
        let [east_m_s, north_m_s] = [current.re, current.im].map(|mean| mean + known_by * normal());
        if east_m_s != 0.0 || north_m_s != 0.0 {
            scenario.ocean.current = vec![CurrentLevel { depth_m: 0.0, north_m_s, east_m_s }];
        }
        // A world is ballasted for its water, the log's vehicle has the hull of its file.
        let world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
        let more_cc = 1e6 * (self.hull_m3 - world.hull_volume_m3());
        scenario.effects.push(Effect { kind: EffectKind::BallastOffset, value: more_cc, aux: None });
        Ok(scenario)
    }
}

/// Median density and temperature of the layers; none where the log has no density.
fn profile(flight: &Flight) -> Option<Vec<Level>> {
    let deepest = flight.pressure_pa.iter().copied().fold(0.0, f64::max);
    let layer = |k: usize| {
        let pa = (k as f64 + 0.5) * LAYER_PA;
        let rows = || (0..flight.len()).filter(move |i| (flight.pressure_pa[*i] - pa).abs() <= 0.5 * LAYER_PA);
        let (density, degc) = (median(rows().map(|i| flight.density_kg_m3[i])), median(rows().map(|i| flight.temperature_degc[i])));
        let level = Level { depth_m: pa / 1e4, temperature_degc: degc, absolute_salinity_g_kg: 0.0, density_kg_m3: Some(density) };
        (density.is_finite() && degc.is_finite()).then_some(level)
    };
    let levels: Vec<Level> = (0..(deepest / LAYER_PA).ceil() as usize).filter_map(layer).collect();
    (levels.len() > 1).then_some(levels)
}

/// Mean and variance.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0))
}

/// A law in a world: what came of it, and its dives.
pub struct Flown {
    /// What came of it.
    pub outcome: Outcome,
    /// Its dives.
    pub dives: Vec<Dive>,
    /// Time (s) and depth (m) of every cycle.
    pub track: Vec<(f64, f64)>,
}

/// Flies a mission in a world; the log is written to `folder` and read back as that of any flight.
///
/// # Errors
/// The law does not answer, or the log cannot be written.
pub fn flown(scenario: &Scenario, setup: &Setup, seat: &mut dyn Seat, folder: &Path) -> anyhow::Result<Flown> {
    let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
    let mut recorder = Recorder::create(folder, &world, setup)?;
    let mut track = Vec::new();
    let outcome = fly(&mut world, seat, setup, &mut |cycle| {
        track.push((cycle.time_s, cycle.truth.depth_m));
        recorder.push(cycle)
    })?;
    recorder.finish(serde_json::json!({}))?;
    let flight = logs::record::csv::flight(folder)?;
    let vehicle = logs::vehicle::read(&folder.join("vehicle.json"))?;
    std::fs::remove_dir_all(folder).with_context(|| format!("{}: cannot be removed", folder.display()))?;
    Ok(Flown { outcome, dives: dives(&flight, &vehicle), track })
}

/// A number with its 90 % interval over the drawn worlds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Half width.
    pub half: f64,
}

/// The interval of one more draw; `floor` is what a value is known by however alike the draws are.
#[must_use]
pub fn interval(values: &[f64], floor: f64) -> Interval {
    let n = values.len() as f64;
    let (mean, variance) = moments(values);
    // Student's factor of so few draws (Cornish and Fisher's first term).
    let factor = NINETY * (1.0 + (NINETY * NINETY + 1.0) / (4.0 * (n - 1.0).max(1.0)));
    Interval { mean, half: factor * (variance * (1.0 + 1.0 / n) + floor * floor).sqrt() }
}

/// How far a recorded dive is from what the law that flew does in the drawn worlds: depth and time, and way, each in 90 % half widths.
type Miss = [f64; 2];

/// What the log's own dives say of the drawn worlds.
#[derive(Clone, Debug, Default)]
pub struct Reproduced {
    /// Of each dive whether depth and time, and its way, are inside of the interval, widened as the other dives ask for.
    pub inside: Vec<[bool; 2]>,
    /// By how much an interval of the whole flight is to be widened: the misses of all dives.
    pub wider: f64,
}

/// Root mean square of misses, no less than one.
fn widening(misses: impl Iterator<Item = f64>) -> f64 {
    // The mean square of two directions is 2 where the interval is right.
    let (sum, n) = misses.filter(|m| m.is_finite()).fold((0.0, 0.0), |(s, n), m| (s + m * m * NINETY_OF_TWO, n + 1.0));
    if n > 0.0 { (0.5 * sum / n).max(1.0_f64).sqrt() } else { 1.0 }
}

/// Compares the recorded dives with those of the law that flew in the drawn worlds.
#[must_use]
pub fn reproduced(recorded: &[Dive], drawn: &[Vec<Dive>]) -> Reproduced {
    let one = |(k, dive): (usize, &Dive)| -> Miss {
        let same: Vec<&Dive> = drawn.iter().filter_map(|dives| dives.get(k)).collect();
        if same.len() < 3 {
            return [f64::INFINITY; 2];
        }
        let off = |of: fn(&Dive) -> f64, floor: f64| {
            let i = interval(&same.iter().map(|d| of(d)).collect::<Vec<f64>>(), floor);
            (of(dive) - i.mean) / i.half
        };
        let depth = off(|d| d.deepest_m, DEEPEST_M).hypot(off(|d| d.time_s, CYCLE_S));
        let way = off(|d| d.way_m[0], FIXES_M).hypot(off(|d| d.way_m[1], FIXES_M));
        [depth, way].map(|off| off * NINETY / NINETY_OF_TWO.sqrt())
    };
    let misses: Vec<Miss> = recorded.iter().enumerate().map(one).collect();
    let is_inside = |k: usize| {
        [0, 1].map(|part| {
            let others = misses.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, m)| m[part]);
            misses[k][part].is_nan() || misses[k][part] <= widening(others)
        })
    };
    let wider = [0, 1].map(|part| widening(misses.iter().map(|m| m[part])));
    Reproduced { inside: (0..misses.len()).map(is_inside).collect(), wider: wider[0].max(wider[1]) }
}
