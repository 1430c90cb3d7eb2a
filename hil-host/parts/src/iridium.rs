//! Iridium 9602 (developer's guide revision 6, ISU AT Command Reference 2.45): commands, buffers, sessions, byte by byte at 19,200 baud.
//!
//! As delivered it echoes. The number of its sessions (MOMSN) outlives its supply, its buffers do not. How long it starts, looks for a
//! satellite and needs for a session are guesses within what users report.

use crate::{Around, Clock, Work};
use embedded_hal::digital::{self, OutputPin};
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

const SECOND_NS: u64 = 1_000_000_000;
const MS_NS: u64 = 1_000_000;
/// Time of a byte at 19,200 baud, 8N1, ns.
const MODEM_BYTE_NS: u64 = 10 * SECOND_NS / 19_200;
/// From power on to the first command (guess).
const BOOT_NS: u64 = 4 * SECOND_NS;
/// Sky in sight and supply on until a satellite is heard (guess).
const ACQUIRE_NS: u64 = 9 * SECOND_NS;
/// It gives up a message whose bytes do not come.
const WRITE_NS: u64 = 60 * SECOND_NS;
/// A session without network, and the shortest and longest with one.
const NO_SESSION_NS: u64 = 12 * SECOND_NS;
const SESSION_NS: (u64, u64) = (5 * SECOND_NS, 30 * SECOND_NS);
/// An answer that comes too late.
const LATE_NS: u64 = 200 * SECOND_NS;
/// Noise is on its way for so long ahead.
const BABBLE_NS: u64 = SECOND_NS / 10;
/// Longest message from here and to here, bytes.
const MOST: usize = 340;
/// Supply off for this long at least, else it may hang (guide, 3.2.4).
const OFF_NS: u64 = 2 * SECOND_NS;

/// What is wrong with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    #[default]
    None,
    /// Dead, or not fitted.
    Dead,
    /// No satellite is heard.
    NoNetwork,
    /// The signal is there and each session breaks off (18).
    DroppedCalls,
    /// It is busy with itself (35).
    Busy,
    /// It was registered a moment ago, always (36).
    TryLater,
    /// Each answer is noise of its length.
    Garbage,
    /// It sends noise without an end.
    Babble,
    /// Each answer breaks off in its middle.
    Cut,
    /// The answer to a session breaks off in its middle, and it falls silent.
    CutSession,
    /// The answer to a session comes after 200 s.
    Late,
    /// It dies in each session.
    DiesInSession,
    /// The sum of a message is never right.
    WrongSum,
    /// All but the greeting is an error.
    Errors,
    /// It does not take bytes.
    Stuck,
    /// A session is said to have gone well, and has not.
    FalseSuccess,
    /// It goes on echoing.
    EchoStays,
    /// A character of three in a thousand is another one, both ways.
    Noise,
}

impl Fault {
    /// All of them, with the names that the command line uses.
    pub const ALL: [(&'static str, Self); 18] = [
        ("none", Self::None),
        ("dead", Self::Dead),
        ("no-network", Self::NoNetwork),
        ("dropped-calls", Self::DroppedCalls),
        ("busy", Self::Busy),
        ("try-later", Self::TryLater),
        ("garbage", Self::Garbage),
        ("babble", Self::Babble),
        ("cut", Self::Cut),
        ("cut-session", Self::CutSession),
        ("late", Self::Late),
        ("dies-in-session", Self::DiesInSession),
        ("wrong-sum", Self::WrongSum),
        ("errors", Self::Errors),
        ("stuck", Self::Stuck),
        ("false-success", Self::FalseSuccess),
        ("echo-stays", Self::EchoStays),
        ("noise", Self::Noise),
    ];

    /// Whether a message may arrive all the same.
    #[must_use]
    pub const fn can_send(self) -> bool {
        matches!(self, Self::None | Self::EchoStays | Self::Noise)
    }
}

/// What it waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Doing {
    #[default]
    Commands,
    /// So many bytes of a message and its sum, until, ns.
    Message { bytes: usize, until_ns: u64 },
    /// In a session that ends at, ns.
    Session { end_ns: u64 },
    /// Silent until its supply was off.
    Hangs,
}

