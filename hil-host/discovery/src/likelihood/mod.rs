//! What is fitted to what: the unknowns, the observations of the fit segments, and the model's answer to them, whitened.
//!
//! Unknowns: the calibration numbers in units of their own tolerance (a unit normal prior each, those of the moments in pitch with a
//! wide tail), the parameters of the effects on trial, and for an internal wave two amplitudes per run. Observations: depth (whitened
//! by [`crate::likelihood::whitening`]), speed through the water, GPS displacement where no unknown current blurs it, pressure while afloat, and the
//! position of the battery ([`crate::likelihood::battery`]).

pub mod battery;
pub mod block_error;
pub(crate) mod covariates;
pub mod discrepancy;
pub mod displacement;
pub(crate) mod finite_difference;
pub mod jacobian;
pub mod selection;
pub mod stall_mask;
pub mod whitening;

use crate::likelihood::battery::Stretch;
use crate::likelihood::block_error::{Block, block_s, modelled_m_s, rms, sampled_every_s};
use crate::likelihood::covariates::integrated;
use crate::likelihood::discrepancy::{Discrepancy, Predicted};
use crate::likelihood::finite_difference::Seen;
use crate::likelihood::whitening::{Colour, Whitener};
use crate::model::branch::Branch;
use crate::model::dynamics::{Job, Track, port_shift_m, see_from_port};
use crate::model::integrator::tracks;
use crate::model::internal_wave::Kind;
use crate::model::parameters::{PRESSURE_ZERO, PRESSURE_ZERO_PA, SPEED_SCALE, SensorErrors, State, law, sensor_errors};
use crate::preprocess::dives::{MOST_FITTED, evenly};
use crate::preprocess::gps::Way;
use crate::preprocess::{Prepared, Run, SURFACE_M};
use crate::record::seawater::density;
use crate::vehicle::Vehicle;
use hydro::effects::{Active, Constants, DAY_S, Effect};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Most model passes of one search, the half steps that they may take together, and the passes that it may take however long they are.
const MOST_PASSES: u64 = 1000;
const MOST_HALF_STEPS: u64 = 12_000_000;
const FEWEST_PASSES: u64 = 250;
/// Error of a mean surface pressure besides sensor noise (waves, trim), Pa; guess from example flights.
const SURFACE_PA: f64 = 100.0;

/// A stretch of a whitened vector, and what it has in the directions of the model discrepancy.
#[derive(Clone, Debug)]
pub struct Column {
    /// Index of its first element.
    pub from: usize,
    /// Values.
    pub values: Vec<f64>,
    shadow: Vec<f64>,
}

impl Column {
    /// A column under a model discrepancy.
    #[must_use]
    pub(crate) fn within(from: usize, values: Vec<f64>, discrepancy: &Discrepancy) -> Self {
        let shadow = discrepancy.shadow(from, &values);
        Self { from, values, shadow }
    }

    /// Inner product with another column: that of the inverse covariance of water, sensors and discrepancy.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        self.plain_dot(other) - self.shadow.iter().zip(&other.shadow).map(|(a, b)| a * b).sum::<f64>()
    }

    /// What it has in the directions of the model discrepancy: `dot` is `plain_dot` less the product of these.
    pub(crate) fn shadow(&self) -> &[f64] {
        &self.shadow
    }

    /// Inner product without the discrepancy.
    pub(crate) fn plain_dot(&self, other: &Self) -> f64 {
        let from = self.from.max(other.from);
        let to = (self.from + self.values.len()).min(other.from + other.values.len());
        if from >= to {
            return 0.0;
        }
        self.values[from - self.from..to - self.from]
            .iter()
            .zip(&other.values[from - other.from..to - other.from])
            .map(|(a, b)| a * b)
            .sum()
    }
}

