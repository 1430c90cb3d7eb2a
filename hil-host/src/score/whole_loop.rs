//! The whole circle in simulated worlds whose truth is known: fly, diagnose, add, new table, fly again.
//!
//! Our own controller flies a sweep of pitches and drives, its best glide among them, in the plant's sea, in which one thing is hidden.
//! Its log is diagnosed, what is named is added, the refitted vehicle gives a new table, and the controller flies the ordinary mission to
//! 200 m in that same world with the table of the vehicle as it was stated and with the new one. What anybody could have gained is what a
//! table of the true polar flies.
//!
//! The plant's force law, its ocean and the controller's learning in flight are all between a name and the range it is worth.

use crate::score::{control_law, story};
use anyhow::{Context as _, anyhow};
use control::PitchSensor;
use discovery::diagnosis::{Verdict, diagnose};
use discovery::hypotheses::search::Depth;
use discovery::workbench::add;
use logs::record::bounded;
use logs::record::csv;
use logs::{Vehicle, vehicle};
use plant::{Effect, EffectKind, Scenario, World};
use rayon::prelude::*;
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::mission_file::{built_in, wings_name};
use rig::flight::recorder::Recorder;
use rig::flight::tables::Built;
use rig::flight::vehicles::pitch_sensor;
use rig::flight::worlds;
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use serde::Serialize;
use signals::{Mission, Wings};
use std::path::Path;

/// Vertical motion of the water in every world, m/s rms (the format's sea).
const BACKGROUND_M_S: f64 = 0.004;
/// A world with one thing hidden in it, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Wings.
    pub wings: Wings,
    /// What is hidden.
    pub hidden: Option<EffectKind>,
    /// Its size, in medium sizes ([`EffectKind::typical`]).
    pub size: f64,
    /// Seed of the world.
    pub seed: u64,
}

/// What came of one circle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Closed {
    /// Which.
    pub case: Case,
    /// The diagnosis.
    pub verdict: &'static str,
    /// What was named and added.
    pub answer: Vec<String>,
    /// The answer is what is hidden, or one of its at most three classes is.
    pub in_class: bool,
    /// Block error on the segments that judge, m/s: as stated, recalibrated, with the answer.
    pub error_m_s: [f64; 3],
    /// Why there is no new table, where one was asked for.
    pub no_table: Option<String>,
    /// L/D flown with the table of the vehicle as stated, with that of the answer (the same where there is none), and with the truth's.
    pub l_over_d: [f64; 3],
}

impl Closed {
    /// Range with the new table over that with the old one, less 1.
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.l_over_d[1] / self.l_over_d[0] - 1.0
    }

    /// The same of a table of the true polar.
    #[must_use]
    pub fn possible_gain(&self) -> f64 {
        self.l_over_d[2] / self.l_over_d[0] - 1.0
    }
}

/// Every wing set with nothing hidden and with every effect the plant knows in each of the sizes. Each has a sea of its own: what one
/// sea does to a calibration would be counted in all.
#[must_use]
pub fn cases(sizes: &[f64], seed: u64) -> Vec<Case> {
    let of = |wings: Wings| {
        let hidden = EffectKind::ALL.iter().flat_map(move |&kind| sizes.iter().map(move |&size| (Some(kind), size)));
        std::iter::once((None, 0.0)).chain(hidden).map(move |(hidden, size)| Case { wings, hidden, size, seed })
    };
    let of_its_own = |(k, case): (usize, Case)| Case { seed: seed.wrapping_mul(1000).wrapping_add(k as u64), ..case };
    of(Wings::Standard).chain(of(Wings::LowAspectRatio)).enumerate().map(of_its_own).collect()
}

/// The sea of a case under a mission.
fn world(case: &Case, mission: &Mission) -> Scenario {
    let mut scenario = worlds::for_mission(mission);
    scenario.ocean.background_rms_m_s = BACKGROUND_M_S;
    scenario.effects = case.hidden.map(|kind| Effect { value: case.size * kind.typical(), ..Effect::typical(kind) }).into_iter().collect();
    scenario.seed = case.seed;
    scenario
}

