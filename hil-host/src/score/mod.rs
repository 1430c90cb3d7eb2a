//! How good it is in numbers: control law, diagnosis on simulated and on real flights, missions, the whole loop.

pub mod both_tables;
pub mod cases;
pub mod contradictions;
pub mod control_law;
pub mod diagnosis;
pub mod margins;
pub mod real;
pub mod story;
pub mod timeline;
pub mod whole_loop;
