//! Steady lift and drag of the true vehicle, for judges that need the whole polar.

use super::World;

/// Speed at which drag that depends on speed is taken, m/s (what a Slocum glides at).
const POLAR_SPEED_M_S: f64 = 0.30;

impl World {
    /// Lift and drag areas (C_L S, C_D S, m²) at an angle of attack, rad: effects and faults of now included, fin and turn straight.
    #[must_use]
    pub fn lift_drag_area_m2(&self, alpha_rad: f64) -> (f64, f64) {
        let i = self.inputs();
        let (s, c) = alpha_rad.sin_cos();
        let rho = 1000.0;
        let f = self.body.law.forces(rho, POLAR_SPEED_M_S * c, POLAR_SPEED_M_S * s, i.drag_factor, 0.0, i.wing_share);
        let dynamic = 0.5 * rho * POLAR_SPEED_M_S * POLAR_SPEED_M_S;
        ((f.x_n * s - f.z_n * c) / dynamic, -(f.x_n * c + f.z_n * s) / dynamic)
    }
}
