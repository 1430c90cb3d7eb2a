//! The HIL rig: a simulated glider and ocean on one side of a serial line, the flight controller on the other.
//!
//! Folders in the order in which they may use each other: [`whole_file`], [`spelling`], [`shards`] (work dealt to machines, kept,
//! merged), [`seats`] (which controller answers), [`flight`] (one simulated flight: world, mission, closed loop, log, tables),
//! [`campaign`] (every fault in every phase).

pub mod campaign;
pub mod flight;
pub mod seats;
pub mod shards;
pub mod spelling;
pub mod whole_file;
