//! How long the watches wait and what they leave alone: the figures of the law
//! itself, for whoever judges what it owes. Nothing here is used in flight.

pub use crate::safety::actuators::{
    FEEDBACK_LOST_S, FEEDBACK_MISSED_S, FIN, MASS_LOST_S, MASS_NEAR_M, MASS_WAIT_S, PUMP_AWAY_M3, PUMP_NEAR_M3, PUMP_WAIT_S, RETRIES,
};
pub use crate::safety::attitude::{HEADING_LOST_S, MUST_SHOW, OPPOSED, OPPOSED_S, PITCH_LOST_S, STILL_S};
pub use crate::safety::depth::{APART_S, BLIND_S, OVER_LEG_M, OVER_LEG_SHARE, OVER_WORKING_M, OVER_WORKING_SHARE, STUCK_S};
pub use crate::safety::release::{SINKS_M_S, SINKS_S, pump_stroke_s};
pub use crate::safety::resume::comes_back;
pub use crate::safety::supply::{CHARGE, DETECTOR_LOST_S, VACUUM_PA, VOLTS};
pub use crate::senses::{APART_M, APART_SHARE, LATE_MS, LEAP_S, NO_DEPTH_S, UNBACKED_S, ZERO_MAX_M};
pub use crate::voyage::{CLIMB_STALLED_S, NO_WAY_S, WAY_M, longest_turn_s};
