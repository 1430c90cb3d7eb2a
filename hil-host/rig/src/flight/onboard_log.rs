//! The flight log on the board's flash: read over the line, decoded here by
//! the board's own code, written as flights of the project's one format.
//!
//! The board only hands out bytes of the part. Which ones are worth having is
//! found here: sectors carry rising sequence numbers, so a dozen headers tell
//! where the log ends, and it is read backwards from there. Each control cycle
//! begins with its UTC, so that of a range of time only its own sectors are
//! read, and a dozen beginnings of others. At 115,200 baud a sector (about 20
//! control cycles) takes half a second.

use super::utc::iso;
use crate::flight::log::{Measured, Truth, Writer};
use crate::seats::{Link, SeatError, Wire, link};
use anyhow::{Context, bail};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use serde_json::json;
use signals::{Object, Refusal, ToBoard, ToHost, Utc};
use std::path::{Path, PathBuf};
use store::ring;

/// Erase sector of the log flash, bytes (W25Q128JV).
const SECTOR: usize = 4096;
/// No log flash is larger, bytes: four times the part of the board.
const LARGEST: usize = 64 << 20;
/// A gap between two cycles that ends a flight, s: the longest patience of the mission at the surface, doubled.
const GAP_S: f64 = 1800.0;
/// Sectors without a header that are looked past: bad ones, or the one being erased.
const BAD: usize = 3;
/// Density and gravity of the board's conversion from pressure to depth (devices::pressure), kg/m³ and m/s².
const DEPTH_TO_PA: f64 = 1027.0 * 9.80665;

/// Sectors looked into for one whose time is known.
const UNDATED: usize = 4;
pub use helm::vault::Logged;

/// What of a log is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// So many sectors at most, the newest.
    pub sectors: usize,
    /// From and to, UTC, ms since 1970.
    pub from_ms: Option<u64>,
    /// See above.
    pub to_ms: Option<u64>,
}

impl Wanted {
    /// The newest sectors.
    #[must_use]
    pub const fn newest(sectors: usize) -> Self {
        Self { sectors, from_ms: None, to_ms: None }
    }

    /// All there is.
    pub const ALL: Self = Self::newest(usize::MAX);

    const fn is_dated(&self) -> bool {
        self.from_ms.is_some() || self.to_ms.is_some()
    }

    fn holds(&self, utc: Utc) -> bool {
        self.from_ms.is_none_or(|from| utc.ms >= from) && self.to_ms.is_none_or(|to| utc.ms <= to)
    }
}

/// What was read of a log.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Control cycles, oldest first.
    pub cycles: Vec<Logged>,
    /// Cycles left out of a range of time because theirs is unknown.
    pub undated: usize,
    /// Sectors read whole.
    pub sectors: usize,
}

/// Bytes of a part that were read, the rest as erased.
struct Copy(Vec<u8>);

/// Out of the part; the copy takes no writes.
#[derive(Debug)]
struct Outside;

impl NorFlashError for Outside {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::OutOfBounds
    }
}

impl ErrorType for Copy {
    type Error = Outside;
}

impl ReadNorFlash for Copy {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Outside> {
        let at = offset as usize;
        bytes.copy_from_slice(self.0.get(at..at + bytes.len()).ok_or(Outside)?);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Copy {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, _: u32, _: u32) -> Result<(), Outside> {
        Err(Outside)
    }
    fn write(&mut self, _: u32, _: &[u8]) -> Result<(), Outside> {
        Err(Outside)
    }
}

/// The log area of a board, as far as it was read.
struct Remote<'a, W> {
    link: &'a mut Link<W>,
    copy: Copy,
}

