//! Estimates of one number from many dives, pooled: dives of a deployment, deployments of a vehicle, vehicles of a fleet.
//!
//! ```text
//! estimate of a dive = fleet + vehicle + deployment + dive + noise + calibration of the vehicle
//! ```
//! The three effects in the middle are random and normal, with a standard deviation τ for each level that the estimates must tell
//! themselves: hierarchical random-effects meta-analysis (DerSimonian and Laird 1986; Higgins, Thompson and Spiegelhalter 2009), by its
//! marginal likelihood over a grid of the three τ with half-normal priors (weakly informative: Gelman 2006; Röver and others 2021) whose scale
//! is what dives scatter by below that level. Interval and p-value are averaged over that grid, so that few vehicles that agree by chance do not count as many. A level on which nothing can be
//! separated (one deployment to each vehicle, one vehicle in the fleet) has no τ: what is found of one vehicle is said of that vehicle.
//!
//! The calibration's error is one draw for each vehicle and is averaged over vehicles alone.
//!
//! Which of many numbers are named: Benjamini and Hochberg (1995), so that at most a given share of the names is expected to be false.

use libm::erfc;

/// Levels below the fleet.
pub const LEVELS: usize = 3;
/// Names of them, as the scatter is listed.
pub const LEVEL_NAMES: [&str; LEVELS] = ["dive", "deployment", "vehicle"];

/// One dive's estimate of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Number of its vehicle and of its deployment; dives of one deployment follow each other, and so do the deployments of a vehicle.
    pub vehicle: usize,
    /// Number of its deployment.
    pub deployment: usize,
    /// Estimate.
    pub value: f64,
    /// Standard deviation of its noise.
    pub noise: f64,
    /// Standard deviation that it shares with the dives of its vehicle.
    pub calibration: f64,
}

impl Observation {
    fn is_sound(&self) -> bool {
        [self.value, self.noise, self.calibration].iter().all(|v| v.is_finite()) && self.noise > 0.0
    }

    /// Probability that nothing makes it, by itself.
    #[must_use]
    pub fn p(&self) -> f64 {
        tail(self.value / self.noise.hypot(self.calibration))
    }
}

/// What all dives say of a number.
#[derive(Clone, Debug)]
pub struct Pooled {
    /// Value for the fleet.
    pub value: f64,
    /// Standard deviation of it, everything included.
    pub sigma: f64,
    /// Scatter on each of [`LEVEL_NAMES`], 1 sigma; NaN where the level has none of its own.
    pub scatter: [f64; LEVELS],
    /// Probability that nothing makes it.
    pub p: f64,
    /// Least such probability of a single dive.
    pub best_dive_p: f64,
    /// Dives, deployments and vehicles that say something of it.
    pub counts: [usize; LEVELS],
}