/// The modem.
pub struct Iridium {
    clock: Clock,
    around: Around,
    /// What is wrong with it; dead is not fitted.
    pub fault: Fault,
    /// When it was switched on, if it is; when it was switched off.
    on_ns: Option<u64>,
    off_ns: u64,
    looked_ns: u64,
    sky_ns: Option<u64>,
    echo: bool,
    doing: Doing,
    command: Vec<u8>,
    /// What is sent next session.
    outgoing: Vec<u8>,
    /// Number of the next session; number of the last message to here.
    momsn: u16,
    mtmsn: u16,
    /// Bytes from the board on their way, and to it, each with its time.
    inward: VecDeque<(u64, u8)>,
    coming: VecDeque<(u64, u8)>,
    kept: VecDeque<u8>,
    room: usize,
    random: u64,
    /// What reached the shore, and when, ns.
    pub shore: Vec<(u64, Vec<u8>)>,
    /// Messages to the vehicle that wait at the gateway.
    pub inbox: VecDeque<Vec<u8>>,
    /// Sessions begun; bytes of messages to here that the board has asked for.
    pub sessions: u32,
    /// Commands that ask for the bytes of a message from shore.
    pub asked_to_read: u32,
    /// When it was on: begin and end, ns; the last one may be open.
    pub on: Vec<(u64, Option<u64>)>,
}

impl Iridium {
    /// A modem that is switched off, and not fitted until its fault is another one; the port keeps `room` bytes.
    #[must_use]
    pub fn new(clock: Clock, around: Around, room: usize) -> Self {
        Self {
            clock,
            around,
            fault: Fault::Dead,
            on_ns: None,
            off_ns: 0,
            looked_ns: 0,
            sky_ns: None,
            echo: true,
            doing: Doing::Commands,
            command: Vec::new(),
            outgoing: Vec::new(),
            momsn: 37,
            mtmsn: 11,
            inward: VecDeque::new(),
            coming: VecDeque::new(),
            kept: VecDeque::new(),
            room,
            random: 0x9e37_79b9_7f4a_7c15,
            shore: Vec::new(),
            inbox: VecDeque::new(),
            sessions: 0,
            asked_to_read: 0,
            on: Vec::new(),
        }
    }

    /// The board was reset: its switch is open, its port empty.
    pub fn reset(&mut self) {
        self.switch(false);
        self.kept.clear();
    }

    /// xorshift64*, Vigna 2016.
    fn draw(&mut self, below: u64) -> u64 {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        (self.random.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) % below
    }

    fn switch(&mut self, on: bool) {
        let now = self.clock.now_ns();
        self.catch_up();
        match (on, self.on_ns) {
            (true, None) => {
                self.on_ns = Some(now);
                let hangs = self.off_ns > 0 && now - self.off_ns < OFF_NS;
                (self.doing, self.echo, self.sky_ns) = (if hangs { Doing::Hangs } else { Doing::Commands }, true, None);
                (self.command, self.outgoing) = (Vec::new(), Vec::new());
                self.on.push((now, None));
            }
            (false, Some(_)) => {
                (self.on_ns, self.off_ns) = (None, now);
                self.inward.clear();
                self.coming.clear();
                if let Some((_, end)) = self.on.last_mut() {
                    *end = Some(now);
                }
            }
            _ => {}
        }
    }

