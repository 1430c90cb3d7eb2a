//! One flight: plant, front seat and board together.
//!
//! ```text
//! share = Σ horizontal way / Σ |vertical way|  /  (L/D)max of the true vehicle      below 1 m, from the first dive on
//! ```
//! By depth and not by phase: the same measure for a flight that the glider's own servo flies.

use crate::behaviours::{Doing, FlightComputer, Motors};
use crate::board::{Board, Flown};
use crate::measured::Measured;
use crate::mission;
use crate::mission::Pilot;
pub use crate::other_end::{Backseat, Nobody};
use crate::science::{LAG_S, Science};
use crate::sensors::updated;
use crate::wire::{Damage, Wire};
use crate::{CYCLE_S, Switches};
use anyhow::{Context, anyhow};
use backseat::sensors::List;
use backseat::{Law, Limits};
use control::Config;
use plant::{Scenario, Truth, World};
use signals::{Micros, Mission, Phase, SensorFrame};
use std::collections::BTreeMap;

/// How finely time passes between the flight cycles, s.
const STEP_S: f64 = 0.25;
/// Depth below which the way counts, m.
const COUNTS_M: f64 = 1.0;
/// A turn up above this is the vehicle bobbing, m.
const TURN_M: f64 = 5.0;
/// Time of the first flight cycle as the glider's clock says it, s.
const EPOCH_S: f64 = 1_767_225_600.0;
/// The program at the line starts so long after the mission, s.
const STARTS_S: f64 = 2.0;

/// What happens at a time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The board's supply is gone: it hears and says nothing.
    BoardSilent(bool),
    /// The line from the glider is cut.
    GliderSilent(bool),
    /// The program at the line stops (false) or starts (true).
    Program(bool),
    /// Bytes before a sentence: boot noise.
    Noise,
    /// The line begins to damage bytes.
    Damage(Damage),
}

/// How to fly.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Text of the mission file.
    pub mission: String,
    /// Text of `extctl.ini`.
    pub ini: String,
    /// The board's list: names of what [`updated`] gives.
    pub list: List,
    /// What nobody published.
    pub switches: Switches,
    /// Motors.
    pub motors: Motors,
    /// Line speed, baud.
    pub baud: f64,
    /// Way to the flight computer, s.
    pub lag_s: f64,
    /// What happens, in order of time.
    pub events: Vec<(f64, Event)>,
    /// Longest flight, s.
    pub limit_s: f64,
    /// Seed of the line's damage.
    pub seed: u64,
}

/// Motors of a world's vehicle: its limits, and the dead bands of its class.
#[must_use]
pub fn motors(world: &World) -> Motors {
    let a = &world.scenario().actuators;
    let cc = a.pump.volume_m3 * 1e6;
    // Public dead bands: 42 cc (default), 10 cc (200 m example), 20 cc (deep); 0.068 in; 0.02 rad.
    let dead_cc = match a.pump.rate_m3_s {
        r if r > 20e-6 => 42.0,
        r if r > 8e-6 => 10.0,
        _ => 20.0,
    };
    Motors { pump_cc: (cc, dead_cc), battery_in: (a.battery_travel_m / 0.0254, 0.068), fin_rad: (a.fin_limit_rad, 0.02) }
}

impl Setup {
    /// The ordinary flight of a mission file.
    #[must_use]
    pub fn new(world: &World, list: List, mission: String, limit_s: f64) -> Self {
        Self {
            mission,
            ini: ini(list),
            list,
            switches: Switches::default(),
            motors: motors(world),
            baud: 9600.0,
            lag_s: LAG_S,
            events: Vec::new(),
            limit_s,
            seed: 1,
        }
    }
}

/// The text of `extctl.ini` for a list.
#[must_use]
pub fn ini(list: List) -> String {
    use backseat::Generation;
    use backseat::ini::Section;
    let mut text = String::new();
    let mut section = None;
    for index in 0..list.count() {
        let (Some(entry), now) = (list.get(index), list.section(index)) else { continue };
        if now != section {
            text += match now {
                Some(Section::Mission) => "mp\n",
                Some(Section::Output) => "os\n",
                _ => "is\n",
            };
            section = now;
        }
        // The newer generation's parameters have no unit.
        text += entry.name;
        if now != Some(Section::Mission) {
            text = text + " " + entry.unit;
        }
        text.push('\n');
    }
    if list.generation == Generation::Newer {
        text += "baud\n9600\npacket_size\n600\n";
    }
    text
}

/// What came of a flight.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What the front seat did last.
    pub doing: Doing,
    /// At the surface in the end, never crushed.
    pub home: bool,
    /// First abort of the front seat, if any.
    pub aborted: Option<crate::behaviours::Abort>,
    /// World time, s.
    pub duration_s: f64,
    /// Way over ground below 1 m, and vertical way, m.
    pub way_m: (f64, f64),
    /// (L/D)max of the vehicle.
    pub best: f64,
    /// Deepest, m.
    pub max_depth_m: f64,
    /// Turns up at depth.
    pub dives: u32,
    /// Electric energy, J.
    pub energy_j: f64,
    /// The front seat's log.
    pub log: Vec<String>,
    /// Sentences of the board with their time, s.
    pub taken: Vec<(f64, String)>,
    /// Files that the board wrote, by name.
    pub files: BTreeMap<String, Vec<u8>>,
    /// Parameters of the front seat in the end.
    pub parameters: [f32; 12],
}

