//! Which steady glide follows: angle of attack, path, speed.
//!
//! Forces balance along and across the path (γ path angle, B net buoyancy):
//! ```text
//! L = |B| cos γ,  D = |B| sin|γ|   =>   tan|γ| = C_D/C_L,   |γ| = |θ| + α
//! U² = 2 |B| sin|γ| / (ρ S C_D)
//! ```
//! At a given pitch θ this may have up to three roots in α. The lowest is the
//! one a glider settles on from a steep path. The pitch needed falls with α to
//! a least pitch and rises beyond it, on the stall side. Flatter than the least
//! pitch there is no attached glide: that is an error, never a stalled answer.
//! Roots are looked for inside the polar's own valid range only: continuations
//! beyond it are bounded, not right.
//!
//! Magnitudes inside (α ≥ 0, angles below the horizon positive), signs outside:
//! dives have θ < 0, γ < 0, α > 0, sink rate > 0; climbs the opposite.
//! Not covered: unsteady flight, moments (pitch is taken as held), turns.

use crate::effects::{Flow, LiftDrag};
use crate::polar::Polar;

/// Steps of the search over α, from 0 to the polar's valid range: 0.05° apart at 25°, narrower than any two roots of a physical polar.
const STEPS: u32 = 500;

/// Halvings of a bracket: 0.05° / 2^50 is below one ulp of α.
const HALVINGS: u32 = 50;

/// Steps of the speed iteration; with drag ~ U^-n, |n| ≤ 0.5, each step gains a factor ≥ 4.
const SPEED_STEPS: u32 = 40;

/// What holds a glider: pitch, weight, water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Pitch θ, rad, nose up positive.
    pub pitch_rad: f64,
    /// Net buoyancy B, N, up positive; a diving glider has B < 0.
    pub net_buoyancy_n: f64,
    /// Water density ρ, kg/m³.
    pub rho_kg_m3: f64,
}

/// On which side of the least pitch a root lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// A steeper pitch means a smaller α: the side a glider flies on.
    Attached,
    /// Beyond the α of least pitch: stalled, or in deep stall where plate lift takes over.
    Stall,
}

/// A steady glide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glide {
    /// Angle of attack α, rad; positive in dives.
    pub alpha_rad: f64,
    /// Path angle γ, rad, up positive.
    pub gamma_rad: f64,
    /// Pitch θ, rad.
    pub pitch_rad: f64,
    /// Speed through the water U, m/s.
    pub speed_m_s: f64,
    /// Horizontal speed U cos γ, m/s.
    pub horizontal_m_s: f64,
    /// Sink rate, m/s, down positive.
    pub sink_m_s: f64,
    /// Coefficients at this glide.
    pub force: LiftDrag,
    /// |L/D| = 1/tan|γ|.
    pub l_over_d: f64,
    /// Which side of the least pitch.
    pub side: Side,
}

/// All steady glides at one trim, lowest α first; the lowest is always [`Side::Attached`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glides {
    /// Lowest root: what the glider does.
    pub lowest: Glide,
    /// Further roots, where there are any.
    pub others: [Option<Glide>; 2],
}

/// Why there is no steady glide.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum GlideError {
    /// An input is not finite or not physical (its name).
    Input(&'static str),
    /// Pitch and buoyancy point opposite ways: it cannot glide forward.
    Opposed,
    /// Pitch too flat: no α inside the valid range balances it. The least |pitch| that has a glide, rad.
    TooFlat {
        /// Least |pitch| with a steady glide, rad.
        least_pitch_rad: f64,
    },
}

/// What a polar can do at best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// α of (L/D)max, rad.
    pub alpha_rad: f64,
    /// (L/D)max.
    pub l_over_d: f64,
    /// Least |γ| = atan(1/(L/D)max), rad.
    pub glide_angle_rad: f64,
    /// |θ| to hold for it, rad.
    pub pitch_rad: f64,
}

/// γ(α) − α: the |pitch| that holds α, rad.
fn pitch_for(force: LiftDrag, alpha: f64) -> f64 {
    libm::atan2(force.cd, force.cl) - alpha
}

