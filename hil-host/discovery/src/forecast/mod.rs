//! Where and when will the vehicle come up next?
//!
//! * [`passages`]: from the last fix before a dive to the first after it, with the way through the water.
//! * [`current`]: mean current, red noise, inertial oscillation and tide, and the flight model's error, by a bank of Kalman filters.
//! * [`region`]: the ellipse, its size and shape learnt from the mission's own misses; probabilities of circles and polygons.
//! * [`mission`]: a mission as it goes, every passage forecast before it is learnt from.
//! * [`summary`]: how good the forecasts of a mission were, by thirds of it.
//! * [`planned`]: the dive that follows from planned pitch, ballast and depths.
//!
//! Not covered: currents of an ocean model, drift with the wind at the surface, a current that differs over depth from one dive plan to
//! the next.

pub mod current;
pub mod mission;
pub mod passages;
pub mod planned;
pub mod region;
pub mod summary;
