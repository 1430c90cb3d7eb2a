//! Model discrepancy: a smooth vertical velocity of unknown small size in the likelihood of every hypothesis (Kennedy and O'Hagan 2001).
//!
//! Nature's law is never quite the one that is fitted. What is left follows depth, leg, turns and roll by some tenths of a centimetre a
//! second on real flights, and on ten thousand rows that would decide between hypotheses that all lack it. So the whitened residual r
//! is not N(0, 1) but
//! ```text
//! δ(t) = Σ w_k b_k(t)    w_k ~ N(0, s² c_k²)      r ~ N(0, 1 + s² Z Zᵀ)
//! (1 + s² Z Zᵀ)⁻¹ = 1 − Pᵀ P       P = L⁻¹ s Zᵀ      L Lᵀ = 1 + s² Zᵀ Z            (Woodbury)
//! ```
//! with Z the basis velocities, integrated to depth and whitened like every column. All inner products of columns are taken in that
//! metric ([`Column::dot`]), so every fit, evidence and test has the term marginalised. What the calibration can follow is projected
//! out of Z first (against its Jacobian with its unit priors, where nothing is named): otherwise s would set the calibration free of
//! what was measured. The size s of each group of the basis is estimated per flight given the best hypothesis
//! (`crate::inference::discrepancy_size`), with a mass of its own at none.
//!
//! Not covered: a discrepancy in speed or displacement; covariates by heading (unknown effects follow it: [`crate::criticism::residual_tests`]).

use crate::likelihood::covariates::{Traits, integrated, traits};
use crate::likelihood::jacobian::{Jacobian, symmetric};
use crate::likelihood::{Column, Problem};
use crate::model::parameters::State;
use crate::preprocess::Run;
use nalgebra::{Cholesky, DVector, Dyn};
use std::sync::Arc;

/// Groups of the basis, each with a size of its own: by depth and leg, by time since the turning point and leg, by roll and leg.
pub const GROUPS: [&str; 3] = ["depth", "time since the last turning point", "roll"];
/// Rms velocity of each group over the rows, m/s.
pub type Sizes = [f64; GROUPS.len()];
/// Hat functions of depth, and decays after a turning point, s.
const DEPTHS: usize = 7;
const DECAYS_S: [f64; 3] = [15.0, 60.0, 200.0];
/// Roll beyond which a reading is a launch or a fault, rad, and the mean square from which a flight rolls at all, rad².
const MOST_ROLL: f64 = 0.5;
const ROLLS: f64 = 1e-4;

/// The term as it is in force.
#[derive(Clone, Debug, Default)]
pub struct Discrepancy {
    /// Rms of the velocity, m/s; 0: none.
    pub size_m_s: f64,
    /// That of each group.
    pub sizes_m_s: Sizes,
    shape: Arc<Shape>,
    /// Where the calibration's Jacobian is projected out.
    around: Option<Arc<State>>,
    /// Whitened basis of unit size, what the calibration can follow taken out.
    unit: Arc<Vec<Vec<f64>>>,
    /// What the calibration follows a unit of each by, in tolerances, before it is scaled back to unit size, and that scale of each group.
    followed: Arc<Vec<DVector<f64>>>,
    scale: Sizes,
    /// P, one row each; empty without the term.
    metric: Arc<Vec<Vec<f64>>>,
    /// Most probable amplitudes of a residual: its products with P through Lᵀ.
    factor: Option<Arc<Cholesky<f64, Dyn>>>,
    /// Half of ln det (1 + s² Z Zᵀ).
    pub half_log_det: f64,
}

fn product(values: &[f64], from: usize, row: &[f64]) -> f64 {
    values.iter().zip(&row[from..]).map(|(a, b)| a * b).sum()
}

impl Discrepancy {
    /// What a stretch of a whitened vector has in the directions of the term.
    pub(crate) fn shadow(&self, from: usize, values: &[f64]) -> Vec<f64> {
        self.metric.iter().map(|row| product(values, from, row)).collect()
    }

    /// Size of the group of basis velocity `k`, m/s.
    fn size(&self, k: usize) -> f64 {
        self.sizes_m_s[self.shape.basis[k].group()]
    }