impl<W: Wire> Remote<'_, W> {
    /// Reads one piece; returns the length of the whole log and of the piece.
    fn piece(&mut self, at: usize) -> Result<(usize, usize), SeatError> {
        const WHAT: &str = "the flight log";
        let offset = at as u32;
        let (length, data) = self.link.request(WHAT, &ToBoard::ReadBack { object: Object::Log, offset }, |answer| match answer {
            ToHost::Content { offset: o, length, data } if o == offset || data.is_empty() => Some(Ok((length as usize, data))),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: WHAT, why })),
            _ => None,
        })??;
        if self.copy.0.len() != length && length <= LARGEST {
            self.copy.0.resize(length, 0xff);
        }
        if let Some(to) = self.copy.0.get_mut(at..at + data.len()) {
            to.copy_from_slice(&data);
        }
        Ok((length, data.len()))
    }

    /// Sequence number of a sector, none without a header.
    fn sequence(&mut self, sector: usize) -> Result<Option<u32>, SeatError> {
        let at = sector * SECTOR;
        self.piece(at)?;
        Ok(self.copy.0.get(at..at + ring::SECTOR_HEADER_BYTES).and_then(ring::sequence))
    }

    /// UTC of the first control cycle of a sector, if its first bytes hold it.
    fn utc(&mut self, sector: usize) -> Result<Option<u64>, SeatError> {
        self.piece(sector * SECTOR)?;
        let bytes = self.copy.0.get(sector * SECTOR..(sector + 1) * SECTOR).unwrap_or_default();
        Ok(first_utc(bytes))
    }

    /// Of sectors from the newest to the oldest: how many of the first begin after this moment. Where times are unknown none is
    /// passed over.
    fn after(&mut self, order: &[usize], to_ms: u64) -> Result<usize, SeatError> {
        let (mut newer, mut end) = (0, order.len());
        while newer < end {
            let middle = newer + (end - newer) / 2;
            let mut utc = None;
            for sector in order.get(middle..end.min(middle + UNDATED)).unwrap_or_default() {
                utc = self.utc(*sector)?;
                if utc.is_some() {
                    break;
                }
            }
            match utc {
                Some(utc) if utc > to_ms => newer = middle + 1,
                _ => end = middle,
            }
        }
        Ok(newer)
    }

    /// The first of this sector and the [`BAD`] after it that has a header.
    fn near(&mut self, sector: usize, sectors: usize) -> Result<Option<(usize, u32)>, SeatError> {
        for s in sector..sectors.min(sector + 1 + BAD) {
            if let Some(sequence) = self.sequence(s)? {
                return Ok(Some((s, sequence)));
            }
        }
        Ok(None)
    }

    /// Reads a whole sector.
    fn sector(&mut self, sector: usize) -> Result<(), SeatError> {
        let (mut at, end) = (sector * SECTOR, (sector + 1) * SECTOR);
        while at < end {
            let (_, n) = self.piece(at)?;
            if n == 0 {
                return Err(SeatError::Refused { asked: "the flight log", why: Refusal::Storage });
            }
            at += n;
        }
        Ok(())
    }
}

/// UTC of the first control cycle at the beginning of a sector.
fn first_utc(sector: &[u8]) -> Option<u64> {
    let mut at = ring::SECTOR_HEADER_BYTES;
    loop {
        let [lo, hi, kind, ..] = *sector.get(at..)?.first_chunk::<{ ring::ENTRY_HEADER }>()?;
        let data = sector.get(at + ring::ENTRY_HEADER..)?;
        match kind {
            helm::vault::CYCLE => return postcard::take_from_bytes::<Option<Utc>>(data).ok()?.0.map(|utc| utc.ms),
            ring::NOTE => at += ring::ENTRY_HEADER + usize::from(u16::from_le_bytes([lo, hi])),
            _ => return None,
        }
    }
}

/// Reads what is wanted of the log. `progress` is called with the sectors read so far.
///
/// # Errors
/// Line lost, or a board without a log.
pub fn read<W: Wire>(board: &mut Link<W>, wanted: &Wanted, mut progress: impl FnMut(usize)) -> anyhow::Result<Found> {
    let name = link::Wire::describe(board.wire());
    let mut remote = Remote { link: board, copy: Copy(Vec::new()) };
    let (length, _) = remote.piece(0)?;
    if length < 2 * SECTOR {
        bail!("{name}: this board keeps no flight log (no log flash answers)");
    }
    if length > LARGEST {
        bail!("{name}: says that its flight log has {length} bytes, more than any flash; is it a board of this release?");
    }
    let all = length / SECTOR;
    let Some((first, oldest)) = remote.near(0, all)? else { return Ok(Found::default()) };
    // Sequence numbers rise up to the newest sector; behind it lies what is erased, or the lap before.
    let (mut newest, mut beyond) = (first, all);
    while beyond - newest > 1 {
        let middle = newest + (beyond - newest) / 2;
        match remote.near(middle, beyond)? {
            Some((at, sequence)) if sequence >= oldest => newest = at,
            _ => beyond = middle,
        }
    }
    let mut found = Found::default();
    let backwards: Vec<usize> = (0..all).map(|i| (newest + all - i) % all).collect();
    let skipped = wanted.to_ms.map_or(Ok(0), |to_ms| remote.after(&backwards, to_ms))?;
    let (mut missed, mut last) = (0, u32::MAX);
    for at in backwards.into_iter().skip(skipped) {
        if found.sectors >= wanted.sectors || missed > BAD {
            break;
        }
        match remote.sequence(at)? {
            Some(sequence) if sequence < last => {
                remote.sector(at)?;
                (last, missed) = (sequence, 0);
                found.sectors += 1;
                progress(found.sectors);
                // What lies before it is older.
                if wanted.from_ms.is_some_and(|from| remote.utc(at).is_ok_and(|utc| utc.is_some_and(|utc| utc < from))) {
                    break;
                }
            }
            Some(_) => break,
            None => missed += 1,
        }
    }
    let mut copy = remote.copy;
    let decoded = ring::Ring::mount(&mut copy, 0).and_then(|ring| {
        ring.read(&mut copy, |kind, data| {
            if kind == helm::vault::CYCLE
                && let Ok((cycle, [])) = postcard::take_from_bytes::<Logged>(data)
            {
                match cycle.0 {
                    Some(utc) if wanted.is_dated() && !wanted.holds(utc) => {}
                    None if wanted.is_dated() => found.undated += 1,
                    _ => found.cycles.push(cycle),
                }
            }
        })
    });
    decoded.map_err(|e| anyhow::anyhow!("{name}: the log cannot be decoded: {e:?}"))?;
    Ok(found)
}

