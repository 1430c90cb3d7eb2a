//! Channels of the two computers, each with its times, become one flight on the rows of the CTD.

use std::collections::BTreeMap;

use super::{Collected, GPS_STATUS};
use crate::import::Report;
use crate::import::assembly::{Log, Row};
use crate::import::position;
use crate::import::pressure_zero::{self, UNDER_WATER_PA};
use crate::import::two_computers::{self, Ctd, covered};
use crate::record::clock_offset::ENGINEERING_PRESSURE;
use crate::record::flight::Flight;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

/// A reading that moves by less does not move the vehicle, m³ (guess).
const PUMP_M3: f64 = 20e-6;

pub(super) fn merge(mut all: Collected, report: &mut Report) -> Option<Flight> {
    let mut series: BTreeMap<String, Series> =
        all.channels.iter().map(|(name, c)| (name.clone(), Series::new(&c.time_s, &c.value))).collect();
    let empty = Series::default();
    let get = |name: &str| series.get(name).unwrap_or(&empty);
    let (lat, lon) = gps(&good(get("m_gps_lat"), get(GPS_STATUS), report), get("m_gps_lon"), report);
    let place = lat.pairs().next().zip(lon.pairs().next()).map(|((_, lat_deg), (_, lon_deg))| Place { lon_deg, lat_deg });
    let steering = steering_pressure(&series, place, &all.spans, report);
    let heading_is_sound = in_rad(get("m_heading"), report);
    let from_ctd = !all.ctd.is_empty();
    if !from_ctd {
        report.note("no CTD in these files: rows are the vehicle's own pressure, and density is missing".into());
    }
    without_ctd(&mut all, &steering, report);
    all.ctd.sort_by(|a, b| a.unix_s.total_cmp(&b.unix_s));
    all.ctd.dedup_by(|b, a| a.unix_s == b.unix_s);
    without_overlap(&mut all.ctd, report);
    number_segments(&mut all.ctd, report);
    let conducts = all.ctd.iter().any(|r| r.conductivity_s_m.is_finite());
    report.density_from("sci_water_cond, sci_water_temp, sci_water_pressure", place, conducts);
    // Shallow gliders have a pump, deep ones an oil bladder, and the reading of the other is a fill: it is the one that moves.
    let (pumped, bladder) = (get("m_ballast_pumped"), get("m_de_oil_vol"));
    let (oil, other) =
        if moves(pumped) >= moves(bladder) { ("m_ballast_pumped", "m_de_oil_vol") } else { ("m_de_oil_vol", "m_ballast_pumped") };
    let (ballast, of_others) = better_in_segments(pumped, bladder, &all.spans, |pumped, bladder| {
        let (a, b) = (moves(pumped), moves(bladder));
        (a.max(b) > PUMP_M3).then_some(a >= b)
    });
    if of_others > 0 {
        report.note(format!("ballast: in {of_others} segments {other} moves and {oil} does not: taken there"));
    }
    report.mapped.retain(|m| m.from != other || of_others > 0);
    for m in report.mapped.iter_mut().filter(|m| from_ctd && m.from == "m_pressure") {
        m.to = ENGINEERING_PRESSURE.into();
    }
    let (dr_lat, dr_lon) = without_zeros(&position::of_minutes(get("m_lat")), &position::of_minutes(get("m_lon")));
    let mut take = |name: &str| series.remove(name).unwrap_or_default();
    let mut log = Log {
        rows: all.ctd,
        pitch: take("m_pitch").into(),
        roll: take("m_roll").into(),
        heading: Some(take("m_heading")).filter(|_| heading_is_sound).unwrap_or_default().into(),
        ballast: ballast.into(),
        battery: take("m_battpos").into(),
        // Beside the CTD's pressure that of the steering computer tells how far the two clocks are apart.
        steering_pressure: if from_ctd { steering } else { Series::default() },
        fixes: position::fixes(&lat, &lon),
        reckoned: [dr_lat, dr_lon],
        ..Log::default()
    };
    let fin = take("m_fin");
    if !fin.is_empty() {
        log.extra.insert("m_fin_rad".into(), fin.into());
    }
    for name in ["m_thruster_power", "m_thruster_current"] {
        let thruster = take(name);
        if moves(&thruster) > 0.0 {
            log.extra.insert(name.into(), thruster.into());
        }
    }
    let name = report.segments.first().cloned().unwrap_or_default();
    log.flight(&name, report)
}

