//! `glider scorecard real`: known errors injected into real flights.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use logs::digest::sha256;
use logs::export;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::super::shards::{Session, ShardArgs, To, file_report, said_of_shard};
use super::super::{Output, Verdict};
use super::cases_bar;
use crate::score::real::ask::Program;
use crate::score::real::flights::{Data, Entry, Floors, Shipped};
use crate::score::real::injected_errors::{INJECTED_ERRORS, InjectedError};
use crate::score::real::{Ready, Scored, ask_one, below, document, line, ready, shipped};
use crate::terminal::{say, table};
use rig::shards::kept::key;
use rig::shards::part;
use rig::shards::work::Done;

/// Arguments of `scorecard real`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard real --flights data\n  glider scorecard real --flight modena-191 --error nothing --error 'cd0 /1.5' --list\n  glider scorecard real --quick --json\n  glider scorecard real --flights data --resume           (goes on after Ctrl-C or a break)\n  glider scorecard real --flights data --shard 2/8 --out part2.json\n\nEach flight gets a calibrated vehicle file, then one change at a time in that file or in the log; `diagnose` is to name it, and\nnothing where nothing was changed. Without --flights the folder is that of the environment variable GLIDER_FLIGHTS.\nExit code 1: below the floors of the list of flights; 2: no flights."
)]
pub struct RealArgs {
    /// Folder of real flights.
    #[arg(long, value_name = "DIR")]
    flights: Option<PathBuf>,
    /// Only these flights of the list (may be repeated).
    #[arg(long, value_name = "NAME")]
    flight: Vec<String>,
    /// Only these errors (may be repeated); a name or its beginning.
    #[arg(long = "error", alias = "lie", value_name = "NAME")]
    injected: Vec<String>,
    /// Only flights of one split.
    #[arg(long, value_name = "development|judging")]
    split: Option<String>,
    /// The bounded subset of the tests.
    #[arg(long)]
    quick: bool,
    /// Judge every mission below the folder of flights by so many of its own earlier quiet dives, instead of the list (may be repeated).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=24))]
    controls: Vec<u64>,
    /// Diagnoses at once.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Write the scorecard as JSON, without the times that it took; of a shard its results.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    shards: ShardArgs,
    /// List every answer as JSON, one a line, not only the table.
    #[arg(long)]
    list: bool,
}

/// Its name in parts.
pub(super) const REAL_COMMAND: &str = "scorecard real";

/// Lies of the bounded subset.
const QUICK: [&str; 5] = ["nothing", "compressibility x0.3", "cd0 /1.5", "pitch +3 deg", "clock +5 s"];

/// What its questions depend on besides the flights.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Plan {
    flight: Vec<String>,
    injected: Vec<String>,
    split: Option<String>,
    quick: bool,
}

impl Plan {
    fn wants(&self, e: &Entry) -> bool {
        (self.flight.is_empty() || self.flight.contains(&e.name))
            && self.split.as_deref().is_none_or(|s| s == e.split.id())
            && (!self.quick || e.quick)
    }

    fn wants_error(&self, l: &InjectedError) -> bool {
        let named = self.injected.is_empty() || self.injected.iter().any(|n| l.name.starts_with(n.as_str()));
        named && (!self.quick || QUICK.contains(&l.name))
    }

    /// Everything that is asked, in order: errors of each flight of the list, and then what is known of vehicle files as shipped.
    fn questions<'a>(&self, data: &'a Data) -> Vec<Question<'a>> {
        let entries: Vec<&Entry> = data.flight.iter().filter(|e| self.wants(e)).collect();
        let errors = || INJECTED_ERRORS.iter().filter(|l| self.wants_error(l));
        let mut out: Vec<Question> =
            entries.iter().flat_map(|e| errors().map(|error| Question { flight: &e.name, what: What::Error(error) })).collect();
        if self.injected.is_empty() && !self.quick {
            let known = data.shipped.iter().filter(|k| entries.iter().any(|e| e.name == k.flight));
            out.extend(known.map(|k| Question { flight: &k.flight, what: What::AsShipped(k) }));
        }
        out
    }
}

/// One question about a flight.
#[derive(Clone, Copy, Debug)]
struct Question<'a> {
    flight: &'a str,
    what: What<'a>,
}

