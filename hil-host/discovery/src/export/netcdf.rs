//! Writes a flight as NetCDF classic (64-bit offsets), one dimension, names of the OG1 vocabulary where it has one.

use std::path::Path;

use netcdf3::error::{InvalidDataSet, WriteError};
use netcdf3::{DataSet, FileWriter, Version};

use crate::record::flight::Flight;

/// The one dimension, as in OG1.
const ROWS: &str = "N_MEASUREMENTS";
/// "No value": NetCDF's own default fill for doubles (the writer cannot find a variable whose fill is NaN).
const FILL: f64 = 9.969_209_968_386_869e36;

/// Why nothing was written.
#[derive(Debug)]
#[non_exhaustive]
pub enum NetcdfError {
    /// A name or attribute that the format does not allow.
    Definition(String),
    /// The file cannot be written.
    Write(String),
}

impl std::fmt::Display for NetcdfError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Definition(e) => write!(f, "NetCDF does not allow {e}"),
            Self::Write(e) => write!(f, "NetCDF: {e}"),
        }
    }
}

impl std::error::Error for NetcdfError {}

impl From<InvalidDataSet> for NetcdfError {
    fn from(e: InvalidDataSet) -> Self {
        Self::Definition(format!("{e:?}"))
    }
}

impl From<WriteError> for NetcdfError {
    fn from(e: WriteError) -> Self {
        Self::Write(format!("{e:?}"))
    }
}

/// Writes `flight`; `start_unix_s` dates it, without it time counts from zero and says so.
///
/// # Errors
/// What the writer says.
pub fn write(flight: &Flight, path: &Path, start_unix_s: Option<f64>) -> Result<(), NetcdfError> {
    let columns = super::columns(flight);
    let mut set = DataSet::new();
    set.add_fixed_dim(ROWS, flight.len())?;
    set.add_global_attr_string("Conventions", "CF-1.8")?;
    set.add_global_attr_string("source", concat!("glider ", env!("CARGO_PKG_VERSION")))?;
    set.add_var_f64("TIME", &[ROWS])?;
    set.add_var_attr_string("TIME", "standard_name", "time")?;
    set.add_var_attr_string("TIME", "units", "seconds since 1970-01-01T00:00:00Z")?;
    if start_unix_s.is_none() {
        set.add_var_attr_string("TIME", "comment", "counted from the start of the flight: its date is not known")?;
    }
    set.add_var_i32("SEGMENT", &[ROWS])?;
    for c in &columns {
        let name = safe(c.og1);
        set.add_var_f64(&name, &[ROWS])?;
        set.add_var_attr_f64(&name, "_FillValue", vec![FILL])?;
        set.add_var_attr_string(&name, "long_name", c.name)?;
        set.add_var_attr_string(&name, "coordinates", "TIME")?;
        if let Some(standard) = standard_name(c.og1) {
            set.add_var_attr_string(&name, "standard_name", standard)?;
        }
        if !c.unit.is_empty() {
            set.add_var_attr_string(&name, "units", c.unit)?;
        }
    }
    let start = start_unix_s.unwrap_or(0.0);
    let time: Vec<f64> = flight.time_s.iter().map(|t| t + start).collect();
    let segment: Vec<i32> = flight.segment.iter().map(|s| i32::try_from(*s).unwrap_or(i32::MAX)).collect();
    let values: Vec<(String, Vec<f64>)> =
        columns.iter().map(|c| (safe(c.og1), c.converted().map(|v| if v.is_finite() { v } else { FILL }).collect())).collect();
    let mut file = FileWriter::open(path)?;
    file.set_def(&set, Version::Offset64Bit, 0)?;
    file.write_var_f64("TIME", &time)?;
    file.write_var_i32("SEGMENT", &segment)?;
    for (name, values) in &values {
        file.write_var_f64(name, values)?;
    }
    Ok(file.close()?)
}

/// Name in the CF standard name table, where it has one.
fn standard_name(og1: &str) -> Option<&'static str> {
    Some(match og1 {
        "PRES" => "sea_water_pressure_due_to_sea_water",
        "TEMP" => "sea_water_temperature",
        "DENSITY" => "sea_water_density",
        "PITCH" => "platform_pitch",
        "ROLL" => "platform_roll",
        "HEADING" => "platform_orientation",
        _ => return None,
    })
}

/// A name that NetCDF accepts.
fn safe(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_import_reads_our_export() {
        let n = 40;
        let column = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(f64::from(i))).collect::<Vec<_>>();
        let flight = Flight {
            time_s: column(&|i| 4.0 * i),
            pressure_pa: column(&|i| 1e4 * i),
            pitch_rad: column(&|i| -0.4 + 0.001 * i),
            heading_rad: column(&|i| 0.01 * i),
            ballast_m3: column(&|_| -2e-4),
            temperature_degc: column(&|i| 15.0 - 0.1 * i),
            density_kg_m3: column(&|i| 1025.0 + 0.01 * i),
            segment: (0..n as u32).map(|i| i / 15).collect(),
            gps_east_m: column(&|i| if i == 3.0 { 7.5 } else { f64::NAN }),
            gps_north_m: column(&|i| if i == 3.0 { -7.5 } else { f64::NAN }),
            ..Flight::blank(n as usize)
        };
        let folder = std::env::temp_dir().join(format!("glider-netcdf-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("flight.nc");
        write(&flight, &path, Some(1.7e9)).expect("written");
        let imported = crate::import::import(&path, &[]).expect("read");
        std::fs::remove_dir_all(&folder).expect("removed");
        assert_eq!(imported.report.start_unix_s, Some(1.7e9));
        let again = imported.flight;
        assert_eq!(again.time_s, flight.time_s);
        assert_eq!(again.segment, flight.segment);
        for (a, b) in again.gps_east_m.iter().chain(&again.gps_north_m).zip(flight.gps_east_m.iter().chain(&flight.gps_north_m)) {
            assert!(a == b || (a.is_nan() && b.is_nan()), "a fix stays at its row: {a} {b}");
        }
        for (a, b) in [
            (&again.pressure_pa, &flight.pressure_pa),
            (&again.pitch_rad, &flight.pitch_rad),
            (&again.heading_rad, &flight.heading_rad),
            (&again.ballast_m3, &flight.ballast_m3),
            (&again.temperature_degc, &flight.temperature_degc),
            (&again.density_kg_m3, &flight.density_kg_m3),
        ] {
            // Two conversions of unit and, for the heading, sine and arc tangent.
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs().max(1.0)));
        }
        assert!(again.roll_rad.iter().all(|v| v.is_nan()), "no value stays no value");
    }
}
