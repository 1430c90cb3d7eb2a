//! The image that runs: which one, and where it stands.

use serde::{Deserialize, Serialize};

/// What a board says of its image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image {
    /// Identity: CRC-32 of its code, constants and initial values, as it reckons them over its own flash.
    pub id: u32,
    /// Where it stands.
    pub standing: Standing,
}

impl Image {
    /// It has yet to finish a control step: no mission on the vehicle's own sensors begins.
    #[must_use]
    pub const fn on_trial(&self) -> bool {
        matches!(self.standing, Standing::Trial { .. })
    }
}

/// Where an image stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Standing {
    /// Flashed by a probe, and none uploaded since.
    #[default]
    Flashed,
    /// Uploaded, and confirmed by a finished control step.
    Confirmed,
    /// Uploaded, and no control step finished yet.
    Trial {
        /// Boots that are left to it before the image before it is put back.
        boots_left: u8,
    },
    /// In place again: the one after it was given up, or taken back.
    RolledBack,
    /// Another one takes its place at the next restart.
    Leaving,
}

/// What becomes of an uploaded image whose version is lower than that of the one that runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Older {
    /// It is refused.
    #[default]
    Refused,
    /// It is taken.
    Taken,
}
