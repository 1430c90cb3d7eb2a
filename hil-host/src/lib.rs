//! The laptop side: HIL seats, commands, reports.

pub mod commands;
pub mod page;
pub mod tables;
