//! The main job: both wing sets fly the paper's lake mission through the best
//! seat there is, and a real flight is compared with the steady model.

use anyhow::{Context, anyhow};
use discovery::steady::{SteadyReport, steady_report};
use plant::World;
use rig::flight::closed_loop::{Outcome, Setup, fly};
use rig::flight::mission_file::{built_in, wings_name};
use rig::flight::recorder::Recorder;
use rig::flight::worlds;
use rig::seats::{self, Choice, qemu};
use serde_json::{Value, json};
use signals::{Mission, Phase, Wings};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Everything the main job found.
pub struct Findings {
    /// Seat used, as [`Choice`].
    pub seat: Choice,
    /// Why this one.
    pub why: String,
    /// One flight per wing set.
    pub flights: Vec<Flown>,
    /// The comparison.
    pub comparison: Comparison,
}

/// One flight.
pub struct Flown {
    /// Wings.
    pub wings: Wings,
    /// Which controller over which wire.
    pub seat: String,
    /// Result.
    pub outcome: Outcome,
    /// (L/D)max of the true vehicle, and its |α|, rad.
    pub best: plant::BestGlide,
    /// Where the log is.
    pub log: PathBuf,
    /// Traces for the page.
    pub trace: Trace,
}

/// Columns of a flight for plotting.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Depth, m.
    pub depth_m: Vec<f64>,
    /// Pitch, deg.
    pub pitch_deg: Vec<f64>,
    /// Pitch aimed at, deg.
    pub aimed_deg: Vec<f64>,
    /// Angle of attack, deg.
    pub alpha_deg: Vec<f64>,
    /// Ballast, cc.
    pub ballast_cc: Vec<f64>,
    /// |α| while gliding, deg.
    pub gliding_alpha_deg: Vec<f64>,
}

/// Steady model against a flight.
pub struct Comparison {
    /// Flight directory.
    pub flight: PathBuf,
    /// A real flight, or the one just simulated.
    pub real: bool,
    /// Why no real one.
    pub why_not: Option<String>,
    /// Errors.
    pub report: SteadyReport,
}

/// Picks the best seat on this machine and says why; builds the flight image if it is missing and can be built.
#[must_use]
pub fn best_seat(say: &mut dyn FnMut(&str)) -> (Choice, String) {
    if !qemu::is_installed() {
        return (Choice::Pty, "qemu-system-arm is not installed (Debian: apt install qemu-system-arm)".to_owned());
    }
    if qemu::find_image().is_err() {
        let script = Path::new("scripts/build-firmware");
        if script.is_file() {
            say("building the flight image (scripts/build-firmware)");
            let _ = Command::new(script).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
        }
    }
    match qemu::find_image() {
        Ok(image) => (Choice::Qemu, format!("QEMU and the flight image are there ({})", short(&image))),
        Err(_) => (
            Choice::Pty,
            "there is no flight image and it could not be built here (scripts/setup-target, then scripts/build-firmware)".to_owned(),
        ),
    }
}

