//! `glider polar`: lift, drag and L/D against angle of attack.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use hydro::effects::{Active, CATALOGUE, by_name};
use hydro::glide::{self, Best};
use hydro::{Flow, Polar};
use serde_json::json;
use signals::Wings;

use super::{Output, Verdict};
use crate::pages::chart::{Chart, Mark};
use crate::pages::figure::Figure;
use crate::terminal::{say, table, wrapped};
use rig::flight::tables::TABLE_SPEED_M_S;
use rig::flight::vehicles::{Model, sea_name, wings_name};
use rig::spelling::meant;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider polar                                             the two sea-calibrated vehicles beside each other
  glider polar --wings low-ar --model fidler               another lift model of the rail wings
  glider polar --vehicle slocum-standard                   a built-in vehicle, or any vehicle file
  glider polar --effect stall=0.15 --out out/polar         with an effect of the catalogue; writes svg, png, csv, json")]
pub struct Args {
    /// Vehicle file or built-in vehicle; default: the sea-calibrated vehicles.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Wing set: standard or low-ar; default: both.
    #[arg(long, value_parser = ["standard", "low-ar"])]
    wings: Option<String>,
    /// Lift model of the wings: lifting-line, polhamus-lamar, bartlett-vidal, fidler, side-edge.
    #[arg(long)]
    model: Option<String>,
    /// Effect on top, NAME=SIZE in its unit; may be given several times.
    #[arg(long)]
    effect: Vec<String>,
    /// Largest angle of attack, degrees.
    #[arg(long, default_value_t = 25.0)]
    to: f64,
    /// Step, degrees.
    #[arg(long, default_value_t = 1.0)]
    step: f64,
    /// Print csv instead of a table.
    #[arg(long)]
    csv: bool,
    /// Folder for polar.svg, .png, .csv and .json.
    #[arg(long)]
    out: Option<PathBuf>,
}

struct Curve {
    model: Model,
    best: Best,
    rows: Vec<[f64; 5]>,
}

