//! The gas in the hull: what its gauge reads besides water and a lost seal.
//!
//! ```text
//! p = p_sealed · amount · (T / T_sealed) · V_gas / (V_gas + ballast − water − squeeze)
//! ```
//! The pump draws oil in and gives it out, water takes room, the hull gives way to the sea, and the gas follows the water's temperature with a
//! lag. In real logs a Slocum has 29 and 35 litres of it and a SeaExplorer 51, by pressure against pump strokes.

use super::World;
use crate::faults::{Kind, Target};

/// One atmosphere, Pa.
pub(super) const ATMOSPHERE_PA: f64 = 101_325.0;
/// Pressure of a sealed hull, Pa absolute (7 inHg below one atmosphere).
const SEALED_PA: f64 = ATMOSPHERE_PA - 7.0 * 3386.0;
/// Temperature at which the hull was sealed, K: on deck.
const SEALED_K: f64 = 293.15;
const FREEZING_K: f64 = 273.15;
/// Least share of the gas's room that is left, 1: beyond, the hull is full.
const LEAST_ROOM: f64 = 0.05;

/// What changes in it slowly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gas {
    /// Over what was sealed in, 1.
    amount: f64,
    /// Its temperature, K.
    kelvin: f64,
}

impl Default for Gas {
    fn default() -> Self {
        Self { amount: 1.0, kelvin: SEALED_K }
    }
}

impl World {
    /// Pressure in the hull, Pa absolute.
    pub(super) fn gas_pa(&self) -> f64 {
        let room_m3 = self.scenario.vehicle.gas_m3;
        let squeeze_m3 = self.body.hull_volume_m3 * self.body.compressibility * self.pressure().max(0.0);
        let taken_m3 = 1e-3 * self.water_in_kg + squeeze_m3 - self.ballast.position;
        SEALED_PA * self.gas.amount * (self.gas.kelvin / SEALED_K) / (1.0 - taken_m3 / room_m3).max(LEAST_ROOM)
    }

    /// One step of length `h` in water of this temperature, °C.
    pub(super) fn breathe(&mut self, h: f64, water_degc: f64) {
        let water_k = water_degc + FREEZING_K;
        self.gas.kelvin = water_k + (self.gas.kelvin - water_k) * (-h / self.scenario.vehicle.gas_lag_s).exp();
        if let Some((tau, _)) = self.schedule.find(self.t, Target::Hull, Kind::VacuumLoss) {
            let pa = self.gas_pa();
            self.gas.amount *= (ATMOSPHERE_PA + (pa - ATMOSPHERE_PA) * (-h / tau.max(1.0)).exp()) / pa;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Scenario, World};
    use signals::ActuatorCommand;

    /// Pressure in a hull with so much gas after two minutes with the pump there, Pa: still near the surface, and no cooler.
    fn after(gas_m3: f64, ballast_m3: f32, fault: Option<&str>) -> f64 {
        let faults = fault.map(|f| f.parse().expect("a fault")).into_iter().collect();
        let mut scenario = Scenario { faults, ..Scenario::default() };
        scenario.vehicle.gas_m3 = gas_m3;
        let mut world = World::new(scenario).expect("a world");
        world.advance(&ActuatorCommand { ballast_m3, ..ActuatorCommand::default() }, 120.0);
        world.gas_pa()
    }

    #[test]
    fn validate_a_pump_stroke_moves_the_pressure_as_in_a_real_log() {
        // A Slocum in the North Sea: 79.27 kPa with 230 cc drawn in, 78.19 kPa with 230 cc given out.
        let share = after(0.035, -230e-6, None) / after(0.035, 230e-6, None) - 1.0;
        assert!((share - (79.27 / 78.19 - 1.0)).abs() < 1e-3, "{share}");
    }

    #[test]
    fn water_raises_the_pressure_and_a_lost_seal_ends_at_one_atmosphere() {
        // 600 g in 30 litres.
        let share = after(0.03, 230e-6, Some("hull:leak=300")) / after(0.03, 230e-6, None) - 1.0;
        assert!((share - 0.6 / 29.6).abs() < 1e-3, "{share}");
        let open = after(0.03, 230e-6, Some("hull:vacuum_loss=5"));
        assert!((open - 101_325.0).abs() < 50.0, "{open}");
    }
}
