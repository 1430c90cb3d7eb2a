//! Is the filter as certain as it says?
//!
//! Simulated flights of its own assumptions (Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and
//! Navigation, 5.4): NEES, the error of the three factors squared over their covariance, has mean 3, NIS, a surprise squared
//! over its variance, mean 1. A flight whose estimate meets the bound of what is believed ends there, as does one whose wings
//! let go: which ones do is known from the measurements alone, given which the error is still distributed as the covariance says.

use super::{BOUND, Belief, FORGET, Innovation, NOISE, News, Piece, SPREAD, Steady};
use crate::glide::Estimate;
use polar::Table;
use signals::Wings;

/// Standard normal numbers from a seed: splitmix64, Box and Muller.
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

/// |S⁻¹ e|² = eᵀ P⁻¹ e, by Cramer's rule.
fn nees(root: &[[f32; 3]; 3], error: [f64; 3]) -> f64 {
    let s = root.map(|row| row.map(f64::from));
    let det = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = det(&s);
    (0..3)
        .map(|column| {
            let mut with = s;
            for (row, e) in with.iter_mut().zip(error) {
                row[column] = e;
            }
            (det(&with) / whole).powi(2)
        })
        .sum()
}

/// Two-sided 95 % band of the mean of `n` numbers that are each χ² with `dof` degrees of freedom (Wilson and Hilferty).
fn band(n: usize, dof: f64) -> (f64, f64) {
    let m = n as f64 * dof;
    let bound = |z: f64| dof * (1.0 - 2.0 / (9.0 * m) + z * (2.0 / (9.0 * m)).sqrt()).powi(3);
    (bound(-1.96), bound(1.96))
}

#[derive(Debug, Default)]
struct Tally {
    nees: Vec<f64>,
    nis: Vec<f64>,
    ended_early: usize,
}

impl Tally {
    fn means(&self) -> (f64, f64) {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        (mean(&self.nees), mean(&self.nis))
    }

    fn report(&self, what: &str) {
        let ((nees, nis), b3, b1) = (self.means(), band(self.nees.len(), 3.0), band(self.nis.len(), 1.0));
        println!(
            "{what}: NEES {nees:.3} of {} flights in {:.3}..{:.3}; NIS {nis:.3} of {} pairs in {:.3}..{:.3}; {} ended early",
            self.nees.len(),
            b3.0,
            b3.1,
            self.nis.len(),
            b1.0,
            b1.1,
            self.ended_early
        );
    }

    fn counts(&mut self, belief: &Belief) {
        let i = belief.innovation;
        self.nis.push(f64::from(i.surprise).powi(2) / f64::from(i.variance));
    }
}

fn bounded(belief: &Belief) -> bool {
    belief.x.iter().zip(BOUND).any(|(x, b)| x.abs() >= b)
}

fn error(truth: [f64; 3], belief: &Belief) -> [f64; 3] {
    [0, 1, 2].map(|i| truth[i] - f64::from(belief.x[i]))
}

/// Root (Cholesky) of what forgetting added to the covariance, taken back from the covariance after it.
fn added(belief: &Belief) -> [[f64; 3]; 3] {
    let after = covariance(&belief.s);
    // P⁻¹ = f² (P⁺⁻¹ − (1 − 1/f²) P₀⁻¹)
    let f2 = f64::from(FORGET).powi(2);
    let mut information = inverse(&after);
    for i in 0..3 {
        information[i][i] -= (1.0 - 1.0 / f2) / f64::from(SPREAD[i]).powi(2);
    }
    let before = inverse(&information.map(|row| row.map(|v| v * f2)));
    let mut q = after;
    for (q, p) in q.as_flattened_mut().iter_mut().zip(before.as_flattened()) {
        *q -= p;
    }
    cholesky(&q)
}

fn covariance(root: &[[f32; 3]; 3]) -> [[f64; 3]; 3] {
    let s = root.map(|row| row.map(f64::from));
    s.map(|a| s.map(|b| a.iter().zip(b).map(|(a, b)| a * b).sum()))
}

fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let minor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let det: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| minor(j, i) / det))
}

