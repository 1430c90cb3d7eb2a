//! `glider diagnose`.

use super::{Output, Verdict, surfacing};
use crate::terminal::{Ladder, parameter, table, wrapped};
use anyhow::Context as _;
use console::style;
use discovery::diagnosis::{self, Diagnosis, report};
use discovery::history::file::History;
use discovery::history::flight as history;
use discovery::hypotheses::search::Depth;
use discovery::preprocess::{prepare, sanity};
use discovery::workbench::calibrate::free_names;
use indicatif::{ProgressBar, ProgressStyle};
use logs::record::csv;
use logs::{Flight, Vehicle, vehicle};
use rig::flight::file_kinds::{Kind, expect, is_surfacings};
use rig::flight::vehicles;
use rig::spelling::meant_path;
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider diagnose --flight trial_dir\n  glider diagnose --flight flight.csv --vehicle vehicle.json --json\n  glider diagnose --flight trial_dir --predict after.csv\n  glider diagnose --flight trial_dir --depth 3\n  glider diagnose --flight flight.csv --vehicle vehicle.json --quick\n  glider diagnose --flight mission.srf --history known.history\n\nOf messages of surfacings (a file .srf, or the log of a glider's terminal) what they say of the vehicle's numbers is judged as\nthe dives of a log are: by its history, or the last of them by those before it.\nExit code 0: done (whatever the verdict); 2: bad input."
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml), csv file, or messages of surfacings.
    #[arg(long, value_name = "DIR|CSV|SRF")]
    flight: PathBuf,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// History of the vehicle that judges the flight; default: NAME.history beside the vehicle file NAME, as calibrate writes it.
    #[arg(long, value_name = "FILE")]
    history: Option<PathBuf>,
    /// Of messages of surfacings: the controller's configuration that the board flew with; default: its hull is that of the vehicle file.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
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
    anyhow::ensure!(flight.exists(), "{}: no such flight{}", flight.display(), meant_path(flight));
    vehicle_file.map_or(Ok(()), vehicles::is_there)?;
    expect(flight, Kind::Flight)?;
    let own_file = || vehicle::file_next_to(flight);
    let file = vehicle_file
        .map_or_else(own_file, |named| Ok(Some(named.to_path_buf())))?
        .with_context(|| format!("{}: no vehicle.json or vehicle.toml beside the flight; name one with --vehicle", flight.display()))?;
    let (read, vehicle) = (csv::flight(flight)?, vehicles::read(&file)?);
    has_segments(&read, &vehicle).with_context(|| file.display().to_string())?;
    Ok((read, vehicle))
}

/// Refuses a vehicle file whose segments to fit, or to check with, are none of the flight's.
fn has_segments(flight: &Flight, vehicle: &Vehicle) -> anyhow::Result<()> {
    let mut has = flight.segment.clone();
    has.sort_unstable();
    has.dedup();
    for (key, wanted) in [("segments.fit", &vehicle.fit_segments), ("segments.check", &vehicle.check_segments)] {
        let missing = !wanted.is_empty() && !wanted.iter().any(|s| has.contains(s));
        anyhow::ensure!(
            !missing,
            "{key} is {wanted:?}: no such segment in {}, which has {}; name some of them",
            flight.name,
            in_runs(&has)
        );
    }
    Ok(())
}

/// Numbers in order, as in `0 to 4, 7`.
fn in_runs(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| *b == *a + 1).map(|run| match run {
        [first, .., last] => format!("{first} to {last}"),
        one => one.iter().map(u32::to_string).collect(),
    });
    runs.collect::<Vec<_>>().join(", ")
}

/// Reads a flight and its vehicle, and refuses what cannot be: columns that contradict a dive, a vehicle that floats on this water.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn load_sound(flight: &Path, vehicle_file: Option<&Path>) -> anyhow::Result<(Flight, Vehicle)> {
    let (read, vehicle) = load(flight, vehicle_file)?;
    sanity::check(&prepare(&read, &vehicle), &vehicle).map_err(|why| anyhow::anyhow!("{}: {why}", flight.display()))?;
    Ok((read, vehicle))
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

