//! Bounded Gauss–Newton with priors: the most probable state under a hypothesis, its curvature, its misfit.

use crate::inference::posterior::Fit;
use crate::inference::unknowns::{Free, HELD, Unknowns};
use crate::likelihood::finite_difference::LEAP;
use crate::likelihood::jacobian::{Jacobian, ln_det};
use crate::likelihood::{Column, Problem};
use crate::model::parameters::{N_CALIBRATION, State, is_law};
use nalgebra::{DMatrix, DVector};

/// How a fit is run.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most iterations.
    pub iterations: usize,
    /// Whether only the place matters: signatures, curvature and errors are those of the step before.
    pub rough: bool,
}

impl Effort {
    /// At most so many iterations.
    #[must_use]
    pub const fn of(iterations: usize) -> Self {
        Self { iterations, rough: false }
    }
}

/// Relative ridge of a step that is not bounded, which keeps the Cholesky factor positive for a column of zeros; and steps that are tried
/// with ever larger ones.
const LEAST_DAMPING: f64 = 1e-9;
/// Fall of chi² over what signatures promised, within which they are as good as new.
const AS_PROMISED: std::ops::Range<f64> = 0.8..1.25;
const TRIALS: usize = 5;

/// Fits the calibration and the effects of `start`, with signatures taken there.
#[must_use]
pub fn fit_from(problem: &Problem, start: &State, effort: Effort) -> Fit {
    fit(problem, &Jacobian::new(problem, start), start, effort)
}

/// Fits the calibration and the effects of `start`.
#[must_use]
pub fn fit(problem: &Problem, jacobian: &Jacobian, start: &State, effort: Effort) -> Fit {
    let mut descent = Descent::new(problem, jacobian, start);
    for iteration in 0..=effort.iterations {
        let last = descent.settled || iteration == effort.iterations;
        descent.stale |= last && descent.moved_since;
        if descent.stale && !(last && effort.rough) {
            descent.differentiate();
        }
        descent.multiply();
        if last || !descent.step() {
            break;
        }
    }
    descent.finish()
}

/// A fit under way.
struct Descent<'a> {
    problem: &'a Problem<'a>,
    unknowns: Unknowns<'a>,
    state: State,
    chi2: f64,
    residual: Column,
    /// Derivative of the whitened prediction by each unknown, and their inner products.
    columns: Vec<Column>,
    gram: DMatrix<f64>,
    damping: f64,
    /// Whether the effects' own derivatives are of another state and no longer good, and whether there was a step since they were taken.
    stale: bool,
    moved_since: bool,
    /// Whether nothing is left to gain.
    settled: bool,
    /// Fall of chi² that the derivatives promise, where no step led down.
    promised: f64,
}

impl<'a> Descent<'a> {
    fn new(problem: &'a Problem<'a>, jacobian: &Jacobian, start: &State) -> Self {
        let unknowns = Unknowns::new(problem, start);
        let (chi2, residual) = unknowns.objective(start);
        let mut columns = jacobian.columns.clone();
        columns.extend(unknowns.of_effects.iter().map(|_| problem.column(0, vec![0.0; problem.data.len()])));
        columns.extend(start.wave.iter().flat_map(|w| problem.wave_columns(&w.kind)));
        let (n, nc) = (unknowns.len(), N_CALIBRATION);
        let mut gram = DMatrix::zeros(n, n);
        gram.view_mut((0, 0), (nc, nc)).copy_from(&jacobian.gram);
        Self {
            problem,
            unknowns,
            state: start.clone(),
            chi2,
            residual,
            columns,
            gram,
            damping: LEAST_DAMPING,
            stale: true,
            moved_since: false,
            settled: false,
            promised: 0.0,
        }
    }

    /// Takes the derivatives by the effects' own numbers at this state.
    fn differentiate(&mut self) {
        let (problem, state) = (self.problem, &self.state);
        let step = |f: &Free| if state.effects[f.effect].values[f.parameter] + f.step > f.high { -f.step } else { f.step };
        let moved = |f: &Free, by: f64| {
            let mut moved = state.clone();
            moved.effects[f.effect].values[f.parameter] += by;
            moved
        };
        let free = &self.unknowns.of_effects;
        let models = problem.models(&free.iter().map(|f| moved(f, step(f))).collect::<Vec<_>>());
        let seen = problem.seen(LEAP);
        let here: Vec<f64> = problem.data.iter().zip(self.residual.values.iter()).map(|(d, r)| d - r).collect();
        for ((j, f), ahead) in free.iter().enumerate().zip(models) {
            let slope = seen.slope(&here, &ahead, step(f), |back| problem.model(&moved(f, back)));
            self.columns[N_CALIBRATION + j] = problem.column(0, slope);
        }
        (self.stale, self.moved_since) = (false, false);
    }

    /// Inner products of the columns of effects and wave with all others.
    fn multiply(&mut self) {
        for i in N_CALIBRATION..self.unknowns.len() {
            for j in 0..=i {
                let v = self.columns[i].dot(&self.columns[j]);
                self.gram[(i, j)] = v;
                self.gram[(j, i)] = v;
            }
        }
    }