#[derive(Clone, Copy, Debug)]
enum What<'a> {
    Error(&'a InjectedError),
    AsShipped(&'a Shipped),
}

/// Its answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Answer {
    Scored(Scored),
    /// A document, as text.
    AsShipped(String),
    NoFlight,
}

/// Runs the command.
///
/// # Errors
/// No flights, or a name that is not in the list.
pub fn run(args: &RealArgs, output: &Output) -> anyhow::Result<Verdict> {
    if !args.controls.is_empty() {
        let root = folder(args.flights.as_deref())?;
        return super::missions::run(&root, &args.controls, args.out.as_deref(), args.list, output);
    }
    let data = Data::built_in()?;
    args.flight.iter().try_for_each(|name| data.entry(name).map(|_| ()))?;
    for name in &args.injected {
        let all: Vec<&str> = INJECTED_ERRORS.iter().map(|l| l.name).collect();
        ensure!(all.iter().any(|l| l.starts_with(name.as_str())), "no injected error `{name}`; there are {}", all.join(", "));
    }
    let plan = Plan { flight: args.flight.clone(), injected: args.injected.clone(), split: args.split.clone(), quick: args.quick };
    let to = To { out: args.out.as_deref(), list: args.list };
    let session = Session::open(&args.shards, (REAL_COMMAND, &json!(plan)), (to.out, Path::new("out/scorecard-real")), args.jobs, output)?;
    ask(&plan, args.flights.as_deref(), &session, &to, output)
}

/// The folder of flights.
fn folder(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    let root = named.map(Path::to_path_buf).or_else(|| std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from));
    let root = root.context("no flights: name their folder with --flights or the environment variable GLIDER_FLIGHTS")?;
    ensure!(root.is_dir(), "{}: no such folder of flights", root.display());
    Ok(root)
}

/// Asks the questions of a plan, or takes the answers from parts, and reports.
pub(super) fn ask(plan: &Plan, flights: Option<&Path>, session: &Session, to: &To, output: &Output) -> anyhow::Result<Verdict> {
    let data = Data::built_in()?;
    let root = folder(flights)?;
    let questions = plan.questions(&data);
    let mine: Vec<&Question> = session.work.shard.items(&questions).map(|(_, q)| q).collect();
    eprintln!("calibrating");
    let missing = |why: &str| eprintln!("left out: {why}");
    let flights = ready(&root, &data, &|e| mine.iter().any(|q| q.flight == e.name), &missing)?;
    ensure!(!flights.is_empty() || mine.is_empty(), "{}: none of the flights of the list can be used", root.display());
    let bar = cases_bar(mine.len(), "diagnoses");
    session.announce(&bar);
    let done = answers(&questions, &flights, &data, session, &|| bar.inc(1));
    bar.finish_and_clear();
    let done = done.map_err(|e| session.explained(e))?;
    if let (false, Some(out)) = (session.is_whole(), to.out) {
        let about = session.leave_part(out, done.iter(), json!({ "diagnoses": done.len() }))?;
        return Ok(said_of_shard(&about, &format!("{} diagnoses", done.len()), "glider scorecard merge", output, false));
    }
    let (mut scored, mut as_shipped) = (Vec::new(), Vec::new());
    for answer in done.into_iter().map(|d| d.value) {
        match answer {
            Answer::Scored(one) => scored.push(one),
            Answer::AsShipped(text) => as_shipped.push(serde_json::from_str(&text)?),
            Answer::NoFlight => {}
        }
    }
    let mut card = document(&flights, &scored, &as_shipped, &data);
    let low = below_floors(&card, plan.quick, &data);
    card["below_floors"] = json!(low);
    card["sha256"] = file_report(to.out, part::report(&card).as_bytes())?.into();
    card["line"] = json!(line(&card));
    session.close();
    output.emit(&card, || print(&card, to));
    Ok(if low.is_empty() { Verdict::Ok } else { Verdict::Negative })
}

