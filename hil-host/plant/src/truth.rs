//! What is true, for judges only: no controller and no model sees it.

use serde::{Deserialize, Serialize};

/// Electric energy spent, by consumer, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Buoyancy pump.
    pub pump_j: f64,
    /// Battery motor.
    pub battery_motor_j: f64,
    /// Fin motor.
    pub fin_j: f64,
    /// Hotel load: computers and sensors.
    pub hotel_j: f64,
}

impl Energy {
    /// All together, J.
    #[must_use]
    pub fn total_j(&self) -> f64 {
        self.pump_j + self.battery_motor_j + self.fin_j + self.hotel_j
    }
}

/// The true state. Signs as in [`signals`]: depth down, pitch nose up, α positive when the flow comes from below the nose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Time since the start, s.
    pub time_s: f64,
    /// Position over ground to the north, m.
    pub north_m: f64,
    /// Position over ground to the east, m.
    pub east_m: f64,
    /// Depth of the centre of buoyancy below its place when just afloat, m.
    pub depth_m: f64,
    /// Rate of depth, m/s, down positive, over ground.
    pub sink_rate_m_s: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Heading, rad, not wrapped.
    pub heading_rad: f64,
    /// Pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
    /// Turn rate, rad/s, to starboard.
    pub turn_rate_rad_s: f64,
    /// Velocity through the water along body x (forward), m/s.
    pub u_m_s: f64,
    /// Velocity through the water along body z (down), m/s.
    pub w_m_s: f64,
    /// Speed through the water, m/s.
    pub speed_m_s: f64,
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Path angle through the water, rad, up positive.
    pub glide_angle_rad: f64,
    /// Ballast as the pump's piston stands, m³.
    pub ballast_m3: f64,
    /// Battery position, m.
    pub battery_mass_m: f64,
    /// Fin angle, rad.
    pub fin_rad: f64,
    /// Water density, kg/m³.
    pub density_kg_m3: f64,
    /// Water temperature, °C.
    pub temperature_degc: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Vertical water velocity, m/s, down positive.
    pub vertical_water_m_s: f64,
    /// Water velocity to the north, m/s.
    pub north_water_m_s: f64,
    /// Water velocity to the east, m/s.
    pub east_water_m_s: f64,
    /// Height above the bottom, m.
    pub altitude_m: f64,
    /// Energy spent.
    pub energy: Energy,
    /// Charge left, 0..1.
    pub charge: f64,
    /// Afloat with the antenna out.
    pub at_surface: bool,
    /// Lying on the bottom.
    pub on_bottom: bool,
    /// Release of the drop weight fired.
    pub weight_fired: bool,
    /// Drop weight gone.
    pub weight_dropped: bool,
    /// Greatest depth so far, m.
    pub max_depth_m: f64,
    /// Has been deeper than the hull stands.
    pub crushed: bool,
}