/// Probability of so many standard deviations or more, on both sides.
fn tail(z: f64) -> f64 {
    erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// Sizes of scatter that are tried, in what dives scatter by below it: noise of a median dive and scatter on the levels below.
const GRID: [f64; 16] = [0.0, 0.07, 0.15, 0.25, 0.4, 0.6, 0.85, 1.2, 1.7, 2.4, 3.5, 5.0, 7.5, 12.0, 20.0, 40.0];
const NOT_THERE: [f64; 1] = [0.0];

/// Scale of the half-normal prior of a scatter, in what dives scatter by below it.
const PRIOR_SCALE: f64 = 1.0;

/// Weight of a size of the grid: width of its cell by the half-normal density.
fn prior_weight(grid: &[f64], k: usize) -> f64 {
    if grid.len() == 1 {
        return 1.0;
    }
    let width = 0.5 * (grid.get(k + 1).unwrap_or(&grid[k]) - grid[k.saturating_sub(1)]);
    width * (-0.5 * (grid[k] / PRIOR_SCALE).powi(2)).exp()
}

/// Mean of values with variances, its variance, and minus twice the log likelihood that it leaves.
fn mean(of: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64, f64) {
    let (mut weight, mut sum, mut cost) = (0.0, 0.0, 0.0);
    for (value, variance) in of.clone() {
        weight += 1.0 / variance;
        sum += value / variance;
        cost += variance.ln();
    }
    let mean = sum / weight;
    cost += weight.ln() + of.map(|(value, variance)| (value - mean).powi(2) / variance).sum::<f64>();
    (mean, 1.0 / weight, cost)
}

/// Lengths of the stretches of equal keys.
fn stretches(keys: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut out: Vec<usize> = Vec::new();
    let mut last = None;
    for key in keys {
        match out.last_mut() {
            Some(n) if last == Some(key) => *n += 1,
            _ => out.push(1),
        }
        last = Some(key);
    }
    out
}

/// Means over stretches of values with variances, to each of which `scatter`² is added; minus twice the log likelihood left by all.
fn means(values: &[(f64, f64)], lengths: &[usize], scatter: f64) -> (Vec<(f64, f64)>, f64) {
    let (mut out, mut left, mut from) = (Vec::with_capacity(lengths.len()), 0.0, 0);
    for n in lengths {
        let (value, variance, cost) = mean(values[from..from + n].iter().map(|(v, var)| (*v, var + scatter * scatter)));
        out.push((value, variance));
        left += cost;
        from += n;
    }
    (out, left)
}

/// Mean over stretches of a standard deviation, weighed as the noise has it: what dives that share one cause share of their mean.
fn shared(all: &[Observation], lengths: &[usize], of: fn(&Observation) -> f64) -> Vec<f64> {
    let mut from = 0;
    let one = |n: &usize| {
        let here = &all[from..from + n];
        from += n;
        let weight: f64 = here.iter().map(|o| o.noise.powi(-2)).sum();
        here.iter().map(|o| of(o) * o.noise.powi(-2)).sum::<f64>() / weight
    };
    lengths.iter().map(one).collect()
}

/// One point of the grid.
struct Point {
    cost: f64,
    prior: f64,
    scatter: [f64; LEVELS],
    value: f64,
    variance: f64,
}

/// The fleet's value at every point of the grid of scatters.
fn points(all: &[Observation]) -> (Vec<Point>, [usize; LEVELS], [bool; LEVELS]) {
    let dives = stretches(all.iter().map(|o| o.deployment));
    let vehicle_dives = stretches(all.iter().map(|o| o.vehicle));
    // Deployments of each vehicle.
    let mut rest = dives.iter();
    let deployments: Vec<usize> = vehicle_dives
        .iter()
        .map(|n| {
            let (mut seen, mut count) = (0, 0);
            while seen < *n {
                seen += rest.next().copied().unwrap_or(*n);
                count += 1;
            }
            count
        })
        .collect();
    let vehicles = vehicle_dives.len();
    let has = [dives.iter().any(|n| *n > 1), deployments.iter().any(|n| *n > 1), vehicles > 1];
    let mut noises: Vec<f64> = all.iter().map(|o| o.noise).collect();
    noises.sort_by(f64::total_cmp);
    let unit = noises[noises.len() / 2];
    let grids: [&[f64]; LEVELS] = has.map(|has| if has { &GRID[..] } else { &NOT_THERE[..] });
    let calibration = shared(all, &vehicle_dives, |o| o.calibration);
    let values: Vec<(f64, f64)> = all.iter().map(|o| (o.value, o.noise * o.noise)).collect();
    let mut out = Vec::new();
    for (i, a) in grids[0].iter().enumerate() {
        let a = a * unit;
        let (of_deployments, cost_a) = means(&values, &dives, a);
        for (j, b) in grids[1].iter().enumerate() {
            let b = b * unit.hypot(a);
            let (mut of_vehicles, cost_b) = means(&of_deployments, &deployments, b);
            of_vehicles.iter_mut().zip(&calibration).for_each(|(v, c)| v.1 += c * c);
            for (k, c) in grids[2].iter().enumerate() {
                let c = c * unit.hypot(a).hypot(b);
                let (value, variance, cost_c) = mean(of_vehicles.iter().map(|(v, var)| (*v, var + c * c)));
                let prior = prior_weight(grids[0], i) * prior_weight(grids[1], j) * prior_weight(grids[2], k);
                out.push(Point { cost: cost_a + cost_b + cost_c, prior, scatter: [a, b, c], value, variance });
            }
        }
    }
    (out, [all.len(), dives.len(), vehicles], has)
}

/// Pools what dives say of one number; the order is that of [`Observation::vehicle`]. None where no dive says anything.
#[must_use]
pub fn pool(all: &[Observation]) -> Option<Pooled> {
    let all: Vec<Observation> = all.iter().filter(|o| o.is_sound()).copied().collect();
    if all.is_empty() {
        return None;
    }
    let (points, counts, has) = points(&all);
    let least = points.iter().map(|p| p.cost).fold(f64::INFINITY, f64::min);
    let weight = |p: &Point| p.prior * (-0.5 * (p.cost - least)).exp();
    let total: f64 = points.iter().map(weight).sum();
    let average = |of: &dyn Fn(&Point) -> f64| points.iter().map(|p| weight(p) * of(p)).sum::<f64>() / total;
    let value = average(&|p| p.value);
    let variance = average(&|p| p.variance + (p.value - value).powi(2));
    let scatter = |level: usize| if has[level] { average(&|p| p.scatter[level].powi(2)).sqrt() } else { f64::NAN };
    let out = Pooled {
        value,
        sigma: variance.sqrt(),
        scatter: std::array::from_fn(scatter),
        p: average(&|p| tail(p.value / p.variance.sqrt())),
        best_dive_p: all.iter().map(|o| o.p()).fold(1.0, f64::min),
        counts,
    };
    (out.value.is_finite() && out.sigma.is_finite() && out.p.is_finite()).then_some(out)
}

/// Benjamini and Hochberg's adjusted p-values (q-values): naming what is below q makes an expected share of at most q of the names false.
#[must_use]
pub fn benjamini_hochberg(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
    let mut out = vec![1.0; p.len()];
    let mut least: f64 = 1.0;
    for (above, k) in order.into_iter().enumerate() {
        let rank = p.len() - above;
        least = least.min(p[k] * p.len() as f64 / rank as f64);
        out[k] = least;
    }
    out
}

#[cfg(test)]
#[path = "meta_analysis_tests.rs"]
mod tests;
