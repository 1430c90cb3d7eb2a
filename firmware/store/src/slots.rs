//! Two slots per object, so that one of them is always whole.
//!
//! A slot is one sector: header, mark, content.
//!
//! ```text
//! 0   magic        u32
//! 4   generation   u32   higher is newer
//! 8   length       u32   bytes of content
//! 12  content CRC  u32
//! 16  header CRC   u32   over bytes 0..16 and the object's number
//! 20  mark         u32   all ones: in force; anything else: revoked
//! 24  content
//! ```
//!
//! Save: erase the slot that is *not* in use, program the content, then the
//! header; only the complete header makes it count. Rollback: program the mark
//! of the slot in use; one changed bit is enough, so a cut leaves either the
//! old or the new state.

use crate::{CRC32, Error};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;

const SLOT_MAGIC: u32 = 0x474c_4431; // "GLD1"
const SLOT_HEADER: usize = 20;
const MARK: u32 = 20;
const CONTENT: u32 = 24;

/// One slot as found.
#[derive(Clone, Copy, Debug)]
struct Slot {
    at: u32,
    generation: u32,
    length: usize,
    crc: u32,
    revoked: bool,
}

/// A/B slots of `OBJECTS` objects from the start of the part.
#[derive(Debug)]
pub struct Slots<F, const OBJECTS: usize> {
    flash: F,
}

impl<F: NorFlash, const OBJECTS: usize> Slots<F, OBJECTS> {
    /// Bytes taken from the start of the part.
    pub const SPAN: u32 = 2 * OBJECTS as u32 * F::ERASE_SIZE as u32;

    /// Slots on this part.
    pub const fn new(flash: F) -> Self {
        const { assert!(F::WRITE_SIZE == 1, "bytes must be programmable one by one") };
        Self { flash }
    }

    /// The part, for the ring that shares it.
    pub const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Copies what is in use to `out`; returns its generation, `None` if there
    /// is nothing valid.
    ///
    /// # Errors
    /// [`Error::Place`] for an unknown object, [`Error::Flash`] if the part does not answer.
    pub fn load<const N: usize>(&mut self, object: usize, out: &mut Vec<u8, N>) -> Result<Option<u32>, Error> {
        for slot in self.newest_first(object)?.into_iter().flatten() {
            if !slot.revoked && self.content(&slot, out)? {
                return Ok(Some(slot.generation));
            }
        }
        out.clear();
        Ok(None)
    }

    /// Makes `bytes` the content in use; returns its generation. What was in
    /// use stays until this is complete, and can be rolled back to.
    ///
    /// # Errors
    /// [`Error::Flash`] also when the content does not read back as written.
    pub fn save(&mut self, object: usize, bytes: &[u8]) -> Result<u32, Error> {
        if bytes.len().saturating_add(CONTENT as usize) > F::ERASE_SIZE {
            return Err(Error::TooLong);
        }
        let found = self.newest_first(object)?;
        let mut in_use = None;
        for slot in found.into_iter().flatten() {
            if !slot.revoked && self.content_is_good(&slot)? {
                in_use = Some(slot.at);
                break;
            }
        }
        let generation = found.into_iter().flatten().map(|s| s.generation).max().map_or(1, |g| g.saturating_add(1));
        let (a, b) = Self::places(object)?;
        let at = if in_use == Some(a) { b } else { a };
        let crc = CRC32.checksum(bytes);
        self.flash.erase(at, at.saturating_add(F::ERASE_SIZE as u32)).map_err(|_| Error::Flash)?;
        self.flash.write(at.saturating_add(CONTENT), bytes).map_err(|_| Error::Flash)?;
        let header = header(object, generation, bytes.len() as u32, crc);
        self.flash.write(at, &header).map_err(|_| Error::Flash)?;
        match self.read_slot(object, at)? {
            Some(slot) if slot.generation == generation && !slot.revoked && self.content_is_good(&slot)? => Ok(generation),
            _ => Err(Error::Flash),
        }
    }