/// The answers of a shard, or those that parts have.
fn answers(
    questions: &[Question],
    flights: &[Ready],
    data: &Data,
    session: &Session,
    tick: &(dyn Fn() + Sync),
) -> anyhow::Result<Vec<Done<Answer>>> {
    let binary = std::env::current_exe().context("cannot find this program's own file")?;
    let program = Program { file: &binary, with: &[] };
    let folder = std::env::temp_dir().join(format!("glider-real-{}", std::process::id()));
    let mut hashes: HashMap<&str, (&Ready, String)> = HashMap::new();
    for flight in flights {
        let mut text = format!("{} {} ", flight.shipped, flight.quiet).into_bytes();
        export::csv::write(&flight.flight, &mut text)?;
        hashes.insert(&flight.entry.name, (flight, sha256(&text)));
    }
    let key = |q: &Question| {
        let flight = hashes.get(q.flight).map_or("no flight", |f| &f.1);
        key(&[REAL_COMMAND, flight, q.flight, &format!("{:?}", q.what), &format!("{} {}", data.shown_sigma, data.limit_s)])
    };
    let make = |q: &Question| {
        let Some((flight, _)) = hashes.get(q.flight) else { return Ok(Answer::NoFlight) };
        match q.what {
            What::AsShipped(known) => Ok(Answer::AsShipped(shipped(flight, known, data, program, &folder).to_string())),
            What::Error(error) => {
                let here = folder.join(format!("{}-{}", q.flight, error.name.replace([' ', '/'], "-")));
                ask_one(flight, error, data, program, &here).map(Answer::Scored)
            }
        }
    };
    let done = session.work.run(questions, &key, &make, &|_, _| tick());
    std::fs::remove_dir_all(&folder).ok();
    done
}

/// Which floors of the list of flights are not reached.
fn below_floors(card: &Value, quick: bool, data: &Data) -> Vec<String> {
    let floors: Vec<(&str, &Floors)> = if quick {
        vec![("quick", &data.floors["quick"])]
    } else {
        data.floors.iter().filter(|f| f.0 != "quick").map(|(n, f)| (n.as_str(), f)).collect()
    };
    let denied = card["all"]["contradictions"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let mut low: Vec<String> = denied.map(|d| format!("an answer denies itself: {d}")).collect();
    for (name, floor) in floors {
        let of = if quick { &card["all"] } else { &card[name] };
        low.extend(below(of, floor).into_iter().map(|why| format!("{name}: {why}")));
    }
    low
}

fn print(card: &Value, to: &To) {
    let text = |v: &Value| v.as_str().unwrap_or("").to_owned();
    let number = |v: &Value, digits: usize| v.as_f64().map_or_else(|| "-".to_owned(), |x| format!("{x:.digits$}"));
    let names = |v: &Value| v.as_array().into_iter().flatten().filter_map(Value::as_str).collect::<Vec<_>>().join("+");
    let mut t = table(["flight", "error", "sigma", "right", "verdict", "answer", "recal. -> best (floor) cm/s", "CPU s"]);
    for s in card["list"].as_array().into_iter().flatten() {
        let right = match (s["scored"] == true, s["right"] == true) {
            (false, _) => "not scored",
            (true, true) => "yes",
            (true, false) => "NO",
        };
        let e = &s["error_cm_s"];
        t.add_row([
            text(&s["flight"]),
            text(&s["lie"]),
            number(&s["expected_sigma"], 1),
            right.to_owned(),
            text(&s["verdict"]),
            names(&s["answer"]),
            format!("{} -> {} ({})", number(&e["recalibrated"], 2), number(&e["best"], 2), number(&e["noise_floor"], 2)),
            number(&s["cpu_s"], 1),
        ]);
        if to.list {
            say(&format!("{s}"));
        }
    }
    println!("{t}");
    for s in card["shipped"].as_array().into_iter().flatten() {
        let interval = format!("{} to {}", number(&s["told"]["low"], 3), number(&s["told"]["high"], 3));
        let right = if s["right"] == true { "yes" } else { "NO" };
        say(&format!(
            "as shipped, {}: {} {} told, {} ({interval}): {right}",
            text(&s["flight"]),
            text(&s["verdict"]),
            names(&s["answer"]),
            text(&s["effect"])
        ));
    }
    for f in card["flights"].as_array().into_iter().flatten() {
        say(&format!("{} ({}): discrepancy {} cm/s", text(&f["name"]), text(&f["split"]), number(&f["discrepancy_cm_s"], 2)));
    }
    say(&text(&card["line"]));
    for why in card["below_floors"].as_array().into_iter().flatten() {
        say(&format!("below the floor: {}", text(why)));
    }
}
