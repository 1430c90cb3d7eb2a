//! The state machine of the crate doc.

mod backseat;
mod image;
mod transfer;

use crate::afloat::Afloat;
use crate::boot::Boot;
use crate::deck::Deck;
use crate::flight::{Activity, Flight};
use crate::glides::Glides;
use crate::limits;
use crate::mark::{Copies, Mark, Seat};
use crate::objects;
use crate::seal::Sum;
use crate::silence::{PATIENCE_MS, aged};
use crate::storage::{Content, Storage};
use crate::upload::{Incoming, Staging};
use crate::utc::UtcClock;
use control::Config;
use signals::link::CRC32;
use signals::{
    Abort, Answer, Counters, Manifest, Micros, Mission, Object, Phase, Receiver, Refusal, Reply, Request, SensorFrame, ToBoard, ToHost,
    Wings,
};

pub use crate::flight::CYCLE_MS;

/// Farthest a frame may be ahead of the last one; beyond, it is not a gap in the line (68 min of lost frames) but nonsense.
pub const MAX_GAP: u32 = 1024;

/// Silence of the line after which a vehicle that was seen afloat has to be seen again, ms: three cycles.
const AFLOAT_HOLDS_MS: u64 = 3 * CYCLE_MS as u64;

/// The controller behind a line.
#[derive(Debug)]
pub struct Helm<S> {
    boots: u32,
    firmware: [u8; 3],
    salt: u32,
    built_in: Config,
    storage: S,
    receiver: Receiver,
    staging: Staging,
    incoming: Incoming,
    restart: bool,
    pub(crate) flight: Flight,
    glides: Glides,
    seal: Sum,
    marks: Copies,
    /// Checks on deck.
    pub deck: Deck,
    /// What time it is, from the time since boot that its caller sets.
    pub utc: UtcClock,
    /// Takes a mend back: the model check must find what it was for.
    #[cfg(test)]
    pub(crate) mutant: Option<crate::tests::model_check::Mutant>,
}

impl<S: Clone> Clone for Helm<S> {
    fn clone(&self) -> Self {
        let mut copy = Self {
            boots: self.boots,
            firmware: self.firmware,
            salt: self.salt,
            built_in: self.built_in.clone(),
            storage: self.storage.clone(),
            receiver: self.receiver.clone(),
            staging: self.staging.clone(),
            incoming: self.incoming,
            restart: self.restart,
            flight: self.flight.clone(),
            glides: self.glides.clone(),
            seal: Sum::NONE,
            marks: self.marks,
            deck: self.deck,
            utc: self.utc,
            #[cfg(test)]
            mutant: self.mutant,
        };
        // A copy has other gaps between its fields. A broken seal stays one.
        if self.seal == Sum::over(&self.flight) {
            copy.seal = Sum::over(&copy.flight);
        }
        copy
    }
}

impl<S: Storage> Helm<S> {
    /// A controller that was just started. `const`, so that the board holds it in a static and never on its stack.
    #[must_use]
    pub const fn new(config: Config, boot: Boot, storage: S) -> Self {
        Self {
            boots: boot.boots,
            firmware: boot.firmware,
            salt: boot.salt,
            built_in: config,
            storage,
            receiver: Receiver::new(),
            staging: Staging::new(),
            incoming: Incoming::None,
            restart: false,
            flight: flight_after(boot.mark),
            glides: Glides::new(),
            seal: Sum::NONE,
            marks: Copies::new(),
            deck: Deck::new(),
            utc: UtcClock::new(),
            #[cfg(test)]
            mutant: None,
        }
    }

    /// Tells a controller made before anything was known how it was booted.
    pub fn booted(&mut self, boot: Boot) {
        (self.boots, self.firmware, self.salt) = (boot.boots, boot.firmware, boot.salt);
        self.flight = flight_after(boot.mark);
        self.seal();
    }

