//! Lift of the wings alone: equations 11, 12, 13 for low aspect ratio, lifting line with separation for the standard wing.
//!
//! ```text
//! C_L = K_p sin α cos² α + K_v cos α sin² α      (11) Polhamus, extended by Lamar to side edges
//! C_L = C_Lα,0 α + C_Dc α|α|                     (12) Bartlett & Vidal
//! C_N = a1 α + a2 α|α|, a1 = (π/2) A for A ≤ 1   (13) Fidler;  C_L = C_N cos α
//! ```
//! What eqs. 11 to 13 are worth on a rectangular plate, and the law that replaces them there: [`crate::rectangular`].
//!
//! α in rad, all coefficients on the wing's own area. Squares of an angle are written α|α| (or sin α |sin α|): a
//! symmetric wing's force changes sign with α. Range |α| ≤ 25° unless said otherwise; low-aspect-ratio forms lose
//! meaning where the vortices burst, 30–40°.

use core::f64::consts::PI;

use crate::drag::{self, DragRule, Layer};
use crate::effects::LiftDrag;
use crate::lift_slope;
use crate::rectangular::SideEdge;
pub use crate::separation::Separation;

/// K_v, 1: vortex lift of eq. 11, "approximately equal to π" (paper sec. IV-B). A constant: that "the vortex component
/// increases linearly" in the paper means sin² α growth of C_L, not of K_v. Holds for sharp delta wings (Polhamus); a rectangular plate
/// has less, [`crate::rectangular::side_edge_kv`].
pub const VORTEX_LIFT_KV: f64 = PI;

/// Eq. 11 (Polhamus–Lamar): C_L = K_p sin α cos² α + K_v cos α sin α |sin α|.
#[must_use]
pub fn polhamus_lamar(kp: f64, kv: f64, alpha_rad: f64) -> f64 {
    let (s, c) = (libm::sin(alpha_rad), libm::cos(alpha_rad));
    kp * s * c * c + kv * c * s * s.abs()
}

/// Eq. 12 (Bartlett & Vidal): C_L = C_Lα,0 α + C_Dc α|α|.
///
/// Printed with C_Lα on the left: a sum of force coefficients is a force coefficient, and the printed form would
/// make the lift *slope* vanish at α = 0. C_Dc is the cross-flow drag per planform area, 1.2 (square plate) to
/// 2.0 (strip), by edge shape; measured square plates ask for 1.2 to 1.5.
#[must_use]
pub fn bartlett_vidal(slope_per_rad: f64, crossflow_cd: f64, alpha_rad: f64) -> f64 {
    slope_per_rad * alpha_rad + crossflow_cd * alpha_rad * alpha_rad.abs()
}

/// Eq. 13 (Fidler): C_N = a1 α + a2 α|α|.
#[must_use]
pub fn fidler_normal(a1_per_rad: f64, a2_per_rad2: f64, alpha_rad: f64) -> f64 {
    a1_per_rad * alpha_rad + a2_per_rad2 * alpha_rad * alpha_rad.abs()
}

/// a1 of eq. 13, 1/rad: (π/2) A for A ≤ 1.
///
/// Printed "a1 = π/2": the slender-wing slope has the factor A (on the wing's area). Literal π/2 is 3.2 times the
/// slopes of eqs. 5, 9, 12 at A = 0.3155, and the three models could not be "highly correlated".
#[must_use]
pub fn fidler_a1(aspect_ratio: f64) -> f64 {
    lift_slope::slender(aspect_ratio)
}

/// Which slope law feeds the linear part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlopeLaw {
    /// Eq. 4 with τ = 0.4.
    Prandtl,
    /// Eq. 5.
    LowryPolhamus,
    /// Eq. 6 at M = 2e-4.
    Roskam,
    /// Eq. 9 per radian.
    HoernerBorst,
}

/// Which lift model the wing follows, with the constants of that model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WingModel {
    /// Standard wing: attached lifting-line lift that separates into plate lift. Stands in for the data of Shortal &
    /// Maggin (NACA TN 1093), which were not at hand: a surrogate, not their measurement.
    LiftingLine(Separation),
    /// Eq. 11.
    PolhamusLamar {
        /// K_v, 1.
        kv: f64,
    },
    /// Eq. 12.
    BartlettVidal {
        /// C_Dc, 1.
        crossflow_cd: f64,
    },
    /// Eq. 13.
    Fidler {
        /// a2, 1/rad².
        a2_per_rad2: f64,
    },
    /// Rectangular plate: side-edge vortices with an onset, separation ([`crate::rectangular`]).
    SideEdge(SideEdge),
}

