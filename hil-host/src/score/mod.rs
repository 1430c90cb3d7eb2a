//! How good it is in numbers: control law, diagnosis, the whole loop.

pub mod control_law;
pub mod diagnosis;
pub mod story;
pub mod whole_loop;
