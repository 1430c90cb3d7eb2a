//! An Iridium 9602 or 9603 modem for short burst data: one message to the shore, over a port that may say anything.
//!
//! Sources: 9602 SBD Transceiver Product Developer's Guide (supply, 3.2), ISU AT Command Reference (commands). 19,200 baud, three wires.
//!
//! ```text
//! power ─► AT ─► ATE0, AT&D0, AT&K0, AT+SBDMTA=0 ─► AT+CSQ: 1 to 5 ─►
//! AT+SBDWB, message, sum ─► AT+SBDS: n ─► AT+SBDIX: n ─► AT+SBDS: n + 1 ─► AT*F ─► off
//! ```
//! Nothing here waits: [`Sbd::poll`] takes what has come, sends what there is room for, and looks at the time that it is given. Each
//! step has a limit and a number of times; one message takes at most [`LIMIT_MS`], and each begins with the modem's power switched on.
//!
//! **A session has taken place** when three lines say so: the modem numbers a session `n`, ends it well as `n`, and numbers the next one
//! `n + 1`, which it does after a finished one only. No checksum protects these lines: one damaged line must not be word from shore.
//!
//! **What comes from the shore orders nothing.** A message is acknowledged by the session that brings it and counted; its bytes stay in
//! the modem, no command to read them is ever sent, and switching off clears them.

pub mod answer;

use answer::{Ended, Lines, Said};
use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write, WriteReady};

/// Rate of its port, bit/s: as delivered.
pub const BAUD: u32 = 19_200;
/// Longest message, bytes: within one unit of 50 bytes it would cost least, 340 is the modem's own bound.
pub const MOST: usize = 100;
/// Longest that one message takes, from power on to power off, ms.
pub const LIMIT_MS: u64 = 240_000;
/// It is off for so long at least, ms: the guide asks for 2 s after its supply has fallen.
pub const OFF_MS: u64 = 4_000;
/// After power on it is not spoken to, ms (guess).
const BOOT_MS: u64 = 3_000;
/// Bytes taken, and sent, in one look.
const BYTES_IN: usize = 256;
const BYTES_OUT: usize = 4;
/// Times that a message is announced.
const ANNOUNCED: u8 = 3;

/// Why a message is not on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// It was stopped from here.
    Stopped,
    /// The modem did not answer: dead, or not fitted.
    Silent,
    /// An answer did not come, or made no sense, at this step.
    At(Step),
    /// No satellite is heard.
    NoNetwork,
    /// The session failed, with this status.
    Status(u16),
    /// A session that is said to have gone well has not moved its number.
    Unproven,
    /// All of it took too long.
    TooLong,
}

/// How a message ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It is with the shore.
    Sent {
        /// A message came with it, whose bytes nobody reads.
        incoming: bool,
        /// More of them wait there.
        waiting: u16,
    },
    /// It is not, as far as is known.
    Failed(Why),
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Switched off.
    Off,
    /// Starting.
    Boot,
    /// Asked whether it is there.
    Greet,
    /// Told not to echo.
    Echo,
    /// Told to ignore the line DTR, which is not wired.
    Dtr,
    /// Told to ignore flow control.
    Flow,
    /// Told not to announce calls.
    Rings,
    /// Asked for the signal.
    Signal,
    /// Before a look at the signal.
    Wait,
    /// Told that a message comes.
    Announce,
    /// Given the message.
    Load,
    /// Asked for the number of the next session.
    Before,
    /// In a session.
    Session,
    /// Asked for the number again.
    After,
    /// Told to write down what it keeps.
    Flush,
}

impl Step {
    /// What is said, for how long an answer is waited for, ms, and how often.
    const fn plan(self) -> (&'static [u8], u64, u8) {
        match self {
            Self::Off => (b"", u64::MAX, 1),
            Self::Boot => (b"", BOOT_MS, 1),
            Self::Greet => (b"AT\r", 1_000, 20),
            Self::Echo => (b"ATE0\r", 2_000, 3),
            Self::Dtr => (b"AT&D0\r", 2_000, 3),
            Self::Flow => (b"AT&K0\r", 2_000, 3),
            Self::Rings => (b"AT+SBDMTA=0\r", 2_000, 3),
            // It may look for a satellite before it answers (guess of how long).
            Self::Signal => (b"AT+CSQ\r", 10_000, 12),
            Self::Wait => (b"", 5_000, 1),
            Self::Announce => (b"AT+SBDWB=", 3_000, 3),
            Self::Load => (b"", 5_000, 1),
            Self::Before | Self::After => (b"AT+SBDS\r", 3_000, 3),
            // Once: a second one while the first is on its way is answered with an error. Sessions take 5 to 30 s, and some more (guess).
            Self::Session => (b"AT+SBDIX\r", 90_000, 1),
            Self::Flush => (b"AT*F\r", 3_000, 1),
        }
    }
}

