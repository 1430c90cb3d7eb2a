//! Figures of missions: numbers from dive to dive, and the way over ground.

use super::Args;
use crate::cli::diagnose::load_sound;
use crate::pages::chart::Mark;
use crate::pages::figure::Figure;
use crate::pages::forecast_map::{in_kilometres, over_ground, with_forecast};
use crate::pages::timeline_figure;
use crate::pages::track_map::{Way, way};
use anyhow::{Context as _, ensure};
use discovery::model::branch::Branch;
use discovery::model::parameters::State;
use discovery::preprocess::prepare;
use logs::record::bounded;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn read(file: &Path) -> anyhow::Result<Value> {
    let name = file.display();
    let text = bounded::text(file, bounded::DOCUMENT).with_context(|| format!("{name}: cannot read"))?;
    serde_json::from_str(&text).with_context(|| format!("{name}: not JSON; name what a command printed with --json"))
}

/// Numbers from dive to dive.
pub fn timeline(files: &[PathBuf]) -> anyhow::Result<Figure> {
    let missions = files.iter().map(|f| read(f)).collect::<anyhow::Result<Vec<_>>>()?;
    timeline_figure::figure(&missions).with_context(|| files[0].display().to_string())
}

/// The way of a flight, and of a forecast made from it the places and ellipses, counted from the last fix.
pub fn map(args: &Args) -> anyhow::Result<Figure> {
    let path = args.flight.as_deref().context("a flight")?;
    let (flight, vehicle) = load_sound(path, args.vehicle.as_deref())?;
    let prepared = prepare(&flight, &vehicle);
    let tracks: Vec<_> = prepared.runs.iter().map(|run| Branch::default().track(run, &vehicle, &State::nominal())).collect();
    let Way { reckoned, fixes } = way(&flight, &prepared.runs, &tracks);
    let with_compass = reckoned.iter().flatten().any(|p| p.0.is_finite());
    ensure!(with_compass || !fixes.is_empty(), "{}: neither compass nor GPS fixes; nothing to draw", path.display());
    let gap = || std::iter::once((f64::NAN, f64::NAN));
    let mut chart = over_ground();
    if with_compass {
        chart =
            chart.plus("dead reckoning by compass and model", Mark::Line, reckoned.iter().flat_map(|run| run.iter().copied().chain(gap())));
    }
    if !fixes.is_empty() {
        chart = chart.plus("GPS fixes", Mark::Point, fixes.iter().copied());
    }
    let mut caption = format!("Flight {}: {} fixes at the surface.", flight.name, fixes.len());
    if let Some(file) = &args.forecast {
        let last = *fixes.last().with_context(|| format!("{}: no GPS fix that a forecast could begin at", path.display()))?;
        let document = read(file)?;
        chart = with_forecast(chart, &document, last).with_context(|| format!("{}: no forecast in it", file.display()))?;
        let ahead = document["surfacings"].as_array().map_or(0, Vec::len);
        caption += &format!(" Forecast of {ahead} surfacings from the last fix; ellipses hold each with 90 %.");
    }
    in_kilometres(&mut chart);
    Ok(Figure { panels: vec![chart], caption })
}
