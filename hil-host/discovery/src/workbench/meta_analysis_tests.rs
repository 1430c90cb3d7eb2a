//! Pooling by hand-worked cases and over simulated fleets.

use super::*;

/// A generator that needs no crate: SplitMix64, and normal numbers by Box and Muller.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Numbers that a fleet is asked for, and the share that the names may have of false ones.
const NUMBERS: usize = 30;
const SHARE: f64 = 0.05;

/// A fleet's shape.
#[derive(Clone, Copy)]
struct Shape {
    vehicles: usize,
    deployments: usize,
    dives: usize,
    /// Scatter on each level, and the shared errors, in the noise of a dive.
    scatter: [f64; LEVELS],
    calibration: f64,
}

fn fleet(shape: Shape, truth: f64, random: &mut Random) -> Vec<Observation> {
    let Shape { vehicles, deployments, dives, scatter, calibration } = shape;
    let mut out = Vec::new();
    for vehicle in 0..vehicles {
        let of_vehicle = scatter[2] * random.normal() + calibration * random.normal();
        for d in 0..deployments {
            let of_deployment = of_vehicle + scatter[1] * random.normal();
            for _ in 0..dives {
                // Dives differ in how much they say.
                let noise = 0.6 + 0.8 * random.uniform();
                let value = truth + of_deployment + scatter[0] * random.normal() + noise * random.normal();
                out.push(Observation { vehicle, deployment: vehicle * deployments + d, value, noise, calibration });
            }
        }
    }
    out
}

#[test]
fn accuracy_without_scatter_the_pooled_value_is_the_weighed_mean() {
    let one = |value: f64, noise: f64| Observation { vehicle: 0, deployment: 0, value, noise, calibration: 0.3 };
    // One dive: its own value and everything that it is uncertain by.
    let single = pool(&[one(2.0, 1.2)]).expect("something");
    assert!((single.value - 2.0).abs() < 1e-12 && (single.sigma - 1.2_f64.hypot(0.3)).abs() < 1e-12, "{single:?}");
    assert!((single.p - erfc(2.0 / 1.2_f64.hypot(0.3) / 2.0_f64.sqrt())).abs() < 1e-12 && single.scatter.iter().all(|s| s.is_nan()));
    // Many dives that agree: the noise is averaged out, the calibration stays.
    let many: Vec<Observation> = (0..4000).map(|k| one(if k % 2 == 0 { 1.9 } else { 2.1 }, 1.2)).collect();
    let many = pool(&many).expect("something");
    assert!((many.value - 2.0).abs() < 1e-9 && (many.sigma - 0.3).abs() < 2e-3, "{many:?}");
    assert_eq!(many.counts, [4000, 1, 1]);
    assert!(pool(&[one(f64::NAN, 1.0)]).is_none());
}

#[test]
fn accuracy_scatter_of_each_level_is_found_where_it_is() {
    let shape = Shape { vehicles: 12, deployments: 8, dives: 10, scatter: [0.5, 1.5, 3.0], calibration: 0.0 };
    let found = pool(&fleet(shape, 7.0, &mut Random(5))).expect("something");
    // 960 dives, 96 deployments, 12 vehicles: 1 sigma of a scatter is 2, 8 and 21 % at best; the grid has steps of 40 %.
    for (found, truth, within) in [(found.scatter[0], 0.5, 0.4), (found.scatter[1], 1.5, 0.4), (found.scatter[2], 3.0, 0.6)] {
        assert!((found / truth - 1.0).abs() < within, "{found} of {truth}");
    }
    // Twelve vehicles that scatter by 3 know their mean to 0.87.
    assert!((found.value - 7.0).abs() < 3.0 && (0.5..1.8).contains(&found.sigma), "{found:?}");
}

/// How often, of `fleets`, a fleet names an effect of two standard deviations in each dive among thirty numbers, and how often its best
/// dive does by itself: the one that knows most, by the same rule.
fn power(shape: Shape, fleets: u32) -> [u32; 2] {
    let mut random = Random(11);
    let alone = |o: &Observation| o.noise.hypot(o.calibration);
    let mut out = [0, 0];
    for _ in 0..fleets {
        let mut numbers: Vec<Vec<Observation>> = (0..NUMBERS).map(|_| fleet(shape, 0.0, &mut random)).collect();
        let size = 2.0 * numbers[0].iter().map(alone).fold(f64::INFINITY, f64::min);
        numbers[0].iter_mut().for_each(|o| o.value += size);
        let p: Vec<f64> = numbers.iter().map(|all| pool(all).expect("something").p).collect();
        let best = (0..numbers[0].len()).min_by(|a, b| alone(&numbers[0][*a]).total_cmp(&alone(&numbers[0][*b]))).expect("a dive");
        let of_dive: Vec<f64> = numbers.iter().map(|all| all[best].p()).collect();
        out[0] += u32::from(benjamini_hochberg(&p)[0] < SHARE);
        out[1] += u32::from(benjamini_hochberg(&of_dive)[0] < SHARE);
    }
    out
}

