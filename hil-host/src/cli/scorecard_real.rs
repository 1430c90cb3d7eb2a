//! `glider scorecard real`: known errors injected into real flights.

use std::path::PathBuf;

use anyhow::{Context as _, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::{Output, Verdict};
use crate::pages::real_scorecard;
use crate::score::real::ask::Program;
use crate::score::real::flights::{Data, Entry, Floors};
use crate::score::real::injected_errors::{INJECTED_ERRORS, InjectedError};
use crate::score::real::{below, document, line, ready, run as ask_all, shipped};
use crate::terminal::{say, table};

/// Arguments of `scorecard real`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard real --flights data\n  glider scorecard real --flight modena-191 --error nothing --error 'cd0 /1.5' --list\n  glider scorecard real --quick --json\n\nEach flight gets a calibrated vehicle file, then one change at a time in that file or in the log; `diagnose` is to name it, and\nnothing where nothing was changed. Without --flights the folder is that of the environment variable GLIDER_FLIGHTS.\nExit code 1: below the floors of the list of flights; 2: no flights."
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
    /// Diagnoses at once.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Where the page goes.
    #[arg(long, value_name = "FILE", default_value = "out/scorecard-real.html")]
    html: PathBuf,
    /// List every answer as JSON, one a line, not only the table.
    #[arg(long)]
    list: bool,
}

/// Lies of the bounded subset.
const QUICK: [&str; 5] = ["nothing", "compressibility x0.3", "cd0 /1.5", "pitch +3 deg", "clock +5 s"];

/// Runs the command.
///
/// # Errors
/// No flights, or a name that is not in the list.
pub fn run(args: &RealArgs, output: &Output) -> anyhow::Result<Verdict> {
    let data = Data::built_in()?;
    let root = args.flights.clone().or_else(|| std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from));
    let root = root.as_deref().context("no flights: name their folder with --flights or the environment variable GLIDER_FLIGHTS")?;
    ensure!(root.is_dir(), "{}: no such folder of flights", root.display());
    args.flight.iter().try_for_each(|name| data.entry(name).map(|_| ()))?;
    let begins = |injected: &InjectedError, names: &[String]| names.iter().any(|n| injected.name.starts_with(n.as_str()));
    for name in &args.injected {
        let all: Vec<&str> = INJECTED_ERRORS.iter().map(|l| l.name).collect();
        ensure!(all.iter().any(|l| l.starts_with(name.as_str())), "no injected error `{name}`; there are {}", all.join(", "));
    }
    let wanted = |e: &Entry| {
        (args.flight.is_empty() || args.flight.contains(&e.name))
            && args.split.as_deref().is_none_or(|s| s == e.split.id())
            && (!args.quick || e.quick)
    };
    let wanted_error =
        |l: &InjectedError| (args.injected.is_empty() || begins(l, &args.injected)) && (!args.quick || QUICK.contains(&l.name));
    eprintln!("calibrating");
    let missing = |why: &str| eprintln!("left out: {why}");
    let flights = ready(root, &data, &wanted, &missing)?;
    ensure!(!flights.is_empty(), "{}: none of the flights of the list can be used", root.display());
    let count = flights.len() * INJECTED_ERRORS.iter().filter(|l| wanted_error(l)).count();
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} diagnoses, {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(count as u64).with_style(style);
    let binary = std::env::current_exe().context("cannot find this program's own file")?;
    let program = Program { file: &binary, with: &[] };
    let folder = std::env::temp_dir().join(format!("glider-real-{}", std::process::id()));
    let scored = ask_all(&flights, &wanted_error, &data, program, &folder, args.jobs, &|_| bar.inc(1));
    let whole = args.injected.is_empty() && !args.quick;
    let known = data.shipped.iter().filter(|_| whole).filter_map(|k| Some((flights.iter().find(|f| f.entry.name == k.flight)?, k)));
    let as_shipped: Vec<Value> = known.map(|(f, k)| shipped(f, k, &data, program, &folder)).collect();
    std::fs::remove_dir_all(&folder).ok();
    bar.finish_and_clear();
    let mut card = document(&flights, &scored?, &as_shipped, &data);
    let floors: Vec<(&str, &Floors)> = if args.quick {
        vec![("quick", &data.floors["quick"])]
    } else {
        data.floors.iter().filter(|f| f.0 != "quick").map(|(n, f)| (n.as_str(), f)).collect()
    };
    let mut low = Vec::new();
    for (name, floor) in floors {
        let of = if args.quick { &card["all"] } else { &card[name] };
        low.extend(below(of, floor).into_iter().map(|why| format!("{name}: {why}")));
    }
    card["below_floors"] = json!(low);
    card["line"] = json!(line(&card));
    real_scorecard::page(&card).write(&args.html)?;
    output.emit(&card, || print(&card, args));
    Ok(if low.is_empty() { Verdict::Ok } else { Verdict::Negative })
}

fn print(card: &Value, args: &RealArgs) {
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
        if args.list {
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
    say(&format!("Page: {}", args.html.display()));
}
