//! Flights of a toy vehicle under the law, and what the law keeps whatever it is shown.

mod bridging;
mod flooding;
mod goals;
mod laws;
mod parts;
mod slow_orders;
mod toy;
mod wrong_sensors;
