//! The command line: one file per command, each with its `Args` and `run`.
//!
//! A command prints for a person, or with `--json` exactly one JSON document
//! on standard output; progress and warnings go to standard error. Exit codes:
//! 0 done, 1 done and the result is negative (a check failed, a fault was not
//! survived), 2 bad input.

use std::cell::RefCell;
use std::io::Write as _;

use crate::terminal::help_text;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{FromArgMatches, Parser, Subcommand, ValueEnum};

pub mod add;
#[cfg(feature = "board")]
pub mod autopsy;
pub mod calibrate;
pub mod compare;
pub mod completions;
pub mod diagnose;
#[cfg(feature = "export")]
pub mod export;
pub mod faults;
pub mod fetch_data;
pub mod fleet;
pub mod fly;
pub mod forecast;
pub mod history;
pub mod import;
#[cfg(feature = "board")]
pub mod launch;
pub mod list;
mod logged;
pub mod main_job;
pub mod margins;
#[cfg(feature = "board")]
pub mod monitor;
#[cfg(feature = "board")]
mod monitor_screen;
pub mod next_flight;
pub mod paper;
pub mod plot;
pub mod polar;
pub mod power;
pub mod replay;
pub mod report;
pub mod scorecard;
#[cfg(feature = "serve")]
pub mod serve;
mod shards;
pub mod story;
pub mod surfacing;
pub mod table;
pub mod timeline;
#[cfg(feature = "board")]
pub mod upload;
pub mod what_if;

/// A count on the command line: one at least.
fn count(text: &str) -> Result<usize, String> {
    text.parse().map_err(|e| format!("{e}")).and_then(|n| if n == 0 { Err("at least 1".into()) } else { Ok(n) })
}

/// What a finished command says to the shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Exit code 0.
    Ok,
    /// Exit code 1: done, and the result is negative.
    Negative,
}

/// Where results go.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// Machine-readable output asked for.
    pub json: bool,
    /// Files that exist may be replaced.
    pub force: bool,
}

impl Output {
    /// Prints `document` if JSON is asked for, else what `human` writes; hands it over where [`document`] asked for it.
    pub fn emit(&self, document: &serde_json::Value, human: impl FnOnce()) {
        let is_taken = TAKEN.with_borrow_mut(|taken| {
            if let Some(taken) = taken {
                taken.clone_from(document);
            }
            taken.is_some()
        });
        match (is_taken, self.json) {
            (true, _) => {}
            (false, true) => println!("{document:#}"),
            (false, false) => human(),
        }
    }
}

/// The help: commands by what a person wants, where to start first. A test holds that every command stands here.
const HELP: &str = "\
{about}

{usage-heading} {usage}

Start here:
  glider                   the main job: flies both wing sets over a serial
                           line, compares a real flight, writes out/report.html
  glider loop              the story: a hidden effect found, added, flown with
  glider serve             the workbench as a page on this machine

A flight against its model:
  import, fetch-data       bring a flight in; get a public real one
  compare                  model against measurement: how wrong, and where
  diagnose                 which physical effect is missing
  add                      add an effect, refit, see the error fall
  calibrate                several flights of one vehicle: what is known of it
  history                  earlier dives of a vehicle, by which it is judged
  timeline                 drag, lift, trim over a mission; what changed, when
  fleet                    an archive of flights: what all dives say together
  next-flight              the mission that would tell what this flight cannot
  forecast                 where and when it comes up next, with an ellipse
  report, plot, export     an offline page; figures; csv, Parquet, NetCDF

The vehicle and its controller:
  polar, table             lift and drag; the flight tables made from them
  fly                      one flight against the simulated vehicle and sea
  replay                   a recorded flight through the law again, bit for
                           bit; another law or table; which change turned it
  what-if                  another law, table, mission, fault or effect in the
                           world that a flight reveals
  monitor, upload          a board: telemetry, log; tables, settings, missions
  autopsy                  why a board was reset, by line of source
  surfacing                what a backseat reports at a surfacing
  launch, power            check a vehicle on deck, start its mission; the
                           power that a mission takes
  list                     effects, faults, vehicles, missions, changes by name
  completions              for bash, zsh, fish, elvish, powershell

How good it is:
  paper                    every claim of the source paper beside our number
  faults                   the fault campaign
  scorecard                control law and discovery on cases with known truth
  margins                  gain, phase and delay margins of the pitch loop

Each has --help with examples: glider diagnose --help