    /// Nothing is done on memory that is not as it was left.
    fn unseal(&mut self) {
        #[cfg(test)]
        if self.mutant == Some(crate::tests::model_check::Mutant::NoSeal) {
            return;
        }
        if let Some(mark) = self.marks.mission() {
            // Idle, and the mark says "in mission": no step would ever be made again.
            let lost = mark.in_mission() && !self.flight.mission().in_mission();
            if lost || self.seal != Sum::over(&self.flight) {
                self.broken(mark);
            }
        }
    }

    /// A mission under way goes on in SAFE, one that is over ends there; without one there is nothing to lose.
    #[cold]
    #[inline(never)]
    fn broken(&mut self, mark: Mark) {
        let mark = match (mark.in_mission(), mark.first_cause()) {
            (true, None) => Mark::mission(mark.seat(), Some(Abort::Internal), mark.weight_fired()),
            _ => mark,
        };
        // What a flipped bit left there is overwritten, not dropped.
        core::mem::forget(core::mem::replace(&mut self.flight, flight_after(mark)));
    }

    fn seal(&mut self) {
        self.marks.keep(self.flight.mission(), self.flight.is_over());
        self.seal = Sum::over(&self.flight);
    }

    /// Whatever is done is done between an intact seal and a new one.
    #[inline(never)]
    fn sealed<T>(&mut self, act: impl FnOnce(&mut Self) -> T) -> T {
        self.unseal();
        self.flight.wake(&mut self.storage, &self.built_in);
        let done = act(self);
        self.seal();
        done
    }

    /// Takes one byte of the line; answers when it completes a message that wants one. Damaged frames are counted and not answered.
    pub fn byte(&mut self, byte: u8) -> Option<Reply> {
        match self.receiver.push::<Request>(byte)? {
            Ok(request) => Some(self.request(request)),
            Err(_) => None,
        }
    }

    /// What the mission under way has learned of its table: see [`State::learned`](control::State::learned).
    #[must_use]
    pub fn learned(&self) -> Option<[f32; 3]> {
        if let Activity::Flying { state, .. } = &self.flight.activity { Some(state.learned()) } else { None }
    }

    /// Takes one request; the reply names it.
    pub fn request(&mut self, request: Request) -> Reply {
        let Request { session, id, message } = request;
        let reply = self.sealed(|helm| match helm.admit(session, &message) {
            Ok(()) => helm.answer(message),
            Err(why) => ToHost::Refused(why),
        });
        Reply { to: id, message: reply }
    }

    /// Takes one message as one of the present session: for callers in the same program.
    pub fn handle(&mut self, message: ToBoard) -> ToHost {
        self.sealed(|helm| helm.answer(message))
    }

    /// What changes something must be of the present session, or, for frames, of the one that began the mission.
    fn admit(&self, session: u32, message: &ToBoard) -> Result<(), Refusal> {
        let of = &self.flight.session;
        let free = matches!(
            message,
            ToBoard::Hello { .. }
                | ToBoard::Report
                | ToBoard::ReadBack { .. }
                | ToBoard::Clock { set: None }
                | ToBoard::OptionBytes { set: false }
        );
        let frame = matches!(message, ToBoard::Sensor(_)) && of.flight == Some(session);
        if self.flight.seat == Seat::Backseat && matches!(message, ToBoard::Sensor(_)) {
            return Err(Refusal::OwnSensors);
        }
        if free || frame || of.present == Some(session) { Ok(()) } else { Err(Refusal::Session) }
    }