/// The best glide of a polar at a speed, α in (0, `alpha_to_rad`].
///
/// A scan of 0.09° finds the highest point, golden section sharpens it; with
/// a polar that rises to the end of the range the end is returned.
#[must_use]
pub fn best(polar: &impl Polar, speed_m_s: f64, alpha_to_rad: f64) -> Best {
    let l_over_d = |alpha_rad: f64| polar.force(&Flow::steady(alpha_rad, speed_m_s)).l_over_d();
    let step = alpha_to_rad / f64::from(STEPS);
    let mut top = (step, l_over_d(step));
    for i in 2..=STEPS {
        let a = step * f64::from(i);
        let value = l_over_d(a);
        if value > top.1 {
            top = (a, value);
        }
    }
    let golden = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (top.0 - step, if top.0 + step < alpha_to_rad { top.0 + step } else { alpha_to_rad });
    for _ in 0..60 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if l_over_d(a) > l_over_d(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let alpha_rad = 0.5 * (low + high);
    let value = l_over_d(alpha_rad);
    let glide_angle_rad = libm::atan2(1.0, value);
    Best { alpha_rad, l_over_d: value, glide_angle_rad, pitch_rad: glide_angle_rad - alpha_rad }
}

fn finish(polar: &impl Polar, trim: &Trim, alpha: f64, speed_guess: f64, side: Side) -> Glide {
    let sign = if trim.net_buoyancy_n < 0.0 { 1.0 } else { -1.0 };
    let force = polar.force(&Flow::steady(sign * alpha, speed_guess));
    let gamma = trim.pitch_rad.abs() + alpha;
    let q_s = 0.5 * trim.rho_kg_m3 * polar.reference_area_m2();
    let speed = libm::sqrt(trim.net_buoyancy_n.abs() * libm::sin(gamma) / (q_s * force.cd));
    Glide {
        alpha_rad: sign * alpha,
        gamma_rad: -sign * gamma,
        pitch_rad: trim.pitch_rad,
        speed_m_s: speed,
        horizontal_m_s: speed * libm::cos(gamma),
        sink_m_s: sign * speed * libm::sin(gamma),
        force,
        l_over_d: 1.0 / libm::tan(gamma),
        side,
    }
}

/// Roots of the balance at one speed, lowest first: (α, side); and the least pitch of the attached side, rad.
fn roots(polar: &impl Polar, trim: &Trim, speed_m_s: f64) -> ([Option<(f64, Side)>; 3], f64) {
    let sign = if trim.net_buoyancy_n < 0.0 { 1.0 } else { -1.0 };
    let theta = trim.pitch_rad.abs();
    // Lift mirrored so that climbs are solved as dives.
    let pitch = |alpha: f64| {
        let f = polar.force(&Flow::steady(sign * alpha, speed_m_s));
        pitch_for(LiftDrag { cl: sign * f.cl, cd: f.cd }, alpha)
    };
    let mut found = [None; 3];
    let mut n = 0;
    let mut least = f64::INFINITY;
    let mut risen = false;
    let step = polar.alpha_valid_rad() / f64::from(STEPS);
    let (mut low, mut before) = (0.0, pitch(0.0) - theta);
    for i in 1..=STEPS {
        let high = step * f64::from(i);
        let value = pitch(high) - theta;
        risen |= value > before;
        if !risen {
            least = value + theta;
        }
        if (before > 0.0) != (value > 0.0) && n < found.len() {
            let falling = before > 0.0;
            let (mut l, mut h) = (low, high);
            for _ in 0..HALVINGS {
                let m = 0.5 * (l + h);
                if (pitch(m) - theta > 0.0) == falling {
                    l = m;
                } else {
                    h = m;
                }
            }
            found[n] = Some((0.5 * (l + h), if risen { Side::Stall } else { Side::Attached }));
            n += 1;
        }
        (low, before) = (high, value);
    }
    (found, least)
}

/// Every steady glide at a trim; the lowest root is what the glider does.
///
/// # Errors
/// Not physical, opposed, or too flat to glide ([`GlideError`]).
pub fn steady(polar: &impl Polar, trim: &Trim) -> Result<Glides, GlideError> {
    if !(trim.pitch_rad.is_finite() && trim.pitch_rad.abs() < core::f64::consts::FRAC_PI_2) {
        return Err(GlideError::Input("pitch_rad"));
    }
    if !(trim.net_buoyancy_n.is_finite() && trim.net_buoyancy_n != 0.0) {
        return Err(GlideError::Input("net_buoyancy_n"));
    }
    if !(trim.rho_kg_m3 > 0.0 && trim.rho_kg_m3.is_finite()) {
        return Err(GlideError::Input("rho_kg_m3"));
    }
    if trim.pitch_rad * trim.net_buoyancy_n < 0.0 {
        return Err(GlideError::Opposed);
    }
    let mut speed = 0.3;
    for _ in 0..SPEED_STEPS {
        let (found, least_pitch_rad) = roots(polar, trim, speed);
        let Some((alpha, side @ Side::Attached)) = found[0] else { return Err(GlideError::TooFlat { least_pitch_rad }) };
        let lowest = finish(polar, trim, alpha, speed, side);
        if !(lowest.speed_m_s > 0.0) {
            return Err(GlideError::Input("force"));
        }
        if (lowest.speed_m_s - speed).abs() <= 1e-10 * speed {
            let other = |r: Option<(f64, Side)>| r.map(|(a, s)| finish(polar, trim, a, speed, s));
            return Ok(Glides { lowest, others: [other(found[1]), other(found[2])] });
        }
        speed = lowest.speed_m_s;
    }
    Err(GlideError::Input("force"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{ALPHA_VALID_RAD, Active, Beyond, Constants, ForceModel, by_name};

    /// The published at-sea set on 0.1 m²: A0 0.0150, A2 1.05, k_L 0.753 (Merckelbach et al.).
    fn at_sea(lift_slope_per_rad: f64) -> Constants {
        Constants {
            gravity_m_s2: 9.81,
            mass_kg: 70.0,
            hull_volume_m3: 0.0696,
            compressibility_per_pa: 5e-10,
            thermal_expansion_per_k: 5e-5,
            reference_temperature_degc: 10.0,
            reference_area_m2: 0.1,
            lift_slope_per_rad,
            lift_quadratic_per_rad2: 0.0,
            cd0: 0.150,
            induced_k: 0.0,
            hull_drag_per_rad2: 10.5,
            slope_loss_per_rad2: 0.0,
            hull_drag_per_rad3: 0.0,
            added_mass_surge: 0.2,
            added_mass_heave: 0.92,
            bank_tilt: 0.0,
            banked_turn: 0.0,
            hull_lag_share: 0.0,
            beyond: Beyond::default(),
        }
    }

    fn dive(pitch_deg: f64, net_buoyancy_n: f64, rho_kg_m3: f64) -> Trim {
        Trim { pitch_rad: -pitch_deg.to_radians(), net_buoyancy_n: -net_buoyancy_n, rho_kg_m3 }
    }

    #[test]
    fn validate_published_coefficients_give_the_published_glides() {
        // (k_L, pitch deg, N, ρ; α deg, γ deg, U m/s, w m/s, L/D), each to one unit of its last digit.
        let rows = [
            (7.53, 21.9, 2.12, 1005.8, 2.9, 24.8, 0.316, 0.133, 2.16),
            (6.75, 21.9, 2.12, 1005.8, 3.34, 25.2, 0.311, 0.133, 2.12),
            (7.53, 26.0, 250e-6 * 1025.0 * 9.81, 1025.0, 2.37, 28.4, 0.373, 0.177, 1.85),
        ];
        for (k, pitch, n, rho, alpha, gamma, u, w, ld) in rows {
            let g = steady(&ForceModel::new(at_sea(k), &[]), &dive(pitch, n, rho)).unwrap().lowest;
            assert!((g.alpha_rad.to_degrees() - alpha).abs() < 0.06, "{g:?}");
            assert!((g.gamma_rad.to_degrees() + gamma).abs() < 0.1 && (g.speed_m_s - u).abs() < 1.1e-3, "{g:?}");
            assert!((g.sink_m_s - w).abs() < 1.1e-3 && (g.l_over_d - ld).abs() < 0.011, "{g:?}");
        }
        let b = best(&ForceModel::new(at_sea(7.53), &[]), 0.3, ALPHA_VALID_RAD);
        assert!((b.l_over_d - 3.00).abs() < 0.01 && (b.alpha_rad.to_degrees() - 6.8).abs() < 0.06, "{b:?}");
        assert!((b.glide_angle_rad.to_degrees() - 18.4).abs() < 0.1 && (b.pitch_rad.to_degrees() - 11.6).abs() < 0.1, "{b:?}");
    }

    #[test]
    fn the_lowest_of_three_roots_is_taken() {
        // Graver's set: three roots at pitch 26: 2.5, 23 and 29 deg if lift and drag grow on; ours ends at 0.35 rad.
        let c = Constants { reference_area_m2: 0.0355, lift_slope_per_rad: 11.76, cd0: 0.214, hull_drag_per_rad2: 32.3, ..at_sea(0.0) };
        let g = steady(&ForceModel::new(c, &[]), &dive(26.0, 2.3, 1025.0)).unwrap();
        assert!((g.lowest.alpha_rad.to_degrees() - 2.5).abs() < 0.1 && g.lowest.side == Side::Attached, "{g:?}");
    }

    #[test]
    fn prop_speed_goes_with_the_root_of_buoyancy_and_areas_change_no_angle() {
        let trim = dive(21.9, 2.12, 1005.8);
        let of = |c: Constants, trim: &Trim| steady(&ForceModel::new(c, &[]), trim).unwrap().lowest;
        let one = of(at_sea(7.53), &trim);
        let four_times = of(at_sea(7.53), &Trim { net_buoyancy_n: 4.0 * trim.net_buoyancy_n, ..trim });
        let twice_as_large = of(Constants { reference_area_m2: 0.2, ..at_sea(7.53) }, &trim);
        for (other, speed) in [(four_times, 2.0), (twice_as_large, 0.5_f64.sqrt())] {
            assert!((other.l_over_d / one.l_over_d - 1.0).abs() < 1e-6, "{other:?} {one:?}");
            assert!((other.speed_m_s / one.speed_m_s / speed - 1.0).abs() < 1e-6, "{other:?} {one:?}");
        }
        // 4.6 % of L/D per degree of path at 25 deg, independent of the polar: d ln cot γ = −2/sin 2γ dγ.
        let per_degree = 2.0 / (2.0 * one.gamma_rad.abs()).sin() * 1f64.to_radians();
        assert!((per_degree - 0.046).abs() < 5e-4, "{per_degree}");
    }

    #[test]
    fn drag_that_depends_on_speed_still_balances() {
        let active = [Active::sized(by_name("reynolds_drag").unwrap(), 0.5)];
        let model = ForceModel::new(at_sea(7.53), &active);
        for n in [0.5, 1.0, 2.0, 4.0] {
            let g = steady(&model, &dive(22.0, n, 1025.0)).unwrap().lowest;
            let f = model.coefficients(&Flow::steady(g.alpha_rad, g.speed_m_s));
            let d = 0.5 * 1025.0 * 0.1 * g.speed_m_s.powi(2) * f.cd;
            assert!((d - n * g.gamma_rad.abs().sin()).abs() < 1e-6, "{n} N: {d}");
        }
    }

    #[test]
    fn impossible_trims_are_named() {
        let m = ForceModel::new(at_sea(7.53), &[]);
        let ok = dive(20.0, 2.0, 1025.0);
        assert_eq!(steady(&m, &Trim { pitch_rad: f64::NAN, ..ok }).unwrap_err(), GlideError::Input("pitch_rad"));
        assert_eq!(steady(&m, &Trim { net_buoyancy_n: 0.0, ..ok }).unwrap_err(), GlideError::Input("net_buoyancy_n"));
        assert_eq!(steady(&m, &Trim { rho_kg_m3: -1.0, ..ok }).unwrap_err(), GlideError::Input("rho_kg_m3"));
        assert_eq!(steady(&m, &Trim { pitch_rad: 0.3, ..ok }).unwrap_err(), GlideError::Opposed);
        assert!(
            matches!(steady(&m, &dive(5.0, 2.0, 1025.0)), Err(GlideError::TooFlat { least_pitch_rad }) if (0.14..0.155).contains(&least_pitch_rad))
        );
    }
}
