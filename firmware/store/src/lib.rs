//! What survives a power cut: A/B slots for uploaded objects, the log ring, and the firmware's own [`image`]s.
//!
//! Both live on NOR flash behind [`embedded_storage::nor_flash::NorFlash`]:
//! bytes are programmed from ones to zeros one by one, and whole sectors are
//! erased back to ones. Power may be cut at any byte of a program and anywhere
//! in an erase. The rule of both parts: **nothing that was valid is touched
//! before what replaces it is complete**, and completeness is proved by a
//! CRC-32, never by a flag that could be half written.
//!
//! ```text
//! sector 0..2·objects   slots: A and B of each object        (one sector each)
//! the rest              ring: log, oldest sector overwritten (sequence number each)
//! ```
//!
//! The tests cut the power at every single byte.
//!
//! # Dependencies
//!
//! * `embedded-storage`: flash behind a trait
//! * `crc`: what a record is checked by
//! * `heapless`: what is read back
#![cfg_attr(not(test), no_std)]

pub mod image;
pub mod ring;
pub mod slots;

pub use ring::Ring;
pub use slots::Slots;

/// CRC-32/ISO-HDLC, as on the line.
pub(crate) const CRC32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Why flash could not serve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The part reported an error, or what was written did not read back.
    Flash,
    /// Longer than its place.
    TooLong,
    /// No such object, or the part is too small.
    Place,
}