/// A history and its name, instead of the one next to the vehicle file.
type ByHistory<'a> = Option<(&'a History, &'a str)>;

/// Diagnoses a flight with a bar that reaches `end` %.
///
/// # Errors
/// Nothing in the flight that could be asked.
pub fn ask(flight: &Flight, vehicle: &Vehicle, depth: Depth, bar: &ProgressBar, end: f64) -> anyhow::Result<Diagnosis> {
    ask_by(None, flight, vehicle, depth, bar, end)
}

fn ask_by(history: ByHistory, flight: &Flight, vehicle: &Vehicle, depth: Depth, bar: &ProgressBar, end: f64) -> anyhow::Result<Diagnosis> {
    let found = diagnosis::diagnose_by(history, flight, vehicle, depth, &|what, share| {
        // A second look starts over; the bar does not.
        bar.set_position(bar.position().max((share * end) as u64));
        bar.set_message(what.to_string());
    });
    Ok(found.inspect_err(|_| bar.finish_and_clear())?)
}

/// Reads a flight and its vehicle and diagnoses it.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn load_and_ask(flight: &Path, vehicle_file: Option<&Path>, depth: Depth) -> anyhow::Result<(Flight, Vehicle, Diagnosis)> {
    load_and_ask_by(None, flight, vehicle_file, depth)
}

