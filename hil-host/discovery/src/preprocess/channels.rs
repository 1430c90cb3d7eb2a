//! Channels of a run without spikes and gaps.

use crate::preprocess::SURFACE_M;
use crate::preprocess::ctd_gaps::{fill_by_depth, without_air};
use crate::preprocess::gaps::{changed_unseen, far_from_known};
use crate::preprocess::interpolate::{fill, quiet_ballast};
use crate::preprocess::spikes::{FASTEST, TURN_STROKE_M3, depth_allowance, despike, despike_by, turn_allowance};
use crate::preprocess::stuck_sensors::{Removed, TURNED_RAD};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use std::ops::Range;

/// Pressure of a metre of water, Pa, to a hundredth or two.
const PA_PER_M: f64 = 1e4;
/// Most that a pump or a valve moves in a second, m³: several times what gliders have.
const FASTEST_BALLAST_M3_S: f64 = 1e-3;

/// Channels of a run without spikes; where nothing else is said gaps are filled.
pub(crate) struct Channels<'a> {
    /// Time, s.
    pub(crate) time: &'a [f64],
    /// Pressure, Pa, with its gaps, and without.
    pub(crate) pressure: Vec<f64>,
    pub(crate) whole_pressure: Vec<f64>,
    /// Pitch, rad, with its gaps.
    pub(crate) pitch: Vec<f64>,
    /// Engine, m³: as logged, and smoothed where it rests.
    pub(crate) seen_ballast: Vec<f64>,
    pub(crate) ballast: Vec<f64>,
    /// By how much pitch may change at each row because the vehicle turns, rad.
    pub(crate) turning: Vec<f64>,
    /// Density, kg/m³, with its gaps, and without.
    pub(crate) raw_density: Vec<f64>,
    pub(crate) density: Vec<f64>,
    /// Temperature, °C.
    pub(crate) temperature: Vec<f64>,
    /// Roll, rad.
    pub(crate) roll: Vec<f64>,
    /// Sine and cosine of the heading, with their gaps, and without.
    pub(crate) ahead: [Vec<f64>; 2],
    pub(crate) whole_ahead: [Vec<f64>; 2],
    /// Speed through the water, m/s, with its gaps.
    pub(crate) speed: Vec<f64>,
}

impl<'a> Channels<'a> {
    pub(crate) fn of(flight: &'a Flight, vehicle: &Vehicle, rows: Range<usize>, removed: &mut Removed) -> Self {
        let time = &flight.time_s[rows.clone()];
        let sensors = &vehicle.sensors;
        let spikes = &mut removed.spikes;
        let mut pressure = flight.pressure_pa[rows.clone()].to_vec();
        let mut pitch = flight.pitch_rad[rows.clone()].to_vec();
        let mut speed = flight.speed_m_s.as_ref().map_or_else(|| vec![f64::NAN; time.len()], |s| s[rows.clone()].to_vec());
        let mut density = flight.density_kg_m3[rows.clone()].to_vec();
        let heading = &flight.heading_rad[rows.clone()];
        let turned_pa: Vec<f64> = depth_allowance(time, &pressure).iter().map(|m| m * PA_PER_M).collect();
        let noise_pa = 1500.0 + 6.0 * sensors.pressure_noise_pa;
        spikes[0] += despike_by(time, &mut pressure, &|i| noise_pa + turned_pa[i], FASTEST.pressure_pa_s);
        let mut seen_ballast = flight.ballast_m3[rows.clone()].to_vec();
        spikes[4] += despike(time, &mut seen_ballast, TURN_STROKE_M3, FASTEST_BALLAST_M3_S);
        let raw_ballast = fill(time, &seen_ballast, 0.0);
        let turning = turn_allowance(time, &pitch, &raw_ballast);
        spikes[1] += despike_by(time, &mut pitch, &|i| 0.035 + 6.0 * sensors.pitch_noise_rad + turning[i], FASTEST.angle_rad_s);
        removed.air += without_air(time, &pressure, &mut density);
        spikes[2] += despike(time, &mut density, 0.25, FASTEST.density_kg_m3_s);
        let mut temperature = flight.temperature_degc[rows.clone()].to_vec();
        despike(time, &mut temperature, 1.0, FASTEST.temperature_k_s);
        spikes[3] += despike(time, &mut speed, 8.0 * sensors.speed_noise_m_s, FASTEST.speed_m_s2);
        let mut roll = flight.roll_rad[rows].to_vec();
        despike(time, &mut roll, 0.3, FASTEST.angle_rad_s);

        let whole_pressure = fill(time, &pressure, 0.0);
        let raw_density = density;
        let density = fill_by_depth(time, &whole_pressure, &raw_density, 1025.0);
        let temperature = fill_by_depth(time, &whole_pressure, &temperature, vehicle.constants.reference_temperature_degc);
        let ballast = quiet_ballast(&raw_ballast);
        let roll = fill(time, &roll, 0.0);
        let ahead: [Vec<f64>; 2] = [heading.iter().map(|h| h.sin()).collect(), heading.iter().map(|h| h.cos()).collect()];
        let whole_ahead = [0, 1].map(|k| fill(time, &ahead[k], 0.0));
        Self {
            time,
            pressure,
            whole_pressure,
            pitch,
            seen_ballast,
            ballast,
            turning,
            raw_density,
            density,
            temperature,
            roll,
            ahead,
            whole_ahead,
            speed,
        }
    }

    /// ∫ dp/(ρ g) at each row, m.
    pub(crate) fn depth(&self, gravity_m_s2: f64) -> Vec<f64> {
        let (pressure, density, g) = (&self.whole_pressure, &self.density, gravity_m_s2);
        let mut depth = Vec::with_capacity(self.time.len());
        let mut z = pressure[0] / (density[0] * g);
        for i in 0..self.time.len() {
            if i > 0 {
                z += (pressure[i] - pressure[i - 1]) * 2.0 / ((density[i] + density[i - 1]) * g);
            }
            depth.push(z);
        }
        depth
    }

    /// Rows whose inputs were made up over a long silence: the model cannot be held to account there.
    pub(crate) fn silent(&self, depth: &[f64], removed: &mut Removed) -> Vec<bool> {
        let time = self.time;
        let mut silent = vec![false; time.len()];
        for input in [&self.pitch, &self.seen_ballast, &self.raw_density] {
            silent.iter_mut().zip(far_from_known(time, input)).for_each(|(s, lonely)| *s |= lonely);
        }
        removed.silent_rows += silent.iter().filter(|s| **s).count();
        for (input, much) in [(&self.pitch, TURNED_RAD), (&self.seen_ballast, TURN_STROKE_M3)] {
            // A vehicle that comes up bobs: what its pitch did there is of no account.
            let submerged = depth.iter().map(|z| *z >= SURFACE_M);
            for ((s, unseen), submerged) in silent.iter_mut().zip(changed_unseen(time, input, much)).zip(submerged) {
                let unseen = unseen && submerged;
                removed.unseen_rows += usize::from(unseen && !*s);
                *s |= unseen;
            }
        }
        silent
    }

    /// Whether a way through the water rests on a heading that was made up.
    pub(crate) fn unsteered(&self) -> bool {
        let time = self.time;
        let made_up =
            |part: &Vec<f64>| far_from_known(time, part).contains(&true) || changed_unseen(time, part, TURNED_RAD).contains(&true);
        self.ahead.iter().any(made_up)
    }
}
