//! Effects of the water's own motion.

use super::{Effect, Parameter, SeenIn};
use core::f64::consts::PI;

/// Vertical structure of mode `n` (1, 2, …) at `depth_m` in water of `water_depth_m`: sin(n π z/H), zero at surface and bottom.
#[must_use]
pub fn vertical_mode(n: u32, depth_m: f64, water_depth_m: f64) -> f64 {
    if !(water_depth_m > 0.0) {
        return 0.0;
    }
    libm::sin(f64::from(n) * PI * (depth_m / water_depth_m).clamp(0.0, 1.0))
}

/// The first mode with its peak moved: sin πs (1 + c cos πs) over its own maximum, s = z/H; above mid-depth for c > 0, |c| < 1.
fn skewed_mode(c: f64, depth_m: f64, water_depth_m: f64) -> f64 {
    let shape = vertical_mode(1, depth_m, water_depth_m) + 0.5 * c * vertical_mode(2, depth_m, water_depth_m);
    // Where the slope vanishes: cos x + c cos 2x = 0, without the cancellation of its textbook root.
    let cos = 2.0 * c / (1.0 + libm::sqrt(1.0 + 8.0 * c * c));
    shape / (libm::sqrt(1.0 - cos * cos) * (1.0 + c * cos))
}

/// Name of the effect whose amplitudes are free in every dive: a fit keeps them apart from the parameters.
pub const WAVE: &str = "internal_wave";

/// Vertical water motion A sin(2π t/T + phase) sin(n π z/H). The phase is one per segment.
pub static INTERNAL_WAVE: Effect = Effect {
    name: WAVE,
    physics: "an internal wave lifts and lowers the water with a period of tens of minutes, whatever the vehicle does",
    separated_by: "several dives in a row at one place: it has its own clock",
    parameters: &[
        Parameter::new("amplitude_m_s", "m/s", 0.0, (0.0, 0.2), 0.01, "1-3 cm/s on shelves"),
        Parameter::new("period_s", "s", 1200.0, (240.0, 7200.0), 900.0, "between buoyancy and inertial period; tens of minutes"),
        Parameter::new("mode", "1", 1.0, (1.0, 3.0), 1.0, "low modes carry the energy"),
    ],
    seen_in: SeenIn::Waves,
    water_up_m_s: Some(&|p, at| {
        let mode = if p[2] < 1.5 { 1 } else { 2 };
        p[0] * libm::sin(2.0 * PI * at.time_s / p[1] + at.phase_rad) * vertical_mode(mode, at.depth_m, at.water_depth_m)
    }),
    ..Effect::NONE
};

/// Steady vertical water motion, up positive, velocity sin(π z/H).
pub static VERTICAL_CURRENT: Effect = Effect {
    name: "vertical_current",
    physics: "the water itself rises or sinks steadily at mid depth, so dives and climbs shift by the same velocity",
    separated_by: "legs at several speeds: the shift in vertical velocity stays the same; another day or place",
    parameters: &[
        Parameter::new("velocity_m_s", "m/s", 0.0, (-0.1, 0.1), 0.008, "upwelling below 1 mm/s, convection and lee slopes 1-5 cm/s"),
        Parameter::new("shallowness", "1", 0.0, (-0.8, 0.8), 0.3, "peak between 0.34 and 0.66 of the water depth; guess"),
    ],
    water_up_m_s: Some(&|p, at| p[0] * skewed_mode(p[1], at.depth_m, at.water_depth_m)),
    ..Effect::NONE
};

/// A steady horizontal current: speed and the direction it flows to (clockwise from north).
pub static HORIZONTAL_CURRENT: Effect = Effect {
    name: "horizontal_current",
    physics: "the water carries the glider sideways: GPS displacement differs from the way through the water by the same vector per hour",
    separated_by: "GPS fixes on legs with different headings; vertical velocity does not feel it",
    parameters: &[
        Parameter::new("speed_m_s", "m/s", 0.0, (0.0, 1.5), 0.05, "2-50 cm/s"),
        Parameter::new("direction_rad", "rad", 0.0, (-7.0, 7.0), 3.0, "any; clockwise from north, towards"),
    ],
    seen_in: SeenIn::Displacement,
    current_m_s: Some(&|p| (p[0] * libm::sin(p[1]), p[0] * libm::cos(p[1]))),
    ..Effect::NONE
};

#[cfg(test)]
mod tests {
    use super::skewed_mode;

    #[test]
    fn a_skewed_mode_peaks_at_one_and_vanishes_at_surface_and_bottom() {
        for c in [-0.8, -0.3, 0.0, 0.3, 0.8] {
            let at = |i: i32| skewed_mode(c, 0.1 * f64::from(i), 100.0);
            let (peak, where_) = (0..=1000).map(|i| (at(i), i)).fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a });
            // 0.1 m of 100 m misses the maximum by (π 0.0005)² / 2 times the curvature, which is at most 4.
            assert!((peak - 1.0).abs() < 1e-5, "{c}: {peak}");
            assert!(at(0).abs() < 1e-12 && at(1000).abs() < 1e-12);
            assert!((where_ - 500) as f64 * c <= 0.0, "{c}: peak at {where_}");
        }
    }
}
