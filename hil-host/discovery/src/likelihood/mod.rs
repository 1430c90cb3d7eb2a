//! What is fitted to what: the observations of the fit segments, whitened, and the model's prediction of them.
//!
//! Unknowns: the calibration numbers in units of their own tolerance (a unit normal prior each, those of the moments in pitch with a
//! wide tail), the parameters of the effects on trial, and for an internal wave two amplitudes per run. Observations: depth (whitened
//! by [`whitening`]), speed through the water, GPS displacement where no unknown current blurs it, pressure while afloat, and the
//! position of the battery ([`battery`]). The prediction is made in `prediction.rs`.

pub mod battery;
pub mod block_error;
pub mod column;
pub(crate) mod covariates;
pub mod discrepancy;
pub mod displacement;
pub(crate) mod finite_difference;
pub mod jacobian;
mod noise_level;
mod prediction;
pub mod selection;
pub mod stall_mask;
pub mod whitening;

pub use column::Column;

use crate::likelihood::battery::Stretch;
use crate::likelihood::discrepancy::Discrepancy;
use crate::likelihood::finite_difference::Seen;
use crate::likelihood::whitening::{Colour, Whitener};
use crate::model::branch::Branch;
use crate::model::parameters::State;
use crate::preprocess::dives::{MOST_FITTED, evenly};
use crate::preprocess::fixes::Displacement;
use crate::preprocess::{Prepared, Run};
use hydro::effects::{Active, DAY_S, Effect};
use logs::vehicle::Vehicle;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// Error of a mean surface pressure besides sensor noise (waves, trim), Pa; guess from example flights.
const MEAN_SURFACE_ERROR_PA: f64 = 100.0;

/// The fit segments of one flight with everything a fit needs.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Runs that are fitted.
    pub runs: Vec<&'a Run>,
    /// Which branch the model takes beyond the valid angle of attack.
    pub branch: Branch,
    /// Colour in force.
    pub colour: Colour,
    /// Where fits start.
    pub start: State,
    pub(crate) whiteners: Vec<Whitener>,
    pub(crate) used: Vec<Vec<bool>>,
    pub(crate) outlier: Vec<Vec<bool>>,
    pub(crate) speed_outlier: Vec<Vec<bool>>,
    pub(crate) speed_rows: Vec<Vec<Vec<usize>>>,
    pub(crate) offsets: Vec<usize>,
    /// Whitened observations.
    pub data: Vec<f64>,
    pub(crate) path_m: Vec<f64>,
    /// Ways over several fitted runs.
    pub(crate) displacements: Vec<Displacement>,
    pub(crate) near_stall_s: Vec<f64>,
    /// From when to when the flow of each run is known to attach, s.
    pub(crate) attached: Vec<Vec<(f64, f64)>>,
    pub(crate) near_stall: Vec<Vec<bool>>,
    /// Stretches of each run in which the battery's position is compared, and by how much more than their noise they may be off.
    pub(crate) stretches: Vec<Vec<Stretch>>,
    pub(crate) moment_noise_factor: f64,
    /// What the model is wrong by under every hypothesis.
    pub(crate) discrepancy: Discrepancy,
    /// Rows simulated so far.
    pub(crate) work: Arc<AtomicU64>,
}

impl<'a> Problem<'a> {
    /// Collects the runs of the fit segments; of very many, [`MOST_FITTED`] spread evenly.
    #[must_use]
    pub fn new(prepared: &'a Prepared, vehicle: &'a Vehicle, fitted: impl Fn(u32) -> bool) -> Self {
        let all: Vec<&Run> = prepared.runs.iter().filter(|r| fitted(r.segment)).collect();
        let runs: Vec<&Run> = evenly(all.len(), MOST_FITTED).into_iter().map(|i| all[i]).collect();
        let displacements = prepared.displacements.iter().filter_map(|displacement| {
            let from = runs.iter().position(|r| std::ptr::eq(*r, &prepared.runs[displacement.runs.start]))?;
            let here = from..from + displacement.runs.len();
            let whole = runs.get(here.clone())?.iter().zip(&prepared.runs[displacement.runs.clone()]).all(|(a, b)| std::ptr::eq(*a, b));
            whole.then(|| Displacement { runs: here, ..displacement.clone() })
        });
        let displacements = displacements.collect();
        // Noise of the smoothed pitch (about a third of a sample's) moves the vehicle at about 0.35 m/s per rad over about 8 s.
        let colour = Colour {
            rms_m_s: vehicle.background.0,
            correlation_s: vehicle.background.1,
            sensor_m: noise_level::sensor_m(vehicle),
            walk_m2_s: (0.35 * vehicle.sensors.pitch_sigma_rad() / 3.0).powi(2) * 8.0,
        };
        let none: Vec<Vec<bool>> = runs.iter().map(|r| vec![false; r.time_s.len()]).collect();
        let path_m = runs.iter().map(|r| 0.3 * (r.time_s[r.time_s.len() - 1] - r.time_s[0])).collect();
        let mut problem = Self {
            vehicle,
            branch: Branch::of_file(vehicle),
            near_stall_s: vec![0.0; runs.len()],
            attached: vec![Vec::new(); runs.len()],
            near_stall: none.clone(),
            outlier: none.clone(),
            used: none.clone(),
            speed_outlier: none,
            speed_rows: vec![Vec::new(); runs.len()],
            runs,
            colour,
            start: State::nominal(),
            whiteners: Vec::new(),
            offsets: Vec::new(),
            data: Vec::new(),
            path_m,
            displacements,
            stretches: Vec::new(),
            moment_noise_factor: 1.0,
            discrepancy: Discrepancy::default(),
            work: Arc::default(),
        };
        // Nothing is left out yet.
        problem.refresh();
        problem
    }

