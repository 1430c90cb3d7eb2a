//! How well does the controller fly, beside the ordinary one?
//!
//! Wings × depth band × disturbance, our controller and the stock one, the
//! same pump volume, band and seed, in virtual time in one process.
//!
//! ```text
//! achieved L/D = Σ horizontal way over ground / Σ |vertical way|    from the first dive to the last surfacing
//! share        = the same through the water / (L/D)max of the true vehicle (mean of dive and climb)
//! ```
//! The distance while still on the surface counts for nobody. α is that of the
//! plant. The table "as true" is sampled from the plant's own steady polar; the
//! built-in one is what the firmware carries and knows nothing of the plant.

mod watch;

use anyhow::{Context, anyhow};
use control::{Config, Settings};
use plant::actuators::{Actuators, Pump};
use plant::effects::{Effect, EffectKind};
use plant::ocean::{Ocean, Profile};
use plant::{Scenario, World};
use polar::{Sample, Spec, Table};
use rayon::prelude::*;
use rig::seats::CYCLE_S;
use serde::Serialize;
use signals::{Abort, Answer, Leg, Micros, Mission, Phase, SensorFrame, Wings};
use watch::Watch;

/// Width of an α bin, degrees.
pub const BIN_DEG: f64 = 2.0;
/// Number of α bins: 0..90°.
pub const BINS: usize = 45;
/// Points of a table made from the plant, and its last α, rad.
const TABLE: (u16, f64) = (50, 0.35);

/// Where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Band {
    /// Lake, 3–27 m, 100 m pump: the paper's trial.
    Shallow,
    /// Shelf sea, 0–200 m, 200 m pump.
    Sea,
    /// Deep sea, 0–1000 m, oil pump.
    Deep,
}

/// Who.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pilot {
    /// The law of this project.
    Ours,
    /// The ordinary controller.
    Stock,
}

/// What is in the way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Disturbance {
    /// Calm water, right table.
    Calm,
    /// Calm water, the table built into the firmware.
    BuiltInTable,
    /// Strongly layered water.
    Stratified,
    /// Internal wave of 2 cm/s and small background motion.
    InternalWaves,
    /// Noise, resolution and lag of every sensor three times as large.
    NoisySensors,
    /// Table with lift times this.
    TableLift(f64),
    /// Table with drag times this.
    TableDrag(f64),
    /// Drag without lift higher by this share, unknown to the built-in table.
    DragLevel(f64),
    /// A hidden effect of medium size.
    Hidden(EffectKind),
}

impl Disturbance {
    /// Those of the fixed scorecard; [`Self::hidden`] adds the effects.
    pub const FIXED: [Self; 9] = [
        Self::Calm,
        Self::BuiltInTable,
        Self::Stratified,
        Self::InternalWaves,
        Self::NoisySensors,
        Self::TableLift(0.8),
        Self::TableLift(1.2),
        Self::TableDrag(0.8),
        Self::TableDrag(1.2),
    ];

    /// One for each effect the plant knows.
    #[must_use]
    pub fn hidden() -> Vec<Self> {
        EffectKind::ALL.iter().map(|&k| Self::Hidden(k)).collect()
    }

    /// Name for people.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Calm => "calm".into(),
            Self::BuiltInTable => "calm, built-in table".into(),
            Self::Stratified => "stratified".into(),
            Self::InternalWaves => "internal waves".into(),
            Self::NoisySensors => "noisy sensors".into(),
            Self::TableLift(f) => format!("table lift x{f}"),
            Self::TableDrag(f) => format!("table drag x{f}"),
            Self::DragLevel(f) => format!("drag without lift {:+.0} %", 100.0 * f),
            Self::Hidden(k) => k.name().into(),
        }
    }
}

/// One flight to fly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Wings.
    pub wings: Wings,
    /// Where.
    pub band: Band,
    /// What is in the way.
    pub disturbance: Disturbance,
    /// Who.
    pub pilot: Pilot,
    /// Seed of the world.
    pub seed: u64,
}

/// What came of a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Which flight.
    pub case: Case,
    /// Came home with the mission flown.
    pub done: bool,
    /// Cause of an abort.
    #[serde(serialize_with = "cause")]
    pub abort: Option<Abort>,
    /// Dives.
    pub dives: u16,
    /// Horizontal way over ground, m.
    pub distance_m: f64,
    /// Horizontal way through the water, m.
    pub water_distance_m: f64,
    /// Vertical way, m.
    pub vertical_m: f64,
    /// Time under way, s.
    pub duration_s: f64,
    /// Achieved L/D.
    pub achieved_l_over_d: f64,
    /// (L/D)max of the true vehicle.
    pub max_l_over_d: f64,
    /// Achieved over best.
    pub share_of_max: f64,
    /// α of (L/D)max, rad.
    pub best_alpha_rad: f64,
    /// Share of the time with |α| within 2° of it.
    pub share_near_best: f64,
    /// Electrical energy, J.
    pub energy_j: f64,
    /// Electrical energy per metre, J/m.
    pub transport_j_m: f64,
    /// Farthest beyond the depth band, m; turns at the surface do not count.
    pub overshoot_m: f64,
    /// Deepest turn short of the band's limit, m.
    pub undershoot_m: f64,
    /// Mean time from one glide to the next, s: pump started until it stands and the pitch is within 2° of what is wanted.
    pub inflection_s: f64,
    /// Time in each bin of |α| of [`BIN_DEG`], as a share.
    pub alpha_histogram: Vec<f64>,
}

