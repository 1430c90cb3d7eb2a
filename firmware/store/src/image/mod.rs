//! Images of the firmware: which one runs, which one waits, and the way back.
//!
//! Three slots of equal size lie on the chip's own flash, and a journal (a [`Ring`](crate::Ring) of two sectors) beside them:
//!
//! ```text
//! slot 0   runs     linked for this place, started here and nowhere else
//! slot 1   staged   what is being uploaded, or was uploaded last
//! slot 2   before   what ran before the last installation: the way back
//! ```
//!
//! A slot begins with its header, the vector table follows:
//!
//! ```text
//! 0    facts   32 bytes, linked into the image: magic, board, length, version, wire version, identity
//! 32   seal    20 bytes: magic, length, CRC-32 over the image as if it had no seal, identity, CRC-32 of the seal
//! 52   erased
//! 512  vector table, code, constants, initial values
//! ```
//!
//! The seal is written last. A slot counts only when its seal and the CRC of all its bytes are right; nothing half written does.
//! What a probe has flashed has no seal: it is believed while the journal is empty, and sealed where it lies before the first entry.
//!
//! ```text
//!              commit             boot loader             finished control step
//!   Steady ───────────► Wanted ──────────────► Trial(n) ─────────────────────────► Steady
//!      ▲                                          │ n boots without it, a watchdog, or not whole
//!      └── RolledBack ◄──────── Restoring ◄───────┘
//!                                   ▲ rollback asked for
//! ```
//!
//! An installation copies slot 0 to slot 2 (unless slot 0 is what is to be installed already), slot 1 to slot 0, and writes the
//! entry: a cut anywhere is mended by doing it again. Going back copies slot 2 to slot 0. Of two slots that a copy touches the one
//! that is read is whole before, and stays.

mod boot;
mod images;

pub use boot::Start;
pub use images::{Error, Images, Standing};

use crate::CRC32;

/// Bytes from the start of a slot to its vector table: facts, seal, and the alignment that the chip's vector table needs.
pub const HEADER: u32 = 512;
/// Bytes of the facts.
pub const FACTS: usize = 32;
/// Bytes of the seal, behind the facts.
pub const SEAL: usize = 20;
/// First word of the facts.
pub const MAGIC: u32 = u32::from_le_bytes(*b"GIMG");
/// First word of the seal.
const SEALED: u32 = u32::from_le_bytes(*b"SEAL");
/// The board that these images are for: science bay, STM32F405RG.
pub const BOARD: [u8; 8] = *b"SCIBAY01";
/// Address of slot 0 on that board.
pub const RUNS_AT: u32 = 0x0802_0000;
/// Boots that an image on trial has to finish a control step in.
pub const TRIALS: u8 = 3;
/// Identity of an image that was linked and not uploaded: the tool that uploads it writes the right one.
pub const NO_ID: u32 = u32::MAX;

/// What an image says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// The board it is for.
    pub board: [u8; 8],
    /// Its length with the header, bytes.
    pub length: u32,
    /// Version major, minor, patch.
    pub firmware: [u8; 3],
    /// Version of the wire that it speaks.
    pub wire: u8,
    /// Identity: CRC-32 of code, constants and initial values; [`NO_ID`] as linked.
    pub id: u32,
}

impl Facts {
    /// From the first bytes of a slot or an image; none: no image of this kind.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (words, _) = bytes.first_chunk::<FACTS>()?.as_chunks::<4>();
        let [magic, board, name, length, version, id, ..] = *words else { return None };
        let ([a, b, c, d], [e, f, g, h], [major, minor, patch, wire]) = (board, name, version);
        (u32::from_le_bytes(magic) == MAGIC).then_some(Self {
            board: [a, b, c, d, e, f, g, h],
            length: u32::from_le_bytes(length),
            firmware: [major, minor, patch],
            wire,
            id: u32::from_le_bytes(id),
        })
    }

    /// As they lie in an image.
    #[must_use]
    pub fn bytes(&self) -> [u8; FACTS] {
        let mut out = [0xff; FACTS];
        let ([a, b, c, d, e, f, g, h], [major, minor, patch]) = (self.board, self.firmware);
        let words = [
            MAGIC.to_le_bytes(),
            [a, b, c, d],
            [e, f, g, h],
            self.length.to_le_bytes(),
            [major, minor, patch, self.wire],
            self.id.to_le_bytes(),
        ];
        out.as_chunks_mut::<4>().0.iter_mut().zip(words).for_each(|(to, word)| *to = word);
        out
    }
}

/// What makes a slot count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Seal {
    pub(crate) length: u32,
    pub(crate) crc: u32,
    pub(crate) id: u32,
}

impl Seal {
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.first_chunk::<SEAL>()?;
        let (words, _) = bytes.as_chunks::<4>();
        let [_, length, crc, id, _] = *words else { return None };
        let [length, crc, id] = [length, crc, id].map(u32::from_le_bytes);
        let seal = Self { length, crc, id };
        (seal.bytes() == *bytes).then_some(seal)
    }

    pub(crate) fn bytes(&self) -> [u8; SEAL] {
        let mut out = [0; SEAL];
        let mut digest = CRC32.digest();
        let (words, _) = out.as_chunks_mut::<4>();
        for (to, word) in words.iter_mut().zip([SEALED, self.length, self.crc, self.id]) {
            *to = word.to_le_bytes();
            digest.update(to);
        }
        if let Some(last) = words.last_mut() {
            *last = digest.finalize().to_le_bytes();
        }
        out
    }
}

/// What the journal says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// What runs is confirmed, or was flashed by a probe.
    Steady,
    /// The staged image is to be installed at the next boot.
    Wanted,
    /// What runs was installed and has been booted so many times without a finished control step.
    Trial(u8),
    /// The image before is to be put back at the next boot.
    Restoring,
    /// It was put back.
    RolledBack,
}

impl State {
    pub(crate) const fn note(self) -> u8 {
        match self {
            Self::Steady => 0,
            Self::Wanted => 1,
            Self::Restoring => 2,
            Self::RolledBack => 3,
            Self::Trial(boots) => 0x10 | boots & 0x0f,
        }
    }

    pub(crate) const fn of(note: u8) -> Self {
        match note {
            1 => Self::Wanted,
            2 => Self::Restoring,
            3 => Self::RolledBack,
            0x10..=0x1f => Self::Trial(note & 0x0f),
            _ => Self::Steady,
        }
    }
}
