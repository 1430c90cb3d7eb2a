//! Flights of one vehicle, one file each, become one flight on one clock.

use std::collections::BTreeMap;

use super::channels::{LONGEST_MISSION_S, stray_times};
use super::{Imported, Report};
use crate::record::flight::Flight;

/// Joins `parts`, each a flight with its name; they are put in the order of time. A part that begins before the one before it has
/// ended is left out.
///
/// Segments are counted on; none without parts.
pub(super) fn join(kind: &str, mut parts: Vec<(String, Imported)>) -> Option<Imported> {
    parts.retain(|(_, p)| !p.flight.is_empty());
    parts.sort_by(|a, b| start(&a.1).total_cmp(&start(&b.1)));
    let unset = of_other_years(&mut parts);
    let first = start(&parts.first()?.1);
    let mut report = Report { start_unix_s: Some(first), ..Report::new(kind) };
    unset.into_iter().for_each(|what| report.leave_out(what));
    let mut flight = Flight::blank(0);
    let mut notes: BTreeMap<String, (String, String, usize)> = BTreeMap::new();
    let mut vehicle = None;
    for (name, part) in parts {
        let shift = start(&part) - first;
        report.files.extend(part.report.files);
        if let Some(end) = flight.time_s.last().filter(|end| shift + part.flight.time_s[0] <= **end) {
            let length = part.flight.time_s.last().copied().unwrap_or(0.0);
            let same = (shift + length - end).abs() < 1e-6 && flight.pressure_pa.ends_with(&part.flight.pressure_pa);
            if same {
                report.note(format!("{name}: holds the same rows as the one before it: read once"));
            } else {
                report.leave_out(format!("{name}: begins {:.0} s before the one before it ends: left out", end - shift));
            }
            continue;
        }
        let offset = flight.segment.last().map_or(0, |s| s + 1);
        append(&mut flight, part.flight, shift, offset);
        report.segments.extend(part.report.segments);
        report.origins.extend(part.report.origins.into_iter().map(|o| super::Origin { segment: o.segment + offset, ..o }));
        part.report.mapped.into_iter().for_each(|m| report.map(m));
        for what in part.report.left_out {
            report.leave_out(format!("{name}: {what}"));
        }
        if !part.report.density.is_empty() && (report.density.is_empty() || report.density.starts_with("missing")) {
            report.density = part.report.density;
        }
        vehicle = vehicle.or(part.vehicle);
        // What all files say alike but for its numbers is said once.
        for note in part.report.notes {
            let shape: String = note.chars().filter(|c| !c.is_ascii_digit()).collect();
            notes.entry(shape).or_insert((name.clone(), note, 0)).2 += 1;
        }
    }
    for (name, note, times) in notes.into_values() {
        report.note(if times > 1 { format!("{note} ({name}; likewise in {} more)", times - 1) } else { format!("{name}: {note}") });
    }
    flight.name = report.segments.first().cloned().unwrap_or_default();
    Some(Imported { flight, report, vehicle })
}

/// Takes out parts whose clock was not set, or stands more than a mission off the others; what they are.
fn of_other_years(parts: &mut Vec<(String, Imported)>) -> Vec<String> {
    let mut starts: Vec<f64> = parts.iter().map(|(_, p)| start(p)).collect();
    stray_times(&mut starts, LONGEST_MISSION_S);
    let mut kept = starts.into_iter();
    let mut out = Vec::new();
    parts.retain(|(name, part)| {
        let stays = kept.next().is_some_and(f64::is_finite);
        if !stays {
            let year = 1970.0 + start(part) / (365.25 * 86400.0);
            out.push(format!("{name}: its clock stands in {year:.0}: {} rows left out", part.flight.len()));
        }
        stays
    });
    out
}

fn start(part: &Imported) -> f64 {
    part.report.start_unix_s.unwrap_or(0.0)
}

fn append(flight: &mut Flight, mut more: Flight, shift_s: f64, first_segment: u32) {
    let (before, after) = (flight.len(), flight.len() + more.len());
    flight.time_s.extend(more.time_s.iter().map(|t| t + shift_s));
    flight.segment.extend(more.segment.iter().map(|s| s + first_segment));
    for (column, more) in flight.columns_mut().into_iter().zip(more.columns_mut()) {
        column.append(more);
    }
    if flight.speed_m_s.is_some() || more.speed_m_s.is_some() {
        let column = flight.speed_m_s.get_or_insert_default();
        column.resize(before, f64::NAN);
        column.extend(more.speed_m_s.unwrap_or_default());
        column.resize(after, f64::NAN);
    }
    for (name, values) in more.extra {
        let column = flight.extra.entry(name).or_default();
        column.resize(before, f64::NAN);
        column.extend(values);
    }
    flight.extra.values_mut().for_each(|c| c.resize(after, f64::NAN));
}