fn effects(list: &[String]) -> anyhow::Result<Vec<Active>> {
    list.iter()
        .map(|text| {
            let (name, size) = text.split_once('=').with_context(|| format!("--effect {text}: expected NAME=SIZE, such as stall=0.1"))?;
            let effect = by_name(name).with_context(|| {
                format!("--effect {name}: no such effect{} (all: glider list effects)", meant(name, CATALOGUE.iter().map(|e| e.name)))
            })?;
            let size: f64 =
                size.parse().ok().filter(|s: &f64| s.is_finite()).with_context(|| format!("--effect {text}: `{size}` is not a number"))?;
            let p = effect.parameters[0];
            if !(p.low..=p.high).contains(&size) {
                bail!("--effect {name}: {size} {} is outside {} to {}", p.unit, p.low, p.high);
            }
            Ok(Active::sized(effect, size))
        })
        .collect()
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if !(args.step > 0.001 && args.to > 0.0 && args.to <= 45.0) {
        bail!("--to must be above 0 and at most 45 degrees, --step above 0.001 degrees");
    }
    let wings = args.wings.as_deref().map(|w| if w == "standard" { Wings::Standard } else { Wings::LowAspectRatio });
    let effects = effects(&args.effect)?;
    let mut models = match &args.vehicle {
        Some(file) => vec![Model::load(file, args.model.as_deref())?],
        None => {
            let which = wings.map_or(vec![Wings::Standard, Wings::LowAspectRatio], |w| vec![w]);
            // A lift model without a wing set means the wings that have it.
            let load = |w: &Wings| Model::load(&PathBuf::from(format!("vehicles/{}.toml", sea_name(*w))), args.model.as_deref());
            if args.model.is_some() && wings.is_none() {
                let found: Vec<Model> = which.iter().filter_map(|w| load(w).ok()).collect();
                if found.is_empty() { vec![load(&Wings::LowAspectRatio)?] } else { found }
            } else {
                which.iter().map(load).collect::<anyhow::Result<_>>()?
            }
        }
    };
    if let (Some(w), Some(m)) = (wings, models.first())
        && m.wings != w
    {
        bail!("{} has {} wings, --wings asks for {}", m.name, wings_name(m.wings), wings_name(w));
    }
    models = models.into_iter().map(|m| m.with_effects(&effects)).collect();
    let curves: Vec<Curve> = models.into_iter().map(|m| curve(m, args)).collect();
    let chart = curves.iter().fold(Chart::lines("Glide polar", "angle of attack, deg", "L/D, 1"), |chart, c| {
        chart.plus(&c.model.name, Mark::Line, c.rows.iter().map(|r| (r[0], r[3])))
    });
    if let Some(out) = &args.out {
        Figure::from(chart).write(out, "polar")?;
    }
    let document = json!({
        "tool": env!("CARGO_PKG_VERSION"),
        "speed_m_s": TABLE_SPEED_M_S,
        "notes": curves.iter().filter_map(|c| c.model.note()).collect::<Vec<_>>(),
        "polars": curves.iter().map(|c| json!({
            "vehicle": c.model.name, "vehicle_id": format!("{:08x}", c.model.id), "wings": wings_name(c.model.wings),
            "effects": args.effect,
            "reference_area_m2": c.model.reference_area_m2(),
            "alpha_valid_deg": c.model.alpha_valid_rad().to_degrees(),
            "best": {"alpha_deg": c.best.alpha_rad.to_degrees(), "l_over_d": c.best.l_over_d,
                     "glide_angle_deg": c.best.glide_angle_rad.to_degrees(), "pitch_deg": c.best.pitch_rad.to_degrees()},
            "alpha_deg": c.rows.iter().map(|r| r[0]).collect::<Vec<_>>(),
            "cl": c.rows.iter().map(|r| r[1]).collect::<Vec<_>>(),
            "cd": c.rows.iter().map(|r| r[2]).collect::<Vec<_>>(),
            "l_over_d": c.rows.iter().map(|r| r[3]).collect::<Vec<_>>(),
            "wing_lift_share": c.rows.iter().map(|r| r[4]).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    });
    let notes: Vec<String> = curves.iter().filter_map(|c| c.model.note()).collect();
    if args.csv && !output.json {
        notes.iter().for_each(|note| eprintln!("Note: {note}"));
        println!("vehicle,alpha_deg,cl,cd,l_over_d,wing_lift_share");
        for c in &curves {
            for [a, cl, cd, ld, share] in &c.rows {
                let share = if share.is_finite() { share.to_string() } else { String::new() };
                println!("{},{a},{cl},{cd},{ld},{share}", c.model.name);
            }
        }
        return Ok(Verdict::Ok);
    }
    output.emit(&document, || {
        print(&curves);
        notes.iter().for_each(|note| say(&wrapped(&format!("Note: {note}"), 6)));
    });
    Ok(Verdict::Ok)
}

fn curve(model: Model, args: &Args) -> Curve {
    let best = glide::best(&model, TABLE_SPEED_M_S, model.alpha_valid_rad());
    let steps = (args.to / args.step + 1e-9).floor() as u32;
    let rows = (0..=steps)
        .map(|i| {
            let deg = f64::from(i) * args.step;
            let f = model.force(&Flow::steady(deg.to_radians(), TABLE_SPEED_M_S));
            let share = model.geometry().map_or(f64::NAN, |g| g.breakdown(deg.to_radians()).wing_lift_share());
            [deg, f.cl, f.cd, f.l_over_d(), share]
        })
        .collect();
    Curve { model, best, rows }
}

fn print(curves: &[Curve]) {
    for c in curves {
        say(&format!(
            "{} ({} wings), coefficients on {:.4} m2, valid to {:.1} deg",
            c.model.name,
            wings_name(c.model.wings),
            c.model.reference_area_m2(),
            c.model.alpha_valid_rad().to_degrees()
        ));
        let mut t = table(["alpha deg", "C_L", "C_D", "L/D", "lift of wings %"]);
        for [a, cl, cd, ld, share] in &c.rows {
            let mark = if *a > c.model.alpha_valid_rad().to_degrees() + 1e-9 { " (outside valid range)" } else { "" };
            let share = if share.is_finite() { format!("{:.1}", 100.0 * share) } else { "–".into() };
            t.add_row([format!("{a:.2}{mark}"), format!("{cl:.4}"), format!("{cd:.4}"), format!("{ld:.3}"), share]);
        }
        println!("{t}");
        say(&format!(
            "(L/D)max {:.3} at alpha {:.2} deg: least glide angle {:.2} deg, pitch {:.2} deg\n",
            c.best.l_over_d,
            c.best.alpha_rad.to_degrees(),
            c.best.glide_angle_rad.to_degrees(),
            c.best.pitch_rad.to_degrees()
        ));
    }
}