impl Outcome {
    /// Achieved L/D over (L/D)max.
    #[must_use]
    pub fn share(&self) -> f64 {
        if self.way_m.1 > 0.0 { self.way_m.0 / self.way_m.1 / self.best } else { 0.0 }
    }
}

/// Sums over the true way, the same for every pilot.
#[derive(Clone, Debug, Default)]
pub struct Way {
    before: Option<(f64, f64, f64)>,
    /// Horizontal and vertical, m.
    pub sums_m: (f64, f64),
    /// Turns up.
    pub dives: u32,
    sinking: bool,
}

impl Way {
    /// One cycle's truth.
    pub fn take(&mut self, t: &Truth) {
        if let Some((north, east, depth)) = self.before
            && depth > COUNTS_M
            && t.depth_m > COUNTS_M
        {
            self.sums_m.0 += (t.north_m - north).hypot(t.east_m - east);
            self.sums_m.1 += (t.depth_m - depth).abs();
        }
        let sinking = if t.sink_rate_m_s.abs() < 0.02 { self.sinking } else { t.sink_rate_m_s > 0.0 };
        self.dives += u32::from(self.sinking && !sinking && t.depth_m > TURN_M);
        self.sinking = sinking;
        self.before = Some((t.north_m, t.east_m, t.depth_m));
    }
}

/// Flies.
///
/// # Errors
/// A mission file that cannot be read, or the line is gone.
pub fn fly(world: &mut World, board: &mut dyn Backseat, setup: &Setup) -> anyhow::Result<Outcome> {
    let mission = mission::read(&setup.mission).context("the mission file")?;
    let mut computer = FlightComputer::new(mission, setup.motors, 0.0);
    let mut science = Science::new(&setup.ini, setup.switches);
    science.lag_s = setup.lag_s;
    let (mut to_board, mut to_glider) = (Wire::new(setup.baud, setup.seed), Wire::new(setup.baud, setup.seed ^ 0x5eed));
    let mut measured = Measured { vacuum_inhg: 7.0, volts: 13.0, ..Measured::default() };
    let (mut way, mut events) = (Way::default(), setup.events.iter().peekable());
    let (mut board_silent, mut aborted, mut home_s) = (false, None, 0.0f64);
    let (mut next_cycle_s, mut now_s, crush_m) = (0.0f64, 0.0f64, world.scenario().vehicle.crush_depth_m);
    let (mut heard, mut said) = (Vec::new(), Vec::new());
    let mut started = false;
    let limits = [setup.motors.pump_cc.0, setup.motors.battery_in.0, setup.motors.fin_rad.0];
    let mut crushed = false;
    loop {
        if !started && now_s >= STARTS_S {
            (started, _) = (true, science.switch(true, now_s));
        }
        while let Some((_, event)) = events.next_if(|(at, _)| *at <= now_s) {
            match event {
                Event::BoardSilent(silent) => board_silent = *silent,
                Event::GliderSilent(silent) => to_board.cut = *silent,
                Event::Program(on) => science.switch(*on, now_s),
                Event::Noise => to_board.put(b"\x00\xf3boot$S"),
                Event::Damage(damage) => (to_board.damage, to_glider.damage) = (*damage, *damage),
            }
        }
        if now_s >= next_cycle_s {
            computer.obey(&science.due_in_flight(now_s));
            let frame = world.sense();
            let truth = world.truth();
            way.take(&truth);
            crushed |= truth.depth_m > crush_m;
            measured = measured.next(&frame, CYCLE_S);
            let minds = setup.switches.silence_s.is_some_and(|s| now_s - science.heard_s.unwrap_or(0.0) > f64::from(s));
            let command = computer.cycle(now_s, CYCLE_S, &measured, 0.0, minds);
            if let Doing::Aborted(cause) = computer.doing {
                aborted = aborted.or(Some(cause));
            }
            let named: Vec<(&str, f64)> = updated(&frame, &truth, EPOCH_S + now_s, &computer, limits)
                .into_iter()
                .filter_map(|(index, value)| setup.list.get(index).map(|entry| (entry.name, value)))
                .collect();
            science.sensors(now_s, &named);
            home_s = if computer.is_over() && truth.depth_m < COUNTS_M { home_s + CYCLE_S } else { 0.0 };
            if home_s > 60.0 || now_s > setup.limit_s || crushed {
                return Ok(Outcome {
                    doing: computer.doing,
                    home: home_s > 60.0 && !crushed,
                    aborted,
                    duration_s: now_s,
                    way_m: way.sums_m,
                    best: world.best_glide().l_over_d,
                    max_depth_m: truth.max_depth_m,
                    dives: way.dives,
                    energy_j: truth.energy.total_j(),
                    log: science.log,
                    taken: science.taken,
                    files: science.files.into_iter().filter(|(name, _)| name != "extctl.ini").collect(),
                    parameters: computer.parameters,
                });
            }
            world.advance(&command, CYCLE_S);
            next_cycle_s += CYCLE_S;
        }
        heard.clear();
        said.clear();
        let mut due = Vec::new();
        science.due_on_line(now_s, &mut due);
        to_board.put(&due);
        to_board.carry(STEP_S, &mut heard);
        if !board_silent {
            board.pass(Micros((now_s * 1e6) as u64), &heard, &mut said)?;
        }
        to_glider.put(&said);
        let mut arrived = Vec::new();
        to_glider.carry(STEP_S, &mut arrived);
        science.bytes(now_s, &arrived);
        now_s += STEP_S;
    }
}

