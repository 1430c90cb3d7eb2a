//! Where in the mission the vehicle is, and what that asks of pump and pitch.
//!
//! ```text
//!              two believed depths            turn depth − carry
//!   Surface ------------------------> Dive ---------------------> InflectLow
//!                                      ^                              | rising, pump over the middle
//!                              sinking |                              v
//!   Comms <---- at the surface     InflectHigh <----------------- Climb
//!     |                    \            turn depth + carry            |
//!     | fix and shore,      `-------------- climb to the surface -----'
//!     | or patience over                                |
//!     `----> Dive                                       `----> Done (mission flown)
//!   any state --abort--> Safe: full buoyancy, for good
//! ```
//! Each state owns what only it needs. A turn is not left before it has dwelt
//! two cycles, nor held longer than its pump can need plus a minute, so no
//! sensor noise makes the machine flutter.
//!
//! In a turn the pitch wanted follows the pump: full dive pitch while the pump
//! holds dive ballast, level at neutral, full climb pitch from a share of the
//! climb ballast on.

use crate::bound::{Bound, all_finite};
use crate::config::Config;
use crate::mutant::Watch as Of;
use crate::senses::NO_DEPTH_S;
use crate::senses::Seen;
use crate::turn::{Turn, Underway};
use signals::{Leg, Micros, Mission, Phase};

/// Deeper than this is not the surface, m.
const SURFACE_M: f32 = 1.0;
/// A depth sensor may be off by this and the vehicle afloat, m.
const NEAR_M: f32 = 5.0;
/// Shortest time in a gliding state, s: two nominal cycles.
const DWELL_S: Micros = Micros::from_secs(8);
/// A dive or climb that made no way for this long turns round, s. A third of the stock same-depth limit.
pub const NO_WAY_S: u32 = 600;
/// A climb that made no way for this long is an abort, s: half the stock same-depth limit.
pub const CLIMB_STALLED_S: u32 = 900;
/// Way that counts as way, m.
pub const WAY_M: f32 = 1.0;
/// Altimeter hits that must agree before the bottom is believed.
const BOTTOM_HITS: u8 = 3;
/// Time at the surface for what calls the vehicle home to come back, s: three resets of a sensor, a guess.
const HEALS_S: f32 = 180.0;

/// Whether more than `s` seconds have passed since then, in whole numbers: cheaper than a time as f32.
fn longer(clock: Micros, since: Micros, s: u32) -> bool {
    clock.since(since) > Micros::from_secs(u64::from(s))
}

/// Longest time a turn is held, s: half as much again as its pump needs, and a minute.
#[must_use]
pub fn longest_turn_s(config: &Config) -> f32 {
    2.0 * config.pump_m3 / config.pump_rate_m3_s * 1.5 + 60.0
}

/// A climb's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Top {
    /// Turn below the surface.
    Turn,
    /// Surface for shore, then dive again.
    Shore,
    /// Surface and stay: the mission is flown.
    End,
}

/// States of the machine above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stage {
    Surface { since: Micros, believed: u8 },
    Dive { since: Micros, mark_m: f32, mark_since: Micros },
    InflectLow { since: Micros, turn: Underway },
    Climb { since: Micros, top: Top, mark_m: f32, mark_since: Micros },
    InflectHigh { since: Micros, turn: Underway },
    Comms { since: Micros, heard: bool, fixed: bool },
    Done,
    Safe,
}

/// What the mission asks for in this cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Order {
    /// Pump position, m³.
    pub(crate) ballast_m3: f32,
    /// At the surface: tail up for the antenna, mass forward.
    pub(crate) antenna_up: bool,
    /// Fin in use.
    pub(crate) steer: bool,
}

/// Mission progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Voyage {
    pub(crate) mission: Mission,
    pub(crate) stage: Stage,
    leg: u8,
    /// Dives flown in this leg.
    leg_dives: u16,
    /// Dives flown in all.
    pub(crate) dives: u16,
    pub(crate) low: Turn,
    pub(crate) high: Turn,
    bottom_hits: u8,
    last_altitude_m: f32,
    /// Dives ended by the bottom in a row.
    pub(crate) bottom_turns: u8,
    /// Dives or climbs without way in a row.
    pub(crate) no_way_turns: u8,
    /// Come home at the next chance without being in danger.
    pub(crate) homeward: bool,
    /// The same for as long as something is missing that may come back.
    pub(crate) home_for_now: bool,
    /// A climb that begins now goes on to the surface.
    pub(crate) surface_due: bool,
    /// Climbs with all that the pump has.
    pub(crate) all_out: bool,
}

