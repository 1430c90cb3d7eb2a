//! Places on the globe as GeoJSON (RFC 7946) and KML (OGC 12-007r2).

use serde_json::{Value, json};

/// Latitude and longitude, deg.
pub type LatLon = (f64, f64);

/// A point, or a polygon by its corners.
#[derive(Clone, Debug)]
pub struct Place {
    /// Its name on a map.
    pub name: String,
    /// One corner: a point.
    pub corners: Vec<LatLon>,
    /// What is known of it.
    pub properties: Value,
}

/// Longitude, latitude: the order of both formats, corners of a polygon closed and against the clock.
fn ring(place: &Place) -> Vec<[f64; 2]> {
    let mut ring: Vec<[f64; 2]> = place.corners.iter().map(|(lat, lon)| [*lon, *lat]).collect();
    if let (true, Some(first)) = (ring.len() > 1, ring.first().copied()) {
        ring.push(first);
        let twice_area: f64 = ring.windows(2).map(|w| w[0][0] * w[1][1] - w[1][0] * w[0][1]).sum();
        if twice_area < 0.0 {
            ring.reverse();
        }
    }
    ring
}

/// A feature collection.
#[must_use]
pub fn geojson(places: &[Place]) -> Value {
    let feature = |p: &Place| {
        let ring = ring(p);
        let geometry = if p.corners.len() == 1 {
            json!({"type": "Point", "coordinates": ring[0]})
        } else {
            json!({"type": "Polygon", "coordinates": [ring]})
        };
        let mut properties = p.properties.clone();
        properties["name"] = p.name.clone().into();
        json!({"type": "Feature", "geometry": geometry, "properties": properties})
    };
    json!({"type": "FeatureCollection", "features": places.iter().map(feature).collect::<Vec<_>>()})
}

/// A document of placemarks.
#[must_use]
pub fn kml(places: &[Place]) -> String {
    let escaped = |s: &str| s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let mut out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">\n<Document>\n".to_owned();
    for p in places {
        let at: Vec<String> = ring(p).iter().map(|[lon, lat]| format!("{lon:.6},{lat:.6}")).collect();
        let at = format!("<coordinates>{}</coordinates>", at.join(" "));
        let geometry = if p.corners.len() == 1 {
            format!("<Point>{at}</Point>")
        } else {
            format!("<Polygon><outerBoundaryIs><LinearRing>{at}</LinearRing></outerBoundaryIs></Polygon>")
        };
        let about = escaped(&p.properties.to_string());
        out += &format!("<Placemark><name>{}</name><description>{about}</description>{geometry}</Placemark>\n", escaped(&p.name));
    }
    out + "</Document>\n</kml>\n"
}

/// Corners of the first polygon of a GeoJSON document: a polygon alone, a feature, or the first feature of a collection.
#[must_use]
pub fn polygon(document: &Value) -> Option<Vec<LatLon>> {
    let feature = document.pointer("/features/0").unwrap_or(document);
    let geometry = feature.get("geometry").unwrap_or(feature);
    let ring = geometry.pointer("/coordinates/0").filter(|_| geometry["type"] == "Polygon")?.as_array()?;
    let corner = |c: &Value| Some((c.get(1)?.as_f64()?, c.get(0)?.as_f64()?));
    ring.iter().map(corner).collect::<Option<Vec<_>>>().filter(|r| r.len() > 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_is_closed_against_the_clock_and_read_again() {
        let clockwise = vec![(27.0, -90.0), (27.1, -90.0), (27.1, -89.9)];
        let places = [Place { name: "a<b".to_owned(), corners: clockwise, properties: json!({"hours": 5}) }];
        let document = geojson(&places);
        let ring = document.pointer("/features/0/geometry/coordinates/0").and_then(Value::as_array).expect("a ring");
        assert_eq!((ring.len(), &ring[0], &ring[1]), (4, &json!([-90.0, 27.0]), &json!([-89.9, 27.1])));
        assert_eq!(polygon(&document).expect("a polygon").len(), 4);
        assert!(polygon(&json!({"type": "Point", "coordinates": [1, 2]})).is_none());
        let text = kml(&places);
        assert!(text.contains("<name>a&lt;b</name>") && text.contains("-90.000000,27.000000 -89.900000,27.100000"), "{text}");
    }
}
