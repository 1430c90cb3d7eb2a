//! Wing and body together: carry-over of lift (Pitts, Nielsen & Kaattari, NACA 1307; slender-body theory).
//!
//! A wing on a body of radius r with semispan s (from the axis to the tip) carries, with k = r/s,
//! ```text
//! K_W(B) + K_B(W) = (1 + k)²
//! K_W(B) = 1 + 0.8174 k + 0.1935 k²       wing in the presence of the body
//! K_B(W) =     1.1826 k + 0.8065 k²       body because of the wing
//! ```
//! times the lift of the wing alone (its two exposed panels joined). The polynomials are fits to the slender-body
//! curves (within 0.01 for 0 ≤ k ≤ 0.6), scaled so that their sum is exact. Slocum: 1.386 with standard wings
//! (s 0.60 m), 2.058 with rails (s 0.245 m), r 0.1065 m.
//! Not covered: vortex interference, tail, finite chord (the wing's root chord is short against the hull).

/// How much of the carry-over a vehicle is believed to have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarryOver {
    /// Share f of the slender-body value, 0 (none, the paper) to 1.
    pub share: f64,
    /// Body radius at the wing r, m.
    pub body_radius_m: f64,
    /// Semispan from the axis to the tip s, m.
    pub semispan_m: f64,
}

impl CarryOver {
    /// k = r/s, 1.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.body_radius_m / self.semispan_m
    }

    /// Factor on the wing's own lift, 1: 1 + f (K_W(B) − 1).
    #[must_use]
    pub fn on_wing(&self) -> f64 {
        let k = self.ratio();
        1.0 + self.share * (0.8174 * k + 0.1935 * k * k)
    }

    /// Lift on the body because of the wing, as a share of the lone wing's lift, 1: f K_B(W).
    #[must_use]
    pub fn on_body(&self) -> f64 {
        let k = self.ratio();
        self.share * (1.1826 * k + 0.8065 * k * k)
    }

    /// Whole factor, 1: 1 + f ((1 + k)² − 1).
    #[must_use]
    pub fn total(&self) -> f64 {
        self.on_wing() + self.on_body()
    }
}

#[cfg(test)]
mod tests {
    use super::CarryOver;

    #[test]
    fn validate_slender_body_values_of_both_wing_sets() {
        let of = |semispan_m| CarryOver { share: 1.0, body_radius_m: 0.1065, semispan_m };
        assert!((of(0.60).total() - 1.386).abs() < 1e-3);
        assert!((of(0.245).total() - 2.058).abs() < 1e-3);
    }

    #[test]
    fn prop_parts_sum_to_the_square_and_nothing_is_nothing() {
        for i in 0..=100 {
            let k = f64::from(i) / 100.0;
            let c = CarryOver { share: 1.0, body_radius_m: k, semispan_m: 1.0 };
            assert!((c.total() - (1.0 + k) * (1.0 + k)).abs() < 1e-12);
            let none = CarryOver { share: 0.0, ..c };
            assert_eq!((none.on_wing(), none.on_body()), (1.0, 0.0));
        }
    }
}