    fn answer(&mut self, message: ToBoard) -> ToHost {
        let answer = match message {
            ToBoard::Sensor(frame) => self.sensor(&frame).map(ToHost::Answer),
            ToBoard::Hello { nonce } => Ok(self.hello(nonce)),
            ToBoard::Begin(mission) => self.begin(mission, Seat::Host),
            ToBoard::Launch(mission) => self.begin(mission, Seat::Sensors),
            ToBoard::Recall => self.recall(),
            ToBoard::Recovered => self.recovered(),
            ToBoard::UploadBegin { object, length, crc } => self.upload(object, length, crc).map(|offset| ToHost::Continue { offset }),
            ToBoard::UploadChunk { offset, data } => self.piece(offset, &data).map(|offset| ToHost::Continue { offset }),
            ToBoard::UploadCommit => self.commit(),
            ToBoard::Rollback(object) => self.rollback(object),
            ToBoard::ReadBack { object, offset } => self.read_back(object, offset),
            ToBoard::Report => Ok(ToHost::Counters(self.receiver.counters)),
            ToBoard::Check { stroke } => self.on_deck().map(|()| ToHost::Checked(self.deck.ask(stroke))),
            ToBoard::Clock { set } => self.clock(set),
            ToBoard::Restart => self.restart(),
            ToBoard::OptionBytes { set } => self.option_bytes(set),
        };
        answer.unwrap_or_else(ToHost::Refused)
    }

    /// One cycle on the vehicle's own sensors: [`Seat::Sensors`] only. `None` when there is nothing to fly.
    pub fn cycle(&mut self, frame: &SensorFrame) -> Option<Answer> {
        self.sealed(|helm| {
            if helm.flight.seat != Seat::Sensors {
                return None;
            }
            helm.flight.watch_pace(frame.time);
            helm.step(frame)
        })
    }

    /// No frame has come for so long, whatever the reason: a vehicle that was seen afloat has to be seen again.
    pub fn unheard(&mut self, silence: Micros) {
        if silence > Micros::from_millis(AFLOAT_HOLDS_MS) && !self.flight.afloat.is_new() {
            self.sealed(|helm| helm.flight.afloat = Afloat::new());
        }
    }

    /// The line has been silent for so long by the board's own clock. Steps at most once per call, once per control cycle, after
    /// [`PATIENCE_MS`]. The answer holds for the actuators; nobody asked for it over the line.
    pub fn silent(&mut self, silence: Micros) -> Option<Answer> {
        self.unheard(silence);
        let due = silence.since(Micros::from_millis(PATIENCE_MS)).0 / (u64::from(CYCLE_MS) * 1_000);
        if due == self.flight.silent_steps {
            return None;
        }
        self.sealed(|helm| {
            let flight = &mut helm.flight;
            // Fewer than before: somebody spoke since, and the silence began anew.
            let more = due > flight.silent_steps;
            flight.silent_steps = due;
            if !matches!(flight.seat, Seat::Host | Seat::Backseat) || !more {
                return None;
            }
            // Nobody spoke since a reset in flight: all readings are missing.
            let frame = flight.last.map(|(frame, _)| frame).unwrap_or_default();
            flight.abort(Abort::LinkLost);
            flight.advance(&helm.built_in, &aged(&frame, silence))
        })
    }

    /// Whether a reset now would be one during a mission.
    #[must_use]
    pub fn mission_in_progress(&self) -> bool {
        self.flight.mission_in_progress()
    }

    /// What a reset must find again: as it was when the last message, cycle or silence had been dealt with.
    #[must_use]
    pub fn mark(&self) -> Mark {
        self.marks.mark().unwrap_or_else(|| self.flight.mark())
    }

    /// Keeps the mark of the mission in step with what is being done. Call it before anything that was answered leaves the board: then
    /// no command of a mission is ever out without its mark.
    pub fn keep_mark(&mut self) {
        let mark = self.mark();
        self.storage.mark(mark);
    }

    /// Writes the last step to the flight log, once. It may take as long as
    /// the part needs for an erase: call it when the answer is on its way.
    pub fn keep_log(&mut self) {
        if self.flight.unlogged {
            self.sealed(|helm| {
                // A flight whose seal was broken has no last step.
                helm.flight.unlogged = false;
                if let Some((frame, answer)) = &helm.flight.last {
                    helm.storage.log(helm.utc.utc(), frame, answer);
                    let phase = answer.trace.phase;
                    helm.confirm_image(phase);
                }
            });
        }
    }

