//! A vehicle judged by its own history: one summary a dive, one covariance a vehicle.

pub mod changes;
pub mod file;
pub mod flight;
pub mod glide;
pub mod judge;
pub mod kinds;
pub mod learn;
pub mod mission;
pub mod numbers;
pub mod posterior;
pub mod rows;
pub mod sent;
pub mod shown;
pub mod structure;
pub mod summary;
pub mod weigh;

#[cfg(test)]
mod tests;
