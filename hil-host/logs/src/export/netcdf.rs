//! Writes a flight as NetCDF-4 in the OceanGliders format OG1.0, which our own import and the community's checker read.
//!
//! Times are Unix times; a flight without a date counts from zero and says so. Positions between fixes are interpolated. Names of
//! the OG1 vocabulary where it has one, else the column's name in capitals, with the name of the flight format in `long_name`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use netcdf_writer::{DimensionId, NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions, VariableId};

use crate::import::calendar::compact_date;
use crate::import::netcdf::own::{COLUMN, FIRST, MODEL, UNDATED, VEHICLE};
use crate::import::{Origin, assembly, position};
use crate::record::flight::Flight;
use crate::record::seawater;

/// The one dimension.
const ROWS_DIMENSION: &str = "N_MEASUREMENTS";
/// "No value", of times and of all else.
const NO_TIME: f64 = -1.0;
const NO_VALUE: f64 = -9999.9;
const EPOCH: &str = "seconds since 1970-01-01T00:00:00Z";
const VOCABULARY: &str = "http://vocab.nerc.ac.uk/collection/OG1/current/";

/// What the flight does not carry itself.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Unix time of the start of the flight, from which its times count, s.
    pub start_unix_s: Option<f64>,
    /// Where the segments' planes lie on the globe.
    pub origins: Vec<Origin>,
    /// Global attributes and string variables that people know: `contributor_name`, `PLATFORM_MODEL`, `WMO_IDENTIFIER` …
    pub stated: BTreeMap<String, String>,
    /// Series of the model, on the rows of the flight: name, unit, what it is, values.
    pub series: Vec<Series>,
    /// Numbers of the vehicle: name, value, unit, 1-sigma uncertainty, what it is.
    pub vehicle: Vec<Number>,
    /// The vehicle file as JSON: an import of ours takes it back.
    pub vehicle_file: Option<String>,
    /// When this is written, Unix time, s.
    pub written_unix_s: f64,
}

/// One column of the model.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the file.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub what: &'static str,
    /// One value a row, NaN for none.
    pub values: Vec<f64>,
}

/// One number of the vehicle.
#[derive(Clone, Debug)]
pub struct Number {
    /// Name in the file.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub what: &'static str,
    /// Value.
    pub value: f64,
    /// 1 sigma, NaN if it is not known.
    pub sigma: f64,
}

/// Why nothing was written.
#[derive(Debug)]
#[non_exhaustive]
pub enum NetcdfError {
    /// A name, attribute or value that the format does not allow.
    Format(String),
    /// The file cannot be written.
    Write(std::io::Error),
}

impl std::fmt::Display for NetcdfError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Format(e) => write!(f, "NetCDF: {e}"),
            Self::Write(e) => write!(f, "{e}"),
        }
    }
}

impl std::error::Error for NetcdfError {}

impl From<netcdf_writer::Error> for NetcdfError {
    fn from(e: netcdf_writer::Error) -> Self {
        Self::Format(e.to_string())
    }
}

impl From<std::io::Error> for NetcdfError {
    fn from(e: std::io::Error) -> Self {
        Self::Write(e)
    }
}

/// Of nine: higher ones take many times as long for a few percent.
const DEFLATE_LEVEL: u8 = 4;

