//! The summary of the glides as it is made on board (`firmware/evidence`): factors, rows, packet, detector.

mod detector;
mod dives;
mod factors;
mod host_model;
mod packets;
