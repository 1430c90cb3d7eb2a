//! The laptop side: HIL seats, commands, reports.

pub mod cli;
pub mod fleet;
pub mod next_mission;
pub mod pages;
pub mod paper;
pub mod score;
pub mod serve;
pub mod terminal;
