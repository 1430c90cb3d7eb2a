//! The host's half of the line: requests, bounded waits, re-sending.
//!
//! Every request is repeated until it is answered or [`GIVE_UP`] has passed.
//! Repeating is harmless: the board answers a repeated sensor frame without a
//! second step, and the other requests have the same effect twice as once.
//! A reply names its request: one to somebody else's, or to one before, ends
//! nothing. Where another hello has taken the session away, a new one is asked
//! for, twice at most for one request.

pub mod upload;

use super::Seat;
use super::error::{Heard, SeatError, UploadError};
use control::Config;
use helm::Content;
use helm::objects::{config_bytes, mission_id};
use signals::link::{CRC32, MAX_WIRE};
use signals::{
    Answer, Manifest, Mission, Object, Receiver, Refusal, Reply, Request, SensorFrame, ToBoard, ToHost, Wings, WireError, encode,
};
use std::time::{Duration, Instant};

/// First wait for an answer, s; doubled with every repeat. A board at 115,200
/// baud needs 25 ms for a frame and its answer; a QEMU on a busy machine was
/// seen to stall for 2 s.
pub const FIRST_WAIT: Duration = Duration::from_millis(250);
/// A request unanswered for this long means that nobody is there.
pub const GIVE_UP: Duration = Duration::from_secs(10);

/// Wait for the answer to a request that is not repeated, s: an erase of the log flash takes 0.4 s at most.
const ONCE: Duration = Duration::from_secs(3);

/// Bytes to a controller and back.
pub trait Wire {
    /// Sends all bytes.
    ///
    /// # Errors
    /// The line is gone.
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()>;
    /// Waits at most `wait` for bytes; `Ok(0)`: none came.
    ///
    /// # Errors
    /// The line is gone.
    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize>;
    /// One line for a person.
    fn describe(&self) -> String;
    /// Interrupts the controller's supply; false: this wire cannot.
    fn reset(&mut self) -> bool {
        false
    }
}

/// A seat made of a wire.
pub struct Link<W> {
    wire: W,
    receiver: Receiver,
    inbox: std::collections::VecDeque<Reply>,
    nonce: u32,
    session: u32,
    id: u16,
    heard: Heard,
    version_seen: Option<u8>,
    /// Identities of what the board was given, to be compared with what it says it will fly.
    given: Given,
    /// Requests that had to be sent more than once.
    pub resent: u64,
    give_up: Duration,
}

/// CRC-32 of what the next mission is to be flown with.
#[derive(Clone, Copy, Debug, Default)]
struct Given {
    config: Option<u32>,
    tables: [Option<u32>; 2],
}

const fn place(wings: Wings) -> usize {
    match wings {
        Wings::Standard => 0,
        Wings::LowAspectRatio => 1,
    }
}

impl<W: Wire> Link<W> {
    /// Nothing said yet.
    pub fn new(wire: W) -> Self {
        // The nonce only has to differ from the ones of other programs and runs on the same board.
        let nonce = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(1, |d| d.subsec_nanos());
        Self {
            wire,
            receiver: Receiver::new(),
            inbox: std::collections::VecDeque::new(),
            nonce,
            session: 0,
            id: nonce as u16,
            heard: Heard::default(),
            version_seen: None,
            given: Given::default(),
            resent: 0,
            give_up: GIVE_UP,
        }
    }

    /// Another patience than [`GIVE_UP`].
    #[must_use]
    pub fn patience(mut self, give_up: Duration) -> Self {
        self.give_up = give_up;
        self
    }

    /// The wire, for what only it knows.
    pub fn wire(&mut self) -> &mut W {
        &mut self.wire
    }

    /// Sends `message` until an answer is taken by `accept`.
    ///
    /// # Errors
    /// No answer in time, line lost, other version; refusals are answers and go to `accept` too.
    pub fn request<T>(&mut self, asked: &'static str, message: &ToBoard, accept: impl FnMut(ToHost) -> Option<T>) -> Result<T, SeatError> {
        self.ask(asked, message, FIRST_WAIT, self.give_up, accept)
    }

    /// Sends `message` once and waits a moment for an answer: for what must not be done twice.
    ///
    /// # Errors
    /// As [`Link::request`].
    pub fn once<T>(&mut self, asked: &'static str, message: &ToBoard, accept: impl FnMut(ToHost) -> Option<T>) -> Result<T, SeatError> {
        self.ask(asked, message, ONCE, Duration::ZERO, accept)
    }

