//! `glider replay`.

mod bisect;
mod stepping;

use super::fly::table_of;
use super::{Output, Verdict};
use crate::terminal::row;
use anyhow::ensure;
use indicatif::{ProgressBar, ProgressStyle};
use rig::flight::frames::Start;
use rig::flight::{config_file, mission_file, worlds};
use rig::replay::difference::{Difference, cause, watch};
use rig::replay::law::Law;
use rig::replay::play::{Played, play};
use rig::replay::record::Record;
use rig::replay::stepper::Stepper;
use serde_json::{Value, json};
use signals::Abort;
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider replay out/flight                              the law built here against what was flown
  glider replay out/flight --law firmware.elf           an image, in QEMU
  glider replay out/flight --law 3f2c1ab                the law of a commit, built from its sources
  glider replay out/flight --table new.bin              what it would order with another table
  glider replay out/flight --at 3600 --cycles 20 --watch 'est_depth_m - m_depth_m'
  glider replay out/flight --step                       go through it: seek, step, watch, until
  glider replay out/flight --bisect v0.3..main          which commit turned it
  glider replay out/flight --bisect a.bin,b.bin,c.bin   which table did
  glider replay flights/flight_1 --mission sea          read from a board's log by glider monitor

FLIGHT is a folder that glider fly --log has written, with any seat, or one read from the log of a board: the frames in it
(frames.bin) are stepped through a law again and every answer is compared bit by bit. The sensors are those of the record: after
the first order that differs the vehicle would have flown on differently, and `glider what-if` flies that.

Exit code: 0 equal in every bit, or a change was found; 1 it differs, or no change was found; 2 bad input.")]
pub struct Args {
    /// Folder of the flight, or its frames.bin.
    #[arg(value_name = "FLIGHT")]
    flight: PathBuf,
    /// Law that is asked: an image (ELF), a program, a commit; default: the one built here.
    #[arg(long, value_name = "ELF|PROGRAM|COMMIT")]
    law: Option<String>,
    /// Flight table (.bin) or vehicle file instead of the one that was flown.
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Mission that was flown, where the record does not hold it (a board's log).
    #[arg(long, value_name = "NAME|FILE")]
    mission: Option<String>,
    /// Controller configuration that was flown, where the record does not hold it.
    #[arg(long, value_name = "FILE", requires = "mission")]
    config: Option<PathBuf>,
    /// Show the cycles from this time on, s since the start.
    #[arg(long, value_name = "S")]
    at: Option<f64>,
    /// So many of them.
    #[arg(long, value_name = "N", default_value_t = 12, requires = "at", value_parser = super::count)]
    cycles: usize,
    /// An expression of signals that is shown too, such as 'est_depth_m - m_depth_m'.
    #[arg(long, value_name = "EXPRESSION")]
    watch: Vec<String>,
    /// Go through the flight by orders on standard input; `help` lists them.
    #[arg(long, conflicts_with_all = ["law", "bisect", "at"])]
    step: bool,
    /// Find the change: commits A..B, or laws and tables in order, with commas between them.
    #[arg(long, value_name = "A..B|FILE,FILE", conflicts_with_all = ["law", "table"])]
    bisect: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    ensure!(args.watch.is_empty() || args.step || args.at.is_some(), "--watch is shown with cycles: add --at SECONDS, or --step");
    let record = read(args)?;
    let table = args.table.as_deref().map(|path| table_of(path, record.start.mission.wings)).transpose()?;
    let table = table.as_deref().or(default_table(args, &record)?);
    if args.step {
        return stepping::at_a_prompt(&record, table, &args.watch);
    }
    if let Some(at_s) = args.at {
        return stepping::shown(&record, table, at_s, args.cycles, &args.watch, output);
    }
    if let Some(row) = &args.bisect {
        return bisect::run(row, &args.flight, &record, output);
    }
    let law = args.law.as_deref().map_or(Ok(Law::Here), Law::named)?;
    let bar = progress(&record);
    let played = play(&mut *law.open()?, &record, table, &mut |i, _| {
        if i.is_multiple_of(1000) {
            bar.set_position(i as u64);
        }
        true
    })?;
    bar.finish_and_clear();
    let watches = watches(&record, table, &law, &played)?;
    tell(args, &record, &law, &played, &watches, output);
    Ok(if played.is_equal() { Verdict::Ok } else { Verdict::Negative })
}

fn progress(record: &Record) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} cycles  {elapsed}").unwrap_or(ProgressStyle::default_bar());
    ProgressBar::new(record.steps.len() as u64).with_style(style)
}

fn read(args: &Args) -> anyhow::Result<Record> {
    let given = match &args.mission {
        Some(name) => {
            let mission = mission_file::load(name, worlds::limits)?;
            let config = args.config.as_deref().map_or_else(|| Ok(worlds::config(&mission)), config_file::load)?;
            Some(Start { settings: *config.settings(), mission, table: Vec::new() })
        }
        None => None,
    };
    Record::read(&args.flight, given)
}

