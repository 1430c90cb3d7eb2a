//! One flight: world → sensors → seat → controller → seat → actuators → world.
//!
//! Lockstep: the world stands still while the controller answers, so a slow
//! line changes nothing but the wall time. What is measured of a flight, and
//! how the glide is judged:
//!
//! ```text
//! achieved L/D = Σ horizontal way over ground / Σ |vertical way|      over all cycles that glide or turn
//! share        = achieved L/D / (L/D)max of the true vehicle
//! ```

use crate::flight::cycle::Cycle;
use crate::seats::{CYCLE_S, Seat, SeatError};
use control::Config;
use plant::World;
use signals::{Abort, ActuatorCommand, Mission, Phase};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A vehicle above this depth, m, counts as being at the surface.
pub const SURFACED_M: f64 = 1.0;
/// Time a finished vehicle is watched at the surface, s.
const WATCH_S: f64 = 60.0;

/// What a person may do to a flight under way.
#[derive(Clone, Debug)]
pub enum Order {
    /// Break something from the next cycle on.
    Inject(plant::Fault),
    /// Order the vehicle home.
    Recall,
}

/// Orders on their way to the closed loop; clones share one list.
#[derive(Clone, Debug, Default)]
pub struct Orders(Arc<Mutex<Vec<Order>>>);

impl Orders {
    /// To be carried out before the next cycle.
    pub fn give(&self, order: Order) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(order);
    }

    fn take(&self) -> Vec<Order> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// How to fly.
#[derive(Clone, Debug)]
pub struct Setup {
    /// What.
    pub mission: Mission,
    /// With which controller configuration.
    pub config: Config,
    /// Longest flight, s.
    pub limit_s: f64,
    /// World seconds per wall second; none: as fast as it goes.
    pub realtime: Option<f64>,
    /// What a person does meanwhile.
    pub orders: Orders,
}

impl Setup {
    /// A mission with its own time limit and two hours to come home.
    #[must_use]
    pub fn new(mission: Mission) -> Self {
        let limit_s = f64::from(mission.max_duration_s) + 7200.0;
        let config = crate::flight::worlds::config(&mission);
        Self { mission, config, limit_s, realtime: None, orders: Orders::default() }
    }
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Why a flight could not be flown to its end.
#[derive(Debug)]
pub enum FlightError {
    /// The seat.
    Seat(SeatError),
    /// Who watches (log, screen).
    Watcher(anyhow::Error),
}

impl From<SeatError> for FlightError {
    fn from(e: SeatError) -> Self {
        Self::Seat(e)
    }
}

impl std::fmt::Display for FlightError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Seat(e) => e.fmt(f),
            Self::Watcher(e) => write!(f, "{e:#}"),
        }
    }
}

impl std::error::Error for FlightError {}

/// Takes the controller of a simulated vehicle out of the mission it is in: it is called home, shown the vehicle afloat for as long
/// as it asks for, and told that it is recovered. Nothing happens to one without a mission.
///
/// # Errors
/// The seat failed, or a mission on the vehicle's own sensors is under way.
pub fn recover(seat: &mut dyn Seat) -> Result<(), SeatError> {
    let manifest = seat.hello()?;
    if !manifest.hil {
        return Err(SeatError::OwnSensors { seat: seat.describe() });
    }
    if manifest.under_way && manifest.last_seq.is_none() && manifest.phase != Phase::Safe {
        return seat.recall(); // armed, and never stepped
    }
    if manifest.under_way {
        seat.recall()?;
        let afloat = signals::Reading::now(0.0);
        let (first, cycle_us) = (manifest.last_seq.map_or(0, |seq| seq.wrapping_add(1)), u64::from(manifest.cycle_ms) * 1_000);
        // From a time that no flight has reached, a cycle apart, and two more than the surface must be seen.
        for n in 0..helm::afloat::TWINS_MS / manifest.cycle_ms.max(1) + 2 {
            let time = signals::Micros::from_secs(1 << 32).plus(signals::Micros(cycle_us * u64::from(n)));
            seat.exchange(&signals::SensorFrame {
                seq: first.wrapping_add(n),
                time,
                depth_m: afloat,
                depth2_m: afloat,
                ..Default::default()
            })?;
        }
    }
    seat.recover()
}

/// Flies a mission to its end. `watch` sees every cycle; an error of it ends the flight.
///
/// # Errors
/// The seat failed, or `watch` did.
pub fn fly(
    world: &mut World,
    seat: &mut dyn Seat,
    setup: &Setup,
    watch: &mut dyn FnMut(&Cycle<'_>) -> anyhow::Result<()>,
) -> Result<Outcome, FlightError> {
    let wall = Instant::now();
    let manifest = seat.hello()?;
    if !manifest.hil {
        return Err(SeatError::OwnSensors { seat: seat.describe() }.into());
    }
    seat.configure(&manifest, &setup.config)?;
    let table_id = seat.begin(&setup.mission)?;
    let start_s = world.time_s();
    let crush_m = world.scenario().vehicle.crush_depth_m;
    let mut tally = Tally::new(world.best_glide().alpha_rad, table_id);
    let mut home_s = 0.0;
    let end = loop {
        for order in setup.orders.take() {
            match order {
                Order::Inject(fault) => world.inject(fault),
                Order::Recall => seat.recall()?,
            }
        }
        let frame = world.sense();
        let truth = world.truth();
        let answer = seat.exchange(&frame)?;
        let time_s = world.time_s() - start_s;
        let cycle = Cycle { time_s, frame: &frame, answer: &answer, truth: &truth };
        tally.take(&cycle);
        watch(&cycle).map_err(FlightError::Watcher)?;
        let phase = answer.trace.phase;
        if truth.depth_m > crush_m {
            break End::Crushed;
        }
        let finished = matches!(phase, Phase::Done | Phase::Safe);
        home_s = if finished && truth.depth_m < SURFACED_M { home_s + CYCLE_S } else { 0.0 };
        if home_s >= WATCH_S {
            break if phase == Phase::Done { End::Done } else { End::Safe(answer.trace.abort) };
        }
        if time_s >= setup.limit_s {
            break End::TimeUp;
        }
        world.observe_phase(phase);
        world.advance(&answer.command, CYCLE_S);
        if world.take_brown_out() {
            seat.reset()?;
        }
        if let Some(times) = setup.realtime {
            let due = Duration::from_secs_f64((world.time_s() - start_s) / times);
            std::thread::sleep(due.saturating_sub(wall.elapsed()));
        }
    };
    let mut out = tally.out;
    out.end = end;
    out.wall_s = wall.elapsed().as_secs_f64();
    out.actuator_hash = tally.hash.value();
    out.share_near_best = if tally.gliding_cycles > 0 { tally.near_best_cycles as f64 / tally.gliding_cycles as f64 } else { 0.0 };
    Ok(out)
}
