//! Numbers as short as a screen needs: five significant digits, gaps as null.

use serde::{Serializer, ser::SerializeSeq};

/// Two digits: a shade.
pub fn rows<S: Serializer>(rows: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    let shade = |v: &f64| if v.is_finite() { Some((v * 100.0).round() / 100.0) } else { None };
    serializer.collect_seq(rows.iter().map(|row| row.iter().map(shade).collect::<Vec<_>>()))
}

/// Eight digits: a time axis must tell rows of a 30-day log apart.
pub fn long<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    rounded(values, 8, serializer)
}

pub fn columns<S: Serializer>(columns: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    let short = |v: &f64| v.is_finite().then(|| (v * 1e4).round() / 1e4);
    serializer.collect_seq(columns.iter().map(|c| c.iter().map(short).collect::<Vec<_>>()))
}

pub fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    rounded(values, 5, serializer)
}

fn rounded<S: Serializer>(values: &[f64], digits: i32, serializer: S) -> Result<S::Ok, S::Error> {
    let mut seq = serializer.serialize_seq(Some(values.len()))?;
    for &v in values {
        if !v.is_finite() {
            seq.serialize_element(&None::<f64>)?;
            continue;
        }
        let places = if v == 0.0 { 0 } else { digits - v.abs().log10().ceil() as i32 };
        let scale = 10f64.powi(places.clamp(-12, 12));
        let rounded = (v * scale).round() / scale;
        if rounded == rounded.trunc() && rounded.abs() < 1e15 {
            seq.serialize_element(&(rounded as i64))?;
        } else {
            seq.serialize_element(&rounded)?;
        }
    }
    seq.end()
}
