//! One simulated flight: the world, the mission, the closed loop, its log and its tables.

pub mod autopsy;
pub mod board_log;
pub mod closed_loop;
pub mod config_file;
pub mod cycle;
pub mod fetch;
pub mod file_kinds;
pub mod image_file;
pub mod image_lines;
pub mod log;
pub mod mission_file;
pub mod onboard_log;
pub mod outcome;
pub mod own_parts;
pub mod power;
pub mod preflight;
pub mod recorder;
pub mod surfacing;
pub mod tables;
pub mod toml_place;
pub mod under_way;
pub mod utc;
pub mod vehicles;
pub mod worlds;
