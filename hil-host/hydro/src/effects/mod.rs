//! Which physical effects may a real glider show that its nominal model lacks?
//!
//! One effect is one type with named, united parameters; every effect is off
//! unless it is in the list of a [`ForceModel`]. A new effect is one type that
//! implements [`Effect`], in the file of its kind, and one line in
//! [`CATALOGUE`]; CONTRIBUTING.md has a worked example.
//!
//! Axes and signs: x along the horizontal track, z up, pitch θ nose up, angle
//! of attack α = θ − γ (positive in a dive), depth and pressure positive down,
//! vertical water motion positive **up**.
//!
//! The nominal force law that effects change (coefficients on the reference
//! area S, valid for |α| ≤ 0.35 rad):
//! ```text
//! CL = cla α + a2 α|α|
//! CD = CD0 + K CL² + CDb α²
//! V  = V0 (1 − ε p + αT (T − T0)) + ballast
//! B  = g (ρ V − m)                      net buoyancy, N, up
//! ```
//! Not covered: effects with a memory of their own (pump lag, flooded-volume
//! lag); they need a state beyond the two velocities of the vehicle. Whether
//! flow is attached, where a stall ends late, is the simulation's to know.

mod beyond;
mod buoyancy;
mod drag;
mod inertia;
mod law;
mod lift;
mod sensing;
mod water;

pub use beyond::{ALPHA_VALID_RAD, Beyond, CD_BROADSIDE, Continuation};
pub use buoyancy::{BallastOffset, BallastScale, HullCompressibility, ThermalExpansion};
pub use drag::{BiofoulingDrag, ClimbDrag, DragLevelError, InducedDragError, ReynoldsDrag, RollTurnDrag};
pub use inertia::{AddedMass, HeaveAddedMass};
pub use law::ForceModel;
pub use lift::{LiftSlopeError, SideEdgeLift, Stall, VortexLiftBodyWing, ZeroLiftAngle};
pub use sensing::{DensityBias, PitchOffset, PitchScale, PressureDrift};
pub use water::{HorizontalCurrent, InternalWave, VerticalCurrent, WAVE, vertical_mode};

/// Most parameters one effect may have.
pub const MAX_PARAMETERS: usize = 4;

/// Constants of the force and buoyancy law, SI units; what a vehicle file gives and constant effects change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constants {
    /// g, m/s².
    pub gravity_m_s2: f64,
    /// m, mass in air, kg.
    pub mass_kg: f64,
    /// V0, displaced volume at zero gauge pressure, reference temperature and ballast reading 0, m³.
    pub hull_volume_m3: f64,
    /// ε, 1/Pa.
    pub compressibility_per_pa: f64,
    /// αT, 1/K.
    pub thermal_expansion_per_k: f64,
    /// T0, °C.
    pub reference_temperature_degc: f64,
    /// S, m².
    pub reference_area_m2: f64,
    /// cla = (a_w S_w + a_h S_h)/S, 1/rad on S.
    pub lift_slope_per_rad: f64,
    /// a2, 1/rad² on S.
    pub lift_quadratic_per_rad2: f64,
    /// CD0 on S.
    pub cd0: f64,
    /// K, 1.
    pub induced_k: f64,
    /// CDb, 1/rad² on S.
    pub hull_drag_per_rad2: f64,
    /// Share of cla that is lost per α²: lift is cla (1 − loss α²) α + a2 α|α|. 0 in the flight format; where wings begin to stall it
    /// needs this to follow them.
    pub slope_loss_per_rad2: f64,
    /// Drag per |α|³ on S, 0 in the flight format: drag due to angle of attack is no parabola over a wide range.
    pub hull_drag_per_rad3: f64,
    /// k1, fraction of the mass.
    pub added_mass_surge: f64,
    /// k2, fraction of the mass.
    pub added_mass_heave: f64,
    /// Share of the lift's tilt out of the vertical plane in a banked turn: lift there is times 1 − share (1 − cos roll). 1 by
    /// geometry, 0 in the flight format's nominal model, which knows no roll. Only unsteady models ask for it.
    pub bank_tilt: f64,
    /// Share of what a turn without sideslip does to a body that banks (Fossen 2011, rigid body and added mass in six degrees of freedom):
    /// lift carries the net buoyancy over the cosine of the roll, the nose's lead over the path leaves the vertical plane, and the added
    /// mass that is carried round pulls at what moves across the hull. 1 by geometry, 0 in the flight format's nominal model. Only
    /// unsteady models ask for it.
    pub banked_turn: f64,
    /// Share of the hull's thermal expansion that follows the water late, with [`HULL_LAG_S`]: about the hull's own lag over that. 0 in
    /// the flight format's nominal model, whose hull is as warm as the water.
    pub hull_lag_share: f64,
    /// How the law goes on beyond [`ALPHA_VALID_RAD`].
    pub beyond: Beyond,
}

