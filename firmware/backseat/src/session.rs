//! When to listen, when to speak, when the line is lost.
//!
//! ```text
//!  WAIT ──HI or SD──► LINKED ──list is ours, parameters come back──► READY ◄─SD─ LATE
//!                       │  ▲                                           │         ▲ │
//!        another list   │  │ HI or SD                                  └─12 s────┘ │ 60 s
//!                       ▼  │                                                       ▼
//!                      MUTE PAUSED ◄──BY── any        LISTEN ◄─10 SD in 60 s──── LOST
//!                            └──600 s and below 5 m──────────────────────────────► LOST
//! ```
//! - Nothing is sent before the glider spoke; no sensor is written before its list was read and is ours.
//! - MUTE: listens, says so once, never writes.
//! - LOST: the law is told once per cycle; what it answers (full buoyancy) is sent on, with the emergency bit: the wire may be half
//!   dead. LISTEN is READY again for the line, not for the law: its abort stays.
//! - 12 s, 600 s, 5 m and 10 sentences are guesses; 60 s is the patience of the board.

use crate::Unfit;

use crate::base64;
use crate::ini::{Item, Reader};
use crate::line;
use crate::orders::{self, Limits, Targets, bits};
use crate::readings::{CC_PER_M3, Fate, M_PER_INCH, Readings};
use crate::sensors::{Generation, List, Sensor};
use crate::sentence::{self, Body, FromGlider, Pairs, words};
use signals::{ActuatorCommand, Answer, Micros, SensorFrame};

/// What is flown behind the line.
pub trait Law {
    /// The line is open and the glider flies its mission: ours begins. `None`: there is none to begin.
    fn begin(&mut self, limits: &Limits) -> Option<Targets>;
    /// One control cycle. `None`: nothing is flown.
    fn step(&mut self, frame: &SensorFrame) -> Option<Answer>;
    /// The line has been silent for this long. Called often; answers once per control cycle.
    fn silent(&mut self, silence: Micros) -> Option<Answer>;
}

/// What is known before the glider speaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// List of sensors expected.
    pub list: List,
    /// Nominal density of the glider's depth, kg/m³.
    pub rho_kg_m3: f32,
    /// Limits of the actuators where the glider does not tell them.
    pub limits: Limits,
}

/// State of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing heard yet.
    Wait,
    /// Heard; its list is read.
    Linked,
    /// Its list is another one, or writes do not arrive.
    Mute,
    /// Open both ways.
    Ready,
    /// Open, and silent for a while.
    Late,
    /// Silent for too long.
    Lost,
    /// Heard again after it was lost.
    Listen,
    /// The glider's program stopped.
    Paused,
}

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Values that are no number or out of range.
    pub out_of_range: u32,
    /// Values out of reach of the last one.
    pub too_fast: u32,
    /// Levels believed after three such values.
    pub new_levels: u32,
    /// Pairs of sensors that are not in the list, or that are none.
    pub unknown_pairs: u32,
    /// Sentences of an unknown type.
    pub unknown_sentences: u32,
    /// Errors that the glider reported.
    pub errors: u32,
    /// Cycles in which the parameters in use were none of those sent.
    pub unechoed: u32,
    /// Sentences of ours that did not fit the line.
    pub dropped: u32,
    /// Orders with a value that must not be sent.
    pub unsendable: u32,
}

const LATE: Micros = Micros::from_secs(12);
const LOST: Micros = Micros::from_secs(60);
/// The line is quiet: the cycle's sentences are all here.
const QUIET: Micros = Micros::from_millis(300);
/// A step without the glider's time in its sentences.
const UNTIMED: Micros = Micros::from_secs(6);
/// No block of a file for so long: it is asked for again.
const BLOCK: Micros = Micros::from_secs(4);
const FILE_TRIES: u8 = 4;
const ECHO: Micros = Micros::from_secs(20);
const ECHO_TRIES: u8 = 3;
/// Parameters agree within this.
const ECHO_WITHIN: f32 = 1e-3;
/// Mode bits that are set are sent again after this.
const MODE_AGAIN: Micros = Micros::from_secs(16);
const PAUSE: Micros = Micros::from_secs(600);
const PAUSE_DEPTH_M: f32 = 5.0;
const HEARD_AGAIN: u8 = 10;
const HEARD_WITHIN: Micros = Micros::from_secs(60);
/// Farthest the glider's clock may differ from ours over one step, s.
const CLOCK_S: f64 = 5.0;
/// Bytes on their way out.
const OUTBOX: usize = 640;
/// Orders of so many cycles may still be on their way.
const ON_THE_WAY: usize = 4;

