//! Segments in which a channel cannot be in the unit it claims, where the other segments can: they do not refuse the flight.

use std::collections::BTreeMap;
use std::ops::Range;

use super::assembly::SALINITY_COLUMN;
use super::{Imported, position};
use crate::record::flight::Flight;
use crate::record::plausible::{implausible, quantile};

/// A shorter segment says too little of its channels' sizes, rows (guess).
const LEAST_ROWS_OF_A_SEGMENT: usize = 50;
/// As many channels as one segment may lose.
const MOST_LOST_CHANNELS: usize = 8;

/// Names of the columns of a flight, in their order, as [`implausible`] is to call them; the pressure first.
const COLUMN_NAMES: [&str; 8] = ["pressure", "pitch", "roll", "heading", "ballast", "battery position", "temperature", "density"];

/// Rows of segments, and why each is bad.
type Bad = Vec<(Range<usize>, String)>;

/// Takes out of single segments what cannot be: a channel's values, or the rows where it is the pressure. Where that is as wrong in half
/// of the rows it is the unit of the file, and nothing is changed.
///
/// # Errors
/// Times that do not increase.
pub(super) fn leave_out(imported: &mut Imported) -> Result<(), String> {
    if !imported.flight.time_s.windows(2).all(|w| w[1] > w[0]) {
        return Err("its times do not increase from row to row (a clock of damage?)".into());
    }
    let segments = position::segments(&imported.flight);
    if segments.len() < 2 {
        return Ok(());
    }
    // By channel: the segments' rows, and why.
    let mut found: BTreeMap<String, Bad> = BTreeMap::new();
    for rows in segments.iter().filter(|rows| rows.len() >= LEAST_ROWS_OF_A_SEGMENT) {
        let mut part = imported.flight.part(rows.clone());
        for _ in 0..MOST_LOST_CHANNELS {
            let Some((column, why)) = implausible(&part, [COLUMN_NAMES[0], COLUMN_NAMES[1], COLUMN_NAMES[4], COLUMN_NAMES[7]]) else {
                break;
            };
            blank(&mut part, &column, 0..rows.len());
            found.entry(column).or_default().push((rows.clone(), why));
        }
    }
    let all = imported.flight.len();
    found.entry(COLUMN_NAMES[7].to_owned()).or_default().extend(other_salinity(&imported.flight, &segments).unwrap_or_default());
    found.retain(|_, bad| 2 * bad.iter().map(|(rows, _)| rows.len()).sum::<usize>() < all);
    let mut out: Vec<Range<usize>> = Vec::new();
    for (column, bad) in found {
        for (rows, why) in bad {
            let segment = imported.flight.segment[rows.start];
            let count = rows.len();
            if column == COLUMN_NAMES[0] {
                imported.report.leave_out(format!("segment {segment}: {column} {why}: its {count} rows are left out"));
                out.push(rows);
            } else {
                imported.report.leave_out(format!("segment {segment}: {column} {why}: left out there"));
                blank(&mut imported.flight, &column, rows);
            }
        }
    }
    out.sort_by_key(|rows| std::cmp::Reverse(rows.start));
    out.into_iter().for_each(|rows| imported.flight.remove(rows));
    Ok(())
}

/// The water of one mission differs by less (guess: a conductivity in another unit is off by ten).
const OTHER_WATER_FACTOR: f64 = 5.0;

/// Segments whose salinity is another than that of the usual segment by so much.
fn other_salinity(flight: &Flight, segments: &[Range<usize>]) -> Option<Bad> {
    let salinity = flight.extra.get(SALINITY_COLUMN)?;
    let middles: Vec<f64> = segments.iter().map(|rows| quantile(&salinity[rows.clone()], 0.5)).collect();
    let usual = quantile(&middles, 0.5);
    let is_other = |middle: f64| middle > OTHER_WATER_FACTOR * usual || middle * OTHER_WATER_FACTOR < usual;
    let why =
        |middle: f64| format!("comes from a salinity of {middle:.2}, that of the others is {usual:.2}: conductivity in another unit?");
    let bad = segments.iter().cloned().zip(middles).filter(|(_, middle)| is_other(*middle)).map(|(rows, middle)| (rows, why(middle)));
    Some(bad.collect())
}

/// A channel without values in some rows; without a temperature there is no density.
fn blank(flight: &mut Flight, column: &str, rows: Range<usize>) {
    let with = |name: &str| name == column || (name == "density" && column == "temperature");
    let columns = COLUMN_NAMES.iter().zip(flight.columns_mut()).filter(|(name, _)| with(name)).map(|(_, values)| values);
    columns.for_each(|values| values[rows.clone()].fill(f64::NAN));
    if let Some(speed) = flight.speed_m_s.as_mut().filter(|_| column == "speed") {
        speed[rows].fill(f64::NAN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::Report;

    /// Four dives to 40 dbar, 100 rows each.
    fn made() -> Imported {
        let mut f = Flight::blank(400);
        for i in 0..400_usize {
            (f.time_s[i], f.segment[i]) = (4.0 * i as f64, (i / 100) as u32);
            f.pressure_pa[i] = 4e5 - 8e3 * ((i % 100) as f64 - 50.0).abs();
            f.pitch_rad[i] = if i % 100 < 50 { -0.45 } else { 0.45 };
            (f.temperature_degc[i], f.density_kg_m3[i]) = (10.0, 1024.0);
        }
        Imported::new(f, Report::new("made"))
    }

    #[test]
    fn regress_one_bad_segment_does_not_refuse_the_flight() {
        let mut good = made();
        leave_out(&mut good).expect("rows in order");
        assert!(good.flight.len() == 400 && good.report.left_out.is_empty(), "{:?}", good.report.left_out);
        let mut fast = made();
        fast.flight.pressure_pa[200..300].iter_mut().for_each(|p| *p *= 14.5);
        leave_out(&mut fast).expect("rows in order");
        assert_eq!((fast.flight.len(), fast.flight.segment[200]), (300, 3));
        assert!(fast.report.left_out[0].contains("segment 2: pressure changes by"), "{:?}", fast.report.left_out);
        let mut warm = made();
        warm.flight.pitch_rad[100..200].iter_mut().for_each(|p| *p *= 57.3);
        warm.flight.temperature_degc[100..200].fill(283.0);
        leave_out(&mut warm).expect("rows in order");
        let f = &warm.flight;
        assert!(
            f.len() == 400 && [&f.pitch_rad, &f.temperature_degc, &f.density_kg_m3].iter().all(|c| c[150].is_nan() && c[250].is_finite())
        );
        assert_eq!(warm.report.left_out.len(), 2, "{:?}", warm.report.left_out);
        let mut salty = made();
        salty.flight.extra.insert(SALINITY_COLUMN.into(), (0..400).map(|i| if i < 100 { 2.3 } else { 33.1 }).collect());
        leave_out(&mut salty).expect("rows in order");
        assert!(salty.flight.density_kg_m3[50].is_nan() && salty.flight.density_kg_m3[150].is_finite() && salty.flight.len() == 400);
        assert!(salty.report.left_out[0].contains("segment 0: density comes from a salinity of 2.30"), "{:?}", salty.report.left_out);
        // In half of the rows it is the file's unit.
        let mut unit = made();
        unit.flight.pitch_rad[..200].iter_mut().for_each(|p| *p *= 57.3);
        leave_out(&mut unit).expect("rows in order");
        assert!(unit.report.left_out.is_empty() && unit.flight.pitch_rad[0].is_finite());
    }
}
