//! The laptop side: HIL seats, commands, reports.

pub mod boardlog;
pub mod campaign;
pub mod circle;
pub mod closed_loop;
pub mod commands;
pub mod config_file;
pub mod discovery_page;
pub mod fetch;
pub mod flight_report;
pub mod flightlog;
pub mod main_job;
pub mod mission_file;
pub mod onboard_log;
pub mod page;
pub mod paper;
pub mod plots;
pub mod scorecard;
pub mod scorecard_page;
pub mod seats;
pub mod serve;
pub mod story;
pub mod tables;
pub mod trial_score;
pub mod vehicles;
pub mod worlds;
