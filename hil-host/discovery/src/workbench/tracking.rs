//! What each dive of a mission says of drag, lift, trim, pitch zero, compressibility and pressure zero, as [`Information`].
//!
//! All other numbers are held: those of the vehicle at its file's values, clocks and lags at what the first dives of the mission say. Each
//! dive is one small Gauss–Newton fit of the six that starts where the dive before ended, so a mission of hundreds of dives costs a few
//! dozen model passes a dive, and nothing of a dive is kept but 6 + 21 numbers.

use crate::diagnosis::settle::estimate_anew;
use crate::diagnosis::{NothingToFit, prepared_problem};
use crate::hypotheses::candidate::fit_named;
use crate::likelihood::finite_difference::LEAP;
use crate::likelihood::whitening::Colour;
use crate::likelihood::{Column, Problem};
use crate::model::branch::Branch;
use crate::model::parameters::{self, N_LAW, PRESSURE_ZERO, State, set_tolerance, tolerance_of};
use crate::preprocess::{Prepared, Run};
use crate::workbench::calibrate::information_of;
use crate::workbench::pooling::Information;
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};

/// One number that is followed from dive to dive.
#[derive(Clone, Copy, Debug)]
pub struct Tracked {
    /// Name in tables and documents.
    pub name: &'static str,
    /// Unit there.
    pub unit: &'static str,
    /// Calibration number.
    pub index: usize,
    /// One step of it, in the unit: about five times what it scatters by from dive to dive. A guess, from which the scatter is learned.
    pub step: f64,
    /// Factor from the unit of the calibration number's tolerance.
    factor: f64,
}

impl Tracked {
    /// So much of the calibration number, in its own measure, in steps.
    pub(crate) fn in_steps(&self, amount: f64) -> f64 {
        amount * self.factor / self.step
    }
}

/// Number of them.
pub const N: usize = 6;
/// Where each stands in [`TRACKED`].
pub const AT_DRAG: usize = 0;
/// Linear lift.
pub const AT_LIFT: usize = 1;
/// Constant volume.
pub const AT_TRIM: usize = 2;
/// Zero of the pitch sensor.
pub const AT_PITCH_ZERO: usize = 3;
/// Compressibility of the hull.
pub const AT_COMPRESSIBILITY: usize = 4;
/// Zero of the pressure sensor.
pub const AT_PRESSURE: usize = 5;

/// What is followed: levels are relative to the vehicle file's, 0 where nothing has changed.
pub const TRACKED: [Tracked; N] = [
    Tracked { name: "drag", unit: "%", index: parameters::DRAG, step: 10.0, factor: 100.0 },
    Tracked { name: "lift", unit: "%", index: parameters::LIFT_SLOPE, step: 20.0, factor: 100.0 },
    Tracked { name: "trim", unit: "cm3", index: parameters::TRIM_VOLUME, step: 10.0, factor: 1.0 },
    Tracked { name: "pitch_zero", unit: "deg", index: parameters::PITCH_ZERO, step: 0.5, factor: 57.295_779_513_082_32 },
    Tracked { name: "compressibility", unit: "%", index: parameters::HULL_COMPRESSIBILITY, step: 20.0, factor: 100.0 },
    Tracked { name: "pressure_zero", unit: "dbar", index: PRESSURE_ZERO, step: 0.15, factor: 1e-4 },
];

/// Tolerances under which a dive is fitted, in tolerances of the step: what a step's finite difference is taken by, no prior.
const WIDE: f64 = 1.0;
/// Dives at the start of a mission that clocks, lags and the noise of the water are taken from.
pub const REFERENCE_DIVES: usize = 8;
/// Least rows of a dive, and steps of its fit.
const FEWEST_ROWS_OF_A_DIVE: usize = 30;
const DIVE_FIT_STEPS: usize = 6;
/// Precision, per step², of the prior that keeps a number of which a dive says little near the start of the mission, so that the fit stays
/// where its linearisation holds: drag and trim follow the dive, lift, compressibility and zeros by a third, two fifths, a degree, 0.3 dbar.
/// It is not in what is kept of a dive.
const TETHER: [f64; N] = [0.01, 0.4, 0.01, 0.25, 0.25, 0.25];
/// Trim of a deployment about that of the one before, 1 sigma at least, m³: a tank and a scale. A guess.
const RETRIMMED_M3: f64 = 1e-5;
/// Innovations beyond this are outliers, sigma.
const OUTLIER: f64 = 5.0;

/// The vehicle as dives are compared with it, and what the first dives say of everything that is held.
#[derive(Clone, Debug)]
pub struct Reference {
    vehicle: Vehicle,
    held: State,
    colour: Colour,
    branch: Branch,
    /// Rms velocity that the model is wrong by, m/s.
    pub discrepancy_m_s: f64,
}