Options:
{options}

Exit code: 0 done, 1 done and the result is negative, 2 bad input.";

/// Glider workbench: fly it, compare it with the sea, learn what is missing.
#[derive(Parser, Debug)]
#[command(name = "glider", version, help_template = HELP, max_term_width = 80)]
struct Cli {
    /// Print one JSON document instead of text.
    #[arg(long, global = true)]
    json: bool,
    /// Replace output files that exist (an input is never replaced).
    #[arg(long, global = true)]
    force: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Lift, drag and L/D against angle of attack.
    Polar(polar::Args),
    /// Every claim of the source paper beside our number.
    Paper(paper::Args),
    /// Build or check the flight tables.
    Table(table::Args),
    /// One hardware-in-the-loop flight.
    Fly(fly::Args),
    /// The fault campaign.
    Faults(faults::Args),
    /// Bring a Slocum, Seaglider, OG1 or csv log into the flight format.
    Import(import::Args),
    /// Write a flight as csv, Parquet or NetCDF.
    #[cfg(feature = "export")]
    Export(export::Args),
    /// Model against measurement.
    Compare(compare::Args),
    /// Which physical effect is missing.
    Diagnose(diagnose::Args),
    /// Add an effect, refit, see the error fall.
    Add(add::Args),
    /// Several flights of one vehicle: its numbers and tolerances.
    Calibrate(calibrate::Args),
    /// What earlier dives of a vehicle say: shown, extended.
    History(history::Args),
    /// Drag, lift and trim over a mission, its changes named and dated.
    Timeline(timeline::Args),
    /// An archive of flights, dive by dive: what all of them say together.
    Fleet(fleet::Args),
    /// The mission that best separates what this flight cannot.
    NextFlight(next_flight::Args),
    /// Where and when the vehicle comes up next, with a 90 % ellipse.
    Forecast(forecast::Args),
    /// Compare, diagnose, add, new table, fly before and after.
    Loop(story::Args),
    /// Offline HTML report of a flight.
    Report(report::Args),
    /// The workbench as a local web page.
    #[cfg(feature = "serve")]
    Serve(serve::Args),
    /// Effects, faults, vehicles and missions by name.
    List(list::Args),
    /// Completions of commands and options for a shell.
    Completions(completions::Args),
    /// Live telemetry of a board in the terminal.
    #[cfg(feature = "board")]
    Monitor(monitor::Args),
    /// Why a board was reset, with lines of source.
    #[cfg(feature = "board")]
    Autopsy(autopsy::Args),
    /// Flies another law, table, mission, fault or effect in the world that a flight reveals.
    WhatIf(what_if::Args),
    /// Steps a recorded flight through the law again: bit for bit, or with another law or table.
    Replay(replay::Args),
    /// What a backseat reports at a surfacing.
    Surfacing(surfacing::Args),
    /// Send a table, configuration or mission to a board.
    #[cfg(feature = "board")]
    Upload(upload::Args),
    /// What a mission takes from the battery, part by part.
    Power(power::Args),
    /// Check a vehicle on deck and start its mission on its own sensors.
    #[cfg(feature = "board")]
    Launch(launch::Args),
    /// Get a public real flight.
    FetchData(fetch_data::Args),
    /// Closed-loop and discovery scorecards.
    Scorecard(scorecard::Args),
    /// Gain, phase and delay margins of the pitch loop.
    Margins(margins::Args),
    /// Figures for papers as SVG, or their numbers as csv or JSON.
    Plot(plot::Args),
}

/// Parses the command line, runs the command, returns the exit code.
#[must_use]
pub fn main() -> std::process::ExitCode {
    // What `println` cannot write it panics about, in whatever thread it is.
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let text = info.payload().downcast_ref::<String>().map_or("", String::as_str);
        match text.strip_prefix("failed printing to stdout: ").or_else(|| text.strip_prefix("failed to write completion file: ")) {
            Some(why) => std::process::exit(unwritten(why)),
            None => report(info),
        }
    }));
    let parsed = command().try_get_matches().and_then(|m| Cli::from_arg_matches(&m));
    let code = match parsed.map_err(advised) {
        Ok(cli) => match run(&cli) {
            Ok(Verdict::Ok) => 0,
            Ok(Verdict::Negative) => 1,
            Err(e) => wrong(&format!("{e:#}"), cli.json),
        },
        Err(e) if e.use_stderr() && std::env::args().any(|a| a == "--json") => wrong(&e.render().to_string(), true),
        Err(e) => e.print().map_or_else(|why| unwritten(&why.to_string()), |()| e.exit_code()),
    };
    let code = std::io::stdout().flush().map_or_else(|why| unwritten(&why.to_string()), |()| code);
    std::process::ExitCode::from(u8::try_from(code).unwrap_or(2))
}

