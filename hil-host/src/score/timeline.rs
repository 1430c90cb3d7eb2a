//! Missions of the plant in which something changes at an unknown dive: is it found, when, and how large?
//!
//! Each case is a vehicle of its own: calibrated on one natural trial of eight dives ([`plant::trials::generate_natural`]), then flown on a
//! mission of sixty ([`plant::trials::mission`]) and followed. Truth is the plant's: another law, a small structure, clocks apart,
//! sensor zeros.
//!
//! * **Right**: a change along the number that was changed, alone or among those not told from it, with its onset within two dives
//!   and the size inside its 90 % interval. (A growth's size is that at the last dive.)
//! * **False alarms** are counted on unchanged dives, drawn again and again from the dives of unchanged missions: what a dive says less
//!   what its mission says on average is its noise, tails and all.

use std::path::Path;

use anyhow::Context as _;
use discovery::history::changes::{Observed, find};
use discovery::history::kinds::{AFLOAT_ZERO, DIVES_PER_ALARM, FOLLOWED, threshold};
use discovery::history::learn::between;
use discovery::history::numbers::{BALLAST_OFFSET, DRAG_LEVEL, PITCH_OFFSET, SLOPE_OF_LIFT};
use discovery::history::shown::N;
use discovery::history::summary::Summary;
use discovery::workbench::calibrate::{Logged, Options, calibrate};
use discovery::workbench::timeline::{Event, Level, Mission};
use logs::record::csv;
use logs::vehicle;
use nalgebra::{DMatrix, DVector};
use plant::trials::mission::{Change, fly};
use plant::trials::{Site, Spec, Wing, files, generate_natural};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Dives of a mission.
pub const DIVES: usize = 60;
/// How near an onset has to be, dives.
const NEAR: usize = 2;

/// One mission.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Number of the vehicle.
    pub index: usize,
    /// Wing set.
    pub wing: Wing,
    /// What changes.
    pub change: Change,
    /// First dive that has it, from 0.
    pub onset: usize,
}

/// Kinds of change that are flown, in turn.
pub const CHANGES_FLOWN: [&str; 5] = ["drag", "fouling", "trim", "leak", "lift"];

/// A number from 0 to 1.
fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A whole number below `n`.
fn below(rng: &mut ChaCha8Rng, n: usize) -> usize {
    ((uniform(rng) * n as f64) as usize).min(n.saturating_sub(1))
}

/// The cases: kinds in turn, sizes over the whole range, onsets in the middle two thirds.
#[must_use]
pub fn plan(cases: usize, seed: u64, only: Option<&str>) -> Vec<Case> {
    let one = |index: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7135 ^ ((index as u64) << 16));
        let onset = DIVES / 6 + below(&mut rng, DIVES * 2 / 3);
        let mut between = |low: f64, high: f64| low * (high / low).powf(uniform(&mut rng));
        let change = match only.unwrap_or(CHANGES_FLOWN[index % CHANGES_FLOWN.len()]) {
            "drag" => Change::Drag(between(0.1, 0.9)),
            "fouling" => Change::Fouling(between(0.2, 0.9)),
            "trim" => Change::Trim(between(10.0, 80.0) * if index.is_multiple_of(2) { 1.0 } else { -1.0 }),
            "leak" => Change::Leak(between(20.0, 80.0)),
            "lift" => Change::Lift(-between(0.1, 0.4)),
            "pitch" => Change::PitchZero(between(0.01, 0.05)),
            "pressure" => Change::PressureZero(between(0.5, 2.0)),
            _ => Change::Nothing,
        };
        let wing = if (index / CHANGES_FLOWN.len()).is_multiple_of(2) { Wing::Standard } else { Wing::LowAspectRatio };
        Case { index, wing, change, onset }
    };
    (0..cases).map(one).collect()
}

/// A change as it was named.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Named {
    /// Kind.
    pub kind: String,
    /// First dive that has it.
    pub dive: usize,
    /// Size: value, low, high.
    pub size: [f64; 3],
}

/// What was said of one mission.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Scored {
    /// The case; put back by [`Self::of`] when this was kept.
    #[serde(skip, default = "no_case")]
    pub case: Case,
    /// Changes, the first dive first.
    pub named: Vec<Named>,
    /// Scatter of the numbers between dives, 1 sigma, in their units.
    pub scatter: [f64; N],
    /// Of an unchanged mission: what its dives say about nothing but noise.
    noise: Option<Noise>,
    /// Onset found less that flown, dives; none where the change is not named.
    pub late: Option<i64>,
    /// Whether the size is inside its interval.
    pub covered: bool,
    /// Whether its own kind leads.
    pub leads: bool,
    /// Changes beside it.
    pub others: usize,
    /// Wall time of the timeline, s.
    pub seconds: f64,
}

