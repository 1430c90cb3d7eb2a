//! A fleet's archive of flights: what each dive says, and what all of them say together.
//!
//! [`archive`] finds flights in folders, [`copies`] which of them are one log, [`joined`] makes one
//! flight of the logs of a mission, [`map`] asks their dives and keeps what they say
//! ([`cache`]), [`part`] is the table of dives that a run or a shard of it leaves, and [`pooled`] is what a table says of the fleet. The
//! digest of a merged table depends on flights, vehicle files and program alone: rows are in the order of their names, whoever made them
//! and when.

pub mod archive;
pub mod cache;
pub mod copies;
pub mod joined;
pub mod map;
pub mod part;
pub mod pooled;
