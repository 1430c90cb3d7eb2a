//! Do we agree with the sea, and what is missing: flights and vehicles are read, a model of the vehicle is run on the measured
//! inputs, its residual is whitened, and every named effect is asked whether it explains what remains.

pub mod add;
pub mod align;
pub mod bank;
pub mod brink;
pub mod calibration;
pub mod clocks;
mod column;
pub mod compare;
pub mod diagnose;
pub mod dives;
pub mod dynamics;
pub mod evidence;
pub mod export;
pub mod expression;
pub mod fit;
pub mod flight;
pub mod import;
pub mod inputs;
pub mod lanes;
mod late_stall;
pub mod left_out;
pub mod metric;
pub mod noise;
mod periodic;
pub mod plan;
pub mod prepare;
pub mod problem;
pub mod read;
pub mod remainder;
pub mod report;
pub mod screen;
pub mod search;
mod second_look;
pub mod signature;
pub mod spikes;
pub mod start;
pub mod steady;
pub mod strangers;
pub mod vehicle;
pub mod vehicle_file;
pub mod wave;
pub mod ways;
pub mod whereabouts;

pub use flight::Flight;
pub use vehicle::Vehicle;
