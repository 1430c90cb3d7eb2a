//! The host's half of the line: requests, bounded waits, re-sending.
//!
//! Every request is repeated until it is answered or [`GIVE_UP`] has passed.
//! Repeating is harmless: the board answers a repeated sensor frame without a
//! second step, and the other requests have the same effect twice as once.

use super::Seat;
use super::upload::{UploadError, upload};
use control::Config;
use helm::Content;
use helm::objects::config_bytes;
use signals::link::{CRC32, MAX_WIRE};
use signals::{Answer, Manifest, Mission, Object, Receiver, Refusal, SensorFrame, ToBoard, ToHost, WIRE_VERSION, Wings, WireError, encode};
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

/// Why a seat does not fly.
#[derive(Debug)]
#[non_exhaustive]
pub enum SeatError {
    /// Nothing came back.
    NoAnswer {
        /// What was asked.
        asked: &'static str,
        /// Who was asked.
        seat: String,
        /// How long, s.
        waited_s: u64,
    },
    /// The board speaks another version of the wire.
    Version {
        /// Who.
        seat: String,
        /// Its version.
        theirs: u8,
    },
    /// The board understood and will not.
    Refused {
        /// What was asked.
        asked: &'static str,
        /// Why not.
        why: Refusal,
    },
    /// The line broke.
    Lost {
        /// Who.
        seat: String,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The board latched its own sensors and takes no frames from the line.
    OwnSensors {
        /// Who.
        seat: String,
    },
    /// The message does not fit a frame.
    TooLong,
    /// The supply of this seat's controller cannot be interrupted.
    NoReset {
        /// Who.
        seat: String,
    },
}

impl std::fmt::Display for SeatError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoAnswer { asked, seat, waited_s } => {
                write!(
                    f,
                    "{seat}: no answer to {asked} within {waited_s} s; check the cable, the power and that the board runs this project's firmware"
                )
            }
            Self::Version { seat, theirs } => write!(
                f,
                "{seat}: the board speaks wire version {theirs}, this program version {WIRE_VERSION}; flash the firmware of the same release (cargo flash)"
            ),
            Self::Refused { asked, why } => write!(f, "the controller refuses {asked}: {why:?}"),
            Self::Lost { seat, cause } => write!(f, "{seat}: line lost ({cause}); plug the board in again and repeat"),
            Self::OwnSensors { seat } => write!(
                f,
                "{seat}: the board flies on its own sensors since nobody spoke to it in its first 10 s; reset it and repeat within 10 s"
            ),
            Self::TooLong => f.write_str("message does not fit a frame"),
            Self::NoReset { seat } => write!(f, "{seat}: cannot interrupt its supply; fly power:brown_out with --seat in-process"),
        }
    }
}

impl std::error::Error for SeatError {}

/// A seat made of a wire.
pub struct Link<W> {
    wire: W,
    receiver: Receiver,
    inbox: std::collections::VecDeque<ToHost>,
    nonce: u32,
    version_seen: Option<u8>,
    /// Requests that had to be sent more than once.
    pub resent: u64,
    give_up: Duration,
}

impl<W: Wire> Link<W> {
    /// Nothing said yet.
    pub fn new(wire: W) -> Self {
        // The nonce only has to differ from the ones of earlier runs on the same board.
        let nonce = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(1, |d| d.subsec_nanos());
        Self {
            wire,
            receiver: Receiver::new(),
            inbox: std::collections::VecDeque::new(),
            nonce,
            version_seen: None,
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
        let mut out = [0u8; MAX_WIRE];
        let length = encode(message, &mut out).map_err(|_| SeatError::TooLong)?;
        let frame = out.get(..length).ok_or(SeatError::TooLong)?;
        let started = Instant::now();
        let mut wait = first_wait;
        let mut first = true;
        while first || started.elapsed() < give_up {
            if !first {
                self.resent += 1;
            }
            first = false;
            self.wire.send(frame).map_err(|e| self.lost(e))?;
            let until = Instant::now() + wait;
            loop {
                while let Some(answer) = self.inbox.pop_front() {
                    if let Some(taken) = accept(answer) {
                        return Ok(taken);
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
        Err(SeatError::NoAnswer { asked, seat: self.wire.describe(), waited_s: started.elapsed().as_secs_f64().ceil() as u64 })
    }

    /// Takes what comes within `wait`; false when nothing came.
    fn listen(&mut self, wait: Duration) -> Result<bool, SeatError> {
        let mut bytes = [0u8; 512];
        let n = self.wire.receive(&mut bytes, wait).map_err(|e| self.lost(e))?;
        for byte in bytes.iter().take(n) {
            match self.receiver.push::<ToHost>(*byte) {
                Some(Ok(message)) => self.inbox.push_back(message),
                Some(Err(WireError::Version(v))) => self.version_seen = Some(v),
                _ => {}
            }
        }
        Ok(n > 0)
    }

    fn lost(&self, cause: std::io::Error) -> SeatError {
        SeatError::Lost { seat: self.wire.describe(), cause }
    }
}

/// Uploads an object that the flight needs.
fn give<W: Wire>(link: &mut Link<W>, object: Object, bytes: &[u8], asked: &'static str) -> Result<(), SeatError> {
    upload(link, object, bytes, |_, _| {}).map(drop).map_err(|e| match e {
        UploadError::Seat(e) => e,
        UploadError::ReadBack(_) => SeatError::Refused { asked, why: Refusal::Storage },
    })
}

impl<W: Wire> Seat for Link<W> {
    fn hello(&mut self) -> Result<Manifest, SeatError> {
        self.nonce = self.nonce.wrapping_add(1);
        let nonce = self.nonce;
        self.request("hello", &ToBoard::Hello { nonce }, |answer| match answer {
            ToHost::Hello { nonce: n, manifest } if n == nonce => Some(manifest),
            _ => None,
        })
    }

    fn configure(&mut self, manifest: &Manifest, config: &Config) -> Result<(), SeatError> {
        let mut bytes = Content::new();
        config_bytes(config, &mut bytes);
        if manifest.config == CRC32.checksum(&bytes) {
            return Ok(());
        }
        give(self, Object::Config, &bytes, "the configuration")
    }

    fn tabulate(&mut self, wings: Wings, table: &[u8]) -> Result<(), SeatError> {
        give(self, Object::Table(wings), table, "the flight table")
    }

    fn recover(&mut self) -> Result<(), SeatError> {
        self.request("that it is recovered", &ToBoard::Recovered, |answer| match answer {
            ToHost::Done { .. } => Some(Ok(())),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: "that it is recovered", why })),
            _ => None,
        })?
    }

    fn begin(&mut self, mission: &Mission) -> Result<u32, SeatError> {
        self.request("the mission", &ToBoard::Begin(mission.clone()), |answer| match answer {
            ToHost::Ready { table_id } => Some(Ok(table_id)),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: "the mission", why })),
            _ => None,
        })?
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
