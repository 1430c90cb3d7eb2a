//! `glider plot`: one figure for a paper.

use super::compare::not_diverged;
use super::diagnose::{load, load_sound};
use super::{Output, Verdict};
use crate::pages::figure::Figure;
use crate::pages::plots::{Chart, Mark, Paper, histogram};
use crate::terminal::say;
use anyhow::{Context as _, bail, ensure};
use discovery::workbench::compare::{Comparison, Sample, compare};
use hydro::glide;
use hydro::{Flow, Polar as _};
use logs::Flight;
use rig::flight::tables::TABLE_SPEED_M_S;
use rig::flight::vehicles::{Model, wings_name};
use rig::whole_file;
use serde_json::json;
use signals::Wings;
use std::path::{Path, PathBuf};

/// Length of the averages of a residual plot, s (as the block error of the flight format, section 6.1).
const BLOCK_S: f64 = 20.0;
/// Largest |α| of a histogram, degrees, and its bins of 1°.
const HISTOGRAM_DEG: (f64, usize) = (30.0, 60);
/// Points per line at most, so that a long flight stays a small file.
const LINE_POINTS: usize = 2000;

/// What is drawn.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// C_L, C_D and L/D against angle of attack.
    Polar,
    /// Depth, and depth rate measured and modelled, against time.
    Flight,
    /// Depth rate measured minus modelled, 20 s means, against angle of attack.
    Residual,
    /// Where the flight was: share of time per degree of angle of attack.
    Histogram,
}

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider plot polar --out polar.svg                        both sea-calibrated vehicles
  glider plot polar --wings low-ar --out rail.csv          one wing set, the numbers
  glider plot flight --flight trial_dir --out flight.png
  glider plot residual --flight trial_dir --vehicle new.json --out residual.svg
  glider plot residual --flight trial_dir --before old.json --vehicle new.json --out both.svg
  glider plot residual --flight trial_dir --width column --out column.pdf

The ending of --out decides: .svg, .pdf or .png (figure with caption), .csv or .json (the
numbers of the same figure). With --width letters are of 7 points at that width, and a PNG
has 300 dpi; without it the figure is for a screen, and the PNG is 2400 px wide.
The figures of the source paper: glider paper --out DIR.")]
pub struct Args {
    /// The figure.
    #[arg(value_enum)]
    kind: Kind,
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: Option<PathBuf>,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Vehicle file whose residual is drawn in the same figure, as before.
    #[arg(long, value_name = "FILE|NAME")]
    before: Option<PathBuf>,
    /// Wing set of a polar: standard or low-ar; default: both.
    #[arg(long, value_parser = ["standard", "low-ar"])]
    wings: Option<String>,
    /// Width in print: column (84 mm), page (174 mm) or so many mm; default: for a screen.
    #[arg(long, value_name = "column|page|MM", value_parser = width_mm)]
    width: Option<f64>,
    /// Height of a panel in print, mm; default: 0.65 of the width, at least 55.
    #[arg(long, value_name = "MM", requires = "width", value_parser = height_mm)]
    height: Option<f64>,
    /// Where the figure goes; the ending decides what it is.
    #[arg(long, value_name = "FILE.svg|.pdf|.png|.csv|.json")]
    out: PathBuf,
}

/// Widths of print that letters of 7 points leave room in, and that a PDF reader shows, mm.
const WIDTHS_MM: std::ops::RangeInclusive<f64> = 60.0..=500.0;
const HEIGHTS_MM: std::ops::RangeInclusive<f64> = 40.0..=500.0;

/// Widths as journals of two columns have them (Springer, Elsevier: 84 to 90 and 174 to 190 mm), or a number.
fn width_mm(word: &str) -> Result<f64, String> {
    match word {
        "column" => Ok(84.0),
        "page" => Ok(174.0),
        number => within(number, &WIDTHS_MM)
            .ok_or_else(|| format!("column (84 mm), page (174 mm), or a number of mm from {} to {}", WIDTHS_MM.start(), WIDTHS_MM.end())),
    }
}

fn height_mm(word: &str) -> Result<f64, String> {
    within(word, &HEIGHTS_MM).ok_or_else(|| format!("a number of mm from {} to {}", HEIGHTS_MM.start(), HEIGHTS_MM.end()))
}

