//! Degrees become metres: GPS fixes and dead reckoning in a local plane per segment.
//!
//! Origin is the first fix of the segment (the last one before it if there is
//! none in it). Sphere of 6 371 km; over a segment of a few kilometres the plane
//! is good to centimetres.

use super::{Origin, Report};
use crate::record::flight::Flight;
use crate::record::resample::Series;

/// Metres per degree of latitude (mean Earth radius 6 371 008.8 m, IUGG).
const METRE_PER_DEGREE: f64 = 6_371_008.8 * std::f64::consts::PI / 180.0;
/// A fix belongs to the nearest row if it is no further in time, s: at the surface the CTD is often off.
const FIX_REACH_S: f64 = 600.0;

/// Degrees of (d)ddmm.mmm; the sign is that of the whole.
#[must_use]
pub fn degrees_of_minutes(ddmm: f64) -> f64 {
    let size = ddmm.abs();
    let whole = (size / 100.0).trunc();
    (whole + (size - 100.0 * whole) / 60.0).copysign(ddmm)
}

/// One GPS fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Unix time, s.
    pub time_s: f64,
    /// Latitude, deg.
    pub lat_deg: f64,
    /// Longitude, deg.
    pub lon_deg: f64,
}

/// Fixes where both coordinates came at one time.
#[must_use]
pub fn fixes(lat: &Series, lon: &Series) -> Vec<Fix> {
    let mut other = lon.pairs().peekable();
    let mut out = Vec::new();
    for (time_s, lat_deg) in lat.pairs() {
        while other.peek().is_some_and(|(t, _)| *t < time_s) {
            other.next();
        }
        if let Some((_, lon_deg)) = other.peek().filter(|(t, _)| *t == time_s) {
            out.push(Fix { time_s, lat_deg, lon_deg: *lon_deg });
        }
    }
    out
}

/// East and north of `fix` from `origin`, m.
#[must_use]
pub fn local(origin: Fix, fix: Fix) -> (f64, f64) {
    let east = (fix.lon_deg - origin.lon_deg) * METRE_PER_DEGREE * origin.lat_deg.to_radians().cos();
    (east, (fix.lat_deg - origin.lat_deg) * METRE_PER_DEGREE)
}

/// Row ranges of the segments.
fn segments(flight: &Flight) -> Vec<std::ops::Range<usize>> {
    let mut out = Vec::new();
    let mut start = 0;
    for i in 1..=flight.len() {
        if i == flight.len() || flight.segment[i] != flight.segment[i - 1] {
            out.push(start..i);
            start = i;
        }
    }
    out
}

/// Origin of a segment: its first fix, from shortly before its first row on.
fn origin(fixes: &[Fix], first_s: f64, last_s: f64) -> Option<Fix> {
    let inside = fixes.iter().find(|f| f.time_s >= first_s - FIX_REACH_S && f.time_s <= last_s);
    inside.or_else(|| fixes.iter().rev().find(|f| f.time_s < first_s)).copied()
}

/// Writes the fixes into the rows nearest in time.
pub fn place(flight: &mut Flight, unix: &[f64], fixes: &[Fix], report: &mut Report) {
    let mut placed = std::collections::BTreeSet::new();
    for rows in segments(flight) {
        let (first, last) = (unix[rows.start], unix[rows.end - 1]);
        let Some(origin) = origin(fixes, first, last) else { continue };
        let segment = flight.segment[rows.start];
        report.origins.push(Origin { segment, unix_s: origin.time_s, lat_deg: origin.lat_deg, lon_deg: origin.lon_deg });
        for (k, fix) in fixes.iter().enumerate().filter(|(_, f)| f.time_s >= first - FIX_REACH_S && f.time_s <= last + FIX_REACH_S) {
            let next = (rows.start + unix[rows.clone()].partition_point(|t| *t < fix.time_s)).min(rows.end - 1);
            let row = if next > rows.start && fix.time_s - unix[next - 1] < unix[next] - fix.time_s { next - 1 } else { next };
            if (unix[row] - fix.time_s).abs() <= FIX_REACH_S {
                (flight.gps_east_m[row], flight.gps_north_m[row]) = local(origin, *fix);
                placed.insert(k);
            }
        }
    }
    if fixes.is_empty() {
        return;
    }
    report.note(format!("{} of {} GPS fixes placed at the row nearest in time", placed.len(), fixes.len()));
}

