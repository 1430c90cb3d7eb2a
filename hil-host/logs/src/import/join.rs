//! Flights of one vehicle, one file each, become one flight on one clock.

use std::collections::BTreeMap;

use super::clocks::{LONGEST_MISSION_S, stray_times};
use super::report::{DensityIs, list_of};
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
    let numbered = parts.iter().all(|(_, p)| p.report.numbered);
    let mut report = Report { start_unix_s: dated.then_some(first), numbered, ..Report::new(kind) };
    unset.into_iter().for_each(|what| report.leave_out(what));
    note_lacking(&mut parts, &mut report);
    let mut flight = Flight::blank(0);
    let mut notes: BTreeMap<String, (String, String, usize)> = BTreeMap::new();
    let (mut vehicle, mut vehicle_file) = (None, None);
    for (name, mut part) in parts {
        let shift = start(&part) - first;
        report.files.extend(std::mem::take(&mut part.report.files));
        if !leave_out_held(&mut flight, &name, &mut part, shift, &mut report) {
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
        if !part.report.density.is_empty() && report.density_is == DensityIs::Missing {
            report.density = part.report.density;
            report.density_is = part.report.density_is;
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

/// Names parts that lack a channel which others have.
fn note_lacking(parts: &mut [(String, Imported)], report: &mut Report) {
    const CHANNELS: [&str; 4] = ["m_pitch_rad", "m_ballast_pumped_cc", "sci_water_temp_degC", "sci_density_kg_m3"];
    for (_, part) in parts.iter_mut() {
        part.report.find_missing(&part.flight);
    }
    let lacks = |part: &Imported, column: &str| part.report.missing.iter().any(|m| m == column);
    for column in CHANNELS {
        let without: Vec<String> = parts.iter().filter(|(_, p)| lacks(p, column)).map(|(name, _)| name.clone()).collect();
        if !without.is_empty() && without.len() < parts.len() {
            report.note(format!("without {column}, which the others have: {}", list_of(&without)));
        }
    }
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
fn leave_out_held(flight: &mut Flight, name: &str, part: &mut Imported, shift: f64, report: &mut Report) -> bool {
    let Some(end) = flight.time_s.last().copied() else { return true };
    let of = &part.flight;
    let (all, shared) = (of.len(), of.time_s.partition_point(|t| shift + t <= end + SAME_TIME_S));
    // The row of the flight that a row of the part is, or would be.
    let times = &flight.time_s;
    let at: Vec<usize> = of.time_s[..shared].iter().map(|t| times.partition_point(|held| *held < shift + t - SAME_TIME_S)).collect();
    let off_pa: Vec<f64> =
        at.iter().enumerate().map(|(k, at)| (flight.pressure_pa[(*at).min(flight.len() - 1)] - of.pressure_pa[k]).abs()).collect();
    let held = |k: usize| times.get(at[k]).is_some_and(|t| t - shift - of.time_s[k] < SAME_TIME_S) && off_pa[k] < SAME_PRESSURE_PA;
    let same = (0..shared).all(held);
    let said = if same && shared > 0 { fill_held(flight, &part.flight, &at) } else { Said::default() };
    if !said.other.is_empty() {
        report.leave_out(format!("{name}: its {} are others than those of the same rows held already, which stay", said.other.join(", ")));
    }
    let filled =
        if said.filled.is_empty() { String::new() } else { format!("; its {} are taken where there were none", said.filled.join(", ")) };
    if shared == all && same {
        report.note(format!("{name}: holds the same rows as the one before it: read once{filled}"));
        return false;
    }
    if !same && shared as f64 > OVERLAP * all as f64 {
        report.leave_out(format!("{name}: begins {:.0} s before the one before it ends: left out", end - shift - of.time_s[0]));
        return false;
    }
    if same && shared > 0 {
        report.note(format!("{name}: the first {shared} of {all} rows are held already, with the same pressure: read once{filled}"));
    } else if shared > 0 {
        let most = off_pa.iter().copied().fold(0.0, f64::max) * 1e-4;
        report.leave_out(format!(
            "{name}: its first {shared} of {all} rows lie in the time of the one before it, their pressure up to {most:.1} dbar off: left out"
        ));
    }
    drop_first(part, shared);
    true
}

/// Columns of rows that are held already: taken where there was no value, and of other values.
#[derive(Default)]
struct Said {
    filled: Vec<String>,
    other: Vec<String>,
}

/// Takes over values of the first rows of `part`, which `flight` holds as its rows `at`, where the flight has none.
fn fill_held(flight: &mut Flight, part: &Flight, at: &[usize]) -> Said {
    const NAMES: [&str; 8] = ["pressure", "pitch", "roll", "heading", "ballast", "battery", "temperature", "density"];
    /// No further apart two writings of one value are, of the larger.
    const SAME: f64 = 1e-5;
    let mut said = Said::default();
    let rows = flight.len();
    let mut take = |name: &str, held: &mut Vec<f64>, new: &[f64]| {
        let (mut filled, mut other) = (false, false);
        for (row, new) in at.iter().zip(new).filter(|(_, new)| new.is_finite()) {
            let held = &mut held[*row];
            other |= (*held - new).abs() > SAME * held.abs().max(new.abs());
            if held.is_nan() {
                *held = *new;
                filled = true;
            }
        }
        if filled {
            said.filled.push(name.to_owned());
        }
        if other {
            said.other.push(name.to_owned());
        }
    };
    for ((name, held), new) in NAMES.iter().zip(flight.columns_mut()).zip(part.columns()).skip(1) {
        take(name, held, new);
    }
    if let Some(new) = &part.speed_m_s {
        take("speed", flight.speed_m_s.get_or_insert_with(|| vec![f64::NAN; rows]), new);
    }
    for (name, new) in &part.extra {
        take(name, flight.extra.entry(name.clone()).or_insert_with(|| vec![f64::NAN; rows]), new);
    }
    said
}

/// The part without its first rows, its segments counted from 0 again; its times stay.
fn drop_first(part: &mut Imported, rows: usize) {
    let Some(first) = part.flight.segment.get(rows).copied().filter(|_| rows > 0) else { return };
    part.flight.remove(0..rows);
    part.flight.segment.iter_mut().for_each(|s| *s -= first);
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
