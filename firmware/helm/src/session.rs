//! The state machine of the crate doc.

use crate::objects;
use crate::silence::{PATIENCE_MS, aged};
use crate::storage::{Content, Kept, Storage};
use crate::upload::Staging;
use crate::vault::Mark;
use control::{Config, State};
use polar::Table;
use signals::link::CHUNK;
use signals::{
    Abort, Answer, Counters, Flags, Manifest, Micros, Mission, Object, Phase, Receiver, Refusal, SensorFrame, ToBoard, ToHost, Wings,
};

/// Control cycle, ms (the paper's vehicle samples every 4 s).
pub const CYCLE_MS: u32 = 4_000;
/// Farthest a frame may be ahead of the last one; beyond, it is not a gap in
/// the line (68 min of lost frames) but nonsense.
pub const MAX_GAP: u32 = 1024;
/// Deepest last reading at which [`ToBoard::Recovered`] is believed, m.
pub const RECOVERY_DEPTH_M: f32 = 5.0;

/// Where sensor frames come from; latched at boot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seat {
    /// Not decided: a hello makes it [`Seat::Host`], [`Helm::settle`] makes it
    /// [`Seat::Sensors`].
    Open,
    /// From the host over the line (hardware in the loop).
    #[default]
    Host,
    /// From the vehicle's own sensors; frames from the line are refused.
    Sensors,
}

/// What the board knows when it starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Boot {
    /// The last run ended in the middle of a mission: SAFE from the first step.
    pub reset_during_mission: bool,
    /// Why that mission had been aborted already, if it had.
    pub first_cause: Option<Abort>,
    /// Boots since first flash; 0 when not counted.
    pub boots: u32,
    /// Firmware version major, minor, patch.
    pub firmware: [u8; 3],
    /// Seat.
    pub seat: Seat,
}

impl Boot {
    /// A first boot: nothing known, frames from the host.
    pub const NEW: Self = Self { reset_during_mission: false, first_cause: None, boots: 0, firmware: [0; 3], seat: Seat::Host };
}

/// What is being done.
// The state lives once, in place; there is no heap to box it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug)]
enum Activity {
    Idle,
    Armed { mission: Mission },
    Flying { state: State, phase: Phase },
}

/// The controller behind a line.
#[derive(Clone, Debug)]
pub struct Helm<S> {
    boot: Boot,
    built_in: Config,
    /// The configuration of the mission under way.
    loaded: Option<Config>,
    storage: S,
    receiver: Receiver,
    staging: Staging,
    activity: Activity,
    /// Booted after a reset during a mission, not yet in SAFE.
    waking: bool,
    /// Uploaded table in use and the wings it is for; empty when the one built
    /// into flash is flown.
    table: Content,
    /// The table in flash, checked when the mission was taken.
    in_flash: Option<Table<'static>>,
    wings: Wings,
    table_id: u32,
    /// The last frame stepped and its answer.
    last: Option<(SensorFrame, Answer)>,
    /// The sequence is known: repeated and stale frames can be told.
    in_sequence: bool,
    /// The last hello; one since the last mission started.
    nonce: Option<u32>,
    greeted: bool,
    /// Own steps made in the present silence.
    silent_steps: u64,
    /// The last step is not in the flight log yet.
    unlogged: bool,
}

impl<S: Storage> Helm<S> {
    /// A controller that was just started. `const`, so that the board holds it
    /// in a static and never on its stack.
    #[must_use]
    pub const fn new(config: Config, boot: Boot, storage: S) -> Self {
        Self {
            boot,
            built_in: config,
            loaded: None,
            storage,
            receiver: Receiver::new(),
            staging: Staging::new(),
            activity: Activity::Idle,
            waking: boot.reset_during_mission,
            table: Content::new(),
            in_flash: None,
            wings: Wings::Standard,
            table_id: 0,
            last: None,
            in_sequence: false,
            nonce: None,
            greeted: false,
            silent_steps: 0,
            unlogged: false,
        }
    }

    /// Tells a controller made before anything was known how it was booted.
    pub fn booted(&mut self, boot: Boot) {
        self.boot = boot;
        self.waking = boot.reset_during_mission;
    }

    /// After a reset during a mission the first thing to be is SAFE.
    fn wake(&mut self) {
        if core::mem::take(&mut self.waking) {
            self.come_up_safe();
        }
    }

    #[inline(never)]
    fn come_up_safe(&mut self) {
        let config = objects::select_config(&mut self.storage, &self.built_in);
        self.take_table();
        self.activity = Activity::Flying { state: State::after_reset(self.boot.first_cause.unwrap_or(Abort::Reset)), phase: Phase::Safe };
        self.loaded = Some(config);
    }

