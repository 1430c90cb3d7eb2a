//! One control cycle: what is measured, what is commanded, and why.

use crate::time::Micros;
use serde::{Deserialize, Serialize};

/// A measured value with its age, or the fact that there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Reading {
    /// Sampled `age_ms` milliseconds before the frame's time.
    Sampled {
        /// The value, in the unit of its field.
        value: f32,
        /// Time since it was sampled, ms.
        age_ms: u32,
    },
    /// The sensor gives nothing.
    #[default]
    Missing,
}

impl Reading {
    /// A value sampled at the frame's own time.
    #[must_use]
    pub const fn now(value: f32) -> Self {
        Self::Sampled { value, age_ms: 0 }
    }

    /// The value if it is inside `range` (of finite ends), and not older than
    /// `max_age_ms`. This is the door at which NaN, infinities and sentinels
    /// (9999) are refused: no comparison holds for NaN, infinities lie outside.
    #[must_use]
    #[inline(always)]
    pub fn accept(self, range: core::ops::RangeInclusive<f32>, max_age_ms: u32) -> Option<f32> {
        match self {
            Self::Sampled { value, age_ms } if range.contains(&value) && age_ms <= max_age_ms => Some(value),
            _ => None,
        }
    }
}

/// A two-state detector that may also be silent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Switch {
    /// No alarm.
    Clear,
    /// Alarm.
    Alarm,
    /// The detector does not answer.
    #[default]
    Unknown,
}

/// The emergency drop weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Weight {
    /// Still attached.
    Held,
    /// Gone.
    Released,
    /// Not monitored.
    #[default]
    Unknown,
}

/// What the antenna says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surface {
    /// A GPS fix was obtained in this cycle.
    pub gps_fix: bool,
    /// The shore was heard in this cycle.
    pub comms: bool,
}

/// What is measured in one control cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorFrame {
    /// Frame counter of the sender; the answer repeats it.
    pub seq: u32,
    /// Monotonic time of the frame.
    pub time: Micros,
    /// Depth by the vehicle's pressure transducer, m, positive down, from 1e4 Pa/dbar and a nominal density.
    pub depth_m: Reading,
    /// Depth by the second (science) pressure sensor, m, positive down.
    pub depth2_m: Reading,
    /// Pitch, rad, nose up positive.
    pub pitch_rad: Reading,
    /// Roll, rad, starboard down positive.
    pub roll_rad: Reading,
    /// Heading, rad, clockwise from true north, 0..2π.
    pub heading_rad: Reading,
    /// Ballast volume fed back by the pump, m³ from mid position, positive buoyant.
    pub ballast_m3: Reading,
    /// Battery mass position fed back, m, positive forward.
    pub battery_mass_m: Reading,
    /// Fin angle fed back, rad.
    pub fin_rad: Reading,
    /// In-situ water density from the CTD, kg/m³.
    pub density_kg_m3: Reading,
    /// Temperature of the water from the CTD, °C: for the report of the glides, the law does not use it.
    pub temperature_degc: Reading,
    /// Height above the bottom by the altimeter, m.
    pub altitude_m: Reading,
    /// Battery voltage, V.
    pub battery_v: Reading,
    /// Battery charge left, 0..1.
    pub charge: Reading,
    /// Internal pressure, Pa absolute.
    pub vacuum_pa: Reading,
    /// Leak detector.
    pub leak: Switch,
    /// Drop weight monitor.
    pub weight: Weight,
    /// Antenna.
    pub surface: Surface,
}

/// What the actuators shall do until the next command. Fields are always
/// finite and inside the ranges of the controller's configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ActuatorCommand {
    /// `seq` of the frame that is answered.
    pub seq: u32,
    /// Ballast volume wanted, m³ from mid position, positive buoyant.
    pub ballast_m3: f32,
    /// Battery mass position wanted, m, positive forward.
    pub battery_mass_m: f32,
    /// Fin angle wanted, rad.
    pub fin_rad: f32,
    /// Fire the release of the drop weight.
    pub drop_weight: bool,
    /// Locator beacon on.
    pub beacon: bool,
}

/// Where in the dive cycle the vehicle is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Phase {
    /// On the surface, before the first or after the last dive.
    #[default]
    Surface,
    /// Gliding down.
    Dive,
    /// Turning from dive to climb.
    InflectLow,
    /// Gliding up.
    Climb,
    /// Turning from climb to dive.
    InflectHigh,
    /// On the surface, waiting for GPS and shore.
    Comms,
    /// Mission complete, floating.
    Done,
    /// Something failed: full buoyancy, never dives again.
    Safe,
}

