//! Tables built into the firmware. Generated; see the header of each file.
mod low_aspect_ratio;
mod standard;

pub use low_aspect_ratio::LOW_ASPECT_RATIO;
pub use standard::STANDARD;