/// The exit code where standard output cannot be written, a full disk say; `glider … | head`, a reader that has seen enough, is no error.
fn unwritten(why: &str) -> i32 {
    if why.contains("Broken pipe") || why.contains("os error 32") {
        return 0;
    }
    eprintln!("glider: standard output cannot be written: {why}");
    2
}

/// The error with the remedy for slips of newcomers: a flight or a mission named without its option, an effect that `fly` shall hide, and
/// a list asked for as a command.
fn advised(mut e: clap::Error) -> clap::Error {
    let of = |kind| match e.get(kind) {
        Some(ContextValue::String(s)) => s.clone(),
        _ => String::new(),
    };
    let asked = std::env::args().nth(1).unwrap_or_default();
    match e.kind() {
        ErrorKind::UnknownArgument => {
            let word = of(ContextKind::InvalidArg);
            let takes = command()
                .find_subcommand(&asked)
                .is_some_and(|c| c.get_arguments().any(|a| a.get_id() == "flight" && a.get_long().is_some()));
            if takes && !word.starts_with('-') {
                let tip = format!("a flight is named by --flight: glider {asked} --flight {word}");
                e.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            }
            let tip = match (asked.as_str(), word.as_str()) {
                ("fly", "--effect") => {
                    Some("what the world hides stands in a truth file: glider fly --truth FILE (docs/truth-file.md)".to_owned())
                }
                ("fly", mission) if !mission.starts_with('-') => {
                    Some(format!("a mission is named by --mission: glider fly --mission {mission}"))
                }
                _ => None,
            };
            if let Some(tip) = tip {
                e.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            }
        }
        ErrorKind::InvalidSubcommand => {
            let word = of(ContextKind::InvalidSubcommand);
            let what = list::What::value_variants().iter().filter_map(ValueEnum::to_possible_value).map(|v| v.get_name().to_owned());
            if let Some(what) = what.into_iter().find(|w| w.trim_end_matches('s') == word.trim_end_matches('s')) {
                e.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![format!("list {what}")]));
            }
        }
        _ => {}
    }
    e
}

thread_local! {
    /// Where the document of a command goes that another program runs in itself.
    static TAKEN: RefCell<Option<serde_json::Value>> = const { RefCell::new(None) };
}

/// Runs a command inside another program: the document that it prints with `--json`, and its verdict.
///
/// # Errors
/// Bad input, in the words of the command.
pub fn document(arguments: &[String]) -> Result<(serde_json::Value, Verdict), String> {
    let line = ["glider", "--json"].into_iter().chain(arguments.iter().map(String::as_str));
    let cli = Cli::try_parse_from(line).map_err(|e| e.render().to_string().trim().to_owned())?;
    TAKEN.set(Some(serde_json::Value::Null));
    let done = run(&cli);
    let document = TAKEN.take().unwrap_or_default();
    done.map(|verdict| (document, verdict)).map_err(|e| format!("{e:#}"))
}

