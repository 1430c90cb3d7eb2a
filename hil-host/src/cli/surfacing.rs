//! `glider surfacing`.

use super::{Output, Verdict};
use crate::packets::{Judge, vehicle_of_history};
use crate::terminal::{say, wrapped};
use anyhow::Context;
use discovery::history::file::History;
use discovery::history::flight::{Said, read as read_history};
use logs::Vehicle;
use logs::record::bounded;
use rig::flight::file_kinds::{Kind, expect};
use rig::flight::surfacing::{document, read, rows};
use rig::flight::{config_file, vehicles};
use serde_json::{Value, json};
use signals::{Flags, Surfacing, Switch, Weight};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider surfacing 6956a0c4.srf
  glider surfacing call.log --json
  glider surfacing out/parts/shore.srf
  glider surfacing mission.srf --history known.history --config controller.toml

A board in a Slocum's science bay says at every surfacing how it is and how it glided, in 54 bytes, or 163
with what its glides say of the vehicle's numbers: a file .srf among the logs of the science computer, and
lines `surfacing,...` on the glider's terminal. A history judges those numbers as diagnose does a log; with
--vehicle alone each surfacing is judged by the quiet ones before it in FILE.
FILE is such a file, several of them in one, or the log of a terminal. A board with a radio of its own
sends the same: `glider fly --seat parts --log DIR` leaves them in DIR/shore.srf. Way in depth stands beside what
the controller's table says of the same glides: where they differ, the vehicle is not that of its table.

Exit code: 0 all is well, 1 an abort, a leak, a released weight, a number that departs or a damaged message, 2 bad input.")]
pub struct Args {
    /// A file of messages, or the log of a glider's terminal.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// History of the vehicle that judges what the glides say, as calibrate writes it.
    #[arg(long, value_name = "FILE")]
    history: Option<PathBuf>,
    /// Vehicle file; default: the one that the history lies beside.
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Controller's configuration that the board flew with; default: its hull is that of the vehicle file.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
}

/// Who judges packets: a history, else the mission itself, with the file of the vehicle and the configuration that the board flew with.
pub(super) struct Judges {
    history: Option<(History, String)>,
    vehicle: Vehicle,
    board: Option<evidence::Vehicle>,
}

impl Judges {
    /// Reads the files; none where neither a history nor a vehicle is named.
    pub(super) fn read(history: Option<&Path>, vehicle: Option<&Path>, config: Option<&Path>) -> anyhow::Result<Option<Self>> {
        let read = history.map(read_history).transpose().map_err(|e| anyhow::anyhow!(e))?;
        let file = match (vehicle, history) {
            (Some(file), _) => file.to_path_buf(),
            (None, Some(history)) => vehicle_of_history(history)?,
            (None, None) => return Ok(None),
        };
        let history = read.zip(history.map(|h| h.display().to_string()));
        let board = config.map(config_file::load).transpose()?.map(|c| helm::glides::vehicle(&c));
        Ok(Some(Self { history, vehicle: vehicles::read(&file)?, board }))
    }

    /// What judges by them.
    pub(super) fn judge(&self) -> Judge<'_> {
        Judge { vehicle: &self.vehicle, history: self.history.as_ref().map(|(h, name)| (h, name.as_str())), board: self.board }
    }
}

/// The messages of files in their order, damaged ones left out; places name the file where there are several.
pub(super) fn messages(files: &[PathBuf]) -> anyhow::Result<Vec<(String, Surfacing)>> {
    let mut all = Vec::new();
    for file in files {
        let name = file.display().to_string();
        let bytes = bounded::bytes(file, bounded::LOG).with_context(|| format!("{name}: cannot read"))?;
        let found = read(&bytes).with_context(|| name.clone())?.messages;
        let placed = |place: String| if files.len() > 1 { format!("{name}, {place}") } else { place };
        all.extend(found.into_iter().map(|(place, message)| (placed(place), message)));
    }
    Ok(all)
}

/// A packet as JSON: each line is a row of R, then y.
fn packet(p: &evidence::Packet) -> Value {
    json!({ "vehicle": format!("{:08x}", p.vehicle_id), "start_s": p.start_s, "duration_s": p.duration_s, "rows": p.rows, "climbing": p.climbing,
        "refused": p.refused, "blocks": p.blocks, "directions": p.directions, "scatter": p.scatter, "variance": p.variance,
        "pitch_rad": p.pitch_rad, "roll_rad": p.roll_rad, "drive_m3": p.drive_m3, "deepest_pa": p.deepest_pa, "lines": p.lines })
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let name = args.file.display().to_string();
    let bytes = bounded::bytes(&args.file, bounded::LOG).with_context(|| format!("{name}: cannot read"))?;
    let received = read(&bytes).map_err(|e| expect(&args.file, Kind::Surfacings).err().unwrap_or_else(|| e.context(name.clone())))?;
    let judges = Judges::read(args.history.as_deref(), args.vehicle.as_deref(), args.config.as_deref())?;
    let said = judges.map_or_else(|| Ok(vec![None; received.messages.len()]), |j| j.judge().judge(&received.messages))?;
    let one = |((place, message), said): (&(String, Surfacing), &Option<Said>)| {
        let mut one = document(place, message);
        one["packet"] = message.packet.as_ref().and_then(|bytes| evidence::Packet::decode(bytes).ok()).as_ref().map_or(Value::Null, packet);
        one["judged"] = said.as_ref().map_or(Value::Null, Said::document);
        one
    };
    let messages: Vec<_> = received.messages.iter().zip(&said).map(one).collect();
    let damaged: Vec<_> = received.damaged.iter().map(|(place, why)| json!({ "place": place, "why": why })).collect();
    output.emit(&json!({ "file": name, "messages": messages, "damaged": damaged }), || {
        for ((place, message), said) in received.messages.iter().zip(&said) {
            rows(place, message).iter().for_each(|row| say(row));
            said.iter().for_each(|said| say(&wrapped(&said.words(), 0)));
            println!();
        }
        received.damaged.iter().for_each(|(place, why)| say(&format!("{place}: damaged ({why})")));
    });
    let departs = said.iter().flatten().any(|s| s.gate.is_none() && !s.judgement.is_quiet());
    let alarms =
        |m: &Surfacing| m.abort.is_some() || m.leak == Switch::Alarm || m.weight == Weight::Released || m.flags.contains(Flags::DEPARTS);
    let bad = departs || received.messages.iter().any(|(_, m)| alarms(m));
    Ok(if bad || !received.damaged.is_empty() { Verdict::Negative } else { Verdict::Ok })
}
