//! `glider next-flight`.

use super::diagnose::load_and_ask;
use super::{Output, Verdict};
use crate::next_mission;
use crate::terminal::{say, wrapped};
use anyhow::Context as _;
use discovery::diagnosis::Diagnosis;
use discovery::diagnosis::report;
use discovery::hypotheses::search::Depth;
use discovery::workbench::next_flight::{DISTINCT_CHI2, Plan};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider next-flight --flight trial_dir --out mission.toml\n  glider next-flight --flight flight.csv --vehicle vehicle.json --json\n\nThe mission file is one that `glider fly --mission` flies. Exit code 1: there is nothing that a mission could tell apart,\nand none is written."
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
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
        rig::whole_file::may_write(out, &inputs, &["toml"], output.force)?;
    }
    let (_, vehicle, found) = load_and_ask(&args.flight, args.vehicle.as_deref(), Depth::Pairs)?;
    let p = match next_mission::plan(&found, &vehicle)? {
        Ok(p) => p,
        Err(why) => {
            let document = json!({"verdict": found.verdict.name(), "tied": [], "legs": [], "tells_apart": false, "why": why});
            output.emit(&document, || say(&wrapped(&format!("No mission is planned: {why} (verdict: {}).", found.verdict.name()), 0)));
            return Ok(Verdict::Negative);
        }
    };
    let mission = p.mission(next_mission::wings(&vehicle));
    let out = args.out.as_ref().filter(|_| p.tells_apart());
    if let Some(out) = out {
        rig::whole_file::write(out, &mission).with_context(|| format!("cannot write {}", out.display()))?;
    }
    let mut document = document(&found, &p);
    document["tells_apart"] = p.tells_apart().into();
    document["mission"] = out.map(|o| o.display().to_string()).into();
    output.emit(&document, || show(&p, &mission, out.map(PathBuf::as_path)));
    Ok(if p.tells_apart() { Verdict::Ok } else { Verdict::Negative })
}

fn show(p: &Plan, mission: &str, out: Option<&Path>) {
    println!("To tell apart: {}", p.tied.iter().map(|t| t.join(" with ")).collect::<Vec<_>>().join(" / "));
    if !p.tells_apart() {
        println!(
            "No dives at other pitches and drives do: the best {} put them apart by an expected chi2 of {:.1}; {} would be 90 % sure.\n\
             What could: measuring one of them on the bench, or water of another density and temperature.",
            p.legs.len(),
            p.expected_chi2(),
            DISTINCT_CHI2
        );
        return;
    }
    for (leg, s) in p.legs.iter().zip(&p.separation) {
        let (pitch, ballast) = (leg.pitch_rad.to_degrees(), leg.ballast_m3 * 1e6);
        println!("  pitch {pitch:>4.1}°, ballast {ballast:>4.0} cc: expected chi2 so far {s:.1}");
    }
    println!("The same number of dives at one pitch: {:.1}", p.default_separation);
    match out {
        Some(out) => println!("Fly it: glider fly --mission {} --log DIR", out.display()),
        None => println!("\n{mission}"),
    }
}