    fn ask<T>(
        &mut self,
        asked: &'static str,
        message: &ToBoard,
        first_wait: Duration,
        give_up: Duration,
        mut accept: impl FnMut(ToHost) -> Option<T>,
    ) -> Result<T, SeatError> {
        for _ in 0..2 {
            match self.ask_once(asked, message, first_wait, give_up, &mut accept)? {
                Said::Taken(taken) => return Ok(taken),
                Said::OtherSession => drop(self.hello()?),
            }
        }
        match self.ask_once(asked, message, first_wait, give_up, &mut accept)? {
            Said::Taken(taken) => Ok(taken),
            Said::OtherSession => Err(SeatError::Refused { asked, why: Refusal::Session }),
        }
    }

    fn ask_once<T>(
        &mut self,
        asked: &'static str,
        message: &ToBoard,
        first_wait: Duration,
        give_up: Duration,
        accept: &mut impl FnMut(ToHost) -> Option<T>,
    ) -> Result<Said<T>, SeatError> {
        self.id = self.id.wrapping_add(1);
        let request = Request { session: self.session, id: self.id, message: message.clone() };
        let mut out = [0u8; MAX_WIRE];
        let length = encode(&request, &mut out).map_err(|_| SeatError::TooLong)?;
        let frame = out.get(..length).ok_or(SeatError::TooLong)?;
        let started = Instant::now();
        let mut wait = first_wait;
        let mut first = true;
        self.heard = Heard::default();
        while first || started.elapsed() < give_up {
            if !first {
                self.resent += 1;
            }
            first = false;
            self.wire.send(frame).map_err(|e| self.lost(e))?;
            let until = Instant::now() + wait;
            loop {
                while let Some(reply) = self.inbox.pop_front() {
                    if reply.to != request.id {
                        continue;
                    }
                    if reply.message == ToHost::Refused(Refusal::Session) {
                        return Ok(Said::OtherSession);
                    }
                    if let Some(taken) = accept(reply.message) {
                        return Ok(Said::Taken(taken));
                    }
                }
                if let Some(theirs) = self.version_seen {
                    return Err(SeatError::Version { seat: self.wire.describe(), theirs });
                }
                let left = until.saturating_duration_since(Instant::now());
                if left.is_zero() || !self.listen(left)? {
                    break;
                }
            }
            wait = (wait * 2).min(Duration::from_secs(2));
        }
        let waited_s = started.elapsed().as_secs_f64().ceil() as u64;
        Err(SeatError::NoAnswer { asked, seat: self.wire.describe(), waited_s, heard: self.heard })
    }

    /// Takes what comes within `wait`; false when nothing came.
    fn listen(&mut self, wait: Duration) -> Result<bool, SeatError> {
        let mut bytes = [0u8; 512];
        let n = self.wire.receive(&mut bytes, wait).map_err(|e| self.lost(e))?;
        self.heard.bytes += n as u64;
        for byte in bytes.iter().take(n) {
            match self.receiver.push::<Reply>(*byte) {
                Some(Ok(reply)) => {
                    self.heard.frames += 1;
                    self.inbox.push_back(reply);
                }
                Some(Err(WireError::Version(v))) => self.version_seen = Some(v),
                _ => {}
            }
        }
        Ok(n > 0)
    }

    /// The mission is armed: with what it was given? If not, it is called off before its first frame.
    fn compare(&mut self, given: [(&'static str, Option<u32>, u32); 3]) -> Result<(), SeatError> {
        for (what, given, taken) in given {
            if let Some(given) = given.filter(|given| *given != taken) {
                self.recall()?;
                return Err(SeatError::Other { what, given, taken });
            }
        }
        Ok(())
    }

    /// Hands over a mission by `message`; compares what the board will fly with what it was given.
    fn start(&mut self, message: &ToBoard, mission: &Mission) -> Result<u32, SeatError> {
        let (table_id, config, taken) = self.request("the mission", message, |answer| match answer {
            ToHost::Ready { table_id, config, mission, .. } => Some(Ok((table_id, config, mission))),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: "the mission", why })),
            _ => None,
        })??;
        let table = self.given.tables.get(place(mission.wings)).copied().flatten();
        let asked = Some(mission_id(mission)).filter(|_| !mission.legs.is_empty());
        self.compare([("flight table", table, table_id), ("configuration", self.given.config, config), ("mission", asked, taken)])?;
        Ok(table_id)
    }

    /// What the board says it has is what will be flown.
    pub fn keep(&mut self, manifest: &Manifest) {
        self.given = Given { config: Some(manifest.config), tables: [manifest.table_standard, manifest.table_low_ar].map(Some) };
    }

    /// Starts a mission on the vehicle's own sensors; without legs the stored one. Returns the identity of its table.
    ///
    /// # Errors
    /// The board refuses it, or would fly something else than it was given.
    pub fn launch(&mut self, mission: &Mission) -> Result<u32, SeatError> {
        self.start(&ToBoard::Launch(mission.clone()), mission)
    }

    fn lost(&self, cause: std::io::Error) -> SeatError {
        SeatError::Lost { seat: self.wire.describe(), cause }
    }
}