/// The table that the record does not hold must be the one built in here.
fn default_table<'a>(args: &Args, record: &'a Record) -> anyhow::Result<Option<&'a [u8]>> {
    let Some(flown) = record.table_id().filter(|_| record.start.table.is_empty() && args.table.is_none()) else { return Ok(None) };
    let wings = record.start.mission.wings;
    let built_in = polar::builtin(wings).map_or(0, |t| t.id());
    ensure!(
        flown == built_in,
        "{}: flown with the table {flown:08x}, which is not in the record; this release has {built_in:08x} built in: name the flown one with --table",
        args.flight.display()
    );
    Ok(None)
}

/// Watches of the law built here that explain the first difference.
fn watches(record: &Record, table: Option<&[u8]>, law: &Law, played: &Played) -> anyhow::Result<Vec<String>> {
    let Some(first) = &played.first else { return Ok(Vec::new()) };
    // The law that was recorded, or the other one that was asked: both against the one built here.
    let recorded = record.steps.get(first.cycle).map(|s| s.answer);
    let other = if *law == Law::Here { recorded } else { Some(first.answer) };
    let Some(other) = other else { return Ok(Vec::new()) };
    Ok(Stepper::new(record, table)?.broken_alike(first.cycle, &other).into_iter().map(watch).collect())
}

fn abort_words(record: &Record, abort: Option<(usize, Abort)>) -> String {
    abort.map_or_else(|| "none".to_owned(), |(i, abort)| format!("{abort:?} at {:.0} s: {}", record.time_s(i), cause(abort)))
}

fn abort_document(record: &Record, abort: Option<(usize, Abort)>) -> Value {
    abort.map_or(Value::Null, |(i, abort)| json!({ "abort": format!("{abort:?}"), "time_s": record.time_s(i), "words": cause(abort) }))
}

/// The JSON of what came of a replay.
fn document(record: &Record, played: &Played, watches: &[String]) -> Value {
    let difference = |d: &Difference| json!({ "signal": d.signal, "recorded": d.recorded, "replayed": d.replayed });
    let first = played.first.as_ref().map(|f| {
        json!({ "cycle": f.cycle, "time_s": record.time_s(f.cycle), "signals": f.differences.iter().map(difference).collect::<Vec<_>>() })
    });
    json!({ "cycles": played.cycles, "differing": played.differing, "first": first, "watches": watches,
        "first_order_s": played.first_order.map(|i| record.time_s(i)),
        "aborts": { "recorded": abort_document(record, played.aborts[0]), "replayed": abort_document(record, played.aborts[1]) },
        "replayed_until_s": record.time_s(played.cycles.saturating_sub(1)), "ends": record.ends })
}

fn tell(args: &Args, record: &Record, law: &Law, played: &Played, watches: &[String], output: &Output) {
    let mut whole = json!({ "flight": args.flight, "law": law.describe(), "table": args.table,
        "table_id": record.table_id().map(|id| format!("{id:08x}")) });
    if let (Some(to), Value::Object(from)) = (whole.as_object_mut(), document(record, played, watches)) {
        to.extend(from);
    }
    output.emit(&whole, || {
        row("record", &format!("{} cycles in {:.1} h", record.steps.len(), record.time_s(record.steps.len() - 1) / 3600.0));
        row("law", &law.describe());
        rows(record, played, watches).iter().for_each(|(label, text)| row(label, text));
    });
}

/// What came of a replay, for a person.
fn rows(record: &Record, played: &Played, watches: &[String]) -> Vec<(&'static str, String)> {
    let mut rows = Vec::new();
    if let Some(ends) = &record.ends {
        rows.push(("replayed", format!("{} cycles; then {ends}", played.cycles)));
    }
    let Some(first) = &played.first else {
        rows.push(("result", format!("{} cycles equal in every bit", played.cycles)));
        return rows;
    };
    rows.push((
        "result",
        format!(
            "{} of {} cycles differ, the first is cycle {}, {:.0} s after the start",
            played.differing,
            played.cycles,
            first.cycle,
            record.time_s(first.cycle)
        ),
    ));
    rows.extend(first.differences.iter().enumerate().map(|(i, d)| (if i == 0 { "first signals" } else { "" }, d.words())));
    rows.extend(
        watches.iter().enumerate().map(|(i, w)| (if i == 0 { "as if a watch" } else { "" }, format!("were broken in one of both: {w}"))),
    );
    let [recorded, replayed] = played.aborts.map(|abort| abort_words(record, abort));
    rows.push((
        "abort",
        if recorded == replayed { format!("in both {recorded}") } else { format!("recorded {recorded}; with this law {replayed}") },
    ));
    rows.push(match played.first_order {
        None => ("orders", "all as recorded".to_owned()),
        Some(i) => {
            let text = "differ first at {} s; what is told of later cycles is what this law orders on these sensors, not how it would fly: glider what-if flies it";
            ("orders", text.replacen("{}", &format!("{:.0}", record.time_s(i)), 1))
        }
    });
    rows
}
