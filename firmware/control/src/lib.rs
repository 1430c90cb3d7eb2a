//! What to command now: mission, glide and safety laws.
//!
//! [`step`] is one control cycle: it decides, changes nothing but its
//! [`State`], reads no clock, writes no pin. Flight maths is f32 and pure Rust,
//! so the same frames give the same bits on a laptop and on the board.
//!
//! | file | answers |
//! |---|---|
//! | [`config`] | vehicle, limits, gains, and their check |
//! | `clock` | how much time passed |
//! | `senses` | what to believe of a frame |
//! | `voyage` | where in the mission we are |
//! | `glide` | which pitch for which goal; α, speed and path from what is measured |
//! | `belief` | how the flight corrects the table |
//! | `trim` | battery position for a pitch |
//! | `turn` | when to start a turn |
//! | `heading` | fin |
//! | `safety` | when to come home, and how; independent of the mission |
//! | [`mutant`] | watches broken on purpose, in trials only |
//! | [`waits`] | how long the watches wait, for those who judge them |
//! | `backup` | the second, separately written way home |
//! | [`stock`] | the ordinary controller, for comparison |
//!
//! # Dependencies
//!
//! * `micromath`: sines and roots, the same bits on every computer
//! * `serde`: settings as they are stored and sent
#![cfg_attr(not(test), no_std)]

mod angle;
mod backup;
mod belief;
mod bound;
mod clock;
pub mod config;
mod glide;
mod heading;
pub mod mutant;
mod safety;
mod senses;
pub mod stock;
mod trim;
mod turn;
mod voyage;
pub mod waits;

pub use glide::dive_j;

pub use config::{Config, ConfigError, Hull, PitchSensor, Settings, TrimLaw};

use backup::{Backup, Limits};
use belief::News;
use bound::{Bound, all_finite};
use clock::Clock;
use glide::{Choice, Estimate};
use polar::Table;
use safety::{Safety, Verdict, Watch};
use senses::{Seen, Senses};
use signals::{Abort, ActuatorCommand, Answer, Flags, Goal, Leg, Micros, Mission, Phase, SensorFrame, Trace};
use trim::{Trim, Wish};
use voyage::{Stage, Voyage};

/// Share of the ballast drive at which the full pitch is wanted; below it the
/// pitch wanted shrinks with the ballast.
const FULL_PITCH_SHARE: f32 = 0.5;
/// Time a flat glide begins steeper for once the pump is through, s: from rest the flow has to come to the wings first, else the vehicle may go on falling flat.
const ENTRY_S: f32 = 20.0;
/// Shallower than this the vehicle still floats, m.
const ENTRY_M: f32 = 1.5;
/// Above the deep turn by less than this a lesson is flown, m: a steep glide before and after the turn, in the same water.
const LESSON_M: f32 = 13.0;
/// Time with the pump at rest after which a glide is steady, s: the flow settles in 20 s, the depth rate in 10 s.
const SETTLED_S: f32 = 40.0;
/// Share of the preset pitch above which a vehicle glides and does not fall flat: 13°, flatter than any best glide of these wings.
const GLIDES_SHARE: f32 = 0.5;
/// Pitch wanted on the way home, rad (69°): more than the battery's range gives, since the rate of a climb grows with its
/// pitch (as sin^1.5 at one drag coefficient) and distance counts no more.
const STEEPEST_RAD: f32 = 1.2;
/// Shallower than this nothing is left to climb, m: afloat, the tail is not held deeper under water than a glide holds it.
const FLOATS_M: f32 = 2.0;
/// The pitch wanted is held when it is met within this, rad (2°): then the glide tells of the polar.
const HELD_RAD: f32 = 0.035;

/// Everything the law remembers.
#[derive(Clone, Debug)]
pub struct State {
    clock: Clock,
    senses: Senses,
    voyage: Voyage,
    choice: Choice,
    trim: Trim,
    estimate: Estimate,
    safety: Safety,
    backup: Backup,
    ballast_m3: f32,
    /// Pump rate as seen, m³/s.
    pump_rate_m3_s: f32,
    steady_s: f32,
    /// Time of this glide with the pump at rest and under water, s.
    pumped_s: f32,
    pitch_wanted_rad: f32,
    last: ActuatorCommand,
}

