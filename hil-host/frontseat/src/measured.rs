//! What the flight computer itself looks at, in its units.

use signals::{Reading, SensorFrame, Switch};

/// What the flight computer itself looks at.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measured {
    /// Depth, m.
    pub depth_m: f64,
    /// Rate of rise, m/s.
    pub rising_m_s: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// Battery position, in.
    pub battery_in: f64,
    /// Voltage, V.
    pub volts: f64,
    /// Vacuum, inHg below one atmosphere.
    pub vacuum_inhg: f64,
    /// A leak detector alarms.
    pub leak: bool,
    /// Shore heard.
    pub comms: bool,
}

pub(crate) fn value(reading: Reading) -> Option<f64> {
    match reading {
        Reading::Sampled { value, .. } if value.is_finite() => Some(f64::from(value)),
        _ => None,
    }
}

impl Measured {
    /// From a frame; what is missing keeps its last value.
    #[must_use]
    pub fn next(self, f: &SensorFrame, dt_s: f64) -> Self {
        let depth_m = value(f.depth_m).unwrap_or(self.depth_m);
        Self {
            depth_m,
            rising_m_s: (self.depth_m - depth_m) / dt_s,
            pitch_rad: value(f.pitch_rad).unwrap_or(self.pitch_rad),
            heading_rad: value(f.heading_rad).unwrap_or(self.heading_rad),
            battery_in: value(f.battery_mass_m).map_or(self.battery_in, |m| m / 0.0254),
            volts: value(f.battery_v).unwrap_or(self.volts),
            vacuum_inhg: value(f.vacuum_pa).map_or(self.vacuum_inhg, inhg),
            leak: f.leak == Switch::Alarm,
            comms: f.surface.comms,
        }
    }
}

pub(crate) fn inhg(pa: f64) -> f64 {
    (101_325.0 - pa) / 3386.39
}