/// Flights of a log: time that jumps back or far ahead starts a new one.
#[must_use]
pub fn flights(cycles: &[Logged]) -> Vec<&[Logged]> {
    let seconds = |c: &Logged| c.1.time.0 as f64 * 1e-6;
    cycles.chunk_by(|a, b| (0.0..GAP_S).contains(&(seconds(b) - seconds(a))) && b.1.time > a.1.time).collect()
}

/// Writes the flights of a log below a directory, each in one of its own; returns where.
///
/// # Errors
/// A flight is there already, or the disk is full.
pub fn write(cycles: &[Logged], below: &Path, board: &str) -> anyhow::Result<Vec<PathBuf>> {
    let nothing = Truth {
        depth_m: f64::NAN,
        east_m: f64::NAN,
        north_m: f64::NAN,
        pitch_rad: f64::NAN,
        alpha_rad: f64::NAN,
        speed_m_s: f64::NAN,
        glide_angle_rad: f64::NAN,
        ballast_m3: f64::NAN,
        battery_mass_m: f64::NAN,
        energy_j: f64::NAN,
    };
    let mut written = Vec::new();
    for (i, flight) in flights(cycles).into_iter().enumerate() {
        let directory = below.join(format!("flight_{}", i + 1));
        let vehicle = json!({ "format": "glider-trial/1", "case": format!("flight_{}", i + 1), "simulated": false,
            "source": format!("flight log of the {board}; give the vehicle with --vehicle"), "tool": env!("CARGO_PKG_VERSION") });
        let mut log = Writer::create(&directory, vehicle, "# the board's log does not hold its mission\n")?;
        let start = flight.first().map_or(0, |c| c.1.time.0);
        for (utc, f, answer) in flight {
            let time_s = (f.time.0 - start) as f64 * 1e-6;
            let measured = Measured { utc: *utc, ..Measured::of(time_s, f, DEPTH_TO_PA) };
            log.push(&measured, f, answer, &nothing)?;
        }
        written.push(log.finish(summary(flight)).with_context(|| directory.display().to_string())?);
    }
    Ok(written)
}

fn summary(flight: &[Logged]) -> serde_json::Value {
    let mut dates = flight.iter().filter_map(|c| c.0.map(|utc| iso(utc.ms)));
    let first = dates.next();
    json!({ "cycles": flight.len(), "first_utc": first, "last_utc": dates.next_back().or_else(|| first.clone()) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use signals::link::MAX_WIRE;
    use signals::{Receiver, Reply, Request, encode};
    use std::time::Duration;

    /// A board that says its log has so many bytes, and has none.
    struct Claims(u32, Receiver, Vec<u8>);

    impl Wire for Claims {
        fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
            for byte in bytes {
                if let Some(Ok(Request { id, .. })) = self.1.push::<Request>(*byte) {
                    let message = ToHost::Content { offset: 0, length: self.0, data: heapless::Vec::new() };
                    let mut wire = [0; MAX_WIRE];
                    let n = encode(&Reply { to: id, message }, &mut wire).expect("fits");
                    self.2.extend(&wire[..n]);
                }
            }
            Ok(())
        }
        fn receive(&mut self, into: &mut [u8], _: Duration) -> std::io::Result<usize> {
            let n = into.len().min(self.2.len());
            into[..n].copy_from_slice(&self.2.drain(..n).collect::<Vec<u8>>());
            Ok(n)
        }
        fn describe(&self) -> String {
            "a board".into()
        }
    }

    /// It took 4 GB of memory, all of it erased flash.
    #[test]
    fn regress_a_board_that_claims_a_log_of_4_gb_is_refused() {
        for length in [u32::MAX, LARGEST as u32 + 1] {
            let mut link = Link::new(Claims(length, Receiver::new(), Vec::new()));
            let said = read(&mut link, &Wanted::ALL, |_| {}).expect_err("refused").to_string();
            assert!(said.starts_with("a board: says that its flight log has") && said.contains(&length.to_string()), "{said}");
        }
    }
}
