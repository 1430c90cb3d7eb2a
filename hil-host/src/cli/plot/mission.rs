//! Figures of missions: numbers from dive to dive, and the way over ground.

use super::Args;
use crate::cli::diagnose::load_sound;
use crate::pages::chart::{Axis, Chart, Mark};
use crate::pages::figure::Figure;
use crate::pages::timeline_figure;
use crate::pages::track_map::{Way, way};
use anyhow::{Context as _, ensure};
use discovery::model::branch::Branch;
use discovery::model::parameters::State;
use discovery::preprocess::prepare;
use logs::record::bounded;
use serde_json::Value;
use std::f64::consts::TAU;
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
    let mut chart = Chart::lines("Way over ground", "east, m", "north, m");
    chart.equal = true;
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
        let (places, ellipses) = ahead(&document, last).with_context(|| format!("{}: no forecast in it", file.display()))?;
        caption += &format!(" Forecast of {} surfacings from the last fix; ellipses hold each with 90 %.", places.len());
        chart = chart.plus("forecast", Mark::Point, places).plus("90 % ellipse", Mark::Dashed, ellipses);
    }
    in_kilometres(&mut chart);
    Ok(Figure { panels: vec![chart], caption })
}

/// A long way is drawn in kilometres.
fn in_kilometres(chart: &mut Chart) {
    /// From here on, m.
    const FAR_M: f64 = 20_000.0;
    let far = chart.series.iter().flat_map(|s| s.x.iter().chain(&s.y)).any(|v| v.abs() > FAR_M);
    if far {
        chart.series.iter_mut().flat_map(|s| s.x.iter_mut().chain(&mut s.y)).for_each(|v| *v /= 1000.0);
        (chart.x, chart.y) = (Axis::new("east", "km"), Axis::new("north", "km"));
    }
}

/// East and north, m.
type Place = (f64, f64);

/// Places of the surfacings to come, and their ellipses with gaps between, m from where the map counts.
fn ahead(forecast: &Value, last: Place) -> Option<(Vec<Place>, Vec<Place>)> {
    const CORNERS: u32 = 72;
    let place = |v: &Value| Some((v["east_m"].as_f64()?, v["north_m"].as_f64()?));
    let from = place(&forecast["last_fix"])?;
    let (mut places, mut ellipses) = (Vec::new(), Vec::new());
    for surfacing in forecast["surfacings"].as_array()? {
        let (east, north) = place(surfacing)?;
        let (east, north) = (east - from.0 + last.0, north - from.1 + last.1);
        places.push((east, north));
        let ellipse = &surfacing["ellipse"];
        let [long, short, azimuth] = ["semi_major_m", "semi_minor_m", "azimuth_deg"].map(|key| ellipse[key].as_f64());
        let (long, short, (sin, cos)) = (long?, short?, azimuth?.to_radians().sin_cos());
        ellipses.extend((0..=CORNERS).map(|k| {
            let (s, c) = (TAU * f64::from(k) / f64::from(CORNERS)).sin_cos();
            (east + long * c * sin + short * s * cos, north + long * c * cos - short * s * sin)
        }));
        ellipses.push((f64::NAN, f64::NAN));
    }
    Some((places, ellipses))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_ellipse_points_where_its_azimuth_does() {
        let ellipse = json!({"semi_major_m": 100.0, "semi_minor_m": 10.0, "azimuth_deg": 90.0});
        let forecast =
            json!({"last_fix": {"east_m": 5.0, "north_m": 7.0}, "surfacings": [{"east_m": 6.0, "north_m": 9.0, "ellipse": ellipse}]});
        let (places, edge) = ahead(&forecast, (1000.0, 2000.0)).expect("a forecast");
        assert_eq!(places, [(1001.0, 2002.0)]);
        let east = edge.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
        let north = edge.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        assert!((east - 1101.0).abs() < 1e-6 && (north - 2012.0).abs() < 1e-6, "{east}, {north}");
        assert!(ahead(&json!({}), (0.0, 0.0)).is_none());
    }
}