/// Writes `flight`; `start_unix_s` dates it, without it time counts from zero and says so.
///
/// # Errors
/// What the writer says.
pub fn write(flight: &Flight, path: &Path, about: &About) -> Result<(), NetcdfError> {
    let mut out = Out { file: NcFileBuilder::new(), rows: None, taken: BTreeSet::from(["PSAL".into()]) };
    let rows = out.file.add_unlimited_dimension(ROWS_DIMENSION)?;
    out.rows = Some(rows);
    let start = about.start_unix_s.unwrap_or(0.0);
    let time: Vec<f64> = flight.time_s.iter().map(|t| t + start).collect();
    out.globals(flight, about, &time)?;
    out.time("TIME", "TIME", "time of measurement", &time, about)?;
    let positions = Positions::of(flight, &about.origins, &time);
    out.positions(&positions, &time, about)?;
    let depth: Vec<f64> = flight.pressure_pa.iter().map(|p| seawater::depth_m(*p, positions.middle_lat)).collect();
    out.column("DEPTH", "m", "glider depth", Some("depth"), Some("DEPTH"), &depth, &[("positive", "down"), ("axis", "Z")])?;
    out.segments(flight)?;
    let (extra, named): (Vec<_>, Vec<_>) = super::columns(flight).into_iter().partition(|c| flight.extra.contains_key(c.name));
    for c in named {
        out.column(c.og1, c.unit, c.name, known(c.og1).0, known(c.og1).1, &c.converted().collect::<Vec<_>>(), &[(COLUMN, c.name)])?;
    }
    for s in &about.series {
        out.column(s.name, s.unit, s.what, None, None, &s.values, &[("flight_model", MODEL)])?;
    }
    out.strings(flight, about, &positions, &time)?;
    for n in &about.vehicle {
        let variable = out.variable(n.name, &[])?;
        out.says(variable, &[("long_name", n.what), ("units", n.unit), ("flight_model", MODEL)])?;
        if n.sigma.is_finite() {
            out.file.add_variable_attribute(variable, "uncertainty", NcAttrValue::Doubles(vec![n.sigma]))?;
        }
        out.file.write_variable(variable, &[n.value])?;
    }
    // Last: their names are the source's and give way.
    for c in extra {
        let (name, unit) = if c.name == assembly::SALINITY_COLUMN { ("PSAL".to_owned(), "1") } else { (out.free(safe(c.og1)), c.unit) };
        out.column(&name, unit, c.name, known(&name).0, known(&name).1, &c.converted().collect::<Vec<_>>(), &[(COLUMN, c.name)])?;
    }
    let (_, bytes) = out.file.to_vec(NcWriteOptions { format: NcWriteFormat::Nc4 })?;
    Ok(std::fs::write(path, bytes)?)
}

struct Out {
    file: NcFileBuilder,
    rows: Option<DimensionId>,
    /// Names of the variables.
    taken: BTreeSet<String>,
}

impl Out {
    /// A name that no variable has: this one, or with a number.
    fn free(&self, name: String) -> String {
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        std::iter::once(name.clone()).chain(numbered).find(|n| !self.taken.contains(n)).unwrap_or(name)
    }

    /// A variable of numbers.
    fn variable(&mut self, name: &str, dimensions: &[DimensionId]) -> Result<VariableId, NetcdfError> {
        self.taken.insert(name.to_owned());
        let variable = self.file.add_variable::<f64>(name, dimensions)?;
        self.packed(variable, dimensions)?;
        Ok(variable)
    }

    /// Deflated in chunks of a megabyte, as every reader of NetCDF-4 knows it; a single number is not.
    fn packed(&mut self, variable: VariableId, dimensions: &[DimensionId]) -> Result<(), NetcdfError> {
        if !dimensions.is_empty() {
            self.file.set_variable_deflate(variable, Some(DEFLATE_LEVEL), true)?;
        }
        Ok(())
    }

    fn says(&mut self, variable: VariableId, texts: &[(&str, &str)]) -> Result<(), NetcdfError> {
        for (name, text) in texts {
            self.file.add_variable_attribute(variable, *name, NcAttrValue::Chars((*text).to_owned()))?;
        }
        Ok(())
    }

