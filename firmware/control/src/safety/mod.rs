//! When to come home, and how: independent of the mission.
//!
//! Looks at what is believed, what was commanded and how long ago; knows
//! nothing of dives, goals or tables. Its answer is a [`Verdict`]; an abort in
//! it is latched with its first cause: full buoyancy, pitch for ascent, fin
//! straight, beacon. It is taken back afloat only, where what failed has come back ([`resume`]).
//!
//! | file | watches | causes |
//! |---|---|---|
//! | `depth` | too deep, no depth, depths apart, depth that does not move though it must | OverDepth, SensorDepth, StuckDepth, LinkLost |
//! | `attitude` | pitch and heading | SensorPitch, NoHeading |
//! | `actuators` | pump, battery mass, fin | BallastFeedback, PumpStuck, MassStuck, FinStuck |
//! | `surfacing` | how long ago the depth was held against the surface | – |
//! | `load` | weight that the motion shows | Stalled |
//! | `supply` | leak, vacuum, voltage, charge, time, shore | Leak, Vacuum, Undervoltage, LowCharge, OverTime, NoComms |
//! | `resume` | whether a mission that a glitch ended goes on, afloat | – |
//! | `release` | the drop weight, by depth zone | – |
//!
//! Priority: ascent before link before mission. A sensor's failure leads to
//! ascent, never to "carry on with the last value".

use crate::bound::Bound;

pub(crate) mod actuators;
pub(crate) mod attitude;
pub(crate) mod depth;
pub(crate) mod load;
pub(crate) mod release;
pub(crate) mod resume;
pub(crate) mod supply;
pub(crate) mod surfacing;

use crate::config::Config;
use crate::mutant::Watch as Of;
use crate::senses::Seen;
use signals::{Abort, ActuatorCommand, Flags, Micros, Phase, SensorFrame};

pub(crate) use release::Release;

/// What the watches look at in one cycle.
pub(crate) struct Watch<'a> {
    pub(crate) config: &'a Config,
    pub(crate) clock: Micros,
    pub(crate) seen: &'a Seen,
    pub(crate) frame: &'a SensorFrame,
    /// Command of the cycle before.
    pub(crate) commanded: &'a ActuatorCommand,
    /// Where the pump is believed to be, m³.
    pub(crate) ballast_m3: f32,
    /// Depth rate that the table gives for this pitch on the pump's buoyancy alone, m/s; none: no steady glide.
    pub(crate) table_rate_m_s: Option<f32>,
    pub(crate) phase: Phase,
    /// Deepest depth of the leg, m.
    pub(crate) leg_max_m: f32,
    pub(crate) max_duration_s: u32,
    /// The climb under way has made no way for a quarter of an hour.
    pub(crate) climb_stalled: bool,
    /// Turns in a row forced by a lack of way.
    pub(crate) no_way_turns: u8,
    /// Turns in a row forced by the bottom.
    pub(crate) bottom_turns: u8,
}

impl Watch<'_> {
    /// In the water and on its way.
    pub(crate) fn gliding(&self) -> bool {
        matches!(self.phase, Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh)
    }

    /// Time of one cycle, s, nominal or longer.
    pub(crate) fn cycle_s(&self) -> f32 {
        self.config.cycle_s.at_least(self.seen.dt_s)
    }
}

/// What safety decides in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Verdict {
    /// First cause of an abort, once there is one.
    pub(crate) abort: Option<Abort>,
    /// Climb for now, without an abort.
    pub(crate) climb: bool,
    /// Come home at the end of this climb.
    pub(crate) homeward: bool,
    /// The same as long as it stands: what is missing may come back.
    pub(crate) home_for_now: bool,
    /// A climb that begins now goes on to the surface.
    pub(crate) surface: bool,
    /// All buoyancy that the pump has in a climb.
    pub(crate) pump_full: bool,
    /// The pump does not follow, or stands where it cannot lift.
    pub(crate) pump_lost: bool,
    /// All that the pump has does not lift what hangs on the vehicle.
    pub(crate) pump_loses: bool,
    /// Keep the battery mass where it is.
    pub(crate) hold_mass: bool,
    /// Do not learn from the pitch reading.
    pub(crate) distrust_pitch: bool,
    /// Pump position to command instead of the wanted one, m³.
    pub(crate) pump_instead_m3: Option<f32>,
    /// More than the pump lifts hung on the vehicle in a dive.
    pub(crate) loaded: bool,
    /// Three of the last five samples found water in the hull.
    pub(crate) leak_stands: bool,
    /// No leak detector answers: water in the hull shows in the motion alone.
    pub(crate) unguarded: bool,
    /// Fire the drop weight.
    pub(crate) drop_weight: bool,
    /// The vehicle sinks though pump and weight do what they can.
    pub(crate) sinks_on: bool,
    /// The mission goes on: its abort is taken back.
    pub(crate) resumed: bool,
    /// Degradations.
    pub(crate) flags: Flags,
}

