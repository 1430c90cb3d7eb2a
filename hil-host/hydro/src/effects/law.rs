//! The law of forces of a vehicle with some effects on; the nominal law is in the room's own description.

use super::{ALPHA_VALID_RAD, Active, Constants, Continuation, Flow, InFlow, LiftDrag, Place, Sensed};

/// The law of forces: constants and the effects that are on.
///
/// Constant effects are folded into the constants when the model is made, so the inner loop of a simulation meets only those
/// that depend on the flow.
#[derive(Clone, Copy, Debug)]
pub struct ForceModel<'a> {
    /// Constants, constant effects already in them.
    pub constants: Constants,
    active: &'a [Active],
    /// The shortest stretch of `active` with all effects that act in the flow.
    in_flow: &'a [Active],
    hooks: InFlow,
    on_volume: bool,
    continuation: Continuation,
}

impl<'a> ForceModel<'a> {
    /// The nominal constants with these effects on.
    #[must_use]
    pub fn new(nominal: Constants, active: &'a [Active]) -> Self {
        let mut constants = nominal;
        for a in active {
            a.effect.constants.inspect(|f| f(&a.values, &mut constants));
        }
        let acts = |a: &Active| a.effect.in_flow() != InFlow::NOTHING;
        let first = active.iter().position(acts).unwrap_or(active.len());
        let end = active.iter().rposition(acts).map_or(first, |last| last + 1);
        Self {
            constants,
            active,
            in_flow: active.get(first..end).unwrap_or(active),
            hooks: active.iter().fold(InFlow::NOTHING, |hooks, a| hooks.or(a.effect.in_flow())),
            on_volume: active.iter().any(|a| a.effect.volume_m3.is_some()),
            continuation: Continuation::default(),
        }
    }

    /// The same law with another continuation beyond the valid angle of attack.
    #[must_use]
    pub fn continued(mut self, continuation: Continuation) -> Self {
        self.continuation = continuation;
        self
    }

    /// Hooks in the flow that any of its effects has: with none the nominal law with these constants is all there is.
    #[must_use]
    pub fn in_flow(&self) -> InFlow {
        self.hooks
    }

    /// Angle that the linear and quadratic lift see, rad.
    #[must_use]
    pub fn lift_angle_rad(&self, alpha_rad: f64) -> f64 {
        self.in_flow.iter().fold(alpha_rad, |angle, e| e.effect.lift_angle_rad.map_or(angle, |f| f(&e.values, angle)))
    }

    /// Lift coefficient that effects add to the law's.
    #[must_use]
    pub fn added_lift(&self, at: &Flow, lift_angle_rad: f64) -> f64 {
        self.in_flow.iter().map(|e| e.effect.lift.map_or(0.0, |f| f(&e.values, at, lift_angle_rad, &self.constants))).sum()
    }

    /// Drag coefficient that effects add to the law's at this lift.
    #[must_use]
    pub fn added_drag(&self, at: &Flow, lift: f64) -> f64 {
        self.in_flow.iter().map(|e| e.effect.drag.map_or(0.0, |f| f(&e.values, at, lift, &self.constants))).sum()
    }

    /// Coefficient of the force normal to the body.
    #[must_use]
    pub fn normal_force(&self, at: &Flow) -> f64 {
        self.in_flow.iter().map(|e| e.effect.normal_force.map_or(0.0, |f| f(&e.values, at))).sum()
    }

    /// Whether the true pitch is a straight line in the measured one (a person's expression may be anything).
    #[must_use]
    pub fn pitch_is_affine(&self) -> bool {
        self.active.iter().all(|a| a.effect.expression.is_none())
    }

    /// What is true when the sensors say `s`.
    #[must_use]
    pub fn truth(&self, mut s: Sensed) -> Sensed {
        for a in self.active {
            a.effect.sensed.inspect(|f| f(&a.values, &mut s));
        }
        s
    }

    /// Displaced volume, m³.
    #[inline]
    #[must_use]
    pub fn volume_m3(&self, s: &Sensed) -> f64 {
        let c = &self.constants;
        let hull_degc = s.temperature_degc + c.hull_lag_share * (s.hull_degc - s.temperature_degc);
        let volume = c.hull_volume_m3
            * (1.0 - c.compressibility_per_pa * s.pressure_pa + c.thermal_expansion_per_k * (hull_degc - c.reference_temperature_degc))
            + s.ballast_m3;
        if !self.on_volume {
            return volume;
        }
        volume + self.active.iter().map(|a| a.effect.volume_m3.map_or(0.0, |f| f(&a.values, s, c))).sum::<f64>()
    }

    /// Net buoyancy, N, up.
    #[inline]
    #[must_use]
    pub fn net_buoyancy_n(&self, s: &Sensed) -> f64 {
        self.constants.gravity_m_s2 * (s.density_kg_m3 * self.volume_m3(s) - self.constants.mass_kg)
    }

    /// Lift and drag coefficients on S, with the bounded continuation beyond [`ALPHA_VALID_RAD`].
    #[must_use]
    pub fn coefficients(&self, at: &Flow) -> LiftDrag {
        let a = at.alpha_rad;
        if a.abs() <= ALPHA_VALID_RAD {
            return self.attached(at);
        }
        let edge = self.attached(&Flow { alpha_rad: if a > 0.0 { ALPHA_VALID_RAD } else { -ALPHA_VALID_RAD }, ..*at });
        let f = self.constants.beyond.coefficients(a, edge, self.continuation);
        LiftDrag { cd: f.cd.max(self.constants.cd0), ..f }
    }

    fn attached(&self, at: &Flow) -> LiftDrag {
        let c = &self.constants;
        let angle = self.lift_angle_rad(at.alpha_rad);
        let slope = c.lift_slope_per_rad * (1.0 - c.slope_loss_per_rad2 * angle * angle);
        let mut cl = slope * angle + c.lift_quadratic_per_rad2 * angle * angle.abs() + self.added_lift(at, angle);
        let hull = c.hull_drag_per_rad2 + c.hull_drag_per_rad3 * at.alpha_rad.abs();
        let mut cd = c.cd0 + c.induced_k * cl * cl + hull * at.alpha_rad * at.alpha_rad + self.added_drag(at, cl);
        let cn = self.normal_force(at);
        if cn != 0.0 {
            cd += cn * libm::sin(at.alpha_rad);
            cl += cn * libm::cos(at.alpha_rad);
        }
        LiftDrag { cl, cd }
    }

    /// Whether any of its effects moves the water up or down, or errs in pressure.
    #[must_use]
    pub fn acts_on_depth(&self) -> bool {
        self.active.iter().any(|a| a.effect.acts_on_depth())
    }

    /// Vertical water motion, m/s, up.
    #[must_use]
    pub fn water_up_m_s(&self, at: &Place) -> f64 {
        self.active.iter().map(|a| a.effect.water_up_m_s.map_or(0.0, |f| f(&a.values, at))).sum()
    }

    /// What the pressure sensor shows too much, Pa.
    #[must_use]
    pub fn pressure_error_pa(&self, time_s: f64) -> f64 {
        self.active.iter().map(|a| a.effect.pressure_error_pa.map_or(0.0, |f| f(&a.values, time_s))).sum()
    }

    /// Horizontal current, (east, north), m/s.
    #[must_use]
    pub fn current_m_s(&self) -> (f64, f64) {
        let currents = self.active.iter().filter_map(|a| Some(a.effect.current_m_s?(&a.values)));
        currents.fold((0.0, 0.0), |(e, n), (de, dn)| (e + de, n + dn))
    }
}