/// What came of one request.
enum Said<T> {
    Taken(T),
    /// Refused because of its session.
    OtherSession,
}

/// Uploads an object that the flight needs.
fn give<W: Wire>(link: &mut Link<W>, object: Object, bytes: &[u8], asked: &'static str) -> Result<(), SeatError> {
    upload::upload(link, object, bytes, |_, _| {}).map(drop).map_err(|e| match e {
        UploadError::Seat(e) => e,
        UploadError::ReadBack(_) => SeatError::Refused { asked, why: Refusal::Storage },
    })
}

impl<W: Wire> Seat for Link<W> {
    fn hello(&mut self) -> Result<Manifest, SeatError> {
        self.nonce = self.nonce.wrapping_add(1);
        let nonce = self.nonce;
        let said = self.ask_once("hello", &ToBoard::Hello { nonce }, FIRST_WAIT, self.give_up, &mut |answer| match answer {
            ToHost::Hello { nonce: n, session, manifest } if n == nonce => Some((session, manifest)),
            _ => None,
        })?;
        match said {
            Said::Taken((session, manifest)) => {
                self.session = session;
                Ok(manifest)
            }
            Said::OtherSession => Err(SeatError::Refused { asked: "hello", why: Refusal::Session }),
        }
    }

    fn configure(&mut self, manifest: &Manifest, config: &Config) -> Result<(), SeatError> {
        let mut bytes = Content::new();
        config_bytes(config, &mut bytes);
        let crc = CRC32.checksum(&bytes);
        // The tables were not given: those that the board says it has.
        self.keep(manifest);
        self.given.config = Some(crc);
        if manifest.config == crc {
            return Ok(());
        }
        give(self, Object::Config, &bytes, "the configuration")
    }

    fn tabulate(&mut self, wings: Wings, table: &[u8]) -> Result<(), SeatError> {
        give(self, Object::Table(wings), table, "the flight table")?;
        let id = polar::Table::parse(table, wings).map_or(0, |table| table.id());
        if let Some(place) = self.given.tables.get_mut(place(wings)) {
            *place = Some(id);
        }
        Ok(())
    }

    fn recover(&mut self) -> Result<(), SeatError> {
        self.request("that it is recovered", &ToBoard::Recovered, |answer| match answer {
            ToHost::Done { .. } => Some(Ok(())),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: "that it is recovered", why })),
            _ => None,
        })?
    }

    fn begin(&mut self, mission: &Mission) -> Result<u32, SeatError> {
        self.start(&ToBoard::Begin(mission.clone()), mission)
    }

    fn exchange(&mut self, frame: &SensorFrame) -> Result<Answer, SeatError> {
        self.request("a sensor frame", &ToBoard::Sensor(*frame), |answer| match answer {
            ToHost::Answer(a) if a.command.seq == frame.seq => Some(Ok(a)),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: "a sensor frame", why })),
            _ => None,
        })?
    }

    fn recall(&mut self) -> Result<(), SeatError> {
        self.request("the recall", &ToBoard::Recall, |answer| match answer {
            ToHost::Done { .. } => Some(Ok(())),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: "the recall", why })),
            _ => None,
        })?
    }

    fn reset(&mut self) -> Result<(), SeatError> {
        let before = self.hello()?.boots;
        if !self.wire.reset() {
            return Err(SeatError::NoReset { seat: self.wire.describe() });
        }
        self.receiver = Receiver::new();
        self.inbox.clear();
        // What still answers may be the controller from before; the next frame must meet the one after.
        let until = Instant::now() + self.give_up;
        while self.hello()?.boots == before {
            if Instant::now() >= until {
                return Err(SeatError::NoReset { seat: self.wire.describe() });
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(())
    }

    fn describe(&self) -> String {
        self.wire.describe()
    }
}
