//! The HIL rig: a simulated glider and ocean on one side of a serial line, the flight controller on the other.
//!
//! Folders in the order in which they may use each other: [`whole_file`], [`spelling`], [`shards`] (work dealt to machines, kept,
//! merged), [`seats`] (which controller answers), [`flight`] (one simulated flight: world, mission, closed loop, log, tables),
//! [`replay`] (a recorded flight stepped through a law again), [`campaign`] (every fault in every phase).
//!
//! # Dependencies
//!
//! * `serialport`: serial lines
//! * `embedded-io`, `embedded-storage`, `heapless`, `postcard`: what the flying crates are written against
//! * `object`, `addr2line`, `gimli`: the image: its sections, its lines of source
//! * `defmt-decoder`: the board's own log
//! * `rand_chacha`, `rand_distr`: noise that a seed repeats
//! * `nalgebra`: a posterior to draw worlds from
//! * `rayon`: missions side by side
//! * `serde`, `serde_json`, `toml`, `base64`: missions, settings, logs and shards on disk
//! * `sha2`: what a shard was made by
//! * `strsim`: what was probably meant
//! * `anyhow`: errors for a person

pub mod campaign;
pub mod flight;
pub mod replay;
pub mod seats;
pub mod shards;
pub mod spelling;
pub mod whole_file;
