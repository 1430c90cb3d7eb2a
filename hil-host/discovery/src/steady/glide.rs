//! The steady glide: which vertical velocity follows from pitch, ballast and water?
//!
//! ```text
//! B  = g [ρ (V0 (1 − ε p + a_T (T − T_ref)) + v_b) − (m0 + dm)]     net buoyancy, N, up
//! α  = (Cd0 + Cd1 α²) / (a tan(θ + α))                              angle of attack, rad
//! U² = 2 B sin(θ + α) / (ρ S (Cd0 + Cd1 α²))                        speed through water, m/s
//! w  = U sin(θ + α)                                                 vertical velocity, m/s, up
//! ```
//! θ is the true pitch, nose up; here `θ = scale · measured + offset`. In this
//! module α has the sign of θ (the path is steeper than the hull), the opposite
//! of the flight-mechanics sign used elsewhere; only its size leaves the module.
//!
//! Source: L. Merckelbach, D. Smeed, G. Griffiths, "Vertical water velocities from
//! underwater gliders", J. Atmos. Oceanic Technol. 27 (2010) 547–563; the numbers
//! are those that the open package `gliderflight` starts from. Valid for
//! |θ| > 0.15 rad: below it the small-angle branch of α ends (stall).

use serde::Serialize;

/// g, m/s² (the value the published figures use).
pub const GRAVITY_M_S2: f64 = 9.81;
/// m0, mass in air, kg (data package of the Comet flight).
pub const MASS_KG: f64 = 70.0;
/// S, reference area, m² (`gliderflight` 1.2.1).
pub const AREA_M2: f64 = 0.1;
/// a, lift slope of wings and hull on S, 1/rad (`gliderflight` 1.2.1: 3.7343 of the wings, 3.8 of the hull).
pub const LIFT_SLOPE_PER_RAD: f64 = 7.5343;
/// Cd1, drag growth with α², 1/rad² on S (`gliderflight` 1.2.1).
pub const DRAG_PER_RAD2: f64 = 10.5;
/// Cd0, parasite drag on S, - (`gliderflight` 1.2.1).
pub const CD0: f64 = 0.15;

/// Everything the force balance needs to know about vehicle and sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GlideModel {
    /// Cd0, parasite drag on S, -.
    pub cd0: f64,
    /// dm, mass beyond neutral trim in water of `reference_density_kg_m3`, kg.
    pub trim_mass_kg: f64,
    /// ε, hull compressibility, 1/Pa.
    pub compressibility_per_pa: f64,
    /// a_T, hull thermal expansion, 1/K.
    pub thermal_expansion_per_k: f64,
    /// Pitch offset, rad, added to the scaled measured pitch.
    pub pitch_offset_rad: f64,
    /// Pitch scale: true pitch over measured pitch, -.
    pub pitch_scale: f64,
    /// a, lift slope on S, 1/rad.
    pub lift_slope_per_rad: f64,
    /// Cd1, drag growth with α² on S, 1/rad².
    pub drag_per_rad2: f64,
    /// ρ0, kg/m³: the hull volume is m0/ρ0.
    pub reference_density_kg_m3: f64,
    /// T_ref, °C: no thermal expansion here.
    pub reference_temperature_degc: f64,
    /// Whether ρ0 stands in for the measured density.
    pub constant_density: bool,
}

impl GlideModel {
    /// The starting point: published coefficients, nothing fitted, water of one density.
    #[must_use]
    pub fn nominal(reference_density_kg_m3: f64, reference_temperature_degc: f64) -> Self {
        Self {
            cd0: CD0,
            trim_mass_kg: 0.0,
            compressibility_per_pa: 0.0,
            thermal_expansion_per_k: 0.0,
            pitch_offset_rad: 0.0,
            pitch_scale: 1.0,
            lift_slope_per_rad: LIFT_SLOPE_PER_RAD,
            drag_per_rad2: DRAG_PER_RAD2,
            reference_density_kg_m3,
            reference_temperature_degc,
            constant_density: true,
        }
    }

    /// Steady motion for one sample; NaN where an input is missing.
    #[must_use]
    pub fn glide(&self, input: &Input) -> Glide {
        let density = if self.constant_density { self.reference_density_kg_m3 } else { input.density_kg_m3 };
        let hull_volume = MASS_KG / self.reference_density_kg_m3;
        // A flight without temperature still has a model as long as no thermal expansion is asked for.
        let thermal = if self.thermal_expansion_per_k == 0.0 {
            0.0
        } else {
            self.thermal_expansion_per_k * (input.temperature_degc - self.reference_temperature_degc)
        };
        let volume = hull_volume * (1.0 - self.compressibility_per_pa * input.pressure_pa + thermal) + input.ballast_m3;
        let buoyancy = GRAVITY_M_S2 * (density * volume - (MASS_KG + self.trim_mass_kg));
        let pitch = self.pitch_scale * input.pitch_rad + self.pitch_offset_rad;
        let alpha = self.angle_beyond_pitch(pitch);
        let sin_path = (pitch + alpha).sin();
        let drag = self.cd0 + self.drag_per_rad2 * alpha * alpha;
        let speed_squared = 2.0 * buoyancy * sin_path / (density * AREA_M2 * drag);
        // Buoyancy against the path: the vehicle does not glide, it stands still (NaN stays NaN).
        let speed = if speed_squared < 0.0 { 0.0 } else { speed_squared.sqrt() };
        Glide { vertical_m_s: speed * sin_path, speed_m_s: speed, alpha_rad: alpha.abs() }
    }

