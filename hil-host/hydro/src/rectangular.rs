//! Lift of a thin rectangular plate of low aspect ratio: potential lift, the side edges' vortices, separation.
//!
//! ```text
//! C_L = a (K_p sin α cos² α + K_v r cos α sin α |sin α|) + (1 − a) C_N cos α
//! r   = 1 / (1 + e^((α_o − |α|)/w))       share of the side-edge suction that has become vortex lift
//! a   = share of attached flow, C_N of the separated plate: [`Separation`]
//! ```
//! Eq. 11 with two corrections. An unswept leading edge carries no vortex of its own (Traub 2023, Aerospace 10(7) 597, rectangular
//! plates of A 0.5 to 3): K_v is the suction of the *side* edges alone (Lamar, NASA TR R-428), which falls with A, not the constant π of
//! a delta wing. And that suction turns into lift only where the flow along the side edge has separated: an onset.
//!
//! | constant | where it is from | fitted to the plates it is held against |
//! |---|---|---|
//! | K_p | eq. 9 | no |
//! | K_v(A) | lifting-surface theory, own lattice (`src/tests/side_edge_lattice.rs`) | no |
//! | end of the low-angle regime, full separation | stall limits by A ([`low_angle_end_rad`]) | no |
//! | onset at A = 1 | the plates themselves ([`ONSET_AT_ONE_RAD`]) | yes, one number |
//!
//! Held against measured rectangular plates (`src/tests/rectangular_plates.rs`): rms of C_L over 3–20° 0.018 (A 1), 0.020 (A 2) at
//! Re 1.4e5, 0.034 (A 1), 0.005 (A 3) in Lamar's data, which show no onset and are met to 0.021 without one. The two series
//! of A = 1 differ by 0.06 between 6° and 12°: what the onset does at an edge and a Reynolds number that nobody measured is not known better.
//!
//! On a hull the panels see K_W(B) α (equivalent angle of attack, Hemsch & Nielsen 1983): onset and separation come that much earlier,
//! and the lift has the carry-over of [`crate::interference`], which for the vortex term stands in for K_W(B)².
//!
//! Range: A 0.25 to 3, thin sections, Re 1e5. **Below A = 0.5 it is an extrapolation**: slope and K_v rest on theory that is exact
//! for A → 0, the onset on what an abstract says of plates of A 0.25. [`interval`] states it. No measurement at hand settles the onset of
//! the rails (1° here): the same share of the low-angle regime as at A = 1 would be 12°, 1.8 sigma away, with up to 0.06 less C_L. The simulated sea is no
//! judge of it, since the plant's rails shed their vortices from the first angle; only a flight is.

use crate::lift_slope;
use crate::separation::Separation;

/// Onset of the side-edge vortex at A = 1, rad (9.5°): half way between what the plates at the glider's Reynolds number say (Pelletier &
/// Mueller: 11.0°) and what all measured series say together (8.25°; Lamar's alone: none).
pub const ONSET_AT_ONE_RAD: f64 = 0.165_806_278_939_461_3;

/// Width of the onset as a share of its angle, 1: a guess; 0.1 to 0.2 change no rms by more than 0.002.
pub const ONSET_WIDTH_SHARE: f64 = 0.15;

/// Least width of the onset, rad (0.3°): the law stays smooth where there is next to none (guess).
const LEAST_WIDTH_RAD: f64 = 0.005;

/// Broadside C_N of a rectangular plate, 1: 1.17 square to 1.2 at A 5 (Hoerner, Fluid-Dynamic Drag, from memory).
pub const BROADSIDE_CN: f64 = 1.17;

/// One sigma of K_v over its theory, 1: the ratio of measured to theoretical K_v is 0.7 to 1.25 over the measured series.
pub const KV_RELATIVE_SIGMA: f64 = 0.2;

/// One sigma of the onset over the same share of the low-angle regime as at A = 1, 1: for A ≥ 1 none at all (Lamar's plates) is two
/// sigma away, at A ≤ 0.25 that share is.
pub const ONSET_RELATIVE_SIGMA: f64 = 0.5;

/// (A, K_v of both side edges): suction of the side edges of a flat rectangular lifting surface, lattice of 16 × 60 panels, converged to 0.2 %;
/// A → 0 is π (slender wing).
const SIDE_EDGE_KV: [(f64, f64); 8] =
    [(0.0, core::f64::consts::PI), (0.1, 3.016), (0.25, 2.840), (0.5, 2.571), (1.0, 2.133), (1.5, 1.802), (2.0, 1.549), (3.0, 1.195)];