/// Seconds per day.
pub const DAY_S: f64 = 86_400.0;

/// Time constant of a hull's temperature, s: 6 mm of aluminium in water that passes by; a guess between 10 and 60 s.
pub const HULL_LAG_S: f64 = 30.0;

/// What the sensors said at one instant; effects of the sensors turn it into what is true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Time since the start of the trial, s.
    pub time_s: f64,
    /// Pitch, rad, nose up.
    pub pitch_rad: f64,
    /// Volume of the buoyancy engine, m³, positive buoyant.
    pub ballast_m3: f64,
    /// Water density, kg/m³.
    pub density_kg_m3: f64,
    /// Water temperature, °C.
    pub temperature_degc: f64,
    /// Temperature of a hull that follows the water with [`HULL_LAG_S`], °C.
    pub hull_degc: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
}

/// The flow the vehicle meets at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// α, rad.
    pub alpha_rad: f64,
    /// U, speed through the water, m/s.
    pub speed_m_s: f64,
    /// Roll, rad, starboard down.
    pub roll_rad: f64,
    /// Vertical velocity of the vehicle relative to the water, m/s, up.
    pub climb_m_s: f64,
    /// Time since the start of the trial, s.
    pub time_s: f64,
    /// Water temperature, °C: it sets the viscosity.
    pub temperature_degc: f64,
    /// Whether flow that came from smaller angles of attack is known to be attached still: a stall does nothing then.
    pub attached: bool,
}

/// Water temperature of coefficients that are stated without one, °C.
pub const REFERENCE_TEMPERATURE_DEGC: f64 = 10.0;

/// A place and a time in the water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Time since the start of the trial, s.
    pub time_s: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Water depth, m.
    pub water_depth_m: f64,
    /// Phase of periodic water motion in this segment, rad (it does not carry over between segments).
    pub phase_rad: f64,
}

/// Lift and drag coefficients on S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiftDrag {
    /// CL, perpendicular to the path, positive for α > 0.
    pub cl: f64,
    /// CD, against the motion.
    pub cd: f64,
}

/// One number of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name inside the effect.
    pub name: &'static str,
    /// Unit as printed.
    pub unit: &'static str,
    /// Value at which the effect (if this is its size) is off, or the usual value of a shape parameter.
    pub off: f64,
    /// Smallest value a fit may reach.
    pub low: f64,
    /// Largest value a fit may reach.
    pub high: f64,
    /// Size that would be remarkable but not rare, same unit; 0 for a number that is stated with the others and never fitted.
    pub typical: f64,
    /// Where range and size come from.
    pub source: &'static str,
}

/// Which of the hooks that depend on the flow an effect has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InFlow {
    /// [`Effect::lift_angle_rad`].
    pub lift_angle: bool,
    /// [`Effect::lift`].
    pub lift: bool,
    /// [`Effect::drag`].
    pub drag: bool,
    /// [`Effect::normal_force`].
    pub normal_force: bool,
}

impl Parameter {
    /// Whether it is stated with the others and never fitted.
    #[must_use]
    pub fn is_stated(&self) -> bool {
        self.typical == 0.0
    }
}

impl InFlow {
    /// None of them.
    pub const NOTHING: Self = Self { lift_angle: false, lift: false, drag: false, normal_force: false };
    /// Every one.
    pub const ALL: Self = Self { lift_angle: true, lift: true, drag: true, normal_force: true };

    /// Those that either has.
    #[must_use]
    pub const fn or(self, other: Self) -> Self {
        Self {
            lift_angle: self.lift_angle | other.lift_angle,
            lift: self.lift | other.lift,
            drag: self.drag | other.drag,
            normal_force: self.normal_force | other.normal_force,
        }
    }
}

