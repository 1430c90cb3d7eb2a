//! The hull's volume from a flight: the volume at which it would neither sink nor rise.
//!
//! In a steady glide the vertical velocity w goes as w|w| = K(θ)·B, with the net buoyancy B = ρ(V₀c + v_b) − m (mass units,
//! c = 1 − εp + αT(T − T₀)) and K(θ) ∝ |sin γ|³. So over the steady stretches of a flight
//! ```text
//! w|w| / |sin³ γ| = K (ρ v_b − m) + K V₀ (ρ c)
//! ```
//! is linear in two numbers, K and K·V₀ (least squares). Needs no coefficient of lift or drag; takes the path a little steeper
//! than the pitch. Good to some ten cm³, which is what a first vehicle file needs.

use crate::record::flight::Flight;

/// Stretches of this length are looked at, s: the w of a single sample is noise.
const TRIM_STRETCH_S: f64 = 60.0;
/// Gliding: nose at least so far from level, rad; and below the surface's disturbance, Pa.
const LEAST_PITCH_RAD: f64 = 0.12;
const LEAST_PRESSURE_PA: f64 = 5e4;
/// Glide path less pitch, rad: a usual angle of attack.
const PATH_BEYOND_PITCH_RAD: f64 = 0.06;
/// The pump is at rest: ballast moves less than this in a stretch, m³.
const PUMP_AT_REST_M3: f64 = 5e-6;

/// What is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Hull volume at ballast reading 0, zero pressure, reference temperature, m³.
    pub hull_volume_m3: f64,
    /// Its 1-sigma uncertainty, m³.
    pub sigma_m3: f64,
    /// Mean density of the water, kg/m³.
    pub water_kg_m3: f64,
}

/// Mass and the hull's change with pressure and temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hull {
    /// kg.
    pub mass_kg: f64,
    /// 1/Pa.
    pub compressibility_per_pa: f64,
    /// 1/K.
    pub expansion_per_k: f64,
    /// °C.
    pub reference_degc: f64,
}

struct Stretch {
    /// ρ v_b − m and ρ c.
    x: [f64; 2],
    y: f64,
    pitch_rad: f64,
    rising_m_s: f64,
    rho_kg_m3: f64,
}

/// How far off a law of the vertical velocity (of pitch, rad; net buoyancy, kg; density, kg/m³), m/s, is in the middle of the steady
/// stretches of a flight, of a hull of this volume, m³; where the law has no steady glide it does not move. None without a stretch.
pub(super) fn off_m_s(flight: &Flight, hull: Hull, volume_m3: f64, law: impl Fn(f64, f64, f64) -> Option<f64>) -> Option<f64> {
    let off = |s: &Stretch| (law(s.pitch_rad, s.x[0] + volume_m3 * s.x[1], s.rho_kg_m3).unwrap_or(0.0) - s.rising_m_s).abs();
    let all: Vec<f64> = stretches(flight, hull).iter().map(off).collect();
    Some(crate::record::plausible::quantile(&all, 0.5)).filter(|off| off.is_finite())
}

/// The hull volume that makes the flight rise and sink where it does; none without enough steady stretches both ways.
#[must_use]
pub fn find(flight: &Flight, hull: Hull) -> Option<Trim> {
    let stretches = stretches(flight, hull);
    let down = stretches.iter().filter(|s| s.y < 0.0).count();
    // Five each way: with fewer the slope K is a guess.
    if down < 5 || stretches.len() - down < 5 {
        return None;
    }
    let mut kept: Vec<&Stretch> = stretches.iter().collect();
    let mut fit = fit(&kept)?;
    for _ in 0..2 {
        let off = |s: &Stretch| (s.y - fit.0[0] * s.x[0] - fit.0[1] * s.x[1]).abs();
        let usual = crate::record::plausible::quantile(&kept.iter().map(|s| off(s)).collect::<Vec<_>>(), 0.5);
        // Four median deviations: 2.7 sigma.
        kept.retain(|s| off(s) <= 4.0 * usual);
        fit = self::fit(&kept)?;
    }
    let ([k, kv], relative) = fit;
    let volume = kv / k;
    let water = kept.iter().map(|s| s.x[1]).sum::<f64>() / kept.len() as f64;
    let plausible = k > 0.0 && volume.is_finite() && (volume * water / hull.mass_kg - 1.0).abs() < 0.1;
    // Neighbouring stretches err alike (path, drag of dives and climbs): five times what independent ones would give.
    let sigma = (5.0 * relative).max(1e-5);
    (plausible && sigma < 1e-3).then_some(Trim { hull_volume_m3: volume, sigma_m3: sigma, water_kg_m3: water })
}

