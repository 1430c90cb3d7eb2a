//! Numbers of a file that belong to the whole of it, such as the constants of its vehicle; and speed through the water.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use netcdf_reader::{NcFile, NcType, NcVariable};

use super::super::Imported;
use super::super::calendar::digits;
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

/// Global attributes that name the vehicle, not the dive or the file.
const VEHICLE_ATTRIBUTES: [&str; 7] =
    ["glider_serial", "glider_name", "platform_code", "wmo_id", "wmo_platform_code", "wmo_identifier", "platform_serial_number"];
/// Where names of deployments stand.
pub(super) const TRAJECTORY: &str = "trajectory";

/// The name of a dataset, in which the glider's stands before a date; else it may be of the file alone.
const ID: &str = "id";

/// "unit_777" of "unit_777-20260501T0000": what stands before the date, without a number that counts files ("ru29_0012-2026…"). None where
/// no glider's name can be read from it.
fn glider_of(id: &str) -> Option<&str> {
    let is_date = |text: &str| text.get(..8).is_some_and(|day| digits(&format!("{day}000000")).is_some());
    let at = id.match_indices(SEPARATORS).map(|m| m.0).find(|at| is_date(&id[at + 1..]))?;
    let name = &id[..at];
    let lower = name.to_ascii_lowercase();
    let of_file = ["profile", "dive", "segment", "cast", "part", "file", "yo"].iter().any(|w| lower.contains(w));
    let base = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = &name[base.len()..];
    let counts = base.ends_with(SEPARATORS) && (number.starts_with('0') || base.bytes().any(|b| b.is_ascii_digit()));
    let name = if counts { base.trim_end_matches(SEPARATORS) } else { name };
    (!of_file && number.len() < 5 && name.bytes().any(|b| b.is_ascii_alphabetic())).then_some(name)
}

const SEPARATORS: [char; 3] = ['-', '_', '.'];

/// Which deployments and vehicles files say they are of: names by where they stand.
#[derive(Clone, Debug, Default)]
pub struct Identity(BTreeMap<&'static str, BTreeSet<String>>);

impl Identity {
    /// What one file says.
    #[must_use]
    pub fn of(file: &NcFile) -> Self {
        let mut out = Self::default();
        let mut add = |key: &'static str, text: &str| {
            let text = text.trim_matches(['\0', ' ']);
            if !text.is_empty() {
                out.add(key, text.to_owned());
            }
        };
        for v in file.variables().unwrap_or_default() {
            let role = v.attribute("cf_role").and_then(|a| a.value.as_string()).unwrap_or_default();
            let named = role.trim() == "trajectory_id" || v.name().eq_ignore_ascii_case(TRAJECTORY);
            if !named || v.num_elements().is_ok_and(|n| n > 1_000_000) {
                continue;
            }
            let texts = file.read_variable_as_strings(v.name());
            let numbers = || file.read_variable_as_f64(v.name()).map(|n| n.iter().map(f64::to_string).collect());
            texts.or_else(|_| numbers()).unwrap_or_default().iter().for_each(|t| add(TRAJECTORY, t));
        }
        for name in VEHICLE_ATTRIBUTES {
            let text = file.global_attribute(name).ok().map(|a| a.value.as_string().or_else(|| a.value.as_f64().map(|v| v.to_string())));
            add(name, &text.flatten().unwrap_or_default());
        }
        let id = file.global_attribute(ID).ok().and_then(|a| a.value.as_string()).unwrap_or_default();
        add(ID, glider_of(&id).unwrap_or_default());
        out
    }

    /// The same of a file by its path; nothing of one that cannot be read.
    #[must_use]
    pub fn of_path(path: &Path) -> Self {
        super::open(path).map_or_else(|_| Self::default(), |file| Self::of(&file))
    }

    /// Adds what another file says.
    pub fn join(&mut self, other: Self) {
        other.0.into_iter().for_each(|(key, names)| names.into_iter().for_each(|name| self.add(key, name)));
    }

    /// A name in other letters' case is the same one.
    fn add(&mut self, key: &'static str, name: String) {
        let names = self.0.entry(key).or_default();
        if !names.iter().any(|n| n.eq_ignore_ascii_case(&name)) {
            names.insert(name);
        }
    }

    /// How many trajectories a file holds in a dimension of that name, where some variable has it and another one.
    #[must_use]
    pub fn trajectories(file: &NcFile) -> u64 {
        let long = |v: &NcVariable| v.dimensions().iter().filter(|d| d.size > 1).count() > 1;
        let of = |v: &NcVariable| v.dimensions().iter().find(|d| d.name.eq_ignore_ascii_case(TRAJECTORY)).map_or(1, |d| d.size);
        // Names of one trajectory are a table of characters.
        let numbers = |v: &&NcVariable| !matches!(v.dtype(), NcType::Char | NcType::String);
        file.variables().unwrap_or_default().iter().filter(numbers).filter(|v| long(v)).map(of).max().unwrap_or(1)
    }

    /// Why these are not of one flight of one vehicle.
    #[must_use]
    pub fn mixed(&self) -> Option<String> {
        let (key, names) = self.0.iter().find(|(_, names)| names.len() > 1)?;
        let list = names.iter().take(6).cloned().collect::<Vec<_>>().join(", ");
        let what = if *key == TRAJECTORY { "deployments" } else { "gliders" };
        Some(format!("of {} {what} ({key}: {list}): import one at a time", names.len()))
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_names_of_another_case_are_of_one_deployment() {
        let of = |name: &str| {
            let mut one = Identity::default();
            one.add(TRAJECTORY, name.into());
            one
        };
        let mut all = of("unit_777-20260502T0915");
        all.join(of("UNIT_777-20260502t0915"));
        assert_eq!(all.mixed(), None);
        all.join(of("unit_778-20260502T0915"));
        assert!(all.mixed().is_some_and(|why| why.contains("2 deployments")));
    }

    #[test]
    fn regress_an_id_names_its_glider_before_the_date_only() {
        for (id, name) in [
            ("unit_777-20260501T0000", Some("unit_777")),
            ("unit_777_20260502T092614Z_rt", Some("unit_777")),
            ("ru29-20150623T1046", Some("ru29")),
            ("dfo-eva035-20190718", Some("dfo-eva035")),
            ("ru29_0012-20150623", Some("ru29")),
            ("ru29_12-20150623", Some("ru29")),
            ("unit_012-20150623", Some("unit")),
            ("p1710003_20130101", None),
            ("profile_7-20150623", None),
            ("20150623T1046_ru29", None),
            ("0012-20150623", None),
            ("unit_777", None),
            ("unit_777-99999999", None),
            ("", None),
        ] {
            assert_eq!(glider_of(id), name, "{id}");
        }
    }
}
