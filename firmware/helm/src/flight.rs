//! What must be the same at the next step as it was after the last: the mission, its state, its configuration, its table.
//!
//! All of it lies in one place, so that one sum seals it (see [`crate::seal`]).

use crate::afloat::Afloat;
use crate::mark::{Mark, Seat};
use crate::objects;
use crate::storage::{Content, Storage};
use control::{Config, State};
use polar::Table;
use signals::{Abort, Answer, Flags, Micros, Mission, Phase, SensorFrame, Wings};

/// Control cycle, ms (the paper's vehicle samples every 4 s).
pub const CYCLE_MS: u32 = 4_000;
/// Own cycles in a row that may come late before it is [`Abort::Overrun`].
const LATE_CYCLES: u8 = 3;

/// What is being done.
// The state lives once, in place; there is no heap to box it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
pub(crate) enum Activity {
    Idle,
    Armed { mission: Mission },
    Flying { state: State, phase: Phase },
}

/// Which conversation may do what.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Session {
    /// Of the last hello.
    pub(crate) nonce: Option<u32>,
    /// Given with it.
    pub(crate) present: Option<u32>,
    /// The one that began the mission.
    pub(crate) flight: Option<u32>,
    /// Said hello since the last mission started.
    pub(crate) greeted: bool,
}

/// See the file's text.
#[derive(Clone, Debug)]
pub(crate) struct Flight {
    pub(crate) seat: Seat,
    pub(crate) activity: Activity,
    /// Booted during this mission, not yet in SAFE.
    waking: Option<Mark>,
    /// The drop weight was fired in this mission.
    weight_fired: bool,
    pub(crate) session: Session,
    /// The configuration of the mission under way.
    pub(crate) config: Option<Config>,
    /// Uploaded table in use and the wings it is for; empty when the one built into flash is flown.
    table: Content,
    /// The table in flash, checked when the mission was taken.
    in_flash: Option<Table<'static>>,
    wings: Wings,
    /// The last frame stepped and its answer.
    pub(crate) last: Option<(SensorFrame, Answer)>,
    /// Number of the last frame stepped; unknown after a reset in flight.
    pub(crate) sequence: Option<u32>,
    pub(crate) afloat: Afloat,
    /// Own steps made in the present silence.
    pub(crate) silent_steps: u64,
    /// The last step is not in the flight log yet.
    pub(crate) unlogged: bool,
    /// Own cycles in a row that came late.
    late: u8,
}

impl Flight {
    /// Nothing to fly, or a mission that a reset interrupted.
    pub(crate) const fn new(seat: Seat, interrupted: Option<Mark>) -> Self {
        Self {
            seat,
            activity: Activity::Idle,
            waking: interrupted,
            weight_fired: false,
            session: Session { nonce: None, present: None, flight: None, greeted: false },
            config: None,
            table: Content::new(),
            in_flash: None,
            wings: Wings::Standard,
            last: None,
            sequence: None,
            afloat: Afloat::new(),
            silent_steps: 0,
            unlogged: false,
            late: 0,
        }
    }

    /// After a reset during a mission the first thing to be is SAFE.
    pub(crate) fn wake(&mut self, storage: &mut impl Storage, built_in: &Config) {
        if let Some(mark) = self.waking.take() {
            self.come_up_safe(mark, storage, built_in);
        }
    }

    #[cold]
    #[inline(never)]
    fn come_up_safe(&mut self, mark: Mark, storage: &mut impl Storage, built_in: &Config) {
        self.take_table(self.wings, storage);
        self.config = Some(objects::select_config(storage, built_in));
        let mut state = State::after_reset(mark.first_cause().unwrap_or(Abort::Reset));
        if mark.weight_fired() {
            state.fire_weight();
        }
        self.weight_fired = mark.weight_fired();
        self.activity = Activity::Flying { state, phase: Phase::Safe };
    }

    /// A mission is taken; it starts with the next frame. Returns the identity of its table.
    pub(crate) fn arm(&mut self, mission: Mission, config: Config, seat: Seat, storage: &mut impl Storage) -> u32 {
        let id = self.take_table(mission.wings, storage);
        storage.begin_log();
        self.config = Some(config);
        self.seat = seat;
        self.activity = Activity::Armed { mission };
        self.session.flight = self.session.present;
        self.forget_frames();
        // The frames of a mission are numbered from 0.
        self.sequence = Some(u32::MAX);
        id
    }

    /// No mission any more.
    pub(crate) fn disarm(&mut self) {
        self.activity = Activity::Idle;
        self.weight_fired = false;
        if self.seat == Seat::Sensors {
            self.seat = Seat::Open;
        }
        self.forget_frames();
    }

    fn forget_frames(&mut self) {
        self.last = None;
        self.sequence = None;
        self.afloat = Afloat::new();
        self.silent_steps = 0;
        self.late = 0;
    }

