//! What a dive says of the eight numbers: its sufficient summary, and the level of its noise without a law of the noise.

use super::glide::Glider;
use super::numbers::{NUMBERS, Numbers};
use super::rows::{Row, Unit, median};
use nalgebra::{DMatrix, DVector, SMatrix};

/// Information of the numbers.
pub type Information = SMatrix<f64, NUMBERS, NUMBERS>;

/// Best determined directions of a block whose scatter is the noise.
const DIRECTIONS: usize = 4;
/// Degrees of freedom that the vehicle's usual level counts for.
const USUAL_FREEDOM: f64 = 8.0;

/// What a block says: R and z of J = QR, z = Q'(r + J d).
#[derive(Clone, Debug)]
pub struct Block {
    r: DMatrix<f64>,
    z: DVector<f64>,
}

/// A unit's rows linearised at numbers `at`, in sizes beyond the vehicle that it was made for.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Where.
    pub at: Numbers,
    /// Measured less modelled, of every row; outliers are 0.
    pub residual: DVector<f64>,
    /// Derivatives, sizes of the numbers per column; further columns may follow them.
    pub jacobian: DMatrix<f64>,
    /// Rows that count.
    pub kept: Vec<bool>,
    /// Variance of the residual of rows that count.
    pub variance: f64,
    blocks: Vec<Block>,
}

/// Variance of the rows that count.
fn variance(residual: &DVector<f64>, kept: &[bool]) -> f64 {
    let counted = || residual.iter().zip(kept).filter(|(_, kept)| **kept).map(|(r, _)| *r);
    let n = counted().count() as f64;
    let mean = counted().sum::<f64>() / n;
    counted().map(|r| (r - mean).powi(2)).sum::<f64>() / n
}

/// Rows that are no outliers: within five standard deviations of the median of their block, robustly, and 1 mm/s. A changed number
/// shifts whole legs, and makes none of their rows an outlier.
fn inliers(residual: &[f64], unit: &Unit) -> Vec<bool> {
    let of_block = |b: usize| median(unit.rows.iter().zip(residual).filter(|(row, _)| row.block == b).map(|(_, r)| *r));
    let middle: Vec<f64> = (0..unit.blocks()).map(of_block).collect();
    let off = |(row, r): (&Row, &f64)| (r - middle[row.block]).abs();
    let spread = 1.4826 * median(unit.rows.iter().zip(residual).map(off));
    unit.rows.iter().zip(residual).map(|row| off(row) < 5.0 * spread + 1e-3).collect()
}

impl Linear {
    /// Linearises a unit.
    #[must_use]
    pub fn of(unit: &Unit, glider: &Glider, at: &Numbers) -> Self {
        Self::with_columns(unit, glider, at, |_, _, _| DMatrix::zeros(unit.rows.len(), 0))
    }

    /// The same with further columns, made of the modelled velocities, the Jacobian and the rows that count.
    pub fn with_columns(
        unit: &Unit,
        glider: &Glider,
        at: &Numbers,
        further: impl FnOnce(&[f64], &DMatrix<f64>, &[bool]) -> DMatrix<f64>,
    ) -> Self {
        let (rises, derivatives) = glider.linearised(unit, &glider.moved(at));
        let mut residual: Vec<f64> = unit.rows.iter().zip(&rises).map(|(row, w)| row.rise_m_s - w).collect();
        let mut kept = inliers(&residual, unit);
        for ((r, kept), d) in residual.iter().zip(&mut kept).zip(&derivatives) {
            *kept &= r.is_finite() && d.iter().all(|x| x.is_finite());
        }
        residual.iter_mut().zip(&kept).filter(|(_, kept)| !**kept).for_each(|(r, _)| *r = 0.0);
        let numbers = DMatrix::from_fn(residual.len(), NUMBERS, |i, k| if kept[i] { derivatives[i][k] } else { 0.0 });
        let more = further(&rises, &numbers, &kept);
        let jacobian = DMatrix::from_fn(residual.len(), NUMBERS + more.ncols(), |i, k| match k {
            k if k < NUMBERS => numbers[(i, k)],
            k if kept[i] => more[(i, k - NUMBERS)],
            _ => 0.0,
        });
        let residual = DVector::from_vec(residual);
        let of_numbers = &numbers * DVector::from_column_slice(at.as_slice());
        let blocks = (0..unit.blocks()).filter_map(|b| block(unit, b, &jacobian, &(&residual + &of_numbers), &kept)).collect();
        let variance = variance(&residual, &kept);
        Self { at: *at, residual, jacobian, kept, variance, blocks }
    }

    /// Counts its numbers from `origin` from now on.
    pub fn count_from(&mut self, origin: &Numbers) {
        let by = DVector::from_column_slice(origin.as_slice());
        for b in &mut self.blocks {
            b.z -= b.r.columns(0, NUMBERS) * &by;
        }
        self.at -= origin;
    }

