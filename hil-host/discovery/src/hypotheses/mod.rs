//! Which effects are tried, alone and together, and from where.

pub(crate) mod aliases;
pub mod bank;
pub mod candidate;
pub(crate) mod discrepancy;
pub mod identifiability;
pub(crate) mod late_stall;
pub(crate) mod multistart;
pub mod search;
pub mod sensitivity;