    /// Half of the curvature of chi² and minus half of its gradient, with those at their bounds held there.
    fn normal_equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (n, unknowns) = (self.unknowns.len(), &self.unknowns);
        let mut curvature = self.gram.clone();
        let mut gradient = unknowns.gradient(&self.state, &self.columns, &self.residual);
        for i in 0..n {
            curvature[(i, i)] = (curvature[(i, i)] + unknowns.precision[i] + unknowns.beyond_normal(&self.state, i).2).max(1e-12);
        }
        for i in unknowns.at_bounds(&self.state, &gradient) {
            gradient[i] = 0.0;
            for k in (0..n).filter(|k| *k != i) {
                curvature[(i, k)] = 0.0;
                curvature[(k, i)] = 0.0;
            }
        }
        (curvature, gradient)
    }

    /// One step of Levenberg and Marquardt: the relative ridge that bounds it grows until it is as good as it promises to be. False where
    /// the curvature is not positive.
    fn step(&mut self) -> bool {
        let (curvature, gradient) = self.normal_equations();
        let damped = |damping: f64| {
            let mut curvature = curvature.clone();
            (0..curvature.nrows()).for_each(|i| curvature[(i, i)] *= 1.0 + damping);
            curvature.cholesky().map(|c| c.solve(&gradient))
        };
        let Some(whole) = damped(LEAST_DAMPING) else { return false };
        self.promised = 0.0;
        if gradient.dot(&whole) < 0.05 {
            self.settled = true;
            return true;
        }
        let mut gained = None;
        for _ in 0..TRIALS {
            let Some(move_by) = damped(self.damping) else { break };
            let predicted = 2.0 * gradient.dot(&move_by) - move_by.dot(&(&curvature * &move_by));
            gained = self.try_step(&move_by, predicted);
            if gained.is_some() {
                break;
            }
            self.damping = (self.damping * 8.0).max(0.5);
        }
        // Derivatives of another state may have led nowhere.
        let old = gained.is_none() && self.moved_since && !self.stale;
        self.stale |= old;
        self.settled = gained.unwrap_or(0.0) < 0.1 && !old;
        self.promised = if gained.is_some() { 0.0 } else { gradient.dot(&whole) };
        true
    }

    /// Goes there if chi² is less there, and says by how much; the next step is bounded by how well that was predicted.
    fn try_step(&mut self, move_by: &DVector<f64>, predicted: f64) -> Option<f64> {
        let mut trial = self.state.clone();
        for i in 0..self.unknowns.len() {
            self.unknowns.set(&mut trial, i, self.unknowns.get(&self.state, i) + move_by[i]);
        }
        let (value, residual) = self.unknowns.objective(&trial);
        let gained = self.chi2 - value;
        let ratio = gained / predicted;
        if !(value < self.chi2) {
            return None;
        }
        (self.state, self.chi2, self.residual) = (trial, value, residual);
        self.moved_since = true;
        self.stale = !AS_PROMISED.contains(&ratio);
        if ratio > 0.75 {
            self.damping = (self.damping / 10.0).max(LEAST_DAMPING);
        } else if ratio < 0.25 {
            self.damping = (self.damping * 4.0).max(0.1);
        }
        Some(gained)
    }

    /// The state that was reached, and its errors.
    fn finish(self) -> Fit {
        let Self { unknowns, state, chi2, residual, columns, gram: mut curvature, promised, .. } = self;
        let (n, nc) = (unknowns.len(), N_CALIBRATION);
        for i in 0..n {
            curvature[(i, i)] += unknowns.precision[i] + unknowns.beyond_normal(&state, i).2;
            curvature[(i, i)] = curvature[(i, i)].max(1e-12) * (1.0 + 1e-9);
        }
        let log_det = curvature.clone().cholesky().map_or(f64::INFINITY, |c| ln_det(&c));
        let mut gradient = unknowns.gradient(&state, &columns, &residual);
        let mut precision = unknowns.precision.clone();
        (0..nc).filter(|i| !is_law(*i)).for_each(|i| precision[i] += unknowns.beyond_normal(&state, i).2);
        let mut pressed = Vec::new();
        for i in unknowns.at_bounds(&state, &gradient) {
            if let Some(f) = unknowns.of_effect(i).filter(|f| f.parameter == 0) {
                pressed.push((f.effect, gradient[i].abs()));
            }
            gradient[i] = 0.0;
            // A calibration at its limit does not give way to anything else.
            if i < nc {
                precision[i] = HELD;
                curvature[(i, i)] += HELD;
            }
        }
        // A curvature that is not positive knows no errors: not a number, lest intervals be printed from it.
        let covariance = curvature.cholesky().map_or_else(|| DMatrix::from_element(n, n, f64::NAN), |c| c.inverse());
        let own = unknowns.of_effects.iter().enumerate();
        let sigma = own.map(|(j, f)| (f.effect, f.parameter, covariance[(nc + j, nc + j)].max(0.0).sqrt())).collect();
        let centre = unknowns.centre;
        Fit { state, chi2, residual, log_det, covariance, sigma, columns, precision, centre, gradient, promised, pressed }
    }
}