impl WingModel {
    /// Name in files and commands.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            WingModel::LiftingLine(_) => "lifting-line",
            WingModel::PolhamusLamar { .. } => "polhamus-lamar",
            WingModel::BartlettVidal { .. } => "bartlett-vidal",
            WingModel::Fidler { .. } => "fidler",
            WingModel::SideEdge(_) => "side-edge",
        }
    }
}

/// A pair of wings. Areas and spans in metres, named apart from the aspect ratio the formulas use, because the paper's
/// A is most likely that of one panel (5.536 = 0.4935 m / 0.0891 m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wing {
    /// A used in the formulas, 1.
    pub aspect_ratio: f64,
    /// Exposed span of one panel, m.
    pub panel_span_m: f64,
    /// Chord, m.
    pub chord_m: f64,
    /// Exposed area of both panels, m².
    pub area_m2: f64,
    /// Sweep at half chord, rad.
    pub sweep_half_chord_rad: f64,
    /// c_lα, 1/rad.
    pub section_slope_per_rad: f64,
    /// Law of the linear slope.
    pub slope_law: SlopeLaw,
    /// Lift model.
    pub model: WingModel,
    /// Oswald's e of eq. 16, 1.
    pub oswald_e: f64,
    /// Drag rule of the low-aspect-ratio models (the standard wing's attached flow is always eq. 14).
    pub drag_rule: DragRule,
    /// Boundary layer.
    pub layer: Layer,
    /// Chord Reynolds number for friction, 1.
    pub reynolds: f64,
    /// Form factor of the section on friction, 1.
    pub form_factor: f64,
}

/// A wing with everything that does not depend on α worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedWing {
    wing: Wing,
    slope: f64,
    k: f64,
    cd0: f64,
    lift_factor: f64,
    upwash: f64,
}

impl Wing {
    /// Linear lift slope, 1/rad on the wing's area.
    #[must_use]
    pub fn slope_per_rad(&self) -> f64 {
        let (cla, a, sweep) = (self.section_slope_per_rad, self.aspect_ratio, self.sweep_half_chord_rad);
        match self.slope_law {
            SlopeLaw::Prandtl => lift_slope::prandtl(cla, a, lift_slope::TAU),
            SlopeLaw::LowryPolhamus => lift_slope::lowry_polhamus(cla, a, sweep),
            SlopeLaw::Roskam => lift_slope::roskam(cla, a, sweep, 0.3 / crate::section::SOUND_SPEED_WATER_M_S),
            SlopeLaw::HoernerBorst => lift_slope::hoerner_borst(a),
        }
    }

    /// Works out slopes and factors once. `lift_factor` is the carry-over on all lift of the wing, `upwash` how much larger than α the angle is
    /// that its panels see beside the hull ([`crate::interference`]); 1 and 1 for a wing alone.
    #[must_use]
    pub fn prepare(&self, lift_factor: f64, upwash: f64) -> PreparedWing {
        PreparedWing {
            wing: *self,
            slope: self.slope_per_rad(),
            k: drag::induced_factor(self.oswald_e, self.aspect_ratio),
            cd0: drag::wing_cd0(drag::friction(self.layer, self.reynolds), self.form_factor),
            lift_factor,
            upwash,
        }
    }
}

impl PreparedWing {
    /// C_D0 of the wing on its area, 1.
    #[must_use]
    pub fn cd0(&self) -> f64 {
        self.cd0
    }

    /// Lift coefficient and drag coefficient *due to lift* (without C_D0) on the wing's area, carry-over included.
    #[must_use]
    pub fn lift_and_its_drag(&self, alpha_rad: f64) -> LiftDrag {
        self.lift_and_its_drag_of(alpha_rad, libm::sin(alpha_rad), libm::cos(alpha_rad))
    }

