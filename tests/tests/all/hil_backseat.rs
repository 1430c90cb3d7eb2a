//! The flight image in QEMU as a Slocum's backseat, against the controller built for this computer behind a pseudo-terminal: the same
//! simulated front seat hears the same bytes from both.

use control::{Config, Settings};
use frontseat::board::Terminal;
use frontseat::flight::{Backseat, Event, Outcome, Setup, Trial};
use plant::Scenario;
use rig::seats::qemu;
use rig::seats::qemu_backseat::QemuBackseat;
use signals::{Micros, Mission, Wings};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The image, and the right to run it: one at a time, two processors are few.
fn image() -> Option<(PathBuf, MutexGuard<'static, ()>)> {
    static ONE: Mutex<()> = Mutex::new(());
    match qemu::find_image() {
        Ok(image) if qemu::is_installed() => Some((image, ONE.lock().unwrap_or_else(PoisonError::into_inner))),
        _ => {
            eprintln!("SKIPPED LOUDLY: no image (scripts/build-firmware) or no {}", qemu::PROGRAM);
            None
        }
    }
}

fn trial(wings: Wings, dives: u16) -> Trial {
    let mut scenario = Scenario::shallow(wings);
    scenario.vehicle.crush_depth_m = 125.0;
    // That of the image: the glider's depth is reckoned with it on both sides.
    scenario.sensors.depth_density_kg_m3 = Some(f64::from(bay::backseat_role::DENSITY_KG_M3));
    let mut mission = Mission { wings, ..Mission::default() };
    mission.legs[0].dives = dives;
    Trial { scenario, mission, config: Config::new(Settings::slocum_100()).expect("valid") }
}

/// What a board said, and when.
struct Recorded<'a> {
    board: &'a mut dyn Backseat,
    said: Vec<(Micros, Vec<u8>)>,
}

impl Backseat for Recorded<'_> {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        let from = said.len();
        self.board.pass(now, heard, said)?;
        let new = said.get(from..).unwrap_or_default();
        if !new.is_empty() {
            self.said.push((now, new.to_vec()));
        }
        Ok(())
    }
}

fn flown(trial: &Trial, board: &mut dyn Backseat, change: impl FnOnce(&mut Setup)) -> (Outcome, Vec<(Micros, String)>) {
    let mut recorded = Recorded { board, said: Vec::new() };
    let out = trial.over_the_line(&mut recorded, change).expect("a flight");
    (out, recorded.said.into_iter().map(|(at, bytes)| (at, String::from_utf8_lossy(&bytes).into_owned())).collect())
}

/// Both fly; what they say must be the same at the same moments.
fn same(wings: Wings, dives: u16, change: impl Fn(&mut Setup)) -> Option<Outcome> {
    let (image, _one) = image()?;
    let trial = trial(wings, dives);
    let mut terminal = Terminal::start(trial.board().expect("a board")).expect("a terminal");
    let (host, host_said) = flown(&trial, &mut terminal, &change);
    let mut qemu = QemuBackseat::start(&image, &trial.mission, &trial.config).expect("the image in QEMU");
    let started = std::time::Instant::now();
    let (out, said) = flown(&trial, &mut qemu, &change);
    println!(
        "{wings:?}: {} dives in {:.0} s, share {:.3}; {} orders of the image, {} bytes, in {:.1} s",
        out.dives,
        out.duration_s,
        out.share(),
        out.taken.iter().filter(|(_, body)| body.starts_with("SW,0:")).count(),
        said.iter().map(|(_, text)| text.len()).sum::<usize>(),
        started.elapsed().as_secs_f64()
    );
    for (image, host) in said.iter().zip(&host_said) {
        assert_eq!(image, host, "{wings:?}: first difference");
    }
    assert_eq!(said.len(), host_said.len());
    assert_eq!((out.taken.len(), out.duration_s, out.share()), (host.taken.len(), host.duration_s, host.share()));
    Some(out)
}

#[test]
fn hil_the_image_as_a_backseat_orders_what_the_host_built_one_orders() {
    let Some(out) = same(Wings::Standard, 1, |_| ()) else { return };
    assert!(out.home && out.aborted.is_none() && out.dives == 1, "{:?} {:?} {}", out.doing, out.aborted, out.dives);
}

