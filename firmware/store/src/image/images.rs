//! The slots and the journal, and what the running image may do with them.

use super::{BOARD, FACTS, Facts, HEADER, RUNS_AT, SEAL, Seal, State, TRIALS};
use crate::{CRC32, Ring};
use embedded_storage::nor_flash::NorFlash;

/// RAM of the board: where a stack may begin.
const RAM: core::ops::RangeInclusive<u32> = 0x2000_0000..=0x2002_0000;

/// Bytes of a slot that are read at once.
const PIECE: usize = 128;

/// Why an image is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The flash reported an error, or what was written did not read back.
    Flash,
    /// Longer than a slot, or shorter than an image can be.
    Length,
    /// A piece that is not where the last one ended.
    OutOfOrder,
    /// Its bytes do not match its CRC, or its facts its length.
    Corrupt,
    /// No image, or one for another board.
    Board,
    /// Of an older version than the one that runs.
    Older,
    /// The image that runs is on trial itself.
    OnTrial,
    /// There is no image before the one that runs.
    NothingBefore,
}

/// Where the image that runs stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Flashed by a probe; nothing was ever uploaded since.
    Flashed,
    /// Confirmed by a finished control step.
    Confirmed,
    /// On trial: so many boots are left to it.
    Trial(u8),
    /// Put back, because the one after it was given up.
    RolledBack,
    /// Another one takes its place at the next boot.
    Leaving,
}

/// A slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    Runs = 0,
    Staged = 1,
    Before = 2,
}

/// The three slots on `F` and the journal on `J`, which share nothing with anything else.
#[derive(Debug)]
pub struct Images<J, F> {
    journal: J,
    slots: F,
    /// None: not opened, or not readable.
    ring: Option<Ring>,
    /// Bytes staged so far; none: no upload is under way.
    staged: Option<u32>,
}

impl<J: NorFlash, F: NorFlash> Images<J, F> {
    /// Nothing is looked at before [`Images::open`].
    pub const fn new(journal: J, slots: F) -> Self {
        const { assert!(F::WRITE_SIZE == 1, "bytes must be programmable one by one") };
        Self { journal, slots, ring: None, staged: None }
    }

    /// Reads the journal.
    pub fn open(&mut self) {
        self.ring = Ring::mount(&mut self.journal, 0).ok();
    }

    /// Both parts, for tests and tools.
    pub const fn parts(&mut self) -> (&mut J, &mut F) {
        (&mut self.journal, &mut self.slots)
    }

    /// What the journal says.
    #[must_use]
    pub fn state(&self) -> State {
        self.ring.as_ref().map_or(State::Steady, |ring| State::of(ring.note()))
    }

    /// Nothing was ever written to the journal: what runs was flashed by a probe, the boot loader with it.
    pub(crate) fn is_new(&self) -> bool {
        self.ring.as_ref().is_some_and(Ring::is_empty)
    }

    /// Where the image that runs stands.
    #[must_use]
    pub fn standing(&self) -> Standing {
        match self.state() {
            State::Steady if self.is_new() => Standing::Flashed,
            State::Steady => Standing::Confirmed,
            State::Trial(boots) => Standing::Trial(TRIALS.saturating_sub(boots)),
            State::RolledBack => Standing::RolledBack,
            State::Wanted | State::Restoring => Standing::Leaving,
        }
    }

    pub(crate) fn write_state(&mut self, state: State) -> Result<(), Error> {
        let ring = self.ring.as_mut().ok_or(Error::Flash)?;
        // After a failure the ring goes on in its next sector.
        let first = ring.set_note(&mut self.journal, state.note());
        first.or_else(|_| ring.set_note(&mut self.journal, state.note())).map_err(|_| Error::Flash)
    }

    /// Bytes of a slot.
    #[must_use]
    pub fn slot_length(&self) -> u32 {
        (self.slots.capacity() as u32) / 3
    }

    fn address(&self, slot: Slot, at: u32) -> u32 {
        (slot as u32).saturating_mul(self.slot_length()).saturating_add(at)
    }

    pub(crate) fn read(&mut self, slot: Slot, at: u32, out: &mut [u8]) -> Result<(), Error> {
        let address = self.address(slot, at);
        self.slots.read(address, out).map_err(|_| Error::Flash)
    }

    pub(crate) fn program(&mut self, slot: Slot, at: u32, bytes: &[u8]) -> Result<(), Error> {
        let address = self.address(slot, at);
        self.slots.write(address, bytes).map_err(|_| Error::Flash)
    }

