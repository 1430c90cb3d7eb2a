//! What the measurements share: a mission, a simulated log of any length, and
//! the table of results.
//!
//! Everything here is simulated, so that every machine measures the same;
//! real flights take part where `GLIDER_FLIGHTS` names a folder that has them.
//!
//! | measured by | what | result |
//! |---|---|---|
//! | `cargo bench -p benches` | everything on this machine | `criterion/`, `performance/speed.tsv` below the target folder |
//! | `benches/on-target/run` | instructions, flash, RAM and stack on the board, and of two alternatives | `performance/on-target.tsv` |
//! | `benches/peers/run` | other people's tools on the same data | `performance/peers.tsv` |
//! | `benches/run --docs` | all of them | the table in docs/performance.md |

use anyhow::{Context, anyhow};
use logs::{Flight, Vehicle};
use plant::{Effect, EffectKind, World};
use rig::flight::closed_loop::{Outcome, Setup, fly};
use rig::flight::recorder::Recorder;
use rig::flight::{mission_file, worlds};
use rig::seats::in_process::InProcess;
use rig::seats::{Link, Seat};
use rustix::time::{ClockId, clock_gettime};
use serde_json::json;
use signals::{Leg, Mission, SensorFrame};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// CPU time of this thread so far. What is bound by computing is measured in it, so that other work on the machine does not
/// count; what waits for another thread or program is measured by the wall clock.
#[must_use]
pub fn cpu_time() -> Duration {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(t.tv_sec.unsigned_abs(), u32::try_from(t.tv_nsec).unwrap_or(0))
}

/// The built-in shallow mission: four dives of 3–27 m.
///
/// # Panics
/// Never: the mission is built in.
#[must_use]
pub fn shallow() -> Mission {
    mission_file::built_in("shallow").expect("a built-in mission")
}

/// Flies a mission in the calm world that belongs to it.
///
/// # Errors
/// The seat failed.
pub fn flown(mission: &Mission, seat: &mut dyn Seat) -> anyhow::Result<Outcome> {
    let mut world = World::new(worlds::for_mission(mission)).map_err(|e| anyhow!("{e}"))?;
    fly(&mut world, seat, &Setup::new(mission.clone()), &mut |_| Ok(())).map_err(|e| anyhow!("{e}"))
}

/// What the controller sees in the shallow mission, cycle by cycle.
///
/// # Errors
/// The flight failed.
pub fn frames() -> anyhow::Result<Vec<SensorFrame>> {
    let mission = shallow();
    let mut world = World::new(worlds::for_mission(&mission)).map_err(|e| anyhow!("{e}"))?;
    let mut frames = Vec::new();
    let mut keep = |c: &rig::flight::cycle::Cycle<'_>| {
        frames.push(*c.frame);
        Ok(())
    };
    fly(&mut world, &mut Link::new(InProcess::default()), &Setup::new(mission), &mut keep).map_err(|e| anyhow!("{e}"))?;
    Ok(frames)
}

/// Folder below the system's temporary one for files that measurements read again.
#[must_use]
pub fn scratch() -> PathBuf {
    std::env::temp_dir().join(format!("glider-benches-{}", std::process::id()))
}

/// Drag that a glider has more in climbs than its model says: named by a diagnosis.
#[must_use]
pub fn hidden() -> Effect {
    Effect { value: 0.4, ..Effect::typical(EffectKind::ClimbDrag) }
}

/// A log of a glider with this effect, which its model lacks: flights of 40 dives one after the other, a row each 4 s, until it
/// has `hours`.
///
/// # Errors
/// A flight failed, or the disk did.
pub fn log(hours: f64, hidden: Option<Effect>) -> anyhow::Result<(Flight, Vehicle)> {
    let mut mission = shallow();
    mission.legs.clear();
    let _ = mission.legs.push(Leg { dives: 40, ..Leg::default() });
    mission.max_duration_s = 24 * 3600;
    let mut scenario = worlds::for_mission(&mission);
    scenario.effects = hidden.into_iter().collect();
    scenario.ocean.background_rms_m_s = 0.003;
    let mut out: Option<(Flight, Vehicle)> = None;
    for seed in 0.. {
        let folder = scratch().join(format!("log-{seed}"));
        scenario.seed = seed;
        let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
        let setup = Setup::new(mission.clone());
        let mut recorder = Recorder::create(&folder, &world, &setup)?;
        let seat = &mut Link::new(InProcess::default());
        fly(&mut world, seat, &setup, &mut |c| recorder.push(c)).map_err(|e| anyhow!("{e}"))?;
        recorder.finish(json!({}))?;
        let flight = logs::record::csv::flight(&folder)?;
        let whole = match &mut out {
            Some((whole, _)) => {
                append(whole, &flight);
                whole
            }
            None => {
                let mut vehicle = logs::vehicle::read(&folder.join("vehicle.json"))?;
                (vehicle.fit_segments, vehicle.check_segments) = (Vec::new(), Vec::new());
                &mut out.insert((flight, vehicle)).0
            }
        };
        std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let under_way = whole.time_s.last().copied().unwrap_or(0.0) - whole.time_s.first().copied().unwrap_or(0.0);
        if under_way >= 3600.0 * hours {
            cut(whole, 3600.0 * hours);
            break;
        }
    }
    out.context("no flight")
}

