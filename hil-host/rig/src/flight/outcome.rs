//! What came of a flight: way over ground, glide, energy, and how it ended.
//!
//! ```text
//! achieved L/D = Σ horizontal way over ground / Σ |vertical way|      over all cycles that glide or turn
//! share        = achieved L/D / (L/D)max of the true vehicle
//! ```

use crate::flight::cycle::Cycle;
use crate::seats::CYCLE_S;
use plant::World;
use signals::{Abort, ActuatorCommand, Phase};
use std::time::Instant;

/// A vehicle above this depth, m, counts as being at the surface.
pub const SURFACED_M: f64 = 1.0;
/// Time a finished vehicle is watched at the surface, s.
const WATCH_S: f64 = 60.0;
/// The same in SAFE, s: a mission that a glitch ended may go on two minutes after all has come back.
const WATCH_SAFE_S: f64 = 200.0;

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum End {
    /// Mission complete, at the surface.
    Done,
    /// In SAFE, at the surface, with the first cause.
    Safe(Option<Abort>),
    /// Below the depth at which the hull fails.
    Crushed,
    /// Not home within the time limit.
    TimeUp,
}

impl End {
    /// At the surface in the end, above crush depth all the way.
    #[must_use]
    pub const fn home(self) -> bool {
        matches!(self, Self::Done | Self::Safe(_))
    }
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Done => f.write_str("done"),
            Self::Safe(Some(cause)) => write!(f, "safe: {cause:?}"),
            Self::Safe(None) => f.write_str("safe"),
            Self::Crushed => f.write_str("crushed"),
            Self::TimeUp => f.write_str("not home in time"),
        }
    }
}

/// What came of a flight.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// Control cycles.
    pub cycles: u64,
    /// World time, s.
    pub duration_s: f64,
    /// Wall time, s.
    pub wall_s: f64,
    /// Dives completed, by the controller's count.
    pub dives: u16,
    /// Horizontal way over ground while gliding and turning, m.
    pub distance_m: f64,
    /// Straight line from the first dive to the end, m.
    pub displacement_m: f64,
    /// Vertical way while gliding and turning, m.
    pub vertical_m: f64,
    /// Share of that time within 2° of the angle of attack of (L/D)max.
    pub share_near_best: f64,
    /// Deepest, m.
    pub max_depth_m: f64,
    /// Shallowest depth of the turns from climb to dive, m; none: no such turn.
    pub upper_turn_m: Option<f64>,
    /// Electrical energy, J: pump, and all.
    pub energy_j: (f64, f64),
    /// FNV-1a over all actuator commands, bit by bit.
    pub actuator_hash: u64,
    /// Identity of the table flown with.
    pub table_id: u32,
}

impl Outcome {
    /// Achieved L/D over the whole gliding way.
    #[must_use]
    pub fn achieved_l_over_d(&self) -> f64 {
        if self.vertical_m > 0.0 { self.distance_m / self.vertical_m } else { 0.0 }
    }

    /// Electrical energy per metre over ground, J/m; none: it went nowhere.
    #[must_use]
    pub fn joule_per_m(&self) -> Option<f64> {
        (self.distance_m > 0.0).then(|| self.energy_j.1 / self.distance_m)
    }
}

/// Hash of an actuator stream: 64-bit FNV-1a over the bits of every field.
#[derive(Clone, Copy, Debug)]
pub struct StreamHash(u64);

impl Default for StreamHash {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl StreamHash {
    /// Takes one command.
    pub fn take(&mut self, c: &ActuatorCommand) {
        let floats = [c.ballast_m3, c.battery_mass_m, c.fin_rad].map(f32::to_bits);
        let words = [c.seq, floats[0], floats[1], floats[2], u32::from(c.drop_weight) | u32::from(c.beacon) << 1];
        for byte in words.iter().flat_map(|w| w.to_le_bytes()) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// The hash so far.
    #[must_use]
    pub const fn value(self) -> u64 {
        self.0
    }
}

/// Running sums of a flight.
#[derive(Clone, Debug)]
struct Tally {
    before: Option<(f64, f64, f64)>,
    first_dive: Option<(f64, f64)>,
    gliding_cycles: u64,
    near_best_cycles: u64,
    best_alpha_rad: f64,
    out: Outcome,
    hash: StreamHash,
}

impl Tally {
    fn new(best_alpha_rad: f64, table_id: u32) -> Self {
        Self {
            before: None,
            first_dive: None,
            gliding_cycles: 0,
            near_best_cycles: 0,
            best_alpha_rad,
            hash: StreamHash::default(),
            out: Outcome {
                end: End::TimeUp,
                cycles: 0,
                duration_s: 0.0,
                wall_s: 0.0,
                dives: 0,
                distance_m: 0.0,
                displacement_m: 0.0,
                vertical_m: 0.0,
                share_near_best: 0.0,
                max_depth_m: 0.0,
                upper_turn_m: None,
                energy_j: (0.0, 0.0),
                actuator_hash: 0,
                table_id,
            },
        }
    }

