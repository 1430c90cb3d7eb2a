//! What a user asks of one flight: compare, add, plan the next; one file a command.

pub mod add;
pub mod compare;
pub mod next_flight;