/// The fix of a row on the globe, if it has one and its segment's origin is known.
#[must_use]
pub fn on_the_globe(flight: &Flight, origins: &[Origin], row: usize) -> Option<Fix> {
    let (east, north) = (flight.gps_east_m[row], flight.gps_north_m[row]);
    let origin = origins.iter().rev().find(|o| o.segment <= flight.segment[row]).filter(|_| east.is_finite() && north.is_finite())?;
    Some(Fix {
        time_s: flight.time_s[row],
        lat_deg: origin.lat_deg + north / METRE_PER_DEGREE,
        lon_deg: origin.lon_deg + east / (METRE_PER_DEGREE * origin.lat_deg.to_radians().cos()),
    })
}

/// Origins anew after segments were cut: fixes of each count from its first one.
pub fn rebase(flight: &mut Flight, report: &mut Report) {
    let Some(old) = report.origins.first().copied() else { return };
    report.origins.clear();
    for rows in segments(flight) {
        let Some(first) = rows.clone().find(|i| flight.gps_east_m[*i].is_finite() && flight.gps_north_m[*i].is_finite()) else { continue };
        let (east, north) = (flight.gps_east_m[first], flight.gps_north_m[first]);
        report.origins.push(Origin {
            segment: flight.segment[first],
            unix_s: report.start_unix_s.unwrap_or(0.0) + flight.time_s[first],
            lat_deg: old.lat_deg + north / METRE_PER_DEGREE,
            lon_deg: old.lon_deg + east / (METRE_PER_DEGREE * old.lat_deg.to_radians().cos()),
        });
        for i in rows {
            flight.gps_east_m[i] -= east;
            flight.gps_north_m[i] -= north;
        }
    }
}

/// The vehicle's own dead reckoning, as columns `dr_east_m`, `dr_north_m` from the same origins.
pub fn dead_reckoning(flight: &mut Flight, unix: &[f64], lat: &Series, lon: &Series, fixes: &[Fix]) {
    if lat.is_empty() || lon.is_empty() {
        return;
    }
    let (lat, lon) = (lat.on(unix), lon.on(unix));
    let (mut east, mut north) = (vec![f64::NAN; unix.len()], vec![f64::NAN; unix.len()]);
    for rows in segments(flight) {
        let Some(origin) = origin(fixes, unix[rows.start], unix[rows.end - 1]) else { continue };
        for i in rows {
            (east[i], north[i]) = local(origin, Fix { time_s: unix[i], lat_deg: lat[i], lon_deg: lon[i] });
        }
    }
    flight.extra.insert("dr_east_m".into(), east);
    flight.extra.insert("dr_north_m".into(), north);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_western_longitude_keeps_its_minutes() {
        assert!((degrees_of_minutes(-12644.5) + 126.741_666_666_7).abs() < 1e-9);
        assert!((degrees_of_minutes(4830.0) - 48.5).abs() < 1e-12);
    }

    #[test]
    fn a_minute_of_latitude_is_a_nautical_mile() {
        let origin = Fix { time_s: 0.0, lat_deg: 54.0, lon_deg: 15.0 };
        let (east, north) = local(origin, Fix { lat_deg: 54.0 + 1.0 / 60.0, ..origin });
        // 1852 m by definition; the sphere is 1 m off.
        assert!((north - 1852.0).abs() < 2.0 && east == 0.0);
        let (east, _) = local(origin, Fix { lon_deg: 15.0 + 1.0 / 60.0, ..origin });
        assert!((east - 1852.0 * 54.0_f64.to_radians().cos()).abs() < 2.0);
    }
}
