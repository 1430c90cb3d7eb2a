//! The serial line's bytes.
//!
//! A frame on the wire is `COBS( version ‖ postcard(message) ‖ crc32 ) ‖ 0x00`;
//! the message is a [`Request`](crate::Request) to the board or a [`Reply`](crate::Reply) to the host.
//! The CRC-32 (ISO-HDLC, little endian) covers version and message; COBS keeps
//! 0x00 for the delimiter, so after any damage the next delimiter re-syncs and
//! at most one good frame is lost per damage. Lengths are bounded by
//! [`MAX_FRAME`]; a longer run of bytes is dropped up to its delimiter.

use crate::messages::Counters;
use serde::{Serialize, de::DeserializeOwned};

/// Version of the wire: messages, framing and meaning. A board with another
/// one is refused by name instead of misread.
pub const WIRE_VERSION: u8 = 9;
/// Longest frame before COBS, bytes.
pub const MAX_FRAME: usize = 384;
/// Longest frame on the wire, bytes: COBS adds 1 in 254, and the delimiter.
pub const MAX_WIRE: usize = MAX_FRAME + MAX_FRAME / 254 + 2;

/// CRC-32/ISO-HDLC, the polynomial of Ethernet and zip.
pub const CRC32: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WireError {
    /// Not COBS, too long or too short.
    Framing,
    /// CRC does not match.
    Crc,
    /// The other side speaks this version.
    Version(u8),
    /// CRC right, but not a message of this version.
    Content,
    /// Message does not fit a frame.
    TooLong,
}

/// Writes one message with its delimiter; returns the bytes used.
///
/// # Errors
/// [`WireError::TooLong`] if it does not fit.
pub fn encode<M: Serialize>(message: &M, out: &mut [u8; MAX_WIRE]) -> Result<usize, WireError> {
    let mut raw = [0u8; MAX_FRAME];
    let body = raw.get_mut(1..MAX_FRAME - 4).ok_or(WireError::TooLong)?;
    let used = postcard::to_slice(message, body).map_err(|_| WireError::TooLong)?.len().wrapping_add(1); // at most MAX_FRAME
    if let Some(first) = raw.first_mut() {
        *first = WIRE_VERSION;
    }
    let crc = CRC32.checksum(raw.get(..used).ok_or(WireError::TooLong)?);
    let end = used.wrapping_add(4);
    raw.get_mut(used..end).ok_or(WireError::TooLong)?.copy_from_slice(&crc.to_le_bytes());
    cobs_encode(raw.get(..end).ok_or(WireError::TooLong)?, out).ok_or(WireError::TooLong)
}

/// Reads one message from the bytes between two delimiters (delimiter excluded).
/// The bytes are decoded in place.
///
/// # Errors
/// Says which layer refused it.
pub fn decode<M: DeserializeOwned>(wire: &mut [u8]) -> Result<M, WireError> {
    let raw = cobs_decode(wire).ok_or(WireError::Framing)?;
    let (body, tail) = raw.split_last_chunk::<4>().ok_or(WireError::Framing)?;
    if CRC32.checksum(body) != u32::from_le_bytes(*tail) {
        return Err(WireError::Crc);
    }
    let (version, message) = body.split_first().ok_or(WireError::Framing)?;
    if *version != WIRE_VERSION {
        return Err(WireError::Version(*version));
    }
    match postcard::take_from_bytes::<M>(message) {
        Ok((m, [])) => Ok(m),
        _ => Err(WireError::Content),
    }
}

/// COBS encode with the trailing zero. Own code because the `cobs` crate's
/// encoder keeps panic paths; a test holds the two against each other.
fn cobs_encode(data: &[u8], out: &mut [u8]) -> Option<usize> {
    let mut code_at = 0usize;
    let mut code = 1u8;
    let mut at = 1usize;
    for &byte in data {
        if byte != 0 {
            *out.get_mut(at)? = byte;
            at = at.checked_add(1)?;
            code = code.wrapping_add(1);
        }
        if byte == 0 || code == 0xff {
            *out.get_mut(code_at)? = code;
            code_at = at;
            code = 1;
            at = at.checked_add(1)?;
        }
    }
    *out.get_mut(code_at)? = code;
    *out.get_mut(at)? = 0;
    at.checked_add(1)
}

/// COBS decode in place; `None` if the bytes are not COBS.
fn cobs_decode(buf: &mut [u8]) -> Option<&[u8]> {
    let (mut read, mut write) = (0usize, 0usize);
    let len = buf.len();
    while read < len {
        let code = usize::from(*buf.get(read)?);
        if code == 0 || read.checked_add(code)? > len {
            return None;
        }
        for i in 1..code {
            let byte = *buf.get(read + i)?;
            if byte == 0 {
                return None;
            }
            *buf.get_mut(write)? = byte;
            write += 1;
        }
        read += code;
        if code != 0xff && read < len {
            *buf.get_mut(write)? = 0;
            write += 1;
        }
    }
    buf.get(..write)
}

