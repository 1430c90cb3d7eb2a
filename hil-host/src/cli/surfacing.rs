//! `glider surfacing`.

use super::{Output, Verdict};
use crate::terminal::say;
use anyhow::Context;
use logs::record::bounded;
use rig::flight::surfacing::{document, read, rows};
use serde_json::json;
use signals::{Switch, Weight};
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider surfacing 6956a0c4.srf
  glider surfacing call.log --json
  glider surfacing out/parts/shore.srf

A board in a Slocum's science bay says at every surfacing how it is and how it glided, in 54 bytes: a
file .srf among the logs of the science computer, and a line `surfacing,...` on the glider's terminal.
FILE is such a file, several of them in one, or the log of a terminal. A board with a radio of its own
sends the same: `glider fly --seat parts --log DIR` leaves them in DIR/shore.srf. Way in depth stands beside what
the controller's table says of the same glides: where they differ, the vehicle is not that of its table.

Exit code: 0 all is well, 1 an abort, a leak, a released weight or a damaged message, 2 bad input.")]
pub struct Args {
    /// A file of messages, or the log of a glider's terminal.
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let name = args.file.display().to_string();
    let bytes = bounded::bytes(&args.file, bounded::LOG).with_context(|| format!("{name}: cannot read"))?;
    let received = read(&bytes).with_context(|| name.clone())?;
    let messages: Vec<_> = received.messages.iter().map(|(place, message)| document(place, message)).collect();
    let damaged: Vec<_> = received.damaged.iter().map(|(place, why)| json!({ "place": place, "why": why })).collect();
    output.emit(&json!({ "file": name, "messages": messages, "damaged": damaged }), || {
        for (place, message) in &received.messages {
            rows(place, message).iter().for_each(|row| say(row));
            println!();
        }
        received.damaged.iter().for_each(|(place, why)| say(&format!("{place}: damaged ({why})")));
    });
    let bad = received.messages.iter().any(|(_, m)| m.abort.is_some() || m.leak == Switch::Alarm || m.weight == Weight::Released);
    Ok(if bad || !received.damaged.is_empty() { Verdict::Negative } else { Verdict::Ok })
}
