//! `glider scorecard`: how good is it, in numbers.

#[cfg(feature = "ablation")]
pub mod ablation;
pub mod closed_loop;
pub mod flight;
pub mod forecast;
pub mod missions;
pub mod real;
pub mod timeline;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};
use plant::trials::{Kind, Spec, generate, generate_natural, generate_scattered, mission, plan};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::shards::{MergeArgs, Session, ShardArgs, To, file_report, parts, said_of_shard};
use super::{Output, Verdict};
use crate::score::diagnosis::{self, Posed, Scored};
use crate::terminal::{say, table};
use rig::shards::kept::key;
use rig::shards::part;
use rig::shards::work::Done;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard discovery --cases 100 --seed 1\n  glider scorecard discovery --earlier 12 --cases 60\n  glider scorecard discovery --write cases --cases 20\n  glider scorecard discovery --cases 300 --shard 2/8 --out part2.json\n  glider scorecard merge part*.json --out discovery.json"
)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand, Debug)]
enum What {
    /// Sealed cases with a hidden effect against `diagnose`.
    Discovery(DiscoveryArgs),
    /// Our controller beside the ordinary one: wings, depth bands, disturbances.
    Flight(flight::FlightArgs),
    /// Fly, diagnose, add, new table, fly again: every hidden effect, both wing sets, and the range it is worth.
    Loop(closed_loop::LoopArgs),
    /// Real flights with a known injected error in the vehicle file or the log against `diagnose`.
    Real(real::RealArgs),
    /// Missions in which something changes at an unknown dive: found, dated, sized; false alarms.
    Timeline(timeline::TimelineArgs),
    /// Forecasts of surfacings on missions that were flown, against persistence.
    Forecast(forecast::ForecastArgs),
    /// Put the parts of shards of `discovery`, `real` or `timeline` together.
    Merge(ScorecardMergeArgs),
    /// What each mechanism of the diagnosis is worth, by turning it off.
    #[cfg(feature = "ablation")]
    Ablation(ablation::AblationArgs),
}

/// Arguments of `scorecard merge`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard merge part*.json --out discovery.json\n  glider scorecard merge part*.json --flights data        (parts of scorecard real)\nExit code as without shards; 2: bad input, as a shard that is missing."
)]
struct ScorecardMergeArgs {
    #[command(flatten)]
    merge: MergeArgs,
    /// Folder of real flights, for parts of `scorecard real`: the one that they were made with.
    #[arg(long, value_name = "DIR")]
    flights: Option<PathBuf>,
}

