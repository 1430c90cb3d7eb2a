//! The flight log: entries one after the other through all sectors, round and
//! round, the oldest sector erased for the next.
//!
//! ```text
//! sector:  magic u32 · sequence u32 · note u8 · 0 u8 · 0 u16 · header CRC u32 · entries …
//! entry:   length u16 · kind u8 · 0 u8 · CRC u32 over length, kind and data · data
//! ```
//!
//! Every sector is erased once per lap, so wear is even by construction: with
//! 4080 sectors of 4 KiB, 200-byte entries every 4 s and 100,000 erase cycles
//! (W25Q128JV datasheet 9.1) the part outlasts a thousand years of gliding.
//!
//! A power cut leaves at most one torn entry: its CRC tells, the rest of that
//! sector is left alone and the next entry opens the next sector.
//!
//! The *note* is one byte that must be known at the next boot without reading
//! the whole log (here: whether a mission is under way). A note is an entry,
//! and every sector's header repeats the last one.

use crate::{CRC32, Error};
use embedded_storage::nor_flash::NorFlash;

const RING_MAGIC: u32 = 0x474c_4f47; // "GLOG"
const SECTOR_HEADER: u32 = 16;
/// Bytes before the data of an entry: length (u16, little-endian), kind, and a sum.
pub const ENTRY_HEADER: usize = 8;
/// Longest entry, bytes.
pub const MAX_ENTRY: usize = 248;
/// Longest entry as it lies on the part, bytes.
pub const MAX_SPAN: usize = MAX_ENTRY + ENTRY_HEADER;
/// Kind of the entries that carry a note.
pub const NOTE: u8 = 0xff;

/// Where the log stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ring {
    /// First byte of the ring on the part.
    base: u32,
    /// Number of sectors.
    sectors: u32,
    /// Sector written last, its sequence number, and where the next entry goes.
    sector: u32,
    sequence: u32,
    next: u32,
    note: u8,
}

/// Bytes at the start of a sector that say which one it is.
pub const SECTOR_HEADER_BYTES: usize = SECTOR_HEADER as usize;

/// Sequence number of a sector from its first bytes; none where they are not a header of this log. For tools that read the
/// part from afar.
#[must_use]
pub fn sequence(header: &[u8]) -> Option<u32> {
    let [_, _, _, _, a, b, c, d, note, ..] = *header.first_chunk::<SECTOR_HEADER_BYTES>()?;
    let sequence = u32::from_le_bytes([a, b, c, d]);
    (header.first_chunk::<SECTOR_HEADER_BYTES>()? == &sector_header(sequence, note)).then_some(sequence)
}

/// Bytes of entries, with their headers, that surely fit in so many sectors: an entry that does not fit the rest of one goes to the next.
#[must_use]
pub const fn room(sectors: u32, sector: u32) -> u64 {
    sectors as u64 * sector.saturating_sub(SECTOR_HEADER + MAX_SPAN as u32 - 1) as u64
}

/// One whole entry.
struct Entry {
    kind: u8,
    length: usize,
}

impl Entry {
    /// Bytes it takes on the part.
    const fn span(&self) -> u32 {
        self.length.saturating_add(ENTRY_HEADER) as u32
    }
}

impl Ring {
    /// Finds the end of the log on the part from byte `base` on. One header
    /// per sector is read, and the newest sector's entries.
    ///
    /// # Errors
    /// [`Error::Place`] if fewer than two sectors are left, [`Error::Flash`]
    /// if the part does not answer.
    pub fn mount<F: NorFlash>(flash: &mut F, base: u32) -> Result<Self, Error> {
        const { assert!(F::WRITE_SIZE == 1, "bytes must be programmable one by one") };
        let size = F::ERASE_SIZE as u32;
        let sectors = (flash.capacity() as u32).saturating_sub(base) / size;
        if sectors < 2 || !base.is_multiple_of(size) {
            return Err(Error::Place);
        }
        let mut ring = Self { base, sectors, sector: sectors.saturating_sub(1), sequence: 0, next: size, note: 0 };
        for sector in 0..sectors {
            if let Some((sequence, note)) = ring.sector_header(flash, sector)?
                && sequence > ring.sequence
            {
                ring = Self { sector, sequence, note, next: SECTOR_HEADER, ..ring };
            }
        }
        if ring.sequence == 0 {
            return Ok(ring); // empty: the first entry opens sector 0
        }
        let mut data = [0u8; MAX_ENTRY];
        loop {
            match ring.entry(flash, ring.sector, ring.next, &mut data)? {
                Found::Entry(entry) => {
                    if let (NOTE, Some(note)) = (entry.kind, data.first()) {
                        ring.note = *note;
                    }
                    ring.next = ring.next.saturating_add(entry.span());
                }
                Found::Free => return Ok(ring),
                Found::Torn => {
                    ring.next = size; // leave the rest of this sector alone
                    return Ok(ring);
                }
            }
        }
    }