/// One dive.
#[derive(Clone, Debug)]
pub struct Dive {
    /// What it says of the tracked numbers, in their steps.
    pub information: Information,
    /// Segment in its flight.
    pub segment: u32,
    /// Begin and end, s since the first row of its flight.
    pub time_s: [f64; 2],
    /// Deepest point, m.
    pub depth_m: f64,
    /// Mean pitch of its dive and of its climb, rad; NaN where there is none.
    pub pitch_rad: [f64; 2],
    /// Rows compared.
    pub rows: usize,
    /// Mean square of its innovations, 1 for noise.
    pub misfit: f64,
}

/// Precision of the vehicle file's tolerances for the tracked numbers, per step²: what is known of the start of a mission.
#[must_use]
pub fn start_precision(vehicle: &Vehicle) -> [f64; N] {
    std::array::from_fn(|k| {
        let t = &TRACKED[k];
        let stated = tolerance_of(vehicle, t.index).max(1e-9) * t.factor / t.step;
        // A vehicle is trimmed anew for each deployment, whatever the file says of the last, and its pressure port floats where it floats.
        if k == AT_TRIM || k == AT_PRESSURE { TETHER[k] } else { stated.powi(-2) }
    })
}

/// The vehicle with the tracked numbers' tolerances at one step each: states are then in steps.
fn in_steps(vehicle: &Vehicle) -> Vehicle {
    let mut out = vehicle.clone();
    (out.fit_segments, out.check_segments) = (Vec::new(), Vec::new());
    for t in TRACKED.iter().filter(|t| t.index != PRESSURE_ZERO) {
        set_tolerance(&mut out, t.index, WIDE * t.step / t.factor);
    }
    out
}

/// The vehicle with no segments of its own, and trimmed anew: a mission has other dives than the flights that it was calibrated on.
#[must_use]
pub fn for_missions(vehicle: &Vehicle) -> Vehicle {
    let mut out = vehicle.clone();
    (out.fit_segments, out.check_segments) = (Vec::new(), Vec::new());
    out.tolerance.trim_volume_m3 = out.tolerance.trim_volume_m3.max(RETRIMMED_M3);
    out
}

impl Reference {
    /// Of the first dives of a mission, made ready together.
    ///
    /// # Errors
    /// No dive that a model could be compared with.
    pub fn of(vehicle: &Vehicle, first: &Prepared, name: &str) -> Result<Self, NothingToFit> {
        let vehicle = for_missions(vehicle);
        let named = Flight { name: name.to_owned(), ..Flight::default() };
        let mut notes = Vec::new();
        let (mut problem, _) = prepared_problem(&named, &vehicle, first, &[], &mut notes)?;
        let (fit, _) = fit_named(&problem, &[]);
        problem.prepare_discrepancy(&fit.state);
        estimate_anew(&mut problem, &fit);
        let fit = crate::diagnosis::settle::settled(&problem, &fit.state);
        let tracked = in_steps(&vehicle);
        let mut held = State::nominal();
        held.calibration[N_LAW..].copy_from_slice(&fit.state.calibration[N_LAW..]);
        // Where the fit of the first dive starts: tolerances become steps.
        for t in &TRACKED {
            held.calibration[t.index] = fit.state.calibration[t.index] * tolerance_of(&vehicle, t.index) / tolerance_of(&tracked, t.index);
        }
        Ok(Self { vehicle: tracked, held, colour: problem.colour, branch: problem.branch, discrepancy_m_s: problem.discrepancy.size_m_s })
    }

    /// The state at which the next dive's fit starts.
    #[must_use]
    pub fn start(&self) -> State {
        self.held.clone()
    }

    /// What one run of a flight says, and the state that its fit ends at. None where too little of it can be compared.
    #[must_use]
    pub fn dive(&self, prepared: &Prepared, run: &Run, start: &State) -> Option<(Dive, State)> {
        self.dive_and(prepared, run, start, |_| ()).map(|(dive, state, ())| (dive, state))
    }

