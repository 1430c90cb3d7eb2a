//! Extra columns added to a fit: what the residual would gain by them, everything that is fitted marginalised.

use crate::inference::posterior::Linearisation;
use crate::likelihood::Column;
use crate::likelihood::jacobian::{ln_det, symmetric};
use nalgebra::{DMatrix, DVector};
use std::borrow::Borrow;

/// Extra columns offered to a residual, with what is fitted already projected out.
///
/// Columns that live in one run each make a gram of blocks, of which the projection takes a matrix of low rank: the work grows
/// with the number of runs, not with its cube.
pub struct ProjectedColumns {
    /// Inner products within each group of columns that live on the same stretch; groups do not overlap.
    blocks: Vec<DMatrix<f64>>,
    /// Inner products with the fitted columns, and the curvature of those.
    cross: DMatrix<f64>,
    curvature: DMatrix<f64>,
    /// Match of the columns with the residual.
    pub match_: DVector<f64>,
}

impl ProjectedColumns {
    /// Projects the columns.
    #[must_use]
    pub fn new<C: Borrow<Column>>(extra: &[C], linearisation: &Linearisation) -> Self {
        let base = &linearisation.fit.columns;
        let column = |i: usize| -> &Column { extra[i].borrow() };
        let m = extra.len();
        let end = |c: &Column| c.from + c.values.len();
        // Groups of neighbours; one group where any two of different groups overlap.
        let mut groups: Vec<std::ops::Range<usize>> = Vec::new();
        let mut reach = 0;
        for i in 0..m {
            let apart = column(i).from >= reach;
            reach = reach.max(end(column(i)));
            match groups.last_mut() {
                Some(g) if !apart => g.end = i + 1,
                _ => groups.push(i..i + 1),
            }
        }
        if (1..m).any(|i| column(i).from < column(i - 1).from) {
            groups = std::iter::once(0..m).collect();
        }
        let block = |g: &std::ops::Range<usize>| symmetric(g.len(), |i, j| column(g.start + i).plain_dot(column(g.start + j)));
        // The model discrepancy is projected out as well: it is in the products with what is fitted, and among the columns themselves.
        let (n, d) = (base.len(), linearisation.residual.shadow().len());
        let cross = DMatrix::from_fn(n + d, m, |i, j| if i < n { base[i].dot(column(j)) } else { column(j).shadow()[i - n] });
        // A pull that the fit has left on its own numbers is not to be made good by the extra columns.
        let pulled = linearisation.curvature.solve(&linearisation.fit.gradient);
        let match_ = DVector::from_fn(m, |j, _| column(j).dot(linearisation.residual)) - cross.rows(0, n).transpose() * pulled;
        let l = linearisation.curvature.l();
        let mut curvature = DMatrix::identity(n + d, n + d);
        curvature.view_mut((0, 0), (n, n)).copy_from(&(&l * l.transpose()));
        Self { blocks: groups.iter().map(block).collect(), curvature, cross, match_ }
    }

    /// The whole gram, what is fitted projected out.
    #[must_use]
    pub fn gram(&self) -> DMatrix<f64> {
        let m = self.match_.len();
        let mut gram = DMatrix::zeros(m, m);
        let mut at = 0;
        for b in &self.blocks {
            gram.view_mut((at, at), b.shape()).copy_from(b);
            at += b.nrows();
        }
        if let Some(c) = self.curvature.clone().cholesky() {
            gram -= self.cross.transpose() * c.solve(&self.cross);
        }
        gram
    }

    /// Log Bayes factor for normal amplitudes of this scale.
    #[must_use]
    pub fn log_bayes(&self, scale: f64) -> f64 {
        self.evidence(scale).unwrap_or(f64::NEG_INFINITY)
    }

    /// With M = 1 + s² blocks (block by block), X the cross products and C the curvature:
    /// `1 + s² (blocks − Xᵀ C⁻¹ X) = M − s² Xᵀ C⁻¹ X`, inverted by Woodbury's identity.
    fn evidence(&self, scale: f64) -> Option<f64> {
        let s2 = scale * scale;
        let mut solved = self.match_.clone();
        let mut spread = self.cross.transpose();
        let mut log_det = 0.0;
        let mut at = 0;
        for b in &self.blocks {
            let n = b.nrows();
            let c = (DMatrix::identity(n, n) + b * s2).cholesky()?;
            log_det += ln_det(&c);
            let part = c.solve(&self.match_.rows(at, n));
            solved.rows_mut(at, n).copy_from(&part);
            let part = c.solve(&spread.rows(at, n));
            spread.rows_mut(at, n).copy_from(&part);
            at += n;
        }
        let inner = (&self.curvature - &self.cross * &spread * s2).cholesky()?;
        log_det += ln_det(&inner) - ln_det(&self.curvature.clone().cholesky()?);
        let through = &self.cross * &solved;
        let quadratic = self.match_.dot(&solved) + s2 * through.dot(&inner.solve(&through));
        Some(0.5 * s2 * quadratic - 0.5 * log_det)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::State;

    fn wobble(from: usize, n: usize, seed: f64) -> Column {
        let values = (0..n).map(|i| ((i as f64 + 1.0) * seed).sin() + 0.3 * (i as f64 * seed * 0.37).cos()).collect();
        Column::with_shadow(from, values, Vec::new())
    }

    #[test]
    fn accuracy_the_evidence_of_columns_in_blocks_is_that_of_the_whole_matrix() {
        let n = 60;
        let columns = vec![wobble(0, n, 0.7), wobble(0, n, 1.9)];
        let fit = crate::inference::posterior::Fit {
            state: State::nominal(),
            chi2: 0.0,
            residual: wobble(0, n, 2.6),
            log_det: 0.0,
            covariance: DMatrix::identity(2, 2),
            sigma: Vec::new(),
            columns,
            precision: vec![1.0, 0.5],
            centre: vec![0.0; 2],
            gradient: DVector::from_vec(vec![0.2, -0.1]),
            promised: 0.0,
            pressed: Vec::new(),
        };
        let linearisation = fit.linearisation().expect("positive");
        // Two columns in each of three stretches, and two that live everywhere.
        let apart: Vec<Column> = (0..6).map(|i| wobble(i / 2 * 20, 20, 0.31 * (i as f64 + 1.0))).collect();
        let everywhere = vec![wobble(0, n, 0.11), wobble(5, 40, 0.23)];
        for (extra, blocks) in [(&apart, 3), (&everywhere, 1)] {
            let projected = ProjectedColumns::new(extra, &linearisation);
            assert_eq!(projected.blocks.len(), blocks);
            for scale in [0.1, 1.0, 7.0_f64] {
                let m = extra.len();
                let s2 = scale * scale;
                let whole = (DMatrix::identity(m, m) + projected.gram() * s2).cholesky().expect("positive");
                let direct = 0.5 * s2 * projected.match_.dot(&whole.solve(&projected.match_)) - 0.5 * ln_det(&whole);
                // Rounding only: the two differ in the order of sums.
                assert!(
                    (projected.log_bayes(scale) - direct).abs() < 1e-9 * (1.0 + direct.abs()),
                    "{scale}: {} {direct}",
                    projected.log_bayes(scale)
                );
            }
        }
    }
}