/// A number in a range, with or without its unit.
fn within(word: &str, range: &std::ops::RangeInclusive<f64>) -> Option<f64> {
    word.trim_end_matches("mm").trim().parse().ok().filter(|mm| range.contains(mm))
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let ending = args.out.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let name = args.out.display();
    match ending.as_str() {
        "svg" | "pdf" | "png" | "csv" | "json" => {}
        "" => bail!("{name}: has no ending; name a file that ends in .svg, .pdf, .png, .csv or .json"),
        other => bail!("{name}: cannot write .{other}; name a file that ends in .svg, .pdf, .png, .csv or .json"),
    }
    let inputs: Vec<&Path> = [args.flight.as_deref(), args.vehicle.as_deref(), args.before.as_deref()].into_iter().flatten().collect();
    whole_file::may_write(&args.out, &inputs, &[], output.force)?;
    let figure = if args.kind == Kind::Polar { polar(args)? } else { flown(args)? };
    let paper = args.width.map_or(Paper::SCREEN, |mm| Paper::printed(mm, args.height));
    let text = figure.bytes(&ending, &paper)?;
    whole_file::write(&args.out, &text).with_context(|| format!("cannot write {name}"))?;
    let panels: Vec<_> = figure
        .panels
        .iter()
        .map(|c| {
            let series: Vec<_> = c.series.iter().map(|s| json!({"name": s.name, "points": s.points.len()})).collect();
            json!({"title": c.title, "x": c.x, "y": c.y, "series": series})
        })
        .collect();
    let document = json!({
        "tool": env!("CARGO_PKG_VERSION"), "written": args.out, "format": ending, "bytes": text.len(),
        "width_mm": paper.width_mm, "caption": figure.caption, "panels": panels,
    });
    output.emit(&document, || say(&format!("{name} ({} kB)\n{}", text.len().div_ceil(1000), figure.caption)));
    Ok(Verdict::Ok)
}

fn polar(args: &Args) -> anyhow::Result<Figure> {
    ensure!(args.flight.is_none(), "a polar is of a vehicle: leave out --flight, or draw flight, residual or histogram");
    let asked = args.wings.as_deref().map(|w| if w == "standard" { Wings::Standard } else { Wings::LowAspectRatio });
    let models = match (&args.vehicle, asked) {
        (Some(file), None) => vec![Model::load(file, None)?],
        (Some(_), Some(_)) => bail!("a vehicle file says which wings it has: give --vehicle or --wings, not both"),
        (None, Some(w)) => vec![Model::sea(w)?],
        (None, None) => vec![Model::sea(Wings::Standard)?, Model::sea(Wings::LowAspectRatio)?],
    };
    let mut coefficients = Chart::new("Lift and drag", "angle of attack, deg", "coefficient on the reference area, 1");
    let mut ratio = Chart::new("Glide ratio", "angle of attack, deg", "L/D, 1");
    let mut captions = Vec::new();
    for model in &models {
        let valid_deg = model.alpha_valid_rad().to_degrees();
        let rows: Vec<_> = (0..=(4.0 * valid_deg + 1e-9) as u32)
            .map(|i| f64::from(i) / 4.0)
            .map(|deg| (deg, model.force(&Flow::steady(deg.to_radians(), TABLE_SPEED_M_S))))
            .collect();
        let wings = wings_name(model.wings);
        coefficients = coefficients.with(&format!("C_L, {wings} wings"), Mark::Line, rows.iter().map(|(a, f)| (*a, f.cl))).with(
            &format!("C_D, {wings} wings"),
            Mark::Dashed,
            rows.iter().map(|(a, f)| (*a, f.cd)),
        );
        ratio = ratio.with(&format!("{wings} wings"), Mark::Line, rows.iter().map(|(a, f)| (*a, f.l_over_d())));
        let best = glide::best(model, TABLE_SPEED_M_S, model.alpha_valid_rad());
        captions.push(format!(
            "{} ({wings} wings, coefficients on {:.4} m2): (L/D)max {:.3} at {:.1} deg",
            model.name,
            model.reference_area_m2(),
            best.l_over_d,
            best.alpha_rad.to_degrees()
        ));
    }
    Ok(Figure { panels: vec![coefficients, ratio], caption: format!("Model at {TABLE_SPEED_M_S} m/s. {}.", captions.join("; ")) })
}

/// Longer pauses than this are cut to it: a log of weeks with a dive a day is drawn as dives, s.
const PAUSE_S: f64 = 120.0;

/// Points over time under way, with a gap (NaN) where a segment ends or more than 30 s are missing.
fn with_gaps(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
    let mut start = samples.first().map_or(0.0, |s| s.time_s);
    let every = samples.len().div_ceil(LINE_POINTS).max(1);
    let mut out = Vec::new();
    let mut last: Option<&Sample> = None;
    for s in samples.iter().step_by(every) {
        if let Some(l) = last
            && (l.segment != s.segment || s.time_s - l.time_s > 30.0f64.max(10.0 * every as f64))
        {
            start += (s.time_s - l.time_s - PAUSE_S).max(0.0);
            out.push((f64::NAN, f64::NAN));
        }
        out.push(((s.time_s - start) / 60.0, value(s)));
        last = Some(s);
    }
    out
}

/// Largest |α| of a block that is drawn, degrees: beyond it the vehicle hardly moves, and has no angle of attack.
const SLOWEST_DEG: f64 = 45.0;

/// Means over blocks: angle of attack (degrees) and residual (cm/s), dives and climbs apart, and how many blocks lie beyond the axis.
fn block_means(samples: &[Sample]) -> ([Vec<(f64, f64)>; 2], usize) {
    let key = |s: &Sample| (s.segment, (s.time_s / BLOCK_S).floor() as i64);
    let (mut out, mut beyond) = ([Vec::new(), Vec::new()], 0);
    for block in samples.chunk_by(|a, b| key(a) == key(b)) {
        let mean = |of: &dyn Fn(&Sample) -> f64| block.iter().map(of).sum::<f64>() / block.len() as f64;
        let climbs = mean(&|s| s.observed_m_s) < 0.0;
        let alpha_deg = mean(&|s| s.alpha_rad.to_degrees());
        if alpha_deg.abs() > SLOWEST_DEG {
            beyond += 1;
        } else {
            out[usize::from(climbs)].push((alpha_deg, mean(&|s| 100.0 * (s.observed_m_s - s.modelled_m_s))));
        }
    }
    (out, beyond)
}