/// First cause of an abort. Latched: later causes do not replace it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Abort {
    /// Deeper than the working depth allows.
    OverDepth,
    /// Leak detector.
    Leak,
    /// Hull vacuum lost.
    Vacuum,
    /// Battery voltage below the limit.
    Undervoltage,
    /// Charge below the last-gasp reserve.
    LowCharge,
    /// Mission longer than allowed.
    OverTime,
    /// No word from shore for too long.
    NoComms,
    /// Depth does not change though it must.
    StuckDepth,
    /// Commanded to rise, does not rise.
    Stalled,
    /// No believable depth.
    SensorDepth,
    /// No believable pitch for too long.
    SensorPitch,
    /// No believable heading.
    NoHeading,
    /// No believable pump position.
    BallastFeedback,
    /// Pump does not follow.
    PumpStuck,
    /// Battery mass does not follow.
    MassStuck,
    /// Fin does not follow, or the vehicle spirals.
    FinStuck,
    /// Started after a reset during a mission.
    Reset,
    /// The line to the host, or the sensors as a whole, went silent.
    LinkLost,
    /// Stored or uploaded mission or configuration is not usable.
    BadMission,
    /// Internal state was not finite or not consistent.
    Internal,
    /// Ordered by the operator.
    Operator,
    /// Control cycle overran repeatedly.
    Overrun,
    /// Vehicle degraded: drag, trim or wing loss.
    Degraded,
    /// Bottom nearer than the minimum altitude again and again.
    Bottom,
}

/// Degradations that do not end the mission by themselves; bits of [`Trace::flags`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Flags(pub u32);

impl Flags {
    /// Pitch is dead-reckoned or preset.
    pub const PITCH_PRESET: Self = Self(1);
    /// Heading control is off, fin centred.
    pub const NO_HEADING: Self = Self(1 << 1);
    /// Depth is projected, not measured.
    pub const DEPTH_PROJECTED: Self = Self(1 << 2);
    /// Density is the default, not measured.
    pub const DENSITY_DEFAULT: Self = Self(1 << 3);
    /// Pump runs open loop.
    pub const PUMP_OPEN_LOOP: Self = Self(1 << 4);
    /// Battery mass runs open loop or is stopped.
    pub const MASS_STOPPED: Self = Self(1 << 5);
    /// A field of the last frame was refused (not finite, out of range).
    pub const FIELD_REFUSED: Self = Self(1 << 6);
    /// Flight log lost entries.
    pub const LOG_FULL: Self = Self(1 << 7);
    /// Polar table refused: fixed preset pitch is flown.
    pub const TABLE_REFUSED: Self = Self(1 << 8);
    /// Vehicle flies worse than the table by more than the margin.
    pub const DEGRADED: Self = Self(1 << 9);
    /// Drop weight fired.
    pub const WEIGHT_FIRED: Self = Self(1 << 10);
    /// The mission was aborted, and goes on since.
    pub const RESUMED: Self = Self(1 << 11);
    /// The glides since the last report depart from the vehicle's history: in the report of a surfacing alone.
    pub const DEPARTS: Self = Self(1 << 12);

    /// Both sets of flags.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all bits of `other` are set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// Why the command is what it is: everything a log needs to explain it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// Phase after this step.
    pub phase: Phase,
    /// First cause of an abort, once there is one.
    pub abort: Option<Abort>,
    /// Degradations.
    pub flags: Flags,
    /// Dives completed.
    pub dives: u16,
    /// Pitch aimed at, rad.
    pub pitch_setpoint_rad: f32,
    /// Estimated angle of attack, rad.
    pub alpha_rad: f32,
    /// Estimated speed through the water, m/s.
    pub speed_m_s: f32,
    /// Estimated glide angle (path), rad, up positive.
    pub glide_angle_rad: f32,
    /// Depth believed by the law, m.
    pub depth_m: f32,
    /// Identity of the polar table in use (its CRC-32).
    pub table_id: u32,
}

/// Answer to one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// What to do.
    pub command: ActuatorCommand,
    /// Why.
    pub trace: Trace,
}

#[cfg(test)]
mod tests {
    use super::Reading;

    #[test]
    fn the_door_refuses_nan_infinity_sentinel_and_age() {
        let range = -5.0..=1200.0;
        assert_eq!(Reading::now(12.0).accept(range.clone(), 3000), Some(12.0));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 9999.0, -5.1] {
            assert_eq!(Reading::now(bad).accept(range.clone(), 3000), None, "{bad}");
        }
        assert_eq!(Reading::Sampled { value: 12.0, age_ms: 3001 }.accept(range.clone(), 3000), None);
        assert_eq!(Reading::Missing.accept(range, 3000), None);
    }
}
