//! The vehicle of an imported flight: of the files, of its class, or of the flight itself.

use std::path::Path;

use super::classes::Class;
use super::draft::Draft;
use super::report::VEHICLE_JSON;
use super::{Imported, lift_drag, trim};
use crate::record::plausible::quantile;

/// States it: what the files say, else the class's usual numbers, and the hull volume checked against the flight.
pub(super) fn state(imported: &mut Imported, usual: fn(f64) -> Class, class: Option<Class>) {
    if class.is_some() {
        imported.vehicle_file = None;
    }
    match imported.vehicle_file.as_ref().map(|text| crate::vehicle::parse_text(text, Path::new(VEHICLE_JSON))) {
        Some(Ok(_)) => {
            imported.report.note_of_vehicle("the file holds that of its export, with its effects".into());
            return;
        }
        Some(Err(e)) => {
            imported.vehicle_file = None;
            imported.report.leave_out(format!("vehicle of the export: {e}"));
        }
        None => {}
    }
    let deepest_dbar = quantile(&imported.flight.pressure_pa, 1.0) * 1e-4;
    let draft = first(imported, usual, class, deepest_dbar);
    let flight = &imported.flight;
    let number = |key: &str| draft.get(key).unwrap_or(0.0);
    let hull = trim::Hull {
        mass_kg: number("mass_kg"),
        compressibility_per_pa: number("hull_compressibility_per_pa"),
        expansion_per_k: number("hull_thermal_expansion_per_k"),
        reference_degc: number("reference_temperature_degc"),
    };
    let trim = trim::find(flight, hull);
    let (mut draft, said) = lift_drag::decided(draft, flight, hull, trim.map(|t| t.hull_volume_m3));
    let stated = draft.get("hull_volume_m3");
    said.into_iter().for_each(|what| imported.report.note_of_vehicle(what));
    match (trim, stated) {
        (Some(found), None) => {
            draft.set("hull_volume_m3", found.hull_volume_m3, "from the flight: rises and sinks where it does");
            draft.set("tolerance_1sigma.trim_volume_cc", (found.sigma_m3 * 1e6).max(TRIM_CC), "of the volume found");
            imported.report.note_of_vehicle(format!(
                "hull volume from the flight {:.2} l, +- {:.0} cc for a mass of {} kg",
                found.hull_volume_m3 * 1e3,
                (found.sigma_m3 * 1e6).max(TRIM_CC),
                hull.mass_kg
            ));
        }
        (Some(found), Some(stated)) => {
            let off_cc = (found.hull_volume_m3 - stated) * 1e6;
            let floats = |volume: f64| hull.mass_kg / volume;
            let sigma_cc = draft.get("tolerance_1sigma.trim_volume_cc").unwrap_or(TRIM_CC).hypot(found.sigma_m3 * 1e6);
            if off_cc.abs() > 3.0 * sigma_cc {
                draft.set("hull_volume_m3", found.hull_volume_m3, &format!("from the flight; the files say {stated:.6}"));
                imported.report.note_of_vehicle(format!(
                    "as stated it floats at {:.1} kg/m3, the flight shows {:.1}: hull volume set to {:.2} l, +- {:.0} cc",
                    floats(stated),
                    floats(found.hull_volume_m3),
                    found.hull_volume_m3 * 1e3,
                    sigma_cc
                ));
            } else {
                imported.report.note_of_vehicle(format!("the flight shows {off_cc:+.0} cc of trim against the stated hull volume"));
            }
        }
        (None, stated) => {
            let water = quantile(&flight.density_kg_m3, 0.5);
            let water = if water.is_finite() { water } else { 1025.0 };
            if stated.is_none() {
                draft.set("hull_volume_m3", hull.mass_kg / water, "guess: neutral at ballast 0 in the middle of the water");
                draft.set("tolerance_1sigma.trim_volume_cc", 200.0, "guess");
                imported.report.note_of_vehicle(
                    "no steady dives and climbs to find the hull volume from; set to float in this water, +- 200 cc".into(),
                );
            }
        }
    }
    imported.vehicle = Some(draft);
}

/// Numbers to begin with: of the class that is named, else of the files, else of the class that the kind and depth of the log suggest.
fn first(imported: &mut Imported, usual: fn(f64) -> Class, class: Option<Class>, deepest_dbar: f64) -> Draft {
    match (class, imported.vehicle.take()) {
        (None, Some(draft)) => draft,
        (Some(class), stated) => {
            if stated.is_some() {
                imported.report.note_of_vehicle(format!("numbers of the files give way to those of the class {}, as named", class.name()));
            }
            class.draft()
        }
        (None, None) => {
            let class = usual(deepest_dbar);
            imported
                .report
                .note_of_vehicle(format!("the files do not state it; usual numbers of the class {} with wide tolerances", class.name()));
            class.draft()
        }
    }
}

/// Least tolerance of a hull volume found from a flight, cm³: what currents and the drag's unlike sides leave open.
const TRIM_CC: f64 = 50.0;
