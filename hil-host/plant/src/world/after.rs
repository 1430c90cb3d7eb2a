//! What a step leaves behind: energy spent, marks passed, the truth.

use super::World;
use super::gas::ATMOSPHERE_PA;
use crate::effects::{Effect, EffectKind as E};
use crate::faults::{Kind, Target};
#[cfg(test)]
use crate::ocean::GRAVITY_M_S2;
use crate::truth::{Energy, Truth};
use rand_distr::{Distribution, StandardNormal};

/// Depth above which the antenna is out, m.
const ANTENNA_OUT_M: f64 = 0.15;
/// Depth within which the hull lies on the bottom, m.
const ON_BOTTOM_M: f64 = 0.02;

impl World {
    /// Energy of one step: `moved` m³ pumped out against `pressure` Pa.
    pub(super) fn account(&mut self, h: f64, rates: [f64; 3], pressure: f64, moved: f64) {
        let a = &self.scenario.actuators;
        let mut pump_w = 0.0;
        if rates[0] != 0.0 {
            // Pushing out works against the water; letting in costs only the valve and motor.
            pump_w = self.pump.running_w + (moved / h).max(0.0) * (pressure + ATMOSPHERE_PA - self.gas_pa()) / self.pump.efficiency;
        }
        let e = &mut self.energy;
        e.pump_j += pump_w * h;
        e.battery_motor_j += if rates[1] == 0.0 { 0.0 } else { a.battery_motor_w * h };
        e.fin_j += if rates[2] == 0.0 { 0.0 } else { a.fin_motor_w * h };
        e.hotel_j += self.scenario.vehicle.hotel_w * h;
        self.pump_power_w = pump_w;
    }

    /// Slow states and marks after a step of length `h`.
    pub(super) fn watch(&mut self, h: f64) {
        let z = self.y[2];
        self.max_depth_m = self.max_depth_m.max(z);
        self.crushed |= z > self.scenario.vehicle.crush_depth_m;
        let iced = self.schedule.find(self.t, Target::Sea, Kind::Ice).is_some();
        self.surfaced_s = if z < ANTENNA_OUT_M && !iced { self.surfaced_s + h } else { 0.0 };
        let water = self.column.at(z, 0.0);
        self.breathe(h, water.temperature);
        if self.hull_temperature.is_some() || self.flooded.is_some() {
            let effects = &self.scenario.effects;
            let towards = |old: f64, new: f64, tau: f64| new + (old - new) * (-h / tau).exp();
            let tau = Effect::sum(effects, E::HullThermalLag).max(1.0);
            self.hull_temperature = self.hull_temperature.map(|t| towards(t, water.temperature, tau));
            let tau = Effect::second(effects, E::FloodedVolumeLag, 60.0).max(1.0);
            self.flooded = self.flooded.map(|rho| towards(rho, water.rho, tau));
        }
        if let Some(since) = self.firing_s
            && !self.weight_dropped
            && self.t - since >= self.scenario.vehicle.release_time_s
            && self.schedule.find(self.t, Target::Release, Kind::Stuck).is_none()
        {
            self.weight_dropped = true;
            self.mass -= self.scenario.vehicle.drop_weight_kg;
        }
        if let Some((rate, _)) = self.schedule.find(self.t, Target::Hull, Kind::Leak) {
            let kg = rate * 1e-3 / 60.0 * h;
            self.water_in_kg += kg;
            self.mass += kg;
        }
    }

    /// Gauge pressure at the vehicle, Pa.
    pub(super) fn pressure(&self) -> f64 {
        self.column.at(self.y[2], 0.0).pressure_pa
    }

    /// A fresh value of the background vertical water motion.
    pub(super) fn draw_background(&mut self, mean: f64, spread: f64) -> f64 {
        let rms = self.scenario.ocean.background_rms_m_s;
        if rms == 0.0 {
            return 0.0;
        }
        let n: f64 = StandardNormal.sample(&mut self.water_rng);
        mean + spread * rms * n
    }

    /// The next node of the background motion: a first-order Gauss-Markov process.
    pub(super) fn next_background(&mut self, last: f64) -> f64 {
        let kept = (-super::BACKGROUND_GRID_S / self.scenario.ocean.background_time_s).exp();
        self.draw_background(kept * last, (1.0 - kept * kept).sqrt())
    }

    /// Everything that is true now.
    #[must_use]
    pub fn truth(&self) -> Truth {
        let [north, east, z, theta, u, w, q, heading, turn] = self.y;
        let i = self.with_water(self.inputs());
        let (vertical_water, lifted) = i.vertical_water(z, 0.0, self.column.depth_m);
        let water = self.column.at(z, lifted);
        let alpha = if u == 0.0 && w == 0.0 { 0.0 } else { w.atan2(u) };
        let lens = i.lens.map_or(0.0, |(edge, change)| change * (0.5 - (z - edge)).clamp(0.0, 1.0));
        let (s, c) = theta.sin_cos();
        Truth {
            time_s: self.t,
            north_m: north,
            east_m: east,
            depth_m: z,
            sink_rate_m_s: -u * s + w * c + vertical_water,
            pitch_rad: theta,
            roll_rad: self.body.roll(i.list, &self.y),
            heading_rad: heading,
            pitch_rate_rad_s: q,
            turn_rate_rad_s: turn,
            u_m_s: u,
            w_m_s: w,
            speed_m_s: (u * u + w * w).sqrt(),
            alpha_rad: alpha,
            glide_angle_rad: theta - alpha,
            ballast_m3: self.ballast.position,
            battery_mass_m: self.battery.position,
            fin_rad: self.fin.position,
            density_kg_m3: water.rho + lens,
            temperature_degc: water.temperature,
            pressure_pa: water.pressure_pa,
            vertical_water_m_s: vertical_water,
            north_water_m_s: water.north + i.current.0,
            east_water_m_s: water.east + i.current.1,
            altitude_m: self.column.depth_m - z,
            energy: self.energy,
            charge: self.charge_left(),
            at_surface: z < ANTENNA_OUT_M,
            on_bottom: z > self.column.depth_m - ON_BOTTOM_M,
            weight_fired: self.firing_s.is_some(),
            weight_dropped: self.weight_dropped,
            max_depth_m: self.max_depth_m,
            crushed: self.crushed,
        }
    }

    /// Energy spent so far.
    #[must_use]
    pub const fn energy(&self) -> Energy {
        self.energy
    }

    /// Mechanical energy of the vehicle in still, uniform, incompressible water, J: what no water can increase.
    #[cfg(test)]
    pub(crate) fn mechanical_energy(&self) -> f64 {
        let [_, _, z, theta, u, w, q, _, _] = self.y;
        let m = self.mass;
        let rho = self.column.at(z, 0.0).rho;
        let ballast = self.ballast.position;
        let mxg = self.body.battery_mass * self.battery.position - rho * ballast * self.body.ballast_arm;
        let mzg = m * self.body.zg;
        let (m1, m3) = (m + self.body.added_surge, m + self.body.added_heave);
        let kinetic = 0.5 * (m1 * u * u + m3 * w * w + self.body.inertia * q * q) + mzg * u * q - mxg * w * q;
        let volume = self.body.hull_volume_m3 + ballast;
        let (s, c) = theta.sin_cos();
        kinetic - (m - rho * volume) * GRAVITY_M_S2 * z + GRAVITY_M_S2 * (mxg * s - mzg * c)
    }
}
