//! What a controller is told when it starts, and whose sensors it flies on.

use crate::mark::Mark;

/// Where sensor frames come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seat {
    /// On deck: the next mission decides, by [`signals::ToBoard::Begin`] or [`signals::ToBoard::Launch`].
    Open,
    /// From the host over the line (hardware in the loop).
    #[default]
    Host,
    /// From the vehicle's own sensors; frames from the line are refused.
    Sensors,
    /// From the glider whose backseat the board is; frames from our line are refused.
    Backseat,
}

/// What the board knows when it starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Boot {
    /// What the last run left; anything but [`Mark::NONE`] is SAFE from the first step.
    pub mark: Mark,
    /// Boots since first flash; 0 when not counted.
    pub boots: u32,
    /// Firmware version major, minor, patch.
    pub firmware: [u8; 3],
    /// A number that the last runs had not: sessions begin from it.
    pub salt: u32,
}

impl Boot {
    /// A first boot: nothing known.
    pub const NEW: Self = Self { mark: Mark::NONE, boots: 0, firmware: [0; 3], salt: 0 };
}
