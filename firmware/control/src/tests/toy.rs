//! A toy glider to fly the law in unit tests: longitudinal rigid body, one
//! drag and one lift polar, instant sensors. Written apart from the project's
//! plant and model; good enough to show that the law flies, not how well.

use crate::config::Config;
use signals::{ActuatorCommand, Reading, SensorFrame, Surface, Switch, Weight};

/// Vehicle of the toy (physics: Slocum, at-sea drag). SI.
#[derive(Clone, Debug)]
pub struct Toy {
    pub t: f64,
    pub u: f64,
    pub w: f64,
    pub q: f64,
    pub theta: f64,
    pub x: f64,
    pub z: f64,
    pub z_max: f64,
    /// Vertical way, m.
    pub way: f64,
    pub ballast: f64,
    pub battery: f64,
    pub fin: f64,
    pub heading: f64,
    pub pump_rate: f64,
    pub pump_sticks: bool,
    pub battery_sticks: bool,
    pub weight_kg: f64,
    /// C_D S at α = 0, m²; lift slope × S; induced, all m².
    pub drag_area: f64,
    pub lift_area: f64,
    pub induced_area: f64,
    /// Zero error of the battery position, m.
    pub battery_zero: f64,
    /// Vertical water velocity, m/s, down.
    pub water: f64,
    seq: u32,
}

impl Toy {
    pub fn new(config: &Config) -> Self {
        Self {
            t: 0.0,
            u: 0.0,
            w: 0.0,
            q: 0.0,
            theta: 0.0,
            x: 0.0,
            z: 0.0,
            z_max: 0.0,
            way: 0.0,
            ballast: f64::from(config.pump_m3),
            battery: 0.0,
            fin: 0.0,
            heading: 0.0,
            pump_rate: f64::from(config.pump_rate_m3_s),
            pump_sticks: false,
            battery_sticks: false,
            weight_kg: 0.5,
            drag_area: 0.0150,
            lift_area: 0.675,
            induced_area: 1.05,
            battery_zero: 0.002,
            water: 0.0,
            seq: 0,
        }
    }

    pub fn frame(&mut self) -> SensorFrame {
        self.seq += 1;
        let up = self.z < 0.3;
        SensorFrame {
            seq: self.seq,
            time: signals::Micros((self.t * 1e6) as u64),
            depth_m: Reading::now(self.z as f32),
            depth2_m: Reading::now(self.z as f32 + 0.05),
            pitch_rad: Reading::now(self.theta as f32),
            roll_rad: Reading::now(0.0),
            heading_rad: Reading::now(self.heading.rem_euclid(std::f64::consts::TAU) as f32),
            ballast_m3: Reading::now(self.ballast as f32),
            battery_mass_m: Reading::now(self.battery as f32),
            fin_rad: Reading::now(self.fin as f32),
            density_kg_m3: Reading::now(1025.0),
            temperature_degc: Reading::now(12.0),
            altitude_m: Reading::Missing,
            battery_v: Reading::now(14.0),
            charge: Reading::now(0.9),
            vacuum_pa: Reading::now(75e3),
            leak: Switch::Clear,
            weight: if self.weight_kg > 0.0 { Weight::Held } else { Weight::Released },
            surface: Surface { gps_fix: up, comms: up },
        }
    }

    pub fn fly(&mut self, c: &ActuatorCommand, span: f64) {
        let n = (span / 0.05).ceil() as usize;
        let dt = span / n as f64;
        for _ in 0..n {
            self.small_step(c, dt);
        }
    }

    fn small_step(&mut self, c: &ActuatorCommand, dt: f64) {
        let go = |at: f64, to: f64, rate: f64| at + (to - at).clamp(-rate * dt, rate * dt);
        if !self.pump_sticks {
            self.ballast = go(self.ballast, f64::from(c.ballast_m3), self.pump_rate);
        }
        if !self.battery_sticks {
            self.battery = go(self.battery, f64::from(c.battery_mass_m), 2.54e-3);
        }
        self.fin = go(self.fin, f64::from(c.fin_rad), 0.02);
        if c.drop_weight {
            self.weight_kg = 0.0;
        }
        let (rho, g, m, m1, m3, i) = (1025.0, 9.81, 52.0, 3.0, 55.0, 17.3);
        let zg = 4.6e-3;
        let buoyancy = rho * g * self.ballast + (0.5 - self.weight_kg) * g;
        let (s, co) = self.theta.sin_cos();
        let v = self.u.hypot(self.w).max(1e-6);
        let alpha = self.w.atan2(self.u);
        let a = alpha.clamp(-0.35, 0.35);
        let q_dyn = 0.5 * rho * v * v;
        let wide = 1.0 - (alpha.cos().max(0.0));
        let drag = q_dyn * (self.drag_area + self.induced_area * a * a + 0.35 * wide);
        let lift = q_dyn * self.lift_area * a * (1.0 - wide).max(0.0);
        let fx = buoyancy * s - drag * alpha.cos() + lift * alpha.sin();
        let fz = -buoyancy * co - drag * alpha.sin() - lift * alpha.cos();
        let trim = 1785.0 * self.ballast - 24.0 * (self.battery + self.battery_zero);
        // Righting moment m g zg (sin θ − tan θ_trim cos θ), zg from the trim law's own balance.
        let moment = -m * g * zg * (s - trim * co) - 15.0 * a * v * v - 40.0 * self.q * v.max(0.1) - 4.0 * self.q;
        let du = fx / (m + m1) - (m + m3) / (m + m1) * self.w * self.q;
        let dw = fz / (m + m3) + (m + m1) / (m + m3) * self.u * self.q;
        self.u += du * dt;
        self.w += dw * dt;
        self.q += moment / i * dt;
        self.theta += self.q * dt;
        let down = -self.u * s + self.w * co + self.water;
        let z = (self.z + down * dt).max(0.0);
        if z <= 0.0 && down < 0.0 {
            self.u *= 1.0 - dt.min(0.5);
            self.w *= 1.0 - dt.min(0.5);
        }
        self.way += (z - self.z).abs();
        self.z = z;
        self.z_max = self.z_max.max(z);
        self.x += (self.u * co + self.w * s) * dt;
        self.heading += 1.5 * self.fin * v * v * dt;
        self.t += dt;
    }
}
