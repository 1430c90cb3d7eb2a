//! `glider report`: the offline page of a flight.

use super::diagnose::load_and_ask;
use super::{Output, Verdict};
use crate::pages::Provenance;
use crate::pages::flight_report;
use anyhow::Context as _;
use discovery::hypotheses::search::Depth;
use logs::record::bounded;
use logs::record::csv;
use rig::whole_file;
use serde_json::json;
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};

const DEFAULT_PAGE: &str = "out/flight.html";

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider report --flight trial_dir\n  glider report --flight flight.csv --vehicle vehicle.json --out flight.html"
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Where the page goes.
    #[arg(long, default_value = DEFAULT_PAGE, value_name = "FILE")]
    out: PathBuf,
}

/// Where a page's numbers come from: this run, and the hash of the flight's csv.
///
/// # Errors
/// The csv cannot be read.
pub fn provenance(flight: &Path) -> anyhow::Result<Provenance> {
    let file = csv::csv_of(flight)?;
    let bytes = bounded::bytes(&file, bounded::LOG).with_context(|| format!("cannot read {}", file.display()))?;
    let hash = Sha256::digest(&bytes).iter().take(8).map(|b| format!("{b:02x}")).collect();
    Ok(Provenance { data_hash: hash, ..Provenance::of_this_run() })
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    // The default page is this command's own.
    let own = args.out == Path::new(DEFAULT_PAGE);
    let inputs: Vec<&Path> = [Some(args.flight.as_path()), args.vehicle.as_deref()].into_iter().flatten().collect();
    whole_file::may_write(&args.out, &inputs, &["html", "htm"], output.force || own)?;
    let (flight, vehicle, found) = load_and_ask(&args.flight, args.vehicle.as_deref(), Depth::Pairs)?;
    flight_report::page(&found, &vehicle, &flight.name, provenance(&args.flight)?).write(&args.out)?;
    let bytes = std::fs::metadata(&args.out).map_or(0, |m| m.len());
    let document = json!({"page": args.out, "bytes": bytes, "verdict": found.verdict.name(), "answer": found.answer});
    output.emit(&document, || println!("{} ({} kB): {}", args.out.display(), bytes / 1000, found.verdict.name()));
    Ok(Verdict::Ok)
}
