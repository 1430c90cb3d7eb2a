//! Flights of one vehicle, one file each, become one flight on one clock.

use std::collections::BTreeMap;

use super::channels::{LONGEST_MISSION_S, stray_times};
use super::{Imported, Report};
use crate::record::flight::Flight;

/// Joins `parts`, each a flight with its name; they are put in the order of time. Rows of a part in the time of those before it are left
/// out, the part as a whole where these are many and hold other values.
///
/// Segments are counted on; none without parts.
pub(super) fn join(kind: &str, mut parts: Vec<(String, Imported)>) -> Option<Imported> {
    parts.retain(|(_, p)| !p.flight.is_empty());
    parts.sort_by(|a, b| start(&a.1).total_cmp(&start(&b.1)));
    let unset = of_other_years(&mut parts);
    let first = start(&parts.first()?.1);
    let dated = parts.iter().any(|(_, p)| p.report.start_unix_s.is_some());
    let mut report = Report { start_unix_s: dated.then_some(first), ..Report::new(kind) };
    unset.into_iter().for_each(|what| report.leave_out(what));
    let mut flight = Flight::blank(0);
    let mut notes: BTreeMap<String, (String, String, usize)> = BTreeMap::new();
    let (mut vehicle, mut vehicle_file) = (None, None);
    for (name, mut part) in parts {
        let shift = start(&part) - first;
        report.files.extend(std::mem::take(&mut part.report.files));
        if !leave_out_held(&flight, &name, &mut part, shift, &mut report) {
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
        vehicle_file = vehicle_file.or(part.vehicle_file);
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
    Some(Imported { flight, report, vehicle, vehicle_file })
}

/// What is odd about parts in the order of their numbers (dives, cycles): numbers that are missing in between, as a note, and ones whose
/// clock does not follow that of the one before.
pub(super) fn numbered(what: &str, parts: &[(u32, f64)], report: &mut Report) {
    let mut missing: Vec<String> = Vec::new();
    for pair in parts.windows(2) {
        let ((before, begins), (number, then)) = (pair[0], pair[1]);
        match number - before {
            0 | 1 => {}
            2 => missing.push(format!("{}", before + 1)),
            _ => missing.push(format!("{} to {}", before + 1, number - 1)),
        }
        if then < begins {
            let back_s = begins - then;
            report.leave_out(format!(
                "{what} {number} begins {back_s:.0} s before {what} {before}: one of their clocks is wrong, and where they lie with it"
            ));
        }
    }
    if !missing.is_empty() {
        report.note(format!("no file of {what} {}", missing.join(", ")));
    }
}

/// Rows of two files at one time, s, and with one pressure, Pa.
const SAME_TIME_S: f64 = 1e-3;
const SAME_PRESSURE_PA: f64 = 100.0;
/// A larger share of a part in the time of another, with other values, is of another glider or clock (guess).
const OVERLAP: f64 = 0.25;

/// Takes the rows out of `part`, `shift` seconds after the first row of `flight`, that lie in the time of the flight; whether any are to
/// be joined.
fn leave_out_held(flight: &Flight, name: &str, part: &mut Imported, shift: f64, report: &mut Report) -> bool {
    let Some(end) = flight.time_s.last().copied() else { return true };
    let of = &part.flight;
    let (all, shared) = (of.len(), of.time_s.partition_point(|t| shift + t <= end + SAME_TIME_S));
    let before = |time: f64| flight.time_s.partition_point(|t| *t < time);
    let held = |k: usize| {
        let at = before(shift + of.time_s[k] - SAME_TIME_S);
        let near = flight.time_s.get(at).is_some_and(|t| t - shift - of.time_s[k] < SAME_TIME_S);
        near && (flight.pressure_pa[at] - of.pressure_pa[k]).abs() < SAME_PRESSURE_PA
    };
    let same = (0..shared).all(held);
    if shared == all && same {
        report.note(format!("{name}: holds the same rows as the one before it: read once"));
        return false;
    }
    if !same && shared as f64 > OVERLAP * all as f64 {
        report.leave_out(format!("{name}: begins {:.0} s before the one before it ends: left out", end - shift - of.time_s[0]));
        return false;
    }
    if same && shared > 0 {
        report.note(format!("{name}: the first {shared} of {all} rows are held already, with the same pressure: read once"));
    } else if shared > 0 {
        let off =
            |k: usize| (flight.pressure_pa[before(shift + of.time_s[k] - SAME_TIME_S).min(flight.len() - 1)] - of.pressure_pa[k]).abs();
        let most = (0..shared).map(off).fold(0.0, f64::max) * 1e-4;
        report.leave_out(format!(
            "{name}: its first {shared} of {all} rows lie in the time of the one before it, their pressure up to {most:.1} dbar off: left out"
        ));
    }
    drop_first(part, shared);
    true
}

/// The part without its first rows, its segments counted from 0 again; its times stay.
fn drop_first(part: &mut Imported, rows: usize) {
    let Some(first) = part.flight.segment.get(rows).copied().filter(|_| rows > 0) else { return };
    let flight = &mut part.flight;
    flight.time_s.drain(..rows);
    flight.segment.drain(..rows);
    flight.segment.iter_mut().for_each(|s| *s -= first);
    flight.columns_mut().into_iter().for_each(|column| drop(column.drain(..rows)));
    flight.speed_m_s.iter_mut().chain(flight.extra.values_mut()).for_each(|column| drop(column.drain(..rows)));
    part.report.segments.drain(..(first as usize).min(part.report.segments.len()));
    part.report.origins.retain(|o| o.segment >= first);
    part.report.origins.iter_mut().for_each(|o| o.segment -= first);
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
