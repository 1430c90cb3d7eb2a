//! The board's own radio: at each surfacing one short message to the shore, and whether that was heard there.
//!
//! Optional: a modem that is not fitted does not answer, and is looked for twice a surfacing. It is switched on afloat only. What it
//! does, says or fails to say changes one thing: a session that is proven ([`devices::sbd`]) is word from shore in one cycle,
//! [`signals::Surface::comms`]. No message from shore is read, and none orders anything.
//!
//! | | |
//! |---|---|
//! | begins | at the surface in Comms, Done or Safe: with a fix, or after a minute |
//! | tells | [`Evidence`] since the last message that arrived, as it is when the modem is switched on |
//! | once more | after an abort that the last message did not know of |
//! | again | after 15 s, 30 s, 1, 2, 4, 8, 15 min …, [`TRIES`] times a surfacing |
//! | ends | when the vehicle leaves the surface: the modem is off 3 s later |

use devices::sbd::{End, OFF_MS, Sbd, Step, Why};
use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use signals::surfacing::{is_dive, is_up};
use signals::{Answer, Evidence, SensorFrame};

/// Steps at the surface after which the message is made without a fix: a minute.
const WAITS: u8 = 15;
/// Messages begun at one surfacing.
pub const TRIES: u8 = 16;
/// Of these to a modem that does not answer at all.
const SILENT: u8 = 2;
/// Pause after the first failure, and the longest, ms.
const PAUSE_MS: u64 = 15_000;
const LONGEST_MS: u64 = 900_000;
/// After "try later" (status 36) it is three minutes, by the command reference; ms.
const LATER: u16 = 36;
const LATER_MS: u64 = 180_000;
/// Word from shore that no cycle took is none after this, ms.
const FRESH_WORD_MS: u64 = 10_000;

const _: () = assert!(PAUSE_MS > OFF_MS, "a modem is off for long enough before it is switched on again");

/// What came of the messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// With the shore.
    pub sent: u32,
    /// Begun, and not.
    pub failed: u32,
    /// Messages from shore that came with them, unread.
    pub incoming: u32,
    /// Why the last one failed.
    pub why: Option<Why>,
}

/// The modem, and what it shall tell.
#[derive(Debug)]
pub struct Radio<U, P> {
    modem: Sbd<U, P>,
    /// Since the last message that arrived, and since the one under way was made.
    evidence: Evidence,
    since: Option<Evidence>,
    up: bool,
    /// Steps at the surface since the last dive, messages begun there, silent ones among them.
    steps: u8,
    tries: u8,
    silent: u8,
    told: bool,
    /// The last message, and the one under way, know of an abort.
    knows_abort: (bool, bool),
    fixed: bool,
    next_ms: u64,
    heard_ms: Option<u64>,
    /// What came of the messages.
    pub tally: Tally,
}

impl<U: Read + ReadReady + Write + WriteReady, P: OutputPin> Radio<U, P> {
    /// Switched off.
    pub fn new(port: U, power: P) -> Self {
        Self {
            modem: Sbd::new(port, power),
            evidence: Evidence::default(),
            since: None,
            up: false,
            steps: 0,
            tries: 0,
            silent: 0,
            told: false,
            knows_abort: (false, false),
            fixed: false,
            next_ms: 0,
            heard_ms: None,
            tally: Tally::default(),
        }
    }

    /// Takes a step of the law.
    pub fn take(&mut self, frame: &SensorFrame, answer: &Answer, now_ms: u64) {
        self.evidence.take(frame, answer);
        if let Some(since) = &mut self.since {
            since.take(frame, answer);
        }
        self.up = is_up(&answer.trace);
        if is_dive(&answer.trace) {
            self.anew();
            (self.steps, self.fixed) = (0, false);
        }
        if self.told && answer.trace.abort.is_some() && !self.knows_abort.0 {
            self.anew();
        }
        if self.up {
            self.steps = self.steps.saturating_add(1);
            self.fixed |= frame.surface.gps_fix;
        } else {
            self.modem.stop(now_ms);
        }
    }

    /// Goes on: call often.
    pub fn poll(&mut self, now_ms: u64) {
        match self.modem.poll(now_ms) {
            Some(End::Sent { incoming, .. }) => {
                self.tally.sent = self.tally.sent.saturating_add(1);
                self.tally.incoming = self.tally.incoming.saturating_add(u32::from(incoming));
                self.evidence = self.since.take().unwrap_or_default();
                (self.told, self.knows_abort.0) = (true, self.knows_abort.1);
                // Under water again it is too late to say that the antenna is out.
                self.heard_ms = self.up.then_some(now_ms);
            }
            Some(End::Failed(why)) => {
                self.tally.failed = self.tally.failed.saturating_add(1);
                self.tally.why = Some(why);
                self.since = None;
                self.silent = self.silent.saturating_add(u8::from(why == Why::Silent));
                self.next_ms = now_ms.saturating_add(pause_ms(self.tries, why));
            }
            None => {}
        }
        let may = self.up && !self.told && self.tries < TRIES && self.silent < SILENT && now_ms >= self.next_ms;
        if may && (self.fixed || self.steps >= WAITS) && self.modem.is_free(now_ms) {
            let message = self.evidence.told().encode();
            if self.modem.begin(&message, now_ms) {
                self.knows_abort.1 = self.evidence.told().abort.is_some();
                self.tries = self.tries.saturating_add(1);
                self.since = Some(Evidence::default());
            }
        }
    }

    /// Whether the shore was heard since the last call.
    pub fn take_heard(&mut self, now_ms: u64) -> bool {
        self.heard_ms.take().is_some_and(|at_ms| now_ms.saturating_sub(at_ms) < FRESH_WORD_MS)
    }

    /// Whether something is to be told at this surfacing, or being told.
    pub const fn has_to_tell(&self) -> bool {
        self.up && !self.told && self.tries < TRIES && self.silent < SILENT
    }

    /// Whether the modem is switched off: nothing of it is heard or timed until the next message.
    pub const fn is_off(&self) -> bool {
        matches!(self.modem.step(), Step::Off)
    }

    /// Another mission, or none: off, and nothing to tell.
    pub fn rest(&mut self, now_ms: u64) {
        self.modem.off(now_ms);
        (self.evidence, self.since, self.up, self.heard_ms) = (Evidence::default(), None, false, None);
        (self.steps, self.fixed, self.knows_abort) = (0, false, (false, false));
        self.anew();
    }

    /// Another message is due.
    const fn anew(&mut self) {
        (self.tries, self.silent, self.told, self.next_ms) = (0, 0, false, 0);
    }
}

/// Pause after so many tries.
fn pause_ms(tries: u8, why: Why) -> u64 {
    let doubled = PAUSE_MS.saturating_mul(1 << tries.saturating_sub(1).min(6)).min(LONGEST_MS);
    if why == Why::Status(LATER) { doubled.max(LATER_MS) } else { doubled }
}
