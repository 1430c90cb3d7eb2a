//! An object on its way to a board, and back to be compared.

use super::super::error::{SeatError, UploadError};
use super::{Link, Wire};
use signals::link::CRC32;
use signals::messages::CHUNK;
use signals::{Object, Refusal, ToBoard, ToHost};

/// What became of an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// CRC-32 of the object now in use, as the board says.
    pub crc: u32,
    /// The board's flash keeps it; false: until the next reset only.
    pub for_good: bool,
}

fn refused(asked: &'static str, why: Refusal) -> SeatError {
    SeatError::Refused { asked, why }
}

/// Sends an object in pieces, has it stored, reads it back and compares.
/// `progress` is told bytes done of bytes to do (sending and reading back).
///
/// # Errors
/// Line lost, refused by the board, or read back differently.
pub fn upload<W: Wire>(
    link: &mut Link<W>,
    object: Object,
    bytes: &[u8],
    mut progress: impl FnMut(usize, usize),
) -> Result<Stored, UploadError> {
    let total = 2 * bytes.len();
    let stored = send(link, object, bytes, |sent| progress(sent, total))?;
    let back = read_back(link, object, |n| progress(bytes.len() + n.min(bytes.len()), total))?;
    match back.iter().zip(bytes).position(|(a, b)| a != b) {
        Some(at) => Err(UploadError::ReadBack(at)),
        None if back.len() != bytes.len() => Err(UploadError::ReadBack(back.len().min(bytes.len()))),
        None => Ok(stored),
    }
}

/// Sends an object in pieces and has it stored. `progress` is told bytes sent.
///
/// # Errors
/// Line lost, or refused by the board.
pub fn send<W: Wire>(link: &mut Link<W>, object: Object, bytes: &[u8], mut progress: impl FnMut(usize)) -> Result<Stored, SeatError> {
    let (length, crc) = (bytes.len() as u32, CRC32.checksum(bytes));
    const WHAT: &str = "the upload";
    let mut sent = link.request(WHAT, &ToBoard::UploadBegin { object, length, crc }, |answer| match answer {
        ToHost::Continue { offset } => Some(Ok(offset as usize)),
        ToHost::Refused(why) => Some(Err(refused(WHAT, why))),
        _ => None,
    })??;
    while let Some(rest) = bytes.get(sent..).filter(|r| !r.is_empty()) {
        let piece = rest.get(..rest.len().min(CHUNK)).unwrap_or_default();
        let data = heapless::Vec::from_slice(piece).map_err(|_| SeatError::TooLong)?;
        let end = sent + piece.len();
        link.request(WHAT, &ToBoard::UploadChunk { offset: sent as u32, data }, |answer| match answer {
            ToHost::Continue { offset } if offset as usize == end => Some(Ok(())),
            ToHost::Refused(why) => Some(Err(refused(WHAT, why))),
            _ => None,
        })??;
        sent = end;
        progress(sent);
    }
    link.request(WHAT, &ToBoard::UploadCommit, |answer| match answer {
        ToHost::Done { crc } => Some(Ok(Stored { crc, for_good: true })),
        ToHost::Volatile { crc } => Some(Ok(Stored { crc, for_good: false })),
        ToHost::Refused(why) => Some(Err(refused(WHAT, why))),
        _ => None,
    })?
}

/// Goes back to the version of an object before the one in use; says which is in use now. Asked only once: the repeat of a
/// request whose answer was lost would go back twice.
///
/// # Errors
/// Line lost, no answer (read back then, to see what is in use), or refused.
pub fn rollback<W: Wire>(link: &mut Link<W>, object: Object) -> Result<Stored, SeatError> {
    const WHAT: &str = "the rollback";
    link.once(WHAT, &ToBoard::Rollback(object), |answer| match answer {
        ToHost::Done { crc } => Some(Ok(Stored { crc, for_good: true })),
        ToHost::Volatile { crc } => Some(Ok(Stored { crc, for_good: false })),
        ToHost::Refused(why) => Some(Err(refused(WHAT, why))),
        _ => None,
    })?
}

/// Reads an object in use from the board.
///
/// # Errors
/// Line lost or refused.
pub fn read_back<W: Wire>(link: &mut Link<W>, object: Object, mut progress: impl FnMut(usize)) -> Result<Vec<u8>, SeatError> {
    let mut content = Vec::new();
    loop {
        let at = content.len() as u32;
        let (length, data) = link.request("a read-back", &ToBoard::ReadBack { object, offset: at }, |answer| match answer {
            ToHost::Content { offset, length, data } if offset == at => Some(Ok((length as usize, data))),
            ToHost::Refused(why) => Some(Err(refused("a read-back", why))),
            _ => None,
        })??;
        if data.is_empty() || content.len() >= length {
            return Ok(content);
        }
        content.extend_from_slice(&data);
        progress(content.len());
    }
}
