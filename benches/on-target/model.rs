//! Slocum with standard wings as it glides at sea, for the alternative in which the board evaluates the whole model
//! instead of its table. The numbers are those of vehicles/slocum-standard-sea.toml.

use hydro::body::Body;
use hydro::drag::{DragRule, Layer};
use hydro::interference::CarryOver;
use hydro::wing::{Separation, SlopeLaw, Wing, WingModel};
use hydro::{Appendage, Geometry, GeometryPolar};

/// The vehicle with what does not depend on the angle of attack worked out.
pub fn polar() -> GeometryPolar {
    Geometry {
        reference_area_m2: 0.1,
        body: Body {
            length_m: 1.5,
            diameter_m: 0.213,
            wetted_area_m2: 0.9,
            planform_area_m2: 0.28,
            potential_area_m2: 0.021,
            munk_factor: 0.9,
            crossflow_eta: 0.652,
            crossflow_cd: 1.15,
            layer: Layer::Laminar,
            reynolds: 3e5,
        },
        wing: Wing {
            aspect_ratio: 5.536,
            panel_span_m: 0.4935,
            chord_m: 0.0891,
            area_m2: 0.088,
            sweep_half_chord_rad: core::f32::consts::FRAC_PI_4,
            section_slope_per_rad: 6.188,
            slope_law: SlopeLaw::LowryPolhamus,
            model: WingModel::LiftingLine(Separation { alpha_rad: 0.2164, width_rad: 0.0436, broadside_cn: 1.2 }),
            oswald_e: 0.85,
            drag_rule: DragRule::Parabolic,
            layer: Layer::Laminar,
            reynolds: 2e4,
            form_factor: 1.0,
        },
        carry_over: CarryOver { share: 1.0, body_radius_m: 0.1065, semispan_m: 0.6 },
        appendage: Appendage { drag_area_m2: 0.0117, crossflow_drag_area_m2: 0.6, normal_area_per_rad_m2: 0.29 },
    }
    .polar()
}
