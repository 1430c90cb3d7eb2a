//! Who can be asked for lift and drag: a vehicle from geometry, one from
//! coefficients, either with effects added.

use crate::effects::{ALPHA_VALID_RAD, Flow, ForceModel, LiftDrag, REFERENCE_TEMPERATURE_DEGC};

/// Anything whose lift and drag can be asked for.
pub trait Polar {
    /// Reference area S of the coefficients, m².
    fn reference_area_m2(&self) -> f64;

    /// Lift and drag coefficients in a flow.
    fn force(&self, flow: &Flow) -> LiftDrag;

    /// Largest |α| the model claims to be valid for, rad.
    fn alpha_valid_rad(&self) -> f64;
}

impl<P: Polar + ?Sized> Polar for &P {
    fn reference_area_m2(&self) -> f64 {
        (**self).reference_area_m2()
    }
    fn force(&self, flow: &Flow) -> LiftDrag {
        (**self).force(flow)
    }
    fn alpha_valid_rad(&self) -> f64 {
        (**self).alpha_valid_rad()
    }
}

impl Polar for ForceModel<'_> {
    fn reference_area_m2(&self) -> f64 {
        self.constants.reference_area_m2
    }
    fn force(&self, flow: &Flow) -> LiftDrag {
        self.coefficients(flow)
    }
    fn alpha_valid_rad(&self) -> f64 {
        ALPHA_VALID_RAD
    }
}

/// Vertical speed at which a vehicle is asked for its drag in dive and climb, m/s: well beyond that of a turn.
const VERTICAL_M_S: f64 = 0.15;

/// A vehicle in the mean of dive and climb at angles of attack of the same size: what a symmetric table can say of one whose lift is
/// zero at an angle, or whose drag is larger in climbs.
pub struct BothWays<P>(pub P);

impl<P: Polar> Polar for BothWays<P> {
    fn reference_area_m2(&self) -> f64 {
        self.0.reference_area_m2()
    }

    fn force(&self, flow: &Flow) -> LiftDrag {
        let (size, sign) = (flow.alpha_rad.abs(), 1.0_f64.copysign(flow.alpha_rad));
        let dive = self.0.force(&Flow { alpha_rad: size, climb_m_s: -VERTICAL_M_S, ..*flow });
        let climb = self.0.force(&Flow { alpha_rad: -size, climb_m_s: VERTICAL_M_S, ..*flow });
        LiftDrag { cl: sign * 0.5 * (dive.cl - climb.cl), cd: 0.5 * (dive.cd + climb.cd) }
    }

    fn alpha_valid_rad(&self) -> f64 {
        self.0.alpha_valid_rad()
    }
}

impl LiftDrag {
    /// L/D = C_L / C_D; negative in climbs, where lift points down.
    #[must_use]
    pub fn l_over_d(&self) -> f64 {
        self.cl / self.cd
    }
}

impl core::ops::Add for LiftDrag {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { cl: self.cl + other.cl, cd: self.cd + other.cd }
    }
}

impl core::ops::Mul<f64> for LiftDrag {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { cl: self.cl * factor, cd: self.cd * factor }
    }
}

impl Flow {
    /// Straight steady flight at α and U in water of 10 °C at the start of a trial: no roll. The vertical velocity, of which effects use the
    /// sign, is taken as −U α (dives have α > 0).
    #[must_use]
    pub fn steady(alpha_rad: f64, speed_m_s: f64) -> Self {
        Self {
            alpha_rad,
            speed_m_s,
            roll_rad: 0.0,
            climb_m_s: -speed_m_s * alpha_rad,
            time_s: 0.0,
            temperature_degc: REFERENCE_TEMPERATURE_DEGC,
            attached: false,
        }
    }
}
