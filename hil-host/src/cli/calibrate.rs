//! `glider calibrate`.

use super::add::write_vehicle;
use super::diagnose::bar;
use super::logged::logged;
use super::{Output, Verdict};
use crate::terminal::{rounded, say, table, wrapped};
use anyhow::Context as _;
use comfy_table::Table;
use discovery::diagnosis::report::number;
use discovery::history::file::{self, History};
use discovery::history::rows::units;
use discovery::workbench::calibrate::{Calibrated, Logged, Number, Options, calibrate, free_names};
use logs::digest::sha256;
use logs::{Flight, vehicle};
use rig::flight::vehicles;
use rig::whole_file;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider calibrate --flight first_dir --out calibrated.json
  glider calibrate --flight may.csv --flight june.csv --vehicle shipped.toml --out calibrated.toml
  glider calibrate --flight day1.csv --flight day9.csv --vehicle v.toml --one-deployment --out v2.json
  glider calibrate --flight day1.csv --vehicle v.toml --free hull_compressibility,thermal_expansion --out v2.json
Then: glider diagnose --flight next.csv --vehicle v2.json; glider timeline mission_dir --vehicle v2.json

Shared by all flights: drag, lift, added mass, hull. Of each flight: clock, pressure zero, and (without --one-deployment) trim and pitch
zero. A tolerance that is written is the standard deviation that the next flight's number is expected within.
Exit code 0: done; 1: on the segments kept out of the fit the calibrated vehicle is worse than the one given; 2: bad input.")]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file; several of one vehicle may be named.
    #[arg(long, value_name = "DIR|CSV", required = true)]
    flight: Vec<PathBuf>,
    /// Vehicle file to start from, or a built-in one by name; default: the one beside the first flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Where to write the calibrated vehicle file (.json or .toml).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Numbers whose tolerance in the file is not to be believed, separated by commas.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    free: Vec<String>,
    /// All flights, and the next, are of one deployment: trim and pitch zero are shared, and known afterwards.
    #[arg(long)]
    one_deployment: bool,
}