    /// Erases the sectors of a slot that begin within these bytes of it.
    pub(crate) fn erase(&mut self, slot: Slot, from: u32, to: u32) -> Result<(), Error> {
        let size = F::ERASE_SIZE as u32;
        let mut sector = from.div_ceil(size).saturating_mul(size);
        while sector < to {
            let address = self.address(slot, sector);
            self.slots.erase(address, address.saturating_add(size)).map_err(|_| Error::Flash)?;
            sector = sector.saturating_add(size);
        }
        Ok(())
    }

    fn facts(&mut self, slot: Slot) -> Result<Facts, Error> {
        let mut raw = [0; FACTS];
        self.read(slot, 0, &mut raw)?;
        Facts::read(&raw).filter(|facts| facts.board == BOARD).ok_or(Error::Board)
    }

    pub(crate) fn seal(&mut self, slot: Slot) -> Option<Seal> {
        let mut raw = [0; SEAL];
        self.read(slot, FACTS as u32, &mut raw).ok()?;
        Seal::read(&raw)
    }

    /// Whether a slot's facts and the first words of its vector table are those of an image of this board, linked for slot 0.
    fn plausible(&mut self, slot: Slot) -> Result<Facts, Error> {
        let facts = self.facts(slot)?;
        if facts.length < HEADER.saturating_add(8) || facts.length > self.slot_length() {
            return Err(Error::Length);
        }
        let mut raw = [0; 8];
        self.read(slot, HEADER, &mut raw)?;
        let [a, b, c, d, e, f, g, h] = raw;
        let (stack, reset) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        let code = RUNS_AT.saturating_add(HEADER)..RUNS_AT.saturating_add(facts.length);
        if RAM.contains(&stack) && reset & 1 == 1 && code.contains(&reset) { Ok(facts) } else { Err(Error::Board) }
    }

    /// CRC-32 over a slot's image as if it had no seal.
    fn sum(&mut self, slot: Slot, length: u32) -> Result<u32, Error> {
        let mut digest = CRC32.digest();
        let mut piece = [0u8; PIECE];
        let mut at = 0u32;
        while at < length {
            let n = piece.len().min(length.saturating_sub(at) as usize);
            let part = piece.get_mut(..n).ok_or(Error::Flash)?;
            self.read(slot, at, part)?;
            if at < HEADER {
                let mut place = at;
                for byte in part.iter_mut() {
                    if (FACTS as u32..(FACTS + SEAL) as u32).contains(&place) {
                        *byte = 0xff;
                    }
                    place = place.saturating_add(1);
                }
            }
            digest.update(part);
            at = at.saturating_add(n as u32);
        }
        Ok(digest.finalize())
    }

    /// The seal of a slot that is whole.
    pub(crate) fn whole(&mut self, slot: Slot) -> Option<Seal> {
        let seal = self.seal(slot)?;
        let facts = self.plausible(slot).ok()?;
        (facts.length == seal.length && self.sum(slot, seal.length) == Ok(seal.crc)).then_some(seal)
    }

    /// Whether slot 0 may be started: whole, or flashed by a probe and never touched since.
    pub(crate) fn may_start(&mut self) -> bool {
        self.whole(Slot::Runs).is_some() || self.is_new() && self.plausible(Slot::Runs).is_ok()
    }

    /// Seals a slot whose image is complete. Done again after a cut it completes what was begun.
    fn close(&mut self, slot: Slot, seal: Seal) -> Result<(), Error> {
        self.program(slot, FACTS as u32, &seal.bytes())?;
        if self.whole(slot) == Some(seal) { Ok(()) } else { Err(Error::Flash) }
    }

    /// Begins to stage an image of so many bytes. What was staged before, or waited, is gone.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::OnTrial`], [`Error::Flash`].
    pub fn begin(&mut self, length: u32) -> Result<(), Error> {
        self.staged = None;
        if length < HEADER.saturating_add(8) || length > self.slot_length() {
            return Err(Error::Length);
        }
        match self.state() {
            State::Trial(_) => return Err(Error::OnTrial),
            State::Wanted | State::Restoring => self.write_state(State::Steady)?,
            State::Steady | State::RolledBack => {}
        }
        self.staged = Some(0);
        Ok(())
    }

    /// Bytes staged so far.
    #[must_use]
    pub const fn staged(&self) -> Option<u32> {
        self.staged
    }

