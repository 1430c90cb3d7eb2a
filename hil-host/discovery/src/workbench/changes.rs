//! Which changes a series of dives shows: generalized likelihood ratio over kind, onset and size.
//!
//! Dive d says `(H_d, b_d)` of its numbers x_d ([`Information`]), and
//! ```text
//! x_d = x_0 + Σ_m a_m s_m(d) e_m + u_d        x_0 ~ N(0, P₀)    u_d ~ N(0, Q)
//! ```
//! with x_0 the start of the mission, known as well as the vehicle file says, u_d scatter from dive to dive (Q is learned from the
//! mission, as between flights in [`crate::workbench::pooling`]) and change m of a kind of [`KINDS`]: along one number e_m, a step or a
//! growth s_m from its onset on, with a size a_m. The ratio of the likelihoods with and without a change, at its best onset and size, is
//! what it is judged by (Lorden 1971; Willsky and Jones 1976); changes are added one at a time while the largest ratio exceeds a
//! threshold ([`crate::workbench::change_kinds`]), Q learned anew given what was found, onsets moved to their best places.
//!
//! **What the law is wrong by** grows with the change: the numbers are those of a law that is not nature's, so a change of size a along
//! one number seems to move the others a little too, and its own by a little more or less. Each change found is fitted with such a
//! discrepancy (a term of model error as in Kennedy and O'Hagan 2001): the same course in every number, of standard deviation
//! `LAW_ERROR` |a|. It widens the interval of the size, and takes the place of small second changes that are none.

use crate::likelihood::jacobian::symmetric;
use crate::workbench::change_kinds::{KINDS, Kind, Shape};
use crate::workbench::pooling::{Information, pool_scatter};
use crate::workbench::tracking::{AT_COMPRESSIBILITY, AT_DRAG, AT_LIFT, N};
use nalgebra::{DMatrix, DVector};

/// One dive of the series: what it says, and when it was, days.
#[derive(Clone, Debug)]
pub struct Observed {
    /// What it says, in steps of the tracked numbers.
    pub information: Information,
    /// Day since the start of the mission.
    pub day: f64,
}

/// A change that was found.
#[derive(Clone, Debug)]
pub struct Change {
    /// Its kind.
    pub kind: Kind,
    /// Index of the first dive that has it; 0: since before the first dive.
    pub onset: usize,
    /// First and last dive that the onset may be, 90 %.
    pub onset_between: (usize, usize),
    /// Size at the end of the series, in steps of its number, and 1 sigma of it.
    pub size: f64,
    /// 1 sigma.
    pub sigma: f64,
    /// Likelihood ratio in its favour, standard deviations: √(2 ln ratio).
    pub strength: f64,
    /// Other kinds that the dives do not tell from it: kind, onset, size, 1 sigma.
    pub others: Vec<(Kind, usize, f64, f64)>,
}

/// What a series shows.
#[derive(Clone, Debug)]
pub struct Found {
    /// Changes in order of their onset.
    pub changes: Vec<Change>,
    /// Scatter from dive to dive, 1 sigma, steps.
    pub scatter: [f64; N],
    /// Start of the mission, steps relative to the vehicle file, and its covariance.
    pub start: (DVector<f64>, DMatrix<f64>),
    /// Threshold that was exceeded, standard deviations.
    pub threshold: f64,
}

/// Scatter from dive to dive that is usual, steps: a guess, from which it is learned.
const USUAL_SCATTER: f64 = 0.2;
/// Fewest dives on a change's far side: one dive alone may be anything.
const FEWEST_AFTER: usize = 2;
/// A number is known no better than to a ten-thousandth of a step.
const MOST_PRECISE: f64 = 1e8;
/// Times that the scatter is learned anew, and most changes.
const LEARNED: usize = 3;
const MOST_CHANGES: usize = 8;
/// What a change of one step seems to be in each number by the law's error, 1 sigma, steps.
const LAW_ERROR: f64 = 0.05;
/// Log likelihood within which a kind is not told from another: ten to one.
const TIED_KINDS: f64 = std::f64::consts::LN_10;

