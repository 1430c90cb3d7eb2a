//! Effects that change the drag.

use super::{Calibrated, Constants, DAY_S, Effect, Flow, InFlow, Parameter};

/// Speed at which the nominal CD0 is stated, m/s (FORMAT section 6.3).
pub const REFERENCE_SPEED_M_S: f64 = 0.30;

/// CD0 (Re/Re_ref)^−exponent, the Reynolds number being that of 0.30 m/s in water of 10 °C at the reference: CD0 (U/0.30)^−exponent
/// times the viscosity of the water to a share of the exponent (1 by theory; a laboratory's rule for one water knows no viscosity).
#[derive(Clone, Copy, Debug)]
pub struct ReynoldsDrag;

impl Effect for ReynoldsDrag {
    fn name(&self) -> &'static str {
        "reynolds_drag"
    }
    fn physics(&self) -> &'static str {
        "skin friction depends on the Reynolds number, so the drag coefficient falls with speed"
    }
    fn separated_by(&self) -> &'static str {
        "legs at several buoyancy drives on the same day"
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow { drag: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "exponent",
                unit: "1",
                off: 0.0,
                low: -1.5,
                high: 1.5,
                typical: 0.25,
                source: "0.5 laminar, 0.15-0.2 turbulent; Seaglider base station 0.5",
            },
            Parameter {
                name: "viscosity_share",
                unit: "1",
                off: 0.5,
                low: 0.0,
                high: 1.0,
                typical: 0.5,
                source: "0 speed alone, 1 Reynolds number",
            },
        ]
    }
    fn drag(&self, p: &[f64], at: &Flow, _lift: f64, c: &Constants) -> f64 {
        if p[0] == 0.0 {
            return 0.0;
        }
        // Below 5 cm/s (launch, turning points) the law is held: it has no measured support there.
        let speed = at.speed_m_s.max(0.05);
        let viscosity = p[1] * log_viscosity(at.temperature_degc);
        c.cd0 * (libm::exp(-p[0] * (libm::log(speed / REFERENCE_SPEED_M_S) - viscosity)) - 1.0)
    }
}

/// ln of the kinematic viscosity of water relative to 10 °C (parabola through 1.79, 1.307 and 1.004 mm²/s at 0, 10 and 20 °C,
/// within 1.5 % up to 30 °C; salt adds 4 to 6 % at all temperatures).
fn log_viscosity(temperature_degc: f64) -> f64 {
    let warmer = temperature_degc - super::REFERENCE_TEMPERATURE_DEGC;
    -0.0289 * warmer + 0.000_254 * warmer * warmer
}

/// CD0 (1 + rate t (t/T)^(power − 1)), t in days since the start of the trial, rate being the mean over the first T days. Linear by
/// default; growth that settles first and spreads later has a power above 1.
#[derive(Clone, Copy, Debug)]
pub struct BiofoulingDrag;

impl Effect for BiofoulingDrag {
    fn name(&self) -> &'static str {
        "biofouling_drag"
    }
    fn physics(&self) -> &'static str {
        "growth on hull and wings raises the drag day by day"
    }
    fn separated_by(&self) -> &'static str {
        "the same leg flown days apart, or after cleaning the hull"
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow { drag: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "rate_per_day",
                unit: "1/day",
                off: 0.0,
                low: -1.0,
                high: 3.0,
                typical: 0.03,
                source: "0-3 %/day, alarm of the Seaglider base station at 1.5 times",
            },
            Parameter {
                name: "power",
                unit: "1",
                off: 1.0,
                low: 0.3,
                high: 3.0,
                typical: 0.3,
                source: "1 steady growth; the spread is a guess",
            },
            Parameter {
                name: "over_days",
                unit: "day",
                off: 1.0,
                low: 0.01,
                high: 1e3,
                typical: 0.0,
                source: "length of the trial that the rate was found in",
            },
        ]
    }
    fn drag(&self, p: &[f64], at: &Flow, _lift: f64, c: &Constants) -> f64 {
        let days = at.time_s / DAY_S;
        let linear = c.cd0 * p[0] * days;
        if p[1] == 1.0 || days <= 0.0 { linear } else { linear * libm::pow(days / p[2], p[1] - 1.0) }
    }
}

/// Drag coefficient grows by k (roll − list)² (k in 1/rad² on S).
#[derive(Clone, Copy, Debug)]
pub struct RollTurnDrag;