    fn globals(&mut self, flight: &Flight, about: &About, time: &[f64]) -> Result<(), NetcdfError> {
        let date = |t: f64| if about.start_unix_s.is_some() { compact_date(t) } else { "unknown".into() };
        let written = compact_date(about.written_unix_s);
        let (first, last) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
        let stated = |key: &str, otherwise: &str| about.stated.get(key).cloned().unwrap_or_else(|| otherwise.to_owned());
        let program = concat!("glider ", env!("CARGO_PKG_VERSION"));
        let comment = if about.start_unix_s.is_some() {
            "one flight, times in UTC"
        } else {
            "the date of this flight is not known: times count from its start"
        };
        let attributes = [
            ("title", stated("title", &format!("Flight {}", flight.name))),
            ("platform", "sub-surface gliders".into()),
            ("platform_vocabulary", "http://vocab.nerc.ac.uk/collection/L06/current/27/".into()),
            ("id", stated("id", &format!("{}_{}_delayed", serial(flight, about), date(first)))),
            ("comment", stated("comment", comment)),
            ("contributor_name", stated("contributor_name", "unknown")),
            ("contributor_email", stated("contributor_email", "unknown")),
            ("contributor_role", stated("contributor_role", "principal investigator")),
            ("contributor_role_vocabulary", "http://vocab.nerc.ac.uk/search_nvs/W08/".into()),
            ("contributing_institutions", stated("contributing_institutions", "unknown")),
            ("contributing_institutions_role", stated("contributing_institutions_role", "operating agency")),
            ("contributing_institutions_role_vocabulary", "http://vocab.nerc.ac.uk/collection/W08/current/".into()),
            ("institution", stated("contributing_institutions", "unknown")),
            ("source", stated("source", program)),
            ("references", stated("references", "none")),
            ("history", format!("{written} written by {program}")),
            ("rtqc_method", stated("rtqc_method", "No QC applied")),
            ("start_date", date(first)),
            ("time_coverage_start", date(first)),
            ("time_coverage_end", date(last)),
            ("date_created", written),
            ("featureType", "trajectory".into()),
            ("Conventions", "CF-1.10, ACDD-1.3, OG-1.0".into()),
        ];
        for (name, text) in attributes {
            self.file.add_attribute(name, NcAttrValue::Chars(text))?;
        }
        Ok(())
    }

    fn time(&mut self, name: &str, vocabulary: &str, what: &str, values: &[f64], about: &About) -> Result<(), NetcdfError> {
        let rows: Vec<DimensionId> = self.rows.into_iter().collect();
        let variable = self.variable(name, &rows)?;
        self.file.set_variable_fill_value(variable, NO_TIME)?;
        self.says(variable, &[("long_name", what), ("standard_name", "time"), ("units", EPOCH), ("calendar", "gregorian")])?;
        if name == "TIME" {
            self.says(variable, &[("axis", "T")])?;
            let first = values.first().map_or(0.0, |t| t - about.start_unix_s.unwrap_or(0.0));
            if first != 0.0 {
                self.file.add_variable_attribute(variable, FIRST, NcAttrValue::Doubles(vec![first]))?;
            }
        }
        self.says(variable, &[("vocabulary", &format!("{VOCABULARY}{vocabulary}/"))])?;
        if about.start_unix_s.is_none() {
            self.says(variable, &[("comment", UNDATED)])?;
        }
        let values: Vec<f64> = values.iter().map(|v| if v.is_finite() { *v } else { NO_TIME }).collect();
        Ok(self.file.write_variable(variable, &values)?)
    }

    #[allow(clippy::too_many_arguments)]
    fn column(
        &mut self,
        name: &str,
        unit: &str,
        what: &str,
        standard: Option<&str>,
        vocabulary: Option<&str>,
        values: &[f64],
        more: &[(&str, &str)],
    ) -> Result<(), NetcdfError> {
        let rows: Vec<DimensionId> = self.rows.into_iter().collect();
        let variable = self.variable(name, &rows)?;
        self.file.set_variable_fill_value(variable, NO_VALUE)?;
        self.says(variable, &[("long_name", what)])?;
        if let Some(standard) = standard {
            self.says(variable, &[("standard_name", standard)])?;
        }
        // A number without a unit that is known has none, in the words of UDUNITS.
        self.says(variable, &[("units", if unit.is_empty() { "1" } else { unit })])?;
        if let Some(vocabulary) = vocabulary {
            self.says(variable, &[("vocabulary", &format!("{VOCABULARY}{vocabulary}/"))])?;
        }
        if !["LATITUDE", "LONGITUDE", "DEPTH"].contains(&name) && !name.ends_with("_GPS") {
            self.says(variable, &[("coordinates", "TIME LATITUDE LONGITUDE DEPTH")])?;
        }
        self.says(variable, more)?;
        let values: Vec<f64> = values.iter().map(|v| if v.is_finite() { *v } else { NO_VALUE }).collect();
        Ok(self.file.write_variable(variable, &values)?)
    }