/// The number that a change is of, its size in the number's unit, and whether it grows.
fn truth(change: Change) -> Option<(usize, f64)> {
    match change {
        Change::Nothing => None,
        Change::Drag(by) | Change::Fouling(by) => Some((DRAG_LEVEL, 100.0 * by)),
        Change::Trim(cc) => Some((BALLAST_OFFSET, cc)),
        Change::Leak(cc) => Some((BALLAST_OFFSET, -cc)),
        Change::Lift(by) => Some((SLOPE_OF_LIFT, 100.0 * by)),
        Change::PitchZero(by) => Some((PITCH_OFFSET, by.to_degrees())),
        Change::PressureZero(by) => Some((AFLOAT_ZERO, by)),
    }
}

fn put(folder: &Path, csv: &str, vehicle: &Value) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    std::fs::write(folder.join("flight.csv"), csv).with_context(|| folder.display().to_string())?;
    std::fs::write(folder.join("vehicle.json"), format!("{vehicle:#}\n")).with_context(|| folder.display().to_string())
}

/// Calibrates a vehicle on its natural trial and flies its mission.
///
/// # Errors
/// A folder that cannot be written, or a log that is refused.
pub fn score(case: Case, seed: u64, dives: usize, folder: &Path) -> anyhow::Result<Scored> {
    let spec = Spec::clean(Site::Sea, case.wing);
    let here = folder.join(case.index.to_string());
    let trial = generate_natural(&spec, seed, case.index);
    let speed = trial.vehicle.sensors.speed_m_s.is_some();
    let document = trial.vehicle.document(&trial.name);
    put(&here.join("trial"), &files::csv(&trial.rows, speed), &document)?;
    let given = vehicle::read(&here.join("trial/vehicle.json"))?;
    let log = Logged { flight: csv::flight(&here.join("trial"))?, sha256: String::new() };
    let calibrated = calibrate(&[log], &given, &Options::default(), b"", &|_, _| ())?;
    let flown = fly(&spec, seed, case.index, dives, case.change, case.onset);
    put(&here.join("mission"), &files::csv(&flown.rows, speed), &calibrated.vehicle)?;
    let known = vehicle::read(&here.join("mission/vehicle.json"))?;
    let log = csv::flight(&here.join("mission"))?;
    std::fs::remove_dir_all(&here).ok();
    let clock = std::time::Instant::now();
    let mut mission = Mission::new(&known);
    mission.add(&log, 0.0);
    let timeline = mission.finish(DIVES_PER_ALARM)?;
    let seconds = clock.elapsed().as_secs_f64();
    let noise = if case.change == Change::Nothing { Some(noise_of(&mission.followed(f64::INFINITY)?.observed())) } else { None };
    Ok(scored(case, (&timeline.events, timeline.scatter), noise, seconds))
}

fn no_case() -> Case {
    Case { index: 0, wing: Wing::Standard, change: Change::Nothing, onset: 0 }
}

fn scored(case: Case, (events, scatter): (&[Event], [f64; N]), noise: Option<Noise>, seconds: f64) -> Scored {
    let named = events.iter().map(|e| Named { kind: e.name().to_owned(), dive: e.dive, size: [e.size.value, e.size.low, e.size.high] });
    let (named, others) = (named.collect(), events.len());
    let mut out = Scored { case, named, scatter, noise, others, late: None, covered: false, leads: false, seconds };
    let Some((number, size)) = truth(case.change) else { return out };
    let inside = |l: &Level| (l.low..=l.high).contains(&size);
    let of = |e: &Event| -> Option<(usize, bool, bool)> {
        if !e.several.is_empty() {
            return None;
        }
        if e.change.kind.number == number {
            return Some((e.change.onset, inside(&e.size), true));
        }
        e.others.iter().find(|(c, _)| c.kind.number == number).map(|(c, l)| (c.onset, inside(l), false))
    };
    let near = events.iter().filter_map(of).min_by_key(|(onset, _, leads)| (onset.abs_diff(case.onset), !leads));
    if let Some((onset, covered, leads)) = near {
        (out.late, out.covered, out.leads) = (Some(onset as i64 - case.onset as i64), covered, leads);
        out.others -= 1;
    }
    out
}

impl Scored {
    /// With its case again.
    #[must_use]
    pub fn of(self, case: Case) -> Self {
        Self { case, ..self }
    }

    /// Found near its onset with its size inside the interval.
    #[must_use]
    pub fn right(&self) -> bool {
        self.near() && self.covered
    }

    /// Found near its onset.
    #[must_use]
    pub fn near(&self) -> bool {
        self.late.is_some_and(|late| late.unsigned_abs() as usize <= NEAR)
    }
}

/// A mission's dives with what they say about nothing but noise: each dive's deviation from the level that the mission has beside it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Noise {
    /// Information, by columns, and its vector.
    dives: Vec<[Vec<f64>; 2]>,
}

impl Noise {
    fn dive(&self, k: usize) -> Summary {
        let [matrix, vector] = &self.dives[k];
        Summary { n: DMatrix::from_column_slice(FOLLOWED, FOLLOWED, matrix), u: DVector::from_column_slice(vector) }
    }
}

