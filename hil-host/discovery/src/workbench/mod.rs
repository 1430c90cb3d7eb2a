//! What a user asks of flights: compare, add, calibrate, plan the next; one file a command, and what commands share.

pub mod add;
pub mod calibrate;
pub mod compare;
pub mod dive_estimates;
pub mod meta_analysis;
pub mod mission_clock;
pub mod next_flight;
pub mod pooling;
pub mod refitted_file;
pub mod timeline;
