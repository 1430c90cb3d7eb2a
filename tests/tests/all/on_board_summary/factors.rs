//! Factors against the sums of squares that they stand for, in f64.

use evidence::NUMBERS;
use evidence::factor::{Factor, Line, WIDTH, best_determined};

/// What rounding of f32 may make of a product of columns, against their lengths.
const ROUNDED: f64 = 2e-5;

/// Lines that repeat themselves in every run, the last number nearly a mirror of the first.
fn lines(n: usize) -> Vec<Line> {
    let mut seed = 1_u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    };
    let mut line = || {
        let mut line: Line = core::array::from_fn(|i| next() * [0.1, 0.05, 0.02, 0.001, 0.03, 0.02, 0.04, 0.0, 0.02][i]);
        line[7] = -0.5 * line[0] + 1e-3 * next();
        line
    };
    (0..n).map(|_| line()).collect()
}

fn normal(lines: &[Line]) -> [[f64; WIDTH]; WIDTH] {
    let product = |i: usize, k: usize| lines.iter().map(|l| f64::from(l[i]) * f64::from(l[k])).sum::<f64>();
    core::array::from_fn(|i| core::array::from_fn(|k| product(i, k)))
}

fn near(a: &[[f64; WIDTH]; WIDTH], b: &[[f64; WIDTH]; WIDTH]) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..WIDTH {
        for k in 0..WIDTH {
            worst = worst.max((a[i][k] - b[i][k]).abs() / (a[i][i] * a[k][k]).sqrt());
        }
    }
    worst
}

#[test]
fn accuracy_a_factor_holds_the_information_of_its_lines() {
    let lines = lines(300);
    let mut all = Factor::default();
    all.add_all(&lines);
    // Rounding of f32 over 300 lines, each of nine rotations.
    let worst = near(&normal(&lines), &normal(&all.0));
    assert!(worst < ROUNDED, "{worst}");
    for (i, row) in all.0.iter().enumerate() {
        assert!(row[..i].iter().all(|x| x.abs() < 1e-6), "below the diagonal: {row:?}");
    }
    // Two halves put together are the same.
    let mut halves = [Factor::default(); 2];
    halves[0].add_all(&lines[..150]);
    halves[1].add_all(&lines[150..]);
    let mut both = halves[0];
    both.add_all(&halves[1].0);
    assert!(near(&normal(&both.0), &normal(&all.0)) < ROUNDED);
}

#[test]
fn accuracy_the_most_probable_numbers_have_no_slope_left() {
    let lines = lines(120);
    let mut all = Factor::default();
    all.add_all(&lines);
    let level = 1e-4;
    let d = all.most_probable(level);
    // N d + level d = u in f64.
    let n = normal(&lines);
    for (i, row) in n.iter().take(NUMBERS).enumerate() {
        let left = row.iter().zip(&d).map(|(n, d)| n * f64::from(*d)).sum::<f64>() + f64::from(level * d[i]) - row[NUMBERS];
        assert!(left.abs() < 1e-5 * row[i].sqrt() * n[NUMBERS][NUMBERS].sqrt(), "{i} {left}");
    }
    let left: f64 = lines.iter().map(|l| (f64::from(l[8]) - (0..8).map(|k| f64::from(l[k] * d[k])).sum::<f64>()).powi(2)).sum();
    assert!((f64::from(all.misfit(&d)) / left - 1.0).abs() < 1e-4);
}

#[test]
fn accuracy_directions_are_orthogonal_and_hold_the_information() {
    for rows in [3, 37] {
        let mut block = Factor::default();
        block.add_all(&lines(rows));
        let directions = block.directions();
        let mut turned: Vec<Line> = directions.iter().map(|d| d.1).collect();
        turned.push(block.0[8]);
        assert!(near(&normal(&turned), &normal(&block.0)) < ROUNDED);
        for (i, (a, one)) in directions.iter().enumerate() {
            for (b, other) in &directions[i + 1..] {
                let product: f64 = one.iter().zip(other).take(NUMBERS).map(|(x, y)| f64::from(x * y)).sum();
                assert!(product.abs() <= 2e-6 * f64::from(a * b).sqrt() + 1e-12, "{rows}: {product} of {a} {b}");
            }
        }
        let mut squares: Vec<f32> = Vec::new();
        let taken = best_determined(&directions, 4, |line| squares.push(line.iter().take(NUMBERS).map(|x| x * x).sum()));
        assert_eq!(usize::from(taken), rows.min(4));
        let rest = directions.iter().map(|d| d.0).filter(|d| !squares.contains(d));
        assert!(rest.into_iter().all(|d| squares.iter().all(|s| *s >= d)));
    }
    assert_eq!(best_determined(&Factor::default().directions(), 4, |_| ()), 0);
}
