//! `glider diagnose`.

use super::{Output, Verdict};
use anyhow::Context as _;
use discovery::diagnosis::report;
use discovery::diagnosis::{self, Diagnosis};
use discovery::hypotheses::search::Depth;
use discovery::record::csv;
use discovery::{Flight, Vehicle, vehicle};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider diagnose --flight trial_dir\n  glider diagnose --flight flight.csv --vehicle vehicle.json --json\n  glider diagnose --flight trial_dir --predict after.csv\n  glider diagnose --flight trial_dir --depth 3\n  glider diagnose --flight flight.csv --vehicle vehicle.json --quick\n\nExit code 0: done (whatever the verdict); 2: bad input."
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file; default: the one beside the flight.
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Most effects that are sought at once.
    #[arg(long, default_value = "2", value_name = "2|3", value_parser = clap::value_parser!(u8).range(2..=3))]
    depth: u8,
    /// One effect at a time: an answer in a few seconds that a pair may yet overturn.
    #[arg(long, conflicts_with = "depth")]
    quick: bool,
    /// Write time_s,w_before_m_s,w_after_m_s (positive down) of the check segments.
    #[arg(long, value_name = "OUT.csv")]
    predict: Option<PathBuf>,
}

/// Reads a flight and its vehicle.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn load(flight: &Path, vehicle_file: Option<&Path>) -> anyhow::Result<(Flight, Vehicle)> {
    let file = vehicle_file
        .map(Path::to_path_buf)
        .or_else(|| vehicle::beside(flight))
        .with_context(|| format!("{}: no vehicle.json or vehicle.toml beside the flight; name one with --vehicle", flight.display()))?;
    Ok((csv::flight(flight)?, vehicle::read(&file)?))
}

/// A progress bar on standard error.
#[must_use]
pub fn bar() -> ProgressBar {
    let bar = ProgressBar::new(100);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos:>3} % {msg}") {
        bar.set_style(style);
    }
    bar
}

/// Diagnoses a flight with a bar that reaches `end` %.
///
/// # Errors
/// Nothing in the flight that could be asked.
pub fn ask(flight: &Flight, vehicle: &Vehicle, depth: Depth, bar: &ProgressBar, end: f64) -> anyhow::Result<Diagnosis> {
    let found = diagnosis::diagnose(flight, vehicle, depth, &|what, share| {
        bar.set_position((share * end) as u64);
        bar.set_message(what.to_string());
    });
    Ok(found.inspect_err(|_| bar.finish_and_clear())?)
}

/// Reads a flight and its vehicle and diagnoses it.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn load_and_ask(flight: &Path, vehicle_file: Option<&Path>, depth: Depth) -> anyhow::Result<(Flight, Vehicle, Diagnosis)> {
    let (flight, vehicle) = load(flight, vehicle_file)?;
    let bar = bar();
    let found = ask(&flight, &vehicle, depth, &bar, 100.0)?;
    bar.finish_and_clear();
    Ok((flight, vehicle, found))
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let depth = match args.depth {
        _ if args.quick => Depth::Singles,
        3.. => Depth::Triples,
        _ => Depth::Pairs,
    };
    if let Some(path) = &args.predict {
        let inputs: Vec<&Path> = [Some(args.flight.as_path()), args.vehicle.as_deref()].into_iter().flatten().collect();
        crate::whole_file::may_write(path, &inputs, &["csv"], output.force)?;
    }
    let (flight, vehicle, found) = load_and_ask(&args.flight, args.vehicle.as_deref(), depth)?;
    if let Some(path) = &args.predict {
        crate::whole_file::write(path, report::prediction(&found, &vehicle)).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let mut document = report::document(&found, &vehicle, &args.flight.display().to_string());
    // A vehicle nobody has calibrated: what its steady glides alone tell, and whether a speed sensor was there to tell lift from pitch.
    let steady =
        if discovery::inference::initial_guess::is_uncalibrated(&vehicle) { discovery::steady::steady_report(&flight).ok() } else { None };
    if let Some(s) = &steady {
        document["steady"] = serde_json::to_value(s)?;
    }
    output.emit(&document, || {
        println!("Verdict: {}", found.verdict.name());
        println!("{}\n", report::explanation(&found));
        let mut table = comfy_table::Table::new();
        table.set_header(["effects", "probability", "log odds", "error fitted cm/s", "error held out cm/s", "parameters (90 %)"]);
        for c in found.candidates.iter().take(10) {
            let parameters: Vec<String> =
                c.parameters.iter().map(|p| format!("{} {:.4} [{:.4}, {:.4}] {}", p.name, p.value, p.low, p.high, p.unit)).collect();
            table.add_row([
                c.effects.join(" + "),
                format!("{:.3}", c.probability),
                format!("{:+.1}", c.log_odds),
                format!("{:.3}", c.error_fitted_m_s * 100.0),
                format!("{:.3}", c.error_check_m_s * 100.0),
                parameters.join("\n"),
            ]);
        }
        println!("{table}");
        if let Some(s) = &steady {
            println!(
                "Steady glides alone (nominal Slocum coefficients): {:.2} cm/s nominal, {:.2} cm/s with drag and trim fitted. {}",
                s.before_cm_s, s.after_cm_s, s.identified
            );
            if let Some(w) = &s.with_speed {
                println!("With the speed sensor: true pitch = {:.3} x measured, speed bias {:+.2} cm/s.", w.pitch_scale, w.speed.bias_cm_s);
            }
        }
        println!("Next: {}", report::next_flight(&found));
        for note in &found.notes {
            println!("Note: {note}");
        }
    });
    Ok(Verdict::Ok)
}