/// What a caption says of blocks that are not drawn.
fn left_out(beyond: usize) -> String {
    if beyond == 0 { String::new() } else { format!(" Left out: {beyond} beyond {SLOWEST_DEG:.0} deg.") }
}

/// The residual of two vehicle files against one flight.
fn before_and_after(file: &Path, flight: &Flight, path: &Path, about: &str, after: &Comparison) -> anyhow::Result<Figure> {
    let (_, old) = load(path, Some(file))?;
    let before = not_diverged(compare(flight, &old), &old)?;
    let ((old_points, old_beyond), (new_points, new_beyond)) = (block_means(&before.samples), block_means(&after.samples));
    let said = |what: &str, c: &Comparison| format!("{what}: {:.2} cm/s rms", 100.0 * c.rms_m_s);
    let panel = Chart::new("Residual before and after", "angle of attack of the model, deg", "measured minus modelled, cm/s")
        .with(&said("before", &before), Mark::Points, old_points.concat())
        .with(&said("after", after), Mark::Points, new_points.concat());
    let caption = format!(
        "{about}; before: {}. Points are {BLOCK_S} s means of the depth rate, positive down.{}",
        old.name,
        left_out(old_beyond + new_beyond)
    );
    Ok(Figure { panels: vec![panel], caption })
}

fn flown(args: &Args) -> anyhow::Result<Figure> {
    let path: &Path = args.flight.as_deref().context("name the flight with --flight; only a polar needs none")?;
    ensure!(args.wings.is_none(), "--wings belongs to a polar; the vehicle file of a flight says which wings it has");
    ensure!(args.before.is_none() || args.kind == Kind::Residual, "--before belongs to a residual");
    let (flight, vehicle) = load_sound(path, args.vehicle.as_deref())?;
    let c = not_diverged(compare(&flight, &vehicle), &vehicle)?;
    ensure!(!c.samples.is_empty(), "{}: no row deeper than 2 m and a minute under way; nothing to draw", path.display());
    let effects: Vec<&str> = vehicle.effects.iter().map(|a| a.effect.name).collect();
    let with = if effects.is_empty() { "no effect on".to_owned() } else { format!("with {}", effects.join(", ")) };
    let about = format!("Flight {}, model of {} ({with})", flight.name, vehicle.name);
    let error = format!("depth-rate residual {:.2} cm/s rms over {} rows", 100.0 * c.rms_m_s, c.samples.len());
    if let Some(file) = &args.before {
        return before_and_after(file, &flight, path, &about, &c);
    }
    Ok(match args.kind {
        Kind::Residual => {
            let ([dives, climbs], beyond) = block_means(&c.samples);
            let panel =
                Chart::new("Residual against angle of attack", "angle of attack of the model, deg", "measured minus modelled, cm/s")
                    .with("dives", Mark::Points, dives)
                    .with("climbs", Mark::Points, climbs);
            Figure {
                panels: vec![panel],
                caption: format!("{about}: {error}; points are {BLOCK_S} s means, positive down.{}", left_out(beyond)),
            }
        }
        Kind::Histogram => {
            let (edge, bins) = HISTOGRAM_DEG;
            let alpha: Vec<f64> = c.samples.iter().map(|s| s.alpha_rad.to_degrees()).collect();
            let shares = histogram(&alpha, -edge, edge, bins).into_iter().map(|(x, share)| (x, 100.0 * share));
            let panel = Chart::new("Angles of attack flown", "angle of attack of the model, deg", "share of rows per degree, %");
            let caption = format!("{about}: {} submerged rows; positive in a dive.", c.samples.len());
            Figure { panels: vec![panel.with("share", Mark::Bars, shares)], caption }
        }
        Kind::Flight | Kind::Polar => {
            let depth = with_gaps(&c.samples, |s| s.depth_m);
            let deepest = depth.iter().map(|p| p.1).filter(|d| d.is_finite()).fold(1.0, f64::max);
            let upper = Chart::new("Depth", "time under way, min", "depth, m")
                .with("measured", Mark::Line, depth)
                .within(None, Some((1.05 * deepest, 0.0)));
            let lower = Chart::new("Depth rate, positive down", "time under way, min", "depth rate, cm/s")
                .with("measured", Mark::Line, with_gaps(&c.samples, |s| 100.0 * s.observed_m_s))
                .with("model", Mark::Line, with_gaps(&c.samples, |s| 100.0 * s.modelled_m_s));
            Figure {
                panels: vec![upper, lower],
                caption: format!(
                    "{about}: {error}; {}; pauses longer than 2 min are cut to that.",
                    c.filter("both through the same {} filter")
                ),
            }
        }
    })
}