    /// Nothing was ever written: no sector has a header.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.sequence == 0
    }

    /// The last note written; 0 if there is none.
    #[must_use]
    pub const fn note(&self) -> u8 {
        self.note
    }

    /// Writes a note.
    ///
    /// # Errors
    /// As [`Ring::append`].
    pub fn set_note<F: NorFlash>(&mut self, flash: &mut F, note: u8) -> Result<(), Error> {
        self.append(flash, NOTE, &[note])?;
        self.note = note;
        Ok(())
    }

    /// Writes an entry; erases the oldest sector when the present one is full.
    ///
    /// # Errors
    /// [`Error::Flash`]: the entry is lost, the next one goes to the next sector.
    pub fn append<F: NorFlash>(&mut self, flash: &mut F, kind: u8, data: &[u8]) -> Result<(), Error> {
        if data.len() > MAX_ENTRY {
            return Err(Error::TooLong);
        }
        let size = F::ERASE_SIZE as u32;
        let length = Entry { kind, length: data.len() }.span();
        if self.next.saturating_add(length) > size {
            self.open_next_sector(flash)?;
        }
        let at = self.address::<F>(self.sector).saturating_add(self.next);
        let head = entry_header(kind, data);
        let written = flash.write(at, &head).and_then(|()| flash.write(at.saturating_add(ENTRY_HEADER as u32), data));
        if written.is_err() {
            self.next = size;
            return Err(Error::Flash);
        }
        let mut check = [0u8; ENTRY_HEADER];
        if flash.read(at, &mut check).is_err() || check != head {
            self.next = size;
            return Err(Error::Flash);
        }
        self.next = self.next.saturating_add(length);
        Ok(())
    }

    /// Shows every whole entry, oldest first: kind and data.
    ///
    /// # Errors
    /// [`Error::Flash`] if the part does not answer.
    pub fn read<F: NorFlash>(&self, flash: &mut F, mut show: impl FnMut(u8, &[u8])) -> Result<(), Error> {
        let mut data = [0u8; MAX_ENTRY];
        let mut sector = self.sector;
        for _ in 0..self.sectors {
            sector = self.after(sector);
            if self.sector_header(flash, sector)?.is_none() {
                continue;
            }
            let mut at = SECTOR_HEADER;
            while let Found::Entry(entry) = self.entry(flash, sector, at, &mut data)? {
                show(entry.kind, data.get(..entry.length).unwrap_or_default());
                at = at.saturating_add(entry.span());
            }
        }
        Ok(())
    }

    fn address<F: NorFlash>(&self, sector: u32) -> u32 {
        self.base.saturating_add(sector.saturating_mul(F::ERASE_SIZE as u32))
    }

    /// The sector after this one, round and round.
    const fn after(&self, sector: u32) -> u32 {
        let next = sector.saturating_add(1);
        if next < self.sectors { next } else { 0 }
    }

    fn open_next_sector<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), Error> {
        let sector = self.after(self.sector);
        let sequence = self.sequence.saturating_add(1);
        let at = self.address::<F>(sector);
        // Whatever happens below, this sector is not tried twice in a row.
        self.sector = sector;
        self.next = F::ERASE_SIZE as u32;
        flash.erase(at, at.saturating_add(F::ERASE_SIZE as u32)).map_err(|_| Error::Flash)?;
        flash.write(at, &sector_header(sequence, self.note)).map_err(|_| Error::Flash)?;
        if self.sector_header(flash, sector)? != Some((sequence, self.note)) {
            return Err(Error::Flash);
        }
        self.sequence = sequence;
        self.next = SECTOR_HEADER;
        Ok(())
    }

    fn sector_header<F: NorFlash>(&self, flash: &mut F, sector: u32) -> Result<Option<(u32, u8)>, Error> {
        let mut raw = [0u8; SECTOR_HEADER as usize];
        flash.read(self.address::<F>(sector), &mut raw).map_err(|_| Error::Flash)?;
        let [_, _, _, _, a, b, c, d, note, ..] = raw;
        let sequence = u32::from_le_bytes([a, b, c, d]);
        Ok((raw == sector_header(sequence, note)).then_some((sequence, note)))
    }

    fn entry<F: NorFlash>(&self, flash: &mut F, sector: u32, at: u32, data: &mut [u8; MAX_ENTRY]) -> Result<Found, Error> {
        let size = F::ERASE_SIZE as u32;
        let body_at = at.saturating_add(ENTRY_HEADER as u32);
        if body_at > size {
            return Ok(Found::Free);
        }
        let base = self.address::<F>(sector);
        let mut raw = [0u8; ENTRY_HEADER];
        flash.read(base.saturating_add(at), &mut raw).map_err(|_| Error::Flash)?;
        if raw == [0xff; ENTRY_HEADER] {
            return Ok(Found::Free);
        }
        let [lo, hi, kind, ..] = raw;
        let length = usize::from(u16::from_le_bytes([lo, hi]));
        let fits = (body_at as usize).saturating_add(length) <= F::ERASE_SIZE;
        let Some(body) = data.get_mut(..length).filter(|_| fits) else { return Ok(Found::Torn) };
        flash.read(base.saturating_add(body_at), body).map_err(|_| Error::Flash)?;
        Ok(if raw == entry_header(kind, body) { Found::Entry(Entry { kind, length }) } else { Found::Torn })
    }
}

/// What lies at a place of a sector.
enum Found {
    Entry(Entry),
    Free,
    Torn,
}

fn sector_header(sequence: u32, note: u8) -> [u8; SECTOR_HEADER as usize] {
    let ([m0, m1, m2, m3], [s0, s1, s2, s3]) = (RING_MAGIC.to_le_bytes(), sequence.to_le_bytes());
    let body = [m0, m1, m2, m3, s0, s1, s2, s3, note, 0, 0, 0];
    let [c0, c1, c2, c3] = CRC32.checksum(&body).to_le_bytes();
    [m0, m1, m2, m3, s0, s1, s2, s3, note, 0, 0, 0, c0, c1, c2, c3]
}

fn entry_header(kind: u8, data: &[u8]) -> [u8; ENTRY_HEADER] {
    let [lo, hi] = (data.len() as u16).to_le_bytes();
    let mut digest = CRC32.digest();
    digest.update(&[lo, hi, kind, 0]);
    digest.update(data);
    let [c0, c1, c2, c3] = digest.finalize().to_le_bytes();
    [lo, hi, kind, 0, c0, c1, c2, c3]
}