impl Voyage {
    pub(crate) fn new(mission: Mission) -> Self {
        Self {
            mission,
            stage: Stage::Surface { since: Micros(0), believed: 0 },
            leg: 0,
            leg_dives: 0,
            dives: 0,
            low: Turn::default(),
            high: Turn::default(),
            bottom_hits: 0,
            last_altitude_m: f32::MAX,
            bottom_turns: 0,
            no_way_turns: 0,
            homeward: false,
            home_for_now: false,
            surface_due: false,
            all_out: false,
        }
    }

    pub(crate) fn phase(&self) -> Phase {
        match self.stage {
            Stage::Surface { .. } => Phase::Surface,
            Stage::Dive { .. } => Phase::Dive,
            Stage::InflectLow { .. } => Phase::InflectLow,
            Stage::Climb { .. } => Phase::Climb,
            Stage::InflectHigh { .. } => Phase::InflectHigh,
            Stage::Comms { .. } => Phase::Comms,
            Stage::Done => Phase::Done,
            Stage::Safe => Phase::Safe,
        }
    }

    /// The leg flown now. A damaged counter gives the last leg, no leg at all the default one.
    #[inline(never)]
    pub(crate) fn leg(&self) -> Leg {
        self.mission.legs.get(usize::from(self.leg)).or(self.mission.legs.last()).copied().unwrap_or_default()
    }

    /// Number of the leg flown now, from 0.
    pub(crate) fn leg_number(&self) -> u8 {
        self.leg
    }

    /// One cycle: moves between states.
    pub(crate) fn advance(&mut self, config: &Config, clock: Micros, seen: &Seen, leg: &Leg, ballast_m3: f32) {
        match self.stage {
            Stage::Surface { since, believed } => {
                let believed = if seen.depth_age_s <= 0.0 { believed.saturating_add(1) } else { 0 };
                self.stage = Stage::Surface { since, believed };
                if believed >= 2 && seen.pitch_rad.is_some() && !self.home_for_now {
                    self.begin_dive(clock, seen);
                }
            }
            Stage::Dive { since, mark_m, mark_since } => {
                let carry = self.low.carry_m(config, seen.rate_m_s, -ballast_m3);
                let late = 0.5 * seen.rate_m_s.at_least(0.0) * config.cycle_s;
                let deep = seen.depth_m + carry + late >= leg.depth_max_m;
                let bottom = self.bottom_is_near(config, seen, carry + late);
                let way = (seen.depth_m - mark_m).abs() > WAY_M;
                let no_way = !way && longer(clock, mark_since, Of::DiveNoWay.after(NO_WAY_S as f32) as u32) && Of::DiveNoWay.enabled();
                if way {
                    self.stage = Stage::Dive { since, mark_m: seen.depth_m, mark_since: clock };
                }
                // A dive that goes nowhere for long is turned round; the limit depth overrules the dwell.
                let dwelt = clock.since(since) >= DWELL_S || seen.depth_m >= leg.depth_max_m;
                if dwelt && (deep || bottom || no_way) {
                    self.bottom_turns = if bottom && !deep { self.bottom_turns.saturating_add(1) } else { 0 };
                    self.no_way_turns = if no_way { self.no_way_turns.saturating_add(1) } else { 0 };
                    let turn = Underway { from_m: seen.depth_m, speed_m_s: seen.rate_m_s, ballast_m3: -ballast_m3, peak_m: seen.depth_m };
                    self.stage = Stage::InflectLow { since: clock, turn };
                }
            }
            Stage::InflectLow { since, mut turn } => {
                turn.peak_m = turn.peak_m.at_least(seen.depth_m);
                self.stage = Stage::InflectLow { since, turn };
                let turned = seen.rate_m_s < -0.01 && ballast_m3 > 0.0;
                if Self::turn_is_over(config, clock.since(since), turned) {
                    if turned {
                        self.low.learn(config, &turn);
                    }
                    self.begin_climb(clock, seen);
                }
            }
            Stage::Climb { since, top, mark_m, mark_since } => {
                let blind = top == Top::Turn && seen.depth_age_s >= NO_DEPTH_S;
                let top = if self.homeward {
                    Top::End
                } else if blind {
                    Top::Shore
                } else {
                    top
                };
                self.climb(config, clock, seen, leg, ballast_m3, since, top, mark_m, mark_since);
            }
            Stage::InflectHigh { since, mut turn } => {
                turn.peak_m = turn.peak_m.at_least(-seen.depth_m);
                self.stage = Stage::InflectHigh { since, turn };
                let turned = seen.rate_m_s > 0.01 && ballast_m3 < 0.0;
                if Self::turn_is_over(config, clock.since(since), turned) {
                    if turned {
                        self.high.learn(config, &turn);
                    }
                    self.begin_dive(clock, seen);
                }
            }
            Stage::Comms { since, heard, fixed } => {
                let stage = Stage::Comms { since, heard: heard || seen.shore, fixed: fixed || seen.fix };
                self.stage = stage;
                let waited = clock.since(since);
                let served = matches!(stage, Stage::Comms { heard: true, fixed: true, .. }) && waited >= DWELL_S;
                let heals = seen.depth_age_s > 0.0 || self.home_for_now && waited.seconds() < HEALS_S;
                if (served || waited.seconds() >= config.comms_patience_s) && !heals {
                    // Not once was the antenna out, and the depth has to be held against the surface: no more dives.
                    let unseen = matches!(stage, Stage::Comms { heard: false, fixed: false, .. });
                    self.homeward |= unseen && self.surface_due;
                    // Patience alone does not make a mission flown: it ends afloat or near the surface.
                    match self.homeward || self.home_for_now {
                        true if served || seen.afloat || seen.depth_m < NEAR_M => self.stage = Stage::Done,
                        true => {}
                        false => self.begin_dive(clock, seen),
                    }
                }
            }
            Stage::Done | Stage::Safe => {}
        }
    }

