//! What to fly.

use crate::root::sqrt;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most legs of one mission.
pub const MAX_LEGS: usize = 8;

/// Which wings are mounted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Wings {
    /// Aspect ratio 5.536 (paper, sec. III).
    #[default]
    #[serde(alias = "standard")]
    Standard,
    /// "Rail" wings, aspect ratio 0.3155 (paper, sec. III).
    #[serde(alias = "low-ar")]
    LowAspectRatio,
}

/// What the pitch setpoint is chosen for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Goal {
    /// Fly at (L/D)max.
    #[default]
    BestGlide,
    /// Farthest per joule, counting a constant hotel load, W.
    BestRange {
        /// Hotel load, W.
        hotel_w: f32,
    },
    /// Fastest horizontal speed through the water.
    BestSpeed,
    /// Best glide over ground with a current along the track, m/s, tail positive.
    Current {
        /// Along-track water speed, m/s.
        along_track_m_s: f32,
    },
    /// A fixed pitch magnitude, rad: what stock missions do, and what experiments need.
    FixedPitch {
        /// |pitch|, rad.
        pitch_rad: f32,
    },
}

/// A run of equal dives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leg {
    /// Number of dives (one dive and one climb each).
    pub dives: u16,
    /// Shallow turn, m.
    pub depth_min_m: f32,
    /// Deep turn, m.
    pub depth_max_m: f32,
    /// What to choose pitch for.
    pub goal: Goal,
    /// Ballast drive, m³ either side of neutral.
    pub ballast_m3: f32,
    /// Heading to hold, rad.
    pub heading_rad: f32,
}

impl Default for Leg {
    /// The paper's trial: 3–27 m with a shallow pump's full drive.
    fn default() -> Self {
        Self { dives: 4, depth_min_m: 3.0, depth_max_m: 27.0, goal: Goal::BestGlide, ballast_m3: 230e-6, heading_rad: 0.0 }
    }
}

/// A whole mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// Wings mounted; the controller picks its table by this.
    pub wings: Wings,
    /// Legs in order.
    pub legs: Vec<Leg, MAX_LEGS>,
    /// Longest mission before the vehicle comes home, s.
    pub max_duration_s: u32,
    /// Surface between dives for GPS and shore after this many dives; 0: only at the end.
    pub surface_every: u16,
}

impl Default for Mission {
    fn default() -> Self {
        let mut legs = Vec::new();
        // Capacity is MAX_LEGS > 0, one push cannot fail.
        let _ = legs.push(Leg::default());
        Self { wings: Wings::Standard, legs, max_duration_s: 6 * 3600, surface_every: 0 }
    }
}

/// Why a mission is refused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum MissionError {
    /// No leg at all.
    Empty,
    /// Leg number (from 0) asks for no dive.
    NoDives(u8),
    /// Leg: depths are not finite, not ordered, or closer than 5 m.
    DepthBand(u8),
    /// Leg: deeper than the vehicle's working depth.
    TooDeep(u8),
    /// Leg: ballast drive outside the pump.
    Ballast(u8),
    /// Leg: pitch, heading, current or hotel load outside what can be flown.
    Goal(u8),
    /// Duration is zero or above 60 days.
    Duration,
    /// The slowest glide that the legs allow takes longer than the duration: at least this many seconds.
    TooShort(u32),
}

/// Sink rate of a slow glide over the square root of the ballast drive, m/s per √m³: 0.06 m/s with 230 cc. Measured in glides of
/// both wings at all pitches and goals, rough water included: 0.066 m/s and more (a flat fall at 6°).
const SLOW_GLIDE: f32 = 0.06 / 0.015_166;
/// Longest time of a dive that is no glide, s: two turns with a deep pump (131 s each) and the settling after them.
const TURNS_S: f32 = 400.0;
/// Longest wait for fix and shore, and the way there, s.
const SURFACING_S: f32 = 1200.0;
/// Time under water after which a surfacing may be due that nobody asked for, s: depth has to be held against the surface.
const UNASKED_S: f32 = 7200.0;

impl Mission {
    /// Least distance of a leg's two depths, m: less is no glide between two turns.
    pub const LEAST_BAND_M: f32 = 5.0;
    /// Least ballast drive over the pump's range: light water at the surface and a squeezed hull take up to a quarter of it.
    pub const LEAST_BALLAST_SHARE: f32 = 0.4;
    /// Pitches that can be asked for, rad.
    pub const PITCHES_RAD: core::ops::RangeInclusive<f32> = 0.1..=0.8;

    /// Deepest depth of its legs, m; 0 without one.
    #[must_use]
    pub fn deepest_m(&self) -> f32 {
        self.legs.iter().fold(0.0, |deepest, leg| leg.depth_max_m.max(deepest))
    }