/// What a state means: the law of the vehicle, and the errors of its sensors.
struct Stated {
    law: (Constants, Vec<Active>),
    sensors: SensorErrors,
}

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
    pub(crate) way_m: Vec<f64>,
    /// Ways over several fitted runs.
    pub(crate) ways: Vec<Way>,
    /// Median of what the measured density exceeds that of pure water by, kg/m³; none where the water is salt.
    pub fresh_excess_kg_m3: Option<f64>,
    pub(crate) lost_way_s: Vec<f64>,
    /// From when to when the flow of each run is known to attach, s.
    pub(crate) attached: Vec<Vec<(f64, f64)>>,
    pub(crate) brink_at: Vec<Vec<bool>>,
    /// Stretches of each run in which the battery's position is compared, and by how much more than their noise they may be off.
    pub(crate) stretches: Vec<Vec<Stretch>>,
    pub(crate) moment_doubt: f64,
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
        let ways = prepared.ways.iter().filter_map(|way| {
            let from = runs.iter().position(|r| std::ptr::eq(*r, &prepared.runs[way.runs.start]))?;
            let here = from..from + way.runs.len();
            let whole = runs.get(here.clone())?.iter().zip(&prepared.runs[way.runs.clone()]).all(|(a, b)| std::ptr::eq(*a, b));
            whole.then(|| Way { runs: here, ..way.clone() })
        });
        let ways = ways.collect();
        let s = &vehicle.sensors;
        let pascal_per_m = 1015.0 * vehicle.constants.gravity_m_s2;
        let sensor_m = (s.pressure_noise_pa.powi(2) + s.pressure_resolution_pa.powi(2) / 12.0).sqrt() / pascal_per_m;
        // Noise of the smoothed pitch (about a third of a sample's) moves the vehicle at about 0.35 m/s per rad over about 8 s.
        let colour = Colour {
            rms_m_s: vehicle.background.0,
            correlation_s: vehicle.background.1,
            sensor_m,
            walk_m2_s: (0.35 * s.pitch_sigma_rad() / 3.0).powi(2) * 8.0,
        };
        let none: Vec<Vec<bool>> = runs.iter().map(|r| vec![false; r.time_s.len()]).collect();
        let way_m = runs.iter().map(|r| 0.3 * (r.time_s[r.time_s.len() - 1] - r.time_s[0])).collect();
        let mut problem = Self {
            fresh_excess_kg_m3: fresh_excess(&runs),
            vehicle,
            branch: Branch::of_file(vehicle),
            lost_way_s: vec![0.0; runs.len()],
            attached: vec![Vec::new(); runs.len()],
            brink_at: none.clone(),
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
            way_m,
            ways,
            stretches: Vec::new(),
            moment_doubt: 1.0,
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
            self.runs.iter().zip(&self.used).zip(&self.brink_at).map(|((r, u), b)| Whitener::new(r, u, |i| b[i], &colour)).collect();
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
        for way in &self.ways {
            let (east, north, gps_m) = way.displacement_m;
            self.whiten_way(way.runs.clone(), gps_m, (east, north), &mut data);
        }
        self.offsets = offsets;
        self.data = data;
        self.whiten_discrepancy();
    }

    /// A stretch of a whitened vector as a column.
    #[must_use]
    pub fn column(&self, from: usize, values: Vec<f64>) -> Column {
        Column::within(from, values, &self.discrepancy)
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
            self.whiten_way(k..k + 1, gps_m, d, out);
        }
        for late in 0..2 {
            if let (Some((_, _, n)), Some(p)) = (run.surface[late], surface(late)) {
                let s = &self.vehicle.sensors;
                let noise = (s.pressure_noise_pa.powi(2) + s.pressure_resolution_pa.powi(2) / 12.0) / n as f64;
                out.push(p / (noise + SURFACE_PA * SURFACE_PA).sqrt());
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
        let ways = self.offsets[self.runs.len()]..self.data.len();
        Seen { runs: (0..self.runs.len()).map(|k| self.range(k).0).chain([ways]).collect(), data: &self.data, leap }
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

    /// Between what an effect's size may be beside what the vehicle file has of it, which may be too much. (An onset is an angle.)
    #[must_use]
    pub fn size_limits(&self, effect: &dyn Effect) -> (f64, f64) {
        let p = &effect.parameters()[0];
        let has = self.vehicle.switched_on(effect).filter(|_| effect.onset().is_none()).map_or(0.0, |a| a.values[0] - p.off);
        (p.low - has.max(0.0), p.high - has.min(0.0))
    }

    /// An effect at a start value; what is stated of the flight itself is.
    #[must_use]
    pub fn active(&self, effect: &'static dyn Effect, size: f64) -> Active {
        let mut active = Active::sized(effect, size);
        let of_trial = effect.parameters().iter().position(|p| p.name == "over_days");
        if let Some((k, end_s)) = of_trial.zip(self.runs.last().and_then(|run| run.time_s.last())) {
            active.values[k] = end_s / DAY_S;
        }
        active
    }

    /// Constants and effects that a state means.
    #[must_use]
    pub fn law(&self, state: &State) -> (Constants, Vec<Active>) {
        law(self.vehicle, state)
    }

    /// The model's answer to the observations, whitened.
    #[must_use]
    pub fn model(&self, state: &State) -> Vec<f64> {
        self.models(std::slice::from_ref(state)).pop().unwrap_or_default()
    }

    /// The model's answers at several states. Cheaper than one by one: they are simulated side by side, and those that differ in
    /// nothing that is simulated are simulated once.
    #[must_use]
    pub fn models(&self, states: &[State]) -> Vec<Vec<f64>> {
        let laws: Vec<Stated> = states.iter().map(|s| self.stated(s)).collect();
        let mut out: Vec<Vec<f64>> = states.iter().map(|_| Vec::with_capacity(self.data.len())).collect();
        let mut jobs: Vec<Job> = Vec::new();
        // Which job is whose, run by run.
        let mut of: Vec<usize> = Vec::new();
        for k in 0..self.runs.len() {
            let first = jobs.len();
            for law in &laws {
                let job = self.job(k, law);
                let known = jobs[first..].iter().position(|j| j.is(&job)).map(|k| first + k);
                of.push(known.unwrap_or(jobs.len()));
                if known.is_none() {
                    jobs.push(job);
                }
            }
        }
        let tracks = self.simulated(&jobs);
        let job = |k: usize, i: usize| &tracks[of[k * states.len() + i]];
        for k in 0..self.runs.len() {
            for (i, ((state, law), out)) in states.iter().zip(&laws).zip(&mut out).enumerate() {
                self.answer(self.runs[k], k, state, law, job(k, i), out);
            }
        }
        for way in &self.ways {
            for (i, (state, out)) in states.iter().zip(&mut out).enumerate() {
                let parts = way.runs.clone().map(|k| job(k, i).displacement_m);
                let sum = parts.fold((0.0, 0.0), |s, d| (s.0 + d.0, s.1 + d.1));
                self.whiten_way(way.runs.clone(), way.displacement_m.2, self.as_steered(state, sum), out);
            }
        }
        out
    }

    /// The model's answers to run `k` with other inputs, each at its own state.
    #[must_use]
    pub(crate) fn answers_to(&self, k: usize, asked: &[(&State, Run)]) -> Vec<Vec<f64>> {
        let laws: Vec<Stated> = asked.iter().map(|(s, _)| self.stated(s)).collect();
        let jobs: Vec<Job> = asked.iter().zip(&laws).map(|((_, run), law)| Job { run, ..self.job(k, law) }).collect();
        let tracks = self.simulated(&jobs);
        let mut out = Vec::with_capacity(asked.len());
        for (((state, run), law), track) in asked.iter().zip(&laws).zip(&tracks) {
            let mut answer = Vec::new();
            self.answer(run, k, state, law, track, &mut answer);
            out.push(answer);
        }
        out
    }

    /// A track as the sensors show it, whitened.
    fn answer(&self, run: &Run, k: usize, state: &State, stated: &Stated, t: &Track, out: &mut Vec<f64>) {
        let z = &state.calibration;
        let effects = &stated.law.1;
        let port = stated.sensors.port_m;
        let wave = state.wave.as_ref().map(|w| w.depth_m(run, k, self.vehicle));
        let scale = 1.0 + z[SPEED_SCALE] * self.vehicle.sensors.speed_scale_relative;
        let zero = z[PRESSURE_ZERO] * PRESSURE_ZERO_PA;
        // Drift of the pressure zero is read while afloat; it is one effect's business.
        let drift = |time_s: f64| effects.iter().map(|a| a.effect.pressure_error_pa(&a.values, time_s)).sum::<f64>();
        self.whiten_run(
            k,
            &|row| t.depth_m[row] + port_shift_m(run, row, port) + wave.as_ref().map_or(0.0, |w| w[row]),
            &|row| t.speed_m_s[row] * scale,
            Some(self.as_steered(state, t.displacement_m)),
            |late| run.surface[late].map(|s| zero + drift(s.0)),
            out,
        );
        self.whiten_battery_wanted(k, run, state, &stated.law, t, out);
    }

    /// Signatures of a wave of this kind in each run, [`crate::model::internal_wave::PARTS`] columns per run.
    #[must_use]
    pub fn wave_columns(&self, kind: &Kind) -> Vec<Column> {
        let mut out = Vec::new();
        for k in 0..self.runs.len() {
            for part in kind.depths_m(self.runs[k], self.vehicle) {
                out.push(self.depth_column(k, &|row| part[row]));
            }
        }
        out
    }

    /// Scales the rms of the ordinary water motion to what a state leaves, near its nominal value (the format allows 20 %; a
    /// guess in the file may be far off). Its
    /// correlation time likewise. Returns whether either moved by more than 7 % (20 %).
    pub fn tune_colour(&mut self, state: &State) -> bool {
        let missed = |((run, w), depth): ((&&Run, &Whitener), &Vec<f64>)| w.means(|row| run.depth_m[row] - depth[row]);
        let missed: Vec<Vec<f64>> = self.runs.iter().zip(&self.whiteners).zip(&self.depths_m(state)).map(missed).collect();
        let nominal = self.vehicle.background.0;
        let spread = if self.vehicle.assumed.iter().any(|a| a.starts_with("background")) { 1.0 } else { 0.12 };
        // The format allows 20 % either way; smaller than nominal is hardly believed, because other colours look smaller to a filter.
        let allowed = if spread > 0.5 { 0.2..=5.0 } else { 0.9..=1.2 };
        let mut best = (f64::INFINITY, self.colour);
        for (k, j) in (-10..=10_i32).flat_map(|k| (-3..=3_i32).map(move |j| (k, j))) {
            let (factor, stretch) = ((f64::from(k) * spread * 0.2).exp(), (f64::from(j) * 0.12).exp());
            if !allowed.contains(&factor) {
                continue;
            }
            let colour = Colour { rms_m_s: nominal * factor, correlation_s: self.vehicle.background.1 * stretch, ..self.colour };
            let mut cost = (factor.ln() / spread).powi(2) + (stretch.ln() / 0.12).powi(2);
            for (whitener, missed) in self.whiteners.iter().zip(&missed) {
                let w = whitener.coloured(&colour);
                let mut e = Vec::with_capacity(w.len());
                w.whiten_means(missed.iter().copied(), &mut e);
                // Huber: a few rows that no model gets right must not set the scale.
                cost += 2.0 * w.log_scale + e.iter().map(|x| if x.abs() < 3.0 { x * x } else { 6.0 * x.abs() - 9.0 }).sum::<f64>();
            }
            if cost < best.0 {
                best = (cost, colour);
            }
        }
        let moved =
            (best.1.rms_m_s / self.colour.rms_m_s).ln().abs() > 0.07 || (best.1.correlation_s / self.colour.correlation_s).ln().abs() > 0.2;
        if moved {
            self.set_colour(best.1);
        }
        moved
    }

    /// Which of the fitted runs this is; none where it is kept out of the fit.
    fn index_of(&self, run: &Run) -> Option<usize> {
        self.runs.iter().position(|r| r.first_row == run.first_row)
    }

    /// Depth shift of the wave of a state in one of the fitted runs, m.
    #[must_use]
    pub fn wave_shift(&self, run: &Run, state: &State) -> Option<Vec<f64>> {
        let w = state.wave.as_ref()?;
        let k = self.index_of(run)?;
        Some(w.depth_m(run, k, self.vehicle))
    }

    /// Signature of a vertical velocity `rate(run, row)`, m/s positive down, over all runs, whitened.
    #[must_use]
    pub fn rate_column(&self, rate: &dyn Fn(usize, usize) -> f64) -> Column {
        let mut values = vec![0.0; self.data.len()];
        for k in 0..self.runs.len() {
            let depth = self.integrated(k, rate);
            let mut innovations = Vec::new();
            self.whiteners[k].whiten(|row| depth[row], &mut innovations);
            values[self.offsets[k]..self.offsets[k] + innovations.len()].copy_from_slice(&innovations);
        }
        self.column(0, values)
    }

    /// Depth that a vertical velocity makes at each row of a run, m.
    #[must_use]
    pub fn integrated(&self, k: usize, rate: &dyn Fn(usize, usize) -> f64) -> Vec<f64> {
        integrated(self.runs[k], &|row| rate(k, row))
    }

    /// A depth signature in one run, whitened.
    #[must_use]
    pub fn depth_column(&self, k: usize, depth: &dyn Fn(usize) -> f64) -> Column {
        let mut values = Vec::new();
        self.whiteners[k].whiten(depth, &mut values);
        self.column(self.offsets[k], values)
    }

    /// Rows that take part in the fit.
    #[must_use]
    pub fn rows_compared(&self) -> usize {
        self.used.iter().flatten().filter(|u| **u).count()
    }

    /// Usual length of the blocks that errors are formed over, s.
    #[must_use]
    pub fn block_s(&self) -> f64 {
        block_s(sampled_every_s(self.runs.iter().copied()))
    }

    /// Error that the ordinary water motion and the sensor leave in a block, m/s.
    #[must_use]
    pub fn noise_floor_m_s(&self) -> f64 {
        let c = &self.colour;
        let t = self.block_s();
        let n = 40;
        // The least-squares slope of an integral weighs the velocity by 6 x (1 − x) over the block.
        let weight = |i: usize| {
            let x = (i as f64 + 0.5) / n as f64;
            6.0 * x * (1.0 - x) / n as f64
        };
        let mut water = 0.0;
        for i in 0..n {
            for j in 0..n {
                let lag = (i as f64 - j as f64).abs() * t / n as f64;
                water += weight(i) * weight(j) * (-lag / c.correlation_s).exp();
            }
        }
        let period = self.runs.first().map_or(4.0, |r| (r.time_s[r.time_s.len() - 1] - r.time_s[0]) / (r.time_s.len() - 1) as f64);
        // Variance of a slope over m samples: 12 s²/(t² m).
        let sensor = 12.0 * c.sensor_m * c.sensor_m / (t * t * (t / period).max(3.0));
        (c.rms_m_s * c.rms_m_s * water + sensor).sqrt()
    }

    /// Model track of any run for a state (a wave has no known phase outside the fitted runs and is left out).
    #[must_use]
    pub fn track(&self, run: &Run, state: &State) -> Track {
        self.tracks(run, &[state]).pop().unwrap_or_default()
    }

    /// The same at several states.
    #[must_use]
    pub fn tracks(&self, run: &Run, states: &[&State]) -> Vec<Track> {
        let Some(k) = self.index_of(run) else { return self.branch.tracks(run, self.vehicle, states) };
        let laws: Vec<Stated> = states.iter().map(|s| self.stated(s)).collect();
        let mut tracks = self.simulated(&laws.iter().map(|law| self.job(k, law)).collect::<Vec<_>>());
        tracks.iter_mut().zip(&laws).for_each(|(t, law)| see_from_port(run, t, law.sensors.port_m));
        tracks
    }

    /// Half steps simulated so far.
    #[must_use]
    pub fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// Half steps that one search may simulate: so many model passes, of a long flight fewer.
    #[must_use]
    pub fn most_work(&self) -> u64 {
        let pass = self.runs.iter().map(|r| r.inputs.len() as u64).sum::<u64>().max(1);
        (MOST_PASSES * pass).min(MOST_HALF_STEPS.max(FEWEST_PASSES * pass))
    }

    /// Model tracks of all fitted runs at a state.
    #[must_use]
    pub fn fitted_tracks(&self, state: &State) -> Vec<Track> {
        let law = self.stated(state);
        let mut tracks = self.simulated(&(0..self.runs.len()).map(|k| self.job(k, &law)).collect::<Vec<_>>());
        tracks.iter_mut().zip(&self.runs).for_each(|(t, run)| see_from_port(run, t, law.sensors.port_m));
        tracks
    }

    /// Tracks of jobs on the branch in force.
    fn simulated(&self, jobs: &[Job]) -> Vec<Track> {
        self.work.fetch_add(jobs.iter().map(|j| j.run.inputs.len() as u64).sum(), Ordering::Relaxed);
        tracks(jobs, self.vehicle.water_depth_m, self.branch.continuation)
    }

    /// What simulates fitted run `k` under a law.
    fn job<'b>(&'b self, k: usize, stated: &'b Stated) -> Job<'b> {
        let (constants, effects) = &stated.law;
        let (attached, clock_s) = (&self.attached[k], stated.sensors.clock_s);
        Job { run: self.runs[k], constants: *constants, effects: Cow::Borrowed(effects), attached, clock_s }
    }

    fn stated(&self, state: &State) -> Stated {
        Stated { law: self.law(state), sensors: sensor_errors(self.vehicle, state) }
    }

    /// Depths of the fitted runs, a wave's shift included, m.
    #[must_use]
    pub fn depths_m(&self, state: &State) -> Vec<Vec<f64>> {
        let shifted = |(k, track): (usize, Track)| {
            let mut depth = track.depth_m;
            if let Some(w) = &state.wave {
                depth.iter_mut().zip(w.depth_m(self.runs[k], k, self.vehicle)).for_each(|(d, s)| *d += s);
            }
            depth
        };
        self.fitted_tracks(state).into_iter().enumerate().map(shifted).collect()
    }
}

/// Excess over pure water up to which water is taken for fresh, kg/m³: a sensor's bias and a little salt.
const FRESHEST_KG_M3: f64 = 1.5;
/// Samples of each run that are asked.
const ASKED: usize = 60;

/// Median excess of the measured density over pure water's, if it is small enough for fresh water with a biased sensor.
fn fresh_excess(runs: &[&Run]) -> Option<f64> {
    let mut excess: Vec<f64> = runs
        .iter()
        .flat_map(|r| {
            let under = r.inputs.iter().filter(|i| i.depth_m > SURFACE_M);
            under.step_by((r.inputs.len() / ASKED).max(1)).map(|i| {
                let s = &i.sensed;
                s.density_kg_m3 - density(0.0, s.temperature_degc, s.pressure_pa * 1e-4)
            })
        })
        .filter(|e| e.is_finite())
        .collect();
    excess.sort_by(f64::total_cmp);
    excess.get(excess.len() / 2).copied().filter(|e| e.abs() < FRESHEST_KG_M3)
}

/// Longest time over which speed is averaged, s: short against the 10 s in which speed changes.
const SPEED_GROUP_S: f64 = 7.5;

/// Used rows with a speed, neighbours together.
pub(crate) fn speed_groups(run: &Run, used: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for row in (0..run.time_s.len()).filter(|&i| used(i) && run.speed_m_s[i].is_finite()) {
        match groups.last_mut() {
            Some(g) if run.time_s[row] - run.time_s[g[0]] < SPEED_GROUP_S => g.push(row),
            _ => groups.push(vec![row]),
        }
    }
    groups
}

impl Problem<'_> {
    /// Block error of a state over all blocks of the fitted runs, those left out too, m/s.
    #[must_use]
    pub fn fitted_error_m_s(&self, prepared: &Prepared, state: &State) -> f64 {
        let fitted = prepared.runs.iter().enumerate().filter(|(_, run)| self.runs.iter().any(|r| std::ptr::eq(*r, *run)));
        let all: Vec<_> = fitted.map(|(k, run)| (k, crate::likelihood::block_error::blocks(run))).collect();
        block_errors(self, prepared, &[state], &all, true)[0]
    }
}