    /// Revokes what is in use; the one before it, if still whole, is in use again.
    ///
    /// # Errors
    /// [`Error::Flash`] if the mark does not read back.
    pub fn rollback(&mut self, object: usize) -> Result<(), Error> {
        for slot in self.newest_first(object)?.into_iter().flatten() {
            if !slot.revoked && self.content_is_good(&slot)? {
                self.flash.write(slot.at.saturating_add(MARK), &[0; 4]).map_err(|_| Error::Flash)?;
                return match self.read_slot(object, slot.at)? {
                    Some(now) if !now.revoked => Err(Error::Flash),
                    _ => Ok(()),
                };
            }
        }
        Ok(())
    }

    fn places(object: usize) -> Result<(u32, u32), Error> {
        if object >= OBJECTS {
            return Err(Error::Place);
        }
        let size = F::ERASE_SIZE as u32;
        let a = (object as u32).saturating_mul(2).saturating_mul(size);
        Ok((a, a.saturating_add(size)))
    }

    /// Both slots with a whole header, the newer first.
    fn newest_first(&mut self, object: usize) -> Result<[Option<Slot>; 2], Error> {
        let (a, b) = Self::places(object)?;
        let (a, b) = (self.read_slot(object, a)?, self.read_slot(object, b)?);
        let newer = |s: &Option<Slot>| s.map_or(0, |s| s.generation);
        Ok(if newer(&b) > newer(&a) { [b, a] } else { [a, b] })
    }

    fn read_slot(&mut self, object: usize, at: u32) -> Result<Option<Slot>, Error> {
        let mut raw = [0u8; SLOT_HEADER + 4];
        self.flash.read(at, &mut raw).map_err(|_| Error::Flash)?;
        let (words, _) = raw.as_chunks::<4>();
        let word = |i: usize| words.get(i).map_or(0, |w| u32::from_le_bytes(*w));
        let (generation, length, crc) = (word(1), word(2), word(3));
        let expected = header(object, generation, length, crc);
        let whole = raw.get(..SLOT_HEADER) == Some(expected.as_slice()) && word(0) == SLOT_MAGIC;
        let fits = length as usize <= F::ERASE_SIZE - CONTENT as usize;
        Ok((whole && fits).then_some(Slot { at, generation, length: length as usize, crc, revoked: word(5) != u32::MAX }))
    }

    fn content<const N: usize>(&mut self, slot: &Slot, out: &mut Vec<u8, N>) -> Result<bool, Error> {
        out.clear();
        if slot.length > N || out.resize(slot.length, 0).is_err() {
            return Ok(false);
        }
        self.flash.read(slot.at.saturating_add(CONTENT), out).map_err(|_| Error::Flash)?;
        Ok(CRC32.checksum(out) == slot.crc)
    }

    fn content_is_good(&mut self, slot: &Slot) -> Result<bool, Error> {
        let mut digest = CRC32.digest();
        let mut piece = [0u8; 32];
        let mut done = 0;
        while done < slot.length {
            let n = piece.len().min(slot.length.saturating_sub(done));
            let part = piece.get_mut(..n).ok_or(Error::Flash)?;
            self.flash.read(slot.at.saturating_add(CONTENT).saturating_add(done as u32), part).map_err(|_| Error::Flash)?;
            digest.update(part);
            done = done.saturating_add(n);
        }
        Ok(digest.finalize() == slot.crc)
    }
}

fn header(object: usize, generation: u32, length: u32, crc: u32) -> [u8; SLOT_HEADER] {
    let mut digest = CRC32.digest();
    let mut out = [0u8; SLOT_HEADER];
    let (words, _) = out.as_chunks_mut::<4>();
    for (word, value) in words.iter_mut().zip([SLOT_MAGIC, generation, length, crc]) {
        *word = value.to_le_bytes();
        digest.update(word);
    }
    digest.update(&(object as u32).to_le_bytes());
    let sum = digest.finalize();
    if let Some(last) = words.last_mut() {
        *last = sum.to_le_bytes();
    }
    out
}