    /// Group of each basis velocity.
    pub(crate) fn groups(&self) -> Vec<usize> {
        self.shape.basis.iter().map(Basis::group).collect()
    }

    /// Whitened basis of unit size.
    pub(crate) fn unit(&self) -> &[Vec<f64>] {
        &self.unit
    }

    fn sized(&mut self, sizes_m_s: Sizes) {
        let total = sizes_m_s.iter().map(|s| s * s).sum::<f64>().sqrt();
        (self.size_m_s, self.sizes_m_s, self.half_log_det, self.factor) = (total, sizes_m_s, 0.0, None);
        self.metric = Arc::new(Vec::new());
        if !(total > 0.0) {
            return;
        }
        let z = &self.unit;
        let size: Vec<f64> = (0..z.len()).map(|k| self.size(k)).collect();
        let square = |i: usize, j: usize| if size[i] * size[j] == 0.0 { 0.0 } else { size[i] * size[j] * product(&z[i], 0, &z[j]) };
        let gram = symmetric(z.len(), |i, j| square(i, j) + if i == j { 1.0 } else { 0.0 });
        let Some(factor) = gram.cholesky() else {
            (self.size_m_s, self.sizes_m_s) = (0.0, Sizes::default());
            return;
        };
        let l = factor.l();
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(z.len());
        for i in 0..z.len() {
            let mut row: Vec<f64> = z[i].iter().map(|v| size[i] * v).collect();
            for (j, before) in rows.iter().enumerate() {
                row.iter_mut().zip(before).for_each(|(r, b)| *r -= l[(i, j)] * b);
            }
            row.iter_mut().for_each(|r| *r /= l[(i, i)]);
            rows.push(row);
        }
        self.half_log_det = l.diagonal().iter().map(|d| d.ln()).sum();
        (self.metric, self.factor) = (Arc::new(rows), Some(Arc::new(factor)));
    }

    /// Most probable amplitudes of a residual: ŵ = (L Lᵀ)⁻¹ s Zᵀ r = L⁻ᵀ P r.
    fn amplitudes(&self, residual: &Column) -> Option<DVector<f64>> {
        let mut w = DVector::from_vec(self.shadow(residual.from, &residual.values));
        self.factor.as_ref()?.l().tr_solve_lower_triangular_mut(&mut w);
        Some(w)
    }

    /// A residual without its most probable discrepancy: what is left for the water and the sensors.
    pub(crate) fn taken_from(&self, residual: &Column) -> Vec<f64> {
        let mut left = residual.values.to_vec();
        let Some(w) = self.amplitudes(residual) else { return left };
        for (k, (z, w)) in self.unit.iter().zip(w.iter()).enumerate() {
            let w = w * self.size(k);
            left.iter_mut().zip(&z[residual.from..]).for_each(|(r, z)| *r -= w * z);
        }
        left
    }
}

/// A variable that what remains follows.
#[derive(Clone, Debug, PartialEq)]
pub struct Remains {
    /// The variable.
    pub variable: &'static str,
    /// On which leg: dive or climb.
    pub phase: &'static str,
    /// Rms velocity over the rows, m/s.
    pub size_m_s: f64,
}

/// Least rms velocity that is told of, m/s: half of the smallest discrepancy that real flights show.
const REPORTED_M_S: f64 = 0.00025;

/// The covariate of one basis velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Covariate {
    /// A hat function of depth.
    Depth(usize),
    /// Decay after a turning point, s.
    Turn(f64),
    /// Roll.
    Roll,
    /// Its magnitude.
    RollEitherWay,
}

/// One basis velocity: it lives on dives or on climbs.
#[derive(Clone, Copy, Debug)]
struct Basis {
    covariate: Covariate,
    down: bool,
    /// Factor that gives its group unit variance, and the mean square velocity of a unit of it then.
    scale: f64,
    power: f64,
}

impl Basis {
    fn group(&self) -> usize {
        match self.covariate {
            Covariate::Depth(_) => 0,
            Covariate::Turn(_) => 1,
            Covariate::Roll | Covariate::RollEitherWay => 2,
        }
    }

