//! `glider history`.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use discovery::history::file::{History, Stored};
use discovery::history::flight::{by_history, read};
use discovery::history::judge::judge;
use discovery::history::learn::Forward;
use discovery::history::numbers::{ALL, NUMBERS, Numbers, in_effect};
use discovery::history::rows::units;
use serde_json::{Value, json};

use super::logged::{log_of, logged};
use super::{Output, Verdict};
use crate::packets::vehicle_of_history;
use crate::terminal::{say, table};
use rig::whole_file;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider history calibrated.history
  glider history calibrated.history --add next_flight_dir --vehicle calibrated.toml
  glider history calibrated.history --add after_repair_dir --accept

calibrate writes NAME.history beside the vehicle file NAME; diagnose judges by it. Quiet dives that are added become controls, the last
24 of them judge; dives that are not quiet are kept and do not, unless they are accepted as the new normal.
Exit code 0: done; 1: the history does not predict itself, or a dive that was added is not quiet; 2: bad input.")]
pub struct Args {
    /// The history.
    #[arg(value_name = "FILE")]
    history: PathBuf,
    /// Judge the dives of this flight and add them (may be repeated, in the order of time).
    #[arg(long, value_name = "DIR|CSV")]
    add: Vec<PathBuf>,
    /// Vehicle file of the history; default: the one that it lies beside.
    #[arg(long, value_name = "FILE", requires = "add")]
    vehicle: Option<PathBuf>,
    /// Dives that are added are the new normal, quiet or not.
    #[arg(long, requires = "add")]
    accept: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mut history = read(&args.history).map_err(|e| anyhow::anyhow!(e))?;
    let mut loud = 0;
    for flight in &args.add {
        loud += add(&mut history, args, flight)?;
    }
    if !args.add.is_empty() {
        whole_file::write(&args.history, history.text()).with_context(|| format!("cannot write {}", args.history.display()))?;
    }
    let alike = history.learnt().predicts_itself();
    output.emit(&document(&history, &args.history), || print(&history, &args.history));
    Ok(if alike && loud == 0 { Verdict::Ok } else { Verdict::Negative })
}

/// Judges the dives of a flight and adds them; how many are not quiet.
fn add(history: &mut History, args: &Args, flight: &Path) -> anyhow::Result<usize> {
    /// Numbers of a file that was not edited differ by rounding alone, in sizes.
    const SAME: f64 = 1e-3;
    let file = args.vehicle.clone().map_or_else(|| vehicle_of_history(&args.history), Ok)?;
    let (log, vehicle) = logged(flight, Some(&file))?;
    let edited = history.edited(&vehicle);
    anyhow::ensure!(
        edited.amax() < SAME,
        "{}: its {} is not the one that the history was learnt with; calibrate again, or name that file with --vehicle",
        file.display(),
        ALL[edited.iamax()].name.replace('_', " ")
    );
    let known = history.units.iter().any(|u| u.log_sha256 == log.sha256);
    anyhow::ensure!(!known, "{}: the history has the dives of this log", log_of(flight).display());
    let found = units(&log.flight);
    anyhow::ensure!(!found.is_empty(), "{}: no dive with steady legs", flight.display());
    let mut loud = 0;
    for unit in &found {
        let (glider, learnt) = (history.glider(&vehicle), history.learnt());
        let said = judge(unit, &glider, &learnt, &learnt.at);
        let is_quiet = said.is_quiet() && learnt.predicts_itself();
        loud += usize::from(!is_quiet);
        let compared = Forward { quiet: is_quiet || args.accept, chi2: said.chi2 };
        history.units.push(Stored::of(unit, &glider, &Numbers::from(history.head.at), Some(learnt.usual_level), compared, &log.sha256));
    }
    if loud > 0 && !args.accept {
        let why = by_history(history, "", &log.flight, &vehicle).map_or_else(String::new, |said| said.words());
        eprintln!("{}: {loud} of {} dives are not quiet and do not judge: {why}", flight.display(), found.len());
    }
    Ok(loud)
}

