//! The steady glide of the vehicle at one row, by the law's own table and the vehicle's constants, and its derivatives.
//!
//! With all angles as magnitudes, γ = θ + α of pitch θ and angle of attack α:
//! ```text
//! C_D(α) = C_L(α) tan γ        w² = 2 B sin³ γ / (ρ S C_D)
//! ```
//! B the net buoyancy in the direction of the glide, w the vertical velocity. What a row says is w² and not w, over 2 w as measured: its
//! noise is that of w, and it is a straight line in all numbers of buoyancy however far they are off, beyond B = 0 too. The derivatives
//! are those of these equations (implicit in α), so that a row costs one search for α. The drag level acts on C_D(0), the lift slope on
//! C_L; drag that comes of lift stays, as the table does not say which it is.

use crate::maths::sin_cos;
use crate::rows::Row;
use crate::{NUMBERS, SIZES};
use polar::Table;

const GRAVITY_M_S2: f32 = 9.81;
/// Slowest row, m/s: far above the noise of its own velocity.
const SLOWEST_M_S: f32 = 0.015;
/// Flattest and steepest pitch, and the largest angle of attack, rad: the path stays below 1.5, where the series of [`sin_cos`] ends.
const PITCH_RAD: core::ops::Range<f32> = 0.05..1.1;
const LARGEST_RAD: f32 = 0.35;
/// Step of the table's derivatives, rad.
const STEP_RAD: f32 = 1e-3;
/// Steps of Newton: from the last row's angle three are enough.
const STEPS: usize = 8;
/// The angle is found with a step that is no longer, rad: the next one would be its square.
const FOUND_RAD: f32 = 1e-4;

/// Constants of the vehicle that its table does not have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// Mass, kg: 5 to 500.
    pub mass_kg: f32,
    /// Volume of the hull with the ballast at 0, at the surface and the reference temperature, m³.
    pub volume_m3: f32,
    /// Compressibility of the hull, 1/Pa.
    pub compressibility_per_pa: f32,
    /// Thermal expansion of the hull's volume, 1/K.
    pub expansion_per_k: f32,
    /// Temperature of the stated volume, °C.
    pub reference_degc: f32,
    /// True over measured ballast volume.
    pub ballast_gain: f32,
    /// True over measured pitch.
    pub pitch_gain: f32,
    /// True pitch at a reading of 0, rad.
    pub pitch_offset_rad: f32,
}

impl Vehicle {
    /// Identity of the constants: CRC-32 of their bytes in this order, f32 little endian.
    #[must_use]
    pub fn id(&self) -> u32 {
        let all = [
            self.mass_kg,
            self.volume_m3,
            self.compressibility_per_pa,
            self.expansion_per_k,
            self.reference_degc,
            self.ballast_gain,
            self.pitch_gain,
            self.pitch_offset_rad,
        ];
        polar::crc32(all.map(f32::to_le_bytes).as_flattened())
    }
}

/// A row linearised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// w² of the steady glide, m²/s², negative where the vehicle would go the other way.
    pub square: f32,
    /// Measured less modelled, over 2 w as measured: m/s, up.
    pub residual: f32,
    /// Derivatives of the modelled, by a size of each number, m/s.
    pub by_number: [f32; NUMBERS],
    /// Angle of attack, rad: where the next row's search starts.
    pub alpha_rad: f32,
}

/// Lift and drag at an angle of attack and their slopes: C_L, C_D, dC_L/dα, dC_D/dα. The mean of two places is off by half the curvature
/// times the step's square, 1e-4 of C_D.
fn polar_at(table: &Table<'_>, alpha_rad: f32) -> [f32; 4] {
    let (low, high) = (table.at(alpha_rad - STEP_RAD), table.at(alpha_rad + STEP_RAD));
    let per_rad = 0.5 / STEP_RAD;
    [0.5 * (low.cl + high.cl), 0.5 * (low.cd + high.cd), (high.cl - low.cl) * per_rad, (high.cd - low.cd) * per_rad]
}

/// The balance C_D − C_L tan γ at a path, its slope by α, and the step of Newton that is due.
struct Balance {
    sin: f32,
    tan: f32,
    slope: f32,
    step: f32,
}