fn run(cli: &Cli) -> anyhow::Result<Verdict> {
    let output = Output { json: cli.json, force: cli.force };
    match &cli.command {
        None => main_job::run(&output),
        Some(Command::Polar(a)) => polar::run(a, &output),
        Some(Command::Paper(a)) => paper::run(a, &output),
        Some(Command::Table(a)) => table::run(a, &output),
        Some(Command::Fly(a)) => fly::run(a, &output),
        Some(Command::Faults(a)) => faults::run(a, &output),
        Some(Command::Import(a)) => import::run(a, &output),
        #[cfg(feature = "export")]
        Some(Command::Export(a)) => export::run(a, &output),
        Some(Command::Compare(a)) => compare::run(a, &output),
        Some(Command::Diagnose(a)) => diagnose::run(a, &output),
        Some(Command::Add(a)) => add::run(a, &output),
        Some(Command::Calibrate(a)) => calibrate::run(a, &output),
        Some(Command::History(a)) => history::run(a, &output),
        Some(Command::Timeline(a)) => timeline::run(a, &output),
        Some(Command::Fleet(a)) => fleet::run(a, &output),
        Some(Command::NextFlight(a)) => next_flight::run(a, &output),
        Some(Command::Forecast(a)) => forecast::run(a, &output),
        Some(Command::Loop(a)) => story::run(a, &output),
        Some(Command::Report(a)) => report::run(a, &output),
        #[cfg(feature = "serve")]
        Some(Command::Serve(a)) => serve::run(a, &output),
        Some(Command::List(a)) => list::run(a, &output),
        Some(Command::Completions(a)) => completions::run(a, &output),
        #[cfg(feature = "board")]
        Some(Command::Monitor(a)) => monitor::run(a, &output),
        #[cfg(feature = "board")]
        Some(Command::Autopsy(a)) => autopsy::run(a, &output),
        Some(Command::WhatIf(a)) => what_if::run(a, &output),
        Some(Command::Replay(a)) => replay::run(a, &output),
        Some(Command::Surfacing(a)) => surfacing::run(a, &output),
        #[cfg(feature = "board")]
        Some(Command::Upload(a)) => upload::run(a, &output),
        Some(Command::Power(a)) => power::run(a, &output),
        #[cfg(feature = "board")]
        Some(Command::Launch(a)) => launch::run(a, &output),
        Some(Command::FetchData(a)) => fetch_data::run(a, &output),
        Some(Command::Scorecard(a)) => scorecard::run(a, &output),
        Some(Command::Margins(a)) => margins::run(a, &output),
        Some(Command::Plot(a)) => plot::run(a, &output),
    }
}

/// Says what is wrong: to a person, or as the one JSON document of a failed command.
fn wrong(why: &str, json: bool) -> i32 {
    if json {
        println!("{:#}", serde_json::json!({"error": why.trim(), "exit_code": 2}));
    } else {
        eprintln!("{} {why}", console::style("glider:").red().bold().for_stderr());
    }
    2
}

/// The program's command line.
#[must_use]
pub fn command() -> clap::Command {
    fitted(<Cli as clap::CommandFactory>::command())
}

/// The same command with what stands behind its options in lines of the terminal, and so its subcommands.
fn fitted(command: clap::Command) -> clap::Command {
    let text = command.get_after_help().map(ToString::to_string);
    let inside: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    let command = text.map_or(command.clone(), |t| command.after_help(help_text(&t)));
    inside.iter().fold(command, |c, name| c.mut_subcommand(name, fitted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_run_inside_a_program_hands_its_document_over() {
        let line = |words: &str| words.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let (effects, verdict) = document(&line("list effects")).expect("a list");
        assert!(effects["items"].as_array().is_some_and(|i| i.len() > 20) && verdict == Verdict::Ok);
        let nothing = document(&line("compare --flight nowhere")).expect_err("refused");
        assert!(nothing.contains("nowhere"), "{nothing}");
        let unknown = document(&line("compare --flght a")).expect_err("refused");
        assert!(unknown.contains("--flight"), "{unknown}");
    }

    #[test]
    fn every_command_stands_in_the_grouped_help_and_fits_80_columns() {
        let help = command().render_help().to_string();
        for name in command().get_subcommands().map(clap::Command::get_name).filter(|n| *n != "help") {
            let said = help.lines().any(|l| l.starts_with("  ") && l.split([' ', ',']).any(|w| w == name));
            assert!(said, "{name} is not in the help:\n{help}");
        }
        let wide: Vec<&str> = help.lines().filter(|l| l.chars().count() > 80).collect();
        assert!(wide.is_empty(), "{wide:#?}");
    }

    #[test]
    fn the_help_of_every_command_has_two_examples_and_fits_80_columns() {
        fn check(command: &mut clap::Command, bad: &mut String) {
            let help = command.render_help().to_string();
            let examples = help.lines().filter(|l| l.starts_with("  glider ") || l.trim() == "glider").count();
            let wide = help.lines().filter(|l| l.chars().count() > 80).count();
            if wide > 0 || examples < 2 {
                *bad += &format!("glider {}: {examples} examples, {wide} lines too wide\n", command.get_name());
            }
            command.get_subcommands_mut().filter(|c| c.get_name() != "help").for_each(|c| check(c, bad));
        }
        let mut whole = command();
        whole.build();
        let mut bad = String::new();
        whole.get_subcommands_mut().filter(|c| c.get_name() != "help").for_each(|c| check(c, &mut bad));
        assert!(bad.is_empty(), "{bad}");
    }
}
