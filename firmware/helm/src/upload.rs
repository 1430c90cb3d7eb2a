//! An object on its way in: pieces in order, every piece may come twice.

use crate::storage::{Content, Kept, MAX_OBJECT};
use signals::link::CRC32;
use signals::{Object, Older, Refusal};

/// The upload under way, or the one that was just finished.
#[derive(Clone, Debug)]
pub(crate) enum Upload {
    /// None.
    None,
    /// Pieces are coming.
    Open { object: Object, length: usize, crc: u32 },
    /// Taken: a repeated commit is answered again.
    Closed { crc: u32, kept: Kept },
}

/// An image on its way in; its bytes go past the RAM to where [`Storage`](crate::Storage) stages them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Incoming {
    /// None.
    None,
    /// Pieces are coming.
    Open { older: Older, length: u32, crc: u32, there: u32 },
    /// Taken: a repeated commit is answered again.
    Closed { crc: u32 },
}

/// Staging buffer with its state.
#[derive(Clone, Debug)]
pub(crate) struct Staging {
    upload: Upload,
    bytes: Content,
}

impl Staging {
    pub(crate) const fn new() -> Self {
        Self { upload: Upload::None, bytes: Content::new() }
    }

    pub(crate) fn begin(&mut self, object: Object, length: u32, crc: u32) -> Result<u32, Refusal> {
        let length = usize::try_from(length).map_err(|_| Refusal::TooLong)?;
        if matches!(self.upload, Upload::Open { object: o, length: l, crc: c } if (o, l, c) == (object, length, crc)) {
            return Ok(self.bytes.len() as u32); // asked again: go on where it stands
        }
        self.abandon();
        if length > MAX_OBJECT {
            return Err(Refusal::TooLong);
        }
        self.upload = Upload::Open { object, length, crc };
        Ok(0)
    }

    pub(crate) fn chunk(&mut self, offset: u32, data: &[u8]) -> Result<u32, Refusal> {
        let Upload::Open { length, .. } = self.upload else { return Err(Refusal::OutOfOrder) };
        let offset = usize::try_from(offset).map_err(|_| Refusal::OutOfOrder)?;
        let end = offset.checked_add(data.len()).ok_or(Refusal::TooLong)?;
        if end > length {
            return Err(Refusal::TooLong);
        }
        if offset == self.bytes.len() {
            data.iter().try_for_each(|b| self.bytes.push(*b)).map_err(|_| Refusal::TooLong)?;
        } else if self.bytes.get(offset..end) != Some(data) {
            return Err(Refusal::OutOfOrder); // not a repetition of what is there
        }
        Ok(self.bytes.len() as u32)
    }

    /// The complete object, its CRC checked.
    pub(crate) fn complete(&self) -> Result<(Object, u32, &Content), Refusal> {
        let Upload::Open { object, length, crc } = self.upload else { return Err(Refusal::OutOfOrder) };
        if self.bytes.len() != length {
            return Err(Refusal::OutOfOrder);
        }
        if CRC32.checksum(&self.bytes) != crc {
            return Err(Refusal::Corrupt);
        }
        Ok((object, crc, &self.bytes))
    }

    pub(crate) fn close(&mut self, crc: u32, kept: Kept) {
        self.upload = Upload::Closed { crc, kept };
        self.bytes.clear();
    }

    pub(crate) fn abandon(&mut self) {
        self.upload = Upload::None;
        self.bytes.clear();
    }

    /// The upload that was just taken, if nothing came since.
    pub(crate) fn just_taken(&self) -> Option<(u32, Kept)> {
        match self.upload {
            Upload::Closed { crc, kept } => Some((crc, kept)),
            _ => None,
        }
    }
}
