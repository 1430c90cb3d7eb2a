//! `glider plot`: one figure for a paper.

mod flown;
mod mission;

use super::{Output, Verdict};
use crate::pages::chart::{Chart, Mark};
use crate::pages::figure::Figure;
use crate::pages::plots::Paper;
use crate::terminal::say;
use anyhow::{Context as _, bail, ensure};
use hydro::glide;
use hydro::{Flow, Polar as _};
use rig::flight::tables::TABLE_SPEED_M_S;
use rig::flight::vehicles::{Model, wings_name};
use rig::whole_file;
use serde_json::json;
use signals::Wings;
use std::path::{Path, PathBuf};

/// What is drawn.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// C_L, C_D and L/D against angle of attack.
    Polar,
    /// What moved of the vehicle's numbers, with 90 % intervals, and what could hide.
    Forest,
    /// Error as effects are added, with the floor.
    Ladder,
    /// Numbers of a vehicle from dive to dive, with 90 % intervals.
    Timeline,
    /// Way over ground, and where it comes up next.
    Map,
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
  glider plot forest --flight trial_dir --history calibrated.history --out moved.pdf
  glider plot ladder --flight trial_dir --out ladder.svg
  glider timeline mission_dir --vehicle v.json --json > june.json
  glider plot timeline --timeline june.json --timeline july.json --out year.svg
  glider forecast --flight mission_dir --json > next.json
  glider plot map --flight mission_dir --forecast next.json --out map.png

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
    /// History of the vehicle, of a forest; default: the one beside the vehicle file.
    #[arg(long, value_name = "FILE")]
    history: Option<PathBuf>,
    /// What `glider timeline --json` printed; several are missions in order.
    #[arg(long, value_name = "FILE.json")]
    timeline: Vec<PathBuf>,
    /// What `glider forecast --json` printed of this flight, for a map.
    #[arg(long, value_name = "FILE.json")]
    forecast: Option<PathBuf>,
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

impl Args {
    /// Refuses an option that belongs to another figure, and asks for what this one is made of.
    fn fit_the_kind(&self) -> anyhow::Result<()> {
        let of = |kinds: &[Kind]| kinds.contains(&self.kind);
        let flown = !of(&[Kind::Polar, Kind::Timeline]);
        ensure!(flown || self.flight.is_none(), "a polar is of a vehicle and a timeline of missions: leave out --flight");
        ensure!(!flown || self.flight.is_some(), "--flight DIR|CSV is missing: this figure is of a flight");
        ensure!(self.wings.is_none() || of(&[Kind::Polar]), "--wings belongs to a polar; a flight's vehicle file says which wings it has");
        ensure!(self.before.is_none() || of(&[Kind::Residual]), "--before belongs to a residual");
        ensure!(self.history.is_none() || of(&[Kind::Forest, Kind::Ladder]), "--history belongs to a forest or a ladder");
        ensure!(self.forecast.is_none() || of(&[Kind::Map]), "--forecast belongs to a map");
        ensure!(self.timeline.is_empty() != of(&[Kind::Timeline]), "--timeline FILE.json belongs to a timeline, which is drawn of it");
        Ok(())
    }
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
    let single = [&args.flight, &args.vehicle, &args.before, &args.history, &args.forecast];
    let inputs: Vec<&Path> = single.into_iter().flatten().chain(&args.timeline).map(PathBuf::as_path).collect();
    whole_file::may_write(&args.out, &inputs, &[], output.force)?;
    args.fit_the_kind()?;
    let figure = match args.kind {
        Kind::Polar => polar(args)?,
        Kind::Timeline => mission::timeline(&args.timeline)?,
        Kind::Map => mission::map(args)?,
        Kind::Forest | Kind::Ladder => flown::answer(args)?,
        Kind::Flight | Kind::Residual | Kind::Histogram => flown::flight(args)?,
    };
    let paper = args.width.map_or(Paper::SCREEN, |mm| Paper::printed(mm, args.height));
    let text = figure.bytes(&ending, &paper)?;
    whole_file::write(&args.out, &text).with_context(|| format!("cannot write {name}"))?;
    let panels: Vec<_> = figure
        .panels
        .iter()
        .map(|c| {
            let series: Vec<_> = c.series.iter().map(|s| json!({"name": s.name, "points": s.x.len()})).collect();
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
    let asked = args.wings.as_deref().map(|w| if w == "standard" { Wings::Standard } else { Wings::LowAspectRatio });
    let models = match (&args.vehicle, asked) {
        (Some(file), None) => vec![Model::load(file, None)?],
        (Some(_), Some(_)) => bail!("a vehicle file says which wings it has: give --vehicle or --wings, not both"),
        (None, Some(w)) => vec![Model::sea(w)?],
        (None, None) => vec![Model::sea(Wings::Standard)?, Model::sea(Wings::LowAspectRatio)?],
    };
    let mut coefficients = Chart::lines("Lift and drag", "angle of attack, deg", "coefficient on the reference area, 1");
    let mut ratio = Chart::lines("Glide ratio", "angle of attack, deg", "L/D, 1");
    let mut captions = Vec::new();
    for model in &models {
        let valid_deg = model.alpha_valid_rad().to_degrees();
        let rows: Vec<_> = (0..=(4.0 * valid_deg + 1e-9) as u32)
            .map(|i| f64::from(i) / 4.0)
            .map(|deg| (deg, model.force(&Flow::steady(deg.to_radians(), TABLE_SPEED_M_S))))
            .collect();
        let wings = wings_name(model.wings);
        coefficients = coefficients.plus(&format!("C_L, {wings} wings"), Mark::Line, rows.iter().map(|(a, f)| (*a, f.cl))).plus(
            &format!("C_D, {wings} wings"),
            Mark::Dashed,
            rows.iter().map(|(a, f)| (*a, f.cd)),
        );
        ratio = ratio.plus(&format!("{wings} wings"), Mark::Line, rows.iter().map(|(a, f)| (*a, f.l_over_d())));
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