    fn positions(&mut self, p: &Positions, time: &[f64], about: &About) -> Result<(), NetcdfError> {
        let lat = "latitude of each measurement and GPS location";
        let lon = "longitude of each measurement and GPS location";
        self.column("LATITUDE", "degrees_north", lat, Some("latitude"), Some("LAT"), &p.lat, &[("axis", "Y")])?;
        self.column("LONGITUDE", "degrees_east", lon, Some("longitude"), Some("LON"), &p.lon, &[("axis", "X")])?;
        let fixed: Vec<f64> = time.iter().zip(&p.lat_gps).map(|(t, v)| if v.is_finite() { *t } else { f64::NAN }).collect();
        self.time("TIME_GPS", "TIME_GPS", "time of each GPS location", &fixed, about)?;
        self.column("LATITUDE_GPS", "degrees_north", "latitude of each GPS location", Some("latitude"), Some("LAT_GPS"), &p.lat_gps, &[])?;
        self.column("LONGITUDE_GPS", "degrees_east", "longitude of each GPS location", Some("longitude"), Some("LON_GPS"), &p.lon_gps, &[])
    }

    fn segments(&mut self, flight: &Flight) -> Result<(), NetcdfError> {
        let rows: Vec<DimensionId> = self.rows.into_iter().collect();
        self.taken.insert("SEGMENT_NUMBER".into());
        let variable = self.file.add_variable::<i32>("SEGMENT_NUMBER", &rows)?;
        self.packed(variable, &rows)?;
        self.file.set_variable_fill_value(variable, -1_i32)?;
        self.says(variable, &[("long_name", "number of the segment from one surfacing to the next"), ("units", "1")])?;
        self.says(variable, &[("coordinates", "TIME LATITUDE LONGITUDE DEPTH")])?;
        let values: Vec<i32> = flight.segment.iter().map(|s| i32::try_from(*s).unwrap_or(i32::MAX)).collect();
        Ok(self.file.write_variable(variable, &values)?)
    }

    /// Who flew, where it began, and by which model.
    fn strings(&mut self, flight: &Flight, about: &About, p: &Positions, time: &[f64]) -> Result<(), NetcdfError> {
        let stated = |key: &str, otherwise: String| about.stated.get(key).cloned().unwrap_or(otherwise);
        let serial = serial(flight, about);
        let trajectory = format!("{serial}_{}", about.start_unix_s.map_or_else(|| "undated".into(), compact_date));
        let texts = [
            ("TRAJECTORY", stated("TRAJECTORY", trajectory), "trajectory name"),
            ("WMO_IDENTIFIER", stated("WMO_IDENTIFIER", "unknown".into()), "WMO id"),
            ("PLATFORM_MODEL", stated("PLATFORM_MODEL", "unknown".into()), "model of the glider"),
            ("PLATFORM_SERIAL_NUMBER", serial, "glider serial number"),
            (MODEL, stated(MODEL, "steady and unsteady glide, lift and drag on the reference area".into()), "model of the flight"),
        ];
        for (name, text, what) in texts {
            self.taken.insert(name.into());
            let variable = self.file.add_string_variable(name, &[])?;
            self.says(variable, &[("long_name", what)])?;
            if name == "TRAJECTORY" {
                self.says(variable, &[("cf_role", "trajectory_id")])?;
            }
            if name == "PLATFORM_MODEL" {
                self.says(variable, &[("platform_model_vocabulary", "http://vocab.nerc.ac.uk/collection/B76/current/")])?;
            }
            if name == MODEL {
                self.says(variable, &[("software_version", env!("CARGO_PKG_VERSION"))])?;
                self.says(variable, about.vehicle_file.as_deref().map(|text| (VEHICLE, text)).as_slice())?;
            }
            self.file.write_string_variable(variable, &[text])?;
        }
        let first = |v: &[f64]| v.iter().copied().find(|v| v.is_finite());
        for (name, unit, what, standard, vocabulary, value) in [
            (
                "DEPLOYMENT_TIME",
                EPOCH,
                "date of deployment",
                "time",
                "DEPLOYMENT_TIME",
                time.first().copied().filter(|_| about.start_unix_s.is_some()),
            ),
            ("DEPLOYMENT_LATITUDE", "degrees_north", "latitude of deployment", "latitude", "DEPLOYMENT_LATITUDE", first(&p.lat_gps)),
            ("DEPLOYMENT_LONGITUDE", "degrees_east", "longitude of deployment", "longitude", "DEPLOYMENT_LONGITUDE", first(&p.lon_gps)),
        ] {
            let fill = if name == "DEPLOYMENT_TIME" { NO_TIME } else { NO_VALUE };
            let variable = self.variable(name, &[])?;
            self.file.set_variable_fill_value(variable, fill)?;
            self.says(variable, &[("long_name", what), ("standard_name", standard), ("units", unit)])?;
            self.says(variable, &[("vocabulary", &format!("{VOCABULARY}{vocabulary}/"))])?;
            if name == "DEPLOYMENT_TIME" {
                self.says(variable, &[("calendar", "gregorian")])?;
            }
            self.file.write_variable(variable, &[value.unwrap_or(fill)])?;
        }
        Ok(())
    }
}

