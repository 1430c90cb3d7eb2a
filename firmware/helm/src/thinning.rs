//! Which control cycles are kept, so that a mission of [`MISSION_DAYS`] fits the log.
//!
//! A token bucket (leaky bucket): bytes are earned as time passes, at the rate that fills one lap of the ring in that time, and are
//! paid for every entry. The bucket is full at the start of a mission, and what is not in it is not written: whatever a mission
//! does, its own beginning is not overwritten before it is that old.
//!
//! | kept | while |
//! |---|---|
//! | every cycle | the bucket is more than half full: about the first six hours |
//! | every 30th cycle | it is more than a quarter full, else every 60th |
//! | a turn, with the 8 cycles before and the 15 after it | it was an eighth full when the dive began: all turns of a dive, or none |
//! | an abort, a new degradation, leak or weight, with the same cycles | it holds enough for them |
//! | the cycle of each of these itself | it holds enough for one |

use signals::{Abort, Answer, Flags, Micros, Phase, SensorFrame, Switch, Weight};
use store::ring::{MAX_SPAN, room};

/// Longest mission whose log is kept whole, days.
pub const MISSION_DAYS: u64 = 60;
/// The log flash, bytes, and its sectors: Winbond W25Q128JV.
pub const PART: u32 = 16 * 1024 * 1024;
const SECTOR: u32 = 4096;
/// Sectors of the ring: what the slots of the objects leave, without the one being erased and one left alone after a torn entry.
const SECTORS: u32 = PART / SECTOR - 2 * crate::storage::OBJECTS as u32 - 2;
/// Bytes of entries that fit one lap at worst.
pub const ROOM: u64 = room(SECTORS, SECTOR);
/// Bytes that may be written at once.
pub const BURST: u64 = ROOM / 8;
const MISSION_MS: u64 = MISSION_DAYS * 86_400_000;
/// Longest time that is paid for at once, ms: a clock that jumps earns nothing more.
const MOST_PAID_MS: u64 = 3_600_000;
/// Cycles kept before an event.
pub const BEFORE: usize = 8;
/// Cycles kept after it.
pub const AFTER: u8 = 15;
/// Of the others every so many.
pub const EVERY: u8 = 30;
/// The same when little is left.
pub const SELDOM: u8 = 60;
/// Bytes of an event with all around it, at most.
const WINDOW: u64 = (BEFORE as u64 + 1 + AFTER as u64) * MAX_SPAN as u64;

/// What becomes of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// It may be wanted, if something happens soon.
    Aside,
    /// It is written when it is as old as that, or with what happens before: so that all around an event is there in order.
    Owed,
    /// It is written.
    This,
    /// It is written, after those that were put aside.
    WithBefore,
}

/// What an event is a change of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Status {
    phase: Phase,
    abort: Option<Abort>,
    flags: Flags,
    leak: Switch,
    weight: Weight,
}

/// The rule at work.
#[derive(Clone, Copy, Debug)]
pub struct Thinning {
    /// Bytes times [`MISSION_MS`]: nothing is rounded off.
    credit: u64,
    last: Option<Micros>,
    status: Option<Status>,
    /// Turns of this dive are kept with the cycles around them.
    whole: bool,
    /// Cycles still to be kept after an event, and cycles since one was kept.
    after: u8,
    since: u8,
}

impl Thinning {
    /// After a reset: enough for one event. How much was in the bucket is not known.
    #[must_use]
    pub const fn new() -> Self {
        Self::with(WINDOW)
    }

    /// A mission begins.
    #[must_use]
    pub const fn full() -> Self {
        Self::with(BURST)
    }

    const fn with(bytes: u64) -> Self {
        Self { credit: bytes * MISSION_MS, last: None, status: None, whole: false, after: 0, since: SELDOM }
    }

    fn holds(&self, bytes: u64) -> bool {
        self.credit >= bytes.saturating_mul(MISSION_MS)
    }

    fn earn(&mut self, now: Micros) {
        let passed = now.since(self.last.unwrap_or(now)).0 / 1_000;
        let earned = passed.min(MOST_PAID_MS).saturating_mul(ROOM.saturating_sub(BURST));
        self.credit = self.credit.saturating_add(earned).min(BURST.saturating_mul(MISSION_MS));
        self.last = Some(now);
    }

    /// An entry was written.
    pub fn pay(&mut self, bytes: u32) {
        self.credit = self.credit.saturating_sub(u64::from(bytes).saturating_mul(MISSION_MS));
    }

    /// Decides on a cycle.
    pub fn look(&mut self, frame: &SensorFrame, answer: &Answer) -> Keep {
        let keep = self.decide(frame, answer);
        self.since = if keep == Keep::Aside { self.since.saturating_add(1) } else { 1 };
        keep
    }

    fn decide(&mut self, frame: &SensorFrame, answer: &Answer) -> Keep {
        self.earn(frame.time);
        let trace = &answer.trace;
        let now = Status { phase: trace.phase, abort: trace.abort, flags: trace.flags, leak: frame.leak, weight: frame.weight };
        let before = self.status.replace(now);
        let turn = before.is_none_or(|b| b.phase != now.phase);
        let trouble = before.is_none_or(|b| Status { phase: now.phase, ..b } != now);
        if turn && matches!(now.phase, Phase::Dive | Phase::InflectHigh) {
            self.whole = self.holds(BURST / 8);
        }
        if !self.holds(MAX_SPAN as u64) {
            return Keep::Aside;
        }
        if self.holds(WINDOW) && (trouble || turn && self.whole) {
            self.after = AFTER;
            return Keep::WithBefore;
        }
        if self.holds(BURST / 2) {
            return Keep::WithBefore;
        }
        let after = self.after > 0;
        self.after = self.after.saturating_sub(1);
        let due = self.since >= SELDOM || self.since >= EVERY && self.holds(BURST / 4);
        match (turn || trouble || after, due) {
            (true, _) => Keep::This,
            (false, true) => Keep::Owed,
            (false, false) => Keep::Aside,
        }
    }
}

impl Default for Thinning {
    fn default() -> Self {
        Self::new()
    }
}
