//! Numbers of a file that belong to the whole of it, such as the constants of its vehicle; and speed through the water.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use netcdf_reader::NcFile;

use super::super::Imported;
use crate::record::resample::Series;

/// Numbers without dimension, by name.
#[derive(Clone, Debug, Default)]
pub struct Scalars {
    values: BTreeMap<String, f64>,
    names: BTreeSet<String>,
    /// When the file says it was changed last, as text.
    pub modified: String,
}

impl Scalars {
    /// Numbers by name, of another source than a NetCDF.
    #[must_use]
    pub fn from_values(values: BTreeMap<String, f64>) -> Self {
        Self { values, ..Self::default() }
    }

    /// The number called `name`.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied()
    }

    /// Whether the file has a variable called `name`.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.names.contains(name)
    }
}

/// Scalars of a file; none of one that cannot be read.
#[must_use]
pub fn scalars(path: &Path) -> Scalars {
    let mut out = Scalars::default();
    let Ok(file) = super::open(path) else { return out };
    let Ok(variables) = file.variables() else { return out };
    for v in variables {
        out.names.insert(v.name().to_owned());
        let constant = v.name().starts_with("sg_cal_") || v.name().starts_with("log_");
        if constant
            && v.dimensions().is_empty()
            && let Ok(value) = file.read_variable_as_f64(v.name())
            && let Some(value) = value.iter().next().filter(|v| v.is_finite())
        {
            out.values.insert(v.name().to_owned(), *value);
        }
    }
    out.modified = file.global_attribute("date_modified").ok().and_then(|a| a.value.as_string()).unwrap_or_default();
    out
}

/// Name of the deployment that the file says it is of.
#[must_use]
pub fn trajectory(path: &Path) -> Option<String> {
    let file = super::open(path).ok()?;
    let named = ["trajectory", "TRAJECTORY"].iter().find(|n| file.variable(n).is_ok_and(|v| v.num_elements().is_ok_and(|k| k < 1000)));
    let text = named.and_then(|n| file.read_variable_as_strings(n).ok()).map(|t| t.concat());
    text.map(|t| t.trim_matches(['\0', ' ']).to_owned()).filter(|t| !t.is_empty())
}

/// Speeds agree with the rate of depth to this, m/s, or the leg's are not used: an inverse solution errs by leg.
const AGREES_M_S: f64 = 0.03;

/// Speed through the water of the inverse solution of a Seaglider's current profiler, at the rows nearest in time, on the legs where
/// its vertical part agrees with the rate of depth. How many values there are.
pub fn speed_witness(path: &Path, part: &mut Imported) -> usize {
    let (Ok(file), Some(start)) = (super::open(path), part.report.start_unix_s) else { return 0 };
    let Some(velocity) = velocities(&file) else { return 0 };
    let flight = &mut part.flight;
    let depth: Vec<f64> = flight.pressure_pa.iter().map(|p| p * 1e-4 / 1.0098).collect();
    let depth = Series::new(&flight.time_s, &depth);
    let mut column = vec![f64::NAN; flight.len()];
    let mut legs: [Vec<(usize, f64, f64)>; 2] = Default::default();
    for (t, east, north, up) in velocity {
        let t = t - start;
        let rate = (depth.at(t + 30.0) - depth.at(t - 30.0)) / -60.0;
        let row = flight.time_s.partition_point(|s| *s < t).min(flight.len() - 1);
        let row = if row > 0 && t - flight.time_s[row - 1] < flight.time_s[row] - t { row - 1 } else { row };
        let speed = (east * east + north * north + up * up).sqrt();
        if rate.is_finite() && (flight.time_s[row] - t).abs() < 30.0 {
            legs[usize::from(rate > 0.0)].push((row, speed, up - rate));
        }
    }
    let mut used = 0;
    for (leg, name) in legs.iter().zip(["descent", "ascent"]) {
        let off = crate::record::plausible::quantile(&leg.iter().map(|l| l.2.abs()).collect::<Vec<_>>(), 0.5);
        if off <= AGREES_M_S {
            leg.iter().for_each(|(row, speed, _)| column[*row] = *speed);
            used += leg.len();
        } else if !leg.is_empty() {
            part.report
                .note(format!("speed of the current profiler on the {name} is {:.1} cm/s off the rate of depth: not used", 100.0 * off));
        }
    }
    if used > 0 {
        flight.speed_m_s = Some(column);
    }
    used
}

/// Time, east, north, up through the water.
fn velocities(file: &NcFile) -> Option<Vec<(f64, f64, f64, f64)>> {
    let column = |name: &str| {
        Some(file.read_variable_unpacked_masked(&format!("ad2cp_inv_glider_{name}")).ok()?.iter().copied().collect::<Vec<f64>>())
    };
    let [time, east, north, up] = ["time", "uttw", "vttw", "wttw"].map(column);
    let (time, east, north, up) = (time?, east?, north?, up?);
    let rows = time.iter().zip(&east).zip(north.iter().zip(&up)).map(|((t, e), (n, u))| (*t, *e, *n, *u));
    Some(rows.filter(|r| [r.0, r.1, r.2, r.3].iter().all(|v| v.is_finite() && v.abs() < 1e12)).collect())
}