/// Where the rows are, degrees; NaN where that is not known.
#[derive(Clone, Debug)]
pub struct Positions {
    /// Of all rows: between fixes on the straight line, before the first and after the last there.
    pub lat: Vec<f64>,
    /// The same.
    pub lon: Vec<f64>,
    /// Of fixes alone.
    pub lat_gps: Vec<f64>,
    /// The same.
    pub lon_gps: Vec<f64>,
    /// A latitude for the depth: of the first fix, 45 without one.
    pub middle_lat: f64,
}

impl Positions {
    /// From the fixes of a flight at the times of its rows.
    #[must_use]
    pub fn of(flight: &Flight, origins: &[Origin], time: &[f64]) -> Self {
        let fixes: Vec<Option<position::Fix>> = (0..flight.len()).map(|i| position::on_the_globe(flight, origins, i)).collect();
        let column = |of: fn(&position::Fix) -> f64| fixes.iter().map(|f| f.as_ref().map_or(f64::NAN, of)).collect::<Vec<f64>>();
        let (lat_gps, lon_gps) = (column(|f| f.lat_deg), column(|f| f.lon_deg));
        let between = |values: &[f64]| -> Vec<f64> {
            let known: Vec<(f64, f64)> = time.iter().copied().zip(values.iter().copied()).filter(|(_, v)| v.is_finite()).collect();
            time.iter()
                .map(|t| {
                    let k = known.partition_point(|f| f.0 <= *t);
                    match (k.checked_sub(1).and_then(|k| known.get(k)), known.get(k)) {
                        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0),
                        (Some(one), None) | (None, Some(one)) => one.1,
                        (None, None) => f64::NAN,
                    }
                })
                .collect()
        };
        let middle_lat = lat_gps.iter().copied().find(|v| v.is_finite()).unwrap_or(45.0);
        Self { lat: between(&lat_gps), lon: between(&lon_gps), lat_gps, lon_gps, middle_lat }
    }
}

/// Serial number of the platform: stated, else the flight's name.
fn serial(flight: &Flight, about: &About) -> String {
    about.stated.get("PLATFORM_SERIAL_NUMBER").cloned().unwrap_or_else(|| format!("unit_{}", safe(&flight.name).to_lowercase()))
}

/// Name in the CF standard name table and in the OG1 vocabulary, where it has them.
fn known(og1: &str) -> (Option<&'static str>, Option<&'static str>) {
    match og1 {
        "PRES" => (Some("sea_water_pressure"), Some("PRES")),
        "TEMP" => (Some("sea_water_temperature"), Some("TEMP")),
        "PSAL" => (Some("sea_water_practical_salinity"), Some("PSAL")),
        "DENSITY" => (Some("sea_water_density"), Some("DENSITY")),
        "PITCH" => (Some("platform_pitch"), Some("PITCH")),
        "ROLL" => (Some("platform_roll"), Some("ROLL")),
        "HEADING" => (Some("platform_orientation"), Some("HEADING")),
        _ => (None, None),
    }
}

/// A name in capitals that NetCDF and OG1 accept.
fn safe(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c.to_ascii_uppercase() } else { '_' }).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("X_{name}") }
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
        write(&flight, &path, &About { start_unix_s: Some(1.7e9), ..About::default() }).expect("written");
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
