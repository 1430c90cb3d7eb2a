//! `glider table`: builds the flight tables, prints bytes and interpolation error.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use control::Config;
use serde_json::json;
use signals::{Leg, Wings};

use super::{Output, Verdict};
use crate::terminal::{say, table, wrapped};
use rig::flight::config_file;
use rig::flight::tables::{self, Built};
use rig::flight::vehicles::{Model, sea_name, wings_name};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider table                                        both built-in tables and their interpolation error
  glider table --check                                do the committed tables still follow from their vehicle files?
  glider table --vehicle fitted.json --out flight/    a table from a fitted vehicle, as .bin (for `glider upload`) and .rs")]
pub struct Args {
    /// Vehicle file (geometry or coefficients), or a built-in one by name; default: the two sea-calibrated vehicles.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Vec<PathBuf>,
    /// Fail unless the tables built into the firmware are these, byte for byte.
    #[arg(long)]
    check: bool,
    /// Folder for the table as Rust source and as bytes, and for the controller's configuration where the pitch sensor reads wrong.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Where the controller's configuration goes when the vehicle's pitch sensor does not read true.
fn controller_file(model: &Model) -> String {
    format!("controller-{}.toml", wings_name(model.wings))
}

/// A table, its vehicle, and where that was read.
type Tables = [(Built, Model, String)];

/// Writes each table as source and as bytes, and the controller file of a vehicle whose pitch sensor is off.
fn write(out: &Path, built: &Tables) -> anyhow::Result<()> {
    std::fs::create_dir_all(out).with_context(|| format!("{}: cannot make this folder", out.display()))?;
    for (table, model, from) in built {
        let stem = wings_name(model.wings).replace("low-ar", "low_aspect_ratio");
        for (name, bytes) in
            [(format!("{stem}.rs"), tables::rust_source(table, from).into_bytes()), (format!("{stem}.bin"), table.bytes.clone())]
        {
            // The firmware's source folder takes source only.
            if name.ends_with(".bin") && out.ends_with("generated") {
                continue;
            }
            rig::whole_file::write(out.join(&name), bytes).with_context(|| out.join(&name).display().to_string())?;
        }
        if let Some(text) = config_file::pitch_sensor_alone(model.pitch_sensor()) {
            let file = out.join(controller_file(model));
            rig::whole_file::write(&file, text).with_context(|| file.display().to_string())?;
        }
    }
    Ok(())
}

/// Energy of pump and battery mass per metre of way at (L/D)max, the rest of the vehicle left out, J/m; default leg between 5 and 190 m.
fn moving_j_per_m(built: &Built) -> f32 {
    let leg = Leg { depth_min_m: 5.0, depth_max_m: 190.0, ..Leg::default() };
    control::dive_j(&Config::for_depth(leg.depth_max_m), &leg) / (2.0 * (leg.depth_max_m - leg.depth_min_m) * built.spec.best_l_over_d)
}

/// The tables for a person.
fn print(built: &Tables) {
    let mut t = table(["wings", "table id", "(L/D)max", "at", "J/m", "L/D", "C_L", "C_D", "best angle"]);
    for (b, m, _) in built {
        t.add_row([
            wings_name(m.wings).to_string(),
            format!("{:08x}", b.id()),
            format!("{:.3}", b.spec.best_l_over_d),
            format!("{:.2}°", b.spec.best_alpha_rad.to_degrees()),
            format!("{:.2}", moving_j_per_m(b)),
            format!("{:.4} %", 100.0 * b.error.l_over_d),
            format!("{:.1e}", b.error.cl),
            format!("{:.1e} %", 100.0 * b.error.cd),
            format!("{:.4}°", b.error.best_alpha_rad.to_degrees()),
        ]);
    }
    let about = "J/m: pump and battery mass alone, 5-190 m; glider fly has that of a whole vehicle and of another goal. \
                 The last four: largest error of the table against its vehicle file";
    println!("{t}\n{}", wrapped(about, 0));
    for (_, m, _) in built {
        say(&format!("{} wings: {}", wings_name(m.wings), m.name));
    }
    for note in built.iter().filter_map(|b| b.1.note()) {
        say(&wrapped(&format!("Note: {note}"), 6));
    }
    for (_, m, _) in built {
        if config_file::pitch_sensor_alone(m.pitch_sensor()).is_some() {
            let s = m.pitch_sensor();
            say(&format!(
                "{}: pitch is {:.4} x (reading {:+.4} rad). No table holds that: the controller needs it ({}, with --out).",
                m.name,
                s.per_reading,
                -s.zero_rad,
                controller_file(m)
            ));
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let files: Vec<PathBuf> = if args.vehicle.is_empty() {
        [Wings::Standard, Wings::LowAspectRatio].map(|w| PathBuf::from(format!("vehicles/{}.toml", sea_name(w)))).into()
    } else {
        args.vehicle.clone()
    };
    let mut built: Vec<(Built, Model, String)> = Vec::new();
    for file in &files {
        let model = Model::load(file, None)?;
        ensure!(
            !built.iter().any(|b| b.1.wings == model.wings),
            "{}: a second vehicle with {} wings; give one per wing set",
            file.display(),
            wings_name(model.wings)
        );
        let table = tables::build(&model, model.wings, model.id, 0).with_context(|| file.display().to_string())?;
        built.push((table, model, file.display().to_string()));
    }
    let mut same = true;
    for (table, model, _) in &built {
        if args.check {
            let flown = polar::builtin(model.wings).map_err(|e| anyhow::anyhow!("the table built into the firmware is refused: {e:?}"))?;
            same &= flown.bytes() == &table.bytes[..];
        }
    }
    if let Some(out) = &args.out {
        write(out, &built)?;
    }
    let document = json!({
        "tool": env!("CARGO_PKG_VERSION"),
        "check": args.check.then_some(same),
        "notes": built.iter().filter_map(|b| b.1.note()).collect::<Vec<_>>(),
        "tables": built.iter().map(|(t, m, from)| json!({
            "wings": wings_name(m.wings), "vehicle": from, "vehicle_name": m.name, "vehicle_id": format!("{:08x}", m.id),
            "table_id": format!("{:08x}", t.id()), "bytes": t.bytes.len(), "points": tables::POINTS,
            "reference_area_m2": t.spec.area_m2, "alpha_max_rad": t.spec.alpha_max_rad,
            "best_alpha_rad": t.spec.best_alpha_rad, "best_l_over_d": t.spec.best_l_over_d, "moving_joule_per_m": moving_j_per_m(t),
            "l_over_d_error": t.error.l_over_d, "cl_error": t.error.cl, "cd_relative_error": t.error.cd,
            "pitch_sensor": {"zero_rad": m.pitch_sensor().zero_rad, "per_reading": m.pitch_sensor().per_reading},
            "best_alpha_error_rad": t.error.best_alpha_rad, "best_l_over_d_relative_error": t.error.best_l_over_d,
        })).collect::<Vec<_>>(),
    });
    output.emit(&document, || {
        print(&built);
        if args.check {
            say(if same { "The firmware's tables are these, byte for byte." } else { "The firmware's tables are NOT these." });
        }
    });
    if args.check && !same {
        eprintln!("To regenerate: glider table --out firmware/polar/src/generated (from the project's root), then review and commit.");
        return Ok(Verdict::Negative);
    }
    Ok(Verdict::Ok)
}