fn cause<S: serde::Serializer>(abort: &Option<Abort>, s: S) -> Result<S::Ok, S::Error> {
    match abort {
        Some(a) => s.collect_str(&format_args!("{a:?}")),
        None => s.serialize_none(),
    }
}

impl Band {
    /// The mission, the same for both pilots.
    #[must_use]
    pub fn mission(self, wings: Wings) -> Mission {
        let (leg, hours) = match self {
            Self::Shallow => (Leg::default(), 6),
            Self::Sea => (Leg { dives: 2, depth_min_m: 0.0, depth_max_m: 200.0, ..Leg::default() }, 24),
            Self::Deep => (Leg { dives: 1, depth_min_m: 0.0, depth_max_m: 1000.0, ..Leg::default() }, 48),
        };
        Mission { wings, legs: [leg].into_iter().collect(), max_duration_s: hours * 3600, surface_every: 0 }
    }

    /// The vehicle as the controller is configured for it.
    ///
    /// # Panics
    /// Never: the built-in settings are valid (tested in `control`).
    #[must_use]
    pub fn config(self) -> Config {
        let settings = match self {
            Self::Shallow => Settings::slocum_100(),
            Self::Sea => Settings::slocum_200(),
            Self::Deep => Settings::slocum_1000(),
        };
        Config::new(settings).expect("built-in settings are valid")
    }

    fn scenario(self, wings: Wings, disturbance: Disturbance, seed: u64) -> Scenario {
        let base = match self {
            Self::Shallow => Scenario::shallow(wings),
            Self::Sea => Scenario::sea(wings),
            Self::Deep => Scenario::deep(wings),
        };
        let mut s = Scenario { seed, ..base };
        match disturbance {
            Disturbance::Stratified if self == Self::Shallow => {
                s.ocean = Ocean::baltic();
                s.actuators = Actuators { pump: Pump::shallow_100(), ..s.actuators };
            }
            Disturbance::Stratified => s.ocean.profile = Profile::Baltic,
            Disturbance::InternalWaves => {
                s.effects.push(Effect { kind: EffectKind::InternalWave, value: 0.02, aux: Some(900.0) });
                s.ocean.background_rms_m_s = 0.003;
            }
            Disturbance::NoisySensors => s.sensors = s.sensors.worse(3.0),
            Disturbance::DragLevel(value) => s.effects.push(Effect { kind: EffectKind::DragLevelError, value, aux: None }),
            Disturbance::Hidden(kind) => s.effects.push(Effect { kind, value: kind.typical(), aux: None }),
            _ => {}
        }
        s
    }
}

/// (L/D)max and its α of the true vehicle, mean of dive and climb.
pub(crate) fn best(world: &World) -> (f64, f64) {
    let glide = |a: f64| {
        let (l, d) = world.lift_drag_area_m2(a);
        l.abs() / d
    };
    (1..1200)
        .map(|i| f64::from(i) * 0.0005)
        .map(|a| (0.5 * (glide(a) + glide(-a)), a))
        .fold((0.0, 0.0), |best, here| if here.0 > best.0 { here } else { best })
}

/// A flight table sampled from the plant's own polar, lift and drag scaled.
pub(crate) fn table_of(world: &World, wings: Wings, lift: f64, drag: f64) -> anyhow::Result<Vec<u8>> {
    let area = 0.1;
    let at = |a: f64| {
        let (up, down) = (world.lift_drag_area_m2(a), world.lift_drag_area_m2(-a));
        (lift * 0.5 * (up.0 - down.0) / area, drag * 0.5 * (up.1 + down.1) / area)
    };
    let (n, alpha_max) = TABLE;
    let samples: Vec<Sample> = (0..n)
        .map(|i| {
            let (cl, cd) = at(alpha_max * f64::from(i) / f64::from(n - 1));
            Sample { cl: if i == 0 { 0.0 } else { cl as f32 }, cd: cd as f32 }
        })
        .collect();
    let (_, best_alpha) = best(world);
    let (cl, cd) = at(best_alpha);
    let spec = Spec {
        wings,
        vehicle_id: 0,
        fit_id: 0,
        area_m2: area as f32,
        alpha_max_rad: alpha_max as f32,
        best_alpha_rad: best_alpha as f32,
        best_l_over_d: (cl / cd) as f32,
    };
    let bytes = polar::encode(&spec, &samples).map_err(|e| anyhow!("table of the plant: {e:?}"))?;
    Ok(bytes.to_vec())
}

