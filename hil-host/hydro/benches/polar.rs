//! How long does a polar over 4,000 angles take with every effect of the catalogue on? Aim: below 1 ms.
//!
//! `cargo bench -p hydro`. The room is `no_std` without `alloc`: nothing in here can allocate.

use hydro::drag::{DragRule, Layer};
use hydro::effects::{Active, CATALOGUE};
use hydro::interference::CarryOver;
use hydro::wing::{Separation, SlopeLaw, Wing, WingModel};
use hydro::{Added, Appendage, Constants, Flow, ForceModel, Geometry, Polar, body::Body};
use std::hint::black_box;
use std::time::Instant;

const ANGLES: u32 = 4000;

fn slocum() -> Geometry {
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
            sweep_half_chord_rad: std::f64::consts::FRAC_PI_4,
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
}

fn main() {
    let base = slocum().polar();
    let bare = Constants {
        gravity_m_s2: 9.81,
        mass_kg: 70.0,
        hull_volume_m3: 0.0696,
        compressibility_per_pa: 5e-10,
        thermal_expansion_per_k: 5e-5,
        reference_temperature_degc: 10.0,
        reference_area_m2: 0.1,
        lift_slope_per_rad: 0.0,
        lift_quadratic_per_rad2: 0.0,
        cd0: 0.0,
        induced_k: 0.0,
        hull_drag_per_rad2: 0.0,
        added_mass_surge: 0.2,
        added_mass_heave: 0.92,
    };
    let (constants, _, _) = base.project(&bare);
    let all: Vec<Active> = CATALOGUE
        .iter()
        .map(|e| {
            let p = e.parameters()[0];
            Active::sized(*e, if p.off + p.typical <= p.high { p.off + p.typical } else { p.off - p.typical })
        })
        .collect();
    let polar = Added { base, with: ForceModel::new(constants, &all), without: ForceModel::new(constants, &[]) };
    let mut runs: Vec<f64> = (0..200)
        .map(|_| {
            let begin = Instant::now();
            for i in 0..ANGLES {
                let alpha = 0.7 * (f64::from(i) / f64::from(ANGLES) - 0.5);
                black_box(polar.force(black_box(&Flow::steady(alpha, 0.3))));
            }
            begin.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    runs.sort_by(f64::total_cmp);
    println!(
        "{ANGLES} angles, {} effects on: median {:.3} ms, fastest {:.3} ms, slowest {:.3} ms (aim: below 1 ms)",
        all.len(),
        runs[runs.len() / 2],
        runs[0],
        runs[runs.len() - 1]
    );
}