/// Every column of a flight with its counterpart in another.
fn columns<'a>(a: &'a mut Flight, b: &'a Flight) -> Vec<(&'a mut Vec<f64>, &'a [f64])> {
    let mut all: Vec<(&mut Vec<f64>, &[f64])> = vec![
        (&mut a.pressure_pa, &b.pressure_pa),
        (&mut a.pitch_rad, &b.pitch_rad),
        (&mut a.roll_rad, &b.roll_rad),
        (&mut a.heading_rad, &b.heading_rad),
        (&mut a.ballast_m3, &b.ballast_m3),
        (&mut a.battery_mass_m, &b.battery_mass_m),
        (&mut a.temperature_degc, &b.temperature_degc),
        (&mut a.density_kg_m3, &b.density_kg_m3),
        (&mut a.gps_east_m, &b.gps_east_m),
        (&mut a.gps_north_m, &b.gps_north_m),
    ];
    if let (Some(a), Some(b)) = (&mut a.speed_m_s, &b.speed_m_s) {
        all.push((a, b));
    }
    all.extend(a.extra.iter_mut().filter_map(|(name, column)| Some((column, b.extra.get(name)?.as_slice()))));
    all
}

/// Joins a flight ten minutes after the end of another.
fn append(whole: &mut Flight, next: &Flight) {
    let shift = whole.time_s.last().copied().unwrap_or(0.0) - next.time_s.first().copied().unwrap_or(0.0) + 600.0;
    let segments = whole.segment.last().copied().unwrap_or(0) + 1;
    whole.time_s.extend(next.time_s.iter().map(|t| t + shift));
    whole.segment.extend(next.segment.iter().map(|s| s + segments));
    for (to, from) in columns(whole, next) {
        to.extend_from_slice(from);
    }
}

/// The first `seconds` of a flight.
fn cut(flight: &mut Flight, seconds: f64) {
    let start = flight.time_s.first().copied().unwrap_or(0.0);
    let rows = flight.time_s.partition_point(|t| t - start <= seconds);
    flight.time_s.truncate(rows);
    flight.segment.truncate(rows);
    for (column, _) in columns(flight, &Flight::default()) {
        column.truncate(rows);
    }
    flight.extra.values_mut().for_each(|c| c.truncate(rows));
    if let Some(speed) = &mut flight.speed_m_s {
        speed.truncate(rows);
    }
}

/// One measured number: median, lower and upper end of what was seen, unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Median, or the number itself where it is the same every time.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit.
    pub unit: String,
}

/// Where results go: `performance` below the target folder this program was built into.
#[must_use]
pub fn results() -> PathBuf {
    let exe = std::env::current_exe().unwrap_or_default();
    // …/target/release/deps/speed-…, or …/target/release/performance-table
    let target = exe.ancestors().find(|d| d.join("CACHEDIR.TAG").is_file()).map_or_else(|| PathBuf::from("target"), PathBuf::from);
    target.join("performance")
}

/// All numbers that have been measured, by name: `key <tab> value [<tab> low <tab> high] <tab> unit` in every `.tsv` of [`results`].
///
/// # Errors
/// A file cannot be read, or a line is none of ours.
pub fn figures() -> anyhow::Result<BTreeMap<String, Figure>> {
    let mut all = BTreeMap::new();
    for name in ["speed", "on-target", "peers"] {
        let path = results().join(format!("{name}.tsv"));
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        for line in text.lines() {
            let mut fields = line.split('\t');
            let figure = (|| {
                let key = fields.next()?.to_owned();
                let rest: Vec<&str> = fields.collect();
                let (unit, numbers) = rest.split_last()?;
                let numbers: Vec<f64> = numbers.iter().map(|n| n.parse().ok()).collect::<Option<_>>()?;
                let (value, low, high) = match numbers.as_slice() {
                    [v] => (*v, *v, *v),
                    [v, l, h] => (*v, *l, *h),
                    _ => return None,
                };
                Some((key, Figure { value, low, high, unit: (*unit).to_owned() }))
            })();
            let (key, figure) = figure.with_context(|| format!("{}: `{line}` is no result", path.display()))?;
            all.insert(key, figure);
        }
    }
    Ok(all)
}