/// K and K·V₀ by least squares, and the standard error of their quotient, m³.
fn fit(stretches: &[&Stretch]) -> Option<([f64; 2], f64)> {
    let n = stretches.len() as f64;
    // Centred on the middle of ρc, which hardly varies: both columns are brought to the size of a few hundred grams.
    let c = stretches.iter().map(|s| s.x[1]).sum::<f64>() / n;
    let b = stretches.iter().map(|s| -s.x[0]).sum::<f64>() / n;
    let v0 = b / c;
    let z: Vec<(f64, f64, f64)> = stretches.iter().map(|s| (s.x[0] + v0 * s.x[1], s.x[1], s.y)).collect();
    let sum = |f: &dyn Fn(&(f64, f64, f64)) -> f64| z.iter().map(f).sum::<f64>();
    let (aa, ab, bb) = (sum(&|r| r.0 * r.0), sum(&|r| r.0 * r.1), sum(&|r| r.1 * r.1));
    let (ay, by) = (sum(&|r| r.0 * r.2), sum(&|r| r.1 * r.2));
    let determinant = aa * bb - ab * ab;
    if !(determinant > 0.0) || n < 6.0 {
        return None;
    }
    let (k, rest) = ((bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant);
    let residual = sum(&|r| (r.2 - k * r.0 - rest * r.1).powi(2)) / (n - 2.0);
    // Of V₀ = v0 + rest / k; the error of k matters little beside that of rest.
    let error = (residual * aa / determinant).sqrt() / k.abs();
    Some(([k, k * v0 + rest], error))
}

fn stretches(flight: &Flight, hull: Hull) -> Vec<Stretch> {
    let mut out = Vec::new();
    let mut start = 0;
    while start < flight.len() {
        let end = (start..flight.len())
            .find(|i| flight.segment[*i] != flight.segment[start] || flight.time_s[*i] - flight.time_s[start] > TRIM_STRETCH_S)
            .unwrap_or(flight.len());
        // Sparse logs: at least three rows, at most five minutes.
        let end = if end - start < 3 { (start + 3).min(flight.len()) } else { end };
        let rows = start..end;
        if flight.segment[end - 1] == flight.segment[start] && flight.time_s[end - 1] - flight.time_s[start] <= 5.0 * TRIM_STRETCH_S {
            out.extend(stretch(flight, rows, hull));
        }
        start = end;
    }
    out
}

fn stretch(flight: &Flight, rows: std::ops::Range<usize>, hull: Hull) -> Option<Stretch> {
    let rows: Vec<usize> = rows
        .filter(|i| {
            let all = [flight.pressure_pa[*i], flight.pitch_rad[*i], flight.ballast_m3[*i], flight.density_kg_m3[*i]];
            all.iter().all(|v| v.is_finite())
        })
        .collect();
    let n = rows.len() as f64;
    if rows.len() < 3 {
        return None;
    }
    let mean = |v: &[f64]| rows.iter().map(|i| v[*i]).sum::<f64>() / n;
    let span = |v: &[f64]| {
        let (low, high) = rows.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), i| (l.min(v[*i]), h.max(v[*i])));
        (low, high)
    };
    let (pressure, pitch, ballast, rho) =
        (mean(&flight.pressure_pa), mean(&flight.pitch_rad), mean(&flight.ballast_m3), mean(&flight.density_kg_m3));
    let (flattest, steepest) = span(&flight.pitch_rad);
    let pumped = span(&flight.ballast_m3);
    let steady = pressure > LEAST_PRESSURE_PA
        && pumped.1 - pumped.0 < PUMP_AT_REST_M3
        && (flattest > LEAST_PITCH_RAD || steepest < -LEAST_PITCH_RAD)
        && steepest - flattest < 0.1;
    if !steady {
        return None;
    }
    let t = mean(&flight.time_s);
    let tt: f64 = rows.iter().map(|i| (flight.time_s[*i] - t).powi(2)).sum();
    let tp: f64 = rows.iter().map(|i| (flight.time_s[*i] - t) * (flight.pressure_pa[*i] - pressure)).sum();
    let w = -(tp / tt) / (rho * 9.81);
    let warm = mean(&flight.temperature_degc) - hull.reference_degc;
    let c = 1.0 - hull.compressibility_per_pa * pressure + if warm.is_finite() { hull.expansion_per_k * warm } else { 0.0 };
    let y = w * w.abs() / (pitch.abs() + PATH_BEYOND_PITCH_RAD).min(1.4).sin().powi(3);
    // Nose and path point the same way, else it is carried by something else.
    let x = [rho * ballast - hull.mass_kg, rho * c];
    let sound = y.is_finite() && tt > 0.0 && w.signum() == pitch.signum();
    sound.then_some(Stretch { x, y, pitch_rad: pitch, rising_m_s: w, rho_kg_m3: rho })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracy_the_volume_of_a_made_flight_is_found() {
        let hull = Hull { mass_kg: 60.0, compressibility_per_pa: 4e-10, expansion_per_k: 5e-5, reference_degc: 15.0 };
        let truth = 0.058_45;
        let n = 2000;
        let mut flight = Flight::blank(n);
        let mut p = 1e5;
        let mut down = true;
        for i in 0..n {
            if p > 2e6 {
                down = false;
            } else if p < 8e4 {
                down = true;
            }
            let temperature = 20.0 - p * 5e-6;
            let rho = 1024.0 + p * 1e-6;
            let ballast = if down { -2.3e-4 } else { 2.4e-4 };
            let v = truth * (1.0 - hull.compressibility_per_pa * p + hull.expansion_per_k * (temperature - 15.0)) + ballast;
            let b = rho * v - hull.mass_kg;
            let pitch: f64 = if down { -0.42 } else { 0.45 };
            // Another law of the path than the one the fit assumes.
            let w = b.signum() * (1.1 * b.abs()).sqrt() * (pitch.abs() + 0.04).sin().powf(1.5);
            flight.time_s[i] = 4.0 * i as f64;
            (flight.pressure_pa[i], flight.pitch_rad[i], flight.ballast_m3[i]) = (p, pitch, ballast);
            (flight.density_kg_m3[i], flight.temperature_degc[i]) = (rho, temperature);
            p -= 4.0 * w * rho * 9.81;
        }
        let found = find(&flight, hull).expect("a trim");
        assert!((found.hull_volume_m3 - truth).abs() < 2e-5, "{found:?}");
        assert!(found.sigma_m3 < 1e-4, "{found:?}");
        // A log that never climbs tells nothing.
        flight.pitch_rad.iter_mut().for_each(|p| *p = -p.abs());
        assert_eq!(find(&flight, hull), None);
    }
}