/// A controller in the loop.
enum Flier<'a> {
    Ours(Box<control::State>, Option<Table<'a>>),
    Stock(Box<control::stock::State>),
}

impl Flier<'_> {
    fn step(&mut self, config: &Config, frame: &SensorFrame) -> Answer {
        match self {
            Self::Ours(state, table) => control::step(config, table.as_ref(), state, frame.time, frame),
            Self::Stock(state) => control::stock::step(config, state, frame.time, frame),
        }
    }
}

/// Flies one case.
///
/// # Errors
/// A scenario the plant refuses, a table that does not parse.
pub fn fly(case: Case) -> anyhow::Result<Score> {
    fly_with(case, &case.band.config())
}

/// Flies one case with another configuration of the controller.
///
/// # Errors
/// As [`fly`].
pub fn fly_with(case: Case, config: &Config) -> anyhow::Result<Score> {
    fly_mission(case, config, &case.band.mission(case.wings))
}

/// Flies one case with another mission than its band's.
///
/// # Errors
/// As [`fly`].
pub fn fly_mission(case: Case, config: &Config, mission: &Mission) -> anyhow::Result<Score> {
    let scenario = case.band.scenario(case.wings, case.disturbance, case.seed);
    let nominal = World::new(Scenario { effects: Vec::new(), ..scenario.clone() }).map_err(|e| anyhow!(e)).context("nominal world")?;
    let mut world = World::new(scenario).map_err(|e| anyhow!(e)).context("world")?;
    let bytes = match case.disturbance {
        Disturbance::BuiltInTable | Disturbance::DragLevel(_) => None,
        Disturbance::TableLift(f) => Some(table_of(&nominal, case.wings, f, 1.0)?),
        Disturbance::TableDrag(f) => Some(table_of(&nominal, case.wings, 1.0, f)?),
        _ => Some(table_of(&nominal, case.wings, 1.0, 1.0)?),
    };
    let flier = match case.pilot {
        Pilot::Stock => Flier::Stock(Box::new(control::stock::State::new(config, mission.clone(), Micros(0)))),
        Pilot::Ours => {
            let table = match &bytes {
                Some(b) => Table::parse(b, case.wings),
                None => polar::builtin(case.wings),
            };
            let table = table.map_err(|e| anyhow!("flight table: {e:?}"))?;
            Flier::Ours(Box::new(control::State::new(config, mission.clone(), Micros(0))), Some(table))
        }
    };
    Ok(judge(case, config, mission, &mut world, flier))
}

fn judge(case: Case, config: &Config, mission: &Mission, world: &mut World, mut flier: Flier<'_>) -> Score {
    let mut watch = Watch::new(case, mission, world);
    let mut was = world.truth();
    let start_j = was.energy.total_j();
    let limit = f64::from(mission.max_duration_s) + 7200.0;
    while world.time_s() < limit {
        let frame = world.sense();
        let answer = flier.step(config, &frame);
        let phase = answer.trace.phase;
        world.observe_phase(phase);
        world.advance(&answer.command, CYCLE_S);
        let now = world.truth();
        watch.score.abort = answer.trace.abort;
        watch.score.dives = answer.trace.dives;
        if phase == Phase::Done || (phase == Phase::Safe && now.at_surface) {
            watch.score.done = phase == Phase::Done;
            break;
        }
        let under_way = matches!(phase, Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh) && now.depth_m > 0.3;
        if under_way {
            watch.glide(&was, &now);
        }
        watch.turn(&now, &answer, under_way);
        watch.depth(&was, &now, under_way);
        was = now;
    }
    watch.finished(world.truth().energy.total_j() - start_j)
}

/// Flies many cases on all cores; `tick` is called after each.
///
/// # Errors
/// The first case that cannot be flown.
pub fn fly_all(cases: &[Case], tick: impl Fn() + Sync) -> anyhow::Result<Vec<Score>> {
    cases
        .par_iter()
        .map(|&c| {
            let score = fly(c);
            tick();
            score
        })
        .collect()
}

/// Every combination, ours and stock beside each other.
#[must_use]
pub fn cases(wings: &[Wings], bands: &[Band], disturbances: &[Disturbance], seed: u64) -> Vec<Case> {
    let mut all = Vec::new();
    for &band in bands {
        for &disturbance in disturbances {
            for &wings in wings {
                for pilot in [Pilot::Ours, Pilot::Stock] {
                    all.push(Case { wings, band, disturbance, pilot, seed });
                }
            }
        }
    }
    all
}
