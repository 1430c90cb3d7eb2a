//! Which real flights there are, and the quiet calibrated vehicle file of each.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use discovery::diagnosis::{check_segments, prepared_problem};
use discovery::hypotheses::candidate::fit_named;
use discovery::hypotheses::identifiability::Identifiability;
use discovery::preprocess;
use discovery::workbench::add;
use hydro::effects::{Effect, by_name};
use logs::record::csv;
use logs::record::plausible::quantile;
use logs::{Flight, import, vehicle};
use serde::Deserialize;
use serde_json::{Value, json};

/// Vehicle files of real flights that come with the program.
const BUILT_IN_FILES: [(&str, &str); 2] =
    [("comet", include_str!("../../../../vehicles/comet.toml")), ("modena", include_str!("../../../../vehicles/modena.toml"))];

/// Who may look at a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// While the tool is made.
    Development,
    /// Nobody who sets a threshold.
    Judging,
}

impl Split {
    /// Name in documents.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Development => "development",
            Self::Judging => "judging",
        }
    }
}

/// One flight of the data file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name.
    pub name: String,
    /// Path below the folder of flights.
    pub path: PathBuf,
    /// Vehicle file that calibration starts from.
    pub vehicle: String,
    /// Whether the hull volume is first set to mass / median density.
    #[serde(default)]
    pub neutral: bool,
    /// Effects that the calibration adds.
    #[serde(default)]
    pub with: Vec<String>,
    /// Flight whose calibration is used.
    pub calibrate_on: Option<String>,
    /// Who may look at it.
    pub split: Split,
    /// In the bounded subset of the tests.
    #[serde(default)]
    pub quick: bool,
}

/// Shares below which a scorecard fails.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Floors {
    /// Of scored injected errors that are named in class.
    pub named: f64,
    /// Of untouched flights, clocks and pressure zeros that are quiet.
    pub quiet: f64,
    /// Of intervals of exactly named injected errors that hold the truth.
    #[serde(default)]
    pub interval: f64,
}

/// What is known of a vehicle file as it is shipped.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shipped {
    /// Flight.
    pub flight: String,
    /// Effect that must be named.
    pub effect: String,
    /// Its parameter and the range that the told interval must meet.
    #[serde(default)]
    pub parameter: String,
    /// Lower end.
    #[serde(default)]
    pub low: f64,
    /// Upper end.
    #[serde(default)]
    pub high: f64,
    /// Or the compressibility that the interval must hold, 1/dbar.
    pub compressibility_per_dbar: Option<f64>,
    /// What the vehicle's own file states, where import takes the class's instead, 1/dbar.
    pub stated_per_dbar: Option<f64>,
}

/// The data file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Data {
    /// Standard deviations from which an effect is shown.
    pub shown_sigma: f64,
    /// Longest diagnosis, s.
    pub limit_s: f64,
    /// What is to be reached.
    pub goal: Floors,
    /// Floors by split, and of the bounded subset.
    pub floors: std::collections::BTreeMap<String, Floors>,
    /// Flights.
    pub flight: Vec<Entry>,
    /// Files as shipped.
    #[serde(default)]
    pub shipped: Vec<Shipped>,
}

impl Data {
    /// The data file that comes with the program.
    ///
    /// # Errors
    /// What is wrong in it.
    pub fn built_in() -> anyhow::Result<Self> {
        toml::from_str(include_str!("flights.toml")).context("the list of real flights")
    }

    /// The entry of a name.
    ///
    /// # Errors
    /// No such flight.
    pub fn entry(&self, name: &str) -> anyhow::Result<&Entry> {
        self.flight.iter().find(|e| e.name == name).with_context(|| format!("no flight `{name}` in the list of real flights"))
    }
}

/// A flight of the list as it is on disk, and the vehicle file it starts from.
///
/// # Errors
/// The file that cannot be read, or no vehicle file.
pub fn load(root: &Path, entry: &Entry) -> anyhow::Result<(Flight, Value)> {
    let path = root.join(&entry.path);
    let (mut flight, imported) = if path.extension().is_some_and(|e| e == "csv") {
        (csv::flight(&path)?, None)
    } else {
        let imported = import::import(&path, &[])?;
        let vehicle = imported.vehicle.as_ref().map(|v| toml::from_str(&v.toml())).transpose()?;
        (imported.flight, vehicle)
    };
    flight.name.clone_from(&entry.name);
    let mut document: Value = match BUILT_IN_FILES.iter().find(|b| b.0 == entry.vehicle) {
        Some((name, text)) => toml::from_str(text).with_context(|| format!("{name}.toml"))?,
        None if entry.vehicle == "imported" => {
            imported.with_context(|| format!("{}: the importer makes no vehicle file of it", path.display()))?
        }
        None => bail!("{}: no vehicle file `{}`", entry.name, entry.vehicle),
    };
    if entry.neutral {
        let (mass, density) = (document["mass_kg"].as_f64().unwrap_or(f64::NAN), quantile(&flight.density_kg_m3, 0.5));
        document["hull_volume_m3"] = json!(mass / density);
    }
    Ok((flight, document))
}

/// A calibrated vehicle file: the numbers refitted to the dives that may be fitted, tolerances narrowed to what that leaves uncertain.
///
/// # Errors
/// Nothing in the flight to fit, or an effect of no name.
pub fn calibrated(flight: &Flight, document: &Value, with: &[String]) -> anyhow::Result<Value> {
    let text = format!("{document:#}");
    let vehicle = vehicle::parse(document.clone(), Path::new("vehicle.json"))?;
    let effect = |name: &String| by_name(name).with_context(|| format!("no effect `{name}`"));
    let effects = with.iter().map(effect).collect::<anyhow::Result<Vec<&'static Effect>>>()?;
    Ok(add::add(flight, &vehicle, &effects, text.as_bytes())?.vehicle)
}

/// What a flight is expected to show with a calibrated vehicle file.
///
/// # Errors
/// Nothing in the flight to fit.
pub fn expected(flight: &Flight, document: &Value) -> anyhow::Result<Identifiability> {
    let vehicle = vehicle::parse(document.clone(), Path::new("vehicle.json"))?;
    let prepared = preprocess::prepare(flight, &vehicle);
    let mut notes = Vec::new();
    let check = check_segments(&vehicle, &prepared, &mut notes);
    let (problem, _) = prepared_problem(flight, &vehicle, &prepared, &check, &mut notes)?;
    let (null, _) = fit_named(&problem, &[]);
    let error = problem.fitted_error_m_s(&prepared, &null.state);
    Identifiability::of(&problem, &null, error).context("the curvature of the fit is not positive")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_reads_and_every_calibration_is_of_a_flight_in_it() {
        let data = Data::built_in().expect("reads");
        for e in &data.flight {
            assert!(e.calibrate_on.iter().all(|n| data.entry(n).is_ok()), "{}", e.name);
            assert!(e.with.iter().all(|n| by_name(n).is_some()), "{}", e.name);
            assert!(e.vehicle == "imported" || BUILT_IN_FILES.iter().any(|b| b.0 == e.vehicle), "{}", e.name);
        }
        assert!(data.shipped.iter().all(|s| data.entry(&s.flight).is_ok() && by_name(&s.effect).is_some()));
        assert!(["development", "judging", "quick"].iter().all(|s| data.floors.contains_key(*s)));
        assert!(data.flight.iter().any(|e| e.quick && e.split == Split::Development));
    }
}
