//! Which effects are tried, alone and together, and from where.

pub mod candidate;
pub mod identifiability;
pub mod search;
pub mod sensitivity;
