//! A command as mission parameters.
//!
//! | parameter | argument of the mission | unit |
//! |---|---|---|
//! | a | `d_bpump_value`, absolute volume | cc, up positive |
//! | b | `d_pitch_value`, battery position | in, nose down positive |
//! | c | `heading_value`, fin | rad, to starboard positive |
//! | d | `d_target_depth` | m |
//! | e | `c_target_depth` | m |

use crate::Unfit;

use crate::readings::{CC_PER_M3, M_PER_INCH};
use crate::sensors::{LOGGED, PARAMETERS};
use crate::sentence::{Body, write_sensors};
use signals::{ActuatorCommand, Answer, Phase};

/// How far the vehicle's actuators go, either way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Pump, m³.
    pub ballast_m3: f32,
    /// Battery mass, m.
    pub battery_m: f32,
    /// Fin, rad.
    pub fin_rad: f32,
    /// Smallest step of the battery mass that the glider carries out, m: a law that trims in smaller ones waits for nothing.
    pub battery_step_m: f32,
}

/// Depths at which the glider turns by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Targets {
    /// From dive to climb, m: below every turn of ours.
    pub dive_m: f32,
    /// From climb to dive, m.
    pub climb_m: f32,
}

/// Mode bits that the mission's behaviours wait for.
pub mod bits {
    /// Surface and end the mission.
    pub const FINISH: u32 = 1;
    /// Surface as fast as it goes.
    pub const EMERGENCY: u32 = 2;
    /// Surface for fix and shore, then go on.
    pub const COMMS: u32 = 64;
    /// All of them.
    pub const ALL: u32 = FINISH | EMERGENCY | COMMS;
}

/// Mode bits of a phase.
#[must_use]
pub const fn mode_of(phase: Phase) -> u32 {
    match phase {
        Phase::Safe => bits::EMERGENCY,
        Phase::Done => bits::FINISH,
        Phase::Comms => bits::COMMS,
        Phase::Surface | Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh => 0,
    }
}

fn within(value: f32, limit: f32) -> f32 {
    if value > limit {
        limit
    } else if value < -limit {
        -limit
    } else {
        value
    }
}

/// The five parameters, in the glider's units, within the limits.
#[must_use]
pub fn parameters(command: &ActuatorCommand, targets: &Targets, limits: &Limits) -> [f32; 5] {
    [
        within(command.ballast_m3, limits.ballast_m3) * CC_PER_M3,
        within(command.battery_mass_m, limits.battery_m) / M_PER_INCH,
        within(command.fin_rad, limits.fin_rad),
        targets.dive_m,
        targets.climb_m,
    ]
}

/// The two sentences of five parameters.
///
/// # Errors
/// A parameter that must not be written.
pub fn sentences(values: &[f32; 5]) -> Result<[Body; 2], Unfit> {
    let [a, b, c, d, e] = values.map(f64::from);
    let [ia, ib, ic, id, ie] = PARAMETERS;
    Ok([write_sensors(&[(ia, a), (ib, b), (ic, c)])?, write_sensors(&[(id, d), (ie, e)])?])
}

/// Sequence, phase and cause of abort for the glider's log.
///
/// # Errors
/// No room.
pub fn logged(answer: &Answer) -> Result<Body, Unfit> {
    let [seq, phase, abort] = LOGGED;
    let cause = answer.trace.abort.map_or(-1.0, |abort| f64::from(abort as u8));
    write_sensors(&[(seq, f64::from(answer.command.seq % 1000)), (phase, f64::from(answer.trace.phase as u8)), (abort, cause)])
}
