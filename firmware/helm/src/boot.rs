//! What a controller is told when it starts.

use crate::mark::Mark;

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