/// A glider that is silent for 300 s: both give up the mission at the same moment.
#[test]
fn hil_the_image_gives_up_a_silent_glider_as_the_host_built_one_does() {
    let Some(out) = same(Wings::LowAspectRatio, 2, |setup| {
        setup.events = vec![(250.0, Event::GliderSilent(true)), (550.0, Event::GliderSilent(false))];
    }) else {
        return;
    };
    assert!(out.home && out.taken.iter().any(|(_, body)| body == "MD,67,2"));
}

/// Both wings, all four dives of the shallow mission.
#[test]
#[ignore = "half a minute"]
fn hil_both_wings_fly_the_shallow_mission_on_the_image() {
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let Some(out) = same(wings, Mission::default().legs[0].dives, |_| ()) else { return };
        assert!(out.home && out.aborted.is_none() && out.dives == 4 && out.share() > 0.85, "{:?} {}", out.doing, out.share());
    }
}

/// A reset of the chip at a time.
struct WithReset {
    board: QemuBackseat,
    at: Option<Micros>,
}

impl Backseat for WithReset {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        if let Some(at) = self.at.take_if(|at| *at <= now) {
            println!("reset at {} s", at.0 / 1_000_000);
            self.board.reset(now)?;
        }
        self.board.pass(now, heard, said)
    }
}

#[test]
fn hil_a_reset_in_a_dive_comes_up_in_the_same_role_and_in_safe() {
    let Some((image, _one)) = image() else { return };
    let trial = trial(Wings::Standard, 2);
    let board = QemuBackseat::start(&image, &trial.mission, &trial.config).expect("the image in QEMU");
    let reset_s = 200.0;
    let (out, _) = flown(&trial, &mut WithReset { board, at: Some(Micros::from_secs(reset_s as u64)) }, |_| ());
    let after = |prefix: &str| -> Vec<(f64, String)> {
        out.taken.iter().filter(|(t, body)| *t > reset_s && body.starts_with(prefix)).cloned().collect()
    };
    let cc = |body: &str| body.strip_prefix("SW,0:").and_then(|b| b.split(',').next()).and_then(|v| v.parse::<f64>().ok());
    let before = out.taken.iter().rev().filter(|(t, _)| *t < reset_s).find_map(|(_, body)| cc(body));
    assert!(before.is_some_and(|cc| cc < -150.0), "it was in a dive: {before:?}");
    let orders = after("SW,0:");
    let first_s = orders.first().map_or(f64::INFINITY, |(t, _)| *t);
    assert!(first_s < reset_s + 30.0 && orders.iter().all(|(_, body)| cc(body).is_some_and(|cc| cc > 225.0)), "{first_s} {orders:?}");
    assert!(after("MD,67,2").len() > 2 && out.home, "{:?}", out.doing);
    let cause = format!("7:{}.000000", signals::Abort::Reset as u8);
    assert!(after("SW,5:").iter().all(|(_, body)| body.ends_with(&cause)), "{:?}", after("SW,5:").first());
}

#[test]
fn hil_a_reset_on_a_dead_line_gives_the_emergency_bit_within_64_s() {
    let Some((image, _one)) = image() else { return };
    let trial = trial(Wings::Standard, 2);
    let board = QemuBackseat::start(&image, &trial.mission, &trial.config).expect("the image in QEMU");
    let reset_s = 200.0;
    let mut board = WithReset { board, at: Some(Micros::from_secs(reset_s as u64)) };
    let (out, said) = flown(&trial, &mut board, |setup| setup.events = vec![(reset_s - 1.0, Event::GliderSilent(true))]);
    let emergency: Vec<f64> = out.taken.iter().filter(|(_, body)| body == "MD,67,2").map(|(t, _)| *t).collect();
    assert!(emergency.first().is_some_and(|t| (reset_s + 60.0..reset_s + 66.0).contains(t)), "{:?}", emergency.first());
    let written = said.iter().any(|(at, text)| at.0 as f64 * 1e-6 > reset_s + 5.0 && text.contains("$SW"));
    assert!(!written && out.home && out.aborted.is_none(), "{written} {:?} {:?}", out.doing, out.aborted);
}
