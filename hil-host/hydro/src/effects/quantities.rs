//! What an effect is told: constants of the law, what the sensors said, the flow, a place in the water.

#[cfg(doc)]
use super::ALPHA_VALID_RAD;
use super::Beyond;

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