/// Lower root of a covariance that may be singular.
fn cholesky(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut l = [[0.0f64; 3]; 3];
    for i in 0..3 {
        for j in 0..=i {
            let left: f64 = m[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = if i == j {
                left.max(0.0).sqrt()
            } else if l[j][j] > 1e-9 {
                left / l[j][j]
            } else {
                0.0
            };
        }
    }
    l
}

/// Linear flights: each pair is what the filter takes it for, and the vehicle changes between pairs as the filter allows for.
fn linear(flights: u64, pairs: usize, noise_factor: f64) -> Tally {
    let mut tally = Tally::default();
    for seed in 0..flights {
        let table = polar::builtin(if seed % 2 == 0 { Wings::Standard } else { Wings::LowAspectRatio }).expect("a table");
        let mut r = Normal(seed << 20);
        let mut truth = SPREAD.map(|s| f64::from(s) * r.next());
        let mut belief = Belief::of(&table);
        let piece = |r: &mut Normal, truth: &[f64; 3]| {
            let alpha = f64::from(table.best_alpha_rad()) * r.between(0.5, 1.3);
            let h = Belief::of(&table).steady(&table, alpha as f32, 200e-6).expect("a glide").slope().0;
            let told: f64 = h.iter().zip(truth).map(|(h, t)| f64::from(*h) * t).sum();
            Piece { h, z: (told + noise_factor * (2.0 * f64::from(NOISE)).sqrt() * r.next()) as f32, bend: 0.0 }
        };
        let mut whole = true;
        for _ in 0..pairs {
            let (down, up) = (piece(&mut r, &truth), piece(&mut r, &truth));
            let news = belief.learn(&down, &up);
            tally.counts(&belief);
            if news == News::LetGo || bounded(&belief) {
                whole = false;
                break;
            }
            // A random walk with the covariance that is added for it.
            let walk = added(&belief);
            let n = [r.next(), r.next(), r.next()];
            for (x, row) in truth.iter_mut().zip(walk) {
                *x += row.iter().zip(n).map(|(a, n)| a * n).sum::<f64>();
            }
        }
        if whole {
            tally.nees.push(nees(&belief.s, error(truth, &belief)));
        } else {
            tally.ended_early += 1;
        }
    }
    tally
}

/// The true steady glide at a pitch, if there is one.
fn glide(truth: &Belief, table: &Table<'_>, pitch_rad: f32) -> Option<Steady> {
    let (mut low, mut high) = (0.005, table.best_alpha_rad() * 1.7);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let s = truth.steady(table, middle, 200e-6)?;
        if s.answer() < 0.3 || s.gamma_rad() - middle < pitch_rad { high = middle } else { low = middle }
    }
    let s = truth.steady(table, low, 200e-6)?;
    ((s.gamma_rad() - low - pitch_rad).abs() < 1e-3).then_some(s)
}

/// Flights by the filter's own equations, not made linear, from the depth rate of each cycle on.
fn curved(flights: u64, dives: usize, shrink: f64) -> Tally {
    let mut tally = Tally::default();
    for seed in 0..flights {
        let table = polar::builtin(if seed % 2 == 0 { Wings::Standard } else { Wings::LowAspectRatio }).expect("a table");
        let mut r = Normal(seed << 20);
        let x = SPREAD.map(|s| (f64::from(s) * r.next() * shrink) as f32);
        let truth = Belief { x, ..Belief::of(&table) };
        let mut belief = Belief::of(&table);
        let mut estimate = Estimate::default();
        let mut whole = true;
        'flight: for _ in 0..dives {
            let pitch = r.between(0.33, 0.55) as f32;
            let pieces = 1 + (r.uniform() * 4.0) as usize;
            let Some(s) = glide(&truth, &table, pitch) else { continue };
            for side in [1.0f32, -1.0] {
                for _ in 0..pieces {
                    let e = ((2.0 * f64::from(NOISE)).sqrt() * r.next()) as f32;
                    let rate = side * s.speed_m_s() * s.sin_gamma * (1.0 + e);
                    for _ in 0..60 {
                        let now = estimate.advance(&table, &belief, 4.0, -side * pitch, rate, -side * 200e-6, true);
                        let pairs = belief.pairs;
                        let news = now.map_or(News::None, |now| belief.take(&now, rate));
                        if belief.pairs != pairs || news == News::LetGo {
                            tally.counts(&belief);
                        }
                        if news == News::LetGo || bounded(&belief) {
                            whole = false;
                            break 'flight;
                        }
                        if news == News::Piece {
                            break;
                        }
                    }
                }
            }
        }
        if whole {
            tally.nees.push(nees(&belief.s, error(truth.x.map(f64::from), &belief)));
        } else {
            tally.ended_early += 1;
        }
    }
    tally
}

