//! The vehicles the paper is judged with.
//!
//! *Plain*: literature constants in the paper's structure (eq. 12, eq. 14 drag, no interference). *Fuller*: rail wings by the law of
//! rectangular plates and without edge suction, wing–body carry-over, and the drag area a Slocum has at sea. *Paper*: tuned to the paper.
//! Nothing but these steps differs, so a claim's number can be traced to a step.

use hydro::drag::DragRule;
use hydro::rectangular::SideEdge;
use hydro::wing::WingModel;
use hydro::{Flow, Geometry, Polar};
use signals::Wings;

use rig::flight::vehicles;

/// Appendage drag area of a Slocum at sea, m²: brings the drag area at zero lift from 0.0040 to 0.0150, the value fitted to
/// *Comet* 2016 (within 0.0001).
pub const SEA_DRAG_AREA_M2: f64 = 0.011;

/// Geometry of a built-in vehicle.
///
/// # Errors
/// Never for the committed files.
pub fn geometry(name: &str) -> anyhow::Result<Geometry> {
    Ok(vehicles::built_in(name)?.geometry)
}

/// Literature constants, the paper's structure.
///
/// # Errors
/// Never for the committed files.
pub fn plain(wings: Wings) -> anyhow::Result<Geometry> {
    geometry(match wings {
        Wings::Standard => "slocum-standard",
        Wings::LowAspectRatio => "slocum-low-ar",
    })
}

/// Tuned to the paper.
///
/// # Errors
/// Never for the committed files.
pub fn paper(wings: Wings) -> anyhow::Result<Geometry> {
    geometry(match wings {
        Wings::Standard => "paper-standard",
        Wings::LowAspectRatio => "paper-low-ar",
    })
}

/// With the drag area at sea.
#[must_use]
pub fn at_sea(mut g: Geometry) -> Geometry {
    g.appendage.drag_area_m2 = SEA_DRAG_AREA_M2;
    g
}

/// Without leading-edge suction.
#[must_use]
pub fn no_suction(mut g: Geometry) -> Geometry {
    g.wing.drag_rule = DragRule::ZeroSuction;
    g
}

/// Rail wings by the law that measured rectangular plates follow; other wings as they are.
#[must_use]
pub fn on_plates(mut g: Geometry) -> Geometry {
    if !matches!(g.wing.model, WingModel::LiftingLine(_)) {
        g.wing.model = WingModel::SideEdge(SideEdge::of(g.wing.aspect_ratio));
    }
    g
}

/// With the whole slender-body carry-over.
#[must_use]
pub fn carry_over(mut g: Geometry) -> Geometry {
    g.carry_over.share = 1.0;
    g
}

/// With the aspect ratio of the pair instead of one panel's.
#[must_use]
pub fn pair_aspect_ratio(mut g: Geometry) -> Geometry {
    g.wing.aspect_ratio *= 2.0;
    g
}

/// The plates' law, no suction, carry-over, drag at sea.
#[must_use]
pub fn fuller(g: Geometry) -> Geometry {
    at_sea(carry_over(no_suction(on_plates(g))))
}

/// L/D at an angle in degrees.
#[must_use]
pub fn l_over_d(g: &Geometry, alpha_deg: f64) -> f64 {
    g.polar().force(&Flow::steady(alpha_deg.to_radians(), 0.3)).l_over_d()
}

/// Share of the lift that is there because of the wings, at an angle in degrees.
#[must_use]
pub fn wing_share(g: &Geometry, alpha_deg: f64) -> f64 {
    g.polar().breakdown(alpha_deg.to_radians()).wing_lift_share()
}

/// α of (L/D)max, degrees, and (L/D)max.
#[must_use]
pub fn best(g: &Geometry) -> (f64, f64) {
    let b = hydro::glide::best(&g.polar(), 0.3, 30f64.to_radians());
    (b.alpha_rad.to_degrees(), b.l_over_d)
}

/// A curve of L/D between two angles in degrees, `step` apart.
#[must_use]
pub fn curve(g: &Geometry, from_deg: f64, to_deg: f64, step_deg: f64) -> Vec<(f64, f64)> {
    let polar = g.polar();
    let n = ((to_deg - from_deg) / step_deg).round() as u32;
    (0..=n)
        .map(|i| from_deg + step_deg * f64::from(i))
        .map(|deg| (deg, polar.force(&Flow::steady(deg.to_radians(), 0.3)).l_over_d()))
        .collect()
}