    fn climb(
        &mut self,
        config: &Config,
        clock: Micros,
        seen: &Seen,
        leg: &Leg,
        ballast_m3: f32,
        since: Micros,
        top: Top,
        mark_m: f32,
        mark_since: Micros,
    ) {
        // Sinking is no way up.
        let way = mark_m - seen.depth_m > WAY_M;
        if way {
            self.stage = Stage::Climb { since, top, mark_m: seen.depth_m, mark_since: clock };
        }
        let still = !way && longer(clock, mark_since, 60);
        let dwelt = clock.since(since) >= DWELL_S;
        match top {
            Top::Turn if !self.home_for_now => {
                let carry = self.high.carry_m(config, -seen.rate_m_s, ballast_m3);
                let late = 0.5 * (-seen.rate_m_s).at_least(0.0) * config.cycle_s;
                let top_m = self.top_m(leg);
                if (dwelt || seen.depth_m <= top_m) && seen.depth_m - carry - late <= top_m {
                    let turn = Underway { from_m: -seen.depth_m, speed_m_s: -seen.rate_m_s, ballast_m3, peak_m: -seen.depth_m };
                    self.count_dive();
                    self.stage = Stage::InflectHigh { since: clock, turn };
                }
            }
            Top::Turn | Top::Shore | Top::End => {
                // A biased depth must not keep the vehicle waiting: afloat, or still near the surface, is there too. Reckoned, it may be off.
                let near = seen.depth_m < SURFACE_M || (seen.depth_m < NEAR_M && still);
                let there = seen.afloat || near && seen.depth_age_s < NO_DEPTH_S;
                if dwelt && there {
                    self.count_dive();
                    self.stage = if top == Top::End { Stage::Done } else { Stage::Comms { since: clock, heard: false, fixed: false } };
                }
            }
        }
    }

    /// Afloat after an abort that is taken back: the next dive, or the end of a mission that is flown or had called home.
    #[cold]
    pub(crate) fn go_on(&mut self, clock: Micros) {
        let flown = self.homeward || u32::from(self.dives) >= self.mission.dives();
        self.stage = if flown { Stage::Done } else { Stage::Surface { since: clock, believed: 0 } };
    }

    /// Whether the climb under way has made no way for longer than `s` seconds.
    pub(crate) fn climbs_without_way(&self, clock: Micros, s: u32) -> bool {
        match self.stage {
            Stage::Climb { mark_since, .. } => longer(clock, mark_since, s),
            _ => false,
        }
    }

    /// Whether a turn begins soon: nearer than twice the way that it would carry at the rate of now.
    pub(crate) fn turn_is_near(&self, config: &Config, seen: &Seen, leg: &Leg, ballast_m3: f32) -> bool {
        match self.stage {
            Stage::Dive { .. } => leg.depth_max_m - seen.depth_m < 2.0 * self.low.carry_m(config, seen.rate_m_s, -ballast_m3),
            Stage::Climb { .. } => seen.depth_m - self.top_m(leg) < 2.0 * self.high.carry_m(config, -seen.rate_m_s, ballast_m3),
            _ => false,
        }
    }

    fn turn_is_over(config: &Config, dwelt: Micros, turned: bool) -> bool {
        (turned && dwelt >= DWELL_S) || dwelt.seconds() >= longest_turn_s(config)
    }