    /// Velocity at a row of a run, m/s.
    fn rate(&self, of: &Traits, depth_of_deepest: &[f64], row: usize) -> f64 {
        if of.down[row] != self.down {
            return 0.0;
        }
        let roll = || of.roll[row].clamp(-MOST_ROLL, MOST_ROLL);
        self.scale
            * match self.covariate {
                Covariate::Depth(bin) => (1.0 - (depth_of_deepest[row] * (DEPTHS - 1) as f64 - bin as f64).abs()).max(0.0),
                Covariate::Turn(decay_s) => (-of.since_turn_s[row] / decay_s).exp(),
                Covariate::Roll => roll(),
                Covariate::RollEitherWay => roll().abs(),
            }
    }
}

/// The basis and the depth that hat functions of depth reach to, m.
#[derive(Clone, Debug, Default)]
struct Shape {
    basis: Vec<Basis>,
    deepest_m: f64,
}

impl Shape {
    /// Depth that a unit of each basis velocity makes at each row of a run, m.
    fn depths_m(&self, problem: &Problem, run: &Run) -> Vec<Vec<f64>> {
        let (of, depth) = (traits(run), self.depth(problem, run));
        self.basis.iter().map(|b| integrated(run, &|row| b.rate(&of, &depth, row))).collect()
    }

    /// Depth at each row as a share of the deepest.
    fn depth(&self, problem: &Problem, run: &Run) -> Vec<f64> {
        let g = problem.vehicle.constants.gravity_m_s2;
        (0..run.time_s.len()).map(|row| run.depth_at_row(row, g) / self.deepest_m).collect()
    }

    fn of(problem: &Problem) -> Self {
        let g = problem.vehicle.constants.gravity_m_s2;
        let deepest = |run: &&Run| (0..run.time_s.len()).map(|row| run.depth_at_row(row, g)).fold(1.0, f64::max);
        let mut out = Self { basis: Vec::new(), deepest_m: problem.runs.iter().map(deepest).fold(1.0, f64::max) };
        let covariates: Vec<Covariate> = (0..DEPTHS)
            .map(Covariate::Depth)
            .chain(DECAYS_S.map(Covariate::Turn))
            .chain([Covariate::Roll, Covariate::RollEitherWay])
            .collect();
        let all = [true, false].into_iter().flat_map(|down| covariates.iter().map(move |c| (down, *c)));
        let mut basis: Vec<Basis> = all.map(|(down, covariate)| Basis { covariate, down, scale: 1.0, power: 0.0 }).collect();
        let (mut rows, mut roll) = (0, 0.0);
        for run in &problem.runs {
            let (of, depth) = (traits(run), out.depth(problem, run));
            for row in (0..run.time_s.len()).filter(|&row| run.used[row]) {
                rows += 1;
                roll += of.roll[row].clamp(-MOST_ROLL, MOST_ROLL).powi(2);
                basis.iter_mut().for_each(|b| b.power += b.rate(&of, &depth, row).powi(2));
            }
        }
        let n = f64::from(rows.max(1));
        basis.retain(|b| GROUPS[b.group()] != "roll" || roll / n > ROLLS);
        let power = |group: usize| basis.iter().filter(|b| b.group() == group).map(|b| b.power / n).sum::<f64>();
        out.basis = basis
            .iter()
            .map(|b| {
                let square = 1.0 / power(b.group());
                Basis { scale: square.sqrt(), power: square * b.power / n, ..*b }
            })
            .filter(|b| b.scale.is_finite() && b.power > 0.0)
            .collect();
        out
    }
}

/// What the most probable discrepancy of a fit predicts: the state with what the calibration would have followed taken out, and the
/// amplitudes of the basis.
pub(crate) struct Predicted {
    pub(crate) state: State,
    pub(crate) amplitudes: Vec<f64>,
}

