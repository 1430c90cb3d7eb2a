//! What the fixes of a log say of its vehicle's numbers: the way through the water is longer or shorter than the file's vehicle makes at
//! the measured depth rate, whatever the mean current is.

use super::FIXES_M;
use discovery::forecast::current::Vector;
use discovery::forecast::passages::{Passage, passages};
use discovery::history::glide::Glider;
use discovery::history::numbers::{NUMBERS, Numbers};
use discovery::history::rows::{Row, Unit};
use logs::{Flight, Vehicle};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// Samples of a round, and rounds of adaptive importance sampling.
const SAMPLES: usize = 300;
const ROUNDS: u64 = 3;
/// Rows of a passage that are asked at most.
const MOST_ROWS: usize = 24;
/// Fewest passages that say something beside a current.
const FEWEST_PASSAGES: usize = 3;
/// A round samples from a covariance so much wider than what the round before has found.
const WIDER: f64 = 1.5;

/// Numbers of a vehicle and the current that goes with them.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The eight numbers beyond the file's, in sizes.
    pub x: Numbers,
    /// Mean current, m/s, and what it is known by in each direction.
    pub current: (Vector, f64),
    /// Its share of the probability.
    pub weight: f64,
}

struct Track<'a> {
    glider: &'a Glider,
    /// Each passage, its rows, and the file's way per depth rate in them.
    passages: Vec<(Passage, Vec<Row>, f64)>,
}

impl Track<'_> {
    /// Mean way forward for the measured rise of some rows.
    fn way_per_rise(glider: &Glider, rows: &[Row], by: &[f64; NUMBERS]) -> f64 {
        let forward = |row: &Row| glider.speeds(row, by).map(|[forward, rise]| row.rise_m_s.abs() * forward / rise.abs());
        rows.iter().filter_map(forward).sum::<f64>() / rows.iter().map(|r| r.rise_m_s.abs()).sum::<f64>()
    }

    /// ln of the likelihood of the fixes, their noise unknown, and the current with what it is known by.
    fn of(&self, x: &Numbers) -> (f64, (Vector, f64)) {
        let by = self.glider.moved(x);
        let missed = self.passages.iter().map(|(p, rows, of_file)| {
            let ratio = Self::way_per_rise(self.glider, rows, &by) / of_file;
            (p.way() - p.through_water * if ratio.is_finite() { ratio } else { 1.0 }, p.time_s())
        });
        let missed: Vec<(Vector, f64)> = missed.collect();
        let squares: f64 = missed.iter().map(|(_, t)| t * t).sum();
        let current = missed.iter().map(|(way, t)| way * t).sum::<Vector>() / squares;
        let left: f64 = missed.iter().map(|(way, t)| (way - current * t).norm_sqr()).sum();
        let freedom = 2.0 * (missed.len() as f64 - 1.0);
        let ln_likelihood = -0.5 * freedom * (left + freedom * FIXES_M * FIXES_M).ln();
        (ln_likelihood, (current, (left / freedom.max(1.0) / squares).sqrt()))
    }
}

/// Samples of the numbers by depth rates (their mean and covariance) and by the fixes, in the order of their making.
#[must_use]
pub fn samples(
    flight: &Flight,
    vehicle: &Vehicle,
    glider: &Glider,
    units: &[Unit],
    by_depth: (&Numbers, &DMatrix<f64>),
    seed: u64,
) -> Vec<Sample> {
    let rows_of = |p: &Passage| {
        let all: Vec<Row> =
            units.iter().flat_map(|u| &u.rows).filter(|r| (p.from.time_s..p.to.time_s).contains(&r.time_s)).cloned().collect();
        let every = all.len().div_ceil(MOST_ROWS).max(1);
        all.into_iter().step_by(every).collect::<Vec<_>>()
    };
    let one = |p: Passage| {
        let rows = rows_of(&p);
        let of_file = Track::way_per_rise(glider, &rows, &[0.0; NUMBERS]);
        (p, rows, of_file)
    };
    let track = Track { glider, passages: passages(flight, vehicle, &[]).all.into_iter().map(one).collect() };
    let says = track.passages.len() >= FEWEST_PASSAGES;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut mean, mut covariance, mut out) = (*by_depth.0, by_depth.1.clone(), Vec::new());
    let Some(of_depth) = by_depth.1.clone().cholesky() else { return out };
    let ln_density = |x: &Numbers, mean: &Numbers, of: &nalgebra::Cholesky<f64, nalgebra::Dyn>| {
        let off = DVector::from_column_slice((x - mean).as_slice());
        -0.5 * off.dot(&of.solve(&off)) - 0.5 * of.ln_determinant()
    };
    for round in 0..if says { ROUNDS } else { 1 } {
        let Some(from) = covariance.clone().cholesky() else { return out };
        let made = (0..SAMPLES).map(|_| {
            let z = DVector::from_fn(NUMBERS, |_, _| StandardNormal.sample(&mut rng));
            let x = mean + Numbers::from_column_slice((from.l() * z).as_slice());
            let (ln_fixes, current) = if track.passages.is_empty() { (0.0, (Vector::default(), 0.0)) } else { track.of(&x) };
            let of_track = if says { ln_fixes } else { 0.0 };
            Sample { x, current, weight: ln_density(&x, by_depth.0, &of_depth) + of_track - ln_density(&x, &mean, &from) }
        });
        out = made.collect();
        let most = out.iter().map(|s| s.weight).fold(f64::NEG_INFINITY, f64::max);
        out.iter_mut().for_each(|s| s.weight = (s.weight - most).exp());
        let sum: f64 = out.iter().map(|s| s.weight).sum();
        out.iter_mut().for_each(|s| s.weight /= sum);
        if round + 1 < ROUNDS && says {
            mean = out.iter().map(|s| s.x * s.weight).sum();
            let spread: DMatrix<f64> = out.iter().fold(DMatrix::zeros(NUMBERS, NUMBERS), |sum, s| {
                let off = DVector::from_column_slice((s.x - mean).as_slice());
                sum + &off * off.transpose() * s.weight
            });
            covariance = spread * WIDER + by_depth.1 * 0.01;
        }
    }
    out
}
