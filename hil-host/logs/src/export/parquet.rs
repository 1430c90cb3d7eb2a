//! Writes a flight as Parquet: the csv's columns, doubles, null where there is no value.
//!
//! Uncompressed and without the Arrow layer, so that only the format itself is
//! compiled in; any Parquet reader opens it.

use std::io::Write;

use parquet::basic::{Repetition, Type as Physical};
use parquet::data_type::{DoubleType, Int32Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;

use super::table::{column, field, nullable, writer};
use crate::import::Origin;
use crate::record::flight::Flight;

/// Writes `flight`; `start_unix_s`, the Unix time of its first row, and the `origins` of its segments' planes stand in the metadata of
/// the file, where they are known.
///
/// # Errors
/// What the writer says.
pub fn write(flight: &Flight, out: impl Write + Send, start_unix_s: Option<f64>, origins: &[Origin]) -> Result<()> {
    let start = start_unix_s.map(|s| KeyValue::new("start_unix_s".into(), s.to_string()));
    let places = || serde_json::to_string(origins).map_err(|e| ParquetError::External(Box::new(e)));
    let places = if origins.is_empty() { None } else { Some(KeyValue::new("origins".into(), places()?)) };
    let columns = super::columns(flight);
    let mut fields = vec![
        field("time_s", Physical::DOUBLE, Repetition::REQUIRED, None)?,
        field("segment", Physical::INT32, Repetition::REQUIRED, None)?,
    ];
    for c in &columns {
        fields.push(field(c.name, Physical::DOUBLE, Repetition::OPTIONAL, None)?);
    }
    let mut writer = writer(out, "flight", fields, start.into_iter().chain(places).collect())?;
    let mut rows = writer.next_row_group()?;
    column::<DoubleType, _>(&mut rows, &flight.time_s, None)?;
    let segment: Vec<i32> = flight.segment.iter().map(|s| i32::try_from(*s).unwrap_or(i32::MAX)).collect();
    column::<Int32Type, _>(&mut rows, &segment, None)?;
    for c in &columns {
        nullable(&mut rows, c.converted())?;
    }
    rows.close()?;
    writer.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    #[test]
    fn another_reader_finds_values_and_nulls() {
        let flight = Flight {
            time_s: vec![0.0, 4.0],
            segment: vec![0, 1],
            pressure_pa: vec![1e4, f64::NAN],
            pitch_rad: vec![-0.4, 0.4],
            ..Flight::blank(2)
        };
        let mut bytes = Vec::new();
        write(&flight, &mut bytes, Some(1.7e9), &[]).expect("written");
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).expect("Parquet");
        let about = reader.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
        assert!(about.iter().any(|k| k.key == "start_unix_s" && k.value.as_deref() == Some("1700000000")));
        let rows: Vec<_> = reader.get_row_iter(None).expect("rows").map(|r| r.expect("a row")).collect();
        let get = |row: usize, name: &str| rows[row].get_column_iter().find(|(n, _)| *n == name).map(|(_, f)| f.clone());
        assert_eq!(get(1, "time_s"), Some(Field::Double(4.0)));
        assert_eq!(get(1, "segment"), Some(Field::Int(1)));
        assert_eq!(get(0, "pressure_dbar"), Some(Field::Double(1.0)));
        assert_eq!(get(1, "pressure_dbar"), Some(Field::Null));
        assert_eq!(get(0, "m_pitch_rad"), Some(Field::Double(-0.4)));
    }
}
