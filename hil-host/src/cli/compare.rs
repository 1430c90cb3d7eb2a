//! `glider compare`.

use super::diagnose::load_sound;
use super::{Output, Verdict};
use crate::terminal::{Ladder, place, say, table, wrapped};
use anyhow::Context as _;
use discovery::diagnosis::report;
use discovery::steady::{HeldOut, held_out};
use discovery::workbench::compare;
use discovery::workbench::compare::Comparison;
use logs::Vehicle;
use logs::record::csv;
use rig::flight::file_kinds::{Kind, expect};
use rig::spelling::meant_path;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider compare --flight trial_dir\n  glider compare --flight flight.csv --vehicle vehicle.toml --json\n  glider compare --flight june.csv --test july.csv\n\nThe model is the one of the vehicle file as it stands, with its effects on; nothing is fitted.\nWith --test a steady glide of nominal Slocum coefficients is fitted to --flight, step by step, and\njudged on the other flight: which effects does that one ask for? No vehicle file is needed."
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Another flight of the same vehicle: fit steady glides to --flight, believe this one.
    #[arg(long, value_name = "DIR|CSV", conflicts_with = "vehicle")]
    test: Option<PathBuf>,
}

/// The comparison as one JSON document.
#[must_use]
pub fn document(c: &Comparison, flight: &str, vehicle: &str) -> Value {
    let n = report::number;
    json!({
        "flight": flight,
        "vehicle": vehicle,
        "tool": env!("CARGO_PKG_VERSION"),
        "rms_cm_s": n(c.rms_m_s * 100.0),
        "steady_rms_cm_s": n(c.steady_rms_m_s * 100.0),
        "filter": c.filter("depth rate: local quadratic over {}, measurement and model alike"),
        "block_error_m_s": n(c.block_error_m_s),
        "blocks": c.blocks.0,
        "block_s": n(c.block_s),
        "block_segments": if c.blocks.1 { "check" } else { "fitted" },
        "noise_floor_cm_s": n(c.noise_floor_m_s * 100.0),
        "speed_bias_cm_s": c.speed_error_m_s.map(|s| n(s.0 * 100.0)),
        "speed_rms_cm_s": c.speed_error_m_s.map(|s| n(s.1 * 100.0)),
        "where": report::findings(&c.findings),
        "notes": c.notes,
    })
}

/// Refuses the comparison with a model that diverged.
///
/// # Errors
/// Which numbers of the vehicle file are to be looked at.
pub(crate) fn not_diverged(c: Comparison, vehicle: &Vehicle) -> anyhow::Result<Comparison> {
    c.diverged(vehicle).map_or(Ok(c), |why| anyhow::bail!("{}: {why}", vehicle.path.display()))
}

