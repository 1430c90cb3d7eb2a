//! When to listen, when to speak, when the line is lost.
//!
//! ```text
//!  WAIT ──HI or SD──► LINKED ──list is ours, parameters come back──► READY ◄─SD─ LATE
//!   │                   │  ▲                                           │         ▲ │
//!   │    another list   │  │ HI or SD                                  └─12 s────┘ │ 60 s
//!   │                   ▼  │                                                       ▼
//!   │                  MUTE PAUSED ◄──BY── any        LISTEN ◄─10 SD in 60 s──── LOST
//!   │                        └──600 s and below 5 m──────────────────────────────► LOST
//!   └──60 s from boot, and a mission is under way────────────────────────────────► LOST
//! ```
//! - Nothing is sent before the glider spoke, but for a mission that a reset interrupted; no sensor is written before the glider's list
//!   was read and is ours.
//! - MUTE: listens, says so once, never writes a sensor.
//! - LOST: the law is told once per cycle; what it answers (full buoyancy) is sent on, with the emergency bit: the wire may be half
//!   dead. LISTEN is READY again for the line, not for the law: its abort stays.
//! - A mission under way without a step for 60 s comes up in every state. Where the list is not known to be ours (after a reset, after
//!   a stop of the glider's program, where it cannot be read) that is the emergency bit alone: the mode word is in no list. Where it is
//!   known to be another one nothing is sent: that glider is not ours.
//! - 12 s, 600 s, 5 m and 10 sentences are guesses; 60 s is the patience of the board.

mod heard;

use crate::line;
use crate::list_check::ListCheck;
use crate::orders::{self, Limits, Targets};
use crate::pace::Pace;
use crate::readings::{CC_PER_M3, M_PER_INCH, Readings};
use crate::sensors::{List, Sensor};
use crate::surfacing_report::Report;
use crate::voice::{Once, Voice};
use signals::surfacing::OfGlides;
use signals::{ActuatorCommand, Answer, Micros, Phase, SensorFrame};

