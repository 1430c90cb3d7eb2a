//! Effects that change the drag.

use super::{Calibrated, DAY_S, Effect, Parameter};

/// Speed at which the nominal CD0 is stated, m/s (FORMAT section 6.3).
pub const REFERENCE_SPEED_M_S: f64 = 0.30;

/// CD0 (Re/Re_ref)^−exponent, the Reynolds number being that of 0.30 m/s in water of 10 °C at the reference: CD0 (U/0.30)^−exponent
/// times the viscosity of the water to a share of the exponent (1 by theory; a laboratory's rule for one water knows no viscosity).
pub static REYNOLDS_DRAG: Effect = Effect {
    name: "reynolds_drag",
    physics: "skin friction depends on the Reynolds number, so the drag coefficient falls with speed",
    separated_by: "legs at several buoyancy drives on the same day",
    parameters: &[
        Parameter::new("exponent", "1", 0.0, (-1.5, 1.5), 0.25, "0.5 laminar, 0.15-0.2 turbulent; Seaglider base station 0.5"),
        Parameter::new("viscosity_share", "1", 0.5, (0.0, 1.0), 0.5, "0 speed alone, 1 Reynolds number"),
    ],
    usual_sign: 1.0,
    drag: Some(&|p, at, _, c| {
        if p[0] == 0.0 {
            return 0.0;
        }
        // Below 5 cm/s (launch, turning points) the law is held: it has no measured support there.
        let speed = at.speed_m_s.max(0.05);
        let viscosity = p[1] * log_viscosity(at.temperature_degc);
        c.cd0 * (libm::exp(-p[0] * (libm::log(speed / REFERENCE_SPEED_M_S) - viscosity)) - 1.0)
    }),
    ..Effect::NONE
};

/// ln of the kinematic viscosity of water relative to 10 °C (parabola through 1.79, 1.307 and 1.004 mm²/s at 0, 10 and 20 °C,
/// within 1.5 % up to 30 °C; salt adds 4 to 6 % at all temperatures).
fn log_viscosity(temperature_degc: f64) -> f64 {
    let warmer = temperature_degc - super::REFERENCE_TEMPERATURE_DEGC;
    -0.0289 * warmer + 0.000_254 * warmer * warmer
}

/// CD0 (1 + rate t (t/T)^(power − 1)), t in days since the start of the trial, rate being the mean over the first T days. Linear by
/// default; growth that settles first and spreads later has a power above 1.
pub static BIOFOULING_DRAG: Effect = Effect {
    name: "biofouling_drag",
    physics: "growth on hull and wings raises the drag day by day",
    separated_by: "the same leg flown days apart, or after cleaning the hull",
    parameters: &[
        Parameter::new("rate_per_day", "1/day", 0.0, (-1.0, 3.0), 0.03, "0-3 %/day, alarm of the Seaglider base station at 1.5 times"),
        Parameter::new("power", "1", 1.0, (0.3, 3.0), 0.3, "1 steady growth; the spread is a guess"),
        Parameter::new("over_days", "day", 1.0, (0.01, 1e3), 0.0, "length of the trial that the rate was found in"),
    ],
    usual_sign: 1.0,
    drag: Some(&|p, at, _, c| {
        let days = at.time_s / DAY_S;
        let linear = c.cd0 * p[0] * days;
        if p[1] == 1.0 || days <= 0.0 { linear } else { linear * libm::pow(days / p[2], p[1] - 1.0) }
    }),
    ..Effect::NONE
};

/// Drag coefficient grows by k (roll − list)² (k in 1/rad² on S).
pub static ROLL_TURN_DRAG: Effect = Effect {
    name: "roll_turn_drag",
    physics: "banked turns cost drag that grows with the square of the roll",
    separated_by: "spirals beside straight legs at the same settings",
    parameters: &[
        Parameter::new("k", "1/rad^2", 0.0, (-5.0, 40.0), 1.0, "2-15 % of the drag in spirals"),
        Parameter::new(
            "list_rad",
            "rad",
            0.0,
            (-0.06, 0.06),
            0.0175,
            "a constant list of about 1 deg is possible (flight format, section 1); what turns no more has no drag of turning",
        ),
    ],
    usual_sign: 1.0,
    drag: Some(&|p, at, _, _| {
        let bank = at.roll_rad - p[1];
        p[0] * bank * bank
    }),
    ..Effect::NONE
};

