mod dives;
mod factors;
mod packets;
