//! One run of a flight: its channels without spikes, depth from pressure, rows that take part, fixes, speeds.

use crate::preprocess::channels::Channels;
use crate::preprocess::fixes::fixes;
use crate::preprocess::grid::{inputs, step_s};
use crate::preprocess::run::Run;
use crate::preprocess::stuck_sensors::Removed;
use crate::preprocess::{SETTLE_S, SURFACE_M};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;

/// Spread of readings afloat, Pa: sensor noise and ripples; and the highest zero error that is believed, Pa.
const AFLOAT_PA: f64 = 1200.0;
const MOST_ZERO_PA: f64 = 5e4;

/// Mean time and median pressure of the readings afloat at the start and at the end of a run: buoyant, and not changing.
fn surface_readings(time: &[f64], pressure: &[f64], ballast: &[f64]) -> [Option<(f64, f64, usize)>; 2] {
    let n = time.len();
    [false, true].map(|late| {
        let order: Vec<usize> = if late { (0..n).rev().collect() } else { (0..n).collect() };
        let mut rows: Vec<usize> = Vec::new();
        for i in order.into_iter().filter(|&i| pressure[i].is_finite()) {
            let mut seen: Vec<f64> = rows.iter().map(|&r| pressure[r]).collect();
            seen.sort_by(f64::total_cmp);
            let off = seen.get(seen.len() / 2).is_some_and(|m| (pressure[i] - m).abs() > AFLOAT_PA);
            if ballast[i] <= 0.0 || off || pressure[i].abs() > MOST_ZERO_PA {
                break;
            }
            rows.push(i);
        }
        // The last rows before the dive (after the surfacing) are already (still) under way.
        let edge = rows.last().map(|&r| time[r]);
        rows.retain(|&r| edge.is_some_and(|e| (time[r] - e).abs() > 8.5));
        if rows.len() < 2 {
            return None;
        }
        let k = rows.len() as f64;
        let mut seen: Vec<f64> = rows.iter().map(|&r| pressure[r]).collect();
        seen.sort_by(f64::total_cmp);
        let median = 0.5 * (seen[(seen.len() - 1) / 2] + seen[seen.len() / 2]);
        Some((rows.iter().map(|&r| time[r]).sum::<f64>() / k, median, rows.len()))
    })
}

/// Rows that take part in fits: submerged, settled, with a depth.
fn rows_used(time: &[f64], whole_depth: &[f64], depth: &[f64]) -> Vec<bool> {
    let mut last_shallow = f64::NEG_INFINITY;
    if whole_depth[0] >= SURFACE_M {
        last_shallow = time[0];
    }
    (0..time.len())
        .map(|i| {
            if whole_depth[i] < SURFACE_M {
                last_shallow = time[i];
            }
            time[i] - last_shallow > SETTLE_S && depth[i].is_finite()
        })
        .collect()
}

/// The rows from `start` to before `end` as a run.
pub(crate) fn run(flight: &Flight, vehicle: &Vehicle, start: usize, end: usize, removed: &mut Removed) -> Run {
    let rows = start..end;
    let channels = Channels::of(flight, vehicle, rows.clone(), removed);
    let time = channels.time;
    let g = vehicle.constants.gravity_m_s2;
    let whole_depth = channels.depth(g);
    let surface = surface_readings(time, &channels.pressure, &channels.ballast);
    // What the sensor shows afloat: its zero error, drifted or not.
    let afloat: Vec<f64> = surface.iter().flatten().map(|r| r.1 / (channels.density[0] * g)).collect();
    let zero = if afloat.is_empty() { 0.0 } else { afloat.iter().sum::<f64>() / afloat.len() as f64 };
    let silent = channels.silent(&whole_depth, removed);
    let depth: Vec<f64> =
        (0..time.len()).map(|i| if channels.pressure[i].is_finite() && !silent[i] { whole_depth[i] } else { f64::NAN }).collect();
    let starts_afloat = whole_depth[0] < SURFACE_M;
    let used = rows_used(time, &whole_depth, &depth);
    let first_pitch = channels.pitch.iter().copied().find(|p| p.is_finite()).unwrap_or(0.0);
    let start_speed_m_s = if starts_afloat { 0.0 } else { start_speed_m_s(time, &whole_depth, first_pitch.sin()) };
    let step = step_s(time);
    let inputs = inputs(&channels, &whole_depth, zero, step);
    let fixes = fixes(flight, rows.clone());
    let blind = silent.contains(&true) || channels.unsteered();
    let (displacement_m, displacement_s) = match fixes {
        [Some(a), Some(b)] if !blind => (Some(a.to(&b, vehicle.sensors.gps_noise_m)), b.time_s - a.time_s),
        _ => (None, f64::NAN),
    };
    Run {
        segment: flight.segment[start],
        first_row: start,
        time_s: time.to_vec(),
        depth_m: depth,
        used,
        unseen: silent,
        battery_m: flight.battery_mass_m[rows].to_vec(),
        pressure_pa: channels.whole_pressure,
        speed_m_s: channels.speed,
        ballast_m3: channels.ballast,
        inputs,
        step_s: step,
        displacement_m,
        displacement_s,
        fixes,
        blind,
        surface,
        starts_afloat,
        start_speed_m_s,
    }
}

/// Time over which the speed at the start of a run is taken, s: short against the 10 s in which speed changes.
const START_S: f64 = 9.0;
/// Speed along the hull where depth and pitch say nothing (at a turning point the depth stands still, the vehicle does not), m/s.
const TURNING_SPEED_M_S: f64 = 0.2;
/// Speeds that depth and pitch are believed, m/s, and the least sine of the pitch that says anything.
const START_SPEEDS_M_S: std::ops::RangeInclusive<f64> = 0.1..=0.6;
const LEAST_SIN_PITCH: f64 = 0.1;

/// Speed along the hull of a vehicle under way, m/s: a model that starts from rest there falls flat, and may stay stalled for the
/// whole glide.
fn start_speed_m_s(time_s: &[f64], depth_m: &[f64], sin_pitch: f64) -> f64 {
    let last = time_s.iter().take_while(|t| **t - time_s[0] <= START_S).count().max(2) - 1;
    let speed = (depth_m[0] - depth_m[last]) / (time_s[last] - time_s[0]) / sin_pitch;
    if sin_pitch.abs() > LEAST_SIN_PITCH && START_SPEEDS_M_S.contains(&speed) { speed } else { TURNING_SPEED_M_S }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_under_way_starts_at_the_speed_that_depth_and_pitch_say() {
        let time: Vec<f64> = (0..9).map(|i| 2.0 * f64::from(i)).collect();
        let sinking = |rate: f64| time.iter().map(|t| 20.0 + rate * t).collect::<Vec<_>>();
        // 0.12 m/s down at 24 degrees nose down: 0.295 m/s along the hull.
        assert!((start_speed_m_s(&time, &sinking(0.12), -0.407) - 0.12 / 0.407).abs() < 1e-12);
        for (rate, sin_pitch) in [(0.0, -0.4), (0.12, 0.4), (0.12, -0.05), (-0.9, 0.4), (0.12, 0.0)] {
            assert_eq!(start_speed_m_s(&time, &sinking(rate), sin_pitch), TURNING_SPEED_M_S, "{rate} {sin_pitch}");
        }
    }
}