/// The error of the depth rate in words; where there are no rates or no steady glides, that instead of a number.
fn depth_rate(c: &Comparison) -> String {
    let rows = c.samples.len();
    if !c.rms_m_s.is_finite() {
        return format!("Depth rate: not compared, {} ({rows} rows).", c.filter("no row has one"));
    }
    let steady =
        if c.steady_rms_m_s.is_finite() { format!("steady {:.2} cm/s", c.steady_rms_m_s * 100.0) } else { "no steady rows".into() };
    format!("Depth rate, measured against modelled: rms {:.2} cm/s, {steady}\n({rows} rows, {}).", c.rms_m_s * 100.0, c.filter("filter {}"))
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(test) = &args.test {
        for path in [&args.flight, test] {
            anyhow::ensure!(path.exists(), "{}: no such flight{}", path.display(), meant_path(path));
            expect(path, Kind::Flight)?;
        }
        let (fitted, judged) = (csv::flight(&args.flight)?, csv::flight(test)?);
        anyhow::ensure!(
            !fitted.is_same_log(&judged),
            "--test {}: the same rows as --flight {}; a flight cannot judge its own fit",
            test.display(),
            args.flight.display()
        );
        let found = held_out(&fitted, &judged).with_context(|| format!("{} judged on {}", args.flight.display(), test.display()))?;
        output.emit(&serde_json::to_value(&found)?, || show(&found));
        return Ok(Verdict::Ok);
    }
    let (flight, vehicle) = load_sound(&args.flight, args.vehicle.as_deref())?;
    let c = not_diverged(compare::compare(&flight, &vehicle), &vehicle)?;
    anyhow::ensure!(!c.samples.is_empty(), "{}: no row deeper than 2 m and a minute under way; nothing to compare", args.flight.display());
    let document = document(&c, &args.flight.display().to_string(), &vehicle.path.display().to_string());
    output.emit(&document, || {
        println!("{}", depth_rate(&c));
        if let Some((bias, rms)) = c.speed_error_m_s {
            println!("Speed through the water: bias {:+.2} cm/s, rms {:.2} cm/s.", bias * 100.0, rms * 100.0);
        }
        for note in &c.notes {
            println!("{}", wrapped(&format!("Note: {note}"), 6));
        }
        let mut t = table(["where it fails", "most of it at", "phase", "mean, cm/s", "share", "chance"]);
        for f in &c.findings {
            t.add_row([
                f.variable.replace('_', " "),
                place(f),
                f.phase.to_string(),
                format!("{:+.2}", f.mean_m_s * 100.0),
                format!("{:.0} %", f.share_of_error * 100.0),
                format!("{:.1} %", f.p_value * 100.0),
            ]);
        }
        println!("{t}\nmean: residual there; share: of the squared error; chance: its p-value\n");
        let ladder = Ladder { as_given: c.block_error_m_s, recalibrated: None, with: None, floor: None, held_out: c.blocks.1 };
        print!("{}", ladder.text());
        let stated = format!(
            "The vehicle file has water and sensors alone leave {:.2} cm/s; what they do leave, the floor, takes a fit: glider diagnose.",
            100.0 * c.noise_floor_m_s
        );
        println!("{}", wrapped(&stated, 0));
        println!("Of the model as given, nothing fitted, in {:.0} s blocks. Next: glider diagnose", c.block_s);
    });
    // Nothing was compared: neither a number nor calm.
    Ok(if c.rms_m_s.is_finite() && c.block_error_m_s.is_finite() { Verdict::Ok } else { Verdict::Negative })
}

/// The steps and what the other flight says of each effect, for a person.
fn show(found: &HeldOut) {
    say("Steady glides: rms error of vertical velocity, cm/s.");
    let mut steps = table(["step", "fitted flight", "other flight"]);
    for step in &found.ladder {
        let other = step.test_rms_cm_s.map_or_else(String::new, |e| format!("{e:.2}"));
        steps.add_row([step.title.to_owned(), format!("{:.2}", step.rms_cm_s), other]);
    }
    say(&format!("{steps}"));
    say(&format!("What the other flight asks for ({} legs):", found.legs));
    let mut sets = table(["effects beside drag and trim", "fitted flight", "other flight", "worse than the best, standard errors"]);
    for set in &found.sets {
        sets.add_row([
            names(&set.effects),
            format!("{:.2}", set.fitted_cm_s),
            format!("{:.2}", set.test_cm_s),
            format!("{:.1}{}", set.t, if set.as_good { ": as good" } else { "" }),
        ]);
    }
    say(&format!("{sets}"));
    let named: Vec<String> = found.named.iter().map(|n| names(n)).collect();
    say(&format!(
        "Named: {}. With the first {:.2} cm/s on the fitted flight, {:.2} cm/s on the other.",
        named.join("; not distinguished from it: "),
        found.fitted_cm_s,
        found.test_cm_s
    ));
    say("Values are of the fitted flight alone; the set was chosen on the other.");
}

fn names(effects: &[&str]) -> String {
    if effects.is_empty() { "nothing".into() } else { effects.join(" + ") }
}
