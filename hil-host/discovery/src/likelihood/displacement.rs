//! How far the vehicle came, from GPS fix to GPS fix: over one dive, or over several without a surfacing between them.

use crate::likelihood::Problem;
use crate::model::parameters::{HEADING_BIAS, State};
use std::ops::Range;

/// Error of a GPS displacement besides the fixes (drift afloat, turns), m, and per metre of way; guess from example flights.
const DRIFT_M: f64 = 1.0;
const DRIFT_PER_M: f64 = 0.004;
/// Error of the horizontal speed while the vehicle is near the stall, m/s, and the longest such time for which displacement is used, s.
const NEAR_STALL_M_S: f64 = 0.05;
const MOST_NEAR_STALL_S: f64 = 600.0;

impl Problem<'_> {
    /// Error of a displacement over these runs in each direction, m; none where too much of the way was near the stall.
    fn displacement_error_m(&self, runs: Range<usize>, gps_m: f64) -> Option<f64> {
        let most_near_stall_s = MOST_NEAR_STALL_S * runs.len() as f64;
        let path_m = self.path_m[runs.clone()].iter().sum::<f64>();
        let near_stall_s = self.near_stall_s[runs].iter().sum::<f64>();
        let error = (gps_m * gps_m + DRIFT_M * DRIFT_M + (DRIFT_PER_M * path_m).powi(2) + (NEAR_STALL_M_S * near_stall_s).powi(2)).sqrt();
        (!self.vehicle.current_unknown && near_stall_s < most_near_stall_s).then_some(error)
    }

    /// A displacement (east, north) over these runs in errors of the observed one; nothing where that takes no part in the fit.
    pub(crate) fn whiten_displacement(&self, runs: Range<usize>, gps_m: f64, (east, north): (f64, f64), out: &mut Vec<f64>) {
        if let Some(sigma) = self.displacement_error_m(runs, gps_m) {
            out.extend([east / sigma, north / sigma]);
        }
    }

    /// All observed displacements: over which runs, and what.
    fn displacements_m(&self) -> impl Iterator<Item = (Range<usize>, (f64, f64, f64))> {
        let alone = self.runs.iter().enumerate().filter_map(|(k, r)| Some((k..k + 1, r.displacement_m?)));
        alone.chain(self.displacements.iter().map(|w| (w.runs.clone(), w.displacement_m)))
    }

    /// A displacement (east, north) by a compass with this state's bias.
    pub(crate) fn as_steered(&self, state: &State, (east, north): (f64, f64)) -> (f64, f64) {
        let bias = state.calibration[HEADING_BIAS] * self.vehicle.sensors.heading_bias_rad;
        (east - bias * north, north + bias * east)
    }

    /// Whether any GPS displacement takes part in the fit.
    #[must_use]
    pub fn has_displacement(&self) -> bool {
        self.displacements_m().any(|(runs, (_, _, gps_m))| self.displacement_error_m(runs, gps_m).is_some())
    }

    /// Mean water velocity (east, north) that the displacements leave to be explained at a state, m/s: one for each.
    pub(crate) fn currents_m_s(&self, state: &State) -> Vec<(f64, f64)> {
        let tracks = self.fitted_tracks(state);
        let left = |(runs, (east, north, _)): (Range<usize>, (f64, f64, f64))| {
            let made = runs.map(|k| (tracks[k].displacement_m, self.runs[k].displacement_s));
            let (e, n, time_s) = made.fold((east, north, 0.0), |s, (d, t)| (s.0 - d.0, s.1 - d.1, s.2 + t));
            (e / time_s, n / time_s)
        };
        self.displacements_m().map(left).collect()
    }
}
