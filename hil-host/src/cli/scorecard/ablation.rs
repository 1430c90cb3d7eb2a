//! `glider scorecard ablation`: what each mechanism of the diagnosis is worth, by turning it off. Only in programs built with the
//! feature `ablation`.

use std::path::PathBuf;

use anyhow::{Context as _, ensure};
use discovery::ablation::{SWITCHES, WITHOUT};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::super::{Output, Verdict};
use crate::score::cases;
use crate::score::real::ask::Program;
use crate::score::real::flights::Data;
use crate::score::real::injected_errors::INJECTED_ERRORS;
use crate::score::real::{document, ready, run as ask_all};
use crate::terminal::table;

/// Arguments of `scorecard ablation`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard ablation --flights data --cases foreign\n  glider scorecard ablation --cases foreign --switch clock_from_pressures\n\nEach switch is turned off in turn; the first row has all of them on. Real flights with a known injected error come from --flights, sealed cases\nfrom --cases (the layout that `scorecard discovery --write` writes). At least one of the two is needed."
)]
pub struct AblationArgs {
    /// Folder of real flights.
    #[arg(long, value_name = "DIR")]
    flights: Option<PathBuf>,
    /// Only these real flights of the list (may be repeated).
    #[arg(long, value_name = "NAME")]
    flight: Vec<String>,
    /// Folder of sealed cases with their truth in its subfolder `truth`.
    #[arg(long, value_name = "DIR")]
    cases: Option<PathBuf>,
    /// Only these switches (may be repeated).
    #[arg(long, value_name = "NAME")]
    switch: Vec<String>,
    /// Diagnoses at once.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
}

/// Runs the command.
///
/// # Errors
/// A switch of no name, or nothing to ask.
pub fn run(args: &AblationArgs, output: &Output) -> anyhow::Result<Verdict> {
    ensure!(
        args.flights.is_some() || args.cases.is_some(),
        "nothing to ask: name real flights with --flights or sealed cases with --cases"
    );
    for name in &args.switch {
        let all: Vec<&str> = SWITCHES.iter().map(|s| s.0).collect();
        ensure!(all.contains(&name.as_str()), "no switch `{name}`; there are {}", all.join(", "));
    }
    let data = Data::built_in()?;
    let sealed = args.cases.as_deref().map(cases::read).transpose()?.unwrap_or_default();
    let wanted = |name: &str| args.flight.is_empty() || args.flight.iter().any(|f| f == name);
    let missing = |why: &str| eprintln!("left out: {why}");
    let flights = match &args.flights {
        Some(root) => ready(root, &data, &|e| wanted(&e.name), &missing)?,
        None => Vec::new(),
    };
    let switches = SWITCHES.iter().filter(|s| args.switch.is_empty() || args.switch.iter().any(|n| n == s.0));
    let offs: Vec<&str> = std::iter::once("").chain(switches.map(|s| s.0)).collect();
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} diagnoses, {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new((offs.len() * (sealed.len() + flights.len() * INJECTED_ERRORS.len())) as u64).with_style(style);
    let binary = std::env::current_exe().context("cannot find this program's own file")?;
    let folder = std::env::temp_dir().join(format!("glider-ablation-{}", std::process::id()));
    let mut rows = Vec::new();
    for off in offs {
        // A program that only asks its own file with a switch off: no environment of this process is changed.
        let program = Program { file: &binary, with: &[(WITHOUT, off)] };
        let scored = ask_all(&flights, &|_| true, &data, program, &folder, args.jobs, &|_| bar.inc(1))?;
        let simulated = cases::score(&sealed, program, data.limit_s, args.jobs, &|| bar.inc(1))?;
        rows.push(json!({ "off": off, "real": document(&flights, &scored, &[], &data)["all"], "cases": simulated }));
    }
    std::fs::remove_dir_all(&folder).ok();
    bar.finish_and_clear();
    let card = json!({ "switches": SWITCHES.iter().map(|s| json!({ "name": s.0, "what": s.1 })).collect::<Vec<_>>(), "rows": rows });
    output.emit(&card, || print(&card));
    Ok(Verdict::Ok)
}

fn print(card: &Value) {
    let share = |v: &Value| v["share"].as_f64().map_or_else(|| "-".to_owned(), |s| format!("{s:.2} of {}", v["of"]));
    let mut t = table(["off", "real: named", "real: quiet", "real: interval", "cases: right", "CPU s of the cases"]);
    for row in card["rows"].as_array().into_iter().flatten() {
        let groups = row["cases"]["right"].as_object().into_iter().flatten();
        let groups: Vec<String> = groups.map(|(name, n)| format!("{name} {}/{}", n[0], n[1])).collect();
        let off = row["off"].as_str().filter(|o| !o.is_empty()).unwrap_or("(nothing)");
        let real = &row["real"];
        t.add_row([
            off.to_owned(),
            share(&real["named"]),
            share(&real["quiet"]),
            share(&real["interval"]),
            groups.join(", "),
            format!("{:.0}", row["cases"]["cpu_s"].as_f64().unwrap_or(f64::NAN)),
        ]);
    }
    println!("{t}");
}