impl Default for State {
    /// On the surface, with the default mission.
    fn default() -> Self {
        Self::fresh(Mission::default())
    }
}

impl State {
    #[inline(never)]
    fn fresh(mission: Mission) -> Self {
        Self {
            clock: Clock::default(),
            senses: Senses::default(),
            voyage: Voyage::new(mission),
            choice: Choice::default(),
            trim: Trim::default(),
            estimate: Estimate::default(),
            safety: Safety::default(),
            backup: Backup::default(),
            ballast_m3: 0.0,
            pump_rate_m3_s: 0.0,
            steady_s: 0.0,
            pumped_s: 0.0,
            pitch_wanted_rad: 0.0,
            last: ActuatorCommand::default(),
        }
    }

    /// Ready to fly `mission`, on the surface. A mission the vehicle must not
    /// be told to fly gives SAFE with [`Abort::BadMission`].
    #[must_use]
    pub fn new(config: &Config, mission: Mission, now: Micros) -> Self {
        let flyable = mission.validate(config.working_depth_m, config.pump_m3).is_ok();
        let mut state = Self::fresh(mission);
        state.clock.advance(now);
        if !flyable {
            state.abort(Abort::BadMission);
        }
        state
    }

    /// Booted after a reset during a mission: SAFE from the first step, for good. `first` is the cause latched before
    /// the reset, [`Abort::Reset`] where there was none.
    #[must_use]
    pub fn after_reset(first: Abort) -> Self {
        let mut state = Self::fresh(Mission::default());
        state.abort(first);
        state
    }

    /// What the flight says of the table: factors of the drag level, the drag due to lift and the lift.
    #[must_use]
    pub fn learned(&self) -> [f32; 3] {
        self.choice.belief.factors()
    }

    /// A mission that is aborted does not go on, whatever comes back: for who has another to decide that.
    pub fn stays_safe(&mut self) {
        self.safety.never_resume();
    }

    /// The operator orders the vehicle home.
    pub fn recall(&mut self) {
        self.abort(Abort::Operator);
    }

    /// The caller found a reason to come home (overrun, lost line). The first cause stays, and the mission does not go on.
    #[cold]
    #[inline(never)]
    pub fn abort(&mut self, cause: Abort) {
        self.safety.latch(cause);
        self.safety.never_resume();
        self.voyage.stage = Stage::Safe;
    }

    /// The drop weight was fired before a reset: it is fired on.
    pub fn fire_weight(&mut self) {
        self.safety.fire_weight();
    }

    /// First cause of the abort, once there is one.
    #[must_use]
    pub fn first_cause(&self) -> Option<Abort> {
        self.safety.aborted()
    }

    /// Numbers no flight can have written: put right where that is harmless, else come home.
    fn heal(&mut self) {
        if !self.voyage.sane() {
            self.abort(Abort::Internal);
        }
        let l = &self.last;
        let own = [self.ballast_m3, self.steady_s, self.pumped_s, self.pitch_wanted_rad];
        if !all_finite(own) || !all_finite([l.ballast_m3, l.battery_mass_m, l.fin_rad]) {
            self.put_right();
        }
    }

    #[cold]
    #[inline(never)]
    fn put_right(&mut self) {
        let l = &mut self.last;
        for number in [
            &mut self.ballast_m3,
            &mut self.steady_s,
            &mut self.pumped_s,
            &mut self.pitch_wanted_rad,
            &mut l.ballast_m3,
            &mut l.battery_mass_m,
            &mut l.fin_rad,
        ] {
            if !number.is_finite() {
                *number = 0.0;
            }
        }
    }
}

