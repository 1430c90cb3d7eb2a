//! `glider import`: somebody's log becomes a flight directory with its vehicle.

use super::{Output, Verdict};
use crate::terminal::say;
use anyhow::Context;
use logs::import::classes::Class;
use logs::import::{Imported, Report};
use rig::flight::vehicles;
use rig::spelling::meant;
use rig::whole_file;
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider import raw/ --out flight                       all Slocum dbd, ebd, sbd, tbd ... of a folder
  glider import 00990001.dcd --out flight --cache cac   one file (and its science partner), sensor lists elsewhere
  glider import sg561/ --out flight                     Seaglider dives pNNNNNNN.nc as one flight
  glider import p561000[2-5].nc --out flight            some of them
  glider import mission.nc --out flight                 OG1 or IOOS NetCDF
  glider import tidy.csv --out flight --vehicle vehicles/comet.toml

Writes flight.csv, import.json (what was mapped, missing, left out) and, where no --vehicle is given, a vehicle.toml:
numbers of the files where they state them, else the usual ones of the glider's class with wide tolerances.
Density is always recomputed from salinity, temperature and pressure by TEOS-10.
Exit code 1 if parts were left out, 2 if there is nothing to use.")]
pub struct Args {
    /// Files or folders of one flight.
    #[arg(required = true)]
    input: Vec<PathBuf>,
    /// Flight directory to write; one that an import made is replaced with --force.
    #[arg(long)]
    out: PathBuf,
    /// Further folders of Slocum sensor lists (.cac, .ccc).
    #[arg(long)]
    cache: Vec<PathBuf>,
    /// Vehicle file to put beside the flight [default: of a flight.csv its own, else one is made].
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Class whose usual numbers make the vehicle [default: told by the files].
    #[arg(long, value_parser = class, conflicts_with = "vehicle")]
    class: Option<Class>,
}

/// What is written, and so may be replaced; first what no other command writes.
const WRITTEN: [&str; 4] = ["import.json", "flight.csv", "vehicle.toml", "vehicle.json"];

fn class(name: &str) -> Result<Class, String> {
    let names = || Class::ALL.map(Class::name).join(", ");
    let meant = || meant(name, Class::ALL.map(Class::name));
    Class::ALL.into_iter().find(|c| c.name() == name).ok_or_else(|| format!("expected one of {}{}", names(), meant()))
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let vehicle_file = args.vehicle.clone().map_or_else(|| own_vehicle(args), |named| Ok(Some(named)))?;
    let inputs: Vec<&Path> = args.input.iter().chain(&args.cache).chain(&vehicle_file).map(PathBuf::as_path).collect();
    whole_file::may_write_folder(&args.out, &inputs, &WRITTEN, output.force)?;
    if let Some(vehicle) = &vehicle_file {
        vehicles::read(vehicle)?;
    }
    let spinner = indicatif::ProgressBar::new_spinner().with_message(format!("reading {}", named(args)));
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    let imported = logs::import::import_all(&args.input, &args.cache, args.class);
    spinner.finish_and_clear();
    let imported = imported?;
    let made = imported.vehicle_text().filter(|_| vehicle_file.is_none());
    let Imported { flight, mut report, .. } = imported;
    if vehicle_file.is_some() {
        // Of the vehicle that is not made.
        report.forget_vehicle();
    }
    write(&args.out, &flight, &report, vehicle_file.as_deref(), made.as_ref())?;
    let document = serde_json::json!({
        "flight": args.out,
        "rows": flight.len(),
        "duration_s": flight.time_s.last(),
        "vehicle": vehicle_file,
        "report": report,
    });
    let first = made.is_some_and(|(name, _)| name.ends_with(".toml"));
    output.emit(&document, || print(args, vehicle_file.as_deref(), first, &flight, &report));
    Ok(if report.is_whole() { Verdict::Ok } else { Verdict::Negative })
}

/// The vehicle of a flight in the project's own format, which lies beside it.
fn own_vehicle(args: &Args) -> anyhow::Result<Option<PathBuf>> {
    let [one] = args.input.as_slice() else { return Ok(None) };
    let own = if one.is_dir() { one.join("flight.csv").is_file() } else { one.file_name().is_some_and(|n| n == "flight.csv") };
    if own && args.class.is_none() { Ok(logs::vehicle::file_next_to(one)?) } else { Ok(None) }
}

fn named(args: &Args) -> String {
    let more = if args.input.len() > 1 { format!(" and {} more", args.input.len() - 1) } else { String::new() };
    format!("{}{more}", args.input[0].display())
}

