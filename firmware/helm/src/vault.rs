//! What outlives the power: uploaded objects, the mark of a mission, the log.
//!
//! One NOR part holds all three (A/B slots first, the log ring behind them,
//! see [`store`]). Everything written is read back; what the part does not
//! keep is kept in RAM and said to be lost at the next reset. Without a part,
//! or with one that fails, the flight goes on.
//!
//! The *mark* says that a mission is under way. It is on flash before the
//! first command of the mission leaves the board, and cleared only after the
//! mission is over: after a power cut of any length the board knows whether to
//! come up SAFE.

use crate::mark::Mark;
use crate::storage::{Content, Kept, OBJECTS, RamStorage, Storage, place};
use crate::thinning::{BEFORE, Keep, Thinning};
use embedded_storage::nor_flash::NorFlash;
use heapless::Deque;
use signals::{Answer, Object, Refusal, SensorFrame, Utc};
use store::ring::{MAX_ENTRY, MAX_SPAN, NOTE};
use store::{Ring, Slots};

/// One control cycle in the log, so that each decision can be replayed: UTC where it was known, frame, answer.
pub type Logged = (Option<Utc>, SensorFrame, Answer);

/// Kind of the log entries that hold a [`Logged`] (postcard).
pub const CYCLE: u8 = 3;

/// The part and what stands in for it.
#[derive(Debug)]
pub struct Vault<F> {
    part: Option<Slots<F, OBJECTS>>,
    ring: Option<Ring>,
    ram: RamStorage,
    mark: Mark,
    thinning: Thinning,
    /// Cycles of late that were not written, and whether they have to be.
    aside: Deque<(Logged, bool), BEFORE>,
    lost: bool,
    /// Writes failed in a row.
    failed: u8,
}

/// After so many failed writes in a row the log is given up: a part that
/// answers every erase with its full 420 ms must not hold up each cycle.
const GIVE_UP: u8 = 8;

impl<F: NorFlash> Vault<F> {
    /// Without a part: all in RAM.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            part: None,
            ring: None,
            ram: RamStorage::new(),
            mark: Mark::NONE,
            thinning: Thinning::new(),
            aside: Deque::new(),
            lost: false,
            failed: 0,
        }
    }

    /// Takes the part into use; returns the mark found on it. A part without a
    /// readable log gives [`Mark::NONE`] and a lost log.
    pub fn attach(&mut self, part: F) -> Mark {
        let mut slots = Slots::new(part);
        self.ring = Ring::mount(slots.flash(), Slots::<F, OBJECTS>::SPAN).ok();
        self.lost = self.ring.is_none();
        self.part = Some(slots);
        self.mark = self.ring.as_ref().map_or(Mark::NONE, |ring| Mark(ring.note()));
        self.mark
    }

    /// The part, for tests and tools.
    pub fn part(&mut self) -> Option<&mut F> {
        self.part.as_mut().map(Slots::flash)
    }

    /// After a failure the ring goes on in the next sector, so a second try is worth while.
    fn write(&mut self, kind: u8, data: &[u8], tries: u8) -> bool {
        let (Some(ring), Some(part)) = (&mut self.ring, &mut self.part) else { return false };
        let done = (0..tries).any(|_| match kind {
            NOTE => ring.set_note(part.flash(), data.first().copied().unwrap_or_default()).is_ok(),
            _ => ring.append(part.flash(), kind, data).is_ok(),
        });
        // For good: the log of this run has a gap.
        self.lost |= !done;
        self.failed = if done { 0 } else { self.failed.saturating_add(1) };
        if self.failed >= GIVE_UP {
            self.ring = None;
        }
        done
    }

    /// Writes the oldest of the cycles put aside, if it has to be or if all are wanted.
    fn write_oldest(&mut self, all: bool) {
        if let Some((cycle, owed)) = self.aside.pop_front()
            && (all || owed)
        {
            self.write_cycle(&cycle);
        }
    }

    #[inline(never)]
    fn write_cycle(&mut self, cycle: &Logged) {
        let mut buffer = [0u8; MAX_ENTRY];
        match postcard::to_slice(cycle, &mut buffer) {
            Ok(entry) => {
                let bytes = entry.len().saturating_add(MAX_SPAN - MAX_ENTRY) as u32;
                self.write(CYCLE, entry, 1);
                self.thinning.pay(bytes);
            }
            Err(_) => self.lost = true,
        }
    }
}

impl<F: NorFlash> Default for Vault<F> {
    fn default() -> Self {
        Self::new()
    }
}

impl<F: NorFlash> Storage for Vault<F> {
    /// What is in RAM is newer than what is on the part.
    #[inline(never)]
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        if self.ram.load(object, out) {
            return true;
        }
        match self.part.as_mut().map(|part| part.load(place(object), out)) {
            Some(Ok(Some(_))) => true,
            _ => {
                out.clear();
                false
            }
        }
    }

    #[inline(never)]
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        match self.part.as_mut().map(|part| part.save(place(object), bytes)) {
            Some(Ok(_)) => {
                self.ram.forget(object);
                Ok(Kept::ForGood)
            }
            _ => self.ram.save(object, bytes),
        }
    }

    #[inline(never)]
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        if self.ram.holds(object) {
            return self.ram.rollback(object);
        }
        match &mut self.part {
            Some(part) => part.rollback(place(object)).map(|()| Kept::ForGood).map_err(|_| Refusal::Storage),
            None => Ok(Kept::UntilReset),
        }
    }

    #[inline(never)]
    fn mark(&mut self, mark: Mark) {
        if mark != self.mark && self.write(NOTE, &[mark.0], 2) {
            self.mark = mark;
        }
    }

    fn begin_log(&mut self) {
        self.thinning = Thinning::full();
        self.aside.clear();
    }

    #[inline(never)]
    fn log(&mut self, utc: Option<Utc>, frame: &SensorFrame, answer: &Answer) {
        if self.ring.is_none() {
            return;
        }
        let cycle = (utc, *frame, *answer);
        let keep = self.thinning.look(frame, answer);
        if matches!(keep, Keep::Aside | Keep::Owed) {
            if self.aside.is_full() {
                self.write_oldest(false);
            }
            let _ = self.aside.push_back((cycle, keep == Keep::Owed));
            return;
        }
        for _ in 0..BEFORE {
            self.write_oldest(keep == Keep::WithBefore);
        }
        self.write_cycle(&cycle);
    }

    fn log_lost(&mut self) -> bool {
        self.lost
    }

    #[inline(never)]
    fn read_log(&mut self, at: u32, out: &mut [u8]) -> u32 {
        let Some(part) = self.part.as_mut().map(Slots::flash) else { return 0 };
        let start = Slots::<F, OBJECTS>::SPAN;
        let length = (part.capacity() as u32).saturating_sub(start);
        let at = at.min(length);
        let there = out.len().min(length.saturating_sub(at) as usize);
        match out.get_mut(..there).map(|out| part.read(start.saturating_add(at), out)) {
            Some(Ok(())) => length,
            _ => 0,
        }
    }
}