/// One vehicle on one deployment, and fleets of six and of ten vehicles. (Fewer vehicles that scatter cannot say what a fleet has: three or
/// four that agree may do so by chance, and pooling has less power there than a single dive, which is not asked to speak for others.)
#[test]
fn accuracy_pooling_has_three_times_the_power_of_the_best_dive() {
    let shape = Shape { vehicles: 1, deployments: 2, dives: 8, scatter: [0.3, 0.2, 0.2], calibration: 0.2 };
    let mission = Shape { deployments: 1, dives: 16, scatter: [0.3, 0.0, 0.0], ..shape };
    for shape in [mission, Shape { vehicles: 6, ..shape }, Shape { vehicles: 10, ..shape }] {
        let [pooled, dive] = power(shape, 100);
        eprintln!("{} vehicles: named by the fleet in {pooled} of 100, by its best dive in {dive}", shape.vehicles);
        assert!(dive > 0 && pooled >= 3 * dive, "{} vehicles: {pooled} and {dive} of 100", shape.vehicles);
    }
}

/// The share of names that are false, over a hundred fleets of every shape: with and without true effects, few vehicles and many.
#[test]
fn accuracy_at_most_a_twentieth_of_the_names_is_false() {
    let shapes = [
        Shape { vehicles: 1, deployments: 1, dives: 20, scatter: [0.5, 0.0, 0.0], calibration: 0.3 },
        Shape { vehicles: 3, deployments: 2, dives: 8, scatter: [0.5, 0.5, 0.5], calibration: 0.3 },
        Shape { vehicles: 5, deployments: 3, dives: 6, scatter: [1.0, 0.5, 0.0], calibration: 0.2 },
        Shape { vehicles: 10, deployments: 2, dives: 10, scatter: [0.0, 0.0, 1.0], calibration: 0.0 },
    ];
    let fleets = 100;
    let mut rates = Vec::new();
    for (k, shape) in shapes.into_iter().enumerate() {
        for truths in [0, 5] {
            let mut random = Random(1000 * k as u64 + truths as u64);
            let (mut share, mut names) = (0.0, 0);
            for _ in 0..fleets {
                let p: Vec<f64> = (0..NUMBERS)
                    .map(|n| pool(&fleet(shape, if n < truths { 3.0 } else { 0.0 }, &mut random)).expect("something").p)
                    .collect();
                let named: Vec<bool> = benjamini_hochberg(&p).iter().map(|q| *q < SHARE).collect();
                let wrong = named.iter().skip(truths).filter(|n| **n).count();
                let all = named.iter().filter(|n| **n).count();
                share += wrong as f64 / all.max(1) as f64;
                names += all;
            }
            let rate = share / f64::from(fleets);
            eprintln!("shape {k}, {truths} true effects: {names} names, share of false ones {rate:.3}");
            // Where nothing is true and only a dive's noise scatters, the share is a twentieth exactly; two standard errors of a count.
            let chance = 2.0 * (SHARE * (1.0 - SHARE) / f64::from(fleets)).sqrt();
            assert!(rate <= SHARE + chance, "shape {k}, {truths} true effects: {rate}");
            rates.push(rate);
        }
    }
    let all = rates.iter().sum::<f64>() / rates.len() as f64;
    assert!(all <= SHARE, "{all} over all shapes");
}

#[test]
fn accuracy_q_values_are_those_worked_by_hand() {
    let q = benjamini_hochberg(&[0.01, 0.04, 0.03, 0.5]);
    for (got, owed) in q.iter().zip([0.04, 0.16 / 3.0, 0.16 / 3.0, 0.5]) {
        assert!((got - owed).abs() < 1e-12, "{q:?}");
    }
    assert!(benjamini_hochberg(&[]).is_empty());
}