    /// Everything up to now has happened.
    pub fn catch_up(&mut self) {
        let now = self.clock.now_ns();
        let (before, on) = (self.looked_ns, self.on_ns);
        self.looked_ns = now;
        let Some(on_ns) = on.filter(|_| self.fault != Fault::Dead) else {
            self.inward.clear();
            return;
        };
        self.clock.work(Work::Modem, now - before.max(on_ns).min(now));
        let sky = self.around.borrow_mut().sky() && self.fault != Fault::NoNetwork;
        self.sky_ns = if sky { Some(self.sky_ns.unwrap_or(now)) } else { None };
        while let Some((at, byte)) = self.inward.front().copied().filter(|(at, _)| *at <= now) {
            self.inward.pop_front();
            if at >= on_ns + BOOT_NS && self.doing != Doing::Hangs {
                let byte = self.damaged(byte);
                self.take(at, byte);
            }
        }
        match self.doing {
            Doing::Message { until_ns, .. } if now >= until_ns => {
                self.doing = Doing::Commands;
                self.say(until_ns, "\r\n1\r\n\r\nOK\r\n");
            }
            Doing::Session { end_ns } if now >= end_ns => {
                self.clock.work(Work::ModemSession, end_ns.saturating_sub(before));
                self.end_session(end_ns);
            }
            Doing::Session { .. } => self.clock.work(Work::ModemSession, now - before),
            _ => {}
        }
        if self.fault == Fault::Babble {
            let mut at = self.coming.back().map_or(now, |(at, _)| *at);
            while at < now + BABBLE_NS {
                at += MODEM_BYTE_NS;
                let byte = self.draw(256) as u8;
                self.coming.push_back((at, byte));
            }
        }
        while let Some((_, byte)) = self.coming.front().copied().filter(|(at, _)| *at <= now) {
            self.coming.pop_front();
            let byte = self.damaged(byte);
            if self.kept.len() < self.room {
                self.kept.push_back(byte);
            }
        }
    }

    fn damaged(&mut self, byte: u8) -> u8 {
        if self.fault == Fault::Noise && self.draw(1_000) < 3 { byte ^ 1 << self.draw(8) } else { byte }
    }

    fn heard(&self, now: u64) -> bool {
        let since = self.sky_ns.unwrap_or(u64::MAX).max(self.on_ns.unwrap_or(u64::MAX));
        now.saturating_sub(ACQUIRE_NS) >= since
    }

    /// Bytes to the board, from a moment on.
    fn say(&mut self, from_ns: u64, text: &str) {
        let mut bytes = text.as_bytes().to_vec();
        match self.fault {
            Fault::Babble => return,
            Fault::Garbage => bytes.iter_mut().for_each(|b| *b = self.draw(256) as u8),
            Fault::Cut => bytes.truncate(bytes.len() / 2),
            Fault::CutSession if text.contains("+SBDIX") => {
                bytes.truncate(bytes.len() / 2);
                self.doing = Doing::Hangs;
            }
            _ => {}
        }
        let start = self.coming.back().map_or(from_ns, |(at, _)| from_ns.max(*at));
        self.coming.extend(bytes.into_iter().zip(1..).map(|(byte, i)| (start + i * MODEM_BYTE_NS, byte)));
    }

    fn take(&mut self, at: u64, byte: u8) {
        match self.doing {
            Doing::Message { bytes, .. } => {
                self.outgoing.push(byte);
                if self.outgoing.len() == bytes + 2 {
                    self.message(at, bytes);
                }
            }
            Doing::Session { .. } | Doing::Hangs => {}
            Doing::Commands => {
                if self.echo {
                    self.say(at, char::from(byte & 0x7f).to_string().as_str());
                }
                if byte == b'\r' {
                    let command = String::from_utf8_lossy(&std::mem::take(&mut self.command)).trim().to_uppercase();
                    self.obey(at, &command);
                } else if self.command.len() < 128 {
                    self.command.push(byte);
                }
            }
        }
    }

    fn message(&mut self, at: u64, bytes: usize) {
        self.doing = Doing::Commands;
        let sum = self.outgoing.split_off(bytes);
        let right = self.outgoing.iter().fold(0u16, |s, b| s.wrapping_add(u16::from(*b))).to_be_bytes();
        if sum == right && self.fault != Fault::WrongSum {
            self.say(at, "\r\n0\r\n\r\nOK\r\n");
        } else {
            self.outgoing.clear();
            self.say(at, "\r\n2\r\n\r\nOK\r\n");
        }
    }

