//! `glider compare`.

use super::diagnose::load;
use super::{Output, Verdict};
use anyhow::Context as _;
use discovery::diagnosis::report;
use discovery::record::csv;
use discovery::steady::{HeldOut, held_out};
use discovery::workbench::compare;
use discovery::workbench::compare::Comparison;
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
    /// Vehicle file; default: the one beside the flight.
    #[arg(long, value_name = "FILE")]
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
        "filter": format!("depth rate: local quadratic over {} s, measurement and model alike", 2.0 * compare::RATE_WINDOW_S),
        "block_error_m_s": n(c.block_error_m_s),
        "blocks": c.blocks.0,
        "block_s": n(c.block_s),
        "block_segments": if c.blocks.1 { "check" } else { "all" },
        "noise_floor_cm_s": n(c.noise_floor_m_s * 100.0),
        "speed_bias_cm_s": c.speed_error_m_s.map(|s| n(s.0 * 100.0)),
        "speed_rms_cm_s": c.speed_error_m_s.map(|s| n(s.1 * 100.0)),
        "where": report::findings(&c.findings),
        "notes": c.notes,
    })
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(test) = &args.test {
        let (fitted, judged) = (csv::flight(&args.flight)?, csv::flight(test)?);
        let found = held_out(&fitted, &judged).with_context(|| format!("{} judged on {}", args.flight.display(), test.display()))?;
        output.emit(&serde_json::to_value(&found)?, || show(&found));
        return Ok(Verdict::Ok);
    }
    let (flight, vehicle) = load(&args.flight, args.vehicle.as_deref())?;
    let c = compare::compare(&flight, &vehicle);
    anyhow::ensure!(!c.samples.is_empty(), "{}: no row deeper than 2 m and a minute under way; nothing to compare", args.flight.display());
    let document = document(&c, &args.flight.display().to_string(), &vehicle.path.display().to_string());
    output.emit(&document, || {
        println!(
            "Depth rate, measured against modelled: rms {:.2} cm/s, steady {:.2} cm/s ({} rows, filter 21 s).",
            c.rms_m_s * 100.0,
            c.steady_rms_m_s * 100.0,
            c.samples.len()
        );
        println!(
            "Block error ({:.0} s, {} segments): {:.2} cm/s over {} blocks; ordinary water motion and sensors alone would leave {:.2} cm/s.",
            c.block_s,
            if c.blocks.1 { "check" } else { "all" },
            c.block_error_m_s * 100.0,
            c.blocks.0,
            c.noise_floor_m_s * 100.0
        );
        if let Some((bias, rms)) = c.speed_error_m_s {
            println!("Speed through the water: bias {:+.2} cm/s, rms {:.2} cm/s.", bias * 100.0, rms * 100.0);
        }
        let mut table = comfy_table::Table::new();
        table.set_header(["variable", "where most", "phase", "mean there cm/s", "share of error", "chance does as well"]);
        for f in &c.findings {
            table.add_row([
                f.variable.to_string(),
                format!("{:.3} to {:.3} {}", f.range.0, f.range.1, f.unit),
                f.phase.to_string(),
                format!("{:+.2}", f.mean_m_s * 100.0),
                format!("{:.0} %", f.share_of_error * 100.0),
                format!("{:.1} %", f.p_value * 100.0),
            ]);
        }
        println!("{table}");
        for note in &c.notes {
            println!("Note: {note}");
        }
    });
    // Nothing was compared: neither a number nor calm.
    Ok(if c.rms_m_s.is_finite() && c.block_error_m_s.is_finite() { Verdict::Ok } else { Verdict::Negative })
}

/// The steps and what the other flight says of each effect, for a person.
fn show(found: &HeldOut) {
    println!("Steady glides: rms error of vertical velocity, cm/s.");
    let mut steps = comfy_table::Table::new();
    steps.set_header(["step", "fitted flight", "other flight"]);
    for step in &found.ladder {
        let other = step.test_rms_cm_s.map_or_else(String::new, |e| format!("{e:.2}"));
        steps.add_row([step.title.to_owned(), format!("{:.2}", step.rms_cm_s), other]);
    }
    println!("{steps}");
    println!("What the other flight asks for ({} legs):", found.legs);
    let mut sets = comfy_table::Table::new();
    sets.set_header(["effects beside drag and trim", "fitted flight", "other flight", "worse than the best, standard errors"]);
    for set in &found.sets {
        sets.add_row([
            names(&set.effects),
            format!("{:.2}", set.fitted_cm_s),
            format!("{:.2}", set.test_cm_s),
            format!("{:.1}{}", set.t, if set.as_good { ": as good" } else { "" }),
        ]);
    }
    println!("{sets}");
    let named: Vec<String> = found.named.iter().map(|n| names(n)).collect();
    println!(
        "Named: {}. With the first {:.2} cm/s on the fitted flight, {:.2} cm/s on the other.",
        named.join("; not told apart from it: "),
        found.fitted_cm_s,
        found.test_cm_s
    );
    println!("Values are of the fitted flight alone; the set was chosen on the other.");
}

fn names(effects: &[&str]) -> String {
    if effects.is_empty() { "nothing".into() } else { effects.join(" + ") }
}