impl Problem<'_> {
    /// Whitens the basis anew, where rows or whitening have changed.
    pub(crate) fn whiten_discrepancy(&mut self) {
        let Some(around) = self.discrepancy.around.clone() else { return };
        let sizes = self.discrepancy.sizes_m_s;
        // The Jacobian is that of the observations alone.
        self.discrepancy.sized(Sizes::default());
        let mut unit: Vec<Vec<f64>> = Vec::new();
        let shape = self.discrepancy.shape.clone();
        unit.resize_with(shape.basis.len(), || vec![0.0; self.data.len()]);
        for k in 0..self.runs.len() {
            for (values, depth) in unit.iter_mut().zip(shape.depths_m(self, self.runs[k])) {
                let column = self.depth_column(k, &|row| depth[row]);
                values[column.from..column.from + column.values.len()].copy_from_slice(&column.values);
            }
        }
        let groups = self.discrepancy.groups();
        let power = |unit: &[Vec<f64>]| -> Sizes {
            std::array::from_fn(|g| {
                let of_group = unit.iter().zip(&groups).filter(|(_, group)| **group == g);
                of_group.flat_map(|(z, _)| z).map(|v| v * v).sum::<f64>()
            })
        };
        let before = power(&unit);
        let base = Jacobian::new(self, &around).columns;
        let mut curvature = symmetric(base.len(), |i, j| base[i].dot(&base[j]));
        (0..base.len()).for_each(|i| curvature[(i, i)] = (curvature[(i, i)] + 1.0) * (1.0 + 1e-9));
        let Some(curvature) = curvature.cholesky() else {
            self.discrepancy.unit = Arc::new(Vec::new());
            return;
        };
        let mut followed = Vec::with_capacity(unit.len());
        for z in &mut unit {
            let cross = DVector::from_iterator(base.len(), base.iter().map(|c| product(&c.values, c.from, z)));
            let by = curvature.solve(&cross);
            for (c, b) in base.iter().zip(by.iter()) {
                z[c.from..].iter_mut().zip(c.values.iter()).for_each(|(z, v)| *z -= b * v);
            }
            followed.push(by);
        }
        // The size is that of what is left.
        let left = power(&unit);
        let scale: Sizes = std::array::from_fn(|g| {
            let scale = (before[g] / left[g]).sqrt();
            if scale.is_finite() { scale } else { 1.0 }
        });
        unit.iter_mut().zip(&groups).for_each(|(z, g)| z.iter_mut().for_each(|v| *v *= scale[*g]));
        (self.discrepancy.unit, self.discrepancy.followed, self.discrepancy.scale) = (Arc::new(unit), Arc::new(followed), scale);
        self.discrepancy.sized(sizes);
    }

    /// The term around where nothing is named, of no size yet.
    pub(crate) fn prepare_discrepancy(&mut self, nothing_named: &State) {
        if self.runs.is_empty() {
            return;
        }
        if self.discrepancy.shape.basis.is_empty() {
            self.discrepancy.shape = Arc::new(Shape::of(self));
        }
        self.discrepancy.around = Some(Arc::new(nothing_named.clone()));
        self.whiten_discrepancy();
    }

    /// Puts the term in force with a size of each group, m/s.
    pub(crate) fn set_discrepancy(&mut self, sizes_m_s: Sizes) {
        self.discrepancy.sized(sizes_m_s);
    }

    /// The model with the most probable discrepancy of a fit: its state and its residual.
    pub(crate) fn predicted(&self, state: &State, residual: &Column) -> Predicted {
        let d = &self.discrepancy;
        let mut state = state.clone();
        let Some(w) = d.amplitudes(residual) else { return Predicted { state, amplitudes: Vec::new() } };
        let unit: Vec<f64> = d.groups().iter().map(|g| d.sizes_m_s[*g] * d.scale[*g]).collect();
        for ((w, by), unit) in w.iter().zip(d.followed.iter()).zip(&unit) {
            state.calibration.iter_mut().zip(by.iter()).for_each(|(z, b)| *z -= unit * w * b);
        }
        Predicted { state, amplitudes: w.iter().zip(&unit).map(|(w, unit)| unit * w).collect() }
    }

    /// Depth that a predicted discrepancy makes at each row of a run, m.
    pub(crate) fn discrepancy_m(&self, run: &Run, predicted: &Predicted) -> Option<Vec<f64>> {
        if predicted.amplitudes.is_empty() {
            return None;
        }
        let mut sum = vec![0.0; run.time_s.len()];
        for (depth, w) in self.discrepancy.shape.depths_m(self, run).iter().zip(&predicted.amplitudes) {
            sum.iter_mut().zip(depth).for_each(|(s, d)| *s += w * d);
        }
        Some(sum)
    }

    /// What the most probable discrepancy of a residual follows, largest first.
    pub(crate) fn discrepancy_by_group(&self, residual: &Column) -> Vec<Remains> {
        let d = &self.discrepancy;
        let Some(w) = d.amplitudes(residual) else { return Vec::new() };
        let mut out: Vec<Remains> = Vec::new();
        for (w, basis) in w.iter().zip(&d.shape.basis) {
            let size = w.abs() * d.sizes_m_s[basis.group()] * basis.power.sqrt();
            let (variable, phase) = (GROUPS[basis.group()], if basis.down { "dive" } else { "climb" });
            match out.iter_mut().find(|r| (r.variable, r.phase) == (variable, phase)) {
                Some(r) => r.size_m_s = r.size_m_s.hypot(size),
                None => out.push(Remains { variable, phase, size_m_s: size }),
            }
        }
        out.retain(|r| r.size_m_s > REPORTED_M_S);
        out.sort_by(|a, b| b.size_m_s.total_cmp(&a.size_m_s));
        out
    }
}