/// Forward chances of the quiet units: rank of each among those before it.
fn chances(history: &History) -> Vec<f64> {
    let chi2 = history.earlier_chi2();
    (1..chi2.len()).map(|i| discovery::history::weigh::chance(chi2[i], &chi2[..i]).0).collect()
}

/// As JSON.
#[must_use]
pub(super) fn document(history: &History, file: &Path) -> Value {
    let learnt = history.learnt();
    let scatter = &learnt.between.scatter;
    let sigma = |i: usize| scatter[(i, i)].sqrt();
    let correlations: Vec<Vec<f64>> =
        (0..NUMBERS).map(|i| (0..NUMBERS).map(|k| scatter[(i, k)] / (sigma(i) * sigma(k))).collect()).collect();
    let sizes = discovery::history::numbers::sizes(history.head.drive_m3);
    let number = |i: usize| {
        let at = (learnt.at[i] + learnt.between.mean[i]) * sizes[i];
        json!({"number": ALL[i].name, "effect": ALL[i].effect, "parameter": ALL[i].parameter().name, "unit": ALL[i].parameter().unit,
            "mean": in_effect(i, at, history.head.claims[i]), "mean_in_sizes": learnt.at[i] + learnt.between.mean[i],
            "between_dives_in_sizes": sigma(i), "of_mean_in_sizes": learnt.between.of_mean[(i, i)].sqrt(), "mirror": ALL[i].mirror})
    };
    let unit = |u: &Stored| json!({"id": u.id, "start_s": u.start_s, "quiet": u.quiet, "chi2_per_number": u.chi2, "rows": u.rows});
    json!({
        "file": file.display().to_string(),
        "schema": history.head.schema,
        "vehicle": history.head.vehicle,
        "units": history.units.iter().map(unit).collect::<Vec<_>>(),
        "controls": learnt.units.len(),
        "numbers": (0..NUMBERS).map(number).collect::<Vec<_>>(),
        "correlations": correlations,
        "gate": {"chi2_per_number": if learnt.chi2.is_finite() { json!(learnt.chi2) } else { Value::Null },
            "predicts_itself": learnt.predicts_itself(), "says": History::gate(&learnt)},
        "forward_chances": chances(history),
    })
}

/// The history in a line or two.
pub(super) fn print_short(history: &History, file: &Path) {
    let learnt = history.learnt();
    say(&format!("History: {}: {} dives, {} quiet ones judge the next", file.display(), history.units.len(), learnt.units.len()));
    History::gate(&learnt).iter().for_each(|why| say(why));
}

fn print(history: &History, file: &Path) {
    let learnt = history.learnt();
    let scatter = &learnt.between.scatter;
    let mut t = table(["number", "mean", "between dives", "1", "2", "3", "4", "5", "6", "7"]);
    for i in 0..NUMBERS {
        let mut row = vec![
            format!("{} {}", i + 1, ALL[i].name),
            format!("{:+.2}", learnt.at[i] + learnt.between.mean[i]),
            format!("{:.2}", scatter[(i, i)].sqrt()),
        ];
        row.extend((0..i).map(|k| format!("{:+.2}", scatter[(i, k)] / (scatter[(i, i)] * scatter[(k, k)]).sqrt())));
        row.resize(10, String::new());
        t.add_row(row);
    }
    println!("{t}");
    say("mean beyond the vehicle file, and standard deviation between dives, in usual sizes of an error; then correlations");
    print_short(history, file);
    let loud: Vec<&str> = history.units.iter().filter(|u| !u.quiet).map(|u| u.id.as_str()).collect();
    if !loud.is_empty() {
        say(&format!("not quiet, and no controls: {}", loud.join(", ")));
    }
    if learnt.chi2.is_finite() {
        say(&format!("each control against the others: chi2 {:.2} per number", learnt.chi2));
    }
    let p: Vec<String> = chances(history).iter().map(|p| format!("{p:.2}")).collect();
    say(&format!("chances of the quiet dives, in the order of time: {}", p.join(" ")));
}