    /// The same, and what `more` makes of the fit.
    pub(crate) fn dive_and<T>(
        &self,
        prepared: &Prepared,
        run: &Run,
        start: &State,
        more: impl FnOnce(&DiveFit) -> T,
    ) -> Option<(Dive, State, T)> {
        let alone = Prepared {
            runs: vec![run.clone()],
            displacements: Vec::new(),
            notes: Vec::new(),
            has_temperature: prepared.has_temperature,
            clock_shift_s: None,
        };
        let mut problem = Problem::new(&alone, &self.vehicle, |_| true);
        if problem.rows_compared() < FEWEST_ROWS_OF_A_DIVE {
            return None;
        }
        problem.branch = self.branch;
        problem.set_colour(self.colour);
        let near = &self.held;
        let mut state = fitted(&problem, start, near)?;
        problem.settle_continuation(&state);
        problem.drop_outliers(&problem.residual(&problem.model(&state)).values, OUTLIER);
        if problem.rows_compared() < FEWEST_ROWS_OF_A_DIVE {
            return None;
        }
        state = fitted(&problem, &state, near)?;
        let (columns, residual) = linearised(&problem, &state);
        let at: Vec<f64> = TRACKED.iter().map(|t| state.calibration[t.index]).collect();
        let information = information_of(&columns.iter().collect::<Vec<_>>(), &residual, &at);
        if !information.matrix.iter().chain(information.vector.iter()).all(|v| v.is_finite()) {
            return None;
        }
        let mean = |down: bool| {
            let rows = run.inputs.iter().filter(|i| i.depth_m > 2.0 && (i.sensed.pitch_rad < 0.0) == down);
            let (sum, n) = rows.fold((0.0, 0.0), |(s, n), i| (s + i.sensed.pitch_rad, n + 1.0));
            sum / n
        };
        let dive = Dive {
            information,
            segment: run.segment,
            time_s: [run.time_s.first().copied()?, run.time_s.last().copied()?],
            depth_m: run.depth_m.iter().copied().fold(0.0, f64::max),
            pitch_rad: [mean(true), mean(false)],
            rows: problem.rows_compared(),
            misfit: residual.dot(&residual) / residual.values.len().max(1) as f64,
        };
        let more = more(&DiveFit { problem: &problem, state: &state, columns: &columns, residual: &residual });
        Some((dive, state, more))
    }
}

/// The fit of one dive: its state, sensitivities to the tracked numbers, per step, and its residual.
pub(crate) struct DiveFit<'p> {
    pub problem: &'p Problem<'p>,
    pub state: &'p State,
    pub columns: &'p [Column],
    pub residual: &'p Column,
}

/// Sensitivities to the tracked numbers, per step, and the residual.
fn linearised(problem: &Problem, at: &State) -> (Vec<Column>, Column) {
    /// Share of a step that a difference is taken over: a hundredth of drag, a cubic centimetre of trim.
    const DIFFERENCE: f64 = 0.1;
    let aside = |index: usize, by: f64| {
        let mut shifted = at.clone();
        shifted.calibration[index] += by;
        shifted
    };
    let states: Vec<State> = std::iter::once(at.clone()).chain(TRACKED.iter().map(|t| aside(t.index, DIFFERENCE))).collect();
    let mut models = problem.models(&states).into_iter();
    let base = models.next().unwrap_or_default();
    let seen = problem.seen(LEAP);
    let columns = TRACKED
        .iter()
        .zip(models)
        .map(|(t, ahead)| {
            let slope = seen.slope(&base, &ahead, DIFFERENCE, |back| problem.model(&aside(t.index, back)));
            let finite = slope.iter().all(|v| v.is_finite());
            problem.column(0, if finite { slope } else { vec![0.0; base.len()] })
        })
        .collect();
    (columns, problem.residual(&base))
}

/// Gauss–Newton with halved steps, tied loosely to the start of the mission. None where the model has no glide.
fn fitted(problem: &Problem, start: &State, near: &State) -> Option<State> {
    let get = |s: &State| DVector::from_iterator(N, TRACKED.iter().map(|t| s.calibration[t.index]));
    let from = get(near);
    let tether = DVector::from_row_slice(&TETHER);
    let pulled = |s: &State| tether.component_mul(&(get(s) - &from));
    let cost_of = |s: &State, residual: &Column| residual.dot(residual) + pulled(s).dot(&(get(s) - &from));
    let mut state = start.clone();
    let (mut columns, mut residual) = linearised(problem, &state);
    let mut cost = cost_of(&state, &residual);
    if !cost.is_finite() {
        return None;
    }
    for _ in 0..DIVE_FIT_STEPS {
        let here = get(&state);
        let matrix = DMatrix::from_fn(N, N, |i, j| columns[i].dot(&columns[j]) + if i == j { TETHER[i] } else { 0.0 });
        let vector = DVector::from_fn(N, |i, _| columns[i].dot(&residual)) - pulled(&state);
        let by = matrix.cholesky()?.solve(&vector);
        let mut share = 1.0;
        let mut gained = 0.0;
        for _ in 0..6 {
            let mut trial = state.clone();
            TRACKED.iter().zip((&here + share * &by).iter()).for_each(|(t, z)| trial.calibration[t.index] = *z);
            let left = problem.residual(&problem.model(&trial));
            let value = cost_of(&trial, &left);
            if value < cost {
                gained = cost - value;
                (state, cost) = (trial, value);
                break;
            }
            share *= 0.4;
        }
        if gained < 0.05 {
            break;
        }
        (columns, residual) = linearised(problem, &state);
    }
    Some(state)
}
