//! A HIL flight shown while it flies, with buttons that break things.
//!
//! The flight runs on a thread of its own and goes on when the page is closed:
//! its log is on disk either way. Orders of the page (inject, recall) reach it
//! through a list that the closed loop empties once per control cycle.

use super::requests::Fit;
use super::{Sorry, Workbench};
use crate::score::{both_tables, story};
use anyhow::{Context, anyhow, bail};
use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use plant::World;
use rig::flight::closed_loop::{Order, Orders, Setup, fly as fly_closed_loop};
use rig::flight::cycle::Cycle;
use rig::flight::recorder::Recorder;
use rig::flight::{mission_file, worlds};
use rig::seats::{self, Choice, Seat};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Faults that the page offers: what a crew would want to see survived.
const BUTTONS: [(&str, &str); 8] = [
    ("Leak", "hull:leak"),
    ("Depth sensor stuck", "depth:stuck"),
    ("Pitch sensor off", "pitch:off"),
    ("Pump stuck", "pump:stuck"),
    ("Pump runs to sink", "pump:runaway=-1"),
    ("Battery mass stuck", "mass_motor:stuck"),
    ("Fin hard over", "fin_motor:runaway=1"),
    ("Vacuum lost", "hull:vacuum_loss"),
];

/// Longest pause between two batches of rows to the page.
const LONGEST_PAUSE: Duration = Duration::from_millis(200);

/// The flight under way, if any.
#[derive(Debug, Default)]
pub struct Live {
    under_way: AtomicBool,
    orders: Mutex<Orders>,
    /// Whether that flight was given orders.
    disturbed: AtomicBool,
    kept: Mutex<Kept>,
}

/// The lines of the last flight, for a page that is loaded again; clones share one list.
#[derive(Clone, Debug, Default)]
pub struct Kept(Arc<Mutex<Vec<Value>>>);

/// Most lines kept: five a second for two hours at a human's pace. What comes after is on disk only.
const MOST_KEPT: usize = 40_000;

impl Kept {
    /// One more.
    pub fn push(&self, line: &Value) {
        let mut lines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() < MOST_KEPT {
            lines.push(line.clone());
        }
    }
}

/// `GET /api/watch`.
#[derive(Debug, Deserialize)]
pub struct Watch {
    /// Number of the first line wanted.
    #[serde(default)]
    pub from: usize,
}

/// `POST /api/fly`.
#[derive(Debug, Deserialize)]
pub struct FlyRequest {
    wings: String,
    mission: String,
    seat: String,
    controller: String,
    /// Fly the mission that was planned after this open flight instead.
    #[serde(default)]
    planned: Option<usize>,
    /// World seconds per wall second; 0: as fast as it goes.
    #[serde(default)]
    pace: f64,
    #[serde(default)]
    seed: u64,
    /// Fly in the world that these effects of an open flight mean, first with the table of the vehicle as given, then with the new one.
    #[serde(default)]
    learnt: Option<Fit>,
}

/// `POST /api/fault`.
#[derive(Debug, Deserialize)]
pub struct FaultRequest {
    /// A fault as `glider fly --fault` takes it; it starts now.
    spec: String,
}

/// The faults the page offers, as JSON.
#[must_use]
pub fn fault_buttons() -> Value {
    BUTTONS.iter().map(|(label, spec)| json!({"label": label, "spec": spec})).collect()
}

impl Live {
    /// The lines of the flight under way, or of the last one, from a number on.
    #[must_use]
    pub fn watch(&self, from: usize) -> Value {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner).clone();
        // Asked before the lines are read: one more is then at most asked for in vain.
        let under_way = self.under_way.load(Ordering::Acquire);
        let lines = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
        json!({"under_way": under_way, "next": lines.len(), "lines": lines.get(from..).unwrap_or_default()})
    }

    fn order(&self, order: Order) -> anyhow::Result<()> {
        if !self.under_way.load(Ordering::Acquire) {
            bail!("no flight is under way: press Fly it first");
        }
        self.disturbed.store(true, Ordering::Release);
        self.orders.lock().unwrap_or_else(PoisonError::into_inner).give(order);
        Ok(())
    }

    /// Breaks something from the next control cycle on.
    ///
    /// # Errors
    /// No flight, or not a fault.
    pub fn inject(&self, request: &FaultRequest) -> anyhow::Result<Value> {
        let fault: plant::Fault = request.spec.parse().map_err(|e: String| anyhow!("{e}"))?;
        self.order(Order::Inject(fault))?;
        Ok(json!({"text": format!("Injected: {}", request.spec)}))
    }

    /// Calls the vehicle home.
    ///
    /// # Errors
    /// No flight.
    pub fn recall(&self) -> anyhow::Result<Value> {
        self.order(Order::Recall)?;
        Ok(json!({"text": "Recalled."}))
    }
}

