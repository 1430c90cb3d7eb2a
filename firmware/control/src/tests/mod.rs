//! Flights of a toy vehicle under the law, and what the law keeps whatever it is shown.

mod bridging;
mod flooding;
mod laws;
mod toy;
mod wrong_sensors;
