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
mod coefficients;
mod drag;
mod inertia;
mod law;
mod lift;
mod quantities;
mod search;
mod sensing;
mod water;

pub use beyond::{ALPHA_VALID_RAD, Beyond, CD_BROADSIDE, Continuation};
pub use buoyancy::{BallastOffset, BallastScale, HullCompressibility, ThermalExpansion};
pub use coefficients::LiftDrag;
pub use drag::{BiofoulingDrag, ClimbDrag, DragLevelError, InducedDragError, ReynoldsDrag, RollTurnDrag};
pub use inertia::{AddedMass, HeaveAddedMass};
pub use law::ForceModel;
pub use lift::{LiftSlopeError, SideEdgeLift, Stall, VortexLiftBodyWing, ZeroLiftAngle};
pub use quantities::{Constants, DAY_S, Flow, HULL_LAG_S, Place, REFERENCE_TEMPERATURE_DEGC, Sensed};
pub use search::{Calibrated, Onset, SeenIn};
pub use sensing::{DensityBias, PitchOffset, PitchScale, PressureDrift};
pub use water::{HorizontalCurrent, InternalWave, VerticalCurrent, WAVE, vertical_mode};

/// Most parameters one effect may have.
pub const MAX_PARAMETERS: usize = 4;

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
    /// Which calibrated number of the vehicle it is the error of, if it is: inside that number's tolerance it is scatter.
    fn error_of(&self) -> Option<Calibrated> {
        None
    }
    /// Sign that its size has by its physics (growth grows, vortices add force); 0 if either is as likely.
    fn usual_sign(&self) -> f64 {
        0.0
    }
    /// Size that a fit starts from.
    fn start(&self) -> f64 {
        self.parameters().first().map_or(0.0, |p| p.off)
    }
    /// Where its size is an angle beyond which it acts: how it is looked for.
    fn onset(&self) -> Option<Onset> {
        None
    }
    /// In which measurements it is looked for.
    fn seen_in(&self) -> SeenIn {
        SeenIn::VerticalMotion
    }
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
mod tests;