/// Flies what is to be learned from and leaves the log in a folder.
fn record(case: &Case, folder: &Path) -> anyhow::Result<()> {
    let mission = Mission { wings: case.wings, ..built_in("sweep").context("no mission called sweep")? };
    let mut world = World::new(world(case, &mission)).map_err(|e| anyhow!("{e}"))?;
    let setup = Setup::new(mission);
    let mut recorder = Recorder::create(folder, &world, &setup)?;
    fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |c| recorder.push(c))?;
    recorder.finish(serde_json::json!({}))
}

/// What a tilt table would say of the pitch sensor of a world.
fn true_pitch_sensor(hidden: &[Effect]) -> PitchSensor {
    let of = |kind: EffectKind| hidden.iter().filter(|e| e.kind == kind).map(|e| e.value as f32).sum::<f32>();
    PitchSensor { zero_rad: of(EffectKind::PitchOffset), per_reading: 1.0 / (1.0 + of(EffectKind::PitchScale)) }
}

/// Flies one circle; its log is written below `folder` and removed.
///
/// # Errors
/// A world the plant refuses, a log that cannot be written or diagnosed, a flight that cannot be flown.
pub fn close(case: Case, folder: &Path) -> anyhow::Result<Closed> {
    let name = format!("{}-{}-{}", wings_name(case.wings), case.hidden.map_or("nothing", EffectKind::name), case.size);
    let log = folder.join(&name);
    record(&case, &log).with_context(|| name.clone())?;
    let flight = csv::flight(&log)?;
    let stated = vehicle::read(&log.join("vehicle.json"))?;
    let bytes = bounded::bytes(&stated.path, bounded::DOCUMENT)?;
    std::fs::remove_dir_all(&log).ok();
    let found = diagnose(&flight, &stated, Depth::Pairs, &|_, _| {}).with_context(|| name.clone())?;
    let named = matches!(found.verdict, Verdict::Explained | Verdict::Ambiguous);
    let hidden = case.hidden.map(EffectKind::name);
    let in_class = match hidden.filter(|_| case.hidden.is_some_and(EffectKind::is_catalogued)) {
        Some(hidden) => {
            let few = found.equivalent.len() <= crate::score::diagnosis::LARGEST_CLASS;
            named && (found.answer == [hidden] || few && found.equivalent.iter().any(|class| class == &[hidden]))
        }
        None if hidden.is_some() => found.verdict == Verdict::Unexplained,
        None => found.verdict == Verdict::Adequate,
    };

    let mission = story::mission(case.wings)?;
    let sea = world(&case, &mission);
    let old = story::table_of(&stated, &bytes)?;
    let mut no_table = None;
    let new = if named {
        let effects: Vec<_> = found.answer.iter().filter_map(|n| hydro::effects::by_name(n)).collect();
        let refitted = add::add(&flight, &stated, &effects, &bytes)?;
        let text = format!("{:#}\n", refitted.vehicle);
        let refitted: Vehicle = vehicle::parse_text(&text, &stated.path)?;
        let table = story::table_of(&refitted, text.as_bytes()).map_err(|e| no_table = Some(format!("{e:#}"))).ok();
        table.map(|t| (t, pitch_sensor(&refitted.effects)))
    } else {
        None
    };
    let truth = World::new(sea.clone()).map_err(|e| anyhow!("{e}"))?;
    let right = Built { bytes: control_law::table_of(&truth, case.wings, 1.0, 1.0)?, ..old.clone() };
    let flown = |(table, sensor): (Built, PitchSensor)| -> anyhow::Result<f64> {
        Ok(story::fly_with(table, sensor, &sea, &mission)?.outcome.achieved_l_over_d())
    };
    let before = flown((old, pitch_sensor(&stated.effects)))?;
    let after = new.map_or(Ok(before), flown)?;
    Ok(Closed {
        case,
        verdict: found.verdict.name(),
        answer: if named { found.answer.iter().map(ToString::to_string).collect() } else { Vec::new() },
        in_class,
        error_m_s: found.block_error_m_s,
        no_table,
        l_over_d: [before, after, flown((right, true_pitch_sensor(&sea.effects)))?],
    })
}

/// Flies many circles on all cores; `tick` is called after each.
///
/// # Errors
/// The first circle that cannot be closed.
pub fn close_all(cases: &[Case], folder: &Path, tick: impl Fn() + Sync) -> anyhow::Result<Vec<Closed>> {
    cases
        .par_iter()
        .map(|&case| {
            let closed = close(case, folder);
            tick();
            closed
        })
        .collect()
}