/// Name and text of a vehicle file that the import makes.
type Made = (&'static str, String);

fn write(out: &Path, flight: &logs::Flight, report: &Report, vehicle: Option<&Path>, made: Option<&Made>) -> anyhow::Result<()> {
    // The folder appears under its name when all of it is there. One that stands there is replaced where it really lies.
    let place = out.canonicalize().unwrap_or_else(|_| out.to_path_buf());
    whole_file::in_place_of(&place, &WRITTEN, |part| fill(part, flight, report, vehicle, made))
        .with_context(|| format!("cannot write {}", out.display()))
}

fn fill(out: &Path, flight: &logs::Flight, report: &Report, vehicle: Option<&Path>, made: Option<&Made>) -> anyhow::Result<()> {
    std::fs::create_dir_all(out)?;
    let csv = out.join("flight.csv");
    let file = std::fs::File::create(&csv).with_context(|| format!("cannot write {}", csv.display()))?;
    logs::export::csv::write(flight, file).with_context(|| format!("cannot write {}", csv.display()))?;
    let said = serde_json::json!({ "tool": concat!("glider ", env!("CARGO_PKG_VERSION")), "report": report });
    std::fs::write(out.join("import.json"), format!("{said:#}\n"))?;
    if let Some(vehicle) = vehicle {
        let text = vehicles::text(vehicle)?;
        // What is no TOML by its name may be so by its kind: the built-in ones are.
        let toml = vehicle.extension().is_some_and(|e| e == "toml") || logs::vehicle::file::is_geometry(&text);
        std::fs::write(out.join(if toml { "vehicle.toml" } else { "vehicle.json" }), text)?;
    }
    if let Some((name, text)) = made {
        std::fs::write(out.join(name), text)?;
    }
    Ok(())
}

/// A factor in as many digits as distinguish it from another unit's.
fn short(factor: f64) -> String {
    if factor.abs() < 1e-3 { format!("{factor:e}") } else { format!("{}", (factor * 1e6).round() / 1e6) }
}

/// Of sentences that differ in their numbers alone the first three, and how many more there are: import.json has them all.
fn folded(all: &[String]) -> Vec<String> {
    const SHOWN: usize = 3;
    let shape = |text: &str| text.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
    let mut alike: std::collections::BTreeMap<String, usize> = std::collections::BTreeMap::new();
    all.iter().for_each(|text| *alike.entry(shape(text)).or_default() += 1);
    let mut seen: std::collections::BTreeMap<String, usize> = std::collections::BTreeMap::new();
    let mut out = Vec::new();
    for text in all {
        let (of, seen) = (alike.get(&shape(text)).copied().unwrap_or(1), seen.entry(shape(text)).or_default());
        *seen += 1;
        match *seen {
            SHOWN if of > SHOWN + 1 => out.push(format!("{text} (likewise {} more: import.json lists them)", of - SHOWN)),
            n if n <= SHOWN || of == SHOWN + 1 => out.push(text.clone()),
            _ => {}
        }
    }
    out
}

fn print(args: &Args, vehicle: Option<&Path>, first: bool, flight: &logs::Flight, report: &Report) {
    say(&format!("{}: {}", report.kind, named(args)));
    for file in &report.files {
        say(&format!("  {:32} {:7} rows", file.file, file.rows));
        for problem in &file.problems {
            say(&format!("    damaged: {problem}"));
        }
    }
    say("names, units, and the factor to SI:");
    for m in &report.mapped {
        say(&format!("  {:22} {:15} -> {:20} x {}", m.from, m.unit, m.to, short(m.factor)));
    }
    say(&format!("density: {}", report.density));
    if !report.missing.is_empty() {
        say(&format!("missing: {}", report.missing.join(", ")));
    }
    folded(&report.left_out).iter().for_each(|what| say(&format!("left out: {what}")));
    folded(&report.notes).iter().for_each(|note| say(&format!("note: {note}")));
    let segments = flight.segment.iter().collect::<std::collections::BTreeSet<_>>().len();
    let hours = flight.time_s.last().copied().unwrap_or(0.0) / 3600.0;
    say(&format!("wrote {}: {} rows, {segments} segments, {hours:.2} h", args.out.display(), flight.len()));
    if let Some(vehicle) = vehicle.filter(|_| args.vehicle.is_none()) {
        say(&format!("vehicle: {} lies beside it and is copied (--class CLASS makes a new one)", vehicle.display()));
    }
    let made = if first { " (its vehicle.toml is a first one: look through its numbers)" } else { "" };
    if report.not_comparable().is_some() {
        say(&format!("next: glider export {} --to netcdf (a comparison is not possible)", args.out.display()));
    } else {
        say(&format!("next: glider compare --flight {}{made}", args.out.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_thousand_alike_notes_are_three_lines() {
        let notes =
            |count: usize| (0..count).map(|k| format!("unit-{k}.tbd: the CTD was off")).chain(["another".to_owned()]).collect::<Vec<_>>();
        assert_eq!((folded(&notes(3)), folded(&notes(4))), (notes(3), notes(4)));
        let many = folded(&notes(1000));
        assert_eq!((many.len(), many[3].as_str()), (4, "another"));
        assert!(many[2].ends_with("off (likewise 997 more: import.json lists them)"), "{}", many[2]);
    }
}