    /// Takes one byte of the line; answers when it completes a message that
    /// wants one. Damaged frames are counted and not answered.
    pub fn byte(&mut self, byte: u8) -> Option<ToHost> {
        match self.receiver.push::<ToBoard>(byte)? {
            Ok(message) => self.handle(message),
            Err(_) => None,
        }
    }

    /// Takes one message.
    pub fn handle(&mut self, message: ToBoard) -> Option<ToHost> {
        self.wake();
        let answer = match message {
            ToBoard::Sensor(frame) => return self.sensor(&frame),
            ToBoard::Hello { nonce } => Ok(self.hello(nonce)),
            ToBoard::Begin(mission) => self.begin(mission),
            ToBoard::Recall => self.recall(),
            ToBoard::Recovered => self.recovered(),
            ToBoard::UploadBegin { object, length, crc } => {
                self.on_deck().and_then(|()| self.staging.begin(object, length, crc)).map(|offset| ToHost::Continue { offset })
            }
            ToBoard::UploadChunk { offset, data } => {
                self.on_deck().and_then(|()| self.staging.chunk(offset, &data)).map(|offset| ToHost::Continue { offset })
            }
            ToBoard::UploadCommit => self.commit(),
            ToBoard::Rollback(object) => self.rollback(object),
            ToBoard::ReadBack { object, offset } => self.read_back(object, offset),
            ToBoard::Report => Ok(ToHost::Counters(self.receiver.counters)),
        };
        Some(answer.unwrap_or_else(ToHost::Refused))
    }

    /// One cycle on the vehicle's own sensors: [`Seat::Sensors`] only.
    /// `None` when there is nothing to fly.
    pub fn cycle(&mut self, frame: &SensorFrame) -> Option<Answer> {
        self.wake();
        if self.boot.seat != Seat::Sensors { None } else { self.step(frame) }
    }

    /// Tells how long the line has been silent by the board's own clock.
    /// Steps at most once per call, once per control cycle, after
    /// [`PATIENCE_MS`]. The answer holds for the actuators; nobody asked for
    /// it over the line.
    #[inline(never)]
    pub fn silent(&mut self, silence: Micros) -> Option<Answer> {
        let cycle = Micros::from_millis(CYCLE_MS.into());
        let due = silence.since(Micros::from_millis(PATIENCE_MS)).0 / cycle.0;
        if self.boot.seat != Seat::Host || due <= self.silent_steps {
            return None;
        }
        let (frame, _) = self.last?;
        self.silent_steps = due;
        let Activity::Flying { state, phase } = &mut self.activity else { return None };
        state.abort(Abort::LinkLost);
        let old = aged(&frame, silence);
        let answer =
            advance(self.loaded.as_ref().unwrap_or(&self.built_in), &self.table, self.in_flash.as_ref(), self.wings, state, phase, &old);
        Some(answer)
    }

    /// Whether a reset now would be one during a mission.
    #[must_use]
    pub fn mission_in_progress(&self) -> bool {
        self.waking || matches!(&self.activity, Activity::Flying { phase, .. } if *phase != Phase::Done)
    }

    /// What a reset must find again.
    #[must_use]
    pub fn mark(&self) -> Mark {
        if !self.mission_in_progress() {
            return Mark::NONE;
        }
        let first_cause = match &self.activity {
            Activity::Flying { state, .. } => state.first_cause(),
            Activity::Idle | Activity::Armed { .. } => self.boot.first_cause,
        };
        Mark::mission(self.boot.seat == Seat::Sensors, first_cause)
    }

    /// Keeps the mark of the mission in step with what is being done. Call it
    /// before anything that was answered leaves the board: then no command of
    /// a mission is ever out without its mark.
    pub fn keep_mark(&mut self) {
        let mark = self.mark();
        self.storage.mark(mark);
    }

    /// Writes the last step to the flight log, once. It may take as long as
    /// the part needs for an erase: call it when the answer is on its way.
    pub fn keep_log(&mut self) {
        if core::mem::take(&mut self.unlogged)
            && let Some((frame, answer)) = &self.last
        {
            self.storage.log(frame, answer);
        }
    }