/// Targets until the law has a mission: the vehicle floats.
const START: Targets = Targets { dive_m: 10.0, climb_m: 2.0 };

/// Reading the glider's list.
#[derive(Clone, Debug)]
struct Check {
    reader: Reader,
    asked: Micros,
    tries: u8,
    mismatches: u8,
    same: bool,
    damaged_before: u32,
    waiting: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    List,
    Echo { sent: Micros, tries: u8 },
}

/// Time of the glider's flight as counted by its own clock, checked by ours.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    glider_s: f64,
    ours: Micros,
    flight: Micros,
}

/// The board's half of the line.
#[derive(Clone, Debug)]
pub struct Session {
    setup: Setup,
    receiver: line::Receiver,
    core: Core,
}

#[derive(Clone, Debug)]
struct Core {
    list: List,
    state: State,
    readings: Readings,
    counters: Counters,
    out: heapless::Deque<u8, OUTBOX>,
    stage: Stage,
    check: Check,
    heard: Micros,
    heard_line: Micros,
    heard_again: (Micros, u8),
    paused: Micros,
    anchor: Option<Anchor>,
    timed: Option<Micros>,
    overdue: bool,
    fresh: bool,
    stepped: Micros,
    seq: u32,
    targets: Option<Targets>,
    last: Option<Answer>,
    sent: [Option<[f32; 5]>; ON_THE_WAY],
    unechoed: u8,
    mode_sent: Option<(u32, Micros)>,
    said: u8,
}

/// Texts that are said once.
mod once {
    pub const NO_MISSION: u8 = 1;
    pub const NO_ECHO: u8 = 2;
}

impl Session {
    /// Nothing heard yet.
    #[must_use]
    pub const fn new(setup: Setup) -> Self {
        let zero = Micros(0);
        Self {
            setup,
            receiver: line::Receiver::new(),
            core: Core {
                list: setup.list,
                state: State::Wait,
                readings: Readings::new(setup.list),
                counters: Counters {
                    out_of_range: 0,
                    too_fast: 0,
                    new_levels: 0,
                    unknown_pairs: 0,
                    unknown_sentences: 0,
                    errors: 0,
                    unechoed: 0,
                    dropped: 0,
                    unsendable: 0,
                },
                out: heapless::Deque::new(),
                stage: Stage::List,
                check: Check { reader: Reader::new(), asked: zero, tries: 0, mismatches: 0, same: true, damaged_before: 0, waiting: false },
                heard: zero,
                heard_line: zero,
                heard_again: (zero, 0),
                paused: zero,
                anchor: None,
                timed: None,
                overdue: false,
                fresh: false,
                stepped: zero,
                seq: 0,
                targets: None,
                last: None,
                sent: [None; ON_THE_WAY],
                unechoed: 0,
                mode_sent: None,
                said: 0,
            },
        }
    }

    /// State of the session.
    #[must_use]
    pub const fn state(&self) -> State {
        self.core.state
    }

