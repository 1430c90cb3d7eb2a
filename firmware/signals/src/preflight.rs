//! What a vehicle on deck says of itself before it is launched.

use crate::frame::{Reading, SensorFrame};
use serde::{Deserialize, Serialize};

/// What the strap on the board allows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Strap {
    /// There is no strap: a simulated board.
    #[default]
    None,
    /// Fitted: hardware in the loop, frames from a host.
    Bench,
    /// Taken out: deployment, own sensors.
    Deployment,
    /// The board's role is a Slocum's backseat: the glider's line alone begins a mission.
    Backseat,
}

/// A motor sent from one end of its check to the other and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Stroke {
    /// Not asked for since the board started.
    #[default]
    Never,
    /// Under way.
    UnderWay,
    /// Came to both ends.
    Done {
        /// Time of the way there, s.
        seconds: f32,
        /// Length of the way, m or m³.
        way: f32,
    },
    /// Did not come to an end in one and a half times the time it should take.
    Failed,
}

/// Result of a check on deck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Preflight {
    /// Checks made since the board started; 0: none yet.
    pub number: u32,
    /// What was measured, by the board's own clock.
    pub frame: SensorFrame,
    /// Absolute pressure at the transducer, Pa: that of the air, on deck or afloat.
    pub pressure_pa: Reading,
    /// Pump.
    pub pump: Stroke,
    /// Battery mass.
    pub mass: Stroke,
    /// What the strap allows.
    pub strap: Strap,
    /// Bytes of the log on flash; 0: no flash.
    pub log_bytes: u32,
    /// Sentences of the compass read whole, and refused.
    pub sentences: (u32, u32),
}