    /// [`Self::lift_and_its_drag`] with sin α and cos α worked out before.
    pub(crate) fn lift_and_its_drag_of(&self, alpha_rad: f64, s: f64, c: f64) -> LiftDrag {
        let w = &self.wing;
        let f = self.lift_factor;
        let low = |cl: f64| LiftDrag { cl, cd: drag::due_to_lift(w.drag_rule, self.k, cl, alpha_rad) };
        match w.model {
            WingModel::PolhamusLamar { kv } => low(f * polhamus_lamar(self.slope, kv, alpha_rad)),
            WingModel::BartlettVidal { crossflow_cd } => low(f * bartlett_vidal(self.slope, crossflow_cd, alpha_rad)),
            WingModel::Fidler { a2_per_rad2 } => low(f * fidler_normal(fidler_a1(w.aspect_ratio), a2_per_rad2, alpha_rad) * c),
            WingModel::SideEdge(law) => low(f * law.lift_of(self.slope, self.upwash * alpha_rad, s, c)),
            WingModel::LiftingLine(separation) => {
                let attached = separation.attached(alpha_rad);
                let cl_attached = f * self.slope * s * c * c;
                let cn = f * separation.normal_of(s);
                LiftDrag {
                    cl: attached * cl_attached + (1.0 - attached) * cn * c,
                    cd: attached * self.k * cl_attached * cl_attached + (1.0 - attached) * cn * s,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validate_low_aspect_ratio_slopes_agree_and_the_printed_a1_does_not() {
        let a1 = fidler_a1(0.3155);
        assert!((a1 - 0.495_586).abs() < 5e-7);
        let eq9 = lift_slope::hoerner_borst(0.3155);
        assert!((a1 / eq9 - 1.0).abs() < 0.01, "eq. 13 and eq. 9 share the slender limit");
        assert!((0.5 * PI / eq9 - 3.19).abs() < 0.01, "printed a1 is 3.2 times too steep");
    }

    #[test]
    fn prop_every_model_is_odd_in_lift_and_even_in_drag() {
        for model in [
            WingModel::LiftingLine(SEPARATION),
            WingModel::PolhamusLamar { kv: VORTEX_LIFT_KV },
            WingModel::BartlettVidal { crossflow_cd: 2.0 },
            WingModel::Fidler { a2_per_rad2: 2.2 },
            WingModel::SideEdge(SideEdge::of(0.3155)),
        ] {
            for rule in [DragRule::Parabolic, DragRule::Bounded, DragRule::ZeroSuction] {
                let w = Wing { model, drag_rule: rule, ..example() }.prepare(1.3, 1.2);
                assert_eq!(w.lift_and_its_drag(0.0).cl, 0.0);
                for i in 1..80 {
                    let a = f64::from(i).to_radians();
                    let (p, m) = (w.lift_and_its_drag(a), w.lift_and_its_drag(-a));
                    assert!((p.cl + m.cl).abs() < 1e-14 && (p.cd - m.cd).abs() < 1e-13, "{model:?} {i}");
                    assert!(p.cl > 0.0 && p.cd > 0.0, "{model:?} {i}");
                }
            }
        }
    }

    #[test]
    fn the_standard_wing_follows_the_lifting_line_and_then_the_plate() {
        let w = Wing { model: WingModel::LiftingLine(SEPARATION), ..example() };
        let p = w.prepare(1.0, 1.0);
        let two = 2f64.to_radians();
        assert!((p.lift_and_its_drag(two).cl / (w.slope_per_rad() * two) - 1.0).abs() < 0.02);
        let forty = 40f64.to_radians();
        let plate = SEPARATION.normal(forty) * forty.cos();
        assert!((p.lift_and_its_drag(forty).cl / plate - 1.0).abs() < 0.01);
    }

    const SEPARATION: Separation = Separation { alpha_rad: 0.2164, width_rad: 0.035, broadside_cn: 1.2 };

    fn example() -> Wing {
        Wing {
            aspect_ratio: 0.3155,
            panel_span_m: 0.138,
            chord_m: 0.437,
            area_m2: 0.1202,
            sweep_half_chord_rad: 0.0,
            section_slope_per_rad: 6.188,
            slope_law: SlopeLaw::HoernerBorst,
            model: WingModel::BartlettVidal { crossflow_cd: 2.0 },
            oswald_e: 0.85,
            drag_rule: DragRule::Parabolic,
            layer: Layer::Laminar,
            reynolds: 1e5,
            form_factor: 1.0,
        }
    }
}