/// One control cycle: decides, changes nothing but `state`.
#[must_use]
#[inline(never)]
pub fn step(config: &Config, table: Option<&Table<'_>>, state: &mut State, now: Micros, frame: &SensorFrame) -> Answer {
    let table = table.filter(|t| t.wings() == state.voyage.mission.wings);
    let limits = backup_limits(config, &state.voyage.mission);
    let second_way = state.backup.check(&limits, now, frame);
    state.heal();
    let dt_s = state.clock.advance(now);
    let seen = state.senses.observe(config, dt_s, frame, safety::release::steady_m_s(config, state.ballast_m3));
    follow_pump(config, state, seen.ballast_m3, dt_s);

    let mut leg = state.voyage.leg();
    let number = state.voyage.leg_number();
    let verdict = judge(config, table, state, &seen, &leg, frame);
    fly(config, state, &seen, &leg, &verdict);
    let phase = state.voyage.phase();
    if state.voyage.leg_number() != number {
        leg = state.voyage.leg();
    }
    let table_id = table.map_or(0, Table::id);
    state.choice.follow(config, table, table_id, state.voyage.leg_number(), &leg);
    let mut command = command(config, table, state, &seen, &verdict, &leg, frame.seq);
    let mut abort = verdict.abort;
    if let Some((cause, burn)) = second_way {
        state.safety.never_resume();
        if abort.is_none() {
            state.abort(cause);
            abort = Some(cause);
        }
        // A first way home that is under way keeps the attitude.
        let drop_weight = burn || verdict.drop_weight;
        let under_way = verdict.abort.is_some() && command.ballast_m3 >= limits.pump_m3 && command.beacon;
        command = if under_way { ActuatorCommand { drop_weight, ..command } } else { Backup::command(&limits, frame.seq, drop_weight) };
    }
    state.last = command;
    let mut flags = verdict.flags;
    for (set, flag) in [
        (seen.density_default, Flags::DENSITY_DEFAULT),
        (seen.refused, Flags::FIELD_REFUSED),
        (state.choice.is_preset(), Flags::TABLE_REFUSED),
        (state.choice.is_degraded(), Flags::DEGRADED),
    ] {
        if set {
            flags = flags.with(flag);
        }
    }
    Answer {
        command,
        trace: Trace {
            phase: if abort.is_some() { Phase::Safe } else { phase },
            abort,
            flags,
            dives: state.voyage.dives,
            pitch_setpoint_rad: state.pitch_wanted_rad,
            alpha_rad: state.estimate.alpha_rad,
            speed_m_s: state.estimate.speed_m_s,
            glide_angle_rad: state.estimate.gamma_rad,
            depth_m: seen.depth_m,
            table_id,
        },
    }
}

fn backup_limits(config: &Config, mission: &Mission) -> Limits {
    Limits {
        deep_cm: ((config.working_depth_m * 100.0) as i32).saturating_add(1_000),
        burn_cm: ((config.crush_depth_m * 100.0) as i32).saturating_sub(3_000),
        mission_us: (u64::from(mission.max_duration_s) + 600) * 1_000_000,
        pump_m3: config.pump_m3,
    }
}

fn judge(config: &Config, table: Option<&Table<'_>>, state: &mut State, seen: &Seen, leg: &Leg, frame: &SensorFrame) -> Verdict {
    let watch = Watch {
        config,
        clock: state.clock.run,
        seen,
        frame,
        commanded: &state.last,
        ballast_m3: state.ballast_m3,
        table_rate_m_s: table_rate_m_s(config, table, state, seen),
        phase: state.voyage.phase(),
        leg_max_m: leg.depth_max_m,
        max_duration_s: state.voyage.mission.max_duration_s,
        climb_stalled: state
            .voyage
            .climbs_without_way(state.clock.run, mutant::Watch::ClimbNoWay.after(voyage::CLIMB_STALLED_S as f32) as u32),
        no_way_turns: state.voyage.no_way_turns,
        bottom_turns: state.voyage.bottom_turns,
    };
    state.safety.judge(&watch)
}

/// Depth rate of the steady glide at the pitch flown on the pump's buoyancy alone, m/s; none out of a steady glide, without a table,
/// and at a pitch so flat that the vehicle may fall as steadily as it glides.
fn table_rate_m_s(config: &Config, table: Option<&Table<'_>>, state: &State, seen: &Seen) -> Option<f32> {
    let (table, pitch) = (table?, seen.pitch_rad?);
    let along = if state.ballast_m3 > 0.0 { pitch } else { -pitch };
    let settled = state.pumped_s > SETTLED_S && (state.last.ballast_m3 - state.ballast_m3).abs() < 12e-6;
    let glides = settled && along > config.preset_pitch_rad * GLIDES_SHARE && state.ballast_m3.abs() > 0.2 * config.pump_m3;
    if glides { glide::table_rate_m_s(table, along, state.ballast_m3.abs()) } else { None }
}