/// How far a change that began at dive `onset` has gone at dive `d`; 1 at the end of the series.
fn gone(shape: Shape, onset: usize, d: usize, days: &[f64]) -> f64 {
    if d < onset {
        return 0.0;
    }
    match shape {
        Shape::Step => 1.0,
        Shape::Growth => {
            // It began somewhere between the dive before and this one.
            let from = if onset == 0 { days[0] } else { 0.5 * (days[onset - 1] + days[onset]) };
            let all = days[days.len() - 1] - from;
            if all > 0.0 { (days[d] - from) / all } else { 1.0 }
        }
    }
}

impl Change {
    /// How far it has gone at dive `d`; 1 at the end of the series.
    #[must_use]
    pub fn gone_at(&self, d: usize, days: &[f64]) -> f64 {
        gone(self.kind.shape, self.onset, d, days)
    }
}

/// A change in the model: its kind, onset and size, steps.
#[derive(Clone, Copy)]
struct Placed {
    kind: Kind,
    onset: usize,
    size: f64,
}

/// A column of the series' normal equations: a number, and how far its change has gone at each dive.
#[derive(Clone)]
struct Column {
    number: usize,
    gone: Vec<f64>,
}

impl Column {
    fn of(kind: &Kind, onset: usize, dives: &[Observed]) -> Self {
        let days: Vec<f64> = dives.iter().map(|d| d.day).collect();
        Self { number: kind.number, gone: (0..dives.len()).map(|d| gone(kind.shape, onset, d, &days)).collect() }
    }
}

/// The series with the scatter integrated out, and the changes that are in the model.
struct Series {
    scattered: Vec<Information>,
    /// Of the start, of the changes, and of what the law is wrong by about each change.
    columns: Vec<Column>,
    /// Normal matrix and vector of all columns.
    normal: Information,
}

impl Series {
    fn new(dives: &[Observed], precision: &[f64; N], scatter: &[f64; N], changes: &[Placed]) -> Option<Self> {
        let variance: Vec<f64> = scatter.iter().map(|s| s * s).collect();
        let scattered = dives.iter().map(|d| d.information.scattered(&variance).map(|s| s.0)).collect::<Option<Vec<_>>>()?;
        let start = (0..N).map(|number| Column { number, gone: vec![1.0; dives.len()] });
        let changed: Vec<Column> = changes.iter().map(|c| Column::of(&c.kind, c.onset, dives)).collect();
        let error = changed.iter().flat_map(|c| (0..N).map(|number| Column { number, gone: c.gone.clone() }));
        let columns: Vec<Column> = start.chain(changed.iter().cloned()).chain(error).collect();
        let mut out = Self { scattered, columns: Vec::new(), normal: Information::none(0) };
        let n = columns.len();
        let matrix = symmetric(n, |i, j| out.product(&columns[i], &columns[j]));
        let mut normal = Information { matrix, vector: DVector::from_fn(n, |i, _| out.vector(&columns[i])) };
        precision.iter().enumerate().for_each(|(i, p)| normal.matrix[(i, i)] += p);
        for (c, change) in changes.iter().enumerate() {
            let first = N + changes.len() + c * N;
            (first..first + N).for_each(|i| normal.matrix[(i, i)] += (LAW_ERROR * change.size).powi(-2).min(MOST_PRECISE));
        }
        (out.columns, out.normal) = (columns, normal);
        Some(out)
    }

    fn product(&self, a: &Column, b: &Column) -> f64 {
        self.scattered.iter().enumerate().map(|(d, s)| a.gone[d] * b.gone[d] * s.matrix[(a.number, b.number)]).sum()
    }

    fn vector(&self, a: &Column) -> f64 {
        self.scattered.iter().zip(&a.gone).map(|(s, g)| g * s.vector[a.number]).sum()
    }

    /// What a change would take off minus twice the log likelihood, its size and 1 sigma, beside what is in the model.
    fn asked(&self, inverse: &DMatrix<f64>, mean: &DVector<f64>, kind: &Kind, onset: usize, dives: &[Observed]) -> (f64, f64, f64) {
        let column = Column::of(kind, onset, dives);
        let cross = DVector::from_iterator(self.columns.len(), self.columns.iter().map(|c| self.product(c, &column)));
        let left = self.product(&column, &column) - cross.dot(&(inverse * &cross));
        let pull = self.vector(&column) - cross.dot(mean);
        // What is known to a billionth of a step only is not known at all.
        if !(left > 1e-6) || pull * kind.sign < 0.0 {
            return (0.0, 0.0, f64::INFINITY);
        }
        (pull * pull / left, pull / left, left.powf(-0.5))
    }

