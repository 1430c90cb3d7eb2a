//! Which physical effects may a real glider show that its nominal model lacks?
//!
//! One effect is one row, an [`Effect`] with named, united parameters and hooks;
//! every effect is off unless it is in the list of a [`ForceModel`]. A new effect
//! is one row in the file of its kind, and one line in [`CATALOGUE`];
//! CONTRIBUTING.md has a worked example.
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
pub use buoyancy::{BALLAST_OFFSET, BALLAST_SCALE, HULL_COMPRESSIBILITY, THERMAL_EXPANSION};
pub use coefficients::LiftDrag;
pub use drag::ROLL_TURN_DRAG;
pub use law::ForceModel;
pub use quantities::{Constants, DAY_S, Flow, HULL_LAG_S, Place, REFERENCE_TEMPERATURE_DEGC, Sensed};
pub use search::{Calibrated, Onset, SeenIn};
pub use sensing::PITCH_OFFSET;
pub use water::{WAVE, vertical_mode};

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

impl Parameter {
    /// `name` in `unit`: its off value, its range, its typical size, and where range and size come from.
    #[must_use]
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        off: f64,
        (low, high): (f64, f64),
        typical: f64,
        source: &'static str,
    ) -> Self {
        Self { name, unit, off, low, high, typical, source }
    }

    /// Whether it is stated with the others and never fitted.
    #[must_use]
    pub fn is_stated(&self) -> bool {
        self.typical == 0.0
    }
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

impl InFlow {
    /// None of them.
    pub const NOTHING: Self = Self { lift_angle: false, lift: false, drag: false, normal_force: false };

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

/// What an effect does at one place of the model, if it does anything there.
pub type Hook<F> = Option<&'static F>;

/// One optional physical effect, a row over [`Effect::NONE`]. First argument of every hook are its parameters in the order of
/// [`Effect::parameters`], of which the first is its size: at `off` the effect is not there.
#[derive(Clone, Copy)]
#[allow(clippy::type_complexity, reason = "a hook is its signature")]
pub struct Effect {
    /// Name in files, commands and reports.
    pub name: &'static str,
    /// What it is, in one sentence for a person, with the physics.
    pub physics: &'static str,
    /// What measurement would tell it from its look-alikes.
    pub separated_by: &'static str,
    /// The text of an effect that a person wrote as an expression.
    pub expression: Option<&'static str>,
    /// Its numbers; the first is the size.
    pub parameters: &'static [Parameter],
    /// Which calibrated number of the vehicle it is the error of, if it is: inside that number's tolerance it is scatter.
    pub error_of: Option<Calibrated>,
    /// Sign that its size has by its physics (growth grows, vortices add force); 0 if either is as likely.
    pub usual_sign: f64,
    /// Size that a fit starts from, where that is not `off`.
    pub starts_at: Option<f64>,
    /// Where its size is an angle beyond which it acts: how it is looked for.
    pub onset: Option<Onset>,
    /// In which measurements it is looked for.
    pub seen_in: SeenIn,
    /// Changes constants of the law.
    pub constants: Hook<dyn Fn(&[f64], &mut Constants) + Sync>,
    /// Turns what the sensors said into what is true.
    pub sensed: Hook<dyn Fn(&[f64], &mut Sensed) + Sync>,
    /// Displaced volume added, m³.
    pub volume_m3: Hook<dyn Fn(&[f64], &Sensed, &Constants) -> f64 + Sync>,
    /// Angle that the linear and quadratic lift see, from the one given, rad.
    pub lift_angle_rad: Hook<dyn Fn(&[f64], f64) -> f64 + Sync>,
    /// Lift coefficient added before the induced drag is formed; the angle is the one that the linear and quadratic lift see.
    pub lift: Hook<dyn Fn(&[f64], &Flow, f64, &Constants) -> f64 + Sync>,
    /// Drag coefficient added at a lift coefficient.
    pub drag: Hook<dyn Fn(&[f64], &Flow, f64, &Constants) -> f64 + Sync>,
    /// Coefficient of a force normal to the body (adds lift and drag, no suction), positive for α > 0.
    pub normal_force: Hook<dyn Fn(&[f64], &Flow) -> f64 + Sync>,
    /// Vertical water motion, m/s, up.
    pub water_up_m_s: Hook<dyn Fn(&[f64], &Place) -> f64 + Sync>,
    /// What the pressure sensor shows too much at a time in s, Pa.
    pub pressure_error_pa: Hook<dyn Fn(&[f64], f64) -> f64 + Sync>,
    /// Horizontal current, (east, north), m/s.
    pub current_m_s: Hook<dyn Fn(&[f64]) -> (f64, f64) + Sync>,
}

impl core::fmt::Debug for Effect {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name)
    }
}