impl Effect for RollTurnDrag {
    fn name(&self) -> &'static str {
        "roll_turn_drag"
    }
    fn physics(&self) -> &'static str {
        "banked turns cost drag that grows with the square of the roll"
    }
    fn separated_by(&self) -> &'static str {
        "spirals beside straight legs at the same settings"
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow { drag: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "k",
                unit: "1/rad^2",
                off: 0.0,
                low: -5.0,
                high: 40.0,
                typical: 1.0,
                source: "2-15 % of the drag in spirals",
            },
            Parameter {
                name: "list_rad",
                unit: "rad",
                off: 0.0,
                low: -0.06,
                high: 0.06,
                typical: 0.0175,
                source: "a constant list of about 1 deg is possible (flight format, section 1); what turns no more has no drag of turning",
            },
        ]
    }
    fn drag(&self, p: &[f64], at: &Flow, _lift: f64, _c: &Constants) -> f64 {
        let bank = at.roll_rad - p[1];
        p[0] * bank * bank
    }
}

/// CD0 (1 + rel_increase) while climbing.
#[derive(Clone, Copy, Debug)]
pub struct ClimbDrag;

impl Effect for ClimbDrag {
    fn name(&self) -> &'static str {
        "climb_drag"
    }
    fn physics(&self) -> &'static str {
        "appendages or the wake of the tail make climbing costlier than diving"
    }
    fn separated_by(&self) -> &'static str {
        "dives and climbs at mirrored pitch and drive, several drives"
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow { drag: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "rel_increase",
            unit: "1",
            off: 0.0,
            low: -0.8,
            high: 3.0,
            typical: 0.15,
            source: "an external CTD is 10-20 % of CD0",
        }]
    }
    fn drag(&self, p: &[f64], at: &Flow, _lift: f64, c: &Constants) -> f64 {
        if at.climb_m_s > 0.0 { c.cd0 * p[0] } else { 0.0 }
    }
}

/// CD0 times (1 + rel_error).
#[derive(Clone, Copy, Debug)]
pub struct DragLevelError;

impl Effect for DragLevelError {
    fn name(&self) -> &'static str {
        "drag_level_error"
    }
    fn physics(&self) -> &'static str {
        "the drag at zero lift is wrong by a constant factor (roughness, an appendage that was not counted)"
    }
    fn separated_by(&self) -> &'static str {
        "a bench value of the pump volume, or a speed sensor, with several pitches"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::Drag)
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "rel_error",
            unit: "1",
            off: 0.0,
            low: -0.7,
            high: 3.0,
            typical: 0.25,
            source: "CdA 0.0125-0.017 m2 bare, 0.031 m2 with payload, at sea",
        }]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        c.cd0 *= 1.0 + p[0];
    }
}

/// K times (1 + rel_error f(wing_share)) and CDb times (1 + rel_error f(1 - wing_share)), where f is whole from one half on and below it
/// 1 - (1 - 2 s)²: 1 where the wing's induced drag alone is wrong, 0 where the hull's cross-flow drag alone is, one half where both are by
/// the same factor. (Two straight lines would have a kink there, which held fits fast.) They are one effect, because to first order both
/// grow with the square of the angle of attack; what is left (lift is not quite linear) may tell them apart.
#[derive(Clone, Copy, Debug)]
pub struct InducedDragError;

impl Effect for InducedDragError {
    fn name(&self) -> &'static str {
        "induced_drag_error"
    }
    fn physics(&self) -> &'static str {
        "the drag that comes with lift (induced drag of the wing, cross-flow drag of the hull) is wrong by a factor"
    }
    fn separated_by(&self) -> &'static str {
        "a sweep of pitch: it is felt on shallow legs only"
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "rel_error",
                unit: "1",
                off: 0.0,
                low: -1.0,
                high: 6.0,
                typical: 0.5,
                source: "K between 1/(pi A) and the zero-suction limit",
            },
            Parameter { name: "wing_share", unit: "1", off: 0.5, low: 0.0, high: 1.0, typical: 0.5, source: "guess" },
        ]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        let part = |share: f64| {
            let lost = (1.0 - 2.0 * share).max(0.0);
            1.0 - lost * lost
        };
        c.induced_k *= 1.0 + p[0] * part(p[1]);
        c.hull_drag_per_rad2 *= 1.0 + p[0] * part(1.0 - p[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::{Effect, InducedDragError};
    use crate::effects::tests::nominal;

    /// All of the error is on one of the two at either end and on both in the middle, and nowhere does a small step of the share turn.
    #[test]
    fn accuracy_an_error_of_the_induced_drag_is_shared_out_without_a_kink() {
        let of = |share: f64| {
            let mut c = nominal();
            InducedDragError.constants(&[0.4, share], &mut c);
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
        InducedDragError.constants(&[-1.0, 0.75], &mut c);
        assert!(c.induced_k == 0.0 && c.hull_drag_per_rad2 > 0.0, "{c:?}");
    }
}