    /// A leg is flown, and what is done is judged by it, until the first dive of the next one begins.
    #[cold]
    #[inline(never)]
    fn begin_dive(&mut self, clock: Micros, seen: &Seen) {
        if self.leg_dives >= self.leg().dives {
            self.leg_dives = 0;
            self.leg = self.leg.saturating_add(1);
        }
        self.bottom_hits = 0;
        self.stage = Stage::Dive { since: clock, mark_m: seen.depth_m, mark_since: clock };
    }

    #[cold]
    #[inline(never)]
    fn begin_climb(&mut self, clock: Micros, seen: &Seen) {
        let flown = self.dives.saturating_add(1);
        let every = self.mission.surface_every;
        let last = u32::from(flown) >= self.mission.dives();
        let top = if self.homeward || last {
            Top::End
        } else if self.surface_due || every > 0 && flown.is_multiple_of(every) {
            Top::Shore
        } else {
            Top::Turn
        };
        self.stage = Stage::Climb { since: clock, top, mark_m: seen.depth_m, mark_since: clock };
    }

    /// Ends the dive or turn under way: climb, whatever the mission says.
    #[cold]
    #[inline(never)]
    pub(crate) fn climb_now(&mut self, clock: Micros, seen: &Seen) {
        if matches!(self.stage, Stage::Dive { .. } | Stage::InflectHigh { .. }) {
            let turn = Underway { from_m: seen.depth_m, speed_m_s: 0.0, ballast_m3: 0.0, peak_m: seen.depth_m };
            self.stage = Stage::InflectLow { since: clock, turn };
        }
    }

    #[cold]
    #[inline(never)]
    fn count_dive(&mut self) {
        self.dives = self.dives.saturating_add(1);
        self.leg_dives = self.leg_dives.saturating_add(1);
    }

    /// Depth of the upper turn, m: that of the leg, after its last dive the next one's where that is shallower.
    fn top_m(&self, leg: &Leg) -> f32 {
        let next = self.mission.legs.get(usize::from(self.leg) + 1);
        match next {
            Some(next) if self.leg_dives.saturating_add(1) >= leg.dives => leg.depth_min_m.at_most(next.depth_min_m),
            _ => leg.depth_min_m,
        }
    }

    fn bottom_is_near(&mut self, config: &Config, seen: &Seen, carry_m: f32) -> bool {
        let Some(altitude) = seen.altitude_m else {
            self.bottom_hits = 0;
            return false;
        };
        let expected = self.last_altitude_m - seen.rate_m_s * seen.dt_s;
        let consistent = (altitude - expected).abs() < 3.0;
        self.bottom_hits = if consistent { self.bottom_hits.saturating_add(1) } else { 1 };
        self.last_altitude_m = altitude;
        self.bottom_hits >= BOTTOM_HITS && altitude < config.min_altitude_m + carry_m
    }

    /// What the state asks for.
    pub(crate) fn order(&self, config: &Config, clock: Micros, leg: &Leg) -> Order {
        let drive = leg.ballast_m3.at_least(0.0).at_most(config.pump_m3);
        let full = config.pump_m3;
        match self.stage {
            Stage::Dive { .. } | Stage::InflectHigh { .. } => Order { ballast_m3: -drive, antenna_up: false, steer: true },
            Stage::InflectLow { .. } => Order { ballast_m3: if self.all_out { full } else { drive }, antenna_up: false, steer: true },
            Stage::Climb { top, .. } => {
                // All buoyancy there is for a climb that makes no way.
                let more = self.all_out || self.climbs_without_way(clock, 120) || top != Top::Turn && drive <= 0.0;
                Order { ballast_m3: if more { full } else { drive }, antenna_up: false, steer: true }
            }
            Stage::Surface { .. } | Stage::Comms { .. } | Stage::Done => Order { ballast_m3: full, antenna_up: true, steer: false },
            Stage::Safe => Order { ballast_m3: full, antenna_up: false, steer: false },
        }
    }

    /// A counter or mark that no flight can have written.
    pub(crate) fn sane(&self) -> bool {
        let marks = match self.stage {
            Stage::Dive { mark_m, .. } | Stage::Climb { mark_m, .. } => mark_m.is_finite(),
            Stage::InflectLow { turn, .. } | Stage::InflectHigh { turn, .. } => {
                all_finite([turn.from_m, turn.peak_m, turn.speed_m_s, turn.ballast_m3])
            }
            _ => true,
        };
        marks && !self.last_altitude_m.is_nan() && usize::from(self.leg) <= self.mission.legs.len()
    }
}
