//! A csv of any origin: columns by name and unit, density recomputed where salinity is there.

use std::path::Path;

use super::{FileNote, ImportError, Imported, MappedName, Report};
use crate::record::csv;
use crate::record::flight::Flight;
use crate::record::seawater;

/// Salinity columns, best first: practical (PSS-78) or absolute (g/kg).
const PRACTICAL: [&str; 4] = ["SP_psu", "salinity", "PSAL", "practical_salinity"];
const ABSOLUTE: [&str; 2] = ["SA_g_kg", "absolute_salinity"];

/// Imports one file.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path) -> Result<Imported, ImportError> {
    let mut flight = csv::flight(path).map_err(|e| match e {
        csv::ReadError::File { path, why } => ImportError { file: path.display().to_string(), what: why },
        csv::ReadError::Content { path, line: 0, column, why } => {
            ImportError { file: path.display().to_string(), what: format!("{column}: {why}") }
        }
        csv::ReadError::Content { path, line, column, why } => {
            ImportError { file: format!("{}, line {line}", path.display()), what: format!("column {column}: {why}") }
        }
    })?;
    let mut report = Report { kind: "csv".into(), ..Report::default() };
    let header = std::fs::read_to_string(path).unwrap_or_default();
    let header: Vec<&str> = header.lines().find(|l| !l.starts_with('#')).unwrap_or("").split(',').map(str::trim).collect();
    let mut filled = Vec::new();
    for (name, channel, factor) in csv::NAMES {
        if !filled.contains(channel) && header.iter().any(|h| h.eq_ignore_ascii_case(name)) {
            filled.push(*channel);
            report.map(MappedName { from: (*name).into(), unit: "by its name".into(), to: format!("{channel:?}"), factor: *factor });
        }
    }
    recompute_density(&mut flight, &mut report);
    report.files.push(FileNote { file: path.display().to_string(), rows: flight.len(), problems: Vec::new() });
    Ok(Imported { flight, report })
}

fn recompute_density(flight: &mut Flight, report: &mut Report) {
    let of = |names: &[&str]| names.iter().find_map(|n| flight.extra.get(*n).map(|v| ((*n).to_owned(), v.clone())));
    let (name, absolute) = match (of(&ABSOLUTE), of(&PRACTICAL)) {
        (Some(found), _) => found,
        (None, Some((name, practical))) => (name, practical.iter().map(|sp| seawater::absolute_salinity(*sp, None)).collect()),
        (None, None) => {
            report.density = "as the file states it: there is no salinity column to recompute it from".into();
            return;
        }
    };
    report.density_from(&format!("{name}, temperature, pressure"), None, true);
    let mut largest = 0.0_f64;
    for (i, sa) in absolute.iter().enumerate() {
        let ours = seawater::density(*sa, flight.temperature_degc[i], flight.pressure_pa[i] * 1e-4);
        let change = (ours - flight.density_kg_m3[i]).abs();
        if change > largest {
            largest = change;
        }
        flight.density_kg_m3[i] = ours;
    }
    report.note(format!("density changed by at most {largest:.4} kg/m3 against the file's own"));
}
