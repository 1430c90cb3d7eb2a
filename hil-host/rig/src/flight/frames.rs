//! `frames.bin` of a flight's folder: what the controller was given and what it answered, bit for bit, so that the flight can be
//! stepped through a law again. The rows of `flight.csv` are rounded and cannot.
//!
//! A line that says what it is, the version of the wire (the layout of a frame is the line's own), then entries: length (u16, little endian), postcard
//! bytes, their CRC-32. A flight that was cut ends with the last whole entry.

use anyhow::{Context, bail, ensure};
use control::Settings;
use logs::record::bounded;
use logs::record::csv::UNFINISHED;
use serde::{Deserialize, Serialize};
use signals::link::{CRC32, WIRE_VERSION};
use signals::{Answer, Mission, SensorFrame};
use std::io::Write;
use std::path::Path;

/// Name of the file.
pub const FRAMES: &str = "frames.bin";
const MAGIC: &[u8] = b"glider frames\n";

/// What a controller was given before its first frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Configuration.
    pub settings: Settings,
    /// Mission.
    pub mission: Mission,
    /// Uploaded flight table; empty: the one built into the controller.
    pub table: Vec<u8>,
}

/// What happened, in order.
// A flight is a list of cycles with a rare other entry among them: nothing is gained by a box.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Entry {
    /// The mission was handed over.
    Start(Start),
    /// One control cycle.
    Cycle(SensorFrame, Answer),
    /// The supply was interrupted: the controller started again.
    Reset,
}

/// First bytes of a file.
#[must_use]
pub fn head() -> Vec<u8> {
    [MAGIC, &[WIRE_VERSION]].concat()
}

/// Appends an entry.
///
/// # Errors
/// Disk full or gone.
pub fn append(file: &mut impl Write, entry: &Entry) -> anyhow::Result<()> {
    let bytes = postcard::to_stdvec(entry)?;
    let length = u16::try_from(bytes.len())?.to_le_bytes();
    file.write_all(&[&length, &bytes[..], &CRC32.checksum(&bytes).to_le_bytes()].concat())?;
    Ok(())
}

/// Reads the frames of a flight's folder, of a flight under way too, or of the file itself.
///
/// # Errors
/// No such file, one of another release, or a damaged one.
pub fn read(path: &Path) -> anyhow::Result<Vec<Entry>> {
    let file = if path.is_dir() { path.join(FRAMES) } else { path.to_owned() };
    let running = path.join(format!("{FRAMES}{UNFINISHED}"));
    let file = if path.is_dir() && !file.exists() && running.exists() { running } else { file };
    let name = file.display();
    ensure!(
        file.exists(),
        "{name}: no such file; glider fly --log DIR writes it, and glider monitor PORT --flights DIR reads it from a board's log"
    );
    let bytes = bounded::bytes(&file, bounded::LOG).with_context(|| format!("{name}: cannot read"))?;
    let Some((version, mut rest)) = bytes.strip_prefix(MAGIC).and_then(<[u8]>::split_first) else {
        bail!("{name}: no record of frames; name a folder that glider fly --log has written");
    };
    ensure!(
        *version == WIRE_VERSION,
        "{name}: recorded with frames of version {version}, and this program has version {WIRE_VERSION}: replay it with the release that flew it"
    );
    let mut entries = Vec::new();
    while let Some((length, after)) = rest.split_first_chunk::<2>() {
        let length = usize::from(u16::from_le_bytes(*length));
        let (Some(data), Some(sum)) = (after.get(..length), after.get(length..length + 4)) else { break };
        let at = bytes.len() - rest.len();
        ensure!(
            CRC32.checksum(data).to_le_bytes() == sum,
            "{name}: damaged at byte {at} (CRC); what lies before it is {} entries",
            entries.len()
        );
        entries.push(postcard::from_bytes(data).with_context(|| format!("{name}: no entry of this release at byte {at}"))?);
        rest = after.get(length + 4..).unwrap_or_default();
    }
    Ok(entries)
}
