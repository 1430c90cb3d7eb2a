//! What the model predicts at a state: tracks of the runs, and the observations as the sensors would show them, whitened.

use super::Problem;
use crate::likelihood::column::Column;
use crate::likelihood::covariates::integrated;
use crate::model::dynamics::{Job, Track, port_shift_m, see_from_port};
use crate::model::integrator::tracks;
use crate::model::internal_wave::Kind;
use crate::model::parameters::{PRESSURE_ZERO, PRESSURE_ZERO_PA, SPEED_SCALE, SensorErrors, State, law, sensor_errors};
use crate::preprocess::Run;
use hydro::effects::{Active, Constants};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::atomic::Ordering;

/// Most model passes of one search, the time that they may simulate together, s, and the passes that it may take however long they are.
const MOST_PASSES: u64 = 2000;
const MOST_SIMULATED_S: f64 = 24e6;
const FEWEST_PASSES: u64 = 250;

/// Tracks that are kept at a time: enough to fill all lanes, and little beside the flight.
const TRACKS_AT_ONCE: usize = 64;

/// What a state means: the law of the vehicle, and the errors of its sensors.
struct Stated {
    law: (Constants, Vec<Active>),
    sensors: SensorErrors,
}

/// The model's answers to some runs: whitened, state by state, and the way of each run at each state, m.
struct Part {
    whitened: Vec<Vec<f64>>,
    ways_m: Vec<(f64, f64)>,
}

impl Problem<'_> {
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
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let at_once = (TRACKS_AT_ONCE / states.len().max(1)).clamp(1, all.len().div_ceil(rayon::current_num_threads()).max(1));
        // Runs on all cores; the result is the same whoever simulates which.
        let flag = logs::stop::flag();
        let parts: Vec<Part> =
            all.par_chunks(at_once).map(|some| logs::stop::heeding(flag.clone(), || self.answers(some, states, &laws))).collect();
        let mut out: Vec<Vec<f64>> = states.iter().map(|_| Vec::with_capacity(self.data.len())).collect();
        // Way of each run at each state, run by run.
        let mut ways_m: Vec<(f64, f64)> = Vec::with_capacity(self.runs.len() * states.len());
        for part in parts {
            out.iter_mut().zip(part.whitened).for_each(|(out, more)| out.extend(more));
            ways_m.extend(part.ways_m);
        }
        for displacement in &self.displacements {
            for (i, (state, out)) in states.iter().zip(&mut out).enumerate() {
                let parts = displacement.runs.clone().map(|k| ways_m[k * states.len() + i]);
                let sum = parts.fold((0.0, 0.0), |s, d| (s.0 + d.0, s.1 + d.1));
                self.whiten_displacement(displacement.runs.clone(), displacement.displacement_m.2, self.as_steered(state, sum), out);
            }
        }
        out
    }

    /// The model's answers to some runs at several states.
    fn answers(&self, some: &[usize], states: &[State], laws: &[Stated]) -> Part {
        let mut jobs: Vec<Job> = Vec::new();
        // Which job is whose, run by run.
        let mut of: Vec<usize> = Vec::new();
        for k in some {
            let first = jobs.len();
            for law in laws {
                let job = self.job(*k, law);
                let known = jobs[first..].iter().position(|j| j.is(&job)).map(|k| first + k);
                of.push(known.unwrap_or(jobs.len()));
                if known.is_none() {
                    jobs.push(job);
                }
            }
        }
        let tracks = self.simulated(&jobs);
        let mut part = Part { whitened: vec![Vec::new(); states.len()], ways_m: Vec::with_capacity(of.len()) };
        for (k, of) in some.iter().zip(of.chunks(states.len().max(1))) {
            for (((state, law), out), job) in states.iter().zip(laws).zip(&mut part.whitened).zip(of) {
                self.answer(self.runs[*k], *k, state, law, &tracks[*job], out);
                part.ways_m.push(tracks[*job].displacement_m);
            }
        }
        part
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
        let drift = |time_s: f64| effects.iter().map(|a| a.effect.pressure_error_pa.map_or(0.0, |f| f(&a.values, time_s))).sum::<f64>();
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

    /// Model tracks of all fitted runs at a state.
    #[must_use]
    pub fn fitted_tracks(&self, state: &State) -> Vec<Track> {
        let law = self.stated(state);
        let mut tracks = self.simulated(&(0..self.runs.len()).map(|k| self.job(k, &law)).collect::<Vec<_>>());
        tracks.iter_mut().zip(&self.runs).for_each(|(t, run)| see_from_port(run, t, law.sensors.port_m));
        tracks
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

    /// Tracks of jobs on the branch in force.
    fn simulated(&self, jobs: &[Job]) -> Vec<Track> {
        let tracks = tracks(jobs, self.vehicle.water_depth_m, self.branch.continuation);
        self.work.fetch_add(tracks.iter().map(|t| t.half_steps).sum(), Ordering::Relaxed);
        tracks
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

    /// Half steps simulated so far.
    #[must_use]
    pub fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// Half steps that one search may simulate: so many model passes, of a long flight fewer.
    #[must_use]
    pub fn most_work(&self) -> u64 {
        let pass = self.runs.iter().map(|r| r.inputs.len() as u64).sum::<u64>().max(1);
        let half_step_s = self.runs.first().map_or(1.0, |r| 0.5 * r.step_s);
        (MOST_PASSES * pass).min(((MOST_SIMULATED_S / half_step_s) as u64).max(FEWEST_PASSES * pass))
    }

    /// A depth signature in one run, whitened.
    #[must_use]
    pub fn depth_column(&self, k: usize, depth: &dyn Fn(usize) -> f64) -> Column {
        let mut values = Vec::new();
        self.whiteners[k].whiten(depth, &mut values);
        self.column(self.offsets[k], values)
    }

    /// Depth that a vertical velocity makes at each row of a run, m.
    #[must_use]
    pub fn integrated(&self, k: usize, rate: &dyn Fn(usize, usize) -> f64) -> Vec<f64> {
        integrated(self.runs[k], &|row| rate(k, row))
    }
}