    /// Takes the table of the wings into use: the uploaded one if it is good, else the one in flash. Returns its identity.
    fn take_table(&mut self, wings: Wings, storage: &mut impl Storage) -> u32 {
        self.wings = wings;
        self.in_flash = polar::builtin(wings).ok();
        match objects::uploaded_table(storage, wings, &mut self.table) {
            Some(id) => id,
            None => self.in_flash.as_ref().map_or(0, Table::id),
        }
    }

    /// Phase of the mission under way, or of none.
    pub(crate) fn phase(&self) -> Option<Phase> {
        match &self.activity {
            Activity::Flying { phase, .. } => Some(*phase),
            _ => None,
        }
    }

    /// Whether a reset now would be one during a mission.
    pub(crate) fn mission_in_progress(&self) -> bool {
        self.waking.is_some() || self.phase().is_some_and(|phase| phase != Phase::Done)
    }

    /// The mission that is flown, or over with the vehicle still afloat.
    pub(crate) fn mission(&self) -> Mark {
        match (&self.activity, self.waking) {
            (_, Some(mark)) => mark,
            (Activity::Flying { state, .. }, None) => Mark::mission(self.seat, state.first_cause(), self.weight_fired),
            _ => Mark::NONE,
        }
    }

    /// Whether a reset finds nothing to go on with. A backseat needs nobody to begin: its mission is not over until it is called
    /// recovered, else a reset afloat would dive again.
    pub(crate) fn is_over(&self) -> bool {
        let awaits = self.phase() == Some(Phase::Done) && self.seat == Seat::Backseat;
        !self.mission_in_progress() && !awaits
    }

    /// What a reset must find again.
    pub(crate) fn mark(&self) -> Mark {
        if self.is_over() { Mark::NONE } else { self.mission() }
    }

    /// Comes home for a reason found outside the law.
    pub(crate) fn abort(&mut self, cause: Abort) {
        if let Activity::Flying { state, .. } = &mut self.activity {
            state.abort(cause);
        }
    }

    /// An armed mission starts.
    #[inline(never)]
    fn cast_off(&mut self, built_in: &Config, now: Micros) {
        if let Activity::Armed { mission } = &self.activity {
            let mut state = State::new(self.config.as_ref().unwrap_or(built_in), mission.clone(), now);
            // A glider that was told of an emergency has ended its mission itself.
            if self.seat == Seat::Backseat {
                state.stays_safe();
            }
            self.activity = Activity::Flying { state, phase: Phase::Surface };
            self.session.greeted = false;
        }
    }

    /// One step of the law; starts the mission if one is armed.
    #[inline(never)]
    pub(crate) fn step(&mut self, built_in: &Config, frame: &SensorFrame, log_lost: bool) -> Option<Answer> {
        self.cast_off(built_in, frame.time);
        let mut answer = self.advance(built_in, frame)?;
        if log_lost {
            answer.trace.flags = answer.trace.flags.with(Flags::LOG_FULL);
        }
        self.unlogged = true;
        self.last = Some((*frame, answer));
        self.sequence = Some(frame.seq);
        self.silent_steps = 0;
        Some(answer)
    }

    /// Cycles on own sensors that come late again and again are a controller that does not keep up.
    pub(crate) fn watch_pace(&mut self, now: Micros) {
        let span = self.last.as_ref().map_or(Micros(0), |(last, _)| now.since(last.time));
        let late = span > Micros::from_millis(2 * CYCLE_MS as u64);
        self.late = if late { self.late.saturating_add(1) } else { 0 };
        if self.late >= LATE_CYCLES {
            self.abort(Abort::Overrun);
        }
    }

    /// The table that is flown; checked when it was taken, and under the seal since.
    pub(crate) fn table(&self) -> Option<Table<'_>> {
        let uploaded = if self.table.is_empty() { None } else { Table::checked_before(&self.table, self.wings) };
        uploaded.or(self.in_flash)
    }

    /// The law's step on a frame of now, or on one grown old.
    #[inline(never)]
    pub(crate) fn advance(&mut self, built_in: &Config, frame: &SensorFrame) -> Option<Answer> {
        let Activity::Flying { state, phase } = &mut self.activity else { return None };
        // Checked when it was taken, and under the seal since.
        let uploaded = if self.table.is_empty() { None } else { Table::checked_before(&self.table, self.wings) };
        let table = uploaded.as_ref().or(self.in_flash.as_ref());
        let mut answer = control::step(self.config.as_ref().unwrap_or(built_in), table, state, frame.time, frame);
        answer.command.seq = frame.seq;
        *phase = answer.trace.phase;
        self.weight_fired |= answer.command.drop_weight || answer.trace.flags.contains(Flags::WEIGHT_FIRED);
        self.afloat.take(frame);
        Some(answer)
    }
}