/// The metric of a term of this size over columns of their own, for tests of it.
#[cfg(test)]
pub(crate) fn of_columns(unit: Vec<Vec<f64>>, size_m_s: f64) -> Discrepancy {
    let basis = Basis { covariate: Covariate::Depth(0), down: true, scale: 1.0, power: 1.0 };
    let shape = Shape { basis: vec![basis; unit.len()], deepest_m: 1.0 };
    let mut d = Discrepancy { unit: Arc::new(unit), shape: Arc::new(shape), ..Discrepancy::default() };
    d.sized([size_m_s, 0.0, 0.0]);
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn wobble(n: usize, seed: f64) -> Vec<f64> {
        (0..n).map(|i| ((i as f64 + 1.0) * seed).sin() + 0.3 * (i as f64 * seed * 0.37).cos()).collect()
    }

    /// Woodbury against the dense inverse and determinant of 1 + s² Z Zᵀ.
    #[test]
    fn accuracy_inner_products_are_those_of_the_dense_covariance() {
        let n = 40;
        let z: Vec<Vec<f64>> = [0.3, 0.9, 1.7].map(|s| wobble(n, s)).to_vec();
        let size = 0.7;
        let d = of_columns(z.clone(), size);
        let whole =
            DMatrix::from_fn(n, n, |i, j| z.iter().map(|z| size * size * z[i] * z[j]).sum::<f64>() + if i == j { 1.0 } else { 0.0 });
        let dense = whole.cholesky().expect("positive");
        let column = |from: usize, values: Vec<f64>| Column::with_shadow(from, values.clone(), d.shadow(from, &values));
        let full = |c: &Column| DVector::from_fn(n, |i, _| if i < c.from { 0.0 } else { c.values.get(i - c.from).copied().unwrap_or(0.0) });
        let (a, b) = (column(0, wobble(n, 0.51)), column(13, wobble(20, 1.3)));
        let exact = full(&a).dot(&dense.solve(&full(&b)));
        assert!((a.dot(&b) - exact).abs() < 1e-10 * (1.0 + exact.abs()), "{} {exact}", a.dot(&b));
        let log_det: f64 = dense.l().diagonal().iter().map(|d| d.ln()).sum();
        assert!((d.half_log_det - log_det).abs() < 1e-10, "{} {log_det}", d.half_log_det);
        // What is left of a residual that is all discrepancy is what the prior of unit amplitudes keeps of it.
        let left = d.taken_from(&column(0, z[0].clone()));
        let ridge = {
            let zs = DMatrix::from_fn(n, 3, |i, k| size * z[k][i]);
            let gram = zs.transpose() * &zs + DMatrix::identity(3, 3);
            let r = DVector::from_vec(z[0].clone());
            &r - &zs * gram.cholesky().expect("positive").solve(&(zs.transpose() * &r))
        };
        assert!(left.iter().zip(ridge.iter()).all(|(a, b)| (a - b).abs() < 1e-10));
    }
}
