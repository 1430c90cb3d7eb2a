//! Effects that change the lift: vortices, stall, slope and zero of the lift curve.

use super::{ALPHA_VALID_RAD, Calibrated, Constants, Effect, Flow, InFlow, Onset, Parameter};

/// Normal force of vortices shed by hull and wing beyond an onset angle.
///
/// ```text
/// CN = k (|α| − α0)^2 sign α     for |α| > α0
/// ```
/// Acts normal to the body: CL += CN cos α, CD += CN sin α. k in 1/rad² on S, α0 in rad.
/// Source: form of Polhamus' suction analogy and of cross-flow over a slender body; onset of order 0.1 rad.
#[derive(Clone, Copy, Debug)]
pub struct VortexLiftBodyWing;

impl Effect for VortexLiftBodyWing {
    fn name(&self) -> &'static str {
        "vortex_lift_bodywing"
    }
    fn physics(&self) -> &'static str {
        "vortices rolling up between hull and wing add a force normal to the body beyond an onset angle of attack, growing faster than linearly"
    }
    fn separated_by(&self) -> &'static str {
        "legs at shallow pitch (large angle of attack) beside steep ones: it is absent below the onset"
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn start(&self) -> f64 {
        // At no size the onset angle would be felt by nothing.
        0.5 * self.parameters()[0].typical
    }
    fn in_flow(&self) -> InFlow {
        InFlow { normal_force: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "k",
                unit: "1/rad^2",
                off: 0.0,
                low: 0.0,
                high: 80.0,
                typical: 8.0,
                source: "Kv ~ pi on the wing (Polhamus), hull comparable; wide",
            },
            Parameter { name: "onset_rad", unit: "rad", off: 0.1, low: 0.03, high: 0.2, typical: 0.03, source: "order 0.1 rad; guess" },
        ]
    }
    fn normal_force(&self, p: &[f64], at: &Flow) -> f64 {
        let beyond = at.alpha_rad.abs() - p[1];
        if beyond > 0.0 { p[0] * beyond * beyond * at.alpha_rad.signum() } else { 0.0 }
    }
}

/// Normal force of the wing's side edges, CN = k α|α| (k in 1/rad² on S), from zero angle. Source: Lamar's side-edge suction.
#[derive(Clone, Copy, Debug)]
pub struct SideEdgeLift;

impl Effect for SideEdgeLift {
    fn name(&self) -> &'static str {
        "side_edge_lift"
    }
    fn physics(&self) -> &'static str {
        "vortices along the wing's side edges add a force normal to the wing that grows with the square of the angle of attack from zero"
    }
    fn separated_by(&self) -> &'static str {
        "a sweep of pitch from steep to shallow, best with a speed sensor"
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow { normal_force: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "k",
            unit: "1/rad^2",
            off: 0.0,
            low: 0.0,
            high: 40.0,
            typical: 3.0,
            source: "K_v of rectangular wings, Lamar; C_Dc 1-3",
        }]
    }
    fn normal_force(&self, p: &[f64], at: &Flow) -> f64 {
        p[0] * at.alpha_rad * at.alpha_rad.abs()
    }
}

/// Half of the range of angles over which flow separates, rad. A guess: sections of 6 % thickness at low Reynolds numbers lose their
/// slope over some four degrees.
const ROUNDED_RAD: f64 = 0.04;

/// How far an angle is beyond the stall, rad, the corner rounded: no flow separates everywhere at once.
fn rounded(beyond: f64) -> f64 {
    if beyond >= ROUNDED_RAD {
        beyond
    } else {
        let in_corner = (beyond + ROUNDED_RAD).max(0.0);
        in_corner * in_corner / (4.0 * ROUNDED_RAD)
    }
}

/// The slope of the linear lift halves around an angle, and a share of the lift that is lost, times sin alpha, comes back as drag. Off: an
/// angle that is never reached.
#[derive(Clone, Copy, Debug)]
pub struct Stall;

impl Effect for Stall {
    fn name(&self) -> &'static str {
        "stall"
    }
    fn physics(&self) -> &'static str {
        "the flow separates beyond an angle of attack and the lift of wing and hull grows only half as fast from there"
    }
    fn separated_by(&self) -> &'static str {
        "shallow legs that pass through the stall angle, up and down"
    }
    fn onset(&self) -> Option<Onset> {
        Some(Onset { range_rad: (0.03, 0.25), starts_rad: [0.05, 0.10, 0.16], tried_rad: [0.05, 0.09, 0.15], unfelt_rad: 0.2 })
    }
    fn in_flow(&self) -> InFlow {
        InFlow { lift: true, drag: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "alpha_stall_rad",
                unit: "rad",
                off: ALPHA_VALID_RAD + ROUNDED_RAD,
                low: 0.01,
                high: ALPHA_VALID_RAD + ROUNDED_RAD,
                typical: 0.2,
                source: "6 % sections at chord Reynolds number 1e4-1e5 separate at 6-12 deg",
            },
            Parameter {
                name: "loss",
                unit: "1",
                off: 0.5,
                low: 0.2,
                high: 0.9,
                typical: 0.08,
                source: "half of the slope by definition; its spread is a guess",
            },
            Parameter {
                name: "quadratic_share",
                unit: "1",
                off: 0.5,
                low: 0.0,
                high: 1.0,
                typical: 0.5,
                source: "0: vortex lift of the edges survives, 1: it is lost like the linear lift",
            },
            Parameter {
                name: "drag_share",
                unit: "1",
                off: 0.0,
                low: 0.0,
                high: 0.6,
                typical: 0.2,
                source: "of the lift that is lost, times sin alpha: 0 for a law that knows lift alone, more where suction goes with it; guess",
            },
        ]
    }
    fn drag(&self, p: &[f64], at: &Flow, _lift: f64, c: &Constants) -> f64 {
        if p[3] == 0.0 { 0.0 } else { -p[3] * self.lift(p, at, at.alpha_rad, c) * libm::sin(at.alpha_rad) }
    }
    fn lift(&self, p: &[f64], at: &Flow, lift_angle_rad: f64, c: &Constants) -> f64 {
        let angle = lift_angle_rad.abs();
        let beyond = rounded(angle - p[0]);
        if at.attached || beyond <= 0.0 {
            return 0.0;
        }
        // Separated flow gives the lift of a smaller angle.
        let lost = p[1] * beyond;
        let quadratic = c.lift_quadratic_per_rad2 * ((angle - lost) * (angle - lost) - angle * angle);
        (p[2] * quadratic - c.lift_slope_per_rad * lost) * lift_angle_rad.signum()
    }
}