/// Arguments of `scorecard discovery`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard discovery --cases 100 --seed 1\n  glider scorecard discovery --only clean --cases 50 --jobs 2 --json\n  glider scorecard discovery --nature --only clean --cases 50\n  glider scorecard discovery --earlier 12 --cases 60\n  glider scorecard discovery --write cases --cases 20    (truth apart, in cases/truth)\n  glider scorecard discovery --cases 300 --resume          (goes on after Ctrl-C or a break)\n  glider scorecard discovery --cases 300 --shard 2/8 --out part2.json"
)]
pub struct DiscoveryArgs {
    /// Number of cases.
    #[arg(long, default_value_t = 100, value_parser = super::count)]
    cases: usize,
    /// Seed: the same seed gives the same cases.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only one kind.
    #[arg(long, value_enum)]
    only: Option<Only>,
    /// Worker threads.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Write the cases to this folder instead of scoring them; the truth goes to its subfolder `truth`.
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
    /// Write the scorecard as JSON, without the times that it took; of a shard its results.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    shards: ShardArgs,
    /// Cases with what every real flight has and no model does: 0.1 to 0.4 cm/s by depth, turn, leg and tide, clocks apart, a pressure
    /// zero, sparse samples.
    #[arg(long)]
    nature: bool,
    /// Earlier healthy dives of each case's vehicle, which it is calibrated on; its numbers scatter from dive to dive. Implies --nature.
    #[arg(long, value_name = "DIVES", default_value_t = 0)]
    earlier: usize,
    /// List every case, not only the tables (always in JSON).
    #[arg(long)]
    list: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Only {
    /// Nothing hidden.
    Clean,
    /// One effect of the catalogue.
    Singles,
    /// Two of them.
    Pairs,
    /// One effect outside the catalogue.
    Off,
}

impl Only {
    fn kind(self) -> Kind {
        match self {
            Self::Clean => Kind::Clean,
            Self::Singles => Kind::Single,
            Self::Pairs => Kind::Pair,
            Self::Off => Kind::Off,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    match &args.what {
        What::Discovery(a) => discovery(a, output),
        What::Flight(a) => flight::run(a, output),
        What::Loop(a) => closed_loop::run(a, output),
        What::Real(a) => real::run(a, output),
        What::Timeline(a) => timeline::run(a, output),
        What::Forecast(a) => forecast::run(a, output),
        What::Merge(a) => merge(a, output),
        #[cfg(feature = "ablation")]
        What::Ablation(a) => ablation::run(a, output),
    }
}

fn merge(args: &ScorecardMergeArgs, output: &Output) -> anyhow::Result<Verdict> {
    const COMMANDS: [&str; 3] = [DISCOVERY, timeline::TIMELINE_COMMAND, real::REAL_COMMAND];
    let merged = parts(&args.merge, &COMMANDS, output)?;
    let (command, plan) = (merged.command.clone(), merged.plan.clone());
    let to = To { out: args.merge.out.as_deref(), list: args.merge.list };
    if command == DISCOVERY {
        discover(&serde_json::from_value(plan)?, &Session::merging(DISCOVERY, merged), &to, output)
    } else if command == timeline::TIMELINE_COMMAND {
        timeline::fly(&serde_json::from_value(plan)?, &Session::merging(COMMANDS[1], merged), &to, output)
    } else {
        real::ask(&serde_json::from_value(plan)?, args.flights.as_deref(), &Session::merging(COMMANDS[2], merged), &to, output)
    }
}

const DISCOVERY: &str = "scorecard discovery";

/// What the cases of `scorecard discovery` depend on.
#[derive(Debug, Serialize, Deserialize)]
struct Plan {
    cases: usize,
    seed: u64,
    only: Option<Kind>,
    nature: bool,
    #[serde(default)]
    earlier: usize,
}

impl Plan {
    fn make(&self, spec: &Spec, i: usize) -> Posed {
        match self.earlier {
            0 if self.nature => Posed { case: generate_natural(spec, self.seed, i), before: None },
            0 => Posed { case: generate(spec, self.seed, i), before: None },
            dives => {
                let before = mission::before(spec, self.seed, i, dives);
                Posed { case: generate_scattered(spec, self.seed, i), before: Some(before) }
            }
        }
    }
}

/// Progress on standard error.
pub(super) fn cases_bar(count: usize, what: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(&format!("{{bar:30}} {{pos}}/{{len}} {what}, {{eta}} left"));
    ProgressBar::new(count as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn discovery(args: &DiscoveryArgs, output: &Output) -> anyhow::Result<Verdict> {
    let plan = Plan { cases: args.cases, seed: args.seed, only: args.only.map(Only::kind), nature: args.nature, earlier: args.earlier };
    let Some(folder) = &args.write else {
        let files = (args.out.as_deref(), Path::new("out/scorecard-discovery"));
        let session = Session::open(&args.shards, (DISCOVERY, &json!(plan)), files, args.jobs, output)?;
        return discover(&plan, &session, &To { out: args.out.as_deref(), list: args.list }, output);
    };
    let specs = plant::trials::plan(plan.cases, plan.seed, plan.only);
    let bar = cases_bar(specs.len(), "cases");
    for (i, spec) in specs.iter().enumerate() {
        diagnosis::write_posed(folder, &plan.make(spec, i))?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let document = json!({ "folder": folder, "cases": specs.len(), "seed": args.seed });
    output.emit(&document, || say(&format!("{} cases in {}, truth apart in its subfolder truth", specs.len(), folder.display())));
    Ok(Verdict::Ok)
}

/// Diagnoses the cases of a plan, or takes what was said from parts, and reports.
fn discover(of: &Plan, session: &Session, to: &To, output: &Output) -> anyhow::Result<Verdict> {
    let specs: Vec<(usize, Spec)> = plan(of.cases, of.seed, of.only).into_iter().enumerate().collect();
    let bar = cases_bar(session.work.shard.items(&specs).count(), "cases");
    session.announce(&bar);
    let folder = std::env::temp_dir().join(format!("glider-trials-{}-{}", of.seed, std::process::id()));
    let binary = std::env::current_exe().context("cannot find this program's own file")?;
    let make = |(i, spec): &(usize, Spec)| diagnosis::diagnose_case(&of.make(spec, *i), &folder, &binary);
    let key = |(i, spec): &(usize, Spec)| key(&[DISCOVERY, &format!("{} {} {} {i} {spec:?}", of.seed, of.nature, of.earlier)]);
    let done: anyhow::Result<Vec<Done<Scored>>> = session.work.run(&specs, &key, &make, &|_, _| bar.inc(1));
    std::fs::remove_dir_all(&folder).ok();
    bar.finish_and_clear();
    let done = done.map_err(|e| session.explained(e))?;
    let failures = done.iter().filter(|d| d.value.failure.is_some()).count();
    if let (false, Some(out)) = (session.is_whole(), to.out) {
        let about = session.leave_part(out, done.iter(), json!({ "cases": done.len(), "failures": failures }))?;
        let what = format!("{} cases, {failures} without an answer", done.len());
        return Ok(said_of_shard(&about, &what, "glider scorecard merge", output, failures > 0));
    }
    let scored: Vec<Scored> = done.into_iter().map(|d| d.value).collect();
    let mut document = diagnosis::summary(&scored);
    document["seed"] = json!(of.seed);
    document["nature"] = json!(of.nature);
    document["earlier_dives"] = json!(of.earlier);
    document["list"] = scored.iter().map(diagnosis::case_document).collect();
    document["sha256"] = file_report(to.out, part::report(&document).as_bytes())?.into();
    session.close();
    output.emit(&document, || print(&document, to.list));
    Ok(if failures > 0 { Verdict::Negative } else { Verdict::Ok })
}

fn figure(v: &Value) -> String {
    v.as_f64().map_or_else(|| "-".to_owned(), |x| format!("{x:.2}"))
}

fn of(v: &Value) -> String {
    format!("{} of {}", figure(&v["share"]), v["of"])
}

fn print(d: &Value, list: bool) {
    let mut t =
        table(["hidden", "size", "exact", "where it can be told", "in class", "one named", "error after / floor", "nominal / floor"]);
    for kind in ["singles", "pairs"] {
        for size in ["weak", "medium", "strong"] {
            let s = &d[kind][size];
            t.add_row([
                kind.to_owned(),
                size.to_owned(),
                of(&s["exact"]),
                of(&s["exact_where_it_can_be_told"]),
                of(&s["in_class"]),
                of(&s["at_least_one"]),
                figure(&s["error_after_over_floor_median"]),
                figure(&s["nominal_over_floor_median"]),
            ]);
        }
    }
    println!("{t}");
    say("(A density bias and a ballast offset are one force, a pitch offset is nearly an angle of zero lift, a stall with hysteresis \
         nearly a plain one: where nature's own law prefers the truth to such a twin by less than ten to one, nobody can tell.)");
    say(&format!("clean called adequate: {}", of(&d["clean"]["adequate"])));
    let off =
        |size: &str| format!("{} (where it can be told {})", of(&d["off"][size]), of(&d["off"][format!("{size}_where_it_can_be_told")]));
    say(&format!("outside the catalogue called unexplained: medium {}, strong {}", off("medium"), off("strong")));
    say(&format!(
        "intervals contain the truth: {} of {}; median parameter error {}",
        figure(&d["intervals"]["coverage"]),
        d["intervals"]["of"],
        figure(&d["intervals"]["relative_error_median"])
    ));
    say(&format!(
        "error after / known-truth refit (median): all {}, exact answers {}",
        figure(&d["error_after_over_known_truth_median"]),
        figure(&d["error_after_over_known_truth_of_exact_answers"])
    ));
    say(&format!("wall time per case (median): {} s; failures: {}", figure(&d["wall_s_per_case_median"]), d["failures"]));
    say(&format!("sentences that a number of the same answer denies: {}", d["contradictions"].as_array().map_or(0, Vec::len)));
    let mut confusion = table(["hidden", "answer (count)"]);
    for (truth, said) in d["confusion"].as_object().into_iter().flatten() {
        let text: Vec<String> = said.as_object().into_iter().flatten().map(|(k, n)| format!("{k} ({n})")).collect();
        confusion.add_row([truth.clone(), text.join(", ")]);
    }
    say(&format!("{confusion}"));
    if list {
        for c in d["list"].as_array().into_iter().flatten() {
            say(&format!("{c}"));
        }
    }
    for c in d["list"].as_array().into_iter().flatten() {
        if let Some(f) = c["failure"].as_str() {
            eprintln!("{}: {f}", c["case"].as_str().unwrap_or(""));
            break;
        }
    }
}