/// Moves the mission on, under what safety allows.
fn fly(config: &Config, state: &mut State, seen: &Seen, leg: &Leg, verdict: &Verdict) {
    let before = state.voyage.phase();
    let clock = state.clock.run;
    if verdict.abort.is_some() {
        state.voyage.stage = Stage::Safe;
    } else {
        if verdict.resumed {
            state.voyage.go_on(clock);
        }
        if verdict.climb {
            state.voyage.climb_now(clock, seen);
        }
        state.voyage.homeward |= verdict.homeward;
        state.voyage.home_for_now = verdict.home_for_now;
        state.voyage.surface_due = verdict.surface;
        state.voyage.all_out = verdict.pump_full;
        state.voyage.advance(config, clock, seen, leg, state.ballast_m3);
    }
    state.steady_s = if state.voyage.phase() == before { (state.steady_s + seen.dt_s).at_most(1e4) } else { 0.0 };
}

fn command(
    config: &Config,
    table: Option<&Table<'_>>,
    state: &mut State,
    seen: &Seen,
    verdict: &Verdict,
    leg: &Leg,
    seq: u32,
) -> ActuatorCommand {
    let phase = state.voyage.phase();
    let order = state.voyage.order(config, state.clock.run, leg);
    // After a minute of sinking the pump stands where it will.
    let ahead = if verdict.sinks_on { 0.0 } else { state.pump_rate_m3_s * config.cycle_s * 0.5 };
    let expected_m3 = state.ballast_m3 + (order.ballast_m3 - state.ballast_m3).at_least(-ahead).at_most(ahead);
    let side = side(config, expected_m3, leg);
    let pumped = (order.ballast_m3 - state.ballast_m3).abs() < 10e-6;
    let way_s = if pumped && seen.depth_m > ENTRY_M { seen.dt_s } else { 0.0 };
    state.pumped_s = if state.steady_s > 0.0 { (state.pumped_s + way_s).at_most(1e4) } else { 0.0 };
    let flat = leg.goal == Goal::BestGlide || !state.choice.is_steep();
    let entry = flat && matches!(phase, Phase::Dive | Phase::Climb) && state.pumped_s < ENTRY_S;
    let lesson = leg.depth_max_m - leg.depth_min_m > 4.0 * LESSON_M
        && leg.depth_max_m - seen.depth_m < LESSON_M
        && state.choice.wants_lesson(state.voyage.dives);
    // What sinks in spite of pump and weight sinks slowest on its wings: 0.7 N too many at 0.06 m/s, tail first at 0.11 m/s.
    let lesson_rad = glide::steeper_rad(config, leg, state.voyage.dives, lesson || entry);
    let (steeper_rad, way) = if verdict.sinks_on { (0.0, -1.0) } else { (lesson_rad, side) };
    state.pitch_wanted_rad = match phase {
        Phase::Surface | Phase::Comms | Phase::Done => 0.0,
        Phase::Safe if !verdict.sinks_on && seen.depth_m > FLOATS_M => STEEPEST_RAD,
        Phase::Safe if !verdict.sinks_on => config.preset_pitch_rad,
        Phase::Safe | Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh => {
            state.choice.pitch_rad(config, steeper_rad) * way
        }
    };
    let pitch = if verdict.distrust_pitch { None } else { seen.pitch_rad };
    let steady = matches!(phase, Phase::Dive | Phase::Climb) && pumped && state.steady_s > 15.0;
    if let (Some(table), Some(pitch)) = (table, pitch) {
        learn(config, table, state, seen, pitch, leg, steady);
    }

    let battery_mass_m = if verdict.hold_mass {
        state.trim.hold(config, seen.battery_m)
    } else if order.antenna_up {
        config.battery_m
    } else {
        let wish = Wish { pitch_rad: state.pitch_wanted_rad, ballast_m3: expected_m3, side, steady };
        state.trim.advance(config, seen.dt_s, wish, pitch, seen.battery_m)
    };
    let fin_rad = if order.steer { heading::fin_rad(config, leg.heading_rad, seen.heading_rad) } else { 0.0 };
    let wanted = ActuatorCommand {
        seq,
        ballast_m3: verdict.pump_instead_m3.unwrap_or(order.ballast_m3),
        battery_mass_m,
        fin_rad,
        drop_weight: verdict.drop_weight,
        beacon: matches!(phase, Phase::Safe | Phase::Done),
    };
    within_range(config, wanted)
}

