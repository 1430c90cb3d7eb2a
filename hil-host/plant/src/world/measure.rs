//! What the vehicle's electronics get to know.

use super::World;
use crate::effects::{Effect, EffectKind as E};
use crate::faults::{Kind, Target};
use crate::ocean::GRAVITY_M_S2;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use signals::{Micros, Reading, SensorFrame, Surface, Switch, Weight};
use std::f64::consts::TAU;

/// Resting voltage when full and when empty, V (primary lithium pack, rounded).
const VOLTAGE: (f64, f64) = (15.5, 10.5);
/// Internal resistance of the pack, ohm (guess).
const PACK_OHM: f64 = 0.08;
/// Water in the hull that the leak detector sees, kg (guess: a spoonful).
const LEAK_SEEN_KG: f64 = 0.002;
/// Noise of the CTD's temperature, K (guess: a pumped CTD reads better than its water is mixed).
const TEMPERATURE_NOISE_K: f64 = 0.002;

impl World {
    /// Measures everything once.
    pub fn sense(&mut self) -> SensorFrame {
        let truth = self.truth();
        let effects = &self.scenario.effects;
        let sum = |k| Effect::sum(effects, k);
        let v = &self.scenario.vehicle;
        let sensors = &self.scenario.sensors;
        let rho_nominal = sensors.depth_density_kg_m3.unwrap_or(v.mass_kg / self.body.hull_volume_m3);
        let near = (-truth.depth_m.max(0.0) / 2.0).exp();
        let wave = if near > 0.01 && self.scenario.ocean.wave_height_m > 0.0 {
            let n: f64 = StandardNormal.sample(&mut self.sensor_rng);
            n * self.scenario.ocean.wave_height_m * near
        } else {
            0.0
        };
        let days = (self.scenario.start.in_water_s + self.t) / 86_400.0;
        let depth = (truth.pressure_pa + 1e4 * sum(E::PressureDrift) * days) / (rho_nominal * GRAVITY_M_S2) + truth.depth_m.min(0.0) + wave;
        let altitude = self.column.depth_m - truth.depth_m;
        let volts = self.voltage();
        let channels = [
            Some(depth),
            Some(depth),
            Some(truth.pitch_rad * (1.0 + sum(E::PitchScale)) + sum(E::PitchOffset)),
            Some(truth.roll_rad),
            Some(truth.heading_rad.rem_euclid(TAU)),
            Some(self.ballast.position),
            Some(self.battery.position),
            Some(self.fin.position),
            Some(truth.density_kg_m3 + sum(E::DensityBias)),
            (altitude < sensors.altimeter_range_m).then_some(altitude),
            Some(self.schedule.find(self.t, Target::Power, Kind::Undervoltage).map_or(volts, |f| f.0)),
            Some(self.charge_left()),
            Some(self.gas_pa()),
        ];
        let r = self.suite.read(self.t, channels, &self.schedule, &mut self.sensor_rng);
        self.seq = self.seq.wrapping_add(1);
        let blind = |world: &mut Self, target| {
            world.schedule.find(world.t, target, Kind::Off).is_some()
                || world.schedule.find(world.t, target, Kind::Intermittent).is_some_and(|f| world.fault_rng.random::<f64>() < f.0)
        };
        let no_gps = blind(self, Target::Gps);
        let no_comms = blind(self, Target::Comms);
        SensorFrame {
            seq: self.seq,
            time: Micros(self.scenario.start.clock_us.saturating_add((self.t * 1e6).round() as u64)),
            depth_m: r[0],
            depth2_m: r[1],
            pitch_rad: r[2],
            roll_rad: r[3],
            heading_rad: r[4],
            ballast_m3: r[5],
            battery_mass_m: r[6],
            fin_rad: r[7],
            density_kg_m3: r[8],
            temperature_degc: self.temperature(r[8], truth.temperature_degc),
            altitude_m: r[9],
            battery_v: r[10],
            charge: r[11],
            vacuum_pa: r[12],
            leak: self.leak(),
            weight: self.weight(),
            surface: Surface {
                gps_fix: self.surfaced_s >= self.scenario.sensors.first_fix_s && !no_gps,
                comms: self.surfaced_s >= self.scenario.sensors.first_comms_s && !no_comms,
            },
        }
    }

    /// Whether the antenna is out and the shore would be heard, without looking: no noise is drawn, no time passes.
    #[must_use]
    pub fn shore_in_reach(&self) -> bool {
        let blind = self.schedule.find(self.t, Target::Comms, Kind::Off).is_some();
        self.surfaced_s > 0.0 && self.scenario.sensors.first_comms_s.is_finite() && !blind
    }

    /// The thermistor sits in the CTD: no density, no temperature. Its noise is drawn apart, so that no other sensor's depends on it.
    fn temperature(&mut self, density: Reading, truth_degc: f64) -> Reading {
        let Reading::Sampled { age_ms, .. } = density else { return Reading::Missing };
        let is_perfect = self.scenario.sensors.density.noise == 0.0;
        let noise: f64 = if is_perfect { 0.0 } else { StandardNormal.sample(&mut self.thermometer_rng) };
        Reading::Sampled { value: (truth_degc + TEMPERATURE_NOISE_K * noise) as f32, age_ms }
    }

    fn leak(&mut self) -> Switch {
        let real = if self.water_in_kg > LEAK_SEEN_KG { Switch::Alarm } else { Switch::Clear };
        if self.schedule.is_empty() {
            return real;
        }
        let find = |k| self.schedule.find(self.t, Target::LeakDetector, k);
        if find(Kind::Off).is_some() {
            Switch::Unknown
        } else if find(Kind::Alarm).is_some() {
            Switch::Alarm
        } else if find(Kind::Stuck).is_some() {
            Switch::Clear
        } else if let Some((share, _)) = find(Kind::Chatter) {
            if self.fault_rng.random::<f64>() < share { Switch::Alarm } else { real }
        } else {
            real
        }
    }

    fn weight(&self) -> Weight {
        if self.schedule.find(self.t, Target::WeightMonitor, Kind::Off).is_some() {
            Weight::Unknown
        } else if self.weight_dropped || self.schedule.find(self.t, Target::WeightMonitor, Kind::Alarm).is_some() {
            Weight::Released
        } else {
            Weight::Held
        }
    }

    pub(super) fn charge_left(&self) -> f64 {
        if let Some((size, _)) = self.schedule.find(self.t, Target::Power, Kind::LowCharge) {
            return size;
        }
        (self.scenario.start.charge.unwrap_or(1.0) - self.energy.total_j() / self.scenario.vehicle.battery_j).max(0.0)
    }

    fn voltage(&self) -> f64 {
        let resting = VOLTAGE.1 + (VOLTAGE.0 - VOLTAGE.1) * self.charge_left().sqrt();
        resting - PACK_OHM * (self.pump_power_w + self.scenario.vehicle.hotel_w) / resting
    }
}