    /// What is known of the line.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.receiver.counters
    }

    /// Counts bytes the board lost before they got here.
    pub fn lost_bytes(&mut self, count: u32) {
        let overflow = &mut self.receiver.counters.overflow;
        *overflow = overflow.saturating_add(count);
    }

    /// The last frame stepped and its answer.
    #[must_use]
    pub const fn last(&self) -> Option<&(SensorFrame, Answer)> {
        self.last.as_ref()
    }

    /// What keeps objects.
    pub const fn storage(&mut self) -> &mut S {
        &mut self.storage
    }

    /// What the board says of itself.
    #[inline(never)]
    pub fn manifest(&mut self) -> Manifest {
        Manifest {
            firmware: self.boot.firmware,
            table_standard: objects::identity(&mut self.storage, &self.built_in, Object::Table(Wings::Standard)),
            table_low_ar: objects::identity(&mut self.storage, &self.built_in, Object::Table(Wings::LowAspectRatio)),
            config: objects::identity(&mut self.storage, &self.built_in, Object::Config),
            cycle_ms: CYCLE_MS,
            boots: self.boot.boots,
            hil: self.boot.seat == Seat::Host,
        }
    }

    /// Where sensor frames come from.
    #[must_use]
    pub const fn seat(&self) -> Seat {
        self.boot.seat
    }

    /// The time for a hello is over: an open seat is the vehicle's own sensors.
    pub fn settle(&mut self) {
        if self.boot.seat == Seat::Open {
            self.boot.seat = Seat::Sensors;
        }
    }

    fn hello(&mut self, nonce: u32) -> ToHost {
        if self.boot.seat == Seat::Open {
            self.boot.seat = Seat::Host;
        }
        if self.nonce != Some(nonce) {
            // A new conversation: the host counts from where it likes. A late
            // copy of the old hello must not unlock a second step of one frame.
            self.nonce = Some(nonce);
            self.greeted = true;
            self.in_sequence = false;
        }
        ToHost::Hello { nonce, manifest: self.manifest() }
    }

    #[inline(never)]
    fn begin(&mut self, mut mission: Mission) -> Result<ToHost, Refusal> {
        match &self.activity {
            Activity::Flying { phase: Phase::Safe, .. } => return Err(Refusal::Safe),
            Activity::Flying { phase, .. } if *phase != Phase::Done => return Err(Refusal::NotNow),
            _ if !self.greeted => return Err(Refusal::NotNow),
            _ => {}
        }
        self.staging.abandon();
        let mut bytes = Content::new();
        if mission.legs.is_empty()
            && self.storage.load(Object::Mission, &mut bytes)
            && let Some(stored) = objects::mission(&bytes)
        {
            mission = stored;
        }
        let config = objects::select_config(&mut self.storage, &self.built_in);
        mission.validate(config.working_depth_m, config.pump_m3).map_err(Refusal::Mission)?;
        self.loaded = Some(config);
        self.wings = mission.wings;
        self.take_table();
        self.activity = Activity::Armed { mission };
        self.last = None;
        self.in_sequence = false;
        Ok(ToHost::Ready { table_id: self.table_id })
    }

    fn recall(&mut self) -> Result<ToHost, Refusal> {
        match &mut self.activity {
            Activity::Idle => return Err(Refusal::NotNow),
            Activity::Armed { .. } => self.activity = Activity::Idle,
            Activity::Flying { state, .. } => state.recall(),
        }
        Ok(ToHost::Done { crc: 0 })
    }

    #[inline(never)]
    fn recovered(&mut self) -> Result<ToHost, Refusal> {
        let deep = self.last.is_some_and(|(frame, _)| frame.depth_m.accept(RECOVERY_DEPTH_M..=f32::MAX, u32::MAX).is_some());
        match self.activity {
            Activity::Flying { phase: Phase::Safe | Phase::Done, .. } if !deep => self.activity = Activity::Idle,
            Activity::Flying { .. } => return Err(Refusal::NotNow),
            Activity::Idle | Activity::Armed { .. } => {}
        }
        self.last = None;
        self.in_sequence = false;
        Ok(ToHost::Done { crc: 0 })
    }

    #[inline(never)]
    fn sensor(&mut self, frame: &SensorFrame) -> Option<ToHost> {
        if self.boot.seat != Seat::Host || matches!(self.activity, Activity::Idle) {
            return Some(ToHost::Refused(Refusal::NotNow));
        }
        if let Some((last, answer)) = &self.last {
            let counters = &mut self.receiver.counters;
            let ahead = frame.seq.wrapping_sub(last.seq);
            // The very same frame is a repetition even after a new hello.
            if (self.in_sequence && ahead == 0) || frame == last {
                counters.repeated = counters.repeated.saturating_add(1);
                return Some(ToHost::Answer(*answer));
            }
            if self.in_sequence && ahead > MAX_GAP {
                counters.stale = counters.stale.saturating_add(1);
                return None;
            }
        }
        self.step(frame).map(ToHost::Answer)
    }

    /// One step of the law; starts the mission if one is armed.
    #[inline(never)]
    fn step(&mut self, frame: &SensorFrame) -> Option<Answer> {
        self.cast_off(frame.time);
        let Activity::Flying { state, phase } = &mut self.activity else { return None };
        let mut answer =
            advance(self.loaded.as_ref().unwrap_or(&self.built_in), &self.table, self.in_flash.as_ref(), self.wings, state, phase, frame);
        if self.storage.log_lost() {
            answer.trace.flags = answer.trace.flags.with(Flags::LOG_FULL);
        }
        self.unlogged = true;
        self.last = Some((*frame, answer));
        self.in_sequence = true;
        self.silent_steps = 0;
        Some(answer)
    }

    /// Takes the table of the wings into use: the uploaded one if it is good,
    /// else the one in flash.
    fn take_table(&mut self) {
        self.in_flash = polar::builtin(self.wings).ok();
        self.table_id = match objects::uploaded_table(&mut self.storage, self.wings, &mut self.table) {
            Some(id) => id,
            None => self.in_flash.as_ref().map_or(0, Table::id),
        };
    }

    /// An armed mission starts.
    #[inline(never)]
    fn cast_off(&mut self, now: Micros) {
        if let Activity::Armed { mission } = &self.activity {
            let state = State::new(self.loaded.as_ref().unwrap_or(&self.built_in), mission.clone(), now);
            self.activity = Activity::Flying { state, phase: Phase::Surface };
            self.greeted = false;
        }
    }

    /// Objects change on deck only: not while a mission is armed or flown.
    fn on_deck(&self) -> Result<(), Refusal> {
        match &self.activity {
            Activity::Idle => Ok(()),
            Activity::Flying { phase: Phase::Done, .. } => Ok(()),
            Activity::Flying { phase: Phase::Safe, .. } => Err(Refusal::Safe),
            _ => Err(Refusal::NotNow),
        }
    }

    #[inline(never)]
    fn commit(&mut self) -> Result<ToHost, Refusal> {
        self.on_deck()?;
        if let Some((crc, kept)) = self.staging.just_taken() {
            return Ok(said(kept, crc));
        }
        let (object, crc, bytes) = self.staging.complete()?;
        let config = objects::select_config(&mut self.storage, &self.built_in);
        objects::check(object, bytes, &config)?;
        let kept = self.storage.save(object, bytes)?;
        self.staging.close(crc, kept);
        Ok(said(kept, crc))
    }

    #[inline(never)]
    fn rollback(&mut self, object: Object) -> Result<ToHost, Refusal> {
        self.on_deck()?;
        self.staging.abandon();
        let kept = self.storage.rollback(object)?;
        Ok(said(kept, objects::identity(&mut self.storage, &self.built_in, object)))
    }

    #[inline(never)]
    fn read_back(&mut self, object: Object, offset: u32) -> Result<ToHost, Refusal> {
        let mut piece = [0; CHUNK];
        let length = if object == Object::Log {
            self.storage.read_log(offset, &mut piece)
        } else {
            let mut bytes = Content::new();
            objects::in_use(&mut self.storage, &self.built_in, object, &mut bytes);
            let rest = bytes.get(offset as usize..).unwrap_or_default();
            piece.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            bytes.len() as u32
        };
        let offset = offset.min(length);
        let there = length.saturating_sub(offset) as usize;
        let mut data = heapless::Vec::new();
        piece.iter().take(there).try_for_each(|b| data.push(*b)).map_err(|_| Refusal::TooLong)?;
        Ok(ToHost::Content { offset, length, data })
    }
}

// The borders marked `inline(never)` keep frames of the rare branches out of
// the stack of the frequent one; without them the loop's frame is their sum.

/// An uploaded table lives in RAM, so it is checked again in every cycle; a
/// damaged one gives way to the one in flash.
fn advance(
    config: &Config,
    uploaded: &[u8],
    in_flash: Option<&Table<'static>>,
    wings: Wings,
    state: &mut State,
    phase: &mut Phase,
    frame: &SensorFrame,
) -> Answer {
    let uploaded = if uploaded.is_empty() { None } else { Table::parse(uploaded, wings).ok() };
    let table = uploaded.as_ref().or(in_flash);
    let mut answer = control::step(config, table, state, frame.time, frame);
    answer.command.seq = frame.seq;
    *phase = answer.trace.phase;
    answer
}

const fn said(kept: Kept, crc: u32) -> ToHost {
    match kept {
        Kept::ForGood => ToHost::Done { crc },
        Kept::UntilReset => ToHost::Volatile { crc },
    }
}
