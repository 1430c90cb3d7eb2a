//! A vehicle given by its geometry: hull, wings, their interference, and what the sea adds.
//!
//! Everything is summed as lift and drag *areas* (force / dynamic pressure, m²), so no two parts can disagree about a
//! reference area; only the result is divided by [`Geometry::reference_area_m2`].
//!
//! Not covered: tail moments, lateral motion, dependence on speed (friction is taken at fixed Reynolds numbers; the
//! effect `reynolds_drag` adds it).

use crate::ALPHA_BODY_VALID_RAD;
use crate::body::Body;
use crate::effects::{Constants, Flow, LiftDrag};
use crate::interference::CarryOver;
use crate::polar::Polar;
use crate::wing::{PreparedWing, Wing};

/// What theory of hull and wings leaves out, as calibrated: antenna, fin, CTD, gaps, and the hull's lift at sea.
///
/// A normal force N = n sin α cos α, a constant drag and a drag that grows with sin² α. All zero: no appendages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Appendage {
    /// Drag area at α = 0, m².
    pub drag_area_m2: f64,
    /// Further drag area per sin² α, m².
    pub crossflow_drag_area_m2: f64,
    /// Normal-force area per rad, n, m²/rad.
    pub normal_area_per_rad_m2: f64,
}

/// Geometry of a glider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Reference area of reported coefficients, m²; a convention, it changes no force.
    pub reference_area_m2: f64,
    /// Hull.
    pub body: Body,
    /// Wings, both panels.
    pub wing: Wing,
    /// Interference.
    pub carry_over: CarryOver,
    /// Everything else.
    pub appendage: Appendage,
}

/// Lift and drag areas by part, m² (the fields `cl`, `cd` hold areas here).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakdown {
    /// Wings in the presence of the hull, with their friction.
    pub wing: LiftDrag,
    /// Lift on the hull because of the wings.
    pub carry_over: LiftDrag,
    /// Hull alone.
    pub body: LiftDrag,
    /// Appendages.
    pub appendage: LiftDrag,
}

impl Breakdown {
    /// Whole vehicle, m².
    #[must_use]
    pub fn total(&self) -> LiftDrag {
        self.wing + self.carry_over + self.body + self.appendage
    }

    /// Share of the lift that is there because of the wings (wings and carry-over), 1. Undefined (NaN) at α = 0.
    #[must_use]
    pub fn wing_lift_share(&self) -> f64 {
        (self.wing.cl + self.carry_over.cl) / self.total().cl
    }
}

/// A geometry with everything that does not depend on α worked out: what polars and solvers ask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometryPolar {
    geometry: Geometry,
    wing: PreparedWing,
    on_wing_share: f64,
    axial_drag_area_m2: f64,
}

impl Geometry {
    /// Works out slopes and factors once.
    #[must_use]
    pub fn polar(&self) -> GeometryPolar {
        let total = self.carry_over.total();
        GeometryPolar {
            geometry: *self,
            wing: self.wing.prepare(total, self.carry_over.on_wing()),
            on_wing_share: self.carry_over.on_wing() / total,
            axial_drag_area_m2: self.body.axial_drag_area_m2(),
        }
    }
}

impl GeometryPolar {
    /// The geometry it was made from.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Lift and drag areas by part, m².
    #[must_use]
    pub fn breakdown(&self, alpha_rad: f64) -> Breakdown {
        let g = &self.geometry;
        let (s, c) = (libm::sin(alpha_rad), libm::cos(alpha_rad));
        let lifting = self.wing.lift_and_its_drag_of(alpha_rad, s, c) * g.wing.area_m2;
        let friction = LiftDrag { cl: 0.0, cd: self.wing.cd0() * g.wing.area_m2 };
        let normal = g.appendage.normal_area_per_rad_m2 * s * c;
        Breakdown {
            wing: lifting * self.on_wing_share + friction,
            carry_over: lifting * (1.0 - self.on_wing_share),
            body: g.body.force_area_with(self.axial_drag_area_m2, s, c),
            appendage: LiftDrag { cl: normal * c, cd: g.appendage.drag_area_m2 + g.appendage.crossflow_drag_area_m2 * s * s + normal * s },
        }
    }

    /// The coefficients of the flight format that come closest over |α| ≤ 0.35 rad, least squares on 140 angles.
    ///
    /// ```text
    /// C_L ≈ cla α + a2 α|α|,   C_D ≈ C_D0 + C_Db α²   (K = 0: all drag due to lift is in C_Db)
    /// ```
    /// The rest of `constants` is kept. Returns the largest misfits (C_L, C_D) too.
    #[must_use]
    pub fn project(&self, constants: &Constants) -> (Constants, f64, f64) {
        let at = |alpha: f64| self.force(&Flow::steady(alpha, 0.0));
        let cd0 = at(0.0).cd;
        let grid = |i: u32| 0.35 * f64::from(i) / 140.0;
        // Normal equations of C_L on (α, α²) and of C_D − C_D0 on α².
        let (mut s2, mut s3, mut s4, mut t1, mut t2, mut d2) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for i in 1..=140 {
            let a = grid(i);
            let f = at(a);
            s2 += a * a;
            s3 += a * a * a;
            s4 += a * a * a * a;
            t1 += a * f.cl;
            t2 += a * a * f.cl;
            d2 += a * a * (f.cd - cd0);
        }
        let det = s2 * s4 - s3 * s3;
        let out = Constants {
            reference_area_m2: self.geometry.reference_area_m2,
            lift_slope_per_rad: (t1 * s4 - t2 * s3) / det,
            lift_quadratic_per_rad2: (t2 * s2 - t1 * s3) / det,
            cd0,
            induced_k: 0.0,
            hull_drag_per_rad2: d2 / s4,
            slope_loss_per_rad2: 0.0,
            hull_drag_per_rad3: 0.0,
            ..*constants
        };
        let (mut cl_misfit, mut cd_misfit) = (0.0, 0.0);
        for i in 0..=140 {
            let a = grid(i);
            let f = at(a);
            let l = (out.lift_slope_per_rad * a + out.lift_quadratic_per_rad2 * a * a - f.cl).abs();
            let d = (out.cd0 + out.hull_drag_per_rad2 * a * a - f.cd).abs();
            cl_misfit = if l <= cl_misfit { cl_misfit } else { l };
            cd_misfit = if d <= cd_misfit { cd_misfit } else { d };
        }
        (out, cl_misfit, cd_misfit)
    }
}

impl Polar for GeometryPolar {
    fn reference_area_m2(&self) -> f64 {
        self.geometry.reference_area_m2
    }

    fn force(&self, flow: &Flow) -> LiftDrag {
        self.breakdown(flow.alpha_rad).total() * (1.0 / self.geometry.reference_area_m2)
    }

    fn alpha_valid_rad(&self) -> f64 {
        ALPHA_BODY_VALID_RAD
    }
}
