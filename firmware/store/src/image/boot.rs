//! What is done before an image is started.

use super::images::{Error, Images, Slot};
use super::{FACTS, HEADER, SEAL, State, TRIALS};
use embedded_storage::nor_flash::NorFlash;

/// Moves from one state to the next at a boot: installed, given up, put back, started.
const MOVES: u8 = 4;

/// Slot 0 may be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// It is on trial: a watchdog has to be running already.
    pub trial: bool,
}

impl<J: NorFlash, F: NorFlash> Images<J, F> {
    /// Does what the journal says, and says whether slot 0 can be started then. `watchdog`: a watchdog has ended the run before.
    pub fn boot(&mut self, watchdog: bool) -> Option<Start> {
        for _ in 0..MOVES {
            match self.turn(watchdog) {
                Ok(Some(start)) => return Some(start),
                Ok(None) => {}
                Err(_) => break,
            }
        }
        self.last_resort()
    }

    /// One move.
    fn turn(&mut self, watchdog: bool) -> Result<Option<Start>, Error> {
        match self.state() {
            State::Wanted => self.install()?,
            State::Restoring => self.restore()?,
            State::Trial(boots) => {
                if boots >= TRIALS || watchdog && boots > 0 || self.whole(Slot::Runs).is_none() {
                    self.write_state(State::Restoring)?;
                } else {
                    self.write_state(State::Trial(boots.saturating_add(1)))?;
                    return Ok(Some(Start { trial: true }));
                }
            }
            State::Steady | State::RolledBack => {
                if self.may_start() {
                    return Ok(Some(Start { trial: false }));
                }
                self.mend()?;
            }
        }
        Ok(None)
    }

    /// The staged image into slot 0, and before that what is there into slot 2. Everything that a cut leaves undone is done again.
    fn install(&mut self) -> Result<(), Error> {
        let Some(staged) = self.whole(Slot::Staged) else { return self.write_state(State::Steady) };
        // After a cut slot 0 may be the new one already, or torn: then slot 2 has the one before.
        if let Some(runs) = self.whole(Slot::Runs)
            && runs != staged
            && self.whole(Slot::Before) != Some(runs)
        {
            self.copy(Slot::Runs, Slot::Before)?;
        }
        if self.whole(Slot::Runs) != Some(staged) {
            self.copy(Slot::Staged, Slot::Runs)?;
        }
        self.write_state(State::Trial(0))
    }

    /// The image before into slot 0. Without one slot 0 stays as it is.
    fn restore(&mut self) -> Result<(), Error> {
        if let Some(before) = self.whole(Slot::Before)
            && self.whole(Slot::Runs) != Some(before)
        {
            self.copy(Slot::Before, Slot::Runs)?;
        }
        self.write_state(State::RolledBack)
    }

    /// Slot 0 is not whole though nothing was being written: from its own copy, else from the one before.
    fn mend(&mut self) -> Result<(), Error> {
        let own = self.seal(Slot::Runs);
        let staged = self.whole(Slot::Staged);
        if staged.is_some() && staged == own {
            return self.copy(Slot::Staged, Slot::Runs);
        }
        if self.whole(Slot::Before).is_some() {
            return self.copy(Slot::Before, Slot::Runs);
        }
        if staged.is_some() { self.copy(Slot::Staged, Slot::Runs) } else { Err(Error::NothingBefore) }
    }

    /// A journal that cannot be written: rather any whole image than none.
    fn last_resort(&mut self) -> Option<Start> {
        if !self.may_start() {
            let _ = self.mend();
        }
        self.may_start().then_some(Start { trial: false })
    }

    /// A whole slot over another one, its seal last.
    fn copy(&mut self, from: Slot, to: Slot) -> Result<(), Error> {
        let seal = self.whole(from).ok_or(Error::Corrupt)?;
        self.erase(to, 0, seal.length)?;
        let mut piece = [0u8; 128];
        let mut at = HEADER;
        while at < seal.length {
            let n = piece.len().min(seal.length.saturating_sub(at) as usize);
            let part = piece.get_mut(..n).ok_or(Error::Flash)?;
            self.read(from, at, part)?;
            self.program(to, at, part)?;
            at = at.saturating_add(n as u32);
        }
        let mut head = [0u8; FACTS + SEAL];
        self.read(from, 0, &mut head)?;
        self.program(to, 0, &head)?;
        if self.whole(to) == Some(seal) { Ok(()) } else { Err(Error::Flash) }
    }
}