/// Block errors of several fits (their states and residuals) with their most probable model discrepancy, m/s. A wave's phase is known only in fitted runs.
#[must_use]
pub fn predicted_errors(
    problem: &Problem,
    prepared: &Prepared,
    fits: &[(&State, &Column)],
    blocks: &[(usize, Vec<Block>)],
    with_wave: bool,
) -> Vec<f64> {
    let predicted: Vec<Predicted> = fits.iter().map(|(state, residual)| problem.predicted(state, residual)).collect();
    let states: Vec<&State> = predicted.iter().map(|p| &p.state).collect();
    let shift = |run: &Run, i: usize| problem.discrepancy_m(run, &predicted[i]);
    errors_with(problem, prepared, &states, blocks, with_wave, &shift)
}

/// Block errors of several states, m/s. A wave's phase is known only in fitted runs.
#[must_use]
pub fn block_errors(
    problem: &Problem,
    prepared: &Prepared,
    states: &[&State],
    blocks: &[(usize, Vec<Block>)],
    with_wave: bool,
) -> Vec<f64> {
    errors_with(problem, prepared, states, blocks, with_wave, &|_, _| None)
}

/// The same with a shift of depth of each run and state.
fn errors_with(
    problem: &Problem,
    prepared: &Prepared,
    states: &[&State],
    blocks: &[(usize, Vec<Block>)],
    with_wave: bool,
    shift: &dyn Fn(&Run, usize) -> Option<Vec<f64>>,
) -> Vec<f64> {
    let mut missed: Vec<Vec<f64>> = vec![Vec::new(); states.len()];
    for (k, list) in blocks {
        let run = &prepared.runs[*k];
        for (i, (state, track)) in states.iter().zip(problem.tracks(run, states)).enumerate() {
            let mut depth = track.depth_m;
            let wave = if with_wave { problem.wave_shift(run, state) } else { None };
            for shift in wave.into_iter().chain(shift(run, i)) {
                depth.iter_mut().zip(shift).for_each(|(d, s)| *d += s);
            }
            missed[i].extend(list.iter().map(|b| b.observed_m_s - modelled_m_s(run, b, &depth)));
        }
    }
    missed.into_iter().map(|m| rms(m.into_iter())).collect()
}
