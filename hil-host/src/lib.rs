//! The laptop side: HIL seats, commands, reports.

pub mod campaign;
pub mod cli;
pub mod fleet;
pub mod flight;
pub mod pages;
pub mod paper;
pub mod score;
pub mod seats;
pub mod serve;
pub mod shards;
pub mod terminal;
pub mod whole_file;