    /// Time within which a healthy vehicle has flown the mission in any water it can glide in, s.
    #[must_use]
    pub fn least_duration_s(&self) -> f32 {
        let mut before_m = 0.0;
        let under_water_s = self.legs.iter().fold(0.0, |sum: f32, leg| {
            let rate_m_s = SLOW_GLIDE * sqrt(leg.ballast_m3);
            // Each dive may be one from and to the surface; a leg begins where the one before it ended.
            let dive_s = 2.0 * leg.depth_max_m / rate_m_s + TURNS_S;
            let way_there_s = (leg.depth_min_m - before_m).abs() / rate_m_s;
            before_m = leg.depth_min_m;
            sum + f32::from(leg.dives) * dive_s + way_there_s
        });
        let asked = match self.surface_every {
            0 => 1.0,
            every => self.dives() as f32 / f32::from(every) + 1.0,
        };
        under_water_s * (1.0 + SURFACING_S / UNASKED_S) + asked * SURFACING_S
    }

    /// Total number of dives.
    #[must_use]
    pub fn dives(&self) -> u32 {
        self.legs.iter().fold(0, |sum: u32, l| sum.saturating_add(u32::from(l.dives)))
    }

    /// Refuses what no vehicle should be told to fly.
    ///
    /// # Errors
    /// The first thing wrong, with the leg's number.
    pub fn validate(&self, working_depth_m: f32, pump_m3: f32) -> Result<(), MissionError> {
        if self.legs.is_empty() {
            return Err(MissionError::Empty);
        }
        if self.max_duration_s == 0 || self.max_duration_s > 60 * 86_400 {
            return Err(MissionError::Duration);
        }
        for (i, leg) in self.legs.iter().enumerate() {
            let i = i as u8;
            if leg.dives == 0 {
                return Err(MissionError::NoDives(i));
            }
            // Comparisons are written so that NaN fails them.
            if !(leg.depth_min_m >= 0.0 && leg.depth_max_m - leg.depth_min_m >= Self::LEAST_BAND_M) {
                return Err(MissionError::DepthBand(i));
            }
            if !(leg.depth_max_m <= working_depth_m) {
                return Err(MissionError::TooDeep(i));
            }
            if !(leg.ballast_m3 >= Self::LEAST_BALLAST_SHARE * pump_m3 && leg.ballast_m3 <= pump_m3) {
                return Err(MissionError::Ballast(i));
            }
            let goal_ok = match leg.goal {
                Goal::BestGlide | Goal::BestSpeed => true,
                Goal::BestRange { hotel_w } => (0.0..=100.0).contains(&hotel_w),
                Goal::Current { along_track_m_s } => (-1.0..=1.0).contains(&along_track_m_s),
                Goal::FixedPitch { pitch_rad } => Self::PITCHES_RAD.contains(&pitch_rad),
            };
            if !(goal_ok && (-7.0..=7.0).contains(&leg.heading_rad)) {
                return Err(MissionError::Goal(i));
            }
        }
        let least_s = self.least_duration_s();
        if !(self.max_duration_s as f32 >= least_s) {
            return Err(MissionError::TooShort(least_s as u32));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Goal, Leg, Mission, MissionError};

    fn with(leg: Leg) -> Result<(), MissionError> {
        let mut m = Mission::default();
        m.legs[0] = leg;
        m.validate(200.0, 250e-6)
    }

    #[test]
    fn the_default_is_flyable_and_each_absurd_value_is_refused() {
        let d = Leg::default();
        assert_eq!(with(d), Ok(()));
        assert_eq!(with(Leg { dives: 0, ..d }), Err(MissionError::NoDives(0)));
        assert_eq!(with(Leg { depth_max_m: 201.0, ..d }), Err(MissionError::TooDeep(0)));
        assert_eq!(with(Leg { depth_max_m: f32::NAN, ..d }), Err(MissionError::DepthBand(0)));
        assert_eq!(with(Leg { depth_min_m: f32::INFINITY, ..d }), Err(MissionError::DepthBand(0)));
        assert_eq!(with(Leg { ballast_m3: 1.0, ..d }), Err(MissionError::Ballast(0)));
        assert_eq!(with(Leg { goal: Goal::FixedPitch { pitch_rad: f32::NAN }, ..d }), Err(MissionError::Goal(0)));
        assert_eq!(with(Leg { ballast_m3: 1e-6, ..d }), Err(MissionError::Ballast(0)));
        assert_eq!(with(Leg { depth_min_m: -1.0, ..d }), Err(MissionError::DepthBand(0)));
        assert_eq!(with(Leg { depth_max_m: d.depth_min_m + 1.0, ..d }), Err(MissionError::DepthBand(0)));
        assert_eq!(with(Leg { heading_rad: 1e38, ..d }), Err(MissionError::Goal(0)));
        let empty = Mission { legs: Default::default(), ..Mission::default() };
        assert_eq!(empty.validate(200.0, 250e-6), Err(MissionError::Empty));
        for max_duration_s in [0, 60, 61 * 86_400] {
            let mission = Mission { max_duration_s, ..Mission::default() };
            assert!(mission.validate(200.0, 250e-6).is_err(), "{max_duration_s} s");
        }
    }
}