    /// What was counted.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.core.counters
    }

    /// What was wrong with the line.
    #[must_use]
    pub const fn faults(&self) -> line::Faults {
        self.receiver.faults
    }

    /// The last answer of the law.
    #[must_use]
    pub const fn last(&self) -> Option<&Answer> {
        self.core.last.as_ref()
    }

    /// Whether the law's mission was begun on this line.
    #[must_use]
    pub const fn has_begun(&self) -> bool {
        self.core.targets.is_some()
    }

    /// The frame that a step of now would be made with.
    #[must_use]
    pub fn frame(&self, now: Micros) -> SensorFrame {
        let core = &self.core;
        SensorFrame { seq: core.seq, time: core.flight_time(now), ..core.readings.frame(now, core.stepped, self.setup.rho_kg_m3) }
    }

    /// Takes a byte of the line.
    pub fn byte(&mut self, now: Micros, byte: u8) {
        let Self { receiver, core, .. } = self;
        let damaged = receiver.faults.damaged;
        receiver.push(byte, |body| core.sentence(now, damaged, body));
    }

    /// The next byte to be sent.
    pub fn next_byte(&mut self) -> Option<u8> {
        self.core.out.pop_front()
    }

    /// Limits as the glider tells them, or as they were given.
    #[must_use]
    pub fn limits(&self) -> Limits {
        let given = self.setup.limits;
        let told = |sensor, per_ours: f32, given: f32| match self.core.readings.last(sensor) {
            Some(limit) if limit > 0.0 => limit / per_ours,
            _ => given,
        };
        Limits {
            ballast_m3: told(Sensor::BallastMax, CC_PER_M3, given.ballast_m3),
            battery_m: told(Sensor::MassMax, 1.0 / M_PER_INCH, given.battery_m),
            fin_rad: told(Sensor::FinMax, 1.0, given.fin_rad),
        }
    }

    /// Does what is due: call it after bytes, and at least ten times a second.
    pub fn poll(&mut self, now: Micros, law: &mut impl Law) {
        let silence = now.since(self.core.heard);
        match self.core.state {
            State::Wait => {}
            State::Linked => {
                self.link(now);
                self.patience(now, now.since(self.core.stepped), law);
            }
            State::Mute => self.patience(now, now.since(self.core.stepped), law),
            State::Ready | State::Listen => {
                if self.core.is_due(now) {
                    self.step(now, law);
                }
                if silence >= LATE {
                    self.core.state = State::Late;
                }
            }
            State::Late => {
                if silence >= LOST {
                    self.core.lose(now);
                }
            }
            State::Lost => {
                // From a pause the line has been silent for long; the law is told so.
                self.patience(now, silence, law);
            }
            State::Paused => {
                let deep = self.core.readings.last(Sensor::Depth).is_none_or(|depth| depth >= PAUSE_DEPTH_M);
                if now.since(self.core.paused) >= PAUSE && deep && self.has_begun() {
                    self.core.lose(now);
                }
            }
        }
    }

    /// Tells the law of a silence; what it answers is sent where writing is allowed.
    fn patience(&mut self, now: Micros, silence: Micros, law: &mut impl Law) {
        if !self.has_begun() || silence < LOST {
            return;
        }
        if let Some(answer) = law.silent(silence) {
            self.core.last = Some(answer);
            if self.core.state == State::Lost {
                self.order(now);
            }
        }
    }

    fn step(&mut self, now: Micros, law: &mut impl Law) {
        let flies = self.core.readings.last(Sensor::GliderDos) == Some(0.0);
        let frame = self.frame(now);
        self.core.stepping(now);
        if !flies {
            return;
        }
        if self.core.targets.is_none() {
            self.core.targets = law.begin(&self.limits());
            if self.core.targets.is_none() {
                self.core.say_once(once::NO_MISSION, b"backseat: no mission to fly");
                return;
            }
            self.core.seq = 0;
        }
        let frame = SensorFrame { seq: self.core.seq, ..frame };
        if let Some(answer) = law.step(&frame) {
            self.core.seq = self.core.seq.wrapping_add(1);
            self.core.last = Some(answer);
            self.order(now);
        }
    }

    /// Sends what the law wants: parameters, mode, and what is to be logged.
    fn order(&mut self, now: Micros) {
        let limits = self.limits();
        let core = &mut self.core;
        let Some(answer) = core.last else { return };
        let values = orders::parameters(&answer.command, &core.targets.unwrap_or(START), &limits);
        core.write(&values);
        if let Ok(body) = orders::logged(&answer) {
            core.send(&body);
        }
        let wanted = orders::mode_of(answer.trace.phase);
        let due = match core.mode_sent {
            None => true,
            Some((sent, at)) => sent != wanted || (wanted != 0 && now.since(at) >= MODE_AGAIN),
        };
        if due && let Ok(body) = sentence::mode(bits::ALL, wanted) {
            core.send(&body);
            core.mode_sent = Some((wanted, now));
        }
    }

    /// Reads the glider's list, then sees that what is written arrives.
    fn link(&mut self, now: Micros) {
        match self.core.stage {
            Stage::List => self.core.ask_for_list(now),
            Stage::Echo { sent, tries } => {
                let limits = self.limits();
                let core = &mut self.core;
                let arrived = core.sent.first().copied().flatten().is_some_and(|values| core.is_echoed(&values, sent));
                if arrived || core.last.is_some() || !core.has_echo() {
                    core.open(now);
                } else if tries == 0 || now.since(sent) >= ECHO {
                    if tries > ECHO_TRIES {
                        core.mute(b"backseat: parameters do not arrive, mute");
                        return;
                    }
                    let float = ActuatorCommand { ballast_m3: limits.ballast_m3, ..ActuatorCommand::default() };
                    core.write(&orders::parameters(&float, &START, &limits));
                    core.stage = Stage::Echo { sent: now, tries: tries.saturating_add(1) };
                }
            }
        }
    }
}