/// The modem behind its port and its power switch.
#[derive(Debug)]
pub struct Sbd<U, P> {
    port: U,
    power: P,
    lines: Lines,
    step: Step,
    /// When the step began, when the modem was switched on or off, ms.
    since_ms: u64,
    switched_ms: u64,
    /// Times that this step was begun, and that the message was announced.
    times: u8,
    announced: u8,
    looks: u8,
    message: [u8; MOST],
    length: usize,
    /// Bytes of the step's words, and then of the message and its sum, that are sent.
    sent: usize,
    /// What came before `OK`.
    came: Option<Said>,
    /// Number of the session.
    number: u16,
    end: Option<End>,
}

impl<U: Read + ReadReady + Write + WriteReady, P: OutputPin> Sbd<U, P> {
    /// A modem that is switched off.
    pub fn new(port: U, mut power: P) -> Self {
        let _ = power.set_low();
        Self {
            port,
            power,
            lines: Lines::new(),
            step: Step::Off,
            since_ms: 0,
            switched_ms: 0,
            times: 0,
            announced: 0,
            looks: 0,
            message: [0; MOST],
            length: 0,
            sent: 0,
            came: None,
            number: 0,
            end: None,
        }
    }

    /// What it does.
    pub const fn step(&self) -> Step {
        self.step
    }

    /// Whether a message can be begun: it is off, and was for long enough.
    pub const fn is_free(&self, now_ms: u64) -> bool {
        matches!(self.step, Step::Off) && now_ms.saturating_sub(self.switched_ms) >= OFF_MS
    }

    /// Switches on and begins to send; false where it is not free, or the message is empty or longer than [`MOST`].
    pub fn begin(&mut self, message: &[u8], now_ms: u64) -> bool {
        let Some(room) = self.message.get_mut(..message.len()) else { return false };
        if message.is_empty() || !matches!(self.step, Step::Off) || now_ms.saturating_sub(self.switched_ms) < OFF_MS {
            return false;
        }
        room.iter_mut().zip(message).for_each(|(to, byte)| *to = *byte);
        self.length = message.len();
        (self.lines, self.end) = (Lines::new(), None);
        (self.announced, self.looks) = (1, 0);
        self.switched_ms = now_ms;
        let _ = self.power.set_high();
        self.enter(Step::Boot, now_ms);
        true
    }

    /// Ends what is under way and switches off, after the modem has written down what it keeps.
    pub fn stop(&mut self, now_ms: u64) {
        if !matches!(self.step, Step::Off | Step::Flush) {
            self.finish(End::Failed(Why::Stopped), now_ms);
        }
    }

    /// Switches off at once.
    pub fn off(&mut self, now_ms: u64) {
        let _ = self.power.set_low();
        if self.step != Step::Off {
            self.switched_ms = now_ms;
            self.enter(Step::Off, now_ms);
        }
    }

    /// Takes what has come and sends what is due: call often. Says once how a message ended.
    pub fn poll(&mut self, now_ms: u64) -> Option<End> {
        for _ in 0..BYTES_IN {
            if !self.port.read_ready().unwrap_or(false) {
                break;
            }
            let mut byte = [0; 1];
            if self.port.read(&mut byte).unwrap_or(0) == 0 {
                break;
            }
            let [byte] = byte;
            // What a modem that is off or starting says is not looked at.
            if !matches!(self.step, Step::Off | Step::Boot)
                && let Some(said) = self.lines.push(byte)
            {
                self.take(said, now_ms);
            }
        }
        self.look_at_time(now_ms);
        for _ in 0..BYTES_OUT {
            let Some(byte) = self.next_byte() else { break };
            if !self.port.write_ready().unwrap_or(false) || self.port.write(&[byte]).unwrap_or(0) == 0 {
                break;
            }
            self.sent = self.sent.saturating_add(1);
        }
        if self.step == Step::Off { self.end.take() } else { None }
    }

    fn enter(&mut self, step: Step, now_ms: u64) {
        if step != self.step {
            self.times = 0;
        }
        self.step = step;
        self.times = self.times.saturating_add(1);
        (self.since_ms, self.sent, self.came) = (now_ms, 0, None);
    }

    fn finish(&mut self, end: End, now_ms: u64) {
        self.end = Some(end);
        self.enter(Step::Flush, now_ms);
    }

    /// The next byte of what is to be said in this step.
    fn next_byte(&self) -> Option<u8> {
        let (words, _, _) = self.step.plan();
        let after = || self.sent.checked_sub(words.len());
        match self.step {
            Step::Announce => words.get(self.sent).copied().or_else(|| decimal(self.length).get(after()?).copied().filter(|b| *b != 0)),
            Step::Load => {
                let message = self.message.get(..self.length)?;
                message.get(self.sent).copied().or_else(|| sum(message).get(self.sent.checked_sub(self.length)?).copied())
            }
            _ => words.get(self.sent).copied(),
        }
    }