impl Verdict {
    /// Notes a cause unless there is one already.
    fn cause(&mut self, cause: Abort) {
        self.abort = self.abort.or(Some(cause));
    }

    fn flag(&mut self, flag: Flags) {
        self.flags = self.flags.with(flag);
    }
}

/// Guard word of a state without an abort; any other value is an abort.
const CLEAR: u32 = 0x0C1E_A25A;

/// Memory of the watches, and the latch.
#[derive(Clone, Debug)]
pub(crate) struct Safety {
    latched: Option<Abort>,
    /// Second copy of "not aborted": a flipped bit in either leads to SAFE.
    guard: u32,
    depth: depth::DepthWatch,
    attitude: attitude::AttitudeWatch,
    actuators: actuators::ActuatorWatch,
    supply: supply::SupplyWatch,
    surfacing: surfacing::SurfacingWatch,
    load: load::LoadWatch,
    release: Release,
    resume: resume::Resume,
}

impl Default for Safety {
    fn default() -> Self {
        Self {
            latched: None,
            guard: CLEAR,
            depth: depth::DepthWatch::default(),
            attitude: attitude::AttitudeWatch::default(),
            actuators: actuators::ActuatorWatch::default(),
            supply: supply::SupplyWatch::default(),
            surfacing: surfacing::SurfacingWatch::default(),
            load: load::LoadWatch::default(),
            release: Release::default(),
            resume: resume::Resume::default(),
        }
    }
}

impl Safety {
    /// Latches an abort; the first cause stays.
    pub(crate) fn latch(&mut self, cause: Abort) {
        self.latched = self.latched.or(Some(cause));
        self.guard = 0;
    }

    /// First cause, once there is one.
    pub(crate) fn aborted(&self) -> Option<Abort> {
        match self.latched {
            None if self.guard != CLEAR => Some(Abort::Internal),
            latched => latched,
        }
    }

    /// The mission does not go on, whatever comes back.
    pub(crate) fn never_resume(&mut self) {
        self.resume.never();
    }

    /// The weight was fired before a reset.
    pub(crate) fn fire_weight(&mut self) {
        self.release.fire_on();
    }

    /// Judges one cycle.
    pub(crate) fn judge(&mut self, w: &Watch<'_>) -> Verdict {
        if let Some(cause) = self.aborted() {
            self.latch(cause);
        }
        // What is found now, whatever was found before.
        let mut v = Verdict::default();
        // Order is rank: of two causes in one cycle the first named is kept.
        self.supply.watch(w, &mut v);
        self.depth.watch(w, &mut v);
        self.surfacing.watch(w, &mut v);
        self.actuators.watch(w, &mut v);
        self.attitude.watch(w, &mut v);
        self.load.watch(w, &mut v);
        let weight_lost = self.release.lost(w.frame.weight);
        if self.resume.due(w, &v, self.latched, self.release.is_quiet()) {
            (self.latched, self.guard) = (None, CLEAR);
            v.resumed = true;
        }
        v.abort = self.latched.or(v.abort);
        if w.bottom_turns >= 5 {
            v.cause(Abort::Bottom);
        }
        if w.no_way_turns >= 2 || (w.climb_stalled && Of::ClimbNoWay.enabled()) {
            v.cause(Abort::Stalled);
        }
        if weight_lost && Of::WeightLost.enabled() {
            v.cause(Abort::Degraded);
        }
        let sinks = self.release.sinks(w, v.abort.is_some(), v.loaded);
        if sinks && Of::SinksOn.enabled() || self.release.floats_below(w) && Of::FloatsBelow.enabled() {
            v.cause(Abort::Stalled);
        }
        v.drop_weight = self.release.fire(w, &v);
        if v.drop_weight {
            // Without another cause no time is left: everything goes up with the weight.
            v.cause(Abort::OverDepth);
        }
        if let Some(cause) = v.abort {
            self.latch(cause);
        }
        v.sinks_on = self.release.sunk();
        if self.release.has_fired() {
            v.flag(Flags::WEIGHT_FIRED);
        }
        if self.resume.has_resumed() {
            v.flag(Flags::RESUMED);
        }
        v
    }
}
