//! What do pump, battery motor, fin and drop weight do with a command?
//!
//! Each moves at a constant rate towards its target, starts only when the
//! target is farther than its dead-band, and stops there.

use serde::{Deserialize, Serialize};

/// Buoyancy pump.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pump {
    /// Volume either side of the middle, m³.
    pub volume_m3: f64,
    /// Rate, m³/s.
    pub rate_m3_s: f64,
    /// Dead-band, m³.
    pub dead_band_m3: f64,
    /// Hydraulic work out over electric work in, 0..1 (guess).
    pub efficiency: f64,
    /// Power of motor and valves while it runs, besides the hydraulic work, W (guess).
    pub running_w: f64,
    /// Gauge pressure at which it can no longer push out, Pa.
    pub stall_pa: f64,
}

impl Pump {
    /// 100 m pump: ±230 cc at 35 cc/s (public Slocum figures 32–40).
    #[must_use]
    pub const fn shallow_100() -> Self {
        Self { volume_m3: 230e-6, rate_m3_s: 35e-6, dead_band_m3: 5e-6, efficiency: 0.5, running_w: 12.0, stall_pa: 2.2e6 }
    }

    /// 200 m pump: ±236 cc at 13 cc/s.
    #[must_use]
    pub const fn shallow_200() -> Self {
        Self { volume_m3: 236e-6, rate_m3_s: 13e-6, dead_band_m3: 5e-6, efficiency: 0.5, running_w: 10.0, stall_pa: 3.5e6 }
    }

    /// Deep oil pump: ±263 cc at 4 cc/s.
    #[must_use]
    pub const fn deep() -> Self {
        Self { volume_m3: 263e-6, rate_m3_s: 4e-6, dead_band_m3: 8e-6, efficiency: 0.5, running_w: 8.0, stall_pa: 1.5e7 }
    }
}

impl Default for Pump {
    fn default() -> Self {
        Self::shallow_100()
    }
}

/// All actuators.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Actuators {
    /// Buoyancy pump.
    pub pump: Pump,
    /// Battery travel either side, m. 100 m Slocum ±1.0 in.
    pub battery_travel_m: f64,
    /// Battery rate, m/s. 0.1 in/s (0.04–0.15).
    pub battery_rate_m_s: f64,
    /// Battery dead-band, m. 0.01 in.
    pub battery_dead_band_m: f64,
    /// Power of the battery motor while it runs, W (guess).
    pub battery_motor_w: f64,
    /// Fin limit, rad.
    pub fin_limit_rad: f64,
    /// Fin rate, rad/s (guess; the public simulator's 0.02 is its autopilot).
    pub fin_rate_rad_s: f64,
    /// Fin dead-band, rad (guess).
    pub fin_dead_band_rad: f64,
    /// Power of the fin motor while it runs, W (guess).
    pub fin_motor_w: f64,
}

impl Default for Actuators {
    fn default() -> Self {
        Self {
            pump: Pump::default(),
            battery_travel_m: 0.0254,
            battery_rate_m_s: 0.1 * 0.0254,
            battery_dead_band_m: 0.01 * 0.0254,
            battery_motor_w: 2.0,
            fin_limit_rad: 0.45,
            fin_rate_rad_s: 0.10,
            fin_dead_band_rad: 0.005,
            fin_motor_w: 0.5,
        }
    }
}

/// What the pins of a board's motor drivers do: no targets, only motors that run, and a servo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Pump runs out (`true`, more displaced water) or in.
    pub pump: Option<bool>,
    /// Battery runs forward (`true`) or aft.
    pub battery: Option<bool>,
    /// Angle that the fin's servo is told, rad.
    pub fin_rad: f64,
    /// Both switches of the burn wire are closed.
    pub fire: bool,
}

/// One actuator on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Servo {
    pub(crate) position: f64,
    pub(crate) target: f64,
    pub(crate) limit: f64,
    pub(crate) rate: f64,
    dead_band: f64,
    /// Rate at which it drifts while it is not driven (a leaking valve).
    pub(crate) creep: f64,
    moving: bool,
}

impl Servo {
    pub(crate) fn new(position: f64, limit: f64, rate: f64, dead_band: f64) -> Self {
        Self { position, target: position, limit, rate, dead_band, creep: 0.0, moving: false }
    }

    /// Takes a command; what is not finite is ignored.
    pub(crate) fn command(&mut self, target: f64) {
        if target.is_finite() {
            self.target = target.clamp(-self.limit, self.limit);
        }
        self.moving |= (self.target - self.position).abs() > self.dead_band;
    }

    /// Runs towards one end (`Some(true)`: the positive one) or rests: a motor at its bridge, which knows no target.
    pub(crate) fn run(&mut self, towards: Option<bool>) {
        let Some(positive) = towards else { return self.halt() };
        self.target = if positive { self.limit } else { -self.limit };
        self.moving = self.position != self.target;
    }

    /// Stops where it is.
    pub(crate) fn halt(&mut self) {
        self.moving = false;
        self.target = self.position;
    }

    /// Velocity now, and time until it stops by itself.
    pub(crate) fn plan(&self) -> (f64, f64) {
        if !self.moving {
            let room = self.limit.copysign(self.creep) - self.position;
            return if self.creep * room > 0.0 { (self.creep, room / self.creep) } else { (0.0, f64::INFINITY) };
        }
        if !(self.rate > 0.0) {
            return (0.0, f64::INFINITY);
        }
        let way = self.target - self.position;
        (self.rate.copysign(way), way.abs() / self.rate)
    }

    /// Moves on by `h` at `velocity`; arrives when the plan said so.
    pub(crate) fn pass(&mut self, velocity: f64, h: f64) {
        if velocity == 0.0 {
            return;
        }
        self.position = (self.position + velocity * h).clamp(-self.limit, self.limit);
        if self.moving && (self.target - self.position) * velocity <= self.rate * 1e-9 * velocity.abs() {
            self.position = self.target;
            self.moving = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Servo;

    #[test]
    fn a_servo_starts_beyond_its_dead_band_and_stops_at_its_target() {
        let mut s = Servo::new(0.0, 1.0, 0.1, 0.05);
        s.command(0.04);
        assert_eq!(s.plan(), (0.0, f64::INFINITY));
        s.command(7.0);
        assert_eq!(s.target, 1.0);
        let (v, t) = s.plan();
        assert!((v - 0.1).abs() < 1e-15 && (t - 10.0).abs() < 1e-12);
        s.pass(v, 4.0);
        s.pass(v, 6.0);
        assert_eq!((s.position, s.plan().0), (1.0, 0.0));
        s.command(f64::NAN);
        assert_eq!(s.plan().0, 0.0);
    }

    #[test]
    fn a_motor_runs_to_its_end_and_rests_where_it_is_let_go() {
        let mut s = Servo::new(0.0, 1.0, 0.1, 0.05);
        s.run(Some(false));
        s.pass(s.plan().0, 3.0);
        assert!((s.position + 0.3).abs() < 1e-12);
        s.run(None);
        assert_eq!(s.plan().0, 0.0);
        s.run(Some(true));
        s.pass(s.plan().0, 60.0);
        assert_eq!(s.position, 1.0);
        s.run(Some(true));
        assert_eq!(s.plan().0, 0.0, "at its end");
    }
}
