//! The summary of the glides as it is made on board (`firmware/evidence`): factors, rows, packet.

mod dives;
mod factors;
mod packets;