/// By how much a reading moves, without a value now and then that is a fill; less than 0 where there is none.
fn moves(series: &Series) -> f64 {
    let mut values: Vec<f64> = series.pairs().map(|(_, v)| v).collect();
    values.sort_by(f64::total_cmp);
    values.last().zip(values.first()).map_or(-1.0, |(high, low)| high - low)
}

/// Times of the segments' files: the files' of the vehicle, else those of the CTD.
type Spans = BTreeMap<u32, (f64, f64)>;

/// Of two series the better one in each segment, as `better` says (the first, the second, or none of them more than usual); outside all
/// segments that of the whole flight. In how many segments it is not that.
fn better_in_segments(
    first: &Series,
    second: &Series,
    spans: &Spans,
    better: impl Fn(&Series, &Series) -> Option<bool>,
) -> (Series, usize) {
    let usual = better(first, second).unwrap_or(true);
    let of = |span: &(f64, f64)| better(&first.within(span.0, span.1), &second.within(span.0, span.1));
    let mut others: Vec<(f64, f64)> = spans.values().copied().filter(|span| of(span) == Some(!usual)).collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (one, other) = if usual { (first, second) } else { (second, first) };
    // Spans of one glider do not overlap.
    let inside = |t: f64| others.partition_point(|span| span.0 <= t).checked_sub(1).is_some_and(|k| t <= others[k].1);
    let kept = one.pairs().filter(|(t, _)| !inside(*t)).chain(other.pairs().filter(|(t, _)| inside(*t)));
    let (time, value): (Vec<f64>, Vec<f64>) = kept.unzip();
    (Series::new(&time, &value), others.len())
}

/// Pressure by the steering computer, Pa: its own, else from its depth, in each segment.
fn steering_pressure(series: &BTreeMap<String, Series>, place: Option<Place>, spans: &Spans, report: &mut Report) -> Series {
    let of = |name: &str| series.get(name).filter(|s| !s.is_empty()).cloned();
    let named = ["m_pressure", "m_water_pressure"].into_iter().find_map(|name| Some((name, of(name)?)));
    let own = named.map(|(name, own)| upright(own, name, UNDER_WATER_PA, report));
    let Some(depth) = of("m_depth") else { return own.unwrap_or_default() };
    let depth = upright(depth, "m_depth", UNDER_WATER_PA * 1e-4, report);
    let lat_deg = place.map_or(45.0, |p| p.lat_deg);
    let (time, pressure): (Vec<f64>, Vec<f64>) =
        depth.pairs().map(|(t, z)| (t, if z < 0.0 { 1e4 * z } else { seawater::pressure_pa(z, lat_deg) })).unzip();
    let of_depth = Series::new(&time, &pressure);
    let Some(own) = own else {
        report.note(format!("no m_pressure: the vehicle's pressure is computed from m_depth by TEOS-10 at {lat_deg:.1} deg"));
        return of_depth;
    };
    let (pressure, count) =
        better_in_segments(&own, &of_depth, spans, |own, depth| (own.is_empty() != depth.is_empty()).then_some(depth.is_empty()));
    if count > 0 {
        report.note(format!("{count} segments have no m_pressure: it is computed from m_depth there"));
    }
    pressure
}

/// A channel that grows downward: one whose middle lies further than `water` above the surface is turned round.
fn upright(series: Series, name: &str, water: f64, report: &mut Report) -> Series {
    let (time, mut values): (Vec<f64>, Vec<f64>) = series.pairs().unzip();
    if pressure_zero::turn_upright(&mut values, name, water, report) { Series::new(&time, &values) } else { series }
}