    /// Stages the next bytes, or compares bytes that are there; returns how many are there now. What is sent for the header's
    /// place behind the facts must be as erased.
    ///
    /// # Errors
    /// [`Error::OutOfOrder`], [`Error::Length`], [`Error::Flash`].
    pub fn piece(&mut self, at: u32, bytes: &[u8]) -> Result<u32, Error> {
        let done = self.staged.ok_or(Error::OutOfOrder)?;
        let end = at.saturating_add(bytes.len() as u32);
        if end > self.slot_length() {
            return Err(Error::Length);
        }
        if at == done {
            self.erase(Slot::Staged, at, end)?;
            // The header's place behind the facts stays erased.
            let (facts, _) = bytes.split_at_checked((FACTS as u32).saturating_sub(at) as usize).unwrap_or((bytes, &[]));
            self.program(Slot::Staged, at, facts)?;
            let skip = HEADER.saturating_sub(at);
            self.program(Slot::Staged, at.saturating_add(skip), bytes.get(skip as usize..).unwrap_or_default())?;
            self.staged = Some(end);
        } else if end > done {
            return Err(Error::OutOfOrder);
        }
        if self.is_there(at, bytes)? {
            self.staged.ok_or(Error::OutOfOrder)
        } else {
            Err(if at == done { Error::Flash } else { Error::OutOfOrder })
        }
    }

    /// Whether the staged slot has these bytes.
    fn is_there(&mut self, at: u32, bytes: &[u8]) -> Result<bool, Error> {
        let mut there = [0u8; 32];
        let mut at = at;
        for piece in bytes.chunks(there.len()) {
            let there = there.get_mut(..piece.len()).ok_or(Error::Flash)?;
            self.read(Slot::Staged, at, there)?;
            if there != piece {
                return Ok(false);
            }
            at = at.saturating_add(piece.len() as u32);
        }
        Ok(true)
    }

    /// All staged: checks it, seals it, and has it installed at the next boot. `older`: an older version may come. Returns whether it
    /// will be: the image that runs already is not installed again.
    ///
    /// # Errors
    /// Why not; what runs goes on.
    pub fn commit(&mut self, length: u32, crc: u32, older: bool, running: [u8; 3]) -> Result<bool, Error> {
        if self.staged != Some(length) {
            return Err(Error::OutOfOrder);
        }
        if self.sum(Slot::Staged, length)? != crc {
            return Err(Error::Corrupt);
        }
        let facts = self.plausible(Slot::Staged)?;
        if facts.length != length {
            return Err(Error::Corrupt);
        }
        if facts.firmware < running && !older {
            return Err(Error::Older);
        }
        self.staged = None;
        self.seal_running()?;
        let seal = Seal { length, crc, id: facts.id };
        if self.seal(Slot::Runs).is_some_and(|runs| (runs.length, runs.crc) == (length, crc)) {
            return Ok(false);
        }
        self.close(Slot::Staged, seal)?;
        self.write_state(State::Wanted)?;
        Ok(true)
    }

    /// What a probe has flashed gets its seal, so that it can be copied and come back.
    fn seal_running(&mut self) -> Result<(), Error> {
        if !self.is_new() {
            return Ok(());
        }
        let facts = self.plausible(Slot::Runs)?;
        let crc = self.sum(Slot::Runs, facts.length)?;
        self.close(Slot::Runs, Seal { length: facts.length, crc, id: facts.id })
    }

    /// The image that runs has finished a control step: it is good. `id`: its identity as it reckons it itself.
    ///
    /// # Errors
    /// [`Error::Corrupt`]: it is not the one that was uploaded. [`Error::Flash`].
    pub fn confirm(&mut self, id: u32) -> Result<(), Error> {
        if !matches!(self.state(), State::Trial(_)) {
            return Ok(());
        }
        match self.seal(Slot::Runs) {
            Some(seal) if seal.id == id => self.write_state(State::Steady),
            _ => Err(Error::Corrupt),
        }
    }

    /// Forgets an upload that is not complete.
    pub const fn abandon(&mut self) {
        self.staged = None;
    }

    /// Takes an installation back that has not begun, else has the image before put back at the next boot: asked again after the first
    /// it does the second.
    ///
    /// # Errors
    /// [`Error::NothingBefore`], [`Error::Flash`].
    pub fn go_back(&mut self) -> Result<(), Error> {
        match self.state() {
            State::Restoring => Ok(()),
            State::Wanted => self.write_state(State::RolledBack),
            State::Steady | State::RolledBack | State::Trial(_) => match self.whole(Slot::Before) {
                Some(before) if self.seal(Slot::Runs) != Some(before) => self.write_state(State::Restoring),
                _ => Err(Error::NothingBefore),
            },
        }
    }
}
