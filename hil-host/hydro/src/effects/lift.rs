//! Effects that change the lift: vortices, stall, slope and zero of the lift curve.

use super::{ALPHA_VALID_RAD, Calibrated, Constants, Effect, Flow, Onset, Parameter};

/// Normal force of vortices shed by hull and wing beyond an onset angle.
///
/// ```text
/// CN = k (|α| − α0)^2 sign α     for |α| > α0
/// ```
/// Acts normal to the body: CL += CN cos α, CD += CN sin α. k in 1/rad² on S, α0 in rad.
/// Source: form of Polhamus' suction analogy and of cross-flow over a slender body; onset of order 0.1 rad.
pub static VORTEX_LIFT_BODYWING: Effect = Effect {
    name: "vortex_lift_bodywing",
    physics: "vortices rolling up between hull and wing add a force normal to the body beyond an onset angle of attack, growing faster than linearly",
    separated_by: "legs at shallow pitch (large angle of attack) beside steep ones: it is absent below the onset",
    parameters: &[
        Parameter::new("k", "1/rad^2", 0.0, (0.0, 80.0), 8.0, "Kv ~ pi on the wing (Polhamus), hull comparable; wide"),
        Parameter::new("onset_rad", "rad", 0.1, (0.03, 0.2), 0.03, "order 0.1 rad; guess"),
    ],
    usual_sign: 1.0,
    // At no size the onset angle would be felt by nothing: half of the typical one.
    starts_at: Some(4.0),
    normal_force: Some(&|p, at| {
        let beyond = at.alpha_rad.abs() - p[1];
        if beyond > 0.0 { p[0] * beyond * beyond * at.alpha_rad.signum() } else { 0.0 }
    }),
    ..Effect::NONE
};

/// Normal force of the wing's side edges, CN = k α|α| (k in 1/rad² on S), from zero angle. Source: Lamar's side-edge suction.
pub static SIDE_EDGE_LIFT: Effect = Effect {
    name: "side_edge_lift",
    physics: "vortices along the wing's side edges add a force normal to the wing that grows with the square of the angle of attack from zero",
    separated_by: "a sweep of pitch from steep to shallow, best with a speed sensor",
    parameters: &[Parameter::new("k", "1/rad^2", 0.0, (0.0, 40.0), 3.0, "K_v of rectangular wings, Lamar; C_Dc 1-3")],
    usual_sign: 1.0,
    normal_force: Some(&|p, at| p[0] * at.alpha_rad * at.alpha_rad.abs()),
    ..Effect::NONE
};

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