/// Refuses a flight that holds the same log as one of those `before` it.
///
/// # Errors
/// Both names.
pub(crate) fn named_once<'a>(
    path: &Path,
    flight: &Flight,
    mut before: impl Iterator<Item = (&'a PathBuf, &'a Flight)>,
) -> anyhow::Result<()> {
    match before.find(|(_, other)| other.is_same_log(flight)) {
        Some((other, _)) => anyhow::bail!("{}: the same log as {}; name every flight once", path.display(), other.display()),
        None => Ok(()),
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let own_files: Vec<PathBuf> = args.flight.iter().flat_map(|f| vehicle::files_next_to(f)).collect();
    let inputs: Vec<&Path> = args.flight.iter().chain(&own_files).chain(&args.vehicle).map(PathBuf::as_path).collect();
    whole_file::may_write(&args.out, &inputs, &["json", "toml"], output.force)?;
    whole_file::may_write(&args.out.with_extension(file::ENDING), &inputs, &[file::ENDING], output.force)?;
    for name in &args.free {
        let all = free_names();
        let meant = || rig::spelling::meant(name, all.iter().copied());
        anyhow::ensure!(all.contains(&name.as_str()), "--free {name}: no such number; there are {}{}", all.join(", "), meant());
    }
    let own_file = || args.flight.first().map_or(Ok(None), |f| vehicle::file_next_to(f));
    let start = args.vehicle.clone().map_or_else(own_file, |named| Ok(Some(named)))?;
    let mut flights: Vec<Logged> = Vec::new();
    let mut given = None;
    for path in &args.flight {
        // First: the first flight's file says nothing of the segments of another vehicle.
        if args.vehicle.is_none() && !flights.is_empty() {
            of_one_vehicle(&args.flight[0], given.as_ref(), path)?;
        }
        let (one, vehicle) = logged(path, start.as_deref())?;
        named_once(path, &one.flight, args.flight.iter().zip(flights.iter().map(|f| &f.flight)))?;
        flights.push(one);
        given = given.or(Some(vehicle));
    }
    let vehicle = given.context("no flight is named: --flight DIR|CSV")?;
    let parent = vehicles::text(&vehicle.path)?.into_bytes();
    let options = Options { free: args.free.clone(), one_deployment: args.one_deployment };
    let bar = bar();
    let done = calibrate(&flights, &vehicle, &options, &parent, &|what, share| {
        bar.set_position((100.0 * share) as u64);
        bar.set_message(what.to_owned());
    });
    bar.finish_and_clear();
    let mut done = done?;
    if let Some(why) = refused(&done, &args.out) {
        done.notes.push(format!("{why}: the file that is written has the numbers of the one given, and its history judges by the dives"));
        done.vehicle = vehicle.document.clone();
    }
    // Which segments are fitted and which check is said of the logs at hand, not of the next.
    if let Some(of_vehicle) = done.vehicle.as_object_mut() {
        of_vehicle.remove("segments");
    }
    write_vehicle(&args.out, &done.vehicle)?;
    let history = write_history(&flights, &args.out)?;
    let mut document = document(&done, &args.out);
    document["history"] = history.as_ref().map_or(Value::Null, |(file, history)| super::history::document(history, file));
    output.emit(&document, || {
        for note in &done.notes {
            println!("{}", wrapped(&format!("Note: {note}"), 6));
        }
        println!("{}\n", numbers(&done.numbers));
        println!("{}", flights_table(&done));
        say("errors: block depth-rate errors in cm/s, as given > calibrated; the floor is what water and sensors alone would leave");
        match &history {
            Some((file, history)) => super::history::print_short(history, file),
            None => say("No history: fewer than three dives with steady legs"),
        }
        println!("Calibrated vehicle file: {}", args.out.display());
    });
    Ok(if worse(&done) { Verdict::Negative } else { Verdict::Ok })
}

/// Writes the history of the dives beside the calibrated vehicle file; none of fewer than three.
fn write_history(flights: &[Logged], vehicle_file: &Path) -> anyhow::Result<Option<(PathBuf, History)>> {
    let vehicle = vehicles::read(vehicle_file)?;
    let hash = sha256(vehicles::text(vehicle_file)?.as_bytes());
    let logs: Vec<_> = flights.iter().map(|l| file::Logged { units: units(&l.flight), sha256: l.sha256.clone() }).collect();
    let path = vehicle_file.with_extension(file::ENDING);
    let Some(history) = History::learnt_from(&logs, &vehicle, &hash) else {
        // One of the file that was replaced is another vehicle's.
        std::fs::remove_file(&path).ok();
        return Ok(None);
    };
    whole_file::write(&path, history.text()).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(Some((path, history)))
}

/// Refuses a flight whose own vehicle file is of another vehicle than the first flight's: its wings are others, or its mass differs by more
/// than ballasting makes.
fn of_one_vehicle(first: &Path, given: Option<&logs::Vehicle>, other: &Path) -> anyhow::Result<()> {
    /// Share of the mass (guess).
    const BALLASTED: f64 = 0.03;
    let (Some(given), Some(own)) = (given, vehicle::file_next_to(other)?) else { return Ok(()) };
    let other = vehicles::read(&own)?;
    let wings = [given, &other].map(crate::next_mission::wings);
    anyhow::ensure!(
        wings[0] == wings[1],
        "{} has {} wings, the vehicle of {} {}: flights of one wing set are calibrated together",
        own.display(),
        wings[1],
        first.display(),
        wings[0]
    );
    let [a, b] = [given.constants.mass_kg, other.constants.mass_kg];
    anyhow::ensure!(
        (b / a - 1.0).abs() <= BALLASTED,
        "{} weighs {b:.1} kg, the vehicle of {} {a:.1} kg: flights of one vehicle are calibrated together; if they are, name it with --vehicle",
        own.display(),
        first.display()
    );
    Ok(())
}

/// Why a calibrated vehicle is not to be used: a number that no vehicle has, or errors that are larger than before.
fn refused(done: &Calibrated, out: &Path) -> Option<String> {
    let unsound = vehicle::parse(done.vehicle.clone(), out).err().map(|e| format!("the fit of all flights together lost its way ({e})"));
    unsound.or_else(|| worse(done).then(|| "the calibrated numbers are worse than those given".to_owned()))
}

/// Whether the calibrated vehicle is worse than the one given by a twentieth over all flights, on held-out segments where there are any.
fn worse(done: &Calibrated) -> bool {
    /// Chance on one or two held-out dives.
    const CHANCE: f64 = 1.05;
    let [mut before, mut after] = [0.0, 0.0];
    for flight in &done.flights {
        let [fitted, held_out] = flight.error_m_s;
        let of = if held_out[0].is_finite() { held_out } else { fitted };
        before += of[0].powi(2);
        after += of[1].powi(2);
    }
    !(after.sqrt() <= CHANCE * before.sqrt())
}

fn document(done: &Calibrated, out: &Path) -> Value {
    let cm = |v: f64| number(100.0 * v);
    let flights: Vec<Value> = done
        .flights
        .iter()
        .map(|t| {
            let own = |(value, sigma): (f64, f64)| json!({"value": number(value), "sigma": number(sigma)});
            let sensors: Vec<Value> = t
                .sensors
                .iter()
                .map(|s| json!({"what": s.what, "value": number(s.value), "low": number(s.low), "high": number(s.high), "unit": s.unit}))
                .collect();
            json!({
                "flight": t.flight, "sha256": t.sha256, "fitted_segments": t.fitted_segments,
                "error_before": cm(t.error_m_s[0][0]), "error_after": cm(t.error_m_s[0][1]),
                "error_before_heldout": cm(t.error_m_s[1][0]), "error_after_heldout": cm(t.error_m_s[1][1]),
                "noise_floor": cm(t.noise_floor_m_s), "discrepancy_cm_s": cm(t.discrepancy_m_s),
                "trim_cc": own(t.own[0]), "pitch_zero_rad": own(t.own[1]), "sensors": sensors,
            })
        })
        .collect();
    let numbers: Vec<Value> = done
        .numbers
        .iter()
        .map(|n| {
            let interval = n.interval();
            json!({
                "name": n.name, "unit": n.unit, "before": number(n.value[0]), "after": number(n.value[1]),
                "low": interval.map(|i| number(i.0)), "high": interval.map(|i| number(i.1)),
                "sigma_before": n.tolerance.map(|t| number(t[0])), "sigma_after": n.tolerance.map(|t| number(t[1])),
                "between_flights": n.between_flights.map(number),
            })
        })
        .collect();
    json!({"vehicle": out.display().to_string(), "unit": "cm/s", "flights": flights, "numbers": numbers, "notes": done.notes})
}

fn numbers(all: &[Number]) -> Table {
    let mut t = table(["number", "given", "calibrated", "between flights", "unit"]);
    for n in all {
        let with = |value: f64, sigma: Option<f64>| match (value.abs(), sigma) {
            (small, Some(sigma)) if small > 0.0 && small < 1e-3 && sigma < 1e-3 => format!("{value:.2e} ± {sigma:.1e}"),
            (_, Some(sigma)) => {
                format!("{} ± {}", rounded(value, value - sigma, value + sigma), rounded(sigma, value - sigma, value + sigma))
            }
            (_, None) => format!("{value:.3}"),
        };
        t.add_row([
            n.name.to_owned(),
            with(n.value[0], n.tolerance.map(|t| t[0])),
            with(n.value[1], n.tolerance.map(|t| t[1])),
            n.between_flights.map_or("–".to_owned(), |v| format!("{v:.1e}")),
            n.unit.to_owned(),
        ]);
    }
    t
}

fn flights_table(done: &Calibrated) -> Table {
    let mut t = table(["flight", "fitted", "held out", "floor", "trim, cm3", "pitch zero, deg"]);
    for f in &done.flights {
        let pair = |[a, b]: [f64; 2]| if a.is_finite() { format!("{:.2} > {:.2}", 100.0 * a, 100.0 * b) } else { "–".into() };
        let [trim, zero] = f.own;
        t.add_row([
            f.flight.clone(),
            pair(f.error_m_s[0]),
            pair(f.error_m_s[1]),
            format!("{:.2}", 100.0 * f.noise_floor_m_s),
            format!("{:+.1} ± {:.1}", trim.0, trim.1),
            format!("{:+.2} ± {:.2}", zero.0.to_degrees(), zero.1.to_degrees()),
        ]);
    }
    t
}
