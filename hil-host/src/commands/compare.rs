//! `glider compare`.

use super::diagnose::load;
use super::{Output, Verdict};
use discovery::{compare, report};
use serde_json::json;
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider compare --flight trial_dir\n  glider compare --flight flight.csv --vehicle vehicle.toml --json\n\nThe model is the one of the vehicle file as it stands, with its effects on; nothing is fitted."
)]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file; default: the one beside the flight.
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let (flight, vehicle) = load(&args.flight, args.vehicle.as_deref())?;
    let c = compare::compare(&flight, &vehicle);
    anyhow::ensure!(!c.samples.is_empty(), "{}: no row deeper than 2 m and a minute under way; nothing to compare", args.flight.display());
    let n = report::number;
    let document = json!({
        "flight": args.flight.display().to_string(),
        "vehicle": vehicle.path.display().to_string(),
        "tool": env!("CARGO_PKG_VERSION"),
        "rms_cm_s": n(c.rms_m_s * 100.0),
        "steady_rms_cm_s": n(c.steady_rms_m_s * 100.0),
        "filter": format!("depth rate: local quadratic over {} s, measurement and model alike", 2.0 * compare::RATE_WINDOW_S),
        "block_error_m_s": n(c.block_error_m_s),
        "blocks": c.blocks.0,
        "block_segments": if c.blocks.1 { "check" } else { "all" },
        "noise_floor_cm_s": n(c.noise_floor_m_s * 100.0),
        "speed_bias_cm_s": c.speed_error_m_s.map(|s| n(s.0 * 100.0)),
        "speed_rms_cm_s": c.speed_error_m_s.map(|s| n(s.1 * 100.0)),
        "where": report::findings(&c.findings),
        "notes": c.notes,
    });
    output.emit(&document, || {
        println!(
            "Depth rate, measured against modelled: rms {:.2} cm/s, steady {:.2} cm/s ({} rows, filter 21 s).",
            c.rms_m_s * 100.0,
            c.steady_rms_m_s * 100.0,
            c.samples.len()
        );
        println!(
            "Block error (20 s, {} segments): {:.2} cm/s over {} blocks; ordinary water motion and sensors alone would leave {:.2} cm/s.",
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
    Ok(Verdict::Ok)
}
