//! The board's own log (defmt): bytes and the image they came from → lines.

use anyhow::Context;
use defmt_decoder::{DecodeError, StreamDecoder, Table};
use logs::record::bounded;
use std::path::Path;

/// The strings of one image.
pub struct Image {
    table: Table,
}

/// Decodes a stream of log bytes.
pub struct Stream<'t> {
    decoder: Box<dyn StreamDecoder + Send + Sync + 't>,
    can_recover: bool,
    /// Frames that could not be read.
    pub damaged: u64,
}

impl Image {
    /// Reads the strings of an image.
    ///
    /// # Errors
    /// Not an image, or one without a log.
    pub fn read(elf: &Path) -> anyhow::Result<Self> {
        let bytes = bounded::bytes(elf, bounded::LOG).with_context(|| format!("{}: cannot read this image", elf.display()))?;
        let table = Table::parse(&bytes)
            .map_err(|e| anyhow::anyhow!("{}: not an image with a log this tool can decode ({e:#})", elf.display()))?
            .with_context(|| format!("{}: this image has no defmt log", elf.display()))?;
        Ok(Self { table })
    }

    /// Starts decoding.
    #[must_use]
    pub fn stream(&self) -> Stream<'_> {
        Stream { decoder: self.table.new_stream_decoder(), can_recover: self.table.encoding().can_recover(), damaged: 0 }
    }
}

impl Stream<'_> {
    /// Takes bytes and hands every complete line to `line`.
    pub fn take(&mut self, bytes: &[u8], mut line: impl FnMut(String)) {
        self.decoder.received(bytes);
        loop {
            match self.decoder.decode() {
                Ok(frame) => {
                    let time = frame.display_timestamp().map(|t| format!("{t} ")).unwrap_or_default();
                    let level = frame.level().map(|l| format!("{} ", l.as_str().to_uppercase())).unwrap_or_default();
                    line(format!("{time}{level}{}", frame.display_message()));
                }
                Err(DecodeError::UnexpectedEof) => return,
                Err(DecodeError::Malformed) => {
                    self.damaged += 1;
                    if !self.can_recover {
                        return;
                    }
                }
            }
        }
    }
}
