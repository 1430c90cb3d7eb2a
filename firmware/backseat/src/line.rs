//! Which bytes are a sentence.
//!
//! ```text
//! $ body * HH CR LF        HH: XOR of the bytes of the body, two hex digits
//! ```
//! The XOR of eight bits is blind to swapped characters: what passes here is checked again by value ([`crate::readings`]).
//!
//! A line ends with CR, LF or both. Boot noise may stand before a sentence and two may stand in one line: every `$` begins anew, and what
//! reaches to the next `$` or the end is one candidate.

use crate::Unfit;

/// Longest line, bytes: a block of 725 bytes in base64 with its frame is 977.
pub const LONGEST_LINE: usize = 1024;

/// XOR of all bytes.
#[must_use]
pub fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum ^ byte)
}

/// The hex digit of the low four bits, in capitals.
pub(crate) const fn to_hex(bits: u8) -> u8 {
    match bits & 15 {
        n @ 0..=9 => b'0'.wrapping_add(n),
        n => b'A'.wrapping_add(n.wrapping_sub(10)),
    }
}

const fn hex_digit(byte: u8) -> Option<u8> {
    match byte {
        b'0'..=b'9' => Some(byte.wrapping_sub(b'0')),
        b'a'..=b'f' => Some(byte.wrapping_sub(b'a').wrapping_add(10)),
        b'A'..=b'F' => Some(byte.wrapping_sub(b'A').wrapping_add(10)),
        _ => None,
    }
}

/// The body of `body*HH`, if all of it is printable and the sum is right.
#[must_use]
pub fn open(framed: &[u8]) -> Option<&[u8]> {
    let star = framed.iter().position(|b| *b == b'*')?;
    let (body, sum) = (framed.get(..star)?, framed.get(star.saturating_add(1)..)?);
    let &[high, low] = sum else { return None };
    let said = hex_digit(high)?.wrapping_shl(4) | hex_digit(low)?;
    let printable = body.iter().all(|b| (b' '..=b'~').contains(b) && *b != b'$');
    (printable && said == checksum(body)).then_some(body)
}

/// Byte by byte: heapless' slice copy keeps an overflow check.
pub(crate) fn put<const N: usize>(bytes: &[u8], out: &mut heapless::Vec<u8, N>) -> Result<(), Unfit> {
    bytes.iter().try_for_each(|byte| out.push(*byte)).map_err(|_| Unfit)
}

/// Adds frame and line end to a body.
///
/// # Errors
/// No room.
pub fn seal<const N: usize>(body: &[u8], out: &mut heapless::Vec<u8, N>) -> Result<(), Unfit> {
    let sum = checksum(body);
    out.push(b'$').map_err(|_| Unfit)?;
    put(body, out)?;
    put(&[b'*', to_hex(sum >> 4), to_hex(sum), b'\r', b'\n'], out)
}

/// What was wrong with the line so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// Candidates without a right checksum, and lines without one.
    pub damaged: u32,
    /// Lines longer than [`LONGEST_LINE`].
    pub too_long: u32,
}

/// Collects bytes to sentences.
#[derive(Clone, Debug)]
pub struct Receiver {
    line: heapless::Vec<u8, LONGEST_LINE>,
    overflown: bool,
    /// What was wrong so far.
    pub faults: Faults,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// Nothing heard yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: heapless::Vec::new(), overflown: false, faults: Faults { damaged: 0, too_long: 0 } }
    }

    /// Takes a byte; hands the bodies of a complete line to `take`.
    pub fn push(&mut self, byte: u8, mut take: impl FnMut(&[u8])) {
        if byte != b'\r' && byte != b'\n' {
            self.overflown |= self.line.push(byte).is_err();
            return;
        }
        if self.overflown {
            self.faults.too_long = self.faults.too_long.saturating_add(1);
        } else if !self.line.is_empty() {
            let mut candidates = self.line.split(|b| *b == b'$');
            // Before the first `$` stands noise; a line of noise alone is one damaged line.
            candidates.next();
            let (mut any, mut damaged) = (false, 0u32);
            for framed in candidates {
                any = true;
                match open(framed) {
                    Some(body) => take(body),
                    None => damaged = damaged.saturating_add(1),
                }
            }
            self.faults.damaged = self.faults.damaged.saturating_add(if any { damaged } else { 1 });
        }
        self.line.clear();
        self.overflown = false;
    }
}

#[cfg(test)]
mod tests {
    use super::{LONGEST_LINE, Receiver, seal};

    fn bodies(bytes: &[u8]) -> (Vec<String>, super::Faults) {
        let (mut receiver, mut got) = (Receiver::new(), Vec::new());
        for b in bytes {
            receiver.push(*b, |body| got.push(String::from_utf8_lossy(body).into_owned()));
        }
        (got, receiver.faults)
    }

    #[test]
    fn validate_checksums_that_other_projects_print() {
        for right in ["$HI*01", "$TT*00", "$GO*08", "$FI*0F", "$SW,0:0.12,1:508.0*3B", "$SW,0:25.5*3E", "$TS,S*78", "$FI*0f"] {
            assert_eq!(bodies(format!("{right}\r\n").as_bytes()).0.len(), 1, "{right}");
        }
        for wrong in ["$TS,S*7f", "$TS,F*6a", "$SW,0:0*00"] {
            assert_eq!(bodies(format!("{wrong}\r\n").as_bytes()).0.len(), 0, "{wrong}");
        }
    }

    #[test]
    fn noise_nul_glue_and_any_line_end_are_survived() {
        let (got, faults) = bodies(b"xx$S$SD,9:42.75*12\r\n\0\0$HI*01\r$SD,9:42.75*12$SD,11:-0.3491*3D\n\r\n\n");
        assert_eq!(got, ["SD,9:42.75", "HI", "SD,9:42.75", "SD,11:-0.3491"]);
        assert_eq!(faults.damaged, 1);
        let (got, faults) = bodies(b"$SD,9:42.75*2A\r\n$SD,9:42.75\r\nnoise\r\n$SD,9:4\t2*00\r\n$HI*1\r\n$HI*011\r\n");
        assert_eq!((got.len(), faults.damaged), (0, 6));
    }

    #[test]
    fn a_line_that_never_ends_is_dropped_whole() {
        let mut bytes = vec![b'a'; LONGEST_LINE + 5];
        bytes.extend(b"$HI*01\r\n$HI*01\r\n");
        let (got, faults) = bodies(&bytes);
        assert_eq!((got.len(), faults.too_long), (1, 1));
    }

    #[test]
    fn a_sealed_body_opens() {
        let mut out = heapless::Vec::<u8, 64>::new();
        seal(b"SW,0:25.5", &mut out).expect("room");
        assert_eq!(out.as_slice(), b"$SW,0:25.5*3E\r\n");
    }
}