fn balance([cl, cd, cl_slope, cd_slope]: [f32; 4], path_rad: f32) -> Balance {
    let (sin, cos) = sin_cos(path_rad);
    let tan = sin / cos;
    let slope = cd_slope - cl_slope * tan - cl * (1.0 + tan * tan);
    Balance { sin, tan, slope, step: (cd - cl * tan) / if slope < -0.05 { slope } else { -0.05 } }
}

/// The steady glide at a row; none where there is none.
#[must_use]
pub fn linearise(vehicle: &Vehicle, table: &Table<'_>, row: &Row, from_alpha_rad: f32) -> Option<Linear> {
    let way = row.way();
    let warm_k = if row.temperature_degc.is_finite() { row.temperature_degc - vehicle.reference_degc } else { 0.0 };
    let hull_m3 = vehicle.volume_m3 * (1.0 - vehicle.compressibility_per_pa * row.pressure_pa + vehicle.expansion_per_k * warm_k);
    let ballast_m3 = vehicle.ballast_gain * row.ballast_m3;
    let buoyancy_n = way * GRAVITY_M_S2 * (row.density_kg_m3 * (hull_m3 + ballast_m3) - vehicle.mass_kg);
    let measured_rad = way * vehicle.pitch_gain * row.pitch_rad;
    let pitch_rad = measured_rad + way * vehicle.pitch_offset_rad;
    let most = table.alpha_max_rad() - 2.0 * STEP_RAD;
    let most = if most < LARGEST_RAD { most } else { LARGEST_RAD };
    if !(row.rise_m_s.abs() > SLOWEST_M_S && PITCH_RAD.contains(&pitch_rad)) {
        return None;
    }
    let mut alpha = if from_alpha_rad > 0.0 && from_alpha_rad < most { from_alpha_rad } else { table.best_alpha_rad() };
    let mut found = None;
    for _ in 0..STEPS {
        let at = polar_at(table, alpha);
        let step = balance(at, pitch_rad + alpha).step;
        let to = alpha - step;
        let to = if to > 0.0 { to } else { 0.0 };
        let moved = if to < most { to } else { most } - alpha;
        alpha += moved;
        if moved.abs() < FOUND_RAD {
            // The rest of the way along the slopes: its square is nothing.
            let [cl, cd, cl_slope, cd_slope] = at;
            found = Some([cl + cl_slope * moved, cd + cd_slope * moved, cl_slope, cd_slope]);
            break;
        }
    }
    let at = found.filter(|_| alpha < most)?;
    let [cl, cd, _, cd_slope] = at;
    let Balance { sin, tan, slope, .. } = balance(at, pitch_rad + alpha);
    if !(slope < -0.05) {
        return None;
    }
    let per_buoyancy = 2.0 * sin * sin * sin / (row.density_kg_m3 * table.area_m2() * cd);
    let square = per_buoyancy * buoyancy_n;
    // Changes of w²: by B, and in share of it by α: three times that of sin γ, less that of C_D.
    let by_buoyancy = |change_n: f32| way * change_n * per_buoyancy;
    let by_alpha = |change: f32| (3.0 / tan - cd_slope / cd) * change;
    let weight_n = GRAVITY_M_S2 * row.density_kg_m3;
    let drag_level = table.at(0.0).cd;
    let by_pitch = square * (3.0 / tan + by_alpha(cl * (1.0 + tan * tan) / slope));
    let changes = [
        square * (by_alpha(-drag_level / slope) - drag_level / cd),
        by_buoyancy(-GRAVITY_M_S2),
        by_buoyancy(-weight_n * vehicle.volume_m3 * row.pressure_pa),
        if row.temperature_degc.is_finite() { by_buoyancy(weight_n * vehicle.volume_m3 * warm_k) } else { 0.0 },
        way * by_pitch,
        measured_rad * by_pitch,
        by_buoyancy(weight_n * ballast_m3),
        square * by_alpha(cl * tan / slope),
    ];
    let per_square = 0.5 / row.rise_m_s;
    let mut by_number = [0.0; NUMBERS];
    for ((to, change), size) in by_number.iter_mut().zip(changes).zip(SIZES) {
        *to = per_square * change * size;
    }
    let residual = per_square * (row.rise_m_s * row.rise_m_s - square);
    let sound = residual.abs() < 1e3 && by_number.iter().all(|x| x.abs() < 1e3);
    sound.then_some(Linear { square, residual, by_number, alpha_rad: alpha })
}