/// CD0 (1 + rel_increase) while climbing.
pub static CLIMB_DRAG: Effect = Effect {
    name: "climb_drag",
    physics: "appendages or the wake of the tail make climbing costlier than diving",
    separated_by: "dives and climbs at mirrored pitch and drive, several drives",
    parameters: &[Parameter::new("rel_increase", "1", 0.0, (-0.8, 3.0), 0.15, "an external CTD is 10-20 % of CD0")],
    usual_sign: 1.0,
    drag: Some(&|p, at, _, c| {
        if at.climb_m_s > 0.0 { c.cd0 * p[0] } else { 0.0 }
    }),
    ..Effect::NONE
};

/// CD0 times (1 + rel_error).
pub static DRAG_LEVEL_ERROR: Effect = Effect {
    name: "drag_level_error",
    physics: "the drag at zero lift is wrong by a constant factor (roughness, an appendage that was not counted)",
    separated_by: "a bench value of the pump volume, or a speed sensor, with several pitches",
    parameters: &[Parameter::new("rel_error", "1", 0.0, (-0.7, 3.0), 0.25, "CdA 0.0125-0.017 m2 bare, 0.031 m2 with payload, at sea")],
    error_of: Some(Calibrated::Drag),
    constants: Some(&|p, c| c.cd0 *= 1.0 + p[0]),
    ..Effect::NONE
};

/// K times (1 + rel_error f(wing_share)) and CDb times (1 + rel_error f(1 - wing_share)), where f is whole from one half on and below it
/// 1 - (1 - 2 s)²: 1 where the wing's induced drag alone is wrong, 0 where the hull's cross-flow drag alone is, one half where both are by
/// the same factor. (Two straight lines would have a kink there, which held fits fast.) They are one effect, because to first order both
/// grow with the square of the angle of attack; what is left (lift is not quite linear) may tell them apart.
pub static INDUCED_DRAG_ERROR: Effect = Effect {
    name: "induced_drag_error",
    physics: "the drag that comes with lift (induced drag of the wing, cross-flow drag of the hull) is wrong by a factor",
    separated_by: "a sweep of pitch: it is felt on shallow legs only",
    parameters: &[
        Parameter::new("rel_error", "1", 0.0, (-1.0, 6.0), 0.5, "K between 1/(pi A) and the zero-suction limit"),
        Parameter::new("wing_share", "1", 0.5, (0.0, 1.0), 0.5, "guess"),
    ],
    constants: Some(&|p, c| {
        let part = |share: f64| {
            let lost = (1.0 - 2.0 * share).max(0.0);
            1.0 - lost * lost
        };
        c.induced_k *= 1.0 + p[0] * part(p[1]);
        c.hull_drag_per_rad2 *= 1.0 + p[0] * part(1.0 - p[1]);
    }),
    ..Effect::NONE
};

#[cfg(test)]
mod tests {
    use super::INDUCED_DRAG_ERROR;
    use crate::effects::tests::nominal;

    /// All of the error is on one of the two at either end and on both in the middle, and nowhere does a small step of the share turn.
    #[test]
    fn accuracy_an_error_of_the_induced_drag_is_shared_out_without_a_kink() {
        let changed = INDUCED_DRAG_ERROR.constants.expect("it changes constants");
        let of = |share: f64| {
            let mut c = nominal();
            changed(&[0.4, share], &mut c);
            (c.induced_k / nominal().induced_k, c.hull_drag_per_rad2 / nominal().hull_drag_per_rad2)
        };
        for (share, wing, hull) in [(1.0, 1.4, 1.0), (0.5, 1.4, 1.4), (0.0, 1.0, 1.4)] {
            let (w, h) = of(share);
            // Rounding of a few products.
            assert!((w - wing).abs() < 1e-12 && (h - hull).abs() < 1e-12, "{share}: {w} {h}");
        }
        for k in 1..100 {
            let share = f64::from(k) / 100.0;
            let [before, at, after] = [share - 1e-3, share, share + 1e-3].map(of);
            // A parabola's second difference: 8 x 0.4 x (1e-3)²; a kink would leave 0.8e-3.
            assert!((before.0 + after.0 - 2.0 * at.0).abs() < 4e-6 && (before.1 + after.1 - 2.0 * at.1).abs() < 4e-6, "{share}");
        }
        // Nothing has less drag than none.
        let mut c = nominal();
        changed(&[-1.0, 0.75], &mut c);
        assert!(c.induced_k == 0.0 && c.hull_drag_per_rad2 > 0.0, "{c:?}");
    }
}
