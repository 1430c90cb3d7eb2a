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

/// A row so deep has no fix, though it is the nearest in time: the CTD was on under water only, Pa (20 dbar, guess).
const NO_FIX_PA: f64 = 2e5;

/// Degrees of (d)ddmm.mmm; the sign is that of the whole.
#[must_use]
pub fn degrees_of_minutes(ddmm: f64) -> f64 {
    let size = ddmm.abs();
    let whole = (size / 100.0).trunc();
    (whole + (size - 100.0 * whole) / 60.0).copysign(ddmm)
}

/// Slocum positions are ddmm.mmmm; fills such as 69696969 are no positions.
pub(super) fn of_minutes(series: &Series) -> Series {
    let (time, value): (Vec<f64>, Vec<f64>) =
        series.pairs().map(|(t, v)| (t, degrees_of_minutes(v))).filter(|(_, v)| v.abs() <= 180.0).unzip();
    Series::new(&time, &value)
}

/// Whether positions that should be ddmm.mmm are degrees: minutes of 60 and more, or all within a degree or two of 0 deg 0 deg.
pub(super) fn in_degrees(lat: &Series, lon: &Series) -> bool {
    let known =
        |series: &Series, most: f64| series.pairs().map(|(_, v)| v).filter(|v| v.abs() <= most * 100.0 && *v != 0.0).collect::<Vec<f64>>();
    let (lat, lon) = (known(lat, 90.0), known(lon, 180.0));
    let minutes = lat.iter().chain(&lon).filter(|v| v.abs() % 100.0 >= 60.0).count();
    let small = lat.iter().all(|v| v.abs() <= 90.0) && lon.iter().all(|v| v.abs() <= 180.0);
    2 * minutes > lat.len() || small
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

/// No glider drifts faster at the surface, m/s; and how far two fixes of one place lie apart at most, m (a bad fix of GPS).
const DRIFT_M_S: f64 = 5.0;
const FIX_ERROR_M: f64 = 500.0;

/// Without fixes at 0° 0°, where a receiver that has none says to be, and those that lie where no glider comes from its other fixes.
#[must_use]
pub fn sound(fixes: Vec<Fix>, report: &mut Report) -> Vec<Fix> {
    let on_the_globe = |f: &Fix| f.lat_deg.abs() <= 90.0 && f.lon_deg.abs() <= 360.0;
    let known: Vec<Fix> = fixes.iter().copied().filter(|f| on_the_globe(f) && (f.lat_deg != 0.0 || f.lon_deg != 0.0)).collect();
    let near = |a: usize, b: usize| {
        let (east, north) = local(known[a], known[b]);
        east.hypot(north) <= FIX_ERROR_M + DRIFT_M_S * (known[a].time_s - known[b].time_s).abs()
    };
    let kept: Vec<Fix> = reachable(known.len(), near).into_iter().map(|k| known[k]).collect();
    if kept.len() < fixes.len() {
        let out = fixes.len() - kept.len();
        report.note(format!("{out} of {} GPS fixes are at 0 deg 0 deg or where no glider comes from the others: left out", fixes.len()));
    }
    kept
}

/// Places of the most fixes of `count` that follow one another, where `near` says of two whether a glider comes from one to the other:
/// runs of neighbours, and the heaviest chain of runs. Of two alike, such as two fixes alone, all stay: which one is wrong is not known.
fn reachable(count: usize, near: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for k in 0..count {
        match runs.last_mut().filter(|r| near(r.end - 1, k)) {
            Some(run) => run.end = k + 1,
            None => runs.push(k..k + 1),
        }
    }
    if runs.len() < 2 || runs.len() > MOST_RUNS {
        return (0..count).collect();
    }
    // Weight of the heaviest chain that ends in each run, and the run before it.
    let mut best: Vec<(usize, Option<usize>)> = Vec::with_capacity(runs.len());
    for (k, run) in runs.iter().enumerate() {
        let before = (0..k).filter(|b| near(runs[*b].end - 1, run.start)).max_by_key(|b| best[*b].0);
        best.push((run.len() + before.map_or(0, |b| best[b].0), before));
    }
    let heaviest = best.iter().map(|b| b.0).max().unwrap_or(0);
    if 2 * heaviest <= count {
        return (0..count).collect();
    }
    let mut chain = Vec::new();
    let mut at = best.iter().position(|b| b.0 == heaviest);
    while let Some(k) = at {
        chain.push(runs[k].clone());
        at = best[k].1;
    }
    chain.into_iter().rev().flatten().collect()
}

/// More runs than this are noise, not a few wrong fixes (guess).
const MOST_RUNS: usize = 1000;

/// A longitude, or the difference of two, between -180 and 180 deg: across the date line it jumps by 360.
fn nearest_turn(lon_deg: f64) -> f64 {
    if lon_deg.abs() > 180.0 { lon_deg - 360.0 * (lon_deg / 360.0).round() } else { lon_deg }
}

/// East and north of `fix` from `origin`, m.
#[must_use]
pub fn local(origin: Fix, fix: Fix) -> (f64, f64) {
    let east = nearest_turn(fix.lon_deg - origin.lon_deg) * METRE_PER_DEGREE * origin.lat_deg.to_radians().cos();
    (east, (fix.lat_deg - origin.lat_deg) * METRE_PER_DEGREE)
}

/// Row ranges of the segments.
pub(super) fn segments(flight: &Flight) -> Vec<std::ops::Range<usize>> {
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

/// Fixes of a segment: those of its time, and of the time at the surface around it that are nearer to it than to another one.
fn of_segment<'a>(fixes: &'a [Fix], spans: &'a [(f64, f64)], own: usize) -> impl Iterator<Item = (usize, Fix)> + 'a {
    let (first, last) = spans[own];
    let (from, to) = (fixes.partition_point(|f| f.time_s < first - FIX_REACH_S), fixes.partition_point(|f| f.time_s <= last + FIX_REACH_S));
    let off = |span: (f64, f64), t: f64| (span.0 - t).max(t - span.1).max(0.0);
    let elsewhere = move |t: f64| {
        let nearer = |k: usize, or_alike: bool| {
            let other = spans.get(k).map_or(f64::INFINITY, |span| off(*span, t));
            other < off((first, last), t) || (or_alike && other == off((first, last), t))
        };
        // A fix between two belongs to the nearer one, in the middle to the earlier one.
        own.checked_sub(1).is_some_and(|k| nearer(k, true)) || nearer(own + 1, false)
    };
    (from..to.max(from)).map(|k| (k, fixes[k])).filter(move |(_, f)| !elsewhere(f.time_s))
}

/// Origin of a segment: the fix of its own nearest to its first row, else the last one before.
fn origin(fixes: &[Fix], spans: &[(f64, f64)], own: usize) -> Option<Fix> {
    let (first, last) = spans[own];
    let off = |f: &Fix| (f.time_s - first).abs();
    let inside = of_segment(fixes, spans, own).map(|(_, f)| f).filter(|f| f.time_s <= last).min_by(|a, b| off(a).total_cmp(&off(b)));
    inside.or_else(|| fixes.iter().rev().find(|f| f.time_s < first).copied())
}

/// First and last time of each segment's rows.
fn spans(unix: &[f64], rows: &[std::ops::Range<usize>]) -> Vec<(f64, f64)> {
    rows.iter().map(|r| (unix[r.start], unix[r.end - 1])).collect()
}

/// Writes the fixes into the rows nearest in time; of several at one row the nearest stays.
pub fn place(flight: &mut Flight, unix: &[f64], fixes: &[Fix], report: &mut Report) {
    let mut placed = std::collections::BTreeSet::new();
    let segments = segments(flight);
    let spans = spans(unix, &segments);
    for (own, rows) in segments.into_iter().enumerate() {
        let Some(origin) = origin(fixes, &spans, own) else { continue };
        let segment = flight.segment[rows.start];
        report.origins.push(Origin { segment, unix_s: origin.time_s, lat_deg: origin.lat_deg, lon_deg: origin.lon_deg });
        let mut nearest: std::collections::BTreeMap<usize, f64> = std::collections::BTreeMap::new();
        for (k, fix) in of_segment(fixes, &spans, own) {
            let next = (rows.start + unix[rows.clone()].partition_point(|t| *t < fix.time_s)).min(rows.end - 1);
            let row = if next > rows.start && fix.time_s - unix[next - 1] < unix[next] - fix.time_s { next - 1 } else { next };
            let off = (unix[row] - fix.time_s).abs();
            if off <= FIX_REACH_S && !(flight.pressure_pa[row] > NO_FIX_PA) {
                placed.insert(k);
                let held = nearest.entry(row).or_insert(f64::INFINITY);
                if off < *held {
                    *held = off;
                    (flight.gps_east_m[row], flight.gps_north_m[row]) = local(origin, fix);
                }
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
    let (lat_deg, lon_deg) = globe((origin.lat_deg, origin.lon_deg), east, north);
    Some(Fix { time_s: flight.time_s[row], lat_deg, lon_deg })
}

/// Latitude and longitude, deg, of a place so far east and north of an origin, m: [`local`] the other way.
#[must_use]
pub fn globe((lat_deg, lon_deg): (f64, f64), east_m: f64, north_m: f64) -> (f64, f64) {
    let east_deg = east_m / (METRE_PER_DEGREE * lat_deg.to_radians().cos());
    (lat_deg + north_m / METRE_PER_DEGREE, nearest_turn(lon_deg + east_deg))
}

/// Origins anew after segments were cut, which were `before`: fixes of each count from its first one.
pub fn rebase(flight: &mut Flight, report: &mut Report, before: &[u32]) {
    let old = std::mem::take(&mut report.origins);
    let now = std::mem::replace(&mut flight.segment, before.to_vec());
    let mut fixes: Vec<Option<Fix>> = (0..flight.len()).map(|row| on_the_globe(flight, &old, row)).collect();
    flight.segment = now;
    if old.is_empty() {
        return;
    }
    for rows in segments(flight) {
        let Some(first) = rows.clone().find_map(|i| fixes[i]) else { continue };
        let unix_s = report.start_unix_s.unwrap_or(0.0) + first.time_s;
        report.origins.push(Origin { segment: flight.segment[rows.start], unix_s, lat_deg: first.lat_deg, lon_deg: first.lon_deg });
        for i in rows {
            (flight.gps_east_m[i], flight.gps_north_m[i]) = fixes[i].take().map_or((f64::NAN, f64::NAN), |fix| local(first, fix));
        }
    }
}

/// The vehicle's own dead reckoning, as columns `dr_east_m`, `dr_north_m` from the same origins.
pub fn dead_reckoning(flight: &mut Flight, unix: &[f64], [lat, lon]: &[Series; 2], fixes: &[Fix]) {
    if lat.is_empty() || lon.is_empty() {
        return;
    }
    // Interpolated across the date line it would go once round the globe.
    let middle = fixes.first().map_or(0.0, |f| f.lon_deg);
    let (time, near): (Vec<f64>, Vec<f64>) = lon.pairs().map(|(t, v)| (t, middle + nearest_turn(v - middle))).unzip();
    let (lat, lon) = (lat.on(unix), Series::new(&time, &near).on(unix));
    let (mut east, mut north) = (vec![f64::NAN; unix.len()], vec![f64::NAN; unix.len()]);
    let segments = segments(flight);
    let spans = spans(unix, &segments);
    for (own, rows) in segments.into_iter().enumerate() {
        let Some(origin) = origin(fixes, &spans, own) else { continue };
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
    fn regress_a_fix_at_zero_or_a_degree_off_is_left_out() {
        let fix = |k: u32| Fix { time_s: 600.0 * f64::from(k), lat_deg: 54.0 + 1e-4 * f64::from(k), lon_deg: 15.0 };
        let good: Vec<Fix> = (0..17).map(fix).collect();
        let mut report = Report::new("made");
        assert_eq!(sound(good.clone(), &mut report), good);
        assert!(report.notes.is_empty());
        for k in [0, 8, 16] {
            for (lat_deg, lon_deg) in [(0.0, 0.0), (55.0, 15.0)] {
                let mut with = good.clone();
                with[k] = Fix { lat_deg, lon_deg, ..with[k] };
                let mut report = Report::new("made");
                let mut want = good.clone();
                want.remove(k);
                assert_eq!(sound(with, &mut report), want);
                assert_eq!(report.notes.len(), 1);
            }
        }
    }

    #[test]
    fn regress_several_far_fixes_are_left_out_and_half_of_them_are_not() {
        let fix = |k: u32, north: f64| Fix { time_s: 60.0 * f64::from(k), lat_deg: 54.0 + north, lon_deg: 15.0 };
        let far = |range: std::ops::Range<u32>| (0..17).map(|k| fix(k, if range.contains(&k) { 1.0 } else { 0.0 })).collect::<Vec<_>>();
        for range in [13..17, 0..4, 7..11] {
            let kept = sound(far(range.clone()), &mut Report::new("made"));
            assert!(kept.len() == 13 && kept.iter().all(|f| f.lat_deg == 54.0), "{range:?}: {}", kept.len());
        }
        // Two days later and 100 km on is a ship or a current.
        let mut later = far(17..17);
        later.extend((0..9).map(|k| Fix { time_s: 172_800.0 + f64::from(k), ..fix(0, 0.9) }));
        assert_eq!(sound(later.clone(), &mut Report::new("made")), later);
        let two = vec![fix(0, 0.0), fix(1, 1.0)];
        assert_eq!(sound(two.clone(), &mut Report::new("made")), two);
    }

    #[test]
    fn regress_fixes_of_the_next_segment_are_not_this_one_s() {
        // Two segments of 200 s with 100 s between them, drifting north; fixes every 20 s all the while.
        let mut f = Flight::blank(100);
        let times: Vec<f64> = (0..100).map(|i| if i < 50 { 4.0 * f64::from(i) } else { 100.0 + 4.0 * f64::from(i) }).collect();
        (50..100).for_each(|i| f.segment[i] = 1);
        let degree = |t: f64| 54.0 + t * 0.5 / METRE_PER_DEGREE;
        let fixes: Vec<Fix> = (0..25).map(|k| 20.0 * f64::from(k)).map(|t| Fix { time_s: t, lat_deg: degree(t), lon_deg: 15.0 }).collect();
        let mut report = Report::new("made");
        place(&mut f, &times, &fixes, &mut report);
        // 10 fixes in each span, those between once only.
        let placed = f.gps_north_m.iter().filter(|v| v.is_finite()).count();
        assert!(placed <= 25, "{placed} of 25 fixes");
        for rows in [0..50, 50..100] {
            let start = report.origins[usize::from(rows.start > 0)].unix_s;
            for i in rows.filter(|i| f.gps_north_m[*i].is_finite()) {
                assert!((f.gps_north_m[i] - 0.5 * (times[i] - start)).abs() < 6.0, "row {i}: {}", f.gps_north_m[i]);
            }
        }
        assert!((report.origins[1].unix_s - 300.0).abs() < 1.0, "{:?}", report.origins);
    }

    #[test]
    fn regress_a_fix_after_the_last_row_of_a_dive_is_not_at_depth() {
        // The CTD ends half way down, 300 s before the fix.
        let mut f = Flight::blank(50);
        let times: Vec<f64> = (0..50).map(|i| 4.0 * f64::from(i)).collect();
        (0..50).for_each(|i| f.pressure_pa[i] = 1.2e4 * i as f64);
        let fix = |time_s| Fix { time_s, lat_deg: 54.0, lon_deg: 15.0 };
        place(&mut f, &times, &[fix(0.0), fix(496.0)], &mut Report::new("made"));
        assert!(f.gps_north_m[0] == 0.0 && f.gps_north_m[1..].iter().all(|v| v.is_nan()));
    }

    #[test]
    fn regress_the_date_line_is_no_way_round_the_globe() {
        let fix = |lon_deg| Fix { time_s: 0.0, lat_deg: -17.0, lon_deg };
        for (from, to) in [(179.999, -179.999), (179.999, 180.001), (-180.0, 180.002), (359.999, 0.001)] {
            let (east, _) = local(fix(from), fix(to));
            assert!((east - 0.002 * METRE_PER_DEGREE * 17.0_f64.to_radians().cos()).abs() < 1e-3, "{from} {to}: {east}");
        }
        let mut flight = Flight::blank(3);
        let times = [0.0, 10.0, 20.0];
        let (lat, lon) = (Series::new(&[0.0, 20.0], &[-17.0; 2]), Series::new(&[0.0, 20.0], &[179.999, -179.999]));
        dead_reckoning(&mut flight, &times, &[lat, lon], &[fix(179.999)]);
        assert!((flight.extra["dr_east_m"][1] - 106.3).abs() < 0.1, "{:?}", flight.extra);
        let origin = Origin { segment: 0, unix_s: 0.0, lat_deg: 0.0, lon_deg: 179.999 };
        (flight.gps_east_m[0], flight.gps_north_m[0]) = (0.002 * METRE_PER_DEGREE, 0.0);
        let on = on_the_globe(&flight, &[origin], 0).expect("a fix");
        assert!((on.lon_deg + 179.999).abs() < 1e-9, "{on:?}");
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
