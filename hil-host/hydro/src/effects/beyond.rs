//! How do lift and drag go on beyond the angle of attack where the law ends?
//!
//! Nobody has measured it on a glider; only launches, turning points and stalls reach it. All that is known is that forces are
//! bounded and meet the law at its edge. So it is two continuations of lift, what lies between them, and the drag of a vehicle that
//! is broadside on, with the doubt about both stated where they are calibrated.

use super::coefficients::LiftDrag;

/// Angle of attack beyond which the coefficients are only a bounded continuation, rad (FORMAT section 3).
pub const ALPHA_VALID_RAD: f64 = 0.35;
/// Drag coefficient of the vehicle broadside on, on S, 1 (FORMAT section 3).
pub const CD_BROADSIDE: f64 = 3.5;

/// Which continuation of lift a model is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Continuation {
    /// With sin 2α, as FORMAT section 3 suggests: lift still grows to 45°.
    #[default]
    Rising,
    /// With cos α: lift fades at once. Deep stall after a launch lasts longer.
    Fading,
}

/// What is settled beyond the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beyond {
    /// Share of the way from the continuation in force towards and past the fading one, 1.
    pub lift_fading: f64,
    /// Drag coefficient broadside on, on S, 1.
    pub cd_broadside: f64,
}

impl Default for Beyond {
    fn default() -> Self {
        Self { lift_fading: 0.0, cd_broadside: CD_BROADSIDE }
    }
}

impl Beyond {
    /// Lift and drag at an angle of attack beyond the law, from those at the law's edge on the same side.
    #[must_use]
    pub fn coefficients(&self, alpha_rad: f64, edge: LiftDrag, on: Continuation) -> LiftDrag {
        // sin²(0.35), sin(0.7) and cos(0.35): every continuation meets the law at the edge.
        const SIN2_EDGE: f64 = 0.117_578_906_357_755_77;
        const SIN_TWICE_EDGE: f64 = 0.644_217_687_237_691_1;
        const COS_EDGE: f64 = 0.939_372_712_847_378_9;
        let (sin_a, cos_a) = (libm::sin(alpha_rad), libm::cos(alpha_rad));
        let rising = 2.0 * sin_a.abs() * cos_a / SIN_TWICE_EDGE;
        let fading = cos_a / COS_EDGE;
        let share = self.lift_fading + if on == Continuation::Fading { 1.0 } else { 0.0 };
        LiftDrag {
            cl: edge.cl * (rising + share * (fading - rising)),
            cd: edge.cd + (self.cd_broadside - edge.cd) * (sin_a * sin_a - SIN2_EDGE) / (1.0 - SIN2_EDGE),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGE: LiftDrag = LiftDrag { cl: 0.9, cd: 0.4 };

    #[test]
    fn prop_every_continuation_meets_the_law_and_ends_broadside() {
        for on in [Continuation::Rising, Continuation::Fading] {
            for lift_fading in [-0.6, 0.0, 0.3, 1.0] {
                for cd_broadside in [1.0, CD_BROADSIDE] {
                    let beyond = Beyond { lift_fading, cd_broadside };
                    for side in [1.0, -1.0] {
                        let edge = LiftDrag { cl: side * EDGE.cl, ..EDGE };
                        let at = beyond.coefficients(side * ALPHA_VALID_RAD, edge, on);
                        // Rounding of six operations on numbers of order one.
                        assert!((at.cl - edge.cl).abs() < 1e-12 && (at.cd - edge.cd).abs() < 1e-12, "{at:?}");
                        let across = beyond.coefficients(side * std::f64::consts::FRAC_PI_2, edge, on);
                        assert!(across.cl.abs() < 1e-12 && (across.cd - cd_broadside).abs() < 1e-12, "{across:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn prop_the_whole_way_to_fading_is_the_fading_continuation() {
        let whole = Beyond { lift_fading: 1.0, ..Beyond::default() };
        for a in [0.4, 0.8, 1.2, 2.5] {
            let there = whole.coefficients(a, EDGE, Continuation::Rising).cl;
            let fading = Beyond::default().coefficients(a, EDGE, Continuation::Fading).cl;
            assert!((there - fading).abs() < 1e-12, "{a}: {there} {fading}");
        }
    }
}