/// One optional physical effect. Hooks do nothing unless an effect writes its own; `p` are its parameters in the order of
/// [`Effect::parameters`]. The first parameter is its size: at `off` the effect is not there.
pub trait Effect: Sync + core::fmt::Debug {
    /// Name in files, commands and reports.
    fn name(&self) -> &'static str;
    /// What it is, in one sentence for a person, with the physics.
    fn physics(&self) -> &'static str;
    /// What measurement would tell it from its look-alikes.
    fn separated_by(&self) -> &'static str;
    /// The text of an effect that a person wrote as an expression.
    fn expression(&self) -> Option<&str> {
        None
    }
    /// Its numbers; the first is the size.
    fn parameters(&self) -> &'static [Parameter];
    /// Which hooks that depend on the flow it has. Only saves time: hooks that it says it has not are not asked in the inner loop.
    fn in_flow(&self) -> InFlow {
        InFlow::ALL
    }
    /// Changes constants of the law.
    fn constants(&self, _p: &[f64], _c: &mut Constants) {}
    /// Whether it has a hook of its own for the sensors. Only saves time.
    fn acts_on_sensors(&self) -> bool {
        false
    }
    /// Turns what the sensors said into what is true; asked only of effects that say they act on them.
    fn sensed(&self, _p: &[f64], _s: &mut Sensed) {}
    /// The same for many instants: one call for a whole flight. Not for an effect to write.
    fn sensed_all(&self, p: &[f64], all: &mut [Sensed]) {
        all.iter_mut().for_each(|s| self.sensed(p, s));
    }
    /// Whether it has a hook of its own for the displaced volume. Only saves time.
    fn acts_on_volume(&self) -> bool {
        false
    }
    /// Displaced volume added, m³; asked only of effects that say they act on it.
    fn volume_m3(&self, _p: &[f64], _s: &Sensed, _c: &Constants) -> f64 {
        0.0
    }
    /// Angle that the linear and quadratic lift see, rad.
    fn lift_angle_rad(&self, _p: &[f64], alpha_rad: f64) -> f64 {
        alpha_rad
    }
    /// Lift coefficient added before the induced drag is formed; the angle is the one that the linear and quadratic lift see.
    fn lift(&self, _p: &[f64], _at: &Flow, _lift_angle_rad: f64, _c: &Constants) -> f64 {
        0.0
    }
    /// Drag coefficient added.
    fn drag(&self, _p: &[f64], _at: &Flow, _lift: f64, _c: &Constants) -> f64 {
        0.0
    }
    /// Coefficient of a force normal to the body (adds lift and drag, no suction), positive for α > 0.
    fn normal_force(&self, _p: &[f64], _at: &Flow) -> f64 {
        0.0
    }
    /// Whether it has a hook of its own for vertical water motion or the pressure sensor. Only saves time.
    fn acts_on_depth(&self) -> bool {
        false
    }
    /// Vertical water motion, m/s, up; asked only of effects that say they act on depth.
    fn water_up_m_s(&self, _p: &[f64], _at: &Place) -> f64 {
        0.0
    }
    /// What the pressure sensor shows too much, Pa; asked only of effects that say they act on depth.
    fn pressure_error_pa(&self, _p: &[f64], _time_s: f64) -> f64 {
        0.0
    }
    /// Horizontal current, (east, north), m/s.
    fn current_m_s(&self, _p: &[f64], _at: &Place) -> (f64, f64) {
        (0.0, 0.0)
    }
}

/// Every effect with a name, in the order of FORMAT section 6.3; a new one is a line more, such as `&drag::MastDrag,`.
pub static CATALOGUE: &[&dyn Effect] = &[
    &VortexLiftBodyWing,
    &SideEdgeLift,
    &ReynoldsDrag,
    &Stall,
    &HullCompressibility,
    &ThermalExpansion,
    &BiofoulingDrag,
    &PitchOffset,
    &BallastOffset,
    &BallastScale,
    &InternalWave,
    &VerticalCurrent,
    &RollTurnDrag,
    &ClimbDrag,
    &AddedMass,
    &HeaveAddedMass,
    &DragLevelError,
    &LiftSlopeError,
    &InducedDragError,
    &ZeroLiftAngle,
    &DensityBias,
    &PressureDrift,
    &PitchScale,
    &HorizontalCurrent,
];