    /// A line came.
    fn take(&mut self, said: Said, now_ms: u64) {
        match (self.step, said) {
            (Step::Announce, Said::Ready) => self.enter(Step::Load, now_ms),
            (Step::Announce, Said::Written(_)) | (Step::Load, Said::Written(_)) => self.came = Some(said),
            (Step::Signal, Said::Signal(_)) | (Step::Before | Step::After, Said::Status { .. }) | (Step::Session, Said::Ended(_)) => {
                // Two that differ are none.
                self.came = if self.came.is_none_or(|before| before == said) { Some(said) } else { Some(Said::Other) };
            }
            (Step::Off | Step::Boot | Step::Wait, _) => {}
            (_, Said::Ok) => self.answered(now_ms),
            (_, Said::Error) => self.again(now_ms),
            _ => {}
        }
    }

    /// The answer to a step is complete.
    fn answered(&mut self, now_ms: u64) {
        let next = match (self.step, self.came) {
            (Step::Greet, _) => Step::Echo,
            (Step::Echo, _) => Step::Dtr,
            (Step::Dtr, _) => Step::Flow,
            (Step::Flow, _) => Step::Rings,
            // A modem that starts late answers several greetings: let them go by.
            (Step::Rings, _) => Step::Wait,
            (Step::Signal, Some(Said::Signal(bars))) if bars > 0 => Step::Announce,
            (Step::Signal, Some(Said::Signal(_))) => Step::Wait,
            (Step::Load, Some(Said::Written(0))) => Step::Before,
            (Step::Before, Some(Said::Status { loaded: true, next })) => {
                self.number = next;
                Step::Session
            }
            (Step::Session, Some(Said::Ended(ended))) => return self.ended(&ended, now_ms),
            (Step::After, Some(Said::Status { next, .. })) => {
                let end = if next == self.number.wrapping_add(1) { self.end } else { Some(End::Failed(Why::Unproven)) };
                return self.finish(end.unwrap_or(End::Failed(Why::Unproven)), now_ms);
            }
            (Step::Flush, _) => return self.off(now_ms),
            _ => return self.again(now_ms),
        };
        self.enter(next, now_ms);
    }

    fn ended(&mut self, ended: &Ended, now_ms: u64) {
        if ended.status > 4 {
            return self.finish(End::Failed(Why::Status(ended.status)), now_ms);
        }
        if ended.number != self.number {
            return self.finish(End::Failed(Why::Unproven), now_ms);
        }
        // Not before the number has moved.
        self.end = Some(End::Sent { incoming: ended.incoming == 1, waiting: ended.waiting });
        self.enter(Step::After, now_ms);
    }

    /// The step did not do: once more, or the message fails.
    fn again(&mut self, now_ms: u64) {
        let (_, _, most) = self.step.plan();
        match self.step {
            Step::Flush => self.off(now_ms),
            // Told anew that it comes.
            Step::Announce | Step::Load if self.announced < ANNOUNCED => {
                self.announced = self.announced.saturating_add(1);
                self.enter(Step::Announce, now_ms);
            }
            step if self.times < most && !matches!(step, Step::Announce | Step::Load) => self.enter(step, now_ms),
            Step::Greet => self.finish(End::Failed(Why::Silent), now_ms),
            step => self.finish(End::Failed(Why::At(step)), now_ms),
        }
    }

    fn look_at_time(&mut self, now_ms: u64) {
        if self.step == Step::Off {
            return;
        }
        if now_ms.saturating_sub(self.switched_ms) >= LIMIT_MS && self.step != Step::Flush {
            self.end = Some(End::Failed(Why::TooLong));
            return self.off(now_ms);
        }
        let (_, limit_ms, _) = self.step.plan();
        if now_ms.saturating_sub(self.since_ms) < limit_ms {
            return;
        }
        match self.step {
            Step::Boot => self.enter(Step::Greet, now_ms),
            Step::Wait => {
                let (_, _, most) = Step::Signal.plan();
                self.looks = self.looks.saturating_add(1);
                if self.looks < most {
                    self.enter(Step::Signal, now_ms);
                } else {
                    self.finish(End::Failed(Why::NoNetwork), now_ms);
                }
            }
            _ => self.again(now_ms),
        }
    }
}

/// A length as text with the end of the command; zeros after it.
fn decimal(length: usize) -> [u8; 4] {
    let digit = |unit: usize| b'0'.wrapping_add((length / unit % 10) as u8);
    match length {
        0..10 => [digit(1), b'\r', 0, 0],
        10..100 => [digit(10), digit(1), b'\r', 0],
        _ => [digit(100), digit(10), digit(1), b'\r'],
    }
}

/// The sum that follows a message, its high byte first: the low 16 bits of the sum of all bytes.
fn sum(message: &[u8]) -> [u8; 2] {
    message.iter().fold(0u16, |sum, byte| sum.wrapping_add(u16::from(*byte))).to_be_bytes()
}