/// (A, end of the low-angle regime, full separation), degrees: A ≥ 0.5 limits after Torres & Mueller 2004, below and for full separation those of
/// the agile-aeroplane model of Khan & Nahon; both as they stand in the public source of that model (`McFoamy_Airfoil_Simplified.m`).
const STALL_DEG: [(f64, f64, f64); 9] = [
    (0.1666, 32.0, 40.0),
    (0.333, 36.0, 60.0),
    (0.5, 35.0, 56.0),
    (0.75, 33.0, 48.0),
    (1.0, 28.0, 40.0),
    (1.25, 20.0, 29.0),
    (1.5, 15.0, 28.7),
    (2.0, 13.0, 28.0),
    (3.0, 13.0, 24.0),
];

/// Linear between points, constant beyond the ends.
fn between(points: impl Iterator<Item = (f64, f64)>, x: f64) -> f64 {
    let mut before: Option<(f64, f64)> = None;
    for (px, py) in points {
        match before {
            _ if x > px => before = Some((px, py)),
            None => return py,
            Some((bx, by)) => return by + (py - by) * (x - bx) / (px - bx),
        }
    }
    before.map_or(f64::NAN, |b| b.1)
}

/// K_v of the two side edges by lifting-surface theory, 1. Range 0 ≤ A ≤ 3.
#[must_use]
pub fn side_edge_kv(aspect_ratio: f64) -> f64 {
    between(SIDE_EDGE_KV.iter().copied(), aspect_ratio)
}

/// Angle at which the low-angle regime ends, rad. Range 0.17 ≤ A ≤ 3, ± 3°.
#[must_use]
pub fn low_angle_end_rad(aspect_ratio: f64) -> f64 {
    between(STALL_DEG.iter().map(|p| (p.0, p.1)), aspect_ratio).to_radians()
}

/// Angle from which the flow is fully separated, rad. Range 0.17 ≤ A ≤ 3, ± 5°.
#[must_use]
pub fn separated_from_rad(aspect_ratio: f64) -> f64 {
    between(STALL_DEG.iter().map(|p| (p.0, p.2)), aspect_ratio).to_radians()
}

/// Onset that is the same share of the low-angle regime as at A = 1, rad.
fn onset_of_regime_rad(aspect_ratio: f64) -> f64 {
    ONSET_AT_ONE_RAD * low_angle_end_rad(aspect_ratio) / low_angle_end_rad(1.0)
}

/// Onset of the side-edge vortex, rad: for A ≥ 1 the same share of the low-angle regime as at A = 1; below it fades to none at A = 0.25,
/// where plates in water follow lattice lift and cross-flow at every angle (NACA Report 1246, Wadlin, Ramsen & Vaughan, abstract: "at all
/// angles investigated for aspect ratios of 1.00 and 0.25").
#[must_use]
pub fn onset_rad(aspect_ratio: f64) -> f64 {
    onset_of_regime_rad(aspect_ratio) * between([(0.25, 0.0), (1.0, 1.0)].into_iter(), aspect_ratio)
}

/// Constants of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SideEdge {
    /// K_v of both side edges, 1.
    pub kv: f64,
    /// Angle at which half of the suction has become vortex lift α_o, rad.
    pub onset_rad: f64,
    /// Width of the onset (logistic) w, rad.
    pub onset_width_rad: f64,
    /// How the flow leaves the plate.
    pub separation: Separation,
}

impl SideEdge {
    /// The law at an aspect ratio, every constant from its source.
    #[must_use]
    pub fn of(aspect_ratio: f64) -> Self {
        let onset = onset_rad(aspect_ratio);
        Self {
            kv: side_edge_kv(aspect_ratio),
            onset_rad: onset,
            onset_width_rad: (ONSET_WIDTH_SHARE * onset).max(LEAST_WIDTH_RAD),
            separation: Separation::between(low_angle_end_rad(aspect_ratio), separated_from_rad(aspect_ratio), BROADSIDE_CN),
        }
    }

    /// Share of the side-edge suction that has become vortex lift, 0..1.
    #[must_use]
    pub fn developed(&self, alpha_rad: f64) -> f64 {
        1.0 / (1.0 + libm::exp((self.onset_rad - alpha_rad.abs()) / self.onset_width_rad))
    }

    /// C_L at the linear slope `kp_per_rad`. Odd in α.
    #[must_use]
    pub fn lift(&self, kp_per_rad: f64, alpha_rad: f64) -> f64 {
        self.lift_of(kp_per_rad, alpha_rad, libm::sin(alpha_rad), libm::cos(alpha_rad))
    }

    /// [`Self::lift`] with sin α and cos α worked out before, and onset and separation at the angle that the edges see.
    pub(crate) fn lift_of(&self, kp_per_rad: f64, seen_rad: f64, s: f64, c: f64) -> f64 {
        let attached = self.separation.attached(seen_rad);
        let on = kp_per_rad * s * c * c + self.kv * self.developed(seen_rad) * c * s * s.abs();
        attached * on + (1.0 - attached) * self.separation.normal_of(s) * c
    }
}

