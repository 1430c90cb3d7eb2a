//! `glider next-flight`.

use super::diagnose::load_and_ask;
use super::{Output, Verdict};
use anyhow::Context as _;
use discovery::diagnosis::Diagnosis;
use discovery::diagnosis::report;
use discovery::hypotheses::search::Depth;
use discovery::workbench::next_flight;
use discovery::workbench::next_flight::Plan;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider next-flight --flight trial_dir --out mission.toml\n  glider next-flight --flight flight.csv --vehicle vehicle.json --json\n\nThe mission file is one that `glider fly --mission` reads. Exit code 1: there is nothing to tell apart."
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file; default: the one beside the flight.
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Where to write the mission file.
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
}

/// The plan as one JSON document.
#[must_use]
pub fn document(found: &Diagnosis, p: &Plan) -> Value {
    let n = report::number;
    json!({
        "verdict": found.verdict.name(),
        "tied": p.tied,
        "legs": p.legs.iter().map(|l| json!({"pitch_deg": n(l.pitch_rad.to_degrees()), "ballast_cc": n(l.ballast_m3 * 1e6)})).collect::<Vec<_>>(),
        "depth_m": [n(p.depth_min_m), n(p.depth_max_m)],
        "expected_chi2": p.separation.iter().map(|s| n(*s)).collect::<Vec<_>>(),
        "expected_chi2_default_sawtooth": n(p.default_separation),
        "mission": Value::Null,
    })
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(out) = &args.out {
        let inputs: Vec<&std::path::Path> = [Some(args.flight.as_path()), args.vehicle.as_deref()].into_iter().flatten().collect();
        crate::whole_file::may_write(out, &inputs, &["toml"], output.force)?;
    }
    let (_, vehicle, found) = load_and_ask(&args.flight, args.vehicle.as_deref(), Depth::Pairs)?;
    let Some(p) = next_flight::plan(&found, &vehicle) else {
        output.emit(&json!({"verdict": found.verdict.name(), "tied": [], "legs": []}), || {
            println!("There are no two hypotheses that a mission could tell apart (verdict: {}).", found.verdict.name());
        });
        return Ok(Verdict::Negative);
    };
    let wings = if vehicle.document["wing"]["name"].as_str().is_some_and(|w| w.contains("low")) { "low-ar" } else { "standard" };
    let mission = p.mission(wings);
    if let Some(out) = &args.out {
        crate::whole_file::write(out, &mission).with_context(|| format!("cannot write {}", out.display()))?;
    }
    let mut document = document(&found, &p);
    document["mission"] = args.out.as_ref().map(|o| o.display().to_string()).into();
    output.emit(&document, || {
        let names: Vec<String> = p.tied.iter().map(|t| t.join(" with ")).collect();
        println!("To tell apart: {}", names.join(" / "));
        for (leg, s) in p.legs.iter().zip(&p.separation) {
            println!(
                "  pitch {:>4.1} deg, ballast {:>4.0} cc: expected chi2 so far {s:.1}",
                leg.pitch_rad.to_degrees(),
                leg.ballast_m3 * 1e6
            );
        }
        println!("The same number of dives at one pitch: {:.1}", p.default_separation);
        match &args.out {
            Some(out) => println!("Mission file: {}", out.display()),
            None => println!("\n{mission}"),
        }
    });
    Ok(Verdict::Ok)
}
