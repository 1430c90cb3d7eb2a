//! The laptop side: HIL seats, commands, reports.

pub mod campaign;
pub mod cli;
pub mod flight;
pub mod pages;
pub mod paper;
pub mod score;
pub mod seats;
pub mod serve;
pub mod whole_file;

// Where modules stood before they had folders.
pub use cli as commands;
pub use flight::board_log as boardlog;
pub use flight::closed_loop;
pub use flight::config_file;
pub use flight::fetch;
pub use flight::mission_file;
pub use flight::onboard_log;
pub use flight::tables;
pub use flight::vehicles;
pub use flight::worlds;
pub use pages as page;
pub use pages::control_scorecard as scorecard_page;
pub use pages::diagnosis_scorecard as discovery_page;
pub use pages::flight_report;
pub use pages::plots;
pub use score::control_law as scorecard;
pub use score::diagnosis as trial_score;
pub use score::story;
pub use score::whole_loop as circle;
/// The log of a flight and what writes it.
pub mod flightlog {
    pub use crate::flight::log::*;
    pub use crate::flight::recorder;
}