    /// α of the module's head: the smallest root of `a α tan(|θ| + α) = Cd0 + Cd1 α²`, with the sign of θ.
    ///
    /// Where the pitch is too flat for any root (stall) or the root lies beyond
    /// [`ALPHA_MAX_RAD`], that bound is returned: the fit is pushed away from
    /// such vehicles instead of losing its footing.
    fn angle_beyond_pitch(&self, pitch_rad: f64) -> f64 {
        let (a, cd0, cd1) = (self.lift_slope_per_rad, self.cd0, self.drag_per_rad2);
        let pitch = pitch_rad.abs();
        let f = |alpha: f64| a * alpha * (pitch + alpha).tan() - cd0 - cd1 * alpha * alpha;
        // From zero, where f = −Cd0 and rises: quadratic convergence, 4–6 of the 20 steps are used.
        let mut alpha = 0.0;
        for _ in 0..20 {
            let t = (pitch + alpha).tan();
            let slope = a * t + a * alpha * (1.0 + t * t) - 2.0 * cd1 * alpha;
            let step = f(alpha) / slope;
            alpha -= step;
            if step.abs() < 1e-13 && (0.0..=ALPHA_MAX_RAD).contains(&alpha) {
                return alpha.copysign(pitch_rad);
            }
            if alpha.is_nan() {
                return f64::NAN;
            }
            if !(0.0..=ALPHA_MAX_RAD).contains(&alpha) {
                break;
            }
        }
        let (mut low, mut high) = (0.0, ALPHA_MAX_RAD.min(1.5 - pitch));
        if !(f(high) > 0.0) {
            return ALPHA_MAX_RAD.copysign(pitch_rad);
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if f(middle) > 0.0 {
                high = middle;
            } else {
                low = middle;
            }
        }
        low.copysign(pitch_rad)
    }
}

/// Largest α of the model, rad: 46°, far beyond any glide, so that a fit that runs away is seen to.
pub const ALPHA_MAX_RAD: f64 = 0.8;

/// What the model is given at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// Measured pitch, rad, nose up.
    pub pitch_rad: f64,
    /// Ballast volume, m³, positive buoyant.
    pub ballast_m3: f64,
    /// In-situ density, kg/m³.
    pub density_kg_m3: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Water temperature, °C; NaN is fine without thermal expansion.
    pub temperature_degc: f64,
}

/// What the model says of one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glide {
    /// w, m/s, positive up.
    pub vertical_m_s: f64,
    /// U, m/s.
    pub speed_m_s: f64,
    /// |α|, rad.
    pub alpha_rad: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diving(pitch_rad: f64) -> Input {
        Input { pitch_rad, ballast_m3: -230e-6, density_kg_m3: 1005.8, pressure_pa: 2e5, temperature_degc: 10.0 }
    }

    #[test]
    fn the_angle_solves_its_equation() {
        let model = GlideModel::nominal(1005.8, 10.0);
        for tenth_degrees in 110..400 {
            let pitch = -(f64::from(tenth_degrees) / 10.0).to_radians();
            let alpha = -model.glide(&diving(pitch)).alpha_rad;
            let residual = LIFT_SLOPE_PER_RAD * alpha * (pitch + alpha).tan() - CD0 - DRAG_PER_RAD2 * alpha * alpha;
            // dimensionless coefficient; Newton stops at 1e-13 rad
            assert!(residual.abs() < 1e-11, "pitch {pitch}: {residual}");
        }
    }

    #[test]
    fn a_dive_sinks_and_a_climb_rises_by_the_same_amount_in_uniform_water() {
        let model = GlideModel::nominal(1005.8, 10.0);
        let dive = model.glide(&diving(-0.38));
        let climb = model.glide(&Input { ballast_m3: 230e-6, pitch_rad: 0.38, ..diving(0.0) });
        assert!(dive.vertical_m_s < 0.0 && climb.vertical_m_s > 0.0);
        assert!((dive.vertical_m_s + climb.vertical_m_s).abs() < 1e-12);
    }

    /// Published check point: the defaults at 21.9° and 2.12 N of negative buoyancy
    /// give α 2.9°, U 0.316 m/s, w 0.133 m/s (three digits, hence the tolerances).
    #[test]
    fn validate_the_published_steady_glide() {
        let model = GlideModel::nominal(1005.8, 10.0);
        let ballast = -2.12 / (GRAVITY_M_S2 * 1005.8);
        let glide = model.glide(&Input { ballast_m3: ballast, ..diving(-21.9_f64.to_radians()) });
        assert!((glide.alpha_rad.to_degrees() - 2.9).abs() < 0.06, "{glide:?}");
        assert!((glide.speed_m_s - 0.316).abs() < 0.0015, "{glide:?}");
        assert!((glide.vertical_m_s + 0.133).abs() < 0.001, "{glide:?}");
    }

    #[test]
    fn a_sample_without_pitch_has_no_answer() {
        let model = GlideModel::nominal(1005.8, 10.0);
        assert!(model.glide(&diving(f64::NAN)).vertical_m_s.is_nan());
    }
}
