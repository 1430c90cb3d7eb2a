//! `glider scorecard`: how good is it, in numbers.

use std::path::PathBuf;

use anyhow::Context as _;
use indicatif::{ProgressBar, ProgressStyle};
use plant::trials::{Case, Kind, Spec, generate, generate_natural, plan};
use serde_json::{Value, json};

use super::{Output, Verdict};
use crate::score;
use crate::terminal::{say, table};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard discovery --cases 100 --seed 1\n  glider scorecard discovery --write cases --cases 20"
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
    Flight(super::scorecard_flight::FlightArgs),
    /// Fly, diagnose, add, new table, fly again: every hidden effect, both wing sets, and the range it is worth.
    Loop(super::scorecard_loop::LoopArgs),
    /// Real flights with a known injected error in the vehicle file or the log against `diagnose`.
    Real(super::scorecard_real::RealArgs),
    /// Missions in which something changes at an unknown dive: found, dated, sized; false alarms.
    Timeline(super::scorecard_timeline::TimelineArgs),
    /// What each mechanism of the diagnosis is worth, by turning it off.
    #[cfg(feature = "ablation")]
    Ablation(super::scorecard_ablation::AblationArgs),
}

/// Arguments of `scorecard discovery`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard discovery --cases 100 --seed 1\n  glider scorecard discovery --only clean --cases 50 --jobs 2 --json\n  glider scorecard discovery --nature --only clean --cases 50\n  glider scorecard discovery --write cases --cases 20    (truth apart, in cases/truth)"
)]
pub struct DiscoveryArgs {
    /// Number of cases.
    #[arg(long, default_value_t = 100)]
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
    /// Where the page goes.
    #[arg(long, value_name = "FILE", default_value = "out/scorecard-discovery.html")]
    html: PathBuf,
    /// Cases with what every real flight has and no model does: 0.1 to 0.4 cm/s by depth, turn, leg and tide, clocks apart, a pressure
    /// zero, sparse samples.
    #[arg(long)]
    nature: bool,
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
        What::Flight(a) => super::scorecard_flight::run(a, output),
        What::Loop(a) => super::scorecard_loop::run(a, output),
        What::Real(a) => super::scorecard_real::run(a, output),
        What::Timeline(a) => super::scorecard_timeline::run(a, output),
        #[cfg(feature = "ablation")]
        What::Ablation(a) => super::scorecard_ablation::run(a, output),
    }
}

fn discovery(args: &DiscoveryArgs, output: &Output) -> anyhow::Result<Verdict> {
    let specs = plan(args.cases, args.seed, args.only.map(Only::kind));
    let make =
        |spec: &Spec, i: usize| -> Case { if args.nature { generate_natural(spec, args.seed, i) } else { generate(spec, args.seed, i) } };
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} cases, {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(specs.len() as u64).with_style(style);
    if let Some(folder) = &args.write {
        for (i, spec) in specs.iter().enumerate() {
            score::diagnosis::write_case(folder, &make(spec, i))?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        let document = json!({ "folder": folder, "cases": specs.len(), "seed": args.seed });
        output.emit(&document, || say(&format!("{} cases in {}, truth apart in its subfolder truth", specs.len(), folder.display())));
        return Ok(Verdict::Ok);
    }
    let folder = std::env::temp_dir().join(format!("glider-trials-{}-{}", args.seed, std::process::id()));
    let binary = std::env::current_exe().context("cannot find this program's own file")?;
    let diagnose = |flight: &std::path::Path| score::diagnosis::diagnose_with(&binary, flight);
    let scored = score::diagnosis::run_made(&specs, &make, &folder, args.jobs, &diagnose, &|| bar.inc(1));
    std::fs::remove_dir_all(&folder).ok();
    let scored = scored?;
    bar.finish_and_clear();
    let mut document = score::diagnosis::summary(&scored);
    document["seed"] = json!(args.seed);
    document["nature"] = json!(args.nature);
    document["list"] = scored.iter().map(score::diagnosis::case_document).collect();
    crate::pages::diagnosis_scorecard::page(&document, args.seed).write(&args.html)?;
    output.emit(&document, || {
        print(&document, args.list);
        say(&format!("Page: {}", args.html.display()));
    });
    let failed = document["failures"].as_u64().unwrap_or(0) > 0;
    Ok(if failed { Verdict::Negative } else { Verdict::Ok })
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
