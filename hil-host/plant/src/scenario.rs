//! What shall be true? One scenario is one world: vehicle, water, sensors,
//! actuators, hidden effects, faults, seed. It can be read from and written to
//! a TOML file; every field has a default.

use crate::actuators::{Actuators, Pump};
use crate::effects::Effect;
use crate::faults::Fault;
use crate::ocean::Ocean;
use crate::sensors::Sensors;
use crate::vehicle::Vehicle;
use serde::{Deserialize, Serialize};
use signals::Wings;

/// Where and how the vehicle starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Start {
    /// Clock of the controller at the start, µs: long-time tests start just before a wrap.
    pub clock_us: u64,
    /// Time in the water before the start, s: fouling has grown this long.
    pub in_water_s: f64,
    /// Depth, m. 0: floating.
    pub depth_m: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Ballast, m³; none: all pumped out.
    pub ballast_m3: Option<f64>,
    /// Battery position, m; none: where it balances the ballast at zero pitch.
    pub battery_mass_m: Option<f64>,
    /// Charge, 0..1; none: full.
    pub charge: Option<f64>,
}

/// A whole world to be.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Wings mounted.
    pub wings: Wings,
    /// Seed of all noise. Equal scenarios with equal commands give equal worlds.
    pub seed: u64,
    /// Start.
    pub start: Start,
    /// Vehicle.
    pub vehicle: Vehicle,
    /// Actuators.
    pub actuators: Actuators,
    /// Sensors.
    pub sensors: Sensors,
    /// Water.
    pub ocean: Ocean,
    /// Hidden effects.
    pub effects: Vec<Effect>,
    /// Faults to come.
    pub faults: Vec<Fault>,
}

impl Scenario {
    /// The paper's trial water: a lake of 60 m, 100 m pump.
    #[must_use]
    pub fn shallow(wings: Wings) -> Self {
        Self { wings, ..Self::default() }
    }

    /// Shelf sea of 250 m, 200 m pump.
    #[must_use]
    pub fn sea(wings: Wings) -> Self {
        Self { wings, ocean: Ocean::sea(), actuators: Actuators { pump: Pump::shallow_200(), ..Actuators::default() }, ..Self::default() }
    }

    /// Deep sea of 1500 m, oil pump.
    #[must_use]
    pub fn deep(wings: Wings) -> Self {
        Self {
            wings,
            vehicle: Vehicle::deep(),
            ocean: Ocean::deep(),
            actuators: Actuators { pump: Pump::deep(), battery_travel_m: 1.4 * 0.0254, ..Actuators::default() },
            ..Self::default()
        }
    }

    /// Reads a TOML truth file's text.
    ///
    /// # Errors
    /// Line, column and what is wrong, and for a number what it may be.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        let scenario: Self = toml::from_str(text).map_err(|e| e.to_string().trim().to_owned())?;
        crate::bounds::check(text)?;
        scenario.validate()?;
        Ok(scenario)
    }

    /// Writes a TOML truth file.
    ///
    /// # Errors
    /// When a number cannot be written.
    pub fn to_toml(&self) -> Result<String, String> {
        toml::to_string(self).map_err(|e| e.to_string())
    }

    /// Refuses worlds that cannot be.
    ///
    /// # Errors
    /// The first field that is wrong, with its value and range.
    pub fn validate(&self) -> Result<(), String> {
        let v = &self.vehicle;
        let a = &self.actuators;
        let checks = [
            ("vehicle.mass_kg", v.mass_kg, 1.0, 1e4),
            ("vehicle.compressibility_per_pa", v.compressibility_per_pa, -1e-8, 1e-8),
            ("vehicle.thermal_expansion_per_k", v.thermal_expansion_per_k, -1e-3, 1e-3),
            ("vehicle.added_mass_surge_kg", v.added_mass_surge_kg, 0.0, 1e4),
            ("vehicle.added_mass_heave_kg", v.added_mass_heave_kg, 0.0, 1e4),
            ("vehicle.inertia_kg_m2", v.inertia_kg_m2, 0.1, 1e5),
            ("vehicle.metacentric_height_m", v.metacentric_height_m, 1e-4, 1.0),
            ("vehicle.battery_mass_kg", v.battery_mass_kg, 0.1, 1e3),
            ("vehicle.turn_radius_m", v.turn_radius_m, 0.5, 1e4),
            ("vehicle.yaw_length_m", v.yaw_length_m, 0.1, 1e3),
            ("vehicle.battery_j", v.battery_j, 1.0, 1e12),
            ("vehicle.hotel_w", v.hotel_w, 0.0, 1e4),
            ("actuators.pump.volume_m3", a.pump.volume_m3, 1e-6, 1.0),
            ("actuators.pump.rate_m3_s", a.pump.rate_m3_s, 1e-8, 1.0),
            ("actuators.pump.efficiency", a.pump.efficiency, 0.01, 1.0),
            ("actuators.battery_travel_m", a.battery_travel_m, 1e-4, 1.0),
            ("actuators.battery_rate_m_s", a.battery_rate_m_s, 1e-6, 1.0),
            ("actuators.fin_rate_rad_s", a.fin_rate_rad_s, 1e-4, 100.0),
            ("ocean.background_rms_m_s", self.ocean.background_rms_m_s, 0.0, 1.0),
            ("ocean.background_time_s", self.ocean.background_time_s, 1.0, 1e6),
            ("start.depth_m", self.start.depth_m, 0.0, 1e4),
            ("start.pitch_rad", self.start.pitch_rad, -1.5, 1.5),
        ];
        for (name, value, low, high) in checks {
            if !(low..=high).contains(&value) {
                return Err(format!("{name} is {value}, it must be within {low} to {high}"));
            }
        }
        let ball = ball_kg_m2(v.mass_kg);
        if v.inertia_kg_m2 < ball {
            return Err(format!(
                "vehicle.inertia_kg_m2 is {}, less than a ball of vehicle.mass_kg = {} has ({ball:.2} kg m2); \
                 a glider is longer: state both",
                v.inertia_kg_m2, v.mass_kg
            ));
        }
        if let Some(e) = self.effects.iter().find(|e| !e.value.is_finite()) {
            return Err(format!("effect {} has no finite size", e.kind.name()));
        }
        Ok(())
    }
}

/// Inertia of a ball that floats in sea water, kg m²: the least of any hull of its mass and volume.
fn ball_kg_m2(mass_kg: f64) -> f64 {
    const SEA_WATER_KG_M3: f64 = 1025.0;
    let radius_m = (3.0 * mass_kg / (4.0 * std::f64::consts::PI * SEA_WATER_KG_M3)).cbrt();
    0.4 * mass_kg * radius_m * radius_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_an_inertia_below_that_of_a_ball_is_refused() {
        // 52 kg: radius 0.23 m, 0.4 x 52 x 0.0527.
        assert!((ball_kg_m2(52.0) - 1.097).abs() < 1e-3);
        let refused = Scenario::from_toml("[vehicle]\ninertia_kg_m2 = 1.0").expect_err("refused");
        assert!(refused.contains("vehicle.inertia_kg_m2 is 1, less than a ball"), "{refused}");
        assert!(Scenario::from_toml("[vehicle]\ninertia_kg_m2 = 2.0").is_ok());
    }
}
