//! Flights written for others, and for ourselves.
//!
//! * [`csv`]: the project's own flight format.
//! * [`mcap`]: MCAP for viewers of robot logs.
//! * [`netcdf`]: NetCDF-4 in the OceanGliders format OG1.0.
//! * [`parquet`]: Parquet with the columns of the csv.
//! * [`table`]: Parquet of any table, and back.

use crate::record::flight::Flight;

pub mod csv;
#[cfg(test)]
mod import_tests;
pub mod mcap;
pub mod netcdf;
pub mod parquet;
pub mod table;

/// One column as others see it.
struct Column<'a> {
    /// Name in the flight format.
    name: &'a str,
    /// Name in NetCDF (OG1 vocabulary where it has one).
    og1: &'a str,
    /// Unit after the factor, as UDUNITS writes it; empty where nothing is known.
    unit: &'static str,
    values: &'a [f64],
    /// Factor from SI.
    factor: f64,
    /// Digits after the point: one decade below the resolution of a good sensor; none where the sensor is not known.
    digits: Option<usize>,
}

impl Column<'_> {
    /// Values in the column's unit.
    fn converted(&self) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().map(|v| v * self.factor)
    }
}

/// All columns of a flight with their names in the flight format and their units, time and segment first.
#[must_use]
pub fn named_columns(flight: &Flight) -> Vec<(String, String, Vec<f64>)> {
    let first = [
        ("time_s".to_owned(), "s".to_owned(), flight.time_s.clone()),
        ("segment".to_owned(), "1".to_owned(), flight.segment.iter().map(|s| f64::from(*s)).collect()),
    ];
    let rest = columns(flight).into_iter().map(|c| (c.name.to_owned(), c.unit.to_owned(), c.converted().collect()));
    first.into_iter().chain(rest).collect()
}

/// All columns but time and segment, named ones first.
fn columns(flight: &Flight) -> Vec<Column<'_>> {
    let column = |name, og1, unit, values, factor, digits| Column { name, og1, unit, values, factor, digits };
    let mut columns = vec![
        column("pressure_dbar", "PRES", "dbar", flight.pressure_pa.as_slice(), 1e-4, Some(4)),
        column("m_pitch_rad", "PITCH", "rad", &flight.pitch_rad, 1.0, Some(5)),
        column("m_roll_rad", "ROLL", "rad", &flight.roll_rad, 1.0, Some(5)),
        column("m_heading_rad", "HEADING", "rad", &flight.heading_rad, 1.0, Some(5)),
        column("m_ballast_pumped_cc", "BALLAST", "cm3", &flight.ballast_m3, 1e6, Some(3)),
        column("m_battpos_m", "BATTERY_POSITION", "m", &flight.battery_mass_m, 1.0, Some(6)),
        column("sci_water_temp_degC", "TEMP", "degree_Celsius", &flight.temperature_degc, 1.0, Some(4)),
        column("sci_density_kg_m3", "DENSITY", "kg m-3", &flight.density_kg_m3, 1.0, Some(5)),
        column("gps_east_m", "GPS_EAST", "m", &flight.gps_east_m, 1.0, Some(2)),
        column("gps_north_m", "GPS_NORTH", "m", &flight.gps_north_m, 1.0, Some(2)),
    ];
    if let Some(speed) = &flight.speed_m_s {
        columns.push(column("speed_water_m_s", "SPEED_WATER", "m s-1", speed, 1.0, Some(5)));
    }
    for (name, values) in &flight.extra {
        columns.push(column(name, name, "", values, 1.0, None));
    }
    columns
}