impl Core {
    fn has_echo(&self) -> bool {
        self.list.get(Sensor::EchoBallast.index()).is_some()
    }

    fn is_echoed(&self, values: &[f32; 5], since: Micros) -> bool {
        let echoes = [Sensor::EchoBallast, Sensor::EchoMass, Sensor::EchoFin, Sensor::EchoDive, Sensor::EchoClimb];
        let near =
            |(sensor, value): (&Sensor, &f32)| self.readings.since(*sensor, since).is_some_and(|v| libm::fabsf(v - value) < ECHO_WITHIN);
        echoes.iter().zip(values).all(near)
    }

    fn sentence(&mut self, now: Micros, damaged: u32, body: &[u8]) {
        self.heard_line = now;
        match sentence::read(body) {
            FromGlider::Hi => {
                self.heard = now;
                self.relink(now);
            }
            FromGlider::By => {
                if !matches!(self.state, State::Wait | State::Lost) {
                    self.state = State::Paused;
                    self.paused = now;
                }
            }
            FromGlider::Sensors(pairs) => self.sensors(now, pairs),
            FromGlider::File(block) => self.file(now, damaged, block),
            FromGlider::Error(_) => {
                self.counters.errors = self.counters.errors.saturating_add(1);
                if self.state == State::Linked && self.stage == Stage::List {
                    self.try_again(now);
                }
            }
            FromGlider::Next | FromGlider::Directory(_) => {}
            FromGlider::Unknown => self.counters.unknown_sentences = self.counters.unknown_sentences.saturating_add(1),
        }
    }

    fn sensors(&mut self, now: Micros, pairs: Pairs<'_>) {
        self.heard = now;
        match self.state {
            State::Wait | State::Paused => self.relink(now),
            State::Late => {
                self.state = if self.mode_sent.is_some_and(|(bits, _)| bits & bits::EMERGENCY != 0) { State::Listen } else { State::Ready }
            }
            State::Lost => {
                // The window begins with the first sentence heard.
                let (first, count) = self.heard_again;
                self.heard_again = if count == 0 || now.since(first) > HEARD_WITHIN { (now, 1) } else { (first, count.saturating_add(1)) };
                if self.heard_again.1 >= HEARD_AGAIN {
                    self.state = State::Listen;
                }
            }
            State::Linked | State::Mute | State::Ready | State::Listen => {}
        }
        for pair in pairs.iter() {
            let fate = match pair {
                Some((index, value)) => {
                    let fate = self.readings.take(index, value, now);
                    if index == Sensor::Time.index()
                        && fate == Fate::Taken
                        && let Some(glider_s) = value
                    {
                        self.glider_time(now, glider_s);
                    }
                    fate
                }
                None => Fate::UnknownIndex,
            };
            let c = &mut self.counters;
            let counter = match fate {
                Fate::Taken => {
                    self.fresh = true;
                    continue;
                }
                Fate::NewLevel => {
                    self.fresh = true;
                    &mut c.new_levels
                }
                Fate::OutOfRange => &mut c.out_of_range,
                Fate::TooFast => &mut c.too_fast,
                Fate::UnknownIndex | Fate::Ours => &mut c.unknown_pairs,
            };
            *counter = counter.saturating_add(1);
        }
    }