/// Measured when written: NEES 3.057, 3.108, 3.104; NIS 1.012, 1.009, 1.003 (docs: margins.md).
#[test]
fn accuracy_nees_and_nis_lie_in_their_95_percent_bands_over_2000_flights_of_its_own_assumptions() {
    for pairs in [3, 30, 300] {
        let tally = linear(2000, pairs, 1.0);
        tally.report(&format!("{pairs} pairs"));
        let ((nees, nis), b3, b1) = (tally.means(), band(tally.nees.len(), 3.0), band(tally.nis.len(), 1.0));
        assert!(tally.nees.len() >= 1000, "{} flights", tally.nees.len());
        assert!((b3.0..b3.1).contains(&nees) && (b1.0..b1.1).contains(&nis), "{pairs} pairs: NEES {nees}, NIS {nis}");
    }
}

/// Noise a fifth larger than stated: the test above can fail.
#[test]
fn a_filter_that_is_too_certain_leaves_both_bands() {
    let tally = linear(2000, 30, 1.2);
    let ((nees, nis), b3, b1) = (tally.means(), band(tally.nees.len(), 3.0), band(tally.nis.len(), 1.0));
    assert!(nees > b3.1 && nis > b1.1, "NEES {nees}, NIS {nis}");
}

/// The line is not the curve. A table wrong by half the stated spread: never too certain (measured when written: NEES 2.0 over four
/// dives; 10.5 without the curvature in the variance). By the whole of it: a mean of 5.1, drawn up by few flights.
#[test]
fn accuracy_by_its_own_equations_not_made_linear_it_is_not_too_certain() {
    for (dives, shrink, most) in [(4, 0.5, 3.0), (10, 0.5, 3.0), (4, 1.0, 6.0)] {
        let tally = curved(1000, dives, shrink);
        tally.report(&format!("{dives} dives, {shrink} of the spread"));
        let (nees, nis) = tally.means();
        assert!(nees < most && nis < 1.0, "{dives} dives, {shrink} of the spread: NEES {nees}, NIS {nis}");
    }
}

/// Symmetric, positive, not above the spread before any flight, and finite; and so are the factors.
fn sound(belief: &Belief) -> bool {
    let p = belief.s.map(|a| belief.s.map(|b| super::dot(&a, &b)));
    let symmetric = (0..3).all(|i| (0..3).all(|j| p[i][j].to_bits() == p[j][i].to_bits()));
    // det S ≠ 0 and finite: P = S Sᵀ is positive.
    let positive = nees(&belief.s, [1.0, 1.0, 1.0]);
    let p = covariance(&belief.s);
    let below: [[f64; 3]; 3] = [0, 1, 2]
        .map(|i| [0, 1, 2].map(|j| f64::from(u8::from(i == j)) * (1.0 + 1e-4) - p[i][j] / f64::from(SPREAD[i]) / f64::from(SPREAD[j])));
    let l = cholesky(&below);
    let within = (0..3).all(|i| l[i][i] > 0.0);
    let bounded = belief.x.iter().zip(BOUND).all(|(x, b)| x.abs() <= b);
    symmetric && positive.is_finite() && positive > 0.0 && within && bounded
}

#[test]
fn prop_the_covariance_stays_symmetric_and_positive_over_a_hundred_thousand_pieces() {
    const BAD: [f32; 8] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-40, 0.0, 1e18];
    let table = polar::builtin(Wings::Standard).expect("a table");
    for extreme in [false, true] {
        let mut r = Normal(u64::from(extreme));
        let mut belief = Belief::of(&table);
        let (mut learned, mut healed) = (0, 0);
        for step in 0..100_000 {
            let alpha = r.between(0.01, 0.25) as f32;
            let Some(mut now) = belief.steady(&table, alpha, 200e-6) else { continue };
            let mut surprise = (0.05 * r.next()) as f32;
            let mut bad = || BAD[(r.uniform() * 8.0) as usize];
            if extreme && step % 3 == 0 {
                match step % 5 {
                    0 => surprise = bad(),
                    1 => (now.alpha_rad, now.induced) = (bad(), bad()),
                    2 => (now.tan_gamma, now.sin_gamma, now.cos_gamma) = (bad(), bad(), bad()),
                    3 => belief.scatter = bad(),
                    _ => {
                        let piece = Piece { h: [bad(), bad(), bad()], z: bad(), bend: bad() };
                        belief.learn(&piece, &piece);
                    }
                }
            }
            let before = belief.innovation;
            belief.file(&now, r.uniform() < 0.5, surprise);
            learned += u32::from(belief.innovation != before);
            // As every cycle of a glide begins.
            belief.heal();
            healed += u32::from(belief.innovation == Innovation::default() && before != Innovation::default());
            assert!(sound(&belief), "step {step}: {belief:?}");
        }
        println!("extreme {extreme}: {learned} learned, {healed} healed");
        assert!(learned > 20_000 && (extreme || healed == 0), "{learned} learned, {healed} healed");
    }
}