    /// Minus twice the log likelihood of the changes in the model, but for a constant.
    fn cost(&self) -> Option<f64> {
        let (mean, _) = self.normal.estimate()?;
        Some(-self.normal.vector.dot(&mean))
    }
}

/// The best onset of one kind beside a model.
#[derive(Clone, Copy)]
struct Best {
    kind: Kind,
    onset: usize,
    gain: f64,
    size: f64,
    sigma: f64,
}

/// Onsets that are asked: with dives enough on the far side; from before the first dive only for numbers that a file knows.
fn onsets(kind: &Kind, n: usize) -> std::ops::Range<usize> {
    let of_the_vehicle = matches!(kind.number, AT_DRAG | AT_LIFT | AT_COMPRESSIBILITY) && kind.shape == Shape::Step;
    usize::from(!of_the_vehicle)..(n + 1).saturating_sub(FEWEST_AFTER)
}

fn best_of_each(series: &Series, dives: &[Observed]) -> Option<Vec<Best>> {
    let (mean, inverse) = series.normal.estimate()?;
    let of = |kind: &Kind| {
        let all = onsets(kind, dives.len()).map(|onset| {
            let (gain, size, sigma) = series.asked(&inverse, &mean, kind, onset, dives);
            Best { kind: *kind, onset, gain, size, sigma }
        });
        all.max_by(|a, b| a.gain.total_cmp(&b.gain))
    };
    let mut out: Vec<Best> = KINDS.iter().filter_map(of).collect();
    out.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Some(out)
}

/// The changes with their sizes fitted together, and 1 sigma of these.
fn sized(dives: &[Observed], precision: &[f64; N], scatter: &[f64; N], changes: &mut [Placed]) -> Option<Vec<f64>> {
    let mut sigmas = Vec::new();
    // Errors of the law follow from the sizes, and the sizes a little from these.
    for _ in 0..2 {
        let (mean, covariance) = Series::new(dives, precision, scatter, changes)?.normal.estimate()?;
        changes.iter_mut().enumerate().for_each(|(c, change)| change.size = mean[N + c]);
        sigmas = (0..changes.len()).map(|c| covariance[(N + c, N + c)].max(0.0).sqrt()).collect();
    }
    Some(sigmas)
}

/// Scatter from dive to dive beside changes: what is left once they are taken out.
fn learned_scatter(dives: &[Observed], precision: &[f64; N], scatter: &[f64; N], changes: &[Placed]) -> Option<[f64; N]> {
    let series = Series::new(dives, precision, scatter, changes)?;
    let (mean, _) = series.normal.estimate()?;
    let left: Vec<Information> = dives
        .iter()
        .enumerate()
        .map(|(d, dive)| {
            let mut expected = DVector::zeros(N);
            for (column, size) in series.columns.iter().zip(mean.iter()) {
                expected[column.number] += size * column.gone[d];
            }
            let vector = &dive.information.vector - &dive.information.matrix * expected;
            Information { matrix: dive.information.matrix.clone(), vector }
        })
        .collect();
    let learned = pool_scatter(&left, precision, &[USUAL_SCATTER; N])?;
    Some(std::array::from_fn(|i| learned[i]))
}

/// What a series of dives shows. `precision` is what the vehicle file knows of the start of the mission, per step². None where nothing
/// is known of anything.
#[must_use]
pub fn find(dives: &[Observed], precision: &[f64; N], threshold: f64) -> Option<Found> {
    let mut scatter = learned_scatter(dives, precision, &[USUAL_SCATTER; N], &[])?;
    let mut changes: Vec<Placed> = Vec::new();
    for _ in 0..LEARNED {
        let before = changes.clone();
        changes.clear();
        while changes.len() < MOST_CHANGES {
            let series = Series::new(dives, precision, &scatter, &changes)?;
            let best = best_of_each(&series, dives)?;
            let Some(first) = best.first().filter(|b| b.gain > threshold * threshold) else { break };
            changes.push(Placed { kind: first.kind, onset: first.onset, size: first.size });
            settle(dives, precision, &scatter, &mut changes)?;
        }
        scatter = learned_scatter(dives, precision, &scatter, &changes)?;
        if changes.iter().map(|c| (c.kind, c.onset)).eq(before.iter().map(|c| (c.kind, c.onset))) {
            break;
        }
    }
    let sigmas = sized(dives, precision, &scatter, &mut changes)?;
    let (mut significant, mut kept) = (Vec::new(), Vec::new());
    for k in 0..changes.len() {
        if let Some(change) = described(dives, precision, &scatter, (&changes, &sigmas), k, threshold) {
            significant.push(change);
            kept.push(changes[k]);
        }
    }
    significant.sort_by_key(|c| c.onset);
    let series = Series::new(dives, precision, &scatter, &kept)?;
    let (mean, covariance) = series.normal.estimate()?;
    let start = (mean.rows(0, N).into_owned(), covariance.view((0, 0), (N, N)).into_owned());
    Some(Found { changes: significant, scatter, start, threshold })
}