    /// Columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.jacobian.ncols()
    }

    /// J'J and J'(r + J d) over all blocks, whatever the noise.
    #[must_use]
    pub fn normal(&self) -> (DMatrix<f64>, DVector<f64>) {
        let q = self.columns();
        self.blocks.iter().fold((DMatrix::zeros(q, q), DVector::zeros(q)), |(n, u), b| (n + b.r.tr_mul(&b.r), u + b.r.tr_mul(&b.z)))
    }

    /// Square root of the summary: triangular R and y with N = R'R and u = R'y.
    #[must_use]
    pub fn root(&self) -> (DMatrix<f64>, DVector<f64>) {
        let q = self.columns();
        let rows: usize = self.blocks.iter().map(|b| b.r.nrows()).sum();
        let mut stacked = DMatrix::zeros(rows.max(q), q + 1);
        let mut first = 0;
        for b in &self.blocks {
            stacked.view_mut((first, 0), b.r.shape()).copy_from(&b.r);
            stacked.view_mut((first, q), (b.z.len(), 1)).copy_from(&b.z);
            first += b.r.nrows();
        }
        let r = stacked.qr().r();
        (r.view((0, 0), (q, q)).into_owned(), r.view((0, q), (q, 1)).column(0).into_owned())
    }

    /// Level of the noise at numbers `d` (further columns behind them): the scatter of the blocks' scores in their best determined
    /// directions, shrunk to the vehicle's usual level, and no less than the variance of the rows.
    #[must_use]
    pub fn level(&self, d: &DVector<f64>, usual: Option<f64>) -> f64 {
        let (mut sum, mut freedom) = (0.0, 0.0);
        for b in &self.blocks {
            let left = &b.z - b.r.columns(NUMBERS, self.columns() - NUMBERS) * d.rows(NUMBERS, d.len() - NUMBERS);
            let left = left - b.r.columns(0, NUMBERS) * d.rows(0, NUMBERS);
            let svd = b.r.columns(0, NUMBERS).into_owned().svd(true, false);
            let Some(u) = svd.u else { continue };
            let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
            order.sort_by(|i, j| svd.singular_values[*j].total_cmp(&svd.singular_values[*i]));
            let largest = svd.singular_values[order[0]];
            for &k in order.iter().take(DIRECTIONS).filter(|k| svd.singular_values[**k].powi(2) > 1e-9 * largest.powi(2)) {
                sum += u.column(k).dot(&left).powi(2);
                freedom += 1.0;
            }
        }
        noise_level(sum, freedom, usual, self.variance)
    }

    /// Level of the noise at the numbers that this unit says itself, priors of one size.
    #[must_use]
    pub fn own_level(&self, usual: Option<f64>) -> f64 {
        let (n, u) = self.normal();
        let q = self.columns();
        let best = |level: f64| {
            let h = &n / level + DMatrix::identity(q, q);
            h.cholesky().map_or_else(|| DVector::zeros(q), |c| c.solve(&(&u / level)))
        };
        let first = self.level(&best(self.variance), usual);
        self.level(&best(first), usual)
    }
}

/// Level of the noise of which the blocks scatter by `sum` in so many directions: shrunk to the usual level, and no less than the
/// variance of the rows.
pub(super) fn noise_level(mut sum: f64, directions: f64, usual: Option<f64>, variance: f64) -> f64 {
    let mut freedom = f64::max(directions - DIRECTIONS as f64, 0.0);
    if let Some(usual) = usual {
        sum += USUAL_FREEDOM * usual;
        freedom += USUAL_FREEDOM;
    }
    (sum / freedom.max(1.0)).max(variance)
}

/// What one block of a unit says; none without a row that counts.
fn block(unit: &Unit, number: usize, jacobian: &DMatrix<f64>, says: &DVector<f64>, kept: &[bool]) -> Option<Block> {
    let rows: Vec<usize> = (0..kept.len()).filter(|i| kept[*i] && unit.rows[*i].block == number).collect();
    if rows.is_empty() {
        return None;
    }
    let q = jacobian.ncols();
    let stacked = DMatrix::from_fn(rows.len(), q + 1, |i, k| if k < q { jacobian[(rows[i], k)] } else { says[rows[i]] });
    let r = stacked.qr().r();
    let n = r.nrows().min(q);
    Some(Block { r: r.view((0, 0), (n, q)).into_owned(), z: r.view((0, q), (n, 1)).column(0).into_owned() })
}

/// A unit's summary over its noise: N and u.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Information of numbers (and of further columns behind them).
    pub n: DMatrix<f64>,
    /// Information times where the numbers are best.
    pub u: DVector<f64>,
}

impl Summary {
    /// Of a linearisation with noise of this level.
    #[must_use]
    pub fn of(linear: &Linear, level: f64) -> Self {
        let (n, u) = linear.normal();
        Self { n: n / level, u: u / level }
    }

    /// Of a square root.
    #[must_use]
    pub fn of_root(r: &DMatrix<f64>, y: &DVector<f64>) -> Self {
        Self { n: r.tr_mul(r), u: r.tr_mul(y) }
    }

    /// The same about numbers that lie elsewhere.
    #[must_use]
    pub fn about(&self, mean: &DVector<f64>) -> DVector<f64> {
        &self.u - &self.n * mean
    }

    /// Its first columns alone: the eight numbers.
    #[must_use]
    pub fn of_numbers(&self) -> Self {
        Self { n: self.n.view((0, 0), (NUMBERS, NUMBERS)).into_owned(), u: self.u.rows(0, NUMBERS).into_owned() }
    }
}