/// C_L of a rectangular plate with its one-sigma interval (low, nominal, high): K_v and the onset, each by its sigma, in root sum of
/// squares. Range as the law's.
#[must_use]
pub fn interval(aspect_ratio: f64, alpha_rad: f64) -> (f64, f64, f64) {
    let law = SideEdge::of(aspect_ratio);
    let kp = lift_slope::hoerner_borst(aspect_ratio);
    let at = |law: &SideEdge| law.lift(kp, alpha_rad);
    let nominal = at(&law);
    let by_kv = at(&SideEdge { kv: law.kv * (1.0 + KV_RELATIVE_SIGMA), ..law }) - nominal;
    let sigma = ONSET_RELATIVE_SIGMA * onset_of_regime_rad(aspect_ratio);
    let onset = |onset_rad: f64| {
        at(&SideEdge { onset_rad, onset_width_rad: (ONSET_WIDTH_SHARE * onset_rad).max(LEAST_WIDTH_RAD), ..law }) - nominal
    };
    let (earlier, later) = (onset((law.onset_rad - sigma).max(0.0)), onset(law.onset_rad + sigma));
    let root = |a: f64, b: f64| libm::sqrt(a * a + b * b);
    (nominal - root(by_kv, later), nominal, nominal + root(by_kv, earlier))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_the_law_is_odd_smooth_and_tends_to_the_plate() {
        for a in [0.25, 0.3155, 0.5, 1.0, 2.0, 3.0] {
            let (law, kp) = (SideEdge::of(a), lift_slope::hoerner_borst(a));
            assert_eq!(law.lift(kp, 0.0), 0.0);
            for i in 1..=90 {
                let x = f64::from(i).to_radians();
                assert!((law.lift(kp, x) + law.lift(kp, -x)).abs() < 1e-15, "A {a} at {i}");
                assert!((0.0..=1.0).contains(&law.developed(x)));
                // No corner: the slope changes by less than 1.6/rad from one degree to the next.
                let slope = |d: f64| (law.lift(kp, x + d) - law.lift(kp, x + d - 1e-4)) / 1e-4;
                assert!((slope(1f64.to_radians()) - slope(0.0)).abs() < 1.6, "A {a} at {i}");
            }
            let eighty = 80f64.to_radians();
            let plate = law.separation.normal(eighty) * eighty.cos();
            assert!((law.lift(kp, eighty) / plate - 1.0).abs() < 0.05, "A {a}");
        }
    }

    #[test]
    fn the_slope_at_zero_is_the_potential_one() {
        for a in [0.3155, 1.0, 2.0] {
            let kp = lift_slope::hoerner_borst(a);
            assert!((SideEdge::of(a).lift(kp, 1e-3) / (kp * 1e-3) - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn prop_constants_fall_with_aspect_ratio_and_stay_in_their_limits() {
        for i in 0..300 {
            let (a, b) = (0.01 * f64::from(i), 0.01 * f64::from(i + 1));
            assert!(side_edge_kv(b) < side_edge_kv(a) && side_edge_kv(a) <= core::f64::consts::PI);
            assert!(separated_from_rad(a) > low_angle_end_rad(a) && low_angle_end_rad(a) > onset_rad(a));
        }
        assert!((onset_rad(1.0).to_degrees() - 9.5).abs() < 1e-9);
        assert!(
            (low_angle_end_rad(0.333).to_degrees() - 36.0).abs() < 1e-9 && (separated_from_rad(0.333).to_degrees() - 60.0).abs() < 1e-9
        );
    }

    #[test]
    fn the_interval_holds_the_law_and_is_wider_where_the_vortex_is() {
        let width = |deg: f64| {
            let (low, nominal, high) = interval(0.3155, deg.to_radians());
            assert!(low <= nominal && nominal <= high && low > 0.0);
            high - low
        };
        assert!(width(3.0) < width(10.0) && width(10.0) < 0.2);
        // An onset as late as at A = 1 is the other thing that could be so: within two sigma of the onset, and below the law at every angle.
        let (law, kp, late) = (SideEdge::of(0.3155), lift_slope::hoerner_borst(0.3155), onset_of_regime_rad(0.3155));
        let sigmas = (late - law.onset_rad) / (ONSET_RELATIVE_SIGMA * late);
        assert!((11.5..12.5).contains(&late.to_degrees()) && (1.7..2.0).contains(&sigmas), "{late} {sigmas}");
        let late = SideEdge { onset_rad: late, onset_width_rad: ONSET_WIDTH_SHARE * late, ..law };
        let loss = (1..=20).map(|deg| f64::from(deg).to_radians()).map(|x| law.lift(kp, x) - late.lift(kp, x));
        assert!(loss.clone().all(|l| l >= 0.0) && (0.04..0.08).contains(&loss.fold(0.0, f64::max)));
    }
}
