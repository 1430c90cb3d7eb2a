//! The posterior of a hypothesis as Laplace's approximation has it: the most probable state, its curvature and its residual.

use crate::inference::unknowns::HELD;
use crate::likelihood::Column;
use crate::likelihood::jacobian::symmetric;
use crate::model::internal_wave::PARTS;
use crate::model::parameters::State;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The most probable state under a hypothesis.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Where it is.
    pub state: State,
    /// Sum of squares of residuals and of normal priors.
    pub chi2: f64,
    /// Whitened residual; a model discrepancy that the problem knows of is still in it.
    pub residual: Column,
    /// ln det of the curvature (all priors but those of sizes in it).
    pub log_det: f64,
    /// Covariance of all free numbers: calibration, effect parameters in order, wave amplitudes.
    pub covariance: DMatrix<f64>,
    /// 1 sigma of each free parameter of the effects: (effect index, parameter index, sigma).
    pub sigma: Vec<(usize, usize, f64)>,
    /// Columns of all free numbers at the state.
    pub columns: Vec<Column>,
    /// Prior precision of all free numbers.
    pub precision: Vec<f64>,
    /// Means of their normal priors.
    pub centre: Vec<f64>,
    /// Pull that is left on each free number (none on those held by a bound).
    pub gradient: DVector<f64>,
    /// Fall of chi² that the signatures still promised where no step along them led down: a fit at rest has none.
    pub promised: f64,
    /// Sizes that rest at a bound: effect, and the pull outwards, half of the slope of chi² per unit.
    pub pressed: Vec<(usize, f64)>,
}

/// What a fit leaves to more signatures: its residual, its columns and their curvature, priors in it.
pub struct Linearisation<'a> {
    /// The fit.
    pub fit: &'a Fit,
    /// Cholesky factor of its curvature.
    pub curvature: Cholesky<f64, Dyn>,
    /// Its whitened residual.
    pub residual: &'a Column,
}

impl Fit {
    /// Mean square of the innovations, 1 for noise.
    #[must_use]
    pub fn mean_square(&self) -> f64 {
        self.residual.dot(&self.residual) / self.residual.values.len().max(1) as f64
    }

    /// By how much the likelihood pulls the size of an effect beyond the bound at which it rests; 0 where it rests by itself.
    #[must_use]
    pub(crate) fn pressed_by(&self, effect: usize) -> f64 {
        self.pressed.iter().find(|p| p.0 == effect).map_or(0.0, |p| p.1)
    }

    /// What all free numbers of a state near this fit cost by their normal priors, in chi². One that a limit holds does not move: it
    /// costs nothing more.
    #[must_use]
    pub fn cost_of(&self, state: &State) -> f64 {
        let own = self.sigma.iter().map(|&(e, p, _)| state.effects[e].values[p]);
        let waves = state.wave.iter().flat_map(|w| w.amplitude_m_s.iter().flatten().copied());
        let numbers = state.calibration.iter().copied().chain(own).chain(waves);
        let priors = self.centre.iter().zip(&self.precision).map(|(c, p)| (c, if *p < HELD { *p } else { 0.0 }));
        numbers.zip(priors).map(|(x, (centre, precision))| precision * (x - centre).powi(2)).sum()
    }

    /// The fit's state with its free numbers moved by so much each; those of effects stay within their limits.
    #[must_use]
    pub fn moved(&self, by: impl IntoIterator<Item = f64>) -> State {
        let mut state = self.state.clone();
        let mut by = by.into_iter();
        state.calibration.iter_mut().zip(&mut by).for_each(|(z, b)| *z += b);
        for (&(e, p, _), b) in self.sigma.iter().zip(&mut by) {
            let active = &mut state.effects[e];
            let (parameter, from) = (&active.effect.parameters[p], active.values[p]);
            active.values[p] = (from + b).clamp(parameter.low.min(from), parameter.high.max(from));
        }
        let amplitudes = state.wave.iter_mut().flat_map(|w| w.amplitude_m_s.iter_mut().flatten());
        amplitudes.zip(&mut by).for_each(|(a, b)| *a += b);
        state
    }

    /// Sine and cosine amplitude of the fitted wave in each run, m/s, and the sum of their variances; empty without a wave.
    #[must_use]
    pub(crate) fn wave_amplitudes(&self) -> Vec<([f64; 2], f64)> {
        let amplitudes = self.state.wave.as_ref().map_or(&[][..], |w| &w.amplitude_m_s);
        let first = self.covariance.nrows() - PARTS * amplitudes.len();
        let variance = |at: usize| self.covariance[(at, at)] + self.covariance[(at + 1, at + 1)];
        amplitudes.iter().enumerate().map(|(k, &[a, b, ..])| ([a, b], variance(first + PARTS * k))).collect()
    }

    /// What the fit leaves; none where its curvature is not positive.
    #[must_use]
    pub fn linearisation(&self) -> Option<Linearisation<'_>> {
        let n = self.columns.len();
        let mut curvature = symmetric(n, |i, j| self.columns[i].dot(&self.columns[j]));
        for i in 0..n {
            curvature[(i, i)] = (curvature[(i, i)] + self.precision[i]).max(1e-12) * (1.0 + 1e-9);
        }
        Some(Linearisation { fit: self, curvature: curvature.cholesky()?, residual: &self.residual })
    }
}
