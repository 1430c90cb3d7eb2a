//! The vehicle that an OG1 file states in scalars, as our own export and the format's open proposals name them.

use super::super::classes::Class;
use super::super::draft::Draft;
use super::{NcFile, Report, numbers_of, scalar, text};

/// Name and unit in the file, key of the vehicle file, and the key of its tolerance with whether that is relative and its factor.
type Stated = (&'static str, &'static str, &'static str, Option<(&'static str, bool, f64)>);

const STATED_ATTRIBUTES: [Stated; 12] = [
    ("MASS", "kg", "mass_kg", None),
    ("GLIDER_MASS", "kg", "mass_kg", None),
    ("GLIDER_VOLUME", "m3", "hull_volume_m3", Some(("trim_volume_cc", false, 1e6))),
    ("GLIDER_COMPRESSIBILITY", "Pa-1", "hull_compressibility_per_pa", Some(("hull_compressibility_relative", true, 1.0))),
    ("GLIDER_THERMAL_EXPANSION", "K-1", "hull_thermal_expansion_per_k", Some(("hull_thermal_expansion_relative", true, 1.0))),
    ("GLIDER_REFERENCE_TEMPERATURE", "degree_Celsius", "reference_temperature_degc", None),
    ("GLIDER_REFERENCE_AREA", "m2", "hydro.reference_area_m2", None),
    ("GLIDER_LIFT_SLOPE", "rad-1", "hydro.hull_lift_slope_per_rad", Some(("lift_slope_relative", true, 1.0))),
    ("GLIDER_DRAG_ZERO_LIFT", "1", "hydro.cd0", Some(("cd0_relative", true, 1.0))),
    ("GLIDER_DRAG_QUADRATIC", "rad-2", "hydro.hull_drag_per_rad2", None),
    ("GLIDER_ADDED_MASS_SURGE", "1", "hydro.added_mass_surge", Some(("added_mass_surge", false, 1.0))),
    ("GLIDER_ADDED_MASS_HEAVE", "1", "hydro.added_mass_heave", Some(("added_mass_heave", false, 1.0))),
];

/// Numbers of a vehicle that are not enough to use.
const UNREAD: [&str; 2] = ["VOLMAX", "OIL_VOL"];

/// The vehicle by the numbers that the file states; none without its mass.
pub(super) fn stated_vehicle(file: &NcFile, report: &mut Report) -> Option<Draft> {
    let mut draft = Class::Unknown.draft();
    let mut names = Vec::new();
    for (name, unit, key, tolerance) in STATED_ATTRIBUTES {
        let Some(value) = scalar(file, name).filter(|v| v.is_finite()) else { continue };
        if text(file, name, "units").as_deref() != Some(unit) {
            report.leave_out(format!("{name} is not in {unit}: the vehicle's own number is not taken"));
            continue;
        }
        draft.set(key, value, name);
        if key == "hydro.reference_area_m2" {
            // All of the lift is in one slope on this area.
            draft.set("hydro.hull_area_m2", value, name);
        }
        let sigma = numbers_of(file, name, "uncertainty").and_then(|u| u.first().copied()).filter(|s| *s > 0.0);
        if let Some((sigma, (of, relative, factor))) = sigma.zip(tolerance) {
            let size = if relative { sigma / value.abs() } else { sigma * factor };
            draft.set(&format!("tolerance_1sigma.{of}"), size, &format!("uncertainty of {name}"));
        }
        names.push(name);
    }
    for name in UNREAD.into_iter().filter(|name| scalar(file, name).is_some()) {
        report.note_of_vehicle(format!("{name} is not read: at which reading of the pump it is the volume is not stated"));
    }
    (names.contains(&"GLIDER_MASS") || names.contains(&"MASS")).then(|| {
        report.note_of_vehicle(format!("of the file: {}; the rest are usual numbers with wide tolerances", names.join(", ")));
        draft
    })
}
