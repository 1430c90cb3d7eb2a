//! `glider import`: somebody's log becomes a flight directory.

use super::{Output, Verdict};
use anyhow::{Context, bail};
use discovery::import::{Imported, Report};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider import raw/ --out flight                       all Slocum dbd, ebd, sbd, tbd ... of a folder
  glider import 00990001.dcd --out flight --cache cac   one file (and its science partner), sensor lists elsewhere
  glider import p1710104.nc --out flight                Seaglider, OG1 or IOOS NetCDF
  glider import tidy.csv --out flight --vehicle vehicles/comet.toml

Density is always recomputed from salinity, temperature and pressure by TEOS-10.
Exit code 1 if parts were damaged and left out, 2 if there is nothing to use.")]
pub struct Args {
    /// Folder, Slocum file, NetCDF or csv.
    input: PathBuf,
    /// Flight directory to write; must not exist yet.
    #[arg(long)]
    out: PathBuf,
    /// Further folders of Slocum sensor lists (.cac, .ccc).
    #[arg(long)]
    cache: Vec<PathBuf>,
    /// Vehicle file to put beside the flight.
    #[arg(long)]
    vehicle: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if args.out.exists() {
        bail!("{} exists: name a new folder with --out, nothing is overwritten", args.out.display());
    }
    if let Some(vehicle) = &args.vehicle {
        discovery::vehicle::read(vehicle)?;
    }
    let spinner = indicatif::ProgressBar::new_spinner().with_message(format!("reading {}", args.input.display()));
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    let imported = discovery::import::import(&args.input, &args.cache);
    spinner.finish_and_clear();
    let Imported { flight, report } = imported?;
    write(&args.out, &flight, &report, args.vehicle.as_deref())?;
    let damaged = report.files.iter().any(|f| !f.problems.is_empty());
    let document = serde_json::json!({
        "flight": args.out,
        "rows": flight.len(),
        "duration_s": flight.time_s.last(),
        "report": report,
    });
    output.emit(&document, || print(args, &flight, &report));
    Ok(if damaged { Verdict::Negative } else { Verdict::Ok })
}

fn write(out: &Path, flight: &discovery::Flight, report: &Report, vehicle: Option<&Path>) -> anyhow::Result<()> {
    std::fs::create_dir_all(out).with_context(|| format!("cannot make folder {}", out.display()))?;
    let csv = out.join("flight.csv");
    let file = std::fs::File::create(&csv).with_context(|| format!("cannot write {}", csv.display()))?;
    discovery::export::csv::write(flight, file).with_context(|| format!("cannot write {}", csv.display()))?;
    let said = serde_json::json!({ "tool": concat!("glider ", env!("CARGO_PKG_VERSION")), "report": report });
    std::fs::write(out.join("import.json"), format!("{said:#}\n"))?;
    if let Some(vehicle) = vehicle {
        let name = if vehicle.extension().is_some_and(|e| e == "toml") { "vehicle.toml" } else { "vehicle.json" };
        std::fs::copy(vehicle, out.join(name)).with_context(|| format!("cannot copy {}", vehicle.display()))?;
    }
    Ok(())
}

fn print(args: &Args, flight: &discovery::Flight, report: &Report) {
    println!("{}: {}", report.kind, args.input.display());
    for file in &report.files {
        println!("  {:32} {:7} rows", file.file, file.rows);
        for problem in &file.problems {
            println!("    damaged: {problem}");
        }
    }
    println!("names and units:");
    for m in &report.mapped {
        println!("  {:28} {:8} -> {:22} (x {} to SI)", m.from, m.unit, m.to, m.factor);
    }
    println!("density: {}", report.density);
    if !report.missing.is_empty() {
        println!("missing: {}", report.missing.join(", "));
    }
    for note in &report.notes {
        println!("note: {note}");
    }
    let segments = flight.segment.iter().collect::<std::collections::BTreeSet<_>>().len();
    let hours = flight.time_s.last().copied().unwrap_or(0.0) / 3600.0;
    println!("wrote {}: {} rows, {segments} segments, {hours:.2} h", args.out.display(), flight.len());
    if args.vehicle.is_none() {
        println!("next: put a vehicle.toml beside it, or name one with --vehicle (examples in vehicles/)");
    }
}