/// Linear lift times (1 + rel_error). How much of the quadratic lift goes with it is open: times (1 + quadratic_share rel_error), 0 for
/// a lift that is only steeper at the origin, 1 for a lift curve that is wrong as a whole.
#[derive(Clone, Copy, Debug)]
pub struct LiftSlopeError;

impl Effect for LiftSlopeError {
    fn name(&self) -> &'static str {
        "lift_slope_error"
    }
    fn physics(&self) -> &'static str {
        "the linear lift slope of wing and hull is wrong by a constant factor"
    }
    fn separated_by(&self) -> &'static str {
        "a speed sensor or GPS displacement without current, on shallow legs"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::LiftSlope)
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
                low: -0.8,
                high: 2.0,
                typical: 0.3,
                source: "hull carry-over changes the slope by 1.4-2.1 (slender-body theory)",
            },
            Parameter { name: "quadratic_share", unit: "1", off: 0.5, low: 0.0, high: 1.0, typical: 0.5, source: "guess" },
        ]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        c.lift_slope_per_rad *= 1.0 + p[0];
        c.lift_quadratic_per_rad2 *= 1.0 + p[1] * p[0];
    }
}

/// Lift is zero at an angle: CL(α) becomes CL(α − angle). How much of the hull's drag polar turns with it is open:
/// CDb α² becomes CDb (α − drag_share angle)², 0 for a wing set at an angle, 1 for a hull that is crooked as a whole.
#[derive(Clone, Copy, Debug)]
pub struct ZeroLiftAngle;

impl Effect for ZeroLiftAngle {
    fn name(&self) -> &'static str {
        "zero_lift_angle"
    }
    fn physics(&self) -> &'static str {
        "wing incidence or an asymmetric hull shifts the angle of attack at which lift vanishes, with opposite effect in dives and climbs"
    }
    fn separated_by(&self) -> &'static str {
        "dives and climbs at several pitches and speeds, and a bench check of the pitch sensor"
    }
    fn in_flow(&self) -> InFlow {
        InFlow { lift_angle: true, drag: true, ..InFlow::NOTHING }
    }
    fn parameters(&self) -> &'static [Parameter] {
        &[
            Parameter {
                name: "angle_rad",
                unit: "rad",
                off: 0.0,
                low: -0.2,
                high: 0.2,
                typical: 0.02,
                source: "wing incidence of 0.5-2 deg; guess",
            },
            Parameter { name: "drag_share", unit: "1", off: 0.5, low: 0.0, high: 1.0, typical: 0.5, source: "guess" },
        ]
    }
    fn drag(&self, p: &[f64], at: &Flow, _lift: f64, c: &Constants) -> f64 {
        let shifted = at.alpha_rad - p[1] * p[0];
        c.hull_drag_per_rad2 * (shifted * shifted - at.alpha_rad * at.alpha_rad)
    }
    fn lift_angle_rad(&self, p: &[f64], alpha_rad: f64) -> f64 {
        alpha_rad - p[0]
    }
}

#[cfg(test)]
mod tests {
    use super::{Effect, Stall};
    use crate::effects::Flow;
    use crate::effects::tests::nominal;

    /// Suction goes with the lift that is lost: what it had been spared comes back as drag, and none where nothing has separated.
    #[test]
    fn accuracy_a_stall_gives_back_a_share_of_its_lost_lift_as_drag() {
        let c = nominal();
        let at = |alpha_rad: f64| Flow {
            alpha_rad,
            speed_m_s: 0.3,
            roll_rad: 0.0,
            climb_m_s: 0.0,
            time_s: 0.0,
            temperature_degc: 10.0,
            attached: false,
        };
        let law = |share: f64| [0.1, 0.5, 0.5, share];
        for alpha in [0.2, -0.2] {
            let lost = Stall.lift(&law(0.4), &at(alpha), alpha, &c);
            assert!(lost * alpha < 0.0, "{lost}");
            let drag = Stall.drag(&law(0.4), &at(alpha), 0.0, &c);
            // Rounding of one product.
            assert!((drag - 0.4 * lost.abs() * alpha.abs().sin()).abs() < 1e-15 && drag > 0.0, "{drag}");
            assert_eq!(Stall.drag(&law(0.0), &at(alpha), 0.0, &c), 0.0);
        }
        assert_eq!(Stall.drag(&law(0.4), &at(0.04), 0.0, &c), 0.0);
    }
}
