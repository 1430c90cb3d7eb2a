//! The eight segments as they really happened: dynamics, on-board pitch control, pump, battery, turns.
//!
//! State: depth, velocity along and across the body relative to the water,
//! pitch and pitch rate; fourth-order Runge–Kutta, fixed step ([`STEP_S`]).
//! The force from accelerating water (pressure gradient) and the inertia of the
//! moving frame cancel for a neutrally buoyant body, so water motion enters
//! through kinematics only. Controls are held over a step.

use super::nature::{ALPHA_END_RAD, Nature, Stall};
use super::ocean::Ocean;
use super::vehicle::Nominal;

/// Integration step, s: a quarter of the fastest time constant that moves depth (heave, about 2 s); halving it
/// changes depth by less than 1 mm (tested).
pub const STEP_S: f64 = 0.5;
/// One instant of what really happened, on the step grid.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Time since the start of the segment, s.
    pub t: f64,
    /// Depth, m.
    pub depth: f64,
    /// Depth the vehicle would have without the background motion, from the same relative velocity, m.
    pub known_depth: f64,
    /// The part of it that water motion of a missing effect gives, m.
    pub stirred_depth: f64,
    /// Velocity along and across (up) the body relative to the water, m/s.
    pub velocity: [f64; 2],
    /// True pitch, rad.
    pub pitch: f64,
    /// True roll, rad.
    pub roll: f64,
    /// True heading, rad, not wrapped.
    pub heading: f64,
    /// Ballast reading, m³.
    pub ballast: f64,
    /// Battery position reading, m.
    pub battery: f64,
    /// Gauge pressure, Pa.
    pub pressure: f64,
    /// Water temperature at the vehicle, °C.
    pub temperature: f64,
    /// Temperature of the conductivity cell's water as density sees it, °C.
    pub cell_temperature: f64,
    /// True density at the vehicle, kg/m³.
    pub density: f64,
    /// East and north, m.
    pub position: [f64; 2],
    /// Floating at the surface.
    pub floating: bool,
}

/// Sizes of the angle of attack at the instants under water, rad.
fn angles_under_water(moments: &[Moment]) -> impl Iterator<Item = f64> + '_ {
    let under = moments.iter().filter(|m| !m.floating && m.depth > 2.0);
    under.map(|m| libm::atan2(-m.velocity[1], m.velocity[0]).abs())
}

/// Share of the time under water that was flown beyond the angle of attack where the given law ends.
#[must_use]
pub fn stalled_share(moments: &[Moment]) -> f64 {
    let (mut stalled, mut under) = (0_u32, 0_u32);
    for size in angles_under_water(moments) {
        under += 1;
        stalled += u32::from(size > ALPHA_END_RAD);
    }
    f64::from(stalled) / f64::from(under.max(1))
}

/// Shares of the time under water that were flown where flow may be attached or separated: those of either.
#[must_use]
pub fn branches(moments: &[Moment], stall: &Stall) -> [f64; 2] {
    let (mut flown, mut under, mut separated) = ([0_u32; 2], 0_u32, false);
    for size in angles_under_water(moments) {
        separated = stall.separates(size, separated);
        under += 1;
        if (stall.angle - stall.hysteresis..stall.angle).contains(&size) {
            flown[usize::from(separated)] += 1;
        }
    }
    flown.map(|n| f64::from(n) / f64::from(under.max(1)))
}

/// The segment that is being flown.
pub struct Voyage<'a> {
    /// File numbers (the autopilot and the pump know only these).
    pub nominal: &'a Nominal,
    /// The real vehicle.
    pub nature: &'a Nature,
    /// The real water.
    pub ocean: &'a Ocean,
    /// Constant list, rad.
    pub list: f64,
}

impl Voyage<'_> {
    /// The pitch sensor without its noise.
    #[must_use]
    pub fn measured_pitch(&self, pitch: f64, heading: f64, pressure: f64) -> f64 {
        let off = &self.nature.off;
        pitch * (1.0 + self.nature.pitch_scale)
            + self.nature.pitch_zero
            + off.pitch_by_heading * libm::sin(heading)
            + off.pitch_by_depth * libm::tanh(pressure * 1e-6 * 0.5) * 2.0
    }
}
