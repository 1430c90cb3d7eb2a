//! Is the pressure in the unit that it claims? Asked of the rate of depth: a glider of this vehicle's drag, buoyancy and pitch sinks and
//! rises as fast as it does, and units differ by factors that no drag of a sound vehicle explains.

use hydro::effects::ForceModel;
use hydro::glide::{Trim, steady};

use crate::preprocess::run::Run;
use logs::record::plausible::quantile;
use logs::vehicle::Vehicle;

/// Pressure as told over true pressure, and how that comes about.
const MISTAKES: [(f64, &str); 4] = [
    (1.450_38, "psi named dbar: divide it by 1.4504"),
    (0.689_476, "dbar taken for psi: multiply it by 1.4504"),
    (10.0, "dbar taken for bar: divide it by 10"),
    (0.1, "bar named dbar: multiply it by 10"),
];
/// How near the rates must be to a factor, relative: what trim and lift leave open.
const NEAR_A_FACTOR: f64 = 0.08;
/// Standard deviations of the drag's tolerance within which it is the drag.
const DRAG_SIGMAS: f64 = 3.0;
/// Steady glides that are asked, of dives and of climbs each, their length, s, and steepness, rad, and what they may vary by, rad and m³.
const ASKED_GLIDES: usize = 8;
const GLIDE_S: f64 = 60.0;
const STEEP_RAD: f64 = 0.2;
const STILL: (f64, f64) = (0.04, 6e-6);

/// What the pressure may be instead, where the rates of depth say so.
pub(crate) fn suspected(runs: &[Run], vehicle: &Vehicle) -> Option<String> {
    mistake(runs, vehicle).map(|m| m.1)
}

/// The same where no drag, load or trim of a vehicle that glides comes near: ten times as fast, or as slow.
pub(crate) fn impossible(runs: &[Run], vehicle: &Vehicle) -> Option<String> {
    mistake(runs, vehicle).filter(|(factor, _)| factor.ln().abs() > TENS.ln()).map(|m| m.1)
}

/// Rates that differ by more than this are none of one vehicle: a quarter of the buoyancy, or four times the drag, halves a rate.
const TENS: f64 = 5.0;

/// By which factor the pressure is taken wrongly, and what is said of it.
fn mistake(runs: &[Run], vehicle: &Vehicle) -> Option<(f64, String)> {
    let drag = 0.5 * DRAG_SIGMAS * vehicle.tolerance.cd0_relative;
    if rate(runs, vehicle, 1.0).is_some_and(|r| r.abs() <= drag) {
        return None;
    }
    let fits = |factor: f64| rate(runs, vehicle, factor).filter(|r| (r - factor.ln()).abs() < NEAR_A_FACTOR && factor.ln().abs() > drag);
    let (factor, rate, what) = MISTAKES.iter().find_map(|(factor, what)| Some((*factor, fits(*factor)?.exp(), what)))?;
    Some((factor, format!("pressure_dbar: depth changes {rate:.2} times as fast as this vehicle glides: is it {what}?")))
}

/// Logarithm of measured over expected rate of depth, where pressures are `factor` times what they should be.
fn rate(runs: &[Run], vehicle: &Vehicle, factor: f64) -> Option<f64> {
    let mut glides: [Vec<f64>; 2] = Default::default();
    for run in runs {
        let [mut dives, mut climbs] = ratios(run, vehicle, factor);
        glides[0].append(&mut dives);
        glides[1].append(&mut climbs);
    }
    let [dive, climb] = glides.map(|g| if g.len() < 3 { f64::NAN } else { quantile(&g, 0.5).ln() });
    // A trim that is off makes one faster and the other slower.
    Some(0.5 * (dive + climb)).filter(|r| r.is_finite())
}

/// Measured over expected rate of depth in some steady dives and climbs of a run.
fn ratios(run: &Run, vehicle: &Vehicle, factor: f64) -> [Vec<f64>; 2] {
    let mut found: [Vec<f64>; 2] = Default::default();
    let law = ForceModel::new(vehicle.constants, &vehicle.effects);
    let c = &vehicle.constants;
    let rows: Vec<usize> = (0..run.time_s.len()).filter(|&i| run.used[i]).collect();
    let apart = (rows.len() / (4 * ASKED_GLIDES)).max(1);
    for &row in rows.iter().step_by(apart) {
        let [before, now, after] = [-0.5 * GLIDE_S, 0.0, 0.5 * GLIDE_S].map(|ahead| run.input_at_row(row, ahead));
        let (a, s, b) = (&before.sensed, &now.sensed, &after.sensed);
        let still = (a.pitch_rad - b.pitch_rad).abs() < STILL.0 && (a.ballast_m3 - b.ballast_m3).abs() < STILL.1;
        let (rise_m_s, side) = ((before.depth_m - after.depth_m) / GLIDE_S, usize::from(s.pitch_rad > 0.0));
        if !still || s.pitch_rad.abs() < STEEP_RAD || rise_m_s * s.pitch_rad <= 0.0 || found[side].len() >= ASKED_GLIDES {
            continue;
        }
        let warmer = if s.temperature_degc.is_finite() { s.temperature_degc - c.reference_temperature_degc } else { 0.0 };
        let hull = c.hull_volume_m3 * (1.0 - c.compressibility_per_pa * s.pressure_pa / factor + c.thermal_expansion_per_k * warmer);
        let net_buoyancy_n = c.gravity_m_s2 * (s.density_kg_m3 * (hull + s.ballast_m3) - c.mass_kg);
        let trim = Trim { pitch_rad: s.pitch_rad, net_buoyancy_n, rho_kg_m3: s.density_kg_m3 };
        if let Ok(glides) = steady(&law, &trim) {
            let expected = glides.lowest.speed_m_s * glides.lowest.gamma_rad.sin();
            found[side].push(rise_m_s / expected);
        }
    }
    found
}