/// Flies as the page asks; rows go out as they come.
///
/// # Errors
/// A flight is under way already.
pub async fn fly(State(bench): State<Arc<Workbench>>, Json(request): Json<FlyRequest>) -> Result<Response, Sorry> {
    if bench.live.under_way.swap(true, Ordering::AcqRel) {
        return Err(Sorry("a flight is under way: recall it, or wait for its end".into()));
    }
    let landed = Landed(bench.clone());
    let orders = Orders::default();
    bench.live.disturbed.store(false, Ordering::Release);
    *bench.live.orders.lock().unwrap_or_else(PoisonError::into_inner) = orders.clone();
    let kept = Kept::default();
    *bench.live.kept.lock().unwrap_or_else(PoisonError::into_inner) = kept.clone();
    let (lines, body) = super::lines();
    let lines = lines.kept(kept);
    super::streaming(lines, move |lines| {
        let _landed = landed;
        one_flight(&bench, &request, orders, lines)
    });
    Ok(Body::from_stream(body).into_response())
}

/// The sky is free again when this goes, also when the flight failed badly.
struct Landed(Arc<Workbench>);

impl Drop for Landed {
    fn drop(&mut self) {
        self.0.live.under_way.store(false, Ordering::Release);
    }
}

fn free_log(folder: &std::path::Path, wings: &str, mission: &str) -> anyhow::Result<PathBuf> {
    (1..10_000)
        .map(|i| folder.join(format!("{wings}-{mission}-{i}")))
        .find(|p| !p.exists())
        .with_context(|| format!("{}: ten thousand logs; move some away", folder.display()))
}

/// The mission that is asked for, and its name.
fn mission_of<'a>(bench: &Workbench, request: &'a FlyRequest) -> anyhow::Result<(&'a str, signals::Mission)> {
    if let Some(flight) = request.planned {
        let text = bench.flight(flight)?.planned()?;
        return Ok(("planned", mission_file::parse(&text, "the planned mission", worlds::limits)?));
    }
    // Only built-in names: no request reaches the file system by path.
    if !mission_file::BUILT_IN.contains(&request.mission.as_str()) {
        bail!("mission {}: one of {}", request.mission, mission_file::BUILT_IN.join(", "));
    }
    let mut mission = mission_file::load(&request.mission, worlds::limits)?;
    mission.wings = mission_file::parse_wings(&request.wings).with_context(|| format!("wings {}: standard or low-ar", request.wings))?;
    Ok((&request.mission, mission))
}

fn one_flight(bench: &Workbench, request: &FlyRequest, orders: Orders, lines: &super::Lines) -> anyhow::Result<()> {
    let choice = match request.seat.as_str() {
        "in-process" => Choice::InProcess,
        "pty" => Choice::Pty,
        "qemu" => Choice::Qemu,
        other => bail!("seat {other}: in-process, pty or qemu"),
    };
    let (name, mut mission) = mission_of(bench, request)?;
    let learnt = request.learnt.as_ref().map(|l| bench.learnt(l)).transpose()?;
    let mut scenario = match &learnt {
        Some(([_, (model, _)], _)) => {
            mission.wings = model.wings;
            story::world_of(model, &mission)
        }
        None => worlds::for_mission(&mission),
    };
    scenario.wings = mission.wings;
    scenario.seed = request.seed;
    let realtime = (request.pace > 0.0 && request.pace.is_finite()).then_some(request.pace.clamp(1e-3, 1e6));
    let tables: Vec<(&str, Option<&[u8]>)> = match &learnt {
        Some(([old, new], _)) => vec![("old table", Some(&old.1.bytes)), ("new table", Some(&new.1.bytes))],
        None => vec![("", None)],
    };
    if learnt.is_some() && request.controller == "stock" {
        bail!("the stock controller flies no table: choose ours");
    }
    let mut flown: Vec<Value> = Vec::new();
    for (pass, table) in tables {
        let mut seat = match (request.controller.as_str(), &choice) {
            ("ours", _) => seats::open(&choice, None, None)?,
            ("stock", Choice::InProcess) => Box::new(seats::stock::Stock::default()),
            ("stock", _) => bail!("the stock controller flies in the seat in-process only"),
            (other, _) => bail!("controller {other}: ours or stock"),
        };
        let log = free_log(&bench.logs, mission_file::wings_name(mission.wings), name)?;
        let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
        let setup = Setup { realtime, orders: orders.clone(), table: table.map(<[u8]>::to_vec), ..Setup::new(mission.clone()) };
        lines.send(&json!({"pass": pass}));
        flown.push(one_pass(&mut world, &mut *seat, &setup, &log, lines)?);
    }
    let mut summary = flown.last().cloned().unwrap_or_default();
    if let (Some((tables, vehicle)), [old, new]) = (&learnt, flown.as_slice()) {
        let ratio = |v: &Value| v["achieved_l_over_d"].as_f64().unwrap_or(f64::NAN);
        let tables = tables.each_ref().map(|(_, built)| built.bytes.as_slice());
        let progress = |done| lines.send(&json!({"worlds": done, "of": both_tables::WORLDS}));
        let draw = || both_tables::in_drawn_worlds(tables, &Setup::new(mission.clone()), &scenario, Some(vehicle), &progress);
        // Worlds that are drawn have no orders: they say nothing of a flight that was given some.
        let drawn = (!bench.live.disturbed.load(Ordering::Acquire)).then(draw);
        both_tables::add_to(&mut summary, old.clone(), [ratio(old), ratio(new)], drawn.as_ref());
    }
    lines.send(&summary);
    Ok(())
}