fn short(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// Flies one wing set and logs it below `out`.
///
/// # Errors
/// The seat or the log failed.
pub fn fly_wings(wings: Wings, choice: &Choice, out: &Path, progress: &mut dyn FnMut(u16)) -> anyhow::Result<Flown> {
    let mission = Mission { wings, ..built_in("shallow").context("no mission called shallow")? };
    let log = free_folder(out, wings_name(wings));
    std::fs::create_dir_all(&log).with_context(|| format!("{}: cannot create", log.display()))?;
    let mut seat = seats::open(choice, None, Some(log.join("board.defmt")))?;
    let mut world = World::new(worlds::for_mission(&mission)).map_err(|e| anyhow!("{e}"))?;
    let best = world.best_glide();
    let setup = Setup::new(mission);
    let mut recorder = Recorder::create(&log, &world, &setup)?;
    let mut trace = Trace::default();
    let flown = fly(&mut world, &mut *seat, &setup, &mut |c| {
        progress(c.answer.trace.dives);
        trace.time_s.push(c.time_s);
        trace.depth_m.push(c.truth.depth_m);
        trace.pitch_deg.push(c.truth.pitch_rad.to_degrees());
        trace.aimed_deg.push(f64::from(c.answer.trace.pitch_setpoint_rad).to_degrees());
        // Afloat and at rest there is no angle of attack worth an axis of ±180°.
        let alpha_deg = c.truth.alpha_rad.to_degrees();
        trace.alpha_deg.push(if alpha_deg.abs() <= 45.0 { alpha_deg } else { f64::NAN });
        trace.ballast_cc.push(c.truth.ballast_m3 * 1e6);
        if matches!(c.answer.trace.phase, Phase::Dive | Phase::Climb) {
            trace.gliding_alpha_deg.push(c.truth.alpha_rad.abs().to_degrees());
        }
        recorder.push(c)
    });
    let outcome = match flown {
        Ok(outcome) => outcome,
        Err(e) => return Err(recorder.cut_short(anyhow!("{e}"))),
    };
    recorder.finish(
        json!({ "wings": wings_name(wings), "end": outcome.end.to_string(), "actuator_hash": format!("{:016x}", outcome.actuator_hash) }),
    )?;
    Ok(Flown { wings, seat: seat.describe(), outcome, best, log, trace })
}

/// `out/flights/NNN-name`, the first that is not taken.
fn free_folder(out: &Path, name: &str) -> PathBuf {
    let flights = out.join("flights");
    let taken = |n: u32| {
        std::fs::read_dir(&flights).is_ok_and(|d| d.flatten().any(|e| e.file_name().to_string_lossy() == format!("{n:03}-{name}")))
    };
    let n = (1..10_000).find(|n| !taken(*n)).unwrap_or(0);
    flights.join(format!("{n:03}-{name}"))
}

/// Compares a real flight with the steady model; a simulated one, marked as such, where there is no real one.
///
/// # Errors
/// Neither can be compared.
pub fn compare(cache: &Path, fallback: &Path) -> anyhow::Result<Comparison> {
    let why = match rig::flight::fetch::comet_2016(cache) {
        Ok(fetched) => {
            let flight = logs::record::csv::flight(&fetched.flight)?;
            return Ok(Comparison { report: steady_report(&flight)?, flight: fetched.flight, real: true, why_not: None });
        }
        Err(e) => format!("{e:#}"),
    };
    let flight = logs::record::csv::flight(fallback)?;
    Ok(Comparison { report: steady_report(&flight)?, flight: fallback.to_owned(), real: false, why_not: Some(why) })
}

impl Findings {
    /// The JSON document.
    #[must_use]
    pub fn document(&self, page: &Path) -> Value {
        let flights: Vec<Value> = self
            .flights
            .iter()
            .map(|f| {
                let o = &f.outcome;
                json!({ "wings": wings_name(f.wings), "dives": o.dives, "distance_m": o.distance_m, "duration_s": o.duration_s,
                    "achieved_l_over_d": o.achieved_l_over_d(), "max_l_over_d": f.best.l_over_d,
                    "share_of_max": o.achieved_l_over_d() / f.best.l_over_d, "max_depth_m": o.max_depth_m,
                    "pump_energy_j": o.energy_j.0, "energy_j": o.energy_j.1, "actuator_hash": format!("{:016x}", o.actuator_hash),
                    "end": o.end.to_string(), "log": f.log })
            })
            .collect();
        let c = &self.comparison;
        json!({ "seat": self.seat.to_string(), "seat_why": self.why, "flights": flights, "report": page,
            "comparison": { "flight": c.flight, "real": c.real, "why_not_real": c.why_not, "steady_rms_before_cm_s": c.report.before_cm_s,
                "steady_rms_cm_s": c.report.after_cm_s, "samples": c.report.samples, "identified": c.report.identified } })
    }
}