impl Effect {
    /// Without a name, numbers and hooks, of either sign and seen in the vertical motion.
    pub const NONE: Self = Self {
        name: "",
        physics: "",
        separated_by: "",
        expression: None,
        parameters: &[],
        error_of: None,
        usual_sign: 0.0,
        starts_at: None,
        onset: None,
        seen_in: SeenIn::VerticalMotion,
        constants: None,
        sensed: None,
        volume_m3: None,
        lift_angle_rad: None,
        lift: None,
        drag: None,
        normal_force: None,
        water_up_m_s: None,
        pressure_error_pa: None,
        current_m_s: None,
    };

    /// Size that a fit starts from.
    #[must_use]
    pub fn start(&self) -> f64 {
        self.starts_at.unwrap_or(self.parameters.first().map_or(0.0, |p| p.off))
    }

    /// Which hooks that depend on the flow it has.
    #[must_use]
    pub fn in_flow(&self) -> InFlow {
        InFlow {
            lift_angle: self.lift_angle_rad.is_some(),
            lift: self.lift.is_some(),
            drag: self.drag.is_some(),
            normal_force: self.normal_force.is_some(),
        }
    }

    /// Whether it moves the water up or down, or errs in pressure.
    #[must_use]
    pub fn acts_on_depth(&self) -> bool {
        self.water_up_m_s.is_some() || self.pressure_error_pa.is_some()
    }
}

/// Every effect with a name, in the order of FORMAT section 6.3; a new one is a line more, such as `&drag::MAST_DRAG,`.
pub static CATALOGUE: &[&Effect] = &[
    &lift::VORTEX_LIFT_BODYWING,
    &lift::SIDE_EDGE_LIFT,
    &drag::REYNOLDS_DRAG,
    &lift::STALL,
    &buoyancy::HULL_COMPRESSIBILITY,
    &buoyancy::THERMAL_EXPANSION,
    &drag::BIOFOULING_DRAG,
    &sensing::PITCH_OFFSET,
    &buoyancy::BALLAST_OFFSET,
    &buoyancy::BALLAST_SCALE,
    &water::INTERNAL_WAVE,
    &water::VERTICAL_CURRENT,
    &drag::ROLL_TURN_DRAG,
    &drag::CLIMB_DRAG,
    &inertia::ADDED_MASS,
    &inertia::HEAVE_ADDED_MASS,
    &drag::DRAG_LEVEL_ERROR,
    &lift::LIFT_SLOPE_ERROR,
    &drag::INDUCED_DRAG_ERROR,
    &lift::ZERO_LIFT_ANGLE,
    &sensing::DENSITY_BIAS,
    &sensing::PRESSURE_DRIFT,
    &sensing::PITCH_SCALE,
    &water::HORIZONTAL_CURRENT,
];

/// The effect with this name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static Effect> {
    CATALOGUE.iter().copied().find(|e| e.name == name)
}

/// An effect that is on, with its values.
#[derive(Clone, Copy, Debug)]
pub struct Active {
    /// Which.
    pub effect: &'static Effect,
    /// Values in the order of its parameters; the rest is unused.
    pub values: [f64; MAX_PARAMETERS],
}

impl Active {
    /// The effect at its off value, shape parameters at their usual ones.
    #[must_use]
    pub fn off(effect: &'static Effect) -> Self {
        let mut values = [0.0; MAX_PARAMETERS];
        for (v, p) in values.iter_mut().zip(effect.parameters) {
            *v = p.off;
        }
        Self { effect, values }
    }

    /// The effect at this size, shape parameters at their usual values.
    #[must_use]
    pub fn sized(effect: &'static Effect, size: f64) -> Self {
        let mut a = Self::off(effect);
        a.values[0] = size;
        a
    }
}

#[cfg(test)]
mod tests;
