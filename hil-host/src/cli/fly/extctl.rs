//! `glider fly --seat extctl`: the controller as a Slocum's backseat, against a simulated front seat.

use super::super::{Output, Verdict};
use super::{Args, summary_head};
use crate::terminal::{fitted, say};
use anyhow::{Context, ensure};
use frontseat::board::{OnPort, SAYS_SOMETHING, Standing, Terminal};
use frontseat::flight::{Outcome, Trial, ini};
use frontseat::mission::Pilot;
use indicatif::ProgressBar;
use plant::Scenario;
use rig::flight::worlds;
use rig::seats::qemu_backseat::QemuBackseat;
use rig::seats::{Choice, port, qemu};
use serde_json::json;
use signals::Mission;
use std::path::Path;

/// What no backseat can do, said before it flies.
pub const CANNOT: &str = "a backseat cannot drop the weight or switch the beacon on: it asks for the emergency surfacing (mode bit 2), and the \
                          glider's own aborts do the rest; it starts no mission and overrides no abort";

/// Flies a board on a port in real time: says at once what is waited for and for how long, then how far the flight is.
fn on_port(args: &Args, name: &str, port: Box<dyn serialport::SerialPort>, trial: &Trial) -> anyhow::Result<Outcome> {
    let wait_s = SAYS_SOMETHING.as_secs();
    say_aside(&format!(
        "Waiting up to {wait_s} s for the backseat on {name} to speak ({} baud; the simulated front seat calls it, Ctrl-C ends).",
        args.baud
    ));
    let bar = ProgressBar::new_spinner();
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    let mut spoke = false;
    let mut board = OnPort::new(name, port, |standing| match standing {
        Standing::Silent { left } => bar.set_message(format!("{name}: silent, {} s left", left.as_secs_f64().ceil())),
        Standing::Speaking(since) => {
            if !std::mem::replace(&mut spoke, true) {
                bar.suspend(|| say_aside(&format!("{name}: the board speaks. It is flown in real time.")));
            }
            let s = since.as_secs();
            bar.set_message(format!("{name}: flown for {}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60));
        }
    });
    let flown = trial.over_the_line(&mut board, |setup| setup.baud = f64::from(args.baud));
    drop(board);
    bar.finish_and_clear();
    flown
}

/// Prints lines that fit the terminal beside the result.
fn say_aside(text: &str) {
    eprintln!("{}", fitted(text));
}

fn write_files(dir: &Path, trial: &Trial, out: &Outcome) -> anyhow::Result<()> {
    std::fs::create_dir_all(dir).with_context(|| format!("{}: cannot create this directory", dir.display()))?;
    let line: String = out.taken.iter().map(|(t, body)| format!("{t:10.2} {body}\n")).collect();
    let texts = [
        ("backseat.mi", trial.mission_text(Pilot::Backseat)),
        ("extctl.ini", ini(trial.list())),
        ("said.txt", line),
        ("frontseat.log", out.log.join("\n") + "\n"),
    ];
    let texts = texts.iter().map(|(name, text)| (*name, text.as_bytes()));
    for (name, content) in texts.chain(out.files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice()))) {
        // A name that comes over the line is no path.
        let path = dir.join(Path::new(name).file_name().unwrap_or_default());
        ensure!(!path.exists(), "{}: exists already; name a new directory", path.display());
        std::fs::write(&path, content).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Runs the flight of `glider fly --seat extctl`, or with `--extctl` of a board on a port or of its image in QEMU.
///
/// # Errors
/// Bad input, or the line is gone.
pub fn run(args: &Args, output: &Output, mission: &Mission, scenario: &Scenario, choice: &Choice) -> anyhow::Result<Verdict> {
    ensure!(
        args.controller == "ours" && args.table.is_none() && args.config.is_none(),
        "--seat extctl flies our law with its built-in table"
    );
    say_aside(CANNOT);
    let trial = Trial { scenario: scenario.clone(), mission: mission.clone(), config: worlds::config(mission) };
    let (out, detail) = match choice {
        Choice::Port(name) => {
            let port = port::open(name, args.baud)?;
            (on_port(args, name, port, &trial)?, format!("board on {name}, simulated front seat in real time"))
        }
        Choice::Qemu => {
            let image = args.elf.clone().map_or_else(qemu::find_image, Ok)?;
            let mut board = QemuBackseat::start(&image, mission, &trial.config)?;
            (trial.over_the_line(&mut board, |_| ())?, "the flight image in QEMU, simulated front seat".to_owned())
        }
        _ => {
            let mut terminal = Terminal::start(trial.board()?)?;
            let name = terminal.name.clone();
            (trial.over_the_line(&mut terminal, |_| ())?, format!("controller behind {name}, simulated front seat"))
        }
    };
    if let Some(dir) = &args.log {
        write_files(dir, &trial, &out)?;
    }
    let own = if mission.legs.len() == 1 { Some(trial.own_servo()?.share()) } else { None };
    let frames = trial.frames_share()?;
    let mut document = summary_head(args, mission, &detail);
    let round = |x: f64| (x * 1e4).round() / 1e4;
    let more = json!({
        "dives": out.dives, "distance_m": round(out.way_m.0), "duration_s": round(out.duration_s), "max_depth_m": round(out.max_depth_m),
        "max_l_over_d": round(out.best), "share_of_max": round(out.share()), "share_of_max_own_servo": own.map(round),
        "share_of_max_frames_seat": round(frames), "energy_j": round(out.energy_j), "home": out.home,
        "front_seat": format!("{:?}", out.doing), "front_seat_abort": out.aborted.map(|a| format!("{a:?}")), "log": args.log,
        "cannot": CANNOT,
    });
    if let (Some(document), Some(more)) = (document.as_object_mut(), more.as_object()) {
        document.extend(more.clone());
    }
    output.emit(&document, || {
        say(&format!("{} — {detail}", args.mission));
        say(&format!(
            "home           {}, front seat: {:?}{}",
            out.home,
            out.doing,
            out.aborted.map_or(String::new(), |a| format!(" after {a:?}"))
        ));
        say(&format!("dives          {} in {:.0} s, deepest {:.1} m", out.dives, out.duration_s, out.max_depth_m));
        say(&format!(
            "share of (L/D)max over the line {:.3}, frames seat {frames:.3}, front seat's own servo {}",
            out.share(),
            own.map_or("-".into(), |s| format!("{s:.3}"))
        ));
        if let Some(dir) = &args.log {
            let messages = out.files.len();
            say(&format!("files          {} (backseat.mi, extctl.ini, what the board said)", dir.display()));
            say(&format!("               {messages} messages of surfacings (.srf): glider surfacing FILE"));
        }
    });
    Ok(if out.home && out.aborted.is_none() { Verdict::Ok } else { Verdict::Negative })
}
