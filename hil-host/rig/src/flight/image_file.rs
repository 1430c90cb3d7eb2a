//! An image of the firmware as it is uploaded: the bytes of its slot, out of its ELF.

use super::file_kinds::{Kind, expect};
use super::image_lines::ImageLines;
use anyhow::{Context as _, ensure};
use logs::record::bounded;
use object::{Object as _, ObjectSegment as _};
use signals::WIRE_VERSION;
use std::path::Path;
use store::image::{BOARD, FACTS, Facts, HEADER, RUNS_AT};

/// Bytes of a slot.
const SLOT: usize = 256 * 1024;

/// An image.
#[derive(Clone, Debug)]
pub struct ImageFile {
    /// What it says of itself, its identity written in.
    pub facts: Facts,
    /// As it is uploaded.
    pub bytes: Vec<u8>,
}

impl ImageFile {
    /// Reads an ELF.
    ///
    /// # Errors
    /// Not one of this board, in words with the fix.
    pub fn read(elf: &Path) -> anyhow::Result<Self> {
        let name = elf.display();
        expect(elf, Kind::Image)?;
        let id = ImageLines::read(elf)?.id;
        let raw = bounded::bytes(elf, bounded::LOG)
            .with_context(|| format!("{name}: cannot read this image; scripts/build-firmware makes one"))?;
        let file = object::File::parse(&*raw).with_context(|| format!("{name}: not an ELF image; scripts/build-firmware makes one"))?;
        let mut segments = Vec::new();
        for program in file.segments() {
            let data = program.data().with_context(|| format!("{name}: a segment is cut; build it again"))?;
            // Initial values lie behind the code in flash, wherever they go in RAM.
            let at = physical(&raw, program.file_range().0).unwrap_or(program.address());
            if let Some(at) = at.checked_sub(u64::from(RUNS_AT)).map(|at| at as usize).filter(|at| *at < SLOT && !data.is_empty()) {
                segments.push((at, data));
            }
        }
        Self::of(&segments, id).with_context(|| format!("{name}: no image for this board's slot; build it with scripts/build-firmware"))
    }

    /// From the pieces of a slot and the identity.
    fn of(segments: &[(usize, &[u8])], id: u32) -> anyhow::Result<Self> {
        let end = segments.iter().map(|(at, data)| at + data.len()).max().unwrap_or(0);
        ensure!(end > HEADER as usize, "nothing lies at {RUNS_AT:#010x}: an image without the boot loader's slots");
        ensure!(end <= SLOT, "it takes {end} bytes, a slot has {SLOT}");
        let mut bytes = vec![0xff; end];
        for (at, data) in segments {
            bytes[*at..at + data.len()].copy_from_slice(data);
        }
        let facts = Facts::read(&bytes).context("it does not say what it is")?;
        ensure!(facts.board == BOARD, "it is for the board {}", String::from_utf8_lossy(&facts.board));
        let length = facts.length as usize;
        ensure!((HEADER as usize + 8..=SLOT).contains(&length) && length >= end, "it says {length} bytes and has {end}");
        bytes.resize(length, 0xff);
        let facts = Facts { id, ..facts };
        bytes[..FACTS].copy_from_slice(&facts.bytes());
        Ok(Self { facts, bytes })
    }

    /// Refused without leave: after the restart this program could not speak with the board.
    ///
    /// # Errors
    /// Another wire version.
    pub fn speaks_this_wire(&self) -> anyhow::Result<()> {
        let theirs = self.facts.wire;
        ensure!(
            theirs == WIRE_VERSION,
            "the image speaks wire version {theirs}, this program version {WIRE_VERSION}: use the glider of the image's release, or --force"
        );
        Ok(())
    }
}

/// Physical address of the program header (ELF32, little endian) whose bytes begin at this place of the file.
fn physical(raw: &[u8], offset: u64) -> Option<u64> {
    let word = |at: usize| raw.get(at..at + 4).and_then(|b| Some(u64::from(u32::from_le_bytes(b.try_into().ok()?))));
    let half = |at: usize| raw.get(at..at + 2).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])));
    let (first, size, count) = (word(28)? as usize, half(42)?, half(44)?);
    (0..count)
        .map(|n| first + n * size)
        .find(|at| word(*at) == Some(1) && word(at + 4) == Some(offset) && word(at + 16) != Some(0))
        .and_then(|at| word(at + 12))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(facts: &Facts) -> Vec<u8> {
        facts.bytes().to_vec()
    }

    #[test]
    fn an_image_is_put_together_and_what_is_none_is_named() {
        let facts = Facts { board: BOARD, length: 700, firmware: [0, 1, 0], wire: WIRE_VERSION, id: 0 };
        let (head, code) = (header(&facts), vec![7; 180]);
        let image = ImageFile::of(&[(0, &head), (512, &code)], 0xabcd).expect("an image");
        assert_eq!((image.bytes.len(), image.facts.id, image.bytes[100], image.bytes[512], image.bytes[699]), (700, 0xabcd, 0xff, 7, 0xff));
        assert!(image.speaks_this_wire().is_ok());
        for (facts, words) in [
            (Facts { board: *b"OTHER001", ..facts }, "it is for the board OTHER001"),
            (Facts { length: 600, ..facts }, "it says 600 bytes and has 692"),
            (Facts { length: 1 << 20, ..facts }, "it says 1048576 bytes"),
        ] {
            let why = ImageFile::of(&[(0, &header(&facts)), (512, &code)], 0).expect_err(words).to_string();
            assert!(why.contains(words), "{why}");
        }
        let why = |segments: &[(usize, &[u8])]| ImageFile::of(segments, 0).expect_err("none").to_string();
        assert!(why(&[]).contains("without the boot loader's slots"));
        assert!(why(&[(0, &[0; 40]), (512, &code)]).contains("does not say what it is"));
        assert!(why(&[(SLOT - 10, &code)]).contains("a slot has 262144"));
        let other = ImageFile { facts: Facts { wire: 3, ..facts }, bytes: vec![] }.speaks_this_wire().expect_err("another wire");
        assert!(other.to_string().contains("wire version 3"));
    }
}