/// Moves each change to the kind and onset that are best beside the others.
fn settle(dives: &[Observed], precision: &[f64; N], scatter: &[f64; N], changes: &mut [Placed]) -> Option<()> {
    sized(dives, precision, scatter, changes)?;
    if changes.len() < 2 {
        return Some(());
    }
    for _ in 0..2 {
        for k in 0..changes.len() {
            let series = Series::new(dives, precision, scatter, &without(changes, k))?;
            let best = best_of_each(&series, dives)?;
            let first = best.first()?;
            let mut moved = changes.to_vec();
            moved[k] = Placed { kind: first.kind, onset: first.onset, size: first.size };
            sized(dives, precision, scatter, &mut moved)?;
            let cost = |of: &[Placed]| Series::new(dives, precision, scatter, of)?.cost();
            if cost(&moved)? < cost(changes)? - 1e-6 {
                changes.copy_from_slice(&moved);
            }
        }
    }
    Some(())
}

/// All changes but one.
fn without(changes: &[Placed], k: usize) -> Vec<Placed> {
    changes.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, c)| *c).collect()
}

/// A change with its intervals beside the others; none where it is not above the threshold any more.
fn described(
    dives: &[Observed],
    precision: &[f64; N],
    scatter: &[f64; N],
    (changes, sigmas): (&[Placed], &[f64]),
    k: usize,
    threshold: f64,
) -> Option<Change> {
    let series = Series::new(dives, precision, scatter, &without(changes, k))?;
    let best = best_of_each(&series, dives)?;
    let first = best.iter().find(|b| b.kind == changes[k].kind)?;
    if !(first.gain > threshold * threshold) {
        return None;
    }
    let (start, inverse) = series.normal.estimate()?;
    // Posterior of the onset and of the size over it.
    let asked: Vec<(usize, f64, f64, f64)> = onsets(&first.kind, dives.len())
        .map(|onset| {
            let (gain, size, sigma) = series.asked(&inverse, &start, &first.kind, onset, dives);
            (onset, 0.5 * (gain - first.gain), size, sigma)
        })
        .filter(|a| a.3.is_finite())
        .collect();
    let weight: Vec<f64> = asked.iter().map(|a| a.1.exp() * a.3).collect();
    let total: f64 = weight.iter().sum();
    // At its onset the size is fitted together with the law's error; other onsets would shift it, and add to its variance.
    let mean = asked.iter().zip(&weight).map(|(a, w)| w * a.2).sum::<f64>() / total;
    let apart = asked.iter().zip(&weight).map(|(a, w)| w * (a.3 * a.3 + (a.2 - mean).powi(2))).sum::<f64>() / total;
    let size = changes[k].size + mean - first.size;
    let variance = sigmas[k] * sigmas[k] + (apart - first.sigma * first.sigma).max(0.0);
    let at = |share: f64| {
        let mut sum = 0.0;
        asked.iter().zip(&weight).find_map(|(a, w)| {
            sum += w;
            (sum >= share * total).then_some(a.0)
        })
    };
    let tied = best.iter().filter(|b| b.kind != first.kind && b.gain > 0.0 && 0.5 * (first.gain - b.gain) < TIED_KINDS);
    Some(Change {
        kind: first.kind,
        onset: first.onset,
        onset_between: (at(0.05)?.min(first.onset), at(0.95)?.max(first.onset)),
        size,
        sigma: variance.sqrt(),
        strength: first.gain.sqrt(),
        others: tied.map(|b| (b.kind, b.onset, b.size, b.sigma)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::change_kinds::{DIVES_PER_ALARM, threshold};
    use crate::workbench::tracking::AT_TRIM;

    /// Repeatable noise of variance 1, nearly normal: a sum of twelve uniform numbers.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            let mut uniform = || {
                self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (self.0 >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    /// Dives that know each number to a fifth of a step, drag and lift correlated, and scatter by as much again.
    fn series(n: usize, seed: u64, truth: impl Fn(usize) -> [f64; N]) -> Vec<Observed> {
        let mut noise = Noise(seed);
        (0..n)
            .map(|d| {
                let matrix = DMatrix::from_fn(N, N, |i, j| match (i, j) {
                    (0, 1) | (1, 0) => 20.0,
                    _ if i == j => 25.0,
                    _ => 0.0,
                });
                let root = matrix.clone().cholesky().expect("positive").inverse().cholesky().expect("positive").l();
                let white = DVector::from_fn(N, |_, _| noise.next());
                let at = DVector::from_column_slice(&truth(d)) + root * white + DVector::from_fn(N, |_, _| 0.2 * noise.next());
                Observed { information: Information { vector: &matrix * at, matrix }, day: 0.1 * d as f64 }
            })
            .collect()
    }

    const KNOWN: [f64; N] = [4.0, 4.0, 0.01, 1.0, 4.0, 1.0];

    fn with(number: usize, size: f64) -> [f64; N] {
        let mut out = [0.0; N];
        out[number] = size;
        out
    }

    #[test]
    fn accuracy_a_step_is_named_dated_and_sized() {
        let limit = threshold(DIVES_PER_ALARM);
        let (mut dated, mut sized) = (0, 0);
        for seed in 0..20 {
            let dives = series(40, 77 + seed, |d| with(AT_DRAG, if d >= 17 { 2.0 } else { 0.0 }));
            let found = find(&dives, &KNOWN, limit).expect("something is known");
            let first = found.changes.iter().find(|c| c.kind.name == "snag").expect("named");
            dated += usize::from(first.onset.abs_diff(17) <= 2);
            sized += usize::from((first.size - 2.0).abs() < 1.645 * first.sigma);
        }
        // Of twenty 90 % intervals fewer than fifteen hold it once in ninety times.
        assert!(dated >= 18 && sized >= 15, "{dated} {sized}");
    }

    #[test]
    fn accuracy_growth_and_a_step_in_one_mission_are_distinguished() {
        let truth = |d: usize| {
            let mut out = with(AT_TRIM, if d >= 40 { -3.0 } else { 0.0 });
            out[AT_DRAG] = if d >= 10 { 4.0 * (d as f64 - 9.5) / 49.5 } else { 0.0 };
            out
        };
        let found = find(&series(60, 5, truth), &KNOWN, threshold(DIVES_PER_ALARM)).expect("something is known");
        let names: Vec<&str> = found.changes.iter().map(|c| c.kind.name).collect();
        assert_eq!(names, ["fouling", "ballast_moved"], "{found:?}");
        assert!(
            (found.changes[0].size - 4.0).abs() < 3.0 * found.changes[0].sigma && found.changes[1].onset.abs_diff(40) <= 1,
            "{found:?}"
        );
    }

    #[test]
    fn accuracy_what_was_there_before_the_first_dive_is_dated_so() {
        let found = find(&series(30, 9, |_| with(AT_DRAG, 4.0)), &KNOWN, threshold(DIVES_PER_ALARM)).expect("something is known");
        let all: Vec<(&str, usize)> = found.changes.iter().map(|c| (c.kind.name, c.onset)).collect();
        assert_eq!(all, [("snag", 0)], "{found:?}");
    }

    #[test]
    fn accuracy_alarms_in_noise_are_no_more_than_calculated() {
        let limit = threshold(200.0);
        let missions = 60;
        let alarms: usize =
            (0..missions).map(|m| find(&series(40, 1000 + m, |_| [0.0; N]), &KNOWN, limit).map_or(0, |f| f.changes.len())).sum();
        // Twelve are calculated for 2,400 dives; twenty have a probability of 2 %.
        assert!(alarms < 20, "{alarms}");
    }
}
