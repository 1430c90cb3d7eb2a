//! A glider for tests of the session: what it is told it does.

use signals::{ActuatorCommand, Micros, Reading, SensorFrame, Surface, Switch};

/// Slew-limited actuators, pitch by the trim law, depth rate by the ballast alone.
pub struct Toy {
    /// Depth, m.
    pub depth_m: f32,
    pitch_rad: f32,
    ballast_m3: f32,
    battery_m: f32,
    rate_per_m3: f32,
}

impl Toy {
    /// Afloat; rises with `rate_per_m3` m/s for a cubic metre of ballast.
    pub fn new(rate_per_m3: f32) -> Self {
        Self { depth_m: 0.1, pitch_rad: 0.0, ballast_m3: 230e-6, battery_m: 0.0, rate_per_m3 }
    }

    /// What its sensors say.
    pub fn frame(&self, seq: u32, time: Micros) -> SensorFrame {
        let afloat = self.depth_m < 0.5;
        SensorFrame {
            seq,
            time,
            depth_m: Reading::now(self.depth_m),
            pitch_rad: Reading::now(self.pitch_rad),
            roll_rad: Reading::now(0.01),
            heading_rad: Reading::now(0.02),
            ballast_m3: Reading::now(self.ballast_m3),
            battery_mass_m: Reading::now(self.battery_m),
            fin_rad: Reading::now(0.0),
            density_kg_m3: Reading::now(1025.0),
            temperature_degc: Reading::now(12.0),
            battery_v: Reading::now(14.5),
            charge: Reading::now(0.9),
            vacuum_pa: Reading::now(70_000.0),
            leak: Switch::Clear,
            surface: Surface { gps_fix: afloat, comms: afloat },
            ..SensorFrame::default()
        }
    }

    /// Moves on by a cycle of 4 s.
    pub fn obey(&mut self, command: &ActuatorCommand) {
        let go = |at: f32, to: f32, most: f32| at + (to - at).clamp(-most, most);
        self.ballast_m3 = go(self.ballast_m3, command.ballast_m3, 52e-6);
        self.battery_m = go(self.battery_m, command.battery_mass_m, 10e-3);
        self.pitch_rad = 1785.0 * self.ballast_m3 - 24.0 * self.battery_m;
        self.depth_m = (self.depth_m - 4.0 * self.rate_per_m3 * self.ballast_m3).max(0.1);
    }
}