    fn take(&mut self, c: &Cycle<'_>) {
        let t = c.truth;
        let at = (t.north_m, t.east_m, t.depth_m);
        let o = &mut self.out;
        let phase = c.answer.trace.phase;
        let gliding = matches!(phase, Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh);
        if let Some((north, east, depth)) = self.before.filter(|_| gliding) {
            o.distance_m += (at.0 - north).hypot(at.1 - east);
            o.vertical_m += (at.2 - depth).abs();
            self.gliding_cycles += 1;
            if (t.alpha_rad.abs() - self.best_alpha_rad).abs() < 2f64.to_radians() {
                self.near_best_cycles += 1;
            }
        }
        if gliding {
            let from = *self.first_dive.get_or_insert((at.0, at.1));
            o.displacement_m = (at.0 - from.0).hypot(at.1 - from.1);
        }
        if phase == Phase::InflectHigh {
            o.upper_turn_m = Some(o.upper_turn_m.map_or(at.2, |u| u.min(at.2)));
        }
        self.before = Some(at);
        o.max_depth_m = o.max_depth_m.max(at.2);
        o.dives = o.dives.max(c.answer.trace.dives);
        o.cycles += 1;
        o.duration_s = c.time_s;
        o.energy_j = (t.energy.pump_j, t.energy.total_j());
        self.hash.take(&c.answer.command);
    }
}

/// A flight under way, seen cycle by cycle until it ends.
#[derive(Clone, Debug)]
pub struct Course {
    tally: Tally,
    crush_m: f64,
    limit_s: f64,
    home_s: f64,
    wall: Instant,
}

impl Course {
    /// Of a flight that begins now with this table; it ends after `limit_s` at the latest.
    #[must_use]
    pub fn new(world: &World, table_id: u32, limit_s: f64) -> Self {
        let tally = Tally::new(world.best_glide().alpha_rad, table_id);
        Self { tally, crush_m: world.scenario().vehicle.crush_depth_m, limit_s, home_s: 0.0, wall: Instant::now() }
    }

    /// Takes a cycle; says how the flight ends, if it does.
    pub fn take(&mut self, cycle: &Cycle<'_>) -> Option<End> {
        self.tally.take(cycle);
        let (phase, depth_m) = (cycle.answer.trace.phase, cycle.truth.depth_m);
        if depth_m > self.crush_m {
            return Some(End::Crushed);
        }
        let finished = matches!(phase, Phase::Done | Phase::Safe);
        self.home_s = if finished && depth_m < SURFACED_M { self.home_s + CYCLE_S } else { 0.0 };
        let may_go_on = phase == Phase::Safe && cycle.answer.trace.abort.is_some_and(control::waits::comes_back);
        if self.home_s >= if may_go_on { WATCH_SAFE_S } else { WATCH_S } {
            return Some(if phase == Phase::Done { End::Done } else { End::Safe(cycle.answer.trace.abort) });
        }
        (cycle.time_s >= self.limit_s).then_some(End::TimeUp)
    }

    /// Everything that came of it.
    #[must_use]
    pub fn ended(self, end: End) -> Outcome {
        let (tally, mut out) = (&self.tally, self.tally.out.clone());
        out.end = end;
        out.wall_s = self.wall.elapsed().as_secs_f64();
        out.actuator_hash = tally.hash.value();
        out.share_near_best = if tally.gliding_cycles > 0 { tally.near_best_cycles as f64 / tally.gliding_cycles as f64 } else { 0.0 };
        out
    }
}
