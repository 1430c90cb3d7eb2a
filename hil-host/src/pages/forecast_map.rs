//! Surfacings to come on a map: places, and ellipses that hold each with the stated probability.

use super::chart::{Axis, Chart, Mark};
use serde_json::Value;
use std::f64::consts::TAU;

/// East and north, m.
pub type Place = (f64, f64);

/// Corners of a round line.
const CORNERS: u32 = 72;

/// A chart in which a metre is as long to the east as to the north.
#[must_use]
pub fn over_ground() -> Chart {
    Chart { equal: true, ..Chart::lines("Way over ground", "east, m", "north, m") }
}

/// Places about the origin at angles all around.
pub fn round(half_axes: [f64; 2], azimuth_rad: f64) -> impl Iterator<Item = Place> {
    let (sin, cos) = azimuth_rad.sin_cos();
    (0..=CORNERS).map(move |k| {
        let (s, c) = (TAU * f64::from(k) / f64::from(CORNERS)).sin_cos();
        let (along, across) = (half_axes[0] * c, half_axes[1] * s);
        (along * sin + across * cos, along * cos - across * sin)
    })
}

/// Adds what `glider forecast --json` printed, its last fix at this place of the map; none where there is no forecast in it.
#[must_use]
pub fn with_forecast(chart: Chart, forecast: &Value, last: Place) -> Option<Chart> {
    let (places, ellipses) = ahead(forecast, last)?;
    Some(chart.plus("forecast", Mark::Point, places).plus("90 % ellipse", Mark::Dashed, ellipses))
}

/// Places of the surfacings to come, and their ellipses with gaps between, m from where the map counts.
fn ahead(forecast: &Value, last: Place) -> Option<(Vec<Place>, Vec<Place>)> {
    let place = |v: &Value| Some((v["east_m"].as_f64()?, v["north_m"].as_f64()?));
    let from = place(&forecast["last_fix"])?;
    let (mut places, mut ellipses) = (Vec::new(), Vec::new());
    for surfacing in forecast["surfacings"].as_array()? {
        let (east, north) = place(surfacing)?;
        let (east, north) = (east - from.0 + last.0, north - from.1 + last.1);
        places.push((east, north));
        let [long, short, azimuth] = ["semi_major_m", "semi_minor_m", "azimuth_deg"].map(|key| surfacing["ellipse"][key].as_f64());
        ellipses.extend(round([long?, short?], azimuth?.to_radians()).map(|(e, n)| (east + e, north + n)));
        ellipses.push((f64::NAN, f64::NAN));
    }
    Some((places, ellipses))
}

/// A long way is drawn in kilometres.
pub fn in_kilometres(chart: &mut Chart) {
    /// From here on, m.
    const FAR_M: f64 = 20_000.0;
    let far = chart.series.iter().flat_map(|s| s.x.iter().chain(&s.y)).any(|v| v.abs() > FAR_M);
    if far {
        chart.series.iter_mut().flat_map(|s| s.x.iter_mut().chain(&mut s.y)).for_each(|v| *v /= 1000.0);
        (chart.x, chart.y) = (Axis::new("east", "km"), Axis::new("north", "km"));
    }
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