    /// Rebuilds the whitening for a colour.
    pub fn set_colour(&mut self, colour: Colour) {
        self.colour = colour;
        self.whiteners =
            self.runs.iter().zip(&self.used).zip(&self.near_stall).map(|((r, u), b)| Whitener::new(r, u, |i| b[i], &colour)).collect();
        let mut data = Vec::new();
        let mut offsets = Vec::new();
        for k in 0..self.runs.len() {
            offsets.push(data.len());
            let run = self.runs[k];
            self.whiten_run(
                k,
                &|row| run.depth_m[row],
                &|row| run.speed_m_s[row],
                run.displacement_m.map(|d| (d.0, d.1)),
                |late| run.surface[late].map(|s| s.1),
                &mut data,
            );
            self.whiten_battery_seen(k, &mut data);
        }
        offsets.push(data.len());
        for displacement in &self.displacements {
            let (east, north, gps_m) = displacement.displacement_m;
            self.whiten_displacement(displacement.runs.clone(), gps_m, (east, north), &mut data);
        }
        self.offsets = offsets;
        self.data = data;
        self.whiten_discrepancy();
    }

    /// A stretch of a whitened vector as a column.
    #[must_use]
    pub fn column(&self, from: usize, values: Vec<f64>) -> Column {
        let shadow = self.discrepancy.shadow(from, &values);
        Column::with_shadow(from, values, shadow)
    }

    /// What a state leaves of the observations, whitened.
    #[must_use]
    pub fn residual(&self, model: &[f64]) -> Column {
        self.column(0, self.data.iter().zip(model).map(|(d, m)| d - m).collect())
    }

    fn whiten_run(
        &self,
        k: usize,
        depth: &dyn Fn(usize) -> f64,
        speed: &dyn Fn(usize) -> f64,
        displacement: Option<(f64, f64)>,
        surface: impl Fn(usize) -> Option<f64>,
        out: &mut Vec<f64>,
    ) {
        self.whiteners[k].whiten(depth, out);
        let run = self.runs[k];
        let sigma = self.vehicle.sensors.speed_noise_m_s;
        out.extend(self.speed_rows[k].iter().map(|rows| {
            let n = rows.len() as f64;
            rows.iter().map(|&row| speed(row)).sum::<f64>() / (n.sqrt() * sigma)
        }));
        if let (Some((_, _, gps_m)), Some(d)) = (run.displacement_m, displacement) {
            self.whiten_displacement(k..k + 1, gps_m, d, out);
        }
        for late in 0..2 {
            if let (Some((_, _, n)), Some(p)) = (run.surface[late], surface(late)) {
                let s = &self.vehicle.sensors;
                let noise = (s.pressure_noise_pa.powi(2) + s.pressure_resolution_pa.powi(2) / 12.0) / n as f64;
                out.push(p / (noise + MEAN_SURFACE_ERROR_PA * MEAN_SURFACE_ERROR_PA).sqrt());
            }
        }
    }

    /// What a residual leaves to water and sensors: itself without the most probable model discrepancy.
    #[must_use]
    pub fn innovations(&self, residual: &Column) -> Vec<f64> {
        self.discrepancy.taken_from(residual)
    }

    /// Range of a run in a whitened vector: all of it, and the depth innovations at its start.
    #[must_use]
    pub fn range(&self, k: usize) -> (Range<usize>, usize) {
        (self.offsets[k]..self.offsets[k + 1], self.whiteners[k].len())
    }

    /// What answers are compared with, run by run; ways over several runs together. `leap` is said at [`Seen`].
    #[must_use]
    pub(crate) fn seen(&self, leap: f64) -> Seen<'_> {
        let displacements = self.offsets[self.runs.len()]..self.data.len();
        Seen { runs: (0..self.runs.len()).map(|k| self.range(k).0).chain([displacements]).collect(), data: &self.data, leap }
    }

    /// The rows behind each depth innovation of run `k`.
    #[must_use]
    pub fn rows(&self, k: usize) -> Vec<Vec<usize>> {
        self.whiteners[k].rows().map(<[usize]>::to_vec).collect()
    }

    /// Minus twice the normaliser of the depth likelihood.
    #[must_use]
    pub fn log_scale(&self) -> f64 {
        self.whiteners.iter().map(|w| w.log_scale).sum()
    }

    /// Limits of an effect's size added to what the vehicle file has of it, which may be too much. (An onset is an angle.)
    #[must_use]
    pub fn size_limits(&self, effect: &Effect) -> (f64, f64) {
        let p = &effect.parameters[0];
        let has = self.vehicle.switched_on(effect).filter(|_| effect.onset.is_none()).map_or(0.0, |a| a.values[0] - p.off);
        (p.low - has.max(0.0), p.high - has.min(0.0))
    }

    /// An effect at a start value; what is stated of the flight itself is.
    #[must_use]
    pub fn active(&self, effect: &'static Effect, size: f64) -> Active {
        let mut active = Active::sized(effect, size);
        let of_trial = effect.parameters.iter().position(|p| p.name == "over_days");
        if let Some((k, end_s)) = of_trial.zip(self.runs.last().and_then(|run| run.time_s.last())) {
            active.values[k] = end_s / DAY_S;
        }
        active
    }

    /// Rows that take part in the fit.
    #[must_use]
    pub fn rows_compared(&self) -> usize {
        self.used.iter().flatten().filter(|u| **u).count()
    }
}