/// What is flown behind the line.
pub trait Law {
    /// The line is open and the glider flies its mission: ours begins. `None`: there is none to begin.
    fn begin(&mut self, limits: &Limits) -> Option<Targets>;
    /// One control cycle. `None`: nothing is flown.
    fn step(&mut self, frame: &SensorFrame) -> Option<Answer>;
    /// The line has been silent for this long. Called often; answers once per control cycle, and only where a mission is under way: one
    /// that was begun on this line, or that a reset interrupted.
    fn silent(&mut self, silence: Micros) -> Option<Answer>;
    /// What the glides since the last call say of the vehicle's numbers, for a report to the shore.
    fn glides(&mut self) -> Option<OfGlides> {
        None
    }
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
const ECHO: Micros = Micros::from_secs(20);
const ECHO_TRIES: u8 = 3;
const PAUSE: Micros = Micros::from_secs(600);
const PAUSE_DEPTH_M: f32 = 5.0;
const HEARD_AGAIN: u8 = 10;
const HEARD_WITHIN: Micros = Micros::from_secs(60);

/// Targets until the law has a mission: the vehicle floats.
const START: Targets = Targets { dive_m: 10.0, climb_m: 2.0 };

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// It is read, or could not be.
    List,
    /// It is ours.
    Echo { sent: Micros, tries: u8 },
    /// It is another one.
    Other,
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
    voice: Voice,
    pace: Pace,
    stage: Stage,
    check: ListCheck,
    heard: Micros,
    heard_line: Micros,
    heard_again: (Micros, u8),
    paused: Micros,
    /// When it was linked again after a pause, and when it was opened.
    resumed: Micros,
    opened: Micros,
    seq: u32,
    targets: Option<Targets>,
    last: Option<Answer>,
    report: Report,
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
                voice: Voice::new(setup.list),
                pace: Pace::new(),
                stage: Stage::List,
                check: ListCheck::new(setup.list),
                heard: zero,
                heard_line: zero,
                heard_again: (zero, 0),
                paused: zero,
                resumed: zero,
                opened: zero,
                seq: 0,
                targets: None,
                last: None,
                report: Report::new(),
            },
        }
    }

    /// Another setup, for a line on which nothing was heard yet.
    pub fn set_up(&mut self, setup: Setup) {
        if self.core.state != State::Wait {
            return;
        }
        self.setup = setup;
        let core = &mut self.core;
        core.list = setup.list;
        core.readings.expect(setup.list);
        core.check = ListCheck::new(setup.list);
        core.voice.expect(setup.list);
    }

    /// Whether the glider flies its mission, as far as it says.
    #[must_use]
    pub fn flies(&self) -> bool {
        self.core.readings.last(Sensor::GliderDos) == Some(0.0)
    }

    /// Bytes are waiting to be sent.
    #[must_use]
    pub fn has_to_say(&self) -> bool {
        self.core.voice.has_to_say()
    }

    /// State of the session.
    #[must_use]
    pub const fn state(&self) -> State {
        self.core.state
    }

    /// What was counted.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        let voice = &self.core.voice;
        Counters { dropped: voice.dropped, unsendable: voice.unsendable, ..self.core.counters }
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

    /// Whether steps of the law are due: its mission was begun on this line and the glider flies its own, or the line is lost.
    #[must_use]
    pub fn is_stepping(&self) -> bool {
        match self.core.state {
            State::Lost => true,
            State::Paused => false,
            _ => self.core.targets.is_some() && self.flies(),
        }
    }

    /// The frame that a step of now would be made with.
    #[must_use]
    pub fn frame(&self, now: Micros) -> SensorFrame {
        let core = &self.core;
        SensorFrame { seq: core.seq, time: core.pace.flight_time(now), ..core.readings.frame(now, core.pace.stepped, self.setup.rho_kg_m3) }
    }

    /// Takes a byte of the line.
    pub fn byte(&mut self, now: Micros, byte: u8) {
        let Self { receiver, core, .. } = self;
        let damaged = receiver.faults.damaged;
        receiver.push(byte, |body| core.sentence(now, damaged, body));
    }

    /// The next byte to be sent.
    pub fn next_byte(&mut self) -> Option<u8> {
        self.core.voice.next_byte()
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
            ..given
        }
    }

    /// Does what is due: call it after bytes, and at least ten times a second.
    pub fn poll(&mut self, now: Micros, law: &mut impl Law) {
        let silence = now.since(self.core.heard);
        match self.core.state {
            // From boot on: a line that never speaks is lost as well.
            State::Wait => self.patience(now, silence, law),
            State::Linked => {
                self.link(now);
                self.patience(now, self.core.unstepped(now), law);
            }
            State::Mute => self.patience(now, self.core.unstepped(now), law),
            State::Ready | State::Listen => {
                if self.core.pace.is_due(now, self.core.heard_line) {
                    self.step(now, law);
                }
                self.core.report.poll(now, &mut self.core.voice);
                if silence >= LATE {
                    self.core.state = State::Late;
                } else {
                    // Heard, but nothing that a step could be made of.
                    self.patience(now, now.since(self.core.pace.stepped).min(now.since(self.core.opened)), law);
                }
            }
            State::Late => {
                if silence >= LOST {
                    self.core.lose(now);
                }
            }
            // A sentence now and then does not end it: counted from the last step.
            State::Lost => self.patience(now, silence.max(now.since(self.core.pace.stepped)), law),
            State::Paused => {
                let deep = self.core.readings.last(Sensor::Depth).is_none_or(|depth| depth >= PAUSE_DEPTH_M);
                if now.since(self.core.paused) >= PAUSE && deep {
                    self.patience(now, silence, law);
                }
            }
        }
    }

    /// Tells the law of a silence; it answers where a mission is under way, and what it answers is sent where it may be.
    fn patience(&mut self, now: Micros, silence: Micros, law: &mut impl Law) {
        if silence < LOST {
            return;
        }
        if let Some(answer) = law.silent(silence) {
            self.core.last = Some(answer);
            if !matches!(self.core.state, State::Lost | State::Linked | State::Mute) {
                self.core.lose(now);
            }
            self.order(now);
        }
    }

    fn step(&mut self, now: Micros, law: &mut impl Law) {
        let flies = self.flies();
        let frame = self.frame(now);
        self.core.stepping(now);
        if flies && self.core.targets.is_none() {
            self.core.targets = law.begin(&self.limits());
            if self.core.targets.is_none() {
                self.core.voice.say_once(Once::NoMission, b"backseat: no mission to fly");
                return;
            }
            // One that a reset interrupted goes on with its frames.
            if self.core.last.is_none() {
                self.core.seq = 0;
            }
        }
        // In the glider's shell SAFE goes on: the way out of it is to be seen afloat.
        let safe = self.core.last.is_none_or(|answer| answer.trace.phase == Phase::Safe);
        if !flies && !safe {
            return;
        }
        let frame = SensorFrame { seq: self.core.seq, ..frame };
        if let Some(answer) = law.step(&frame) {
            self.core.seq = self.core.seq.wrapping_add(1);
            self.core.last = Some(answer);
            let core = &mut self.core;
            core.report.take(&frame, &answer, core.pace.glider_s(now), &mut core.voice, || law.glides());
            // After a reset the glider may not say again that it flies.
            if flies || self.core.readings.last(Sensor::GliderDos).is_none() {
                self.order(now);
            }
        }
    }

    /// Sends what the law wants: parameters, mode, and what is to be logged. See the file's text for who is sent what.
    fn order(&mut self, now: Micros) {
        let limits = self.limits();
        let core = &mut self.core;
        let Some(answer) = core.last else { return };
        let mode = orders::mode_of(answer.trace.phase);
        match core.stage {
            Stage::Other => return,
            Stage::Echo { .. } if core.state != State::Mute => {}
            _ => return core.voice.mode(mode, now),
        }
        let values = orders::parameters(&answer.command, &core.targets.unwrap_or(START), &limits);
        core.voice.write(&values);
        if let Ok(body) = orders::logged(&answer) {
            core.voice.send(&body);
        }
        core.voice.mode(mode, now);
    }

    /// Reads the glider's list, then sees that what is written arrives.
    fn link(&mut self, now: Micros) {
        match self.core.stage {
            Stage::Other => {}
            Stage::List => {
                let next = self.core.check.poll(now);
                self.core.go_on(now, next);
            }
            Stage::Echo { sent, tries } => {
                let limits = self.limits();
                let core = &mut self.core;
                if core.voice.arrived(&core.readings, sent) || core.last.is_some() || !core.voice.has_echo() {
                    core.open(now);
                } else if tries == 0 || now.since(sent) >= ECHO {
                    if tries > ECHO_TRIES {
                        core.mute(b"backseat: parameters do not arrive, mute");
                        return;
                    }
                    let float = ActuatorCommand { ballast_m3: limits.ballast_m3, ..ActuatorCommand::default() };
                    core.voice.write(&orders::parameters(&float, &START, &limits));
                    core.stage = Stage::Echo { sent: now, tries: tries.saturating_add(1) };
                }
            }
        }
    }
}

impl Core {
    /// Time since the last step; a pause of the glider's program is excused for as long as one may last.
    fn unstepped(&self, now: Micros) -> Micros {
        let since = now.since(self.pace.stepped);
        if since < PAUSE { since.min(now.since(self.resumed)) } else { since }
    }

    fn stepping(&mut self, now: Micros) {
        self.pace.step(now);
        if self.voice.is_unheard(&self.readings) {
            self.counters.unechoed = self.counters.unechoed.saturating_add(1);
            self.voice.say_once(Once::NoEcho, b"backseat: parameters do not arrive");
        }
    }

    fn lose(&mut self, now: Micros) {
        self.state = State::Lost;
        self.heard_again = (now, 0);
        self.voice.forget_mode();
    }

    fn open(&mut self, now: Micros) {
        self.state = State::Ready;
        self.opened = now;
        // The law's steps begin with a whole cycle.
        self.pace.forget();
        // A bit left over from a mission before makes the glider surface at once.
        if self.last.is_none() {
            self.voice.mode(0, now);
        }
    }

    fn mute(&mut self, why: &[u8]) {
        self.state = State::Mute;
        self.voice.say(why);
    }
}
