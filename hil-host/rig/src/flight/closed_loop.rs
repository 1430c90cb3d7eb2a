//! One flight: world → sensors → seat → controller → seat → actuators → world.
//!
//! Lockstep: the world stands still while the controller answers, so a slow
//! line changes nothing but the wall time. What comes of it: [`super::outcome`].

use crate::flight::cycle::Cycle;
pub use crate::flight::outcome::{Course, End, Outcome, SURFACED_M, StreamHash};
use crate::seats::{CYCLE_S, Seat, SeatError};
use control::Config;
use plant::{Scenario, Truth, World};
use signals::{Mission, Phase};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

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
    /// Flight table that is uploaded first; none: the controller's own.
    pub table: Option<Vec<u8>>,
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
        Self { mission, config, table: None, limit_s, realtime: None, orders: Orders::default() }
    }
}

/// Why a flight could not be flown to its end.
#[derive(Debug)]
pub enum FlightError {
    /// The seat.
    Seat(SeatError),
    /// Who watches (log, screen).
    Watcher(anyhow::Error),
    /// The simulated motion is no number any more: what to look at.
    Diverged(String),
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
            Self::Diverged(what) => f.write_str(what),
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

/// Refuses a simulated motion that is no number any more.
///
/// # Errors
/// The time of it, and the numbers of the vehicle that make a simulated motion fast.
pub fn is_finite(time_s: f64, truth: &Truth, scenario: &Scenario) -> Result<(), FlightError> {
    let motion = [truth.depth_m, truth.north_m, truth.east_m, truth.pitch_rad, truth.pitch_rate_rad_s, truth.u_m_s, truth.w_m_s];
    if motion.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    let v = &scenario.vehicle;
    Err(FlightError::Diverged(format!(
        "the simulated vehicle diverged at {time_s:.0} s: with these numbers it moves faster than a simulation can follow. \
         Look at [vehicle] of the truth file: mass_kg = {}, added_mass_surge_kg = {}, added_mass_heave_kg = {}, \
         inertia_kg_m2 = {}, metacentric_height_m = {}, battery_mass_kg = {}, ballast_arm_m = {}{}, and at the sizes of its effects",
        v.mass_kg,
        v.added_mass_surge_kg,
        v.added_mass_heave_kg,
        v.inertia_kg_m2,
        v.metacentric_height_m,
        v.battery_mass_kg,
        v.ballast_arm_m,
        v.aero.map_or_else(String::new, |a| format!(", aero.moment_slope = {}, aero.moment_rate = {}", a.moment_slope, a.moment_rate)),
    )))
}

/// Flies a mission to its end. `watch` sees every cycle; an error of it ends the flight.
///
/// # Errors
/// The seat failed, or `watch` did, or the simulated motion diverged.
pub fn fly(
    world: &mut World,
    seat: &mut dyn Seat,
    setup: &Setup,
    watch: &mut dyn FnMut(&Cycle<'_>) -> anyhow::Result<()>,
) -> Result<Outcome, FlightError> {
    let manifest = seat.hello()?;
    if !manifest.hil {
        return Err(SeatError::OwnSensors { seat: seat.describe() }.into());
    }
    seat.configure(&manifest, &setup.config)?;
    if let Some(table) = &setup.table {
        seat.tabulate(setup.mission.wings, table)?;
    }
    let table_id = seat.begin(&setup.mission)?;
    let (wall, start_s) = (Instant::now(), world.time_s());
    let mut course = Course::new(world, table_id, setup.limit_s);
    let (mut idle, mut resets) = (None, 0);
    let end = loop {
        for order in setup.orders.take() {
            match order {
                Order::Inject(fault) => world.inject(fault),
                Order::Recall => seat.recall()?,
            }
        }
        let frame = world.sense();
        let truth = world.truth();
        is_finite(world.time_s() - start_s, &truth, world.scenario())?;
        let answer = match idle {
            Some(last) => last,
            None => seat.exchange(&frame)?,
        };
        let cycle = Cycle { time_s: world.time_s() - start_s, frame: &frame, answer: &answer, truth: &truth, resets };
        let end = course.take(&cycle);
        watch(&cycle).map_err(FlightError::Watcher)?;
        if let Some(end) = end {
            break end;
        }
        world.observe_phase(answer.trace.phase);
        world.advance(&answer.command, CYCLE_S);
        if world.take_brown_out() {
            seat.reset()?;
            resets += 1;
            // After its mission a controller comes up idle: what was commanded last stays.
            idle = (answer.trace.phase == Phase::Done).then_some(answer);
        }
        if let Some(times) = setup.realtime {
            let due = Duration::from_secs_f64((world.time_s() - start_s) / times);
            std::thread::sleep(due.saturating_sub(wall.elapsed()));
        }
    };
    Ok(course.ended(end))
}