    /// A new cycle of the glider. Only differences of its clock matter; one that jumps is replaced by ours.
    fn glider_time(&mut self, now: Micros, glider_s: f64) {
        let flight = match self.anchor {
            Some(a) => {
                let (theirs_s, ours_s) = (glider_s - a.glider_s, now.since(a.ours).0 as f64 * 1e-6);
                let span_s = if theirs_s > 0.0 && libm::fabs(theirs_s - ours_s) <= CLOCK_S { theirs_s } else { ours_s };
                a.flight.plus(Micros((span_s * 1e6) as u64))
            }
            None => now,
        };
        self.anchor = Some(Anchor { glider_s, ours: now, flight });
        // The cycle before was not stepped yet: its sentences ran into this one.
        self.overdue |= self.timed.is_some();
        self.timed = Some(now);
    }

    fn flight_time(&self, now: Micros) -> Micros {
        match (self.anchor, self.timed) {
            (Some(a), Some(_)) => a.flight,
            (Some(a), None) => a.flight.plus(now.since(a.ours)),
            (None, _) => now,
        }
    }

    fn is_due(&self, now: Micros) -> bool {
        let quiet = now.since(self.heard_line) >= QUIET;
        match self.timed {
            Some(_) => self.overdue || quiet,
            None => self.fresh && quiet && now.since(self.stepped) >= UNTIMED,
        }
    }

    fn stepping(&mut self, now: Micros) {
        (self.timed, self.overdue, self.fresh, self.stepped) = (None, false, false, now);
        if self.has_echo() && self.sent.iter().all(Option::is_some) {
            let known = self.sent.iter().flatten().any(|values| self.is_echoed(values, Micros(0)));
            self.unechoed = if known { 0 } else { self.unechoed.saturating_add(1) };
            if self.unechoed > 5 {
                self.counters.unechoed = self.counters.unechoed.saturating_add(1);
                self.say_once(once::NO_ECHO, b"backseat: parameters do not arrive");
            }
        }
    }

    /// The glider's program started, or is heard for the first time: its list may be another one now.
    fn relink(&mut self, now: Micros) {
        self.state = State::Linked;
        self.stage = Stage::List;
        self.readings.clear();
        self.check = Check { reader: Reader::new(), asked: now, tries: 0, mismatches: 0, same: true, damaged_before: 0, waiting: false };
        self.sent = [None; ON_THE_WAY];
        (self.timed, self.overdue, self.fresh, self.mode_sent, self.said) = (None, false, false, None, 0);
    }

    fn lose(&mut self, now: Micros) {
        self.state = State::Lost;
        self.heard_again = (now, 0);
        self.mode_sent = None;
    }

    fn open(&mut self, now: Micros) {
        self.state = State::Ready;
        self.stepped = self.stepped.max(now.since(UNTIMED));
        // A mission bit left over from before makes the glider surface at once.
        if self.last.is_none()
            && let Ok(body) = sentence::mode(bits::ALL, 0)
        {
            self.send(&body);
            self.mode_sent = Some((0, now));
        }
    }

    fn mute(&mut self, why: &[u8]) {
        self.state = State::Mute;
        self.say(why);
    }

