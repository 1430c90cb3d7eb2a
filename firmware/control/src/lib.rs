//! What to command now: mission, glide and safety laws.
#![cfg_attr(not(test), no_std)]

use polar::Table;
use signals::{Answer, Micros, Mission, SensorFrame};

/// What does not change in flight: vehicle, actuators, limits, gains.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Deepest depth a mission may ask for, m.
    pub working_depth_m: f32,
    /// Pump range either side of neutral, m³.
    pub pump_m3: f32,
}

impl Default for Config {
    fn default() -> Self {
        Self { working_depth_m: 200.0, pump_m3: 236e-6 }
    }
}

/// Everything the law remembers.
#[derive(Clone, Debug, Default)]
pub struct State {
    seq: u32,
}

impl State {
    /// Ready to fly `mission`, on the surface.
    #[must_use]
    pub fn new(_config: &Config, _mission: Mission, _now: Micros) -> Self {
        Self::default()
    }

    /// Booted after a reset during a mission: SAFE from the first step, for good.
    #[must_use]
    pub fn after_reset(_config: &Config) -> Self {
        Self::default()
    }

    /// The operator orders the vehicle home.
    pub fn recall(&mut self) {}
}

/// One control cycle: decides, changes nothing but `state`.
#[must_use]
pub fn step(_config: &Config, _table: Option<&Table<'_>>, state: &mut State, _now: Micros, frame: &SensorFrame) -> Answer {
    state.seq = frame.seq;
    Answer::default()
}