/// Segments whose CTD was off for most of the time under water get the rows of the vehicle's own pressure.
fn without_ctd(all: &mut Collected, steering: &Series, report: &mut Report) {
    let ctd = two_computers::rows_by_segment(all.ctd.iter().map(|r| (r.segment, r.unix_s, r.pressure_pa)));
    let mut off = std::collections::BTreeSet::new();
    for (segment, span) in &all.spans {
        let own: Vec<(f64, f64)> = steering.within(span.0, span.1).pairs().collect();
        let ctd = ctd.get(segment).map_or(&[][..], Vec::as_slice);
        let name = report.segments.get(*segment as usize).cloned().unwrap_or_default();
        match covered(&own, ctd) {
            Ctd::Whole => {}
            Ctd::Missing(off, of) => {
                report.leave_out(format!("{name}: the CTD was off in {off} of {of} minutes under water, which have no rows"));
            }
            Ctd::Off(ran, of) => {
                let had = ctd.len();
                if had > 0 {
                    report.leave_out(format!(
                        "{name}: the CTD ran in {ran} of {of} minutes under water: its {had} samples give way to the vehicle's own pressure"
                    ));
                }
                off.insert(*segment);
            }
        }
    }
    all.ctd.retain(|r| !off.contains(&r.segment));
    for segment in off {
        let own = all.spans.get(&segment).map(|span| steering.within(span.0, span.1)).unwrap_or_default();
        all.ctd.extend(own.pairs().map(|(unix_s, pressure_pa)| Row::at(unix_s, segment, pressure_pa)));
    }
}

/// Rows of a segment after the first one of the next: two files overlap, and their rows would come by turns.
fn without_overlap(rows: &mut Vec<Row>, report: &mut Report) {
    let mut seen: Vec<u32> = Vec::new();
    let all = rows.len();
    rows.retain(|row| {
        if seen.last() != Some(&row.segment) && !seen.contains(&row.segment) {
            seen.push(row.segment);
        }
        seen.last() == Some(&row.segment)
    });
    if rows.len() < all {
        report.leave_out(format!("{} of {all} rows of one segment lie in the time of the next: two files overlap", all - rows.len()));
    }
}

/// Latitudes that the receiver itself does not call bad at their time.
fn good(lat: &Series, status: &Series, report: &mut Report) -> Series {
    let bad: std::collections::BTreeSet<u64> = status.pairs().filter(|(_, v)| *v != 0.0).map(|(t, _)| t.to_bits()).collect();
    let (time, value): (Vec<f64>, Vec<f64>) = lat.pairs().filter(|(t, _)| !bad.contains(&t.to_bits())).unzip();
    if time.len() == lat.len() || time.is_empty() {
        return lat.clone();
    }
    report.note(format!("{} of {} GPS fixes have another {GPS_STATUS} than 0: no good ones, left out", lat.len() - time.len(), lat.len()));
    Series::new(&time, &value)
}

/// Latitude and longitude of the GPS, deg.
fn gps(lat: &Series, lon: &Series, report: &mut Report) -> (Series, Series) {
    let fixes = without_zeros(&position::of_minutes(lat), &position::of_minutes(lon));
    if !fixes.0.is_empty() && position::in_degrees(lat, lon) {
        report.leave_out("m_gps_lat and m_gps_lon are to be ddmm.mmm and look like degrees: all fixes are left out".into());
        return (Series::default(), Series::default());
    }
    fixes
}

/// Positions without those of 0 deg 0 deg, where a receiver without a fix says to be; on the equator or the meridian there are fixes.
fn without_zeros(lat: &Series, lon: &Series) -> (Series, Series) {
    let known = position::fixes(lat, lon).into_iter().filter(|f| f.lat_deg != 0.0 || f.lon_deg != 0.0);
    let (time, places): (Vec<f64>, Vec<(f64, f64)>) = known.map(|f| (f.time_s, (f.lat_deg, f.lon_deg))).unzip();
    let (lat, lon): (Vec<f64>, Vec<f64>) = places.into_iter().unzip();
    (Series::new(&time, &lat), Series::new(&time, &lon))
}

/// Whether a heading that states rad can be in rad.
fn in_rad(heading: &Series, report: &mut Report) -> bool {
    let beyond = heading.pairs().filter(|(_, v)| v.abs() > FULL_TURN_RAD).count();
    let sound = 20 * beyond <= heading.len();
    if !sound {
        report.leave_out("m_heading is in rad and goes beyond a full turn: degrees? It is left out".into());
    }
    sound
}

/// A full turn, and a little more, rad.
const FULL_TURN_RAD: f64 = 6.6;

/// Segment numbers without holes, in the order of time.
fn number_segments(rows: &mut [Row], report: &mut Report) {
    let mut seen: Vec<u32> = Vec::new();
    for s in rows.iter_mut().map(|r| &mut r.segment) {
        let k = seen.iter().position(|k| k == s).unwrap_or_else(|| {
            seen.push(*s);
            seen.len() - 1
        });
        *s = k as u32;
    }
    report.segments = seen.iter().filter_map(|k| report.segments.get(*k as usize).cloned()).collect();
}