    fn obey(&mut self, at: u64, command: &str) {
        const OK: &str = "\r\nOK\r\n";
        match command {
            "" => {}
            "AT" => self.say(at, OK),
            _ if self.fault == Fault::Errors => self.say(at, "\r\nERROR\r\n"),
            "ATE0" => {
                self.echo = self.fault == Fault::EchoStays;
                self.say(at, OK);
            }
            "AT&D0" | "AT&K0" | "AT*F" | "AT+SBDMTA=0" => self.say(at, OK),
            "AT+CSQ" => {
                let bars = if self.heard(at) { 1 + self.draw(5) } else { 0 };
                self.say(at + 2 * SECOND_NS, &format!("\r\n+CSQ:{bars}\r\n\r\nOK\r\n"));
            }
            "AT+SBDS" => {
                let (loaded, next) = (u8::from(!self.outgoing.is_empty()), self.momsn);
                self.say(at, &format!("\r\n+SBDS: {loaded}, {next}, 0, -1\r\n\r\nOK\r\n"));
            }
            "AT+SBDIX" => {
                self.sessions += 1;
                let needed =
                    if self.heard(at) { SESSION_NS.0 + self.draw((SESSION_NS.1 - SESSION_NS.0) / MS_NS) * MS_NS } else { NO_SESSION_NS };
                let needed = if self.fault == Fault::Late { LATE_NS } else { needed };
                self.doing = Doing::Session { end_ns: at + needed };
            }
            "AT+SBDRB" | "AT+SBDRT" => {
                self.asked_to_read += 1;
                self.say(at, "\r\nERROR\r\n");
            }
            _ => match command.strip_prefix("AT+SBDWB=").and_then(|n| n.parse().ok()) {
                Some(bytes @ 1..=MOST) => {
                    self.outgoing.clear();
                    self.doing = Doing::Message { bytes, until_ns: at + WRITE_NS };
                    self.say(at, "\r\nREADY\r\n");
                }
                Some(_) => self.say(at, "\r\n3\r\n\r\nOK\r\n"),
                None => self.say(at, "\r\nERROR\r\n"),
            },
        }
    }

    fn end_session(&mut self, at: u64) {
        self.doing = Doing::Commands;
        let failed = match self.fault {
            Fault::Busy => Some(35),
            Fault::TryLater => Some(36),
            Fault::DroppedCalls => Some(18),
            Fault::DiesInSession => {
                self.doing = Doing::Hangs;
                return;
            }
            _ if !self.heard(at) => Some(32),
            _ => None,
        };
        let number = self.momsn;
        let answer = match failed {
            Some(status) => format!("{status}, {number}, 2, 0, 0, 0"),
            None if self.fault == Fault::FalseSuccess => format!("0, {number}, 0, 0, 0, 0"),
            None => {
                self.momsn = self.momsn.wrapping_add(1);
                if !self.outgoing.is_empty() {
                    self.shore.push((at, self.outgoing.clone()));
                }
                match self.inbox.pop_front() {
                    Some(message) => {
                        self.mtmsn = self.mtmsn.wrapping_add(1);
                        format!("0, {number}, 1, {}, {}, {}", self.mtmsn, message.len(), self.inbox.len())
                    }
                    None => format!("0, {number}, 0, 0, 0, 0"),
                }
            }
        };
        self.say(at, &format!("\r\n+SBDIX: {answer}\r\n\r\nOK\r\n"));
    }
}

/// Its port, as the board sees it: one byte at a time goes out.
pub struct ModemPort(pub Rc<RefCell<Iridium>>);

impl ErrorType for ModemPort {
    type Error = Infallible;
}

impl Read for ModemPort {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        // A queue in memory does not fail.
        Ok(std::io::Read::read(&mut self.0.borrow_mut().kept, out).unwrap_or(0))
    }
}

impl ReadReady for ModemPort {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        let mut part = self.0.borrow_mut();
        part.catch_up();
        Ok(!part.kept.is_empty())
    }
}

impl Write for ModemPort {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let mut part = self.0.borrow_mut();
        let start = part.clock.now_ns().max(part.inward.back().map_or(0, |(at, _)| *at));
        part.inward.extend(bytes.iter().zip(1..).map(|(byte, i)| (start + i * MODEM_BYTE_NS, *byte)));
        Ok(bytes.len())
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl WriteReady for ModemPort {
    /// Room in the transmitter: one byte waits while another one is sent.
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        let part = self.0.borrow();
        let now = part.clock.now_ns();
        Ok(part.fault != Fault::Stuck && part.inward.back().is_none_or(|(at, _)| *at <= now + MODEM_BYTE_NS))
    }
}

/// Its supply's switch.
pub struct ModemPower(pub Rc<RefCell<Iridium>>);

impl digital::ErrorType for ModemPower {
    type Error = Infallible;
}

impl OutputPin for ModemPower {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().switch(false);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().switch(true);
        Ok(())
    }
}
