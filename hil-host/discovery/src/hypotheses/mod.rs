//! Which effects are tried, alone and together, and from where.

pub(crate) mod aliases;
pub mod bank;
pub mod candidate;
pub mod hull_lag;
pub mod identifiability;
pub(crate) mod late_stall;
pub(crate) mod multistart;
pub mod search;
pub mod sensitivity;
