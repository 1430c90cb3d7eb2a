//! The covariance of the filter, whatever the glides say.

use super::{Belief, Piece, TOGETHER};
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

/// Symmetric, positive and finite; the factors within their bounds.
fn sound(belief: &Belief) -> bool {
    let p = belief.s.map(|a| belief.s.map(|b| super::dot(&a, &b)));
    let symmetric = (0..3).all(|i| (0..3).all(|j| p[i][j].to_bits() == p[j][i].to_bits()));
    // det S ≠ 0 and finite: P = S Sᵀ is positive.
    let positive = nees(&belief.s, [1.0, 1.0, 1.0]);
    let bounded = belief.x.iter().zip(belief.prior().bound).all(|(x, b)| x.abs() <= b);
    symmetric && positive.is_finite() && positive > 0.0 && bounded
}

#[test]
fn prop_the_covariance_stays_positive_over_a_hundred_thousand_pieces() {
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
                        let piece = Piece { h: [bad(), bad(), bad()], z: bad() };
                        belief.learn(&piece, &piece);
                    }
                }
            }
            let before = belief.s;
            belief.file(&now, r.uniform() < 0.5, surprise);
            learned += u32::from(belief.s != before);
            // As every cycle of a glide begins.
            belief.heal();
            healed += u32::from(belief.s == TOGETHER.root() && before != TOGETHER.root());
            assert!(sound(&belief), "step {step}: {belief:?}");
        }
        println!("extreme {extreme}: {learned} learned, {healed} healed");
        assert!(learned > 20_000 && (extreme || healed == 0), "{learned} learned, {healed} healed");
    }
}

#[test]
fn what_no_glide_can_have_taught_gives_way_to_the_table() {
    let table = polar::builtin(Wings::Standard).expect("a table");
    let learned = Belief { x: [0.1; 3], pairs: 2, ..Belief::of(&table) };
    let now = learned.steady(&table, 0.1, 2e-4).expect("a glide");
    let damages: [fn(&mut Belief); 6] = [
        |b| b.x[1] = f32::NAN,
        |b| b.s[2] = [0.0; 3],
        |b| b.s[0][0] = 1.0,
        |b| b.scatter = f32::INFINITY,
        |b| b.top = super::WAITING,
        |b| b.height = super::WAITING + 1,
    ];
    for (i, damage) in damages.into_iter().enumerate() {
        let mut belief = learned;
        damage(&mut belief);
        belief.take(&now, 0.1);
        assert_eq!((belief.factors(), belief.pairs(), sound(&belief)), ([1.0; 3], 0, true), "damage {i}");
    }
    // A rate that is none ends its piece and teaches nothing.
    let mut belief = learned;
    (0..200).for_each(|_| assert!(matches!(belief.take(&now, f32::NAN), super::News::None)));
    assert_eq!((belief.factors(), belief.height), (learned.factors(), 0));
}