fn stalled_lift(p: &[f64], at: &Flow, lift_angle_rad: f64, c: &Constants) -> f64 {
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

/// The slope of the linear lift halves around an angle, and a share of the lift that is lost, times sin alpha, comes back as drag. Off: an
/// angle that is never reached.
pub static STALL: Effect = Effect {
    name: "stall",
    physics: "the flow separates beyond an angle of attack and the lift of wing and hull grows only half as fast from there",
    separated_by: "shallow legs that pass through the stall angle, up and down",
    parameters: &[
        Parameter::new(
            "alpha_stall_rad",
            "rad",
            ALPHA_VALID_RAD + ROUNDED_RAD,
            (0.01, ALPHA_VALID_RAD + ROUNDED_RAD),
            0.2,
            "6 % sections at chord Reynolds number 1e4-1e5 separate at 6-12 deg",
        ),
        Parameter::new("loss", "1", 0.5, (0.2, 0.9), 0.08, "half of the slope by definition; its spread is a guess"),
        Parameter::new(
            "quadratic_share",
            "1",
            0.5,
            (0.0, 1.0),
            0.5,
            "0: vortex lift of the edges survives, 1: it is lost like the linear lift",
        ),
        Parameter::new(
            "drag_share",
            "1",
            0.0,
            (0.0, 0.6),
            0.2,
            "of the lift that is lost, times sin alpha: 0 for a law that knows lift alone, more where suction goes with it; guess",
        ),
    ],
    onset: Some(Onset { range_rad: (0.03, 0.25), starts_rad: [0.05, 0.10, 0.16], tried_rad: [0.05, 0.09, 0.15], unfelt_rad: 0.2 }),
    drag: Some(&|p, at, _, c| if p[3] == 0.0 { 0.0 } else { -p[3] * stalled_lift(p, at, at.alpha_rad, c) * libm::sin(at.alpha_rad) }),
    lift: Some(&stalled_lift),
    ..Effect::NONE
};

/// Linear lift times (1 + rel_error). How much of the quadratic lift goes with it is open: times (1 + quadratic_share rel_error), 0 for
/// a lift that is only steeper at the origin, 1 for a lift curve that is wrong as a whole.
pub static LIFT_SLOPE_ERROR: Effect = Effect {
    name: "lift_slope_error",
    physics: "the linear lift slope of wing and hull is wrong by a constant factor",
    separated_by: "a speed sensor or GPS displacement without current, on shallow legs",
    parameters: &[
        Parameter::new("rel_error", "1", 0.0, (-0.8, 2.0), 0.3, "hull carry-over changes the slope by 1.4-2.1 (slender-body theory)"),
        Parameter::new("quadratic_share", "1", 0.5, (0.0, 1.0), 0.5, "guess"),
    ],
    error_of: Some(Calibrated::LiftSlope),
    constants: Some(&|p, c| {
        c.lift_slope_per_rad *= 1.0 + p[0];
        c.lift_quadratic_per_rad2 *= 1.0 + p[1] * p[0];
    }),
    ..Effect::NONE
};

/// Lift is zero at an angle: CL(α) becomes CL(α − angle). How much of the hull's drag polar turns with it is open:
/// CDb α² becomes CDb (α − drag_share angle)², 0 for a wing set at an angle, 1 for a hull that is crooked as a whole.
pub static ZERO_LIFT_ANGLE: Effect = Effect {
    name: "zero_lift_angle",
    physics: "wing incidence or an asymmetric hull shifts the angle of attack at which lift vanishes, with opposite effect in dives and climbs",
    separated_by: "dives and climbs at several pitches and speeds, and a bench check of the pitch sensor",
    parameters: &[
        Parameter::new("angle_rad", "rad", 0.0, (-0.2, 0.2), 0.02, "wing incidence of 0.5-2 deg; guess"),
        Parameter::new("drag_share", "1", 0.5, (0.0, 1.0), 0.5, "guess"),
    ],
    drag: Some(&|p, at, _, c| {
        let shifted = at.alpha_rad - p[1] * p[0];
        c.hull_drag_per_rad2 * (shifted * shifted - at.alpha_rad * at.alpha_rad)
    }),
    lift_angle_rad: Some(&|p, alpha_rad| alpha_rad - p[0]),
    ..Effect::NONE
};

#[cfg(test)]
mod tests {
    use super::{STALL, stalled_lift};
    use crate::effects::tests::{at, nominal};

    /// Suction goes with the lift that is lost: what it had been spared comes back as drag, and none where nothing has separated.
    #[test]
    fn accuracy_a_stall_gives_back_a_share_of_its_lost_lift_as_drag() {
        let (c, drag) = (nominal(), STALL.drag.expect("it adds drag"));
        let law = |share: f64| [0.1, 0.5, 0.5, share];
        for alpha in [0.2, -0.2] {
            let lost = stalled_lift(&law(0.4), &at(alpha), alpha, &c);
            assert!(lost * alpha < 0.0, "{lost}");
            let back = drag(&law(0.4), &at(alpha), 0.0, &c);
            // Rounding of one product.
            assert!((back - 0.4 * lost.abs() * alpha.abs().sin()).abs() < 1e-15 && back > 0.0, "{back}");
            assert_eq!(drag(&law(0.0), &at(alpha), 0.0, &c), 0.0);
        }
        assert_eq!(drag(&law(0.4), &at(0.04), 0.0, &c), 0.0);
    }
}
