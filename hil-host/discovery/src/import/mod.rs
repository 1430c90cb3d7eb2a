//! Logs of other people's gliders, brought into the one flight type.
//!
//! * [`npy`]: numpy arrays.
//! * [`comet`]: the public Comet 2016 flight as its Python package carries it.

pub mod comet;
pub mod npy;