/// What this cycle tells of the glide, and one more point of the search for the pitch.
fn learn(config: &Config, table: &Table<'_>, state: &mut State, seen: &Seen, pitch_rad: f32, leg: &Leg, steady: bool) {
    let choice = &mut state.choice;
    let now = state.estimate.advance(table, &choice.belief, seen.dt_s, pitch_rad, seen.rate_m_s, state.ballast_m3, steady);
    let held = (pitch_rad - state.pitch_wanted_rad).abs() < HELD_RAD;
    // A steeper glide carries farther through the turn: what its start was reckoned from must be what is flown.
    let near = state.voyage.turn_is_near(config, seen, leg, state.ballast_m3);
    let way = seen.depth_age_s <= 0.0 && seen.dt_s > 0.0 && seen.rate_m_s * state.ballast_m3 < 0.0;
    match now {
        Some(now) if steady && held && way => match choice.belief.take(&now, seen.rate_m_s) {
            News::None => choice.search(config, table, leg, state.voyage.dives),
            News::Piece if !near => choice.settle(config, table, leg),
            News::Piece => {}
            News::LetGo => choice.retreat(),
        },
        _ => choice.belief.interrupt(),
    }
}

/// Keeps the believed pump position: measured, else moved at the pump's rate
/// towards what was commanded. The rate is learned, since pumps slow down under
/// pressure and with age.
fn follow_pump(config: &Config, state: &mut State, measured_m3: Option<f32>, dt_s: f32) {
    let known = 0.1 * config.pump_rate_m3_s..=5.0 * config.pump_rate_m3_s;
    if !known.contains(&state.pump_rate_m3_s) {
        state.pump_rate_m3_s = config.pump_rate_m3_s;
    }
    // A pump that ran through the whole cycle shows its rate.
    if let (Some(at), true) = (measured_m3, dt_s > 0.0) {
        let moved = (at - state.ballast_m3).abs();
        let still_running = (state.last.ballast_m3 - at).abs() > moved;
        let rate = moved / dt_s;
        if still_running && moved > 5e-6 && known.contains(&rate) {
            state.pump_rate_m3_s += 0.3 * (rate - state.pump_rate_m3_s);
        }
    }
    let reach = state.pump_rate_m3_s * dt_s;
    let modelled = state.ballast_m3 + (state.last.ballast_m3 - state.ballast_m3).at_least(-reach).at_most(reach);
    state.ballast_m3 = measured_m3.unwrap_or(modelled).at_least(-config.pump_m3).at_most(config.pump_m3);
}

/// Between dive (−1) and climb (+1) by the ballast.
fn side(config: &Config, ballast_m3: f32, leg: &Leg) -> f32 {
    let drive = leg.ballast_m3.at_least(0.1 * config.pump_m3).at_most(config.pump_m3);
    (ballast_m3 / (drive * FULL_PITCH_SHARE)).at_least(-1.0).at_most(1.0)
}

/// The last gate before the wires: finite and in range, whatever came before.
fn within_range(config: &Config, c: ActuatorCommand) -> ActuatorCommand {
    // NaN is within nothing.
    if c.ballast_m3.abs() <= config.pump_m3 && c.battery_mass_m.abs() <= config.battery_m && c.fin_rad.abs() <= config.fin_rad {
        return c;
    }
    brought_within(config, c)
}

#[cold]
#[inline(never)]
fn brought_within(config: &Config, c: ActuatorCommand) -> ActuatorCommand {
    let gate = |v: f32, range: f32, safe: f32| if v.is_finite() { v.at_least(-range).at_most(range) } else { safe };
    ActuatorCommand {
        ballast_m3: gate(c.ballast_m3, config.pump_m3, config.pump_m3),
        battery_mass_m: gate(c.battery_mass_m, config.battery_m, 0.0),
        fin_rad: gate(c.fin_rad, config.fin_rad, 0.0),
        ..c
    }
}

#[cfg(test)]
mod tests;
