//! Which steady glide follows: angle of attack, path, speed.
//!
//! Forces balance along and across the path (γ path angle, B net buoyancy):
//! ```text
//! L = |B| cos γ,  D = |B| sin|γ|   =>   tan|γ| = C_D/C_L,   |γ| = |θ| + α
//! U² = 2 |B| sin|γ| / (ρ S C_D)
//! ```
//! At a given pitch θ this may have up to three roots in α. The lowest is the
//! one a glider settles on from a steep path; where the pitch needed *rises*
//! with α the glider is on the stall side; below a least pitch there is none.
//!
//! Magnitudes inside (α ≥ 0, angles below the horizon positive), signs outside:
//! dives have θ < 0, γ < 0, α > 0, sink rate > 0; climbs the opposite.
//! Not covered: unsteady flight, moments (pitch is taken as held), turns.

use crate::effects::{Flow, LiftDrag};
use crate::polar::Polar;

/// Largest |α| a root is looked for at, rad (45°).
const ALPHA_SEARCH_RAD: f64 = core::f64::consts::FRAC_PI_4;

/// Steps of the search over α: 0.09° apart, narrower than any two roots of a physical polar.
const STEPS: u32 = 500;

/// Halvings of a bracket: 0.09° / 2^50 is below one ulp of α.
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
    /// A steeper pitch means a larger α: stalled, not held by a constant pitch.
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

/// All steady glides at one trim, lowest α first.
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
    /// Pitch too flat: no α balances it. The least |pitch| that has a glide, rad.
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

/// Roots of the balance at one speed, lowest first: (α, side).
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
    let step = ALPHA_SEARCH_RAD / f64::from(STEPS);
    let (mut low, mut before) = (0.0, pitch(0.0) - theta);
    for i in 1..=STEPS {
        let high = step * f64::from(i);
        let value = pitch(high) - theta;
        if value + theta < least {
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
            found[n] = Some((0.5 * (l + h), if falling { Side::Attached } else { Side::Stall }));
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
        let Some((alpha, side)) = found[0] else { return Err(GlideError::TooFlat { least_pitch_rad }) };
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
