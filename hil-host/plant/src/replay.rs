//! What would this vehicle have done under a recorded flight's commands?
//!
//! Ballast, pitch, density, temperature and pressure are taken as recorded;
//! speed and sink rate follow from the same force law and the same added
//! masses as in [`crate::World`]. Pitch is driven kinematically: what is judged
//! is the force balance and its inertia, not the pitch loop.
//!
//! ```text
//! (m+m1) u' = −(m+m3) w q + X − F sin θ      (m+m3) w' = (m+m1) u q + Z + F cos θ      z' = −u sin θ + w cos θ
//! ```

use crate::forces::Law;
use crate::ocean::GRAVITY_M_S2;
use crate::vehicle::{Aero, Vehicle};
use signals::Wings;

/// Longest integration step, s.
const STEP_S: f64 = 0.5;
/// Shallower than this the vehicle is taken to float at rest, m.
const AFLOAT_M: f64 = 0.7;

/// One recorded instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    /// Time, s, increasing.
    pub time_s: f64,
    /// Pitch, rad, nose up.
    pub pitch_rad: f64,
    /// Ballast, m³, buoyant positive.
    pub ballast_m3: f64,
    /// In-situ density, kg/m³.
    pub density_kg_m3: f64,
    /// Temperature, °C.
    pub temperature_degc: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
}

/// What a ballasting table would have told: constants fitted to the flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trim {
    /// Extra displaced volume, m³.
    pub volume_m3: f64,
    /// Relative change of the axial drag area (payload, antenna, fouling).
    pub axial_relative: f64,
}

/// One instant of the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flown {
    /// Sink rate, m/s, down positive, through the water.
    pub sink_rate_m_s: f64,
    /// Speed through the water, m/s.
    pub speed_m_s: f64,
    /// Angle of attack, rad.
    pub alpha_rad: f64,
}

/// Runs the vehicle through the record; one answer per sample. The hull's
/// volume is that which is neutral at `neutral_kg_m3`, zero pressure and the
/// reference temperature.
#[must_use]
pub fn replay(vehicle: &Vehicle, wings: Wings, neutral_kg_m3: f64, trim: Trim, record: &[Recorded]) -> Vec<Flown> {
    let mut aero = vehicle.aero.unwrap_or_else(|| Aero::of(wings));
    aero.axial_m2 *= 1.0 + trim.axial_relative;
    let law = Law::new(aero, &[]);
    let m = vehicle.mass_kg;
    let (m1, m3) = (m + vehicle.added_mass_surge_kg, m + vehicle.added_mass_heave_kg);
    let hull = m / neutral_kg_m3;
    let rate = |a: &Recorded, b: &Recorded, share: f64, q: f64, [u, w]: [f64; 2]| {
        let mix = |x: fn(&Recorded) -> f64| x(a) + (x(b) - x(a)) * share;
        let rho = mix(|r| r.density_kg_m3);
        let volume = hull
            * (1.0 - vehicle.compressibility_per_pa * mix(|r| r.pressure_pa)
                + vehicle.thermal_expansion_per_k * (mix(|r| r.temperature_degc) - vehicle.reference_temperature_degc))
            + mix(|r| r.ballast_m3)
            + trim.volume_m3;
        let down = (m - rho * volume) * GRAVITY_M_S2;
        let (s, c) = mix(|r| r.pitch_rad).sin_cos();
        let f = law.forces(rho, u, w, 1.0, 0.0, 1.0);
        [(-m3 * w * q + f.x_n - down * s) / m1, (m1 * u * q + f.z_n + down * c) / m3]
    };
    let mut y = [0.0, 0.0];
    let mut flown = Vec::with_capacity(record.len());
    for (k, now) in record.iter().enumerate() {
        let [u, w] = y;
        let (s, c) = now.pitch_rad.sin_cos();
        flown.push(Flown {
            sink_rate_m_s: -u * s + w * c,
            speed_m_s: u.hypot(w),
            alpha_rad: if u == 0.0 && w == 0.0 { 0.0 } else { w.atan2(u) },
        });
        let Some(next) = record.get(k + 1) else { break };
        let span = next.time_s - now.time_s;
        if now.pressure_pa < AFLOAT_M * 1000.0 * GRAVITY_M_S2 || !(span > 0.0) || span > 60.0 {
            y = [0.0, 0.0];
            continue;
        }
        let q = (next.pitch_rad - now.pitch_rad) / span;
        let steps = (span / STEP_S).ceil();
        let h = span / steps;
        for n in 0..steps as u32 {
            let from = f64::from(n) / steps;
            let half = 0.5 / steps;
            let along = |k: [f64; 2], by: f64| [y[0] + by * k[0], y[1] + by * k[1]];
            let k1 = rate(now, next, from, q, y);
            let k2 = rate(now, next, from + half, q, along(k1, 0.5 * h));
            let k3 = rate(now, next, from + half, q, along(k2, 0.5 * h));
            let k4 = rate(now, next, from + 2.0 * half, q, along(k3, h));
            y = [0, 1].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
    }
    flown
}