/// The effect with this name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static dyn Effect> {
    CATALOGUE.iter().copied().find(|e| e.name() == name)
}

/// An effect that is on, with its values.
#[derive(Clone, Copy, Debug)]
pub struct Active {
    /// Which.
    pub effect: &'static dyn Effect,
    /// Values in the order of its parameters; the rest is unused.
    pub values: [f64; MAX_PARAMETERS],
}

impl Active {
    /// The effect at its off value, shape parameters at their usual ones.
    #[must_use]
    pub fn off(effect: &'static dyn Effect) -> Self {
        let mut values = [0.0; MAX_PARAMETERS];
        for (v, p) in values.iter_mut().zip(effect.parameters()) {
            *v = p.off;
        }
        Self { effect, values }
    }

    /// The effect at this size, shape parameters at their usual values.
    #[must_use]
    pub fn sized(effect: &'static dyn Effect, size: f64) -> Self {
        let mut a = Self::off(effect);
        a.values[0] = size;
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(in crate::effects) fn nominal() -> Constants {
        Constants {
            gravity_m_s2: 9.81,
            mass_kg: 68.0,
            hull_volume_m3: 0.068,
            compressibility_per_pa: 5e-10,
            thermal_expansion_per_k: 5e-5,
            reference_temperature_degc: 10.0,
            reference_area_m2: 0.11,
            lift_slope_per_rad: 0.9,
            lift_quadratic_per_rad2: 4.5,
            cd0: 0.15,
            induced_k: 0.35,
            hull_drag_per_rad2: 1.0,
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

    /// Level flow of 0.3 m/s.
    fn at(alpha_rad: f64) -> Flow {
        Flow { alpha_rad, speed_m_s: 0.3, roll_rad: 0.0, climb_m_s: 0.0, time_s: 0.0, temperature_degc: 10.0, attached: false }
    }

    /// What the sensors say at 100 m under way, the hull warmer than the water.
    fn sensed() -> Sensed {
        Sensed {
            time_s: 1e5,
            pitch_rad: -0.4,
            ballast_m3: 2e-4,
            density_kg_m3: 1020.0,
            temperature_degc: 15.0,
            hull_degc: 15.5,
            pressure_pa: 1e6,
        }
    }

    #[test]
    fn every_effect_is_off_by_default_and_its_range_holds_its_off_value() {
        let flows = [(-0.2, 0.25, -0.1), (0.05, 0.4, 0.2), (0.3, 0.3, 0.0), (0.9, 0.1, 0.0)];
        for e in CATALOGUE.iter().copied() {
            let active = [Active::off(e)];
            let (with, without) = (ForceModel::new(nominal(), &active), ForceModel::new(nominal(), &[]));
            assert_eq!(with.constants, without.constants, "{}", e.name());
            let s = sensed();
            assert_eq!(with.truth(s), s, "{}", e.name());
            assert_eq!(with.volume_m3(&s), without.volume_m3(&s), "{}", e.name());
            for (alpha_rad, speed_m_s, roll_rad) in flows {
                let at = Flow { alpha_rad, speed_m_s, roll_rad, climb_m_s: 0.1, time_s: 1e5, temperature_degc: 10.0, attached: false };
                let (a, b) = (with.coefficients(&at), without.coefficients(&at));
                assert!((a.cl - b.cl).abs() < 1e-12 && (a.cd - b.cd).abs() < 1e-12, "{} at {alpha_rad}", e.name());
            }
            assert_eq!(with.water_up_m_s(&Place { time_s: 9.0, depth_m: 40.0, water_depth_m: 100.0, phase_rad: 1.0 }), 0.0);
            assert_eq!(with.pressure_error_pa(1e5), 0.0);
            for (i, p) in e.parameters().iter().enumerate() {
                // Only what is stated beside the size may have no spread.
                let spread = p.typical > 0.0 || (i > 0 && p.is_stated());
                assert!(p.low <= p.off && p.off <= p.high && spread, "{}.{}", e.name(), p.name);
            }
            assert!(e.parameters().len() <= MAX_PARAMETERS);
            assert_eq!(by_name(e.name()).map(Effect::name), Some(e.name()));
        }
    }

    #[test]
    fn every_effect_changes_something_at_its_typical_size() {
        for e in CATALOGUE.iter().copied() {
            let p = e.parameters()[0];
            let size = if p.off + p.typical <= p.high { p.off + p.typical } else { p.off - p.typical };
            let active = [Active::sized(e, size)];
            let (with, without) = (ForceModel::new(nominal(), &active), ForceModel::new(nominal(), &[]));
            let s = sensed();
            let at = Flow {
                alpha_rad: 0.25,
                speed_m_s: 0.4,
                roll_rad: 0.2,
                climb_m_s: 0.1,
                time_s: 1e5,
                temperature_degc: 10.0,
                attached: false,
            };
            let place = Place { time_s: 9.0, depth_m: 40.0, water_depth_m: 100.0, phase_rad: 1.0 };
            let changed = with.constants != without.constants
                || with.volume_m3(&s) != without.volume_m3(&s)
                || with.truth(s) != s
                || with.coefficients(&at) != without.coefficients(&at)
                || with.water_up_m_s(&place) != 0.0
                || with.pressure_error_pa(1e5) != 0.0
                || with.current_m_s(&place) != (0.0, 0.0);
            assert!(changed, "{}", e.name());
            // Whoever is not asked in the inner loop must have nothing to say there.
            let hooks = e.in_flow();
            let silent = |asked: bool, said: f64| assert!(asked || said == 0.0, "{} has a hook in the flow and says it has none", e.name());
            silent(hooks.lift_angle, with.lift_angle_rad(at.alpha_rad) - at.alpha_rad);
            silent(hooks.lift, with.added_lift(&at, at.alpha_rad));
            silent(hooks.drag, with.added_drag(&at, 0.5));
            silent(hooks.normal_force, with.normal_force(&at));
            let moved = with.water_up_m_s(&place).abs() + with.pressure_error_pa(1e5).abs();
            assert!(e.acts_on_sensors() || with.truth(s) == s, "{} acts on sensors and says it does not", e.name());
            assert!(e.acts_on_depth() || moved == 0.0, "{} acts on depth and says it does not", e.name());
        }
    }

    #[test]
    fn prop_lift_is_odd_and_drag_even_and_both_are_continuous() {
        let model = ForceModel::new(nominal(), &[]);
        for i in 0..150 {
            let a = f64::from(i) * 0.01;
            let (p, m) = (model.coefficients(&at(a)), model.coefficients(&at(-a)));
            assert!((p.cl + m.cl).abs() < 1e-12 && (p.cd - m.cd).abs() < 1e-12, "{a}");
        }
        let (below, above) = (model.coefficients(&at(0.349_999_99)), model.coefficients(&at(0.350_000_01)));
        assert!((below.cl - above.cl).abs() < 1e-6 && (below.cd - above.cd).abs() < 1e-6);
    }

    #[test]
    fn accuracy_growth_keeps_its_mean_rate_over_the_trial_whatever_its_power() {
        let day = |days: f64| Flow { time_s: days * DAY_S, ..at(0.05) };
        for power in [0.5, 1.0, 2.2] {
            let effects = [Active { effect: &BiofoulingDrag, values: [0.1, power, 8.0, 0.0] }];
            let model = ForceModel::new(nominal(), &effects);
            let grown = |days: f64| model.added_drag(&day(days), 0.0) / nominal().cd0;
            assert!((grown(8.0) - 0.8).abs() < 1e-12, "power {power}: {} after 8 days", grown(8.0));
            assert!((grown(2.0) - 0.8 * 0.25_f64.powf(power)).abs() < 1e-12, "power {power}: {} after 2 days", grown(2.0));
            assert_eq!(grown(0.0), 0.0);
        }
    }

    #[test]
    fn prop_a_wing_set_at_an_angle_stalls_as_far_above_zero_lift_as_below() {
        let effects = [Active::sized(&Stall, 0.06), Active::sized(&ZeroLiftAngle, 0.03)];
        let model = ForceModel::new(nominal(), &effects);
        for i in 0..30 {
            let a = f64::from(i) * 0.01;
            let (above, below) = (model.coefficients(&at(0.03 + a)).cl, model.coefficients(&at(0.03 - a)).cl);
            assert!((above + below).abs() < 1e-12, "{a}: {above} {below}");
        }
    }
}
