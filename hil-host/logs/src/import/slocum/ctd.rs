//! The CTD's samples of one Slocum file.

use super::clocks::{in_order, plausible_times};
use super::{Collected, LEAST_STAMPS, Loaded, STAMPS, sensor};
use crate::import::Report;
use crate::import::assembly::Row;
use crate::import::clocks::SET_CLOCK_S;
use crate::import::dbd::DbdFile;

/// Pressure, temperature, conductivity as the glider passes them on; else as an RBR CTD states them itself, its pressure above that of
/// the air first.
const SENSORS_OF_CTDS: [[&str; 3]; 3] = [
    ["sci_water_pressure", "sci_water_temp", "sci_water_cond"],
    ["sci_rbrctd_seapressure_00", "sci_rbrctd_temperature_00", "sci_rbrctd_conductivity_00"],
    ["sci_rbrctd_pressure_00", "sci_rbrctd_temperature_00", "sci_rbrctd_conductivity_00"],
];

/// The sensors whose pressure has values; none if there is no CTD in the file.
pub(super) fn sensors_of(file: &DbdFile) -> Option<[&'static str; 3]> {
    let known = |name: &str| file.columns.get(name).is_some_and(|c| c.1.iter().any(|v| v.is_finite()));
    SENSORS_OF_CTDS.into_iter().find(|names| known(names[0]))
}

/// The CTD's samples of one file, on the CTD's own clock where it was set.
pub(super) fn ctd_rows(all: &mut Collected, report: &mut Report, one: &Loaded, own: Vec<f64>) {
    let file = &one.file;
    let none = || vec![f64::NAN; file.cycles];
    let science = |name: &str| -> Vec<f64> {
        let read = file.columns.get(name).and_then(|(unit, v)| Some((sensor(name)?.in_si(unit)?, v)));
        read.map_or_else(none, |((offset, factor), v)| v.iter().map(|v| (v - offset) * factor).collect())
    };
    let Some(names) = sensors_of(file) else {
        let known = |name: &&&str| file.columns.get(**name).is_some_and(|c| c.1.iter().any(|v| v.is_finite() && *v != 0.0));
        if let Some(alone) = SENSORS_OF_CTDS.iter().flat_map(|names| &names[1..]).find(known) {
            report.leave_out(format!("{}: {alone} has values, the CTD's pressure none: there is no density without it", one.name));
        }
        return;
    };
    let [pressure, temperature, conductivity] = names.map(science);
    if names != SENSORS_OF_CTDS[0] {
        report.note(format!("{}: no sci_water_pressure: {} are taken", one.name, names.join(", ")));
    }
    let set = |name: &str| file.columns.get(name).is_some_and(|c| c.1.iter().filter(|t| **t > SET_CLOCK_S).count() >= LEAST_STAMPS);
    let stamp = match STAMPS.iter().find(|n| set(n)) {
        Some(name) => {
            let stamps = file.columns.get(*name).map_or_else(none, |(_, v)| v.clone());
            let unset = (0..file.cycles).filter(|k| stamps[*k] < SET_CLOCK_S && pressure[*k].is_finite() && pressure[*k] != 0.0).count();
            if unset > 0 {
                report.leave_out(format!("{}: {unset} samples of the CTD whose clock {name} was not set", one.name));
            }
            in_order(plausible_times(stamps), one, "the CTD's clock", report)
        }
        None => {
            let why = if STAMPS.iter().any(|n| file.columns.contains_key(*n)) { "was not set" } else { "is not in it" };
            report.note(format!("{}: the CTD's own clock {why}: its samples stand on the computer's", one.name));
            // Without it every cycle carries a sample; one like the one before is a copy.
            own
        }
    };
    let zero = |k: &usize| pressure[*k] == 0.0 && temperature[*k] == 0.0 && conductivity[*k] == 0.0;
    let known = (0..file.cycles).filter(|k| pressure[*k].is_finite()).count();
    if known > 1 && (0..file.cycles).filter(zero).count() == known {
        report.note(format!("{}: its {known} CTD samples are all zero: the CTD was off", one.name));
    }
    let lively = (0..file.cycles)
        .filter(|k| pressure[*k].is_finite() && !zero(k))
        .fold(None, |span: Option<(usize, usize)>, k| Some((span.map_or(k, |s| s.0), k)));
    let off = lively.map_or(0, |(first, last)| (first..last).filter(zero).count());
    if off > 0 {
        report.note(format!("{}: {off} CTD samples between others are zero throughout: the CTD was off, left out", one.name));
    }
    for k in 0..file.cycles {
        let time_s = stamp[k];
        // A CTD that has just been switched on reports zeros.
        let switched_on = pressure[k] != 0.0 || temperature[k] != 0.0 || conductivity[k] != 0.0;
        if time_s.is_finite() && pressure[k].is_finite() && switched_on {
            let row = Row::at(time_s, one.segment, pressure[k]);
            all.ctd.push(Row { temperature_degc: temperature[k], conductivity_s_m: conductivity[k], ..row });
        }
    }
}