/// Assembles bytes into messages. Bounded memory, bounded work per byte; no value of its fields, not one that a flipped bit left,
/// makes it read or write outside its buffer.
#[derive(Clone, Debug)]
pub struct Receiver {
    buffer: [u8; MAX_WIRE],
    /// Bytes of the frame so far; more than fit: it is dropped up to the next delimiter.
    used: usize,
    /// What was seen so far.
    pub counters: Counters,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// Nothing received.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffer: [0; MAX_WIRE],
            used: 0,
            counters: Counters { accepted: 0, damaged: 0, version: 0, unknown: 0, overflow: 0, repeated: 0, stale: 0 },
        }
    }

    /// Takes one byte; returns a message, or why a whole frame was refused,
    /// when the byte completes one.
    pub fn push<M: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<M, WireError>> {
        if byte != 0 {
            match self.buffer.get_mut(self.used) {
                Some(place) => {
                    *place = byte;
                    self.used = self.used.saturating_add(1);
                }
                None => {
                    self.used = usize::MAX;
                    self.counters.overflow = self.counters.overflow.saturating_add(1);
                }
            }
            return None;
        }
        let used = core::mem::take(&mut self.used);
        if used == 0 {
            return None; // idle delimiters are free
        }
        let result = self.buffer.get_mut(..used).map_or(Err(WireError::Framing), decode);
        let counter = match result {
            Ok(_) => &mut self.counters.accepted,
            Err(WireError::Version(_)) => &mut self.counters.version,
            Err(WireError::Content) => &mut self.counters.unknown,
            Err(_) => &mut self.counters.damaged,
        };
        *counter = counter.saturating_add(1);
        Some(result)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Reading, SensorFrame};
    use crate::messages::{CHUNK, Reply, Request, ToBoard, ToHost};
    use crate::mission::Mission;
    use crate::time::Micros;
    use heapless::Vec;

    fn sample() -> ToBoard {
        ToBoard::Sensor(SensorFrame {
            seq: 7,
            time: Micros::from_secs(4),
            depth_m: Reading::now(12.5),
            pitch_rad: Reading::Sampled { value: -0.3, age_ms: 40 },
            ..SensorFrame::default()
        })
    }

    fn feed(receiver: &mut Receiver, bytes: &[u8]) -> std::vec::Vec<Result<ToBoard, WireError>> {
        bytes.iter().filter_map(|b| receiver.push(*b)).collect()
    }

    #[test]
    fn prop_decode_undoes_encode() {
        let mut wire = [0; MAX_WIRE];
        let n = encode(&sample(), &mut wire).unwrap();
        assert_eq!(wire[n - 1], 0);
        assert!(!wire[..n - 1].contains(&0));
        assert_eq!(decode::<ToBoard>(&mut wire[..n - 1]), Ok(sample()));
    }

    /// A frame of this version with its CRC right and any content.
    fn sealed(content: &[u8]) -> std::vec::Vec<u8> {
        let mut raw = std::vec![WIRE_VERSION];
        raw.extend_from_slice(content);
        let crc = CRC32.checksum(&raw);
        raw.extend_from_slice(&crc.to_le_bytes());
        let mut wire = [0; MAX_WIRE];
        let n = cobs_encode(&raw, &mut wire).unwrap();
        wire[..n - 1].to_vec()
    }

    /// Both directions, all 65,793 contents of up to two bytes: no panic, and what is a message is the same message when it is sent on.
    #[test]
    fn prop_every_content_of_two_bytes_is_refused_or_a_message() {
        fn check<M: DeserializeOwned + Serialize + PartialEq + core::fmt::Debug>(content: &[u8]) -> bool {
            match decode::<M>(&mut sealed(content)) {
                Ok(message) => {
                    let mut wire = [0; MAX_WIRE];
                    let n = encode(&message, &mut wire).unwrap();
                    assert_eq!(decode::<M>(&mut wire[..n - 1]).as_ref(), Ok(&message), "{content:?}");
                    true
                }
                Err(e) => {
                    assert_eq!(e, WireError::Content, "{content:?}");
                    false
                }
            }
        }
        let one = (0..=u8::MAX).map(|a| std::vec![a]);
        let two = (0..=u16::MAX).map(|ab| ab.to_le_bytes().to_vec());
        let all: std::vec::Vec<_> = core::iter::once(std::vec![]).chain(one).chain(two).collect();
        let read = |of: fn(&[u8]) -> bool| all.iter().filter(|content| of(content)).count();
        let (board, host) = (read(check::<ToBoard>), read(check::<ToHost>));
        assert!(board > 0 && host > 0 && board + host < all.len() / 10, "{board} and {host} of {}", all.len());
    }

    #[test]
    fn validate_cobs_agrees_with_the_cobs_crate() {
        let mut seed = 1u32;
        for len in 0..600usize {
            let data: std::vec::Vec<u8> = (0..len)
                .map(|_| {
                    seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    // Every other one without a zero: groups of all 254 bytes.
                    if len % 2 == 1 { (seed >> 16) as u8 | 1 } else { (seed >> 16) as u8 * u8::from(seed >> 28 != 0) }
                })
                .collect();
            let mut ours = [0u8; 700];
            let n = cobs_encode(&data, &mut ours).unwrap();
            let mut theirs = [0u8; 700];
            let m = cobs::encode(&data, &mut theirs);
            // The crate leaves out a closing empty group after exactly 254 bytes; both decode alike.
            let mut check = [0u8; 700];
            let k = cobs::decode(&ours[..n - 1], &mut check).unwrap().frame_size();
            assert_eq!(&check[..k], &data[..], "len {len}");
            assert_eq!(cobs_decode(&mut theirs[..m]).unwrap(), &data[..], "len {len}");
            assert_eq!(cobs_decode(&mut ours[..n - 1]).unwrap(), &data[..], "len {len}");
        }
        for bad in [[0, 1, 1], [3, 0, 1], [1, 3, 1]] {
            assert_eq!(cobs_decode(&mut bad.clone()), None, "{bad:?}");
        }
    }

    #[test]
    fn every_single_bit_flip_is_refused_and_the_next_frame_is_read() {
        let mut wire = [0; MAX_WIRE];
        let n = encode(&sample(), &mut wire).unwrap();
        for bit in 0..8 * (n - 1) {
            let mut stream = wire[..n].to_vec();
            stream[bit / 8] ^= 1 << (bit % 8);
            stream.extend_from_slice(&wire[..n]);
            stream.extend_from_slice(&wire[..n]);
            let got = feed(&mut Receiver::new(), &stream);
            let good = got.iter().filter(|r| **r == Ok(sample())).count();
            // A flip that makes a delimiter splits the frame; one that unmakes none: the two that follow stand.
            assert_eq!(good, 2, "bit {bit}: {got:?}");
        }
    }

    #[test]
    fn a_lost_delimiter_costs_one_good_frame() {
        let mut wire = [0; MAX_WIRE];
        let n = encode(&sample(), &mut wire).unwrap();
        let mut stream = wire[..n - 1].to_vec();
        stream.extend_from_slice(&wire[..n]);
        stream.extend_from_slice(&wire[..n]);
        let good = feed(&mut Receiver::new(), &stream).iter().filter(|r| r.is_ok()).count();
        assert_eq!(good, 1);
    }

    #[test]
    fn an_endless_frame_is_dropped_and_counted() {
        let mut receiver = Receiver::new();
        assert!(feed(&mut receiver, &[7; 5000]).is_empty());
        assert_eq!(feed(&mut receiver, &[0]), [Err(WireError::Framing)]);
        assert_eq!(receiver.counters.damaged, 1);
        assert!(receiver.counters.overflow > 0);
    }

    #[test]
    fn another_wire_version_is_named() {
        let mut raw = [0u8; 64];
        raw[0] = WIRE_VERSION + 1;
        raw[1] = 9;
        let crc = CRC32.checksum(&raw[..2]);
        raw[2..6].copy_from_slice(&crc.to_le_bytes());
        let mut wire = [0u8; MAX_WIRE];
        let n = cobs_encode(&raw[..6], &mut wire).unwrap();
        assert_eq!(decode::<ToBoard>(&mut wire[..n - 1]), Err(WireError::Version(WIRE_VERSION + 1)));
    }

    #[test]
    fn the_longest_messages_fit() {
        let mut wire = [0; MAX_WIRE];
        let mut mission = Mission::default();
        while mission.legs.push(crate::Leg { goal: crate::Goal::FixedPitch { pitch_rad: 0.4 }, ..Default::default() }).is_ok() {}
        let ask = |message| Request { session: u32::MAX, id: u16::MAX, message };
        encode(&ask(ToBoard::Begin(mission)), &mut wire).unwrap();
        let mut data = Vec::new();
        data.resize(CHUNK, 0xff).unwrap();
        let message = ToHost::Content { offset: u32::MAX, length: u32::MAX, data };
        encode(&Reply { to: u16::MAX, message }, &mut wire).unwrap();
        let s = Reading::Sampled { value: f32::MIN, age_ms: u32::MAX };
        let frame = SensorFrame {
            seq: u32::MAX,
            time: Micros(u64::MAX),
            depth_m: s,
            depth2_m: s,
            pitch_rad: s,
            roll_rad: s,
            heading_rad: s,
            ballast_m3: s,
            battery_mass_m: s,
            fin_rad: s,
            density_kg_m3: s,
            temperature_degc: s,
            altitude_m: s,
            battery_v: s,
            charge: s,
            vacuum_pa: s,
            ..Default::default()
        };
        let n = encode(&ask(ToBoard::Sensor(frame)), &mut wire).unwrap();
        assert!(n < 210, "a sensor frame takes {n} bytes");
    }
}