fn noise_of(observed: &[Observed]) -> Noise {
    let all: Vec<Summary> = observed.iter().map(|o| o.says.clone()).collect();
    // Wide enough for the mission's own mean.
    let mean = between(&all, &DVector::from_element(FOLLOWED, 0.01), &DVector::zeros(FOLLOWED)).mean;
    let dives = all.iter().map(|o| [o.n.as_slice().to_vec(), o.about(&mean).as_slice().to_vec()]).collect();
    Noise { dives }
}

/// What unchanged dives say: dives, missions, and the changes that were named in them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alarms {
    /// Dives.
    pub dives: usize,
    /// Missions.
    pub missions: usize,
    /// Changes named.
    pub alarms: usize,
}

/// Counts alarms on at least so many unchanged dives, drawn from those of unchanged missions.
///
/// # Errors
/// A pool that cannot start.
pub fn false_alarms(unchanged: &[&Scored], dives: usize, seed: u64, jobs: usize, tick: &(dyn Fn() + Sync)) -> anyhow::Result<Alarms> {
    let noise: Vec<Noise> = unchanged.iter().filter_map(|s| s.noise.clone()).collect();
    if noise.is_empty() {
        return Ok(Alarms::default());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().context("cannot start the worker threads")?;
    let missions = dives.div_ceil(DIVES);
    let limit = threshold(DIVES_PER_ALARM);
    let alarms = pool.install(|| {
        (0..missions)
            .into_par_iter()
            .map(|m| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0xA1A2 ^ ((m as u64) << 20));
                let of = &noise[m % noise.len()];
                let draw = |d: usize, rng: &mut ChaCha8Rng| Observed { says: of.dive(below(rng, of.dives.len())), day: 0.06 * d as f64 };
                let series: Vec<Observed> = (0..DIVES).map(|d| draw(d, &mut rng)).collect();
                tick();
                find(&series, limit).changes.len()
            })
            .sum()
    });
    Ok(Alarms { dives: missions * DIVES, missions, alarms })
}

fn name_of(change: Change) -> &'static str {
    match change {
        Change::Nothing => "nothing",
        Change::Drag(_) => "drag",
        Change::Fouling(_) => "fouling",
        Change::Trim(_) => "trim",
        Change::Leak(_) => "leak",
        Change::Lift(_) => "lift",
        Change::PitchZero(_) => "pitch",
        Change::PressureZero(_) => "pressure",
    }
}

/// The scorecard as a document.
#[must_use]
pub fn document(scored: &[Scored], alarms: &Alarms) -> Value {
    let of = |list: &[&Scored]| {
        let share = |what: &dyn Fn(&Scored) -> bool| list.iter().filter(|s| what(s)).count();
        json!({
            "missions": list.len(), "right": share(&Scored::right), "onset_within_2": share(&Scored::near),
            "named": share(&|s| s.late.is_some()), "size_covered": share(&|s| s.covered), "leads": share(&|s| s.leads),
            "other_changes": list.iter().map(|s| s.others).sum::<usize>(),
        })
    };
    let changed: Vec<&Scored> = scored.iter().filter(|s| truth(s.case.change).is_some()).collect();
    let unchanged: Vec<&Scored> = scored.iter().filter(|s| truth(s.case.change).is_none()).collect();
    let mut kinds: Vec<&str> = changed.iter().map(|s| name_of(s.case.change)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let by_kind: serde_json::Map<String, Value> = kinds
        .iter()
        .map(|k| ((*k).to_owned(), of(&changed.iter().copied().filter(|s| name_of(s.case.change) == *k).collect::<Vec<_>>())))
        .collect();
    let list: Vec<Value> = scored
        .iter()
        .map(|s| {
            let size = |n: &Named| json!({"kind": n.kind, "dive": n.dive, "size": n.size[0], "low": n.size[1], "high": n.size[2]});
            let named: Vec<Value> = s.named.iter().map(size).collect();
            json!({
                "vehicle": s.case.index, "wing": s.case.wing.id(), "change": name_of(s.case.change),
                "size": truth(s.case.change).map(|t| t.1), "dive": s.case.onset + 1, "late": s.late, "covered": s.covered,
                "leads": s.leads, "named": named, "scatter_1sigma": s.scatter.to_vec(), "wall_s": s.seconds,
            })
        })
        .collect();
    let mut wall: Vec<f64> = scored.iter().map(|s| s.seconds).collect();
    wall.sort_by(f64::total_cmp);
    json!({
        "changed": of(&changed), "by_kind": by_kind,
        "unchanged": {"missions": unchanged.len(), "changes_named": unchanged.iter().map(|s| s.named.len()).sum::<usize>()},
        "false_alarms": {
            "dives": alarms.dives, "missions": alarms.missions, "alarms": alarms.alarms,
            "per_1000_dives": 1000.0 * alarms.alarms as f64 / alarms.dives.max(1) as f64,
        },
        "wall_s_median": wall.get(wall.len() / 2), "list": list,
    })
}