    /// UTC is set on deck only: in a mission the records go on as they began, or by the fixes at the surface.
    fn clock(&mut self, set: Option<(u64, u32)>) -> Result<ToHost, Refusal> {
        if let Some((ms, within_ms)) = set {
            self.on_deck()?;
            self.utc.set(ms, within_ms)?;
        }
        Ok(ToHost::Clock(self.utc.said()))
    }

    /// They are set on deck only: flash that is written stops the program for half a second.
    fn option_bytes(&mut self, set: bool) -> Result<ToHost, Refusal> {
        if set {
            self.on_deck()?;
        }
        Ok(ToHost::OptionBytes(self.deck.ask_options(set)))
    }

    /// Counters of the line.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.receiver.counters
    }

    /// Bytes the receiving hardware or its queue lost.
    pub fn lost_bytes(&mut self, count: u32) {
        let counters = &mut self.receiver.counters;
        counters.overflow = counters.overflow.saturating_add(count);
    }

    /// The last frame stepped and its answer.
    #[must_use]
    pub const fn last(&self) -> Option<&(SensorFrame, Answer)> {
        self.flight.last.as_ref()
    }

    /// The configuration of the mission under way, or the built-in one.
    #[must_use]
    pub fn config(&self) -> &Config {
        self.flight.config.as_ref().unwrap_or(&self.built_in)
    }

    /// What keeps objects.
    pub const fn storage(&mut self) -> &mut S {
        &mut self.storage
    }

    /// Where sensor frames come from.
    #[must_use]
    pub const fn seat(&self) -> Seat {
        self.flight.seat
    }

    /// What the board says of itself.
    #[inline(never)]
    pub fn manifest(&mut self) -> Manifest {
        let flight = &self.flight;
        let under_way = flight.mission_in_progress() || matches!(flight.activity, Activity::Armed { .. });
        let (phase, last_seq) = (flight.phase().unwrap_or_default(), flight.last.map(|(frame, _)| frame.seq));
        Manifest {
            firmware: self.firmware,
            table_standard: objects::identity(&mut self.storage, &self.built_in, Object::Table(Wings::Standard)),
            table_low_ar: objects::identity(&mut self.storage, &self.built_in, Object::Table(Wings::LowAspectRatio)),
            config: objects::identity(&mut self.storage, &self.built_in, Object::Config),
            cycle_ms: CYCLE_MS,
            boots: self.boots,
            hil: matches!(self.flight.seat, Seat::Open | Seat::Host) && !self.deck.is_backseat(),
            under_way,
            phase,
            last_seq,
            image: self.storage.image(),
        }
    }

    /// A new nonce gives a new session; it changes nothing else. The old nonce gives the same one again.
    fn hello(&mut self, nonce: u32) -> ToHost {
        let session = match (self.flight.session.present, self.flight.session.nonce == Some(nonce)) {
            (Some(present), true) => present,
            _ => self.new_session(nonce),
        };
        ToHost::Hello { nonce, session, manifest: self.manifest() }
    }

    fn new_session(&mut self, nonce: u32) -> u32 {
        #[cfg(test)]
        if self.mutant == Some(crate::tests::model_check::Mutant::HelloClearsSequence) {
            self.flight.sequence = None;
        }
        self.salt = self.salt.wrapping_add(1);
        let mut digest = CRC32.digest();
        digest.update(&nonce.to_le_bytes());
        digest.update(&self.salt.to_le_bytes());
        // 0 is that of nobody.
        let session = digest.finalize().max(1);
        let of = &mut self.flight.session;
        (of.nonce, of.present, of.greeted) = (Some(nonce), Some(session), true);
        session
    }

    #[inline(never)]
    fn begin(&mut self, mut mission: Mission, seat: Seat) -> Result<ToHost, Refusal> {
        match self.flight.phase() {
            Some(Phase::Safe) => return Err(Refusal::Safe),
            Some(phase) if phase != Phase::Done => return Err(Refusal::UnderWay),
            _ if !self.flight.session.greeted => return Err(Refusal::NotNow),
            _ if !self.deck.allows(seat) => return Err(Refusal::Strap),
            _ if seat == Seat::Sensors => self.tried()?,
            _ => {}
        }
        self.abandon();
        // What was asked for on deck and not done is not done in flight.
        self.deck.take_options();
        let mut bytes = Content::new();
        if mission.legs.is_empty()
            && self.storage.load(Object::Mission, &mut bytes)
            && let Some(stored) = objects::mission(&bytes)
        {
            mission = stored;
        }
        let config = objects::select_config(&mut self.storage, &self.built_in);
        if seat == Seat::Sensors {
            limits::check_own(&config, &self.built_in).map_err(|e| Refusal::Limit(e.limit))?;
        }
        mission.validate(config.working_depth_m, config.pump_m3).map_err(Refusal::Mission)?;
        let (config_id, mission_id) = (objects::config_id(&config), objects::mission_id(&mission));
        let table_id = self.flight.arm(mission, config, seat, &mut self.storage);
        Ok(ToHost::Ready { table_id, config: config_id, mission: mission_id, image: self.storage.image() })
    }

    fn recall(&mut self) -> Result<ToHost, Refusal> {
        match &mut self.flight.activity {
            Activity::Idle => return Err(Refusal::NoMission),
            Activity::Armed { .. } => self.flight.disarm(),
            Activity::Flying { state, .. } => state.recall(),
        }
        Ok(ToHost::Done { crc: 0 })
    }

    fn recovered(&mut self) -> Result<ToHost, Refusal> {
        match self.flight.phase() {
            Some(Phase::Safe) if self.seen_afloat() => {}
            Some(Phase::Safe) => return Err(Refusal::NotAfloat),
            Some(Phase::Done) | None => {}
            Some(_) => return Err(Refusal::UnderWay),
        }
        self.flight.disarm();
        Ok(ToHost::Done { crc: 0 })
    }

    fn seen_afloat(&self) -> bool {
        #[cfg(test)]
        if self.mutant == Some(crate::tests::model_check::Mutant::LastDepthAlone) {
            // As it once was: the last frame's first depth, and a missing one is the surface.
            return self.flight.last.is_none_or(|(frame, _)| frame.depth_m.accept(5.0..=f32::MAX, u32::MAX).is_none());
        }
        self.flight.afloat.seen()
    }

    #[inline(never)]
    fn sensor(&mut self, frame: &SensorFrame) -> Result<Answer, Refusal> {
        let flight = &self.flight;
        match (flight.seat, &flight.activity) {
            (_, Activity::Idle) => return Err(Refusal::NoMission),
            (Seat::Sensors, _) => return Err(Refusal::OwnSensors),
            _ => {}
        }
        if let Some(last) = flight.sequence {
            let ahead = frame.seq.wrapping_sub(last);
            let counters = &mut self.receiver.counters;
            if let (0, Some((_, answer))) = (ahead, &flight.last) {
                counters.repeated = counters.repeated.saturating_add(1);
                return Ok(*answer);
            }
            if ahead == 0 || ahead > MAX_GAP {
                counters.stale = counters.stale.saturating_add(1);
                return Err(Refusal::Sequence { last });
            }
        }
        self.step(frame).ok_or(Refusal::NoMission)
    }

    fn step(&mut self, frame: &SensorFrame) -> Option<Answer> {
        let log_lost = self.storage.log_lost();
        let answer = self.flight.step(&self.built_in, frame, log_lost)?;
        let config = self.flight.config.as_ref().unwrap_or(&self.built_in);
        self.glides.take(config, self.flight.table().as_ref(), frame, &answer);
        Some(answer)
    }
}

/// What is flown after a boot that found this mark.
const fn flight_after(mark: Mark) -> Flight {
    Flight::new(mark.seat(), if mark.in_mission() { Some(mark) } else { None })
}
