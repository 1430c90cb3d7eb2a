//! A vehicle given by its geometry in the terms of the flight format.

use hydro::rectangular::SideEdge;
use hydro::wing::{Wing, WingModel};
use hydro::{Constants, Geometry};
use serde_json::{Value, json};

use crate::vehicle::Tolerance;
use crate::vehicle::file::VehicleFile;

impl VehicleFile {
    /// The vehicle in the terms of the flight format: the coefficients its geometry comes closest to.
    #[must_use]
    pub fn as_trial(&self) -> Value {
        let (c, g) = (&self.constants, &self.geometry);
        let part = g.polar().breakdown(1e-3);
        // The projected slope is split as the geometry splits it at small α.
        let total_slope = c.lift_slope_per_rad * c.reference_area_m2;
        let wing_slope = total_slope * part.wing_lift_share();
        let (slope_relative, quadratic_relative) = self.lift_tolerance();
        json!({
            "format": "glider-trial/1",
            "case": self.name,
            "made_from": {"geometry": self.path.display().to_string(), "coefficients": "least squares over |alpha| <= 0.35 rad"},
            "gravity_m_s2": c.gravity_m_s2,
            "mass_kg": c.mass_kg,
            "hull_volume_m3": c.hull_volume_m3,
            "hull_compressibility_per_pa": c.compressibility_per_pa,
            "hull_thermal_expansion_per_k": c.thermal_expansion_per_k,
            "reference_temperature_degc": c.reference_temperature_degc,
            "wing": {
                "name": if self.wings == "standard" { "standard" } else { "low_ar" },
                "aspect_ratio": g.wing.aspect_ratio,
                "area_m2": g.wing.area_m2,
                "sweep_deg": g.wing.sweep_half_chord_rad.to_degrees(),
            },
            "hydro": {
                "reference_area_m2": c.reference_area_m2,
                "wing_lift_slope_per_rad": wing_slope / g.wing.area_m2,
                "hull_lift_slope_per_rad": (total_slope - wing_slope) / c.reference_area_m2,
                "hull_area_m2": c.reference_area_m2,
                "lift_quadratic_per_rad2": c.lift_quadratic_per_rad2,
                "cd0": c.cd0,
                "induced_k": c.induced_k,
                "hull_drag_per_rad2": c.hull_drag_per_rad2,
                "added_mass_surge": c.added_mass_surge,
                "added_mass_heave": c.added_mass_heave,
            },
            "tolerance_1sigma": {"lift_slope_relative": slope_relative, "lift_quadratic_relative": quadratic_relative},
            (super::CURRENT_KEY): "unknown",
        })
    }

    /// 1-sigma tolerances of the linear and the quadratic lift, relative: those of a ballasted glider, and what the file's uncertainty of
    /// the side-edge vortices (K_v and onset) makes of the projected coefficients, in root sum of squares.
    #[must_use]
    pub fn lift_tolerance(&self) -> (f64, f64) {
        let usual = Tolerance::default();
        let (mut slope, mut quadratic) = (usual.lift_slope_relative, usual.lift_quadratic_relative);
        let WingModel::SideEdge(law) = self.geometry.wing.model else { return (slope, quadratic) };
        let sigma = |key: &str| self.quantities.iter().find(|q| q.key == key).map_or(0.0, |q| q.sigma);
        let with = |law: SideEdge| -> Constants {
            let wing = Wing { model: WingModel::SideEdge(law), ..self.geometry.wing };
            Geometry { wing, ..self.geometry }.polar().project(&self.constants).0
        };
        let nominal = with(law);
        for changed in [
            with(SideEdge { kv: law.kv + sigma("wing.side_edge.vortex_kv"), ..law }),
            // Later, so that a large sigma leaves an onset.
            with(SideEdge { onset_rad: law.onset_rad + sigma("wing.side_edge.onset_rad"), ..law }),
        ] {
            slope = slope.hypot(changed.lift_slope_per_rad / nominal.lift_slope_per_rad - 1.0);
            quadratic = quadratic.hypot(changed.lift_quadratic_per_rad2 / nominal.lift_quadratic_per_rad2 - 1.0);
        }
        (slope, quadratic)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    /// The rails' lift is an extrapolation: a fit may move it further than that of the calibrated standard wings.
    #[test]
    fn the_uncertain_vortex_of_the_rails_widens_the_tolerance_of_the_lift() {
        let of = |text| crate::vehicle::file::parse(text, Path::new("v.toml")).expect("reads");
        let rails = of(include_str!("../../../../vehicles/slocum-low-ar-sea.toml"));
        let standard = of(include_str!("../../../../vehicles/slocum-standard-sea.toml"));
        assert_eq!(standard.lift_tolerance(), (0.04, 0.05));
        let (slope, quadratic) = rails.lift_tolerance();
        println!("rails: slope {slope:.3}, quadratic {quadratic:.3}");
        assert!((0.04..0.5).contains(&slope) && (0.1..2.0).contains(&quadratic), "{slope} {quadratic}");
        let read = crate::vehicle::parse(rails.as_trial(), Path::new("v.toml")).expect("reads");
        assert_eq!((read.tolerance.lift_slope_relative, read.tolerance.lift_quadratic_relative), (slope, quadratic));
    }
}
