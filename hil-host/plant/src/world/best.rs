//! What the true vehicle could do at best, and bench figures a person would know of it.

use super::World;
use crate::ocean::GRAVITY_M_S2;

/// The true vehicle's best steady glide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BestGlide {
    /// |Angle of attack| of (L/D)max, rad.
    pub alpha_rad: f64,
    /// (L/D)max, the mean of dive and climb as a saw-tooth flies them (equal heights).
    pub l_over_d: f64,
}

/// Speed at which drag that depends on speed is taken, m/s (what a Slocum glides at).
const BEST_GLIDE_SPEED_M_S: f64 = 0.35;
/// Step of the search, rad: L/D at its flat top is right to 1e-5.
const STEP_RAD: f64 = 0.0005;

impl World {
    /// (L/D)max of the vehicle as it is now, effects and faults included, fin and turn straight.
    #[must_use]
    pub fn best_glide(&self) -> BestGlide {
        let i = self.inputs();
        let glide = |alpha: f64| {
            let (s, c) = alpha.sin_cos();
            let f = self.body.law.forces(1000.0, BEST_GLIDE_SPEED_M_S * c, BEST_GLIDE_SPEED_M_S * s, i.drag_factor, 0.0, i.wing_share);
            let drag = -(f.x_n * c + f.z_n * s);
            let lift = f.x_n * s - f.z_n * c;
            lift.abs() / drag
        };
        let mut best = BestGlide { alpha_rad: 0.0, l_over_d: 0.0 };
        let mut alpha_rad = STEP_RAD;
        while alpha_rad < 0.6 {
            let l_over_d = 0.5 * (glide(alpha_rad) + glide(-alpha_rad));
            if l_over_d > best.l_over_d {
                best = BestGlide { alpha_rad, l_over_d };
            }
            alpha_rad += STEP_RAD;
        }
        best
    }

    /// Displaced volume at zero gauge pressure, reference temperature and ballast 0, m³.
    #[must_use]
    pub const fn hull_volume_m3(&self) -> f64 {
        self.body.hull_volume_m3
    }

    /// Upward force on the whole vehicle at rest, N: at a depth of the undisturbed water whose density is off by
    /// `density_kg_m3`, with this ballast, and `load_kg` more on board than the vehicle has with its weight.
    #[must_use]
    pub fn upward_at_rest_n(&self, depth_m: f64, density_kg_m3: f64, ballast_m3: f64, load_kg: f64) -> f64 {
        let water = self.column.at(depth_m, 0.0);
        let volume = self.body.volume(water.pressure_pa, water.temperature) + ballast_m3;
        ((water.rho + density_kg_m3) * volume - self.scenario.vehicle.mass_kg - load_kg) * GRAVITY_M_S2
    }

    /// Density by which the vehicle computes depth from pressure, kg/m³.
    #[must_use]
    pub fn depth_density_kg_m3(&self) -> f64 {
        let v = &self.scenario.vehicle;
        self.scenario.sensors.depth_density_kg_m3.unwrap_or(v.mass_kg / self.body.hull_volume_m3)
    }
}
