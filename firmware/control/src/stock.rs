//! The ordinary controller, for comparison.
//!
//! What public descriptions of Slocum missions and the source paper say:
//! * fixed pitch command, 26° (0.4538 rad), dive and climb alike;
//! * pitch by the battery mass: once per cycle (4 s), if the error is outside
//!   a dead-band, the mass is moved by a share of what the trim law says; no
//!   account of the pump's motion, no learning; a new turn starts from a fixed
//!   guess for dive and climb ("the control system … progressively adjusts");
//! * the pump is started *at* the turn depth;
//! * the same pump volume, depth band and number of dives as ours.
//!
//! Not modelled: the vendor's code itself, its autoballast, its abort logic
//! (only over-depth, leak and a lost depth bring it home here).
//!
//! The numbers are the public defaults where there are some, else guesses,
//! each said so below.

use crate::angle::tan;
use crate::bound::Bound;
use crate::clock::Clock;
use crate::config::Config;
use crate::heading;
use crate::senses::Senses;
use signals::{Abort, ActuatorCommand, Answer, Micros, Mission, Phase, SensorFrame, Switch, Trace};

/// Pitch command, rad: 26°, stock mission file.
pub const PITCH_RAD: f32 = 0.4538;
/// Pitch dead-band, rad (3°, guess).
const PITCH_DEADBAND_RAD: f32 = 0.052;
/// Share of the trim law's correction applied per cycle (guess: proportional servo that does not overshoot).
const SHARE: f32 = 0.3;
/// Battery position a dive or climb starts from, m: ∓0.5 in (guess), forward in the dive.
const START_M: f32 = 0.0127;

/// Memory of the ordinary controller.
#[derive(Clone, Debug)]
pub struct State {
    clock: Clock,
    senses: Senses,
    mission: Mission,
    phase: Phase,
    leg: u8,
    leg_dives: u16,
    dives: u16,
    battery_m: f32,
    since: Micros,
    abort: Option<Abort>,
    lost_s: f32,
}

impl State {
    /// Ready to fly `mission`, on the surface.
    #[must_use]
    pub fn new(config: &Config, mission: Mission, now: Micros) -> Self {
        let flyable = mission.validate(config.working_depth_m, config.pump_m3).is_ok();
        let mut clock = Clock::default();
        clock.advance(now);
        Self {
            clock,
            senses: Senses::default(),
            mission,
            phase: if flyable { Phase::Surface } else { Phase::Safe },
            leg: 0,
            leg_dives: 0,
            dives: 0,
            battery_m: START_M,
            since: Micros(0),
            abort: (!flyable).then_some(Abort::BadMission),
            lost_s: 0.0,
        }
    }
}

/// One control cycle.
#[must_use]
pub fn step(config: &Config, state: &mut State, now: Micros, frame: &SensorFrame) -> Answer {
    let dt_s = state.clock.advance(now);
    let seen = state.senses.observe(config, dt_s, frame, 0.0);
    let clock = state.clock.run;
    let leg = state.mission.legs.get(usize::from(state.leg)).or(state.mission.legs.last()).copied().unwrap_or_default();

    state.lost_s = seen.depth_age_s;
    let too_deep = seen.depth_m > config.working_depth_m + 10.0;
    let cause = [(too_deep, Abort::OverDepth), (frame.leak == Switch::Alarm, Abort::Leak), (state.lost_s > 20.0, Abort::SensorDepth)];
    if let Some(&(_, cause)) = cause.iter().find(|c| c.0) {
        state.abort = state.abort.or(Some(cause));
        state.phase = Phase::Safe;
    }
    let last = u32::from(state.dives) + 1 >= state.mission.dives();
    let every = state.mission.surface_every;
    let surfacing = last || (every > 0 && (state.dives + 1).is_multiple_of(every));
    let next = match state.phase {
        Phase::Surface if clock.since(state.since).seconds() >= 8.0 && seen.depth_age_s <= 0.0 => Phase::Dive,
        Phase::Dive if seen.depth_m >= leg.depth_max_m => Phase::Climb,
        Phase::Climb if !surfacing && seen.depth_m <= leg.depth_min_m => Phase::Dive,
        Phase::Climb if surfacing && (seen.depth_m < 1.0 || seen.afloat) && last => Phase::Done,
        Phase::Climb if surfacing && (seen.depth_m < 1.0 || seen.afloat) => Phase::Comms,
        Phase::Comms if clock.since(state.since).seconds() >= 60.0 => Phase::Dive,
        same => same,
    };
    if next != state.phase {
        if state.phase == Phase::Climb {
            state.dives = state.dives.saturating_add(1);
            state.leg_dives = state.leg_dives.saturating_add(1);
            if state.leg_dives >= leg.dives {
                state.leg_dives = 0;
                state.leg = state.leg.saturating_add(1);
            }
        }
        state.since = clock;
        state.phase = next;
        state.battery_m = if next == Phase::Climb { -START_M } else { START_M }.at_least(-config.battery_m).at_most(config.battery_m);
    }
    let wanted = match state.phase {
        Phase::Dive => -PITCH_RAD,
        Phase::Climb | Phase::Safe => PITCH_RAD,
        _ => 0.0,
    };
    if let (Phase::Dive | Phase::Climb, Some(pitch), true) = (state.phase, seen.pitch_rad, dt_s > 0.0)
        && (pitch - wanted).abs() > PITCH_DEADBAND_RAD
    {
        let correction = SHARE * (tan(wanted) - tan(pitch)) / config.trim.per_battery_m;
        state.battery_m = (state.battery_m + correction).at_least(-config.battery_m).at_most(config.battery_m);
    }
    let drive = leg.ballast_m3.at_least(0.0).at_most(config.pump_m3);
    let (ballast_m3, battery_mass_m) = match state.phase {
        Phase::Dive => (-drive, state.battery_m),
        Phase::Climb => (drive, state.battery_m),
        Phase::Safe => (config.pump_m3, 0.0),
        _ => (config.pump_m3, config.battery_m),
    };
    let gliding = matches!(state.phase, Phase::Dive | Phase::Climb);
    Answer {
        command: ActuatorCommand {
            seq: frame.seq,
            ballast_m3,
            battery_mass_m,
            fin_rad: if gliding { heading::fin_rad(config, leg.heading_rad, seen.heading_rad) } else { 0.0 },
            drop_weight: false,
            beacon: matches!(state.phase, Phase::Safe | Phase::Done),
        },
        trace: Trace {
            phase: state.phase,
            abort: state.abort,
            dives: state.dives,
            pitch_setpoint_rad: wanted,
            depth_m: seen.depth_m,
            ..Trace::default()
        },
    }
}