/// A vehicle, its mission and its controller's configuration: what one compares pilots on.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The world.
    pub scenario: Scenario,
    /// What is flown.
    pub mission: Mission,
    /// With which configuration.
    pub config: Config,
}

/// Time a mission may take longer than it says, s.
const COMING_HOME_S: f64 = 7200.0;
/// Hours without comms after which the glider's mission ends by itself.
const NO_COMMS_H: u32 = 8;

impl Trial {
    /// The list of sensors for its vehicle.
    #[must_use]
    pub fn list(&self) -> List {
        bay::backseat_role::list(&self.config)
    }

    /// The mission file for the glider with a board.
    #[must_use]
    pub fn mission_text(&self, pilot: Pilot) -> String {
        let no_comms_s = match pilot {
            // Before the mission's own time is over: that would be an abort.
            Pilot::Backseat => (self.mission.max_duration_s / 10 * 9).min(NO_COMMS_H * 3600),
            // Nobody surfaces in between.
            Pilot::Own => self.mission.max_duration_s.max(48 * 3600),
        };
        mission::text(&self.mission, pilot, self.config.working_depth_m, no_comms_s)
    }

    fn world(&self) -> anyhow::Result<World> {
        World::new(self.scenario.clone()).map_err(|e| anyhow!("{e}"))
    }

    /// The controller built for this computer, as a backseat.
    ///
    /// # Errors
    /// The world cannot be.
    pub fn board(&self) -> anyhow::Result<Board> {
        let rho = self.world()?.depth_density_kg_m3() as f32;
        Ok(Board::new(bay::backseat_role::setup(self.list(), &self.config, rho), &self.mission, self.config.clone()))
    }

    fn law(&self) -> Flown {
        Flown::new(&self.mission, self.config.clone())
    }

    /// Flies it over the line.
    ///
    /// # Errors
    /// The world cannot be, or the line is gone.
    pub fn over_the_line(&self, board: &mut dyn Backseat, change: impl FnOnce(&mut Setup)) -> anyhow::Result<Outcome> {
        let mut world = self.world()?;
        let mut setup =
            Setup::new(&world, self.list(), self.mission_text(Pilot::Backseat), f64::from(self.mission.max_duration_s) + COMING_HOME_S);
        change(&mut setup);
        fly(&mut world, board, &setup)
    }

    /// The glider's own servo on the first leg's depths and pump.
    ///
    /// # Errors
    /// The world cannot be.
    pub fn own_servo(&self) -> anyhow::Result<Outcome> {
        let mut world = self.world()?;
        let setup = Setup::new(&world, self.list(), self.mission_text(Pilot::Own), f64::from(self.mission.max_duration_s) + COMING_HOME_S);
        fly(&mut world, &mut Nobody, &setup)
    }

    /// Frames straight to the law, as over our own line; measured in the same way: its share of (L/D)max.
    ///
    /// # Errors
    /// The world cannot be, or the law refuses the mission.
    pub fn frames_share(&self) -> anyhow::Result<f64> {
        let mut world = self.world()?;
        let (mut law, mut way) = (self.law(), Way::default());
        let c = &self.config;
        law.begin(&Limits { ballast_m3: c.pump_m3, battery_m: c.battery_m, fin_rad: c.fin_rad, battery_step_m: 0.0 })
            .context("the law refuses the mission")?;
        let (mut seq, mut over_s) = (0, 0.0);
        while over_s < 60.0 && world.time_s() < f64::from(self.mission.max_duration_s) + COMING_HOME_S {
            let frame = SensorFrame { seq, ..world.sense() };
            seq += 1;
            way.take(&world.truth());
            let answer = law.step(&frame).context("the law does not answer")?;
            let over = matches!(answer.trace.phase, Phase::Done | Phase::Safe) && world.truth().depth_m < COUNTS_M;
            over_s = if over { over_s + FRAMES_S } else { 0.0 };
            world.advance(&answer.command, FRAMES_S);
        }
        Ok(way.sums_m.0 / way.sums_m.1 / world.best_glide().l_over_d)
    }
}

/// Cycle of the frames seat, s.
const FRAMES_S: f64 = 4.0;