/// The same by a history and its name.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn load_and_ask_by(
    history: ByHistory,
    flight: &Path,
    vehicle_file: Option<&Path>,
    depth: Depth,
) -> anyhow::Result<(Flight, Vehicle, Diagnosis)> {
    let (flight, vehicle) = load(flight, vehicle_file)?;
    let bar = bar();
    let found = ask_by(history, &flight, &vehicle, depth, &bar, 100.0)?;
    bar.finish_and_clear();
    Ok((flight, vehicle, found))
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if is_surfacings(&args.flight) {
        return surfacings(args, output);
    }
    let depth = match args.depth {
        _ if args.quick => Depth::Singles,
        3.. => Depth::Triples,
        _ => Depth::Pairs,
    };
    if let Some(path) = &args.predict {
        let inputs: Vec<&Path> = [Some(args.flight.as_path()), args.vehicle.as_deref()].into_iter().flatten().collect();
        rig::whole_file::may_write(path, &inputs, &["csv"], output.force)?;
    }
    let history = args.history.as_deref().map(history::read).transpose().map_err(|e| anyhow::anyhow!(e))?;
    let file = args.history.as_ref().map(|file| file.display().to_string());
    let (flight, vehicle, found) = load_and_ask_by(history.as_ref().zip(file.as_deref()), &args.flight, args.vehicle.as_deref(), depth)?;
    if let Some(path) = &args.predict {
        rig::whole_file::write(path, report::prediction(&found, &vehicle)).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let mut document = report::document(&found, &vehicle, &args.flight.display().to_string());
    // A vehicle nobody has calibrated: what its steady glides alone tell, and whether a speed sensor was there to tell lift from pitch.
    let steady =
        if discovery::inference::initial_guess::is_uncalibrated(&vehicle) { discovery::steady::steady_report(&flight).ok() } else { None };
    if let Some(s) = &steady {
        document["steady"] = serde_json::to_value(s)?;
    }
    // Deviations of the recalibrated numbers from the file's, in tolerances: what is far outside is no calibration.
    let deviations = || free_names().iter().zip(found.recalibrated.calibration);
    document["recalibration_sigma"] =
        deviations().map(|(name, z)| ((*name).to_owned(), report::number(z))).collect::<serde_json::Map<_, _>>().into();
    output.emit(&document, || {
        candidates(&found);
        if let Some(s) = &steady {
            println!("{}", wrapped(&steady_words(s), 2));
        }
        for note in &found.notes {
            println!("{}", wrapped(&format!("Note: {note}"), 6));
        }
        println!("\n{}", Ladder::of(&found).text());
        if let Some(said) = found.history.as_ref().filter(|_| found.answered_by().is_none()) {
            println!("{}", wrapped(&format!("History: {}", said.words()), 9));
        }
        println!("Verdict: {}", style(found.verdict.name()).bold());
        println!("{}", wrapped(&report::explanation(&found), 0));
        println!("{}", wrapped(&format!("Next: {}", report::next_flight(&found)), 6));
    });
    Ok(Verdict::Ok)
}

/// What messages of surfacings say beside the vehicle's history.
fn surfacings(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    anyhow::ensure!(args.predict.is_none(), "--predict: messages of surfacings have no rows to predict; name the log");
    let name = args.flight.display().to_string();
    let messages = surfacing::messages(std::slice::from_ref(&args.flight))?;
    let own = args.vehicle.as_deref().filter(|_| args.history.is_none()).and_then(History::next_to);
    let history = args.history.as_deref().or(own.as_deref());
    let judges = surfacing::Judges::read(history, args.vehicle.as_deref(), args.config.as_deref())?;
    let judges = judges.with_context(|| format!("{name}: messages of surfacings; name who judges them with --history or --vehicle"))?;
    let said = judges.judge().together(&messages).with_context(|| name.clone())?;
    let document = serde_json::json!({ "flight": name, "surfacings": messages.len(), "history": said.document() });
    output.emit(&document, || println!("{}", wrapped(&format!("History: {}", said.words()), 9)));
    Ok(Verdict::Ok)
}

/// The best hypotheses, each with its numbers below it: a table of all that would be wider than a terminal.
fn candidates(found: &Diagnosis) {
    let mut t = table(["hypothesis", "prob.", "log odds", "fitted", "held out"]);
    for c in found.candidates.iter().take(6) {
        let cm = |e: f64| if e.is_finite() { format!("{:.3}", 100.0 * e) } else { "–".into() };
        t.add_row([
            c.effects.join(" + "),
            format!("{:.3}", c.probability),
            format!("{:+.1}", c.log_odds),
            cm(c.error_fitted_m_s),
            cm(c.error_check_m_s),
        ]);
    }
    println!("{t}\nprob.: among all hypotheses; log odds: against nothing missing; errors in cm/s");
    for p in found.candidates.iter().take(1).flat_map(|c| &c.parameters) {
        println!("  {}", parameter(p));
    }
}

fn steady_words(s: &discovery::steady::SteadyReport) -> String {
    let mut out = format!(
        "Steady glides alone (nominal Slocum coefficients): {:.2} cm/s nominal, {:.2} cm/s with drag and trim fitted. {}",
        s.before_cm_s, s.after_cm_s, s.identified
    );
    if let Some(w) = &s.with_speed {
        out += &format!(" With the speed sensor: true pitch = {:.3} x measured, speed bias {:+.2} cm/s.", w.pitch_scale, w.speed.bias_cm_s);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_segments_that_a_flight_has_not_are_refused() {
        let flight = Flight { name: "june".into(), segment: vec![0, 0, 1, 2, 5], ..Flight::default() };
        let vehicle = |fit: &[u32], check: &[u32]| {
            let known = vehicles::read(Path::new("slocum-standard-sea")).expect("built in");
            Vehicle { fit_segments: fit.into(), check_segments: check.into(), ..known }
        };
        for (fit, check, key) in [(&[99_u32][..], &[][..], "segments.fit is [99]"), (&[], &[99, 7], "segments.check is [99, 7]")] {
            let said = has_segments(&flight, &vehicle(fit, check)).expect_err("refused").to_string();
            assert!(said.starts_with(key) && said.contains("june, which has 0 to 2, 5;"), "{said}");
        }
        // The vehicle file of a longer flight.
        assert!(has_segments(&flight, &vehicle(&[0, 1, 8], &[2, 9])).is_ok() && has_segments(&flight, &vehicle(&[], &[])).is_ok());
    }
}
