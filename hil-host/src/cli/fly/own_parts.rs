//! `glider fly --seat parts`: the board on its own sensors and motors.

use super::super::{Output, Verdict};
use super::{Args, print, progress, summary, table_of, verdict};
use crate::terminal::say;
use anyhow::{Context, anyhow, ensure};
use parts::iridium::Fault;
use plant::{Scenario, World};
use rig::flight::closed_loop::Setup;
use rig::flight::recorder::Recorder;
use rig::flight::{config_file, own_parts};
use rig::seats::CYCLE_S;
use serde_json::json;
use signals::Mission;

/// File with what the shore received, beside the log.
const SHORE: &str = "shore.srf";
/// Longest time after the flight that the last message is waited for, s.
const TELL_S: f64 = 3_600.0;

/// Flies the mission.
///
/// # Errors
/// Bad input, or the board refuses.
pub fn run(args: &Args, output: &Output, mission: Mission, scenario: Scenario) -> anyhow::Result<Verdict> {
    ensure!(args.controller == "ours", "--controller stock flies in-process only; leave out --seat parts");
    ensure!(
        args.realtime.is_none() && args.first_table.is_none(),
        "--seat parts flies at its own pace and one table: leave out --realtime, --beside"
    );
    let mut setup = Setup::new(mission.clone());
    if let Some(path) = &args.config {
        setup.config = config_file::load(path)?;
    }
    setup.table = args.table.as_deref().map(|path| table_of(path, mission.wings)).transpose()?;
    let world = World::new(scenario).map_err(|e| anyhow!("{e}"))?;
    let mut recorder = match &args.log {
        Some(dir) => Some(Recorder::create(dir, &world, &setup)?),
        None => None,
    };
    let mut board = own_parts::board(world, &setup);
    let fault = Fault::ALL.into_iter().find(|(name, _)| *name == args.modem).map_or(Fault::Dead, |(_, fault)| fault);
    board.wire().fit_modem(fault);
    let bar = progress(&mission);
    let flown = own_parts::fly(
        &mut board,
        &setup,
        &mut |cycle| {
            bar.set_position(u64::from(cycle.answer.trace.dives));
            if ((cycle.time_s / CYCLE_S) as u64).is_multiple_of(64) {
                let t = &cycle.answer.trace;
                bar.set_message(format!("{:.0} s, {:?} at {:.1} m", cycle.time_s, t.phase, cycle.truth.depth_m));
            }
            recorder.as_mut().map_or(Ok(()), |r| r.push(cycle))
        },
        &mut |_| {},
    );
    bar.finish_and_clear();
    let out = match flown {
        Ok(out) => out,
        Err(e) => return Err(recorder.map_or(anyhow!("{e}"), |r| r.cut_short(anyhow!("{e}")))),
    };
    let board = board.wire();
    let mut document = summary(&out, &board.around.borrow().world, args, &mission, "the board's loop and drivers on models of its parts");
    let (said, whole, refused) = board.sentences();
    document["compass"] = json!({ "sentences": said, "whole": whole, "refused": refused });
    (document["resets"], document["watchdog_resets"]) = (json!(board.resets), json!(board.hangs));
    board.tell(TELL_S);
    let shore = board.shore();
    let tally = *board.radio();
    let file = args.log.as_ref().filter(|_| !shore.is_empty()).map(|dir| dir.join(SHORE));
    document["modem"] = json!({ "fault": args.modem, "at_shore": shore.len(), "sent": tally.sent, "failed": tally.failed,
        "why": tally.why.map(|why| format!("{why:?}")), "file": file });
    if let Some(path) = &file {
        let bytes: Vec<u8> = shore.iter().flat_map(|(_, message)| message.iter().copied()).collect();
        std::fs::write(path, bytes).with_context(|| format!("{}: cannot write", path.display()))?;
    }
    if let Some(r) = recorder {
        r.finish(document.clone())?;
    }
    output.emit(&document, || {
        say(&format!("compass        {whole} of {said} sentences whole, {refused} refused; {} resets", board.resets));
        say(&format!("modem          {} messages at the shore, {} tries failed", shore.len(), tally.failed));
        if let Some(path) = &file {
            say(&format!("               glider surfacing {}", path.display()));
        }
        print(&document, args);
    });
    Ok(verdict(&out, args))
}
