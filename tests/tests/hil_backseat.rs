//! The flight image in QEMU as a Slocum's backseat, against the controller built for this computer behind a pseudo-terminal: the same
//! simulated front seat hears the same bytes from both.

use control::{Config, Settings};
use frontseat::board::Terminal;
use frontseat::flight::{Backseat, Event, Outcome, Setup, Trial};
use hil_host::seats::qemu;
use hil_host::seats::qemu_backseat::QemuBackseat;
use plant::Scenario;
use signals::{Micros, Mission, Wings};
use std::path::PathBuf;

fn image() -> Option<PathBuf> {
    match qemu::find_image() {
        Ok(image) if qemu::is_installed() => Some(image),
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
    scenario.sensors.depth_density_kg_m3 = Some(f64::from(bay::aboard::DENSITY_KG_M3));
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
    let image = image()?;
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

/// Dives 3–27 m.
#[test]
fn hil_the_image_as_a_backseat_orders_what_the_host_built_one_orders() {
    let Some(out) = same(Wings::Standard, 1, |_| ()) else { return };
    assert!(out.home && out.aborted.is_none() && out.dives == 1, "{:?} {:?} {}", out.doing, out.aborted, out.dives);
}

/// A glider that is silent for 70 s in a dive: both give up the mission at the same moment.
#[test]
#[ignore = "a minute"]
fn hil_the_image_gives_up_a_silent_glider_as_the_host_built_one_does() {
    let Some(out) = same(Wings::LowAspectRatio, 2, |setup| {
        setup.events = vec![(400.0, Event::GliderSilent(true)), (700.0, Event::GliderSilent(false))];
    }) else {
        return;
    };
    assert!(out.home && out.taken.iter().any(|(_, body)| body == "MD,67,2"));
}

/// Both wings, all four dives of the shallow mission.
#[test]
#[ignore = "minutes"]
fn hil_both_wings_fly_the_shallow_mission_on_the_image() {
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let Some(out) = same(wings, Mission::default().legs[0].dives, |_| ()) else { return };
        assert!(out.home && out.aborted.is_none() && out.dives == 4 && out.share() > 0.85, "{:?} {}", out.doing, out.share());
    }
}