    fn ask_for_list(&mut self, now: Micros) {
        if self.check.tries == 0 || (self.check.waiting && now.since(self.check.asked).0 > self.pause().0) {
            if self.check.tries >= FILE_TRIES {
                self.mute(b"backseat: extctl.ini cannot be read, mute");
                return;
            }
            let c = &mut self.check;
            (c.reader, c.same, c.damaged_before, c.waiting) = (Reader::new(), true, u32::MAX, false);
            (c.tries, c.asked) = (c.tries.saturating_add(1), now);
            let newer = self.list.generation == Generation::Newer;
            let asked = if newer { words(&[b"FR", b"extctl.ini", b"config"]) } else { words(&[b"FR", b"extctl.ini"]) };
            if let Ok(body) = asked {
                self.send(&body);
            }
        } else if !self.check.waiting && now.since(self.check.asked) >= BLOCK {
            self.try_again(now);
        }
    }

    /// Before the file is asked for again, 1 to 4 s: what damaged a line may come with a period.
    fn pause(&self) -> Micros {
        let spread = self.check.asked.0.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
        Micros(1_000_000u64.saturating_add(spread % 3_000_000))
    }

    fn try_again(&mut self, now: Micros) {
        self.check.waiting = true;
        self.check.asked = now;
    }

    fn file(&mut self, now: Micros, damaged: u32, block: &[u8]) {
        if self.state != State::Linked || self.stage != Stage::List || self.check.waiting || self.check.tries == 0 {
            return;
        }
        if self.check.damaged_before == u32::MAX {
            self.check.damaged_before = damaged;
        }
        if block.is_empty() {
            self.end_of_list(now, damaged);
            return;
        }
        self.check.asked = now;
        let (list, check) = (self.list, &mut self.check);
        let decoded = base64::decode(block, |byte| {
            let item = check.reader.push(byte);
            check.same &= is_ours(list, item);
        });
        if decoded.is_err() {
            self.try_again(now);
        } else if list.generation == Generation::Newer
            && let Ok(body) = words(&[b"GO"])
        {
            self.send(&body);
        }
    }

    fn end_of_list(&mut self, now: Micros, damaged: u32) {
        let last = self.check.reader.finish();
        let same = self.check.same && is_ours(self.list, last) && self.check.reader.sensors() == self.list.count();
        if same {
            self.stage = Stage::Echo { sent: now, tries: 0 };
            return;
        }
        // A block that was damaged on the way makes another list of ours: only one that is read twice is believed.
        if damaged == self.check.damaged_before {
            self.check.mismatches = self.check.mismatches.saturating_add(1);
        }
        if self.check.mismatches >= 2 {
            self.mute(b"backseat: extctl.ini is another one, mute");
        } else {
            self.try_again(now);
        }
    }

    fn write(&mut self, values: &[f32; 5]) {
        match orders::sentences(values) {
            Ok(bodies) => {
                bodies.iter().for_each(|body| self.send(body));
                self.sent.rotate_right(1);
                if let Some(latest) = self.sent.first_mut() {
                    *latest = Some(*values);
                }
            }
            Err(Unfit) => self.counters.unsendable = self.counters.unsendable.saturating_add(1),
        }
    }

    fn say(&mut self, text: &[u8]) {
        if self.list.generation == Generation::Newer
            && let Ok(body) = words(&[b"TXT", text])
        {
            self.send(&body);
        }
    }

    fn say_once(&mut self, what: u8, text: &[u8]) {
        if self.said & what == 0 {
            self.said |= what;
            self.say(text);
        }
    }

    /// A whole sentence, or none of it.
    fn send(&mut self, body: &Body) {
        let framed = sentence::framed(body).unwrap_or_default();
        let room = self.out.capacity().saturating_sub(self.out.len()) >= framed.len();
        if !room || framed.is_empty() {
            self.counters.dropped = self.counters.dropped.saturating_add(1);
            return;
        }
        for byte in framed {
            let _ = self.out.push_back(byte);
        }
    }
}

/// Whether a line of the glider's list is that of ours.
fn is_ours(list: List, item: Option<Result<Item, crate::ini::IniError>>) -> bool {
    match item {
        None | Some(Ok(Item::Baud(_) | Item::PacketSize(_))) => true,
        Some(Ok(Item::Sensor { index, section, name, .. })) => {
            list.get(index).is_some_and(|ours| ours.name == name.as_str()) && list.section(index) == Some(section)
        }
        Some(Err(_)) => false,
    }
}