/// Flies once, with its log; the summary is written into the log and returned.
fn one_pass(world: &mut World, seat: &mut dyn Seat, setup: &Setup, log: &Path, lines: &super::Lines) -> anyhow::Result<Value> {
    let best = world.best_glide();
    let mut recorder = Recorder::create(log, world, setup)?;
    let mut rows = Vec::new();
    let mut sent = Instant::now();
    let seat_name = seat.describe();
    let out = fly_closed_loop(world, seat, setup, &mut |cycle| {
        rows.push(row(cycle, best.alpha_rad));
        if sent.elapsed() >= LONGEST_PAUSE || rows.len() >= 500 {
            lines.send(&json!({"rows": std::mem::take(&mut rows), "seat": seat_name}));
            sent = Instant::now();
        }
        recorder.push(cycle)
    });
    let out = match out {
        Ok(out) => out,
        Err(e) => return Err(recorder.cut_short(anyhow!("{e}"))),
    };
    lines.send(&json!({"rows": rows, "seat": seat_name}));
    let summary = json!({
        "end": out.end.to_string(), "dives": out.dives, "distance_m": out.distance_m, "achieved_l_over_d": out.achieved_l_over_d(),
        "max_l_over_d": best.l_over_d, "log": log.display().to_string(), "actuator_hash": format!("{:016x}", out.actuator_hash),
        "table_id": format!("{:08x}", out.table_id),
    });
    recorder.finish(summary.clone())?;
    Ok(summary)
}

fn row(cycle: &Cycle<'_>, best_alpha_rad: f64) -> Value {
    let (t, trace, command) = (cycle.truth, &cycle.answer.trace, &cycle.answer.command);
    let degrees = |rad: f64| (rad.to_degrees() * 100.0).round() / 100.0;
    json!({
        "t": (cycle.time_s * 10.0).round() / 10.0, "depth": (t.depth_m * 100.0).round() / 100.0, "pitch": degrees(t.pitch_rad),
        "setpoint": degrees(f64::from(trace.pitch_setpoint_rad)), "ballast": (f64::from(command.ballast_m3) * 1e5 * 100.0).round() / 100.0,
        "alpha": degrees(t.alpha_rad), "alpha_estimate": degrees(f64::from(trace.alpha_rad)),
        "alpha_best": degrees(best_alpha_rad.copysign(t.alpha_rad)), "phase": format!("{:?}", trace.phase),
        "abort": trace.abort.map(|a| format!("{a:?}")), "table": format!("{:08x}", trace.table_id),
        "link": format!("frame {}", cycle.frame.seq), "east": t.east_m.round(), "north": t.north_m.round(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_button_is_a_fault() {
        for (label, spec) in BUTTONS {
            assert!(spec.parse::<plant::Fault>().is_ok(), "{label}: {spec}");
        }
    }

    #[test]
    fn orders_without_a_flight_are_refused() {
        let live = Live::default();
        assert!(live.recall().is_err());
        assert!(live.inject(&FaultRequest { spec: "hull:leak".into() }).is_err());
    }
}
